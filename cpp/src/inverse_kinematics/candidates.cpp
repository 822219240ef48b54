// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/candidates.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "inverse_kinematics/singularity.hpp"
#include "math/constants.hpp"

namespace truing::inverse_kinematics {
namespace {

/// Above det J in Cramer's rule for Newton's step of one joint: det [J, the error in place of that joint's column].
/// Zero where the other joints alone take the error away.
double newton_numerator(const PreparedRobot& robot, const Goal& pose, const double* readings, int joint,
                        EffectScratch* scratch) {
  const int rails = robot.closed.rails();
  Columns columns;
  const Tip tip = robot.arm.tip(readings, scratch, &columns);
  columns.linear[joint] = pose.position - tip.position;
  columns.angular[joint] = rotation_between(tip.rotation, pose.rotation);
  Matrix6d J;
  for (int j = 0; j < 6; ++j) J.col(j) << columns.linear[rails + j] / robot.scales.length, columns.angular[rails + j];
  return J.determinant();
}

/// The seeds on the circles of singular wrists and shoulders, each with Newton's numerator.
struct Circles {
  int at[ClosedForm::kCircles][ClosedForm::kMostPlaces];  ///< seed on a circle at a place; -1: it is missing
  double value[ClosedForm::kMost];                        ///< of each seed
};

/// False: none of the seeds lies on a circle.
bool find_circles(const PreparedRobot& robot, const Goal& pose, const double* from, const Configuration* all, int count,
                  EffectScratch* scratch, Circles* circles) {
  bool any = false;
  for (int k = 0; k < count; ++k) {
    if (all[k].circle < 0) continue;
    if (!any) std::fill(&circles->at[0][0], &circles->at[0][0] + ClosedForm::kCircles * ClosedForm::kMostPlaces, -1);
    any = true;
    circles->at[all[k].circle][all[k].place] = k;
    double readings[kMaxDrivenJoints], excess = 0.0;
    robot.closed.readings_near(all[k], from, robot.limits.lower, robot.limits.upper, readings, &excess);
    circles->value[k] = newton_numerator(robot, pose, readings, robot.closed.rails() + all[k].about, scratch);
  }
  return any;
}

/// Round a circle of seeds Newton's step of the joint that goes round passes through zero near every configuration that
/// the robot has there: seeds are moved to these zeros, and those beside a place that is missing stay.
void choose_on_circles(const PreparedRobot& robot, const Goal& pose, const double* from, Configuration* all, int count,
                       EffectScratch* scratch, bool* worth) {
  Circles circles;
  if (!find_circles(robot, pose, from, all, count, scratch, &circles)) return;
  const double* value = circles.value;
  Configuration moved[ClosedForm::kMost];
  for (int k = 0; k < count; ++k) {
    if (all[k].circle < 0) continue;
    const int* circle = circles.at[all[k].circle];
    const int places = all[k].places;
    const int before = circle[(all[k].place + places - 1) % places], next = circle[(all[k].place + 1) % places];
    moved[k] = all[k];
    if (before < 0 || next < 0) {
      worth[k] = true;
    } else if ((value[k] < 0.0) != (value[next] < 0.0)) {
      worth[k] = true;
      const double fraction = value[k] / (value[k] - value[next]);
      for (int i = 0; i < 6; ++i)
        moved[k].angle[i] += fraction * std::remainder(all[next].angle[i] - all[k].angle[i], 2.0 * kPi);
    } else {
      // It may touch zero between places: where its size is least, and small.
      const bool least = std::abs(value[k]) < std::abs(value[before]) && std::abs(value[k]) <= std::abs(value[next]);
      const bool alone = (value[k] < 0.0) == (value[before] < 0.0);
      worth[k] = least && alone;
    }
  }
  for (int k = 0; k < count; ++k) {
    if (all[k].circle >= 0) all[k] = moved[k];
  }
}

/// Error of the task along one direction, over a line of configurations beside a singular one.
struct LineBeside {
  double at[kMaxDrivenJoints];     ///< the singular one
  double still[kMaxDrivenJoints];  ///< joint motion that moves the tip least
  Vector6d unreached;              ///< direction of the tip's motion that joints make least of

