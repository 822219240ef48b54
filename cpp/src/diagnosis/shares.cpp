// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// How much each cause counts: its fraction of the gap, averaged over orders, and how far it moves the tip; and how much
// of the gap all that is named leaves.

#include <algorithm>
#include <cmath>

#include "diagnosis/diagnosis.hpp"
#include "math/linear_algebra.hpp"

namespace truing::diagnosis {

constexpr double kMostly =
    0.5;  ///< of the gap's mean square beyond noise: what must be closed to call it partly explained

/// By how much the held-out mean square falls as a group enters with the size that was found, averaged over all orders
/// in which groups may enter, as a fraction of the gap (Shapley 1953, "A value for n-person games", eq. (13)).
///
/// With y what base and tool leave, m_k the motion by group k beyond what base and tool can do, and r = y - sum m_j, a
/// group lowers the squares by 2 m_k (y - m_S) - m_k^2 when those of S are in already. Half of the orders have group j
/// before k, so that the mean of m_S is half the sum of the others, and the mean fall is m_k (y + r). Sizes are those
/// found with all groups in: one that is small in the end does not count for the work of others that it can mimic.
std::vector<double> order_averaged_shares(const Work& work, const Evidence& evidence, const Evidence::State& state) {
  const std::vector<ColumnGroup>& groups = work.design.candidates.groups;
  const auto count = static_cast<Eigen::Index>(state.choice.groups.size()),
             p = static_cast<Eigen::Index>(state.columns.size()),
             frames = static_cast<Eigen::Index>(work.design.nuisance.size());
  const Gram train = evidence.gram().of(state.columns), test = work.grams.test.of(state.columns);
  // Column k: what group k adds, and what base and tool, fitted to the training rows, take of it. The last: of y.
  Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(p, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const std::vector<int>& own =
        groups[static_cast<std::size_t>(state.choice.groups[static_cast<std::size_t>(k)])].columns;
    for (Eigen::Index c = frames; c < p; ++c) {
      if (std::find(own.begin(), own.end(), state.columns[static_cast<std::size_t>(c)]) != own.end())
        motion(c, k) = state.solution[c];
    }
  }
  Eigen::VectorXd registered = Eigen::VectorXd::Zero(p);
  if (frames > 0) {
    Eigen::MatrixXd normal = train.xx.topLeftCorner(frames, frames);
    normal.diagonal() *= 1.0 + 1e-10;
    const Eigen::MatrixXd taken = train.xx.topRows(frames) * motion;
    for (Eigen::Index k = 0; k < count; ++k)
      motion.col(k).head(frames) -= solve_symmetric<Eigen::Dynamic, 1>(normal, Eigen::VectorXd(taken.col(k)));
    registered.head(frames) = solve_symmetric<Eigen::Dynamic, 1>(normal, Eigen::VectorXd(train.xy.head(frames)));
  }
  const double gap = test.yy - 2.0 * registered.dot(test.xy) + registered.dot(test.xx * registered);
  if (!(gap > 0.0)) return std::vector<double>(static_cast<std::size_t>(count), 0.0);
  const Eigen::VectorXd both = 2.0 * test.xy - test.xx * (2.0 * registered + motion.rowwise().sum());  // X^T (y + r)
  const Eigen::VectorXd shares = motion.transpose() * both / gap;
  return {shares.data(), shares.data() + count};
}

/// [m] rms length of the motion of the tip that some of the state's columns make, beyond what base and tool can do as
/// well: these are fitted to it.
double size_at_tip(const Work& work, const Evidence::State& state, const std::vector<int>& columns) {
  const Design& design = work.design;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    if (kind_of(design.component[static_cast<std::size_t>(i)]) != 1) rows.push_back(i);
  }
  std::vector<std::size_t> own;
  for (std::size_t c = 0; c < state.columns.size(); ++c) {
    if (std::find(columns.begin(), columns.end(), state.columns[c]) != columns.end()) own.push_back(c);
  }
  if (rows.empty() || own.empty()) return 0.0;
  const auto frames = static_cast<Eigen::Index>(design.nuisance.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(frames, frames);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(frames), by_frames(frames);
  double squares = 0.0;
  for (const Eigen::Index i : rows) {
    double motion = 0.0;
    for (const std::size_t c : own)
      motion += design.x(i, state.columns[c]) * state.solution[static_cast<Eigen::Index>(c)];
    for (Eigen::Index k = 0; k < frames; ++k) by_frames[k] = design.x(i, design.nuisance[static_cast<std::size_t>(k)]);
    normal.noalias() += by_frames * by_frames.transpose();
    right += motion * by_frames;
    squares += motion * motion;
  }
  normal.diagonal() *= 1.0 + 1e-10;
  if (frames > 0) squares -= right.dot(solve_symmetric<Eigen::Dynamic, 1>(normal, right));
  const double values = work.given.data.distance ? 1.0 : 3.0;
  return std::sqrt(std::max(0.0, squares) * values / static_cast<double>(rows.size()));
}

Explained explained_by(const Diagnosis& d, bool too_few_poses) {
  if (d.verdict == Verdict::does_not_hold) return Explained::does_not_hold;
  if (d.verdict == Verdict::none) return too_few_poses ? Explained::not_explained : Explained::no_gap;
  if (d.effects.empty()) return Explained::not_explained;
  // Mean squares add up: what is left beyond the noise, against the noise.
  const double left = std::pow(d.after.rms, 2.0), noise = std::pow(d.noise_floor, 2.0);
  if (left - noise <= noise) return Explained::explained;
  return d.closable >= kMostly ? Explained::partly_explained : Explained::not_explained;
}

}  // namespace truing::diagnosis
