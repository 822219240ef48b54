// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Torques fitted to what was asked for, and predicted.

#include "truing/dynamics/identify.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/columns.hpp"
#include "dynamics/effects/families.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/search.hpp"
#include "math/text.hpp"

namespace truing {
using namespace dynamics;

bool TorqueOptions::is_valid(std::string* error) const {
  if (!(cutoff > 0.0) || !std::isfinite(cutoff)) return *error = "cutoff must be above 0 Hz", false;
  if (!(test_share > 0.0 && test_share < 1.0)) return *error = "test_share must lie between 0 and 1", false;
  if (threads < 0) return *error = "threads must be 0 or more", false;
  return true;
}

namespace dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Without the forms that have such a parameter; their columns stay unused.
void leave_out_forms(const std::vector<std::string>& forms, TorqueDesign* design) {
  const auto has = [&](const TorqueGroup& group, const std::string& form) {
    const std::size_t dot = form.find('.');
    if (dot == std::string::npos || group.effect != form.substr(0, dot)) return false;
    const std::string part = form.substr(dot);
    return std::any_of(group.columns.begin(), group.columns.end(), [&](int c) {
      const std::string& name = design->terms[static_cast<std::size_t>(c)].parameter;
      return name.size() >= part.size() && name.compare(name.size() - part.size(), part.size(), part) == 0;
    });
  };
  std::vector<TorqueGroup>& groups = design->groups;
  groups.erase(std::remove_if(groups.begin(), groups.end(),
                              [&](const TorqueGroup& group) {
                                return std::any_of(forms.begin(), forms.end(),
                                                   [&](const std::string& form) { return has(group, form); });
                              }),
               groups.end());
}

/// Groups of the effects asked for; of a law with inner constants all forms.
TorqueDesign requested_design(const Problem& problem, const TorqueOptions& options) {
  TorqueDesign design;
  std::vector<EffectRequest> requests = options.effects;
  for (const TorqueEffect& effect : torque_catalogue()) {
    const bool inertial = effect.traits.standard && effect.traits.family == TorqueFamily::inertia;
    const bool unasked = options.effects.empty() && effect.traits.usual && !inertial;
    if (unasked || (inertial && options.fit_inertials)) requests.push_back({effect.name, {}});
  }
  for (const EffectRequest& request : requests) {
    const TorqueEffect& effect = find_torque_effect(request.effect, options.own_effects);
    if (request.joints.empty()) add_effect(effect, -1, problem.robot, problem.range, &design);
    for (const std::string& joint : request.joints)
      add_effect(effect, static_cast<int>(driven_number(problem.robot, joint)), problem.robot, problem.range, &design);
  }
  leave_out_forms(options.leave_out_forms, &design);
  return design;
}

/// Of every effect at every joint the form that fits best; the others are left out.
std::vector<int> best_forms(const TorqueDesign& design, const Sums& sums) {
  std::vector<int> chosen, columns;
  for (std::size_t g = 0; g < design.groups.size(); ++g) {
    if (design.groups[g].forms > 1) continue;
    chosen.push_back(static_cast<int>(g));
    columns.insert(columns.end(), design.groups[g].columns.begin(), design.groups[g].columns.end());
  }
  std::vector<bool> done(design.groups.size(), false);
  for (std::size_t g = 0; g < design.groups.size(); ++g) {
    const TorqueGroup& mine = design.groups[g];
    if (done[g] || std::find(chosen.begin(), chosen.end(), static_cast<int>(g)) != chosen.end()) continue;
    double least = std::numeric_limits<double>::infinity();
    std::size_t best = g;
    for (std::size_t h = g; h < design.groups.size(); ++h) {
      const TorqueGroup& other = design.groups[h];
      if (other.effect != mine.effect || other.joints != mine.joints) continue;
      done[h] = true;
      std::vector<int> with = columns;
      with.insert(with.end(), other.columns.begin(), other.columns.end());
      const Fit fit = fit_of(sums, with);
      const double squares = sums.all.yy - fit.values.dot(sums.all.of(with).xy);
      if (squares < least) {
        least = squares;
        best = h;
      }
    }
    chosen.push_back(static_cast<int>(best));
    columns.insert(columns.end(), design.groups[best].columns.begin(), design.groups[best].columns.end());
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

std::vector<int> columns_of(const TorqueDesign& design, const std::vector<int>& groups) {
  std::vector<int> out;
  for (const int g : groups) {
    const std::vector<int>& columns = design.groups[static_cast<std::size_t>(g)].columns;
    out.insert(out.end(), columns.begin(), columns.end());
  }
  return out;
}

/// Effects beyond those that the groundwork has.
bool asks_for_more(const TorqueDesign& design) {
  return std::any_of(design.groups.begin(), design.groups.end(), [](const TorqueGroup& g) { return !g.standard; });
}

bool scales_masses(const TorqueDesign& design, const TorqueOptions& options) {
  return std::any_of(design.groups.begin(), design.groups.end(), [&](const TorqueGroup& group) {
    return find_torque_effect(group.effect, options.own_effects).traits.scales_masses;
  });
}

}  // namespace

TorqueFit identify(const Robot& robot, const std::vector<Recording>& recordings, const TorqueOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument(error);
  validate(robot);
  require_usable(robot, recordings);
  Problem problem(robot, recordings, {options.cutoff, options.test_share, options.threads, options.own_effects});
  const Groundwork groundwork = groundwork_of(&problem);
  TorqueDesign design = requested_design(problem, options);
  const std::vector<bool> with_prior = inertial_columns(design);
  DesignColumns columns(problem.tiles, design, Resting::left_out);

  TorqueFit out;
  TorqueModel model = groundwork.model;
  std::vector<Noise> noise = groundwork.noise;
  std::vector<int> groups;
  std::vector<TorqueGrams> grams;
  Sums sums;
  Fit fit;
  // Terms that need the torque see that of the model found in the round before. Beside the links' masses a drive's
  // constant k comes nearer by the factor k in a round.
  const bool scaled = scales_masses(design, options);
  const int rounds = scaled ? 6 : 2;
  for (int round = 0; round < rounds; ++round) {
    bool turned = false;
    if (round == 1 && asks_for_more(design) && !problem.fitted_before) {
      turned = choose_turns_again(&problem, part_of(design, groups), model, noise, false);
      if (turned) {
        design = requested_design(problem, options);  // of the same groups
        columns.turned();
        model = model.turning(problem.range.turns);
      }
    }
    grams = sum_grams(columns, problem.nominal, model, problem.train, {grams, turned}, std::vector<Rows>{Rows::fitted});
    sums = sums_of(grams.front(), noise, design, with_prior);
    groups = best_forms(design, sums);
    fit = fit_of(sums, columns_of(design, groups));
    model = problem.nominal.with(valued(design, fit));
    noise = noise_of(problem.tiles, model, problem.train);
  }
  out.warnings = problem.warnings;
  if (scaled && options.fit_inertials && !payload_varies(problem.range))
    out.warnings.push_back(
        "motor_constant and all masses share one scale, which the prior of the masses alone decides here: a known "
        "payload (column payload_kg) that differs between recordings tells");
  fit = with_bodies(robot, design, sums, fit, &out.warnings);
  out.robot = applied(robot, design, groups, fit, problem.range);
  out.parameters = parameters_of(design, columns_of(design, groups), fit);
  out.covariance = covariance_of(design, fit, out.parameters);
  out.errors = errors_of(
      problem, {{"nominal", problem.nominal}, {"standard", groundwork.model}, {"named", model_of(out.robot, problem)}});
  out.cutoff = problem.tiles.options().cutoff;
  out.held_out = problem.held_out;
  out.not_testable = design.not_testable;
  return out;
}

}  // namespace dynamics
}  // namespace truing
