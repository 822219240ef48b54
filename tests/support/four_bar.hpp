// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The exact closure of a four-bar linkage.

#include <cmath>

namespace four_bar {

struct Bars {
  double base, crank, coupler, rocker;  ///< lengths
};

/// Angle of the rocker against the base bar, with the crank at `theta`: the one of the two closures that is nearer to
/// it (law of cosines in the triangle of the crank's end, the rocker's bearing and the rocker's end).
inline double rocker_angle(const Bars& bars, double theta) {
  const double x = bars.crank * std::cos(theta) - bars.base, y = bars.crank * std::sin(theta);
  const double diagonal = std::hypot(x, y);
  const double between = std::acos((diagonal * diagonal + bars.rocker * bars.rocker - bars.coupler * bars.coupler) /
                                   (2.0 * diagonal * bars.rocker));
  const double towards = std::atan2(y, x);
  const double one = std::remainder(towards - between - theta, 2.0 * M_PI),
               other = std::remainder(towards + between - theta, 2.0 * M_PI);
  return theta + (std::abs(one) < std::abs(other) ? one : other);
}

}  // namespace four_bar
