// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "identification/start.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "math/linear_algebra.hpp"
#include "math/random.hpp"
#include "math/registration.hpp"
#include "math/statistics.hpp"
#include "model/readings.hpp"

namespace truing::identification {
namespace {

struct Predicted {
  std::size_t row;
  Eigen::Isometry3d frame;
};

/// What the robot predicts for a sample of those rows that satisfy `wanted`, in order of rows.
template <typename Wanted>
std::vector<Predicted> predict_some(const Robot& robot, const Job& job, const Wanted& wanted) {
  const Model model = make_model(robot, job.data, job.options.effects, job.options.own_effects);
  std::vector<std::int32_t> rows;
  for (const std::int32_t row : evenly(job.rows)) {
    if (wanted(static_cast<std::size_t>(row))) rows.push_back(row);
  }
  const Evaluator evaluator(model, job.data, job.bases, make_segments(job.data, rows, true), {}, 1);
  std::vector<Predicted> out;
  evaluator.predict(initial_values(model), [&](std::size_t row, const double* f) {
    Predicted predicted{row, Eigen::Isometry3d::Identity()};
    predicted.frame.translation() = Eigen::Vector3d(f[0], f[1], f[2]);
    predicted.frame.linear() = Eigen::Map<const Eigen::Matrix3d>(f + 3);
    out.push_back(predicted);
  });
  std::sort(out.begin(), out.end(), [](const Predicted& a, const Predicted& b) { return a.row < b.row; });
  return out;
}

/// Fits a few unknowns to rows of which some may be wrong by any amount. `fit` gives a candidate of the rows with these
/// indices, `error` the length of a row's error under it. Least squares of all rows, unless a candidate of few rows
/// halves the median error (least median of squares: Rousseeuw, J. American Statistical Association 79 (1984) 871):
/// then least squares of the rows that agree with that one. Nobody looks for one where no error is longer than
/// `suspicious` medians; 0 for unknowns that a single row can bend until it fits.
template <typename Candidate, typename FitTo, typename Error>
Candidate agreed(std::size_t rows, std::size_t sample, double suspicious, const FitTo& fit_to, const Error& error) {
  constexpr int kTrials = 200;
  constexpr double kAgrees = 10.0;  // medians
  std::vector<std::size_t> all(rows);
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<double> errors(rows);
  const auto median_error = [&](const Candidate& candidate) {
    for (std::size_t i = 0; i < rows; ++i) errors[i] = error(candidate, i);
    return median_of(errors);
  };
  Candidate best = fit_to(all);
  const double of_all = median_error(best);
  const double longest = *std::max_element(errors.begin(), errors.end());
  if (rows <= 2 * sample || longest <= suspicious * of_all) return best;

  Random random(1);
  double least = 0.5 * of_all;
  bool found = false;
  std::vector<std::size_t> some(sample);
  for (int trial = 0; trial < kTrials; ++trial) {
    for (std::size_t& index : some) index = random.below(rows);
    const Candidate candidate = fit_to(some);
    const double median = median_error(candidate);
    if (!(median < least)) continue;
    least = median;
    best = candidate;
    found = true;
  }
  if (!found) return best;
  std::vector<std::size_t> agreeing;
  for (const std::size_t i : all) {
    if (error(best, i) <= kAgrees * least) agreeing.push_back(i);
  }
  return fit_to(agreeing);
}

Eigen::Isometry3d register_columns(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                                   const std::vector<std::size_t>& columns) {
  Eigen::Matrix3Xd some_from(3, static_cast<Eigen::Index>(columns.size())), some_to = some_from;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    some_from.col(static_cast<Eigen::Index>(k)) = from.col(static_cast<Eigen::Index>(columns[k]));
    some_to.col(static_cast<Eigen::Index>(k)) = to.col(static_cast<Eigen::Index>(columns[k]));
  }
  return register_points(some_from, some_to);
}

/// Base frame by registration of the nominal robot's predictions, and target orientations (where they are free) by the
/// mean of what is left.
void register_frames(const Job& job, bool base_free, const std::vector<bool>& turn_free, Robot* robot) {
  const Measurements& data = job.data;
  const std::vector<Predicted> predicted =
      predict_some(*robot, job, [&](std::size_t row) { return data.has_position(row) && !data.has_fixed_point(row); });
  if (predicted.size() < 3) return;
  const auto n = static_cast<Eigen::Index>(predicted.size());
  Eigen::Matrix3Xd from(3, n), to(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Predicted& p = predicted[static_cast<std::size_t>(i)];
    from.col(i) = p.frame.translation();
    to.col(i) << data.position[0][p.row], data.position[1][p.row], data.position[2][p.row];
  }
  Eigen::Isometry3d correction = Eigen::Isometry3d::Identity();
  if (base_free) {
    correction = agreed<Eigen::Isometry3d>(
        predicted.size(), 4, 4.0,
        [&](const std::vector<std::size_t>& some) { return register_columns(from, to, some); },
        [&](const Eigen::Isometry3d& T, std::size_t i) {
          const auto column = static_cast<Eigen::Index>(i);
          return (T * from.col(column) - to.col(column)).norm();
        });
    robot->T_measurement_base = correction * robot->T_measurement_base;
  }
  std::vector<Eigen::Matrix3d> turn(robot->targets.size(), Eigen::Matrix3d::Zero());
  for (const Predicted& p : predicted) {
    if (!data.has_orientation(p.row)) continue;
    const Eigen::Quaterniond want(data.orientation[0][p.row], data.orientation[1][p.row], data.orientation[2][p.row],
                                  data.orientation[3][p.row]);
    const std::size_t target = data.target.empty() ? 0 : static_cast<std::size_t>(data.target[p.row]);
    turn[target] += (correction.linear() * p.frame.linear()).transpose() * want.normalized().toRotationMatrix();
  }
  for (std::size_t k = 0; k < turn.size(); ++k) {
    if (turn_free[k] && !turn[k].isZero(0.0))
      robot->targets[k].T_last_target.linear() = robot->targets[k].T_last_target.linear() * nearest_rotation(turn[k]);
  }
}

/// Anchor and wire zero, linear in the unknowns once p.p - d^2 = 2 p.c - 2 d z + (z^2 - c.c) is written out.
void locate_anchor(const Job& job, Robot* robot) {
  using Unknowns = Eigen::Matrix<double, 5, 1>;
  const std::vector<Predicted> predicted =
      predict_some(*robot, job, [&](std::size_t row) { return job.data.has_distance(row); });
  if (predicted.empty()) return;
  const auto solve_for = [&](const std::vector<std::size_t>& some) -> Unknowns {
    Eigen::Matrix<double, 5, 5> gram = Eigen::Matrix<double, 5, 5>::Zero();
    Unknowns right = Unknowns::Zero();
    for (const std::size_t i : some) {
      const Eigen::Vector3d p = predicted[i].frame.translation();
      const double d = job.data.distance[predicted[i].row];
      Unknowns column;
      column << 2.0 * p, -2.0 * d, 1.0;
      gram += column * column.transpose();
      right += column * (p.squaredNorm() - d * d);
    }
    return solve_symmetric<5, 1>(gram, right);
  };
  const auto error = [&](const Unknowns& x, std::size_t i) {
    const double d = job.data.distance[predicted[i].row];
    return x.allFinite() ? std::abs((predicted[i].frame.translation() - x.head<3>()).norm() + x[3] - d) : 1e300;
  };
  const Unknowns x = agreed<Unknowns>(predicted.size(), 8, 0.0, solve_for, error);
  if (x.allFinite()) robot->anchor = Anchor{x.head<3>(), x[3]};
}

}  // namespace

