// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Errors of poses that a fit did not see: of every training fold by a fit to the others, and of the poses held out.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include "math/random.hpp"
#include "math/student.hpp"

namespace truing::diagnosis {
namespace {

constexpr double kSureRise = 1.5;  ///< standard errors over the folds

std::vector<int> columns_of(const Work& work, const Choice& choice) {
  std::vector<int> out = work.design.nuisance;
  for (const int g : choice.groups) {
    const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(g)].columns;
    out.insert(out.end(), columns.begin(), columns.end());
  }
  return out;
}

/// Of a choice: the fit to all training folds, and the fits to all but one.
struct Fits {
  std::vector<int> columns;
  Eigen::VectorXd whole;
  std::vector<Eigen::VectorXd> without;
};

Fits fits_of(const Work& work, const Choice& choice) {
  const Evidence evidence = evidence_now(work);
  const Evidence::State state = evidence.evaluate(choice);
  Fits out;
  out.columns = columns_of(work, choice);
  out.whole = state.solution;
  const Gram all = work.grams.train.of(out.columns);
  for (const Gram& fold : work.grams.train_folds) {
    const Gram held = fold.of(out.columns);
    Eigen::MatrixXd d = all.xx - held.xx;
    d.diagonal() += state.precision;
    out.without.push_back(factorised(std::move(d)).solve(all.xy - held.xy));
  }
  return out;
}

}  // namespace

Eigen::VectorXd squares_of_folds(const Work& work, const Choice& choice) {
  const Fits fits = fits_of(work, choice);
  Eigen::VectorXd out(static_cast<Eigen::Index>(fits.without.size()));
  for (std::size_t k = 0; k < fits.without.size(); ++k)
    out[static_cast<Eigen::Index>(k)] = held_out_squares(work.grams.train_folds[k], fits.columns, fits.without[k]);
  return out;
}

Eigen::VectorXd squares_of_parts(const Work& work, const std::function<Choice(const Gram&)>& choose) {
  constexpr std::size_t kParts = 4;
  const std::vector<Gram>& folds = work.grams.train_folds;
  Eigen::VectorXd out(static_cast<Eigen::Index>(folds.size()));
  for (std::size_t part = 0; part < kParts; ++part) {
    Gram others;
    for (std::size_t k = 0; k < folds.size(); ++k) {
      if (k % kParts != part) others.add(folds[k]);
    }
    const Evidence evidence(others, work.design.candidates.groups, work.design.nuisance, work.design.prior);
    const Evidence::State state = evidence.evaluate(choose(others));
    for (std::size_t k = part; k < folds.size(); k += kParts)
      out[static_cast<Eigen::Index>(k)] = held_out_squares(folds[k], state.columns, state.solution);
  }
  return out;
}

namespace {

/// What one fold leaves of an average of two fits, as it depends on the one's part p, in units of the fold's own:
/// |b + p d|^2, with b what the other leaves and d how the two differ.
struct Parabola {
  double d2 = 0.0, bd = 0.0;
};

/// Of their squares at parts 0, 1/2 and 1. A fold's unit is the geometric mean of what both leave, or a single fold
/// could decide.
Parabola parabola_of(double none, double half, double whole) {
  const double unit = std::max(std::sqrt(none * whole), 1e-300), d2 = 2.0 * (none + whole - 2.0 * half);
  return {d2 / unit, 0.5 * (whole - none - d2) / unit};
}

/// The part by least squares, with its sandwich standard error over the folds; and what is known beforehand of a number
/// in [0, 1], that it is `usual`, with the variance of a uniform one.
double shrunk_part(const std::vector<Parabola>& folds, double usual) {
  constexpr double kVariance = 1.0 / 12.0;
  double d2 = 0.0, bd = 0.0, scatter = 0.0;
  for (const Parabola& fold : folds) {
    d2 += fold.d2;
    bd += fold.bd;
  }
  const double part = -bd / d2;
  for (const Parabola& fold : folds) scatter += std::pow(fold.bd + part * fold.d2, 2.0);
  const auto n = static_cast<double>(folds.size());
  const double variance = scatter * n / (n - 1.0) / (d2 * d2);
  return std::clamp((part * kVariance + usual * variance) / (kVariance + variance), 0.0, 1.0);
}

/// Of the fits to all training folds but one, as one linear model: columns may stand in it twice.
struct AveragedFits {
  std::vector<int> columns;
  std::vector<Eigen::VectorXd> without;
};

AveragedFits averaged(const Work& work, const Average& average) {
  AveragedFits out;
  out.without.resize(work.grams.train_folds.size());
  for (std::size_t k = 0; k < average.of.size(); ++k) {
    const Fits fits = fits_of(work, average.of[k]);
    out.columns.insert(out.columns.end(), fits.columns.begin(), fits.columns.end());
    for (std::size_t fold = 0; fold < out.without.size(); ++fold) {
      Eigen::VectorXd both(static_cast<Eigen::Index>(out.columns.size()));
      both << out.without[fold], average.parts[k] * fits.without[fold];
      out.without[fold] = std::move(both);
    }
  }
  return out;
}

}  // namespace

