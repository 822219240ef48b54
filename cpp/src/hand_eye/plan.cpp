// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// The next poses: one after the other, each the best of many.

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "hand_eye/closed_form.hpp"
#include "hand_eye/errors.hpp"
#include "hand_eye/images.hpp"
#include "hand_eye/readings.hpp"
#include "hand_eye/refine.hpp"
#include "math/frame.hpp"
#include "math/linear_algebra.hpp"
#include "math/random.hpp"
#include "rooms.hpp"
#include "truing/handeye.hpp"

namespace truing {
using namespace hand_eye;

namespace {

constexpr double kOrbit = 1.0;      // [rad] how far a new view turns away from a measured one
constexpr double kDistance = 0.25;  // fraction by which its distance changes

/// Views of the board that the camera had.
struct Seen {
  double tilt = 0.0, aside = 0.0, nearest = 1e300,
         farthest = 0.0;                           // [rad] of the board's normal, off the mean view; [m]
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();  // unit vector
};

double tilt_of(const Eigen::Isometry3d& B) {
  return std::acos(std::min(1.0, std::abs(B.linear().col(2).dot(B.translation().normalized()))));
}

Seen views(const Frames& B) {
  Seen seen;
  for (const Eigen::Isometry3d& b : B) seen.mean += b.translation().normalized();
  seen.mean.normalize();
  for (const Eigen::Isometry3d& b : B) {
    seen.tilt = std::max(seen.tilt, tilt_of(b));
    seen.aside = std::max(seen.aside, std::acos(std::min(1.0, seen.mean.dot(b.translation().normalized()))));
    seen.nearest = std::min(seen.nearest, b.translation().norm()),
    seen.farthest = std::max(seen.farthest, b.translation().norm());
  }
  return seen;
}

bool in_view(const HandEyePoses& poses, const Seen& seen, const Eigen::Isometry3d& B, double tilt) {
  const double distance = B.translation().norm();
  if (tilt_of(B) > std::max(tilt, seen.tilt) || distance < (1.0 - kDistance) * seen.nearest ||
      distance > (1.0 + kDistance) * seen.farthest)
    return false;
  if (!poses.camera || poses.images.empty()) return seen.mean.dot(B.translation().normalized()) >= std::cos(seen.aside);
  const Camera& camera = *poses.camera;
  const Eigen::Matrix3Xd& points = poses.images.front().points;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = B * points.col(i);
    if (!(p.z() > 0.0)) return false;
    const Eigen::Vector2d pixel = project(camera, p);
    if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() > camera.width || pixel.y() > camera.height) return false;
  }
  return true;
}

Eigen::Vector3d any_vector(Random* random, double length) {
  return Eigen::Vector3d(random->normal(), random->normal(), random->normal()).normalized() *
         random->uniform(0.0, length);
}

/// Covariance once a pose of these derivatives and this noise is measured too (Woodbury).
Matrix12d with_pose(const Matrix12d& C, const LoopRow& row) {
  const Eigen::Matrix<double, 6, 12> JC = row.J * C;
  return C - JC.transpose() * solve_symmetric<6, 12>(row.V + JC * row.J.transpose(), JC);
}

}  // namespace

std::vector<NextHandPose> handeye_plan(const HandEyePoses& given, const HandEyeResult& result,
                                       const HandEyeOptions& options, const HandEyePlanOptions& plan) {
  if (result.status != HandEyeStatus::done)
    throw std::invalid_argument("a plan starts from a camera that was found: " + result.message);
  if (plan.count < 1 || plan.candidates < 1)
    throw std::invalid_argument("a plan needs one pose and one candidate or more");
  HandEyePoses poses = given;
  apply_reading(options.reading, &poses.T_base_hand, &poses.T_camera_board);
  const Eigen::Isometry3d &X = result.camera.T, &Y = result.board.T;
  const Seen seen = views(poses.T_camera_board);

  LoopProblem problem;
  problem.setup = options.setup;
  LoopNoise noise;
  noise.variance = {std::pow(result.noise.position, 2), std::pow(result.noise.hand_rotation, 2),
                    std::pow(result.noise.camera_rotation, 2),
                    poses.images.empty() ? 0.0 : std::pow(result.noise.pixel, 2)};
  const auto row_of = [&](const Eigen::Isometry3d& A, const Eigen::Isometry3d& B) {
    problem.A = {A}, problem.M = moving_frames(problem.A, options.setup), problem.B = {B};
    if (!poses.images.empty()) problem.pixel_shape = {board_covariance(*poses.camera, poses.images.front().points, B)};
    return loop_row(problem, 0, X, Y, noise);
  };

  // The twelve unknowns of the fit, from the poses that it used.
  Matrix12d N = Matrix12d::Zero();
  for (std::size_t i = 0; i < poses.T_base_hand.size(); ++i) {
    if (result.residuals[i].rejected || (!poses.set.empty() && poses.set[i] != 0)) continue;
    const LoopRow row = row_of(poses.T_base_hand[i], poses.T_camera_board[i]);
    N += row.J.transpose() * solve_definite<6, 12>(row.V, row.J);
  }
  const Eigen::Matrix<double, 12, 1> unit = unit_scale<12>(N);
  Matrix12d C = scaled_both<12>(unit, inverse_symmetric<Eigen::Dynamic>(scaled_both<12>(unit, N)));
  const auto variance = [&](const Matrix12d& covariance) {
    return at_working_point({X, covariance.topLeftCorner<6, 6>()}, result.working_point).trace();
  };

  Random random(plan.seed);
  std::vector<NextHandPose> out;
  for (int k = 0; k < plan.count; ++k) {
    NextHandPose best;
    Matrix12d best_C = C;
    double least = std::numeric_limits<double>::infinity();
    for (int tried = 0, found = 0; tried < 20 * plan.candidates && found < plan.candidates; ++tried) {
      const Eigen::Isometry3d& from = poses.T_camera_board[random.below(poses.T_camera_board.size())];
      NextHandPose next;
      next.T_camera_board.linear() = rotation_from_vector(any_vector(&random, kOrbit)) * from.linear();
      next.T_camera_board.translation() = from.translation() + any_vector(&random, plan.reach);
      const Eigen::Isometry3d M = X * next.T_camera_board * Y.inverse(Eigen::Isometry);
      next.T_base_hand = options.setup == HandEyeSetup::eye_to_hand ? M : M.inverse(Eigen::Isometry);
      const bool reached =
          std::any_of(poses.T_base_hand.begin(), poses.T_base_hand.end(), [&](const Eigen::Isometry3d& A) {
            return (A.translation() - next.T_base_hand.translation()).norm() <= plan.reach;
          });
      if (!reached || !in_view(poses, seen, next.T_camera_board, plan.tilt)) continue;
      ++found;
      const Matrix12d covariance = with_pose(C, row_of(next.T_base_hand, next.T_camera_board));
      const double v = variance(covariance);
      if (v < least) least = v, best = next, best_C = covariance;
    }
    if (!std::isfinite(least)) break;
    C = best_C;
    best.working_point_sigma = std::sqrt(least / 3.0);
    out.push_back(best);
  }
  return out;
}

}  // namespace truing
