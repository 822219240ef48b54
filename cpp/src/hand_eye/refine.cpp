// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/refine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/frame.hpp"
#include "math/gauss_newton.hpp"
#include "math/linear_algebra.hpp"

namespace truing::hand_eye {
namespace {

constexpr double kStep = 1e-9;            // the estimate stands when a step is this small beside its standard errors …
constexpr double kVarianceStep = 1e-2;    // … and variances change by no more than this fraction
constexpr double kLargestChange = 2.0;    // of a variance's logarithm in one step
constexpr double kLeastVariance = 1e-18;  // [m^2, rad^2, px^2] a nanometre, a nanoradian: data without noise stop there
constexpr double kSingular = 1e-13;       // smallest eigenvalue of the unit-diagonal information

using Vector12d = Eigen::Matrix<double, 12, 1>;

NoiseShapes shapes_at(const LoopProblem& problem, std::size_t i, const Eigen::Vector3d& w) {
  NoiseShapes out{Matrix6d::Zero(), Matrix6d::Identity(), Matrix6d::Zero(), Matrix6d::Zero()};
  out[0].topLeftCorner<3, 3>().setIdentity();
  const Eigen::Matrix3d wx = cross_matrix(w);
  out[1].topLeftCorner<3, 3>() = -wx * wx;
  out[1].topRightCorner<3, 3>() = -wx;
  out[1].bottomLeftCorner<3, 3>() = wx;
  out[2].bottomRightCorner<3, 3>().setIdentity();
  if (!problem.pixel_shape.empty()) out[3] = problem.pixel_shape[i];
  return out;
}

/// Closure and derivatives. With R = R_X^T: moving X by d moves the board by -R d, turning it by d about its own origin
/// by R (v x d) and -R d, v from X's origin to the board in the parent; moving Y by d moves the board by R R_M d,
/// turning it turns the board by R R_M d.
void linearise(const LoopProblem& problem, std::size_t i, const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y,
               Vector6d* e, Eigen::Matrix<double, 6, 12>* J, Eigen::Vector3d* w) {
  const Eigen::Isometry3d board = problem.M[i] * Y;  // in the camera's parent
  const Eigen::Matrix3d R = X.linear().transpose();
  Eigen::Isometry3d predicted;
  predicted.linear() = R * board.linear();
  predicted.translation() = R * (board.translation() - X.translation());
  *e = closure(predicted, problem.B[i]);
  const Eigen::Matrix3d turned = R * problem.M[i].linear();
  J->setZero();
  J->block<3, 3>(0, 0) = -R;
  J->block<3, 3>(0, 3) = R * cross_matrix(board.translation() - X.translation());
  J->block<3, 3>(3, 3) = -R;
  J->block<3, 3>(0, 6) = turned;
  J->block<3, 3>(3, 9) = turned;
  const Eigen::Isometry3d& A = problem.A[i];
  *w = problem.setup == HandEyeSetup::eye_to_hand ? Eigen::Vector3d(R * (A.linear() * Y.translation()))
                                                  : Eigen::Vector3d(turned * (Y.translation() - A.translation()));
}

Matrix6d weighted_sum(const NoiseShapes& shape, const LoopNoise& noise) {
  return noise.variance[0] * shape[0] + noise.variance[1] * shape[1] + noise.variance[2] * shape[2] +
         noise.variance[3] * shape[3];
}

/// Sums over poses for a step of X, Y and of the variances.
struct LoopSums {
  Matrix12d N = Matrix12d::Zero();  // J^T W J, W = V^-1
  Vector12d g = Vector12d::Zero();  // J^T W e
  double chi2 = 0.0;
  // For variances: W V_k W between closures, between columns; traces.
  std::array<double, 3> trace{};                                                             // tr W V_k
  std::array<double, 3> square{};                                                            // e^T W V_k W e
  std::array<Matrix12d, 3> spread{Matrix12d::Zero(), Matrix12d::Zero(), Matrix12d::Zero()};  // J^T W V_k W J
  Eigen::Matrix3d information =
      Eigen::Matrix3d::Zero();  // tr W V_k W V_l; k, l < 3: the pixels' noise is known from within images
};

LoopSums sum_loop(const LoopProblem& problem, const Rows& rows, const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y,
                  const LoopNoise& noise, bool variances) {
  LoopSums s;
  Vector6d e;
  Eigen::Matrix<double, 6, 12> J;
  Eigen::Vector3d w;
  for (const std::size_t i : rows) {
    linearise(problem, i, X, Y, &e, &J, &w);
    const NoiseShapes shape = shapes_at(problem, i, w);
    const Matrix6d W = solve_definite<6, 6>(weighted_sum(shape, noise), Matrix6d::Identity());
    const Eigen::Matrix<double, 6, 12> WJ = W * J;
    const Vector6d We = W * e;
    s.N.noalias() += J.transpose() * WJ;
    s.g.noalias() += J.transpose() * We;
    s.chi2 += e.dot(We);
    if (!variances) continue;
    std::array<Matrix6d, 3> WV;
    for (std::size_t k = 0; k < 3; ++k) {
      WV[k].noalias() = W * shape[k];
      s.trace[k] += WV[k].trace();
      s.square[k] += We.dot(shape[k] * We);
      s.spread[k].noalias() += WJ.transpose() * shape[k] * WJ;
    }
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l <= k; ++l)
        s.information(k, l) +=
            WV[static_cast<std::size_t>(k)].cwiseProduct(WV[static_cast<std::size_t>(l)].transpose()).sum();
  }
  s.information = s.information.selfadjointView<Eigen::Lower>();
  if (problem.known) {
    const double weight = 1.0 / (problem.known->sigma * problem.known->sigma);
    const Eigen::Vector3d& a = problem.known->axis;
    s.N.topLeftCorner<3, 3>() += weight * a * a.transpose();
    s.g.head<3>() += weight * (a.dot(X.translation()) - problem.known->height) * a;
  }
  return s;
}

/// Of a positive definite matrix, by unit diagonal.
template <int N>
double log_determinant(const Eigen::Matrix<double, N, N>& M) {
  const Eigen::Matrix<double, N, 1> unit = unit_scale<N>(M);
  return symmetric_eigen<Eigen::Dynamic>(scaled_both<N>(unit, M)).values.array().max(1e-300).log().sum() -
         2.0 * unit.array().log().sum();
}

/// Inverse of the information, by unit diagonal; false where it has none.
bool invert(const Matrix12d& N, Matrix12d* C) {
  const Vector12d unit = unit_scale<12>(N);
  const auto eigen = symmetric_eigen<Eigen::Dynamic>(scaled_both<12>(unit, N));
  if (!(eigen.values(0) > kSingular * eigen.values(11))) return false;
  *C = scaled_both<12>(
      unit, carried<Eigen::Dynamic, Eigen::Dynamic>(eigen.vectors, eigen.values.cwiseInverse().asDiagonal()));
  return true;
}

/// How far the variances are stepped: steps that turn back are halved, as scoring overshoots where a variance is next
/// to nothing.
struct Stride {
  double factor = 1.0;
  Eigen::VectorXd last;
};

/// One scoring step of the logarithms of the variances; the largest change. Score of the restricted likelihood: (e^T P
/// V_k P e - tr P V_k) / 2 with P = W - W J C J^T W, and P e = W e once the fit stands (Searle, Casella, McCulloch
/// 1992, section 6.6).
double step_variances(const LoopSums& s, const Matrix12d& C, std::size_t rows, Stride* stride, LoopNoise* noise) {
  std::vector<int> free;
  for (int k = 0; k < 3; ++k)
    if (noise->estimate[static_cast<std::size_t>(k)]) free.push_back(k);
  if (free.empty()) return 0.0;
  const double shrink = 1.0 - 2.0 / static_cast<double>(rows);  // 12 of 6 n degrees of freedom
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd F(n, n);
  Eigen::VectorXd score(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const auto k = static_cast<std::size_t>(free[static_cast<std::size_t>(a)]);
    const double v = noise->variance[k];
    score(a) = 0.5 * v * (s.square[k] - s.trace[k] + C.cwiseProduct(s.spread[k]).sum());
    for (Eigen::Index b = 0; b < n; ++b) {
      const int l = free[static_cast<std::size_t>(b)];
      F(a, b) = 0.5 * shrink * v * noise->variance[static_cast<std::size_t>(l)] * s.information(static_cast<int>(k), l);
    }
  }
  F.diagonal().array() += 1.0 / (kPriorSpread * kPriorSpread);
  // The prior pulls back to an even split of what there is: fractions of the trace.
  double total = 0.0;
  for (const int k : free) total += noise->variance[static_cast<std::size_t>(k)] * s.trace[static_cast<std::size_t>(k)];
  for (Eigen::Index a = 0; a < n; ++a) {
    const auto k = static_cast<std::size_t>(free[static_cast<std::size_t>(a)]);
    const double even = total / static_cast<double>(n) / std::max(s.trace[k], 1e-300);
    score(a) -= std::log(noise->variance[k] / even) / (kPriorSpread * kPriorSpread);
  }
  const Eigen::VectorXd full = solve_symmetric<Eigen::Dynamic, 1>(F, score);
  if (stride->last.size() == n)
    stride->factor = stride->last.dot(full) < -0.25 * stride->last.squaredNorm() ? 0.5 * stride->factor
                                                                                 : std::min(1.0, 1.5 * stride->factor);
  stride->last = full;
  const Eigen::VectorXd change = stride->factor * full;
  double largest = 0.0;
  for (Eigen::Index a = 0; a < n; ++a) {
    const double d = std::clamp(change(a), -kLargestChange, kLargestChange);
    double& variance = noise->variance[static_cast<std::size_t>(free[static_cast<std::size_t>(a)])];
    const double before = variance;
    variance = std::max(kLeastVariance, variance * std::exp(d));
    if (variance != before) largest = std::max(largest, std::abs(full(a)));
  }
  return largest;
}

/// X, Y and the variances where the iteration stands.
struct LoopIteration {
  const LoopProblem& problem;
  const Rows& rows;
  LoopEstimate* out;
  LoopSums sums;
  Stride stride;
  double variance_change = 0.0;  ///< largest, of a logarithm

