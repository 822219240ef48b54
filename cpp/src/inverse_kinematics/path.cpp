// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Joints along a chain of targets: the cheapest chain over samples, evened out.

#include <cstdint>
#include <numeric>

#include "inverse_kinematics/reach.hpp"
#include "math/constants.hpp"

namespace truing::inverse_kinematics {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();
constexpr int kMostPlaces = 160;  // rolls times places of the rails
constexpr int kSearchSeeds = 24;  // of robots without closed form, for each target
constexpr double kGapCost = 1e6;  // so that the fewest gaps come first

/// Samples of what is free: `places` of them over a closed interval, its middle if there is one.
double sample_of(double low, double high, int place, int places) {
  return places == 1 ? 0.5 * (low + high) : low + (high - low) * place / (places - 1);
}

}  // namespace

/// A way to be at one target, and the cheapest chain that ends there.
struct Reach::Node {
  double readings[kMaxDrivenJoints];
  double cost = kNone;
  std::int32_t before = -1;  ///< node of the target before
};

/// All branches over rolls and rails. They are those of the closed form: near enough to the robot's own to choose
/// among.
void Reach::sample(const Goal& goal, const double* seed, const PathOptions& how, EffectScratch* scratch,
                   std::vector<Node>* nodes) const {
  nodes->clear();
  Search search{goal, seed, scratch};
  const auto keep = [&](const double* readings) {
    Node node;
    std::copy(readings, readings + driven(), node.readings);
    nodes->push_back(node);
  };
  if (!closed || goal.kind == TaskKind::point || !limits.passive.empty()) {
    double from[kMaxDrivenJoints];
    std::copy(seed, seed + driven(), from);
    for (int k = 0; k < kSearchSeeds; ++k) {
      Solution solution;
      if (descend_to(&search, from, &solution)) keep(solution.joints.data());
      restart_seed(k, seed, from);
    }
    return;
  }
  const bool torch = goal.kind == TaskKind::torch, rolls = torch && goal.wanted_roll != goal.wanted_roll;
  // No more ways to be at a target than the chain search has time for: what there are more of is sampled less.
  int roll_places = rolls ? how.rolls : 1, rail_places = how.rail_places;
  const auto all_places = [&] { return roll_places * static_cast<int>(std::pow(rail_places, closed.rails())); };
  while (all_places() > kMostPlaces && (rail_places > 2 || roll_places > 6)) {
    if (roll_places > 6 && (roll_places > 2 * rail_places || rail_places <= 2))
      roll_places = std::max(6, roll_places - 2);
    else
      --rail_places;
  }
  // All around the last sample is one before the first.
  const double roll_low = goal.rolls ? goal.roll.lower : -kPi,
               roll_high = goal.rolls ? goal.roll.upper : kPi - 2.0 * kPi / roll_places;
  double low[3], high[3];
  int places = 1;
  for (int k = 0; k < closed.rails(); ++k) {
    closed.rail_range(k, {goal.rotation, goal.position}, !torch, &low[k], &high[k]);
    low[k] = std::max(low[k], limits.lower[k]);
    high[k] = std::min(high[k], limits.upper[k]);
    if (low[k] > high[k]) return;
    places *= rail_places;
  }
  for (int place = 0; place < places; ++place) {
    double rails[3] = {0.0, 0.0, 0.0};
    for (int k = 0, rest = place; k < closed.rails(); ++k, rest /= rail_places)
      rails[k] = sample_of(low[k], high[k], rest % rail_places, rail_places);
    for (int roll = 0; roll < roll_places; ++roll) {
      const Goal pose =
          !torch ? goal
                 : pose_at_roll(goal, rolls ? sample_of(roll_low, roll_high, roll, roll_places) : goal.wanted_roll);
      Candidate found[ClosedForm::kMost];
      const int count = candidates(&search, pose, rails, closed.exact() ? kLimitRounding : kNearLimit, found);
      for (int i = 0; i < count; ++i) {
        if (!surroundings.empty() && surroundings.nearest(arm, found[i].readings).distance < 0.0) continue;
        keep(found[i].readings);
      }
    }
  }
}

/// Squared length of a step in radians' worth; infinite when a joint goes further than `slack` times what is allowed.
double Reach::step_cost(const double* from, const double* to, const PathOptions& how, double slack) const {
  double sum = 0.0;
  for (int j = 0; j < driven(); ++j) {
    const double way = std::abs(to[j] - from[j]);
    if (way > slack * (arm.turns(j) ? how.longest_turn : how.longest_slide)) return kNone;
    const double scaled = way / scales.joint[j];
    sum += scaled * scaled;
  }
  return sum;
}

/// Every target but the ends towards the middle of its neighbours, as far as its task leaves it free (Gauss-Seidel on
/// the sum of the squared steps).
void Reach::even_out(const std::vector<Goal>& goals, const PathOptions& how, EffectScratch* scratch,
                     std::vector<Joints>* joints) const {
  const auto cost = [&](const Joints& a, const Joints& b, const Joints& c) {
    return step_cost(a.data(), b.data(), how, kNone) + step_cost(b.data(), c.data(), how, kNone);
  };
  for (int round = 0; round < how.smoothing; ++round) {
    double gain = 0.0;
    for (std::size_t k = 1; k + 1 < joints->size(); ++k) {
      const Joints &before = (*joints)[k - 1], &after = (*joints)[k + 1];
      if (before.size() == 0 || after.size() == 0 || (*joints)[k].size() == 0) continue;
      const Joints middle = 0.5 * (before + after);
      const double now = cost(before, (*joints)[k], after);
      Search search{goals[k], middle.data(), scratch};
      Solution moved;
      if (!descend_to(&search, middle.data(), &moved)) continue;
      const double then = cost(before, moved.joints, after);
      if (then >= now) continue;
      gain += now - then;
      (*joints)[k] = moved.joints;
    }
    if (gain < 1e-9) break;
  }
}

