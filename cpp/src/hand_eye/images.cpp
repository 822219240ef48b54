// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/images.hpp"

#include <cmath>
#include <limits>
#include <memory>

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "math/frame.hpp"
#include "math/linear_algebra.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {
namespace {

using Intrinsics = std::array<double, kLens>;  // fx fy cx cy k1 k2 p1 p2 k3

Intrinsics intrinsics_of(const Camera& c) {
  return {c.fx, c.fy, c.cx, c.cy, c.distortion[0], c.distortion[1], c.distortion[2], c.distortion[3], c.distortion[4]};
}

Camera with_intrinsics(Camera c, const Intrinsics& k) {
  c.fx = k[0], c.fy = k[1], c.cx = k[2], c.cy = k[3];
  for (std::size_t i = 0; i < 5; ++i) c.distortion[i] = k[4 + i];
  return c;
}

/// Brown 1966, as OpenCV counts its coefficients.
template <class T, class K>
void project_point(const K* k, const T* p, T* pixel) {
  const T x = p[0] / p[2], y = p[1] / p[2], r2 = x * x + y * y;
  const T radial = T(1.0) + r2 * (k[4] + r2 * (k[5] + r2 * k[8]));
  pixel[0] = k[0] * (x * radial + 2.0 * k[6] * x * y + k[7] * (r2 + 2.0 * x * x)) + k[2];
  pixel[1] = k[1] * (y * radial + k[6] * (r2 + 2.0 * y * y) + 2.0 * k[7] * x * y) + k[3];
}

/// Pixel and its derivative by the point in the camera frame.
Eigen::Vector2d project_with_jacobian(const Intrinsics& k, const Eigen::Vector3d& point,
                                      Eigen::Matrix<double, 2, 3>* J) {
  using Jet = ceres::Jet<double, 3>;
  const std::array<Jet, 3> p{Jet(point.x(), 0), Jet(point.y(), 1), Jet(point.z(), 2)};
  std::array<Jet, 2> pixel;
  project_point(k.data(), p.data(), pixel.data());
  for (int r = 0; r < 2; ++r) J->row(r) = pixel[static_cast<std::size_t>(r)].v.transpose();
  return {pixel[0].a, pixel[1].a};
}

/// Pixel and its derivative by the lens.
Eigen::Vector2d project_with_lens_jacobian(const Intrinsics& k, const Eigen::Vector3d& point,
                                           Eigen::Matrix<double, 2, kLens>* J) {
  using Jet = ceres::Jet<double, kLens>;
  std::array<Jet, kLens> lens;
  for (std::size_t i = 0; i < lens.size(); ++i) lens[i] = Jet(k[i], static_cast<int>(i));
  const std::array<Jet, 3> p{Jet(point.x()), Jet(point.y()), Jet(point.z())};
  std::array<Jet, 2> pixel;
  project_point(lens.data(), p.data(), pixel.data());
  for (int r = 0; r < 2; ++r) J->row(r) = pixel[static_cast<std::size_t>(r)].v.transpose();
  return {pixel[0].a, pixel[1].a};
}

/// A frame and a small move of it, as `moved`: p -> exp(d_r) R p + t + d_t.
template <class T>
void transform(const Eigen::Isometry3d& frame, const T* d, const T* p, T* out) {
  Eigen::Map<const Eigen::Matrix<T, 3, 1>> point(p);
  const Eigen::Matrix<T, 3, 1> turned = frame.linear().cast<T>() * point;
  ceres::AngleAxisRotatePoint(d + 3, turned.data(), out);
  for (int i = 0; i < 3; ++i) out[i] += frame.translation()(i) + d[i];
}

/// The inverse of `transform`.
template <class T>
void transform_back(const Eigen::Isometry3d& frame, const T* d, const T* p, T* out) {
  const T back[3] = {-d[3], -d[4], -d[5]};
  const T arm[3] = {p[0] - frame.translation()(0) - d[0], p[1] - frame.translation()(1) - d[1],
                    p[2] - frame.translation()(2) - d[2]};
  Eigen::Matrix<T, 3, 1> turned;
  ceres::AngleAxisRotatePoint(back, arm, turned.data());
  Eigen::Map<Eigen::Matrix<T, 3, 1>> result(out);
  result = frame.linear().transpose().cast<T>() * turned;
}

/// X^-1 M Y p in pixels, with moves of X, of Y and of the hand as unknowns.
struct PixelCost {
  HandEyeSetup setup;
  const Eigen::Isometry3d *X, *Y, *A;
  Eigen::Vector3d point;
  Eigen::Vector2d seen;
  double weight;

