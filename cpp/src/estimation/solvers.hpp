// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The two solvers behind one interface: start values in, minimum out, and why it stopped.

#include <functional>

#include <Eigen/Core>

#include "estimation/evaluate.hpp"
#include "rooms.hpp"
#include "truing/common/solver_options.hpp"

namespace truing::estimation {

/// Called after every accepted step; may move parameters that are found in closed form (the measurement frame by SVD).
using Refit = std::function<void(Eigen::VectorXd* values)>;

/// Levenberg-Marquardt on streamed normal equations (levenberg_marquardt.cpp).
SolverSummary levenberg_marquardt(const Evaluator& problem, const Weighing& weighing, const SolverOptions& options,
                                  const Refit& refit, Eigen::VectorXd* values);

/// Ceres on the same tiles (ceres_solver.cpp); honours options.bounds.
SolverSummary solve_with_ceres(const Evaluator& problem, const Model& model, const Weighing& weighing,
                               const SolverOptions& options, Eigen::VectorXd* values);

}  // namespace truing::estimation
