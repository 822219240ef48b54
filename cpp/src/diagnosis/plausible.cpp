// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Effects that fit and would have to be larger than machines have them: no name is given to those.

#include <algorithm>
#include <cmath>

#include "diagnosis/diagnosis.hpp"
#include "math/text.hpp"

namespace truing::diagnosis {

constexpr double kForSure = 2.0;          ///< standard errors beyond what is plausible
constexpr double kLargestWarming = 50.0;  ///< [K] of a robot that runs warm, times what is plausible per kelvin

/// Growth over time, where no temperature was recorded.
static bool is_growth(const Explanation& e) {
  return e.kind == Explanation::Kind::drift && e.law_test == LawTest::times_the_lengths;
}

/// No machine has more, in the unit of the candidate's columns; 0: unknown.
static double plausible_size(const Work& work, const Explanation& e) {
  return effect_traits(work, e).plausible * (is_growth(e) ? kLargestWarming : 1.0);
}

/// The parameter that is farthest beyond; no column: none is.
static TooLarge too_large_at(const Work& work, const Evidence::State& state, int group) {
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(group)];
  const double plausible = plausible_size(work, e);
  TooLarge out;
  if (!(plausible > 0.0)) return out;
  double farthest = 0.0;
  const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(group)].columns;
  for (std::size_t k = 0; k < state.columns.size(); ++k) {
    if (std::find(columns.begin(), columns.end(), state.columns[k]) == columns.end()) continue;
    const auto at = static_cast<Eigen::Index>(k);
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(state.solution.size(), at);
    const double sigma = std::sqrt(std::max(0.0, state.sigma2 * unit.dot(state.factor.solve(unit))));
    const double beyond = std::abs(state.solution[at]) - kForSure * sigma - plausible;
    if (beyond <= farthest) continue;
    farthest = beyond;
    out = {group, state.columns[k], std::abs(state.solution[at]),
           work.design.candidates.groups[static_cast<std::size_t>(group)]};
  }
  return out;
}

std::vector<TooLarge> too_large_in(const Work& work, const Evidence::State& state) {
  std::vector<TooLarge> out;
  for (const int g : state.choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    if ((e.kind != Explanation::Kind::catalogue && !is_growth(e)) || e.period > 0.0) continue;
    const TooLarge one = too_large_at(work, state, g);
    if (one.column >= 0) out.push_back(one);
  }
  return out;
}

/// Columns of a group in the order of a state's, the main part first; none: it has no such parts.
static std::vector<Eigen::Index> main_part_and_others(const Work& work, const Evidence::State& state, int group) {
  const std::string& main =
      effect_traits(work, work.design.candidates.named[static_cast<std::size_t>(group)]).main_part;
  const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(group)].columns;
  std::vector<Eigen::Index> out;
  for (std::size_t k = 0; k < state.columns.size(); ++k) {
    if (std::find(columns.begin(), columns.end(), state.columns[k]) == columns.end()) continue;
    const std::string& name = work.design.column_names[static_cast<std::size_t>(state.columns[k])];
    const bool is_main = name.substr(name.rfind('.') + 1) == main;
    out.insert(is_main ? out.begin() : out.end(), static_cast<Eigen::Index>(k));
  }
  return out;
}

/// The main part is, for sure, more than so many times each of the others.
static bool stands_out(const Evidence::State& state, const std::vector<Eigen::Index>& parts, double times) {
  return std::all_of(parts.begin() + 1, parts.end(), [&](Eigen::Index other) {
    Eigen::VectorXd excess = Eigen::VectorXd::Zero(state.solution.size());
    excess[parts[0]] = 1.0;
    excess[other] = -times;
    const double sigma = std::sqrt(std::max(0.0, state.sigma2 * excess.dot(state.factor.solve(excess))));
    return excess.dot(state.solution) > kForSure * sigma;
  });
}

std::vector<int> out_of_proportion_in(const Work& work, const Evidence::State& state) {
  std::vector<int> out;
  for (const int g : state.choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    const double times = effect_traits(work, e).most_times_others;
    if (e.kind != Explanation::Kind::catalogue || !(times > 0.0)) continue;
    const std::vector<Eigen::Index> parts = main_part_and_others(work, state, g);
    if (parts.size() > 1 && stands_out(state, parts, times)) out.push_back(g);
  }
  return out;
}

void set_aside(const std::vector<int>& these, std::size_t groups, const Grams& grams, Work* work) {
  Design& design = work->design;
  const Eigen::Index columns = grams.train.xx.cols();
  design.x.conservativeResize(Eigen::NoChange, columns);
  design.prior.conservativeResize(columns);
  design.column_names.resize(static_cast<std::size_t>(columns));
  design.column_units.resize(static_cast<std::size_t>(columns));
  design.candidates.groups.resize(groups);
  design.candidates.named.resize(groups);
  work->grams = grams;
  for (const int g : these) {
    ColumnGroup& group = design.candidates.groups[static_cast<std::size_t>(g)];
    group.shadow = true;
    group.columns.clear();
  }
}

/// "a harmonic of 12 mrad, more than machines have (5 mrad)".
static std::string in_words(const Work& work, const TooLarge& one) {
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(one.group)];
  const EffectTraits& traits = effect_traits(work, e);
  const std::string& unit = work.design.column_units[static_cast<std::size_t>(one.column)];
  const bool converted = unit == traits.reported.of;
  const double factor = converted ? traits.reported.factor : 1.0;
  const std::string shown = converted ? " " + traits.reported.unit : unit == "-" ? "" : " " + unit;
  return "like " + plain(e.effect) + " of " + number(factor * one.size, 2) + shown + ", more than machines have (" +
         number(factor * plausible_size(work, e), 2) + shown + ")";
}

void say_what_is_negative(Diagnosis* out) {
  for (const FoundEffect& found : out->effects) {
    const auto known = std::find_if(catalogue().begin(), catalogue().end(),
                                    [&](const Effect& effect) { return effect.name == found.effect; });
    if (known == catalogue().end() || known->traits.if_negative.empty()) continue;
    for (const Parameter& p : found.parameters) {
      const bool its_own = p.name.rfind(found.effect + ".", 0) == 0;  // not the moment of an unknown weight
      if (its_own && p.value + kForSure * p.sigma < 0.0)
        out->warnings.push_back(p.name + " is below zero, and " + known->traits.if_negative);
    }
  }
}

void describe_what_is_too_large(const Work& work, const Evidence& evidence, const Decision& decision, Diagnosis* out) {
  for (const TooLarge& one : decision.too_large) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(one.group)];
    const std::string joint = e.joints.size() == 1 ? e.joints[0] : "";
    const auto here = std::find_if(out->unknown.begin(), out->unknown.end(),
                                   [&](const UnknownEffect& unknown) { return unknown.joint == joint; });
    if (here != out->unknown.end()) {
      here->looks_like += (here->looks_like.empty() ? "" : "; ") + in_words(work, one);
      continue;
    }
    const Evidence::Gain gain = evidence.gain(decision.state, one.candidate.columns, one.candidate.cost);
    if (gain.score < decision.search.threshold || e.driver.empty()) continue;  // something else stands in its place
    UnknownEffect unknown;
    unknown.joint = joint;
    unknown.inputs = {e.driver};
    unknown.held_out_before = unknown.held_out_after = out->after;
    unknown.probability = std::clamp(0.5 + 0.49 * std::min(1.0, gain.score / 30.0), 0.0, 0.99);
    unknown.looks_like = in_words(work, one);
    out->unknown.push_back(std::move(unknown));
  }
}

}  // namespace truing::diagnosis
