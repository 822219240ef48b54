// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What every question is answered with: a descent from somewhere, and the independent check of what comes out.

#include "inverse_kinematics/prepared_robot.hpp"
#include "rooms.hpp"

namespace truing::inverse_kinematics {

/// What is asked for. Nothing of it changes while the answer is looked for, but the bases of effects in `scratch`.
struct Query {
  const PreparedRobot& robot;
  const Goal& goal;
  const double* seed;      ///< readings
  EffectScratch* scratch;  ///< null for robots without effects

  Query with_goal(const Goal& other) const { return {robot, other, seed, scratch}; }
  Query from(const double* other) const { return {robot, goal, other, scratch}; }
};

/// What descents met on the way: what they cost, and what a failure is explained by.
struct Trace {
  int iterations = 0;
  Descent nearest{};     ///< of all descents within limits the one that came nearest
  Solution colliding{};  ///< of what would be there but for a collision the least deep; joints empty: none
};

/// The independent check: forward once more, task, limits, collision. Fills joints, errors, roll, contact and reason of
/// `solution`; true: reached.
bool check(const Query& query, const double* readings, Trace* trace, Solution* solution);

Descent descend_from(const Query& query, const double* from, const DescentOptions& how, Trace* trace);

/// One descent within limits, and its check.
bool descend_to(const Query& query, const double* from, Trace* trace, Solution* solution);

/// From the seed, then from others until one arrives.
bool descend_from_many(const Query& query, int restarts, Trace* trace, Solution* solution);

/// Is something nearer than the scene's clearance?
bool collides(const PreparedRobot& robot, const double* readings);

}  // namespace truing::inverse_kinematics
