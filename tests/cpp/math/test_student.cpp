// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "math/student.hpp"

#include <doctest/doctest.h>

using truing::math::student_probability;

TEST_CASE("Student's t has the quantiles of its tables") {
  CHECK(student_probability(6.313752, 1) == doctest::Approx(0.95).epsilon(1e-6));
  CHECK(student_probability(4.302653, 2) == doctest::Approx(0.975).epsilon(1e-6));
  CHECK(student_probability(2.131847, 4) == doctest::Approx(0.95).epsilon(1e-6));
  CHECK(student_probability(3.707428, 6) == doctest::Approx(0.995).epsilon(1e-6));
  CHECK(student_probability(-1.697261, 30) == doctest::Approx(0.05).epsilon(1e-6));
  CHECK(student_probability(1.644869, 1000001) == doctest::Approx(0.95).epsilon(1e-5));
  CHECK(student_probability(0.0, 7) == 0.5);
  CHECK(student_probability(3.0, 0) == 0.5);
}
