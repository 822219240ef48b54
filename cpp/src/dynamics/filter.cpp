// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/filter.hpp"

#include <algorithm>
#include <cmath>

#include "math/constants.hpp"

namespace truing::dynamics {
namespace {

/// Half the filter's length, in periods of its cut-off.
constexpr double kHalfLength = 2.0;

/// Row `k` of x, mirrored at the end points: x(-k) = 2 x(0) - x(k).
double mirrored(const double* x, Eigen::Index rows, Eigen::Index k) {
  const Eigen::Index last = rows - 1;
  if (k < 0) return 2.0 * x[0] - x[std::min(-k, last)];
  if (k > last) return 2.0 * x[last] - x[std::max<Eigen::Index>(0, 2 * last - k)];
  return x[k];
}

}  // namespace

// Oppenheim and Schafer, Discrete-time signal processing, 7.2: the ideal low-pass under a Blackman window.
Eigen::VectorXd low_pass(double cutoff, double step) {
  const auto half = static_cast<Eigen::Index>(std::ceil(kHalfLength / (cutoff * step)));
  Eigen::VectorXd weights(2 * half + 1);
  for (Eigen::Index k = -half; k <= half; ++k) {
    const double x = 2.0 * cutoff * step * static_cast<double>(k);
    const double sinc = k == 0 ? 1.0 : std::sin(kPi * x) / (kPi * x);
    const double at = kPi * static_cast<double>(k) / static_cast<double>(half);
    weights[k + half] = sinc * (0.42 + 0.5 * std::cos(at) + 0.08 * std::cos(2.0 * at));
  }
  return weights / weights.sum();
}

Eigen::MatrixXd filtered(const Eigen::MatrixXd& x, const Eigen::VectorXd& weights, Eigen::Index stride) {
  const Eigen::Index half = weights.size() / 2, rows = x.rows();
  const Eigen::Index out_rows = rows == 0 ? 0 : (rows - 1) / stride + 1;
  Eigen::MatrixXd out(out_rows, x.cols());
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    const double* column = x.data() + c * rows;
    for (Eigen::Index i = 0; i < out_rows; ++i) {
      const Eigen::Index at = i * stride, first = at - half;
      if (first >= 0 && at + half < rows) {
        out(i, c) = weights.dot(Eigen::Map<const Eigen::VectorXd>(column + first, weights.size()));
        continue;
      }
      double sum = 0.0;
      for (Eigen::Index k = 0; k < weights.size(); ++k) sum += weights[k] * mirrored(column, rows, first + k);
      out(i, c) = sum;
    }
  }
  return out;
}

Eigen::MatrixXd rate_of(const Eigen::MatrixXd& x, double step) {
  const Eigen::Index n = x.rows();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, x.cols());
  if (n < 2) return out;
  out.row(0) = (x.row(1) - x.row(0)) / step;
  out.row(n - 1) = (x.row(n - 1) - x.row(n - 2)) / step;
  if (n > 2) out.middleRows(1, n - 2) = (x.bottomRows(n - 2) - x.topRows(n - 2)) / (2.0 * step);
  return out;
}

}  // namespace truing::dynamics
