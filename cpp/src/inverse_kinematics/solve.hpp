// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One target: one answer, the next of a chain, or all answers.

#include "inverse_kinematics/search.hpp"
#include "rooms.hpp"

namespace truing::inverse_kinematics {

/// One answer, or why there is none. `by_way`: approach directions are those of the way from the seed. `trace`: what
/// was met so far.
Solution solve(const Query& query, bool by_way, Trace* trace);

/// From the seed alone, and within limits.
Solution follow(const Query& query, bool by_way);

/// All answers that the closed form knows of, or many descents find.
void find_branches(const Query& query, bool by_way, Branches* found);

/// Where effects ask for the direction that a joint came from and nobody said: the way from the seed. An answer
/// changes the ways, and the ways the answer, by no more than the play: a few rounds settle it.
void settle_directions(const Query& query, Trace* trace, Solution* solution);

}  // namespace truing::inverse_kinematics
