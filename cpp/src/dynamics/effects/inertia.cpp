// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Masses: links, rotors, payload, and which way they weigh.

#include <algorithm>
#include <cmath>

#include "dynamics/effects/families.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/regressor.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr const char* kParts[kLinkParameters] = {"m", "mx", "my", "mz", "xx", "yy", "zz", "xy", "xz", "yz"};

/// A column of the rigid chain, at the joints that feel the link.
TorqueTerm rigid_term(const RigidChain& chain, std::string parameter, int part, std::size_t link, double prior) {
  TorqueTerm term;
  term.parameter = std::move(parameter);
  term.unit = part == 0 ? "kg" : part < 4 ? "kg m" : "kg m^2";
  for (Index j = 0; j < chain.driven(); ++j) {
    const std::vector<Index>& felt = chain.felt_links(j);
    if (std::find(felt.begin(), felt.end(), static_cast<Index>(link)) != felt.end())
      term.joints.push_back(static_cast<std::size_t>(j));
  }
  term.prior = prior;
  const Index column = kLinkParameters * static_cast<Index>(link) + part;
  term.link_parameter = static_cast<int>(column);
  term.basis = [column, joints = term.joints](const Motion& m) {
    MatrixXd out(m.rows(), static_cast<Index>(joints.size()));
    for (std::size_t k = 0; k < joints.size(); ++k) out.col(static_cast<Index>(k)) = m.rigid[joints[k]].col(column);
    return out;
  };
  return term;
}

/// [m] what the robot would reach if it were one long line.
double stretched(const Robot& robot) {
  double length = 0.0;
  for (const Joint& joint : robot.joints)
    length += std::hypot(joint.a, joint.d) + joint.T_parent_joint.translation().norm();
  return std::max(length, 0.1);
}

/// Sizes by which a link may differ from its file: of its own mass or of a usual one, over a link's length.
struct Size {
  double mass = 1.0, length = 0.2;
  double of(int part) const { return mass * std::pow(length, part == 0 ? 0 : part < 4 ? 1 : 2); }
};
Size size_of_link(const Robot& robot, std::size_t link) {
  double total = 0.0;
  for (const Joint& joint : robot.joints) total += joint.mass.value_or(0.0);
  const auto links = static_cast<double>(robot.joints.size());
  Size out;
  out.mass = std::max({0.5 * robot.joints[link].mass.value_or(0.0), 0.2 * total / links, 0.01});
  out.length = std::max(0.05, 0.4 * stretched(robot) / links);
  return out;
}

std::vector<TorqueForm> link_inertia(const Robot& robot, std::size_t joint, const MotionRange&) {
  const std::size_t link = robot.driven_joints()[joint];
  const Size size = size_of_link(robot, link);
  const RigidChain chain(robot);
  TorqueForm form;
  for (int part = 0; part < kLinkParameters; ++part)
    form.push_back(
        rigid_term(chain, parameter_name("link_inertia", robot, joint, kParts[part]), part, link, size.of(part)));
  return {form};
}

std::vector<TorqueForm> payload(const Robot& robot, std::size_t, const MotionRange&) {
  const std::size_t last = robot.joints.size() - 1;
  double total = 0.0;
  for (const Joint& joint : robot.joints) total += joint.mass.value_or(0.0);
  const Size size{std::max(0.1 * total, 0.05), std::max(0.05, 0.1 * stretched(robot))};
  const RigidChain chain(robot);
  // A small load is a mass at a place, a large one has an inertia as well.
  std::vector<TorqueForm> forms;
  for (const int parts : {4, static_cast<int>(kLinkParameters)}) {
    TorqueForm form;
    for (int part = 0; part < parts; ++part)
      form.push_back(rigid_term(chain, std::string("payload.") + kParts[part], part, last, size.of(part)));
    form.front().least = 0.0;
    forms.push_back(std::move(form));
  }
  return forms;
}

/// What a robot carries it has in every recording, also where nothing hangs at it.
bool carries(const Robot& robot, const std::string& name) {
  return std::any_of(robot.torque_effects.begin(), robot.torque_effects.end(),
                     [&](const AppliedEffect& applied) { return applied.effect == name; });
}

std::vector<TorqueForm> payload_place(const Robot& robot, std::size_t, const MotionRange& range) {
  const auto stated = range.columns.find(kPayload);
  const bool known = stated != range.columns.end() && stated->second.second > 0.0 && !payload_was_found(range);
  if (!known && !carries(robot, "payload_place"))
    throw MissingColumn("needs the column payload_kg, a payload of known mass");
  TorqueForm form;
  for (int axis = 0; axis < 3; ++axis) {
    TorqueTerm term;
    term.parameter = std::string("payload_place.") + "xyz"[axis];
    term.unit = "m";
    for (std::size_t j = 0; j < robot.driven_count(); ++j) term.joints.push_back(j);
    term.prior = 0.1;
    term.basis = [axis](const Motion& m) { return payload_shifted(m, axis); };
    form.push_back(std::move(term));
  }
  return {form};
}

