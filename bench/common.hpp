// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What the timed programs share: the clock, the lines that bench/run.py reads, the arm.

#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>

#include "truing/model/robot.hpp"

namespace truing::bench {

inline double seconds(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Best of so many runs, as the peers and BLAS are timed: what the code takes when nothing else runs on the machine.
inline double best_seconds(int runs, const std::function<void()>& work) {
  double best = seconds(work);
  for (int k = 1; k < runs; ++k) best = std::min(best, seconds(work));
  return best;
}

/// One JSON object a line: {"name", "value", "unit"}.
inline void report(const std::string& name, double value, const char* unit) {
  std::printf("{\"name\": \"%s\", \"value\": %.9g, \"unit\": \"%s\"}\n", name.c_str(), value, unit);
  std::fflush(stdout);
}

inline void report(const std::string& name, const char* text) {
  std::printf("{\"name\": \"%s\", \"value\": \"%s\", \"unit\": \"\"}\n", name.c_str(), text);
  std::fflush(stdout);
}

/// Modified DH, without masses.
inline Robot ur10() {
  const double table[6][3] = {{0, 0, 0.1273},         {M_PI / 2, 0, 0},      {0, -0.612, 0},
                              {0, -0.5723, 0.163941}, {M_PI / 2, 0, 0.1157}, {-M_PI / 2, 0, 0.0922}};
  Robot robot;
  robot.name = "ur10";
  robot.convention = Convention::mdh;
  for (int k = 0; k < 6; ++k) {
    Joint joint;
    joint.name = "J" + std::to_string(k + 1);
    joint.alpha = table[k][0];
    joint.a = table[k][1];
    joint.d = table[k][2];
    robot.joints.push_back(joint);
  }
  return robot;
}

}  // namespace truing::bench
