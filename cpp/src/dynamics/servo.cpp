// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The actuator chain of servo arms, step by step beside a simulator of the bodies.

#include "truing/dynamics/servo.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "math/batch.hpp"
#include "rooms.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;

constexpr double kTurning = 0.01;        ///< [rad/s | m/s] where friction that is computed here turns round
constexpr double kFar = 1e3;             ///< [rad | m] a joint that is so far from its start has left
constexpr double kContact = 0.05;        ///< of J / h^2: stiffness of the stops of a play, where nothing else is known
constexpr double kContactDamping = 0.7;  ///< of the critical: of stops and springs between rotor and link
constexpr double kLinkArmature = 0.02;   ///< of the rotor's inertia that stays at the link, behind a play
constexpr int kRotorSteps = 4;           ///< of a rotor of its own in one of the simulator's
constexpr double kSlope = 1e-5;          ///< of an effort, or [Nm]: step of the derivative of the drive's law

/// A row of a chain, by name.
struct Drive {
  explicit Drive(const Eigen::MatrixXd& chain, Index joint) : row(chain.row(joint)) {}
  double operator[](ServoField field) const { return row[static_cast<Index>(field)]; }
  Eigen::RowVectorXd row;
};

using F = ServoField;

double at(const Eigen::MatrixXd& table, Index row, Index joint) {
  return table(std::min(row, table.rows() - 1), table.cols() == 1 ? 0 : joint);
}

/// Whole number below, which a call of std::floor would take most of a step for.
Index floored(double x) {
  const auto whole = static_cast<Index>(x);
  return static_cast<double>(whole) > x ? whole - 1 : whole;
}

/// Cosine and sine, near zero by their series, to 1e-14.
void turn_of(double x, double* cosine, double* sine) {
  if (std::abs(x) > 0.5) {
    *cosine = std::cos(x);
    *sine = std::sin(x);
    return;
  }
  const double y = x * x;
  *cosine =
      1.0 - y / 2.0 * (1.0 - y / 12.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0 * (1.0 - y / 90.0 * (1.0 - y / 132.0)))));
  *sine =
      x *
      (1.0 - y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0 * (1.0 - y / 110.0 * (1.0 - y / 156.0))))));
}

/// Mean over one step of the simulator of a command that is held from row to row, and of its slope.
struct Held {
  double value = 0.0, slope = 0.0;
};
Held held_command(const ServoRecording& r, Index joint, double begin, double length) {
  const auto value = [&](Index row) { return r.command(std::clamp<Index>(row, 0, r.command.rows() - 1), joint); };
  const auto slope = [&](Index row) { return (value(row) - value(row - 1)) / r.step; };
  const double rate = 1.0 / r.step, from = begin * rate, to = (begin + length) * rate;
  const Index row = floored(from + 1e-9), last = floored(to - 1e-9);
  if (last <= row) return {value(row), slope(row)};
  const double later = (to - static_cast<double>(last)) / (to - from);  // part of the step after the change
  return {(1.0 - later) * value(row) + later * value(row + 1), (1.0 - later) * slope(row) + later * slope(row + 1)};
}

/// Command effort -> torque, an exponent through a reference at which any exponent gives the same.
double drive_law(const Drive& d, double effort) {
  const double exponent = d[F::drive_law];
  if (exponent == 1.0) return effort;
  const double reference = d[F::drive_reference], size = std::abs(effort) / reference;
  constexpr double kStraight = 1e-3;  // below it a straight line: a root's slope at zero has no end
  const double law = size < kStraight ? size * std::pow(kStraight, exponent - 1.0) : std::pow(size, exponent);
  return std::copysign(reference * law, effort);
}

double square(double x) { return x * x; }

double without_band(double error, double band) {
  return std::abs(error) <= band ? 0.0 : error - std::copysign(band, error);
}

double hat_sum(const ServoFunction& f, double x) {
  const double place = std::clamp((x - f.low) / f.width, 0.0, static_cast<double>(f.values.size() - 1));
  const auto left = std::min<Index>(static_cast<Index>(place), f.values.size() - 2);
  const double part = place - static_cast<double>(left);
  return (1.0 - part) * f.values[left] + part * f.values[left + 1];
}

