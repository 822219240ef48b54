// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// How sure a name is: what could stand in its place, and whether other poses would have brought it.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "math/random.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;
constexpr double kClassR2 = 0.98;
constexpr double kClassNats = 3.0;

bool same_name(const Explanation& a, const Explanation& b) { return a.effect == b.effect && a.joints == b.joints; }

/// link_geometry contains the same link's zero: a name for more of the same.
bool contains(const Explanation& large, const Explanation& small) {
  if (large.effect != "link_geometry") return false;
  if (small.effect != "joint_offset" && small.effect != "link_geometry") return false;
  return large.joints.size() > small.joints.size() || (small.effect == "joint_offset" && large.joints == small.joints);
}

Sureness how_sure(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t at) {
  constexpr double kTempered = 0.5;  // no model is exact: half a nat counts for one
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  const int g = state.choice.groups[at];
  const Evidence::State less = evidence.evaluate(without(state.choice, groups, at));
  Eigen::VectorXd theta(static_cast<Eigen::Index>(groups[static_cast<std::size_t>(g)].columns.size()));
  for (Eigen::Index k = 0; k < theta.size(); ++k) {
    const int column = groups[static_cast<std::size_t>(g)].columns[static_cast<std::size_t>(k)];
    const auto found = std::find(state.columns.begin(), state.columns.end(), column) - state.columns.begin();
    theta[k] = state.solution[static_cast<Eigen::Index>(found)];
  }
  Sureness out;
  out.removal_loss = state.score - less.score;
  double all = 1.0 + std::exp(-kTempered * std::max(0.0, out.removal_loss)), of_class = 1.0;
  const double gained = less.rss - state.rss;
  for (const Evidence::Gain& gain : evidence.gains(less)) {
    const Explanation& e = named[static_cast<std::size_t>(gain.group)];
    const ColumnGroup& group = groups[static_cast<std::size_t>(gain.group)];
    if (gain.group == g || group.corrects_law_at >= 0 || group.columns.empty() || e.kind == Kind::free) continue;
    if (same_name(e, named[static_cast<std::size_t>(g)]) || contains(e, named[static_cast<std::size_t>(g)]) ||
        e.kind == Kind::drift)
      continue;
    if (std::find(less.choice.groups.begin(), less.choice.groups.end(), gain.group) != less.choice.groups.end())
      continue;
    Rival rival;
    rival.group = gain.group;
    rival.loss = state.score - less.score - gain.score;
    const std::string& mine = named[static_cast<std::size_t>(g)].effect;
    const bool any_geometry = e.kind == Kind::all_geometry;
    if (gain.squares > 0.5 * gained || (any_geometry && (mine == "scale" || mine == "thermal"))) {
      rival.r2 = evidence.explained(less, groups[static_cast<std::size_t>(g)].columns, theta, group.columns);
      // Or the other way round: a plainer one that this one contains, and that closes nearly as much.
      if (group.columns.size() == 1 && gain.squares > 0.8 * gained) {
        rival.r2 = std::max(rival.r2, evidence.explained(less, group.columns, Eigen::VectorXd::Ones(1),
                                                         groups[static_cast<std::size_t>(g)].columns));
      }
    }
    // What can make the same motion is named with it, even where the last per cents speak for one of them: no law is
    // that exact.
    const bool comparable = any_geometry ? mine == "scale" || mine == "thermal" : gain.rank <= 8;
    rival.in_class = rival.loss < kClassNats || (rival.r2 > kClassR2 && comparable);
    const double weight = group.shadow ? 0.0 : std::exp(-kTempered * std::max(0.0, rival.loss));
    all += weight;
    if (rival.in_class) of_class += weight;
    if (rival.in_class || weight > 1e-3) out.rivals.push_back(rival);
  }
  out.raw = of_class / all;
  std::sort(out.rivals.begin(), out.rivals.end(),
            [](const Rival& a, const Rival& b) { return a.in_class != b.in_class ? a.in_class : a.loss < b.loss; });
  return out;
}

