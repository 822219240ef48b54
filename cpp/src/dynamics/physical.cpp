// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/physical.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Cholesky>

#include "math/linear_algebra.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Numbers = Eigen::Matrix<double, 10, 1>;  ///< of a symmetric matrix of four rows

/// Their basis: orthonormal by the trace of the product.
const std::vector<Matrix4d>& basis() {
  static const std::vector<Matrix4d> all = [] {
    std::vector<Matrix4d> out;
    for (int i = 0; i < 4; ++i) {
      for (int j = i; j < 4; ++j) {
        Matrix4d E = Matrix4d::Zero();
        E(i, j) = E(j, i) = i == j ? 1.0 : std::sqrt(0.5);
        out.push_back(E);
      }
    }
    return out;
  }();
  return all;
}

Matrix4d matrix_of(const Numbers& x) {
  Matrix4d out = Matrix4d::Zero();
  for (std::size_t k = 0; k < 10; ++k) out += x[static_cast<Index>(k)] * basis()[k];
  return out;
}

Numbers numbers_of(const Matrix4d& M) {
  Numbers out;
  for (std::size_t k = 0; k < 10; ++k) out[static_cast<Index>(k)] = basis()[k].cwiseProduct(M).sum();
  return out;
}

VectorXd eigenvalues_of(const Matrix4d& M) { return symmetric_eigen<Eigen::Dynamic>(M).values; }

Numbers part(const VectorXd& x, std::size_t link) { return x.segment<10>(10 * static_cast<Index>(link)); }

/// The nearest body: mass, then the second moments about the centre of mass, each raised to the least.
LinkParameters lifted(const LinkParameters& p, const PhysicalOptions& options) {
  const double m = std::max(p[0], options.least_mass);
  const Vector3d c = p[0] > 0.0 ? Vector3d(p.segment<3>(1) / p[0]) : Vector3d(Vector3d::Zero());
  const Matrix4d P = pseudo_inertia(p);
  const Matrix3d about_center = P.topLeftCorner<3, 3>() - std::max(p[0], 0.0) * c * c.transpose();
  const SymmetricEigen<3> second = symmetric_eigen<3>(about_center);
  const Vector3d raised = second.values.cwiseMax(m * options.least_radius * options.least_radius);
  if (m == p[0] && raised == second.values) return p;
  Matrix4d out;
  out.topLeftCorner<3, 3>() = second.vectors * raised.asDiagonal() * second.vectors.transpose() + m * c * c.transpose();
  out.topRightCorner<3, 1>() = m * c;
  out.bottomLeftCorner<1, 3>() = m * c.transpose();
  out(3, 3) = m;
  return parameters_of(out);
}

void require(bool holds, const std::string& message) {
  if (!holds) throw std::invalid_argument("physical_inertias: " + message);
}

void check(const Robot& nominal, const MatrixXd& information, const VectorXd& gradient, const PhysicalOptions& options,
           const VectorXd& near) {
  validate(nominal);
  const auto n = static_cast<Index>(10 * nominal.joints.size());
  const std::string expected =
      std::to_string(n) + ", ten for each of " + std::to_string(nominal.joints.size()) + " links";
  require(information.rows() == n && information.cols() == n,
          "the information has shape (" + std::to_string(information.rows()) + ", " +
              std::to_string(information.cols()) + "), expected " + expected);
  require(gradient.size() == n,
          "the gradient has " + std::to_string(gradient.size()) + " values, expected " + expected);
  require(near.size() == 0 || near.size() == n,
          "near has " + std::to_string(near.size()) + " values, expected none or " + expected);
  require(near.allFinite(), "near has a value that is not finite");
  require(information.allFinite(), "the information has a value that is not finite");
  require(gradient.allFinite(), "the gradient has a value that is not finite");
  const double size = information.cwiseAbs().maxCoeff();
  require((information - information.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * size,
          "the information is not symmetric");
  require((information.diagonal().array() >= 0.0).all(), "the information has a negative value on its diagonal");
  for (const double option : {options.spread, options.least_mass, options.least_radius})
    require(option > 0.0 && std::isfinite(option), "an option is " + number(option) + ", expected more than zero");
  require(options.max_steps > 0, "max_steps is " + std::to_string(options.max_steps) + ", expected at least 1");
}

/// Newton's method, every step as far as it leads down, until what a step promises is below `tolerance`.
Iterations newton(const PhysicalObjective& objective, double weight, double tolerance, int max_steps, VectorXd* x) {
  Iterations out;
  while (out.steps < max_steps) {
    const PhysicalObjective::Local local = objective.local(*x, weight);
    const VectorXd y = least_squares(local.rows, -local.residuals);
    if (!y.allFinite()) return {out.steps, StopReason::singular};
    ++out.steps;
    if ((local.rows * y).squaredNorm() <= 2.0 * tolerance) return {out.steps, StopReason::small_promise};
    const VectorXd step = local.to_x(y);
    double length = objective.along(*x, step, weight).lowest();
    // Next to the border rounding may lead across it.
    while (length > 1e-10 && !objective.is_body(*x + length * step)) length *= 0.5;
    if (!(length > 1e-10)) return {out.steps, StopReason::no_descent};
    *x += length * step;
  }
  return out;
}

}  // namespace

