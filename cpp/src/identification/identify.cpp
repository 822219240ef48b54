// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "truing/identify.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "estimation/clustered.hpp"
#include "estimation/evaluate.hpp"
#include "estimation/selection.hpp"
#include "estimation/solvers.hpp"
#include "math/constants.hpp"
#include "math/linear_algebra.hpp"
#include "math/observability.hpp"
#include "math/random.hpp"
#include "math/registration.hpp"
#include "math/rotation.hpp"
#include "math/statistics.hpp"
#include "model/readings.hpp"
#include "rooms.hpp"

namespace truing {
using namespace identification;

namespace identification {
namespace {

using kernel::RowLoss;

std::string count_of(std::size_t n, const char* what) { return std::to_string(n) + " " + what + (n == 1 ? "" : "s"); }

// --- which rows, which parameters ------------------------------------------------------------------------------------

/// 0 train, 1 test for every row: the data's own split, or a fraction of the pose groups drawn with the seed.
std::vector<std::int8_t> split(const Measurements& data, const IdentifyOptions& options,
                               const std::vector<std::int32_t>& group) {
  const std::size_t groups =
      group.empty() ? 0 : static_cast<std::size_t>(*std::max_element(group.begin(), group.end())) + 1;
  if (groups < 2)
    throw std::invalid_argument("all " + count_of(data.rows, "row") +
                                " are of one pose: nothing can be identified from them");
  if (!data.set.empty()) return data.set;
  std::vector<std::int32_t> order(groups);
  std::iota(order.begin(), order.end(), 0);
  Random random(options.seed);
  for (std::size_t k = groups - 1; k > 0; --k) std::swap(order[k], order[random.below(k + 1)]);
  std::vector<std::int8_t> of_group(groups, 0);
  const auto held_out = static_cast<std::size_t>(std::lround(options.test_share * static_cast<double>(groups)));
  for (std::size_t k = 0; k < held_out; ++k) of_group[order[k]] = 1;
  std::vector<std::int8_t> set(data.rows);
  for (std::size_t row = 0; row < data.rows; ++row) set[row] = of_group[group[row]];
  return set;
}

struct SplitRows {
  std::vector<std::int32_t> pose;  ///< number of the pose, for every row
  std::vector<std::int8_t> set;    ///< 0 train, 1 test, for every row
  std::vector<std::int32_t> train, test;
};

SplitRows split_rows(const Measurements& data, const IdentifyOptions& options) {
  SplitRows out;
  out.pose = pose_groups(data);
  out.set = split(data, options, out.pose);
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (data.weight && data.weight[row] == 0.0) continue;  // counts for nothing
    (out.set[row] ? out.test : out.train).push_back(static_cast<std::int32_t>(row));
  }
  return out;
}

/// What is to be fitted, and what measures it.
struct Asked {
  Content content;         ///< of the training rows
  std::size_t values = 0;  ///< that they measure
  std::vector<int> free;
  std::vector<std::string> instrument;  ///< of these: base, targets, anchor and fixed points, which are always unknown
  bool base_free = false;
};

std::size_t measured_values(const std::vector<Segment>& segments) {
  std::size_t out = 0;
  for (const Segment& segment : segments) {
    out += segment.rows.size() * (segment.kind == kernel::Kind::distance ? 1u
                                  : segment.kind == kernel::Kind::pose   ? 6u
                                                                         : 3u);
  }
  return out;
}

Asked what_is_asked(const Model& model, const Measurements& data, const std::vector<std::int32_t>& train,
                    const IdentifyOptions& options) {
  const std::vector<Segment> segments = make_segments(data, train);
  Asked out;
  out.content = content_of(model, segments);
  out.values = measured_values(segments);
  out.free = select_free(model, out.content, options);
  if (out.free.empty()) throw std::invalid_argument("nothing is free: name parameters to fit, or hold fewer");
  for (const auto& [name, bound] : options.bounds) find_parameters(model, {name});
  for (const auto& [glob, sigma] : options.priors) {
    for (const int k : find_parameters(model, {glob})) {
      const ParameterInfo& info = model.parameters[static_cast<std::size_t>(k)];
      if (belongs_to_instrument(info.role) || info.role == Role::target)
        throw std::invalid_argument("priors: '" + glob + "' stands for " + info.name +
                                    ", but base, targets and instrument are found from the data alone");
    }
  }
  if (options.frame_by == FrameBy::svd &&
      (out.content.distance || out.content.poses || !out.content.frame || !model.point_names.empty())) {
    throw std::invalid_argument(
        "frame_by = svd needs measured positions only, no orientations, distances or fixed points");
  }
  for (const int k : out.free) {
    const Role role = model.parameters[k].role;
    if (belongs_to_instrument(role) || role == Role::target) out.instrument.push_back(model.parameters[k].name);
    if (role == Role::base) out.base_free = true;
  }
  return out;
}

/// Touching fixed points shows shapes, not sizes: with every length free the robot could shrink to nothing. The longest
/// is held.
int length_that_carries_scale(const Model& model, const Eigen::VectorXd& values, const std::vector<int>& free) {
  int longest = -1;
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const bool length = (info.role == Role::geometry || info.role == Role::target) && info.unit == "m";
    const double size = std::abs(values[static_cast<Eigen::Index>(k)]);
    if (!length || size < 1e-9) continue;
    if (std::find(free.begin(), free.end(), static_cast<int>(k)) == free.end())
      return -1;  // some length is held already
    if (info.role == Role::geometry && (longest < 0 || size > std::abs(values[longest]))) longest = static_cast<int>(k);
  }
  return longest;
}

// --- one fit ---------------------------------------------------------------------------------------------------------

struct Fit {
  Eigen::VectorXd values;
  Weighing weighing;
  SolverSummary solver;
  std::vector<int> fitted;             ///< parameters
  std::vector<std::int32_t> rejected;  ///< rows
  double cost = 0.0;
};

struct Job {
  const Model& model;
  const Measurements& data;
  const std::vector<std::vector<double>>& bases;
  const IdentifyOptions& options;
  std::vector<std::int32_t> rows;
};

SolverSummary solve(const Job& job, const Evaluator& evaluator, const Weighing& weighing, const Refit& refit,
                    Eigen::VectorXd* values) {
  return job.options.solver == Solver::ceres ? solve_with_ceres(evaluator, job.model, weighing, job.options, values)
                                             : levenberg_marquardt(evaluator, weighing, job.options, refit, values);
}

int components_of(const Measurements& data, std::size_t row) {
  if (data.has_fixed_point(row)) return 3;
  if (data.has_distance(row)) return 1;
  return data.has_orientation(row) ? 6 : 3;
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

/// Lengths of the training rows' residuals, made comparable between kinds of rows.
std::vector<double> comparable_lengths(const Job& job, const std::vector<double>& norms) {
  std::vector<double> out;
  out.reserve(job.rows.size());
  for (const std::int32_t row : job.rows)
    out.push_back(norms[static_cast<std::size_t>(row)] / kChiMedian[components_of(job.data, row)]);
  return out;
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

std::vector<std::int32_t> without(const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& left_out) {
  std::vector<std::int32_t> out;
  std::set_difference(rows.begin(), rows.end(), left_out.begin(), left_out.end(), std::back_inserter(out));
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

/// The options' priors of the fitted parameters about the nominal robot, against rows with this noise.
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

/// Beyond so many medians of what the robot as drawn leaves, a row is no measurement of it but a fault: a comma lost, a
/// tracker that followed another reflector. A single one of a kilometre would carry plain least squares where no later
/// rejection finds back from. Whether the row stays out is decided by the fit that starts without it.
constexpr double kImpossible = 20.0;

/// Least squares, under priors if there are some; then, as asked, a robust loss at a scale of the residuals' own, or
/// gross outliers found and left out.
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

/// Splits the free parameters into those that the rows can see and combinations that they cannot.
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

/// What is fitted of what was asked for.
struct Seen {
  std::vector<int> free;
  int scale_carrier = -1;  ///< a length that is held, since nothing shows the scale; -1: none
  Selection selection;
};

/// Number of parameters that the rows alone must determine. What priors are weighed against comes from the rows as
/// well, unless it is given.
std::size_t without_prior(const Job& job, const std::vector<int>& fitted) {
  if (!(job.options.prior_noise > 0.0)) return fitted.size();
  return static_cast<std::size_t>((prior_of(job, fitted, job.options.prior_noise).weight.array() == 0.0).count());
}

Seen what_is_seen(const Job& job, const Asked& asked, const Eigen::VectorXd& values) {
  Seen out;
  out.free = asked.free;
  if (!asked.content.frame && !asked.content.distance) {
    out.scale_carrier = length_that_carries_scale(job.model, values, out.free);
    out.free.erase(std::remove(out.free.begin(), out.free.end(), out.scale_carrier), out.free.end());
  }
  out.selection = select_observable(job, out.free, values);
  const std::size_t unknown = without_prior(job, out.selection.fitted);
  if (asked.values <= unknown) {
    throw std::invalid_argument(count_of(asked.values, "measured value") + " in " +
                                count_of(job.rows.size(), "training row") + " cannot determine " +
                                count_of(unknown, "parameter") + ": measure more poses, or free fewer parameters");
  }
  if (out.scale_carrier >= 0) {
    const std::string& name = job.model.parameters[out.scale_carrier].name;
    out.selection.frozen.push_back(
        {name, {{name, 1.0}}, "touching fixed points shows no scale: this length, held at nominal, carries it"});
  }
  return out;
}

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

/// At most so many rows, evenly taken, are enough to start from.
constexpr std::size_t kStartRows = 4096;

std::vector<std::int32_t> evenly(const std::vector<std::int32_t>& rows) {
  std::vector<std::int32_t> out;
  const std::size_t step = (rows.size() + kStartRows - 1) / kStartRows;
  for (std::size_t i = 0; i < rows.size(); i += step) out.push_back(rows[i]);
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
    Fit other = fit(job, here.fitted, place);
    const double squares = depth.at(other);
    if (!(squares < least)) continue;
    least = squares;
    deepest = std::move(other);
  }
  return deepest;
}

/// The fit in the deepest of its hollows. Nobody looks for others where priors or bounds hold what is hardly seen.
Fit deepest_fit(const Job& job, const std::vector<int>& fitted, const Eigen::VectorXd& start) {
  constexpr int kMostRounds = 3;
  constexpr int kMostSteps = 1000;
  Fit best = fit(job, fitted, start);
  if (!best.solver.converged || !job.options.priors.empty() || !job.options.bounds.empty()) return best;
  IdentifyOptions options = job.options;
  options.max_iterations = std::min(options.max_iterations, kMostSteps);
  const Job some{job.model, job.data, job.bases, options, evenly(job.rows)};
  const bool all = some.rows.size() == job.rows.size();
  for (int round = 0; round < kMostRounds; ++round) {
    if (!all && beyond_bends(job, best).empty()) break;
    const std::optional<Fit> deeper = deeper_fit(some, all ? best : fit(some, fitted, best.values));
    if (!deeper) break;
    Fit other = all && deeper->solver.converged ? *deeper : fit(job, fitted, deeper->values);
    if (!all && !(Depth(job, best).at(other) < Depth(job, best).here())) break;
    best = std::move(other);
  }
  return best;
}

/// The fit; gravity torques are taken from the robot as found until they no longer change. `bases` are the job's.
Fit fit_with_gravity(const Job& job, const std::vector<int>& fitted, const Eigen::VectorXd& start,
                     std::vector<std::vector<double>>* bases) {
  constexpr int kRounds = 5;
  constexpr double kUnchanged = 1e-11;
  const auto needs_gravity = [](const Term& term) { return term.needs_gravity; };
  Fit found = deepest_fit(job, fitted, start);
  if (!std::any_of(job.model.terms.begin(), job.model.terms.end(), needs_gravity)) return found;
  for (int round = 0; round < kRounds; ++round) {
    const Robot robot = robot_with(job.model, found.values);
    const Model found_model = make_model(robot, job.data, job.options.effects, job.options.own_effects);
    if (found_model.terms.size() != job.model.terms.size())
      break;  // a length that was none: the law stays with the drawing's
    *bases = make_bases(found_model, job.data);
    const Eigen::VectorXd before = found.values;
    found = fit(job, fitted, before);
    if ((found.values - before).cwiseAbs().maxCoeff() < kUnchanged) break;
  }
  return found;
}

// --- where to start --------------------------------------------------------------------------------------------------

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

/// Every fixed point at the mean of the tip's predictions.
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

struct Start {
  Robot robot;
  std::vector<std::int32_t> rejected;  ///< rows
  Eigen::VectorXd values;              ///< of make_model(robot, …): for the fixed points, which a robot does not hold
  double rms = 0.0;
};

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

double spread_of(const Job& job, const std::vector<std::int32_t>& rejected) {
  return measured_range(job.data, without(job.rows, rejected));
}

/// A target far from where the model has it can spoil the registration: then other places are tried, and the best one
/// kept.
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

// --- what to say about it --------------------------------------------------------------------------------------------

/// Length of every row's error: position or distance [m], and rotation [rad] where orientations are measured.
struct ErrorLengths {
  std::vector<double> position;
  std::vector<float> rotation;  ///< NaN: not measured; empty: none is
};

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

ErrorStatistics statistics(const ErrorLengths& errors, const std::vector<std::int32_t>& rows) {
  std::vector<double> lengths;
  lengths.reserve(rows.size());
  double turn = 0.0;
  std::size_t turns = 0;
  for (const std::int32_t row : rows) {
    lengths.push_back(errors.position[row]);
    if (!errors.rotation.empty() && std::isfinite(errors.rotation[row])) {
      turn += static_cast<double>(errors.rotation[row]) * static_cast<double>(errors.rotation[row]);
      ++turns;
    }
  }
  ErrorStatistics out = error_statistics(std::move(lengths));
  if (turns) out.rotation_rms = std::sqrt(turn / static_cast<double>(turns));
  return out;
}

struct Uncertainty {
  Eigen::MatrixXd covariance;
  double noise = 0.0;
  double rotation_noise = kNaN;
};

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

/// Covariance clustered by pose. Where poses are few, with positions and rotations each at the noise they show: H^-1
/// (s_p^2 H_p + s_r^2 H_r) H^-1; for positions alone, s^2 H^-1. With a robust loss the weighted rows stand for the
/// rows: good to a few per cent.
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

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

/// d(rotation vector) / d(small rotation about the parent's axes): inverse left Jacobian of SO(3), Sola et al. 2018,
/// eq. (146).
Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& v) {
  const Eigen::Matrix3d cross = skew(v);
  const double angle = v.norm();
  const double factor = angle < 1e-4 ? 1.0 / 12.0 : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
}

/// Which axis a parameter turns about, if it is a frame's orientation: 0..2; else -1.
int orientation_axis(const ParameterInfo& info) {
  const std::string name = info.name.substr(info.name.rfind('.') + 1);
  if (info.role == Role::effect) return -1;
  return name == "rx" ? 0 : name == "ry" ? 1 : name == "rz" ? 2 : -1;
}

/// The covariance of rotation vectors from that of the small rotations which were fitted.
void report_orientation_covariance(const Model& model, const std::vector<int>& fitted, const Eigen::VectorXd& values,
                                   Eigen::MatrixXd* covariance) {
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(covariance->rows(), covariance->cols());
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    const ParameterInfo& row = model.parameters[fitted[i]];
    if (orientation_axis(row) < 0) continue;
    const std::string frame = row.name.substr(0, row.name.rfind('.'));
    Eigen::Vector3d v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = values[model.parameter_index(frame + ".r" + "xyz"[axis])];
    const Eigen::Matrix3d j = inverse_left_jacobian(v);
    for (std::size_t k = 0; k < fitted.size(); ++k) {
      const ParameterInfo& column = model.parameters[fitted[k]];
      if (orientation_axis(column) < 0 || column.name.substr(0, column.name.rfind('.')) != frame) continue;
      T(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          j(orientation_axis(row), orientation_axis(column));
    }
  }
  *covariance = T * *covariance * T.transpose();
}

/// Orientation parameters as the user reads them: the rotation vector from the nominal to the found orientation, about
/// the parent's axes.
void report_orientations(const Robot& nominal, const Robot& found, const Model& model, Eigen::VectorXd* nominal_values,
                         Eigen::VectorXd* values) {
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const int axis = orientation_axis(info);
    if (axis < 0) continue;
    const auto frame = [&](const Robot& robot) {
      return info.role == Role::base     ? robot.T_measurement_base
             : info.role == Role::target ? robot.targets[info.owner].T_last_target
                                         : robot.joints[info.owner].T_parent_joint;
    };
    (*nominal_values)[static_cast<Eigen::Index>(k)] = 0.0;
    (*values)[static_cast<Eigen::Index>(k)] =
        rotation_vector(frame(found).linear() * frame(nominal).linear().transpose())[axis];
  }
}

std::string three_digits(double v) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3g", v);
  return buffer;
}

