// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Which effects stand between a model and recorded torques: the steps in order.

#include "truing/dynamics/diagnose.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/columns.hpp"
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
std::vector<Noise> noise_of_all(const Problem& problem, const DesignColumns& columns, const TorqueGrams& grams,
                                const std::vector<Noise>& first) {
  const TorqueDesign& design = columns.design();
  std::vector<int> which;
  for (const TorqueGroup& group : design.groups) {
    // Not what needs the torque: with that of another model it would be another column.
    const bool fixed = std::none_of(group.columns.begin(), group.columns.end(),
                                    [&](int c) { return design.terms[static_cast<std::size_t>(c)].needs_torque; });
    if (!group.effect.empty() && fixed) which.insert(which.end(), group.columns.begin(), group.columns.end());
  }
  std::vector<Noise> noise = first;
  for (int round = 0; round < 2; ++round) {
    // Every row counts here: the priors are there for what the rows cannot see, and for nothing else.
    for (Noise& one : noise) one.design_effect = 1.0;
    const Fit all = fit_of(sums_of(grams, noise, design, std::vector<bool>(design.terms.size(), true)), which);
    noise = noise_of(columns, problem.nominal, all.columns, all.values, problem.train);
  }
  return noise;
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
  const Problem problem(robot, recordings, {options.cutoff, options.test_share, options.threads, options.own_effects});
  const Groundwork groundwork = groundwork_of(problem);
  TorqueDesign design = design_of(problem.robot, problem.range, options.own_effects,
                                  {options.leave_out.begin(), options.leave_out.end()}, !problem.fitted_before);
  add_free_functions(problem.robot, problem.range, &design);
  const std::vector<int> nuisance = problem.fitted_before ? std::vector<int>{} : standard_columns(design);
  std::vector<bool> priors = inertial_columns(design);
  if (problem.fitted_before) priors.assign(priors.size(), false);  // they are candidates, with priors of their own

  SearchLimits limits;
  limits.least_gain = options.least_gain;
  limits.most = options.max_effects;
  limits.plausible_only = !problem.fitted_before;  // departures from what the robot carries have either sign
  const DesignColumns columns(problem.tiles, design);
  TorqueModel model = groundwork.model;
  TorqueGrams grams = sum_grams(columns, problem.nominal, model, problem.train);
  std::vector<Noise> noise = noise_of_all(problem, columns, grams, groundwork.noise);
  Choice choice;
  // What noise is, and the torque that some terms need, are those of the model found in the round before.
  for (int round = 0; round < 2; ++round) {
    if (round > 0) grams = sum_grams(columns, problem.nominal, model, problem.train);
    const Sums sums = sums_of(grams, noise, design, priors);
    const Search search(design, sums, nuisance);
    choice = search.run(round == 0 ? Choice{} : choice, limits, false);
    model = fitted_model(problem, design, sums, search, choice);
    noise = noise_of(problem.tiles, model, problem.train);
  }
  const Sums sums = sums_of(grams, noise, design, priors);
  const Sums held_out = sums_of(sum_grams(columns, problem.nominal, model, problem.test), noise, design,
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
