// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Measurements of a robot that moves: rows follow each other as a tracker streams them, and no joint stands still for
// its row.

#include <functional>
#include <string>

#include "rooms.hpp"
#include "truing/model/measurement.hpp"

namespace truing::model {

/// Whether rows follow each other more quickly than a robot can stop and be measured, each joint about midway between
/// the rows beside it. Times must ascend.
bool moved_while_measured(const Measurements& data);

/// The data with the joints as they were `later` seconds after each row: cubics through readings and speeds (Hermite).
/// Speeds as inferred. Rows for which there is no reading on both sides are the nearest before that has them once more,
/// with the weight zero.
Measurements with_joints_at(const Measurements& data, double later);

/// At most so many rows that follow each other, from the middle.
Measurements middle_rows(const Measurements& data, std::size_t most);

/// Whether at least half of the rows have a weight.
bool has_most_rows(const Measurements& data);

/// Rows that are enough to look for a lag on.
constexpr std::size_t kRowsOfLag = 4000;

/// [s] by which joints are to be taken later for an error to be least: of steps of 20 ms up to half a second either way
/// the best, then the golden section around it. 0 where the error still falls at the end of these. `error`: of the
/// joints as they were so much later; infinite: nobody knows.
double best_lag(const std::function<double(double)>& error);

/// "the clocks of joints and measurement differ: what was measured belongs to where the joints were 35 ms earlier".
std::string text_of_lag(double later);

}  // namespace truing::model
