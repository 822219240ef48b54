// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// An instrument that was moved while it measured: from some row on all positions are in another frame.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "rooms.hpp"
#include "truing/model/measurement.hpp"

namespace truing::model {

using Positions = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;  ///< shape=(n, 3) [m]

struct FrameChange {
  std::int32_t row = 0;   ///< the first one in the other frame
  double together = 0.0;  ///< [m] rms distance between both with one frame
  double apart = 0.0;     ///< [m] the same with a frame of either part's own
  double move = 0.0;      ///< [m] that the middle of what was measured would seem to jump by
  double turn = 0.0;      ///< [rad] between both frames
};

/// The row from which on another frame leaves the least, where two frames leave less than a tenth of the squares of
/// one. `rows`: of both tables that are looked at, ascending; none of them NaN.
std::optional<FrameChange> find_frame_change(const Positions& predicted, const Positions& measured,
                                             const std::vector<std::int32_t>& rows);

/// The same of data with one frame and one target, and of what a robot predicts less what was measured. `off`:
/// shape=(n, 3) [m]; NaN: not measured.
std::optional<FrameChange> find_frame_change(const Measurements& data, const Positions& off);

/// Whether there are positions, and nothing that was measured otherwise.
bool has_one_frame(const Measurements& data);

/// Of the median error with one frame, that each part with its own may leave where the instrument was moved.
constexpr double kOfTwoFrames = 0.3;

/// "from row 71 on everything was measured from another place: the middle of the poses jumps by ...": rows from 1.
std::string text_of(const FrameChange& change);

}  // namespace truing::model
