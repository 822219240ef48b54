// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Normal equations of the torques, one Gram a joint: a joint's inertial columns are those of the links that it feels,
// so most of one large Gram over all joints would be zeros.

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "dynamics/regressor.hpp"
#include "estimation/evidence.hpp"
#include "rooms.hpp"

namespace truing::dynamics {

/// Rows of one joint: ten columns for each of RigidChain::felt_links, then the further ones, then the measured torque.
using JointRows = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// Gets rows of joint k with their inertial columns in place, the first of them row `begin` of the tables, and writes
/// the others; it may weight all of them. Called from several threads, on rows that are never the same.
using CompleteRows = std::function<void(Eigen::Index k, Eigen::Index begin, JointRows rows)>;

/// Gram of every joint with a reading, further[k] columns behind its inertial ones. `q`, `qd`, `qdd`: shape=(rows,
/// driven). threads: 0 is as many as the machine has; the bits do not depend on it. Memory does not grow with the rows.
std::vector<estimation::Gram> joint_grams(const RigidChain& chain, const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd,
                                          const Eigen::MatrixXd& qdd, const std::vector<Eigen::Index>& further,
                                          const CompleteRows& complete, int threads = 0);

}  // namespace truing::dynamics