double stacked_part(const Work& work, const Average& one, const Choice& other) {
  constexpr double kAlike = 1e-4;  // of the squares: the fits predict the same
  const AveragedFits a = averaged(work, one), b = averaged(work, {{other}, {1.0}});
  std::vector<int> columns = a.columns;
  columns.insert(columns.end(), b.columns.begin(), b.columns.end());
  std::vector<Parabola> folds;
  double apart = 0.0, left = 0.0;
  for (std::size_t fold = 0; fold < a.without.size(); ++fold) {
    const auto squares = [&](double part) {
      Eigen::VectorXd both(static_cast<Eigen::Index>(columns.size()));
      both << part * a.without[fold], (1.0 - part) * b.without[fold];
      return held_out_squares(work.grams.train_folds[fold], columns, both);
    };
    const double none = squares(0.0), half = squares(0.5), whole = squares(1.0);
    apart += none + whole - 2.0 * half;
    left += whole;
    folds.push_back(parabola_of(none, half, whole));
  }
  const auto fits = static_cast<double>(one.of.size());
  return apart <= kAlike * left ? 1.0 : shrunk_part(folds, fits / (fits + 1.0));
}

double cross_validated(const Work& work, const Choice& choice) { return squares_of_folds(work, choice).sum(); }

/// Standard errors by which the folds' sums of squares rise from one choice to another; of their roots, or a single
/// fold could decide.
static double sure_rise(const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  const Eigen::VectorXd rise = (to - from).unaryExpr([](double d) { return std::copysign(std::sqrt(std::abs(d)), d); });
  const auto n = static_cast<double>(rise.size());
  const double spread = (rise.array() - rise.mean()).matrix().norm() / std::sqrt(n - 1.0);
  return rise.mean() / std::max(spread / std::sqrt(n), 1e-300);
}

bool predicts_better(const Eigen::VectorXd& one, const Eigen::VectorXd& other, double factor) {
  return other.sum() >= factor * one.sum() && sure_rise(one, other) >= kSureRise;
}

UnseenErrors unseen_errors(const Work& work, const Choice& choice) {
  const Fits fits = fits_of(work, choice);
  const Design& design = work.design;
  UnseenErrors out;
  std::map<std::int32_t, double> squares;  // by fold
  std::int32_t last = -1;
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const std::int32_t row = design.row[at], fold = design.fold[at];
    const Eigen::VectorXd& solution = fold < design.folds ? fits.without[static_cast<std::size_t>(fold)] : fits.whole;
    double e = design.y[i];
    for (std::size_t c = 0; c < fits.columns.size(); ++c)
      e -= design.x(i, fits.columns[c]) * solution[static_cast<Eigen::Index>(c)];
    // In metres, by their weights: a row that stands far out counts for little here as in every fit.
    e *= design.weight[i] * work.noise.position_sigma;
    if (row != last) out.length.push_back(0.0);
    last = row;
    if (kind_of(design.component[at]) != 1) out.length.back() += e * e;
    squares[fold] += e * e;
  }
  for (double& length : out.length) length = std::sqrt(length);
  for (const auto& [fold, square] : squares) out.square_of_fold.push_back(square);
  return out;
}

HeldOutFall fall_of(const std::vector<double>& before, const std::vector<double>& after,
                    const std::vector<std::int8_t>& set, const std::vector<std::int32_t>& cluster) {
  struct Squares {
    double before = 0.0, after = 0.0, rows = 0.0;
  };
  std::map<std::int32_t, Squares> of_pose;
  for (std::size_t row = 0; row < before.size(); ++row) {
    if (!set[row] || !std::isfinite(before[row]) || !std::isfinite(after[row])) continue;
    Squares& squares = of_pose[cluster[row]];
    squares.before += before[row] * before[row];
    squares.after += after[row] * after[row];
    squares.rows += 1.0;
  }
  Eigen::VectorXd fall(static_cast<Eigen::Index>(of_pose.size()));
  Eigen::Index at = 0;
  for (const auto& [pose, s] : of_pose) fall[at++] = std::sqrt(s.before / s.rows) - std::sqrt(s.after / s.rows);
  HeldOutFall out;
  out.poses = of_pose.size();
  if (out.poses < 2) return out;
  const auto n = static_cast<double>(out.poses);
  out.mean = fall.mean();
  out.sigma = (fall.array() - out.mean).matrix().norm() / std::sqrt(n * (n - 1.0));
  if (out.sigma > 0.0) out.probability = student_probability(out.mean / out.sigma, static_cast<int>(out.poses) - 1);
  return out;
}

static double sum_of(const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0); }

static double shrink_of(double from, double to) { return 1.0 - std::sqrt(to / std::max(from, 1e-300)); }

double sure_fall(const UnseenErrors& before, const UnseenErrors& after) {
  const auto n = static_cast<Eigen::Index>(before.length.size());
  const auto lengths = [&](const UnseenErrors& of) { return Eigen::Map<const Eigen::ArrayXd>(of.length.data(), n); };
  const Eigen::ArrayXd fall = lengths(before) - lengths(after);
  const double sigma =
      (fall - fall.mean()).matrix().norm() / std::sqrt(static_cast<double>(n) * static_cast<double>(n - 1));
  return fall.mean() / std::max(sigma, 1e-300);
}

Share shrinkage(const UnseenErrors& before, const UnseenErrors& after, int draws, std::uint64_t seed) {
  const std::size_t folds = before.square_of_fold.size();
  Random random(seed);
  std::vector<double> drawn;
  for (int r = 0; r < draws; ++r) {
    double from = 0.0, to = 0.0;
    for (std::size_t k = 0; k < folds; ++k) {
      const std::size_t fold = random.below(folds);
      from += before.square_of_fold[fold];
      to += after.square_of_fold[fold];
    }
    drawn.push_back(shrink_of(from, to));
  }
  return percentile_interval(std::move(drawn), shrink_of(sum_of(before.square_of_fold), sum_of(after.square_of_fold)));
}

}  // namespace truing::diagnosis
