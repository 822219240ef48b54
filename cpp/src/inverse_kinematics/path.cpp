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
constexpr int kFollowed = 24;     // chains that are followed from one target to the next
constexpr double kApart = 0.05;   // chains that lie nearer to a cheaper one are not followed, in radians' worth
constexpr int kPatience = 10;     // times the smoothing, where a step is still too long
constexpr double kGapCost = 1e6;  // so that the fewest gaps come first

/// How chains are searched for.
struct Effort {
  double slack;   ///< steps of a chain may be so many times as long as what is allowed
  int times = 1;  ///< so many times the usual seeds and followed chains
};

/// A way to be at one target, and the cheapest chain that ends there.
struct Node {
  double readings[kMaxDrivenJoints];
  double cost = kNoWay;
  std::int32_t before = -1;  ///< node of the target before
  bool after_gap = false;    ///< no step that is allowed leads here from there
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
void sample_by_descents(const Query& query, int seeds, Layer* nodes) {
  const int n = query.robot.driven();
  double from[kMaxDrivenJoints];
  std::copy(query.seed, query.seed + n, from);
  Trace trace;
  for (int k = 0; k < seeds; ++k) {
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
void sample(const Query& query, const PathOptions& how, const Effort& effort, Layer* nodes) {
  const PreparedRobot& robot = query.robot;
  const Goal& goal = query.goal;
  nodes->clear();
  if (!robot.closed || goal.kind == TaskKind::point || !robot.limits.passive.empty()) {
    sample_by_descents(query, effort.times * kSearchSeeds, nodes);
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

/// Nothing is free, and the closed form that says all ways is the robot's own.
bool all_sampled(const PreparedRobot& robot, const Goal& goal) {
  return robot.closed && robot.closed.exact() && robot.closed.rails() == 0 && goal.kind == TaskKind::pose &&
         robot.limits.passive.empty();
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
    if (readings[j] > robot.limits.upper[j] + kNearLimit) readings[j] -= robot.turn[j];
    if (readings[j] < robot.limits.lower[j] - kNearLimit) readings[j] += robot.turn[j];
  }
}

/// What a chain has passed through since its last gap. Whole turns are chosen once that is known: a chain that begins
/// at the turn nearest to the seed may run into a limit that it would not have met a turn further back.
struct Stretch {
  double low[kMaxDrivenJoints], high[kMaxDrivenJoints];

  void begin(int driven, const double* readings) {
    std::copy(readings, readings + driven, low);
    std::copy(readings, readings + driven, high);
  }
  void add(int driven, const double* readings) {
    for (int j = 0; j < driven; ++j) {
      low[j] = std::min(low[j], readings[j]);
      high[j] = std::max(high[j], readings[j]);
    }
  }
  /// So many turns of a joint, as near to `wanted` as can be, bring all of it within limits; false: none do.
  bool turns(const PreparedRobot& robot, int joint, double wanted, double* count) const {
    const double turn = robot.turn[joint], slack = robot.seed_slack();
    *count = 0.0;
    if (turn == 0.0) return true;
    const double least = std::ceil((robot.limits.lower[joint] - slack - low[joint]) / turn);
    const double most = std::floor((robot.limits.upper[joint] + slack - high[joint]) / turn);
    *count = std::max(least, std::min(wanted, most));
    return least <= most;
  }
};

/// What it costs to begin a stretch whole turns away from the turns nearest to where the chain comes from; infinite
/// when no turns bring it within limits.
double cost_of_turns(const PreparedRobot& robot, const Stretch& stretch) {
  double sum = 0.0;
  for (int j = 0; j < robot.driven(); ++j) {
    double count = 0.0;
    if (!stretch.turns(robot, j, 0.0, &count)) return kNoWay;
    sum += std::abs(count) * robot.turn[j] * robot.turn[j];
  }
  return sum;
}

/// The chains that end at one target.
struct Ends {
  const Layer* layer = nullptr;
  std::vector<Stretch> stretches;  ///< of each node
  std::vector<std::size_t> cheapest_first;
};

/// The cheapest way to a node from those of the layer before, looked at in order of their cost.
void connect(const PreparedRobot& robot, const PathOptions& how, double slack, const Ends& ends, Node* node,
             Stretch* stretch) {
  const int n = robot.driven();
  const Node found = *node;
  for (const std::size_t i : ends.cheapest_first) {
    const Node& from = (*ends.layer)[i];
    if (from.cost >= node->cost) break;
    Node here = found;
    bring_near(robot, from.readings, here.readings);
    Stretch gone = ends.stretches[i];
    double cost = step_cost(robot, from.readings, here.readings, how, slack);
    if (cost != kNoWay) {
      gone.add(n, here.readings);
      cost += cost_of_turns(robot, gone) - cost_of_turns(robot, ends.stretches[i]);
    }
    if (cost == kNoWay) {
      here = found;
      here.after_gap = true;
      turn_near(robot, from.readings, here.readings);
      gone.begin(n, here.readings);
      cost = kGapCost + distance2(robot, here.readings, from.readings);
    }
    if (from.cost + cost >= node->cost) continue;
    *node = here;
    node->cost = from.cost + cost;
    node->before = static_cast<std::int32_t>(i);
    *stretch = gone;
  }
}

/// Where chains go on to from the target before: descents from the cheapest, no two of which lie close together.
/// Samples are found anew at every target and may lie on no way that goes on.
void continue_chains(const Query& query, const Ends& ends, std::size_t most, Layer* nodes) {
  const PreparedRobot& robot = query.robot;
  const int n = robot.driven();
  std::vector<const double*> followed;
  Trace trace;
  for (const std::size_t i : ends.cheapest_first) {
    const double* readings = (*ends.layer)[i].readings;
    const auto near = [&](const double* other) { return distance2(robot, readings, other) < kApart * kApart; };
    if (std::any_of(followed.begin(), followed.end(), near)) continue;
    followed.push_back(readings);
    double from[kMaxDrivenJoints], middle[kMaxDrivenJoints];
    std::copy(readings, readings + n, from);
    for (int j = 0; j < n; ++j) {
      const double low = robot.limits.lower[j], high = robot.limits.upper[j];
      middle[j] = std::isfinite(low) && std::isfinite(high) ? 0.5 * (low + high) : std::clamp(from[j], low, high);
    }
    bring_near(robot, middle, from);
    Solution solution;
    if (descend_to(query, from, &trace, &solution)) add_node(n, solution.joints.data(), nodes);
    if (followed.size() == most) return;
  }
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
                   const PathOptions& how, const Effort& effort, EffectScratch* scratch,
                   const std::function<bool(std::size_t)>& progress) {
  Chains chains;
  chains.layers.resize(goals.size());
  chains.before.resize(goals.size(), 0);
  Ends ends;
  const auto most_followed = static_cast<std::size_t>(effort.times * kFollowed);
  for (std::size_t k = 0; k < goals.size(); ++k) {
    if (progress && k % 64 == 0 && !progress(k)) break;
    Layer& layer = chains.layers[k];
    const Query query{robot, goals[k], seed, scratch};
    sample(query, how, effort, &layer);
    if (chains.any && !all_sampled(robot, goals[k])) continue_chains(query, ends, most_followed, &layer);
    if (layer.empty()) continue;
    std::vector<Stretch> stretches(layer.size());
    for (std::size_t i = 0; i < layer.size(); ++i) {
      if (chains.any) {
        connect(robot, how, effort.slack, ends, &layer[i], &stretches[i]);
      } else {
        turn_near(robot, seed, layer[i].readings);
        layer[i].cost = distance2(robot, layer[i].readings, seed);
        stretches[i].begin(robot.driven(), layer[i].readings);
      }
    }
    chains.before[k] = chains.last;
    ends = {&layer, std::move(stretches), by_cost(layer)};
    chains.any = true;
    chains.last = k;
  }
  return chains;
}

/// Places of a chain, the last first, moved by the whole turns that bring each stretch between gaps within limits.
struct ChainPlace {
  std::size_t target;
  bool after_gap;
  double readings[kMaxDrivenJoints];
};

void choose_turns(const PreparedRobot& robot, std::vector<ChainPlace>* chain) {
  const int n = robot.driven();
  for (std::size_t end = chain->size(); end > 0;) {
    std::size_t begin = end - 1;  // the first of the stretch; it ends at `last`, exclusive
    std::size_t last = begin;
    Stretch stretch;
    stretch.begin(n, (*chain)[begin].readings);
    while (last > 0 && !(*chain)[last - 1].after_gap) stretch.add(n, (*chain)[--last].readings);
    for (int j = 0; j < n; ++j) {
      if (robot.turn[j] == 0.0) continue;
      const double first = (*chain)[begin].readings[j];
      const double wanted =
          end == chain->size() ? 0.0 : std::floor(((*chain)[end].readings[j] - first) / robot.turn[j] + 0.5);
      double count = 0.0;
      if (!stretch.turns(robot, j, wanted, &count)) continue;
      for (std::size_t i = last; i <= begin; ++i) (*chain)[i].readings[j] += count * robot.turn[j];
    }
    end = last;
  }
}

/// The cheapest chain, from its end back to its beginning, on the robot as it is; no joints where there are none.
std::vector<Joints> follow_back(const PreparedRobot& robot, const std::vector<Goal>& goals, const Chains& chains,
                                EffectScratch* scratch) {
  std::vector<Joints> joints(goals.size());
  if (!chains.any) return joints;
  const Layer& last = chains.layers[chains.last];
  const auto cheaper = [](const Node& a, const Node& b) { return a.cost < b.cost; };
  auto node = static_cast<std::int32_t>(std::min_element(last.begin(), last.end(), cheaper) - last.begin());
  std::vector<ChainPlace> chain;
  for (std::size_t k = chains.last; node >= 0; k = chains.before[k]) {
    const Node& here = chains.layers[k][static_cast<std::size_t>(node)];
    ChainPlace place{k, here.after_gap, {}};
    std::copy(here.readings, here.readings + robot.driven(), place.readings);
    chain.push_back(place);
    node = here.before;
  }
  choose_turns(robot, &chain);
  for (const ChainPlace& place : chain) {
    Trace trace;
    Solution solution;
    const Query query{robot, goals[place.target], place.readings, scratch};
    if (descend_to(query, place.readings, &trace, &solution)) joints[place.target] = solution.joints;
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
  const auto allowed = [&](const Joints& a, const Joints& b, const Joints& c) {
    return step_cost(robot, a.data(), b.data(), how, 1.0) != kNoWay &&
           step_cost(robot, b.data(), c.data(), how, 1.0) != kNoWay;
  };
  const auto has_long_step = [&] {
    for (std::size_t k = 0; k + 1 < joints->size(); ++k) {
      const Joints &a = (*joints)[k], &b = (*joints)[k + 1];
      if (a.size() > 0 && b.size() > 0 && step_cost(robot, a.data(), b.data(), how, 1.0) == kNoWay) return true;
    }
    return false;
  };
  const int most = kPatience * how.smoothing;
  for (int round = 0; round < how.smoothing || (round < most && has_long_step()); ++round) {
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
      if (then >= now || (allowed(before, (*joints)[k], after) && !allowed(before, moved.joints, after))) continue;
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

Path find_path_with(const Effort& effort, const PreparedRobot& robot, const std::vector<Goal>& goals,
                    const double* seed, const PathOptions& how, EffectScratch* scratch, bool by_way, bool redundant,
                    const std::function<bool(std::size_t)>& progress) {
  const Chains chains = find_chains(robot, goals, seed, how, effort, scratch, progress);
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

}  // namespace

Path find_path(const PreparedRobot& robot, const std::vector<Goal>& goals, const double* seed, const PathOptions& how,
               EffectScratch* scratch, bool by_way, const std::function<bool(std::size_t)>& progress) {
  // Samples lie apart: where something is free, a chain may step from one to the next, and smoothing makes up for it.
  const bool redundant = !goals.empty() && (goals[0].kind != TaskKind::pose || robot.driven() > 6);
  bool stopped = false;
  const auto go_on = [&](std::size_t done) { return !(stopped = progress && !progress(done)); };
  Path path = find_path_with({redundant ? 2.0 : 1.2}, robot, goals, seed, how, scratch, by_way, redundant, go_on);
  const auto too_long = [](const PathGap& gap) { return gap.joint >= 0; };
  if (stopped || goals.empty() || all_sampled(robot, goals[0]) ||
      std::none_of(path.gaps.begin(), path.gaps.end(), too_long))
    return path;
  // Smoothing could not make up for it, or the way that goes on was not among the samples.
  constexpr int kThorough = 4;
  const auto all_done = [&](std::size_t) { return go_on(goals.size()); };
  Path other = find_path_with({1.0, kThorough}, robot, goals, seed, how, scratch, by_way, redundant, all_done);
  return !stopped && other.gaps.size() < path.gaps.size() ? other : path;
}

}  // namespace truing::inverse_kinematics
