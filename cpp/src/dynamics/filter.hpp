// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A low-pass without phase: a windowed sinc, the same on both sides of the equation of motion.

#include <Eigen/Core>

#include "rooms.hpp"

namespace truing::dynamics {

/// Symmetric weights that add up to one: -6 dB at `cutoff` [Hz], for samples every `step` [s]. Shape=(2 half + 1,).
Eigen::VectorXd low_pass(double cutoff, double step);

/// What a column's slope changes by from row to row at its ends.
struct Bends {
  double first = 0.0, last = 0.0;
};

constexpr Eigen::Index kFewestForBend = 8;  ///< rows: fewer tell no bend

/// The bend at x[0] of a cubic through x[0], x[way], x[2 way] …, so many rows; the less certain it is, the smaller it
/// is taken, and of fewer than kFewestForBend it is none.
double bend_of(const double* x, Eigen::Index way, Eigen::Index rows);

/// Every `stride`-th row of x, filtered, from row 0 on; beyond its ends x is mirrored at its end points.
Eigen::MatrixXd filtered(const Eigen::MatrixXd& x, const Eigen::VectorXd& weights, Eigen::Index stride = 1);

/// Rows `first` to `first + count` of the same, of one column that bends on so beyond its ends. A row's bits do not
/// depend on which others are asked for.
void filter_column(const double* x, Eigen::Index rows, const Eigen::VectorXd& weights, Eigen::Index stride,
                   Eigen::Index first, Eigen::Index count, double* out, const Bends& bends = {});

/// Central differences along the rows, at the ends one-sided ones of second order.
Eigen::MatrixXd rate_of(const Eigen::MatrixXd& x, double step);

}  // namespace truing::dynamics
