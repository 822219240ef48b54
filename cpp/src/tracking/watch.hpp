// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Notices that the tracker's poses have jumped against what inertial sensor and forward kinematics say: a base station
// was moved, or the receiver has slipped on the flange.

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "rooms.hpp"
#include "tracking/pose_filter.hpp"
#include "truing/tracking/tracker.hpp"

namespace truing::tracking {

class ShiftWatch {
 public:
  ShiftWatch(const TrackSetup& setup, const WatchOptions& options);

  /// A settled tracker sample, in the order of their times; `T_base_flange`: forward kinematics then, or null.
  void push(const PoseGrade& grade, const Eigen::Isometry3d* T_base_flange);
  const Shift& last() const { return shift_; }
  /// Largest statistic of the last sample, in units of the threshold.
  double level() const { return level_; }
  void restart();

 private:
  static constexpr int kScales = 4;
  static constexpr std::array<double, kScales> kSamples{4.0, 12.0, 48.0, 160.0};  // of the averages
  struct Average {
    Vector6d mean = Vector6d::Zero();
    double spread = 1.0;
  };
  struct Row {
    double t = 0.0;
    Vector6d u, innovation;
    Vector6d weight;  ///< inverse variances that were expected of the innovation
    Matrix6d kept;
    std::array<double, 2> noise{};  ///< of the tracker [m], [rad]
    Eigen::Isometry3d T_base_receiver;
    bool has_flange = false;
    Eigen::Isometry3d T_base_flange;
  };

  const Row& row(std::int64_t k) const { return rows_[static_cast<std::size_t>(k) % rows_.size()]; }
  void average(const Vector6d& u, double seconds);
  void forget();
  bool lasts(std::int64_t onset, const Vector6d& jump) const;
  void learn_deviation(const Row& row);
  void flag();
  std::int64_t find_onset() const;
  Vector6d find_jump(std::int64_t onset) const;
  void compare(const Row& row);
  Vector6d deviation_of_receiver(const Row& row) const;

  TrackSetup setup_;
  WatchOptions options_;
  std::vector<Row> rows_;
  std::int64_t count_ = 0;
  std::array<Average, kScales> averages_;
  int pending_ = 0;        // samples to wait for before the jump is judged
  std::int64_t back_ = 0;  // samples in which its onset is looked for
  int rejected_ = 0;       // samples in a row that the filter has refused
  double quiet_ = 0.0;     // seconds of samples since the last start
  double level_ = 0.0;
  Vector6d mean_ = Vector6d::Zero(),
           variance_ = Vector6d::Zero();  // of the receiver's deviation from forward kinematics
  double learned_ = 0.0;                  // seconds that they are averaged over
  bool comparing_ = false;
  Eigen::Isometry3d station_ = Eigen::Isometry3d::Identity(),
                    receiver_ = Eigen::Isometry3d::Identity();  // the shift, in the base and on the receiver
  Shift shift_;
};

}  // namespace truing::tracking
