// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Standard errors where the noise was found from the same poses: (J^T V^-1 J)^-1 takes it for known, and of ten poses
/// it is too small.
#pragma once

#include "hand_eye/refine.hpp"

namespace truing::hand_eye {

struct SmallSample {
  Matrix12d covariance;  ///< as LoopEstimate::covariance, for the noise being found too
  /// Of Student's t, of each unknown, 1 or more; infinite: the noise was given.
  Eigen::Matrix<double, 12, 1> degrees_of_freedom;
};

/// Kenward and Roger (1997), Small sample inference for fixed effects from restricted maximum likelihood; the
/// information of the variances is that of `refine_loop`, with its prior. `weights`: the noise that the closures of
/// `rows` were weighed by, and what of it was found from them.
SmallSample small_sample(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit,
                         const LoopNoise& weights);

}  // namespace truing::hand_eye
