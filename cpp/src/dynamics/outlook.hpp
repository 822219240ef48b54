// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What motions could show of effects on torques, from the columns alone.

#include <vector>

#include "dynamics/design.hpp"
#include "rooms.hpp"
#include "truing/dynamics/plan.hpp"

namespace truing::dynamics {

/// What motions tell of every column of a design.
struct Information {
  /// Shape=(columns, columns), in units of the noise: what is left beyond the groundwork, rows that go on in time
  /// counted once. Zero for the groundwork's own columns.
  Eigen::MatrixXd seen;
  Eigen::VectorXd whole;  ///< shape=(columns,): the diagonal with nothing taken off
  Eigen::MatrixXd rms;    ///< shape=(joints, columns) [Nm | N] for a parameter of one
  double values = 0.0;    ///< rows that count, all joints together
};

/// `noise`: [Nm | N] of every joint; `noise_time`: [s] its correlation time. All rows of the data count.
Information information_of(const Tiles& tiles, const TorqueDesign& design, const std::vector<double>& noise,
                           double noise_time);

/// Nats that parameters as large as their priors would bring, once measured: log det(I + D S D) / 2 over these columns
/// (Bayesian D-optimality; Chaloner and Verdinelli 1995, eq. 8).
double nats(const Information& information, const TorqueDesign& design, const std::vector<int>& columns);
/// The same of some columns beside others that are fitted too.
double nats_beside(const Information& information, const TorqueDesign& design, const std::vector<int>& columns,
                   const std::vector<int>& others);

/// Sizes, what is alike, what would not show. `wanted`: by group, whether it is asked for.
TorqueOutlook outlook_of(const Information& information, const TorqueDesign& design, const Robot& robot,
                         const std::vector<TorqueEffect>& own, const std::vector<bool>& wanted, double alike);

/// Every pair of these, one of each two groups that stand for different effects or places.
std::vector<TorqueEffectPair> pairs_of(const Information& information, const TorqueDesign& design,
                                       const std::vector<TorqueEffect>& own, const std::vector<bool>& wanted);

}  // namespace truing::dynamics
