// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Which effects stand between a model and recorded torques: the steps in order.

#include "truing/dynamics/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dynamics/judge.hpp"
#include "dynamics/name.hpp"
#include "dynamics/search.hpp"

namespace truing {
using namespace dynamics;

bool TorqueDiagnoseOptions::is_valid(std::string* error) const {
  if (!(cutoff > 0.0) || !std::isfinite(cutoff)) return *error = "cutoff must be above 0 Hz", false;
  if (!(test_share > 0.0 && test_share < 1.0)) return *error = "test_share must lie between 0 and 1", false;
  if (max_effects < 1) return *error = "max_effects must be 1 or more", false;
  if (!(least_gain >= 0.0)) return *error = "least_gain must be 0 or more", false;
  if (threads < 0) return *error = "threads must be 0 or more", false;
  return true;
}

namespace dynamics {
namespace {

/// What all effects together leave: the errors of the groundwork alone go on in time as the effects do that it lacks.
std::vector<Noise> noise_of_all(const Problem& problem, const TorqueDesign& design,
                                const std::vector<JointGrams>& grams, const std::vector<Noise>& first) {
  std::vector<int> columns;
  for (const TorqueGroup& group : design.groups) {
    // Not what needs the torque: with that of another model it would be another column.
    const bool fixed = std::none_of(group.columns.begin(), group.columns.end(),
                                    [&](int c) { return design.terms[static_cast<std::size_t>(c)].needs_torque; });
    if (!group.effect.empty() && fixed) columns.insert(columns.end(), group.columns.begin(), group.columns.end());
  }
  std::vector<Noise> noise = first;
  for (int round = 0; round < 2; ++round) {
    // Every row counts here: the priors are there for what the rows cannot see, and for nothing else.
    for (Noise& one : noise) one.design_effect = 1.0;
    const Fit all = fit_of(sums_of(grams, noise, design, std::vector<bool>(design.terms.size(), true)), columns);
    noise = noise_of(problem.data, problem.nominal.with(valued(design, all)), problem.train);
  }
  return noise;
}

/// All effects that there are to find, and the free functions.
TorqueDesign whole_design(const Problem& problem, const TorqueDiagnoseOptions& options) {
  TorqueDesign out = design_of(problem.robot, problem.range, options.own_effects,
                               {options.leave_out.begin(), options.leave_out.end()}, !problem.fitted_before);
  add_free_functions(problem.robot, problem.range, &out);
  return out;
}

/// The terms of a choice alone, and what is always in.
TorqueDesign part_of(const TorqueDesign& whole, const Choice& choice) {
  TorqueDesign out;
  for (std::size_t g = 0; g < whole.groups.size(); ++g) {
    TorqueGroup group = whole.groups[g];
    const bool chosen =
        std::find(choice.groups.begin(), choice.groups.end(), static_cast<int>(g)) != choice.groups.end();
    if (!group.standard && !chosen) continue;
    for (int& column : group.columns) {
      out.terms.push_back(whole.terms[static_cast<std::size_t>(column)]);
      column = static_cast<int>(out.terms.size()) - 1;
    }
    out.groups.push_back(std::move(group));
  }
  return out;
}

/// What is left where everything chosen is fitted with the turns that are set.
std::vector<Noise> noise_left(const Problem& problem, const TorqueDesign& whole, const Choice& choice,
                              const TorqueModel& seen, const std::vector<Noise>& before) {
  const TorqueDesign design = part_of(whole, choice);
  const Sums sums =
      sums_of(sum_grams(problem.data, design, problem.nominal, seen.turning(problem.range.turns), problem.train),
              before, design, inertial_columns(design));
  std::vector<int> columns(design.terms.size());
  std::iota(columns.begin(), columns.end(), 0);
  return noise_of(problem.data, problem.nominal.with(valued(design, fit_of(sums, columns))), problem.train);
}

/// The choice fitted, as a model beside the nominal one.
TorqueModel fitted_model(const Problem& problem, const TorqueDesign& design, const Sums& sums, const Search& search,
                         const Choice& choice) {
  const Evidence::State state = search.state(choice);
  return problem.nominal.with(valued(design, fit_of(sums, state.columns, state.precision)));
}

}  // namespace

TorqueDiagnosis diagnose(const Robot& robot, const std::vector<Recording>& recordings,
                         const TorqueDiagnoseOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument(error);
  for (const std::string& name : options.leave_out) find_torque_effect(name, options.own_effects);
  validate(robot);
  require_usable(robot, recordings);
  Problem problem(robot, recordings, {options.cutoff, options.test_share, options.threads, options.own_effects});
  const Groundwork groundwork = groundwork_of(&problem);
  TorqueDesign design = whole_design(problem, options);
  const std::vector<int> nuisance = problem.fitted_before ? std::vector<int>{} : standard_columns(design);
  std::vector<bool> priors = inertial_columns(design);
  if (problem.fitted_before) priors.assign(priors.size(), false);  // they are candidates, with priors of their own

  SearchLimits limits;
  limits.least_gain = options.least_gain;
  limits.most = options.max_effects;
  limits.plausible_only = !problem.fitted_before;  // departures from what the robot carries have either sign
  TorqueModel model = groundwork.model;
  std::vector<JointGrams> grams = sum_grams(problem.data, design, problem.nominal, model, problem.train);
  std::vector<Noise> noise = noise_of_all(problem, design, grams, groundwork.noise);
  Choice choice;
  // What noise is, and the torque that some terms need, are those of the model found in the round before.
  for (int round = 0; round < 2; ++round) {
    if (round > 0 && !problem.fitted_before) {
      choose_turns(&problem, [&] { return noise_left(problem, design, choice, model, noise); });
      design = whole_design(problem, options);  // of the same groups
      model = model.turning(problem.range.turns);
    }
    if (round > 0) grams = sum_grams(problem.data, design, problem.nominal, model, problem.train);
    const Sums sums = sums_of(grams, noise, design, priors);
    const Search search(design, sums, nuisance);
    choice = search.run(round == 0 ? Choice{} : choice, limits, false);
    model = fitted_model(problem, design, sums, search, choice);
    noise = noise_of(problem.data, model, problem.train);
  }
  const Sums sums = sums_of(grams, noise, design, priors);
  const Sums held_out = sums_of(sum_grams(problem.data, design, problem.nominal, model, problem.test), noise, design,
                                std::vector<bool>(design.terms.size(), false));
  const Search search(design, sums, nuisance);
  SearchLimits few = limits;
  few.least_gain = std::max(0.01, limits.least_gain);
  few.most = static_cast<int>(choice.groups.size()) + 6;
  const Choice with_unknown = search.run(choice, few, true);
  return named(problem, groundwork, design, sums, held_out, search, choice, with_unknown, noise);
}

}  // namespace dynamics
}  // namespace truing
