// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "truing/model/robot.hpp"
#include "truing/tracking/streams.hpp"

namespace truing {

/// A flexible mode of the arm: one damped oscillator, driven by the acceleration of the rigid arm's tip, by gravity and
/// by gusts,
///
///     q'' + 2 zeta omega q' + omega^2 q = -participation . (a_tip - g) * reach/reference + gust,
///
/// that moves the tip by direction * q and turns it by rotation * q. Vectors stand in the base's axes, slewed with the
/// first joint.
struct FlexibleMode {
  double frequency = 1.0;                                ///< [Hz] undamped, at the reference reach
  double damping = 0.015;                                ///< damping ratio zeta
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< shape=(3,): of the tip's motion, per unit of the mode
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();    ///< shape=(3,) [rad/m]: of the tip, per unit of the mode
  Eigen::Vector3d participation =
      Eigen::Vector3d::Zero();  ///< shape=(3,): fraction of the tip's acceleration driving it
  double gust = 0.0;            ///< [m] standard deviation of the sway that gusts alone would make
};

enum class SimulatedMotion {
  still,        ///< no motion, gusts only
  gentle,       ///< slow waves of all joints
  stop_and_go,  ///< "stop-and-go": jerk-limited moves between random joint positions, with rests
};

/// Errors of a simulated inertial sensor (densities as in data sheets).
struct ImuErrors {
  double gyro_noise = 1e-4;       ///< [rad/s/sqrt(Hz)] noise density
  double accel_noise = 1e-3;      ///< [m/s^2/sqrt(Hz)] noise density
  double gyro_bias = 2e-3;        ///< [rad/s] standard deviation at the start
  double accel_bias = 3e-2;       ///< [m/s^2] standard deviation at the start
  double gyro_bias_walk = 1e-5;   ///< [rad/s/sqrt(s)] random walk
  double accel_bias_walk = 1e-4;  ///< [m/s^2/sqrt(s)] random walk
  double gyro_scale = 3e-4;       ///< standard deviation of each axis' scale error
  double accel_scale = 3e-4;      ///< standard deviation of each axis' scale error
};

/// Errors of a simulated tracker, and of its way to the computer.
struct TrackerErrors {
  double position_noise = 1e-3;   ///< [m] of one component
  double rotation_noise = 1e-3;   ///< [rad] of one component
  double latency = 0.03;          ///< [s] mean
  double latency_jitter = 0.004;  ///< [s] standard deviation; no sample arrives before it was taken
  double clock_offset = 0.0;      ///< [s] t_tracker = t_imu * (1 + clock_drift) + clock_offset
  double clock_drift = 0.0;       ///< [s/s]
  double out_of_order = 0.0;      ///< fraction of the samples that take 25 ms more
  double lost = 0.0;              ///< fraction of single samples that never arrive
};

/// The tracker gives nothing for a while.
struct Dropout {
  double start = 0.0;    ///< [s]
  double seconds = 0.0;  ///< [s] length
};

/// From `start` on the tracker frame is another: T_old_new, in the tracker frame.
struct StationShift {
  double start = 0.0;                                           ///< [s]
  Eigen::Isometry3d T_old_new = Eigen::Isometry3d::Identity();  ///< shape=(4, 4)
};

/// A simulated recording.
struct StreamSimulationOptions {
  double seconds = 60.0;                             ///< [s] length
  SimulatedMotion motion = SimulatedMotion::gentle;  ///< how the arm moves
  double tip_speed = 0.3;                            ///< [m/s] rms of a gentle motion, maximum of stop-and-go
  double imu_rate = 1000.0;                          ///< [Hz]
  double tracker_rate = 100.0;                       ///< [Hz]
  double joint_rate = 250.0;                         ///< [Hz]
  double plan_rate = 100.0;                          ///< [Hz]
  double plan_ahead = 0.5;                           ///< [s] how long before its time a planned pose is known
  double joint_noise = 2e-6;                         ///< [rad | m] standard deviation of encoder readings
  double actuator_lag = 0.04;                        ///< [s] delay of the joints behind the plan
  std::vector<FlexibleMode> modes;                   ///< flexible modes of the arm; empty: those of `large_boom_modes`
  double frequency_spread = 0.05;    ///< every mode's frequency is drawn anew by the seed, to within this fraction
  double gust_corner = 6.0;          ///< [Hz] gusts are white noise below this frequency
  double reach_exponent = 0.5;       ///< frequencies go as (reference reach / reach)^this
  ImuErrors imu;                     ///< errors of the inertial sensor
  TrackerErrors tracker;             ///< errors of the tracker
  std::vector<Dropout> dropouts;     ///< of the tracker: start and length [s]
  std::vector<StationShift> shifts;  ///< from a time [s] on the tracker frame is another: T_old_new, shape=(4, 4)
  /// Where the sensors truly are (clock offsets and actuator lag are taken from above); not given: as on a large arm.
  std::optional<TrackSetup> setup;
  std::uint64_t seed = 0;  ///< of everything that is drawn

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// A concrete pump's or crane's arm in its plane: slew, luff, elbow and a levelled tip, 12 m of reach.
Robot large_boom();
/// Four modes from 0.6 to 6 Hz: lateral, vertical, lateral, vertical.
std::vector<FlexibleMode> large_boom_modes();

/// Streams of a simulated arm with their truth. Every stream is sorted by arrival.
struct SimulatedStreams {
  std::vector<ImuSample> imu;
  std::vector<PoseSample> tracker;
  std::vector<double> joints_t, joints_arrival;  ///< of the rows of `joints`
  Eigen::MatrixXd joints;                        ///< readings, shape (samples, driven joints) [rad | m]
  std::vector<FrameSample> flange;               ///< forward kinematics of `joints`
  std::vector<FrameSample> plan;                 ///< tool
  std::vector<FlexibleMode> modes;               ///< as they were drawn
  TrackSetup setup;                              ///< true frames, clock offset at t = 0

  /// The true flange in the base frame at a time of the inertial sensor's clock, between two milliseconds by
  /// interpolation.
  Eigen::Isometry3d flange_at(double t) const;
  Eigen::Isometry3d tool_at(double t) const { return flange_at(t) * setup.T_flange_tool; }

  double grid = 1e-3;                          ///< step of the truth [s]
  double grid_start = 0.0;                     ///< time of its first row [s]
  std::vector<Eigen::Vector3d> true_position;  ///< of the flange
  std::vector<Eigen::Quaterniond> true_orientation;
};

/// The modes are integrated as differential equations (Runge and Kutta, 1 ms); inertial data are differences of the
/// true poses; encoders do not see the sway. Nothing here is shared with the filter. Throws std::invalid_argument on
/// options that make no sense.
SimulatedStreams simulate_streams(const Robot& robot, const StreamSimulationOptions& options = {});

}  // namespace truing
