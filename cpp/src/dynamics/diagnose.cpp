// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Which effects stand between a model and recorded torques: the steps in order.

#include "truing/dynamics/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "dynamics/columns.hpp"
#include "dynamics/judge.hpp"
#include "dynamics/name.hpp"
#include "dynamics/search.hpp"
#include "math/batch.hpp"
#include "math/text.hpp"

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

using Eigen::VectorXd;

/// What everything together leaves: the errors of the groundwork alone go on in time as that does which it lacks.
std::vector<Noise> noise_of_all(const Problem& problem, const DesignColumns& columns, const TorqueGrams& grams,
                                const std::vector<Noise>& first) {
  const TorqueDesign& design = columns.design();
  std::vector<bool> wanted(design.terms.size(), false);
  for (const TorqueGroup& group : design.groups) {
    // Not what needs the torque: with that of another model it would be another column.
    const bool fixed = std::none_of(group.columns.begin(), group.columns.end(),
                                    [&](int c) { return design.terms[static_cast<std::size_t>(c)].needs_torque; });
    for (const int column : group.columns) wanted[static_cast<std::size_t>(column)] = fixed;
  }
  std::vector<Noise> noise = first;
  for (int round = 0; round < 2; ++round) {
    // Every row counts here: the priors are there for what the rows cannot see, and for nothing else.
    for (Noise& one : noise) one.design_effect = 1.0;
    const VectorXd values = values_of(grams, noise, design, wanted, problem.tiles.threads());
    noise = noise_of(columns, problem.nominal, values, problem.train);
  }
  return noise;
}

TorqueDesign whole_design(const Problem& problem, const TorqueDiagnoseOptions& options) {
  TorqueDesign out = design_of(problem.robot, problem.range, options.own_effects,
                               {options.leave_out.begin(), options.leave_out.end()}, !problem.fitted_before);
  add_alternatives_of_masses(problem.robot, problem.range, options.own_effects, &out);
  return out;
}

/// Sums of held-out recordings, of what an account chose and of what is always in: a search looks at hundreds of
/// columns, its answer has few. How much a fold counts was found for those that are fitted. `seen`: the model whose
/// torque some terms need.
std::vector<FoldGram> held_out_of(const Problem& problem, const Account& account, const TorqueModel& seen,
                                  std::vector<Noise> noise) {
  for (Noise& one : noise) one.weight_of_fold.resize(0);
  std::vector<int> columns = account.search->evidence().nuisance();
  for (const int g : account.choice.groups) {
    const std::vector<int>& more = account.design->groups[static_cast<std::size_t>(g)].columns;
    columns.insert(columns.end(), more.begin(), more.end());
  }
  std::sort(columns.begin(), columns.end());
  const DesignColumns chosen(problem.tiles, *account.design, std::move(columns), Resting::left_out);
  const TorqueGrams grams = sum_grams(chosen, problem.nominal, seen, problem.test);
  std::vector<FoldGram> out;
  for (int f = 0; f < problem.test.count; ++f) out.emplace_back(grams, static_cast<std::size_t>(f), noise);
  return out;
}

/// Groups that are always in or chosen, in the design's order.
std::vector<int> groups_in(const TorqueDesign& design, const std::vector<int>& nuisance, const Choice& choice) {
  std::vector<int> out;
  for (std::size_t g = 0; g < design.groups.size(); ++g) {
    const int column = design.groups[g].columns.front(), number = static_cast<int>(g);
    const bool always = std::find(nuisance.begin(), nuisance.end(), column) != nuisance.end();
    const bool chosen = std::find(choice.groups.begin(), choice.groups.end(), number) != choice.groups.end();
    if (always || chosen) out.push_back(number);
  }
  return out;
}

/// The choice fitted, as a model beside the nominal one.
TorqueModel fitted_model(const Problem& problem, const TorqueDesign& design, const Sums& sums, const Search& search,
                         const Choice& choice) {
  const Evidence::State state = search.state(choice);
  return problem.nominal.with(valued(design, fit_of(sums, state.columns, state.precision)));
}

