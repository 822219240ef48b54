// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What noise is: weights of rows, and the Gram matrices of weighted rows.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "math/batch.hpp"
#include "math/statistics.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;

/// Sums over the values of the training folds that are `wanted`, by fold and kind, of some columns.
template <typename Wanted>
static Gram sum_of(const Design& design, const Eigen::VectorXd& weight, const std::vector<int>& columns,
                   const Wanted& wanted) {
  GramSum sum(static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const std::int32_t fold = design.fold[static_cast<std::size_t>(i)];
    if (fold >= design.folds || !wanted(fold, kind_of(design.component[static_cast<std::size_t>(i)]))) continue;
    double* out = sum.row();
    for (const int column : columns) {
      *out = weight[i] * design.x(i, column);
      ++out;
    }
    *out = weight[i] * design.y[i];
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

/// Of positions, rotations and distances.
using ByKind = std::array<double, 3>;

/// Noise of one value, by kind, from the median length of what a row leaves; 0: no row has this kind. `used`: effective
/// parameters that its values determine.
static ByKind sigma_of(const std::vector<Block>& blocks, const Eigen::VectorXd& residual, const ByKind& used) {
  std::vector<double> lengths[3];
  ByKind values{}, sigma{};
  for (const Block& block : blocks) {
    if (!block.training) continue;
    lengths[block.kind].push_back(residual.segment(block.first, block.count).norm());
    values[static_cast<std::size_t>(block.kind)] += static_cast<double>(block.count);
  }
  for (std::size_t kind = 0; kind < 3; ++kind) {
    if (lengths[kind].empty()) continue;
    const double inflate = std::sqrt(values[kind] / std::max(1.0, values[kind] - used[kind]));
    sigma[kind] = std::max(median_of(lengths[kind]) / kChiMedian[kind == 2 ? 1 : 3] * inflate, 1e-12);
  }
  return sigma;
}

/// What the rows say of themselves: their own weight over their own sigma.
static Eigen::VectorXd own_weights(const Design& design, const Measurements& data) {
  Eigen::VectorXd out = Eigen::VectorXd::Ones(design.x.rows());
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const auto row = static_cast<std::size_t>(design.row[static_cast<std::size_t>(i)]);
    const int kind = kind_of(design.component[static_cast<std::size_t>(i)]);
    if (data.weight) out[i] = std::sqrt(data.weight[row]);
    if (kind != 1 && data.position_sigma) out[i] /= data.position_sigma[row];
    if (kind == 1 && data.rotation_sigma) out[i] /= data.rotation_sigma[row];
  }
  return out;
}

/// Columns of the flexible model: the nuisance first, then everything but frames that wander as fast as noise does.
static std::vector<int> flexible_columns(const Design& design) {
  std::vector<int> out = design.nuisance;
  std::vector<bool> in(static_cast<std::size_t>(design.x.cols()), false);
  for (const int k : out) in[static_cast<std::size_t>(k)] = true;
  for (std::size_t g = 0; g < design.candidates.groups.size(); ++g) {
    const Explanation& e = design.candidates.named[g];
    const bool coarse_drift = e.kind == Kind::drift && frame_coordinates(e.site).size() == 6 && e.knots[0].size() <= 12;
    if (is_over_time(e) && !coarse_drift) continue;
    for (const int k : design.candidates.groups[g].columns) {
      if (!in[static_cast<std::size_t>(k)]) out.push_back(k);
      in[static_cast<std::size_t>(k)] = true;
    }
  }
  return out;
}

/// The nuisance and all links together.
static std::vector<int> columns_of_links(const Design& design) {
  std::vector<int> out = design.nuisance;
  for (std::size_t g = 0; g < design.candidates.groups.size(); ++g) {
    if (design.candidates.named[g].kind != Kind::all_geometry) continue;
    const std::vector<int>& links = design.candidates.groups[g].columns;
    out.insert(out.end(), links.begin(), links.end());
  }
  return out;
}

/// What rows that were held out show of a fit that did not see them: their noise and the fit's own error.
static ByKind sigma_of_predictions(std::vector<Block> blocks, const Eigen::VectorXd& residual, const ByKind& noise) {
  for (Block& block : blocks) block.training = !block.training;
  ByKind sigma = sigma_of(blocks, residual, {});
  for (std::size_t kind = 0; kind < 3; ++kind) sigma[kind] = std::max(sigma[kind], noise[kind]);
  return sigma;
}

/// Squared length of what every block leaves, in units of what it should leave: `sigma`, and `predicted` of rows held
/// out.
static std::vector<double> standardised_squares(const std::vector<Block>& blocks, const Eigen::VectorXd& own,
                                                const Eigen::VectorXd& residual, const ByKind& sigma,
                                                const ByKind& predicted) {
  std::vector<double> out(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const auto [first, count, kind, training] = blocks[b];
    const double noise = (training ? sigma : predicted)[static_cast<std::size_t>(kind)];
    out[b] = own.segment(first, count).cwiseProduct(residual.segment(first, count)).squaredNorm() / (noise * noise);
  }
  return out;
}

/// Do more rows stand far out than normal noise has?
static bool has_tails(const std::vector<Block>& blocks, const std::vector<double>& squares) {
  std::size_t far = 0, very_far = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const double bound = blocks[b].count == 1 ? 9.0 : 14.2;  // one in 370 of normal noise
    far += squares[b] > bound ? 1 : 0;
    very_far += squares[b] > 3.0 * bound ? 1 : 0;
  }
  return very_far > 0 || static_cast<double>(far) > 4.0 + 0.01 * static_cast<double>(blocks.size());
}

