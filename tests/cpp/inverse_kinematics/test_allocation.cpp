// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Counts what is taken from the heap, for the whole program: a file of its own.

#include <doctest/doctest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "support/inverse_arms.hpp"
#include "truing/compensate.hpp"

namespace {
std::atomic<long> g_taken{0};
}

// Not inlined: GCC 12 else sees free() on memory of a new that it has not looked into, and warns of the mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++g_taken;
  if (void* memory = std::malloc(size ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

using namespace inverse_arms;

TEST_CASE("a solve takes nothing from the heap, with effects neither") {
  Robot loaded = perturbed(wrist_arm(), 1e-3, 1e-3, 91);
  loaded.effects = {{"backlash", {"J2"}, {{"backlash.J2", 1e-3}}},
                    {"harmonic", {"J1"}, {{"harmonic.J1.cos1", 1e-3}, {"harmonic.J1.sin1", 1e-3}}}};
  for (const Robot& robot : {wrist_arm(), perturbed(wrist_arm(), 1e-3, 1e-3, 91), loaded, gantry()}) {
    const truing::InverseSolver solver(robot);
    Sampler sampler(robot, 92);
    for (const TaskKind kind : {TaskKind::pose, TaskKind::torch, TaskKind::point}) {
      const Task task = task_at(reached(robot, sampler.joints()), kind);
      const Joints seed = sampler.joints();
      truing::Branches branches;
      (void)solver.solve(task, seed);  // the first one makes the scratch memory
      const long before = g_taken;
      const Solution solution = solver.solve(task, seed);
      (void)solver.follow(task, solution.joints);
      if (kind == TaskKind::pose && robot.joints.size() == 6) solver.branches(task, seed, &branches);
      Task far = task;
      far.T_measurement_target.translation() = Vector3d(0, 30, 0);
      (void)solver.solve(far, seed);
      CHECK(g_taken == before);
      CHECK(solution.reached());
    }
  }
}