TorqueModel fitted_model(const Problem& problem, const Account& account) {
  return fitted_model(problem, *account.design, *account.sums, *account.search, account.choice);
}

bool has_constant_of_drive(const Account& account) {
  return std::any_of(account.choice.groups.begin(), account.choice.groups.end(),
                     [&](int g) { return account.design->groups[static_cast<std::size_t>(g)].of_given_masses; });
}

/// What is usual but the links' inertias.
std::vector<int> friction_columns(const TorqueDesign& design) {
  const std::vector<bool> inertial = inertial_columns(design);
  std::vector<int> out = standard_columns(design);
  out.erase(std::remove_if(out.begin(), out.end(), [&](int c) { return inertial[static_cast<std::size_t>(c)]; }),
            out.end());
  return out;
}

constexpr double kOfBodies = 1.1;  ///< squares that inertias of real bodies may leave, to those of any numbers

/// Squares that a fit leaves on the training rows.
double squares_of(const Sums& sums, const Fit& fit) {
  const Gram gram = sums.all.of(fit.columns);
  return sums.all.yy - 2.0 * fit.values.dot(gram.xy) + fit.values.dot(gram.xx * fit.values);
}

/// An account's choice fitted to these sums, of bodies that there can be; with `near` as in with_bodies().
Fit bodies_fitted(const Problem& problem, const Account& account, const Sums& sums, const Fit* near = nullptr) {
  const Evidence::State& state = account.search->state(account.choice);
  const Fit fit = fit_of(sums, state.columns, state.precision);
  std::vector<std::string> said_later;
  return with_bodies(problem.robot, *account.design, sums, fit, &said_later, near);
}

/// Masses below zero and the like may fit as well as anything, but no robot has them.
bool can_do_it(const Account& account, const Fit& bodies) {
  const Evidence::State& state = account.search->state(account.choice);
  const Fit fit = fit_of(*account.sums, state.columns, state.precision);
  return squares_of(*account.sums, bodies) <= kOfBodies * squares_of(*account.sums, fit);
}

/// The one-standard-error rule (Breiman et al., Classification and Regression Trees, 1984, section 3.4.3): of two
/// models the one that says less is worse only where its squares on folds that were not fitted are larger by more than
/// that.
bool as_good(const VectorXd& simple, const VectorXd& flexible) {
  const VectorXd more = simple - flexible;
  const auto n = static_cast<double>(more.size());
  const double variance = (more.array() - more.mean()).square().sum() / std::max(1.0, n - 1.0);
  return more.mean() <= std::sqrt(variance / n);
}

/// The file's inertias with links, rotors or loads that differ in place of nothing else are the answer even where folds
/// are worse by this part of their squares: free inertias also take up small errors of the derivatives, which go on
/// from fold to fold, and whatever single cause is hidden with them.
constexpr double kOfFreeInertias = 0.05;

/// Nothing was chosen beyond what free inertias have beside them but what they would take up.
bool adds_bodies_alone(const Account& given, const Account& free) {
  return std::all_of(given.choice.groups.begin(), given.choice.groups.end(), [&](int g) {
    const TorqueGroup& group = given.design->groups[static_cast<std::size_t>(g)];
    if (group.family == TorqueFamily::inertia || group.of_given_masses) return true;
    const std::vector<int>& others = free.choice.groups;
    return std::any_of(others.begin(), others.end(), [&](int other) {
      const TorqueGroup& one = free.design->groups[static_cast<std::size_t>(other)];
      return one.effect == group.effect && one.joints == group.joints;
    });
  });
}

bool as_good_as_free(const Account& given, const Account& free) {
  const VectorXd& simple = given.search->squares_of_folds(given.choice);
  const VectorXd& flexible = free.search->squares_of_folds(free.choice);
  const bool nearly = simple.sum() <= (1.0 + kOfFreeInertias) * flexible.sum();
  return as_good(simple, flexible) || (nearly && adds_bodies_alone(given, free));
}

