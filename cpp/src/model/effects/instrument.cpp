// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What is not the robot: the metre and the clocks of what measures it.

#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"

namespace truing::model {
namespace {

using Eigen::Vector3d;

// The instrument's metre: x -> (1 + s) x. Stretching about the base's origin differs from stretching about
// the instrument's by a shift of the base, which is fitted anyway; and what it adds at the tip does not
// depend on where the base stands: the way from base to tip, in the last link's frame, where the targets'
// coordinates are.
std::vector<Term> scale(const Robot& robot, std::size_t, const Measurements&) {
  std::vector<std::string> targets;
  for (const Target& target : robot.targets) targets.push_back(target.name);
  if (targets.empty()) targets.push_back("tool");
  const std::size_t last = robot.joints.size() - 1;
  const Vector3d base = robot.T_measurement_base.translation();
  std::vector<Term> terms;
  for (const std::string& target : targets) {
    for (int axis = 0; axis < 3; ++axis) {
      terms.push_back(make_term(
          "scale", "-", target + "." + "xyz"[axis],
          [last, base, axis](const Inputs& in) { return in.frames[last].linear().col(axis).dot(in.tip - base); },
          true));
    }
  }
  return terms;
}

// Joints and measurement are stamped by clocks that differ by dt: every joint is read dt * speed too far
// back.
std::vector<Term> time_offset(const Robot& robot, std::size_t, const Measurements& data) {
  std::vector<Term> terms;
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (std::size_t k = 0; k < driven.size(); ++k) {
    const Joint& at = robot.joints[driven[k]];
    if (k >= data.joint_speed.size() || !data.joint_speed[k]) {
      throw MissingColumn("time_offset needs the column qd" + std::to_string(k + 1) + "_" + motion_unit(at) +
                          "_s (speed of joint " + at.name + ")");
    }
    terms.push_back(
        make_term("time_offset", "s", at.name, [k](const Inputs& in) { return in.data->joint_speed[k][in.row]; }));
  }
  return terms;
}

Effect scale_effect() {
  Effect effect{"scale", "the instrument's metre is too long or too short", scale, false};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::several;
  traits.moves = Moves::target;
  traits.of_instrument = true;
  traits.contained_in = {{"link_geometry", Containment::look_alike, ""}};
  traits.separated_by = {{Experiment::scale_bar}};
  traits.usual = 1e-4;
  traits.plausible = 5e-3;
  traits.documentation = {"s · way from base to tip, on the target", "`scale` [-]", ""};
  return effect;
}

Effect time_offset_effect() {
  Effect effect{"time_offset", "joints and measurement are stamped by clocks that differ", time_offset, false};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::speed;
  traits.of_instrument = true;
  traits.usual = 1e-3;
  traits.plausible = 0.5;
  traits.documentation = {"δt · speed, at every joint", "`time_offset` [s]", "`qd1_rad_s …`"};
  return effect;
}

}  // namespace

std::vector<Effect> instrument_effects() { return {scale_effect(), time_offset_effect()}; }

}  // namespace truing::model
