// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What gives way under weight: joints and links.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"
#include "model/gravity.hpp"
#include "model/motion.hpp"

namespace truing::model {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// A linear spring: the joint gives way by compliance * torque, in the direction that the weight pulls. Where
// no mass is known, the payload's torque alone.
std::vector<Term> joint_compliance(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_weight("joint_compliance", robot, at, data, ", or ask for gravity_moment, which finds the moments itself");
  const auto index = static_cast<Eigen::Index>(joint);
  Term term;
  term.parameter = "joint_compliance." + at.name;
  term.unit = at.type == JointType::revolute ? "rad/Nm" : "m/N";
  term.site = at.name;
  term.basis = [index](const Inputs& in) { return in.gravity_torque[index]; };
  term.needs_gravity = true;
  return {term};
}

// Stiffness in three zones, as strain-wave gears have it (K1 < K2 < K3 below T1, up to T2 and beyond;
// Harmonic Drive, Engineering data, "torsional stiffness"): a compliance for each zone of |torque|. T1 and T2
// are not fitted: they part the data's |torque| in thirds, so that every zone is seen.
std::vector<Term> stiffness_zones(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_weight("stiffness_zones", robot, at, data);
  const auto index = static_cast<Eigen::Index>(joint);
  const std::string prefix = "stiffness_zones." + at.name;
  std::vector<double> sizes;  // of the torque, sorted; only when a knot is asked for the first time
  const auto quantile = [&](double share) {
    if (sizes.empty() && data.joints.size() == robot.driven_count()) {
      constexpr std::size_t kRows = 10000;  // enough for a third
      const std::size_t step = std::max<std::size_t>(1, data.rows / kRows);
      const Eigen::MatrixXd coupling = coupling_matrix(robot);
      Eigen::VectorXd reading(static_cast<Eigen::Index>(data.joints.size()));
      Eigen::VectorXd torque(static_cast<Eigen::Index>(robot.joints.size()));
      for (std::size_t row = 0; row < data.rows; row += step) {
        for (Eigen::Index k = 0; k < reading.size(); ++k) reading[k] = data.joints[static_cast<std::size_t>(k)][row];
        gravity_torques_at(robot, coupling, forward_kinematics(robot, reading, 0),
                           data.payload ? data.payload[row] : 0.0, torque);
        sizes.push_back(std::abs(torque[index]));
      }
      std::sort(sizes.begin(), sizes.end());
    }
    return sizes.empty() ? 0.0 : sizes[static_cast<std::size_t>(share * static_cast<double>(sizes.size()))];
  };
  const double first = remembered(robot, "stiffness_zones", prefix + ".T1", [&] { return quantile(1.0 / 3.0); });
  const double second = remembered(robot, "stiffness_zones", prefix + ".T2", [&] { return quantile(2.0 / 3.0); });
  const double edges[4] = {0.0, first, second, std::numeric_limits<double>::infinity()};
  std::vector<Term> terms;
  for (int zone = 0; zone < 3; ++zone) {
    const double from = edges[zone], to = edges[zone + 1];
    terms.push_back(make_term(
        prefix + ".c" + std::to_string(zone + 1), is_revolute(at) ? "rad/Nm" : "m/N", at.name,
        [index, from, to](const Inputs& in) {
          const double torque = in.gravity_torque[index];
          return std::copysign(std::clamp(std::abs(torque), from, to) - from, torque);
        },
        true));
    terms.back().constants = {{prefix + ".T1", first}, {prefix + ".T2", second}};
  }
  return terms;
}

// A spring under weights that nobody knows. The weight of all that hangs beyond a revolute joint turns it by
// a . sum_l (R_l H_l) x g, linear in the first moments H_l [kg m]: each link's own, and what hangs beyond it
// at its end (Atkeson, An and Hollerbach 1986; Khalil and Dombre 2002, ch. 9: those that can be told apart
// are the base parameters, the others are frozen by name). A prismatic joint beyond carries its mass along. A
// parameter is compliance * moment. A known payload comes on top by joint_compliance.
std::vector<Term> gravity_moment(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  require_revolute("gravity_moment", at, "");
  const auto shared = std::make_shared<const Robot>(robot);
  const Eigen::VectorXd carried = coupling_matrix(robot).col(static_cast<Eigen::Index>(joint));
  const Vector3d g = robot.T_measurement_base.linear() * robot.gravity;
  // Turning the coordinate turns it and its passive joints: the torques of all these, of a force at an arm
  // from the axis.
  const auto torque = [shared, carried, g](const Inputs& in, std::size_t link, const Vector3d& arm) {
    double sum = 0.0, size = 0.0;
    for (std::size_t m = 0; m <= link; ++m) {
      const double weight = carried[static_cast<Eigen::Index>(m)];
      if (weight == 0.0 || !is_revolute(shared->joints[m])) continue;
      sum += weight * joint_axis(*shared, in.frames, m).direction.dot(arm.cross(g));
      size += std::abs(weight) * arm.norm() * g.norm();
    }
    return without_rounding(sum, size);
  };
  const std::string prefix = "gravity_moment." + at.name + ".";
  std::vector<Term> terms;
  for (std::size_t link = joint; link < robot.joints.size(); ++link) {
    for (int axis = 0; axis < 3; ++axis) {
      terms.push_back(make_term(
          prefix + robot.joints[link].name + "." + "xyz"[axis], "rad kg/N", at.name,
          [torque, link, axis](const Inputs& in) { return torque(in, link, in.frames[link].linear().col(axis)); },
          true));
    }
    if (is_revolute(robot.joints[link])) continue;
    terms.push_back(make_term(
        prefix + robot.joints[link].name + ".mass", "rad kg/Nm", at.name,
        [shared, torque, link](const Inputs& in) {
          const Vector3d axis = joint_axis(*shared, in.frames, link).direction;
          return torque(in, link, in.joints[static_cast<Eigen::Index>(link)] * axis);
        },
        true));
  }
  return terms;
}

// The frame in which a link ends: where its joint's successor starts to turn, before it turns.
Isometry3d link_end(const Robot& robot, const std::vector<Isometry3d>& frames, std::size_t link) {
  if (robot.convention == Convention::dh) return frames[link];
  const Joint& next = robot.joints[link + 1];
  if (robot.convention == Convention::urdf)
    return frames[link] * Eigen::Translation3d(next.T_parent_joint.translation());
  return frames[link] * Eigen::AngleAxisd(next.alpha, Vector3d::UnitX()) * Eigen::Translation3d(next.a, 0.0, 0.0) *
         Eigen::AngleAxisd(next.beta, Vector3d::UnitY());
}

// Where it starts: at its own joint.
Vector3d link_start(const Robot& robot, const std::vector<Isometry3d>& frames, std::size_t link, double motion) {
  const Joint& joint = robot.joints[link];
  switch (robot.convention) {
    case Convention::dh:
      return (link == 0 ? robot.T_measurement_base : frames[link - 1]).translation();
    case Convention::mdh:
      return frames[link] * Vector3d(0.0, 0.0, -joint.d - (is_revolute(joint) ? 0.0 : motion));
    case Convention::urdf:
      break;
  }
  return frames[link].translation();
}

using Sites = std::array<std::string, 3>;

// Elementary rotations about where a link starts. Nothing turns there after the joint has: so it is the two
// angles before, and the joint's own.
Sites start_sites(const Robot& robot, std::size_t link) {
  const std::string& at = robot.joints[link].name;
  if (robot.convention == Convention::urdf) return {at + ".rx", at + ".ry", at + ".rz"};
  if (robot.convention == Convention::mdh) return {at + ".alpha", at + ".beta", at + ".theta"};
  if (link == 0) return {"base.rx", "base.ry", "base.rz"};
  return {robot.joints[link - 1].name + ".alpha", robot.joints[link - 1].name + ".beta", at + ".theta"};
}

// The axes that these turn about, in the measurement frame.
Eigen::Matrix3d start_axes(const Robot& robot, const std::vector<Isometry3d>& frames, std::size_t link) {
  if (robot.convention == Convention::dh && link == 0) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d before = (link == 0 ? robot.T_measurement_base : frames[link - 1]).linear();
  if (robot.convention != Convention::mdh) return before;
  return before * Eigen::AngleAxisd(robot.joints[link].alpha, Vector3d::UnitX()).toRotationMatrix();
}

// About where it ends, and about the axes of link_end: its last angles, and the next joint's before it turns.
Sites end_sites(const Robot& robot, std::size_t link) {
  const std::string &at = robot.joints[link].name, &next = robot.joints[link + 1].name;
  if (robot.convention == Convention::dh) return {at + ".alpha", at + ".beta", next + ".theta"};
  if (robot.convention == Convention::mdh) return {next + ".alpha", next + ".beta", next + ".theta"};
  return {next + ".rx", next + ".ry", next + ".rz"};
}

// Moment about `axis` through `place` of the weight of all links beyond `link` and of the payload; the link's
// own weight is left out.
double moment_beyond(const Robot& robot, const Inputs& in, std::size_t link, const Vector3d& place,
                     const Vector3d& axis) {
  const double mass = in.data->payload ? in.data->payload[in.row] : 0.0;
  Vector3d first_moment = mass * (in.frames.back().translation() - place);
  double size = first_moment.norm();  // of what adds up
  for (std::size_t k = link + 1; k < robot.joints.size(); ++k) {
    const Joint& beyond = robot.joints[k];
    if (!beyond.mass) continue;
    const Vector3d part = *beyond.mass * (in.frames[k] * beyond.center_of_mass - place);
    first_moment += part;
    size += part.norm();
  }
  const Vector3d g = robot.T_measurement_base.linear() * robot.gravity;
  return without_rounding(axis.dot(first_moment.cross(g)), size * g.norm());
}

// A link bends about the two axes across it: a uniform beam under what hangs beyond its end (Euler and
// Bernoulli). The bending moment runs straight from Ms at the start to Me at the end; the end then is displaced
// and turned as by a turn about the start of c (2 Ms + Me) / 6 and one about the end of c (Ms + 2 Me) / 6, with
// c = L / EI (conjugate beam, Mohr 1868). A turn about the end alone would be the next joint's spring.
std::vector<Term> link_compliance(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  if (joint + 1 == robot.joints.size())
    unsuited("link_compliance", at, "needs a joint beyond the link; " + at.name + " is the last");
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(robot.driven_count()));
  const std::vector<Isometry3d> frames = forward_kinematics(robot, zero, 0);
  const Isometry3d end = link_end(robot, frames, joint);
  const Vector3d along = end.linear().transpose() * (end.translation() - link_start(robot, frames, joint, 0.0));
  if (along.norm() < 5e-3) unsuited("link_compliance", at, "needs a link with a length; this one has none");
  require_weight("link_compliance", robot, at, data);
  Eigen::Index lengthwise = 0;
  along.cwiseAbs().maxCoeff(&lengthwise);

