// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include "truing/robot.hpp"

namespace truing::detail {

/// A joint's axis and a point on it, in the measurement frame.
struct Axis {
  Eigen::Vector3d direction;
  Eigen::Vector3d point;
};

/// Axis of joint `i`; `frames` from forward_kinematics.
Axis joint_axis(const Robot& robot, const std::vector<Eigen::Isometry3d>& frames, std::size_t i);

/// True when some link of the robot has a mass.
bool knows_mass(const Robot& robot);

/// gravity_torques without allocation: `coupling` from coupling_matrix(robot), `frames` from
/// forward_kinematics(robot, q, 0), `torque` of size n_joints. Links without a mass weigh nothing; it does
/// not throw.
void gravity_torques_at(const Robot& robot, const Eigen::MatrixXd& coupling,
                        const std::vector<Eigen::Isometry3d>& frames, double payload,
                        Eigen::Ref<Eigen::VectorXd> torque);

}  // namespace truing::detail
