// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Boards of another size than was said: their distances from the camera are all wrong by one factor.
#pragma once

#include "hand_eye/closed_form.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {

/// Boards at `factor` times the distances.
Frames with_lengths_times(double factor, Frames boards);

/// The factor on the board's lengths with which the motions agree best, least squares in all of them; NaN: they do not
/// tell. Rotation first, then position (Tsai and Lenz 1989), as lengths that are far off spoil rotations that are found
/// together with them.
double factor_on_lengths(const Frames& M, const Frames& B, const Rows& rows);

}  // namespace truing::hand_eye
