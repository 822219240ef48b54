// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "math/batch.hpp"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>

namespace truing::math {
namespace {

std::size_t threads_of_machine() {
  static const std::size_t threads = std::max(1u, std::thread::hardware_concurrency());  // asking opens a file
  return threads;
}

/// Threads that wait for work: a new one may begin only when its caller waits for it, as both are on one processor
/// until the scheduler looks again.
class Helpers {
 public:
  /// Calls run() here and on at most so many helpers. Those that come too late are not waited for: whoever works
  /// leaves nothing undone.
  void share(std::size_t most, const std::function<void()>& run) {
    Call call{&run, most};
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      while (idle_ < most && started_ < std::max(most, threads_of_machine() - 1) && begins()) ++idle_, ++started_;
      calls_.push_back(&call);
    }
    most == 1 ? wanted_.notify_one() : wanted_.notify_all();
    run();
    std::unique_lock<std::mutex> lock(mutex_);
    calls_.erase(std::remove(calls_.begin(), calls_.end(), &call), calls_.end());
    ended_.wait(lock, [&] { return call.helpers == 0; });
  }

 private:
  struct Call {
    const std::function<void()>* run;
    std::size_t wanted;       ///< so many more helpers may begin
    std::size_t helpers = 0;  ///< are at it
  };

  /// One more helper; false: the system has no thread to give, and the work is done by fewer.
  bool begins() {
    try {
      std::thread([this] { help(); }).detach();
    } catch (const std::system_error&) {
      return false;
    }
    return true;
  }

  void help() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      wanted_.wait(lock, [&] { return !calls_.empty(); });
      Call& call = *calls_.front();
      if (--call.wanted == 0) calls_.pop_front();
      ++call.helpers;
      --idle_;
      lock.unlock();
      (*call.run)();
      lock.lock();
      ++idle_;
      if (--call.helpers == 0) ended_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable wanted_, ended_;
  std::deque<Call*> calls_;
  std::size_t started_ = 0, idle_ = 0;
};

/// Never destroyed: helpers wait until the process ends. A forked process has no threads but its own, and gets others.
std::atomic<Helpers*> all_helpers{nullptr};
[[maybe_unused]] const int at_fork = pthread_atfork(nullptr, nullptr, [] { all_helpers = nullptr; });

Helpers& helpers() {
  Helpers* known = all_helpers;
  if (known) return *known;
  auto made = std::make_unique<Helpers>();
  if (all_helpers.compare_exchange_strong(known, made.get())) return *made.release();
  return *known;
}

}  // namespace

void for_each_on_threads(std::size_t count, int threads, const std::function<bool(std::size_t)>& progress,
                         const std::function<void(std::size_t)>& work, std::size_t at_a_time) {
  const std::size_t chunks = (count + at_a_time - 1) / at_a_time;
  const std::size_t workers = std::min(threads > 0 ? static_cast<std::size_t>(threads) : threads_of_machine(), chunks);
  const auto caller = std::this_thread::get_id();
  std::atomic<std::size_t> next{0}, done{0};
  std::atomic<bool> stop{false};
  std::size_t reported = 0;
  std::exception_ptr failure;
  std::mutex mutex;
  const auto run = [&] {
    const bool reports = progress && std::this_thread::get_id() == caller;
    try {
      for (std::size_t chunk = next++; chunk < chunks && !stop; chunk = next++) {
        const std::size_t begin = chunk * at_a_time, end = std::min(count, begin + at_a_time);
        for (std::size_t k = begin; k < end; ++k) work(k);
        done += end - begin;
        if (reports && !progress(reported = done)) stop = true;
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!failure) failure = std::current_exception();
      stop = true;
    }
  };
  if (workers > 1)
    helpers().share(workers - 1, run);
  else
    run();
  if (failure) std::rethrow_exception(failure);
  if (progress && !stop && reported < count) progress(count);  // the others did the last ones
}

}  // namespace truing::math
