// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which way dry friction knows a joint to move.

#include <vector>

#include "rooms.hpp"
#include "truing/dynamics/effect.hpp"

namespace truing::dynamics {

/// Prandtl's stop operator (1928): z follows the travel / x0 and stays between -1 and 1. Each row has the mean over the
/// time that belongs to it, positions on straight lines between the rows. `kept`: part of z that is left after a row's
/// time without travel.
Eigen::VectorXd stop_operator(const Eigen::Ref<const Eigen::VectorXd>& q, double x0, double kept = 1.0);

/// tanh(speed / width), each row the mean over the time that belongs to it, speeds on straight lines between the rows.
Eigen::VectorXd direction_by_speed(const Eigen::Ref<const Eigen::VectorXd>& qd, double width);

/// The same of one joint, by the speed or by the travel.
Eigen::VectorXd direction_of(const Motion& motion, Eigen::Index joint, const FrictionTurn& turn);

bool same(const std::vector<FrictionTurn>& a, const std::vector<FrictionTurn>& b);

/// Motion::direction where friction turns so at every joint.
Eigen::MatrixXd directions_of(const Motion& motion, const std::vector<FrictionTurn>& turns);

}  // namespace truing::dynamics
