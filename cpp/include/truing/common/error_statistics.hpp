// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace truing {

/// Length of the position (or distance) errors of a set of rows.
struct ErrorStatistics {
  double rms = 0.0;           ///< [m]
  double mean = 0.0;          ///< [m]
  double median = 0.0;        ///< [m]
  double p95 = 0.0;           ///< [m] 95th percentile
  double max = 0.0;           ///< [m]
  double rotation_rms = 0.0;  ///< [rad]; NaN: no orientation measured
  std::size_t n = 0;          ///< number of rows
};

}  // namespace truing
