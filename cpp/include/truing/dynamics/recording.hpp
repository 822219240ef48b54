// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/model/robot.hpp"

namespace truing {

struct Recording;

/// [Hz] of the low-pass that motion and torques go through, where none is given.
inline constexpr double kUsualCutoff = 8.0;

/// Rows of a recording in order of time, some of them each time that it is called: false when there are no more.
using NextRows = std::function<bool(Recording* rows)>;

/// A recording of motion: one file, one fold. Columns of the joints that have a reading, in chain order; a table that
/// was not recorded has no columns, a joint that was not recorded is NaN throughout.
struct Recording {
  std::string name;                ///< of the file, in messages and results
  Eigen::VectorXd time;            ///< shape=(n,) [s], increasing
  Eigen::MatrixXd position;        ///< shape=(n, joints) [rad | m] as read
  Eigen::MatrixXd speed;           ///< shape=(n, joints) [rad/s | m/s] as recorded, if it was
  Eigen::MatrixXd torque;          ///< shape=(n, joints) [Nm | N] of the drives, measured, if it was
  Eigen::MatrixXd current;         ///< shape=(n, joints) [A] of the drives, measured, if it was
  Eigen::MatrixXd command;         ///< shape=(n, joints) [rad | m] positions commanded, if they were recorded
  Eigen::MatrixXd speed_command;   ///< shape=(n, joints) [rad/s | m/s] speeds commanded, if they were recorded
  Eigen::MatrixXd torque_command;  ///< shape=(n, joints) [Nm | N] torques commanded, if they were recorded
  /// shape=(n,) each, by name: 'payload_kg', 'temp1_C' … or 'temp_C', 'volt_V', 'enabled', and one's own.
  std::map<std::string, Eigen::VectorXd> columns;
  /// Torques and currents are means over the time of a row, which is in its middle, and not values at its instant: of
  /// rows that are more than 12 ms apart, as nearer ones show no difference.
  bool torque_is_mean = false;
  bool test = false;  ///< held out: it is judged on, and never fitted to
  /// Of a recording that is longer than memory: begins to read it, as often as it is called. The tables above are then
  /// its first rows.
  std::function<NextRows()> read;
  double end = 0.0;  ///< [s] of a recording that is read: time of its last row

  std::size_t rows() const { return static_cast<std::size_t>(time.size()); }
};

/// Throws std::invalid_argument that names the recording, the column (as files have it, without its unit: q2, tau3) and
/// the row, counted from 1: tables of another shape, times that do not increase, values that are not finite (but for
/// joints that are NaN throughout, which a position must not be) or beyond 1e12, fewer than 20 rows. Of a recording
/// that is read, all of it is.
void validate(const Recording& recording, const Robot& robot);

}  // namespace truing