/// "a (1.2 mm), b (3 mrad)": fitted, and known to more than 10 mm or mrad only.
std::string barely_seen(const std::vector<Parameter>& parameters) {
  std::string out;
  for (const Parameter& parameter : parameters) {
    const bool length = parameter.unit == "m";
    if (parameter.frozen || !(length || parameter.unit == "rad") || !(parameter.sigma > 0.01)) continue;
    out += (out.empty() ? "" : ", ") + parameter.name + " (" + three_digits(1e3 * parameter.sigma) +
           (length ? " mm)" : " mrad)");
  }
  return out;
}

std::vector<std::string> make_warnings(const Identification& result, std::size_t train_values, double spread) {
  std::vector<std::string> warnings;
  const ErrorStatistics& train = result.train.after;
  if (spread > 0.0 && train.median > 0.02 * spread) {
    warnings.push_back("what is left, " + three_digits(1e3 * train.median) + " mm in the median, is " +
                       three_digits(100.0 * train.median / spread) +
                       " % of the measured range: is a joint column wrong (unit, sign, order), or the robot file?");
  }
  if (train_values < 3 * static_cast<std::size_t>(result.rank)) {
    warnings.push_back("only " + count_of(train_values, "measured value") + " for " +
                       count_of(static_cast<std::size_t>(result.rank), "parameter") +
                       ": measure more poses or free fewer parameters");
  }
  if (!result.test) {
    warnings.push_back("no rows are held out: nothing says how good the result is on other poses");
  } else if (result.test->after.rms > 1.5 * train.rms && result.test->after.median > 1.3 * train.median) {
    warnings.push_back("held-out error " + three_digits(1e3 * result.test->after.rms) + " mm against " +
                       three_digits(1e3 * train.rms) + " mm in training: the data cannot support this many parameters");
  }
  const std::string weak = barely_seen(result.parameters);
  if (!weak.empty()) warnings.push_back("barely seen, standard error in brackets: " + weak);
  if (!result.rejected_rows.empty())
    warnings.push_back(count_of(result.rejected_rows.size(), "training row") + " left out as gross outliers");
  return warnings;
}

