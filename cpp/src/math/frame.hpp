// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <Eigen/Geometry>

#include "rooms.hpp"

namespace truing::math {

/// [v]x, so that [v]x a = v x a.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Rotation by |v| about v [rad].
inline Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  if (angle == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, v / angle).toRotationMatrix();
}

/// The vector of a rotation, at most pi long [rad]. By its quaternion: exact near zero and near half a turn.
inline Eigen::Vector3d vector_from_rotation(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  const double sine = q.vec().norm();
  if (sine == 0.0) return Eigen::Vector3d::Zero();
  return 2.0 * std::atan2(q.w() < 0.0 ? -sine : sine, std::abs(q.w())) / sine * q.vec();
}

/// T moved by d[0:3] and turned by d[3:6] about its own origin, both in the parent's axes.
inline Eigen::Isometry3d moved(const Eigen::Isometry3d& T, const Eigen::Matrix<double, 6, 1>& d) {
  Eigen::Isometry3d out = T;
  out.translation() += d.head<3>();
  out.linear() = Eigen::Quaterniond(rotation_from_vector(d.tail<3>()) * T.linear()).normalized().toRotationMatrix();
  return out;
}

}  // namespace truing::math
