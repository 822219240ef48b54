// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "estimation/clustered.hpp"

#include <algorithm>
#include <map>

#include "kernel/kernel.hpp"
#include "math/linear_algebra.hpp"

namespace truing::estimation {

namespace {

/// Clusters of about so many rows are summed at a time: their scores are all that is kept.
constexpr std::size_t kRowsAtATime = 16384;
/// A cluster that nearly alone decides a parameter leaves no residual: its score cannot be made good by division.
constexpr double kMostLeverage = 0.9;
constexpr Eigen::Index kLanes = 8;  ///< rows of a Gram kernel come in multiples of so many

/// Rows by the cluster that each belongs to, side by side.
std::vector<std::int32_t> sorted_by(const std::vector<std::int32_t>& cluster, std::vector<std::int32_t> rows) {
  const auto before = [&](std::int32_t a, std::int32_t b) {
    return cluster[static_cast<std::size_t>(a)] < cluster[static_cast<std::size_t>(b)];
  };
  if (!std::is_sorted(rows.begin(), rows.end(), before)) std::stable_sort(rows.begin(), rows.end(), before);
  return rows;
}

/// R with A = R^T R, of a symmetric A whose eigenvalues are not negative but for rounding.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& A) {
  const Eigen::VectorXd scale = math::unit_scale<Eigen::Dynamic>(A);
  const auto eigen = math::symmetric_eigen<Eigen::Dynamic>(math::scaled_both<Eigen::Dynamic>(scale, A));
  return eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose() *
         scale.cwiseInverse().asDiagonal();
}

/// Scores and leverages, one a row of the data; then, folded, one a cluster.
struct Scores {
  Eigen::MatrixXd score;     ///< shape=(rows and what fills the last lanes up, parameters)
  Eigen::VectorXd leverage;  ///< of the mean of a row's values; of a cluster: summed over its rows
};

/// Of `rows` in their order; `place`: for every row of the data, scratch.
Scores scores_of(const FittedRows& fitted, const std::vector<std::int32_t>& rows, const Eigen::VectorXd& values,
                 const Weighing& weighing, const Eigen::MatrixXd& root, std::vector<std::int32_t>* place) {
  for (std::size_t at = 0; at < rows.size(); ++at)
    (*place)[static_cast<std::size_t>(rows[at])] = static_cast<std::int32_t>(at);
  std::vector<std::int32_t> ascending = rows;
  if (!std::is_sorted(ascending.begin(), ascending.end())) std::sort(ascending.begin(), ascending.end());
  const Evaluator evaluator(fitted.model, fitted.data, fitted.bases, make_segments(fitted.data, ascending), fitted.free,
                            fitted.threads);
  const auto n = static_cast<Eigen::Index>(rows.size());
  const auto p = static_cast<Eigen::Index>(fitted.free.size());
  const Eigen::Index padded = (n + kLanes - 1) / kLanes * kLanes;
  Scores out{Eigen::MatrixXd(padded, p), Eigen::VectorXd(n)};
  evaluator.scores(values, weighing, root,
                   [&](const std::int32_t* some, int count, const double* scores, const double* leverage) {
                     for (int i = 0; i < count; ++i) {
                       const Eigen::Index at = (*place)[static_cast<std::size_t>(some[i])];
                       out.leverage[at] = leverage[i];
                       for (Eigen::Index k = 0; k < p; ++k) out.score(at, k) = scores[k * kernel::kTilePoses + i];
                     }
                   });
  return out;
}

/// Sums over rows of one cluster, which stand side by side; returns the number of clusters.
Eigen::Index fold(const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& cluster, Scores* scores) {
  Eigen::Index last = -1;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const bool next =
        i == 0 || cluster[static_cast<std::size_t>(rows[i])] != cluster[static_cast<std::size_t>(rows[i - 1])];
    if (next && ++last == at) continue;  // in its place already
    if (next) {
      scores->score.row(last) = scores->score.row(at);
      scores->leverage[last] = scores->leverage[at];
    } else {
      scores->score.row(last) += scores->score.row(at);
      scores->leverage[last] += scores->leverage[at];
    }
  }
  return last + 1;
}

