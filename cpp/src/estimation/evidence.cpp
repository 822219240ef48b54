// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "estimation/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "kernel/kernel.hpp"
#include "math/batch.hpp"
#include "math/linear_algebra.hpp"
#include "math/random.hpp"

namespace truing::estimation {
namespace {

/// Parts of the prior size that a group's parameters may have: from "as far off as robots get" down to noise. A scale
/// that is off by three costs half a nat a parameter: groups of many columns try the scales between as well.
std::vector<double> scales_of(std::size_t columns) {
  constexpr std::size_t kManyColumns = 8;
  if (columns > kManyColumns) return {1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001};
  return {1.0, 0.1, 0.01, 0.001};
}
/// A nuisance column that the others explain but for this fraction of its square is held at zero.
constexpr double kFlat = 1e-9;

Eigen::MatrixXd block(const Eigen::MatrixXd& m, const std::vector<int>& rows, const std::vector<int>& columns) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index j = 0; j < out.cols(); ++j) {
    const double* column = m.data() + static_cast<Eigen::Index>(columns[static_cast<std::size_t>(j)]) * m.rows();
    for (Eigen::Index i = 0; i < out.rows(); ++i) out(i, j) = column[rows[static_cast<std::size_t>(i)]];
  }
  return out;
}

Eigen::VectorXd part(const Eigen::VectorXd& v, const std::vector<int>& rows) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(rows.size()));
  for (Eigen::Index i = 0; i < out.size(); ++i) out[i] = v[rows[static_cast<std::size_t>(i)]];
  return out;
}

double log_determinant(const Eigen::LLT<Eigen::MatrixXd>& factor) {
  return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

/// Cholesky with pivots: A = L L^T, where L has as many columns as A has rank (Higham 1990, Analysis of the Cholesky
/// decomposition of a semi-definite matrix).
Eigen::MatrixXd pivoted_cholesky(const Eigen::MatrixXd& A, double tolerance) {
  Eigen::MatrixXd L(A.rows(), A.cols());
  Eigen::VectorXd rest = A.diagonal();
  Eigen::Index rank = 0;
  for (; rank < A.cols(); ++rank) {
    Eigen::Index pivot = 0;
    const double largest = rest.maxCoeff(&pivot);
    if (!(largest > tolerance)) break;
    L.col(rank) = (A.col(pivot) - L.leftCols(rank) * L.row(pivot).head(rank).transpose()) / std::sqrt(largest);
    rest -= L.col(rank).cwiseAbs2();
    rest[pivot] = 0.0;
  }
  return L.leftCols(rank);
}

/// X^T e and e^T e of noise of unit variance, from the Gram matrix alone: with X^T X = L L^T, X^T e is L z with as many
/// normal z as X has rank, and z^T z is what the columns can see of e^T e.
class WhiteNoise {
 public:
  explicit WhiteNoise(const Gram& gram) : scale_(unit_scale<Eigen::Dynamic>(gram.xx)) {
    constexpr double kNoPivot = 1e-9;
    L_ = pivoted_cholesky(scaled_both<Eigen::Dynamic>(scale_, gram.xx), kNoPivot);
    unseen_ = gram.n - static_cast<double>(L_.cols());
  }

  struct Draw {
    Eigen::VectorXd xy;
    double yy = 0.0;
  };
  Draw draw(Random* random) const {
    Eigen::VectorXd z(L_.cols());
    for (double& one : z) one = random->normal();
    Draw out{scale_.cwiseInverse().cwiseProduct(L_ * z), z.squaredNorm()};
    // A chi-square of many degrees of freedom (Wilson and Hilferty 1931).
    if (unseen_ > 0.0) {
      const double spread = 2.0 / (9.0 * unseen_);
      out.yy += unseen_ * std::pow(std::max(0.0, 1.0 - spread + std::sqrt(spread) * random->normal()), 3.0);
    }
    return out;
  }

 private:
  Eigen::VectorXd scale_;
  Eigen::MatrixXd L_;
  double unseen_ = 0.0;  ///< degrees of freedom of the noise that no column sees
};

}  // namespace

