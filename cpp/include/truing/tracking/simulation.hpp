// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
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
  double frequency = 1.0;                                   ///< undamped, at the reference reach [Hz]
  double damping = 0.015;                                   ///< ratio zeta
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();     ///< of the tip's motion, per unit of q
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();       ///< of the tip, per unit of q [rad/m]
  Eigen::Vector3d participation = Eigen::Vector3d::Zero();  ///< fraction of the tip's acceleration that drives it
  double gust = 0.0;  ///< standard deviation of the sway that gusts alone would make [m]
};

enum class SimulatedMotion {
  still,        ///< no motion, gusts only
  gentle,       ///< slow waves of all joints
  stop_and_go,  ///< jerk-limited moves between random joint positions, with rests
};

/// Errors of the inertial sensor (densities as in data sheets).
struct ImuErrors {
  double gyro_noise = 1e-4;       ///< [rad/s/sqrt(Hz)]
  double accel_noise = 1e-3;      ///< [m/s^2/sqrt(Hz)]
  double gyro_bias = 2e-3;        ///< standard deviation at the start [rad/s]
  double accel_bias = 3e-2;       ///< [m/s^2]
  double gyro_bias_walk = 1e-5;   ///< [rad/s/sqrt(s)]
  double accel_bias_walk = 1e-4;  ///< [m/s^2/sqrt(s)]
  double gyro_scale = 3e-4;       ///< standard deviation of each axis' scale error
  double accel_scale = 3e-4;
};

/// Errors of the tracker and of its way to the computer.
struct TrackerErrors {
  double position_noise = 1e-3;   ///< of one component [m]
  double rotation_noise = 1e-3;   ///< of one component [rad]
  double latency = 0.03;          ///< [s]
  double latency_jitter = 0.004;  ///< standard deviation, never before the sample was taken [s]
  double clock_offset = 0.0;      ///< t_tracker = t_imu * (1 + clock_drift) + clock_offset [s]
  double clock_drift = 0.0;       ///< [s/s]
  double out_of_order = 0.0;      ///< fraction of the samples that take 25 ms more
  double lost = 0.0;              ///< fraction of single samples that never arrive
};

struct Dropout {
  double start = 0.0, seconds = 0.0;
};  ///< [s]

/// From `start` on the tracker frame is another: T_old_new, in the tracker frame.
struct StationShift {
  double start = 0.0;  ///< [s]
  Eigen::Isometry3d T_old_new = Eigen::Isometry3d::Identity();
};

struct StreamSimulationOptions {
  double seconds = 60.0;
  SimulatedMotion motion = SimulatedMotion::gentle;
  double tip_speed = 0.3;           ///< rms of a gentle motion; highest of a stop-and-go motion [m/s]
  double imu_rate = 1000.0;         ///< [Hz]
  double tracker_rate = 100.0;      ///< [Hz]
  double joint_rate = 250.0;        ///< [Hz]
  double plan_rate = 100.0;         ///< [Hz]
  double plan_ahead = 0.5;          ///< a planned pose is known so long before [s]
  double joint_noise = 2e-6;        ///< standard deviation of encoder readings [rad | m]
  double actuator_lag = 0.04;       ///< joints follow the plan so late [s]
  std::vector<FlexibleMode> modes;  ///< empty: those of `large_boom_modes`
  double frequency_spread = 0.05;   ///< every mode's frequency is drawn anew by the seed, to within this fraction
  double gust_corner = 6.0;         ///< gusts are white noise below this frequency [Hz]
  double reach_exponent = 0.5;      ///< frequencies go as (reference reach / reach)^this
  ImuErrors imu;
  TrackerErrors tracker;
  std::vector<Dropout> dropouts;
  std::vector<StationShift> shifts;
  TrackSetup setup;           ///< where the sensors truly are (clock offsets and actuator lag are taken from above)
  bool default_setup = true;  ///< frames of the kind a large arm has, instead of `setup`
  std::uint64_t seed = 0;

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