Matrix4d pseudo_inertia(const LinkParameters& p) {
  Matrix3d I;
  I << p[4], p[7], p[8], p[7], p[5], p[9], p[8], p[9], p[6];
  Matrix4d out;
  out.topLeftCorner<3, 3>() = 0.5 * I.trace() * Matrix3d::Identity() - I;
  out.topRightCorner<3, 1>() = p.segment<3>(1);
  out.bottomLeftCorner<1, 3>() = p.segment<3>(1).transpose();
  out(3, 3) = p[0];
  return out;
}

LinkParameters parameters_of(const Matrix4d& P) {
  const Matrix3d Sigma = P.topLeftCorner<3, 3>();
  const Matrix3d I = Sigma.trace() * Matrix3d::Identity() - Sigma;
  LinkParameters out;
  out << P(3, 3), P.topRightCorner<3, 1>(), I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2);
  return out;
}

PhysicalObjective::PhysicalObjective(const VectorXd& nominal, const MatrixXd& information, const VectorXd& gradient)
    : nominal_(nominal) {
  const Index n = nominal.size();
  MatrixXd J = MatrixXd::Zero(n, n);
  for (Index at = 0; at < n; at += 10) {
    const Matrix4d L = pseudo_inertia(nominal.segment<10>(at)).llt().matrixL();
    Eigen::Matrix<double, 10, 10> block;
    for (std::size_t k = 0; k < 10; ++k)
      block.col(static_cast<Index>(k)) = parameters_of(L * basis()[k] * L.transpose());
    to_parameters_.push_back(block);
    J.block<10, 10>(at, at) = block;
  }
  constexpr double kUnseen = 1e-12;
  const auto seen =
      symmetric_eigen<Eigen::Dynamic>(carried<Eigen::Dynamic, Eigen::Dynamic>(J.transpose(), information));
  const double largest = std::max(0.0, seen.values.maxCoeff());
  if (seen.values.minCoeff() < -1e-9 * largest)
    throw std::invalid_argument("physical_inertias: the information has a negative eigenvalue, " +
                                number(seen.values.minCoeff()) + " beside " + number(largest) + " in relative units");
  // The root, so that the gradient of what is seen well does not round into directions that are hardly seen.
  const Index rank = (seen.values.array() > kUnseen * largest).count();  // values ascend
  const VectorXd root = seen.values.tail(rank).cwiseSqrt();
  root_ = root.asDiagonal() * seen.vectors.rightCols(rank).transpose();
  const VectorXd pull = seen.vectors.rightCols(rank).transpose() * (J.transpose() * (gradient - information * nominal));
  fit_ = seen.vectors.rightCols(rank) * pull.cwiseQuotient(root.cwiseAbs2());
}

VectorXd PhysicalObjective::Local::to_x(const VectorXd& y) const {
  VectorXd out(y.size());
  for (std::size_t link = 0; link < blocks.size(); ++link)
    out.segment<10>(10 * static_cast<Index>(link)) = blocks[link] * part(y, link);
  return out;
}

