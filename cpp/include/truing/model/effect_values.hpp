// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "truing/model/robot.hpp"

namespace truing {

/// What is wrong with the values of each effect that the robot carries (Robot::effects), in words: a value that its law
/// does not look at, which would do nothing. "": nothing, or the effect is the caller's own, or what it needs is not
/// known here.
std::vector<std::string> unknown_effect_values(const Robot& robot);

}  // namespace truing
