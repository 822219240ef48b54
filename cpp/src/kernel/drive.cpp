// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Compiled once per instruction set, like kernel.cpp; products and sums are rounded one by one (-ffp-contract=off), so
// that all copies agree to the bit, with each other and with the same chain by itself (dynamics/servo_chain.hpp).

#include "drive.hpp"

#include <cmath>

#include "lanes.hpp"

namespace truing::kernel::TRUING_KERNEL_NAMESPACE {
namespace {

constexpr double kTurning = 0.01;   ///< [rad/s | m/s] where friction that is computed here turns round
constexpr double kSlope = 1e-5;     ///< of an effort, or [Nm]: step of the derivative of the drive's law
constexpr double kStraight = 1e-3;  ///< of the reference: below it a root is a line, or its slope has no end

const Mask kSign = Mask{} + INT64_MIN;

inline Pack size(Pack x) { return (Pack)((Mask)x & ~kSign); }
inline Pack with_sign(Pack of, Pack like) { return (Pack)(((Mask)of & ~kSign) | ((Mask)like & kSign)); }
inline Pack positive(Pack x) { return 0.0 < x ? x : Pack{}; }
inline Pack negative(Pack x) { return x < 0.0 ? x : Pack{}; }
inline Pack within(Pack x, Pack most) { return x < -most ? -most : (most < x ? most : x); }
inline bool any(Mask mask) {
  std::int64_t out = 0;
  for (int i = 0; i < kLanes; ++i) out |= mask[i];
  return out != 0;
}

/// Cosine and sine, near zero by their series, to 1e-14.
inline void turn_of(Pack x, Pack* cosine, Pack* sine) {
  const Pack y = x * x, y2 = y * y, y4 = y2 * y2;
  *cosine = (1.0 - y * (1.0 / 2.0)) + y2 * (1.0 / 24.0 - y * (1.0 / 720.0)) +
            y4 * ((1.0 / 40320.0 - y * (1.0 / 3628800.0)) + y2 * (1.0 / 479001600.0));
  *sine = x * ((1.0 - y * (1.0 / 6.0)) + y2 * (1.0 / 120.0 - y * (1.0 / 5040.0)) +
               y4 * ((1.0 / 362880.0 - y * (1.0 / 39916800.0)) + y2 * (1.0 / 6227020800.0)));
  const Mask far = size(x) > 0.5;
  if (!any(far)) return;
  for (int i = 0; i < kLanes; ++i) {
    if (!far[i]) continue;
    (*cosine)[i] = std::cos(x[i]);
    (*sine)[i] = std::sin(x[i]);
  }
}

inline double hat_sum(const DriveFunction& f, double x) {
  const double wanted = (x - f.low) / f.width, most = f.count - 1;
  const double place = wanted > 0.0 ? (wanted < most ? wanted : most) : 0.0;
  const int whole = static_cast<int>(place), left = whole < f.count - 2 ? whole : f.count - 2;
  const double part = place - left;
  return (1.0 - part) * f.values[left] + part * f.values[left + 1];
}

/// One step of some lanes. The law is that of python/truing/dynamics/servo/chain.py.
class Step {
 public:
  Step(const DriveTile& tile, int first, int number)
      : tile_(tile), first_(first), late_(2 * number), part_(static_cast<double>(number) / tile.steps) {}

  /// (I + h d) v' + h F sgn v' = I v + h (applied - bias), by implicit Coulomb friction (Moreau 1988).
  void go() {
    const double h = tile_.step;
    feel();
    command();
    torque_ = drive_torque(speed_);
    const Pack slope = has(kDriveDamped) ? speed_slope() : Pack{};
    applied_ = torque_ + slope * speed_;
    damping_ = at(DriveRow::viscous) + slope;
    act_beside();
    Pack friction = friction_level();
    if (has(kDrivePresliding)) bend(&friction);
    const Pack light = 1.0 / (heavy_ + h * damping_);
    const Pack free = (heavy_ * speed_ + h * (applied_ - against_)) * light;
    const Pack speed = with_sign(positive(size(free) - h * friction * light), free);
    keep(DriveRow::angle, angle_ + h * speed);
    keep(DriveRow::speed, speed);
    keep(DriveRow::torque, torque_);
    put(DriveRow::time, at(DriveRow::time) + h);
  }

