// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/model/measurement.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "math/text.hpp"
#include "rooms.hpp"

namespace truing {
using namespace model;

namespace {

[[noreturn]] void refuse_row(std::size_t row, const std::string& what) {
  throw std::invalid_argument("row " + std::to_string(row) + ": " + what);
}

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument(what); }

// Of lengths and angles: beyond any machine, and within what the kernel's sine and the squares of residuals can hold.
constexpr double kLargest = 1e6;

void require_usable(const Column& column, const std::string& name, std::size_t rows) {
  if (!column) return;
  for (std::size_t row = 0; row < rows; ++row) {
    if (std::abs(column[row]) > kLargest)
      refuse_row(row, name + " is " + number(column[row]) + ", expected a value between -1e6 and 1e6 (m, rad)");
  }
}

void require_finite(const Column& column, const std::string& name, std::size_t rows) {
  if (!column) return;
  for (std::size_t row = 0; row < rows; ++row) {
    if (!std::isfinite(column[row]))
      refuse_row(row, name + " is " + number(column[row]) + ", expected a finite number");
  }
}

void require_positive(const Column& column, const std::string& name, std::size_t rows) {
  require_finite(column, name, rows);
  for (std::size_t row = 0; column && row < rows; ++row) {
    if (!(column[row] > 0.0)) refuse_row(row, name + " is " + number(column[row]) + ", expected more than zero");
  }
}

void require_not_negative(const Column& column, const std::string& name, std::size_t rows) {
  require_finite(column, name, rows);
  for (std::size_t row = 0; column && row < rows; ++row) {
    if (column[row] < 0.0) refuse_row(row, name + " is " + number(column[row]) + ", expected zero or more");
  }
}

template <class Number>
void require_integers(const std::vector<Number>& values, const std::string& name, std::size_t rows, std::int64_t lowest,
                      std::int64_t end, const std::string& expected) {
  if (values.empty()) return;
  if (values.size() != rows) {
    refuse(name + " has " + std::to_string(values.size()) + " entries, there are " + std::to_string(rows) + " rows");
  }
  for (std::size_t row = 0; row < rows; ++row) {
    const auto value = static_cast<std::int64_t>(values[row]);
    if (value < lowest || value >= end)
      refuse_row(row, name + " is " + std::to_string(value) + ", expected " + expected);
  }
}

// Columns that go together: all given or none, and in every row all measured or none (NaN).
template <std::size_t N>
void require_whole(const std::array<Column, N>& columns, const std::string& name, std::size_t rows) {
  std::size_t given = 0;
  for (const Column& column : columns) given += column ? 1 : 0;
  if (given == 0) return;
  if (given < N) refuse(name + " has " + std::to_string(given) + " of its " + std::to_string(N) + " columns");
  for (std::size_t row = 0; row < rows; ++row) {
    std::size_t measured = 0;
    for (const Column& column : columns) {
      if (std::isinf(column[row])) refuse_row(row, name + " is infinite");
      measured += std::isnan(column[row]) ? 0 : 1;
    }
    if (measured != 0 && measured != N) {
      refuse_row(row, name + " is half measured: " + std::to_string(measured) + " of " + std::to_string(N) +
                          " values are numbers; all or none (NaN) are expected");
    }
  }
}

void require_unit_quaternions(const Measurements& data) {
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (!data.has_orientation(row)) continue;
    double squared = 0.0;
    for (const Column& column : data.orientation) squared += column[row] * column[row];
    if (std::abs(std::sqrt(squared) - 1.0) > 1e-3) {
      refuse_row(row, "orientation has length " + number(std::sqrt(squared)) +
                          ", expected a unit quaternion in the order w, x, y, z");
    }
  }
}

void require_joints(const Measurements& data, const Robot& robot) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  const auto require_count = [&driven](const std::vector<Column>& columns, const std::string& what) {
    if (columns.size() == driven.size()) return;
    refuse("got " + std::to_string(columns.size()) + " columns of " + what + ", the robot has " +
           std::to_string(driven.size()) + " driven joints (passive joints have none)");
  };
  require_count(data.joints, "joint readings");
  if (!data.direction.empty()) require_count(data.direction, "approach direction");
  if (!data.joint_speed.empty()) require_count(data.joint_speed, "joint speed");
  for (std::size_t k = 0; k < driven.size(); ++k) {
    const std::string& name = robot.joints[driven[k]].name;
    if (!data.joints[k]) refuse("joint " + name + " has no column of readings");
    require_finite(data.joints[k], "reading of joint " + name, data.rows);
    require_usable(data.joints[k], "reading of joint " + name, data.rows);
    if (!data.joint_speed.empty()) require_finite(data.joint_speed[k], "speed of joint " + name, data.rows);
    if (data.direction.empty() || !data.direction[k]) continue;
    for (std::size_t row = 0; row < data.rows; ++row) {
      const double value = data.direction[k][row];
      if (value != -1.0 && value != 0.0 && value != 1.0) {
        refuse_row(row, "approach direction of joint " + name + " is " + number(value) + ", expected -1, 0 or 1");
      }
    }
  }
}

void require_some_measurement(const Measurements& data) {
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (data.has_position(row) || data.has_orientation(row) || data.has_distance(row) || data.has_fixed_point(row))
      continue;
    refuse_row(row, "nothing is measured: expected a position, a pose, a distance or a fixed point");
  }
}

// Multiplicative hashing (Knuth, The Art of Computer Programming 3, 6.4), the high half folded back so that
// the low bits depend on all: round readings differ in their high bits only.
std::uint64_t mixed(std::uint64_t hash, std::uint64_t bits) {
  hash = (hash ^ bits) * 0x9E3779B97F4A7C15u;
  return hash ^ (hash >> 32);
}

