// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/spline.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "dynamics/filter.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A derivative of the quintic B-spline of knots at whole numbers, by truncated powers (de Boor, A practical guide to
/// splines, chapter IX).
double b_spline(double x, int derivative) {
  constexpr double kBinomial[] = {1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0};
  constexpr double kFactorial[] = {120.0, 24.0, 6.0};
  double out = 0.0;
  for (int j = 0; j < 7; ++j) {
    const double above = x + 3.0 - j;
    if (above > 0.0) out += kBinomial[j] * std::pow(above, 5 - derivative);
  }
  return out / kFactorial[derivative];
}

/// Coefficients of the B-splines at rows -reach ... reach whose sum is one at row 0 and zero at all others.
VectorXd cardinal(Index reach) {
  const Index n = 2 * reach + 1;
  MatrixXd at_rows = MatrixXd::Zero(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index k = std::max<Index>(0, i - 2); k < std::min(n, i + 3); ++k)
      at_rows(i, k) = b_spline(static_cast<double>(i - k), 0);
  return at_rows.partialPivLu().solve(VectorXd::Unit(n, reach));
}

}  // namespace

SplineBetween::SplineBetween(double part, double step) : weights_(MatrixXd::Zero(2 * kReach + 1, 3)) {
  static const VectorXd coefficients = cardinal(2 * kReach);
  for (Index k = -kReach; k <= kReach; ++k) {
    const double x = part - static_cast<double>(k);  // the row is at zero
    for (Index c = -2 * kReach; c <= 2 * kReach; ++c) {
      const double away = x - static_cast<double>(c);
      if (std::abs(away) >= 3.0) continue;
      for (int d = 0; d < 3; ++d)
        weights_(k + kReach, d) += coefficients[c + 2 * kReach] * b_spline(away, d) / std::pow(step, d);
    }
  }
}

MatrixXd SplineBetween::at(const Eigen::Ref<const VectorXd>& x, Index first, Index count, const Bends& bends) const {
  MatrixXd out(count, 3);
  for (Index d = 0; d < 3; ++d)
    filter_column(x.data(), x.size(), weights_.col(d), 1, first, count, out.col(d).data(), bends);
  return out;
}

}  // namespace truing::dynamics
