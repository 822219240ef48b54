// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <doctest/doctest.h>

#include "dynamics/filter.hpp"
#include "kernel/kernel.hpp"
#include "math/constants.hpp"
#include "math/random.hpp"

using namespace truing::dynamics;

namespace {

constexpr double kStep = 0.01;

Eigen::MatrixXd sine(double frequency, Eigen::Index rows) {
  Eigen::MatrixXd out(rows, 1);
  for (Eigen::Index i = 0; i < rows; ++i)
    out(i, 0) = std::sin(2.0 * truing::math::kPi * frequency * kStep * static_cast<double>(i));
  return out;
}

/// Amplitude of a sine in the middle of a filtered record, and of what is out of phase with it.
std::pair<double, double> response(double frequency) {
  const Eigen::MatrixXd x = sine(frequency, 1200), y = filtered(x, low_pass(8.0, kStep));
  double in = 0.0, out = 0.0, squares = 0.0;
  for (Eigen::Index i = 200; i < 1000; ++i) {
    const double cosine = std::cos(2.0 * truing::math::kPi * frequency * kStep * static_cast<double>(i));
    in += x(i, 0) * y(i, 0);
    out += cosine * y(i, 0);
    squares += x(i, 0) * x(i, 0);
  }
  return {in / squares, out / squares};
}

}  // namespace

TEST_CASE("a slow sine passes the low-pass unchanged, a fast one does not, and neither is delayed") {
  CHECK(std::abs(response(1.0).first - 1.0) < 1e-3);
  CHECK(std::abs(response(8.0).first - 0.5) < 0.02);
  CHECK(std::abs(response(20.0).first) < 1e-3);
  for (const double frequency : {1.0, 4.0, 8.0, 20.0}) CHECK(std::abs(response(frequency).second) < 1e-3);
}

TEST_CASE("a straight line passes the low-pass up to its ends") {
  Eigen::MatrixXd x(300, 1);
  for (Eigen::Index i = 0; i < 300; ++i) x(i, 0) = 3.0 - 0.2 * static_cast<double>(i);
  const Eigen::MatrixXd y = filtered(x, low_pass(8.0, kStep));
  CHECK((y - x).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("every third row of a filtered record is that row") {
  const Eigen::MatrixXd x = sine(2.0, 400);
  const Eigen::VectorXd weights = low_pass(8.0, kStep);
  const Eigen::MatrixXd all = filtered(x, weights), some = filtered(x, weights, 3);
  REQUIRE(some.rows() == 134);
  for (Eigen::Index i = 0; i < some.rows(); ++i) CHECK(some(i, 0) == all(3 * i, 0));
}

TEST_CASE("where a column is zero for long nothing is summed, and beside it all is") {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(3000);
  x.segment(900, 3).setConstant(2.0);
  x[2999] = 1.0;
  const Eigen::VectorXd weights = low_pass(8.0, kStep);
  const Eigen::MatrixXd y = filtered(x, weights, 2);
  const Eigen::Index half = weights.size() / 2;
  for (Eigen::Index i = 0; i < y.rows(); ++i) {
    double sum = 0.0;
    for (Eigen::Index k = -half; k <= half; ++k) {
      const Eigen::Index at = 2 * i + k;
      sum += weights[k + half] * (at < 0 ? -x[-at] : at > 2999 ? 2.0 * x[2999] - x[5998 - at] : x[at]);
    }
    CHECK(std::abs(y(i, 0) - sum) < 1e-14);
  }
}

TEST_CASE("every copy of the kernel filters as the sum says, and rows do not depend on each other, to the bit") {
  Eigen::VectorXd x = Eigen::VectorXd::Random(700);
  x.segment(60, 80).setZero();  // all that some rows see
  const Eigen::VectorXd weights = Eigen::VectorXd::Random(51);
  for (const char* name : {"scalar", "sse2", "avx2", "avx512"}) {
    const truing::kernel::Functions* kernel = truing::kernel::functions(name);
    if (!kernel) continue;
    for (const int step : {1, 4, 5}) {
      const int count = 88;
      std::vector<double> scratch(truing::kernel::filter_scratch(step, 51, count)), out(count), few(8);
      kernel->filter(x.data(), step, weights.data(), 51, count, scratch.data(), out.data());
      for (int i = 0; i < count; ++i)
        CHECK(std::abs(out[static_cast<std::size_t>(i)] - weights.dot(x.segment(i * step, 51))) < 1e-13);
      kernel->filter(x.data() + 3 * step, step, weights.data(), 51, 8, scratch.data(), few.data());
      for (std::size_t i = 0; i < few.size(); ++i) CHECK(few[i] == out[i + 3]);
    }
  }
}

TEST_CASE("the rate of a sine is its cosine") {
  const double w = 2.0 * truing::math::kPi * 0.5;
  const Eigen::MatrixXd rate = rate_of(sine(0.5, 400), kStep);
  for (Eigen::Index i = 0; i < 400; ++i)
    CHECK(std::abs(rate(i, 0) - w * std::cos(w * kStep * static_cast<double>(i))) < 1e-3 * w);
}

TEST_CASE("a motion that is recorded on its way accelerates at the ends of its record as it does within") {
  const double w = 2.0 * truing::math::kPi * 0.9;
  const Eigen::Index rows = 300, seen = 13;
  const Eigen::MatrixXd all = sine(0.9, 400), x = all.middleRows(25, rows);  // from where it accelerates most
  const Eigen::VectorXd weights = low_pass(8.0, kStep);
  const auto largest_error = [&](const Bends& bends) {
    Eigen::MatrixXd y(rows, 1);
    filter_column(x.data(), rows, weights, 1, 0, rows, y.data(), bends);
    const Eigen::MatrixXd acceleration = rate_of(rate_of(y, kStep), kStep);
    return (acceleration + w * w * x).cwiseAbs().maxCoeff() / (w * w);
  };
  CHECK(largest_error({bend_of(x.data(), 1, seen), bend_of(x.data() + rows - 1, -1, seen)}) < 0.08);
  CHECK(largest_error({}) > 0.4);
}

TEST_CASE("noise bends less than a fit to it says") {
  Random random(4);
  const Eigen::Index rows = 26;
  double taken = 0.0, bent = 0.0;
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::VectorXd noise(rows);
    for (double& value : noise) value = random.normal();
    taken += std::pow(bend_of(noise.data(), 1, rows), 2.0);
    for (Eigen::Index k = 0; k < rows; ++k) noise[k] += 0.5 * static_cast<double>(k * k);  // by 1 from row to row
    bent += bend_of(noise.data(), 1, rows) / 200.0;
  }
  const double standard_error = 0.0454;  // of the second derivative of a cubic's end through 26 rows
  CHECK(std::sqrt(taken / 200.0) < 0.5 * standard_error);
  CHECK(std::abs(bent - 1.0) < 0.1);
}
