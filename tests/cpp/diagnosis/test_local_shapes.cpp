// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What a joint does with its own angle: waves, or a step, a corner, a bump.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "diagnosis/diagnosis.hpp"
#include "math/random.hpp"

using truing::Curve;
using truing::diagnosis::share_of_local_shape;
using truing::diagnosis::Work;

namespace local_shapes {
namespace {

using Function = std::function<double(double)>;

/// A joint's motion at 120 angles, and at a knot every tenth of them.
Curve curve_of(const Function& f) {
  Curve out;
  out.input = "q3";
  out.input_unit = "rad";
  for (int k = 0; k <= 120; ++k) {
    const double q = -2.7 + 0.045 * k;
    out.samples.push_back({q, f(q)});
    if (k % 10 == 0) out.points.push_back({q, f(q), 1e-6});
  }
  return out;
}

/// A joint that moves the tip by f(q) times 0.5 to 1.5 m, seen 400 times to 0.1 mm.
Work of_joint(const Function& f) {
  constexpr Eigen::Index kRows = 400;
  constexpr double kPerNoise = 1e4;
  Work work;
  work.design.x = Eigen::MatrixXd::Zero(kRows, 2);
  work.design.y = Eigen::VectorXd::Zero(kRows);
  work.design.weight = Eigen::VectorXd::Constant(kRows, kPerNoise);
  work.design.prior = Eigen::VectorXd::Constant(2, truing::diagnosis::kLargest);
  work.design.folds = 4;
  work.design.nuisance = {0};
  work.design.joint_column = {{1}};
  work.inputs = {{"q1", "rad", 0, false, {}}};
  truing::math::Random random(3);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double q = random.uniform(-2.7, 2.7), lever = random.uniform(0.5, 1.5);
    work.inputs[0].values.push_back(q);
    work.design.x.row(i) << 1.0, lever;
    work.design.y[i] = 2e-4 + lever * f(q) + random.normal() / kPerNoise;
    work.design.row.push_back(static_cast<std::int32_t>(i));
    work.design.fold.push_back(static_cast<std::int32_t>(i % 4));
  }
  work.grams = truing::diagnosis::make_grams(work.design, 1.0, 1);
  return work;
}

bool is_smooth(const Function& f) {
  const Work work = of_joint(f);
  const truing::estimation::Evidence evidence = truing::diagnosis::evidence_now(work);
  return truing::diagnosis::is_smooth(work, evidence, evidence.evaluate({}), 0, 0);
}

}  // namespace

TEST_CASE("a wave is no local shape, and a step, a corner and a bump are") {
  CHECK(share_of_local_shape(curve_of([](double q) { return 1e-4 * std::cos(2.0 * q + 0.4); })) < 0.8);
  CHECK(share_of_local_shape(curve_of([](double q) { return 1e-4 * std::cos(3.0 * q - 1.0); })) < 0.5);
  CHECK(share_of_local_shape(curve_of([](double q) { return q < 0.4 ? 0.0 : 1e-4; })) > 0.95);
  CHECK(share_of_local_shape(curve_of([](double q) { return 1e-4 * std::max(0.0, q - 0.5); })) > 0.99);
  CHECK(share_of_local_shape(curve_of([](double q) { return 1e-4 * std::exp(-2.0 * q * q); })) > 0.95);
}

TEST_CASE("a joint turns in waves of three orders, and not by edges, corners, bumps or faster waves") {
  CHECK(is_smooth([](double q) { return 3e-4 * std::cos(q) + 2e-4 * std::cos(3.0 * q + 1.0); }));
  CHECK(is_smooth([](double q) { return 3e-4 * std::cos(2.0 * q + 0.3) + 2e-4 * std::cos(3.0 * q + 1.0); }));
  CHECK(!is_smooth([](double q) { return 5e-4 * std::fmod(q / 2.8 + 10.2, 1.0); }));
  CHECK(!is_smooth([](double q) { return q > 0.2 && q < 1.5 ? 5e-4 : 0.0; }));
  CHECK(!is_smooth([](double q) { return 3e-4 * std::pow(std::max(0.0, q - 0.5), 1.5); }));
  CHECK(!is_smooth([](double q) { return 3e-4 * std::exp(-4.0 * q * q); }));
  CHECK(!is_smooth([](double q) { return 3e-4 * std::cos(5.0 * q); }));
}

}  // namespace local_shapes
