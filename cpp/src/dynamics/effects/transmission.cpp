// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Gears, belts, springs: what one joint does to another, and what a turn of the joint repeats.

#include <algorithm>
#include <cmath>

#include "dynamics/effects/families.hpp"
#include "dynamics/filter.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/regressor.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// --- a joint's motor that carries, or is carried by, another's

std::vector<TorqueForm> coupling(const Robot& robot, std::size_t joint, const MotionRange& range) {
  std::vector<TorqueForm> out;
  for (std::size_t k = 0; k < robot.driven_count(); ++k) {
    if (k == joint) continue;
    const auto other = static_cast<Index>(k);
    const std::string name = parameter_name("coupling", robot, joint) + "." + driven_name(robot, k) + ".";
    const double torque = 0.3 * torque_prior(range, joint);
    const std::string unit = torque_unit(robot, joint);
    out.push_back(
        {term_at(joint, name + "coulomb", unit, torque,
                 [other](const Motion& m, Phi phi) { phi = m.direction.col(other).array(); }),
         undirected(term_at(joint, name + "viscous", unit + " s/" + angle_unit(robot, k),
                            torque / std::max(range.speed[other], 0.01),
                            [other](const Motion& m, Phi phi) { phi = m.qd.col(other).array(); })),
         undirected(term_at(joint, name + "inertia", "kg m^2", torque / std::max(range.acceleration[other], 0.1),
                            [other](const Motion& m, Phi phi) { phi = m.qdd.col(other).array(); }))});
  }
  if (out.empty()) throw Unsuited("there is no other joint");
  return out;
}

// --- what repeats with the joint's turn

std::vector<TorqueForm> ripple(const Robot& robot, std::size_t joint, const MotionRange& range) {
  if (!is_revolute(robot, joint)) throw Unsuited("a prismatic joint does not turn");
  const auto at = static_cast<Index>(joint);
  const double travel = range.upper[at] - range.lower[at];
  std::vector<TorqueForm> out;
  for (const int k : {1, 2, 3, 4, 6, 8, 12, 16, 24}) {
    const bool seen = k * travel >= 3.14;  // less than half a wave is no wave, but may be what something else is
    if (!seen && k > 2) continue;
    const std::string name = parameter_name("ripple", robot, joint);
    const double prior = 0.2 * torque_prior(range, joint);
    out.push_back({term_at(joint, name + ".sin" + std::to_string(k), "Nm", prior,
                           [at, k](const Motion& m, Phi phi) { phi = sines(k * m.q.col(at)); }),
                   term_at(joint, name + ".cos" + std::to_string(k), "Nm", prior,
                           [at, k](const Motion& m, Phi phi) { phi = cosines(k * m.q.col(at)); })});
    for (TorqueTerm& term : out.back()) {
      term.only_alternative = !seen;
      term.needs_direction = false;
    }
  }
  return out;
}

std::vector<TorqueForm> spring(const Robot& robot, std::size_t joint, const MotionRange& range) {
  const auto at = static_cast<Index>(joint);
  const double travel = std::max(range.upper[at] - range.lower[at], 1e-3);
  return {{undirected(
      term_at(joint, parameter_name("spring", robot, joint), torque_unit(robot, joint) + "/" + angle_unit(robot, joint),
              torque_prior(range, joint) / travel, [at](const Motion& m, Phi phi) { phi = m.q.col(at).array(); }))}};
}

// --- the link is not where the motor is

/// A term that all joints' torques have.
TorqueTerm of_all_joints(const Robot& robot, std::string parameter, std::string unit, double prior) {
  if (link_parameters(robot).isZero()) throw Unsuited("the links' masses are not known");
  TorqueTerm term;
  term.parameter = std::move(parameter);
  term.unit = std::move(unit);
  term.prior = prior;
  term.needs_rigid = term.needs_direction = false;
  for (std::size_t j = 0; j < robot.driven_count(); ++j) term.joints.push_back(j);
  return term;
}

// A drive that gives way (Spong 1987): the link stands tau / K behind the motor.
std::vector<TorqueForm> joint_elasticity(const Robot& robot, std::size_t joint, const MotionRange& range) {
  TorqueTerm term = of_all_joints(robot, parameter_name("joint_elasticity", robot, joint),
                                  is_revolute(robot, joint) ? "rad/Nm" : "m/N", 5e-3 / torque_prior(range, joint));
  term.needs_torque = term.needs_yielding = true;
  term.basis = [joint](const Motion& m) { return m.yielding[joint]; };
  return {{within(std::move(term), 0.0)}};  // a link stands behind its motor
}