void Gram::add(const Gram& other, double times) {
  if (xx.size() == 0) {
    xx = times * other.xx;
    xy = times * other.xy;
    yy = times * other.yy;
    n = times * other.n;
    return;
  }
  xx += times * other.xx;
  xy += times * other.xy;
  yy += times * other.yy;
  n += times * other.n;
}

void Gram::scale(double times) {
  xx *= times;
  xy *= times;
  yy *= times;
  n *= times;
}

Eigen::LLT<Eigen::MatrixXd> factorised(Eigen::MatrixXd d) {
  Eigen::LLT<Eigen::MatrixXd> factor(d);
  for (double more = 1e-10; factor.info() != Eigen::Success && more < 1.0; more *= 100.0) {
    d.diagonal() *= 1.0 + more;
    d.diagonal().array() += 1e-300;
    factor.compute(d);
  }
  return factor;
}

namespace {

/// So many columns at a time.
constexpr Eigen::Index kColumnsAtATime = 64;

/// Calls work(first, count) for blocks of columns.
template <typename Work>
void for_blocks(Eigen::Index n, int threads, const Work& work) {
  const auto one = [&](std::size_t block) {
    const Eigen::Index first = static_cast<Eigen::Index>(block) * kColumnsAtATime;
    work(first, std::min(kColumnsAtATime, n - first));
  };
  for_each_on_threads(static_cast<std::size_t>((n + kColumnsAtATime - 1) / kColumnsAtATime), threads, {}, one, 1);
}

/// L^-1, by blocks of columns, which are zero above the diagonal.
Eigen::MatrixXd inverse_of_lower(const Eigen::MatrixXd& L, int threads) {
  const Eigen::Index n = L.rows();
  Eigen::MatrixXd out = Eigen::MatrixXd::Identity(n, n);
  for_blocks(n, threads, [&](Eigen::Index first, Eigen::Index count) {
    auto columns = out.block(first, first, n - first, count);
    L.bottomRightCorner(n - first, n - first).triangularView<Eigen::Lower>().solveInPlace(columns);
  });
  return out;
}

}  // namespace

// A^-1 = L^-T L^-1.
Eigen::MatrixXd upper_inverse(const Eigen::LLT<Eigen::MatrixXd>& factor, int threads) {
  const Eigen::MatrixXd half = inverse_of_lower(factor.matrixLLT(), threads);
  const Eigen::Index n = half.rows();
  Eigen::MatrixXd out(n, n);
  for_blocks(n, threads, [&](Eigen::Index first, Eigen::Index count) {
    const Eigen::Index below = n - first, last = first + count;
    out.block(0, first, last, count).noalias() =
        half.block(first, 0, below, last).transpose() * half.block(first, first, below, count);
  });
  return out;
}

Eigen::VectorXd diagonal_of_inverse(const Eigen::LLT<Eigen::MatrixXd>& factor, int threads) {
  return inverse_of_lower(factor.matrixLLT(), threads).colwise().squaredNorm().transpose();
}

double trace_of_product(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& whole) {
  double out = 0.0;
  for (Eigen::Index k = 0; k < whole.cols(); ++k)
    out += 2.0 * upper.col(k).head(k).dot(whole.col(k).head(k)) + upper(k, k) * whole(k, k);
  return out;
}

/// A symmetric matrix of which the upper triangle is given, by blocks that a cache can hold.
template <typename Upper>
static Eigen::MatrixXd whole_of_upper(const Upper& upper, Eigen::Index n) {
  constexpr Eigen::Index kBlock = 32;
  Eigen::MatrixXd out(n, n);
  for (Eigen::Index i = 0; i < n; i += kBlock) {
    const Eigen::Index rows = std::min(kBlock, n - i);
    out.block(i, i, rows, rows) = upper.block(i, i, rows, rows).template selfadjointView<Eigen::Upper>();
    for (Eigen::Index j = i + kBlock; j < n; j += kBlock) {
      const Eigen::Index columns = std::min(kBlock, n - j);
      out.block(i, j, rows, columns) = upper.block(i, j, rows, columns);
      out.block(j, i, columns, rows) = upper.block(i, j, rows, columns).transpose();
    }
  }
  return out;
}

