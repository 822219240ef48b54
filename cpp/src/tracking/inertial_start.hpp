// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A start for the calibration of the inertial sensor: both sensors turn at the same speed, whatever their frames.

#include <vector>

#include <Eigen/Core>

#include "rooms.hpp"
#include "truing/tracking/streams.hpp"

namespace truing::tracking {

/// Angular velocities at the same instants, each in its sensor's frame [rad/s]. shape=(3, instants)
struct SpeedPairs {
  Eigen::Matrix3Xd imu, receiver;

  Eigen::Matrix3Xd centred_imu() const { return imu.colwise() - imu.rowwise().mean(); }
  Eigen::Matrix3Xd centred_receiver() const { return receiver.colwise() - receiver.rowwise().mean(); }
};

/// The clock offset at which the two angular velocities correlate best.
struct SpeedAlignment {
  double clock_offset = 0.0;                             ///< t_imu = t_tracker - clock_offset [s]
  double correlation = 0.0;                              ///< of the two, turned into each other; 1: one motion
  SpeedPairs pairs;                                      ///< at that offset
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of receiver with imu, times the number of instants
};

/// Offsets up to `search` [s] are tried.
SpeedAlignment align_speeds(const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker, double search);

}  // namespace truing::tracking