  void readings(int driven, double way, double* out) const {
    for (int j = 0; j < driven; ++j) out[j] = at[j] + way * still[j];
  }
  double error(const Query& query, double way) const {
    double q[kMaxDrivenJoints];
    readings(query.robot.driven(), way, q);
    const Tip tip = query.robot.arm.tip(q, query.scratch);
    return unreached.head<3>().dot(query.goal.position - tip.position) / query.robot.scales.length +
           unreached.tail<3>().dot(rotation_between(tip.rotation, query.goal.rotation));
  }
};

/// A descent that ended at a singularity, e != 0 there, may have its answer beside it. Lyapunov-Schmidt: with J v = 0
/// and u J = 0 all but u e can be taken away by the other motions, and u e(q + s v) = c + b s + a s^2 has its zeros
/// where the answers are; or there are none.
void leave_singularity(const Query& query, const double* seed, const DescentOptions& how, Trace* trace,
                       Descent* descent) {
  constexpr double kNear = 1e-3;                   // of the cost
  constexpr double kProbe = 0.1, kFurthest = 1.5;  // [rad]
  if (descent->cost > kNear) return;
  const PreparedRobot& robot = query.robot;
  const int n = robot.driven();
  LineBeside line;
  std::copy(descent->readings, descent->readings + n, line.at);
  line.unreached = still_direction(robot, descent->readings, how.fixed_joints, query.scratch, line.still);
  const double c = line.error(query, 0.0), plus = line.error(query, kProbe), minus = line.error(query, -kProbe);
  const double a = 0.5 * (plus + minus - 2.0 * c) / (kProbe * kProbe), b = 0.5 * (plus - minus) / kProbe;
  const double discriminant = b * b - 4.0 * a * c;
  if (!(discriminant > 0.0)) return;
  // The zero on the side that the seed came from first: the other one is its twin's.
  double side = 0.0;
  for (int j = 0; j < n; ++j)
    side += (seed[j] - line.at[j]) * line.still[j] / (robot.scales.joint[j] * robot.scales.joint[j]);
  const double half = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  const double zero[2] = {half / a, c / half};
  const int first = side * zero[0] > side * zero[1] ? 0 : 1;
  for (const int k : {first, 1 - first}) {
    if (!(std::abs(zero[k]) < kFurthest)) continue;
    double from[kMaxDrivenJoints];
    line.readings(n, zero[k], from);
    const Descent other = descend_from(query, from, how, trace);
    if (!other.converged) continue;
    *descent = other;
    return;
  }
}

/// Descents of the arm alone: rails stay, and limits are looked at afterwards.
DescentOptions of_the_arm_alone(const PreparedRobot& robot) {
  DescentOptions how;
  how.max_iterations = robot.options.max_iterations;
  how.fixed_joints = robot.closed.rails();
  how.ignore_limits = true;
  return how;
}

/// A descent without limits ended here: the turns nearest to the seed, and within limits.
bool finish(const Query& query, Descent descent, Trace* trace, Solution* solution) {
  const PreparedRobot& robot = query.robot;
  const ClosedForm& closed = robot.closed;
  double from[kMaxDrivenJoints], readings[kMaxDrivenJoints], excess = 0.0;
  Configuration here;
  for (int k = 0; k < 6; ++k) here.angle[k] = closed.angle(k, descent.readings);
  std::copy(query.seed, query.seed + robot.driven(), from);
  std::copy(descent.readings, descent.readings + closed.rails(), from);
  closed.readings_near(here, from, robot.limits.lower, robot.limits.upper, readings, &excess);
  if (excess > kLimitRounding) return false;
  if (robot.arm.has_effects()) {  // they need not come again after a whole turn
    descent = descend_from(query, readings, of_the_arm_alone(robot), trace);
    std::copy(descent.readings, descent.readings + robot.driven(), readings);
  }
  return check(query, readings, trace, solution);
}

}  // namespace

int candidates(const Query& query, const Goal& pose, const double* rails, double slack, Candidate* found) {
  const PreparedRobot& robot = query.robot;
  const ClosedForm& closed = robot.closed;
  Configuration all[ClosedForm::kMost];
  double from[kMaxDrivenJoints];
  std::copy(query.seed, query.seed + robot.driven(), from);
  std::copy(rails, rails + closed.rails(), from);
  const double hold = closed.angle(closed.kind() == ClosedFormKind::spherical_wrist ? 3 : 5, from);
  const int count = closed.solve({pose.rotation, pose.position}, from, hold, all);
  bool worth[ClosedForm::kMost];
  for (int k = 0; k < count; ++k) worth[k] = closed.exact() || all[k].circle < 0;
  if (!closed.exact()) choose_on_circles(robot, pose, from, all, count, query.scratch, worth);
  int kept = 0;
  for (int k = 0; k < count; ++k) {
    if (!worth[k]) continue;
    Candidate c;
    closed.readings_near(all[k], from, robot.limits.lower, robot.limits.upper, c.readings, &c.excess);
    if (c.excess > slack) continue;
    c.branch = all[k].branch;
    c.distance = distance2(robot, c.readings, query.seed);
    int at = kept++;
    for (; at > 0 && found[at - 1].distance > c.distance; --at) found[at] = found[at - 1];
    found[at] = c;
  }
  return kept;
}

bool polish(const Query& query, const Candidate& candidate, Trace* trace, Solution* solution) {
  solution->branch = candidate.branch;
  constexpr double kGood = 1e-10;  // of what closed forms give away from singularities
  const bool good = query.robot.closed.exact() && check(query, candidate.readings, trace, solution);
  if (good && solution->position_error <= kGood && solution->rotation_error <= kGood) return true;
  DescentOptions how = of_the_arm_alone(query.robot);
  how.patience = 4;  // what ends at a singularity has mostly nothing beside it
  Descent descent = descend_from(query, candidate.readings, how, trace);
  how.patience = 6;
  if (!descent.converged) leave_singularity(query, candidate.readings, how, trace, &descent);
  if (!descent.converged) return good && check(query, candidate.readings, trace, solution);
  return finish(query, descent, trace, solution);
}

}  // namespace truing::inverse_kinematics
