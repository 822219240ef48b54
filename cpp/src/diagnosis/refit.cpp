// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// How far the error shrinks: the exact refit, errors of rows, noise from repeats.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>

#include "math/statistics.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;

/// Lengths of the position (or distance) errors that a linear model leaves on the design's held-out rows, in order.
std::vector<double> held_out_lengths(const Design& design, const Evidence::State& state) {
  std::vector<double> out;
  std::int32_t last = -1;
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    if (design.fold[static_cast<std::size_t>(i)] < design.folds ||
        kind_of(design.component[static_cast<std::size_t>(i)]) == 1)
      continue;
    double e = design.y[i];
    for (std::size_t c = 0; c < state.columns.size(); ++c)
      e -= design.x(i, state.columns[c]) * state.solution[static_cast<Eigen::Index>(c)];
    const std::int32_t row = design.row[static_cast<std::size_t>(i)];
    if (row != last) out.push_back(0.0);
    last = row;
    out.back() += e * e;
  }
  for (double& length : out) length = std::sqrt(length);
  return out;
}

Share percentile_interval(std::vector<double> values, double center) {
  Share out{center, center, center};
  if (values.size() < 5) return out;
  // Folds are few and whole: their spread is a little less than that of poses (measured by the examination,
  // docs/method/exam.md).
  constexpr double kWider = 1.25;
  const double median = quantile(&values, 0.5);
  out.low = center + kWider * (quantile(&values, 0.05) - median);
  out.high = center + kWider * (quantile(&values, 0.95) - median);
  return out;
}

/// A column's parameter in the linear model.
static double solution_of(const Work& work, const Evidence::State& state, const std::string& name) {
  const int column = work.design.column(name);
  const auto at = std::find(state.columns.begin(), state.columns.end(), column) - state.columns.begin();
  return column >= 0 && at < static_cast<std::ptrdiff_t>(state.columns.size())
             ? state.solution[static_cast<Eigen::Index>(at)]
             : 0.0;
}

/// The chosen groups fitted without linearisation on the training rows.
static Refit refit_with(const Work& work, const Robot& robot, const Evidence::State& state,
                        const std::vector<int>& groups, bool hold_moments) {
  Refit out;
  Robot start = robot;
  IdentifyOptions options;
  options.threads = work.options.threads;
  options.seed = work.options.seed;
  options.own_effects = work.options.own_effects;
  std::vector<std::string> targets;
  for (const Target& target : robot.targets) targets.push_back(target.name + ".*");
  if (targets.empty()) targets.push_back("tool.*");
  options.free = targets;
  std::set<std::pair<std::string, std::string>> asked;
  for (const int g : groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    options.free.insert(options.free.end(), e.model_free.begin(), e.model_free.end());
    const bool many = std::any_of(e.requests.begin(), e.requests.end(),
                                  [](const EffectRequest& request) { return request.effect == "gravity_moment"; });
    if (many && hold_moments) {
      // First moments of unknown weights are many and hardly told apart: they stay as the search found them, under its
      // prior.
      for (const EffectRequest& request : e.requests) {
        AppliedEffect applied{request.effect, request.joints, {}};
        for (const std::string& name : e.parameters) {
          if (name.compare(0, request.effect.size() + 1, request.effect + ".") == 0)
            applied.parameters[name] = solution_of(work, state, name);
        }
        start.effects.push_back(std::move(applied));
      }
      continue;
    }
    for (const EffectRequest& request : e.requests) {
      if (request.effect == "gear_ratio" || request.effect == "joint_offset" || request.effect == "link_geometry")
        continue;
      if (asked.insert({request.effect, request.joints.empty() ? "" : request.joints[0]}).second)
        options.effects.push_back(request);
    }
    if (e.kind == Kind::law || e.kind == Kind::free || e.kind == Kind::drift) {
      const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(g)].columns;
      Eigen::VectorXd coefficients(static_cast<Eigen::Index>(columns.size()));
      for (Eigen::Index k = 0; k < coefficients.size(); ++k) {
        const auto at = std::find(state.columns.begin(), state.columns.end(), columns[static_cast<std::size_t>(k)]) -
                        state.columns.begin();
        coefficients[k] = state.solution[static_cast<Eigen::Index>(at)];
      }
      options.own_effects.push_back(free_effect(e, coefficients, work.inputs));
      options.effects.push_back({options.own_effects.back().name, {}});
    }
  }
  // One request an effect, with all of its joints.
  std::vector<EffectRequest> merged;
  for (const EffectRequest& request : options.effects) {
    auto same = std::find_if(merged.begin(), merged.end(), [&](const EffectRequest& other) {
      return other.effect == request.effect && !other.joints.empty();
    });
    if (same != merged.end() && !request.joints.empty())
      same->joints.insert(same->joints.end(), request.joints.begin(), request.joints.end());
    else
      merged.push_back(request);
  }
  options.effects = merged;
  out.own = options.own_effects;
  Measurements data = work.data;
  data.set = work.set;
  out.found = identify(start, data, options);
  return out;
}

Refit refit(const Work& work, const Robot& robot, const Evidence::State& state, const std::vector<int>& groups) {
  Refit out = refit_with(work, robot, state, groups, true);
  // Moments that lean on geometry which the fit holds elsewhere do not fit there: then they are fitted with it.
  if (out.found.train.after.median > work.frames.train.after.median)
    out = refit_with(work, robot, state, groups, false);
  return out;
}

std::vector<double> lengths_of(const Residuals& residuals, std::size_t rows) {
  std::vector<double> out(rows, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t row = 0; row < rows; ++row) {
    const auto i = static_cast<Eigen::Index>(row);
    const double d = residuals.distance[i];
    out[row] = d == d ? std::abs(d) : residuals.position.row(i).norm();
  }
  return out;
}

