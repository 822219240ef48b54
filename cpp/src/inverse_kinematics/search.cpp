// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/search.hpp"

#include <algorithm>

namespace truing::inverse_kinematics {

bool check(const Query& query, const double* readings, Trace* trace, Solution* solution) {
  const PreparedRobot& robot = query.robot;
  const Limits& limits = robot.limits;
  const int n = robot.driven();
  solution->joints.resize(n);
  for (int j = 0; j < n; ++j) {
    double q = readings[j];
    if (q > limits.upper[j] && q <= limits.upper[j] + kLimitRounding) q = limits.upper[j];
    if (q < limits.lower[j] && q >= limits.lower[j] - kLimitRounding) q = limits.lower[j];
    solution->joints[j] = q;
  }
  const Miss miss = miss_of(query.goal, robot.arm.tip(solution->joints.data(), query.scratch));
  solution->position_error = miss.position;
  solution->rotation_error = miss.rotation;
  solution->roll = miss.roll;
  solution->reason = Reason::out_of_reach;
  int joint = -1;
  if (limits.excess(n, solution->joints.data(), &joint) > 0.0) return false;
  if (!(miss.position <= robot.options.position_tolerance && miss.rotation <= robot.options.rotation_tolerance))
    return false;
  if (!robot.surroundings.empty()) {
    const NearestPair pair = robot.surroundings.nearest(robot.arm, solution->joints.data());
    solution->contact = {pair.first, pair.second};
    solution->contact_distance = pair.distance + robot.options.scene.clearance;
    if (pair.distance < 0.0) {
      solution->reason = Reason::collision;
      if (trace->colliding.joints.size() == 0 || solution->contact_distance > trace->colliding.contact_distance)
        trace->colliding = *solution;
      return false;
    }
  }
  solution->reason = Reason::reached;
  return true;
}

Descent descend_from(const Query& query, const double* from, const DescentOptions& how, Trace* trace) {
  const PreparedRobot& robot = query.robot;
  Descent descent;
  std::copy(from, from + robot.driven(), descent.readings);
  descend(robot.arm, robot.limits, robot.scales, query.goal, how, query.scratch, &descent);
  trace->iterations += descent.iterations;
  return descent;
}

bool descend_to(const Query& query, const double* from, Trace* trace, Solution* solution) {
  DescentOptions how;
  how.max_iterations = query.robot.options.max_iterations;
  const Descent descent = descend_from(query, from, how, trace);
  if (descent.cost < trace->nearest.cost) trace->nearest = descent;
  return check(query, descent.readings, trace, solution);
}

bool descend_from_many(const Query& query, int restarts, Trace* trace, Solution* solution) {
  if (descend_to(query, query.seed, trace, solution)) return true;
  double from[kMaxDrivenJoints];
  for (int k = 0; k < restarts; ++k) {
    restart_seed(query.robot, k, query.seed, from);
    if (descend_to(query, from, trace, solution)) return true;
  }
  return false;
}

bool collides(const PreparedRobot& robot, const double* readings) {
  return !robot.surroundings.empty() && robot.surroundings.nearest(robot.arm, readings).distance < 0.0;
}

}  // namespace truing::inverse_kinematics