  bool estimates() const {
    const std::array<bool, kVariances>& asked = out->noise.estimate;
    return asked[0] || asked[1] || asked[2];
  }
  NormalSystem<12> system() {
    sums = sum_loop(problem, rows, out->X, out->Y, out->noise, estimates());
    return {sums.N, sums.g, sums.chi2};
  }
  void move(const Vector12d& step) {
    out->X = moved(out->X, step.head<6>());
    out->Y = moved(out->Y, step.tail<6>());
  }
  bool settled(const NormalSystem<12>& at, const Vector12d& step) {
    const double length = std::sqrt(std::max(0.0, step.dot(at.gram * step)) / 12.0);  // in standard errors
    out->chi2 = at.cost + at.gradient.dot(step);
    // Variances from closures that the step has already moved: far from the fit they would only see its errors.
    if (estimates() && length < 1.0)
      variance_change = step_variances(sums, out->covariance, rows.size(), &stride, &out->noise);
    return length < kStep * (estimates() ? 1e4 : 1.0) && (!estimates() || variance_change < kVarianceStep);
  }
};

}  // namespace

LoopEstimate refine_loop(const LoopProblem& problem, const Rows& rows, const Eigen::Isometry3d& X,
                         const Eigen::Isometry3d& Y, LoopNoise noise, int max_iterations) {
  LoopEstimate out;
  out.X = X, out.Y = Y, out.noise = noise;
  LoopIteration iteration{problem, rows, &out, {}, {}};
  const auto solve = [&out](const NormalSystem<12>& system) -> Vector12d {
    if (!system.gram.allFinite() || !invert(system.gram, &out.covariance)) return Vector12d::Constant(kNaN);
    return -out.covariance * system.gradient;
  };
  const Iterations ended = gauss_newton(&iteration, max_iterations, solve);
  out.iterations = ended.steps;
  out.converged = ended.reason == StopReason::settled;
  out.singular = ended.reason == StopReason::singular;
  return out;
}

