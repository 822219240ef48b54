// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/explain.hpp"

#include <algorithm>
#include <cmath>

#include "inverse_kinematics/singularity.hpp"
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

struct Excess {
  int joint = -1;  ///< as Limits::excess counts them; -1: no way within reach even without limits
  double size = kInfinity;
};

/// Would it do without limits? Of the ways that would, the one that exceeds them least.
Excess least_excess(const Query& query, const double* best, Trace* trace) {
  const PreparedRobot& robot = query.robot;
  DescentOptions free;
  free.max_iterations = robot.options.max_iterations;
  free.ignore_limits = true;
  Excess least;
  double from[kMaxDrivenJoints];
  std::copy(best, best + robot.driven(), from);
  constexpr int kTries = 16;
  for (int k = 0; k < kTries; ++k) {
    Descent descent = descend_from(query, from, free, trace);
    restart_seed(robot, k, best, from);
    if (!descent.converged) continue;
    bring_near(robot, best, descent.readings);
    int at = -1;
    const double excess = robot.limits.excess(robot.driven(), descent.readings, &at);
    if (at >= 0 && excess < least.size) least = {at, excess};
  }
  return least;
}

/// The nearest alternative: the orientation first, then as near as can be; unless the orientation itself is the
/// trouble.
void find_alternative(const Query& query, const double* best, Trace* trace, Solution* solution) {
  const PreparedRobot& robot = query.robot;
  DescentOptions stiff;
  stiff.max_iterations = 4 * robot.options.max_iterations;
  stiff.rotation_weight = 100.0;
  Descent nearest = descend_from(query, best, stiff, trace);
  double from[kMaxDrivenJoints];
  constexpr int kOthers = 6;
  for (int k = 0; k < kOthers; ++k) {
    restart_seed(robot, k, best, from);
    const Descent other = descend_from(query, from, stiff, trace);
    if (other.cost < (1.0 - 1e-6) * nearest.cost) nearest = other;
  }
  check(query, nearest.readings, trace, solution);
  if (solution->rotation_error > 1e-4 && solution->rotation_error * robot.scales.length > solution->position_error)
    check(query, best, trace, solution);
}

}  // namespace

void explain(const Query& query, Trace* trace, Solution* solution) {
  const PreparedRobot& robot = query.robot;
  const Goal& goal = query.goal;
  if (trace->colliding.joints.size() > 0) {  // there, but for what it touches
    const int iterations = solution->iterations;
    *solution = trace->colliding;
    solution->iterations = iterations;
    solution->miss = -solution->contact_distance;
    return;
  }
  if (!std::isfinite(trace->nearest.cost)) {
    DescentOptions how;
    how.max_iterations = robot.options.max_iterations;
    trace->nearest = descend_from(query, query.seed, how, trace);
  }
  const double* best = trace->nearest.readings;
  const Excess excess = least_excess(query, best, trace);
  find_alternative(query, best, trace, solution);
  if (solution->reached()) return;  // what looked for the next best thing found the best

  const Tip tip = robot.arm.tip(solution->joints.data(), query.scratch);
  const bool turned_away = solution->position_error <= robot.options.position_tolerance;
  solution->miss = turned_away ? solution->rotation_error : solution->position_error;
  solution->direction = turned_away ? rotation_way(goal, tip) : Vector3d((goal.position - tip.position).normalized());
  solution->branch = -1;
  if (excess.joint >= 0) {
    solution->reason = Reason::limit;
    solution->joint = excess.joint;
    solution->excess = excess.size;
    return;
  }
  solution->reason = Reason::out_of_reach;
  constexpr double kAlmost = 1e-3;  // of the arm's length: so near that only a singularity stands in between
  if (solution->position_error + robot.scales.length * solution->rotation_error < kAlmost * robot.scales.length) {
    solution->reason = Reason::singular;
    const Vector3d stiffest = singular_direction(robot, solution->joints.data(), query.scratch);
    if (stiffest.norm() > 0.5) solution->direction = stiffest;
  }
}

}  // namespace truing::inverse_kinematics