// Numbers rows by equal keys in order of first appearance. Open addressing: one int32 per slot and one row
// number per group is all that is held, 12 to 24 bytes a row; keys stay in the caller's columns.
template <class Hash, class Equal>
std::vector<std::int32_t> numbered_groups(std::size_t rows, Hash hash, Equal equal) {
  if (rows > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    refuse("more than 2^31 - 1 rows in one piece");
  }
  std::size_t slots = 16;
  while (slots < 2 * rows) slots *= 2;
  std::vector<std::int32_t> group_in_slot(slots, -1);
  std::vector<std::uint32_t> first_row;
  std::vector<std::int32_t> group(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    std::size_t slot = hash(row) & (slots - 1);
    while (group_in_slot[slot] >= 0 && !equal(row, first_row[static_cast<std::size_t>(group_in_slot[slot])])) {
      slot = (slot + 1) & (slots - 1);
    }
    if (group_in_slot[slot] < 0) {
      group_in_slot[slot] = static_cast<std::int32_t>(first_row.size());
      first_row.push_back(static_cast<std::uint32_t>(row));
    }
    group[row] = group_in_slot[slot];
  }
  return group;
}

}  // namespace

void validate(const Measurements& data, const Robot& robot, bool joints_only) {
  if (data.rows == 0) refuse("there are no rows");
  require_joints(data, robot);
  require_whole(data.position, "position", data.rows);
  for (const Column& column : data.position) require_usable(column, "position", data.rows);
  require_usable(data.distance, "distance", data.rows);
  require_whole(data.orientation, "orientation", data.rows);
  require_unit_quaternions(data);
  require_integers(data.fixed_point, "fixed_point", data.rows, -1,
                   static_cast<std::int64_t>(data.fixed_point_names.size()),
                   "-1 (none) or an index into the " + std::to_string(data.fixed_point_names.size()) + " fixed points");
  const std::size_t targets =
      robot.targets.empty() ? 1 : robot.targets.size();  // none given: the last frame is the tool
  require_integers(data.target, "target", data.rows, 0, static_cast<std::int64_t>(targets),
                   "an index into the robot's " + std::to_string(targets) + " targets, counted from 0");
  require_integers(data.set, "set", data.rows, 0, 2, "0 (train) or 1 (test)");
  require_integers(data.pose, "pose", data.rows, std::numeric_limits<std::int32_t>::min(),
                   std::int64_t{std::numeric_limits<std::int32_t>::max()} + 1, "a group number");
  require_not_negative(data.payload, "payload", data.rows);
  require_finite(data.time, "time", data.rows);
  require_positive(data.position_sigma, "position_sigma", data.rows);
  require_positive(data.rotation_sigma, "rotation_sigma", data.rows);
  if (data.rotation_sigma && !data.position_sigma) {
    throw std::invalid_argument(
        "rotation_sigma needs position_sigma beside it: rows are weighed by both or by neither");
  }
  require_not_negative(data.weight, "weight", data.rows);
  if (!joints_only) require_some_measurement(data);
}

std::vector<std::int32_t> pose_groups(const Measurements& data) {
  if (!data.pose.empty()) {
    if (data.pose.size() != data.rows)
      refuse("pose has " + std::to_string(data.pose.size()) + " entries, there are " + std::to_string(data.rows) +
             " rows");
    const auto hash = [&data](std::size_t row) { return mixed(0, static_cast<std::uint32_t>(data.pose[row])); };
    const auto equal = [&data](std::size_t row, std::size_t other) { return data.pose[row] == data.pose[other]; };
    return numbered_groups(data.rows, hash, equal);
  }
  const auto hash = [&data](std::size_t row) {
    std::uint64_t value = 0;
    for (const Column& joint : data.joints) {
      const double reading = joint[row] + 0.0;  // -0 equals 0 but has other bits
      std::uint64_t bits;
      std::memcpy(&bits, &reading, sizeof bits);
      value = mixed(value, bits);
    }
    return value;
  };
  const auto equal = [&data](std::size_t row, std::size_t other) {
    for (const Column& joint : data.joints) {
      if (!(joint[row] == joint[other])) return false;
    }
    return true;
  };
  return numbered_groups(data.rows, hash, equal);
}

Measurements with_inferred_directions(const Measurements& data) {
  if (!data.direction.empty()) return data;
  constexpr double kAtRest = 1e-4;  ///< [rad | m] a joint that moves less keeps its side
  struct Owned {
    std::shared_ptr<const void> rest;
    std::vector<std::vector<double>> columns;
  };
  const std::size_t joints = data.joints.size();
  const auto owned = std::make_shared<Owned>(
      Owned{data.owner, std::vector<std::vector<double>>(joints, std::vector<double>(data.rows, 0.0))});
  const std::vector<std::int32_t> group = pose_groups(data);
  for (std::size_t k = 0; k < joints; ++k) {
    double direction = 0.0;
    for (std::size_t row = 1; row < data.rows; ++row) {
      const double step = data.joints[k][row] - data.joints[k][row - 1];
      if (group[row] != group[row - 1] && std::abs(step) > kAtRest) direction = step > 0.0 ? 1.0 : -1.0;
      owned->columns[k][row] = direction;
    }
  }
  Measurements out = data;
  for (const std::vector<double>& column : owned->columns) out.direction.push_back({column.data(), 1});
  out.owner = owned;
  return out;
}

}  // namespace truing
