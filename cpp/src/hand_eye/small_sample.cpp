// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/small_sample.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "math/linear_algebra.hpp"

namespace truing::hand_eye {
namespace {

/// Sums over the poses, of the n variances that were found; U_k = v_k V_k, so that variances are counted by their
/// logarithms.
struct VarianceSums {
  Matrix12d N = Matrix12d::Zero();        // J^T W J, W = V^-1
  std::vector<Matrix12d> S;               // J^T W U_k W J
  std::vector<std::vector<Matrix12d>> Q;  // J^T W U_k W U_l W J
  Eigen::MatrixXd trace;                  // tr W U_k W U_l
};

VarianceSums sum_variances(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit,
                           const LoopNoise& weights, const std::vector<std::size_t>& found) {
  const std::size_t n = found.size();
  VarianceSums s;
  s.S.assign(n, Matrix12d::Zero());
  s.Q.assign(n, std::vector<Matrix12d>(n, Matrix12d::Zero()));
  s.trace = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  for (const std::size_t i : rows) {
    const LoopRow row = loop_row(problem, i, fit.X, fit.Y, weights);
    const NoiseShapes shapes = noise_shapes(problem, i, fit.X, fit.Y);
    const Matrix6d W = solve_definite<6, 6>(row.V, Matrix6d::Identity());
    const Eigen::Matrix<double, 6, 12> WJ = W * row.J;
    s.N.noalias() += row.J.transpose() * WJ;
    std::vector<Matrix6d> U(n);
    for (std::size_t k = 0; k < n; ++k) {
      U[k] = weights.variance[found[k]] * shapes[found[k]];
      s.S[k].noalias() += WJ.transpose() * U[k] * WJ;
    }
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t l = 0; l < n; ++l) {
        s.Q[k][l].noalias() += WJ.transpose() * U[k] * W * U[l] * WJ;
        s.trace(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l)) +=
            (W * U[k]).cwiseProduct((W * U[l]).transpose()).sum();
      }
  }
  if (problem.known)
    s.N.topLeftCorner<3, 3>() +=
        problem.known->axis * problem.known->axis.transpose() / (problem.known->sigma * problem.known->sigma);
  return s;
}

}  // namespace

SmallSample small_sample(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit,
                         const LoopNoise& weights) {
  SmallSample out{fit.covariance, Eigen::Matrix<double, 12, 1>::Constant(std::numeric_limits<double>::infinity())};
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < 3; ++k)
    if (weights.estimate[k]) found.push_back(k);
  if (found.empty()) return out;

  const VarianceSums s = sum_variances(problem, rows, fit, weights, found);
  const Eigen::Matrix<double, 12, 1> unit = unit_scale<12>(s.N);
  const Matrix12d C = scaled_both<12>(unit, inverse_symmetric<Eigen::Dynamic>(scaled_both<12>(unit, s.N)));
  // Covariance of the logarithms: the inverse of tr(P U_k P U_l) / 2, P = W - W J C J^T W, and the prior (section 2).
  const std::size_t n = found.size();
  const auto at = [](std::size_t k) { return static_cast<Eigen::Index>(k); };
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(at(n), at(n)) / (kPriorSpread * kPriorSpread);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t l = 0; l < n; ++l)
      information(at(k), at(l)) += 0.5 * (s.trace(at(k), at(l)) - 2.0 * C.cwiseProduct(s.Q[k][l].transpose()).sum() +
                                          (C * s.S[k]).cwiseProduct((C * s.S[l]).transpose()).sum());
  const Eigen::MatrixXd spread = inverse_symmetric<Eigen::Dynamic>(information);
  // Their adjusted covariance, C + 2 C (sum of spread_kl (Q_kl - S_k C S_l)) C: once for weights that are off, once for
  // the C of a noise that was found being too small on the average.
  Matrix12d off = Matrix12d::Zero();
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t l = 0; l < n; ++l) off += spread(at(k), at(l)) * (s.Q[k][l] - s.S[k] * C * s.S[l]);
  const Matrix12d more = C * (off + off.transpose()) * C;
  out.covariance += 0.5 * (more + more.transpose());
  // Degrees of freedom after Satterthwaite: 2 c^2 / var c, c a diagonal element of C.
  Eigen::MatrixXd slope(at(n), 12);  // of c by the logarithms
  for (std::size_t k = 0; k < n; ++k) slope.row(at(k)) = Matrix12d(C * s.S[k] * C).diagonal().transpose();
  for (Eigen::Index j = 0; j < 12; ++j)
    out.degrees_of_freedom(j) = std::max(1.0, 2.0 * C(j, j) * C(j, j) / slope.col(j).dot(spread * slope.col(j)));
  return out;
}

}  // namespace truing::hand_eye
