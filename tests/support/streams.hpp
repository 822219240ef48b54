// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Simulated streams of a boom, played to a tracker or a filter in the order in which they arrive.

#include <cstdint>
#include <type_traits>

#include "truing/tracking/simulation.hpp"
#include "truing/tracking/tracker.hpp"

namespace streams {

using namespace truing;

inline SimulatedStreams boom(SimulatedMotion motion, std::uint64_t seed, double seconds) {
  StreamSimulationOptions options;
  options.motion = motion;
  options.seed = seed;
  options.seconds = seconds;
  return simulate_streams(large_boom(), options);
}

struct Player {
  std::size_t pose = 0, flange = 0, plan = 0;

  template <typename T>
  void before(const SimulatedStreams& s, double arrival, T* tracker) {
    for (; pose < s.tracker.size() && s.tracker[pose].arrival < arrival; ++pose) tracker->push_pose(s.tracker[pose]);
    if constexpr (std::is_same_v<T, Tracker>) {
      for (; plan < s.plan.size() && s.plan[plan].arrival < arrival; ++plan)
        tracker->push_plan(s.plan[plan].t, s.plan[plan].T_base_frame);
      for (; flange < s.flange.size() && s.flange[flange].arrival < arrival; ++flange)
        tracker->push_joints(s.flange[flange].t, s.flange[flange].T_base_frame);
    } else {
      for (; flange < s.flange.size() && s.flange[flange].arrival < arrival; ++flange)
        tracker->push_flange(s.flange[flange].t, s.flange[flange].T_base_frame);
    }
  }
};

/// Everything up to `until`, in the order of arrival.
template <typename T>
std::size_t play(const SimulatedStreams& s, double until, T* tracker, Player* player, std::size_t from = 0) {
  std::size_t k = from;
  for (; k < s.imu.size() && s.imu[k].t <= until; ++k) {
    player->before(s, s.imu[k].arrival, tracker);
    tracker->push_imu(s.imu[k]);
  }
  return k;
}

}  // namespace streams
