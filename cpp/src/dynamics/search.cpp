// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/search.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "math/batch.hpp"

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

constexpr std::size_t kTriesTogether = 4;  ///< that are looked at ahead: most are refused

double squares_left(const Gram& gram, const VectorXd& solution) {
  return gram.yy - 2.0 * solution.dot(gram.xy) + solution.dot(gram.xx * solution);
}

}  // namespace

Search::Search(const TorqueDesign& design, const Sums& sums, std::vector<int> nuisance, int threads)
    : design_(design),
      sums_(sums),
      groups_(column_groups(design)),
      evidence_(sums_.all, groups_, std::move(nuisance), priors_of(design), estimation::Nuisance::eliminated),
      threads_(threads) {
  const VectorXd flat = evidence_.evaluate({}).precision;
  folds_.resize(sums.folds.size());
  const auto fit_others = [&](std::size_t f) {
    folds_[f] = std::make_unique<FoldFit>(sums, f, evidence_.nuisance(), flat);
  };
  math::for_each_on_threads(folds_.size(), threads_, {}, fit_others, 1);
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

FoldFit::Column& FoldFit::column(int number) {
  Column& out = columns_[static_cast<std::size_t>(number)];
  if (out.half.size() == 0) {
    out.number = number;
    out.held = fold_.products(nuisance_, number);
    VectorXd others(out.held.size());
    for (Index k = 0; k < others.size(); ++k) others[k] = sums_.all.xx(nuisance_[static_cast<std::size_t>(k)], number);
    out.half = factor_.matrixL().solve(others - out.held);
    out.follow = factor_.matrixU().solve(out.half);
    out.left = out.held - held_xx_ * out.follow;
    const double product = fold_.product(number);
    out.right = sums_.all.xy[number] - product - out.half.dot(half_y_);
    out.product = product - out.held.dot(follow_y_) - out.follow.dot(left_y_);
    out.pairs.resize(++asked_);
  }
  return out;
}

const FoldFit::Pair& FoldFit::pair(Column& one, Column& other) {
  Column &a = one.number < other.number ? one : other, &b = &a == &one ? other : one;
  Pair& out = a.pairs.size() < b.pairs.size() ? b.pairs[a.pairs.size() - 1] : a.pairs[b.pairs.size() - 1];
  if (std::isnan(out.held)) {
    const double held = fold_.product(a.number, b.number);
    out.others = sums_.all.xx(a.number, b.number) - held - a.half.dot(b.half);
    out.held = held - a.follow.dot(b.left) - a.held.dot(b.follow);
  }
  return out;
}

// With the nuisance columns N eliminated, a column x is x - N b of the others' fit, b = (N^T N)^-1 N^T x.
double FoldFit::squares(const Evidence::State& state) {
  const std::size_t always = nuisance_.size();
  const auto m = static_cast<Index>(state.columns.size() - always);
  MatrixXd rest(m, m), squares(m, m);
  VectorXd right(m), product(m);
  std::vector<Column*> own;
  for (Index i = 0; i < m; ++i) {
    own.push_back(&column(state.columns[always + static_cast<std::size_t>(i)]));
    right[i] = own.back()->right;
    product[i] = own.back()->product;
    for (Index k = 0; k <= i; ++k) {
      const Pair& both = pair(*own.back(), *own[static_cast<std::size_t>(k)]);
      rest(i, k) = both.others;
      squares(i, k) = both.held;
    }
  }
  rest.diagonal() += state.precision.tail(m);
  const VectorXd solution = factorised(rest.selfadjointView<Eigen::Lower>()).solve(right);
  return left_yy_ - 2.0 * solution.dot(product) + solution.dot(squares.selfadjointView<Eigen::Lower>() * solution);
}

Search::Look& Search::look(const Choice& choice) const {
  const std::lock_guard<std::mutex> one(asking_);
  const auto known = looks_.find({choice.groups, choice.scales});
  if (known != looks_.end()) return known->second;
  Look& out = looks_[{choice.groups, choice.scales}];
  out.state = evidence_.evaluate(choice);
  return out;
}

void Search::look_ahead(const std::vector<Choice>& choices, Ahead what) const {
  if (threads_ == 1) return;
  std::vector<std::pair<const Choice*, Look*>> fresh;
  std::vector<Look*> unjudged;
  for (const Choice& choice : choices) {
    const auto [at, is_new] = looks_.try_emplace({choice.groups, choice.scales});
    Look* const look = &at->second;
    if (is_new) fresh.emplace_back(&choice, look);
    const bool judged = look->squares.size() > 0 || std::count(unjudged.begin(), unjudged.end(), look) > 0;
    if (what == Ahead::squares && !judged) unjudged.push_back(look);
  }
  const auto evaluate = [&](std::size_t k) { fresh[k].second->state = evidence_.evaluate(*fresh[k].first); };
  math::for_each_on_threads(fresh.size(), threads_, {}, evaluate, 1);
  fill_squares(unjudged, threads_);
}

void Search::fill_squares(const std::vector<Look*>& looks, int threads) const {
  for (Look* look : looks) look->squares.resize(static_cast<Index>(folds_.size()));
  const auto judge = [&](std::size_t f) {
    for (Look* look : looks) look->squares[static_cast<Index>(f)] = folds_[f]->squares(look->state);
  };
  math::for_each_on_threads(folds_.size(), threads, {}, judge, 1);
}

const std::vector<Evidence::Gain>& Search::gains(const Choice& choice, int threads) const {
  Look& seen = look(choice);
  std::call_once(seen.gains_asked, [&] { seen.gains = evidence_.gains(seen.state, threads); });
  return seen.gains;
}

std::vector<bool> Search::idle_flights(const Choice& choice) const {
  std::vector<bool> out(design_.terms.size(), false);
  const std::vector<Evidence::Gain>&alone = gains({}), &beside = gains(choice);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const bool chosen =
        std::find(choice.groups.begin(), choice.groups.end(), static_cast<int>(g)) != choice.groups.end();
    if (chosen || alone[g].score > 0.0 || beside[g].score > 0.0) continue;
    for (const int c : groups_[g].columns)
      out[static_cast<std::size_t>(c)] = design_.terms[static_cast<std::size_t>(c)].needs_inertia;
  }
  return out;
}

