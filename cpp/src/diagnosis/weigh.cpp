// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What noise is: weights of rows, and the Gram matrices of weighted rows.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <thread>

#include "math/statistics.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;

/// Sums over the training rows, of some columns.
static Gram sum_flexible(const Design& design, const std::vector<int>& columns) {
  GramSum sum(static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    if (design.fold[static_cast<std::size_t>(i)] >= design.folds) continue;
    double* out = sum.row();
    for (const int column : columns) {
      *out = design.weight[i] * design.x(i, column);
      out += GramSum::stride();
    }
    *out = design.weight[i] * design.y[i];
    sum.push();
  }
  return sum.finish();
}

/// Values of one row and kind, as they follow each other in the design.
struct Block {
  Eigen::Index first = 0, count = 0;
  int kind = 0;
  bool training = false;
};

static std::vector<Block> blocks_of(const Design& design) {
  std::vector<Block> out;
  std::int32_t last = -1;
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const int kind = kind_of(design.component[at]);
    if (out.empty() || design.row[at] != last || out.back().kind != kind)
      out.push_back({i, 0, kind, design.fold[at] < design.folds});
    ++out.back().count;
    last = design.row[at];
  }
  return out;
}

/// Noise of one value, by kind, from the median length of what a row leaves; 0: no row has this kind. `used`: effective
/// parameters.
static std::array<double, 3> sigma_of(const std::vector<Block>& blocks, const Eigen::VectorXd& residual, double used) {
  std::vector<double> lengths[3];
  double training = 0.0;
  for (const Block& block : blocks) {
    if (!block.training) continue;
    lengths[block.kind].push_back(residual.segment(block.first, block.count).norm());
    training += static_cast<double>(block.count);
  }
  const double inflate = std::sqrt(training / std::max(1.0, training - used));
  std::array<double, 3> sigma{};
  for (std::size_t kind = 0; kind < 3; ++kind) {
    if (!lengths[kind].empty())
      sigma[kind] = std::max(median_of(lengths[kind]) / kChiMedian[kind == 2 ? 1 : 3] * inflate, 1e-12);
  }
  return sigma;
}

