// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The actuator chain of one joint, step by step: from commands, angle and speed to what acts at the joint. The law is
// that of python/truing/dynamics/servo/chain.py.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "truing/dynamics/servo.hpp"

namespace truing::dynamics {

/// Where a joint stands when a step begins.
struct ServoMoment {
  Eigen::Index row = 0;  ///< of the recording, at or before now
  double time = 0.0;     ///< [s] from the recording's first row
  double angle = 0.0, speed = 0.0;
  double bias = 0.0;         ///< [Nm] what weight (and motion) ask of the joint
  double all_torques = 0.0;  ///< [Nm] sum of the sizes of all drives' in the step before
};

/// What acts at a joint in a step: a torque, damping that goes with the speed, dry friction that holds.
struct ServoActs {
  double applied = 0.0, damping = 0.0, friction = 0.0;
};

/// The chain of one joint over one recording.
class ServoDrive {
 public:
  ServoDrive(const ServoArm& arm, const ServoRecording& recording, const ServoSet& set, Eigen::Index joint)
      : command_(recording.command, joint),
        position_(recording.position, joint),
        gain_(recording.gain, joint),
        supply_(recording.supply, joint),
        enabled_(recording.enabled, joint),
        warmth_(recording.warmth, joint),
        step_(arm.step),
        row_step_(recording.step),
        rate_(1.0 / recording.step),
        torque_command_(arm.torque_command) {
    for (int k = 0; k < kServoFields; ++k) d_[static_cast<std::size_t>(k)] = set.chain(joint, k);
    for (const ServoFunction& f : set.functions)
      if (f.joint == joint) functions_.push_back(&f);
    has_rotor_ = d(F::backlash) > 0.0 || d(F::elasticity) > 0.0;
    on_motor_ = has_rotor_ && d(F::motor_encoder) > 0.5;
    limited_ = std::isfinite(d(F::rate_limit));
    if (has_rotor_) couple();
  }

  /// Inertia of the rotor that the joint itself carries.
  double armature() const { return d(F::armature) * (has_rotor_ ? kLinkArmature : 1.0); }
  double zero() const { return d(F::zero); }
  bool sags() const { return d(F::supply_sag) != 0.0; }
  double torque() const { return torque_; }
  /// The angle as the recording has it.
  double recorded(double angle) const { return encoder(angle) + d(F::zero); }

  void begin(Eigen::Index row, double angle, double speed) {
    rotor_ = angle;
    rotor_speed_ = link_speed_ = speed;
    wanted_ = held(static_cast<double>(row) * row_step_ - d(F::delay)).value;
    remember(row);
  }

  /// What acts in the step that begins now.
  ServoActs act(const ServoMoment& now) {
    const Held command = held(now.time - d(F::delay));
    const double most = d(F::rate_limit) * step_;
    wanted_ = limited_ ? wanted_ + std::clamp(command.value - wanted_, -most, most) : command.value;
    integral_ += enabled_(now.row) * (wanted_ - d(F::zero) - encoder(now.angle)) * step_;
    const bool on = enabled_(now.row) >= 0.5;
    ServoActs acts{0.0, viscous(on), 0.0};
    if (has_rotor_) {
      turn_rotor(now, command, on, &acts);
    } else {
      torque_ = drive_torque(now, command, now.angle, now.speed);
      // Linearly implicit in the speed, or a small inertia would not bear the gain.
      const double slope = speed_slope(now, command);
      acts.applied = torque_ + slope * now.speed;
      acts.damping += slope;
    }
    acts.applied += functions_at(now) + d(F::current_offset) - d(F::spring) * now.angle;
    acts.applied -= (d(F::gravity_scale) - 1.0) * now.bias;
    acts.damping += std::max(0.0, d(F::viscous_law) * std::abs(now.speed));
    acts.applied -= std::min(0.0, d(F::viscous_law)) * now.speed * std::abs(now.speed);
    const double level = friction_level(now, now.speed);
    if (d(F::presliding) > 0.0) {
      bend(level, now.speed, &acts);
    } else if (!has_rotor_) {
      acts.friction = level;
    }
    return acts;
  }

