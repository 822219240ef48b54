// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "inverse_kinematics/search.hpp"
#include "rooms.hpp"

namespace truing::inverse_kinematics {

/// Why a target is not reached, and what is the nearest to it.
void explain(const Query& query, Trace* trace, Solution* solution);

}  // namespace truing::inverse_kinematics