/// Adds the products of the first `count` rows, divided by the root of 1 - h.
void add_products(Eigen::Index count, Scores* scores, std::vector<double>* sums) {
  const Eigen::Index padded = (count + kLanes - 1) / kLanes * kLanes;
  scores->score.middleRows(count, padded - count).setZero();
  const Eigen::ArrayXd factor = (1.0 - scores->leverage.head(count).array().min(kMostLeverage)).rsqrt();
  scores->score.topRows(count).array().colwise() *= factor;
  const kernel::Functions& run = kernel::functions();
  run.gram_add(scores->score.data(), scores->score.rows(), static_cast<int>(scores->score.cols()), 0,
               static_cast<int>(padded), sums->data());
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Unit-weight residuals and Jacobian of one cluster.
struct Block {
  Eigen::VectorXd residual;
  RowMajor jacobian;  ///< shape=(values, parameters)
};

/// One block for each cluster that has a row, in the order of the clusters' numbers.
std::map<std::int32_t, Block> blocks_of(const FittedRows& fitted, const Eigen::VectorXd& values,
                                        const Weighing& weighing, const std::vector<std::int32_t>& cluster) {
  const Evaluator evaluator(fitted.model, fitted.data, fitted.bases, make_segments(fitted.data, fitted.rows),
                            fitted.free, fitted.threads);
  const auto p = static_cast<Eigen::Index>(fitted.free.size());
  std::map<std::int32_t, Block> out;
  for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
    const int components = evaluator.tile_components(tile), count = evaluator.tile_rows(tile);
    Eigen::VectorXd residual(components * count);
    RowMajor jacobian(components * count, p);
    evaluator.tile(tile, values, weighing, residual.data(), jacobian.data());
    for (int i = 0; i < count; ++i) {
      Block& block = out[cluster[static_cast<std::size_t>(evaluator.tile_numbers(tile)[i])]];
      const Eigen::Index before = block.residual.size();
      block.residual.conservativeResize(before + components);
      block.jacobian.conservativeResize(before + components, p);
      block.residual.tail(components) = residual.segment(i * components, components);
      block.jacobian.bottomRows(components) = jacobian.middleRows(i * components, components);
    }
  }
  return out;
}

/// J^T (I - H)^-1/2 r of a cluster, by the singular values of J root^T, of which the smaller product has the squares:
/// H = B B^T = U h U^T, or B^T B = V h V^T and (I - H)^-1/2 = I + B V diag(((1 - h)^-1/2 - 1) / h) V^T B^T.
Eigen::VectorXd adjusted_score(const Block& block, const Eigen::MatrixXd& root) {
  const Eigen::MatrixXd B = block.jacobian * root.transpose();
  const bool wide = B.rows() <= B.cols();
  const Eigen::MatrixXd squares = wide ? Eigen::MatrixXd(B * B.transpose()) : Eigen::MatrixXd(B.transpose() * B);
  const auto eigen = math::symmetric_eigen<Eigen::Dynamic>(squares);
  const Eigen::ArrayXd h = eigen.values.array().max(0.0).min(kMostLeverage), factor = (1.0 - h).rsqrt();
  const Eigen::VectorXd& r = block.residual;
  if (wide)
    return block.jacobian.transpose() * (eigen.vectors * (factor * (eigen.vectors.transpose() * r).array()).matrix());
  const Eigen::ArrayXd added = (h > 1e-12).select((factor - 1.0) / h.max(1e-12), 0.5);
  const Eigen::VectorXd inside = eigen.vectors.transpose() * (B.transpose() * r);
  return block.jacobian.transpose() * (r + B * (eigen.vectors * (added * inside.array()).matrix()));
}

}  // namespace

std::size_t clusters_in(const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& cluster) {
  std::vector<bool> there(cluster.size());  // clusters are numbered from 0, no more of them than rows
  std::size_t out = 0;
  for (const std::int32_t row : rows) {
    const auto number = static_cast<std::size_t>(cluster[static_cast<std::size_t>(row)]);
    if (there[number]) continue;
    there[number] = true;
    ++out;
  }
  return out;
}

Eigen::MatrixXd clustered_scores(const FittedRows& fitted, const Eigen::VectorXd& values, const Weighing& weighing,
                                 const Eigen::MatrixXd& inverse, const std::vector<std::int32_t>& cluster) {
  const std::vector<std::int32_t> rows = sorted_by(cluster, fitted.rows);
  const auto cluster_at = [&](std::size_t at) { return cluster[static_cast<std::size_t>(rows[at])]; };
  const Eigen::MatrixXd root = inverse.isZero(0.0) ? Eigen::MatrixXd(0, inverse.cols()) : root_of(inverse);
  std::vector<std::int32_t> place(fitted.data.rows);
  const kernel::Functions& run = kernel::functions();
  const auto p = static_cast<int>(fitted.free.size());
  std::vector<double> sums(run.gram_size(p), 0.0);
  for (std::size_t first = 0, end = 0; first < rows.size(); first = end) {
    while (end < rows.size() && (end - first < kRowsAtATime || cluster_at(end) == cluster_at(end - 1))) ++end;
    const std::vector<std::int32_t> some(rows.begin() + static_cast<std::ptrdiff_t>(first),
                                         rows.begin() + static_cast<std::ptrdiff_t>(end));
    Scores scores = scores_of(fitted, some, values, weighing, root, &place);
    add_products(fold(some, cluster, &scores), &scores, &sums);
  }
  Eigen::MatrixXd upper = Eigen::MatrixXd::Zero(p, p);
  run.gram_reduce(sums.data(), p, 0, upper.data());
  return upper.selfadjointView<Eigen::Upper>();
}

Eigen::MatrixXd few_clusters_scores(const FittedRows& fitted, const Eigen::VectorXd& values, const Weighing& weighing,
                                    const Eigen::MatrixXd& inverse, const std::vector<std::int32_t>& cluster) {
  const Eigen::MatrixXd root = root_of(inverse);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(inverse.rows(), inverse.cols());
  for (const auto& [number, block] : blocks_of(fitted, values, weighing, cluster)) {
    const Eigen::VectorXd score = adjusted_score(block, root);
    out.noalias() += score * score.transpose();
  }
  return out;
}

}  // namespace truing::estimation