  const auto shared = std::make_shared<const Robot>(robot);
  const auto moment_at_start = [shared, joint](const Inputs& in, const Vector3d& axis) {
    const double motion = in.joints[static_cast<Eigen::Index>(joint)];
    return moment_beyond(*shared, in, joint, link_start(*shared, in.frames, joint, motion), axis);
  };
  const auto moment_at_end = [shared, joint](const Inputs& in, const Vector3d& axis) {
    return moment_beyond(*shared, in, joint, link_end(*shared, in.frames, joint).translation(), axis);
  };
  const Sites about_start = start_sites(robot, joint), about_end = end_sites(robot, joint);
  std::vector<Term> terms;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (axis == lengthwise) continue;
    const std::string parameter = "link_compliance." + at.name + ".r" + "xyz"[axis];
    const auto across = [shared, joint, axis](const Inputs& in) -> Vector3d {
      return link_end(*shared, in.frames, joint).linear().col(axis);
    };
    const auto turn_at_end = [=](const Inputs& in) {
      return (moment_at_start(in, across(in)) + 2.0 * moment_at_end(in, across(in))) / 6.0;
    };
    terms.push_back(make_term(parameter, "rad/Nm", about_end[static_cast<std::size_t>(axis)], turn_at_end, true));
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto turn_at_start = [=](const Inputs& in) {
        const double part = start_axes(*shared, in.frames, joint).col(k).dot(across(in));
        return part * (2.0 * moment_at_start(in, across(in)) + moment_at_end(in, across(in))) / 6.0;
      };
      terms.push_back(make_term(parameter, "rad/Nm", about_start[static_cast<std::size_t>(k)], turn_at_start, true));
    }
  }
  return terms;
}