/// Unit-weight rows: each kind of value by its own noise, what stands far out by less (Huber 1964; the power makes
/// gross outliers count for nothing). The noise is what the flexible model leaves: everything at once under a ridge
/// prior, so that an effect is not taken for noise.
void weigh(Work* work) {
  Design& design = work->design;
  const Eigen::Index n = design.x.rows();
  const Measurements& data = work->data;
  Eigen::VectorXd own = Eigen::VectorXd::Ones(n);  // what the rows say of themselves
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(design.row[static_cast<std::size_t>(i)]);
    const int kind = kind_of(design.component[static_cast<std::size_t>(i)]);
    if (data.weight) own[i] = std::sqrt(data.weight[row]);
    if (kind != 1 && data.position_sigma) own[i] /= data.position_sigma[row];
    if (kind == 1 && data.rotation_sigma) own[i] /= data.rotation_sigma[row];
  }
  std::vector<int> flexible = design.nuisance;
  std::vector<bool> in(static_cast<std::size_t>(design.x.cols()), false);
  for (const int k : flexible) in[static_cast<std::size_t>(k)] = true;
  for (std::size_t g = 0; g < design.candidates.groups.size(); ++g) {
    const Explanation& e = design.candidates.named[g];
    const bool coarse_drift =
        e.kind == Kind::drift && e.effect == "drift" && e.site != "base.xyz" && e.knots[0].size() <= 12;
    if (e.kind == Kind::drift && !coarse_drift) continue;
    for (const int k : design.candidates.groups[g].columns) {
      if (!in[static_cast<std::size_t>(k)]) flexible.push_back(k);
      in[static_cast<std::size_t>(k)] = true;
    }
  }
  const std::vector<Block> blocks = blocks_of(design);
  std::array<double, 3> sigma{};
  Eigen::VectorXd residual = design.y;
  double used = 0.0;
  const auto p = static_cast<Eigen::Index>(flexible.size());
  Eigen::MatrixXd xx(p, p);
  Eigen::VectorXd xy(p);
  double summed_at = 0.0;  // noise that xx and xy were weighted with; 0: weights differ from row to row
  for (int round = 0; round < 4; ++round) {
    // Noise of each kind, and the rows that stand out.
    sigma = sigma_of(blocks, own.cwiseProduct(residual), used);
    std::size_t far = 0, very_far = 0;
    std::vector<double> distance2(blocks.size());
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto [first, count, kind, training] = blocks[b];
      const double noise = sigma[static_cast<std::size_t>(kind)];
      distance2[b] =
          own.segment(first, count).cwiseProduct(residual.segment(first, count)).squaredNorm() / (noise * noise);
      const double bound = count == 1 ? 9.0 : 14.2;  // one in 370 of normal noise
      far += distance2[b] > bound ? 1 : 0;
      very_far += distance2[b] > 3.0 * bound ? 1 : 0;
    }
    const bool tails =
        round > 0 && (very_far > 0 || static_cast<double>(far) > 4.0 + 0.01 * static_cast<double>(blocks.size()));
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto [first, count, kind, training] = blocks[b];
      const double bound = count == 1 ? 5.0 : 9.0;
      const double root = tails && distance2[b] > bound ? std::pow(bound / distance2[b], 0.75) : 1.0;
      if (round == 3 && root < 0.2) work->outliers.push_back(design.row[static_cast<std::size_t>(first)]);
      design.weight.segment(first, count) = own.segment(first, count) * root / sigma[static_cast<std::size_t>(kind)];
    }
    if (round == 3) break;
    // The flexible fit, at noise variance one. As long as all weights are equal, the sums only change their scale.
    const auto kinds = std::count_if(sigma.begin(), sigma.end(), [](double noise) { return noise > 0.0; });
    const double uniform = kinds == 1 && !tails ? *std::max_element(sigma.begin(), sigma.end()) : 0.0;
    if (uniform > 0.0 && summed_at > 0.0) {
      const double times = std::pow(summed_at / uniform, 2.0);
      xx *= times;
      xy *= times;
    } else {
      const Gram sums = sum_flexible(design, flexible);
      xx = sums.xx;
      xy = sums.xy;
    }
    summed_at = uniform;
    Eigen::MatrixXd d = xx;
    for (Eigen::Index c = 0; c < p; ++c) {
      const bool flat = c < static_cast<Eigen::Index>(design.nuisance.size());
      d(c, c) +=
          flat ? 1e-9 * xx(c, c) + 1e-30 : std::pow(0.05 * design.prior[flexible[static_cast<std::size_t>(c)]], -2.0);
    }
    const Eigen::LLT<Eigen::MatrixXd> factor = factorised(std::move(d));
    const Eigen::VectorXd solution = factor.solve(xy);
    used = factor.solve(xx).trace();  // effective number of parameters
    for (Eigen::Index i = 0; i < n; ++i) {
      double fitted = 0.0;
      for (Eigen::Index c = 0; c < p; ++c) fitted += design.x(i, flexible[static_cast<std::size_t>(c)]) * solution[c];
      residual[i] = design.y[i] - fitted;
    }
  }
  // In metres, whatever the rows say of themselves: `sigma` has no unit where they bring a sigma of their own.
  const std::array<double, 3> in_metres = sigma_of(blocks, residual, used);
  work->position_sigma = in_metres[0] > 0.0 ? in_metres[0] : in_metres[2];

  // Rows of one pose that err together count for less than their number.
  double together = 0.0, pairs = 0.0, alone = 0.0, values = 0.0;
  std::map<std::pair<std::int32_t, int>, std::array<double, 3>>
      sums;  // by pose and component: sum, sum of squares, count
  for (Eigen::Index i = 0; i < n; ++i) {
    if (design.fold[static_cast<std::size_t>(i)] >= design.folds) continue;
    const double e = design.weight[i] * residual[i];
    auto& s = sums[{design.cluster[static_cast<std::size_t>(i)], design.component[static_cast<std::size_t>(i)]}];
    s[0] += e;
    s[1] += e * e;
    s[2] += 1.0;
  }
  double squares_of_counts = 0.0;
  for (const auto& [key, s] : sums) {
    together += s[0] * s[0] - s[1];
    pairs += s[2] * (s[2] - 1.0);
    alone += s[1];
    values += s[2];
    squares_of_counts += s[2] * s[2];
  }
  if (pairs > 0.0 && alone > 0.0) {
    const double correlation = std::clamp((together / pairs) / (alone / values), 0.0, 1.0);
    work->deff = 1.0 + (squares_of_counts / values - 1.0) * correlation;
  }
}

