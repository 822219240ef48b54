// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The actuator chain of one joint, step by step: from commands, angle and speed to what acts at the joint. The law is
// that of python/truing/dynamics/servo/chain.py.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "dynamics/servo_pair.hpp"
#include "kernel/drive.hpp"
#include "truing/dynamics/servo.hpp"

namespace truing::dynamics {

/// Where a joint stands when a step begins.
struct ServoMoment {
  Eigen::Index row = 0;  ///< of the recording, at or before now
  std::size_t step = 0;  ///< of the simulator, counted from the row
  double time = 0.0;     ///< [s] from the recording's first row
  double angle = 0.0, speed = 0.0;
  double bias = 0.0;         ///< [Nm] what weight (and motion) ask of the joint
  double inertia = 0.0;      ///< [kg m^2 | kg] of the link, no more than it is, of the whole arm
  double rubbed = 0.0;       ///< [Nm] what dry friction gave the joint in the step before, of the whole arm
  double all_torques = 0.0;  ///< [Nm] sum of the sizes of all drives' in the step before
};

/// What acts at a joint in a step: a torque, damping that goes with the speed, dry friction that holds; and the inertia
/// of the rotor that it carries.
struct ServoActs {
  double applied = 0.0, damping = 0.0, friction = 0.0, armature = 0.0;
};

/// The chain of one joint over one recording.
class ServoDrive {
  using F = ServoField;
  using Index = Eigen::Index;

 public:
  /// number: of the recording.
  ServoDrive(const ServoArm& arm, const ServoRecording& recording, const ServoSet& set, int number, Eigen::Index joint)
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
    feedback_ = d(F::viscous) * d(F::limited_damping);
    if (d(F::elasticity) > 0.0)
      spring_rub_ = 2.0 * kSpringDamping * std::sqrt(d(F::armature) * (1.0 - kLinkArmature) / d(F::elasticity));
    const auto steps = static_cast<std::size_t>(std::lround(recording.step / arm.step));
    for (std::size_t k = 0; k < steps; ++k) late_.push_back(late(static_cast<double>(k) * step_ - d(F::delay)));
    play_ = Play(0.5 * d(F::backlash));
    if (set.charge.size() > 0) integral_ = set.charge(number, joint);
  }

  /// Inertia of the rotor that the joint carries at most.
  double most_armature() const { return d(F::elasticity) > 0.0 ? armature() : d(F::armature); }
  /// Inertia of the rotor that the joint itself carries.
  double armature() const { return d(F::armature) * (has_rotor_ ? kLinkArmature : 1.0); }
  double zero() const { return d(F::zero); }
  bool has_rotor() const { return has_rotor_; }
  bool sags() const { return d(F::supply_sag) != 0.0; }
  double torque() const { return torque_; }
  /// The angle as the recording has it.
  double recorded(double angle) const { return encoder(angle) + d(F::zero); }

  // ---- what the kernel's lanes take (kernel/drive.hpp), of a joint apart whose rotor is
  // its link's and whose supply does not sag: put(row of the table, value)

  unsigned laws() const {
    unsigned out = 0;
    const auto add = [&out](bool has, unsigned law) { out |= has ? law : 0; };
    add(torque_command_, kernel::kDriveTorqueCommand);
    add(d(F::damping_gain) != 0.0 || feedback_ != 0.0, kernel::kDriveDamped);
    add(d(F::drive_law) != 1.0, kernel::kDriveBent);
    add(d(F::stribeck) != 0.0, kernel::kDriveStribeck);
    add(d(F::asymmetric_friction) != 0.0, kernel::kDriveAsymmetric);
    add(d(F::presliding) > 0.0, kernel::kDrivePresliding);
    add(!functions_.empty(), kernel::kDriveFunctions);
    return out;
  }