/// What a joint carries from step to step.
struct JointState {
  double integral = 0.0;  ///< of the command error [rad s]
  double command = 0.0;   ///< as the rate limit lets it follow
  double bristle = 0.0;   ///< presliding travel [rad]
  double rotor = 0.0, rotor_speed = 0.0;
  double torque = 0.0;                   ///< of the drive, in the step before
  double damping = 0.0;                  ///< of the drive: less torque for more speed, taken implicitly
  double gain = 1.0, gain_factor = 1.0;  ///< of the firmware, last seen, and what it multiplies by
};

/// What moves the bodies by one step: the simulator, or every joint along its path.
class Bodies {
 public:
  virtual ~Bodies() = default;
  /// Before the chain acts on row + part: what it reads (speeds, angles, bias) stands in the workspace.
  virtual void look(Index /*row*/, double /*part*/) {}
  virtual void step() = 0;
};

class Simulator final : public Bodies {
 public:
  Simulator(const ServoCalls& calls, const ServoWorkspace& w) : calls_(calls), w_(w) {}
  void step() override { calls_.step(w_.model, w_.data); }

 private:
  const ServoCalls& calls_;
  const ServoWorkspace& w_;
};

/// Joints that do not know of each other, implicit in friction and damping.
class Apart final : public Bodies {
 public:
  Apart(const ServoArm& arm, const ServoRecording& r, const ServoPath& path, const ServoSet& set,
        const ServoWorkspace& w)
      : arm_(arm),
        r_(r),
        path_(path),
        weight_(set.weight_scale),
        w_(w),
        inertia_(path.inertia.cols()),
        against_(inertia_.size()),
        first_(std::max(0, set.only)),
        end_(set.only < 0 ? inertia_.size() : set.only + 1) {}

  void look(Index row, double part) override {
    const Index next = std::min(row + 1, path_.inertia.rows() - 1);
    const auto between = [&](const Eigen::MatrixXd& table, Index j) {
      return table(row, j) + part * (table(next, j) - table(row, j));
    };
    for (Index j = first_; j < end_; ++j) {
      const double cosine = between(path_.cosine, j), sine = between(path_.sine, j);
      const double x = path_.turns[j] * (w_.qpos[j] - between(r_.position, j));
      double c = 1.0, s = 0.0;
      turn_of(x, &c, &s);
      w_.bias[j] = weight_ * (cosine * c + sine * s);
      against_[j] = w_.bias[j] + between(path_.bias, j) - cosine;
      inertia_[j] = between(path_.inertia, j) + w_.armature[j];
    }
  }

  /// (I + h d) v' + h F sgn v' = I v + h (applied - bias), by implicit Coulomb friction (Moreau 1988).
  void step() override {
    const double h = arm_.step;
    for (Index j = first_; j < end_; ++j) {
      const double heavy = inertia_[j] + h * w_.damping[j];
      const double free = (inertia_[j] * w_.qvel[j] + h * (w_.applied[j] - against_[j])) / heavy;
      w_.qvel[j] = std::copysign(std::max(0.0, std::abs(free) - h * w_.frictionloss[j] / heavy), free);
      w_.qpos[j] += h * w_.qvel[j];
    }
  }

 private:
  const ServoArm& arm_;
  const ServoRecording& r_;
  const ServoPath& path_;
  double weight_;
  const ServoWorkspace& w_;
  Eigen::VectorXd inertia_, against_;
  Index first_, end_;
};

/// One set over one window on one workspace.
class Run {
 public:
  Run(Bodies* moved, const ServoWorkspace& w, const ServoArm& arm, const ServoRecording& recording, const ServoSet& set)
      : moved_(moved),
        w_(w),
        arm_(arm),
        r_(recording),
        set_(set),
        n_(static_cast<Index>(arm.dof.size())),
        first_(std::max(0, set.only)),
        end_(set.only < 0 ? n_ : set.only + 1) {
    for (Index j = 0; j < n_; ++j) drives_.emplace_back(set.chain, j);
    joints_.resize(static_cast<std::size_t>(n_));
    sags_ = (set.chain.col(static_cast<Index>(F::supply_sag)).array() != 0.0).any();
    for (Index j = 0; j < n_; ++j) {
      const Drive& d = drives_[static_cast<std::size_t>(j)];
      w_.armature[arm_.dof[static_cast<std::size_t>(j)]] = d[F::armature] * (has_rotor(d) ? kLinkArmature : 1.0);
    }
  }

