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

/// Some of a job's rows, to be solved for what is fitted.
class Equations {
 public:
  Equations(const Job& job, const std::vector<int>& fitted, const std::vector<std::int32_t>& rows)
      : job_(job),
        evaluator_(job.model, job.data, job.bases, make_segments(job.data, rows), fitted, job.options.threads) {
    const bool base =
        std::any_of(fitted.begin(), fitted.end(), [&](int k) { return job.model.parameters[k].role == Role::base; });
    if (base && job.options.frame_by == FrameBy::svd)
      refit_ = frame_by_registration(job.model, job.data, evaluator_, rows);
  }
  Equations(const Equations&) = delete;
  Equations& operator=(const Equations&) = delete;

  /// Solved from where the fit stands; iterations are added up.
  void solve(Fit* fit) const {
    const int before = fit->solver.iterations;
    fit->solver = job_.options.solver == Solver::ceres
                      ? solve_with_ceres(evaluator_, job_.model, fit->weighing, job_.options, &fit->values)
                      : levenberg_marquardt(evaluator_, fit->weighing, job_.options, refit_, &fit->values);
    fit->solver.iterations += before;
  }

  /// Lengths of the residuals, by row of the data; 0 of other rows.
  std::vector<double> norms(const Fit& fit) const {
    std::vector<double> out(job_.data.rows, 0.0);
    evaluator_.residual_norms(fit.values, fit.weighing, &out);
    return out;
  }

 private:
  const Job& job_;
  Evaluator evaluator_;
  Refit refit_;
};

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

/// Noise of a unit-weight component, as given or as a fit without priors leaves it.
double noise_against_priors(const Equations& equations, const Equations& all, const Job& job, Fit without_priors) {
  if (job.options.prior_noise > 0.0) return job.options.prior_noise;
  equations.solve(&without_priors);
  return noise_of(job, without_priors.fitted, all.norms(without_priors));
}

constexpr int kRobustRounds = 10;
constexpr double kSettled = 1e-3;  // of the scale

/// A robust loss at a scale of the residuals' own, until that has settled.
void robust_rounds(const Equations& all, const Job& job, Loss loss, int rounds, double settled, Fit* out) {
  for (int round = 0; round < rounds; ++round) {
    const std::vector<double> norms = all.norms(*out);
    std::vector<double> of_rows;
    for (const std::int32_t row : job.rows) of_rows.push_back(norms[row]);
    const double scale = loss_medians(loss) * median_of(std::move(of_rows));
    if (!(scale > 0.0) || (round > 0 && std::abs(scale / out->weighing.loss_scale - 1.0) < settled)) break;
    out->weighing.loss = row_loss(loss);
    out->weighing.loss_scale = scale;
    all.solve(out);
  }
}

/// Gross outliers are left out, and found again, until they are the same.
void rejecting_rounds(const Equations& all, const Job& job, Fit* out) {
  constexpr int kRounds = 10;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::int32_t> rejected = gross_outliers(job, all.norms(*out), job.options.reject_beyond);
    if (round > 0 && rejected == out->rejected) break;
    out->rejected = std::move(rejected);
    Equations(job, out->fitted, without(job.rows, out->rejected)).solve(out);
  }
}

}  // namespace

Fit fit(const Job& job, const std::vector<int>& fitted, const Eigen::VectorXd& start) {
  Fit out;
  out.values = start;
  out.fitted = fitted;
  out.weighing.rotation_scale = job.options.rotation_length;
  const Equations all(job, fitted, job.rows);
  std::vector<std::int32_t> possible = job.rows;
  if (job.options.loss != Loss::none) possible = without(job.rows, gross_outliers(job, all.norms(out), kImpossible));
  const bool all_possible = possible.size() == job.rows.size();
  std::optional<Equations> some;
  if (!all_possible) some.emplace(job, fitted, possible);
  const Equations& first = some ? *some : all;
  if (!job.options.priors.empty())
    out.weighing.prior = prior_of(job, fitted, noise_against_priors(first, all, job, out));
  first.solve(&out);
  if (job.options.loss == Loss::none) return out;
  if (job.options.loss != Loss::reject) {
    robust_rounds(all, job, job.options.loss, kRobustRounds, kSettled, &out);
    return out;
  }
  if (gross_outliers(job, all.norms(out), job.options.reject_beyond).empty()) {
    if (!all_possible) all.solve(&out);
    return out;
  }
  robust_rounds(all, job, Loss::cauchy, 3, 1e-2, &out);
  out.weighing.loss = RowLoss::none;
  rejecting_rounds(all, job, &out);
  return out;
}

Fit descended(const Job& job, const Fit& like, const Eigen::VectorXd& place) {
  Fit out = like;
  out.values = place;
  out.solver.iterations = 0;
  Equations(job, out.fitted, without(job.rows, out.rejected)).solve(&out);
  return out;
}

Fit settled(const Job& job, Fit found) {
  const Equations all(job, found.fitted, job.rows);
  if (job.options.loss == Loss::reject) rejecting_rounds(all, job, &found);
  if (found.weighing.loss != RowLoss::none) robust_rounds(all, job, job.options.loss, kRobustRounds, kSettled, &found);
  return found;
}

double noise_of(const Job& job, const Fit& found) {
  return noise_of(job, found.fitted, Equations(job, found.fitted, job.rows).norms(found));
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
