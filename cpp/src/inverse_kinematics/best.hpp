// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "inverse_kinematics/search.hpp"
#include "rooms.hpp"

namespace truing::inverse_kinematics {

/// The best of all answers by InverseOptions::choose: over the branches of the closed form, over the rails before the
/// arm, over the roll of a torch; or of what descents from many seeds reach. False: none was found.
bool solve_for_best(const Query& query, Trace* trace, Solution* solution);

}  // namespace truing::inverse_kinematics
