// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What was found, in words: how sure, how much, what else it may be.

#include "dynamics/search.hpp"
#include "rooms.hpp"
#include "truing/dynamics/diagnose.hpp"

namespace truing::dynamics {

TorqueDiagnosis named(const Problem& problem, const Groundwork& groundwork, const TorqueDesign& design,
                      const Sums& sums, const Sums& held_out, const Search& search, const Choice& choice,
                      const Choice& with_unknown, const std::vector<Noise>& noise);

}  // namespace truing::dynamics
