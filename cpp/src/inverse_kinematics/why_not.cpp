// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Why a target is not reached, and what is the nearest to it.

#include <Eigen/Cholesky>

#include "inverse_kinematics/reach.hpp"
#include "math/constants.hpp"

namespace truing::inverse_kinematics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Axis of the rotation that is missing.
Vector3d rotation_way(const Goal& goal, const Tip& tip) {
  if (goal.kind == TaskKind::pose) return Eigen::AngleAxisd(Matrix3d(goal.rotation * tip.rotation.transpose())).axis();
  const Vector3d n = (tip.rotation * goal.axis).cross(goal.rotation * goal.axis);
  return n.norm() > 0.0 ? Vector3d(n.normalized()) : Vector3d::Zero();
}

/// Place of a driven joint in the chain.
std::size_t driven_joint(const Robot& robot, int reading) {
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    if (!robot.joints[k].passive() && reading-- == 0) return k;
  }
  return 0;
}

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

}  // namespace

namespace {

/// Jacobian of the joints from `fixed` on: lengths over `scales.length`, per joint's radian's worth.
TipJacobian scaled_jacobian(const Reach& reach, const double* readings, int fixed, EffectScratch* scratch) {
  Columns columns;
  reach.arm.tip(readings, scratch, &columns);
  const int n = reach.driven() - fixed;
  TipJacobian J(6, n);
  for (int j = 0; j < n; ++j) {
    J.col(j) << columns.linear[fixed + j] / reach.scales.length, columns.angular[fixed + j];
    J.col(j) *= reach.scales.joint[fixed + j];
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

/// Joint motion that moves the tip least; returned: the tip's motion that joints make least of.
Vector6d Reach::still_direction(const double* readings, int fixed, EffectScratch* scratch, double* still) const {
  const TipJacobian J = scaled_jacobian(*this, readings, fixed, scratch);
  to_readings(weakest_direction(Gram(J.transpose().lazyProduct(J))), scales, fixed, still);
  return weakest_direction(Eigen::Matrix<double, 6, 6>(J.lazyProduct(J.transpose())));
}

/// Direction that the tip can move in least, if it is one of translation; else zero.
Vector3d Reach::singular_direction(const double* readings, EffectScratch* scratch) const {
  Columns columns;
  arm.tip(readings, scratch, &columns);
  Eigen::Matrix<double, 6, 6> gram = Eigen::Matrix<double, 6, 6>::Zero();
  for (int j = 0; j < driven(); ++j) {
    Eigen::Matrix<double, 6, 1> c;
    c << columns.linear[j] / scales.length, columns.angular[j];
    c *= scales.joint[j];
    gram += c * c.transpose();
  }
  const Vector3d linear = weakest_direction(gram).template head<3>();
  return linear.norm() > 0.5 ? Vector3d(linear.normalized()) : Vector3d::Zero();
}

/// Readings of a joint after which everything is where it was: a whole turn of a joint that turns nothing else. 0:
/// none.
double Reach::turn_of(int joint) const {
  int moved = 0;
  for (Eigen::Index k = 0; k < arm.motion_weights().rows(); ++k) moved += arm.motion_weights()(k, joint) != 0.0;
  if (!arm.turns(joint) || moved != 1) return 0.0;
  return 2.0 * kPi / std::abs(arm.robot().joints[driven_joint(arm.robot(), joint)].ratio);
}

/// Takes whole turns off joints, so that they come as near to `seed` as they can.
void Reach::bring_near(const double* seed, double* readings) const {
  for (int j = 0; j < driven(); ++j) {
    const double turn = turn_of(j);
    if (turn > 0.0) readings[j] += turn * std::floor((seed[j] - readings[j]) / turn + 0.5);
  }
}

void Reach::explain(Search* search, Solution* solution) const {
  const Goal& goal = search->goal;
  if (search->interfering.joints.size() > 0) {  // there, but for what it touches
    const int iterations = solution->iterations;
    *solution = search->interfering;
    solution->iterations = iterations;
    solution->miss = -solution->contact_distance;
    return;
  }
  if (!std::isfinite(search->nearest.cost)) {
    DescentOptions how;
    how.max_iterations = options.max_iterations;
    search->nearest = descent_from(search, search->seed, how);
  }
  const double* best = search->nearest.readings;

  // Would it do without limits? Of the ways that would, the one that exceeds them least.
  DescentOptions free;
  free.max_iterations = options.max_iterations;
  free.ignore_limits = true;
  double least = std::numeric_limits<double>::infinity();
  int joint = -1;
  double from[kMaxDrivenJoints];
  std::copy(best, best + driven(), from);
  constexpr int kTries = 16;
  for (int k = 0; k < kTries; ++k) {
    Descent descent = descent_from(search, from, free);
    restart_seed(k, best, from);
    if (!descent.converged) continue;
    bring_near(best, descent.readings);
    int at = -1;
    const double excess = limits.excess(driven(), descent.readings, &at);
    if (at < 0 || excess >= least) continue;
    least = excess;
    joint = at;
  }

  // The nearest alternative: the orientation first, then as near as can be; unless the orientation itself is the
  // trouble.
  DescentOptions stiff;
  stiff.max_iterations = 4 * options.max_iterations;
  stiff.rotation_weight = 100.0;
  Descent nearest = descent_from(search, best, stiff);
  constexpr int kOthers = 6;
  for (int k = 0; k < kOthers; ++k) {
    restart_seed(k, best, from);
    const Descent other = descent_from(search, from, stiff);
    if (other.cost < (1.0 - 1e-6) * nearest.cost) nearest = other;
  }
  check(search, nearest.readings, solution);
  if (solution->rotation_error > 1e-4 && solution->rotation_error * scales.length > solution->position_error)
    check(search, best, solution);
  const Tip tip = arm.tip(solution->joints.data(), search->scratch);
  const bool turned_away = solution->position_error <= options.position_tolerance;
  solution->miss = turned_away ? solution->rotation_error : solution->position_error;
  solution->direction = turned_away ? rotation_way(goal, tip) : Vector3d((goal.position - tip.position).normalized());
  solution->branch = -1;
  if (joint >= 0) {
    solution->reason = Reason::limit;
    solution->joint = joint;
    solution->excess = least;
    return;
  }
  solution->reason = Reason::out_of_reach;
  constexpr double kAlmost = 1e-3;  // of the arm's length: so near that only a singularity stands in between
  if (solution->position_error + scales.length * solution->rotation_error < kAlmost * scales.length) {
    solution->reason = Reason::singular;
    const Vector3d stiffest = singular_direction(solution->joints.data(), search->scratch);
    if (stiffest.norm() > 0.5) solution->direction = stiffest;
  }
}

}  // namespace truing::inverse_kinematics