// The softest gear that is sold: a strain wave gear of size 3 has 27 Nm/rad (Harmonic Drive, RSF supermini series,
// manual, "torsional stiffness": RSF-3C 27 to 34 Nm/rad, RSF-5B 90 to 150 Nm/rad).
constexpr double kSoftestGear = 1.0 / 27.0;  // [rad/Nm]

// Strain wave gears have K3 up to twice K1 (Harmonic Drive, RSF-B mini series, manual, "torsional stiffness"). What
// gives way under the first few newton metres and hardly beyond is no gear, but play that closes.
constexpr double kLargestHardening = 3.0;

Effect joint_compliance_effect() {
  Effect effect{"joint_compliance", "the joint gives way under the weight that it carries", joint_compliance};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::gravity_torque;
  traits.law = Law::of_torque;
  traits.law_test = LawTest::of_driver;
  traits.on_several_joints = true;
  traits.weights_found_by = "gravity_moment";
  traits.mimicked_by = {"windup"};
  traits.contained_in = {
      {"stiffness_zones", Containment::special_case, "a spring with three zones can be a plain one"}};
  traits.separated_by = {{Experiment::target_on_elbow, "link_compliance"}, {Experiment::another_payload}};
  traits.usual = 2e-6;
  traits.plausible = kSoftestGear;
  traits.if_negative =
      "no joint gives way against its weight: where a robot hangs from a ceiling, `gravity` of its file says so";
  traits.documentation = {"c · gravity torque τ", "`joint_compliance.J2` [rad/Nm, m/N]",
                          "masses in the robot, or `payload_kg` (then of the payload alone)"};
  return effect;
}

