// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "identification/fit.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "math/constants.hpp"
#include "math/observability.hpp"
#include "math/registration.hpp"
#include "math/rotation.hpp"
#include "math/statistics.hpp"

namespace truing::identification {
int components_of(const Measurements& data, std::size_t row) {
  if (data.has_fixed_point(row)) return 3;
  if (data.has_distance(row)) return 1;
  return data.has_orientation(row) ? 6 : 3;
}

std::vector<std::int32_t> without(const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& left_out) {
  std::vector<std::int32_t> out;
  std::set_difference(rows.begin(), rows.end(), left_out.begin(), left_out.end(), std::back_inserter(out));
  return out;
}

// At most so many rows are enough to start from.
constexpr std::size_t kStartRows = 4096;

std::vector<std::int32_t> evenly(const std::vector<std::int32_t>& rows) {
  std::vector<std::int32_t> out;
  const std::size_t step = (rows.size() + kStartRows - 1) / kStartRows;
  for (std::size_t i = 0; i < rows.size(); i += step) out.push_back(rows[i]);
  return out;
}

std::vector<double> comparable_lengths(const Job& job, const std::vector<double>& norms) {
  std::vector<double> out;
  out.reserve(job.rows.size());
  for (const std::int32_t row : job.rows)
    out.push_back(norms[static_cast<std::size_t>(row)] / kChiMedian[components_of(job.data, row)]);
  return out;
}

namespace {

using kernel::RowLoss;

SolverSummary solve(const Job& job, const Evaluator& evaluator, const Weighing& weighing, const Refit& refit,
                    Eigen::VectorXd* values) {
  return job.options.solver == Solver::ceres ? solve_with_ceres(evaluator, job.model, weighing, job.options, values)
                                             : levenberg_marquardt(evaluator, weighing, job.options, refit, values);
}

/// The measurement frame refitted to the current predictions by SVD.
Refit frame_by_registration(const Model& model, const Measurements& data, const Evaluator& evaluator,
                            std::vector<std::int32_t> rows) {
  return [&model, &data, &evaluator, rows](Eigen::VectorXd* values) {
    const auto n = static_cast<Eigen::Index>(rows.size());
    Eigen::Matrix3Xd from(3, n), to(3, n);
    evaluator.predict(*values, [&](std::size_t row, const double* frame) {
      const auto i = std::lower_bound(rows.begin(), rows.end(), static_cast<std::int32_t>(row)) - rows.begin();
      for (int k = 0; k < 3; ++k) {
        from(k, i) = frame[k];
        to(k, i) = data.position[static_cast<std::size_t>(k)][row];
      }
    });
    const Eigen::Isometry3d correction = register_points(from, to);
    const Eigen::Isometry3d base = correction * robot_with(model, *values).T_measurement_base;
    const Eigen::Vector3d rpy = rpy_from_rotation(base.linear() * model.robot.T_measurement_base.linear().transpose());
    const char* const names[6] = {"base.x", "base.y", "base.z", "base.rx", "base.ry", "base.rz"};
    for (int k = 0; k < 6; ++k) (*values)[model.parameter_index(names[k])] = k < 3 ? base.translation()[k] : rpy[k - 3];
  };
}

/// Rows whose residual is longer than `beyond` medians.
std::vector<std::int32_t> gross_outliers(const Job& job, const std::vector<double>& norms, double beyond) {
  const std::vector<double> comparable = comparable_lengths(job, norms);
  const double bound = beyond * median_of(comparable);
  std::vector<std::int32_t> out;
  for (std::size_t i = 0; i < job.rows.size(); ++i) {
    if (comparable[i] > bound) out.push_back(job.rows[i]);
  }
  return out;
}

/// Scale of a robust loss in medians of the residual's length.
double loss_medians(Loss loss) { return loss == Loss::tukey ? 6.0 : 1.5; }

RowLoss row_loss(Loss loss) {
  switch (loss) {
    case Loss::huber:
      return RowLoss::huber;
    case Loss::cauchy:
      return RowLoss::cauchy;
    case Loss::tukey:
      return RowLoss::tukey;
    default:
      return RowLoss::none;
  }
}

/// Noise of a unit-weight component, from the median row; NaN: no more values than parameters.
double noise_of(const Job& job, const std::vector<int>& fitted, const std::vector<double>& norms) {
  double values = 0.0;
  for (const std::int32_t row : job.rows) values += components_of(job.data, static_cast<std::size_t>(row));
  const double free_values = values - static_cast<double>(fitted.size());
  return free_values > 0.0 ? median_of(comparable_lengths(job, norms)) * std::sqrt(values / free_values) : kNaN;
}

}  // namespace

Prior prior_of(const Job& job, const std::vector<int>& fitted, double noise) {
  const Eigen::VectorXd nominal = initial_values(job.model);
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(nominal.size());
  for (const auto& [glob, sigma] : job.options.priors) {
    for (const int k : find_parameters(job.model, {glob}))
      weight[k] = std::max(weight[k], std::pow(noise / sigma, 2.0));
  }
  Prior out;
  out.center = nominal(fitted);
  out.weight = weight(fitted);
  return out;
}

namespace {

/// Beyond so many medians of what the robot as drawn leaves, a row is no measurement of it but a fault: a comma lost, a
/// tracker that followed another reflector. A single one of a kilometre would carry plain least squares where no later
/// rejection finds back from. Whether the row stays out is decided by the fit that starts without it.
constexpr double kImpossible = 20.0;

}  // namespace

Fit fit(const Job& job, const std::vector<int>& fitted, const Eigen::VectorXd& start) {
  Fit out;
  out.values = start;
  out.fitted = fitted;
  out.weighing.rotation_scale = job.options.rotation_length;
  const Evaluator evaluator(job.model, job.data, job.bases, make_segments(job.data, job.rows), fitted,
                            job.options.threads);
  const bool by_svd = job.options.frame_by == FrameBy::svd && std::any_of(fitted.begin(), fitted.end(), [&](int k) {
                        return job.model.parameters[k].role == Role::base;
                      });
  const auto refit_on = [&](const Evaluator& of_rows, const std::vector<std::int32_t>& rows) {
    return by_svd ? frame_by_registration(job.model, job.data, of_rows, rows) : Refit();
  };
  const Refit refit = refit_on(evaluator, job.rows);
  std::vector<double> norms(job.data.rows, 0.0);
  std::vector<std::int32_t> possible = job.rows;
  if (job.options.loss != Loss::none) {
    evaluator.residual_norms(out.values, out.weighing, &norms);
    possible = without(job.rows, gross_outliers(job, norms, kImpossible));
  }
  const bool all_possible = possible.size() == job.rows.size();
  std::optional<Evaluator> some;
  if (!all_possible)
    some.emplace(job.model, job.data, job.bases, make_segments(job.data, possible), fitted, job.options.threads);
  const Evaluator& first = some ? *some : evaluator;
  const auto solve_possible = [&] { return solve(job, first, out.weighing, refit_on(first, possible), &out.values); };
  double noise = job.options.prior_noise;
  if (!job.options.priors.empty() && !(noise > 0.0)) {
    solve_possible();
    evaluator.residual_norms(out.values, out.weighing, &norms);
    noise = noise_of(job, fitted, norms);
    out.values = start;
  }
  if (!job.options.priors.empty()) out.weighing.prior = prior_of(job, fitted, noise);
  out.solver = solve_possible();
  if (job.options.loss == Loss::none) return out;

  const auto median_norm = [&] {
    evaluator.residual_norms(out.values, out.weighing, &norms);
    std::vector<double> of_rows;
    for (const std::int32_t row : job.rows) of_rows.push_back(norms[row]);
    return median_of(std::move(of_rows));
  };
  int iterations = out.solver.iterations;
  const auto robust_rounds = [&](RowLoss loss, double medians, int rounds, double settled) {
    for (int round = 0; round < rounds; ++round) {
      const double scale = medians * median_norm();
      if (!(scale > 0.0) || (round > 0 && std::abs(scale / out.weighing.loss_scale - 1.0) < settled)) break;
      out.weighing.loss = loss;
      out.weighing.loss_scale = scale;
      out.solver = solve(job, evaluator, out.weighing, refit, &out.values);
      iterations += out.solver.iterations;
    }
  };
  if (job.options.loss != Loss::reject) {
    robust_rounds(row_loss(job.options.loss), loss_medians(job.options.loss), 10, 1e-3);
    out.solver.iterations = iterations;
    return out;
  }

  evaluator.residual_norms(out.values, out.weighing, &norms);
  if (gross_outliers(job, norms, job.options.reject_beyond).empty()) {
    if (!all_possible) out.solver = solve(job, evaluator, out.weighing, refit, &out.values);
    return out;
  }
  robust_rounds(RowLoss::cauchy, loss_medians(Loss::cauchy), 3, 1e-2);
  out.weighing.loss = RowLoss::none;
  for (int round = 0; round < 10; ++round) {
    evaluator.residual_norms(out.values, out.weighing, &norms);
    std::vector<std::int32_t> rejected = gross_outliers(job, norms, job.options.reject_beyond);
    if (round > 0 && rejected == out.rejected) break;
    out.rejected = std::move(rejected);
    const std::vector<std::int32_t> kept = without(job.rows, out.rejected);
    const Evaluator clean(job.model, job.data, job.bases, make_segments(job.data, kept), fitted, job.options.threads);
    out.solver = solve(job, clean, out.weighing, refit_on(clean, kept), &out.values);
    iterations += out.solver.iterations;
  }
  out.solver.iterations = iterations;
  return out;
}

Selection select_observable(const Job& job, const std::vector<int>& free, const Eigen::VectorXd& values) {
  const Evaluator evaluator(job.model, job.data, job.bases, make_segments(job.data, job.rows), free,
                            job.options.threads);
  Weighing weighing;
  weighing.rotation_scale = job.options.rotation_length;
  NormalEquations normal;
  evaluator.normal_equations(values, weighing, &normal);
  std::vector<int> priority;
  for (const int k : free) priority.push_back(priority_of(job.model.parameters[k].role));
  return observable(job.model, free, find_rank(normal.gram, priority, job.options.rank_tolerance));
}

ErrorLengths error_lengths(const Job& job, const Evaluator& evaluator, const Eigen::VectorXd& values, bool poses) {
  ErrorLengths out;
  out.position.resize(job.data.rows);
  if (poses) out.rotation.assign(job.data.rows, std::numeric_limits<float>::quiet_NaN());
  evaluator.residuals(values, [&](std::size_t row, const double* r) {
    out.position[row] = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    if (components_of(job.data, row) == 6)
      out.rotation[row] = static_cast<float>(std::sqrt(r[3] * r[3] + r[4] * r[4] + r[5] * r[5]));
  });
  return out;
}

}  // namespace truing::identification
