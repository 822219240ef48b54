// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The quintic spline through even rows, between two of them: its acceleration is smooth, too.

#include <Eigen/Core>

#include "dynamics/filter.hpp"
#include "rooms.hpp"

namespace truing::dynamics {

/// Value, first and second derivative at a part of the way from each row to the next one.
class SplineBetween {
 public:
  static constexpr Eigen::Index kReach = 24;  ///< rows on both sides: what is further away counts less than 1e-8

  /// part: 0 ... 1; step [s] between rows.
  SplineBetween(double part, double step);
  /// From row `first` on, `count` times: shape=(count, 3). Beyond its ends x is mirrored at its end points, and bends
  /// on.
  Eigen::MatrixXd at(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Index first, Eigen::Index count,
                     const Bends& bends = {}) const;

 private:
  Eigen::MatrixXd weights_;  ///< shape=(2 kReach + 1, 3) of the rows around
};

}  // namespace truing::dynamics
