// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/recording.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "math/text.hpp"
#include "rooms.hpp"

namespace truing {
using namespace dynamics;

namespace {

constexpr std::size_t kFewestRows = 20;  // fewer hold no motion that a filter could differentiate
constexpr double kLargest = 1e12;        // of any number: its square, and sums of such squares, are still numbers

/// One table of a recording, and how its columns are called in files: `stem`, the joint's number, `suffix`.
struct JointTable {
  const Eigen::MatrixXd* values;
  const char* field;
  const char* stem;
  const char* suffix = "";
};

[[noreturn]] void refuse(const Recording& recording, const std::string& what) {
  throw std::invalid_argument("recording '" + recording.name + "'" + what);
}

[[noreturn]] void refuse_value(const Recording& recording, const std::string& column, Eigen::Index row, double found,
                               const std::string& expected) {
  refuse(recording, ", column " + column + ", row " + std::to_string(row + 1) + ": found " + number(found, 12) +
                        ", expected " + expected);
}

bool usable(double value) { return std::abs(value) <= kLargest; }  // false for NaN

void require_usable(const Recording& recording, const std::string& column, const Eigen::VectorXd& values,
                    const std::string& hint) {
  for (Eigen::Index row = 0; row < values.size(); ++row) {
    if (usable(values[row])) continue;
    refuse_value(recording, column, row, values[row],
                 std::isfinite(values[row]) ? "a number between -1e12 and 1e12" : "a finite number: " + hint);
  }
}

void require_time(const Recording& recording) {
  require_usable(recording, "t", recording.time, "leave out rows without a stamp");
  for (Eigen::Index row = 1; row < recording.time.size(); ++row) {
    if (recording.time[row] > recording.time[row - 1]) continue;
    refuse_value(recording, "t", row, recording.time[row],
                 "a time after " + number(recording.time[row - 1], 12) +
                     ": sort the rows by time, and keep one of those with equal stamps");
  }
}

void require_table(const Recording& recording, const JointTable& table, std::size_t joints, bool required) {
  const Eigen::MatrixXd& values = *table.values;
  if (values.cols() == 0 && !required) return;
  if (values.rows() != recording.time.size() || static_cast<std::size_t>(values.cols()) != joints) {
    refuse(recording, ": " + std::string(table.field) + " has shape (" + std::to_string(values.rows()) + ", " +
                          std::to_string(values.cols()) + "), expected (" + std::to_string(recording.rows()) + ", " +
                          std::to_string(joints) + "): a row for every time, a column for every joint with a reading");
  }
  for (Eigen::Index k = 0; k < values.cols(); ++k) {
    const Eigen::VectorXd column = values.col(k);
    if (!required && column.array().isNaN().all()) continue;  // this joint was not recorded
    require_usable(recording, table.stem + std::to_string(k + 1) + table.suffix, column,
                   required ? "leave the rows out, or make two recordings of it"
                            : "leave the rows out, or make the column NaN throughout if it was not recorded");
  }
}

}  // namespace

namespace {

void require_rows(const Recording& recording, std::size_t joints) {
  require_time(recording);
  require_table(recording, {&recording.position, "position", "q"}, joints, true);
  for (const JointTable& table :
       {JointTable{&recording.speed, "speed", "qd"}, JointTable{&recording.torque, "torque", "tau"},
        JointTable{&recording.current, "current", "i"}, JointTable{&recording.command, "command", "u"},
        JointTable{&recording.speed_command, "speed_command", "ud"},
        JointTable{&recording.torque_command, "torque_command", "u", " (torque)"}})
    require_table(recording, table, joints, false);
  for (const auto& [name, values] : recording.columns) {
    if (values.size() != recording.time.size()) {
      refuse(recording, ", column " + name + ": has " + std::to_string(values.size()) + " rows, expected " +
                            std::to_string(recording.rows()) + " as there are times");
    }
    require_usable(recording, name, values, "fill the gaps, or leave the column out");
  }
}

}  // namespace

void validate(const Recording& recording, const Robot& robot) {
  const std::size_t joints = robot.driven_count();
  if (recording.rows() < kFewestRows) {
    refuse(recording, ": has " + std::to_string(recording.rows()) + " rows, expected at least " +
                          std::to_string(kFewestRows) + ": record a longer motion, or leave it out");
  }
  require_rows(recording, joints);
  if (!recording.read) return;
  const NextRows next = recording.read();
  Recording rows;
  double last = -std::numeric_limits<double>::infinity();
  while (next(&rows)) {
    if (rows.rows() == 0) continue;
    rows.name = recording.name;
    require_rows(rows, joints);
    if (!(rows.time[0] > last))
      refuse_value(rows, "t", 0, rows.time[0], "a time after " + number(last, 12) + ", the last of the rows before");
    last = rows.time[rows.time.size() - 1];
  }
}

}  // namespace truing