  void begin(Index row) {
    for (Index j = first_; j < end_; ++j) {
      const Drive& d = drives_[static_cast<std::size_t>(j)];
      JointState& s = joints_[static_cast<std::size_t>(j)];
      q(j) = r_.position(row, j) - d[F::zero];
      v(j) = r_.speed(row, j);
      s.rotor = q(j);
      s.rotor_speed = v(j);
      s.command = held_command(r_, j, static_cast<double>(row) * r_.step - d[F::delay], arm_.step).value;
      history(d, j, row, &s);
    }
    time_ = static_cast<double>(row) * r_.step;
  }

  /// One step of the simulator, `part` of the way from a row to the next.
  void step(Index row, double part) {
    if (sags_) {
      sum_torques_ = 0.0;
      for (const JointState& s : joints_) sum_torques_ += std::abs(s.torque);
    }
    moved_->look(row, part);
    for (Index j = first_; j < end_; ++j) drive(j, row);
    moved_->step();
    time_ += arm_.step;
  }

  double recorded(Index j) const {
    const Drive& d = drives_[static_cast<std::size_t>(j)];
    return measured(d, joints_[static_cast<std::size_t>(j)], j) + d[F::zero];
  }
  double torque(Index j) const { return joints_[static_cast<std::size_t>(j)].torque; }

 private:
  static bool has_rotor(const Drive& d) { return d[F::backlash] > 0.0 || d[F::elasticity] > 0.0; }
  double& q(Index j) const { return w_.qpos[arm_.qpos[static_cast<std::size_t>(j)]]; }
  double& v(Index j) const { return w_.qvel[arm_.dof[static_cast<std::size_t>(j)]]; }
  double measured(const Drive& d, const JointState& s, Index j) const {
    return has_rotor(d) && d[F::motor_encoder] > 0.5 ? s.rotor : q(j);
  }

  /// What the rows before a window leave in the joint: integral, rate-limited command, bent bristle.
  void history(const Drive& d, Index j, Index row, JointState* s) const {
    const bool limited = std::isfinite(d[F::rate_limit]), bends = d[F::presliding] > 0.0,
               sums = d[F::integral_gain] > 0.0;
    if (!limited && !bends && !sums) return;
    const double most = d[F::rate_limit] * r_.step;
    double command = held_command(r_, j, -d[F::delay], arm_.step).value;
    for (Index k = 0; k < row; ++k) {
      const double wanted = held_command(r_, j, static_cast<double>(k) * r_.step - d[F::delay], arm_.step).value;
      command = limited ? command + std::clamp(wanted - command, -most, most) : wanted;
      s->integral += at(r_.enabled, k, j) * (command - r_.position(k, j)) * r_.step;
      s->bristle =
          std::clamp(s->bristle + r_.position(k + 1, j) - r_.position(k, j), -d[F::presliding], d[F::presliding]);
    }
    if (limited) s->command = command;
  }

  /// What the firmware's gain multiplies the effort by.
  static double firmware(double gain, double exponent, JointState* s) {
    if (gain != s->gain) {  // seldom: a power at each step would take longer than all else
      s->gain = gain;
      s->gain_factor = std::pow(gain, exponent);
    }
    return s->gain_factor;
  }

  /// Torque of the drive for an angle and a speed; the state of its controller is that of this step.
  double drive_torque(const Drive& d, JointState& s, Index j, Index row, const Held& command, double angle,
                      double speed) const {
    if (at(r_.enabled, row, j) < 0.5) return 0.0;
    double tau = 0.0;
    if (arm_.torque_command) {
      tau = d[F::command_gain] * command.value;
    } else {
      const double error = without_band(s.command - d[F::zero] - angle, d[F::dead_band]);
      const double effort = d[F::command_gain] * error + d[F::integral_gain] * s.integral;
      tau = firmware(at(r_.gain, row, j), d[F::gain_law], &s) * effort;
      tau += d[F::damping_gain] * (command.slope - speed);
    }
    tau = drive_law(d, tau);
    tau *= 1.0 + d[F::supply_gain] * (at(r_.supply, row, j) - 1.0);
    tau *= std::max(0.0, 1.0 - d[F::supply_sag] * sum_torques_);
    return std::clamp(tau, -d[F::saturation], d[F::saturation]);
  }

