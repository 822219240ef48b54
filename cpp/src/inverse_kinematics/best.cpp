// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// A grid over what a task leaves free, then a pattern search from its local maxima (Hooke and Jeeves 1961), first over
// the closed form's branches, then on the robot as it is.

#include "inverse_kinematics/best.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "inverse_kinematics/candidates.hpp"
#include "inverse_kinematics/singularity.hpp"
#include "math/constants.hpp"

namespace truing::inverse_kinematics {
namespace {

constexpr double kNone = -std::numeric_limits<double>::infinity();
constexpr int kMostFree = 4;

/// What a task leaves free, and between which bounds: rails before the arm, then the roll of a torch.
struct Box {
  double low[kMostFree] = {}, high[kMostFree] = {};
  int count = 0;
  bool rolls = false;
};

/// A place within a box, and the value of what is to be largest there.
struct Place {
  double x[kMostFree] = {};
  double value = kNone;
};

// ---- How good joints are --------------------------------------------------------------------------------------------

/// What is left of a joint's range on its nearer side, as a fraction of it.
double limit_fraction(const Limits& limits, int j, double q) {
  return std::min(q - limits.lower[j], limits.upper[j] - q) / (limits.upper[j] - limits.lower[j]);
}

bool has_both_limits(const Limits& limits, int j) {
  return std::isfinite(limits.lower[j]) && std::isfinite(limits.upper[j]);
}

/// Driven joint with the least fraction of its range left; -1: none has both limits.
int nearest_to_limit(const PreparedRobot& robot, const double* q) {
  const Limits& limits = robot.limits;
  int nearest = -1;
  for (int j = 0; j < robot.driven(); ++j) {
    if (!has_both_limits(limits, j)) continue;
    if (nearest < 0 || limit_fraction(limits, j, q[j]) < limit_fraction(limits, nearest, q[nearest])) nearest = j;
  }
  return nearest;
}

double rail_travel(const PreparedRobot& robot, const double* from, const double* to) {
  double way = 0.0;
  for (int j = 0; j < robot.driven(); ++j) {
    if (!robot.arm.turns(j)) way += (to[j] - from[j]) * (to[j] - from[j]);
  }
  return std::sqrt(way);
}

/// Yoshikawa 1985, eq. (6); with fewer than six joints of what they span.
double manipulability(const PreparedRobot& robot, const double* q, EffectScratch* scratch) {
  Columns columns;
  robot.arm.tip(q, scratch, &columns);
  TipJacobian J(6, 0);
  for (int j = 0; j < robot.driven(); ++j) {
    if (!robot.arm.turns(j)) continue;
    J.conservativeResize(6, J.cols() + 1);
    J.col(J.cols() - 1) << columns.linear[j] / robot.scales.length, columns.angular[j];
  }
  const double squared = J.cols() < 6 ? JointMatrix(J.transpose().lazyProduct(J)).determinant()
                                      : Matrix6d(J.lazyProduct(J.transpose())).determinant();
  return std::sqrt(std::max(0.0, squared));
}

/// By InverseOptions::choose: more is better.
double merit(const Query& query, const double* q) {
  const PreparedRobot& robot = query.robot;
  switch (robot.options.choose) {
    case Choose::nearest:
      return -distance2(robot, q, query.seed);
    case Choose::rail_travel:
      return -rail_travel(robot, query.seed, q);
    case Choose::limits_margin: {
      const int j = nearest_to_limit(robot, q);
      return j < 0 ? 1.0 : limit_fraction(robot.limits, j, q[j]);
    }
    case Choose::manipulability:
      return manipulability(robot, q, query.scratch);
  }
  return kNone;
}

// ---- The largest value in a box -------------------------------------------------------------------------------------

constexpr int kMaxima = 2;

/// The local maxima of a grid with the largest values, no two of them less than a cell and a half apart.
template <typename Value>
void find_maxima(const Value& value_at, const Box& box, int cells, Place* maxima) {
  int places = 1;
  for (int k = 0; k < box.count; ++k) places *= cells;
  for (int place = 0; place < places; ++place) {
    Place here;
    for (int k = 0, rest = place; k < box.count; ++k, rest /= cells)
      here.x[k] = box.low[k] + (box.high[k] - box.low[k]) * (rest % cells + 0.5) / cells;
    here.value = value_at(here.x);
    if (here.value == kNone) continue;
    const auto same_maximum = [&](const Place& other) {
      if (other.value == kNone) return false;
      for (int k = 0; k < box.count; ++k) {
        if (std::abs(here.x[k] - other.x[k]) > 1.5 * (box.high[k] - box.low[k]) / cells) return false;
      }
      return true;
    };
    Place* const end = maxima + kMaxima;
    Place* slot = std::find_if(maxima, end, same_maximum);
    if (slot == end)
      slot = std::min_element(maxima, end, [](const Place& a, const Place& b) { return a.value < b.value; });
    if (here.value > slot->value) *slot = here;
  }
}

/// Uphill along one variable after the other, then along two at once where that leads nowhere (ridges), then in steps
/// half as long.
template <typename Value>
Place pattern_search(const Value& value_at, const Box& box, Place at, const double* first_step, int halvings) {
  double step[kMostFree];
  std::copy(first_step, first_step + kMostFree, step);
  const auto try_step = [&](int a, double along_a, int b, double along_b) {
    Place next = at;
    next.x[a] = std::clamp(at.x[a] + along_a * step[a], box.low[a], box.high[a]);
    if (b != a) next.x[b] = std::clamp(at.x[b] + along_b * step[b], box.low[b], box.high[b]);
    if (next.x[a] == at.x[a] && next.x[b] == at.x[b]) return false;
    next.value = value_at(next.x);
    if (next.value <= at.value) return false;
    at = next;
    return true;
  };
  const auto along_axes = [&] {
    bool better = false;
    for (int k = 0; k < box.count; ++k) better = try_step(k, 1.0, k, 0.0) || try_step(k, -1.0, k, 0.0) || better;
    return better;
  };
  const auto across = [&] {
    for (int a = 0; a < box.count; ++a) {
      for (int b = a + 1; b < box.count; ++b) {
        for (const double x : {1.0, -1.0}) {
          for (const double y : {1.0, -1.0}) {
            if (try_step(a, x, b, y)) return true;
          }
        }
      }
    }
    return false;
  };
  constexpr int kMostRounds = 60;
  for (int round = 0; halvings > 0 && round < kMostRounds; ++round) {
    if (along_axes() || across()) continue;
    --halvings;
    for (double& s : step) s *= 0.5;
  }
  return at;
}

// ---- What is free, and what the arm can do there --------------------------------------------------------------------

/// Rails, only as far as the arm can reach from them, then the roll of a torch. False: there is no place at all.
bool find_free(const PreparedRobot& robot, const Goal& goal, Box* free) {
  const ClosedForm& closed = robot.closed;
  for (int k = 0; k < closed.rails(); ++k) {
    double low = 0.0, high = 0.0;
    closed.rail_range(k, {goal.rotation, goal.position}, goal.kind == TaskKind::pose, &low, &high);
    low = std::max(low, robot.limits.lower[k]);
    high = std::min(high, robot.limits.upper[k]);
    if (!(low <= high)) return false;
    free->low[k] = low;
    free->high[k] = high;
  }
  free->count = closed.rails();
  free->rolls = goal.kind == TaskKind::torch && !goal.prefers_roll();
  if (!free->rolls) return true;
  free->low[free->count] = goal.rolls ? goal.roll.lower : -kPi;
  free->high[free->count++] = goal.rolls ? goal.roll.upper : kPi;
  return true;
}

/// In each direction: as many as there is time for.
int grid_cells(const Box& free) {
  constexpr int kCells[kMostFree + 1] = {1, 40, 9, 5, 4};
  constexpr double kFine = 0.1;  // one rail by itself [m]
  if (free.count != 1 || free.rolls) return kCells[free.count];
  return std::clamp(static_cast<int>((free.high[0] - free.low[0]) / kFine) + 1, 16, 64);
}

/// Where the turns of joints are taken nearest to: the middle of their ranges where limits are asked about.
Joints seed_of_turns(const PreparedRobot& robot, const double* seed) {
  const Limits& limits = robot.limits;
  const bool middle = robot.options.choose == Choose::limits_margin;
  Joints out(robot.driven());
  for (int j = 0; j < robot.driven(); ++j)
    out[j] = middle && has_both_limits(limits, j) ? 0.5 * (limits.lower[j] + limits.upper[j]) : seed[j];
  return out;
}

/// Merit of the best branch at one place, limits and collision looked at; `turns`: its seed is where the turns of
/// joints are taken nearest to.
double best_branch(const Query& asked, const Query& turns, const Box& free, const double* x, Candidate* best) {
  const Goal& goal = turns.goal;
  const Goal pose = free.rolls ? pose_at_roll(goal, x[free.count - 1]) : goal;
  Candidate found[ClosedForm::kMost];
  const int count = candidates(turns, pose, x, turns.robot.seed_slack(), found);
  double most = kNone;
  for (int k = 0; k < count; ++k) {
    const double value = merit(asked, found[k].readings);
    if (value <= most) continue;
    if (collides(turns.robot, found[k].readings)) continue;
    most = value;
    *best = found[k];
  }
  return most;
}

/// The same on the robot as it is: the best of its own answers there.
double best_answer(const Query& asked, const Query& turns, const double* x, Trace* trace, Solution* best) {
  Candidate found[ClosedForm::kMost];
  const int count = candidates(turns, turns.goal, x, kNearLimit, found);
  double most = kNone;
  for (int k = 0; k < count; ++k) {
    constexpr double kMayChange = 0.05;  // a merit, by calibration
    if (merit(asked, found[k].readings) <= most - kMayChange * (1.0 + std::abs(most))) continue;
    Trace met;
    Solution there;
    const bool good = polish(turns.from(found[k].readings), found[k], &met, &there);
    trace->iterations += met.iterations;
    if (!good) {
      if (met.colliding.joints.size() > 0) trace->colliding = met.colliding;
      continue;
    }
    const double value = merit(asked, there.joints.data());
    if (value <= most) continue;
    most = value;
    *best = there;
  }
  return most;
}

// ---- The search -----------------------------------------------------------------------------------------------------

/// Where pattern searches begin: local maxima of the grid, and for the least way of the rails where they are now.
struct Starts {
  Place place[kMaxima + 1];
  double step[kMostFree] = {};
};

/// The largest value that was found, and the start that the search came from.
struct Found {
  Place maximum, start;
};

template <typename Value>
Starts find_starts(const Value& value_at, const Query& asked, const Box& free) {
  const int cells = grid_cells(free);
  Starts starts;
  find_maxima(value_at, free, cells, starts.place);
  if (asked.robot.options.choose == Choose::rail_travel) {
    Place& now = starts.place[kMaxima];
    for (int k = 0; k < asked.robot.closed.rails(); ++k)
      now.x[k] = std::clamp(asked.seed[k], free.low[k], free.high[k]);
    now.value = value_at(now.x);
  }
  for (int k = 0; k < free.count; ++k) starts.step[k] = 0.5 * (free.high[k] - free.low[k]) / cells;
  return starts;
}

template <typename Value>
Found search_from(const Value& value_at, const Box& free, const Starts& starts) {
  Found found;
  for (const Place& start : starts.place) {
    if (start.value == kNone) continue;
    const Place maximum = pattern_search(value_at, free, start, starts.step, 8);
    if (maximum.value > found.maximum.value) found = {maximum, start};
  }
  return found;
}

/// A start on the robot as it is. It may lie beyond where its branch ends there: then a cell aside, then another start.
template <typename Value>
Place start_on_robot(const Value& answer_at, const Box& free, const Starts& starts, Place start) {
  constexpr double kMuch = 0.002;  // less than the closed form says
  const double expected = start.value;
  start.value = answer_at(start.x);
  if (start.value < expected - kMuch * (1.0 + std::abs(expected))) {
    const Place missed = start;
    for (int k = 0; k < free.count; ++k) {
      for (const double way : {2.0, -2.0}) {
        Place aside = missed;
        aside.x[k] = std::clamp(missed.x[k] + way * starts.step[k], free.low[k], free.high[k]);
        aside.value = answer_at(aside.x);
        if (aside.value > start.value) start = aside;
      }
    }
  }
  for (const Place& other : starts.place) {
    if (start.value > kNone || other.value == kNone) continue;
    start = other;
    start.value = answer_at(start.x);
  }
  return start;
}

/// A branch that ends just at the maximum for the closed form may end short of it for the robot: from the start as near
/// to the maximum as it lasts, by bisection.
template <typename Value>
Place furthest_that_lasts(const Value& answer_at, const Box& free, const Place& start, const Place& maximum) {
  Place inside = start;
  for (double fraction = 0.5, half = 0.25; maximum.value < inside.value && half > 1e-3; half *= 0.5) {
    Place there;
    for (int k = 0; k < free.count; ++k) there.x[k] = start.x[k] + fraction * (maximum.x[k] - start.x[k]);
    there.value = answer_at(there.x);
    const bool lasts = there.value >= inside.value;
    if (lasts) inside = there;
    fraction += lasts ? half : -half;
  }
  return inside;
}

/// Towards what is better, as far as the task lets the joints follow: a joint is moved, and a descent brings the tip
/// back by the least motion of all, limits kept.
void pull(const Query& query, Trace* trace, Solution* solution) {
  const PreparedRobot& robot = query.robot;
  const Choose choose = robot.options.choose;
  if (choose != Choose::rail_travel && choose != Choose::limits_margin) return;
  double fraction = 0.5, most = merit(query, solution->joints.data());
  constexpr int kMostRounds = 30;
  for (int round = 0; round < kMostRounds && fraction > 1e-3; ++round) {
    Joints from = solution->joints;
    if (choose == Choose::rail_travel) {
      for (int j = 0; j < robot.closed.rails(); ++j) from[j] += fraction * (query.seed[j] - from[j]);
    } else {
      const int j = nearest_to_limit(robot, from.data());
      if (j < 0) return;
      from[j] += 0.2 * fraction * (0.5 * (robot.limits.lower[j] + robot.limits.upper[j]) - from[j]);
    }
    Solution there;
    if (descend_to(query, from.data(), trace, &there) && merit(query, there.joints.data()) > most + 1e-12) {
      there.branch = solution->branch;
      *solution = there;
      most = merit(query, there.joints.data());
      fraction = std::min(1.0, 2.0 * fraction);
    } else {
      fraction *= 0.4;
    }
  }
}

/// What the closed form found, on the robot as it is.
bool put_on_robot(const Query& query, const Query& turns, const Box& free, const Starts& starts, const Found& found,
                  Trace* trace, Solution* solution) {
  Trace met;
  Solution answer;
  const auto answer_at = [&](const double* x) { return best_answer(query, turns, x, &met, &answer); };
  Place best = found.maximum;
  best.value = answer_at(best.x);
  if (!query.robot.closed.exact() && free.count > 0) {
    const Place start = start_on_robot(answer_at, free, starts, found.start);
    const Place inside = furthest_that_lasts(answer_at, free, start, best);
    if (inside.value > best.value) best = inside;
    if (best.value > kNone) answer_at(best.x);
  }
  if (best.value > kNone && free.count > 0) pull(query, trace, &answer);
  trace->iterations += met.iterations;
  if (best.value == kNone) {
    if (trace->colliding.joints.size() == 0) trace->colliding = met.colliding;
    return false;
  }
  *solution = answer;
  return true;
}

/// Over what is free, by the closed form's branches.
bool best_of_what_is_free(const Query& query, Trace* trace, Solution* solution) {
  const PreparedRobot& robot = query.robot;
  Box free;
  if (!robot.closed || query.goal.kind == TaskKind::point || !find_free(robot, query.goal, &free)) return false;
  const Joints seed = seed_of_turns(robot, query.seed);
  const Query turns = query.from(seed.data());
  Candidate candidate{};
  const auto branch_at = [&](const double* x) { return best_branch(query, turns, free, x, &candidate); };
  const Starts starts = find_starts(branch_at, query, free);
  const Found found = search_from(branch_at, free, starts);
  if (found.maximum.value == kNone) return false;
  if (query.goal.kind == TaskKind::pose) return put_on_robot(query, turns, free, starts, found, trace, solution);
  branch_at(found.maximum.x);  // the roll stays free on the robot as it is
  return descend_to(query, candidate.readings, trace, solution);
}

/// Of what descents from many seeds reach.
bool best_of_many(const Query& query, Trace* trace, Solution* solution) {
  constexpr int kSeeds = 48;
  double most = kNone;
  const auto look = [&](const double* from) {
    Solution there;
    if (!descend_to(query, from, trace, &there)) return;
    const double value = merit(query, there.joints.data());
    if (value <= most) return;
    most = value;
    *solution = there;
  };
  look(query.seed);
  double from[kMaxDrivenJoints];
  for (int k = 0; k < kSeeds; ++k) {
    restart_seed(query.robot, k, query.seed, from);
    look(from);
  }
  return most > kNone;
}

}  // namespace

bool solve_for_best(const Query& query, Trace* trace, Solution* solution) {
  return best_of_what_is_free(query, trace, solution) || best_of_many(query, trace, solution);
}

}  // namespace truing::inverse_kinematics
