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

void set_aside(const std::vector<TooLarge>& too_large, std::size_t groups, const Grams& grams, Work* work) {
  Design& design = work->design;
  const Eigen::Index columns = grams.train.xx.cols();
  design.x.conservativeResize(Eigen::NoChange, columns);
  design.prior.conservativeResize(columns);
  design.column_names.resize(static_cast<std::size_t>(columns));
  design.column_units.resize(static_cast<std::size_t>(columns));
  design.candidates.groups.resize(groups);
  design.candidates.named.resize(groups);
  work->grams = grams;
  for (const TooLarge& one : too_large) {
    ColumnGroup& group = design.candidates.groups[static_cast<std::size_t>(one.group)];
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