Effect stiffness_zones_effect() {
  Effect effect{"stiffness_zones", "the joint gives way, and more or less so as torque grows: strain-wave gears",
                stiffness_zones};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::gravity_torque;
  traits.law = Law::of_torque;
  traits.needs_masses = true;
  traits.mimicked_by = {"windup"};
  traits.separated_by = {{Experiment::another_payload}};
  traits.usual = 2e-6;
  traits.plausible = kSoftestGear;
  traits.main_part = "c1";
  traits.most_times_others = kLargestHardening;
  traits.documentation = {"c₁, c₂, c₃ · the part of τ in each zone of \\|τ\\|; zones part the data's \\|τ\\| in thirds",
                          "`stiffness_zones.J2.c1` … `c3` [rad/Nm]", "the same"};
  return effect;
}

Effect gravity_moment_effect() {
  Effect effect{"gravity_moment", "the joint gives way under weights that are not known", gravity_moment};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::gravity_torque;
  traits.search = Search::with_unknown_weights;
  traits.plausible = 5e-3;
  traits.documentation = {
      "Σ h · (axis · (e × g)), e the axes of every link from here on: a spring under unknown weights",
      "`gravity_moment.J2.J4.x` … [rad kg/N]: compliance × first moment", "a revolute joint"};
  return effect;
}

Effect link_compliance_effect() {
  Effect effect{"link_compliance", "the link bends under the weight that hangs beyond it", link_compliance};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::gravity_torque;
  traits.moves = Moves::link;
  traits.separated_by = {{Experiment::another_payload}};
  traits.usual = 1e-6;
  traits.plausible = 1e-3;
  traits.documentation = {
      "a beam, about the two axes across it: a turn of c (2 Ms + Me) / 6 about the link's start and of c (Ms + 2 Me) / "
      "6 about its end, where the bending moments are Ms and Me; c = L / EI",
      "`link_compliance.J2.ry`, `.rz` [rad/Nm]", "masses or `payload_kg`; a joint beyond"};
  return effect;
}

}  // namespace

std::vector<Effect> compliance_effects() {
  return {joint_compliance_effect(), stiffness_zones_effect(), gravity_moment_effect(), link_compliance_effect()};
}

}  // namespace truing::model
