// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

#include "rooms.hpp"

namespace truing::math {

/// So many neighbours go to one thread, one after the other.
constexpr std::size_t kBatchChunk = 64;

/// Calls work(k) for every k below count, on so many threads (0: as many as the machine has). What work(k) does must
/// not depend on the others, and then nothing depends on the number of threads. `progress` is called by the calling
/// thread with how many are done, the last time with all; false stops. The first exception comes out when all threads
/// have ended. A thread takes `at_a_time` of them: one where each is long. The caller's helpers are threads of the
/// process that wait for the next call: it may come from several threads, and out of work(k).
void for_each_on_threads(std::size_t count, int threads, const std::function<bool(std::size_t)>& progress,
                         const std::function<void(std::size_t)>& work, std::size_t at_a_time = kBatchChunk);

}  // namespace truing::math
