// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Dynamic programming over samples of what is free at every target, then descents on the robot as it is.

#include "inverse_kinematics/path.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "inverse_kinematics/candidates.hpp"
#include "inverse_kinematics/solve.hpp"
#include "math/constants.hpp"

namespace truing::inverse_kinematics {
namespace {

constexpr double kNoWay = std::numeric_limits<double>::infinity();
constexpr int kMostPlaces = 160;  // rolls times places of the rails
constexpr int kSearchSeeds = 24;  // of robots without closed form, for each target
constexpr double kGapCost = 1e6;  // so that the fewest gaps come first

/// A way to be at one target, and the cheapest chain that ends there.
struct Node {
  double readings[kMaxDrivenJoints];
  double cost = kNoWay;
  std::int32_t before = -1;  ///< node of the target before
};
using Layer = std::vector<Node>;

// ---- Ways to be at one target ---------------------------------------------------------------------------------------

/// Samples of what is free: `places` of them over a closed interval, its middle if there is one.
double sample_of(double low, double high, int place, int places) {
  return places == 1 ? 0.5 * (low + high) : low + (high - low) * place / (places - 1);
}

void add_node(int driven, const double* readings, Layer* nodes) {
  Node node;
  std::copy(readings, readings + driven, node.readings);
  nodes->push_back(node);
}

/// What descents from several seeds reach.
void sample_by_descents(const Query& query, Layer* nodes) {
  const int n = query.robot.driven();
  double from[kMaxDrivenJoints];
  std::copy(query.seed, query.seed + n, from);
  Trace trace;
  for (int k = 0; k < kSearchSeeds; ++k) {
    Solution solution;
    if (descend_to(query, from, &trace, &solution)) add_node(n, solution.joints.data(), nodes);
    restart_seed(query.robot, k, query.seed, from);
  }
}

/// Samples of the roll of a torch and of every rail.
struct Grid {
  int rolls = 1, rail_places = 1;
  double roll_low = 0.0, roll_high = 0.0;
  double low[3], high[3];  ///< of the rails, as far as the arm can reach from them
  int places = 1;          ///< of all rails together

