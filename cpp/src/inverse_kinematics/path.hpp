// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "inverse_kinematics/search.hpp"
#include "rooms.hpp"

namespace truing::inverse_kinematics {

/// Joints along a chain of goals: the cheapest chain over samples, evened out. `scratch` as for one solve; `by_way`:
/// approach directions are those of the path.
Path find_path(const PreparedRobot& robot, const std::vector<Goal>& goals, const double* seed, const PathOptions& how,
               EffectScratch* scratch, bool by_way, const std::function<bool(std::size_t)>& progress);

}  // namespace truing::inverse_kinematics
