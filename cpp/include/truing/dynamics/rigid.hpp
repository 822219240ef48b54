// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "truing/model/robot.hpp"

namespace truing::dynamics {

/// Torques that the drives must give to move the rigid chain: masses, centres of mass and inertias of the links under
/// gravity, plus rotor inertias times acceleration; no friction, no other effect. What the robot does not state (mass,
/// inertia) counts as zero. A passive joint has no torque of its own: what it needs is felt by the joints that drive
/// it.
///
/// `q`, `qd`, `qdd`: shape=(n, driven joints) [rad | m, per s, per s^2], readings and their derivatives. Returns
/// shape=(n, driven joints) [Nm | N]. Throws std::invalid_argument: a robot that cannot be used, other shapes, values
/// that are not finite.
Eigen::MatrixXd rigid_torques(const Robot& robot, const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd,
                              const Eigen::MatrixXd& qdd);

}  // namespace truing::dynamics