/// Squares of every fold by the fit to the others, of bodies that there can be. `to_all`: theirs to all folds.
VectorXd squares_with_bodies(const Problem& problem, const Account& account, const Fit& to_all) {
  const Evidence::State& state = account.search->state(account.choice);
  const std::vector<FoldGram>& folds = account.sums->folds;
  VectorXd out(static_cast<Eigen::Index>(folds.size()));
  const auto fit_without = [&](std::size_t f) {
    const Gram held = folds[f].of(state.columns);
    Sums others{{}, account.sums->all, account.sums->precision};
    others.all.xx(state.columns, state.columns) -= held.xx;
    others.all.xy(state.columns) -= held.xy;
    const Fit fit = bodies_fitted(problem, account, others, &to_all);
    out[static_cast<Eigen::Index>(f)] = held.yy - 2.0 * fit.values.dot(held.xy) + fit.values.dot(held.xx * fit.values);
  };
  math::for_each_on_threads(folds.size(), problem.tiles.threads(), {}, fit_without, 1);
  return out;
}

/// What was chosen beside the file's inertias, beside inertias that are all free: single links may explain torques only
/// with masses that no body has, and what else was chosen bends to the nearest that one can have. None where bodies
/// predict folds as well without. `bodies`: what was chosen, of bodies that there can be.
std::shared_ptr<const Account> freed(const Problem& problem, const Account& given, const Fit& bodies,
                                     double least_gain) {
  const TorqueDesign& design = *given.design;
  const int threads = problem.tiles.threads();
  // The sums of given inertias have no priors.
  auto out = std::make_shared<Account>(account_of(
      given.design, with_priors(*given.sums, design, inertial_columns(design)), standard_columns(design), threads));
  for (std::size_t k = 0; k < given.choice.groups.size(); ++k) {
    if (is_inertial(design.groups[static_cast<std::size_t>(given.choice.groups[k])])) continue;
    out->choice.groups.push_back(given.choice.groups[k]);
    out->choice.scales.push_back(given.choice.scales[k]);
  }
  const VectorXd before = squares_with_bodies(problem, given, bodies);
  const VectorXd after = squares_with_bodies(problem, *out, bodies_fitted(problem, *out, *out->sums));
  if (!Search::gains_on_folds(before, after, least_gain / given.search->joints())) return {};
  return out;
}

// The file's inertias as they are, and single links, rotors, loads that differ from it: where that predicts folds as
// well as inertias that are all free, it says more with less. What free inertias take up is named here.
// `flat`: sums of `columns`; `seen`: the model of the free ones.
std::optional<Account> of_given_inertias(const Problem& problem, const DesignColumns& columns, Sums flat,
                                         const TorqueModel& seen, const std::vector<Noise>& noise, const Account& free,
                                         const SearchLimits& limits) {
  SearchLimits more = limits;
  more.most = static_cast<int>(free.choice.groups.size() + problem.robot.driven_count());
  more.masses_given = true;
  const int threads = problem.tiles.threads();
  const auto searched = [&](Sums sums, const Choice& start) {
    Account out = account_of(free.design, std::move(sums), friction_columns(*free.design), threads);
    out.choice = out.search->run(start, more, false);
    out.inertias_given = true;
    return out;
  };
  const TorqueGrams grams = flat.folds.front().joints();
  Account out = searched(std::move(flat), free.choice);
  TorqueModel model = seen;
  if (has_constant_of_drive(out)) {
    // Free inertias take a drive's constant up, and its column with it: now it is the torque that the file's give.
    model = fitted_model(problem, out);
    const TorqueGrams again = sum_grams(columns, problem.nominal, model, problem.train,
                                        {{grams}, false, out.search->idle_flights(out.choice)});
    out = searched(flat_sums_of(again, noise, *free.design, threads), out.choice);
  }
  leave_out_what_hides(&out);
  if (!as_good_as_free(out, free)) return {};
  const Fit bodies = bodies_fitted(problem, out, *out.sums);
  if (!can_do_it(out, bodies)) return {};
  out.freed = freed(problem, out, bodies, limits.least_gain);
  out.held_out = held_out_of(problem, out, model, noise);
  return out;
}

