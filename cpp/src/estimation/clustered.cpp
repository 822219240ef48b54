// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "estimation/clustered.hpp"

#include <algorithm>
#include <cmath>

namespace truing::estimation {

namespace {

/// Clusters of about so many rows are summed at a time: their scores are all that is kept.
constexpr std::size_t kRowsAtATime = 8192;
/// A cluster that nearly alone decides a parameter leaves no residual: its score cannot be made good by division.
constexpr double kMostLeverage = 0.9;

using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Rows of `cluster[at]` for the cluster that each belongs to, side by side.
std::vector<std::int32_t> sorted_by(const std::vector<std::int32_t>& cluster, std::vector<std::int32_t> rows) {
  std::stable_sort(rows.begin(), rows.end(), [&](std::int32_t a, std::int32_t b) {
    return cluster[static_cast<std::size_t>(a)] < cluster[static_cast<std::size_t>(b)];
  });
  return rows;
}

/// Scores and leverages of some clusters, numbered from `first`.
struct Scores {
  Eigen::MatrixXd score;     ///< shape=(parameters, clusters)
  Eigen::VectorXd leverage;  ///< of the mean of the cluster's rows
};

Scores scores_of(const FittedRows& fitted, const std::vector<std::int32_t>& rows, const Eigen::VectorXd& values,
                 const Weighing& weighing, const Eigen::MatrixXd& inverse, const std::vector<std::int32_t>& number,
                 Eigen::Index clusters) {
  const std::vector<Segment> segments = make_segments(fitted.data, rows);
  const Evaluator evaluator(fitted.model, fitted.data, fitted.bases, segments, fitted.free, 1);
  const auto p = static_cast<Eigen::Index>(fitted.free.size());
  Scores out{Eigen::MatrixXd::Zero(p, clusters), Eigen::VectorXd::Zero(clusters)};
  Columns jacobian;
  Eigen::VectorXd residual;
  int tile = 0;
  for (const Segment& segment : segments) {
    for (std::size_t at = 0; at < segment.rows.size(); ++tile) {
      const int components = evaluator.tile_components(tile), count = evaluator.tile_rows(tile);
      jacobian.resize(static_cast<Eigen::Index>(components) * count, p);
      residual.resize(jacobian.rows());
      evaluator.tile(tile, values, weighing, residual.data(), jacobian.data());
      for (int i = 0; i < count; ++i, ++at) {
        const Eigen::Index c = number[static_cast<std::size_t>(segment.rows[at])];
        const auto J = jacobian.middleRows(static_cast<Eigen::Index>(i) * components, components);
        out.score.col(c).noalias() +=
            J.transpose() * residual.segment(static_cast<Eigen::Index>(i) * components, components);
        out.leverage[c] += (J * inverse).cwiseProduct(J).sum() / components;
      }
    }
  }
  return out;
}

}  // namespace

std::size_t clusters_in(const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& cluster) {
  std::vector<std::int32_t> of_rows;
  of_rows.reserve(rows.size());
  for (const std::int32_t row : rows) of_rows.push_back(cluster[static_cast<std::size_t>(row)]);
  std::sort(of_rows.begin(), of_rows.end());
  return static_cast<std::size_t>(std::unique(of_rows.begin(), of_rows.end()) - of_rows.begin());
}

Eigen::MatrixXd clustered_scores(const FittedRows& fitted, const Eigen::VectorXd& values, const Weighing& weighing,
                                 const Eigen::MatrixXd& inverse, const std::vector<std::int32_t>& cluster) {
  const std::vector<std::int32_t> rows = sorted_by(cluster, fitted.rows);
  const auto cluster_at = [&](std::size_t at) { return cluster[static_cast<std::size_t>(rows[at])]; };
  std::vector<std::int32_t> number(fitted.data.rows, -1);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(inverse.rows(), inverse.cols());
  for (std::size_t first = 0, end = 0; first < rows.size(); first = end) {
    Eigen::Index clusters = 0;
    for (; end < rows.size(); ++end) {
      const bool next = end == first || cluster_at(end) != cluster_at(end - 1);
      if (next && end - first >= kRowsAtATime) break;
      if (next) ++clusters;
      number[static_cast<std::size_t>(rows[end])] = static_cast<std::int32_t>(clusters - 1);
    }
    std::vector<std::int32_t> some(rows.begin() + static_cast<std::ptrdiff_t>(first),
                                   rows.begin() + static_cast<std::ptrdiff_t>(end));
    std::sort(some.begin(), some.end());
    Scores scores = scores_of(fitted, some, values, weighing, inverse, number, clusters);
    for (Eigen::Index c = 0; c < clusters; ++c)
      scores.score.col(c) /= std::sqrt(1.0 - std::min(kMostLeverage, scores.leverage[c]));
    out.noalias() += scores.score * scores.score.transpose();
  }
  return out;
}

}  // namespace truing::estimation
