// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "identification/fit.hpp"
#include "math/constants.hpp"

namespace truing::identification {

/// Of the fitted parameters, and the noise of rows [m], [rad].
struct Uncertainty {
  Eigen::MatrixXd covariance;
  double noise = 0.0;
  double rotation_noise = kNaN;
};

/// Covariance clustered by pose. Where poses are few, with positions and rotations each at the noise they show: H^-1
/// (s_p^2 H_p + s_r^2 H_r) H^-1; for positions alone, s^2 H^-1. With a robust loss the weighted rows stand for the
/// rows: good to a few per cent.
Uncertainty uncertainty(const Job& job, const Fit& found, const std::vector<std::int32_t>& pose, bool poses);

}  // namespace truing::identification
