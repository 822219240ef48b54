// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// From the closed form to the robot as it is.

#include "inverse_kinematics/search.hpp"
#include "rooms.hpp"

namespace truing::inverse_kinematics {

/// A seed that the closed form gave.
struct Candidate {
  double readings[kMaxDrivenJoints];
  double distance;  ///< from the seed, squared, joints in radians' worth
  double excess;    ///< beyond limits
  int branch;
};

/// What the closed form knows of a pose with the rails there, nearest to the seed first; `slack`: how far beyond limits
/// they may lie. `found` has room for ClosedForm::kMost; the number of them.
int candidates(const Query& query, const Goal& pose, const double* rails, double slack, Candidate* found);

/// A candidate carried over to the robot as it is, rails and limits aside; then the turns nearest to the seed within
/// limits. True: `solution` is reached.
bool polish(const Query& query, const Candidate& candidate, Trace* trace, Solution* solution);

}  // namespace truing::inverse_kinematics
