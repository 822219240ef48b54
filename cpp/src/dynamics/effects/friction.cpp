// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Friction in joints and gears.

#include <cmath>

#include "dynamics/effects/families.hpp"
#include "dynamics/laws.hpp"
#include "dynamics/prepare.hpp"
#include "dynamics/turn.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;

double per_speed(const Robot& robot, const MotionRange& range, std::size_t joint) {
  return torque_prior(range, joint) / fastest_of(robot, range, joint);
}

auto speed(const Motion& motion, std::size_t joint) { return motion.qd.col(static_cast<Index>(joint)).array(); }
auto direction(const Motion& motion, std::size_t joint) {
  return motion.direction.col(static_cast<Index>(joint)).array();
}

const char* const kCoulomb = "coulomb";
const char* const kTurnSpeed = "turn_speed";
const char* const kTurnTravel = "turn_travel";
const char* const kTurnFade = "turn_fade";

/// The direction is that of the motion, which knows how friction turns; the term's constants say it.
TorqueForm coulomb_turning(const Robot& robot, std::size_t joint, const FrictionTurn& turn, double prior) {
  TorqueTerm term = term_at(joint, parameter_name(kCoulomb, robot, joint), torque_unit(robot, joint), prior,
                            [joint](const Motion& m, Phi phi) { phi = direction(m, joint); });
  const bool by_travel = turn.travel > 0.0;
  term.constants[parameter_name(kCoulomb, robot, joint, by_travel ? kTurnTravel : kTurnSpeed)] =
      by_travel ? turn.travel : turn.speed;
  if (by_travel && turn.fade > 0.0) term.constants[parameter_name(kCoulomb, robot, joint, kTurnFade)] = turn.fade;
  return {term};
}

std::vector<TorqueForm> coulomb(const Robot& robot, std::size_t joint, const MotionRange& range) {
  return {coulomb_turning(robot, joint, range.turns[joint], torque_prior(range, joint))};
}

TorqueForm coulomb_with(const Robot& robot, std::size_t joint, const std::map<std::string, double>&) {
  return coulomb_turning(robot, joint, turns_of(robot)[joint], 1.0);
}

std::vector<TorqueForm> viscous(const Robot& robot, std::size_t joint, const MotionRange& range) {
  return {{undirected(term_at(
      joint, parameter_name("viscous", robot, joint), torque_unit(robot, joint) + " s/" + angle_unit(robot, joint),
      per_speed(robot, range, joint), [joint](const Motion& m, Phi phi) { phi = speed(m, joint); }))}};
}

// --- laws of the speed beside Coulomb's and the linear one

const char* const kLaw = "viscous_law";

TorqueForm saturating_with(const Robot& robot, std::size_t joint, double v0, double prior) {
  TorqueTerm term = term_at(joint, parameter_name(kLaw, robot, joint, "saturating"), torque_unit(robot, joint), prior,
                            [joint, v0](const Motion& m, Phi phi) { phi = tangents(speed(m, joint) / v0); });
  term.constants[parameter_name(kLaw, robot, joint, "v0")] = v0;
  return {within(undirected(std::move(term)), 0.0)};  // friction that falls is Stribeck's
}

std::vector<TorqueForm> viscous_law(const Robot& robot, std::size_t joint, const MotionRange& range) {
  const double torque = torque_prior(range, joint);
  const double fastest = fastest_of(robot, range, joint);
  const std::string unit = torque_unit(robot, joint), angle = angle_unit(robot, joint);
  std::vector<TorqueForm> out;
  out.push_back(
      {undirected(term_at(joint, parameter_name(kLaw, robot, joint, "quadratic"), unit + " s^2/" + angle + "^2",
                          torque / (fastest * fastest),
                          [joint](const Motion& m, Phi phi) { phi = speed(m, joint) * speed(m, joint).abs(); }))});
  out.push_back({undirected(term_at(joint, parameter_name(kLaw, robot, joint, "cubic"), unit + " s^3/" + angle + "^3",
                                    torque / std::pow(fastest, 3.0),
                                    [joint](const Motion& m, Phi phi) { phi = speed(m, joint).cube(); }))});
  out.push_back(
      {within(term_at(joint, parameter_name(kLaw, robot, joint, "root"), unit + " (s/" + angle + ")^0.5",
                      torque / std::sqrt(fastest),
                      [joint](const Motion& m, Phi phi) { phi = direction(m, joint) * speed(m, joint).abs().sqrt(); }),
              0.0)});
  for (const double part : {0.05, 0.15, 0.4, 1.0}) out.push_back(saturating_with(robot, joint, part * fastest, torque));
  return out;
}

TorqueForm viscous_law_with(const Robot& robot, std::size_t joint, const std::map<std::string, double>& constants) {
  return saturating_with(robot, joint, constant_of(constants, parameter_name(kLaw, robot, joint, "v0")), 1.0);
}

// --- Stribeck 1902: friction falls from stiction to Coulomb's as the joint gets faster

