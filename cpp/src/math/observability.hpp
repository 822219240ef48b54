// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What the data can see: rank from the Gram of unit columns, frozen combinations, covariance.

#include <vector>

#include <Eigen/Core>

#include "rooms.hpp"

namespace truing::math {

struct Rank {
  std::vector<int> kept;    ///< columns to fit, in increasing order
  std::vector<int> frozen;  ///< columns that the kept ones explain (but for `tolerance` of their length), increasing
  Eigen::MatrixXd
      combination;  ///< shape (kept, frozen): frozen column = kept columns times this, in the columns' own units
};

/// Cholesky of the Gram of unit columns, leaving out columns that those kept already explain. Columns of lower
/// `priority` number come first; within one number the clearly visible, then the order of the columns. A Gram cannot
/// tell fractions below about 1e-7.
Rank find_rank(const Eigen::MatrixXd& gram, const std::vector<int>& priority, double tolerance);

/// Inverse of a Gram matrix through its unit-column scaling.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& gram);

}  // namespace truing::math
