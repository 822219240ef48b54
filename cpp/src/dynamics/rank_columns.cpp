// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Candidates beside columns that are always in: evidence, and squares of folds that were not fitted.

#include <algorithm>
#include <stdexcept>

#include "estimation/evidence.hpp"
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

}  // namespace

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
