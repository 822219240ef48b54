// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "model/gravity.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "math/text.hpp"
#include "model/motion.hpp"
#include "rooms.hpp"
#include "truing/model/effect.hpp"

namespace truing::model {

Axis joint_axis(const Robot& robot, const std::vector<Eigen::Isometry3d>& frames, std::size_t i) {
  switch (robot.convention) {
    case Convention::dh: {  // distal: the joint moves about or along z of the frame *before* its link
      const Eigen::Isometry3d& T = i == 0 ? robot.T_measurement_base : frames[i - 1];
      return {T.linear().col(2), T.translation()};
    }
    case Convention::mdh:
      return {frames[i].linear().col(2), frames[i].translation()};
    case Convention::urdf:
      return {frames[i].linear() * robot.joints[i].axis, frames[i].translation()};
  }
  return {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
}

bool knows_mass(const Robot& robot) {
  return std::any_of(robot.joints.begin(), robot.joints.end(),
                     [](const Joint& joint) { return joint.mass.has_value(); });
}

void gravity_torques_at(const Robot& robot, const Eigen::MatrixXd& coupling,
                        const std::vector<Eigen::Isometry3d>& frames, double payload,
                        Eigen::Ref<Eigen::VectorXd> torque) {
  const Eigen::Vector3d g = robot.T_measurement_base.linear() * robot.gravity;
  // Mass and first moment of all that a joint carries, gathered from the tip down.
  double mass = payload;
  Eigen::Vector3d moment = payload * frames.back().translation();
  torque.setZero();
  for (std::size_t i = robot.joints.size(); i-- > 0;) {
    const Joint& joint = robot.joints[i];
    if (joint.mass) {
      mass += *joint.mass;
      moment += *joint.mass * (frames[i] * joint.center_of_mass);
    }
    // Virtual work of the weight for a unit motion: sum of m g . (a x (p - o)) = a . (sum of m (p - o)) x g,
    // or m g . a
    const Axis axis = joint_axis(robot, frames, i);
    const Eigen::Vector3d arm = moment - mass * axis.point;
    const double site_torque =
        joint.type == JointType::revolute
            ? without_rounding(axis.direction.dot(arm.cross(g)), (moment.norm() + mass * axis.point.norm()) * g.norm())
            : without_rounding(mass * axis.direction.dot(g), mass * g.norm());
    // A joint feels what acts on all that moves with it, passive joints included: the transposed coupling.
    torque += site_torque * coupling.row(static_cast<Eigen::Index>(i)).transpose();
  }
}

}  // namespace truing::model

namespace truing {
using namespace model;

Eigen::VectorXd gravity_torques(const Robot& robot, const Eigen::VectorXd& reading, double payload) {
  if (!(std::isfinite(payload) && payload >= 0.0)) {
    throw std::invalid_argument("payload is " + number(payload) + " kg, expected zero or more");
  }
  if (!knows_mass(robot) && payload == 0.0) {
    throw std::invalid_argument(
        "gravity torques need a mass: give the links' mass and com in the robot, or a payload; the robot has "
        "none and the "
        "payload is zero");
  }
  Eigen::VectorXd torque(static_cast<Eigen::Index>(robot.joints.size()));
  gravity_torques_at(robot, coupling_matrix(robot), forward_kinematics(robot, reading, 0), payload, torque);
  return torque;
}

}  // namespace truing