/// Slope by which size * exp(-(v / vs)^2) falls where it does so fastest, at vs / sqrt(2).
double steepest(double size, double vs) { return size * std::sqrt(2.0) * std::exp(-0.5) / vs; }

// Where the linear drag grows by more than the curve falls, friction falls nowhere: a curve of drag that is not linear
// may look the same.
TorqueForm stribeck_at(const Robot& robot, std::size_t joint, double vs, double prior) {
  TorqueTerm term = term_at(joint, parameter_name("stribeck", robot, joint), torque_unit(robot, joint), prior,
                            [joint, vs](const Motion& m, Phi phi) {
                              phi = direction(m, joint) * exponentials(-(speed(m, joint) / vs).square());
                            });
  term.constants[parameter_name("stribeck", robot, joint, "vs")] = vs;
  term.may_as_well_be = [vs, own = term.parameter, drag = parameter_name("viscous", robot, joint)](
                            const std::map<std::string, double>& values) -> std::string {
    const auto at = values.find(drag);
    const bool falls = at == values.end() || steepest(values.at(own), vs) > at->second;
    return falls ? "" : kLaw;
  };
  return {within(std::move(term), 0.0)};
}

std::vector<TorqueForm> stribeck(const Robot& robot, std::size_t joint, const MotionRange& range) {
  std::vector<TorqueForm> out;
  const double unit = is_revolute(robot, joint) ? 1.0 : kDrum;
  for (const double turning : {0.02, 0.05, 0.12, 0.3, 0.7}) {
    const double vs = unit * turning;
    if (vs < 0.5 * range.speed[static_cast<Index>(joint)])
      out.push_back(stribeck_at(robot, joint, vs, torque_prior(range, joint)));
  }
  if (out.empty()) throw Unsuited("the joint is too slow to leave the range of stiction");
  return out;
}

TorqueForm stribeck_with(const Robot& robot, std::size_t joint, const std::map<std::string, double>& constants) {
  return stribeck_at(robot, joint, constant_of(constants, parameter_name("stribeck", robot, joint, "vs")), 1.0);
}

// --- presliding: the stop operator of the travelled angle (Prandtl 1928): friction builds up over x0 after a reversal
// --

TorqueForm presliding_at(const Robot& robot, std::size_t joint, double x0, double prior) {
  TorqueTerm term = term_at(
      joint, parameter_name("presliding", robot, joint), torque_unit(robot, joint), prior,
      [joint, x0](const Motion& m, Phi phi) { phi = stop_operator(m.q.col(static_cast<Index>(joint)), x0).array(); });
  term.constants[parameter_name("presliding", robot, joint, "x0")] = x0;
  return {within(undirected(std::move(term)), 0.0)};
}

std::vector<TorqueForm> presliding(const Robot& robot, std::size_t joint, const MotionRange& range) {
  std::vector<TorqueForm> out;
  const double travel = range.upper[static_cast<Index>(joint)] - range.lower[static_cast<Index>(joint)];
  const double unit = is_revolute(robot, joint) ? 1.0 : kDrum;
  for (const double turned : {2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 3e-2}) {
    const double x0 = unit * turned;
    if (x0 < 0.1 * travel) out.push_back(presliding_at(robot, joint, x0, torque_prior(range, joint)));
  }
  if (out.empty()) throw Unsuited("the joint travels too little");
  return out;
}

TorqueForm presliding_with(const Robot& robot, std::size_t joint, const std::map<std::string, double>& constants) {
  return presliding_at(robot, joint, constant_of(constants, parameter_name("presliding", robot, joint, "x0")), 1.0);
}

// --- friction that is not a function of the speed alone

std::vector<TorqueForm> asymmetric(const Robot& robot, std::size_t joint, const MotionRange& range) {
  return {
      {undirected(term_at(joint, parameter_name("asymmetric_friction", robot, joint),
                          torque_unit(robot, joint) + " s/" + angle_unit(robot, joint), per_speed(robot, range, joint),
                          [joint](const Motion& m, Phi phi) { phi = speed(m, joint).abs(); }))}};
}

// Gears lose a part of what they carry (Hamon, Gautier and Garrec 2011): of what their motor gives, or of what their
// link takes.
std::vector<TorqueForm> load_friction(const Robot& robot, std::size_t joint, const MotionRange&) {
  const auto of = [&](const std::string& parameter, MatrixXd Motion::* load) -> TorqueForm {
    const auto column = [joint, load](const Motion& m, Phi phi) {
      phi = direction(m, joint) * (m.*load).col(static_cast<Index>(joint)).array().abs();
    };
    return {within(term_at(joint, parameter, "-", 0.3, column, true), 0.0, 0.6)};
  };
  return {of(parameter_name("load_friction", robot, joint), &Motion::torque),
          of(parameter_name("load_friction", robot, joint, "links"), &Motion::carried)};
}