  /// What holds for good, and where it stands when it has begun.
  template <class Put>
  void values(const Put& put) const {
    using Row = kernel::DriveRow;
    put(Row::command_gain, d(F::command_gain));
    put(Row::integral_gain, d(F::integral_gain));
    put(Row::damping_gain, d(F::damping_gain));
    put(Row::feedback, feedback_);
    put(Row::most_change, d(F::rate_limit) * step_);
    put(Row::saturation, d(F::saturation));
    put(Row::drive_law, d(F::drive_law));
    put(Row::drive_reference, d(F::drive_reference));
    put(Row::dead_band, d(F::dead_band));
    put(Row::coulomb, d(F::coulomb));
    put(Row::viscous_law, d(F::viscous_law));
    put(Row::stribeck, d(F::stribeck));
    put(Row::stribeck_speed, d(F::stribeck_speed));
    put(Row::load_friction, d(F::load_friction));
    put(Row::asymmetric_friction, d(F::asymmetric_friction));
    put(Row::presliding, d(F::presliding));
    put(Row::warmup, d(F::warmup));
    put(Row::spring, d(F::spring));
    put(Row::current_offset, d(F::current_offset));
    put(Row::gravity_scale, d(F::gravity_scale));
    put(Row::armature, armature());
    put(Row::zero, d(F::zero));
    put(Row::rate, rate_);
    put(Row::wanted, wanted_);
    put(Row::integral, integral_);
    put(Row::bristle, bristle_);
    for (std::size_t k = 0; k < late_.size(); ++k) {
      const auto row = static_cast<int>(Row::late) + 2 * static_cast<int>(k);
      put(static_cast<Row>(row), static_cast<double>(late_[k].row - late_[0].row));
      put(static_cast<Row>(row + 1), late_[k].later);
    }
  }

  /// What holds until the next row, beside the command.
  template <class Put>
  void row_values(const Put& put) const {
    using Row = kernel::DriveRow;
    put(Row::on, on_ ? 1.0 : 0.0);
    put(Row::enabled, enabled_part_);
    put(Row::gain, gain_factor_);
    put(Row::supply, supply_factor_);
    put(Row::warmth, warmth_factor_);
    put(Row::viscous, viscous_);
  }

  /// The commands that the steps after a row see.
  template <class Put>
  void commands(Index row, const Put& put) const {
    using Row = kernel::DriveRow;
    const Index first = row + late_[0].row;
    const auto value = [&](Index k) { return command_(std::max<Index>(k, 0)); };
    put(Row::command_before, value(first - 1));
    put(Row::command, value(first));
    put(Row::command_next, value(first + 1));
    put(Row::command_after, value(first + 2));
  }

  /// The functions that are added to it.
  void lend(std::vector<kernel::DriveFunction>* out) const {
    for (const ServoFunction* f : functions_)
      out->push_back({static_cast<kernel::DriveFunction::Input>(f->input), f->low, f->width, f->values.data(),
                      static_cast<int>(f->values.size())});
  }

  /// Begins at a row, with an encoder at this angle and speed. Where a rotor has a play or a spring before it, what
  /// weight asks of the link [Nm | N], of this inertia, says where it stands. The link's angle.
  double begin(Eigen::Index row, double angle, double speed, double load = 0.0, double inertia = 1.0) {
    const double half = 0.5 * d(F::backlash);
    side_ = has_rotor_ && std::abs(load) * kFalls * kFalls > 2.0 * half * inertia ? std::copysign(1.0, load) : 0.0;
    const double twist = has_rotor_ ? side_ * half + d(F::elasticity) * load : 0.0;
    rotor_ = on_motor_ ? angle : angle + twist;
    rotor_speed_ = speed;
    play_.begin(side_);
    pending_ = false;
    wanted_ = held(row);
    enter(row);
    remember(row);
    return on_motor_ ? angle - twist : angle;
  }

  /// From this row on until the next: what the recording says beside the command.
  void enter(Eigen::Index row) {
    on_ = enabled_(row) >= 0.5;
    enabled_part_ = enabled_(row);
    gain_factor_ = firmware(gain_(row));
    supply_factor_ = 1.0 + d(F::supply_gain) * (supply_(row) - 1.0);
    warmth_factor_ = 1.0 + d(F::thermal_friction) * warmth_(row);
    viscous_ = viscous(on_);
  }

  /// What acts in the step that begins now.
  ServoActs act(const ServoMoment& now) {
    const Held command = commanded(now);
    ServoActs acts{0.0, viscous_, 0.0, armature()};
    const bool bends = d(F::presliding) > 0.0;
    if (has_rotor_ && d(F::elasticity) == 0.0) {
      turn_with_stops(now, command, bends, &acts);
    } else if (has_rotor_) {
      turn_with_spring(now, command, bends, &acts);
    } else {
      torque_ = drive_torque(now, command, now.angle, now.speed);
      // Linearly implicit in the speed, or a small inertia would not bear the gain.
      const double slope = speed_slope(now, command, now.angle, now.speed);
      acts.applied = torque_ + slope * now.speed;
      acts.damping += slope;
    }
    act_beside(now, &acts);
    const double level = friction_level(now, now.speed);
    if (bends) {
      bend(level, now.speed, &acts);
    } else if (!has_rotor_) {
      acts.friction = level;
    }
    return acts;
  }

