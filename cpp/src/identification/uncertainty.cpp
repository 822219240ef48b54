// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "identification/uncertainty.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimation/clustered.hpp"
#include "math/linear_algebra.hpp"

namespace truing::identification {
namespace {

/// Fewer poses than so many times the parameters cannot say how their scores scatter.
constexpr std::size_t kPosesPerParameter = 2;

/// Covariance with every pose's residuals as one observation, H^-1 M H^-1 (Liang and Zeger 1986); priors scatter as
/// the noise does that they are weighed against. Nothing is known where poses are too few.
std::optional<Eigen::MatrixXd> clustered_by_pose(const FittedRows& fitted, const Fit& found,
                                                 const std::vector<std::int32_t>& pose, const Eigen::MatrixXd& inverse,
                                                 double sigma2) {
  if (clusters_in(fitted.rows, pose) < kPosesPerParameter * fitted.free.size()) return std::nullopt;
  Weighing weighing = found.weighing;
  weighing.prior = {};
  Eigen::MatrixXd middle = clustered_scores(fitted, found.values, weighing, inverse, pose);
  if (found.weighing.prior.weight.size() > 0) middle.diagonal() += sigma2 * found.weighing.prior.weight;
  return inverse * middle * inverse;
}

/// From so many poses a parameter on, none decides much of the fit: the leverage of each one's mean will do.
constexpr std::size_t kManyPosesPerParameter = 5;

/// Covariance of few poses, clustered, with the whole leverage of each. Their scores span as many directions as there
/// are poses. What lacks to two poses a parameter is `plain` in their place, s^2 H^-1 or the like, as large as theirs
/// (shrinking as Ledoit and Wolf, J. Multivariate Analysis 88 (2004) 365, do). Nothing is known where half of all
/// directions would be missing.
std::optional<Eigen::MatrixXd> clustered_by_few_poses(const FittedRows& fitted, const Fit& found,
                                                      const std::vector<std::int32_t>& pose,
                                                      const NormalEquations& normal, const Eigen::MatrixXd& inverse,
                                                      const Eigen::MatrixXd& plain) {
  const auto p = static_cast<double>(fitted.free.size());
  const double lacking = 1.0 - static_cast<double>(clusters_in(fitted.rows, pose)) / (kPosesPerParameter * p);
  if (lacking > 0.75) return std::nullopt;
  const Eigen::MatrixXd middle = few_clusters_scores(fitted, found.values, found.weighing, inverse, pose);
  const Eigen::MatrixXd clustered = inverse * middle * inverse;
  if (lacking <= 0.0) return clustered;
  const double as_large = middle.cwiseProduct(inverse).sum() / plain.cwiseProduct(normal.gram).sum();
  return (1.0 - lacking) * clustered + lacking * as_large * plain;
}

}  // namespace

Uncertainty uncertainty(const Job& job, const Fit& found, const std::vector<std::int32_t>& pose, bool poses) {
  Uncertainty out;
  const std::vector<std::int32_t> rows = without(job.rows, found.rejected);
  const Evaluator evaluator(job.model, job.data, job.bases, make_segments(job.data, rows), found.fitted,
                            job.options.threads);
  NormalEquations all;
  evaluator.normal_equations(found.values, found.weighing, &all);
  const Eigen::MatrixXd inverse = inverse_of(all.gram);
  double position_components = 0.0, rotation_components = 0.0, sigma2 = 0.0;
  for (const std::int32_t row : rows) {
    const int components = components_of(job.data, row);
    position_components += std::min(components, 3);
    rotation_components += components == 6 ? 3 : 0;
  }
  Weighing positions_only = found.weighing;
  // Parameters that the rows pay for: priors pay for the rest.
  const Eigen::VectorXd& known = found.weighing.prior.weight;
  const double p = static_cast<double>(found.fitted.size()) - (known.size() > 0 ? known.dot(inverse.diagonal()) : 0.0);
  if (!poses) {
    sigma2 = all.squares / std::max(1.0, position_components - p);
    out.covariance = sigma2 * inverse;
  } else {
    positions_only.rotation_scale = 0.0;
    NormalEquations position;
    evaluator.normal_equations(found.values, positions_only, &position);
    const Eigen::MatrixXd rotation_gram = all.gram - position.gram;
    const double p_position = (inverse * position.gram).trace();  // parameters that the positions pay for
    sigma2 = position.squares / std::max(1.0, position_components - p_position);
    const double sigma2_rotation =
        (all.squares - position.squares) / std::max(1.0, rotation_components - (p - p_position));
    out.covariance = inverse * (sigma2 * position.gram + sigma2_rotation * rotation_gram) * inverse;
    out.rotation_noise = std::sqrt(sigma2_rotation) / found.weighing.rotation_scale;
  }
  const FittedRows fitted{job.model, job.data, job.bases, found.fitted, rows, job.options.threads};
  const bool few = known.size() == 0 && clusters_in(rows, pose) < kManyPosesPerParameter * found.fitted.size();
  if (auto clustered = few ? clustered_by_few_poses(fitted, found, pose, all, inverse, out.covariance)
                           : clustered_by_pose(fitted, found, pose, inverse, sigma2))
    out.covariance = std::move(*clustered);
  out.noise = std::sqrt(sigma2);
  if (job.data.position_sigma || job.data.weight) {  // unit-weight residuals are not metres then
    const ErrorLengths errors = error_lengths(job, evaluator, found.values, poses);
    double position = 0.0, rotation = 0.0;
    for (const std::int32_t row : rows) {
      position += errors.position[row] * errors.position[row];
      if (poses && std::isfinite(errors.rotation[row]))
        rotation += static_cast<double>(errors.rotation[row]) * static_cast<double>(errors.rotation[row]);
    }
    const double per_degree_of_freedom =
        (position_components + rotation_components) / std::max(1.0, position_components + rotation_components - p);
    out.noise = std::sqrt(position / position_components * per_degree_of_freedom);
    if (poses) out.rotation_noise = std::sqrt(rotation / rotation_components * per_degree_of_freedom);
  }
  return out;
}

}  // namespace truing::identification
