// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Free functions beside what was named.

#include "dynamics/search.hpp"
#include "rooms.hpp"

namespace truing::dynamics {

/// An account's choice, with what is too small to be named, less the free functions of joints that these do not help:
/// whose squares on folds that were not fitted, rows at rest included, they do not lower by `least_gain`, over all
/// folds and without the quarter that gains most. `seen`: the model whose torque some terms need.
Choice with_functions_that_help(const Problem& problem, const Account& functions, const TorqueModel& seen,
                                double least_gain);

}  // namespace truing::dynamics