GramSum::GramSum(Eigen::Index columns)
    : columns_(columns),
      rows_(Rows::Zero(kLength, (columns + kernel::kRowColumns) / kernel::kRowColumns * kernel::kRowColumns)) {}

void GramSum::push() {
  n_ += 1.0;
  if (++filled_ == kLength) fold_in();
}

void GramSum::fold_in() {
  const bool first = n_ <= static_cast<double>(kLength);
  if (first) sums_.resize(rows_.cols(), rows_.cols());
  kernel::functions().gram_add_rows(rows_.data(), static_cast<int>(rows_.cols()), static_cast<int>(filled_), first,
                                    sums_.data());
  filled_ = 0;
}

Gram GramSum::finish() {
  if (filled_ > 0 || n_ == 0.0) fold_in();
  Gram out;
  out.xx = whole_of_upper(sums_, columns_);
  out.xy = sums_.col(columns_).head(columns_);
  out.yy = sums_(columns_, columns_);
  out.n = std::exchange(n_, 0.0);
  return out;
}

Gram Gram::of(const std::vector<int>& columns) const { return {block(xx, columns, columns), part(xy, columns), yy, n}; }

namespace {

/// Of a column whose prior is flat.
double flat_ridge(const Gram& gram, int column) { return kFlat * std::max(gram.xx(column, column), 1e-30); }

}  // namespace

Evidence::Evidence(const Gram& gram, const std::vector<ColumnGroup>& groups, std::vector<int> nuisance,
                   const Eigen::VectorXd& prior, Nuisance treated)
    : gram_(gram), groups_(groups), nuisance_(std::move(nuisance)), prior_(prior) {
  degrees_of_freedom_ = std::max(1.0, gram.n - static_cast<double>(nuisance_.size()));
  if (treated == Nuisance::in_factor || nuisance_.empty()) return;
  eliminated_ = nuisance_.size();
  Eigen::MatrixXd d = block(gram.xx, nuisance_, nuisance_);
  for (Eigen::Index k = 0; k < d.rows(); ++k) d(k, k) += flat_ridge(gram, nuisance_[static_cast<std::size_t>(k)]);
  always_ = factorised(std::move(d));
  always_half_ = gram.xx(nuisance_, Eigen::all);
  always_.matrixL().solveInPlace(always_half_);
  always_half_y_ = always_.matrixL().solve(part(gram.xy, nuisance_));
  rest_xy_ = gram.xy - always_half_.transpose() * always_half_y_;
  rest_yy_ = gram.yy - always_half_y_.squaredNorm();
  rest_rows_.resize(static_cast<std::size_t>(gram.xx.cols()));
  for (const ColumnGroup& group : groups) rest_of_groups_.push_back(rest(group.columns, group.columns));
}

std::vector<int> Evidence::factored(const State& state) const {
  return {state.columns.begin() + static_cast<std::ptrdiff_t>(eliminated_), state.columns.end()};
}

const Eigen::VectorXd& Evidence::rest_row(int column) const {
  Eigen::VectorXd& out = rest_rows_[static_cast<std::size_t>(column)];
  if (out.size() > 0) return out;
  out = gram_.xx.col(column);  // product by product, so that what is kept has the bits of what is not
  for (Eigen::Index k = 0; k < out.size(); ++k) out[k] -= always_half_.col(column).dot(always_half_.col(k));
  return out;
}

void Evidence::keep_rest(const Choice& choice) const {
  if (eliminated_ == 0) return;
  for (const int group : choice.groups)
    for (const int column : groups_[static_cast<std::size_t>(group)].columns) rest_row(column);
}

Eigen::MatrixXd Evidence::rest(const std::vector<int>& rows, const std::vector<int>& columns) const {
  Eigen::MatrixXd out = block(gram_.xx, rows, columns);
  for (Eigen::Index i = 0; eliminated_ > 0 && i < out.rows(); ++i) {
    const int row = rows[static_cast<std::size_t>(i)];
    const Eigen::VectorXd& kept = rest_rows_[static_cast<std::size_t>(row)];
    for (Eigen::Index j = 0; j < out.cols(); ++j) {
      const int column = columns[static_cast<std::size_t>(j)];
      out(i, j) = kept.size() > 0 ? kept[column] : out(i, j) - always_half_.col(row).dot(always_half_.col(column));
    }
  }
  return out;
}

