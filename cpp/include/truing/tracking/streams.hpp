// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Geometry>

namespace truing {

// Samples of streams. `t` is the stamp of the device's own clock; `arrival` is the true time at which the sample
// reached the computer [s]. Three clocks: the inertial sensor's, in which everything is computed; the tracker's, t_imu
// = t_tracker - clock_offset; and the controller's (joints and plan), t_imu = t_controller - controller_clock_offset.

struct ImuSample {
  double t = 0.0;
  double arrival = 0.0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();  ///< angular velocity in the sensor frame [rad/s]
  Eigen::Vector3d accel =
      Eigen::Vector3d::Zero();  ///< specific force in the sensor frame, +9.81 upward at rest [m/s^2]
};

/// The receiver in the tracker frame.
struct PoseSample {
  double t = 0.0;
  double arrival = 0.0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();                       ///< [m]
  Eigen::Quaterniond orientation = Eigen::Quaterniond(0.0, 0.0, 0.0, 0.0);  ///< all zero: the tracker gives none
  bool has_orientation() const { return orientation.coeffs().squaredNorm() != 0.0; }
};

/// A frame in the robot base at a time: the flange by forward kinematics, or the planned tool.
struct FrameSample {
  double t = 0.0;
  double arrival = 0.0;
  Eigen::Isometry3d T_base_frame = Eigen::Isometry3d::Identity();
};

/// Where things are, and how clocks differ. `T_a_b` maps b-coordinates into a.
struct TrackSetup {
  Eigen::Isometry3d T_tracker_base = Eigen::Isometry3d::Identity();     ///< shape=(4, 4)
  Eigen::Isometry3d T_flange_receiver = Eigen::Isometry3d::Identity();  ///< shape=(4, 4)
  Eigen::Isometry3d T_flange_tool = Eigen::Isometry3d::Identity();      ///< shape=(4, 4)
  Eigen::Isometry3d T_flange_imu = Eigen::Isometry3d::Identity();       ///< shape=(4, 4)
  Eigen::Vector3d gravity{0.0, 0.0, -9.81};                             ///< shape=(3,) [m/s^2] in the base frame
  double clock_offset = 0.0;                                            ///< [s] t_imu = t_tracker - clock_offset
  double clock_offset_sigma = 0.0;       ///< [s] standard error of `clock_offset`; 0: known, and not estimated
  double controller_clock_offset = 0.0;  ///< [s] t_imu = t_controller - controller_clock_offset
  double actuator_lag = 0.0;             ///< [s] delay of the joints behind the plan
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< shape=(3,) [rad/s] as it was when it was calibrated
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< shape=(3,) [m/s^2] likewise
  double gyro_bias_sigma = 0.0;                          ///< [rad/s] its standard error, one component; 0: not known
  double accel_bias_sigma = 0.0;                         ///< [m/s^2] likewise
};

}  // namespace truing
