// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/solve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "inverse_kinematics/best.hpp"
#include "inverse_kinematics/candidates.hpp"
#include "inverse_kinematics/explain.hpp"
#include "math/constants.hpp"

namespace truing::inverse_kinematics {
namespace {

/// The nearest branch, the rails where the seed has them.
bool solve_by_branches(const Query& query, Trace* trace, Solution* solution) {
  Candidate found[ClosedForm::kMost];
  const int count = candidates(query, query.goal, query.seed, query.robot.seed_slack(), found);
  for (int k = 0; k < count; ++k) {
    if (polish(query, found[k], trace, solution)) return true;
  }
  solution->branch = -1;
  return false;
}

/// A torch task as poses: every few degrees of roll the closed form, at the seed's rails.
bool solve_by_rolls(const Query& query, Trace* trace, Solution* solution) {
  constexpr int kRolls = 72;
  const Goal& goal = query.goal;
  const bool fixed = goal.prefers_roll();
  const double low = goal.rolls ? goal.roll.lower : -kPi, high = goal.rolls ? goal.roll.upper : kPi;
  for (int k = 0; k < (fixed ? 1 : kRolls); ++k) {
    Candidate found[ClosedForm::kMost];
    const Goal pose = pose_at_roll(goal, fixed ? goal.wanted_roll : low + (high - low) * (k + 0.5) / kRolls);
    const int count = candidates(query, pose, query.seed, kNearLimit, found);
    for (int i = 0; i < count; ++i) {
      if (descend_to(query, found[i].readings, trace, solution)) return true;
    }
  }
  return false;
}

bool solve_once(const Query& query, Trace* trace, Solution* solution) {
  const PreparedRobot& robot = query.robot;
  const Goal& goal = query.goal;
  if (robot.options.choose != Choose::nearest && solve_for_best(query, trace, solution)) return true;
  if (goal.kind == TaskKind::pose && robot.closed && solve_by_branches(query, trace, solution)) return true;
  // Without rails an exact closed form has said all there is to say, but for configurations at the rim of what exists.
  const bool said_all = goal.kind == TaskKind::pose && robot.closed.exact() && robot.closed &&
                        robot.closed.rails() == 0 && robot.limits.passive.empty();
  const int restarts = said_all ? std::min(robot.options.max_restarts, 8) : robot.options.max_restarts;
  if (descend_from_many(query, restarts, trace, solution)) return true;
  return goal.kind == TaskKind::torch && robot.closed && solve_by_rolls(query, trace, solution);
}

/// From an answer at another roll towards the preferred one, until it goes no further.
void turn_towards_roll(const Query& query, Trace* trace, Solution* solution) {
  Goal at = query.goal;
  at.rolls = true;
  const double whole = std::remainder(query.goal.wanted_roll - solution->roll, 2.0 * kPi);
  double fraction = 0.0, step = 0.5;
  for (int k = 0; k < 40 && step > 1e-9; ++k) {
    at.wanted_roll = solution->roll + std::min(step, 1.0 - fraction) * whole;
    const Query next{query.robot, at, solution->joints.data(), query.scratch};
    Trace met;
    Solution further;
    if (descend_to(next, solution->joints.data(), &met, &further)) {
      fraction += std::min(step, 1.0 - fraction);
      *solution = further;
      if (fraction >= 1.0) break;
    } else {
      step *= 0.5;
    }
    trace->iterations += met.iterations;
  }
}

/// As near to the preferred roll as can be: there, or from the answer towards it.
bool solve_at_preferred_roll(const Query& query, Trace* trace, Solution* solution) {
  Goal there = query.goal;
  there.rolls = true;
  Trace met_there;
  if (solve_once(query.with_goal(there), &met_there, solution)) return true;
  Goal anywhere = query.goal;
  anywhere.wanted_roll = std::numeric_limits<double>::quiet_NaN();
  anywhere.rolls = anywhere.roll.upper - anywhere.roll.lower < 2.0 * kPi;
  Trace met;
  if (!solve_once(query.with_goal(anywhere), &met, solution)) {
    trace->nearest = met.nearest;
    trace->colliding = met.colliding;
    return false;
  }
  turn_towards_roll(query, trace, solution);
  return true;
}

/// The goal moved along its direction of retreat. The configuration that collides least first: it is the one to be
/// freed.
bool free_at(const Query& query, double way, const double* seed, Solution* there) {
  Goal moved = query.goal;
  moved.position += way * query.goal.retreat;
  const Query at{query.robot, moved, seed, query.scratch};
  Trace met;
  there->retreat = way;
  return descend_to(at, seed, &met, there) || solve_once(at, &met, there);
}

/// By the least way that frees it: doubled steps until it is free, then halved ones.
bool retreat(const Query& query, const Trace& trace, Solution* solution) {
  const Goal& goal = query.goal;
  if (!(goal.longest_retreat > 0.0) || trace.colliding.joints.size() == 0) return false;
  constexpr double kFirst = 1e-3, kFine = 1e-5;  // [m]
  double blocked = 0.0, way = std::min(kFirst, goal.longest_retreat);
  Solution freed;
  while (!free_at(query, way, trace.colliding.joints.data(), &freed)) {
    if (way >= goal.longest_retreat) return false;
    blocked = way;
    way = std::min(2.0 * way, goal.longest_retreat);
  }
  while (way - blocked > kFine) {
    const double middle = 0.5 * (blocked + way);
    Solution there;
    if (free_at(query, middle, freed.joints.data(), &there)) {
      way = middle;
      freed = there;
    } else {
      blocked = middle;
    }
  }
  *solution = freed;
  solution->reason = Reason::retreated;
  return true;
}

/// Adds an answer that is not there yet.
void keep(const Solution& solution, Branches* found) {
  constexpr double kSame = 1e-5;
  for (int k = 0; k < found->count; ++k) {
    if ((found->solution[static_cast<std::size_t>(k)].joints - solution.joints).cwiseAbs().maxCoeff() < kSame) return;
  }
  if (found->count < static_cast<int>(found->solution.size()))
    found->solution[static_cast<std::size_t>(found->count++)] = solution;
}

}  // namespace

Solution solve(const Query& query, bool by_way, Trace* trace) {
  Solution solution;
  const bool reached = query.goal.prefers_roll() ? solve_at_preferred_roll(query, trace, &solution)
                                                 : solve_once(query, trace, &solution);
  if (!reached && !retreat(query, *trace, &solution)) explain(query, trace, &solution);
  solution.iterations = trace->iterations;
  if (by_way) settle_directions(query, trace, &solution);
  return solution;
}

Solution follow(const Query& query, bool by_way) {
  Trace trace;
  Solution solution;
  if (!descend_to(query, query.seed, &trace, &solution)) explain(query, &trace, &solution);
  solution.iterations = trace.iterations;
  if (by_way) settle_directions(query, &trace, &solution);
  return solution;
}

void find_branches(const Query& query, bool by_way, Branches* found) {
  const PreparedRobot& robot = query.robot;
  found->count = found->beyond_limits = 0;
  Trace trace;
  const auto settle_and_keep = [&](Solution& solution) {
    if (query.scratch && by_way) {
      settle_directions(query, &trace, &solution);
      std::fill(query.scratch->direction.begin(), query.scratch->direction.end(), 0.0);
      if (!solution.reached()) return;
    }
    keep(solution, found);
  };
  if (robot.closed) {
    Candidate all[ClosedForm::kMost];
    const int count = candidates(query, query.goal, query.seed, std::numeric_limits<double>::infinity(), all);
    for (int k = 0; k < count; ++k) {
      if (all[k].excess > robot.seed_slack()) {
        ++found->beyond_limits;
        continue;
      }
      Solution solution;
      if (polish(query, all[k], &trace, &solution)) settle_and_keep(solution);
    }
    return;
  }
  double from[kMaxDrivenJoints];
  for (int k = 0; k < 8 * std::max(1, robot.options.max_restarts); ++k) {
    restart_seed(robot, k, query.seed, from);
    Solution solution;
    if (descend_to(query, from, &trace, &solution)) settle_and_keep(solution);
  }
}

void settle_directions(const Query& query, Trace* trace, Solution* solution) {
  std::vector<double>& direction = query.scratch->direction;
  for (int round = 0; round < 4 && solution->reached(); ++round) {
    bool same = true;
    for (int j = 0; j < query.robot.driven(); ++j) {
      const double way = solution->joints[j] - query.seed[j];
      const double now = way > 0.0 ? 1.0 : way < 0.0 ? -1.0 : 0.0;
      same = same && direction[static_cast<std::size_t>(j)] == now;
      direction[static_cast<std::size_t>(j)] = now;
    }
    if (same) return;
    const Joints here = solution->joints;
    if (!descend_to(query, here.data(), trace, solution)) explain(query, trace, solution);
  }
}

}  // namespace truing::inverse_kinematics
