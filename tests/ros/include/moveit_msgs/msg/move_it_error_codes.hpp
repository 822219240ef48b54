// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone: the values of the message that ros/truing_ros uses.

#include <cstdint>

namespace moveit_msgs::msg {

struct MoveItErrorCodes {
  static constexpr std::int32_t SUCCESS = 1, TIMED_OUT = -6, GOAL_IN_COLLISION = -12, NO_IK_SOLUTION = -31;
  std::int32_t val = 0;
};

}  // namespace moveit_msgs::msg
