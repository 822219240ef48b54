// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/filter.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>

#include "kernel/kernel.hpp"
#include "kernel/rigid.hpp"
#include "math/constants.hpp"

namespace truing::dynamics {
namespace {

/// Half the filter's length, in periods of its cut-off.
constexpr double kHalfLength = 2.0;

/// Rows from `begin` on of a column of so many, `count` of them; beyond its ends it is mirrored at the end points, and
/// bends on as it does there: x(-k) = 2 x(0) - x(k) + bend k^2.
void copy_mirrored(const double* x, Eigen::Index rows, Eigen::Index begin, Eigen::Index count, const Bends& bends,
                   double* out) {
  const auto squared = [](Eigen::Index k) { return static_cast<double>(k) * static_cast<double>(k); };
  const Eigen::Index last = rows - 1;
  Eigen::Index k = begin;
  for (; k < std::min<Eigen::Index>(0, begin + count); ++k)
    *out++ = 2.0 * x[0] - x[std::min(-k, last)] + bends.first * squared(k);
  const Eigen::Index recorded = std::max(k, std::min(rows, begin + count));
  out = std::copy(x + k, x + recorded, out);
  k = recorded;
  for (; k < begin + count; ++k)
    *out++ = 2.0 * x[last] - x[std::max<Eigen::Index>(0, 2 * last - k)] + bends.last * squared(k - last);
}

/// Residuals of least squares go on in time: how many of them count as one where each goes on from the one before,
/// (1 + rho) / (1 - rho) (Bayley and Hammersley, J. Royal Statistical Society, Suppl. 8 (1946) 184); no more than all.
double rows_as_one(const Eigen::VectorXd& left) {
  const Eigen::Index n = left.size();
  const double rho = left.head(n - 1).dot(left.tail(n - 1)) / std::max(left.squaredNorm(), 1e-300);
  return (1.0 + std::max(rho, 0.0)) / std::max(1.0 - rho, 2.0 / static_cast<double>(n));
}

}  // namespace

// Oppenheim and Schafer, Discrete-time signal processing, 7.2: the ideal low-pass under a Blackman window.
Eigen::VectorXd low_pass(double cutoff, double step) {
  // A whole number of steps stays one, whatever rounding made of the step.
  const auto half = static_cast<Eigen::Index>(std::ceil(kHalfLength / (cutoff * step) - 1e-6));
  Eigen::VectorXd weights(2 * half + 1);
  for (Eigen::Index k = -half; k <= half; ++k) {
    const double x = 2.0 * cutoff * step * static_cast<double>(k);
    const double sinc = k == 0 ? 1.0 : std::sin(kPi * x) / (kPi * x);
    const double at = kPi * static_cast<double>(k) / static_cast<double>(half);
    weights[k + half] = sinc * (0.42 + 0.5 * std::cos(at) + 0.08 * std::cos(2.0 * at));
  }
  return weights / weights.sum();
}

double bend_of(const double* x, Eigen::Index way, Eigen::Index rows) {
  constexpr int kTerms = 4;       // a cubic
  constexpr double kPlain = 3.0;  // standard errors: a bend of so many is taken for half of what it seems
  if (rows < kFewestForBend) return 0.0;
  const auto last = static_cast<double>(rows - 1);
  Eigen::MatrixXd powers(rows, kTerms);
  Eigen::VectorXd y(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const double u = static_cast<double>(k) / last;
    powers.row(k) << 1.0, u, u * u, u * u * u;
    y[k] = x[k * way] - x[0];
  }
  const Eigen::Matrix4d inverse = (powers.transpose() * powers).inverse();
  const Eigen::Vector4d cubic = inverse * (powers.transpose() * y);
  const Eigen::VectorXd left = y - powers * cubic;
  const double variance = left.squaredNorm() / static_cast<double>(rows - kTerms) * rows_as_one(left);
  const double signal = cubic[2] * cubic[2], noise = kPlain * kPlain * variance * inverse(2, 2);
  return signal > 0.0 ? 2.0 * cubic[2] / (last * last) * signal / (signal + noise) : 0.0;
}

namespace {

/// `count` outputs, as many as kernels take together, of rows from x on.
void filter_rows(const double* x, const Eigen::VectorXd& weights, Eigen::Index stride, Eigen::Index count,
                 double* out) {
  thread_local std::vector<double> scratch;
  const auto taps = static_cast<int>(weights.size()), step = static_cast<int>(stride), all = static_cast<int>(count);
  scratch.resize(std::max(scratch.size(), kernel::filter_scratch(step, taps, all)));
  kernel::functions().filter(x, step, weights.data(), taps, all, scratch.data(), out);
}

}  // namespace

void filter_column(const double* x, Eigen::Index rows, const Eigen::VectorXd& weights, Eigen::Index stride,
                   Eigen::Index first, Eigen::Index count, double* out, const Bends& bends) {
  constexpr Eigen::Index kTogether = 512, kFew = kernel::kSampleMultiple;
  thread_local std::vector<double> reached;
  const Eigen::Index taps = weights.size(), half = taps / 2;
  for (Eigen::Index done = 0; done < count;) {
    const Eigen::Index begin = (first + done) * stride - half, left = count - done, room = rows - taps - begin;
    const Eigen::Index inside = begin < 0 || room < 0 ? 0 : std::min({left, room / stride + 1, kTogether});
    const Eigen::Index some = std::max(kFew, inside / kFew * kFew);
    if (some <= inside) {
      filter_rows(x + begin, weights, stride, some, out + done);
    } else {  // at the column's ends
      double sums[kFew];
      const Eigen::Index needed = (std::min(kFew, left) - 1) * stride + taps;
      reached.assign(static_cast<std::size_t>((kFew - 1) * stride + taps), 0.0);
      copy_mirrored(x, rows, begin, needed, bends, reached.data());
      filter_rows(reached.data(), weights, stride, kFew, sums);
      std::copy_n(sums, std::min(kFew, left), out + done);
    }
    done += std::min(some, left);
  }
}

Eigen::MatrixXd filtered(const Eigen::MatrixXd& x, const Eigen::VectorXd& weights, Eigen::Index stride) {
  const Eigen::Index rows = x.rows(), out_rows = rows == 0 ? 0 : (rows - 1) / stride + 1;
  Eigen::MatrixXd out(out_rows, x.cols());
  for (Eigen::Index c = 0; c < x.cols(); ++c)
    filter_column(x.data() + c * rows, rows, weights, stride, 0, out_rows, out.data() + c * out_rows);
  return out;
}

Eigen::MatrixXd rate_of(const Eigen::MatrixXd& x, double step) {
  const Eigen::Index n = x.rows();
  if (n < 2) return Eigen::MatrixXd::Zero(n, x.cols());
  if (n == 2) return ((x.row(1) - x.row(0)) / step).replicate(2, 1);
  Eigen::MatrixXd out(n, x.cols());
  out.row(0) = (2.0 * x.row(1) - 1.5 * x.row(0) - 0.5 * x.row(2)) / step;
  out.row(n - 1) = (1.5 * x.row(n - 1) - 2.0 * x.row(n - 2) + 0.5 * x.row(n - 3)) / step;
  out.middleRows(1, n - 2) = (0.5 / step) * (x.bottomRows(n - 2) - x.topRows(n - 2));
  return out;
}

}  // namespace truing::dynamics