  double friction_level(const Drive& d, const JointState& s, Index j, Index row, double speed) const {
    const double by_speed =
        d[F::stribeck] == 0.0 ? 0.0 : d[F::stribeck] * std::exp(-square(speed / d[F::stribeck_speed]));
    const double by_side =
        d[F::asymmetric_friction] == 0.0 ? 0.0 : d[F::asymmetric_friction] * std::tanh(speed / kTurning);
    const double level = d[F::coulomb] + d[F::load_friction] * std::abs(s.torque) + by_speed + by_side;
    return std::max(0.0, level * (1.0 + d[F::thermal_friction] * at(r_.warmth, row, j) + d[F::warmup] * time_));
  }

  double function_input(const ServoFunction& f, const JointState& s, Index j) const {
    const double angle = q(j) + drives_[static_cast<std::size_t>(j)][F::zero];
    switch (f.input) {
      case ServoInput::speed:
        return v(j);
      case ServoInput::load:
        return s.torque;
      case ServoInput::angle:
        return angle;
      case ServoInput::command_error:
        return s.command - angle;
      case ServoInput::time:
        return time_;
      case ServoInput::directed_load:
        return std::abs(s.torque);
      default:
        return angle;
    }
  }

  double functions_at(const JointState& s, Index j) const {
    double sum = 0.0;
    for (const ServoFunction& f : set_.functions) {
      if (f.joint != j) continue;
      const bool directed = f.input == ServoInput::directed_load || f.input == ServoInput::directed_angle;
      sum += hat_sum(f, function_input(f, s, j)) * (directed ? std::tanh(v(j) / kTurning) : 1.0);
    }
    return sum;
  }

  /// What acts at joint j in the step that begins now, written to where the simulator finds it.
  void drive(Index j, Index row) {
    const Drive& d = drives_[static_cast<std::size_t>(j)];
    JointState& s = joints_[static_cast<std::size_t>(j)];
    const int dof = arm_.dof[static_cast<std::size_t>(j)];
    const Held command = held_command(r_, j, time_ - d[F::delay], arm_.step);
    const double most = d[F::rate_limit] * arm_.step;
    s.command = std::isfinite(most) ? s.command + std::clamp(command.value - s.command, -most, most) : command.value;
    s.integral += at(r_.enabled, row, j) * (s.command - d[F::zero] - measured(d, s, j)) * arm_.step;
    const double speed = v(j);
    double applied = 0.0, damping = d[F::viscous];
    const bool at_rotor = has_rotor(d) && d[F::presliding] == 0.0;
    if (has_rotor(d)) {
      applied = turn_rotor(d, j, row, command, &s, &damping);
    } else {
      s.torque = drive_torque(d, s, j, row, command, q(j), speed);
      // Linearly implicit in the speed, or a small inertia would not bear the gain.
      const double slope = speed_slope(d, s, j, row, command, speed);
      applied = s.torque + slope * speed;
      damping += slope;
    }
    applied += functions_at(s, j) + d[F::current_offset] - d[F::spring] * q(j);
    applied -= (d[F::gravity_scale] - 1.0) * w_.bias[dof];
    damping += std::max(0.0, d[F::viscous_law] * std::abs(speed));
    applied -= std::min(0.0, d[F::viscous_law]) * speed * std::abs(speed);
    const double level = friction_level(d, s, j, row, speed);
    w_.frictionloss[dof] = at_rotor ? 0.0 : level;
    if (d[F::presliding] > 0.0) {
      applied -= bristle_force(d, level, speed, &s, &damping);
      w_.frictionloss[dof] = 0.0;
    }
    w_.applied[dof] = applied;
    w_.damping[dof] = damping;
  }

  double speed_slope(const Drive& d, JointState& s, Index j, Index row, const Held& command, double speed) const {
    if (d[F::damping_gain] == 0.0) return 0.0;
    const double more = kSlope / d[F::damping_gain];
    return std::max(0.0, (s.torque - drive_torque(d, s, j, row, command, q(j), speed + more)) / more);
  }

  /// A bristle that bends up to `presliding`, as stiff as its level asks; implicit in the speed.
  double bristle_force(const Drive& d, double level, double speed, JointState* s, double* damping) const {
    const double most = d[F::presliding], h = arm_.step, bent = std::clamp(s->bristle + h * speed, -most, most);
    const double stiffness = level / most;
    const bool sticks = std::abs(s->bristle + h * speed) < most;
    const double force = stiffness * (sticks ? s->bristle : bent);
    s->bristle = bent;
    if (sticks) *damping += stiffness * h;
    return force;
  }