std::vector<TorqueForm> position_friction(const Robot& robot, std::size_t joint, const MotionRange& range) {
  if (!is_revolute(robot, joint)) throw Unsuited("a prismatic joint does not turn");
  const double prior = 0.3 * torque_prior(range, joint);
  const auto angle = [joint](const Motion& m) { return m.q.col(static_cast<Index>(joint)); };
  return {{term_at(joint, parameter_name("position_friction", robot, joint, "sin"), "Nm", prior,
                   [=](const Motion& m, Phi phi) { phi = direction(m, joint) * sines(angle(m)); }),
           term_at(joint, parameter_name("position_friction", robot, joint, "cos"), "Nm", prior,
                   [=](const Motion& m, Phi phi) { phi = direction(m, joint) * cosines(angle(m)); })}};
}

TorqueTraits traits(const char* plain, SimulatorPlace mujoco, SimulatorPlace urdf, EffectDocumentation documentation) {
  TorqueTraits out;
  out.family = TorqueFamily::friction;
  out.mujoco = mujoco;
  out.urdf = urdf;
  out.plain = plain;
  out.documentation = std::move(documentation);
  return out;
}

}  // namespace

std::vector<FrictionTurn> turns_of(const Robot& robot) {
  std::vector<FrictionTurn> out(robot.driven_count());
  for (std::size_t joint = 0; joint < out.size(); ++joint) {
    const std::string speed = parameter_name(kCoulomb, robot, joint, kTurnSpeed);
    const std::string travel = parameter_name(kCoulomb, robot, joint, kTurnTravel);
    const std::string fade = parameter_name(kCoulomb, robot, joint, kTurnFade);
    for (const AppliedEffect& effect : robot.torque_effects) {
      if (effect.parameters.count(speed) > 0) out[joint].speed = constant_of(effect.parameters, speed);
      if (effect.parameters.count(travel) > 0) out[joint].travel = constant_of(effect.parameters, travel);
      if (effect.parameters.count(fade) > 0) out[joint].fade = constant_of(effect.parameters, fade);
    }
  }
  return out;
}

std::vector<TorqueEffect> friction_effects() {
  using Place = SimulatorPlace;
  std::vector<TorqueEffect> out;
  out.push_back(
      {"coulomb", "friction of one size, against the motion", coulomb, true,
       traits("dry friction", Place::field, Place::field,
              {"s = tanh(qd / turn_speed), or s <- clip(s + dq / turn_travel, -1, 1), which remembers at rest "
               "where it came from, for ever or fading by s / turn_fade a second",
               "`coulomb.J2` [Nm] with `.turn_speed` [rad/s] or `.turn_travel` [rad], `.turn_fade` [s]",
               "motion both ways"}),
       coulomb_with});
  out.push_back({"viscous", "friction that grows with the speed", viscous, true,
                 traits("viscous friction", Place::field, Place::field, {"qd", "`viscous.J2` [Nm s/rad]", "speed"})});
  for (TorqueEffect& effect : out) effect.traits.standard = effect.traits.usual = true;
  out.push_back({"viscous_law", "friction that grows faster, or slower, than the speed", viscous_law, true,
                 traits("friction that is not linear in the speed", Place::field, Place::none,
                        {"qd abs(qd); or qd^3; or s sqrt(abs(qd)); or tanh(qd / v0)",
                         "`viscous_law.J2.quadratic`, `.cubic`, `.root` or `.saturating` with `.v0` [rad/s]",
                         "slow and fast motion"}),
                 viscous_law_with});
  out.push_back({"stribeck", "friction that falls from stiction as the joint gets faster", stribeck, true,
                 traits("stiction that fades with speed", Place::extra_element, Place::none,
                        {"s exp(-(qd / vs)^2)", "`stribeck.J2` [Nm], `.vs` [rad/s]", "slow and fast motion"}),
                 stribeck_with});
  out.push_back({"presliding", "friction that builds up over a small angle after a reversal", presliding, true,
                 traits("friction that builds up after a reversal", Place::extra_element, Place::none,
                        {"z <- clip(z + dq / x0, -1, 1)", "`presliding.J2` [Nm], `.x0` [rad]", "reversals"}),
                 presliding_with});
  out.push_back({"asymmetric_friction", "friction that differs between the directions", asymmetric, true,
                 traits("friction that differs between the directions", Place::callback, Place::none,
                        {"abs(qd)", "`asymmetric_friction.J2` [Nm s/rad]", "motion both ways"})});
  out.push_back({"load_friction", "friction that grows with the load that the gear carries", load_friction, true,
                 traits("friction that grows with the load", Place::callback, Place::none,
                        {"s abs(tau), tau the whole torque that the model predicts, or what the links take of it",
                         "`load_friction.J2` or `load_friction.J2.links` [-]", "two loads, or gravity that changes"})});
  out.push_back({"position_friction", "friction that changes over a turn of the joint", position_friction, true,
                 traits("friction that changes with the joint's angle", Place::callback, Place::none,
                        {"s sin q, s cos q", "`position_friction.J2.sin`, `.cos` [Nm]", "a wide range of angles"})});
  return out;
}

}  // namespace truing::dynamics
