// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "estimation/evaluate.hpp"
#include "estimation/selection.hpp"
#include "estimation/solvers.hpp"
#include "rooms.hpp"
#include "truing/identify.hpp"

namespace truing::identification {

// One fit of parameters to rows, and what it leaves.

/// Robot, rows and options of a fit.
struct Job {
  const Model& model;
  const Measurements& data;
  const std::vector<std::vector<double>>& bases;
  const IdentifyOptions& options;
  std::vector<std::int32_t> rows;
};

/// What a fit found, and on which rows.
struct Fit {
  Eigen::VectorXd values;
  Weighing weighing;
  SolverSummary solver;
  std::vector<int> fitted;             ///< parameters
  std::vector<std::int32_t> rejected;  ///< rows
};

/// Numbers that a row measures.
int components_of(const Measurements& data, std::size_t row);

/// Rows but for those left out; both in order.
std::vector<std::int32_t> without(const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& left_out);

/// At most some thousand of the rows, evenly taken: enough to start from.
std::vector<std::int32_t> evenly(const std::vector<std::int32_t>& rows);

/// Lengths of the training rows' residuals, made comparable between kinds of rows.
std::vector<double> comparable_lengths(const Job& job, const std::vector<double>& norms);

/// The options' priors of the fitted parameters about the nominal robot, against rows with this noise.
Prior prior_of(const Job& job, const std::vector<int>& fitted, double noise);

/// Least squares, under priors if there are some; then, as asked, a robust loss at a scale of the residuals' own, or
/// gross outliers found and left out.
Fit fit(const Job& job, const std::vector<int>& fitted, const Eigen::VectorXd& start);

/// Where the rows and the loss that a fit ended with lead from another place.
Fit descended(const Job& job, const Fit& like, const Eigen::VectorXd& place);

/// A fit whose gross outliers, or scale of the loss, are found anew until they stay.
Fit settled(const Job& job, Fit found);

/// The fit in the deepest of the hollows about one that was found. Nobody looks for others where priors or bounds hold
/// what is hardly seen.
Fit deepest_from(const Job& job, Fit found);

/// Noise of a unit-weight component, from the median row of a fit; NaN: no more values than parameters.
double noise_of(const Job& job, const Fit& found);

/// Splits the free parameters into those that the rows can see and combinations that they cannot.
Selection select_observable(const Job& job, const std::vector<int>& free, const Eigen::VectorXd& values);

/// Length of every row's error: position or distance [m], and rotation [rad] where orientations are measured.
struct ErrorLengths {
  std::vector<double> position;
  std::vector<float> rotation;  ///< NaN: not measured; empty: none is
};

ErrorLengths error_lengths(const Job& job, const Evaluator& evaluator, const Eigen::VectorXd& values, bool poses);

}  // namespace truing::identification