Eigen::VectorXd Evidence::rest(const std::vector<int>& columns) const {
  return part(eliminated_ == 0 ? gram_.xy : rest_xy_, columns);
}

// log p(y) = -nu/2 log(y^T y - m^T X^T y) - 1/2 log|X^T X + s^2 P| + 1/2 log|s^2 P| (MacKay 1992, eq. 4.10, with the
// noise variance s^2 at its most probable value).
Evidence::State Evidence::evaluate(const Choice& choice, double sigma2, int rounds) const {
  State out;
  out.choice = choice;
  out.columns = nuisance_;
  std::vector<double> precision;
  for (const int k : nuisance_) precision.push_back(-flat_ridge(gram_, k));  // negative: flat
  double cost = 0.0;
  for (std::size_t g = 0; g < choice.groups.size(); ++g) {
    const ColumnGroup& group = groups_[static_cast<std::size_t>(choice.groups[g])];
    cost += group.cost;
    for (const int k : group.columns) {
      out.columns.push_back(k);
      precision.push_back(std::pow(choice.scales[g] * prior_[k], -2.0));
    }
  }
  const auto p = static_cast<Eigen::Index>(out.columns.size()), first = static_cast<Eigen::Index>(eliminated_);
  const std::vector<int> own = factored(out);
  const Eigen::MatrixXd xx = rest(own, own);
  const Eigen::VectorXd xy = rest(own);
  const double yy = eliminated_ == 0 ? gram_.yy : rest_yy_;
  out.precision.resize(p);
  out.sigma2 = sigma2;
  double log_prior = 0.0;
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixXd d = xx;
    log_prior = 0.0;
    for (Eigen::Index k = 0; k < p; ++k) {
      const double given = precision[static_cast<std::size_t>(k)];
      const double ridge = given < 0.0 ? -given : out.sigma2 * given;
      out.precision[k] = ridge;
      if (k >= first) d(k - first, k - first) += ridge;
      if (given >= 0.0) log_prior += std::log(ridge);
    }
    out.factor = factorised(std::move(d));
    out.solution = out.factor.solve(xy);
    out.rss = std::max(yy - xy.dot(out.solution), 1e-12 * gram_.yy + 1e-300);
    const double left = out.rss / degrees_of_freedom_;
    const bool settled = std::abs(left / out.sigma2 - 1.0) < 1e-3;
    out.sigma2 = left;
    if (settled) break;
  }
  out.evidence = -0.5 * degrees_of_freedom_ * std::log(out.rss) - 0.5 * log_determinant(out.factor) + 0.5 * log_prior;
  if (eliminated_ > 0) {
    out.evidence -= 0.5 * log_determinant(always_);
    Eigen::VectorXd always = always_half_y_;
    for (std::size_t k = 0; k < own.size(); ++k)
      always -= out.solution[static_cast<Eigen::Index>(k)] * always_half_.col(own[k]);
    always_.matrixU().solveInPlace(always);
    const Eigen::VectorXd others = out.solution;
    out.solution.resize(p);
    out.solution << always, others;
  }
  out.score = out.evidence - cost;
  return out;
}

Evidence::State Evidence::evaluate(const Choice& choice) const {
  constexpr int kMostRounds = 12;
  return evaluate(choice, gram_.yy / std::max(1.0, gram_.n), kMostRounds);
}

Evidence::State Evidence::evaluate_at(double sigma2, const Choice& choice) const {
  State out = evaluate(choice, sigma2, 1);
  out.sigma2 = sigma2;  // where gains begin to look for theirs
  return out;
}

struct Evidence::Projected {
  Eigen::MatrixXd v;  ///< L^-1 X_S^T X
  Eigen::VectorXd u;  ///< L^-1 X_S^T y
};

