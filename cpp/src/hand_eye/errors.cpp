// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/errors.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "math/frame.hpp"
#include "math/statistics.hpp"

namespace truing::hand_eye {

HandEyeErrors errors_of(const std::vector<HandEyeResidual>& residuals, const Rows& rows, bool left_out) {
  HandEyeErrors out;
  out.n = rows.size();
  if (rows.empty()) return out;
  std::vector<double> position;
  double squares = 0.0, turns = 0.0, pixels = 0.0;
  for (const std::size_t i : rows) {
    const HandEyeResidual& r = residuals[i];
    const double p = left_out ? r.position_left_out : r.position, t = left_out ? r.rotation_left_out : r.rotation;
    position.push_back(p);
    squares += p * p, turns += t * t, pixels += r.pixels * r.pixels;
  }
  if (!std::isfinite(squares)) return out;  // a pose that the others cannot predict: nothing is known
  const double n = static_cast<double>(rows.size());
  out.position_rms = std::sqrt(squares / n), out.rotation_rms = std::sqrt(turns / n),
  out.pixel_rms = std::sqrt(pixels / n);
  out.position_mean = std::accumulate(position.begin(), position.end(), 0.0) / n;
  out.position_max = *std::max_element(position.begin(), position.end());
  out.position_p95 = quantile(&position, 0.95);
  return out;
}

Eigen::Matrix3d at_working_point(const UncertainFrame& camera, const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -cross_matrix(camera.T.linear() * point);
  return J * camera.covariance * J.transpose();
}

}  // namespace truing::hand_eye
