// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Pixels: the pose of a board from one image, and all images with all robot poses at once (Ceres).
#pragma once

#include <vector>

#include "hand_eye/refine.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {

/// A board's pose by its pixels alone.
struct BoardFit {
  Eigen::Isometry3d T_camera_board = Eigen::Isometry3d::Identity();
  Matrix6d shape = Matrix6d::Identity();  ///< covariance of (position, turn about its origin) for pixels of unit noise
  double sum = 0.0;                       ///< of squared pixel errors
  int degrees_of_freedom = 0;             ///< 2 points - 6
  bool converged = false;
};

/// Gauss-Newton from `start`. Not converged: points behind the camera, or too few to tell.
BoardFit fit_board(const Camera& camera, const BoardImage& image, const Eigen::Isometry3d& start);

/// Root mean square pixel error of the board at a pose; infinite where points lie behind the camera.
double pixel_rms(const Camera& camera, const BoardImage& image, const Eigen::Isometry3d& T_camera_board);

/// Number of a lens' values: fx fy cx cy k1 k2 p1 p2 k3.
constexpr int kLens = 9;

/// What one image says of the lens, beside its board's pose; for pixels of unit noise, at a pose that fits its pixels.
struct LensShare {
  Eigen::Matrix<double, 6, kLens> board;     ///< move of the board that fits, by each value of the lens
  Eigen::Matrix<double, kLens, kLens> gram;  ///< information on the lens, the board's pose being free
  Eigen::Matrix<double, kLens, 1> gradient;  ///< of half the squared pixel errors
};
LensShare lens_share(const Camera& camera, const BoardImage& image, const Eigen::Isometry3d& T_camera_board);

/// The camera with its lens' values changed by so much.
Camera with_lens_moved(const Camera& camera, const Eigen::Matrix<double, kLens, 1>& change);

/// The same shape at a pose, of points that are yet to be seen.
Matrix6d board_covariance(const Camera& camera, const Eigen::Matrix3Xd& points,
                          const Eigen::Isometry3d& T_camera_board);

struct ImageSigmas {
  double pixel = 1.0;           ///< [px]
  double hand_position = 1e-3;  ///< [m]
  double hand_rotation = 1e-3;  ///< [rad]
};

struct ImageEstimate {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity(), Y = Eigen::Isometry3d::Identity();
  Camera camera;
  Frames A;                                  ///< T_base_hand as found, of the rows given
  Matrix12d covariance = Matrix12d::Zero();  ///< of X and Y as in LoopEstimate
  std::vector<double> camera_sigma;          ///< of fx fy cx cy k1 k2 p1 p2 k3; empty where the camera was held
  SolverSummary solver;
};

/// Minimises pixel errors over their sigma and moves of every robot pose over theirs, over X, Y, those moves, and the
/// camera where asked.
ImageEstimate refine_images(const LoopProblem& problem, const std::vector<BoardImage>& images, const Rows& rows,
                            const Camera& camera, const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y,
                            const ImageSigmas& sigmas, bool refine_camera, int max_iterations);

}  // namespace truing::hand_eye
