// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Poses predicted by a fit that has not seen them, without fitting anew.
///
/// With N the information of all poses on the unknowns and N_i = J_i^T V_i^-1 J_i that of pose i, leaving it out moves
/// the unknowns by
///   (N - N_i)^-1 J_i^T V_i^-1 e_i                                   (Cook and Weisberg 1982, equation 2.2.1)
/// The unknowns are X and Y, and the lens where it was found from the same images: then e_i and N_i hold what image i
/// says of the lens as well.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "hand_eye/images.hpp"
#include "hand_eye/refine.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {

/// The images that the lens was found from, with the lens.
struct LensData {
  const Camera& camera;
  const std::vector<BoardImage>& images;
};

/// What one pose knows of the unknowns: X, Y as in LoopEstimate, then the lens where it is unknown.
struct PoseShare {
  Vector6d e;                ///< closure
  Eigen::MatrixXd J;         ///< of the closure, shape=(6, unknowns)
  Eigen::MatrixXd gram;      ///< information, shape=(unknowns, unknowns)
  Eigen::VectorXd gradient;  ///< of half its squared errors
};

class LeftOut {
 public:
  /// `rows` took part in the fit with `weights`; `lens` where the lens did. All are held by reference.
  LeftOut(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit, const LoopNoise& weights,
          const std::optional<LensData>& lens);

  /// Of any pose as the fit without it predicts it: seen to predicted board. NaN where the others leave something open.
  Vector6d closure(std::size_t i) const;
  /// [px] rms of its image as the fit without it predicts it, with the robot pose as reported.
  double pixels(std::size_t i, const Camera& camera, const BoardImage& image) const;
  /// Root mean square of its six standardised closures.
  double standardised(std::size_t i) const;

 private:
  PoseShare share(std::size_t i) const;
  bool fitted(std::size_t i) const;
  Eigen::VectorXd change_without(std::size_t i, const PoseShare& pose) const;

  const LoopProblem& problem_;
  const Rows& rows_;
  const LoopEstimate& fit_;
  const LoopNoise& weights_;
  const std::optional<LensData>& lens_;
  Eigen::MatrixXd information_;
};

}  // namespace truing::hand_eye
