// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The best of all answers by a criterion: over the branches of the closed form, over the rails before the arm, over the
// roll of a torch.

#include <Eigen/LU>

#include "inverse_kinematics/reach.hpp"
#include "math/constants.hpp"

namespace truing::inverse_kinematics {
namespace {

constexpr double kNone = -std::numeric_limits<double>::infinity();
constexpr int kMostFree = Box::kMost;

/// A function of a few variables within a box, and where it is largest.
struct Summit {
  double x[kMostFree] = {};
  double height = kNone;
};

/// What is left of a joint's range on its nearer side, as a share of it.
double limit_share(const Limits& limits, int j, double q) {
  return std::min(q - limits.lower[j], limits.upper[j] - q) / (limits.upper[j] - limits.lower[j]);
}

constexpr int kSummits = 2;

/// The highest places of a grid that are not one hill: more than a cell and a half apart.
template <typename Height>
void find_hills(const Height& height, const Box& box, int cells, Summit* hills) {
  int places = 1;
  for (int k = 0; k < box.count; ++k) places *= cells;
  for (int place = 0; place < places; ++place) {
    Summit here;
    for (int k = 0, rest = place; k < box.count; ++k, rest /= cells)
      here.x[k] = box.low[k] + (box.high[k] - box.low[k]) * (rest % cells + 0.5) / cells;
    here.height = height(here.x);
    if (here.height == kNone) continue;
    const auto same_hill = [&](const Summit& other) {
      if (other.height == kNone) return false;
      for (int k = 0; k < box.count; ++k) {
        if (std::abs(here.x[k] - other.x[k]) > 1.5 * (box.high[k] - box.low[k]) / cells) return false;
      }
      return true;
    };
    Summit* const end = hills + kSummits;
    Summit* slot = std::find_if(hills, end, same_hill);
    if (slot == end)
      slot = std::min_element(hills, end, [](const Summit& a, const Summit& b) { return a.height < b.height; });
    if (here.height > slot->height) *slot = here;
  }
}

/// Uphill along one variable after the other, then along two at once where that leads nowhere (ridges), then in steps
/// half as long.
template <typename Height>
Summit climb(const Height& height, const Box& box, Summit at, const double* first_step, int halvings) {
  double step[kMostFree];
  std::copy(first_step, first_step + kMostFree, step);
  const auto try_step = [&](int a, double along_a, int b, double along_b) {
    Summit next = at;
    next.x[a] = std::clamp(at.x[a] + along_a * step[a], box.low[a], box.high[a]);
    if (b != a) next.x[b] = std::clamp(at.x[b] + along_b * step[b], box.low[b], box.high[b]);
    if (next.x[a] == at.x[a] && next.x[b] == at.x[b]) return false;
    next.height = height(next.x);
    if (next.height <= at.height) return false;
    at = next;
    return true;
  };
  const auto along_axes = [&] {
    bool climbed = false;
    for (int k = 0; k < box.count; ++k) climbed = try_step(k, 1.0, k, 0.0) || try_step(k, -1.0, k, 0.0) || climbed;
    return climbed;
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

}  // namespace

/// Driven joint with the least share of its range left; -1: none has both limits.
int Reach::nearest_to_limit(const double* q) const {
  int nearest = -1;
  for (int j = 0; j < driven(); ++j) {
    if (!std::isfinite(limits.lower[j]) || !std::isfinite(limits.upper[j])) continue;
    if (nearest < 0 || limit_share(limits, j, q[j]) < limit_share(limits, nearest, q[nearest])) nearest = j;
  }
  return nearest;
}

double Reach::merit(const Search& search, const double* q) const {
  switch (options.choose) {
    case Choose::nearest:
      return -distance2(q, search.seed);
    case Choose::rail_travel: {
      double way = 0.0;
      for (int j = 0; j < driven(); ++j) {
        if (!arm.turns(j)) way += (q[j] - search.seed[j]) * (q[j] - search.seed[j]);
      }
      return -std::sqrt(way);
    }
    case Choose::limits_margin: {
      const int j = nearest_to_limit(q);
      return j < 0 ? 1.0 : limit_share(limits, j, q[j]);
    }
    case Choose::manipulability: {  // Yoshikawa 1985, eq. (6); with fewer than six joints of what they span
      Columns columns;
      arm.tip(q, search.scratch, &columns);
      TipJacobian J(6, 0);
      for (int j = 0; j < driven(); ++j) {
        if (!arm.turns(j)) continue;
        J.conservativeResize(6, J.cols() + 1);
        J.col(J.cols() - 1) << columns.linear[j] / scales.length, columns.angular[j];
      }
      const double squared = J.cols() < 6 ? Gram(J.transpose().lazyProduct(J)).determinant()
                                          : Eigen::Matrix<double, 6, 6>(J.lazyProduct(J.transpose())).determinant();
      return std::sqrt(std::max(0.0, squared));
    }
  }
  return kNone;
}

/// Of what descents from many seeds reach, the best.
bool Reach::solve_for_best_of_many(Search* search, Solution* solution) const {
  constexpr int kSeeds = 48;
  double most = kNone;
  const auto look = [&](const double* from) {
    Solution there;
    if (!descend_to(search, from, &there)) return;
    const double value = merit(*search, there.joints.data());
    if (value <= most) return;
    most = value;
    *solution = there;
  };
  look(search->seed);
  double from[kMaxDrivenJoints];
  for (int k = 0; k < kSeeds; ++k) {
    restart_seed(k, search->seed, from);
    look(from);
  }
  return most > kNone;
}

/// What is free: rails, only as far as the arm can reach from them, then the roll of a torch. False: there is no place
/// at all.
bool Reach::find_free(const Goal& goal, Box* free) const {
  for (int k = 0; k < closed.rails(); ++k) {
    double low = 0.0, high = 0.0;
    closed.rail_range(k, {goal.rotation, goal.position}, goal.kind == TaskKind::pose, &low, &high);
    low = std::max(low, limits.lower[k]);
    high = std::min(high, limits.upper[k]);
    if (!(low <= high)) return false;
    free->low[k] = low;
    free->high[k] = high;
  }
  free->count = closed.rails();
  free->rolls = goal.kind == TaskKind::torch && goal.wanted_roll != goal.wanted_roll;
  if (!free->rolls) return true;
  free->low[free->count] = goal.rolls ? goal.roll.lower : -kPi;
  free->high[free->count++] = goal.rolls ? goal.roll.upper : kPi;
  return true;
}

/// The best branch at one place, limits and interference looked at; `search->seed`: where the turns of joints are taken
/// nearest to.
double Reach::best_branch(Search* search, const Search& asked, const Box& free, const double* x,
                          Candidate* best) const {
  const Goal& goal = search->goal;
  const Goal pose = free.rolls ? pose_at_roll(goal, x[free.count - 1]) : goal;
  Candidate found[ClosedForm::kMost];
  const int count = candidates(search, pose, x, closed.exact() ? kLimitRounding : kNearLimit, found);
  double most = kNone;
  for (int k = 0; k < count; ++k) {
    const double value = merit(asked, found[k].readings);
    if (value <= most) continue;
    if (!surroundings.empty() && surroundings.nearest(arm, found[k].readings).distance < 0.0) continue;
    most = value;
    *best = found[k];
  }
  return most;
}

/// The same on the robot as it is: the best of its own answers there.
double Reach::best_answer(Search* search, const Search& asked, const double* x, Solution* best) const {
  Candidate found[ClosedForm::kMost];
  const int count = candidates(search, search->goal, x, kNearLimit, found);
  double most = kNone;
  for (int k = 0; k < count; ++k) {
    constexpr double kMayChange = 0.05;  // a merit, by calibration
    if (merit(asked, found[k].readings) <= most - kMayChange * (1.0 + std::abs(most))) continue;
    Search at{search->goal, found[k].readings, search->scratch};
    Solution there;
    const bool good = polish(&at, found[k], &there);
    search->iterations += at.iterations;
    if (!good) {
      if (at.interfering.joints.size() > 0) search->interfering = at.interfering;
      continue;
    }
    const double value = merit(asked, there.joints.data());
    if (value <= most) continue;
    most = value;
    *best = there;
  }
  return most;
}

/// Towards what is better, as far as the task lets the joints follow: a joint is moved, and a descent brings the tip
/// back by the least motion of all, limits kept.
void Reach::pull(Search* search, Solution* solution) const {
  if (options.choose != Choose::rail_travel && options.choose != Choose::limits_margin) return;
  double share = 0.5, most = merit(*search, solution->joints.data());
  constexpr int kMostRounds = 30;
  for (int round = 0; round < kMostRounds && share > 1e-3; ++round) {
    Joints from = solution->joints;
    if (options.choose == Choose::rail_travel) {
      for (int j = 0; j < closed.rails(); ++j) from[j] += share * (search->seed[j] - from[j]);
    } else {
      const int j = nearest_to_limit(from.data());
      if (j < 0) return;
      from[j] += 0.2 * share * (0.5 * (limits.lower[j] + limits.upper[j]) - from[j]);
    }
    Solution there;
    if (descend_to(search, from.data(), &there) && merit(*search, there.joints.data()) > most + 1e-12) {
      there.branch = solution->branch;
      *solution = there;
      most = merit(*search, there.joints.data());
      share = std::min(1.0, 2.0 * share);
    } else {
      share *= 0.4;
    }
  }
}

/// A grid over what is free, and from its hills on by steps that get shorter (Hooke and Jeeves 1961).
bool Reach::solve_for_best(Search* search, Solution* solution) const {
  const Goal& goal = search->goal;
  Box free;
  if (!closed || goal.kind == TaskKind::point || !find_free(goal, &free)) return false;

  // The turns of joints are those in the middle of their ranges where limits are asked about.
  Joints middle(driven());
  for (int j = 0; j < driven(); ++j) {
    const bool limited = std::isfinite(limits.lower[j]) && std::isfinite(limits.upper[j]);
    middle[j] = limited && options.choose == Choose::limits_margin ? 0.5 * (limits.lower[j] + limits.upper[j])
                                                                   : search->seed[j];
  }
  Search from_middle{goal, middle.data(), search->scratch};
  Candidate candidate{};
  const auto branch_at = [&](const double* x) { return best_branch(&from_middle, *search, free, x, &candidate); };

  constexpr int kCells[kMostFree + 1] = {1, 40, 9, 5, 4};  // in each direction: as many as there is time for
  constexpr double kFine = 0.1;                            // one rail by itself [m]
  const int cells = free.count == 1 && !free.rolls
                        ? std::clamp(static_cast<int>((free.high[0] - free.low[0]) / kFine) + 1, 16, 64)
                        : kCells[free.count];
  Summit start[kSummits + 1];
  find_hills(branch_at, free, cells, start);
  // Where the rails are now: nothing is nearer.
  if (options.choose == Choose::rail_travel) {
    for (int k = 0; k < closed.rails(); ++k)
      start[kSummits].x[k] = std::clamp(search->seed[k], free.low[k], free.high[k]);
    start[kSummits].height = branch_at(start[kSummits].x);
  }
  double step[kMostFree];
  for (int k = 0; k < free.count; ++k) step[k] = 0.5 * (free.high[k] - free.low[k]) / cells;
  Summit top, foot;
  for (const Summit& hill : start) {
    if (hill.height == kNone) continue;
    const Summit climbed = climb(branch_at, free, hill, step, 8);
    if (climbed.height <= top.height) continue;
    top = climbed;
    foot = hill;
  }
  if (top.height == kNone) return false;

  // On to the robot as it is; the roll stays free there.
  if (goal.kind != TaskKind::pose) {
    branch_at(top.x);
    return descend_to(search, candidate.readings, solution);
  }
  Solution answer;
  const auto answer_at = [&](const double* x) { return best_answer(&from_middle, *search, x, &answer); };
  constexpr double kMuch = 0.002;  // less than the closed form says
  top.height = answer_at(top.x);
  if (!closed.exact() && free.count > 0) {
    // A branch that ends just here for the closed form may end short of it for the robot: from the foot of the hill as
    // near to the top as it lasts. The foot itself may lie beyond that end: then a cell aside.
    const double expected = foot.height;
    foot.height = answer_at(foot.x);
    if (foot.height < expected - kMuch * (1.0 + std::abs(expected))) {
      const Summit missed = foot;
      for (int k = 0; k < free.count; ++k) {
        for (const double way : {2.0, -2.0}) {
          Summit aside = missed;
          aside.x[k] = std::clamp(missed.x[k] + way * step[k], free.low[k], free.high[k]);
          aside.height = answer_at(aside.x);
          if (aside.height > foot.height) foot = aside;
        }
      }
    }
    for (const Summit& hill : start) {
      if (foot.height > kNone || hill.height == kNone) continue;
      foot = hill;
      foot.height = answer_at(foot.x);
    }
    Summit inside = foot;
    for (double share = 0.5, half = 0.25; top.height < inside.height && half > 1e-3; half *= 0.5) {
      Summit there;
      for (int k = 0; k < free.count; ++k) there.x[k] = foot.x[k] + share * (top.x[k] - foot.x[k]);
      there.height = answer_at(there.x);
      const bool lasts = there.height >= inside.height;
      if (lasts) inside = there;
      share += lasts ? half : -half;
    }
    if (inside.height > top.height) top = inside;
    if (top.height > kNone) answer_at(top.x);
  }
  if (top.height > kNone && free.count > 0) pull(search, &answer);
  search->iterations += from_middle.iterations;
  if (top.height == kNone) {
    if (search->interfering.joints.size() == 0) search->interfering = from_middle.interfering;
    return false;
  }
  *solution = answer;
  return true;
}

}  // namespace truing::inverse_kinematics