// --- play

/// Where the link stands in a play, ahead of its middle. While the motor carries the link it stands on the side that
/// the load pushes it to, behind the motor of one above zero; when the load turns round, the link flies freely, with
/// the acceleration -load / inertia relative to the motor, until it meets the other side and stays there (Nordin and
/// Gutman, Controlling mechanical systems with backlash, Automatica 38, 2002; an impact without rebound).
VectorXd flight_in_play(const VectorXd& load, const VectorXd& inertia, double play, double step) {
  constexpr int kStepsOfARow = 8;  // of a row: a flight may take less than one
  const double side = 0.5 * play, h = step / kStepsOfARow;
  VectorXd out(load.size());
  double place = 0.0, speed = 0.0;
  bool on_side = true;
  if (load.size() > 0) out[0] = place = load[0] > 0.0 ? -side : side;
  for (Index i = 1; i < load.size(); ++i) {
    out[i] = place;
    const bool is_held = on_side && place * load[i - 1] <= 0.0 && place * load[i] <= 0.0;
    if (is_held) continue;
    const double before = -load[i - 1] / inertia[i], more = -(load[i] - load[i - 1]) / inertia[i];
    for (int part = 0; part < kStepsOfARow; ++part) {
      const double pull = before + (part + 0.5) / kStepsOfARow * more;
      place += h * (speed + 0.5 * h * pull);
      speed += h * pull;
      if (std::abs(place) < side) continue;
      place = std::copysign(side, place);
      speed = 0.0;
    }
    on_side = speed == 0.0 && std::abs(place) == side;
    out[i] = place;
  }
  return out;
}

const char* const kCrossed = "crossed";
const char* const kBefore = "before";
constexpr double kLeastInertia = 1e-9;  ///< [kg m^2] a link that has none flies at once

// The link falls out of the motor's torque for as long as it flies, and its impact gives back at once what was missed.
// The load is that of the links: friction is the motor's. `crossed` is the play whose flights the column has, and which
// is scaled to the play that is found; `before` the part of the inertia at the joint that is the rotor's and stays with
// the motor.
TorqueForm backlash_over(const Robot& robot, std::size_t joint, double crossed, double before, double prior) {
  const auto at = static_cast<Index>(joint);
  TorqueTerm term = of_all_joints(robot, parameter_name("backlash", robot, joint), angle_unit(robot, joint), prior);
  term.needs_torque = term.needs_inertia = true;
  term.basis = [=](const Motion& m) -> MatrixXd {
    const MatrixXd& inertia = m.inertia[joint];
    const VectorXd load = m.carried.col(at) - before * inertia.col(at).cwiseProduct(m.qdd.col(at));
    if (load.minCoeff() > 0.0 || load.maxCoeff() < 0.0) return {};  // it lies on one side
    const VectorXd of_link = (1.0 - before) * inertia.col(at);
    const VectorXd place = flight_in_play(load, of_link.cwiseMax(kLeastInertia), crossed, m.step);
    const VectorXd pull = rate_of(rate_of(place, m.step), m.step).col(0) / crossed;
    MatrixXd out = MatrixXd::Zero(m.rows(), inertia.cols());
    for (Index i = 0; i < pull.size(); ++i) {
      if (pull[i] == 0.0) continue;  // it is carried, in all but few rows
      out.row(i) = pull[i] * inertia.row(i);
      out(i, at) = pull[i] * of_link[i];
    }
    return out;
  };
  term.constants[parameter_name("backlash", robot, joint, kCrossed)] = crossed;
  if (before > 0.0) term.constants[parameter_name("backlash", robot, joint, kBefore)] = before;
  return {within(std::move(term), 0.4 * crossed, 2.5 * crossed)};
}

std::vector<TorqueForm> backlash(const Robot& robot, std::size_t joint, const MotionRange&) {
  std::vector<TorqueForm> out;
  for (const double before : {0.0, 0.3}) {
    for (const double crossed : {2e-3, 4e-3, 8e-3, 16e-3, 32e-3})
      out.push_back(backlash_over(robot, joint, crossed, before, crossed));
  }
  return out;
}