Evidence::Projected Evidence::project(const State& state, int threads) const {
  Projected out;
  const std::vector<int> own = factored(state);
  out.v.resize(static_cast<Eigen::Index>(own.size()), gram_.xx.cols());
  for (Eigen::Index i = 0; i < out.v.rows(); ++i) {
    const int column = own[static_cast<std::size_t>(i)];
    if (eliminated_ == 0)
      out.v.row(i) = gram_.xx.col(column).transpose();
    else
      out.v.row(i) = rest_row(column).transpose();
  }
  for_blocks(out.v.cols(), threads, [&](Eigen::Index first, Eigen::Index count) {
    auto block = out.v.middleCols(first, count);
    state.factor.matrixL().solveInPlace(block);
  });
  out.u = state.factor.matrixL().solve(rest(own));
  return out;
}

Evidence::Gain Evidence::gain_of(const State& state, const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                 const Eigen::VectorXd& prior, double cost) const {
  Gain best;
  Eigen::LLT<Eigen::MatrixXd> factor;
  Eigen::MatrixXd m;
  for (const double scale : scales_of(static_cast<std::size_t>(b.size()))) {
    double sigma2 = state.sigma2, fall = 0.0, determinants = 0.0;
    bool good = true;
    for (int round = 0; round < 3 && good; ++round) {
      if (b.size() == 1) {  // most groups
        const double ridge = sigma2 / (scale * scale * prior[0] * prior[0]);
        fall = b[0] * b[0] / (a(0, 0) + ridge);
        determinants = std::log(ridge) - std::log(a(0, 0) + ridge);
      } else {
        const Eigen::VectorXd ridge = sigma2 * (scale * prior).array().pow(-2.0).matrix();
        m = a;
        m.diagonal() += ridge;
        factor.compute(m);
        good = factor.info() == Eigen::Success;
        if (!good) break;
        fall = factor.matrixL().solve(b).squaredNorm();
        determinants = ridge.array().log().sum() - log_determinant(factor);
      }
      fall = std::min(fall, state.rss * (1.0 - 1e-9));
      const double next = (state.rss - fall) / degrees_of_freedom_;
      if (std::abs(next / sigma2 - 1.0) < 0.05) break;
      sigma2 = next;
    }
    if (!good) continue;
    const double evidence = -0.5 * degrees_of_freedom_ * std::log1p(-fall / state.rss) + 0.5 * determinants;
    if (evidence > best.evidence) {
      best.evidence = evidence;
      best.scale = scale;
      best.share = fall / state.rss;
      best.squares = fall;
    }
  }
  best.score = best.evidence - cost;
  return best;
}

Eigen::MatrixXd Evidence::projected_on(const State& state, const std::vector<int>& columns) const {
  Eigen::MatrixXd out = rest(factored(state), columns);
  state.factor.matrixL().solveInPlace(out);
  return out;
}

Evidence::Gain Evidence::gain(const State& state, const std::vector<int>& columns, double cost) const {
  const Eigen::MatrixXd v = projected_on(state, columns);
  const Eigen::VectorXd u = state.factor.matrixL().solve(rest(factored(state)));
  return gain_of(state, rest(columns, columns) - v.transpose() * v, rest(columns) - v.transpose() * u,
                 part(prior_, columns), cost);
}

double Evidence::visible(const State& state, int column) const {
  const Eigen::VectorXd cross = rest(factored(state), {column}).col(0);
  return rest({column}, {column})(0, 0) - state.factor.matrixL().solve(cross).squaredNorm();
}

double Evidence::explained(const State& state, const std::vector<int>& what, const Eigen::VectorXd& theta,
                           const std::vector<int>& by) const {
  return explained(state, what, theta)(by);
}

std::function<double(const std::vector<int>&)> Evidence::explained(const State& state, const std::vector<int>& what,
                                                                   const Eigen::VectorXd& theta) const {
  const Eigen::VectorXd v = projected_on(state, what) * theta;
  const double all = theta.dot(rest(what, what) * theta) - v.squaredNorm();
  return [this, &state, what, theta, v, all](const std::vector<int>& by) {
    if (!(all > 0.0)) return 0.0;
    const Eigen::MatrixXd w = projected_on(state, by);
    Eigen::MatrixXd bb = rest(by, by) - w.transpose() * w;
    for (Eigen::Index k = 0; k < bb.rows(); ++k)
      bb(k, k) += 1e-9 * gram_.xx(by[static_cast<std::size_t>(k)], by[static_cast<std::size_t>(k)]) + 1e-300;
    const Eigen::VectorXd right = rest(what, by).transpose() * theta - w.transpose() * v;
    return std::min(1.0, right.dot(solve_symmetric<Eigen::Dynamic, 1>(bb, right)) / all);
  };
}