void report_uncertainty(const Uncertainty& known, Identification* result) {
  result->covariance = known.covariance;
  result->noise_sigma = known.noise;
  result->rotation_noise_sigma = known.rotation_noise;
}

/// Every parameter that was asked for, with its standard error if it was fitted.
void report_parameters(const Model& nominal_model, const Model& model, const Seen& seen, const Fit& found,
                       Identification* result) {
  const std::vector<int>& fitted = seen.selection.fitted;
  Eigen::VectorXd nominal_values = initial_values(nominal_model), values = found.values;
  report_orientations(nominal_model.robot, result->robot, model, &nominal_values, &values);
  report_orientation_covariance(model, fitted, values, &result->covariance);
  std::vector<int> asked = seen.free;
  if (seen.scale_carrier >= 0) asked.push_back(seen.scale_carrier);
  std::sort(asked.begin(), asked.end());
  Eigen::Index at = 0;
  for (const int k : asked) {
    Parameter parameter;
    parameter.name = model.parameters[k].name;
    parameter.unit = model.parameters[k].unit;
    parameter.nominal = nominal_values[k];
    parameter.value = values[k];
    parameter.frozen = std::find(fitted.begin(), fitted.end(), k) == fitted.end();
    parameter.sigma = parameter.frozen ? kNaN : std::sqrt(result->covariance(at, at));
    if (!parameter.frozen) ++at;
    result->parameters.push_back(parameter);
  }
}