const VectorXd& Search::squares_of_folds(const Choice& choice) const {
  Look& seen = look(choice);
  const std::lock_guard<std::mutex> one(asking_);
  if (seen.squares.size() == 0) fill_squares({&seen}, threads_);
  return seen.squares;
}

double Search::squares_on(const FoldGram& other, const Evidence::State& state) {
  return squares_left(other.of(state.columns), state.solution);
}

bool Search::may_enter(const Choice& choice, int group, const SearchLimits& limits, bool free_functions) const {
  const TorqueGroup& g = design_.groups[static_cast<std::size_t>(group)];
  const bool shadow = groups_[static_cast<std::size_t>(group)].shadow && !(limits.masses_given && g.of_given_masses);
  if (g.effect.empty() != free_functions || shadow) return false;
  const auto& nuisance = evidence_.nuisance();
  if (!nuisance.empty() && std::find(nuisance.begin(), nuisance.end(), g.columns.front()) != nuisance.end())
    return false;
  return std::none_of(choice.groups.begin(), choice.groups.end(),
                      [&](int in) { return same_place(design_.groups[static_cast<std::size_t>(in)], g); });
}

bool Search::gains_on_folds(const VectorXd& before, const VectorXd& after, double least_part) {
  std::vector<std::pair<double, double>> folds;  // gain, and what it is a part of
  for (Index f = 0; f < before.size(); ++f)
    if (before[f] > 0.0) folds.emplace_back(before[f] - after[f], before[f]);  // else nothing moved
  if (folds.size() < 2) return false;
  std::sort(folds.begin(), folds.end());
  const auto gains = [&](std::size_t count) {
    double gain = 0.0, of = 0.0;
    for (std::size_t k = 0; k < count; ++k) {
      gain += folds[k].first;
      of += folds[k].second;
    }
    return gain > least_part * of;
  };
  return gains(folds.size()) && gains(folds.size() - (folds.size() + 3) / 4);
}

// Every joint counts alike in the sum: one joint's errors are the part that it has of it.
bool Search::predicts(const VectorXd& before, const VectorXd& after, const SearchLimits& limits) const {
  return gains_on_folds(before, after, limits.least_gain / static_cast<double>(joints_));
}

bool Search::is_plausible(const Evidence::State& state, int group) const {
  for (const int c : groups_[static_cast<std::size_t>(group)].columns) {
    const auto at = std::find(state.columns.begin(), state.columns.end(), c) - state.columns.begin();
    const double value = state.solution[static_cast<Index>(at)];
    const TorqueTerm& term = design_.terms[static_cast<std::size_t>(c)];
    if (value < term.least || value > term.most) return false;
  }
  return true;
}

std::vector<Evidence::Gain> Search::forms_of(const Choice& choice, std::size_t at) const {
  const TorqueGroup& mine = design_.groups[static_cast<std::size_t>(choice.groups[at])];
  const Evidence::State& less = state(without(choice, at));
  std::vector<Evidence::Gain> out;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (!same_place(design_.groups[g], mine) || groups_[g].shadow) continue;
    Evidence::Gain form = evidence_.gain(less, groups_[g].columns, groups_[g].cost);
    form.group = static_cast<int>(g);
    if (form.score > 0.0) out.push_back(form);
  }
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.score > b.score; });
  return out;
}

/// Of the forms that explain about as much, one that predicts folds as well as the present one does. A form that no
/// machine has makes way for one that machines have where this explains nearly as much; where it wins over all of these
/// it stays, and is refused at the end: what is there is something else.
Choice Search::in_best_form(const Choice& choice, std::size_t at, const SearchLimits& limits) const {
  const std::vector<Evidence::Gain> forms = forms_of(choice, at);
  if (forms.empty()) return choice;
  const auto in_form = [&](const Evidence::Gain& form) {
    Choice other = choice;
    other.groups[at] = form.group;
    other.scales[at] = form.scale;
    return other;
  };
  for (const Evidence::Gain& form : forms) {
    if (form.score < forms.front().score - limits.threshold) break;
    Choice other = in_form(form);
    const bool possible = !limits.plausible_only || is_plausible(state(other), form.group);
    if (!possible) continue;
    const bool is_present = form.group == choice.groups[at];
    if (is_present || !predicts(squares_of_folds(other), squares_of_folds(choice), limits)) return other;
  }
  return in_form(forms.front());
}