std::vector<Evidence::Gain> Evidence::gains(const State& state, int threads, std::size_t fewer) const {
  constexpr std::size_t kGroupsAtATime = 16;
  const Projected projected = project(state, threads);
  std::vector<Gain> out(groups_.size());
  const auto one = [&](std::size_t g) {
    const std::vector<int>& columns = groups_[g].columns;
    out[g].group = static_cast<int>(g);
    if (columns.empty() || columns.size() >= fewer) return;
    Eigen::MatrixXd v(projected.v.rows(), static_cast<Eigen::Index>(columns.size()));
    for (Eigen::Index i = 0; i < v.cols(); ++i) v.col(i) = projected.v.col(columns[static_cast<std::size_t>(i)]);
    const Eigen::MatrixXd a = (eliminated_ == 0 ? rest(columns, columns) : rest_of_groups_[g]) - v.transpose() * v;
    out[g] = gain_of(state, a, rest(columns) - v.transpose() * projected.u, part(prior_, columns), groups_[g].cost);
    out[g].group = static_cast<int>(g);
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      out[g].rank += a(i, i) > 1e-7 * gram_.xx(columns[k], columns[k]) ? 1 : 0;
    }
  };
  for_each_on_threads(groups_.size(), threads, {}, one, kGroupsAtATime);
  return out;
}

bool Evidence::may_enter(const State& state, int group) const {
  const ColumnGroup& g = groups_[static_cast<std::size_t>(group)];
  if (g.shadow || g.columns.empty()) return false;
  const std::vector<int>& in = state.choice.groups;
  if (std::find(in.begin(), in.end(), group) != in.end()) return false;
  if (g.corrects_law_at < 0) return true;
  return std::any_of(in.begin(), in.end(), [&](int other) {
    const ColumnGroup& o = groups_[static_cast<std::size_t>(other)];
    return o.law_at == g.corrects_law_at && o.corrects_law_at < 0;
  });
}

Choice with_one_more(Choice choice, int group, double scale) {
  choice.groups.push_back(group);
  choice.scales.push_back(scale);
  return choice;
}

Evidence::Gain Evidence::best_of(const State& state, const std::vector<Gain>& gains, int but) const {
  Gain best;
  for (const Gain& gain : gains) {
    if (gain.group != but && gain.score > best.score && may_enter(state, gain.group)) best = gain;
  }
  return best;
}

Evidence::Gain Evidence::addition_to(const State& state, const SearchOptions& options, std::size_t fewer) const {
  std::vector<Gain> worth;
  for (const Gain& gain : gains(state, options.threads, fewer)) {
    const bool plain = groups_[static_cast<std::size_t>(gain.group)].corrects_law_at < 0;
    if (plain && gain.score > options.threshold && gain.share > options.least_share) worth.push_back(gain);
  }
  return best_of(state, worth, -1);
}

Evidence::State Evidence::two_in_place(const State& state, const State& less, int gone, const std::vector<Gain>& gains,
                                       const SearchOptions& options) const {
  constexpr double kMuch = 0.5;  ///< of what the group wins, that a plainer one wins alone
  if (static_cast<int>(state.choice.groups.size()) >= options.most_groups) return state;
  const auto size_of = [&](int group) { return groups_[static_cast<std::size_t>(group)].columns.size(); };
  State best = state;
  for (const Gain& plainer : gains) {
    const bool much = plainer.score > std::max(options.threshold, kMuch * (state.score - less.score));
    const bool leaves_room = size_of(plainer.group) + 1 < size_of(gone);
    if (!much || !leaves_room || !may_enter(less, plainer.group)) continue;
    const State one = evaluate(with_one_more(less.choice, plainer.group, plainer.scale));
    const Gain beside = addition_to(one, options, size_of(gone) - size_of(plainer.group));
    if (beside.group < 0 || one.score + beside.score < best.score) continue;
    State two = evaluate(with_one_more(one.choice, beside.group, beside.scale));
    if (two.score > best.score) best = std::move(two);
  }
  if (!(best.score > state.score + options.threshold)) return state;
  const Gain more = addition_to(state, options, std::numeric_limits<std::size_t>::max());
  return best.score > state.score + options.threshold + std::max(0.0, more.score) ? best : state;
}