  /// Rotor and link are two bodies with a play and a spring between: the torque on the link.
  double turn_rotor(const Drive& d, Index j, Index row, const Held& command, JointState* s, double* damping) {
    const double inertia = d[F::armature] * (1.0 - kLinkArmature), h = arm_.step / kRotorSteps;
    const double stiffest = kContact * inertia / (h * h);
    const double stiffness = d[F::elasticity] > 0.0 ? std::min(1.0 / d[F::elasticity], stiffest) : stiffest;
    const double rub = 2.0 * kContactDamping * std::sqrt(stiffness * inertia) * (d[F::elasticity] > 0.0 ? 0.1 : 1.0);
    const double link_speed = v(j), half = 0.5 * d[F::backlash];
    double angle = q(j), sum = 0.0, touching = 0.0;
    for (int k = 0; k < kRotorSteps; ++k) {
      const double twist = without_band(s->rotor - angle, half);
      const bool touches = half == 0.0 || twist != 0.0;
      const double passed = touches ? stiffness * twist + rub * (s->rotor_speed - link_speed) : 0.0;
      const double at_encoder = d[F::motor_encoder] > 0.5 ? s->rotor : angle;
      const double speed = d[F::motor_encoder] > 0.5 ? s->rotor_speed : link_speed;
      s->torque = drive_torque(d, *s, j, row, command, at_encoder, speed);
      const double force = s->torque - passed - d[F::viscous] * s->rotor_speed;
      const double heavy = inertia + h * (d[F::viscous] + (touches ? rub + h * stiffness : 0.0));
      const double free = s->rotor_speed + h * force / heavy;
      const double level = d[F::presliding] > 0.0 ? 0.0 : friction_level(d, *s, j, row, s->rotor_speed);
      s->rotor_speed = std::copysign(std::max(0.0, std::abs(free) - h * level / heavy), free);
      s->rotor += h * s->rotor_speed;
      angle += h * link_speed;
      sum += passed / kRotorSteps;
      touching += (touches ? 1.0 : 0.0) / kRotorSteps;
    }
    const double slope = touching * (rub + arm_.step * stiffness);
    *damping = slope;  // the rotor has friction
    return sum + slope * link_speed;
  }

  Bodies* moved_;
  const ServoWorkspace& w_;
  const ServoArm& arm_;
  const ServoRecording& r_;
  const ServoSet& set_;
  Index n_, first_, end_;
  std::vector<Drive> drives_;
  std::vector<JointState> joints_;
  double time_ = 0.0, sum_torques_ = 0.0;
  bool sags_ = false;
};

ServoBodies bodies_of(const ServoWorkspace& w, int bodies) {
  const auto take = [&](const double* from, int width) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(from, width * bodies));
  };
  return {take(w.mass, 1), take(w.ipos, 3), take(w.iquat, 4), take(w.inertia, 3)};
}

void place_bodies(const ServoWorkspace& w, const ServoBodies& b) {
  std::copy(b.mass.begin(), b.mass.end(), w.mass);
  std::copy(b.ipos.begin(), b.ipos.end(), w.ipos);
  std::copy(b.iquat.begin(), b.iquat.end(), w.iquat);
  std::copy(b.inertia.begin(), b.inertia.end(), w.inertia);
}

/// Arrays of a simulator that there is not. shape=(joints, 7)
ServoWorkspace workspace_on(Eigen::MatrixXd* space) {
  ServoWorkspace w;
  double** const arrays[] = {&w.qpos, &w.qvel, &w.applied, &w.bias, &w.frictionloss, &w.damping, &w.armature};
  for (Index k = 0; k < space->cols(); ++k) *arrays[k] = space->col(k).data();
  return w;
}

void require(bool good, const char* what) {
  if (!good) throw std::invalid_argument(what);
}

