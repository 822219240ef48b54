// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A six-axis arm with hidden errors is measured with a laser tracker (simulated), and found out.
// Your own robot and measurements take the place of all that stands before `identify` in main().

#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include <truing/truing.hpp>

namespace {

struct Link {
  const char* name;
  double theta, d, a, alpha;
};

truing::Robot six_axes() {
  const double right = std::acos(0.0);
  const Link links[] = {{"J1", 0.0, 0.290, 0.000, -right}, {"J2", -right, 0.000, 0.270, 0.0},
                        {"J3", 0.0, 0.000, 0.070, -right}, {"J4", 0.0, 0.302, 0.000, right},
                        {"J5", 0.0, 0.000, 0.000, -right}, {"J6", 2.0 * right, 0.072, 0.000, 0.0}};
  truing::Robot robot;
  robot.name = "six axes";
  for (const Link& link : links) {
    truing::Joint joint;
    joint.name = link.name;
    joint.theta = link.theta;
    joint.d = link.d;
    joint.a = link.a;
    joint.alpha = link.alpha;
    robot.joints.push_back(joint);
  }
  truing::Target tool;
  tool.name = "tool";
  // A reflector off the flange's axis: every joint moves it.
  tool.T_last_target.translation() << 0.05, 0.02, 0.08;
  robot.targets = {tool};
  return robot;
}

}  // namespace

int main() {
  const truing::Robot nominal = six_axes();
  truing::Robot real = nominal;
  real.joints[1].a += 0.8e-3;
  real.joints[2].offset += 1.5e-3;
  real.joints[3].alpha -= 0.6e-3;
  real.T_measurement_base.translation() << 1.0, -0.4, 0.2;  // nobody knows where the robot stands

  // Rows of joint readings and measured positions; any memory will do, column by column or row by row.
  constexpr std::size_t rows = 120, joints = 6;
  std::vector<double> reading(rows * joints), position(rows * 3);
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 3e-5);
  std::uniform_real_distribution<double> angle(-1.9, 1.9);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t k = 0; k < joints; ++k) reading[row * joints + k] = angle(random);
    const Eigen::Map<const Eigen::VectorXd> q(&reading[row * joints], joints);
    const Eigen::Vector3d tip = truing::forward_kinematics(real, q).back().translation();
    for (int axis = 0; axis < 3; ++axis) position[row * 3 + static_cast<std::size_t>(axis)] = tip[axis] + noise(random);
  }
  truing::Measurements data;  // owns nothing: pointer and stride per column
  data.rows = rows;
  for (std::size_t k = 0; k < joints; ++k) data.joints.push_back({&reading[k], joints});
  for (std::size_t axis = 0; axis < 3; ++axis) data.position[axis] = {&position[axis], 3};

  const truing::Identification found = truing::identify(nominal, data);

  std::printf("%s after %d iterations: %s\n", found.solver.converged ? "converged" : "NOT converged",
              found.solver.iterations, found.solver.stopped_because.c_str());
  std::printf("held out: %.4f mm before, %.4f mm after (mean of %zu rows)\n", 1e3 * found.test->before.mean,
              1e3 * found.test->after.mean, found.test->after.n);
  std::printf("%d of %d parameters found; the changes of more than five standard errors:\n", found.rank, found.columns);
  for (const truing::Parameter& p : found.parameters) {
    if (p.frozen || p.name.rfind("base.", 0) == 0 || std::abs(p.value - p.nominal) < 5.0 * p.sigma) continue;
    std::printf("  %-10s %+.6f +- %.6f %s\n", p.name.c_str(), p.value - p.nominal, p.sigma, p.unit.c_str());
  }
  return found.solver.converged && found.test->after.mean < 1e-4 ? 0 : 1;
}
