// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "math/constants.hpp"
#include "rooms.hpp"

namespace truing::math {

/// Chance that Student's t with so many degrees of freedom is below `t`: the sums of Abramowitz and Stegun
/// (1964), 26.7.3 and 26.7.4.
inline double student_probability(double t, int freedom) {
  if (freedom < 1) return 0.5;
  const double angle = std::atan2(t, std::sqrt(static_cast<double>(freedom)));
  const double cosine2 = std::cos(angle) * std::cos(angle);
  const bool odd = freedom % 2 == 1;
  double term = odd ? std::cos(angle) : 1.0, sum = odd && freedom == 1 ? 0.0 : term;
  for (int k = odd ? 3 : 2; k < freedom; k += 2) sum += term *= cosine2 * (k - 1.0) / k;
  const double within = odd ? 2.0 / kPi * (angle + std::sin(angle) * sum) : std::sin(angle) * sum;
  return 0.5 * (1.0 + within);
}

}  // namespace truing::math