/// Between which values the fitted rows have every input.
std::map<std::string, std::pair<double, double>> ranges_of(const Measurements& data,
                                                           const std::vector<std::int32_t>& rows) {
  std::map<std::string, std::pair<double, double>> out;
  const auto look_at = [&](const std::string& name, const Column& column) {
    for (const std::int32_t row : rows) {
      const double value = column ? column[static_cast<std::size_t>(row)] : kNaN;
      if (!std::isfinite(value)) continue;
      const auto found = out.emplace(name, std::pair{value, value}).first;
      found->second.first = std::min(found->second.first, value);
      found->second.second = std::max(found->second.second, value);
    }
  };
  for (std::size_t k = 0; k < data.joints.size(); ++k) look_at("q" + std::to_string(k + 1), data.joints[k]);
  look_at("payload", data.payload);
  look_at("temp", data.temperature);
  return out;
}

/// Errors before and after, on the rows fitted and on those held out.
void report_errors(const Job& job, const Content& content, const std::vector<std::int32_t>& test,
                   const Eigen::VectorXd& before, const Fit& found, Identification* result) {
  std::vector<std::int32_t> seen_test;
  for (const std::int32_t row : test) {  // a fixed point that no training row touches has no place to compare with
    if (!job.data.has_fixed_point(row) || content.point[job.data.fixed_point[row]]) seen_test.push_back(row);
  }
  std::vector<std::int32_t> all;
  std::merge(job.rows.begin(), job.rows.end(), seen_test.begin(), seen_test.end(), std::back_inserter(all));
  const Evaluator everything(job.model, job.data, job.bases, make_segments(job.data, all), found.fitted,
                             job.options.threads);
  const std::vector<std::int32_t> kept = without(job.rows, found.rejected);
  if (!seen_test.empty()) result->test.emplace();
  for (const bool after : {false, true}) {
    const ErrorLengths errors = error_lengths(job, everything, after ? found.values : before, content.poses);
    (after ? result->train.after : result->train.before) = statistics(errors, kept);
    if (result->test) (after ? result->test->after : result->test->before) = statistics(errors, seen_test);
  }
}

}  // namespace
}  // namespace identification

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
  const Fit found = fit_with_gravity(job, seen.selection.fitted, start.values, &bases);

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
  report_uncertainty(uncertainty(job, found, rows.pose, asked.content.poses), &result);
  report_parameters(nominal_model, model, seen, found, &result);
  report_errors(job, asked.content, rows.test, start.values, found, &result);
  result.warnings = make_warnings(result, asked.values, spread_of(job, found.rejected));
  return result;
}