std::vector<double> held_out(const std::vector<double>& lengths, const std::vector<std::int8_t>& set) {
  std::vector<double> out;
  for (std::size_t row = 0; row < lengths.size(); ++row) {
    if (set[row] && std::isfinite(lengths[row])) out.push_back(lengths[row]);
  }
  return out;
}

/// Rows of one target at equal joints, directions and payload; copies of a row are no repeats.
Repeats noise_of_repeats(const Measurements& data) {
  using Measured = std::vector<double>;
  std::map<std::vector<double>, std::set<Measured>> same;
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (!data.has_position(row) && !data.has_distance(row)) continue;
    std::vector<double> key;
    for (const Column& column : data.joints) key.push_back(column[row]);
    for (const Column& column : data.direction) key.push_back(column ? column[row] : 0.0);
    key.push_back(data.payload ? data.payload[row] : 0.0);
    key.push_back(data.target.empty() ? 0.0 : data.target[row]);
    key.push_back(data.has_distance(row) ? 1.0 : 3.0);
    if (data.has_distance(row))
      same[std::move(key)].insert({data.distance[row]});
    else
      same[std::move(key)].insert({data.position[0][row], data.position[1][row], data.position[2][row]});
  }
  Repeats out;
  double sum = 0.0;
  for (const auto& [key, repeats] : same) {
    const auto count = static_cast<double>(repeats.size());
    const std::size_t components = repeats.begin()->size();
    for (std::size_t c = 0; c < components && repeats.size() > 1; ++c) {
      double mean = 0.0;
      for (const Measured& one : repeats) mean += one[c] / count;
      for (const Measured& one : repeats) sum += (one[c] - mean) * (one[c] - mean);
      out.freedom += count - 1.0;
    }
  }
  if (out.freedom > 0.0) out.sigma = std::sqrt(sum / out.freedom);
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
  const double error = std::sqrt(spread * spread / static_cast<double>(sigmas.size()) + 0.5 / repeats.freedom);
  return (std::log(std::max(median_of(sigmas), 1e-300) / repeats.sigma) - kFitted) / error;
}

std::vector<std::int32_t> thinned_rows(const Measurements& data, const std::vector<std::int32_t>& cluster,
                                       std::size_t most) {
  const std::size_t clusters =
      cluster.empty() ? 0 : static_cast<std::size_t>(*std::max_element(cluster.begin(), cluster.end())) + 1;
  std::vector<std::int32_t> rows;
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (data.weight && data.weight[row] == 0.0) continue;
    // Evenly in order of appearance: of n clusters, `most`.
    const auto c = static_cast<std::size_t>(cluster[row]);
    if (clusters > most && c * most / clusters == (c + 1) * most / clusters) continue;
    rows.push_back(static_cast<std::int32_t>(row));
  }
  return rows;
}

/// The rows as data of their own, so that nothing is computed for the others.
struct SubsetColumns {
  std::vector<std::vector<double>> columns;
};

Measurements subset_of(const Measurements& data, const std::vector<std::int32_t>& rows) {
  auto owned = std::make_shared<SubsetColumns>();
  Measurements out;
  out.rows = rows.size();
  const auto take = [&](const Column& from, Column* to) {
    if (!from) return;
    std::vector<double> values(rows.size());
    for (std::size_t k = 0; k < rows.size(); ++k) values[k] = from[static_cast<std::size_t>(rows[k])];
    owned->columns.push_back(std::move(values));
    *to = {owned->columns.back().data(), 1};  // a vector keeps its memory when it is moved
  };
  const auto take_all = [&](const std::vector<Column>& from, std::vector<Column>* to) {
    to->resize(from.size());
    for (std::size_t k = 0; k < from.size(); ++k) take(from[k], &(*to)[k]);
  };
  take_all(data.joints, &out.joints);
  take_all(data.direction, &out.direction);
  take_all(data.joint_speed, &out.joint_speed);
  for (std::size_t k = 0; k < 3; ++k) take(data.position[k], &out.position[k]);
  for (std::size_t k = 0; k < 4; ++k) take(data.orientation[k], &out.orientation[k]);
  take(data.distance, &out.distance);
  take(data.payload, &out.payload);
  take(data.temperature, &out.temperature);
  take(data.time, &out.time);
  take(data.position_sigma, &out.position_sigma);
  take(data.rotation_sigma, &out.rotation_sigma);
  take(data.weight, &out.weight);
  for (const auto& [name, column] : data.covariates) take(column, &out.covariates[name]);
  out.fixed_point_names = data.fixed_point_names;
  for (const std::int32_t row : rows) {
    const auto r = static_cast<std::size_t>(row);
    if (!data.fixed_point.empty()) out.fixed_point.push_back(data.fixed_point[r]);
    if (!data.target.empty()) out.target.push_back(data.target[r]);
    if (!data.set.empty()) out.set.push_back(data.set[r]);
  }
  out.owner = owned;
  return out;
}

/// Own effects may look values up by row: of the whole data, not of the subset.
std::vector<Effect> mapped(const std::vector<Effect>& own, const Measurements& whole,
                           const std::vector<std::int32_t>& rows) {
  std::vector<Effect> out = own;
  for (Effect& effect : out) {
    effect.terms = [terms = effect.terms, &whole, &rows](const Robot& robot, std::size_t joint, const Measurements&) {
      std::vector<Term> made = terms(robot, joint, whole);
      for (Term& term : made) {
        term.basis = [basis = term.basis, &whole, &rows](const Inputs& in) {
          Inputs of_whole = in;
          of_whole.data = &whole;
          of_whole.row = static_cast<std::size_t>(rows[in.row]);
          return basis(of_whole);
        };
      }
      return made;
    };
  }
  return out;
}

}  // namespace truing::diagnosis
