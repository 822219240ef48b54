// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "kernel/laws.hpp"

#include <cmath>

#include <doctest/doctest.h>

#include "dynamics/laws.hpp"
#include "kernel/kernel.hpp"

namespace {

using Eigen::ArrayXd;

/// On both sides of nought, from the smallest to where nothing changes any more.
ArrayXd numbers() {
  ArrayXd out(800);
  for (Eigen::Index i = 0; i < out.size(); ++i)
    out[i] = std::pow(10.0, -12.0 + 14.8 * static_cast<double>(i / 2) / 400.0) * (i % 2 == 0 ? 1.0 : -1.0);
  return out;
}

double log_two_cosh(double x) { return std::abs(x) + std::log1p(std::exp(-2.0 * std::abs(x))); }

using Law = void (*)(const double*, int, double*);

void check(Law law, const ArrayXd& x, double (*expected)(double)) {
  ArrayXd out(x.size());
  law(x.data(), static_cast<int>(x.size()), out.data());
  for (Eigen::Index i = 0; i < x.size(); ++i)
    CHECK(std::abs(out[i] - expected(x[i])) <= 1e-15 * std::abs(expected(x[i])));
}

}  // namespace

TEST_CASE("functions of laws are those of the library, on every copy of the kernel") {
  for (const char* name : {"scalar", "sse2", "avx2", "avx512"}) {
    const truing::kernel::LawFunctions* kernel = truing::kernel::law_functions(name);
    if (!kernel) continue;
    check(kernel->exponential, numbers(), [](double x) { return std::exp(x); });
    check(kernel->hyperbolic_tangent, numbers(), [](double x) { return std::tanh(x); });
    check(kernel->log_two_cosh, numbers(), log_two_cosh);
  }
}

TEST_CASE("an exponential is nought where it has no digits left, and nothing is made of what is no number") {
  double x[8] = {-709.0, -1e300, 0.0, NAN, 709.0, -708.0, 1.0, -1.0}, out[8];
  truing::kernel::law_functions().exponential(x, 8, out);
  CHECK(out[0] == 0.0);
  CHECK(out[1] == 0.0);
  CHECK(out[2] == 1.0);
  CHECK(std::isnan(out[3]));
  CHECK(out[4] == doctest::Approx(std::exp(709.0)));
  truing::kernel::law_functions().hyperbolic_tangent(x, 8, out);
  CHECK(out[1] == -1.0);
  CHECK(std::isnan(out[3]));
}

TEST_CASE("a number's function does not depend on the numbers around it, to the bit") {
  const ArrayXd x = numbers();
  for (const auto& of :
       {truing::dynamics::exponentials, truing::dynamics::tangents, truing::dynamics::logs_of_two_cosh}) {
    const ArrayXd all = of(x), few = of(x.segment(3, 13));
    CHECK((all.segment(3, 13) == few).all());
    CHECK(of(ArrayXd()).size() == 0);
  }
}
