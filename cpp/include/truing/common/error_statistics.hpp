// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace truing {

/// Length of the position (or distance) errors of a set of rows.
struct ErrorStatistics {
  double rms = 0.0, mean = 0.0, median = 0.0, p95 = 0.0, max = 0.0;  ///< [m]
  double rotation_rms = 0.0;                                         ///< [rad]; NaN: no orientation measured
  std::size_t n = 0;
};

}  // namespace truing
