// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "truing/handeye.hpp"
#include "truing/tracking/streams.hpp"

namespace truing {

// What a TrackSetup is made of, from recordings. Test positions give the tracker's frame and the receiver; poses with
// the tool tip on a point and with the tool in prescribed orientations give the tool; a recording of a motion gives
// inertial sensor, gravity and clock. See docs/method/track.md.

// ---- Test positions -------------------------------------------------------------------------------------------------

/// A standstill, averaged.
struct RestPose {
  double start = 0.0, end = 0.0;  ///< controller's clock [s]
  Eigen::Isometry3d T_base_flange = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_tracker_receiver = Eigen::Isometry3d::Identity();
  double scatter = 0.0;     ///< of the tracker's position, rms of a component: noise and sway [m]
  std::size_t samples = 0;  ///< of the tracker
};

struct RestOptions {
  double least = 2.0;         ///< shorter ones do not count: sway has to average out [s]
  double margin = 0.5;        ///< left out after the arm has stopped and before it starts [s]
  double position = 5e-4;     ///< the flange of forward kinematics stays within this [m]
  double rotation = 5e-4;     ///< [rad]
  double clock_offset = 0.0;  ///< t_controller = t_tracker - clock_offset, a fraction of `margin` is enough [s]
};

/// Standstills of forward kinematics with what the tracker saw during them. Both sorted by time. Throws
/// std::invalid_argument on time that goes backwards and values that are not finite, naming the row.
std::vector<RestPose> find_rests(const std::vector<FrameSample>& flange, const std::vector<PoseSample>& tracker,
                                 const RestOptions& options = {});

enum class CalibrationStatus {
  done,
  not_observable,  ///< the message says what does not show, and what to do
  not_consistent,  ///< the message names the reading of the numbers that would make them agree, if there is one
  not_converged,
};
const char* name(CalibrationStatus status);

/// How far a test position is from the frames found, and what it counted in the refinement.
struct PositionError {
  double position = 0.0;  ///< [m]
  double rotation = 0.0;  ///< [rad]
  double weight = 1.0;    ///< about 1 where errors are usual, towards 0 where they are large
};

struct FramesResult {
  CalibrationStatus status = CalibrationStatus::done;
  std::string message;
  std::vector<std::string> warnings;
  UncertainFrame T_tracker_base, T_flange_receiver;
  std::vector<PositionError> errors;  ///< one per test position
  double position_sigma = 0.0;        ///< usual error of one component [m]
  double rotation_sigma = 0.0;        ///< [rad]
  int iterations = 0;
};

/// Tracker frame and receiver, T_tracker_receiver = T_tracker_base T_base_flange T_flange_receiver: dual quaternions in
/// closed form (as `handeye`, whose reasons for what is wrong with the numbers are used), then least squares in which
/// every position counts by its own error: weights of a multivariate t distribution with five degrees of freedom
/// (Lange, Little and Taylor 1989). Throws std::invalid_argument as `handeye` does.
FramesResult calibrate_frames(const std::vector<Eigen::Isometry3d>& T_base_flange,
                              const std::vector<Eigen::Isometry3d>& T_tracker_receiver);

// ---- Tool -----------------------------------------------------------------------------------------------------------

struct ToolPoses {
  std::vector<Eigen::Isometry3d> pivot;  ///< T_base_flange with the tool tip on one point, in several orientations
  std::vector<Eigen::Isometry3d>
      orientation;  ///< T_base_flange with the tool in prescribed orientations; empty: the flange's axes are the tool's
  std::vector<Eigen::Matrix3d> prescribed;  ///< R_base_tool of those
};

struct ToolResult {
  CalibrationStatus status = CalibrationStatus::done;
  std::string message;
  UncertainFrame T_flange_tool;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< where the tip was, base [m]
  std::vector<double> pivot_error;                  ///< of every pivot pose [m]
  std::vector<double> orientation_error;            ///< of every orientation pose [rad]
};

/// Throws std::invalid_argument on fewer than three pivot poses and unequal counts. Standard errors follow the scatter
/// of the poses.
ToolResult calibrate_tool(const ToolPoses& poses);

// ---- Inertial sensor, gravity, clock --------------------------------------------------------------------------------

struct InertialOptions {
  double clock_search = 2.0;   ///< offsets up to this are looked for [s]
  double clock_wanted = 1e-3;  ///< a larger standard error of the offset is not enough, and advice is given [s]
  double segment = 2.0;        ///< inertial data are integrated over so long [s]
  double gyro_bias = 0.05;     ///< standard deviations before any data [rad/s]
  double accel_bias = 0.1;     ///< [m/s^2]
  int max_iterations = 30;

  bool is_valid(std::string* error) const;
};

struct InertialResult {
  CalibrationStatus status = CalibrationStatus::done;
  std::string message;
  std::vector<std::string> warnings;
  UncertainFrame T_receiver_imu;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  ///< in the tracker frame [m/s^2]
  Eigen::Matrix3d gravity_covariance = Eigen::Matrix3d::Zero();
  std::string tracker_up;                               ///< the tracker's axis that points up: "+z", "+y", …
  double clock_offset = 0.0, clock_offset_sigma = 0.0;  ///< t_imu = t_tracker - clock_offset [s]
  bool rich_enough = false;                             ///< the offset is known as well as wanted
  std::string advice;                                   ///< what would make it so
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rms about the three principal axes, descending [rad/s]
  double position_rms = 0.0, rotation_rms = 0.0;            ///< of one component, what is left [m], [rad]
  int iterations = 0;
};

/// Where the inertial sensor is on the receiver, gravity, and the offset of the clocks: a start by correlating angular
/// speeds and by the rotation that makes them agree (Wahba 1965), then inertial data integrated over short segments
/// against the tracker, with everything unknown in one least squares: per segment pose and speed, over all the frame,
/// biases, gravity and the offset. Standard errors from the scatter of the segments, so that they hold for errors that
/// are correlated within one. Needs orientations of the tracker. Throws std::invalid_argument on data that cannot be
/// used.
InertialResult calibrate_inertial(const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker,
                                  const InertialOptions& options = {});

/// The parts put together; gravity in the base frame. `notes` (may be null): what the user should know, as a base that
/// is not level.
TrackSetup assemble_setup(const FramesResult& frames, const ToolResult& tool, const InertialResult& inertial,
                          std::vector<std::string>* notes = nullptr);

}  // namespace truing