constexpr double kLeastGainOfFunctions = 0.05;  ///< a free function bends to anything: it must remove more than a law
constexpr int kMostFunctions = 6;               ///< more of them are no answer that anybody reads

/// Beside what was named, free functions of what may drive an unknown effect. What was fitted and is too small to be
/// named makes room: it may be what little a law can do for something that nobody knows. It is `small` of the account.
Account with_functions(const Problem& problem, const Account& of_effects, const TorqueModel& model,
                       const SearchLimits& limits, std::vector<Noise>* noise) {
  const std::vector<int>& always = of_effects.search->evidence().nuisance();
  const std::vector<int> groups = groups_in(*of_effects.design, always, of_effects.choice);
  auto design = std::make_shared<TorqueDesign>(part_of(*of_effects.design, groups));
  Choice fitted = of_effects.choice;
  for (int& group : fitted.groups)
    group = static_cast<int>(std::find(groups.begin(), groups.end(), group) - groups.begin());
  std::vector<int> nuisance;
  for (std::size_t g = 0; g < design->groups.size(); ++g) {
    const std::vector<int>& columns = design->groups[g].columns;
    if (std::find(fitted.groups.begin(), fitted.groups.end(), static_cast<int>(g)) == fitted.groups.end())
      nuisance.insert(nuisance.end(), columns.begin(), columns.end());
  }
  const auto [choice, small] = likely_and_small(of_effects, fitted);
  add_free_functions(problem.robot, problem.range, design.get());
  const DesignColumns columns(problem.tiles, *design, Resting::left_out);
  const TorqueGrams grams = sum_grams(columns, problem.nominal, model, problem.train);
  *noise = noise_of_all(problem, columns, grams, *noise);
  std::vector<bool> priors = inertial_columns(*design);
  if (problem.fitted_before || of_effects.inertias_given) priors.assign(priors.size(), false);
  const int threads = problem.tiles.threads();
  Account out = account_of(design, sums_of(grams, *noise, *design, priors, threads), nuisance, threads);
  SearchLimits of_functions = limits;
  of_functions.least_gain = std::max(kLeastGainOfFunctions, limits.least_gain);
  of_functions.most = static_cast<int>(choice.groups.size()) + kMostFunctions;
  out.choice = out.search->run(choice, of_functions, true);
  out.held_out = held_out_of(problem, out, model, *noise);
  out.choice = without_functions_that_fail(out, of_functions.least_gain);
  out.small = small;
  out.inertias_given = of_effects.inertias_given;
  return out;
}

/// "armature.J4 = -0.35 kg m^2": the first parameter of a group beyond what machines have.
std::string beyond_machines(const TorqueDesign& design, const Evidence::State& state, const TorqueGroup& group) {
  for (std::size_t k = 0; k < state.columns.size(); ++k) {
    const TorqueTerm& term = design.terms[static_cast<std::size_t>(state.columns[k])];
    const double value = state.solution[static_cast<Eigen::Index>(k)];
    const bool own = std::find(group.columns.begin(), group.columns.end(), state.columns[k]) != group.columns.end();
    if (own && (value < term.least || value > term.most))
      return term.parameter + " = " + math::number(value, 2) + (term.unit == "-" ? "" : " " + term.unit);
  }
  return {};
}

