// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/filter.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernel/kernel.hpp"
#include "kernel/rigid.hpp"
#include "math/constants.hpp"

namespace truing::dynamics {
namespace {

/// Half the filter's length, in periods of its cut-off.
constexpr double kHalfLength = 2.0;

/// Rows from `begin` on of a column of so many, `count` of them; beyond its ends it is mirrored at the end points:
/// x(-k) = 2 x(0) - x(k).
void copy_mirrored(const double* x, Eigen::Index rows, Eigen::Index begin, Eigen::Index count, double* out) {
  const Eigen::Index last = rows - 1;
  Eigen::Index k = begin;
  for (; k < std::min<Eigen::Index>(0, begin + count); ++k) *out++ = 2.0 * x[0] - x[std::min(-k, last)];
  const Eigen::Index recorded = std::max(k, std::min(rows, begin + count));
  out = std::copy(x + k, x + recorded, out);
  k = recorded;
  for (; k < begin + count; ++k) *out++ = 2.0 * x[last] - x[std::max<Eigen::Index>(0, 2 * last - k)];
}

/// So many rows, or as few more as the kernels take.
constexpr Eigen::Index padded(Eigen::Index rows) {
  constexpr Eigen::Index k = kernel::kSampleMultiple;
  return (rows + k - 1) / k * k;
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

void filter_column(const double* x, Eigen::Index rows, const Eigen::VectorXd& weights, Eigen::Index stride,
                   Eigen::Index first, Eigen::Index count, double* out) {
  constexpr Eigen::Index kTogether = 256;  // what is filtered stays in the first-level cache
  thread_local std::vector<double> reached, scratch, sums(kTogether);
  const auto taps = static_cast<int>(weights.size()), step = static_cast<int>(stride);
  for (Eigen::Index done = 0; done < count; done += kTogether) {
    const Eigen::Index some = std::min(kTogether, count - done);
    const Eigen::Index needed = (some - 1) * stride + taps;
    reached.resize(static_cast<std::size_t>((padded(some) - 1) * stride + taps));
    copy_mirrored(x, rows, (first + done) * stride - taps / 2, needed, reached.data());
    std::fill(reached.begin() + needed, reached.end(), 0.0);
    // Many columns act now and then only: beside a knot, while a play is crossed. No other output sees anything.
    const auto is_not_zero = [](double value) { return value != 0.0; };
    const Eigen::Index least = std::find_if(reached.begin(), reached.end(), is_not_zero) - reached.begin();
    const Eigen::Index most = reached.rend() - std::find_if(reached.rbegin(), reached.rend(), is_not_zero);
    const Eigen::Index begin = std::min(some, std::max<Eigen::Index>(0, (least - taps + stride) / stride));
    const Eigen::Index end = std::max(begin, std::min(some, (most + stride - 1) / stride));
    double* const to = out + done;
    std::fill_n(to, begin, 0.0);
    std::fill(to + end, to + some, 0.0);
    if (begin == end) continue;
    // Kernels take so many outputs at once: more of them before the first one where there are none behind the last.
    const Eigen::Index all = padded(end - begin), from = std::min(begin, padded(some) - all);
    scratch.resize(kernel::filter_scratch(step, taps, static_cast<int>(all)));
    kernel::functions().filter(reached.data() + from * stride, step, weights.data(), taps, static_cast<int>(all),
                               scratch.data(), sums.data());
    std::copy(sums.data() + (begin - from), sums.data() + (end - from), to + begin);
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
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, x.cols());
  if (n < 2) return out;
  out.row(0) = (x.row(1) - x.row(0)) / step;
  out.row(n - 1) = (x.row(n - 1) - x.row(n - 2)) / step;
  if (n > 2) out.middleRows(1, n - 2) = (x.bottomRows(n - 2) - x.topRows(n - 2)) / (2.0 * step);
  return out;
}

}  // namespace truing::dynamics
