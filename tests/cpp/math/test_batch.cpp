// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// A batch on threads: what its progress says, and that it stops when told to.

#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

#include "math/batch.hpp"

using truing::math::for_each_on_threads;

TEST_CASE("every item is done once, however many threads there are") {
  for (const int threads : {0, 1, 2, 5}) {
    CAPTURE(threads);
    std::vector<std::atomic<int>> times(1000);
    for_each_on_threads(times.size(), threads, {}, [&](std::size_t k) { ++times[k]; });
    for (const std::atomic<int>& n : times) CHECK(n == 1);
  }
}

TEST_CASE("progress ends with all, also where another thread does the last part") {
  // Two chunks. Whoever gets the second one waits until the first has been reported.
  constexpr std::size_t kCount = 128;
  std::mutex mutex;
  std::condition_variable changed;
  int started = 0;
  bool reported = false;
  std::vector<std::size_t> said;
  const auto caller = std::this_thread::get_id();
  const auto progress = [&](std::size_t done) {
    said.push_back(done);
    const std::lock_guard<std::mutex> lock(mutex);
    reported = true;
    changed.notify_all();
    return true;
  };
  const auto work = [&](std::size_t k) {
    if (k % 64 != 0) return;
    std::unique_lock<std::mutex> lock(mutex);
    ++started;
    changed.notify_all();
    changed.wait(lock, [&] { return started == 2; });  // each thread has a chunk
    if (std::this_thread::get_id() != caller) changed.wait(lock, [&] { return reported; });
  };
  for_each_on_threads(kCount, 2, progress, work);
  REQUIRE(!said.empty());
  CHECK(said.back() == kCount);
  CHECK(said.front() < kCount);
}

TEST_CASE("a progress that answers false stops the batch, and is not called again") {
  std::size_t done = 0;
  int calls = 0;
  const auto progress = [&](std::size_t) { return ++calls < 3; };
  for_each_on_threads(1000, 1, progress, [&](std::size_t) { ++done; });
  CHECK(calls == 3);
  CHECK(done == std::size_t{3} * 64);
}

TEST_CASE("what a thread throws comes out") {
  CHECK_THROWS_AS(for_each_on_threads(1000, 2, {},
                                      [](std::size_t k) {
                                        if (k == 700) throw std::runtime_error("seven hundred");
                                      }),
                  std::runtime_error);
}

TEST_CASE("a batch may be asked for out of a batch, and by several threads at once") {
  std::atomic<int> done{0};
  const auto inner = [&](std::size_t) { for_each_on_threads(50, 3, {}, [&](std::size_t) { ++done; }, 1); };
  std::vector<std::thread> callers;
  for (int k = 0; k < 4; ++k) callers.emplace_back([&] { for_each_on_threads(20, 3, {}, inner, 1); });
  for (std::thread& caller : callers) caller.join();
  CHECK(done == 4 * 20 * 50);
}

#if defined(__has_feature)
#define HAS_FEATURE(name) __has_feature(name)
#else
#define HAS_FEATURE(name) 0
#endif
#if !defined(__SANITIZE_THREAD__) && !HAS_FEATURE(thread_sanitizer)  // which lets no forked process begin threads
TEST_CASE("a forked process has helpers of its own") {
  const auto count = [] {
    std::atomic<int> done{0};
    for_each_on_threads(100, 2, {}, [&](std::size_t) { ++done; }, 1);
    return done.load();
  };
  REQUIRE(count() == 100);
  const pid_t child = fork();
  if (child == 0) _exit(count() == 100 ? 0 : 1);
  int status = 1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(status == 0);
}
#endif
