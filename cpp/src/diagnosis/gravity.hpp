// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <Eigen/Core>

#include "diagnosis/diagnosis.hpp"

namespace truing::diagnosis {

/// Gravity [m/s^2] in the base frame by which joints give way under the weight, where that is for sure not the one that
/// the robot's file has: arms hang from ceilings and walls, and the file seldom says so. None: the file may be right.
std::optional<Eigen::Vector3d> other_gravity(const Work& work);

/// What is said of it.
SanityFinding gravity_finding(const Eigen::Vector3d& gravity);

}  // namespace truing::diagnosis