Evidence::State Evidence::improve(State state, const SearchOptions& options) const {
  const auto without = [&](const Choice& choice, std::size_t at) {
    Choice out;
    const ColumnGroup& gone = groups_[static_cast<std::size_t>(choice.groups[at])];
    for (std::size_t k = 0; k < choice.groups.size(); ++k) {
      const ColumnGroup& other = groups_[static_cast<std::size_t>(choice.groups[k])];
      const bool orphan = gone.corrects_law_at < 0 && gone.law_at >= 0 && other.corrects_law_at == gone.law_at;
      if (k == at || orphan) continue;
      out.groups.push_back(choice.groups[k]);
      out.scales.push_back(choice.scales[k]);
    }
    return out;
  };
  for (int round = 0; round < 6; ++round) {
    bool changed = false;
    for (std::size_t at = 0; at < state.choice.groups.size(); ++at) {
      const State less = evaluate(without(state.choice, at));
      const std::size_t before = state.choice.groups.size(), after = less.choice.groups.size();
      if (less.score > state.score - options.threshold * 0.5) {  // not worth its place
        state = less;
        changed = true;
        break;
      }
      if (before - after > 1) continue;  // a law with its correction is not swapped
      const int gone = state.choice.groups[at];
      const std::vector<Gain> in_its_place = gains(less, options.threads);
      const Gain best = best_of(less, in_its_place, gone);
      if (best.group < 0) continue;
      const State other = evaluate(with_one_more(less.choice, best.group, best.scale));
      if (other.score > state.score + 1.0) {
        state = other;
        changed = true;
        break;
      }
      State two = two_in_place(state, less, gone, in_its_place, options);
      if (two.score > state.score) {
        state = std::move(two);
        changed = true;
        break;
      }
    }
    if (!changed) break;
  }
  return state;
}

Evidence::State Evidence::search(const SearchOptions& options, const Choice& start) const {
  std::vector<State> beam = {evaluate(start)};
  State best = beam[0];
  std::vector<std::vector<int>> seen;
  while (!beam.empty() && static_cast<int>(beam[0].choice.groups.size()) < options.most_groups) {
    std::vector<State> next;
    for (const State& state : beam) {
      std::vector<Gain> ranked;
      for (const Gain& gain : gains(state, options.threads)) {
        if (may_enter(state, gain.group) && gain.score > options.threshold && gain.share > options.least_share)
          ranked.push_back(gain);
      }
      std::sort(ranked.begin(), ranked.end(), [](const Gain& a, const Gain& b) { return a.score > b.score; });
      // The law of what is in already is questioned before a second effect is believed.
      if (!ranked.empty()) {
        const auto law = std::find_if(ranked.begin(), ranked.end(), [&](const Gain& gain) {
          const ColumnGroup& g = groups_[static_cast<std::size_t>(gain.group)];
          return g.corrects_law_at >= 0 ||
                 (g.law_at >= 0 && std::any_of(state.choice.groups.begin(), state.choice.groups.end(), [&](int in) {
                    return groups_[static_cast<std::size_t>(in)].law_at == g.law_at;
                  }));
        });
        if (law != ranked.end() && law->score >= options.law_share * ranked[0].score)
          std::rotate(ranked.begin(), law, law + 1);
      }
      const std::size_t width = state.choice.groups.empty() ? static_cast<std::size_t>(2 * options.beam)
                                                            : static_cast<std::size_t>(options.beam);
      for (std::size_t k = 0; k < std::min(ranked.size(), width); ++k) {
        const Choice grown = with_one_more(state.choice, ranked[k].group, ranked[k].scale);
        std::vector<int> key = grown.groups;
        std::sort(key.begin(), key.end());
        if (std::find(seen.begin(), seen.end(), key) != seen.end()) continue;
        seen.push_back(key);
        next.push_back(evaluate(grown));
      }
    }
    std::sort(next.begin(), next.end(), [](const State& a, const State& b) { return a.score > b.score; });
    if (next.size() > static_cast<std::size_t>(options.beam)) next.resize(static_cast<std::size_t>(options.beam));
    if (!next.empty() && next[0].score > best.score)
      best = next[0];
    else if (!next.empty() && next[0].score < best.score - 1.0)
      break;
    beam = std::move(next);
  }
  return improve(best, options);
}