  template <class T>
  bool operator()(const T* k, const T* dX, const T* dY, const T* dA, T* residual) const {
    const T p[3] = {T(point.x()), T(point.y()), T(point.z())};
    T on_parent[3], in_parent[3], in_camera[3], pixel[2];
    transform(*Y, dY, p, on_parent);
    if (setup == HandEyeSetup::eye_to_hand)
      transform(*A, dA, on_parent, in_parent);
    else
      transform_back(*A, dA, on_parent, in_parent);
    transform_back(*X, dX, in_parent, in_camera);
    if (!(in_camera[2] > T(0.0))) return false;
    project_point(k, in_camera, pixel);
    residual[0] = weight * (pixel[0] - seen.x());
    residual[1] = weight * (pixel[1] - seen.y());
    return true;
  }
};

/// The move of a robot pose, over its noise.
struct HandCost {
  double position_weight, rotation_weight;

  template <class T>
  bool operator()(const T* dA, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = position_weight * dA[i], residual[3 + i] = rotation_weight * dA[3 + i];
    return true;
  }
};

using Block = std::array<double, 6>;

struct ImageProblem {
  Eigen::Isometry3d X, Y;
  Intrinsics k;
  Block dX{}, dY{};
  std::vector<Block> dA;
  ceres::Problem problem;
};

/// (J^T J)^-1 of the blocks given, all moves of robot poses marginalised: an arrow matrix, so that a sparse factor does
/// it in linear time.
Eigen::MatrixXd marginal_covariance(ceres::Problem* problem, const std::vector<double*>& moves,
                                    const std::vector<double*>& asked) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = moves;
  options.parameter_blocks.insert(options.parameter_blocks.end(), asked.begin(), asked.end());
  ceres::CRSMatrix crs;
  problem->Evaluate(options, nullptr, nullptr, nullptr, &crs);
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> J(
      crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()), crs.rows.data(), crs.cols.data(),
      crs.values.data());
  const Eigen::SparseMatrix<double> columns(J);
  const Eigen::VectorXd unit = (columns.cwiseProduct(columns).transpose() * Eigen::VectorXd::Ones(crs.num_rows))
                                   .cwiseSqrt()
                                   .cwiseMax(1e-300)
                                   .cwiseInverse();
  const Eigen::SparseMatrix<double> scaled = columns * unit.asDiagonal();
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(scaled.transpose() * scaled);
  const Eigen::Index count = crs.num_cols - 6 * static_cast<Eigen::Index>(moves.size());
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(crs.num_cols, count);
  right.bottomRows(count).setIdentity();
  const Eigen::MatrixXd solved = factor.solve(right);
  const auto tail = unit.tail(count);
  return tail.asDiagonal() * solved.bottomRows(count) * tail.asDiagonal();
}

}  // namespace

namespace {

/// Normal equations of a small move of the board.
struct PixelSums {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
};

PixelSums sum_pixels(const Camera& camera, const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd* pixels,
                     const Eigen::Isometry3d& T_camera_board) {
  const Intrinsics k = intrinsics_of(camera);
  PixelSums sums;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d arm = T_camera_board.linear() * points.col(i);
    Eigen::Matrix<double, 2, 3> Jp;
    const Eigen::Vector2d pixel = project_with_jacobian(k, arm + T_camera_board.translation(), &Jp);
    Eigen::Matrix<double, 2, 6> J;
    J << Jp, -Jp * cross_matrix(arm);
    sums.H.noalias() += J.transpose() * J;
    if (pixels) sums.g.noalias() += J.transpose() * (pixel - pixels->col(i));
  }
  return sums;
}

