// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// How sure a name is said to be.

#include <doctest/doctest.h>

#include <cmath>

#include "estimation/confidence.hpp"

using namespace truing::estimation;

TEST_CASE("confidence is the posterior times a logistic map of the grounds, and no less than one half") {
  const std::vector<Ground> grounds = {{"constant", 1.0, -1.0}, {"found_again", 0.5, 6.0}};
  CHECK(confidence(0.9, grounds) == doctest::Approx(0.9 / (1.0 + std::exp(-2.0))));
  const std::vector<Ground> against = {{"unknown_found", 1.0, -3.0}};
  CHECK(confidence(1.0, against) == kNamed);
  CHECK(confidence(1.0, {}) == kNamed);
  CHECK(grounds_told(0.9, grounds) ==
        std::map<std::string, double>{{"posterior", 0.9}, {"constant", 1.0}, {"found_again", 0.5}});
}