std::vector<double> Evidence::null_scores(const State& state, int count, std::uint64_t seed, int threads) const {
  constexpr std::size_t kDrawsAtATime = 8;
  const WhiteNoise noise(gram_);
  const Projected projected = project(state);
  struct Prepared {
    const ColumnGroup* group;
    Eigen::MatrixXd v;
    std::vector<Eigen::LLT<Eigen::MatrixXd>> factor;  ///< by scale
    std::vector<double> determinants;
  };
  std::vector<Prepared> prepared;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (!may_enter(state, static_cast<int>(g))) continue;
    const std::vector<int>& columns = groups_[g].columns;
    Prepared one;
    one.group = &groups_[g];
    one.v.resize(projected.v.rows(), static_cast<Eigen::Index>(columns.size()));
    for (Eigen::Index i = 0; i < one.v.cols(); ++i)
      one.v.col(i) = projected.v.col(columns[static_cast<std::size_t>(i)]);
    const Eigen::MatrixXd a = rest(columns, columns) - one.v.transpose() * one.v;
    const Eigen::VectorXd size = part(prior_, columns);
    for (const double scale : scales_of(columns.size())) {
      const Eigen::VectorXd ridge = state.sigma2 * (scale * size).array().pow(-2.0).matrix();
      Eigen::MatrixXd m = a;
      m.diagonal() += ridge;
      one.factor.emplace_back(m);
      one.determinants.push_back(ridge.array().log().sum() - log_determinant(one.factor.back()));
    }
    prepared.push_back(std::move(one));
  }
  Random random(seed);
  std::vector<WhiteNoise::Draw> draws;
  for (int k = 0; k < count; ++k) draws.push_back(noise.draw(&random));
  std::vector<double> out(draws.size(), -1e300);
  const auto score = [&](std::size_t k) {
    auto& [xy, yy] = draws[k];
    xy *= std::sqrt(state.sigma2);
    yy *= state.sigma2;
    if (eliminated_ > 0) {
      const Eigen::VectorXd always = always_.matrixL().solve(part(xy, nuisance_));
      xy -= always_half_.transpose() * always;
      yy -= always.squaredNorm();
    }
    const Eigen::VectorXd u = state.factor.matrixL().solve(part(xy, factored(state)));
    const double rss = std::max(yy - u.squaredNorm(), 1e-300);
    for (const Prepared& one : prepared) {
      const Eigen::VectorXd b = part(xy, one.group->columns) - one.v.transpose() * u;
      for (std::size_t s = 0; s < one.factor.size(); ++s) {
        const double fall = std::min(one.factor[s].matrixL().solve(b).squaredNorm(), (1.0 - 1e-9) * rss);
        out[k] = std::max(
            out[k], -0.5 * degrees_of_freedom_ * std::log1p(-fall / rss) + 0.5 * one.determinants[s] - one.group->cost);
      }
    }
  };
  for_each_on_threads(draws.size(), threads, {}, score, kDrawsAtATime);
  return out;
}

double detection_nats(double threshold, double cost, std::size_t columns, double values) {
  return threshold + cost + 0.5 * static_cast<double>(columns) * std::log(1.0 + values);
}

double held_out_squares(const Gram& held_out, const std::vector<int>& columns, const Eigen::VectorXd& solution) {
  return held_out.yy - 2.0 * solution.dot(part(held_out.xy, columns)) +
         solution.dot(block(held_out.xx, columns, columns) * solution);
}

}  // namespace truing::estimation
