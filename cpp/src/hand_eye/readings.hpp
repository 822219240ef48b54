// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Other readings of the same numbers: inverted poses, another order of quaternion or angles, millimetres for metres, a
/// left-handed frame …
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hand_eye/closed_form.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {

/// Applies a reading by its name, or several joined by "+". Throws std::invalid_argument that lists the names there
/// are.
void apply_reading(const std::string& name, Frames* hand, Frames* board);

/// The set-up is not the one that was told: proposed, but not a way to read poses.
constexpr const char* kOtherSetup = "other-setup";

/// What a reading, or several joined by "+", is about.
struct ReadingScope {
  bool hand_first = false;  ///< the first of them is of the hand's poses
  bool board = false;       ///< one is of the boards, or of the rows they belong to
  bool rows = false;        ///< one is of the rows
  bool setup = false;       ///< one is of the set-up
};
ReadingScope scope_of(const std::string& name);

/// Readings in which the loop of `rows` closes clearly better than in the one given (medians), best first, simplest
/// among equals.
std::vector<Reading> find_readings(const Frames& T_base_hand, const Frames& T_camera_board, HandEyeSetup setup,
                                   const Rows& rows, double position, double rotation);

}  // namespace truing::hand_eye