  void rails_at(int place, int count, double* rails) const {
    for (int k = 0, rest = place; k < count; ++k, rest /= rail_places)
      rails[k] = sample_of(low[k], high[k], rest % rail_places, rail_places);
  }
};

/// No more ways to be at a target than the chain search has time for: what there are more of is sampled less.
void choose_counts(const PathOptions& how, bool free_roll, int rails, Grid* grid) {
  int rolls = free_roll ? how.rolls : 1, rail_places = how.rail_places;
  const auto all_places = [&] { return rolls * static_cast<int>(std::pow(rail_places, rails)); };
  while (all_places() > kMostPlaces && (rail_places > 2 || rolls > 6)) {
    if (rolls > 6 && (rolls > 2 * rail_places || rail_places <= 2))
      rolls = std::max(6, rolls - 2);
    else
      --rail_places;
  }
  grid->rolls = rolls;
  grid->rail_places = rail_places;
}

/// False: a rail has no place from which the target can be reached.
bool find_grid(const PreparedRobot& robot, const Goal& goal, const PathOptions& how, Grid* grid) {
  const ClosedForm& closed = robot.closed;
  const bool torch = goal.kind == TaskKind::torch;
  choose_counts(how, torch && !goal.prefers_roll(), closed.rails(), grid);
  // All around the last sample is one before the first.
  grid->roll_low = goal.rolls ? goal.roll.lower : -kPi;
  grid->roll_high = goal.rolls ? goal.roll.upper : kPi - 2.0 * kPi / grid->rolls;
  for (int k = 0; k < closed.rails(); ++k) {
    closed.rail_range(k, {goal.rotation, goal.position}, !torch, &grid->low[k], &grid->high[k]);
    grid->low[k] = std::max(grid->low[k], robot.limits.lower[k]);
    grid->high[k] = std::min(grid->high[k], robot.limits.upper[k]);
    if (grid->low[k] > grid->high[k]) return false;
    grid->places *= grid->rail_places;
  }
  return true;
}

/// The pose that a sample of roll makes of the goal.
Goal pose_of_sample(const Goal& goal, const Grid& grid, int roll) {
  if (goal.kind != TaskKind::torch) return goal;
  return pose_at_roll(
      goal, goal.prefers_roll() ? goal.wanted_roll : sample_of(grid.roll_low, grid.roll_high, roll, grid.rolls));
}

/// All branches over rolls and rails. They are those of the closed form: near enough to the robot's own to choose
/// among.
void sample(const Query& query, const PathOptions& how, Layer* nodes) {
  const PreparedRobot& robot = query.robot;
  const Goal& goal = query.goal;
  nodes->clear();
  if (!robot.closed || goal.kind == TaskKind::point || !robot.limits.passive.empty()) {
    sample_by_descents(query, nodes);
    return;
  }
  Grid grid;
  if (!find_grid(robot, goal, how, &grid)) return;
  for (int place = 0; place < grid.places; ++place) {
    double rails[3] = {0.0, 0.0, 0.0};
    grid.rails_at(place, robot.closed.rails(), rails);
    for (int roll = 0; roll < grid.rolls; ++roll) {
      Candidate found[ClosedForm::kMost];
      const int count = candidates(query, pose_of_sample(goal, grid, roll), rails, robot.seed_slack(), found);
      for (int i = 0; i < count; ++i) {
        if (!collides(robot, found[i].readings)) add_node(robot.driven(), found[i].readings, nodes);
      }
    }
  }
}

// ---- The cheapest chain ---------------------------------------------------------------------------------------------

double longest_step(const PreparedRobot& robot, const PathOptions& how, int joint) {
  return robot.arm.turns(joint) ? how.longest_turn : how.longest_slide;
}

/// Squared length of a step in radians' worth; infinite when a joint goes further than `slack` times what is allowed.
double step_cost(const PreparedRobot& robot, const double* from, const double* to, const PathOptions& how,
                 double slack) {
  double sum = 0.0;
  for (int j = 0; j < robot.driven(); ++j) {
    const double way = std::abs(to[j] - from[j]);
    if (way > slack * longest_step(robot, how, j)) return kNoWay;
    const double scaled = way / robot.scales.joint[j];
    sum += scaled * scaled;
  }
  return sum;
}

/// The turns nearest to where the chain comes from, within limits.
void turn_near(const PreparedRobot& robot, const double* from, double* readings) {
  bring_near(robot, from, readings);
  for (int j = 0; j < robot.driven(); ++j) {
    if (readings[j] > robot.limits.upper[j] + kNearLimit) readings[j] -= whole_turn(robot, j);
    if (readings[j] < robot.limits.lower[j] - kNearLimit) readings[j] += whole_turn(robot, j);
  }
}

/// The cheapest way to a node from those of the layer before, looked at in order of their cost.
void connect(const PreparedRobot& robot, const PathOptions& how, double slack, const Layer& last,
             const std::vector<std::size_t>& cheapest_first, Node* node) {
  const int n = robot.driven();
  double best_readings[kMaxDrivenJoints];
  std::copy(node->readings, node->readings + n, best_readings);
  for (const std::size_t i : cheapest_first) {
    const Node& from = last[i];
    if (from.cost >= node->cost) break;
    double readings[kMaxDrivenJoints];
    std::copy(node->readings, node->readings + n, readings);
    turn_near(robot, from.readings, readings);
    double cost = step_cost(robot, from.readings, readings, how, slack);
    if (cost == kNoWay) cost = kGapCost + distance2(robot, readings, from.readings);
    if (from.cost + cost >= node->cost) continue;
    node->cost = from.cost + cost;
    node->before = static_cast<std::int32_t>(i);
    std::copy(readings, readings + n, best_readings);
  }
  std::copy(best_readings, best_readings + n, node->readings);
}

std::vector<std::size_t> by_cost(const Layer& layer) {
  std::vector<std::size_t> order(layer.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return layer[a].cost < layer[b].cost; });
  return order;
}

/// Ways to be at every target, each with the cheapest chain to it. Targets that have none are passed over.
struct Chains {
  std::vector<Layer> layers;
  std::vector<std::size_t> before;  ///< layer that a layer's chains come from
  bool any = false;
  std::size_t last = 0;  ///< the last layer that has ways
};

Chains find_chains(const PreparedRobot& robot, const std::vector<Goal>& goals, const double* seed,
                   const PathOptions& how, double slack, EffectScratch* scratch,
                   const std::function<bool(std::size_t)>& progress) {
  Chains chains;
  chains.layers.resize(goals.size());
  chains.before.resize(goals.size(), 0);
  std::vector<std::size_t> cheapest_first;
  for (std::size_t k = 0; k < goals.size(); ++k) {
    if (progress && k % 64 == 0 && !progress(k)) break;
    Layer& layer = chains.layers[k];
    sample({robot, goals[k], seed, scratch}, how, &layer);
    if (layer.empty()) continue;
    for (Node& node : layer) {
      if (chains.any)
        connect(robot, how, slack, chains.layers[chains.last], cheapest_first, &node);
      else
        node.cost = distance2(robot, node.readings, seed);
    }
    chains.before[k] = chains.last;
    cheapest_first = by_cost(layer);
    chains.any = true;
    chains.last = k;
  }
  return chains;
}

/// The cheapest chain, from its end back to its beginning, on the robot as it is; no joints where there are none.
std::vector<Joints> follow_back(const PreparedRobot& robot, const std::vector<Goal>& goals, const Chains& chains,
                                EffectScratch* scratch) {
  std::vector<Joints> joints(goals.size());
  if (!chains.any) return joints;
  const Layer& last = chains.layers[chains.last];
  std::int32_t node = 0;
  for (std::size_t i = 1; i < last.size(); ++i) {
    if (last[i].cost < last[static_cast<std::size_t>(node)].cost) node = static_cast<std::int32_t>(i);
  }
  for (std::size_t k = chains.last; node >= 0;) {
    const Node& here = chains.layers[k][static_cast<std::size_t>(node)];
    Trace trace;
    Solution solution;
    if (descend_to({robot, goals[k], here.readings, scratch}, here.readings, &trace, &solution))
      joints[k] = solution.joints;
    node = here.before;
    k = chains.before[k];
  }
  return joints;
}

// ---- On the robot as it is ------------------------------------------------------------------------------------------

/// Every target but the ends towards the middle of its neighbours, as far as its task leaves it free (Gauss-Seidel on
/// the sum of the squared steps).
void even_out(const PreparedRobot& robot, const std::vector<Goal>& goals, const PathOptions& how,
              EffectScratch* scratch, std::vector<Joints>* joints) {
  const auto cost = [&](const Joints& a, const Joints& b, const Joints& c) {
    return step_cost(robot, a.data(), b.data(), how, kNoWay) + step_cost(robot, b.data(), c.data(), how, kNoWay);
  };
  for (int round = 0; round < how.smoothing; ++round) {
    double gain = 0.0;
    for (std::size_t k = 1; k + 1 < joints->size(); ++k) {
      const Joints &before = (*joints)[k - 1], &after = (*joints)[k + 1];
      if (before.size() == 0 || after.size() == 0 || (*joints)[k].size() == 0) continue;
      const Joints middle = 0.5 * (before + after);
      const double now = cost(before, (*joints)[k], after);
      Trace trace;
      Solution moved;
      if (!descend_to({robot, goals[k], middle.data(), scratch}, middle.data(), &trace, &moved)) continue;
      const double then = cost(before, moved.joints, after);
      if (then >= now) continue;
      gain += now - then;
      (*joints)[k] = moved.joints;
    }
    if (gain < 1e-9) break;
  }
}

/// The answer at one target: the chain's joints, or where there are none what a solve from the target before finds.
/// `here`: the chain's joints, set to those of the answer.
Solution answer_at(const PreparedRobot& robot, const Goal& goal, const double* before, EffectScratch* scratch,
                   bool by_way, Joints* here) {
  const Joints from = here->size() > 0 ? *here : Joints(Eigen::Map<const Eigen::VectorXd>(before, robot.driven()));
  const Query query{robot, goal, from.data(), scratch};
  Trace trace;
  Solution solution;
  if (here->size() == 0 || !check(query, from.data(), &trace, &solution)) {
    solution = solve(query, false, &trace);
    if (solution.reached()) *here = solution.joints;
  }
  if (by_way && here->size() > 0) {  // the play of joints, by the way that the path comes
    Trace along;
    settle_directions({robot, goal, before, scratch}, &along, &solution);
    *here = solution.joints;
  }
  return solution;
}

/// The step from one target to the next: a gap, or counted among the longest ones.
void judge_step(const PreparedRobot& robot, const PathOptions& how, std::size_t from, const Joints& step, Path* path) {
  PathGap worst{from, -1, 0.0};
  double worst_fraction = 1.0;
  for (int j = 0; j < robot.driven(); ++j) {
    const double fraction = step[j] / longest_step(robot, how, j);
    if (fraction <= worst_fraction) continue;
    worst_fraction = fraction;
    worst.joint = j;
    worst.step = step[j];
  }
  if (worst.joint >= 0) {
    path->gaps.push_back(worst);
    return;
  }
  for (int j = 0; j < robot.driven(); ++j) {
    double& longest = robot.arm.turns(j) ? path->longest_turn : path->longest_slide;
    longest = std::max(longest, step[j]);
  }
}

}  // namespace

