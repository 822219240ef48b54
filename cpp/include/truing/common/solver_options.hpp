// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>

namespace truing {

/// When an iteration of least squares stops, and how it is damped.
struct SolverOptions {
  int max_iterations = 5000;      ///< long valleys take thousands of short steps; well-seen robots stop after 3 to 5
  double initial_damping = 1e-9;  ///< mu, on columns of unit norm
  double rms_fall = 1e-12;  ///< [m] stop when an accepted step lowers the rms by no more (the method's own: 1e-3 mm)
  double gradient = 1e-14;  ///< stop when |g| of unit columns, relative to the residual's norm, is no more
  bool undamped = false;    ///< mu = 0: the least-squares iteration of the differential error model
  std::map<std::string, std::pair<double, double>> bounds;  ///< by parameter; Solver::ceres only
};

/// How an iteration ended.
struct SolverSummary {
  std::string name;
  int iterations = 0;
  bool converged = false;
  std::string stopped_because;
};

}  // namespace truing