/// Root of a block's robust weight: (c^2 / s^2)^1.5 beyond c. Huber (1964); the power makes gross outliers count for
/// nothing.
static double root_weight(const Block& block, double square) {
  const double bound = block.count == 1 ? 5.0 : 9.0;
  return square > bound ? std::pow(bound / square, 0.75) : 1.0;
}

namespace {

/// The flexible fit: everything at once under a ridge prior, at noise variance one, so that an effect is not taken for
/// noise.
class FlexibleFit {
 public:
  FlexibleFit(const Design& design, std::vector<int> columns, int threads)
      : design_(design), columns_(std::move(columns)), threads_(threads), residual_(design.y) {
    std::set<int> kinds;
    for (const std::int8_t component : design.component) kinds.insert(kind_of(component));
    kinds_.assign(kinds.begin(), kinds.end());
  }

  /// Sums rows with these weights. `uniform`: the one noise that all are weighted with, and then the sums of the time
  /// before only change their scale; 0: weights differ from row to row.
  void sum(const Eigen::VectorXd& weight, double uniform) {
    if (uniform > 0.0 && summed_at_ > 0.0) {
      for (Gram& part : parts_) part.scale(std::pow(summed_at_ / uniform, 2.0));
    } else {
      parts_.assign(kParts * kinds_.size(), {});
      const auto work = [&](std::size_t k) {
        const auto wanted = [&](std::int32_t fold, int kind) {
          return part_of(fold) == k % kParts && kind == kinds_[k / kParts];
        };
        parts_[k] = sum_of(design_, weight, columns_, wanted);
      };
      for_each_on_threads(parts_.size(), threads_, {}, work, 1);
    }
    summed_at_ = uniform;
  }

  /// To what was summed.
  void fit() {
    Gram all = total([](std::size_t, std::size_t) { return true; });
    const Eigen::VectorXd precision = precision_of(all);
    const Eigen::LLT<Eigen::MatrixXd> factor = factorised(with_diagonal(std::move(all.xx), precision));
    const Eigen::VectorXd solution = factor.solve(all.xy);
    used_ = {};
    if (kinds_.size() == 1) {
      // The trace of A^-1 (A - P) with a diagonal P.
      used_[static_cast<std::size_t>(kinds_[0])] =
          static_cast<double>(precision.size()) - precision.dot(diagonal_of_inverse(factor, threads_));
    } else {
      const Eigen::MatrixXd inverse = upper_inverse(factor, threads_);
      for (std::size_t k = 0; k < kinds_.size(); ++k) {
        const Gram of_kind = total([&](std::size_t, std::size_t kind) { return kind == k; });
        used_[static_cast<std::size_t>(kinds_[k])] = trace_of_product(inverse, of_kind.xx);
      }
    }
    for (Eigen::Index i = 0; i < residual_.size(); ++i) residual_[i] = design_.y[i] - fitted(i, solution);
  }