 private:
  using F = ServoField;
  using Index = Eigen::Index;

  static constexpr double kTurning = 0.01;        ///< [rad/s | m/s] where friction that is computed here turns round
  static constexpr double kContact = 0.05;        ///< of J / h^2: stiffness of a play's stops, else not known
  static constexpr double kContactDamping = 0.7;  ///< of the critical: of stops and springs between rotor and link
  static constexpr double kLinkArmature = 0.02;   ///< of the rotor's inertia that stays at the link, behind a play
  static constexpr int kRotorSteps = 4;           ///< of a rotor of its own in one of the simulator's
  static constexpr double kSlope = 1e-5;          ///< of an effort, or [Nm]: step of the derivative of the drive's law
  static constexpr double kStraight = 1e-3;  ///< of the reference: below it a root is a line, or its slope has no end

  /// A joint's column of a recording's table; a table of one column, or row, holds for all.
  struct Input {
    Input(const Eigen::MatrixXd& table, Index joint)
        : values(table.col(table.cols() == 1 ? 0 : joint).data()), last(table.rows() - 1) {}
    double operator()(Index row) const { return values[std::min(row, last)]; }
    const double* values;
    Index last;
  };

  /// Mean over one step of the simulator of a command that is held from row to row, and of its slope.
  struct Held {
    double value = 0.0, slope = 0.0;
  };

  double d(F field) const { return d_[static_cast<std::size_t>(field)]; }
  double encoder(double angle) const { return on_motor_ ? rotor_ : angle; }

  /// Whole number below, which a call of std::floor would take most of a step for.
  static Index floored(double x) {
    const auto whole = static_cast<Index>(x);
    return static_cast<double>(whole) > x ? whole - 1 : whole;
  }
  static double square(double x) { return x * x; }
  static double without_band(double error, double band) {
    return std::abs(error) <= band ? 0.0 : error - std::copysign(band, error);
  }

  Held held(double begin) const {
    const auto value = [&](Index row) { return command_(std::max<Index>(row, 0)); };
    const auto slope = [&](Index row) { return (value(row) - value(row - 1)) * rate_; };
    const bool sloped = d(F::damping_gain) != 0.0;
    const double from = begin * rate_, to = (begin + step_) * rate_;
    const Index row = floored(from + 1e-9), last = floored(to - 1e-9);
    if (last <= row) return {value(row), sloped ? slope(row) : 0.0};
    const double later = (to - static_cast<double>(last)) / (to - from);  // part of the step after the change
    return {(1.0 - later) * value(row) + later * value(row + 1),
            sloped ? (1.0 - later) * slope(row) + later * slope(row + 1) : 0.0};
  }

  /// What the rows before a window leave in the joint: integral, rate-limited command, bent bristle.
  void remember(Index row) {
    const bool bends = d(F::presliding) > 0.0, sums = d(F::integral_gain) > 0.0;
    if (!limited_ && !bends && !sums) return;
    const double most = d(F::rate_limit) * row_step_;
    double command = held(-d(F::delay)).value;
    for (Index k = 0; k < row; ++k) {
      const double wanted = held(static_cast<double>(k) * row_step_ - d(F::delay)).value;
      command = limited_ ? command + std::clamp(wanted - command, -most, most) : wanted;
      integral_ += enabled_(k) * (command - position_(k)) * row_step_;
      bristle_ = std::clamp(bristle_ + position_(k + 1) - position_(k), -d(F::presliding), d(F::presliding));
    }
    if (limited_) wanted_ = command;
  }

  // ---- the drive

  /// What the firmware's gain multiplies the effort by.
  double firmware(double gain) {
    if (gain != gain_seen_) {  // seldom: a power at each step would take longer than all else
      gain_seen_ = gain;
      gain_factor_ = std::pow(gain, d(F::gain_law));
    }
    return gain_factor_;
  }

