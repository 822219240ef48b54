// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A low-pass without phase: a windowed sinc, the same on both sides of the equation of motion.

#include <Eigen/Core>

#include "rooms.hpp"

namespace truing::dynamics {

/// Symmetric weights that add up to one: -6 dB at `cutoff` [Hz], for samples every `step` [s]. Shape=(2 half + 1,).
Eigen::VectorXd low_pass(double cutoff, double step);

/// Every `stride`-th row of x, filtered, from row 0 on; beyond its ends x is mirrored at its end points.
Eigen::MatrixXd filtered(const Eigen::MatrixXd& x, const Eigen::VectorXd& weights, Eigen::Index stride = 1);

/// Rows `first` to `first + count` of the same, of one column. A row's bits do not depend on which others are asked
/// for.
void filter_column(const double* x, Eigen::Index rows, const Eigen::VectorXd& weights, Eigen::Index stride,
                   Eigen::Index first, Eigen::Index count, double* out);

/// Central differences along the rows, one-sided at the ends.
Eigen::MatrixXd rate_of(const Eigen::MatrixXd& x, double step);

}  // namespace truing::dynamics
