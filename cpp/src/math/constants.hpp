// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include <Eigen/Core>

#include "rooms.hpp"

namespace truing::math {

constexpr double kPi = 3.14159265358979323846;
constexpr double kTwoPi = 6.283185307179586;
constexpr double kDegree = kPi / 180.0;  ///< [rad]
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kNever = -1e300;  ///< [s] before any time stamp
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Position, then rotation vector: small moves of a frame, twists, residuals of a pose.
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

}  // namespace truing::math
