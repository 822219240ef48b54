// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace truing {

/// Why an effect cannot be tested.
enum class Untestable {
  column_missing,  ///< a column is missing, or has rows without a number
  masses_missing,  ///< masses of the links are missing
  joint_at_rest,   ///< the joint does not move
  input_constant,  ///< its input never changes
  no_motion,       ///< it moves nothing at these poses
  same_as_frames,  ///< base and tool do the same
  same_as_masses,  ///< other masses of the links do the same
  other,           ///< as `why` says
};

/// An effect that the data could not show, whether it is there or not.
struct NotTestable {
  std::string effect;                     ///< its name
  std::vector<std::string> joints;        ///< where; empty: at any joint
  std::string why;                        ///< "no column temp_C", "J1 does not move", "the same as the base frame" …
  Untestable reason = Untestable::other;  ///< the same for programs
};

}  // namespace truing