  /// Command effort -> torque, an exponent through a reference at which any exponent gives the same.
  double drive_law(double effort) const {
    const double exponent = d(F::drive_law);
    if (exponent == 1.0) return effort;
    const double reference = d(F::drive_reference), size = std::abs(effort) / reference;
    const double law = size < kStraight ? size * std::pow(kStraight, exponent - 1.0) : std::pow(size, exponent);
    return std::copysign(reference * law, effort);
  }

  /// Torque of the drive for an angle and a speed; the state of its controller is that of this step.
  double drive_torque(const ServoMoment& now, const Held& command, double angle, double speed) {
    if (enabled_(now.row) < 0.5) return 0.0;
    double tau = 0.0;
    if (torque_command_) {
      tau = d(F::command_gain) * command.value;
    } else {
      const double error = without_band(wanted_ - d(F::zero) - angle, d(F::dead_band));
      tau = firmware(gain_(now.row)) * (d(F::command_gain) * error + d(F::integral_gain) * integral_);
      tau += d(F::damping_gain) * (command.slope - speed);
    }
    tau = drive_law(tau);
    tau *= 1.0 + d(F::supply_gain) * (supply_(now.row) - 1.0);
    tau *= std::max(0.0, 1.0 - d(F::supply_sag) * now.all_torques);
    return std::clamp(tau, -d(F::saturation), d(F::saturation));
  }

  double speed_slope(const ServoMoment& now, const Held& command) {
    if (d(F::damping_gain) == 0.0) return 0.0;
    const double more = kSlope / d(F::damping_gain);
    return std::max(0.0, (torque_ - drive_torque(now, command, now.angle, now.speed + more)) / more);
  }

  // ---- friction

  /// A motor that is switched off (its bridge open) does not brake: its part of the damping is not there.
  double viscous(bool on) const { return d(F::viscous) * (on ? 1.0 : 1.0 - d(F::back_emf)); }

  double friction_level(const ServoMoment& now, double speed) const {
    double level = d(F::coulomb) + d(F::load_friction) * std::abs(torque_);
    if (d(F::stribeck) != 0.0) level += d(F::stribeck) * std::exp(-square(speed / d(F::stribeck_speed)));
    if (d(F::asymmetric_friction) != 0.0) level += d(F::asymmetric_friction) * std::tanh(speed / kTurning);
    return std::max(0.0, level * (1.0 + d(F::thermal_friction) * warmth_(now.row) + d(F::warmup) * now.time));
  }

  /// A bristle that bends up to `presliding`, as stiff as its level asks; implicit in the speed.
  void bend(double level, double speed, ServoActs* acts) {
    const double most = d(F::presliding), wanted = bristle_ + step_ * speed, bent = std::clamp(wanted, -most, most);
    const double stiffness = level / most;
    const bool sticks = std::abs(wanted) < most;
    acts->applied -= stiffness * (sticks ? bristle_ : bent);
    if (sticks) acts->damping += stiffness * step_;
    bristle_ = bent;
  }

  // ---- play and elasticity

  /// What stands between rotor and link: a play, and a spring (or stops).
  void couple() {
    const double inertia = d(F::armature) * (1.0 - kLinkArmature), h = step_ / kRotorSteps;
    const double stiffest = kContact * inertia / (h * h);
    stiffness_ = d(F::elasticity) > 0.0 ? std::min(1.0 / d(F::elasticity), stiffest) : stiffest;
    rub_ = 2.0 * kContactDamping * std::sqrt(stiffness_ * inertia) * (d(F::elasticity) > 0.0 ? 0.1 : 1.0);
    for (const bool on : {false, true}) {
      per_inertia_[on] = h / (inertia + h * viscous(on));
      per_inertia_touching_[on] = h / (inertia + h * (viscous(on) + rub_ + h * stiffness_));
    }
  }

