// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Directions that a configuration is weakest in.

#include "inverse_kinematics/prepared_robot.hpp"
#include "math/constants.hpp"
#include "rooms.hpp"

namespace truing::inverse_kinematics {

/// J^T J of the driven joints, on the stack.
using JointMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxDrivenJoints, kMaxDrivenJoints>;

/// Joint motion that moves the tip least, as readings, its largest part one radian's worth; the first `fixed` joints
/// stay. Returned: the tip's motion that joints make least of.
Vector6d still_direction(const PreparedRobot& robot, const double* readings, int fixed, EffectScratch* scratch,
                         double* still);

/// Direction that the tip can move in least, if it is one of translation; else zero.
Eigen::Vector3d singular_direction(const PreparedRobot& robot, const double* readings, EffectScratch* scratch);

}  // namespace truing::inverse_kinematics