  /// What every part of the training folds shows of a fit to the others.
  Eigen::VectorXd predicted_residual() const {
    std::array<Eigen::VectorXd, kParts> solutions;
    const auto work = [&](std::size_t held_out) {
      Gram others = total([&](std::size_t part, std::size_t) { return part != held_out; });
      const Eigen::VectorXd precision = precision_of(others);
      solutions[held_out] = factorised(with_diagonal(std::move(others.xx), precision)).solve(others.xy);
    };
    for_each_on_threads(kParts, threads_, {}, work, 1);
    Eigen::VectorXd out = residual_;
    for (Eigen::Index i = 0; i < out.size(); ++i) {
      const std::int32_t fold = design_.fold[static_cast<std::size_t>(i)];
      if (fold < design_.folds) out[i] = design_.y[i] - fitted(i, solutions[part_of(fold)]);
    }
    return out;
  }

  const Eigen::VectorXd& residual() const { return residual_; }
  /// Effective number of parameters: the trace of the smoother matrix (Hastie and Tibshirani 1990), over values of each
  /// kind.
  const ByKind& used() const { return used_; }

 private:
  static constexpr std::size_t kParts = 4;
  static std::size_t part_of(std::int32_t fold) { return static_cast<std::size_t>(fold) % kParts; }

  /// The sums of some parts and kinds.
  template <typename Wanted>
  Gram total(const Wanted& wanted) const {
    Gram out;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      if (wanted(k % kParts, k / kParts)) out.add(parts_[k]);
    }
    return out;
  }

  /// Of the prior: flat for the nuisance.
  Eigen::VectorXd precision_of(const Gram& gram) const {
    Eigen::VectorXd out = 1e-9 * gram.xx.diagonal().array() + 1e-30;
    for (auto c = static_cast<Eigen::Index>(design_.nuisance.size()); c < out.size(); ++c)
      out[c] = std::pow(0.05 * design_.prior[columns_[static_cast<std::size_t>(c)]], -2.0);
    return out;
  }

  static Eigen::MatrixXd with_diagonal(Eigen::MatrixXd xx, const Eigen::VectorXd& more) {
    xx.diagonal() += more;
    return xx;
  }

  double fitted(Eigen::Index row, const Eigen::VectorXd& solution) const {
    double out = 0.0;
    for (Eigen::Index c = 0; c < solution.size(); ++c)
      out += design_.x(row, columns_[static_cast<std::size_t>(c)]) * solution[c];
    return out;
  }

  const Design& design_;
  const std::vector<int> columns_;
  int threads_;
  std::vector<int> kinds_;   // that there are values of
  std::vector<Gram> parts_;  // of each of these kinds, kParts one after the other
  Eigen::VectorXd residual_;
  ByKind used_{};
  double summed_at_ = 0.0;  // noise that the sums were weighted with
};

}  // namespace

/// By how much less than everything at once, which misses `all`, the best of some models misses poses that it did not
/// see, by kind of value: few poses are predicted worse by a fit of everything than by frames alone, or links as well.
static ByKind less_than_everything(const ByKind& all, std::vector<FlexibleFit> others, const std::vector<Block>& blocks,
                                   const Eigen::VectorXd& own, const Eigen::VectorXd& weight) {
  ByKind out = {1.0, 1.0, 1.0};
  for (FlexibleFit& model : others) {
    model.sum(weight, 0.0);
    const ByKind sigma = sigma_of(blocks, own.cwiseProduct(model.predicted_residual()), {});
    for (std::size_t kind = 0; kind < out.size(); ++kind)
      if (all[kind] > 0.0) out[kind] = std::min(out[kind], sigma[kind] / all[kind]);
  }
  return out;
}

/// Are there poses with more than one row?
static bool has_repeats(const Design& design) {
  const std::set<std::int32_t> rows(design.row.begin(), design.row.end()),
      poses(design.cluster.begin(), design.cluster.end());
  return poses.size() < rows.size();
}

