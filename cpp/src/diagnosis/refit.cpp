// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// How far the error shrinks: the exact refit, errors of rows, and by how much they exceed the noise of repeats.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "math/statistics.hpp"
#include "model/effects/traits.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;

Share percentile_interval(std::vector<double> values, double center) {
  Share out{center, center, center};
  if (values.size() < 5) return out;
  // Folds are few and whole: their spread is a little less than that of poses (measured by the examination,
  // docs/method/exam.md).
  constexpr double kWider = 1.45;
  const double median = quantile(&values, 0.5);
  out.low = center + kWider * (quantile(&values, 0.05) - median);
  out.high = center + kWider * (quantile(&values, 0.95) - median);
  return out;
}

/// A column's parameter in the linear model; 0: the column is not in it.
static double solution_of(const Evidence::State& state, int column) {
  const auto at = std::find(state.columns.begin(), state.columns.end(), column) - state.columns.begin();
  return at < static_cast<std::ptrdiff_t>(state.columns.size()) ? state.solution[static_cast<Eigen::Index>(at)] : 0.0;
}

static Eigen::VectorXd solutions_of(const Evidence::State& state, const std::vector<int>& columns) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index k = 0; k < out.size(); ++k) out[k] = solution_of(state, columns[static_cast<std::size_t>(k)]);
  return out;
}

/// Parameters of the model that `identify` will have for the explanation: at the nominal robot, whose lengths may be
/// none where the search's are not.
static std::set<std::string> parameters_at(const Robot& robot, const Explanation& e, const Registered& given) {
  std::set<std::string> out(e.model_free.begin(), e.model_free.end());
  for (const Term& term : effect_terms(e.requests, robot, given.data, given.options.own_effects))
    out.insert(term.parameter);
  return out;
}

/// Standard deviation that the search gave the group's parameters beforehand, or what few poses hardly show would run
/// away in the fit without linearisation. Of a parameter of two groups, the wider one.
static void add_priors(const Design& design, int group, double scale, const std::set<std::string>& there,
                       std::map<std::string, double>* priors) {
  for (const int column : design.candidates.groups[static_cast<std::size_t>(group)].columns) {
    const std::string& name = design.column_names[static_cast<std::size_t>(column)];
    if (!there.count(name)) continue;
    double& sigma = (*priors)[name];
    sigma = std::max(sigma, scale * design.prior[column]);
  }
}

/// One request an effect, with all of its joints.
static std::vector<EffectRequest> merged(const std::vector<EffectRequest>& requests) {
  std::vector<EffectRequest> out;
  for (const EffectRequest& request : requests) {
    const auto same = std::find_if(out.begin(), out.end(), [&](const EffectRequest& other) {
      return other.effect == request.effect && !other.joints.empty();
    });
    if (same != out.end() && !request.joints.empty())
      same->joints.insert(same->joints.end(), request.joints.begin(), request.joints.end());
    else
      out.push_back(request);
  }
  return out;
}

/// Parameters of the forms that were not chosen of the effects that were.
static std::vector<std::string> other_forms(const Design& design, const Evidence::State& state,
                                            const std::vector<int>& groups) {
  std::set<std::string> chosen, others;
  for (const int g : state.choice.groups) {
    if (std::find(groups.begin(), groups.end(), g) == groups.end()) continue;
    const Explanation& e = design.candidates.named[static_cast<std::size_t>(g)];
    if (e.kind != Kind::catalogue) continue;
    chosen.insert(e.parameters.begin(), e.parameters.end());
    for (const Explanation& other : design.candidates.named) {
      if (other.kind == Kind::catalogue && other.constants.empty() && same_name(other, e))
        others.insert(other.parameters.begin(), other.parameters.end());
    }
  }
  std::vector<std::string> out;
  std::set_difference(others.begin(), others.end(), chosen.begin(), chosen.end(), std::back_inserter(out));
  return out;
}

/// Variance of what these groups of a choice leave alone: beside others they would leave less.
static double variance_left_by(const Work& work, const Choice& choice, const std::vector<int>& groups) {
  return evidence_now(work).evaluate(only_these(choice, groups)).sigma2;
}

RefitTask refit_task(const Work& work, const std::vector<InputColumn>& inputs, const Robot& robot,
                     const Evidence::State& state, const std::vector<int>& groups) {
  const Design& design = work.design;
  const DiagnoseOptions& options = work.given.options;
  RefitTask out;
  out.start = robot;
  out.options.threads = options.threads;
  out.options.seed = options.seed;
  out.options.own_effects = options.own_effects;
  out.options.free = targets_of(robot);
  out.options.prior_noise =
      work.noise.unit * std::sqrt(variance_left_by(work, state.choice, groups) * work.noise.design_effect);
  std::set<std::pair<std::string, std::string>> asked;
  for (std::size_t at = 0; at < state.choice.groups.size(); ++at) {
    const int g = state.choice.groups[at];
    if (std::find(groups.begin(), groups.end(), g) == groups.end()) continue;
    const Explanation& e = design.candidates.named[static_cast<std::size_t>(g)];
    out.options.free.insert(out.options.free.end(), e.model_free.begin(), e.model_free.end());
    if (!e.constants.empty()) out.start.effects.push_back({e.effect, e.joints, e.constants});
    for (const EffectRequest& request : e.requests) {
      if (model::traits_of(request.effect, {}).stands_for != StandsFor::terms) continue;
      if (asked.insert({request.effect, request.joints.empty() ? "" : request.joints[0]}).second)
        out.options.effects.push_back(request);
    }
    if (e.kind == Kind::law || e.kind == Kind::free || e.kind == Kind::drift) {
      const std::vector<int>& columns = design.candidates.groups[static_cast<std::size_t>(g)].columns;
      out.options.own_effects.push_back(free_effect(e, solutions_of(state, columns), inputs));
      out.options.effects.push_back({out.options.own_effects.back().name, {}});
    } else {
      add_priors(design, g, state.choice.scales[at], parameters_at(robot, e, work.given), &out.options.priors);
    }
  }
  out.options.hold = other_forms(design, state, groups);
  out.options.effects = merged(out.options.effects);
  return out;
}