Path find_path(const PreparedRobot& robot, const std::vector<Goal>& goals, const double* seed, const PathOptions& how,
               EffectScratch* scratch, bool by_way, const std::function<bool(std::size_t)>& progress) {
  // Samples lie apart: where something is free, a chain may step from one to the next, and smoothing makes up for it.
  const bool redundant = !goals.empty() && (goals[0].kind != TaskKind::pose || robot.driven() > 6);
  const Chains chains = find_chains(robot, goals, seed, how, redundant ? 2.0 : 1.2, scratch, progress);
  std::vector<Joints> joints = follow_back(robot, goals, chains, scratch);
  if (redundant) even_out(robot, goals, how, scratch, &joints);

  Path out;
  out.solutions.resize(goals.size());
  for (std::size_t k = 0; k < goals.size(); ++k) {
    const double* before = k > 0 && joints[k - 1].size() > 0 ? joints[k - 1].data() : seed;
    out.solutions[k] = answer_at(robot, goals[k], before, scratch, by_way, &joints[k]);
    if (k == 0) continue;
    if (out.solutions[k].reached() && out.solutions[k - 1].reached())
      judge_step(robot, how, k - 1, (joints[k] - joints[k - 1]).cwiseAbs(), &out);
    else
      out.gaps.push_back({k - 1, -1, 0.0});
  }
  return out;
}

}  // namespace truing::inverse_kinematics