/// Of every joint without an unknown function, the best of what was refused: it has no name, but where it acts, and
/// like what, is known.
void say_refused(const Account& account, SearchLimits limits, TorqueDiagnosis* out) {
  limits.least_gain = std::max(kLeastGainOfFunctions, limits.least_gain);
  const Search& search = *account.search;
  const double before = search.squares_of_folds(account.choice).sum();
  std::set<std::string> said;
  for (const UnknownTorque& one : out->unknown) said.insert(one.joint);
  for (const Choice& one : search.refused(account.choice, limits)) {
    const TorqueGroup& group = account.design->groups[static_cast<std::size_t>(one.groups.back())];
    if (!said.insert(group.joints.empty() ? "" : group.joints.front()).second) continue;
    const double part = std::min(1.0, (1.0 - search.squares_of_folds(one).sum() / before) * search.joints());
    const std::string where = group.joints.empty() ? "" : " at " + math::listed(group.joints);
    out->warnings.push_back("something that has no name acts like " + group.effect + where + " with " +
                            beyond_machines(*account.design, search.state(one), group) +
                            ", which no machine has: it would remove " + math::number(std::round(100.0 * part)) +
                            " % of a joint's squared error on folds that were not fitted");
  }
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
  const Groundwork groundwork = groundwork_of(&problem, true);
  auto design = std::make_shared<TorqueDesign>(whole_design(problem, options));
  const std::vector<int> nuisance = problem.fitted_before ? std::vector<int>{} : standard_columns(*design);
  std::vector<bool> priors = inertial_columns(*design);
  if (problem.fitted_before) priors.assign(priors.size(), false);  // they are candidates, with priors of their own

  SearchLimits limits;
  limits.least_gain = options.least_gain;
  limits.most = options.max_effects;
  limits.plausible_only = !problem.fitted_before;  // departures from what the robot carries have either sign
  auto columns = std::make_unique<DesignColumns>(problem.tiles, *design, Resting::left_out);
  TorqueModel model = groundwork.model;
  TorqueGrams grams = sum_grams(*columns, problem.nominal, model, problem.train);
  std::vector<Noise> noise = noise_of_all(problem, *columns, grams, groundwork.noise);
  Choice choice;
  std::vector<bool> idle;
  // The torque that some terms need is that of the model found in the round before. What was chosen over another torque
  // than it makes now leaves errors that are no noise, in which what would mend them drowns: so noise is what
  // everything leaves, and only in the last round what the model found leaves.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    bool turned = false;
    if (round + 1 == kRounds && !problem.fitted_before) {
      const TorqueDesign chosen = part_of(*design, groups_in(*design, standard_columns(*design), choice));
      turned = choose_turns_again(&problem, chosen, model, noise, true);
      if (turned) {
        *design = whole_design(problem, options);  // of the same groups
        columns->turned();
        model = model.turning(problem.range.turns);
      }
    }
    if (round > 0) grams = sum_grams(*columns, problem.nominal, model, problem.train, {{grams}, turned, idle});
    const Sums sums = sums_of(grams, noise, *design, priors, options.threads);
    const Search search(*design, sums, nuisance, options.threads);
    choice = search.run(round == 0 ? Choice{} : choice, limits, false);
    model = fitted_model(problem, *design, sums, search, choice);
    idle = search.idle_flights(choice);
    if (round + 2 >= kRounds) noise = noise_of(problem.tiles, model, problem.train);
  }
  Sums flat = flat_sums_of(grams, noise, *design, options.threads);
  Account free = account_of(design, with_priors(flat, *design, priors), nuisance, options.threads);
  free.choice = choice;
  leave_out_what_hides(&free);
  const auto answer = [&](const Account& account, const TorqueModel& of_account) {
    std::vector<Noise> noise_of_functions = noise;
    const Account functions = with_functions(problem, account, of_account, limits, &noise_of_functions);
    TorqueDiagnosis out = named(problem, groundwork, account, noise, functions, noise_of_functions, limits.least_gain);
    if (limits.plausible_only) say_refused(account, limits, &out);
    return out;
  };
  std::optional<Account> given;
  if (!problem.fitted_before) given = of_given_inertias(problem, *columns, std::move(flat), model, noise, free, limits);
  columns.reset();  // large
  if (given) {
    TorqueDiagnosis out = answer(*given, fitted_model(problem, *given));
    if (out.verdict != Verdict::does_not_hold) return out;
  }
  free.held_out = held_out_of(problem, free, model, noise);
  return answer(free, model);
}

}  // namespace dynamics
}  // namespace truing
