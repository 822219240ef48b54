// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/search.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool same_place(const TorqueGroup& a, const TorqueGroup& b) {
  return a.effect == b.effect && a.joints == b.joints && a.inputs == b.inputs;
}

/// Having looked at all joints and forms of an effect costs the log of their number.
std::vector<ColumnGroup> column_groups(const TorqueDesign& design) {
  std::map<std::string, int> of_a_kind;
  for (const TorqueGroup& group : design.groups) ++of_a_kind[group.effect];
  std::vector<ColumnGroup> out;
  for (const TorqueGroup& group : design.groups) {
    ColumnGroup one;
    one.columns = group.columns;
    one.cost = std::log(static_cast<double>(of_a_kind[group.effect]));
    one.shadow = design.terms[static_cast<std::size_t>(group.columns.front())].only_alternative;
    out.push_back(std::move(one));
  }
  return out;
}

VectorXd priors_of(const TorqueDesign& design) {
  VectorXd out(static_cast<Index>(design.terms.size()));
  for (std::size_t c = 0; c < design.terms.size(); ++c) out[static_cast<Index>(c)] = design.terms[c].prior;
  return out;
}

double squares_left(const Gram& gram, const VectorXd& solution) {
  return gram.yy - 2.0 * solution.dot(gram.xy) + solution.dot(gram.xx * solution);
}

}  // namespace

Search::Search(const TorqueDesign& design, const Sums& sums, std::vector<int> nuisance)
    : design_(design),
      sums_(sums),
      groups_(column_groups(design)),
      evidence_(sums_.all, groups_, std::move(nuisance), priors_of(design)) {
  const VectorXd flat = evidence_.evaluate({}).precision;
  for (std::size_t f = 0; f < sums.folds.size(); ++f) folds_.emplace_back(sums, f, evidence_.nuisance(), flat);
  for (const TorqueTerm& term : design.terms) {
    for (const std::size_t j : term.joints) joints_ = std::max(joints_, j + 1);
  }
}

Choice Search::without(const Choice& choice, std::size_t at) {
  Choice out = choice;
  out.groups.erase(out.groups.begin() + static_cast<std::ptrdiff_t>(at));
  out.scales.erase(out.scales.begin() + static_cast<std::ptrdiff_t>(at));
  return out;
}

FoldFit::FoldFit(const Sums& sums, std::size_t fold, const std::vector<int>& nuisance, const VectorXd& precision)
    : sums_(sums),
      fold_(sums.folds[fold]),
      nuisance_(nuisance),
      columns_(static_cast<std::size_t>(sums.all.xx.cols())) {
  const Gram all = sums.all.of(nuisance), held = fold_.of(nuisance);
  MatrixXd d = all.xx - held.xx;
  d.diagonal() += precision;
  factor_ = factorised(std::move(d));
  half_y_ = factor_.matrixL().solve(all.xy - held.xy);
  follow_y_ = factor_.matrixU().solve(half_y_);
  held_xx_ = held.xx;
  left_y_ = held.xy - held.xx * follow_y_;
  left_yy_ = held.yy - follow_y_.dot(held.xy + left_y_);
}

const FoldFit::Column& FoldFit::column(int number) {
  Column& out = columns_[static_cast<std::size_t>(number)];
  if (out.half.size() == 0) {
    out.held = fold_.products(nuisance_, number);
    VectorXd others(out.held.size());
    for (Index k = 0; k < others.size(); ++k) others[k] = sums_.all.xx(nuisance_[static_cast<std::size_t>(k)], number);
    out.half = factor_.matrixL().solve(others - out.held);
    out.follow = factor_.matrixU().solve(out.half);
    out.left = out.held - held_xx_ * out.follow;
  }
  return out;
}

// With the nuisance columns N eliminated, a column x is x - N b of the others' fit, b = (N^T N)^-1 N^T x.
double FoldFit::squares(const Evidence::State& state) {
  const std::vector<int> chosen(state.columns.begin() + static_cast<std::ptrdiff_t>(nuisance_.size()),
                                state.columns.end());
  const auto m = static_cast<Index>(chosen.size());
  const Gram held = fold_.of(chosen), all = sums_.all.of(chosen);
  MatrixXd rest = all.xx - held.xx, squares = held.xx;
  VectorXd right = all.xy - held.xy, product = held.xy;
  for (Index i = 0; i < m; ++i) {
    const Column& one = column(chosen[static_cast<std::size_t>(i)]);
    right[i] -= one.half.dot(half_y_);
    product[i] -= one.held.dot(follow_y_) + one.follow.dot(left_y_);
    for (Index k = 0; k <= i; ++k) {
      const Column& other = column(chosen[static_cast<std::size_t>(k)]);
      rest(i, k) -= one.half.dot(other.half);
      squares(i, k) -= one.follow.dot(other.left) + one.held.dot(other.follow);
    }
  }
  rest.diagonal() += state.precision.tail(m);
  const VectorXd solution = factorised(rest.selfadjointView<Eigen::Lower>()).solve(right);
  return left_yy_ - 2.0 * solution.dot(product) + solution.dot(squares.selfadjointView<Eigen::Lower>() * solution);
}

VectorXd Search::squares_of_folds(const Choice& choice) const { return squares_of_folds(evidence_.evaluate(choice)); }

VectorXd Search::squares_of_folds(const Evidence::State& state) const {
  VectorXd out(static_cast<Index>(folds_.size()));
  for (std::size_t f = 0; f < folds_.size(); ++f) out[static_cast<Index>(f)] = folds_[f].squares(state);
  return out;
}

double Search::squares_on(const FoldGram& other, const Evidence::State& state) {
  return squares_left(other.of(state.columns), state.solution);
}

