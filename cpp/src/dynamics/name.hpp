// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What was found, in words: how sure, how much, what else it may be.

#include "dynamics/search.hpp"
#include "rooms.hpp"
#include "truing/dynamics/diagnose.hpp"

namespace truing::dynamics {

/// Takes out of the choice what only hides another one: of two that do the same neither is missed, and neither would be
/// named. The less likely one goes, if then the other is likely. The posteriors are those of what is left.
void leave_out_what_hides(Account* account);

/// The choice less free functions that do not remove `least_gain` of a joint's squares on held-out recordings: some of
/// hundreds that were tried bend to a few folds by chance.
Choice without_functions_that_fail(Account account, double least_gain);

/// Of an account's choice, what is likely enough to be named by its posteriors, and what is too small for it. `same`:
/// the choice, in the numbers that the answer has.
std::pair<Choice, Choice> likely_and_small(const Account& account, const Choice& same);

/// `functions`: the account with free functions beside what was named. Noise is that of either. `least_gain`: of a
/// joint's squares on folds, without which its functions do not help.
TorqueDiagnosis named(const Problem& problem, const Groundwork& groundwork, const Account& account,
                      const std::vector<Noise>& noise, const Account& functions,
                      const std::vector<Noise>& noise_of_functions, double least_gain);

}  // namespace truing::dynamics
