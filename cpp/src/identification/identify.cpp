// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "identification/asked.hpp"
#include "identification/report.hpp"
#include "identification/resamples.hpp"
#include "identification/shrink.hpp"
#include "identification/start.hpp"
#include "identification/uncertainty.hpp"
#include "truing/identify.hpp"

namespace truing {
using namespace identification;

bool IdentifyOptions::is_valid(std::string* error) const {
  const auto fail = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(rotation_length > 0.0)) return fail("rotation_length must be positive [m]");
  if (!(test_share >= 0.0 && test_share < 1.0)) return fail("test_share must be in [0, 1)");
  if (max_iterations < 1) return fail("max_iterations must be at least 1");
  if (!(initial_damping > 0.0)) return fail("initial_damping must be positive");
  if (!(rms_fall >= 0.0) || !(gradient >= 0.0)) return fail("rms_fall and gradient must not be negative");
  if (!(rank_tolerance > 0.0 && rank_tolerance < 1.0)) return fail("rank_tolerance must be in (0, 1)");
  if (!(reject_beyond > 1.0)) return fail("reject_beyond must be more than 1 median");
  if (!(shrink_beyond > 0.0)) return fail("shrink_beyond must be positive [rad, m]; infinity: never");
  if (resamples < 0) return fail("resamples must not be negative");
  if (!bounds.empty() && solver != Solver::ceres) return fail("bounds need solver = ceres");
  if (frame_by == FrameBy::svd && solver == Solver::ceres) return fail("frame_by = svd needs solver = lm");
  if (!(prior_noise >= 0.0 && std::isfinite(prior_noise))) return fail("prior_noise must be finite and not negative");
  for (const auto& [name, sigma] : priors) {
    if (!(sigma > 0.0 && std::isfinite(sigma))) return fail("a prior's standard deviation must be finite and positive");
  }
  for (const auto& [name, bound] : bounds) {
    if (!(bound.first < bound.second)) return fail("a lower bound must be below its upper bound");
  }
  return true;
}

namespace identification {
namespace {

/// A fit; gravity torques are taken from the robot as found until they no longer change. `bases` are the job's.
Fit with_gravity(const Job& job, Fit found, std::vector<std::vector<double>>* bases) {
  constexpr int kRounds = 5;
  constexpr double kUnchanged = 1e-11;
  const auto needs_gravity = [](const Term& term) { return term.needs_gravity; };
  if (!std::any_of(job.model.terms.begin(), job.model.terms.end(), needs_gravity)) return found;
  for (int round = 0; round < kRounds; ++round) {
    const Robot robot = robot_with(job.model, found.values);
    const Model found_model = make_model(robot, job.data, job.options.effects, job.options.own_effects);
    if (found_model.terms.size() != job.model.terms.size())
      break;  // a length that was none: the law stays with the drawing's
    *bases = make_bases(found_model, job.data);
    const Eigen::VectorXd before = found.values;
    found = fit(job, found.fitted, before);
    if ((found.values - before).cwiseAbs().maxCoeff() < kUnchanged) break;
  }
  return found;
}

/// A fit whose links are near the nominal robot, and about how far off it they are.
struct NearNominal {
  Fit fit;
  double size = 0.0;  ///< [rad, m]
};

/// A fit anew, its links near the nominal robot: under a prior of a size that the rows choose, until it stays. Where
/// links are farther off than robots are, the nominal robot tells nothing of them but where to start from: the fit is
/// free, in one of the hollows that are near.
NearNominal shrunk(const Job& job, const Fit& found, const Eigen::VectorXd& start,
                   std::vector<std::vector<double>>* bases) {
  constexpr double kFirst = 0.01;  // [rad, m]
  constexpr int kRounds = 5;
  const std::vector<int> links = links_of(job.model, found.fitted);
  IdentifyOptions options = job.options;
  options.prior_noise = noise_of(job, found);
  const Job near_nominal{job.model, job.data, job.bases, options, job.rows};
  NearNominal out;
  double next = kFirst;
  for (int round = 0; round < kRounds && next != out.size && out.size <= kFarOff; ++round) {
    out.size = next;
    for (const int k : links) options.priors[job.model.parameters[found.fitted[k]].name] = out.size;
    *bases = make_bases(job.model, job.data);
    out.fit = with_gravity(near_nominal, fit(near_nominal, found.fitted, start), bases);
    next = likeliest_error(near_nominal, out.fit, links);
  }
  if (out.size <= kFarOff) return out;
  *bases = make_bases(job.model, job.data);
  out.fit = with_gravity(job, deepest_from(job, fit(job, found.fitted, out.fit.values)), bases);
  unwind(job.model, links, &out.fit);
  return out;
}

}  // namespace
}  // namespace identification