void check_paths(const std::vector<std::vector<ServoPath>>& paths, const std::vector<ServoRecording>& recordings,
                 const std::vector<ServoSet>& sets) {
  for (const std::vector<ServoPath>& kind : paths) {
    require(kind.size() == recordings.size(), "simulate_servos_apart: a path of every recording expected");
    for (std::size_t k = 0; k < kind.size(); ++k) {
      const Eigen::MatrixXd& like = recordings[k].position;
      for (const Eigen::MatrixXd* table : {&kind[k].inertia, &kind[k].bias, &kind[k].cosine, &kind[k].sine})
        require(table->rows() == like.rows() && table->cols() == like.cols() && kind[k].turns.size() == like.cols(),
                "simulate_servos_apart: a path's tables have another shape than its recording");
    }
  }
  for (const ServoSet& s : sets)
    require(s.only < s.chain.rows() && std::max(0, s.bodies) < static_cast<int>(paths.size()),
            "simulate_servos_apart: masses without paths, or no such joint");
}

void check(const ServoArm& arm, const std::vector<ServoRecording>& recordings, const std::vector<ServoWindow>& windows,
           const std::vector<ServoSet>& sets) {
  const auto joints = static_cast<Index>(arm.dof.size());
  require(arm.step > 0.0 && arm.qpos.size() == arm.dof.size(),
          "simulate_servos: an arm with a step and joints expected");
  for (const ServoRecording& r : recordings) {
    require(r.command.cols() == joints && r.position.cols() == joints && r.speed.cols() == joints &&
                r.command.rows() == r.position.rows() && r.speed.rows() == r.position.rows(),
            "simulate_servos: a recording's tables have other shapes than (n, joints)");
    const double steps = r.step / arm.step;
    require(steps > 0.5 && std::abs(steps - std::round(steps)) < 1e-6,
            "simulate_servos: a recording's rows are not a whole number of steps apart");
    for (const Eigen::MatrixXd* table : {&r.gain, &r.supply, &r.enabled, &r.warmth})
      require(table->rows() > 0 && (table->cols() == 1 || table->cols() == joints),
              "simulate_servos: gain, supply, enabled and warmth have shape (n, joints) or (n, 1)");
  }
  for (const ServoWindow& w : windows) {
    require(w.recording >= 0 && static_cast<std::size_t>(w.recording) < recordings.size() && w.first >= 0 &&
                w.rows > 0 && w.first + w.rows < recordings[static_cast<std::size_t>(w.recording)].position.rows(),
            "simulate_servos: a window beyond its recording");
  }
  for (const ServoSet& s : sets) {
    require(s.chain.rows() == joints && s.chain.cols() == kServoFields, "simulate_servos: a chain of another shape");
    for (const ServoFunction& f : s.functions)
      require(f.values.size() > 1 && f.width > 0.0, "simulate_servos: a function needs two places or more");
  }
}

/// One set over one window, written to its rows.
void simulate(Run* run, const ServoWindow& window, const ServoArm& arm, double step, Index row,
              Eigen::MatrixXd* position, Eigen::MatrixXd* torque) {
  const auto joints = static_cast<Index>(arm.dof.size());
  const auto substeps = static_cast<int>(std::lround(step / arm.step));
  run->begin(window.first);
  bool left = false;
  for (Index k = 0; k < window.rows; ++k) {
    for (int i = 0; i < substeps && !left; ++i) run->step(window.first + k, static_cast<double>(i) / substeps);
    for (Index j = 0; j < joints; ++j) {
      const double q = run->recorded(j);
      left = left || !(std::abs(q) < kFar);
      (*position)(row + k, j) = std::isfinite(q) ? std::clamp(q, -kFar, kFar) : kFar;
      if (torque) (*torque)(row + k, j) = run->torque(j);
    }
  }
}

}  // namespace

std::vector<std::string> servo_fields() {
  return {"command_gain",
          "integral_gain",
          "damping_gain",
          "gain_law",
          "delay",
          "rate_limit",
          "saturation",
          "drive_law",
          "drive_reference",
          "supply_gain",
          "supply_sag",
          "dead_band",
          "coulomb",
          "viscous",
          "viscous_law",
          "stribeck",
          "stribeck_speed",
          "load_friction",
          "asymmetric_friction",
          "presliding",
          "thermal_friction",
          "warmup",
          "spring",
          "current_offset",
          "gravity_scale",
          "armature",
          "backlash",
          "elasticity",
          "motor_encoder",
          "zero"};
}

std::vector<std::string> servo_inputs() {
  return {"speed", "load", "angle", "command_error", "time", "directed_load", "directed_angle"};
}

