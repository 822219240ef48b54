// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// Why an arm's torques differ from its model's: friction that grows with the load at the second joint, which nobody put
// into the model, is named from recordings of motion and torque.

#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include <truing/truing.hpp>

namespace {

using Eigen::Index;

constexpr Index kJoints = 3;

truing::Robot three_axes() {
  truing::Robot robot;
  robot.name = "three axes";
  const double alpha[] = {std::acos(0.0), 0.0, 0.0}, a[] = {0.0, 0.45, 0.35}, d[] = {0.4, 0.0, 0.0};
  const double mass[] = {9.0, 8.0, 4.0};
  for (int k = 0; k < kJoints; ++k) {
    truing::Joint joint;
    joint.name = "J" + std::to_string(k + 1);
    joint.alpha = alpha[k];
    joint.a = a[k];
    joint.d = d[k];
    joint.mass = mass[k];
    joint.center_of_mass = {-0.5 * a[k], 0.0, 0.0};
    joint.inertia = Eigen::Vector3d(0.02, 0.12, 0.12).asDiagonal();
    robot.joints.push_back(joint);
  }
  truing::Target tool;
  tool.name = "tool";
  robot.targets = {tool};
  return robot;
}

/// The real arm: usual friction at every joint, and friction of the load at J2.
truing::Robot with_friction(truing::Robot robot, double load_friction) {
  for (const truing::Joint& joint : robot.joints) {
    robot.torque_effects.push_back({"coulomb", {joint.name}, {{"coulomb." + joint.name, 3.0}}});
    robot.torque_effects.push_back({"viscous", {joint.name}, {{"viscous." + joint.name, 4.0}}});
  }
  robot.torque_effects.push_back({"load_friction", {"J2"}, {{"load_friction.J2", load_friction}}});
  return robot;
}

/// Twenty seconds of sines at 100 Hz.
truing::Recording motion(int number) {
  constexpr Index kRows = 2000;
  truing::Recording out;
  out.name = "run" + std::to_string(number);
  out.test = number >= 4;
  out.time = Eigen::VectorXd::LinSpaced(kRows, 0.0, 0.01 * (kRows - 1));
  out.position.resize(kRows, kJoints);
  for (Index j = 0; j < kJoints; ++j) {
    const double pace = 0.7 + 0.31 * static_cast<double>(j) + 0.13 * number,
                 phase = 1.3 * static_cast<double>(j) + number;
    out.position.col(j) = 0.9 * (pace * out.time.array() + phase).sin() + 0.3 * (2.7 * pace * out.time.array()).sin();
  }
  return out;
}

}  // namespace

int main() {
  const truing::Robot nominal = three_axes();
  constexpr double hidden = 0.12;
  const truing::Robot real = with_friction(nominal, hidden);

  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.2);  // [Nm]
  std::vector<truing::Recording> recordings;
  for (int number = 0; number < 6; ++number) {
    truing::Recording one = motion(number);
    one.torque = truing::dynamics::predict(real, one).torque;
    for (double& torque : one.torque.reshaped()) torque += noise(random);
    recordings.push_back(one);
  }

  const truing::TorqueDiagnosis found = truing::dynamics::diagnose(nominal, recordings);
  std::printf("%s\n", found.sentence.c_str());
  for (const truing::FoundTorqueEffect& effect : found.effects) {
    if (effect.standard) continue;
    const truing::Parameter& first = effect.parameters.front();
    std::printf("%s = %.3f +- %.3f, hidden were %.3f; probability %.2f\n", first.name.c_str(), first.value, first.sigma,
                hidden, effect.probability);
  }
  const truing::FoundTorqueEffect& named = found.effects.front();
  const bool right = named.effect == "load_friction" && named.joints == std::vector<std::string>{"J2"};
  return right && std::abs(named.parameters.front().value - hidden) < 0.2 * hidden ? 0 : 1;
}
