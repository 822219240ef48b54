// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "rooms.hpp"

namespace truing::math {

/// The least rotation that turns one direction into the other.
Eigen::Quaterniond least_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// The rigid frame T that makes T * from nearest to `to` in least squares: Umeyama 1991, eqs. (38)-(42), without scale.
/// shape=(3, n)
Eigen::Isometry3d register_points(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to);

/// The rotation nearest to a 3x3 matrix in the Frobenius norm: U diag(1, 1, det(U V^T)) V^T.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m);

}  // namespace truing::math
