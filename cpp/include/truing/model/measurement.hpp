// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "truing/model/robot.hpp"

namespace truing {

/// A read-only column of numbers somewhere in memory; it does not own them.
struct Column {
  const double* data = nullptr;
  std::ptrdiff_t stride = 1;  ///< in doubles

  explicit operator bool() const { return data != nullptr; }
  double operator[](std::size_t row) const { return data[static_cast<std::ptrdiff_t>(row) * stride]; }
};

/// One row per measurement. A row carries a position, a full pose, a distance, or touches a fixed point.
/// Absent columns are empty. Nothing is copied: memory stays with the caller (or with `owner`).
struct Measurements {
  std::size_t rows = 0;
  std::vector<Column> joints;             ///< readings of the driven joints, chain order [rad | m]
  std::array<Column, 3> position;         ///< of the target in the measurement frame [m]; NaN: not measured
  std::array<Column, 4> orientation;      ///< w x y z, Hamilton; NaN: not measured
  Column distance;                        ///< to the anchor [m]; NaN: not measured
  std::vector<std::int32_t> fixed_point;  ///< index into fixed_point_names, -1: none
  std::vector<std::string> fixed_point_names;
  std::vector<std::int32_t> target;  ///< index into Robot::targets; empty: all 0 (the tool)
  std::vector<Column> direction;     ///< approach direction per driven joint, -1, 0, 1
  std::vector<Column> joint_speed;   ///< per driven joint [rad/s | m/s]
  Column payload;                    ///< [kg]
  Column temperature;                ///< [deg C]
  Column time;                       ///< [s]
  std::vector<std::int32_t> pose;    ///< group of rows of one robot pose; empty: equal joints make a group
  std::vector<std::int8_t> set;      ///< 0 train, 1 test; empty: split by options
  Column position_sigma;             ///< per row [m]; empty: one unknown sigma, estimated
  Column rotation_sigma;             ///< per row [rad]
  Column weight;                     ///< per row, multiplies the squared residual
  std::map<std::string, Column> covariates;
  std::shared_ptr<const void> owner;  ///< keeps the memory behind the columns alive, if set

  bool has_position(std::size_t row) const { return position[0] && position[0][row] == position[0][row]; }
  bool has_orientation(std::size_t row) const { return orientation[0] && orientation[0][row] == orientation[0][row]; }
  bool has_distance(std::size_t row) const { return distance && distance[row] == distance[row]; }
  bool has_fixed_point(std::size_t row) const { return !fixed_point.empty() && fixed_point[row] >= 0; }
};

/// Throws std::invalid_argument naming the row (counted from 0) and what is wrong: counts that do not fit the robot,
/// joints or inputs that are not finite, a row without any measurement (unless `joints_only`), half a position, a
/// quaternion that is not of unit length (1e-3), direction not in {-1, 0, 1}, sigma <= 0. Temperature and covariates
/// may hold NaN: an effect that needs them says so.
void validate(const Measurements& data, const Robot& robot, bool joints_only = false);

/// Group number of every row, 0 … count-1 in order of appearance: `pose` if given, else equal joint readings.
std::vector<std::int32_t> pose_groups(const Measurements& data);

/// The data with approach directions as the order of the rows shows them, if the poses were driven to one after the
/// other: the sign of every joint's last motion of more than 1e-4 [rad | m], 0 before the first one. Data that have
/// directions stay as they are.
Measurements with_inferred_directions(const Measurements& data);

/// The data with joint speeds as joints and times show them, if the robot moved while it was measured: rows follow each
/// other more quickly than it can stop (0.25 s), each joint about midway between the rows beside it. Slopes of
/// parabolas through three rows. Other data, and those that have speeds, stay as they are.
Measurements with_inferred_speeds(const Measurements& data);

}  // namespace truing
