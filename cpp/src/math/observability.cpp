// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "math/observability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/linear_algebra.hpp"

namespace truing::math {

Rank find_rank(const Eigen::MatrixXd& gram, const std::vector<int>& priority, double tolerance) {
  const Eigen::Index n = gram.rows();
  const Eigen::VectorXd scale = unit_scale<Eigen::Dynamic>(gram);
  Eigen::MatrixXd rest =
      scale.asDiagonal() * gram * scale.asDiagonal();  // Schur complement after the columns kept so far
  std::vector<bool> done(static_cast<std::size_t>(n), false);
  std::vector<int> classes(priority);
  std::sort(classes.begin(), classes.end());
  classes.erase(std::unique(classes.begin(), classes.end()), classes.end());
  // In passes, the clearly visible first: a column kept while it is hardly visible would spoil the digits of those
  // after it. Within a pass the order of the columns decides, never their rounding: of two equal columns it is always
  // the first that stays.
  for (const int wanted : classes) {
    for (const double share : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, tolerance}) {
      const double bound = std::max(share, tolerance) * std::max(share, tolerance);
      for (int k = 0; k < n; ++k) {
        if (done[k] || priority[k] != wanted || !(rest(k, k) > bound)) continue;
        done[k] = true;
        const Eigen::VectorXd column = rest.col(k) / std::sqrt(rest(k, k));
        rest.noalias() -= column * column.transpose();
      }
    }
  }
  Rank rank;
  for (int k = 0; k < n; ++k) (done[k] ? rank.kept : rank.frozen).push_back(k);
  const auto kept = static_cast<Eigen::Index>(rank.kept.size());
  const auto frozen = static_cast<Eigen::Index>(rank.frozen.size());
  Eigen::MatrixXd inner(kept, kept), cross(kept, frozen);
  for (Eigen::Index j = 0; j < kept; ++j) {
    for (Eigen::Index i = 0; i < kept; ++i)
      inner(i, j) = scale[rank.kept[i]] * gram(rank.kept[i], rank.kept[j]) * scale[rank.kept[j]];
  }
  for (Eigen::Index j = 0; j < frozen; ++j) {
    for (Eigen::Index i = 0; i < kept; ++i)
      cross(i, j) = scale[rank.kept[i]] * gram(rank.kept[i], rank.frozen[j]) * scale[rank.frozen[j]];
  }
  rank.combination = kept > 0 && frozen > 0 ? solve_symmetric<Eigen::Dynamic, Eigen::Dynamic>(inner, cross)
                                            : Eigen::MatrixXd::Zero(kept, frozen);
  for (Eigen::Index j = 0; j < frozen; ++j) {
    for (Eigen::Index i = 0; i < kept; ++i) {
      // A unit column explained to one part in a million has its weights no better than that.
      double& weight = rank.combination(i, j);
      if (std::abs(weight) < 1e-4) weight = 0.0;
      weight *= scale[rank.kept[i]] / scale[rank.frozen[j]];
    }
  }
  return rank;
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& gram) {
  const Eigen::VectorXd scale = unit_scale<Eigen::Dynamic>(gram);
  const Eigen::MatrixXd inverse = inverse_symmetric<Eigen::Dynamic>(scaled_both<Eigen::Dynamic>(scale, gram));
  return scale.asDiagonal() * (0.5 * (inverse + inverse.transpose())) * scale.asDiagonal();
}

}  // namespace truing::math
