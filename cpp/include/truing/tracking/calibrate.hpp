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
  double start = 0.0;                                                    ///< [s] controller's clock
  double end = 0.0;                                                      ///< [s] controller's clock
  Eigen::Isometry3d T_base_flange = Eigen::Isometry3d::Identity();       ///< shape=(4, 4)
  Eigen::Isometry3d T_tracker_receiver = Eigen::Isometry3d::Identity();  ///< shape=(4, 4)
  double scatter = 0.0;     ///< [m] of the tracker's position, rms of a component: noise and sway
  std::size_t samples = 0;  ///< number of samples of the tracker
};

struct RestOptions {
  double least = 2.0;         ///< [s] shorter ones do not count: sway has to average out
  double margin = 0.5;        ///< [s] left out after the arm has stopped and before it starts
  double moved_by = 5e-4;     ///< [m] the flange of forward kinematics stays within this
  double turned_by = 5e-4;    ///< [rad] likewise
  double clock_offset = 0.0;  ///< [s] t_controller = t_tracker - clock_offset, to within a fraction of `margin`
};

/// Standstills of forward kinematics with what the tracker saw during them. Both sorted by time. Throws
/// std::invalid_argument on time that goes backwards and values that are not finite, naming the row.
std::vector<RestPose> find_rests(const std::vector<FrameSample>& flange, const std::vector<PoseSample>& tracker,
                                 const RestOptions& options = {});

enum class CalibrationStatus {
  done,
  not_observable,  ///< "not observable": the message says what does not show, and what to do
  not_consistent,  ///< "not consistent": the message names the reading that would make the numbers agree, if any
  not_converged,   ///< "not converged"
};
const char* name(CalibrationStatus status);

/// How far a test position is from the frames found, and what it counted in the refinement.
struct PositionError {
  double position = 0.0;  ///< [m]
  double rotation = 0.0;  ///< [rad]
  double weight = 1.0;    ///< about 1 where errors are usual, towards 0 where they are large
};

/// Tracker frame and receiver, of `calibrate_frames`.
struct FramesResult {
  CalibrationStatus status = CalibrationStatus::done;  ///< whether there is a result, and why not
  std::string message;                                 ///< one sentence
  std::vector<std::string> warnings;                   ///< what to know or do
  UncertainFrame T_tracker_base;                       ///< with covariance
  UncertainFrame T_flange_receiver;                    ///< with covariance
  std::vector<PositionError> errors;                   ///< one per test position
  double position_sigma = 0.0;                         ///< [m] usual error of one component
  double rotation_sigma = 0.0;                         ///< [rad] likewise
  int iterations = 0;                                  ///< of the refinement
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

/// The tool on the flange, of `calibrate_tool`.
struct ToolResult {
  CalibrationStatus status = CalibrationStatus::done;  ///< whether there is a result, and why not
  std::string message;                                 ///< one sentence
  UncertainFrame T_flange_tool;                        ///< with covariance
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     ///< shape=(3,) [m] where the tip was, in the base frame
  std::vector<double> pivot_error;                     ///< [m] of every pivot pose
  std::vector<double> orientation_error;               ///< [rad] of every orientation pose
};

/// Throws std::invalid_argument on fewer than three pivot poses and unequal counts. Standard errors follow the scatter
/// of the poses.
ToolResult calibrate_tool(const ToolPoses& poses);

// ---- Inertial sensor, gravity, clock --------------------------------------------------------------------------------

struct InertialOptions {
  double clock_search = 2.0;   ///< [s] offsets up to this are searched
  double clock_wanted = 1e-3;  ///< [s] standard error of the offset that is wanted; above it, advice is given
  double segment = 2.0;        ///< [s] length of the segments over which inertial data are integrated
  double gyro_bias = 0.05;     ///< [rad/s] standard deviation before any data
  double accel_bias = 0.1;     ///< [m/s^2] standard deviation before any data
  int max_iterations = 30;     ///< the fit stops here at the latest

  bool is_valid(std::string* error) const;
};

/// Inertial sensor, gravity and clock, of `calibrate_inertial`.
struct InertialResult {
  CalibrationStatus status = CalibrationStatus::done;            ///< whether there is a result, and why not
  std::string message;                                           ///< one sentence
  std::vector<std::string> warnings;                             ///< what to know or do
  UncertainFrame T_receiver_imu;                                 ///< with covariance
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();             ///< shape=(3,) [m/s^2] in the tracker frame
  Eigen::Matrix3d gravity_covariance = Eigen::Matrix3d::Zero();  ///< shape=(3, 3)
  std::string tracker_up;                                        ///< the tracker's axis that points up: '+z', '+y' …
  double clock_offset = 0.0;                                     ///< [s] t_imu = t_tracker - clock_offset
  double clock_offset_sigma = 0.0;                               ///< [s] standard error
  bool rich_enough = false;                                      ///< the offset is known as well as wanted
  std::string advice;                                            ///< what would make it so
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();           ///< shape=(3,) [rad/s]
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();          ///< shape=(3,) [m/s^2]
  double gyro_bias_sigma = 0.0;                                  ///< [rad/s] standard error, rms over the components
  double accel_bias_sigma = 0.0;                                 ///< [m/s^2] likewise
  /// shape=(3,) [rad/s] rms about the three principal axes, descending.
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();
  double position_rms = 0.0;  ///< [m] residual of one component
  double rotation_rms = 0.0;  ///< [rad] likewise
  int iterations = 0;         ///< of the fit
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