  /// Rotor and link are two bodies with a play and a spring between: the torque on the link.
  void turn_rotor(const ServoMoment& now, const Held& command, bool on, ServoActs* acts) {
    const double h = step_ / kRotorSteps, half = 0.5 * d(F::backlash);
    double angle = now.angle, sum = 0.0, touching = 0.0;
    // The link's step was implicit in its own speed: what it was pushed less by, the rotor was pushed back less.
    rotor_speed_ += step_ * given_ * (now.speed - link_speed_) / (d(F::armature) * (1.0 - kLinkArmature));
    for (int k = 0; k < kRotorSteps; ++k) {
      const double twist = without_band(rotor_ - angle, half);
      const bool touches = half == 0.0 || twist != 0.0;
      const double passed = touches ? stiffness_ * twist + rub_ * (rotor_speed_ - now.speed) : 0.0;
      torque_ = drive_torque(now, command, on_motor_ ? rotor_ : angle, on_motor_ ? rotor_speed_ : now.speed);
      const double force = torque_ - passed - viscous(on) * rotor_speed_;
      const double part = touches ? per_inertia_touching_[on] : per_inertia_[on];
      const double free = rotor_speed_ + part * force;
      const double level = d(F::presliding) > 0.0 ? 0.0 : friction_level(now, rotor_speed_);
      const double before = rotor_speed_;
      rotor_speed_ = std::copysign(std::max(0.0, std::abs(free) - part * level), free);
      rotor_ += h * rotor_speed_;
      angle += h * now.speed;
      const double more = touches ? (rub_ + h * stiffness_) * (rotor_speed_ - before) : 0.0;  // implicit as well
      sum += (passed + more) / kRotorSteps;
      touching += (touches ? 1.0 : 0.0) / kRotorSteps;
    }
    acts->damping = touching * (rub_ + step_ * stiffness_);  // the rotor has friction
    acts->applied = sum + acts->damping * now.speed;
    given_ = acts->damping;
    link_speed_ = now.speed;
  }

  // ---- functions that no effect explains

  double functions_at(const ServoMoment& now) const {
    double sum = 0.0;
    for (const ServoFunction* f : functions_) {
      const bool directed = f->input == ServoInput::directed_load || f->input == ServoInput::directed_angle;
      sum += hat_sum(*f, function_input(f->input, now)) * (directed ? std::tanh(now.speed / kTurning) : 1.0);
    }
    return sum;
  }

  double function_input(ServoInput input, const ServoMoment& now) const {
    const double angle = now.angle + d(F::zero);
    switch (input) {
      case ServoInput::speed:
        return now.speed;
      case ServoInput::load:
        return torque_;
      case ServoInput::command_error:
        return wanted_ - angle;
      case ServoInput::time:
        return now.time;
      case ServoInput::directed_load:
        return std::abs(torque_);
      default:
        return angle;
    }
  }

  static double hat_sum(const ServoFunction& f, double x) {
    const double place = std::clamp((x - f.low) / f.width, 0.0, static_cast<double>(f.values.size() - 1));
    const auto left = std::min<Index>(static_cast<Index>(place), f.values.size() - 2);
    const double part = place - static_cast<double>(left);
    return (1.0 - part) * f.values[left] + part * f.values[left + 1];
  }

  std::array<double, static_cast<std::size_t>(kServoFields)> d_;
  std::vector<const ServoFunction*> functions_;
  Input command_, position_, gain_, supply_, enabled_, warmth_;
  double step_, row_step_, rate_;
  bool torque_command_ = false, has_rotor_ = false, on_motor_ = false, limited_ = false;
  double stiffness_ = 0.0, rub_ = 0.0;
  double per_inertia_[2] = {}, per_inertia_touching_[2] = {};  ///< of the rotor's step, switched off and on
  // What the joint carries from step to step.
  double integral_ = 0.0;  ///< of the command error [rad s]
  double wanted_ = 0.0;    ///< command, as the rate limit lets it follow
  double bristle_ = 0.0;   ///< presliding travel [rad]
  double rotor_ = 0.0, rotor_speed_ = 0.0;
  double given_ = 0.0, link_speed_ = 0.0;       ///< damping of the link by the rotor in the step before, and its speed
  double torque_ = 0.0;                         ///< of the drive, in the step before
  double gain_seen_ = 1.0, gain_factor_ = 1.0;  ///< of the firmware, last seen, and what it multiplies by
};

}  // namespace truing::dynamics
