// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What is left of a joint's torque beside what was named, by a little of everything.

#include <vector>

#include "dynamics/search.hpp"
#include "rooms.hpp"

namespace truing::dynamics {

struct Remainder {
  std::size_t joint = 0;
  std::vector<ValuedTerm> terms;
};

/// Beside an account's choice, of joints at which it helps: a ridge regression (Hoerl and Kennard 1970) on all other
/// columns of the joint, shrunken as folds say that were not fitted. It helps where a joint's squares there fall by
/// `least_gain`, over all folds and without the quarter that gains most. `handed_over`: the fit of the choice with
/// inertias that bodies can have, which leaves more than any numbers do.
std::vector<Remainder> remainders_beside(const Account& account, const Fit& handed_over, double least_gain);

}  // namespace truing::dynamics