/// The size of a group is that of most of its parameters, and a few are many times larger: every parameter has a
/// variance of its own. One EM step of a Student-t prior of one degree of freedom about the group's `usual` size
/// (Tipping 2001, Sparse Bayesian learning): its posterior mean square and the usual variance, half each.
static void give_each_its_size(const std::map<std::string, double>& usual, const Identification& found,
                               std::map<std::string, double>* priors) {
  for (const Parameter& p : found.parameters) {
    const auto prior = usual.find(p.name);
    if (prior == usual.end() || p.frozen) continue;
    double& size = (*priors)[p.name];
    const double away = p.value - p.nominal,
                 error = std::min(p.sigma, size);  // of a posterior: no more than the prior's
    size = std::sqrt(0.5 * (prior->second * prior->second + away * away + error * error));
  }
}

/// No value has moved by a tenth of its standard error.
static bool settled(const Identification& before, const Identification& after) {
  for (std::size_t k = 0; k < after.parameters.size(); ++k) {
    const Parameter &was = before.parameters[k], &is = after.parameters[k];
    if (!is.frozen && std::abs(is.value - was.value) > 0.1 * is.sigma) return false;
  }
  return true;
}

Refit refit(const Registered& whole, const Work& work, const std::vector<InputColumn>& inputs, const Robot& robot,
            const Evidence::State& state, const std::vector<int>& groups) {
  constexpr int kMostRounds = 8;
  Measurements data = whole.data;
  data.set = whole.set;
  RefitTask task = refit_task(work, inputs, robot, state, groups);
  const std::map<std::string, double> usual = task.options.priors;
  Refit out{identify(task.start, data, task.options), task.options.own_effects};
  for (int round = 0; round < kMostRounds && !usual.empty(); ++round) {
    give_each_its_size(usual, out.found, &task.options.priors);
    const Identification before = std::move(out.found);
    out.found = identify(task.start, data, task.options);
    if (settled(before, out.found)) break;
  }
  return out;
}

Robot with_tables(const Work& work, const std::vector<InputColumn>& inputs, const Evidence::State& state,
                  const std::vector<int>& groups, const Refit& refitted) {
  Robot out = refitted.found.robot;
  for (const int g : groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    if (!fits_in_tables(e, inputs)) continue;
    const Eigen::VectorXd shape =
        solutions_of(state, work.design.candidates.groups[static_cast<std::size_t>(g)].columns);
    const std::string name = free_effect(e, shape, inputs).name;
    const auto applied = std::find_if(out.effects.begin(), out.effects.end(),
                                      [&](const AppliedEffect& effect) { return effect.effect == name; });
    if (applied == out.effects.end()) continue;
    const double times = applied->parameters.at(name);
    out.effects.erase(applied);
    for (const LookupTable& table : tables_of(e, times * shape, inputs, out)) add_table(table, &out);
  }
  return out;
}

/// By how many standard errors held-out errors exceed the noise that repeats show, and the 5 % that fitting a few
/// frames may add. Of medians: a few rows far out are no lack of fit.
double lack_of_fit(const Measurements& data, const std::vector<double>& lengths, const std::vector<std::int8_t>& set,
                   const Repeats& repeats) {
  constexpr double kFitted = 0.05;
  constexpr double kSpread[2] = {
      0.562, 1.166};  // sqrt(n) standard errors of the logarithm of a median length: 3 components, 1
  std::vector<double> sigmas;
  bool distances = false;
  for (std::size_t row = 0; row < lengths.size(); ++row) {
    if (!set[row] || !std::isfinite(lengths[row])) continue;
    distances |= data.has_distance(row);
    sigmas.push_back(lengths[row] / kChiMedian[data.has_distance(row) ? 1 : 3]);
  }
  if (sigmas.empty() || !(repeats.sigma > 0.0)) return 0.0;
  const double spread = kSpread[distances ? 1 : 0];
  const double error =
      std::sqrt(spread * spread / static_cast<double>(sigmas.size()) + 0.5 / repeats.degrees_of_freedom);
  return (std::log(std::max(median_of(sigmas), 1e-300) / repeats.sigma) - kFitted) / error;
}

}  // namespace truing::diagnosis