 private:
  bool has(DriveLaws law) const { return (tile_.laws & law) != 0; }
  double* row(DriveRow which, int more = 0) const {
    return tile_.table + static_cast<std::ptrdiff_t>(static_cast<int>(which) + more) * tile_.lanes + first_;
  }
  Pack at(DriveRow which, int more = 0) const { return load(row(which, more)); }
  void put(DriveRow which, Pack value) { store(row(which), value); }
  void keep(DriveRow which, Pack value) { put(which, at(DriveRow::moves) != 0.0 ? value : at(which)); }

  /// Inertia and weight, along the recorded motion and beside it.
  void feel() {
    const auto between = [&](DriveRow from, DriveRow more) { return at(from) + part_ * at(more); };
    angle_ = at(DriveRow::angle);
    speed_ = at(DriveRow::speed);
    const Pack inertia = between(DriveRow::inertia, DriveRow::inertia_more);
    const Pack bias = between(DriveRow::bias, DriveRow::bias_more);
    const Pack cosine = between(DriveRow::cosine, DriveRow::cosine_more);
    const Pack sine = between(DriveRow::sine, DriveRow::sine_more);
    const Pack position = between(DriveRow::position, DriveRow::position_more);
    Pack c, s;
    turn_of(at(DriveRow::turns) * (angle_ - position), &c, &s);
    weight_ = at(DriveRow::weight) * (cosine * c + sine * s);
    against_ = weight_ + bias - cosine;
    heavy_ = inertia + at(DriveRow::armature);
  }

  /// The command of this step, as its rate limit and integral take it.
  void command() {
    const Mask next = at(DriveRow::late, late_) != 0.0;
    const Pack later = at(DriveRow::late, late_ + 1);
    const Pack c0 = at(DriveRow::command), c1 = at(DriveRow::command_next), c2 = at(DriveRow::command_after);
    const auto mean = [&](Pack now, Pack then) { return now + later * (then - now); };
    const Pack value = mean(next ? c1 : c0, next ? c2 : c1);
    value_ = value;
    if (has(kDriveDamped)) {
      const Pack rate = at(DriveRow::rate), s1 = (c1 - c0) * rate;
      slope_ = mean(next ? s1 : (c0 - at(DriveRow::command_before)) * rate, next ? (c2 - c1) * rate : s1);
    }
    const Pack most = at(DriveRow::most_change), before = at(DriveRow::wanted);
    wanted_ = most < HUGE_VAL ? before + within(value - before, most) : value;
    integral_ = at(DriveRow::integral) + at(DriveRow::enabled) * (wanted_ - at(DriveRow::zero) - angle_) * tile_.step;
    put(DriveRow::wanted, wanted_);
    put(DriveRow::integral, integral_);
  }

  /// Torque of the drive; the state of its controller is that of this step.
  Pack drive_torque(Pack speed) const {
    Pack tau;
    if (has(kDriveTorqueCommand)) {
      tau = at(DriveRow::command_gain) * value_;
    } else {
      const Pack band = at(DriveRow::dead_band), off = wanted_ - at(DriveRow::zero) - angle_;
      const Pack error = size(off) <= band ? Pack{} : off - with_sign(band, off);
      tau = at(DriveRow::gain) * (at(DriveRow::command_gain) * error + at(DriveRow::integral_gain) * integral_);
      if (has(kDriveDamped)) tau = tau + at(DriveRow::damping_gain) * (slope_ - speed);
    }
    if (has(kDriveDamped)) tau = tau - at(DriveRow::feedback) * speed;
    if (has(kDriveBent)) bend_effort(&tau);
    return at(DriveRow::on) != 0.0 ? within(tau * at(DriveRow::supply), at(DriveRow::saturation)) : Pack{};
  }

  /// Command effort -> torque, an exponent through a reference at which any exponent gives the same.
  void bend_effort(Pack* effort) const {
    const Pack exponents = at(DriveRow::drive_law), references = at(DriveRow::drive_reference);
    for (int i = 0; i < kLanes; ++i) {
      const double exponent = exponents[i], reference = references[i], of = std::fabs((*effort)[i]) / reference;
      if (exponent == 1.0) continue;
      const double law = of < kStraight ? of * std::pow(kStraight, exponent - 1.0) : std::pow(of, exponent);
      (*effort)[i] = std::copysign(reference * law, (*effort)[i]);
    }
  }

  /// Torque that the drive loses for more speed: none beyond its limit, as MuJoCo has it.
  Pack speed_slope() const {
    const Pack gain = at(DriveRow::damping_gain) + at(DriveRow::feedback);
    const Mask follows = (at(DriveRow::on) != 0.0) & (size(torque_) < at(DriveRow::saturation));
    const Pack straight = follows ? gain * at(DriveRow::supply) : Pack{};
    if (!has(kDriveBent)) return straight;
    const Pack more = kSlope / gain, bent = positive((torque_ - drive_torque(speed_ + more)) / more);
    return at(DriveRow::drive_law) == 1.0 ? straight : (gain != 0.0 ? bent : Pack{});
  }

