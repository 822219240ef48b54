// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>

namespace truing {

/// When an iteration of least squares stops, and how it is damped.
struct SolverOptions {
  /// The fit stops here at the latest: long valleys take thousands of short steps, well-seen robots stop after 3 to 5.
  int max_iterations = 5000;
  double initial_damping = 1e-9;  ///< damping mu of the first step, on columns of unit norm
  double rms_fall = 1e-12;  ///< [m] stop when an accepted step lowers the rms by no more (the method's own: 1e-3 mm)
  double gradient = 1e-14;  ///< stop when |g| of unit columns, relative to the residual's norm, is no more
  bool undamped = false;    ///< no damping, mu = 0: the least-squares iteration of the differential error model
  std::map<std::string, std::pair<double, double>> bounds;  ///< (lowest, highest) by parameter; solver `ceres` only
};

/// How the solver ended.
struct SolverSummary {
  std::string name;             ///< 'lm' or 'ceres'
  int iterations = 0;           ///< steps made
  bool converged = false;       ///< false: the result must not be used
  std::string stopped_because;  ///< the reason, in words
};

}  // namespace truing
