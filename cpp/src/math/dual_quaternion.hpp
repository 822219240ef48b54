// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "rooms.hpp"

namespace truing::math {

/// A rigid motion as unit dual quaternion q + e q', e^2 = 0 (Daniilidis 1999, section 3): real part the rotation, dual
/// part t q / 2.
struct DualQuaternion {
  Eigen::Quaterniond real{1.0, 0.0, 0.0, 0.0};
  Eigen::Quaterniond dual{0.0, 0.0, 0.0, 0.0};
};

inline Eigen::Quaterniond plus(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return {a.w() + b.w(), a.x() + b.x(), a.y() + b.y(), a.z() + b.z()};
}

/// eq. (15): q' = t q / 2
inline DualQuaternion dual_quaternion(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(T.linear()).normalized();
  const Eigen::Vector3d t = 0.5 * T.translation();
  return {q, Eigen::Quaterniond(0.0, t.x(), t.y(), t.z()) * q};
}

/// (a + e a')(b + e b') = a b + e (a b' + a' b)
inline DualQuaternion operator*(const DualQuaternion& a, const DualQuaternion& b) {
  return {a.real * b.real, plus(a.real * b.dual, a.dual * b.real)};
}

/// The inverse motion, for a unit dual quaternion.
inline DualQuaternion conjugate(const DualQuaternion& a) { return {a.real.conjugate(), a.dual.conjugate()}; }

/// t = 2 q' q*
inline Eigen::Isometry3d frame(const DualQuaternion& a) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = a.real.toRotationMatrix();
  T.translation() = 2.0 * (a.dual * a.real.conjugate()).vec();
  return T;
}

}  // namespace truing::math
