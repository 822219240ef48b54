// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/common/error_statistics.hpp"
#include "truing/model/measurement.hpp"

namespace truing::model {

/// Another reading of what was handed over.
struct Reading {
  Robot robot;
  Measurements data;
  std::string kind;           ///< 'joint_sign', 'joint_order', 'joint_unit', 'length_unit', 'handedness', 'link_unit',
                              ///< 'row_shift' or 'convention'; of orientations see below
  std::string text;           ///< what is read otherwise: 'turning the sign of joint column 2'
  double length_scale = 1.0;  ///< measured lengths in `data` over those handed over
};

/// The usual mistakes, each undone: two joint columns exchanged, the sign of one turned, angles or lengths in another
/// unit, positions of a left-handed frame, joints and measurements up to three rows apart, the table of links read by
/// the other convention. Each is made when it is called, since it copies columns; robot and data must outlive them.
std::vector<std::function<Reading()>> readings_of(const Robot& robot, const Measurements& data);

/// Another reading of the orientations, 'orientation_order', 'orientation_inverse' or 'pose_inverse', and the rms
/// rotation errors with base and targets fitted [rad].
struct BetterOrientations {
  Reading reading;
  double as_is = 0.0, left = 0.0;
};

/// The reading of the orientations that agrees with the robot, where they do not as they are: scalar last, the inverse,
/// or the whole pose of the robot's base in the tool. `errors`: what base and targets leave.
std::optional<BetterOrientations> better_orientations(
    const Robot& robot, const Measurements& data, const std::function<ErrorStatistics(const Measurements&)>& errors);

/// What it explains, and what to do, in sentences.
std::string text_of(const BetterOrientations& better);

/// The joints of every row with what was measured `shift` rows further down. Rows that have no such row are the last
/// one that has, once more. `with_rows_paired`: of every row, whose joints, and what was measured in which one.
Measurements with_rows_shifted(const Measurements& data, int shift);
Measurements with_rows_paired(const Measurements& data, const std::vector<std::size_t>& joints_of,
                              const std::vector<std::size_t>& measured_of);

/// Rows that are enough to compare readings by: every so many, the others with weight zero. It must outlive what uses
/// its weights.
struct RowSample {
  std::vector<std::int32_t> rows;
  std::vector<double> weights;  ///< of all rows
};

RowSample sample_of(const Measurements& data, std::size_t most);

/// How large what was measured is [m]: the diagonal of the box around all positions of these rows, without any the
/// range of their distances; 0: none of either.
double measured_range(const Measurements& data, const std::vector<std::int32_t>& rows);

/// The data with other joint columns.
Measurements with_joint_columns(const Measurements& data, std::vector<std::vector<double>> columns);

}  // namespace truing::model