  /// What acts at the link besides drive and friction.
  void act_beside() {
    const Pack law = at(DriveRow::viscous_law), functions = has(kDriveFunctions) ? functions_now() : Pack{};
    applied_ = applied_ + (functions + at(DriveRow::current_offset) - at(DriveRow::spring) * angle_);
    applied_ = applied_ - (at(DriveRow::gravity_scale) - 1.0) * weight_;
    damping_ = damping_ + positive(law * size(speed_));
    applied_ = applied_ - negative(law) * speed_ * size(speed_);
  }

  Pack friction_level() const {
    Pack level = at(DriveRow::coulomb) + at(DriveRow::load_friction) * size(torque_);
    if (has(kDriveStribeck)) {
      const Pack more = at(DriveRow::stribeck), speeds = at(DriveRow::stribeck_speed);
      for (int i = 0; i < kLanes; ++i) {
        const double of = speed_[i] / speeds[i];
        if (more[i] != 0.0) level[i] += more[i] * std::exp(-(of * of));
      }
    }
    if (has(kDriveAsymmetric)) {
      const Pack more = at(DriveRow::asymmetric_friction);
      for (int i = 0; i < kLanes; ++i) {
        if (more[i] != 0.0) level[i] += more[i] * std::tanh(speed_[i] / kTurning);
      }
    }
    return positive(level * (at(DriveRow::warmth) + at(DriveRow::warmup) * at(DriveRow::time)));
  }

  /// A bristle that bends up to `presliding`, as stiff as its level asks; implicit in the speed.
  void bend(Pack* level) {
    const Pack most = at(DriveRow::presliding), bristle = at(DriveRow::bristle);
    const Mask bends = most > 0.0;
    const Pack wanted = bristle + tile_.step * speed_, bent = within(wanted, most), stiffness = *level / most;
    const Mask sticks = size(wanted) < most;
    const Pack applied = applied_ - stiffness * (sticks ? bristle : bent);
    const Pack damping = sticks ? damping_ + stiffness * tile_.step : damping_;
    applied_ = bends ? applied : applied_;
    damping_ = bends ? damping : damping_;
    *level = bends ? Pack{} : *level;
    put(DriveRow::bristle, bends ? bent : bristle);
  }

  /// Functions that no effect explains.
  Pack functions_now() const {
    Pack sums{};
    const Pack times = at(DriveRow::time), zeros = at(DriveRow::zero);
    for (int i = 0; i < kLanes; ++i) {
      double sum = 0.0;
      for (const DriveFunction* f = tile_.functions[first_ + i]; f != tile_.functions[first_ + i + 1]; ++f) {
        using Input = DriveFunction::Input;
        const bool directed = f->input == Input::directed_load || f->input == Input::directed_angle;
        const double x = input(*f, i, angle_[i] + zeros[i], times[i]);
        sum += hat_sum(*f, x) * (directed ? std::tanh(speed_[i] / kTurning) : 1.0);
      }
      sums[i] = sum;
    }
    return sums;
  }
  double input(const DriveFunction& f, int i, double angle, double time) const {
    using Input = DriveFunction::Input;
    if (f.input == Input::speed) return speed_[i];
    if (f.input == Input::load) return torque_[i];
    if (f.input == Input::command_error) return wanted_[i] - angle;
    if (f.input == Input::time) return time;
    return f.input == Input::directed_load ? std::fabs(torque_[i]) : angle;
  }

  const DriveTile& tile_;
  int first_, late_;
  double part_;
  Pack angle_, speed_, weight_, against_, heavy_;
  Pack value_, slope_ = {}, wanted_, integral_;
  Pack torque_, applied_, damping_;
};

void turn(const DriveTile& tile) {
  for (int number = 0; number < tile.steps; ++number) {
    for (int first = 0; first < tile.lanes; first += kLanes) Step(tile, first, number).go();
  }
}

}  // namespace

#define TRUING_TEXT_OF(x) #x
#define TRUING_TEXT(x) TRUING_TEXT_OF(x)
extern const DriveFunctions drive_table;
const DriveFunctions drive_table{TRUING_TEXT(TRUING_KERNEL_NAMESPACE), turn};

}  // namespace truing::kernel::TRUING_KERNEL_NAMESPACE
