// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Maximum likelihood with noise on both sides, X = T_parent_camera and Y = T_parent_board unknown.
///
/// The closure of a pose, e = seen to predicted board, is what its robot pose's noise n_A and the camera's n_B make of
/// it: e = -(G n_A + n_B). With the robot poses eliminated, twelve unknowns are left, and e has the covariance
///   V = s_p^2 [I 0; 0 0] + s_A^2 [|w|^2 I - w w^T, -[w]x; [w]x, I] + V_B,     w from the hand to the board in the
///   camera frame:
/// position noise of hand and camera adds up, a turn of the hand by n moves the board by n x w. V_B is s_B^2 [0 0; 0 I]
/// for board poses (their position noise is in s_p). For images the inverse of the pixels' information comes to that,
/// times s_px^2; s_B^2 is then what lens and board do beyond the pixels' own noise.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "hand_eye/closed_form.hpp"
#include "math/constants.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {

using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// What the refinement sees.
struct LoopProblem {
  HandEyeSetup setup = HandEyeSetup::eye_in_hand;
  Frames A;                           ///< T_base_hand
  Frames M;                           ///< moving_frames of A
  Frames B;                           ///< T_camera_board
  std::vector<Matrix6d> pixel_shape;  ///< with images: covariance of B for pixels of unit noise; else empty
  /// The camera's coordinate along an axis is known: axis, value [m], sigma [m].
  struct Known {
    Eigen::Vector3d axis;
    double height;
    double sigma;
  };
  std::optional<Known> known;
};

/// Variances: 0 position [m^2], 1 hand rotation [rad^2], 2 camera rotation [rad^2], 3 pixels [px^2], of images only.
constexpr std::size_t kVariances = 4;
struct LoopNoise {
  std::array<double, kVariances> variance{1e-6, 1e-6, 1e-6, 0.0};
  std::array<bool, kVariances> estimate{true, true, true, false};
};

struct LoopEstimate {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity(), Y = Eigen::Isometry3d::Identity();
  LoopNoise noise;
  Matrix12d covariance =
      Matrix12d::Zero();  ///< X position, X rotation, Y position, Y rotation; turns about the own origin
  double chi2 = 0.0;      ///< e^T V^-1 e over the rows
  bool singular = false;  ///< the rows do not determine all twelve: the rest is not to be used
  int iterations = 0;
  bool converged = false;
};

/// Gauss-Newton on the closures of `rows` from X, Y; the variances by restricted maximum likelihood (Patterson and
/// Thompson 1971) on the way.
LoopEstimate refine_loop(const LoopProblem& problem, const Rows& rows, const Eigen::Isometry3d& X,
                         const Eigen::Isometry3d& Y, LoopNoise noise, int max_iterations);

/// Logarithm of the restricted likelihood of the noise at `fit`, but for a constant: what the noise that was found has
/// over another is the difference.
double restricted_likelihood(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit);

/// Spread [log of variance] of the weak prior that keeps what data cannot split near an even split.
constexpr double kPriorSpread = 3.0;

/// V of a pose is the sum of variance times shape.
using NoiseShapes = std::array<Matrix6d, kVariances>;
NoiseShapes noise_shapes(const LoopProblem& problem, std::size_t i, const Eigen::Isometry3d& X,
                         const Eigen::Isometry3d& Y);

/// The closure of a pose, its derivatives by X and Y as in LoopEstimate::covariance, and its covariance.
struct LoopRow {
  Vector6d e;
  Eigen::Matrix<double, 6, 12> J;
  Matrix6d V;
};
LoopRow loop_row(const LoopProblem& problem, std::size_t i, const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y,
                 const LoopNoise& noise);

/// One more unknown beside X and Y, from zero: its value and standard error by the derivative of every closure. NaN
/// where it cannot be seen.
struct OneMore {
  double value, sigma;
};
OneMore one_more_unknown(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit,
                         const std::function<Vector6d(std::size_t)>& derivative);

/// The closure if the pose had not been fitted: (I - J C J^T V^-1)^-1 e.
Vector6d left_out(const LoopRow& row, const Matrix12d& covariance);

/// Root mean square of the six standardised closures; `fitted`: the pose took part in the fit.
double standardised(const LoopRow& row, const Matrix12d& covariance, bool fitted);

}  // namespace truing::hand_eye