Path Reach::path(const std::vector<Goal>& goals, const double* seed, const PathOptions& how, EffectScratch* scratch,
                 bool by_way, const std::function<bool(std::size_t)>& progress) const {
  // Samples lie apart: where something is free, a chain may step from one to the next, and smoothing makes up for it.
  const bool redundant = !goals.empty() && (goals[0].kind != TaskKind::pose || driven() > 6);
  const double slack = redundant ? 2.0 : 1.2;
  std::vector<std::vector<Node>> layers(goals.size());
  const std::vector<Node>* last = nullptr;
  std::size_t last_at = 0;
  std::vector<std::size_t> before_layer(goals.size(), 0), cheapest_first;
  for (std::size_t k = 0; k < goals.size(); ++k) {
    if (progress && k % 64 == 0 && !progress(k)) break;
    sample(goals[k], seed, how, scratch, &layers[k]);
    if (layers[k].empty()) continue;
    for (Node& node : layers[k]) {
      if (!last) {
        node.cost = distance2(node.readings, seed);
        continue;
      }
      double best_readings[kMaxDrivenJoints];
      std::copy(node.readings, node.readings + driven(), best_readings);
      for (const std::size_t i : cheapest_first) {
        const Node& from = (*last)[i];
        if (from.cost >= node.cost) break;
        // The turns nearest to where the chain comes from, within limits.
        double readings[kMaxDrivenJoints];
        std::copy(node.readings, node.readings + driven(), readings);
        bring_near(from.readings, readings);
        for (int j = 0; j < driven(); ++j) {
          if (readings[j] > limits.upper[j] + kNearLimit) readings[j] -= turn_of(j);
          if (readings[j] < limits.lower[j] - kNearLimit) readings[j] += turn_of(j);
        }
        double cost = step_cost(from.readings, readings, how, slack);
        if (cost == kNone) cost = kGapCost + distance2(readings, from.readings);
        if (from.cost + cost >= node.cost) continue;
        node.cost = from.cost + cost;
        node.before = static_cast<std::int32_t>(i);
        std::copy(readings, readings + driven(), best_readings);
      }
      std::copy(best_readings, best_readings + driven(), node.readings);
    }
    before_layer[k] = last_at;
    cheapest_first.resize(layers[k].size());
    std::iota(cheapest_first.begin(), cheapest_first.end(), std::size_t{0});
    std::sort(cheapest_first.begin(), cheapest_first.end(),
              [&](std::size_t a, std::size_t b) { return layers[k][a].cost < layers[k][b].cost; });
    last = &layers[k];
    last_at = k;
  }

  Path out;
  out.solutions.resize(goals.size());
  std::vector<Joints> joints(goals.size());
  if (last) {
    std::int32_t node = 0;
    for (std::size_t i = 1; i < last->size(); ++i) {
      if ((*last)[i].cost < (*last)[static_cast<std::size_t>(node)].cost) node = static_cast<std::int32_t>(i);
    }
    for (std::size_t k = last_at; node >= 0;) {
      const Node& here = layers[k][static_cast<std::size_t>(node)];
      Search search{goals[k], here.readings, scratch};
      Solution solution;
      if (descend_to(&search, here.readings, &solution)) joints[k] = solution.joints;
      node = here.before;
      k = before_layer[k];
    }
  }
  if (redundant) even_out(goals, how, scratch, &joints);

  for (std::size_t k = 0; k < goals.size(); ++k) {
    const Joints from = joints[k].size() > 0                ? joints[k]
                        : k > 0 && joints[k - 1].size() > 0 ? joints[k - 1]
                                                            : Joints(Eigen::Map<const Eigen::VectorXd>(seed, driven()));
    Search search{goals[k], from.data(), scratch};
    if (joints[k].size() == 0 || !check(&search, from.data(), &out.solutions[k])) {
      out.solutions[k] = solve(&search);
      if (out.solutions[k].reached()) joints[k] = out.solutions[k].joints;
    }
    if (by_way && joints[k].size() > 0) {  // the play of joints, by the way that the path comes
      Search along{goals[k], k > 0 && joints[k - 1].size() > 0 ? joints[k - 1].data() : seed, scratch};
      settle_directions(&along, &out.solutions[k]);
      joints[k] = out.solutions[k].joints;
    }
    if (k == 0) continue;
    if (!out.solutions[k].reached() || !out.solutions[k - 1].reached()) {
      out.gaps.push_back({k - 1, -1, 0.0});
      continue;
    }
    PathGap worst{k - 1, -1, 0.0};
    double worst_share = 1.0;
    const Joints step = (joints[k] - joints[k - 1]).cwiseAbs();
    for (int j = 0; j < driven(); ++j) {
      const double share = step[j] / (arm.turns(j) ? how.longest_turn : how.longest_slide);
      if (share <= worst_share) continue;
      worst_share = share;
      worst.joint = j;
      worst.step = step[j];
    }
    if (worst.joint >= 0) {
      out.gaps.push_back(worst);
      continue;
    }
    for (int j = 0; j < driven(); ++j) {
      double& longest = arm.turns(j) ? out.longest_turn : out.longest_slide;
      longest = std::max(longest, step[j]);
    }
  }
  return out;
}

}  // namespace truing::inverse_kinematics
