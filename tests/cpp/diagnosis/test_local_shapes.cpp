// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What a joint does with its own angle: waves, or a step, a corner, a bump.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "diagnosis/free_search.hpp"

using truing::Curve;
using truing::diagnosis::share_of_local_shape;

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

}  // namespace

TEST_CASE("a wave is no local shape, and a step, a corner and a bump are") {
  CHECK(share_of_local_shape(curve_of([](double q) { return 1e-4 * std::cos(2.0 * q + 0.4); })) < 0.8);
  CHECK(share_of_local_shape(curve_of([](double q) { return 1e-4 * std::cos(3.0 * q - 1.0); })) < 0.5);
  CHECK(share_of_local_shape(curve_of([](double q) { return q < 0.4 ? 0.0 : 1e-4; })) > 0.95);
  CHECK(share_of_local_shape(curve_of([](double q) { return 1e-4 * std::max(0.0, q - 0.5); })) > 0.99);
  CHECK(share_of_local_shape(curve_of([](double q) { return 1e-4 * std::exp(-2.0 * q * q); })) > 0.95);
}

}  // namespace local_shapes