Matrix6d inverse_of(const Matrix6d& H) {
  const Vector6d unit = unit_scale<6>(H);
  return scaled_both<6>(unit, inverse_symmetric<6>(scaled_both<6>(unit, H)));
}

}  // namespace

Matrix6d board_covariance(const Camera& camera, const Eigen::Matrix3Xd& points,
                          const Eigen::Isometry3d& T_camera_board) {
  return inverse_of(sum_pixels(camera, points, nullptr, T_camera_board).H);
}

Camera with_lens_moved(const Camera& camera, const Eigen::Matrix<double, kLens, 1>& change) {
  Intrinsics k = intrinsics_of(camera);
  for (std::size_t i = 0; i < k.size(); ++i) k[i] += change(static_cast<Eigen::Index>(i));
  return with_intrinsics(camera, k);
}

LensShare lens_share(const Camera& camera, const BoardImage& image, const Eigen::Isometry3d& T_camera_board) {
  const Intrinsics k = intrinsics_of(camera);
  const PixelSums sums = sum_pixels(camera, image.points, nullptr, T_camera_board);
  Eigen::Matrix<double, 6, kLens> cross = Eigen::Matrix<double, 6, kLens>::Zero();
  LensShare out;
  out.gram.setZero(), out.gradient.setZero();
  for (Eigen::Index i = 0; i < image.points.cols(); ++i) {
    const Eigen::Vector3d arm = T_camera_board.linear() * image.points.col(i);
    const Eigen::Vector3d point = arm + T_camera_board.translation();
    Eigen::Matrix<double, 2, 3> Jp;
    project_with_jacobian(k, point, &Jp);
    Eigen::Matrix<double, 2, 6> Jb;
    Jb << Jp, -Jp * cross_matrix(arm);
    Eigen::Matrix<double, 2, kLens> Jk;
    const Eigen::Vector2d pixel = project_with_lens_jacobian(k, point, &Jk);
    cross.noalias() += Jb.transpose() * Jk;
    out.gram.noalias() += Jk.transpose() * Jk;
    out.gradient.noalias() += Jk.transpose() * (pixel - image.pixels.col(i));  // the board's own is 0 where it fits
  }
  out.board.noalias() = -inverse_of(sums.H) * cross;
  out.gram.noalias() += cross.transpose() * out.board;  // Schur complement
  return out;
}

BoardFit fit_board(const Camera& camera, const BoardImage& image, const Eigen::Isometry3d& start) {
  BoardFit out;
  out.T_camera_board = start;
  const Eigen::Index n = image.points.cols();
  out.degrees_of_freedom = static_cast<int>(2 * n) - 6;
  const double count = static_cast<double>(2 * n);
  const auto sum_at = [&](const Eigen::Isometry3d& T) { return count * std::pow(pixel_rms(camera, image, T), 2); };
  out.sum = n < 4 ? std::numeric_limits<double>::infinity() : sum_at(start);
  if (!std::isfinite(out.sum)) return out;
  for (int iteration = 0; iteration < 50 && !out.converged; ++iteration) {
    const PixelSums sums = sum_pixels(camera, image.points, &image.pixels, out.T_camera_board);
    const Vector6d unit = unit_scale<6>(sums.H);
    const Matrix6d scaled = scaled_both<6>(unit, sums.H);
    out.shape = inverse_of(sums.H);
    const Vector6d down = -(unit.asDiagonal() * sums.g);
    for (double damping = 0.0; damping < 1e6; damping = std::max(1e-3, 10.0 * damping)) {  // shorter until it is better
      const Vector6d step = unit.cwiseProduct(solve_symmetric<6, 1>(scaled + damping * Matrix6d::Identity(), down));
      const Eigen::Isometry3d next = moved(out.T_camera_board, step);
      const double sum = sum_at(next);
      out.converged = std::abs(out.sum - sum) <= 1e-10 * out.sum + 1e-18;
      if (sum > out.sum && !out.converged) continue;
      out.T_camera_board = next, out.sum = sum;
      break;
    }
  }
  return out;
}