/// Of cluster sampling (Kish 1965): rows of one pose that err together count for less than their number. `residual`: of
/// poses that the fit did not see, for a flexible fit passes through the few poses that it saw.
static double design_effect_of(const Design& design, const Eigen::VectorXd& weight, const Eigen::VectorXd& residual) {
  struct Sums {
    double errors = 0.0, squares = 0.0, count = 0.0;
  };
  std::map<std::pair<std::int32_t, int>, Sums> of_pose;  // and component
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    if (design.fold[static_cast<std::size_t>(i)] >= design.folds) continue;
    const double e = weight[i] * residual[i];
    Sums& s = of_pose[{design.cluster[static_cast<std::size_t>(i)], design.component[static_cast<std::size_t>(i)]}];
    s.errors += e;
    s.squares += e * e;
    s.count += 1.0;
  }
  double together = 0.0, pairs = 0.0, alone = 0.0, values = 0.0, squares_of_counts = 0.0;
  for (const auto& [key, s] : of_pose) {
    together += s.errors * s.errors - s.squares;
    pairs += s.count * (s.count - 1.0);
    alone += s.squares;
    values += s.count;
    squares_of_counts += s.count * s.count;
  }
  if (!(pairs > 0.0 && alone > 0.0)) return 1.0;
  const double correlation = std::clamp((together / pairs) / (alone / values), 0.0, 1.0);
  return 1.0 + (squares_of_counts / values - 1.0) * correlation;
}

Weighted weigh(const Design& design, const Measurements& data, int threads) {
  constexpr int kFits = 3;               // fits
  constexpr double kSaturated = 0.5;     // of the training values, that the fit's effective parameters are
  constexpr double kCountsLittle = 0.2;  // root of the weight of a row that is said to be an outlier
  const std::vector<Block> blocks = blocks_of(design);
  const Eigen::VectorXd own = own_weights(design, data);
  FlexibleFit flexible(design, flexible_columns(design), threads);
  const std::vector<FlexibleFit> plainer = {{design, design.nuisance, threads},
                                            {design, columns_of_links(design), threads}};
  const auto values =
      std::count_if(design.fold.begin(), design.fold.end(), [&](std::int32_t fold) { return fold < design.folds; });
  Weighted out;
  out.weight = Eigen::VectorXd::Zero(design.x.rows());
  for (int round = 0;; ++round) {
    // A fit that passes through most of what it saw says nothing of noise: then what it predicts of other poses counts.
    const ByKind& fitted = flexible.used();
    const bool predicts = fitted[0] + fitted[1] + fitted[2] > kSaturated * static_cast<double>(values);
    const Eigen::VectorXd residual = predicts ? flexible.predicted_residual() : flexible.residual();
    const ByKind used = predicts ? ByKind{} : fitted;
    const ByKind sigma = sigma_of(blocks, own.cwiseProduct(residual), used);
    const ByKind predicted = predicts ? sigma : sigma_of_predictions(blocks, own.cwiseProduct(residual), sigma);
    const std::vector<double> squares = standardised_squares(blocks, own, residual, sigma, predicted);
    const bool tails = round > 0 && has_tails(blocks, standardised_squares(blocks, own, residual, sigma, sigma));
    const bool bounded = predicts && round == kFits;
    const ByKind less = bounded ? less_than_everything(sigma, plainer, blocks, own, out.weight) : ByKind{1.0, 1.0, 1.0};
    ByKind noise{};
    for (std::size_t kind = 0; kind < noise.size(); ++kind) noise[kind] = less[kind] * sigma[kind];
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto [first, count, kind, training] = blocks[b];
      const double root = tails ? root_weight(blocks[b], squares[b]) : 1.0;
      if (round == kFits && root < kCountsLittle)
        out.noise.outliers.push_back(design.row[static_cast<std::size_t>(first)]);
      out.weight.segment(first, count) = own.segment(first, count) * root / noise[static_cast<std::size_t>(kind)];
    }
    out.noise.unit = noise[0] > 0.0 ? noise[0] : noise[2];
    // In metres, whatever the rows say of themselves: their own sigmas have taken the unit away.
    const ByKind in_metres = sigma_of(blocks, residual, used);
    out.noise.position_sigma = in_metres[0] > 0.0 ? less[0] * in_metres[0] : less[2] * in_metres[2];
    if (round == kFits) break;
    const auto kinds = std::count_if(sigma.begin(), sigma.end(), [](double one) { return one > 0.0; });
    flexible.sum(out.weight, kinds == 1 && !tails ? *std::max_element(noise.begin(), noise.end()) : 0.0);
    flexible.fit();
  }
  if (has_repeats(design))
    out.noise.design_effect = design_effect_of(design, out.weight, flexible.predicted_residual());
  return out;
}