Resampled resample(const Work& work, const Decision& decision) {
  constexpr int kSelections = 10;
  Resampled out;
  Random random(work.options.seed + 7);
  const auto& groups = work.design.candidates.groups;
  const auto drawn = [&](const std::vector<Gram>& folds) {
    std::vector<double> times(folds.size(), 0.0);
    for (std::size_t k = 0; k < folds.size(); ++k) times[random.below(folds.size())] += 1.0;
    Gram sum;
    for (std::size_t k = 0; k < folds.size(); ++k) {
      if (times[k] > 0.0) sum.add(folds[k], times[k]);
    }
    return sum;
  };
  SearchOptions quick = decision.search;
  quick.beam = 1;
  const Shortlist list = shortlist(work, decision.state.choice.groups);
  std::vector<Gram> short_folds;
  for (const Gram& fold : work.fold) short_folds.push_back(fold.of(list.columns));
  for (int r = 0; r < std::min(kSelections, work.options.resamples); ++r) {
    const Gram train = drawn(short_folds);
    out.chosen.emplace_back();
    for (const int g : Evidence(train, list.groups, list.nuisance, list.prior).search(quick).choice.groups) {
      out.chosen.back().push_back(list.which[static_cast<std::size_t>(g)]);
    }
  }
  // How far the error shrinks takes the chosen columns only.
  const std::vector<int>& columns = decision.state.columns;
  std::vector<ColumnGroup> few;
  std::vector<int> nuisance(work.design.nuisance.size());
  std::iota(nuisance.begin(), nuisance.end(), 0);
  Choice choice;
  int next = static_cast<int>(nuisance.size());
  for (std::size_t k = 0; k < decision.state.choice.groups.size(); ++k) {
    ColumnGroup group = groups[static_cast<std::size_t>(decision.state.choice.groups[k])];
    for (int& column : group.columns) column = next++;
    few.push_back(group);
    choice.groups.push_back(static_cast<int>(k));
    choice.scales.push_back(decision.state.choice.scales[k]);
  }
  std::vector<Gram> train_folds, test_folds;
  for (const Gram& fold : work.fold) train_folds.push_back(fold.of(columns));
  for (const Gram& fold : work.test_fold) test_folds.push_back(fold.of(columns));
  Eigen::VectorXd prior(static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index k = 0; k < prior.size(); ++k) prior[k] = work.design.prior[columns[static_cast<std::size_t>(k)]];
  for (int r = 0; r < work.options.resamples; ++r) {
    const Gram train = drawn(train_folds), test = drawn(test_folds);
    if (!(test.n > 0.0)) break;
    const Evidence evidence(train, few, nuisance, prior);
    const Evidence::State refitted = evidence.evaluate(choice), nothing = evidence.evaluate({});
    const double before = std::max(held_out_squares(test, nothing.columns, nothing.solution), 1e-300);
    const double after = std::max(0.0, held_out_squares(test, refitted.columns, refitted.solution));
    out.shrink.push_back(1.0 - std::sqrt(after / before));
    for (std::size_t at = 0; at < choice.groups.size(); ++at) {
      const Evidence::State less = evidence.evaluate(without(choice, few, at));
      const double lesser = std::max(held_out_squares(test, less.columns, less.solution), 1e-300);
      out.shrink_of[decision.state.choice.groups[at]].push_back(1.0 - std::sqrt(after / lesser));
    }
  }
  return out;
}

/// How often the resampled selections hold the group or one of its class; one more success and one more trial stand for
/// the data's own.
double came_back(const Work& work, const Resampled& resampled, const Sureness& sure, int group) {
  const auto& named = work.design.candidates.named;
  double back = 1.0, draws = 1.0;
  for (const std::vector<int>& chosen : resampled.chosen) {
    const bool found = std::any_of(chosen.begin(), chosen.end(), [&](int g) {
      const Explanation &other = named[static_cast<std::size_t>(g)], &mine = named[static_cast<std::size_t>(group)];
      if (same_name(other, mine) || contains(other, mine)) return true;
      return std::any_of(sure.rivals.begin(), sure.rivals.end(),
                         [&](const Rival& r) { return r.in_class && r.group == g; });
    });
    back += found ? 1.0 : 0.0;
    draws += 1.0;
  }
  return back / draws;
}

/// Stated confidence from what it rests on: the posterior of the class, how often resampled poses bring it back, and
/// what is lost without it. Mapped so that it says how often such names were right on development sets of the
/// examination (docs/method/exam.md).
double calibrated(double posterior, double came_back, double removal_loss) {
  const double score = 0.45 * posterior + 0.35 * came_back + 0.2 * std::min(removal_loss, 40.0) / 40.0;
  constexpr double kMap[6][2] = {{0.0, 0.05}, {0.5, 0.3}, {0.7, 0.64}, {0.9, 0.74}, {0.975, 0.8}, {0.998, 0.95}};
  for (int k = 1; k < 6; ++k) {
    if (score <= kMap[k][0])
      return kMap[k - 1][1] + (score - kMap[k - 1][0]) / (kMap[k][0] - kMap[k - 1][0]) * (kMap[k][1] - kMap[k - 1][1]);
  }
  return kMap[5][1];
}

}  // namespace truing::diagnosis
