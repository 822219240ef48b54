// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/left_out.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/frame.hpp"
#include "math/linear_algebra.hpp"

namespace truing::hand_eye {
namespace {

constexpr double kOpen =
    1e-11;  // smallest eigenvalue of the unit-diagonal information: below, a direction is not known

/// A^-1 b of an information matrix, whose columns have units of their own. NaN where it leaves a direction open.
Eigen::MatrixXd solve_information(const Eigen::MatrixXd& A, const Eigen::MatrixXd& b) {
  const Eigen::VectorXd unit = unit_scale<Eigen::Dynamic>(A);
  const SymmetricEigen<Eigen::Dynamic> eigen = symmetric_eigen<Eigen::Dynamic>(scaled_both<Eigen::Dynamic>(unit, A));
  if (!(eigen.values(0) > kOpen * eigen.values(eigen.values.size() - 1)))
    return Eigen::MatrixXd::Constant(b.rows(), b.cols(), std::numeric_limits<double>::quiet_NaN());
  const Eigen::MatrixXd along = eigen.vectors.transpose() * (unit.asDiagonal() * b);
  return unit.asDiagonal() * (eigen.vectors * (eigen.values.cwiseInverse().asDiagonal() * along));
}

}  // namespace

LeftOut::LeftOut(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit, const LoopNoise& weights,
                 const std::optional<LensData>& lens)
    : problem_(problem), rows_(rows), fit_(fit), weights_(weights), lens_(lens) {
  const Eigen::Index unknowns = 12 + (lens_ ? kLens : 0);
  information_ = Eigen::MatrixXd::Zero(unknowns, unknowns);
  for (const std::size_t i : rows_) information_ += share(i).gram;
  if (!problem_.known) return;
  const Eigen::Vector3d axis = problem_.known->axis / problem_.known->sigma;
  information_.topLeftCorner<3, 3>() += axis * axis.transpose();
}

bool LeftOut::fitted(std::size_t i) const { return std::binary_search(rows_.begin(), rows_.end(), i); }

PoseShare LeftOut::share(std::size_t i) const {
  const LoopRow row = loop_row(problem_, i, fit_.X, fit_.Y, weights_);
  PoseShare out{row.e, row.J, {}, {}};
  LensShare lens;
  if (lens_) {  // another lens moves the board as seen
    lens = lens_share(lens_->camera, lens_->images[i], problem_.B[i]);
    out.J.conservativeResize(6, 12 + kLens);
    out.J.rightCols<kLens>() = -lens.board;
  }
  const Eigen::MatrixXd WJ = solve_definite<6, 6>(row.V, Matrix6d::Identity()) * out.J;
  out.gram = out.J.transpose() * WJ, out.gradient = WJ.transpose() * row.e;
  if (!lens_) return out;
  const double weight = 1.0 / weights_.variance[3];
  out.gram.bottomRightCorner<kLens, kLens>() += weight * lens.gram;
  out.gradient.tail<kLens>() += weight * lens.gradient;
  return out;
}

/// Of the unknowns, when the pose is left out: Cook and Weisberg 1982, equation 2.2.1.
Eigen::VectorXd LeftOut::change_without(std::size_t i, const PoseShare& pose) const {
  if (!fitted(i)) return Eigen::VectorXd::Zero(information_.rows());
  return solve_information(information_ - pose.gram, pose.gradient);
}

Vector6d LeftOut::closure(std::size_t i) const {
  const PoseShare pose = share(i);
  return pose.e + pose.J * change_without(i, pose);
}

double LeftOut::pixels(std::size_t i, const Camera& camera, const BoardImage& image) const {
  const Eigen::VectorXd change = change_without(i, share(i));
  if (!change.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::Isometry3d X = moved(fit_.X, change.head<6>()), Y = moved(fit_.Y, change.segment<6>(6));
  const Camera seen_by = lens_ ? with_lens_moved(camera, change.tail<kLens>()) : camera;
  return pixel_rms(seen_by, image, predicted_board(X, problem_.M[i], Y));
}

double LeftOut::standardised(std::size_t i) const {
  const PoseShare pose = share(i);
  const Matrix6d seen = pose.J * solve_information(information_, pose.J.transpose());
  const Matrix6d scatter = loop_row(problem_, i, fit_.X, fit_.Y, fit_.noise).V;
  const Matrix6d V = fitted(i) ? Matrix6d(scatter - seen) : Matrix6d(scatter + seen);
  return std::sqrt(std::max(0.0, pose.e.dot(solve_symmetric<6, 1>(V, pose.e))) / 6.0);
}

}  // namespace truing::hand_eye