  /// The step that begins now of a joint that has a rotor of its own and is looked at apart. inertia: of the link
  /// [kg m^2 | kg]; against: what it asks for [Nm | N].
  void turn(const ServoMoment& now, double inertia, double against, double* angle, double* speed) {
    side_ = 0.0;  // `play_` has it
    const Held command = commanded(now);
    const bool bends = d(F::presliding) > 0.0;
    PairedBody rotor = driven(now, command, bends);
    ServoActs beside;
    act_beside(now, &beside);
    if (bends) bend(friction_level(now, now.speed), now.speed, &beside);
    PairedBody link{inertia, now.angle, now.speed, beside.applied - against, beside.damping, 0.0};
    if (d(F::elasticity) > 0.0) {
      step_with_spring(step_, 0.5 * d(F::backlash), 1.0 / d(F::elasticity), spring_rub_, &rotor, &link);
    } else {
      play_.step(step_, &rotor, &link);
    }
    rotor_ = rotor.angle;
    rotor_speed_ = rotor.speed;
    *angle = link.angle;
    *speed = link.speed;
  }

 private:
  static constexpr double kTurning = 0.01;        ///< [rad/s | m/s] where friction that is computed here turns round
  static constexpr double kSpringDamping = 0.07;  ///< of the critical, with the link held: of a spring
  static constexpr double kFalls = 0.3;  ///< [s] in which a link falls through half of a play, if it lies on a stop
  static constexpr double kLinkArmature = 0.02;  ///< of the rotor's inertia that stays at the link, behind a play
  static constexpr double kSlope = 1e-5;         ///< of an effort, or [Nm]: step of the derivative of the drive's law
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
  /// Rows of the command that a step sees: one, so far after the row that it is in, and the part of the next one.
  struct Late {
    Index row = 0;
    double later = 0.0;
  };

  double d(F field) const { return d_[static_cast<std::size_t>(field)]; }
  double encoder(double angle) const {
    if (!on_motor_) return angle;
    if (pending_) return rotor_ + step_ * arrived_speed(angle);
    return side_ != 0.0 ? angle + side_ * 0.5 * d(F::backlash) : rotor_;
  }

  /// Whole number below, which a call of std::floor would take most of a step for.
  static Index floored(double x) {
    const auto whole = static_cast<Index>(x);
    return static_cast<double>(whole) > x ? whole - 1 : whole;
  }
  static double square(double x) { return x * x; }
  static double without_band(double error, double band) {
    return std::abs(error) <= band ? 0.0 : error - std::copysign(band, error);
  }

  /// A step that begins so long after a row [s] (or before it): what it sees of the commands.
  Late late(double after) const {
    const double from = after * rate_, to = (after + step_) * rate_;
    const Index row = floored(from + 1e-9), last = floored(to - 1e-9);
    return {row, last <= row ? 0.0 : (to - static_cast<double>(last)) / (to - from)};
  }

  Held held(Index row, const Late& at) const {
    const auto value = [&](Index k) { return command_(std::max<Index>(k, 0)); };
    const auto slope = [&](Index k) { return (value(k) - value(k - 1)) * rate_; };
    const bool sloped = d(F::damping_gain) != 0.0;
    const Index first = row + at.row;
    if (at.later == 0.0) return {value(first), sloped ? slope(first) : 0.0};
    const auto mean = [&](double now, double next) { return now + at.later * (next - now); };
    return {mean(value(first), value(first + 1)), sloped ? mean(slope(first), slope(first + 1)) : 0.0};
  }
  double held(Index row) const { return held(row, late(-d(F::delay))).value; }

  /// What the rows before a window leave in the joint: integral, rate-limited command, bent bristle.
  void remember(Index row) {
    const bool bends = d(F::presliding) > 0.0, sums = d(F::integral_gain) > 0.0;
    if (!limited_ && !bends && !sums) return;
    const double most = d(F::rate_limit) * row_step_;
    double command = held(0);
    for (Index k = 0; k < row; ++k) {
      const double wanted = held(k);
      command = limited_ ? command + std::clamp(wanted - command, -most, most) : wanted;
      integral_ += enabled_(k) * (command - position_(k)) * row_step_;
      bristle_ = std::clamp(bristle_ + position_(k + 1) - position_(k), -d(F::presliding), d(F::presliding));
    }
    if (limited_) wanted_ = command;
  }

