// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/laws.hpp"

#include <algorithm>
#include <utility>

#include "kernel/laws.hpp"
#include "kernel/rigid.hpp"

namespace truing::dynamics {
namespace {

using Law = void (*)(const double* x, int count, double* out);

/// What is left beside whole packs has room of its own.
Eigen::ArrayXd of_each(Law law, Eigen::ArrayXd x) {
  const Eigen::Index rest = x.size() % kernel::kSampleMultiple, whole = x.size() - rest;
  double last[kernel::kSampleMultiple] = {};
  std::copy_n(x.data() + whole, rest, last);
  law(x.data(), static_cast<int>(whole), x.data());
  law(last, kernel::kSampleMultiple, last);
  std::copy_n(last, rest, x.data() + whole);
  return x;
}

}  // namespace

Eigen::ArrayXd exponentials(Eigen::ArrayXd x) { return of_each(kernel::law_functions().exponential, std::move(x)); }
Eigen::ArrayXd tangents(Eigen::ArrayXd x) { return of_each(kernel::law_functions().hyperbolic_tangent, std::move(x)); }
Eigen::ArrayXd logs_of_two_cosh(Eigen::ArrayXd x) {
  return of_each(kernel::law_functions().log_two_cosh, std::move(x));
}

}  // namespace truing::dynamics
