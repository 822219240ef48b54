// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Uses the installed library as its users do: a two-joint robot with a link that is 1 mm longer than drawn
// is measured, found out, and has no other cause to be named afterwards.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <truing/truing.hpp>

namespace {

truing::Robot two_joints() {
  truing::Robot robot;
  robot.name = "two joints";
  truing::Joint shoulder;
  shoulder.name = "J1";
  shoulder.a = 0.3;
  shoulder.d = 0.4;
  shoulder.alpha = 1.2;
  truing::Joint elbow;
  elbow.name = "J2";
  elbow.a = 0.25;
  robot.joints = {shoulder, elbow};
  truing::Target tool;
  tool.name = "tool";
  robot.targets = {tool};
  return robot;
}

const truing::Parameter* find(const truing::Identification& result, const std::string& name) {
  for (const truing::Parameter& parameter : result.parameters) {
    if (parameter.name == name) return &parameter;
  }
  return nullptr;
}

}  // namespace

int main() {
  const truing::Robot nominal = two_joints();
  truing::Robot real = nominal;
  real.joints[0].a += 1e-3;

  constexpr std::size_t rows = 60;
  std::vector<double> joints(rows * 2), position(rows * 3);
  for (std::size_t row = 0; row < rows; ++row) {
    joints[2 * row] = 2.5 * std::sin(0.7 * static_cast<double>(row));
    joints[2 * row + 1] = 2.5 * std::sin(1.9 * static_cast<double>(row) + 1.0);
    const Eigen::Vector2d reading(joints[2 * row], joints[2 * row + 1]);
    const Eigen::Vector3d point = truing::forward_kinematics(real, reading).back().translation();
    for (int axis = 0; axis < 3; ++axis) position[3 * row + static_cast<std::size_t>(axis)] = point[axis];
  }
  truing::Measurements data;
  data.rows = rows;
  data.joints = {{joints.data(), 2}, {joints.data() + 1, 2}};
  data.position = {{{position.data(), 3}, {position.data() + 1, 3}, {position.data() + 2, 3}}};

  truing::IdentifyOptions options;
  options.free = {"J1.a"};
  const truing::Identification result = truing::identify(nominal, data, options);
  const truing::Parameter* length = find(result, "J1.a");
  if (length == nullptr) {
    std::puts("consumer: the result has no J1.a");
    return 1;
  }
  std::printf("truing %s: J1.a %.6f m, real %.6f m, %s\n", truing::version, length->value, real.joints[0].a,
              result.solver.stopped_because.c_str());
  if (std::abs(length->value - real.joints[0].a) > 1e-6) return 1;

  unsigned state = 1;  // a little noise, or there would be no scale for what is large
  for (double& coordinate : position) {
    state = state * 1664525u + 1013904223u;
    coordinate += 1e-4 * (static_cast<double>(state >> 8) / 16777216.0 - 0.5);
  }
  const truing::Diagnosis diagnosis = truing::diagnose(result.robot, data);
  std::printf("%s\n", diagnosis.sentence.c_str());
  return diagnosis.verdict == truing::Verdict::none ? 0 : 1;
}
