// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "math/registration.hpp"

#include "math/linear_algebra.hpp"

namespace truing::math {

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const SingularValues svd = singular_values(m);
  Eigen::Matrix3d sign = Eigen::Matrix3d::Identity();
  if (svd.U.determinant() * svd.V.determinant() < 0.0) sign(2, 2) = -1.0;  // Umeyama eq. (39)
  return svd.U * sign * svd.V.transpose();
}

Eigen::Quaterniond least_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Eigen::Isometry3d register_points(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Vector3d from_mean = from.rowwise().mean(), to_mean = to.rowwise().mean();
  const Eigen::Matrix3d covariance =
      (to.colwise() - to_mean) * (from.colwise() - from_mean).transpose();  // eq. (38), but for 1/n
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = nearest_rotation(covariance);           // eq. (40)
  T.translation() = to_mean - T.linear() * from_mean;  // eq. (41)
  return T;
}

}  // namespace truing::math
