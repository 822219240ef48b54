// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// How sure a name is said to be.

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "rooms.hpp"

namespace truing::estimation {

constexpr double kNamed = 0.5;  ///< what is named is no less likely than not

/// Something that speaks for a name, or against it, and what one of it counts in log odds.
struct Ground {
  const char* name;
  double value, weight;
};

/// Stated confidence: the posterior of a name's class, times how often names with the same grounds were right in
/// examinations, by a logistic map (Platt 1999, "Probabilistic outputs for support vector machines"). Weights:
/// docs/method/exam.md; bench/confidence.py fits them.
inline double confidence(double posterior, const std::vector<Ground>& grounds) {
  double log_odds = 0.0;
  for (const Ground& ground : grounds) log_odds += ground.weight * ground.value;
  return std::max(kNamed, posterior / (1.0 + std::exp(-log_odds)));
}

/// What it was worked out from, as it is handed to the user.
inline std::map<std::string, double> grounds_told(double posterior, const std::vector<Ground>& grounds) {
  std::map<std::string, double> out{{"posterior", posterior}};
  for (const Ground& ground : grounds) out[ground.name] = ground.value;
  return out;
}

}  // namespace truing::estimation
