// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "rooms.hpp"

namespace truing::math {

/// So many neighbours go to one thread, one after the other.
constexpr std::size_t kBatchChunk = 64;

/// Calls work(k) for every k below count, on so many threads (0: as many as the machine has). What work(k) does must
/// not depend on the others, and then nothing depends on the number of threads. `progress` is called by the calling
/// thread with how many are done, the last time with all; false stops. The first exception comes out when all threads
/// have ended. A thread takes `at_a_time` of them: one where each is long.
inline void for_each_on_threads(std::size_t count, int threads, const std::function<bool(std::size_t)>& progress,
                                const std::function<void(std::size_t)>& work, std::size_t at_a_time = kBatchChunk) {
  const std::size_t chunks = (count + at_a_time - 1) / at_a_time;
  std::size_t workers =
      threads > 0 ? static_cast<std::size_t>(threads) : std::max(1u, std::thread::hardware_concurrency());
  workers = std::max<std::size_t>(1, std::min(workers, chunks));
  std::atomic<std::size_t> next{0}, done{0};
  std::atomic<bool> stop{false};
  std::size_t reported = 0;
  std::exception_ptr failure;
  std::mutex mutex;
  const auto run = [&](bool reports) {
    try {
      for (std::size_t chunk = next++; chunk < chunks && !stop; chunk = next++) {
        const std::size_t begin = chunk * at_a_time, end = std::min(count, begin + at_a_time);
        for (std::size_t k = begin; k < end; ++k) work(k);
        done += end - begin;
        if (reports && progress && !progress(reported = done)) stop = true;
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!failure) failure = std::current_exception();
      stop = true;
    }
  };
  std::vector<std::thread> helpers;
  for (std::size_t k = 1; k < workers; ++k) helpers.emplace_back(run, false);
  run(true);
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
  if (progress && !stop && reported < count) progress(count);  // the others did the last ones
}

}  // namespace truing::math
