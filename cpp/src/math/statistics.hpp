// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "rooms.hpp"
#include "truing/common/error_statistics.hpp"

namespace truing::math {

/// Median length of a vector of k standard normal components.
constexpr double kChiMedian[7] = {0.0, 0.674490, 1.177410, 1.538172, 1.832134, 2.086015, 2.312600};

inline double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// By linear interpolation between order statistics (Hyndman and Fan's type 7, NumPy's default); reorders `values`.
inline double quantile(std::vector<double>* values, double share) {
  const double at = share * (static_cast<double>(values->size()) - 1.0);
  const auto low = static_cast<std::ptrdiff_t>(at);
  std::nth_element(values->begin(), values->begin() + low, values->end());
  const double below = (*values)[static_cast<std::size_t>(low)];
  const auto above = std::min_element(values->begin() + low + 1, values->end());
  return above == values->end() ? below : below + (at - static_cast<double>(low)) * (*above - below);
}

/// Of the lengths of errors; rotation_rms is left NaN.
inline ErrorStatistics error_statistics(std::vector<double> lengths) {
  ErrorStatistics out;
  out.n = lengths.size();
  out.rotation_rms = std::numeric_limits<double>::quiet_NaN();
  if (lengths.empty()) return out;
  double squares = 0.0, sum = 0.0;
  for (const double length : lengths) {
    sum += length;
    squares += length * length;
  }
  const auto n = static_cast<double>(lengths.size());
  out.rms = std::sqrt(squares / n);
  out.mean = sum / n;
  out.median = quantile(&lengths, 0.5);
  out.p95 = quantile(&lengths, 0.95);
  out.max = *std::max_element(lengths.begin(), lengths.end());
  return out;
}

}  // namespace truing::math