Identification identify(const Robot& nominal, const Measurements& data, const IdentifyOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("identify: " + error);
  validate(nominal);
  validate(data, nominal);
  const SplitRows rows = split_rows(data, options);
  const Model nominal_model = make_model(nominal, data, options.effects, options.own_effects);
  const Asked asked = what_is_asked(nominal_model, data, rows.train, options);

  // Base, targets, anchor and fixed points first: they are always unknown.
  std::vector<std::vector<double>> bases = make_bases(nominal_model, data);
  const Job nominal_job{nominal_model, data, bases, options, rows.train};
  const Start start = find_start(nominal_job, asked.instrument, asked.content, asked.base_free);

  // What can be seen of the rest, and the fit.
  const Model model = make_model(start.robot, data, options.effects, options.own_effects);
  if (model.terms.size() != nominal_model.terms.size()) bases = make_bases(model, data);
  const Job job{model, data, bases, options, rows.train};
  const Seen seen = what_is_seen(job, asked, start.values);
  Fit found = fit(job, seen.selection.fitted, start.values);
  Uncertainty known = uncertainty(job, found, rows.pose, asked.content.poses);
  const auto take = [&](Fit other) {
    found = std::move(other);
    known = uncertainty(job, found, rows.pose, asked.content.poses);
  };
  const auto links_are_barely_seen = [&] {
    return options.priors.empty() && options.bounds.empty() &&
           barely_seen(links_of(model, found.fitted), known.covariance, options.shrink_beyond);
  };
  if (!links_are_barely_seen()) {
    Fit deepest = with_gravity(job, deepest_from(job, found), &bases);
    if (deepest.values != found.values) take(std::move(deepest));
  }
  double off = 0.0;  // about as far as links are; 0: nobody asks
  if (links_are_barely_seen()) {
    NearNominal near = shrunk(job, found, start.values, &bases);
    off = near.size;
    take(std::move(near.fit));
  }

  Identification result;
  result.set = rows.set;
  result.before = start.robot;
  result.robot = robot_with(model, found.values);
  if (!result.robot.effects.empty()) result.robot.fitted_range = ranges_of(data, rows.train);
  result.solver = found.solver;
  result.frozen = seen.selection.frozen;
  result.rank = static_cast<int>(seen.selection.fitted.size());
  result.columns = static_cast<int>(seen.free.size()) + (seen.scale_carrier >= 0 ? 1 : 0);
  for (const std::int32_t row : found.rejected) result.rejected_rows.push_back(static_cast<std::size_t>(row));
  if (off <= kFarOff) result.shrunk_to = off;
  result.covariance = known.covariance;
  result.noise_sigma = known.noise;
  result.rotation_noise_sigma = known.rotation_noise;
  report_parameters(nominal_model, model, seen, found, &result);
  result.local_sigma = result.covariance.diagonal().cwiseSqrt();
  int fits = 0;  // whose scatter is known; none where nobody asks
  if (off > kFarOff) fits = count_scatter(nominal, data, options, rows.pose, &result);
  report_errors(job, asked.content, rows.test, start.values, found, &result);
  result.warnings = make_warnings(result, asked.values, spread_of(job, found.rejected));
  if (off > kFarOff)
    result.warnings.push_back(
        "the rows hardly see some links, and speak for links farther off than robots are: robots of other values may "
        "fit them as well, and standard errors are " +
        (fits > 0 ? "what " + std::to_string(fits) + " fits to poses weighed at random scatter by"
                  : std::string("about this one")));
  return result;
}

}  // namespace truing