  /// The command of this step, as its rate limit and integral take it.
  Held commanded(const ServoMoment& now) {
    const Held command = held(now.row, late_[now.step]);
    const double most = d(F::rate_limit) * step_;
    wanted_ = limited_ ? wanted_ + std::clamp(command.value - wanted_, -most, most) : command.value;
    integral_ += enabled_part_ * (wanted_ - d(F::zero) - encoder(now.angle)) * step_;
    return command;
  }

  /// What acts at the link besides drive and friction.
  void act_beside(const ServoMoment& now, ServoActs* acts) const {
    acts->applied += functions_at(now) + d(F::current_offset) - d(F::spring) * now.angle;
    acts->applied -= (d(F::gravity_scale) - 1.0) * now.bias;
    acts->damping += std::max(0.0, d(F::viscous_law) * std::abs(now.speed));
    acts->applied -= std::min(0.0, d(F::viscous_law)) * now.speed * std::abs(now.speed);
  }

  // ---- the drive

  /// What the firmware's gain multiplies the effort by.
  double firmware(double gain) {
    if (gain != gain_seen_) {  // seldom: a power at each step would take longer than all else
      gain_seen_ = gain;
      gain_power_ = std::pow(gain, d(F::gain_law));
    }
    return gain_power_;
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
    if (!on_) return 0.0;
    double tau = 0.0;
    if (torque_command_) {
      tau = d(F::command_gain) * command.value;
    } else {
      const double error = without_band(wanted_ - d(F::zero) - angle, d(F::dead_band));
      tau = gain_factor_ * (d(F::command_gain) * error + d(F::integral_gain) * integral_);
      tau += d(F::damping_gain) * (command.slope - speed);
    }
    tau -= feedback_ * speed;
    tau = drive_law(tau);
    tau *= supply_factor_;
    tau *= with_sag(now);
    return std::clamp(tau, -d(F::saturation), d(F::saturation));
  }

  double with_sag(const ServoMoment& now) const { return std::max(0.0, 1.0 - d(F::supply_sag) * now.all_torques); }

  /// Torque that the drive loses for more speed: none beyond its limit, as MuJoCo has it.
  double speed_slope(const ServoMoment& now, const Held& command, double angle, double speed) {
    const double gain = d(F::damping_gain) + feedback_;
    if (gain == 0.0 || !on_) return 0.0;
    if (d(F::drive_law) == 1.0)
      return std::abs(torque_) < d(F::saturation) ? gain * supply_factor_ * with_sag(now) : 0.0;
    const double more = kSlope / gain;
    return std::max(0.0, (torque_ - drive_torque(now, command, angle, speed + more)) / more);
  }

  // ---- friction

  /// A motor that is switched off (its bridge open) does not brake: its part of the damping is not there.
  double viscous(bool on) const { return (d(F::viscous) - feedback_) * (on ? 1.0 : 1.0 - d(F::back_emf)); }

