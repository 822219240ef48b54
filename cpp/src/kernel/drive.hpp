// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Servo joints that do not know of each other, side by side in SIMD lanes. See README.md in this folder.

#include <cstddef>

namespace truing::kernel {

/// Rows of a tile's table, one number a lane. Units as in truing/dynamics/servo.hpp.
enum class DriveRow : int {
  // of the chain, for good
  command_gain,
  integral_gain,
  damping_gain,
  feedback,     ///< damping that the controller makes
  most_change,  ///< of the command in a step; infinite: no limit
  saturation,
  drive_law,
  drive_reference,
  dead_band,
  coulomb,
  viscous_law,
  stribeck,
  stribeck_speed,
  load_friction,
  asymmetric_friction,
  presliding,
  warmup,
  spring,
  current_offset,
  gravity_scale,
  armature,
  zero,
  weight,
  turns,
  rate,  ///< [1/s] of the recording's rows
  // from a row of the recording to the next
  on,
  enabled,
  gain,
  supply,
  warmth,
  viscous,
  inertia,
  bias,
  cosine,
  sine,
  position,
  inertia_more,  ///< of the next row, less this one's; so the four after it
  bias_more,
  cosine_more,
  sine_more,
  position_more,
  command_before,
  command,  ///< of the row that the first step sees, and of its neighbours
  command_next,
  command_after,
  // what changes step by step
  angle,
  speed,
  wanted,
  integral,
  bristle,
  time,
  torque,
  moves,  ///< 0: what has left stays where it is
  // for every step after a row: whether it sees the row after the first step's, and the part of its next
  late
};

constexpr int drive_rows(int steps) { return static_cast<int>(DriveRow::late) + 2 * steps; }

/// Straight lines through values at even places of an input, as a torque.
struct DriveFunction {
  enum class Input : int { speed, load, angle, command_error, time, directed_load, directed_angle };
  Input input;
  double low, width;
  const double* values;
  int count;
};

/// Laws that few chains have, and that take long.
enum DriveLaws : unsigned {
  kDriveDamped = 1,         ///< damping_gain, feedback
  kDriveBent = 2,           ///< drive_law
  kDriveStribeck = 4,       ///< stribeck
  kDriveAsymmetric = 8,     ///< asymmetric_friction
  kDrivePresliding = 16,    ///< presliding
  kDriveFunctions = 32,     ///< functions
  kDriveTorqueCommand = 64  ///< commands are torques
};

struct DriveTile {
  double* table;                          ///< [row][lanes], rows of `DriveRow`
  int lanes;                              ///< a multiple of kSampleMultiple
  int steps;                              ///< from a row of the recording to the next
  double step;                            ///< [s]
  unsigned laws;                          ///< of `DriveLaws`: those that any lane has
  const DriveFunction* const* functions;  ///< [lanes + 1]: from each lane's first to the next lane's
};

struct DriveFunctions {
  const char* name;
  /// All steps from a row of the recordings to the next.
  void (*turn)(const DriveTile&);
};

/// The copy of the same name as functions().
const DriveFunctions& drive_functions();
/// The named copy, or null when this machine or build lacks it.
const DriveFunctions* drive_functions(const char* name);

}  // namespace truing::kernel
