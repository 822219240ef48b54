// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "identification/fit.hpp"
#include "math/linear_algebra.hpp"
#include "math/statistics.hpp"

namespace truing::identification {
namespace {

/// Comparable lengths of the training rows' residuals at these values.
std::vector<double> lengths_at(const Job& job, const Evaluator& all, const Eigen::VectorXd& values) {
  Weighing weighing;
  weighing.rotation_scale = job.options.rotation_length;
  std::vector<double> norms(job.data.rows, 0.0);
  all.residual_norms(values, weighing, &norms);
  return comparable_lengths(job, norms);
}

/// Squares of the training rows, those longer than `bound` at their bound.
double bounded_squares(const Job& job, const std::vector<double>& lengths, double bound) {
  double out = 0.0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const double median = kChiMedian[components_of(job.data, static_cast<std::size_t>(job.rows[i]))];
    out += std::pow(std::min(lengths[i], bound) * median, 2.0);
  }
  return out;
}

/// Directions that the rows hardly see: there the floor of the cost may bend within a standard error, so that noise
/// decides into which of its hollows a fit descends (what bends is the parameters' curvature of Bates and Watts,
/// J. Royal Statistical Society B 42 (1980) 1). Places beyond the bends; none where the floor is straight.
std::vector<Eigen::VectorXd> beyond_bends(const Job& job, const Fit& found) {
  constexpr int kWeakest = 2;
  constexpr int kPowers = 20;       // a direction need not be exact
  constexpr double kBent = 10.0;    // times as high as the columns promise
  constexpr double kBeyond = 16.0;  // standard errors
  const std::vector<std::int32_t> rows = without(job.rows, found.rejected);
  const Evaluator evaluator(job.model, job.data, job.bases, make_segments(job.data, rows), found.fitted,
                            job.options.threads);
  Weighing plain;
  plain.rotation_scale = job.options.rotation_length;
  NormalEquations here;
  evaluator.normal_equations(found.values, plain, &here);
  const Eigen::Index p = here.gram.rows();
  const double variance = here.squares / (static_cast<double>(here.components) - static_cast<double>(p));
  if (p == 0 || !(variance > 0.0)) return {};
  const Eigen::VectorXd scale = math::unit_scale<Eigen::Dynamic>(here.gram);
  Eigen::MatrixXd inverse =
      math::scaled_both<Eigen::Dynamic>(scale.cwiseInverse(), math::inverse_of(here.gram));  // of unit columns
  const auto moved = [&](const Eigen::VectorXd& step) {
    Eigen::VectorXd values = found.values;
    for (Eigen::Index i = 0; i < p; ++i) values[found.fitted[static_cast<std::size_t>(i)]] += step[i];
    return values;
  };
  std::vector<double> norms(job.data.rows, 0.0);
  const auto squares_at = [&](const Eigen::VectorXd& values) {
    evaluator.residual_norms(values, plain, &norms);
    return std::accumulate(rows.begin(), rows.end(), 0.0, [&](double sum, std::int32_t row) {
      return sum + std::pow(norms[static_cast<std::size_t>(row)], 2.0);
    });
  };
  std::vector<Eigen::VectorXd> out;
  for (int k = 0; k < kWeakest; ++k) {
    Eigen::VectorXd weakest = Eigen::VectorXd::Ones(p);
    for (int i = 0; i < kPowers; ++i) weakest = (inverse * weakest).normalized();
    const double length = weakest.dot(inverse * weakest);
    if (!(length > 0.0)) break;
    inverse -= length * weakest * weakest.transpose();
    const Eigen::VectorXd step = std::sqrt(variance * length) * scale.cwiseProduct(weakest);
    // A standard error costs one variance where the floor is straight.
    const double rise = 0.5 * (squares_at(moved(step)) + squares_at(moved(-step))) - here.squares;
    if (!(rise > kBent * variance)) break;
    out.push_back(moved(-kBeyond * step));
    out.push_back(moved(kBeyond * step));
  }
  return out;
}

/// How deep fits end, against one of them: rows beyond what that one rejects count as that.
class Depth {
 public:
  Depth(const Job& job, const Fit& of)
      : job_(job),
        all_(job.model, job.data, job.bases, make_segments(job.data, job.rows), of.fitted, job.options.threads) {
    const std::vector<double> lengths = lengths_at(job, all_, of.values);
    if (job.options.loss != Loss::none) bound_ = job.options.reject_beyond * median_of(lengths);
    here_ = bounded_squares(job, lengths, bound_);
  }

  double here() const { return here_; }
  double at(const Fit& other) const { return bounded_squares(job_, lengths_at(job_, all_, other.values), bound_); }
  std::size_t values() const { return all_.components(); }

 private:
  const Job& job_;
  Evaluator all_;
  double bound_ = std::numeric_limits<double>::infinity(), here_ = 0.0;
};

/// The deepest of the hollows in which fits to these rows end that start beyond the bends of one's floor; none if that
/// one is.
std::optional<Fit> deeper_fit(const Job& job, const Fit& here) {
  constexpr double kDeeper = 10.0;  // values' variances: exp(5) times as likely
  const std::vector<Eigen::VectorXd> places = beyond_bends(job, here);
  if (places.empty()) return std::nullopt;
  const Depth depth(job, here);
  double least = depth.here() * (1.0 - kDeeper / static_cast<double>(depth.values()));
  std::optional<Fit> deepest;
  for (const Eigen::VectorXd& place : places) {
    Fit other = descended(job, here, place);
    const double squares = depth.at(other);
    if (!(squares < least)) continue;
    least = squares;
    deepest = std::move(other);
  }
  if (deepest) deepest = settled(job, std::move(*deepest));
  return deepest;
}

}  // namespace

Fit deepest_from(const Job& job, Fit best) {
  constexpr int kMostRounds = 3;
  constexpr int kMostSteps = 1000;
  if (!best.solver.converged || !job.options.priors.empty() || !job.options.bounds.empty()) return best;
  IdentifyOptions options = job.options;
  options.max_iterations = std::min(options.max_iterations, kMostSteps);
  const Job some{job.model, job.data, job.bases, options, evenly(job.rows)};
  const bool all = some.rows.size() == job.rows.size();
  for (int round = 0; round < kMostRounds; ++round) {
    if (!all && beyond_bends(job, best).empty()) break;
    const std::optional<Fit> deeper = deeper_fit(some, all ? best : fit(some, best.fitted, best.values));
    if (!deeper) break;
    Fit other = all && deeper->solver.converged ? *deeper : fit(job, best.fitted, deeper->values);
    if (!all && !(Depth(job, best).at(other) < Depth(job, best).here())) break;
    best = std::move(other);
  }
  return best;
}

}  // namespace truing::identification
