// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rotation vectors and quaternions (Hamilton, w x y z). Equation numbers: Solà, "Quaternion kinematics for the
// error-state Kalman filter", 2017 (arXiv 1711.02508).

#include <cmath>

#include <Eigen/Geometry>

#include "math/constants.hpp"
#include "rooms.hpp"

namespace truing::math {

/// [v]x: skew(v) * w = v x w.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Exp: the rotation by |v| about v, eq. (101).
inline Eigen::Quaterniond exp_rotation(const Eigen::Vector3d& v) {
  const double square = v.squaredNorm();
  if (square < 1e-4) {  // series in half the angle: the next term is below 1e-16
    const double s = square / 4.0;
    const double cosine = 1.0 - s / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0));
    const double sinc = 0.5 * (1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0)));
    return {cosine, sinc * v.x(), sinc * v.y(), sinc * v.z()};
  }
  const double angle = std::sqrt(square), scale = std::sin(angle / 2.0) / angle;
  return {std::cos(angle / 2.0), scale * v.x(), scale * v.y(), scale * v.z()};
}

/// Log: the rotation vector of a unit quaternion, of length 0 to pi, eq. (103); q and -q give the same.
inline Eigen::Vector3d log_rotation(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0, length = q.vec().norm();
  if (length < 1e-9) return 2.0 * sign * q.vec();
  return (2.0 * std::atan2(length, sign * q.w()) / length) * sign * q.vec();
}

/// The pose that `fraction` of the way leads from a to b: straight in position, about one axis in orientation.
inline Eigen::Isometry3d between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double fraction) {
  const Eigen::Quaterniond q_a(a.linear()), q_b(b.linear());
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = (q_a * exp_rotation(fraction * log_rotation(q_a.conjugate() * q_b))).toRotationMatrix();
  out.translation() = a.translation() + fraction * (b.translation() - a.translation());
  return out;
}

}  // namespace truing::math
