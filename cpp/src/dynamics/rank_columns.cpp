// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Candidates beside columns that are always in: their sums, evidence, and squares of folds that were not fitted.

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "estimation/evidence.hpp"
#include "math/batch.hpp"
#include "rooms.hpp"
#include "truing/dynamics/servo.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;

Gram gram_of(const ColumnSums& sums) { return {sums.xx, sums.xy, sums.yy, sums.n}; }

void check(const std::vector<ColumnSums>& folds, const std::vector<int>& always,
           const std::vector<std::vector<int>>& candidates, const std::vector<double>& costs,
           const Eigen::VectorXd& prior) {
  const Index n = prior.size();
  if (folds.empty()) throw std::invalid_argument("rank_columns: no fold");
  for (const ColumnSums& fold : folds) {
    if (fold.xx.rows() != n || fold.xx.cols() != n || fold.xy.size() != n)
      throw std::invalid_argument("rank_columns: a fold's sums and the priors have other shapes");
  }
  if (costs.size() != candidates.size())
    throw std::invalid_argument("rank_columns: a cost for each candidate expected");
  const auto there = [&](int c) { return c >= 0 && c < n; };
  bool good = std::all_of(always.begin(), always.end(), there);
  for (const std::vector<int>& one : candidates) good = good && std::all_of(one.begin(), one.end(), there);
  if (!good) throw std::invalid_argument("rank_columns: a column that there is not");
}

/// Squares of every fold by the ridge fit of a state to all others.
Eigen::VectorXd squares_of_folds(const Gram& all, const std::vector<Gram>& folds, const Evidence::State& state) {
  const Gram here = all.of(state.columns);
  Eigen::VectorXd out(static_cast<Index>(folds.size()));
  for (std::size_t f = 0; f < folds.size(); ++f) {
    const Gram held = folds[f].of(state.columns);
    Eigen::MatrixXd d = here.xx - held.xx;
    d.diagonal() += state.precision;
    const Eigen::VectorXd solution = factorised(std::move(d)).solve(here.xy - held.xy);
    out[static_cast<Index>(f)] = held.yy - 2.0 * solution.dot(held.xy) + solution.dot(held.xx * solution);
  }
  return out;
}

/// Sums of one joint and fold over the columns that are seen there.
struct JointFold {
  std::vector<int> columns;
  Gram gram;
};

/// One joint's and one fold's rows.
JointFold sum_joint(const std::vector<ColumnValues>& columns, const ColumnRows& of, int joint,
                    const std::vector<Index>& rows) {
  const Index joints = of.weight.size();
  JointFold out;
  for (std::size_t k = 0; k < columns.size(); ++k)
    if (columns[k].joint < 0 || columns[k].joint == joint) out.columns.push_back(static_cast<int>(k));
  const double weight = of.weight[joint] * std::sqrt(static_cast<double>(of.every));
  GramSum sum(static_cast<Index>(out.columns.size()));
  for (const Index row : rows) {
    double* to = sum.row();
    for (const int k : out.columns) {
      const ColumnValues& column = columns[static_cast<std::size_t>(k)];
      *to++ = weight * column.values[column.joint < 0 ? row * joints + joint : row];
    }
    *to = weight * of.measured[row * joints + joint];
    sum.push();
  }
  out.gram = sum.finish();
  return out;
}

}  // namespace

std::vector<ColumnSums> sum_columns(const std::vector<ColumnValues>& columns, const ColumnRows& rows, int threads) {
  const auto joints = static_cast<std::size_t>(rows.weight.size());
  const auto n = static_cast<Index>(columns.size());
  for (const ColumnValues& one : columns)
    if (one.joint >= static_cast<int>(joints)) throw std::invalid_argument("sum_columns: a joint that there is not");
  if (rows.every < 1 || rows.folds < 1) throw std::invalid_argument("sum_columns: no fold, or no rows are taken");
  std::vector<std::vector<Index>> of_fold(static_cast<std::size_t>(rows.folds));
  for (std::size_t r = 0; r < rows.fold.size(); r += static_cast<std::size_t>(rows.every)) {
    if (rows.fold[r] < 0 || rows.fold[r] >= rows.folds)
      throw std::invalid_argument("sum_columns: a fold that there is not");
    of_fold[static_cast<std::size_t>(rows.fold[r])].push_back(static_cast<Index>(r));
  }
  std::vector<JointFold> parts(joints * of_fold.size());
  const auto work = [&](std::size_t k) {
    parts[k] = sum_joint(columns, rows, static_cast<int>(k % joints), of_fold[k / joints]);
  };
  for_each_on_threads(parts.size(), threads, {}, work, 1);
  std::vector<ColumnSums> out(of_fold.size());
  for (std::size_t f = 0; f < out.size(); ++f) {
    out[f].xx = Eigen::MatrixXd::Zero(n, n);
    out[f].xy = Eigen::VectorXd::Zero(n);
    out[f].n = static_cast<double>(of_fold[f].size());
    for (std::size_t j = 0; j < joints; ++j) {
      const JointFold& part = parts[f * joints + j];
      for (std::size_t b = 0; b < part.columns.size(); ++b) {
        for (std::size_t a = 0; a < part.columns.size(); ++a)
          out[f].xx(part.columns[a], part.columns[b]) += part.gram.xx(static_cast<Index>(a), static_cast<Index>(b));
        out[f].xy[part.columns[b]] += part.gram.xy[static_cast<Index>(b)];
      }
      out[f].yy += part.gram.yy;
    }
  }
  return out;
}

std::vector<ColumnGain> rank_columns(const std::vector<ColumnSums>& folds, const std::vector<int>& always,
                                     const std::vector<std::vector<int>>& candidates, const std::vector<double>& costs,
                                     const Eigen::VectorXd& prior) {
  check(folds, always, candidates, costs, prior);
  std::vector<Gram> parts;
  Gram all;
  for (const ColumnSums& fold : folds) {
    parts.push_back(gram_of(fold));
    all.add(parts.back());
  }
  std::vector<ColumnGroup> groups;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    ColumnGroup group;
    group.columns = candidates[c];
    group.cost = costs[c];
    groups.push_back(std::move(group));
  }
  const Evidence evidence(all, groups, always, prior);
  const Evidence::State base = evidence.evaluate({});
  const std::vector<Evidence::Gain> gains = evidence.gains(base);
  std::vector<ColumnGain> out(1 + candidates.size());
  out[0].folds = squares_of_folds(all, parts, base);
  std::size_t best = 0;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    ColumnGain& to = out[c + 1];
    to.score = gains[c].score;
    to.scale = gains[c].scale;
    to.share = gains[c].share;
    to.rank = gains[c].rank;
    const Evidence::State with = evidence.evaluate({{static_cast<int>(c)}, {gains[c].scale}});
    to.values = with.solution.tail(static_cast<Index>(candidates[c].size()));
    to.folds = squares_of_folds(all, parts, with);
    if (best == 0 || to.score > out[best].score) best = c + 1;
  }
  for (std::size_t c = 0; c < candidates.size() && best > 0; ++c)
    out[c + 1].explains_best = evidence.explained(base, candidates[best - 1], out[best].values, candidates[c]);
  return out;
}

}  // namespace truing::dynamics
