// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "truing/model/robot.hpp"

namespace truing {

/// What is wrong with the values of each effect that the robot carries on its torques (Robot::torque_effects), as
/// `unknown_effect_values` says it.
std::vector<std::string> unknown_torque_values(const Robot& robot);

}  // namespace truing
