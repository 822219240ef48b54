// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "rooms.hpp"
#include "truing/model/robot.hpp"

namespace truing::model {

/// A joint's axis and a point on it, in the measurement frame.
struct Axis {
  Eigen::Vector3d direction;
  Eigen::Vector3d point;
};

/// Axis of joint `i`; `frames` from forward_kinematics.
Axis joint_axis(const Robot& robot, const std::vector<Eigen::Isometry3d>& frames, std::size_t i);

/// `value`, or zero when it is rounding of terms as large as `size`: the weight on a vertical axis must be
/// none, or what is left of it (and its sign) would be fitted as a column like any other.
inline double without_rounding(double value, double size) { return std::abs(value) <= 1e-12 * size ? 0.0 : value; }

/// True when some link of the robot has a mass.
bool knows_mass(const Robot& robot);

/// gravity_torques without allocation: `coupling` from coupling_matrix(robot), `frames` from
/// forward_kinematics(robot, q, 0), `torque` of size n_joints. Links without a mass weigh nothing; it does
/// not throw.
void gravity_torques_at(const Robot& robot, const Eigen::MatrixXd& coupling,
                        const std::vector<Eigen::Isometry3d>& frames, double payload,
                        Eigen::Ref<Eigen::VectorXd> torque);

}  // namespace truing::model
