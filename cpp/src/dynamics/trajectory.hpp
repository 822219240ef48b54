// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Motions that excite torques: a Fourier series (Swevers et al. 1997, eq. 12), then slow reversals, from rest to rest.

#include <array>
#include <vector>

#include <Eigen/Core>

#include "math/random.hpp"
#include "rooms.hpp"
#include "truing/dynamics/plan.hpp"

namespace truing::dynamics {

/// Within which a motion stays, joint by joint.
struct MotionLimits {
  Eigen::VectorXd home;          ///< [rad | m]
  Eigen::VectorXd lower, upper;  ///< [rad | m]
  Eigen::VectorXd speed;         ///< [rad/s | m/s]
  Eigen::VectorXd acceleration;  ///< [rad/s^2 | m/s^2]
};

/// Throws std::invalid_argument: `home` of another length or outside the limits, a joint without room to move.
MotionLimits motion_limits(const Robot& robot, const TorquePlanOptions& options);

/// What a motion is made of. Parts of what the limits allow, so that every draw keeps them.
struct Trajectory {
  static constexpr int kHarmonics = 5;
  struct OfJoint {
    double centre = 0.0;  ///< -1 … 1 of the range to either side of home
    double size = 1.0;    ///< 0 … 1 of what the limits allow
    std::array<double, kHarmonics> sine{}, cosine{};
    double slow_stroke = 0.2, slow_speed = 0.1, slow_phase = 0.0;       ///< [rad | m], per s, rad
    double small_stroke = 0.01, small_speed = 0.05, small_phase = 0.0;  ///< [rad | m], per s, rad
  };
  double period = 10.0;  ///< [s] of the first harmonic
  std::vector<OfJoint> joints;
};

Trajectory random_trajectory(Eigen::Index joints, math::Random* random);

/// One joint, and the period, changed by steps of `size` (1: as far as random ones differ).
Trajectory varied(const Trajectory& from, double size, math::Random* random);

/// Positions of every row, shape=(rows, joints), within the limits.
Eigen::MatrixXd sampled(const Trajectory& trajectory, const MotionLimits& limits, double duration, double rate);

}  // namespace truing::dynamics