PhysicalObjective::Local PhysicalObjective::local(const VectorXd& x, double weight) const {
  Local out;
  const Index seen = root_.rows(), n = x.size();
  out.rows = MatrixXd::Zero(seen + n, n);
  out.residuals.resize(seen + n);
  out.residuals.head(seen) = root_ * (x - fit_);
  for (std::size_t link = 0; link < to_parameters_.size(); ++link) {
    const Index at = 10 * static_cast<Index>(link);
    const Matrix4d C = (Matrix4d::Identity() + matrix_of(part(x, link))).llt().matrixL();
    Eigen::Matrix<double, 10, 10> block;
    for (std::size_t k = 0; k < 10; ++k) block.col(static_cast<Index>(k)) = numbers_of(C * basis()[k] * C.transpose());
    out.rows.block(0, at, seen, 10) = root_.middleCols<10>(at) * block;
    // d tr(C Y C^T) = tr(C^T C Y), d log det(C (1 + Y) C^T) = tr Y, and its second derivative is -|Y|^2.
    out.residuals.segment<10>(seen + at) = std::sqrt(weight) * numbers_of(C.transpose() * C - Matrix4d::Identity());
    out.blocks.push_back(block);
  }
  out.rows.bottomRows(n).diagonal().setConstant(std::sqrt(weight));
  return out;
}

PhysicalObjective::Line PhysicalObjective::along(const VectorXd& x, const VectorXd& step, double weight) const {
  Line out;
  const VectorXd moved = root_ * step;
  out.slope = moved.dot(root_ * (x - fit_));
  out.curvature = moved.squaredNorm();
  out.weight = weight;
  out.relative.resize(4 * static_cast<Index>(to_parameters_.size()));
  for (std::size_t link = 0; link < to_parameters_.size(); ++link) {
    // det(1 + X + S) / det(1 + X) = det(1 + C^-1 S C^-T) with 1 + X = C C^T.
    const Eigen::LLT<Matrix4d> factor(Matrix4d::Identity() + matrix_of(part(x, link)));
    const Matrix4d S = matrix_of(part(step, link));
    const Matrix4d half = factor.matrixL().solve(S);
    const Matrix4d relative = factor.matrixL().solve(half.transpose());
    out.relative.segment<4>(4 * static_cast<Index>(link)) = eigenvalues_of(0.5 * (relative + relative.transpose()));
    out.slope += weight * S.trace();
  }
  return out;
}

double PhysicalObjective::Line::change(double t) const {
  double logs = 0.0;
  for (const double v : relative) logs += std::log1p(t * v);
  return slope * t + 0.5 * curvature * t * t - weight * logs;
}

double PhysicalObjective::Line::slope_at(double t) const {
  return slope + curvature * t - weight * (relative.array() / (1.0 + t * relative.array())).sum();
}

double PhysicalObjective::Line::lowest() const {
  const double least = relative.minCoeff();
  double low = 0.0, high = least < 0.0 ? -1.0 / least : std::numeric_limits<double>::infinity();
  for (double t = 1.0; t < high; t *= 2.0) {
    if (slope_at(t) >= 0.0 || t > 1e6) high = t;
  }
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (low + high);
    (slope_at(middle) < 0.0 ? low : high) = middle;
  }
  return low;
}

VectorXd PhysicalObjective::parameters(const VectorXd& x) const {
  VectorXd out = nominal_;
  for (std::size_t link = 0; link < to_parameters_.size(); ++link)
    out.segment<10>(10 * static_cast<Index>(link)) += to_parameters_[link] * part(x, link);
  return out;
}

VectorXd PhysicalObjective::x_of(const VectorXd& parameters) const {
  VectorXd out(parameters.size());
  for (std::size_t link = 0; link < to_parameters_.size(); ++link) {
    const Eigen::LLT<Matrix4d> nominal(pseudo_inertia(part(nominal_, link)));  // P = L (1 + X) L^T
    const Matrix4d half = nominal.matrixL().solve(pseudo_inertia(part(parameters, link)));
    const Matrix4d relative = nominal.matrixL().solve(half.transpose());
    out.segment<10>(10 * static_cast<Index>(link)) = numbers_of(relative - Matrix4d::Identity());
  }
  return out;
}