/// What the torques change by when the base turns by a small angle about one of its axes: gravity g becomes
/// g - axis x g in it, and torques are linear in gravity. shape=(rows, joints)
MatrixXd weight_turned(const Motion& m, int axis) {
  Robot turned = *m.robot;
  turned.gravity = -Eigen::Vector3d::Unit(axis).cross(m.robot->gravity);
  return RigidChain(turned).weights(m.q, m.bodies);
}

// A base that does not stand as the file has it. About the vertical nothing changes.
std::vector<TorqueForm> base_tilt(const Robot& robot, std::size_t, const MotionRange&) {
  if (link_parameters(robot).isZero()) throw Unsuited("the links' masses are not known");
  if (robot.gravity.isZero()) throw Unsuited("there is no gravity");
  Index vertical = 0;
  robot.gravity.cwiseAbs().maxCoeff(&vertical);
  TorqueForm form;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == vertical) continue;
    TorqueTerm term;
    term.parameter = std::string("base_tilt.") + "xyz"[axis];
    term.unit = "rad";
    for (std::size_t j = 0; j < robot.driven_count(); ++j) term.joints.push_back(j);
    term.prior = 0.02;
    term.needs_torque = true;  // of the links as the fit has them
    term.needs_rigid = term.needs_direction = false;
    term.basis = [axis](const Motion& m) { return weight_turned(m, axis); };
    form.push_back(within(std::move(term), -0.5, 0.5));  // beyond that a base is mounted otherwise, not tilted
  }
  return {form};
}

std::vector<TorqueForm> armature(const Robot& robot, std::size_t joint, const MotionRange& range) {
  const auto at = static_cast<Index>(joint);
  const double prior = std::max(range.torque[at], 1e-3) / std::max(range.acceleration[at], 0.1);
  return {{within(
      undirected(term_at(joint, parameter_name("armature", robot, joint), is_revolute(robot, joint) ? "kg m^2" : "kg",
                         prior, [at](const Motion& m, Phi phi) { phi = m.qdd.col(at).array(); })),
      0.0)}};
}

}  // namespace

std::vector<TorqueEffect> inertia_effects() {
  std::vector<TorqueEffect> out;
  TorqueTraits traits;
  traits.family = TorqueFamily::inertia;
  traits.mujoco = SimulatorPlace::field;
  traits.urdf = SimulatorPlace::field;
  traits.plain = "mass, centre of mass or inertia of the link";
  traits.standard = traits.usual = true;
  traits.documentation = {"the column of the link's inertial parameter",
                          "`link_inertia.J2.m` [kg], `.mx` … [kg m], `.xx` … [kg m²]: what the link's differ by",
                          "motion of the joints before it"};
  out.push_back({"link_inertia", "mass, centre of mass and inertia of a link are other than in the file", link_inertia,
                 true, traits});
  traits.standard = traits.usual = false;
  traits.plain = "a load at the flange";
  traits.documentation = {"the last link's columns",
                          "`payload.m` [kg], `.mx .my .mz` [kg m], of a large load `.xx` … [kg m²]",
                          "a robot whose links are known"};
  out.push_back({"payload", "a load at the flange that the model does not have", payload, false, traits});
  traits.mujoco = traits.urdf = SimulatorPlace::none;  // it hangs there while it is recorded
  traits.plain = "another place of the known load";
  traits.documentation = {"the last link's columns times `payload_kg`",
                          "`payload_place.x`, `.y`, `.z` [m] in the tool's frame, from where the recording has it",
                          "a column `payload_kg`"};
  out.push_back({"payload_place", "the centre of mass of the payload that is known is elsewhere than stated",
                 payload_place, false, traits});
  traits.family = TorqueFamily::gravity;
  traits.mujoco = SimulatorPlace::field;
  traits.plain = "a tilted base";
  traits.documentation = {"change of the links' weight when the base turns: gravity g - axis x g",
                          "`base_tilt.x`, `.y`, `.z` [rad] about the base's axes that are not vertical",
                          "links whose masses are known"};
  out.push_back({"base_tilt", "the base does not stand as the file has it", base_tilt, false, traits});
  traits.family = TorqueFamily::inertia;
  traits.usual = true;
  traits.plain = "inertia of the motor's rotor";
  traits.urdf = SimulatorPlace::none;
  traits.documentation = {"qdd", "`armature.J2` [kg m²], as the joint feels it", "accelerations"};
  out.push_back({"armature", "inertia of the motor's rotor and gear", armature, true, traits});
  return out;
}

}  // namespace truing::dynamics
