// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "identification/fit.hpp"

namespace truing::identification {

// Where to start: base, targets, anchor and fixed points, which are always unknown.

struct Start {
  Robot robot;
  std::vector<std::int32_t> rejected;  ///< rows
  Eigen::VectorXd values;              ///< of make_model(robot, …): for the fixed points, which a robot does not hold
  double rms = 0.0;
};

/// A target far from where the model has it can spoil the registration: then other places are tried, and the best one
/// kept.
Start find_start(const Job& job, const std::vector<std::string>& unknown, const Content& content, bool base_free);

/// Every fixed point at the mean of the tip's predictions.
void locate_points(const Model& model, const Job& job, Eigen::VectorXd* values);

/// How far apart the measured positions or distances of the rows that were not rejected are [m].
double spread_of(const Job& job, const std::vector<std::int32_t>& rejected);

}  // namespace truing::identification