void make_grams(Work* work) {
  const Design& design = work->design;
  const int folds = design.folds + design.test_folds;
  std::vector<Gram> grams(static_cast<std::size_t>(folds));
  const auto some = [&](int first) {
    for (int f = first; f < folds; f += 2)
      grams[static_cast<std::size_t>(f)].add(design.gram_of_fold(f), 1.0 / work->deff);
  };
  if (work->options.threads == 1) {
    some(0);
    some(1);
  } else {
    std::thread other(some, 1);
    some(0);
    other.join();
  }
  work->fold.assign(std::make_move_iterator(grams.begin()), std::make_move_iterator(grams.begin() + design.folds));
  work->test_fold.assign(std::make_move_iterator(grams.begin() + design.folds), std::make_move_iterator(grams.end()));
  work->train = work->test = Gram();
  for (const Gram& gram : work->fold) work->train.add(gram);
  for (const Gram& gram : work->test_fold) work->test.add(gram);
}

/// After columns were appended: their part of every Gram, nothing else.
void extend_grams(Work* work) {
  const Design& design = work->design;
  const Eigen::Index p = design.x.cols(), before = work->train.xx.cols(), more = p - before;
  if (more <= 0) return;
  const auto folds = static_cast<std::size_t>(design.folds + design.test_folds);
  std::vector<Eigen::MatrixXd> cross(folds, Eigen::MatrixXd::Zero(p, more));
  std::vector<Eigen::VectorXd> right(folds, Eigen::VectorXd::Zero(more));
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const double w2 = design.weight[i] * design.weight[i] / work->deff;
    if (w2 == 0.0) continue;
    const auto f = static_cast<std::size_t>(design.fold[static_cast<std::size_t>(i)]);
    for (Eigen::Index k = 0; k < more; ++k) {
      const double value = w2 * design.x(i, before + k);
      if (value == 0.0) continue;
      cross[f].col(k) += value * design.x.row(i).transpose();
      right[f][k] += value * design.y[i];
    }
  }
  const auto extend = [&](Gram* gram, const Eigen::MatrixXd& block, const Eigen::VectorXd& rhs) {
    gram->xx.conservativeResize(p, p);
    gram->xx.rightCols(more) = block;
    gram->xx.bottomRows(more) = block.transpose();
    gram->xy.conservativeResize(p);
    gram->xy.tail(more) = rhs;
  };
  Eigen::MatrixXd all[2] = {Eigen::MatrixXd::Zero(p, more), Eigen::MatrixXd::Zero(p, more)};
  Eigen::VectorXd all_right[2] = {Eigen::VectorXd::Zero(more), Eigen::VectorXd::Zero(more)};
  for (std::size_t f = 0; f < folds; ++f) {
    const bool test = f >= static_cast<std::size_t>(design.folds);
    extend(test ? &work->test_fold[f - static_cast<std::size_t>(design.folds)] : &work->fold[f], cross[f], right[f]);
    all[test ? 1 : 0] += cross[f];
    all_right[test ? 1 : 0] += right[f];
  }
  extend(&work->train, all[0], all_right[0]);
  extend(&work->test, all[1], all_right[1]);
}

}  // namespace truing::diagnosis
