// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Axes that do not stay where they are.

#include <cmath>

#include "math/registration.hpp"
#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"

namespace truing::model {
namespace {

using Eigen::Vector3d;

// Bearing run-out: the axis tilts about the two directions across it, `order` times per turn. DH turns before its
// link, so what tilts the axis is the link before (alpha, beta), or the base; modified DH has alpha and beta
// before the joint; URDF the origin's rotations.
std::vector<Term> wobble(const std::string& name, int order, const Robot& robot, std::size_t joint) {
  const Joint& at = robot.joints.at(joint);
  require_revolute(name.c_str(), at, " and does not turn");
  // Elementary rotations there are, and what each of the two tilts is in these.
  std::vector<std::string> sites;
  Eigen::Matrix<double, 3, 2> tilts = Eigen::Matrix<double, 3, 2>::Identity();
  const auto about_any_axis = [&](const std::string& frame, const Eigen::Matrix3d& rotation, const Vector3d& axis) {
    sites = {frame + ".rx", frame + ".ry", frame + ".rz"};
    const Eigen::Matrix3d from_z = least_rotation(Vector3d::UnitZ(), axis).toRotationMatrix();
    tilts = (rotation * from_z).leftCols<2>();
  };
  switch (robot.convention) {
    case Convention::mdh:
      sites = {at.name + ".alpha", at.name + ".beta"};
      break;
    case Convention::urdf:
      about_any_axis(at.name, at.T_parent_joint.linear(), at.axis);
      break;
    case Convention::dh:
      if (joint == 0)
        about_any_axis("base", robot.T_measurement_base.linear(), Vector3d::UnitZ());
      else
        sites = {robot.joints[joint - 1].name + ".alpha", robot.joints[joint - 1].name + ".beta"};
      break;
  }
  const auto index = static_cast<Eigen::Index>(joint);
  std::vector<Term> terms;
  for (int tilt = 0; tilt < 2; ++tilt) {
    for (const bool cosine : {true, false}) {
      const std::string parameter = name + "." + at.name + (cosine ? ".cos_" : ".sin_") + "xy"[tilt];
      for (std::size_t k = 0; k < sites.size(); ++k) {
        const double share = tilts(static_cast<Eigen::Index>(k), tilt);
        if (share == 0.0 && sites.size() < 3) continue;  // of three, none stays zero when the frame turns
        terms.push_back(make_term(
            parameter, "rad", sites[k],
            [index, cosine, share, order](const Inputs& in) {
              const double angle = order * in.joints[index];
              return share * (cosine ? std::cos(angle) : std::sin(angle));
            },
            sites.size() == 3));  // the shares come from the robot's frames
      }
    }
  }
  return terms;
}

std::vector<Term> axis_wobble(const Robot& robot, std::size_t joint, const Measurements&) {
  return wobble("axis_wobble", 1, robot, joint);
}

std::vector<Term> axis_wobble_twice(const Robot& robot, std::size_t joint, const Measurements&) {
  return wobble("axis_wobble_twice", 2, robot, joint);
}

Effect axis_wobble_effect() {
  Effect effect{"axis_wobble", "the joint's axis tilts as it turns", axis_wobble};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::angle;
  traits.moves = Moves::axis;
  traits.separated_by = {{Experiment::orientations}};
  traits.usual = 1e-4;
  traits.plausible = 2e-3;
  traits.main_part = "cos_x";
  traits.documentation = {"a tilt about x and about y before the joint: c cos q + s sin q each",
                          "`axis_wobble.J2.cos_x` … [rad]", "a revolute joint"};
  return effect;
}

// Rolling bearings that are not round run out twice per turn.
Effect axis_wobble_twice_effect() {
  Effect effect{"axis_wobble_twice", "the joint's axis tilts twice per turn: bearings out of round", axis_wobble_twice};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::angle;
  traits.moves = Moves::axis;
  traits.separated_by = {{Experiment::orientations}};
  traits.usual = 1e-4;
  traits.plausible = 2e-3;
  traits.main_part = "cos_x";
  traits.documentation = {"a tilt about x and about y before the joint: c cos 2q + s sin 2q each",
                          "`axis_wobble_twice.J2.cos_x` … [rad]", "a revolute joint"};
  return effect;
}

}  // namespace

std::vector<Effect> bearing_effects() { return {axis_wobble_effect(), axis_wobble_twice_effect()}; }

}  // namespace truing::model
