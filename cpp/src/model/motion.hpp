// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "rooms.hpp"
#include "truing/model/robot.hpp"

namespace truing::model {

/// Corrected motion of every joint, chain order [rad | m]: driven ratio * reading + offset, passive the
/// weighted sum of its drivers' motions + offset. Throws std::invalid_argument on a wrong number of readings,
/// unknown or circular drivers.
Eigen::VectorXd joint_motions(const Robot& robot, const Eigen::VectorXd& reading);

/// C(i, j): by how much joint i moves when joint j's offset grows by one. Identity, plus a row of weights per
/// passive joint.
Eigen::MatrixXd coupling_matrix(const Robot& robot);

/// How far the robot reaches with all links in one line, at most, at zero of its rails [m].
double stretched_length(const Robot& robot);

}  // namespace truing::model