ServoMotion simulate_servos(const ServoCalls& calls, const std::vector<ServoWorkspace>& workspaces, const ServoArm& arm,
                            const std::vector<ServoBodies>& bodies, const std::vector<ServoRecording>& recordings,
                            const std::vector<ServoWindow>& windows, const std::vector<ServoSet>& sets, bool torques) {
  require(!workspaces.empty(), "simulate_servos: no workspace");
  check(arm, recordings, windows, sets);
  const auto joints = static_cast<Index>(arm.dof.size());
  std::vector<Index> rows(1, 0);
  for (const ServoWindow& w : windows) rows.push_back(rows.back() + w.rows);
  ServoMotion out;
  out.position.assign(sets.size(), Eigen::MatrixXd::Zero(rows.back(), joints));
  if (torques) out.torque = out.position;
  const ServoBodies nominal = bodies_of(workspaces.front(), arm.bodies);
  std::atomic<std::size_t> next{0};
  const std::size_t count = sets.size() * windows.size();
  // One long piece of work a workspace: pieces of it are dealt out by the counter, and none sees another's numbers.
  const auto work = [&](std::size_t thread) {
    const ServoWorkspace& w = workspaces[thread];
    for (std::size_t k = next++; k < count; k = next++) {
      const std::size_t set = k % sets.size(), window = k / sets.size();
      const ServoRecording& r = recordings[static_cast<std::size_t>(windows[window].recording)];
      for (int i = 0; i < 3; ++i) w.gravity[i] = sets[set].weight_scale * arm.gravity[i];
      if (sets[set].bodies >= 0) place_bodies(w, bodies[static_cast<std::size_t>(sets[set].bodies)]);
      Simulator moved(calls, w);
      Run run(&moved, w, arm, r, sets[set]);
      calls.constants(w.model, w.data);
      calls.reset(w.model, w.data);
      simulate(&run, windows[window], arm, r.step, rows[window], &out.position[set],
               torques ? &out.torque[set] : nullptr);
      if (sets[set].bodies >= 0) place_bodies(w, nominal);
    }
  };
  for_each_on_threads(workspaces.size(), static_cast<int>(workspaces.size()), {}, work, 1);
  return out;
}

ServoMotion simulate_servos_apart(const ServoArm& arm, const std::vector<std::vector<ServoPath>>& paths,
                                  const std::vector<ServoRecording>& recordings,
                                  const std::vector<ServoWindow>& windows, const std::vector<ServoSet>& sets,
                                  int threads, bool torques) {
  check(arm, recordings, windows, sets);
  check_paths(paths, recordings, sets);
  ServoArm apart = arm;  // joints one after the other
  for (std::size_t j = 0; j < arm.dof.size(); ++j) apart.dof[j] = apart.qpos[j] = static_cast<int>(j);
  const auto joints = static_cast<Index>(arm.dof.size());
  std::vector<Index> rows(1, 0);
  for (const ServoWindow& w : windows) rows.push_back(rows.back() + w.rows);
  ServoMotion out;
  out.position.assign(sets.size(), Eigen::MatrixXd::Zero(rows.back(), joints));
  if (torques) out.torque = out.position;
  std::vector<Eigen::MatrixXd> space(static_cast<std::size_t>(threads), Eigen::MatrixXd::Zero(joints, 7));
  const auto work = [&](std::size_t k, std::size_t thread) {
    const std::size_t set = k % sets.size(), window = k / sets.size();
    const auto recording = static_cast<std::size_t>(windows[window].recording);
    space[thread].setZero();
    const ServoWorkspace w = workspace_on(&space[thread]);
    Apart moved(apart, recordings[recording], paths[static_cast<std::size_t>(std::max(0, sets[set].bodies))][recording],
                sets[set], w);
    Run run(&moved, w, apart, recordings[recording], sets[set]);
    simulate(&run, windows[window], apart, recordings[recording].step, rows[window], &out.position[set],
             torques ? &out.torque[set] : nullptr);
  };
  std::atomic<std::size_t> next{0};
  const std::size_t count = sets.size() * windows.size();
  const auto deal = [&](std::size_t thread) {
    for (std::size_t k = next++; k < count; k = next++) work(k, thread);
  };
  for_each_on_threads(space.size(), threads, {}, deal, 1);
  return out;
}

}  // namespace truing::dynamics
