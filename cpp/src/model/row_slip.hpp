// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A row is missing, or measured twice, in the middle of one of two records that were joined row by row: up to there
// joints and measurements are in step, and from there on they are some rows apart.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rooms.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/robot.hpp"

namespace truing::model {

/// From row `from` on, what was measured `shift` rows further down belongs to a row's joints.
struct RowSlip {
  std::size_t from = 0;
  int shift = 0;
  double before = 0.0, after = 0.0;  ///< [m] median error from that row on, as handed over and with the slip undone
};

/// What a search for slips asks of whoever can fit and predict.
struct FramesFit {
  /// The robot with base and targets fitted to the rows whose weight is not zero.
  std::function<Robot(const Measurements&)> fit;
  /// How far every row's measurement is from what the robot predicts [m]; NaN: the row has none.
  std::function<std::vector<double>(const Robot&, const Measurements&)> errors;
};

/// The slip by one to three rows that is beyond doubt, if there is one. Base and targets are fitted to the first third
/// of the rows, or, where that is out of step in itself, to the last third. Then the rows on both sides of the slip
/// must say so, at least eight poses each and nine in ten of those that can tell: what is left before it in step, and
/// after it out of step, is as little, and the other way round many times more. So a few rows far out are no slip, nor
/// is a section that fits neither way, nor repeats of a pose, which cannot tell.
std::optional<RowSlip> find_row_slip(const Measurements& data, const FramesFit& frames);

/// The data with the slip undone. Rows in doubt, and those whose joints have no partner left, have the weight zero.
Measurements with_slip_undone(const Measurements& data, const RowSlip& slip);

/// First row that may have no partner, and the first one after it that has: the slip is somewhere between.
std::pair<std::size_t, std::size_t> rows_in_doubt(const Measurements& data, const RowSlip& slip);

/// "from row 121 on, what was measured 1 row further down belongs to a row's joints, ...": rows counted from 1.
std::string text_of(const RowSlip& slip);

}  // namespace truing::model
