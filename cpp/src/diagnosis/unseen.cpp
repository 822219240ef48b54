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

double stacked_part(const Work& work, const Choice& one, const Choice& other) {
  constexpr double kAlike = 1e-4;  // of the squares: the fits predict the same
  const Fits a = fits_of(work, one), b = fits_of(work, other);
  std::vector<int> columns = a.columns;
  columns.insert(columns.end(), b.columns.begin(), b.columns.end());  // some of them twice, and each time a part
  const auto squares = [&](double part) {
    double out = 0.0;
    for (std::size_t fold = 0; fold < a.without.size(); ++fold) {
      Eigen::VectorXd average(static_cast<Eigen::Index>(columns.size()));
      average << part * a.without[fold], (1.0 - part) * b.without[fold];
      out += held_out_squares(work.grams.train_folds[fold], columns, average);
    }
    return out;
  };
  // They are a parabola of the part.
  const double none = squares(0.0), half = squares(0.5), whole = squares(1.0);
  const double bend = none + whole - 2.0 * half;
  if (bend <= kAlike * whole) return 1.0;
  return std::clamp((3.0 * none + whole - 4.0 * half) / (4.0 * bend), 0.0, 1.0);
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

double shrink_of(const UnseenErrors& before, const UnseenErrors& after) {
  return shrink_of(sum_of(before.square_of_fold), sum_of(after.square_of_fold));
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
  return percentile_interval(std::move(drawn), shrink_of(before, after));
}

}  // namespace truing::diagnosis
