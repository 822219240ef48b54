// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Hand-eye by dual quaternions and one SVD (Daniilidis 1999, "Hand-eye calibration using dual quaternions"; equation
/// numbers are his).
///
/// Both set-ups are  X B = M Y:  X = T_parent_camera, Y = T_parent_board, B = T_camera_board, and M maps the board's
/// parent into the camera's: T_base_hand^-1 with the camera on the hand, T_base_hand with the board on it. Of two
/// poses, a = M_i M_j^-1 and b = B_i B_j^-1 are one motion in two frames: a X = X b.
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "math/constants.hpp"
#include "math/dual_quaternion.hpp"
#include "rooms.hpp"
#include "truing/handeye.hpp"

namespace truing::hand_eye {

using Frames = std::vector<Eigen::Isometry3d>;
using Rows = std::vector<std::size_t>;
using Vector8d = Eigen::Matrix<double, 8, 1>;

/// The M of every pose.
Frames moving_frames(const Frames& T_base_hand, HandEyeSetup setup);

/// X^-1 M Y
inline Eigen::Isometry3d predicted_board(const Eigen::Isometry3d& X, const Eigen::Isometry3d& M,
                                         const Eigen::Isometry3d& Y) {
  return X.inverse(Eigen::Isometry) * M * Y;
}

/// Position [m] and rotation vector [rad], in the camera frame, from the seen to the predicted board.
Vector6d closure(const Eigen::Isometry3d& predicted, const Eigen::Isometry3d& seen);

/// The point that a moving frame's poses leave nearest to where it is: least squares of |T_i p - center| over p and
/// center.
struct Pivot {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< in the fixed frame [m]
  double spread = 0.0;                               ///< rms distance from it [m]
};
Pivot find_pivot(const Frames& poses, const Rows& rows);

/// Dual quaternions of M and B about their pivots and in units of `length`, with signs such that q_M,i q_M,j* and q_B,i
/// q_B,j* have real parts of one sign for all i, j.
struct Screws {
  std::vector<DualQuaternion> M, B;
  Eigen::Vector3d center_M = Eigen::Vector3d::Zero(), center_B = Eigen::Vector3d::Zero();  ///< [m]
  double length = 1.0;                                                                     ///< [m]
};
Screws make_screws(const Frames& M, const Frames& B, const Rows& rows);

/// S of one motion, a q - q b with a and b the vector parts: eq. (31), [a - b, [a + b]x, 0, 0; a' - b', [a' + b']x, a -
/// b, [a + b]x] shape=(6, 8), completed by the scalar parts, [0, -(a - b)^T, 0, 0; 0, -(a' - b')^T, 0, -(a - b)^T]:
/// they vanish with the others, but without them what noise does would depend on the axes of the base frame. Rows:
/// scalar and vector of the real, then of the dual part. shape=(8, 8)
Eigen::Matrix<double, 8, 8> motion_factor(const DualQuaternion& a, const DualQuaternion& b);

/// Sums over motions.
struct MotionSums {
  Eigen::Matrix<double, 8, 8> normal = Eigen::Matrix<double, 8, 8>::Zero();  ///< of S^T S
  Eigen::Matrix3d axes =
      Eigen::Matrix3d::Zero();  ///< of a a^T: axes times the sine of half the angle, in the camera's parent frame
  double incongruence = 0.0;    ///< of (|a| - |b|)^2: equal for rigid frames
  std::size_t motions = 0;
};

/// Over all pairs up to 64 poses; beyond, over 12 partners of each pose, those of largest rotation among 36 spread over
/// all poses in an order that does not depend on theirs. Cost linear in pairs, memory constant.
MotionSums sum_motions(const Screws& screws);

struct CameraSolution {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  Vector8d singular_values = Vector8d::Zero();  ///< of the stacked S, descending, per root of the motions
  Eigen::Vector3d principal_rotations =
      Eigen::Vector3d::Zero();  ///< [rad] rms rotation of a motion about its principal axes, descending
  Eigen::Matrix3d principal_axes = Eigen::Matrix3d::Identity();  ///< columns, camera's parent frame
  double incongruence = 0.0;                                     ///< [rad] rms difference of the two angles of a motion
  double residual = 0.0;                                         ///< |S q| per root of the motions
  double length = 1.0;                                           ///< [m]
  std::size_t motions = 0;
};

/// lambda_1 v7 + lambda_2 v8 of unit norm with real and dual part orthogonal, eqs. (33)-(35).
Vector8d unit_combination(const Vector8d& v7, const Vector8d& v8);

CameraSolution solve_camera(const Frames& M, const Frames& B, const Rows& rows);

/// X where all axes are parallel to `axis` (unit, camera's parent frame) and the camera's coordinate along it is
/// `height` [m].
Eigen::Isometry3d solve_camera_one_axis(const Frames& M, const Frames& B, const Rows& rows, const Eigen::Vector3d& axis,
                                        double height);

/// Y = mean of M^-1 X B: nearest rotation to the sum, mean position.
Eigen::Isometry3d mean_board(const Frames& M, const Frames& B, const Rows& rows, const Eigen::Isometry3d& X);

}  // namespace truing::hand_eye