TorqueForm backlash_with(const Robot& robot, std::size_t joint, const std::map<std::string, double>& constants) {
  const std::string play = parameter_name("backlash", robot, joint);
  const std::string crossed = parameter_name("backlash", robot, joint, kCrossed);
  const auto before = constants.find(parameter_name("backlash", robot, joint, kBefore));
  return backlash_over(robot, joint, constant_of(constants, constants.count(crossed) > 0 ? crossed : play),
                       before == constants.end() ? 0.0 : before->second, 1.0);
}

// --- what pulls at the tool

/// J^T f of a force of one along an axis of the base at the tool. A mass of one there that gravity of one pulls the
/// other way, at rest, asks the same torques of the drives.
MatrixXd held_against(const Motion& m, int axis) {
  Robot robot = *m.robot;
  robot.gravity = Eigen::Vector3d::Unit(axis);
  VectorXd mass = VectorXd::Zero(kLinkParameters * static_cast<Index>(robot.joints.size()));
  mass[mass.size() - kLinkParameters] = 1.0;
  if (!robot.targets.empty())
    mass.segment<3>(mass.size() - kLinkParameters + 1) = robot.targets[0].T_last_target.translation();
  return RigidChain(robot).weights(m.q, mass);
}

// A cable or hose: a constant force at the tool.
std::vector<TorqueForm> tool_force(const Robot& robot, std::size_t, const MotionRange& range) {
  TorqueForm form;
  const double prior = 0.1 * std::max(range.torque.size() > 0 ? range.torque.maxCoeff() : 1.0, 1.0);
  for (int axis = 0; axis < 3; ++axis) {
    TorqueTerm term;
    term.parameter = std::string("tool_force.") + "xyz"[axis];
    term.unit = "N";
    term.prior = prior;
    term.needs_rigid = term.needs_direction = false;
    for (std::size_t j = 0; j < robot.driven_count(); ++j) term.joints.push_back(j);
    term.basis = [axis](const Motion& m) { return held_against(m, axis); };
    form.push_back(std::move(term));
  }
  return {form};
}

}  // namespace

std::vector<TorqueEffect> transmission_effects() {
  std::vector<TorqueEffect> out;
  TorqueTraits traits;
  traits.family = TorqueFamily::coupling;
  traits.mujoco = SimulatorPlace::extra_element;
  traits.plain = "another joint's motor acts on this one";
  traits.documentation = {"s, qd and qdd of another joint",
                          "`coupling.J5.J6.coulomb` [Nm], `.viscous` [Nm s/rad], `.inertia` [kg m²]",
                          "joints that move apart from each other"};
  out.push_back({"coupling", "motion of another joint acts on this one: shared gears, belts through the arm", coupling,
                 true, traits});
  traits.family = TorqueFamily::transmission;
  traits.plain = "a torque that repeats with the joint's turn";
  traits.documentation = {"sin kq, cos kq", "`ripple.J2.sin2`, `.cos2` [Nm]", "half a wave of travel"};
  out.push_back(
      {"ripple", "a torque that repeats with the joint's turn: cogging, an uneven gear", ripple, true, traits});
  traits.family = TorqueFamily::gravity;
  traits.mujoco = SimulatorPlace::field;
  traits.plain = "a spring at the joint";
  traits.documentation = {"q", "`spring.J2` [Nm/rad]", "a wide range of angles"};
  out.push_back({"spring", "a spring, or cables that act like one", spring, true, traits});
  traits.family = TorqueFamily::transmission;
  traits.mujoco = SimulatorPlace::extra_element;
  traits.plain = "a drive that gives way";
  traits.documentation = {"change of the torques when the link stands tau behind the motor",
                          "`joint_elasticity.J2` [rad/Nm]", "two encoders, or fast motion"};
  out.push_back({"joint_elasticity", "gear or belt gives way under torque", joint_elasticity, true, traits});
  traits.plain = "play";
  traits.documentation = {"M_j e'', e: where the link stands in the play, on a side or in free flight, -load / M_jj",
                          "`backlash.J2` [rad] with `.crossed` [rad], `.before` [-]", "a load that turns round"};
  out.push_back({"backlash", "play between motor and link", backlash, true, traits, backlash_with});
  traits.family = TorqueFamily::gravity;
  traits.plain = "a force at the tool";
  traits.documentation = {"J^T f", "`tool_force.x .y .z` [N], in the base's axes", "several postures"};
  out.push_back({"tool_force", "a force at the tool: a cable, a hose", tool_force, false, traits});
  return out;
}

}  // namespace truing::dynamics