double pixel_rms(const Camera& camera, const BoardImage& image, const Eigen::Isometry3d& T_camera_board) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < image.points.cols(); ++i) {
    const Eigen::Vector3d p = T_camera_board * image.points.col(i);
    if (!(p.z() > 0.0)) return std::numeric_limits<double>::infinity();
    sum += (project(camera, p) - image.pixels.col(i)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(2 * image.points.cols()));
}

ImageEstimate refine_images(const LoopProblem& problem, const std::vector<BoardImage>& images, const Rows& rows,
                            const Camera& camera, const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y,
                            const ImageSigmas& sigmas, bool refine_camera, int max_iterations) {
  ImageProblem p;
  p.X = X, p.Y = Y, p.k = intrinsics_of(camera), p.dA.resize(rows.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const std::size_t i = rows[r];
    for (Eigen::Index c = 0; c < images[i].points.cols(); ++c)
      p.problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PixelCost, 2, 9, 6, 6, 6>(
                                     new PixelCost{problem.setup, &p.X, &p.Y, &problem.A[i], images[i].points.col(c),
                                                   images[i].pixels.col(c), 1.0 / sigmas.pixel}),
                                 nullptr, p.k.data(), p.dX.data(), p.dY.data(), p.dA[r].data());
    p.problem.AddResidualBlock(new ceres::AutoDiffCostFunction<HandCost, 6, 6>(
                                   new HandCost{1.0 / sigmas.hand_position, 1.0 / sigmas.hand_rotation}),
                               nullptr, p.dA[r].data());
  }
  if (!refine_camera) p.problem.SetParameterBlockConstant(p.k.data());

  ceres::Solver::Options options;
  options.max_num_iterations = max_iterations;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<double*> moves, asked{p.dX.data(), p.dY.data()};
  for (Block& d : p.dA) ordering->AddElementToGroup(d.data(), 0), moves.push_back(d.data());
  if (refine_camera) asked.push_back(p.k.data());
  for (double* block : {p.dX.data(), p.dY.data(), p.k.data()}) ordering->AddElementToGroup(block, 1);
  options.linear_solver_ordering = ordering;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &p.problem, &summary);

  ImageEstimate out;
  // Moves become part of the frames, so that covariance is that of moves about the frames found.
  p.X = out.X = moved(X, Eigen::Map<const Vector6d>(p.dX.data()));
  p.Y = out.Y = moved(Y, Eigen::Map<const Vector6d>(p.dY.data()));
  p.dX.fill(0.0), p.dY.fill(0.0);
  out.camera = with_intrinsics(camera, p.k);
  out.A = problem.A;
  for (std::size_t r = 0; r < rows.size(); ++r)
    out.A[rows[r]] = moved(problem.A[rows[r]], Eigen::Map<const Vector6d>(p.dA[r].data()));
  const Eigen::MatrixXd C = marginal_covariance(&p.problem, moves, asked);
  out.covariance = C.topLeftCorner<12, 12>();
  for (Eigen::Index i = 12; i < C.rows(); ++i) out.camera_sigma.push_back(std::sqrt(C(i, i)));
  out.solver.name = "ceres";
  out.solver.iterations = static_cast<int>(summary.iterations.size()) - 1;
  out.solver.converged = summary.termination_type == ceres::CONVERGENCE;
  out.solver.stopped_because = summary.message;
  return out;
}

}  // namespace truing::hand_eye

namespace truing {
using namespace hand_eye;

Eigen::Vector2d project(const Camera& camera, const Eigen::Vector3d& point) {
  Eigen::Vector2d pixel;
  project_point(intrinsics_of(camera).data(), point.data(), pixel.data());
  return pixel;
}

}  // namespace truing