  double friction_level(const ServoMoment& now, double speed) const {
    double level = d(F::coulomb) + d(F::load_friction) * std::abs(torque_);
    if (d(F::stribeck) != 0.0) level += d(F::stribeck) * std::exp(-square(speed / d(F::stribeck_speed)));
    if (d(F::asymmetric_friction) != 0.0) level += d(F::asymmetric_friction) * std::tanh(speed / kTurning);
    return std::max(0.0, level * (warmth_factor_ + d(F::warmup) * now.time));
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

  /// A rotor behind a spring, through a step of the simulator (`step_with_spring`): what the rotor will do goes with
  /// the link's speed at the end of the step, and is put into the joint's damping; the rotor follows when it is known.
  void turn_with_spring(const ServoMoment& now, const Held& command, bool bends, ServoActs* acts) {
    if (pending_) {
      rotor_speed_ = arrived_speed(now.angle);
      rotor_ += step_ * rotor_speed_;
    }
    PairedBody rotor = driven(now, command, bends), link;
    link.inertia = now.inertia;
    link.angle = now.angle;
    link.speed = now.speed;
    const SpringStep spring(step_, 0.5 * d(F::backlash), 1.0 / d(F::elasticity), spring_rub_, rotor, link);
    left_.coupled = spring.coupled;
    left_.momentum = rotor.inertia * rotor.speed + step_ * rotor.applied - spring.pushed;
    left_.light = 1.0 / (rotor.inertia + step_ * rotor.damping + spring.coupled);
    left_.most = step_ * rotor.friction * left_.light;
    link_angle_ = now.angle;
    pending_ = true;
    const double free = (left_.momentum + spring.coupled * now.speed) * left_.light;
    const bool slips = std::abs(free) > left_.most;
    const double rubbed = slips ? left_.momentum - std::copysign(step_ * rotor.friction, free) : 0.0;
    acts->damping = spring.coupled * (1.0 - (slips ? spring.coupled * left_.light : 0.0)) / step_;
    acts->applied = (spring.pushed + spring.coupled * left_.light * rubbed) / step_;
  }

  /// Speed of the rotor at the end of the step that the joint has ended at this angle.
  double arrived_speed(double angle) const {
    const double speed = (angle - link_angle_) / step_;
    return braked((left_.momentum + left_.coupled * speed) * left_.light, left_.most);
  }

  /// The rotor, and what acts on it in this step: linearly implicit in the speed that its controller sees.
  PairedBody driven(const ServoMoment& now, const Held& command, bool bends) {
    const double angle = on_motor_ ? rotor_ : now.angle, speed = on_motor_ ? rotor_speed_ : now.speed;
    torque_ = drive_torque(now, command, angle, speed);
    const double slope = on_motor_ ? speed_slope(now, command, angle, speed) : 0.0;
    const double rotors = d(F::armature) * (1.0 - kLinkArmature);
    PairedBody rotor{rotors, rotor_, rotor_speed_, torque_ + slope * rotor_speed_, viscous_ + slope, 0.0};
    if (!bends) rotor.friction = friction_level(now, rotor_speed_);
    return rotor;
  }

  /// The same with a play's hard stops: while rotor and link touch the joint carries the whole rotor and what acts on
  /// it, and in the gap the rotor goes by itself, beside a joint that nothing drives.
  void turn_with_stops(const ServoMoment& now, const Held& command, bool bends, ServoActs* acts) {
    const double half = 0.5 * d(F::backlash), inertia = d(F::armature) * (1.0 - kLinkArmature);
    const double twist = rotor_ - now.angle;
    double meets = 0.0;  // momentum that the joint gets
    if (side_ != 0.0) {  // unless the stop had to pull
      const double kept = inertia * (now.speed - rotor_speed_) / step_;
      const double given = pushed_ + now.rubbed - rubs_ * now.speed - kept;
      rotor_ = now.angle + side_ * half;
      rotor_speed_ = now.speed;
      if (given * side_ < 0.0) side_ = 0.0;
    } else if (std::abs(twist) > half) {
      side_ = std::copysign(1.0, twist);
      rotor_ = now.angle + side_ * half;
      meets = inertia * (rotor_speed_ - now.speed);
    }
    const PairedBody rotor = driven(now, command, bends);
    if (side_ == 0.0) {
      rotor_speed_ = speed_alone(rotor, step_);
      rotor_ += step_ * rotor_speed_;
      acts->damping = 0.0;
      return;
    }
    pushed_ = rotor.applied;
    rubs_ = rotor.damping;
    *acts = {pushed_ + meets / step_, rubs_, rotor.friction, d(F::armature)};
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
  std::vector<Late> late_;  ///< of the steps after a row
  double step_, row_step_, rate_;
  bool torque_command_ = false, has_rotor_ = false, on_motor_ = false, limited_ = false;
  double spring_rub_ = 0.0;
  double feedback_ = 0.0;  ///< [Nm s/rad] damping that the controller makes, within the largest torque
  // What the joint carries from step to step.
  double integral_ = 0.0;  ///< of the command error [rad s]
  double wanted_ = 0.0;    ///< command, as the rate limit lets it follow
  double bristle_ = 0.0;   ///< presliding travel [rad]
  double rotor_ = 0.0, rotor_speed_ = 0.0;
  Play play_;                                      ///< between rotor and link, of a joint apart
  double side_ = 0.0, pushed_ = 0.0, rubs_ = 0.0;  ///< of a play of the whole arm: as `Play`, and what acted on it
  /// Of a spring's step that has begun: what decides the rotor's speed when the link's is known.
  struct Begun {
    double momentum = 0.0, coupled = 0.0, light = 0.0, most = 0.0;
  } left_;
  bool pending_ = false;
  double link_angle_ = 0.0;
  double torque_ = 0.0;                        ///< of the drive, in the step before
  double gain_seen_ = 1.0, gain_power_ = 1.0;  ///< of the firmware, last seen, and what it multiplies by
  // What holds until the next row.
  bool on_ = true;
  double enabled_part_ = 1.0, gain_factor_ = 1.0, supply_factor_ = 1.0, warmth_factor_ = 1.0, viscous_ = 0.0;
};

}  // namespace truing::dynamics