VectorXd PhysicalObjective::nearest_body() const {
  constexpr double kInside = 0.03;
  VectorXd out(fit_.size());
  for (std::size_t link = 0; link < to_parameters_.size(); ++link) {
    const auto relative = symmetric_eigen<Eigen::Dynamic>(MatrixXd(Matrix4d::Identity() + matrix_of(part(fit_, link))));
    const MatrixXd raised = carried<Eigen::Dynamic, Eigen::Dynamic>(
        relative.vectors, MatrixXd(relative.values.cwiseMax(kInside).asDiagonal()));
    out.segment<10>(10 * static_cast<Index>(link)) = numbers_of(raised - Matrix4d::Identity());
  }
  return out;
}

bool PhysicalObjective::is_body(const VectorXd& x) const {
  const VectorXd p = parameters(x);
  for (std::size_t link = 0; link < to_parameters_.size(); ++link) {
    const Eigen::LLT<Matrix4d> body(pseudo_inertia(part(p, link)));
    const Eigen::LLT<Matrix4d> relative(Matrix4d::Identity() + matrix_of(part(x, link)));
    if (body.info() != Eigen::Success || relative.info() != Eigen::Success) return false;
    if (!(eigenvalues_of(pseudo_inertia(part(p, link))).minCoeff() > 0.0)) return false;
    if (!(eigenvalues_of(Matrix4d::Identity() + matrix_of(part(x, link))).minCoeff() > 0.0)) return false;
  }
  return true;
}

double PhysicalObjective::pull(const VectorXd& x) const {
  const Local at = local(x, 0.0);
  return (at.rows.transpose() * at.residuals).norm();
}

double PhysicalObjective::increase(const VectorXd& x) const { return (root_ * (x - fit_)).squaredNorm(); }

PhysicalInertias physical_inertias(const Robot& nominal, const MatrixXd& information, const VectorXd& gradient,
                                   const PhysicalOptions& options, const VectorXd& near) {
  check(nominal, information, gradient, options, near);
  PhysicalInertias out;
  VectorXd start = link_parameters(nominal);
  for (std::size_t link = 0; link < nominal.joints.size(); ++link) {
    const LinkParameters from = part(start, link), to = lifted(from, options);
    if (to != from) out.lifted.push_back({nominal.joints[link].name, from, to});
    start.segment<10>(10 * static_cast<Index>(link)) = to;
  }
  const PhysicalObjective objective(start, information, gradient);
  VectorXd x = near.size() > 0 ? objective.x_of(near) : VectorXd();
  const bool is_near = near.size() > 0 && objective.is_body(x);
  if (!is_near) x = objective.nearest_body();
  if (!objective.is_body(x)) x.setZero();  // so far from any body that its digits do not hold one
  // From where the border is far down to the prior's own weight.
  constexpr double kNats = 1e-9, kPath = 0.1;
  const double last = 1.0 / (options.spread * options.spread);
  for (double weight = is_near ? last : std::max(last, objective.pull(x));;) {
    const bool final = weight <= last;
    const Iterations stage =
        newton(objective, weight, final ? kNats : kPath * weight, options.max_steps - out.steps, &x);
    out.steps += stage.steps;
    out.reason = stage.reason;
    if (final || !converged(stage.reason)) break;
    weight = std::max(last, 0.1 * weight);
  }
  out.parameters = objective.parameters(x);
  out.increase = objective.increase(x);
  out.robot = nominal;
  const auto links = static_cast<Index>(nominal.joints.size());
  out.smallest_eigenvalue.resize(links);
  out.distance.resize(links);
  for (std::size_t link = 0; link < nominal.joints.size(); ++link) {
    const LinkParameters p = part(out.parameters, link);
    set_link_parameters(p, &out.robot.joints[link]);
    out.smallest_eigenvalue[static_cast<Index>(link)] = eigenvalues_of(pseudo_inertia(p)).minCoeff();
    out.distance[static_cast<Index>(link)] =
        eigenvalues_of(Matrix4d::Identity() + matrix_of(part(x, link))).array().log().matrix().norm();
  }
  return out;
}

}  // namespace truing::dynamics
