// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Counts what is taken from the heap, for the whole program: a file of its own.

#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "support/streams.hpp"

#if defined(__GLIBC__)
namespace {
std::atomic<std::uint64_t> g_allocations{0};
}

// Eigen allocates by malloc, the standard library by operator new, which ends there as well.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++g_allocations;
  return __libc_malloc(size);
}

using namespace streams;
using namespace truing;

TEST_CASE("after construction nothing is allocated: seed 20") {
  const SimulatedStreams s = boom(SimulatedMotion::stop_and_go, 20, 6.0);
  TrackOptions options;
  options.modes.count = 4;
  options.modes.frequency = {0.6, 1.4, 3.2, 6.3};
  options.modes.damping = {0.02, 0.02, 0.02, 0.02};
  Tracker tracker(s.setup, options);
  Player player;
  std::size_t k = play(s, 1.0, &tracker, &player);
  const std::uint64_t before = g_allocations;
  double sum = 0.0;
  for (double t = 1.01; t < 5.9; t += 0.01) {
    k = play(s, t, &tracker, &player, k);
    sum += tracker.compensate(t + 0.04).correction.norm() + tracker.clock().sigma +
           static_cast<double>(tracker.shift().count);
  }
  CHECK(g_allocations == before);
  CHECK(std::isfinite(sum));
}
#endif