double noise_of_positions(const Work& work, const Evidence::State& state) {
  const Design& design = work.design;
  struct KindLeft {
    double squares = 0.0, values = 0.0, used = 0.0;
    double variance() const { return squares / std::max(1.0, values - used); }
  };
  KindLeft positions, all;
  const auto p = static_cast<Eigen::Index>(state.columns.size());
  Eigen::VectorXd x(p);
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (design.fold[at] >= design.folds) continue;
    for (Eigen::Index c = 0; c < p; ++c)
      x[c] = design.weight[i] * design.x(i, state.columns[static_cast<std::size_t>(c)]);
    const double left = design.weight[i] * design.y[i] - x.dot(state.solution);
    state.factor.matrixL().solveInPlace(x);
    for (KindLeft* sum : {&all, &positions}) {
      if (sum == &positions && kind_of(design.component[at]) == 1) continue;
      sum->squares += left * left;
      sum->values += 1.0;
      sum->used += x.squaredNorm() / work.noise.design_effect;
    }
  }
  const double times = all.values > positions.values ? positions.variance() / all.variance() : 1.0;
  return work.noise.position_sigma * std::sqrt(state.sigma2 * times);
}

Grams make_grams(const Design& design, double design_effect, int threads) {
  const int folds = design.folds + design.test_folds;
  std::vector<Gram> grams(static_cast<std::size_t>(folds));
  constexpr std::size_t kTogether = 2;  // threads at most, for the sums of each take memory
  const auto some = [&](std::size_t first) {
    GramSum sum(design.x.cols());
    for (auto f = static_cast<int>(first); f < folds; f += kTogether) {
      Gram gram = design.gram_of_fold(f, &sum);
      if (design_effect != 1.0) gram.scale(1.0 / design_effect);
      grams[static_cast<std::size_t>(f)] = std::move(gram);
    }
  };
  for_each_on_threads(kTogether, threads, {}, some, 1);
  Grams out;
  out.train_folds.assign(std::make_move_iterator(grams.begin()), std::make_move_iterator(grams.begin() + design.folds));
  out.test_folds.assign(std::make_move_iterator(grams.begin() + design.folds), std::make_move_iterator(grams.end()));
  for (const Gram& gram : out.train_folds) out.train.add(gram);
  for (const Gram& gram : out.test_folds) out.test.add(gram);
  return out;
}

/// After columns were appended: their part of every Gram, nothing else.
void extend_grams(const Design& design, double design_effect, Grams* grams) {
  const Eigen::Index p = design.x.cols(), before = grams->train.xx.cols(), more = p - before;
  if (more <= 0) return;
  const auto folds = static_cast<std::size_t>(design.folds + design.test_folds);
  std::vector<Eigen::MatrixXd> cross(folds, Eigen::MatrixXd::Zero(p, more));
  std::vector<Eigen::VectorXd> right(folds, Eigen::VectorXd::Zero(more));
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const double w2 = design.weight[i] * design.weight[i] / design_effect;
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
    extend(test ? &grams->test_folds[f - static_cast<std::size_t>(design.folds)] : &grams->train_folds[f], cross[f],
           right[f]);
    all[test ? 1 : 0] += cross[f];
    all_right[test ? 1 : 0] += right[f];
  }
  extend(&grams->train, all[0], all_right[0]);
  extend(&grams->test, all[1], all_right[1]);
}

}  // namespace truing::diagnosis
