// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/singularity.hpp"

#include <algorithm>

#include <Eigen/Cholesky>

namespace truing::inverse_kinematics {
namespace {

using Eigen::Vector3d;

/// Unit vector that a positive matrix shortens most, by inverse iteration.
template <typename Matrix>
auto weakest_direction(Matrix gram) {
  gram.diagonal().array() += 1e-12 * gram.diagonal().maxCoeff() + 1e-300;
  const Eigen::LDLT<Matrix> factored(gram);
  Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1, 0, Matrix::MaxRowsAtCompileTime, 1> v(gram.rows());
  for (Eigen::Index k = 0; k < v.size(); ++k) v[k] = 1.0 + 0.1 * static_cast<double>(k);
  for (int k = 0; k < 3; ++k) v = factored.solve(v).normalized();
  return v;
}

/// Jacobian of the joints from `fixed` on: lengths over `scales.length`, per joint's radian's worth.
TipJacobian scaled_jacobian(const PreparedRobot& robot, const double* readings, int fixed, EffectScratch* scratch) {
  Columns columns;
  robot.arm.tip(readings, scratch, &columns);
  const int n = robot.driven() - fixed;
  TipJacobian J(6, n);
  for (int j = 0; j < n; ++j) {
    J.col(j) << columns.linear[fixed + j] / robot.scales.length, columns.angular[fixed + j];
    J.col(j) *= robot.scales.joint[fixed + j];
  }
  return J;
}

/// As readings, its largest part one radian's worth.
template <typename Vector>
void to_readings(const Vector& v, const Scales& scales, int fixed, double* still) {
  std::fill(still, still + fixed, 0.0);
  for (Eigen::Index j = 0; j < v.size(); ++j)
    still[fixed + j] = v[j] / v.cwiseAbs().maxCoeff() * scales.joint[fixed + j];
}

}  // namespace

Vector6d still_direction(const PreparedRobot& robot, const double* readings, int fixed, EffectScratch* scratch,
                         double* still) {
  const TipJacobian J = scaled_jacobian(robot, readings, fixed, scratch);
  to_readings(weakest_direction(JointMatrix(J.transpose().lazyProduct(J))), robot.scales, fixed, still);
  return weakest_direction(Matrix6d(J.lazyProduct(J.transpose())));
}

Vector3d singular_direction(const PreparedRobot& robot, const double* readings, EffectScratch* scratch) {
  Columns columns;
  robot.arm.tip(readings, scratch, &columns);
  Matrix6d gram = Matrix6d::Zero();
  for (int j = 0; j < robot.driven(); ++j) {
    Vector6d c;
    c << columns.linear[j] / robot.scales.length, columns.angular[j];
    c *= robot.scales.joint[j];
    gram += c * c.transpose();
  }
  const Vector3d linear = weakest_direction(gram).template head<3>();
  return linear.norm() > 0.5 ? Vector3d(linear.normalized()) : Vector3d::Zero();
}

}  // namespace truing::inverse_kinematics