void locate_points(const Model& model, const Job& job, Eigen::VectorXd* values) {
  std::vector<Eigen::Vector3d> sum(model.point_names.size(), Eigen::Vector3d::Zero());
  std::vector<int> count(model.point_names.size(), 0);
  if (sum.empty()) return;
  for (const Predicted& p :
       predict_some(model.robot, job, [&](std::size_t row) { return job.data.has_fixed_point(row); })) {
    const auto point = static_cast<std::size_t>(job.data.fixed_point[p.row]);
    sum[point] += p.frame.translation();
    ++count[point];
  }
  for (std::size_t k = 0; k < sum.size(); ++k) {
    for (int axis = 0; axis < 3 && count[k] > 0; ++axis) {
      (*values)[model.parameter_index("point." + model.point_names[k] + "." + "xyz"[axis])] = sum[k][axis] / count[k];
    }
  }
}

namespace {

double reach_of(const Robot& robot) {
  double reach = 0.0;
  for (const Joint& joint : robot.joints)
    reach += std::abs(joint.a) + std::abs(joint.d) + joint.T_parent_joint.translation().norm();
  return reach;
}

/// Nominal robot with base, targets, anchor and fixed points fitted, from one guess of the targets' places.
Start fit_instrument(const Job& nominal_job, const std::vector<std::string>& unknown, const Robot& guess,
                     bool base_free, bool distance) {
  Start out;
  out.robot = guess;
  std::vector<bool> turn_free(guess.targets.size(), true);
  for (const ParameterInfo& info : nominal_job.model.parameters) {
    const bool unknown_turn = std::find(unknown.begin(), unknown.end(), info.name) != unknown.end();
    if (info.role == Role::target && info.rotation && !unknown_turn)
      turn_free[static_cast<std::size_t>(info.owner)] = false;
  }
  register_frames(nominal_job, base_free, turn_free, &out.robot);
  if (distance) locate_anchor(nominal_job, &out.robot);
  const Model model =
      make_model(out.robot, nominal_job.data, nominal_job.options.effects, nominal_job.options.own_effects);
  Eigen::VectorXd values = initial_values(model);
  IdentifyOptions options = nominal_job.options;
  options.solver = Solver::lm;
  options.frame_by = FrameBy::parameters;
  options.bounds.clear();
  options.priors.clear();
  const Job job{model, nominal_job.data, nominal_job.bases, options, nominal_job.rows};
  locate_points(model, job, &values);
  std::vector<int> free;
  for (const std::string& name : unknown) free.push_back(model.parameter_index(name));
  const Selection seen = select_observable(job, free, values);
  const Fit found = fit(job, seen.fitted, values);
  // Back to a robot and its own model: orientations are counted from the new frames.
  out.rejected = found.rejected;
  out.robot = robot_with(model, found.values);
  out.values = initial_values(make_model(out.robot, job.data, options.effects, options.own_effects));
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    if (model.parameters[k].role == Role::point)
      out.values[static_cast<Eigen::Index>(k)] = found.values[static_cast<Eigen::Index>(k)];
  }
  const Evaluator evaluator(model, job.data, job.bases, make_segments(job.data, without(job.rows, found.rejected)),
                            seen.fitted, options.threads);
  NormalEquations normal;
  evaluator.normal_equations(found.values, found.weighing, &normal);
  out.rms = normal.rms();
  return out;
}

}  // namespace

double spread_of(const Job& job, const std::vector<std::int32_t>& rejected) {
  return measured_range(job.data, without(job.rows, rejected));
}

Start find_start(const Job& job, const std::vector<std::string>& unknown, const Content& content, bool base_free) {
  Start best = fit_instrument(job, unknown, job.model.robot, base_free, content.distance);
  const bool targets_free = std::any_of(unknown.begin(), unknown.end(), [&](const std::string& name) {
    return job.model.parameters[job.model.parameter_index(name)].role == Role::target;
  });
  const bool doubtful = content.distance || (content.frame && best.rms > 0.02 * spread_of(job, best.rejected));
  if (!targets_free || !doubtful) return best;
  for (int k = 0; k < 6; ++k) {
    Robot guess = job.model.robot;
    for (Target& target : guess.targets)
      target.T_last_target.translation()[k % 3] += (k < 3 ? 0.15 : -0.15) * reach_of(guess);
    Start other = fit_instrument(job, unknown, guess, base_free, content.distance);
    if (other.rms < best.rms) best = std::move(other);
  }
  return best;
}

}  // namespace truing::identification