// Patterson and Thompson, Biometrika 58 (1971) 545: chi^2, the determinants of the rows' covariances, and that of the
// information on the frames.
double restricted_likelihood(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit) {
  const LoopSums sums = sum_loop(problem, rows, fit.X, fit.Y, fit.noise, false);
  double twice = sums.chi2 + log_determinant(sums.N);
  for (const std::size_t i : rows) twice += log_determinant(loop_row(problem, i, fit.X, fit.Y, fit.noise).V);
  return -0.5 * twice;
}

NoiseShapes noise_shapes(const LoopProblem& problem, std::size_t i, const Eigen::Isometry3d& X,
                         const Eigen::Isometry3d& Y) {
  Vector6d e;
  Eigen::Matrix<double, 6, 12> J;
  Eigen::Vector3d w;
  linearise(problem, i, X, Y, &e, &J, &w);
  return shapes_at(problem, i, w);
}

LoopRow loop_row(const LoopProblem& problem, std::size_t i, const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y,
                 const LoopNoise& noise) {
  LoopRow row;
  Eigen::Vector3d w;
  linearise(problem, i, X, Y, &row.e, &row.J, &w);
  row.V = weighted_sum(shapes_at(problem, i, w), noise);
  return row;
}

OneMore one_more_unknown(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit,
                         const std::function<Vector6d(std::size_t)>& derivative) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(13, 13);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(13);
  for (const std::size_t i : rows) {
    const LoopRow row = loop_row(problem, i, fit.X, fit.Y, fit.noise);
    Eigen::Matrix<double, 6, 13> J;
    J << row.J, derivative(i);
    const Eigen::Matrix<double, 6, 13> WJ = solve_definite<6, 13>(row.V, J);
    N += J.transpose() * WJ, g += WJ.transpose() * row.e;
  }
  const Eigen::VectorXd unit = unit_scale<Eigen::Dynamic>(N);
  const auto eigen = symmetric_eigen<Eigen::Dynamic>(scaled_both<Eigen::Dynamic>(unit, N));
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  if (!(eigen.values(0) > kSingular * eigen.values(12))) return {nan, nan};
  // The last row of the inverse.
  const Eigen::VectorXd share = eigen.vectors.row(12).transpose().cwiseQuotient(eigen.values);
  const Eigen::VectorXd last = unit(12) * unit.cwiseProduct(eigen.vectors * share);
  return {-last.dot(g), std::sqrt(last(12))};
}

Vector6d left_out(const LoopRow& row, const Matrix12d& covariance) {
  const Matrix6d hat = carried<6, 12>(row.J, covariance) * solve_definite<6, 6>(row.V, Matrix6d::Identity());
  return solve_square<6>(Matrix6d::Identity() - hat, row.e);
}

double standardised(const LoopRow& row, const Matrix12d& covariance, bool fitted) {
  const Matrix6d seen = carried<6, 12>(row.J, covariance);
  const Matrix6d V = fitted ? Matrix6d(row.V - seen) : Matrix6d(row.V + seen);
  return std::sqrt(std::max(0.0, row.e.dot(solve_symmetric<6, 1>(V, row.e))) / 6.0);
}

}  // namespace truing::hand_eye
