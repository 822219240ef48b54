// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace truing {

/// A frame with its uncertainty.
struct UncertainFrame {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();  ///< [m]
  /// Of x, y, z [m] and the rotation vector about the parent's axes [rad]: small changes that move the frame's origin,
  /// and turn it about that origin.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

}  // namespace truing
