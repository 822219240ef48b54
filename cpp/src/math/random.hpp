// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>

#include "rooms.hpp"

namespace truing::math {

/// splitmix64 (Steele, Lea, Flood 2014): the same numbers on every machine, unlike the distributions of <random>.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ull);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }

  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(next() >> 11) * 0x1.0p-53);
  }

  /// Standard normal (Box and Muller 1958).
  double normal() {
    const double r = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return r * std::cos(uniform(0.0, 6.283185307179586));
  }

  /// Exponential, of mean 1.
  double exponential() { return -std::log(1.0 - uniform(0.0, 1.0)); }

  /// 0 … count - 1
  std::uint64_t below(std::uint64_t count) { return next() % count; }

 private:
  std::uint64_t state_;
};

}  // namespace truing::math
