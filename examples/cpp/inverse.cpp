// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A torch task on an arm whose links are a little off, and what to command to a controller that does not know that.

#include <cmath>
#include <cstdio>

#include <truing/truing.hpp>

namespace {

truing::Joint joint(const char* name, double theta, double d, double a, double alpha) {
  truing::Joint j;
  j.name = name;
  j.theta = theta;
  j.d = d;
  j.a = a;
  j.alpha = alpha;
  j.lower = -2.8;
  j.upper = 2.8;
  return j;
}

}  // namespace

int main() {
  truing::Robot nominal;
  nominal.name = "arm";
  nominal.joints = {joint("J1", 0, 0.29, 0, -M_PI / 2), joint("J2", -M_PI / 2, 0, 0.27, 0),
                    joint("J3", 0, 0, 0.07, -M_PI / 2), joint("J4", 0, 0.302, 0, M_PI / 2),
                    joint("J5", 0, 0, 0, -M_PI / 2),    joint("J6", 0, 0.072, 0, 0)};
  truing::Robot real = nominal;
  for (truing::Joint& j : real.joints) {
    j.a += 4e-4;
    j.alpha += 6e-4;
  }

  const truing::InverseSolver solver(real);
  truing::Joints seed(6);
  seed << 0.1, 0.2, -0.3, 0.2, 0.8, -0.4;
  truing::Task task;
  task.T_measurement_target = solver.forward(seed);
  task.T_measurement_target.translation().y() += 0.05;
  task.kind = truing::TaskKind::torch;  // roll about the tool's z is free
  const truing::Solution found = solver.solve(task, seed);
  std::printf("torch: %s, %.1e m, %.1e rad, roll %.3f rad\n", solver.describe(found).c_str(), found.position_error,
              found.rotation_error, found.roll);

  task.T_measurement_target.translation().x() += 2.0;
  std::printf("2 m further: %s\n", solver.describe(solver.solve(task, seed)).c_str());

  task.T_measurement_target = solver.forward(seed);
  task.kind = truing::TaskKind::pose;
  const truing::Compensator compensator(nominal, real);
  const truing::Compensated made = compensator.pose(task, seed);
  std::printf("commanded as it is it would be missed by %.2f mm; compensated by %.1e m\n", 1e3 * made.position_before,
              made.solution.position_error);
  return found.reached() && made.solution.reached() && made.position_before > 1e-4 ? 0 : 1;
}