Choice Search::better_forms(Choice choice, const SearchLimits& limits) const {
  std::vector<std::size_t> with_forms;
  std::vector<Choice> less_one;  // as long as no form becomes another
  for (std::size_t at = 0; at < choice.groups.size(); ++at) {
    const TorqueGroup& mine = design_.groups[static_cast<std::size_t>(choice.groups[at])];
    if (mine.forms < 2 || mine.effect.empty()) continue;
    with_forms.push_back(at);
    less_one.push_back(without(choice, at));
  }
  look_ahead(less_one, Ahead::state);
  for (const std::size_t at : with_forms) choice = in_best_form(choice, at, limits);
  return choice;
}

Choice Search::less_what_is_idle(Choice choice, const SearchLimits& limits, bool free_functions) const {
  for (bool changed = true; changed;) {
    changed = false;
    const Evidence::State& whole = state(choice);
    const VectorXd& squares = squares_of_folds(choice);
    std::vector<int> asked;
    std::vector<Choice> less_one;
    for (std::size_t at = 0; at < choice.groups.size(); ++at) {
      // A free function bends to what a law does as well; a law that was named stays, or it would be unknown too.
      if (design_.groups[static_cast<std::size_t>(choice.groups[at])].effect.empty() != free_functions) continue;
      asked.push_back(choice.groups[at]);
      less_one.push_back(without(choice, at));
    }
    look_ahead(less_one, Ahead::state);
    const auto wins = [&](std::size_t k) {
      const bool possible = !limits.plausible_only || is_plausible(whole, asked[k]);
      return possible && state(less_one[k]).score < whole.score - 0.5 * limits.threshold;
    };
    std::size_t winning = 0;  // so many of the first ones
    while (winning < asked.size() && wins(winning)) ++winning;
    look_ahead({less_one.begin(), less_one.begin() + static_cast<std::ptrdiff_t>(winning)}, Ahead::squares);
    for (std::size_t k = 0; k < asked.size() && !changed; ++k) {
      if (k < winning && predicts(squares_of_folds(less_one[k]), squares, limits)) continue;
      choice = less_one[k];
      changed = true;
    }
  }
  return choice;
}

std::vector<Choice> Search::winning(const Choice& choice, const SearchLimits& limits, bool free_functions) const {
  std::vector<Evidence::Gain> ranked = gains(choice, threads_);
  std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.score > b.score; });
  std::vector<Choice> out;
  for (const Evidence::Gain& gain : ranked) {
    if (gain.score < limits.threshold) break;
    if (may_enter(choice, gain.group, limits, free_functions))
      out.push_back(with_one_more(choice, gain.group, gain.scale));
  }
  return out;
}

std::vector<Choice> Search::refused(const Choice& choice, const SearchLimits& limits) const {
  std::vector<Choice> tries = winning(choice, limits, false);
  look_ahead(tries, Ahead::state);
  const auto not_refused = [&](const Choice& one) {
    return is_plausible(state(one), one.groups.back()) ||
           !predicts(squares_of_folds(choice), squares_of_folds(one), limits);
  };
  tries.erase(std::remove_if(tries.begin(), tries.end(), not_refused), tries.end());
  return tries;
}

std::optional<Choice> Search::grown(const Choice& choice, const SearchLimits& limits, bool free_functions) const {
  const std::vector<Choice> tries = winning(choice, limits, free_functions);
  const VectorXd& squares = squares_of_folds(choice);
  for (std::size_t k = 0; k < tries.size(); ++k) {
    if (k % kTriesTogether == 0) {
      const auto first = tries.begin() + static_cast<std::ptrdiff_t>(k);
      look_ahead({first, first + static_cast<std::ptrdiff_t>(std::min(kTriesTogether, tries.size() - k))},
                 Ahead::squares);
    }
    const bool possible = !limits.plausible_only || is_plausible(state(tries[k]), tries[k].groups.back());
    if (possible && predicts(squares, squares_of_folds(tries[k]), limits)) return tries[k];
  }
  return {};
}

Choice Search::run(Choice choice, const SearchLimits& limits, bool free_functions) const {
  while (static_cast<int>(choice.groups.size()) < limits.most) {
    std::optional<Choice> more = grown(choice, limits, free_functions);
    if (!more) break;
    choice = better_forms(*std::move(more), limits);
  }
  return less_what_is_idle(std::move(choice), limits, free_functions);
}

Account account_of(std::shared_ptr<const TorqueDesign> design, Sums sums, std::vector<int> nuisance, int threads) {
  Account out;
  out.design = std::move(design);
  out.sums = std::make_shared<const Sums>(std::move(sums));
  out.search = std::make_shared<const Search>(*out.design, *out.sums, std::move(nuisance), threads);
  return out;
}

}  // namespace truing::dynamics