/// Whether effects of the robot can be predicted with other data alone.
static bool lacks(const Robot& robot, const Measurements& data, const Measurements& with,
                  const std::vector<Effect>& own_effects) {
  const auto works_with = [&](const AppliedEffect& effect, const Measurements& some) {
    try {
      effect_terms({{effect.effect, effect.joints}}, robot, some, own_effects);
    } catch (const MissingColumn&) {
      return false;
    }
    return true;
  };
  return std::any_of(robot.effects.begin(), robot.effects.end(), [&](const AppliedEffect& effect) {
    return !works_with(effect, data) && works_with(effect, with);
  });
}

bool lacks_directions(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects) {
  return data.direction.empty() && !robot.effects.empty() &&
         lacks(robot, data, with_inferred_directions(data), own_effects);
}

bool lacks_speeds(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects) {
  return data.joint_speed.empty() && !robot.effects.empty() &&
         lacks(robot, data, with_inferred_speeds(data), own_effects);
}

Prediction predict(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects, int threads) {
  validate(data, robot, true);
  const Model model = make_model(robot, data, {}, own_effects);
  const std::vector<std::vector<double>> bases = make_bases(model, data);
  std::vector<std::int32_t> rows(data.rows);
  std::iota(rows.begin(), rows.end(), 0);
  const Evaluator evaluator(model, data, bases, make_segments(data, rows, true), {}, threads);
  Prediction out;
  const auto n = static_cast<Eigen::Index>(data.rows);
  out.position.resize(n, 3);
  out.orientation.resize(n, 4);
  if (robot.anchor) out.distance.resize(n);
  evaluator.predict(initial_values(model), [&](std::size_t row, const double* f) {
    const auto i = static_cast<Eigen::Index>(row);
    const Eigen::Vector3d p(f[0], f[1], f[2]);
    Eigen::Quaterniond q(Eigen::Map<const Eigen::Matrix3d>(f + 3));
    if (q.w() < 0.0) q.coeffs() = -q.coeffs();
    out.position.row(i) = p;
    out.orientation.row(i) << q.w(), q.x(), q.y(), q.z();
    if (robot.anchor) out.distance[i] = (p - robot.anchor->point).norm() + robot.anchor->zero;
  });
  return out;
}