bool Search::may_enter(const Choice& choice, int group, bool free_functions) const {
  const TorqueGroup& g = design_.groups[static_cast<std::size_t>(group)];
  if (g.effect.empty() != free_functions || groups_[static_cast<std::size_t>(group)].shadow) return false;
  const auto& nuisance = evidence_.nuisance();
  if (!nuisance.empty() && std::find(nuisance.begin(), nuisance.end(), g.columns.front()) != nuisance.end())
    return false;
  return std::none_of(choice.groups.begin(), choice.groups.end(),
                      [&](int in) { return same_place(design_.groups[static_cast<std::size_t>(in)], g); });
}

/// Folds that were not fitted, by enough over all of them, and over those that are left without the quarter that gains
/// most, or a single fold could decide.
bool Search::predicts(const VectorXd& before, const VectorXd& after, const SearchLimits& limits) const {
  std::vector<std::pair<double, double>> folds;  // gain, and what it is a part of
  for (Index f = 0; f < before.size(); ++f)
    if (before[f] > 0.0) folds.emplace_back(before[f] - after[f], before[f]);  // else nothing moved
  if (folds.size() < 2) return false;
  std::sort(folds.begin(), folds.end());
  // Every joint counts alike in the sum: one joint's errors are the part that it has of it.
  const double least = limits.least_gain / static_cast<double>(joints_);
  const auto gains = [&](std::size_t count) {
    double gain = 0.0, of = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      gain += folds[k].first;
      of += folds[k].second;
    }
    return gain > least * of;
  };
  return gains(folds.size()) && gains(folds.size() - (folds.size() + 3) / 4);
}

/// Parameters of the group within what machines have; what is beyond stands for something else.
bool Search::is_plausible(const Evidence::State& state, int group) const {
  for (const int c : groups_[static_cast<std::size_t>(group)].columns) {
    const auto at = std::find(state.columns.begin(), state.columns.end(), c) - state.columns.begin();
    const double value = state.solution[static_cast<Index>(at)];
    const TorqueTerm& term = design_.terms[static_cast<std::size_t>(c)];
    if (value < term.least || value > term.most) return false;
  }
  return true;
}

Choice Search::better_forms(Choice choice) const {
  for (std::size_t at = 0; at < choice.groups.size(); ++at) {
    const TorqueGroup& mine = design_.groups[static_cast<std::size_t>(choice.groups[at])];
    if (mine.forms < 2 || mine.effect.empty()) continue;
    const Evidence::State less = evidence_.evaluate(without(choice, at));
    Evidence::Gain best;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      if (!same_place(design_.groups[g], mine) || groups_[g].shadow) continue;
      Evidence::Gain gain = evidence_.gain(less, groups_[g].columns, groups_[g].cost);
      gain.group = static_cast<int>(g);
      if (gain.score > best.score) best = gain;
    }
    if (best.group < 0) continue;
    choice.groups[at] = best.group;
    choice.scales[at] = best.scale;
  }
  return choice;
}

Choice Search::less_what_is_idle(Choice choice, const SearchLimits& limits) const {
  for (bool changed = true; changed;) {
    changed = false;
    const Evidence::State state = evidence_.evaluate(choice);
    const VectorXd squares = squares_of_folds(state);
    for (std::size_t at = 0; at < choice.groups.size(); ++at) {
      const Evidence::State less = evidence_.evaluate(without(choice, at));
      const bool possible = !limits.plausible_only || is_plausible(state, choice.groups[at]);
      const bool wins = possible && less.score < state.score - 0.5 * limits.threshold;
      if (wins && predicts(squares_of_folds(less), squares, limits)) continue;
      choice = less.choice;
      changed = true;
      break;
    }
  }
  return choice;
}

Choice Search::run(Choice choice, const SearchLimits& limits, bool free_functions) const {
  std::vector<int> refused;
  while (static_cast<int>(choice.groups.size()) < limits.most) {
    const Evidence::State state = evidence_.evaluate(choice);
    std::vector<Evidence::Gain> gains = evidence_.gains(state);
    std::sort(gains.begin(), gains.end(), [](const auto& a, const auto& b) { return a.score > b.score; });
    const VectorXd squares = squares_of_folds(state);
    bool taken = false;
    for (const Evidence::Gain& gain : gains) {
      if (gain.score < limits.threshold) break;
      if (!may_enter(choice, gain.group, free_functions)) continue;
      if (std::find(refused.begin(), refused.end(), gain.group) != refused.end()) continue;
      Choice grown = choice;
      grown.groups.push_back(gain.group);
      grown.scales.push_back(gain.scale);
      const Evidence::State with = evidence_.evaluate(grown);
      const bool possible = !limits.plausible_only || is_plausible(with, gain.group);
      if (!possible || !predicts(squares, squares_of_folds(with), limits)) {
        refused.push_back(gain.group);
        continue;
      }
      choice = std::move(grown);
      refused.clear();  // beside what is in now they may predict
      taken = true;
      break;
    }
    if (!taken) break;
    choice = better_forms(std::move(choice));
  }
  return less_what_is_idle(std::move(choice), limits);
}

Account account_of(std::shared_ptr<const TorqueDesign> design, Sums sums, Sums held_out, std::vector<int> nuisance) {
  Account out;
  out.design = std::move(design);
  out.sums = std::make_shared<const Sums>(std::move(sums));
  out.held_out = std::make_shared<const Sums>(std::move(held_out));
  out.search = std::make_shared<const Search>(*out.design, *out.sums, std::move(nuisance));
  return out;
}

}  // namespace truing::dynamics