Residuals residuals(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects, int threads) {
  validate(data, robot);
  const Model model = make_model(robot, data, {}, own_effects);
  const std::vector<std::vector<double>> bases = make_bases(model, data);
  std::vector<std::int32_t> rows(data.rows);
  std::iota(rows.begin(), rows.end(), 0);
  Eigen::VectorXd values = initial_values(model);
  IdentifyOptions options;
  options.own_effects = own_effects;
  options.threads = threads;
  const Job job{model, data, bases, options, rows};
  locate_points(model, job, &values);
  for (const std::int32_t row : rows) {
    if (data.has_distance(row) && !robot.anchor)
      throw std::invalid_argument("distances were measured, but the robot has no anchor: identify it first");
  }
  const Evaluator evaluator(model, data, bases, make_segments(data, rows), {}, threads);
  Residuals out;
  const auto n = static_cast<Eigen::Index>(data.rows);
  out.position = decltype(out.position)::Constant(n, 3, kNaN);
  out.rotation = decltype(out.rotation)::Constant(n, 3, kNaN);
  out.distance = Eigen::VectorXd::Constant(n, kNaN);
  evaluator.residuals(values, [&](std::size_t row, const double* r) {
    const auto i = static_cast<Eigen::Index>(row);
    const int components = components_of(data, row);
    if (components == 1) {
      out.distance[i] = r[0];
    } else {
      out.position.row(i) << r[0], r[1], r[2];
      if (components == 6) out.rotation.row(i) << r[3], r[4], r[5];
    }
  });
  return out;
}

}  // namespace truing
