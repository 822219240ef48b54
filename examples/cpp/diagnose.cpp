// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// A three-axis arm misses its model by lost motion in one gear, and nobody knows. `diagnose` is given robot
// and measurements, and names effect, joint and size.

#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include <truing/truing.hpp>

namespace {

truing::Robot three_axes() {
  truing::Robot robot;
  robot.name = "three axes";
  const double right = std::acos(0.0);
  const double alpha[] = {-right, 0.0, 0.4}, a[] = {0.1, 0.6, 0.5}, d[] = {0.4, 0.0, 0.1};
  for (int k = 0; k < 3; ++k) {
    truing::Joint joint;
    joint.name = "J" + std::to_string(k + 1);
    joint.alpha = alpha[k];
    joint.a = a[k];
    joint.d = d[k];
    robot.joints.push_back(joint);
  }
  truing::Target tool;
  tool.name = "tool";
  tool.T_last_target.translation() << 0.05, 0.02, 0.08;
  robot.targets = {tool};
  return robot;
}

}  // namespace

int main() {
  const truing::Robot nominal = three_axes();
  constexpr double lost = 6e-4;  // [rad] between the two sides
  truing::Robot real = nominal;
  real.T_measurement_base.translation() << 1.0, -0.4, 0.2;  // nobody knows where the robot stands
  real.effects = {{"backlash", {"J2"}, {{"backlash.J2", lost}}}};

  constexpr std::size_t rows = 120, joints = 3;
  std::vector<double> reading(rows * joints), direction(rows * joints), position(rows * 3);
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 3e-5);
  std::uniform_real_distribution<double> angle(-1.9, 1.9);
  for (double& q : reading) q = angle(random);
  for (double& side : direction) side = random() % 2 == 0 ? 1.0 : -1.0;  // from which side each joint arrived
  truing::Measurements data;
  data.rows = rows;
  for (std::size_t k = 0; k < joints; ++k) data.joints.push_back({&reading[k], joints});
  for (std::size_t k = 0; k < joints; ++k) data.direction.push_back({&direction[k], joints});
  const truing::Prediction measured = truing::predict(real, data);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      position[row * 3 + axis] =
          measured.position(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(axis)) + noise(random);
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) data.position[axis] = {&position[axis], 3};

  const truing::Diagnosis found = truing::diagnose(nominal, data);

  std::printf("%s\n", found.sentence.c_str());
  for (const truing::FoundEffect& effect : found.effects) {
    std::printf("%s at %s, probability %.2f: takes %.0f %% off the held-out error (%.0f to %.0f %%)\n",
                effect.effect.c_str(), effect.joints.empty() ? "the robot" : effect.joints[0].c_str(),
                effect.probability, 100.0 * effect.shrink.value, 100.0 * effect.shrink.low, 100.0 * effect.shrink.high);
    for (const truing::Parameter& p : effect.parameters) {
      std::printf("  %s = %.3g +- %.2g %s\n", p.name.c_str(), p.value, p.sigma, p.unit.c_str());
    }
  }
  const bool named = found.effects.size() == 1 && found.effects[0].effect == "backlash" &&
                     found.effects[0].joints == std::vector<std::string>{"J2"};
  return named && std::abs(found.effects[0].parameters.at(0).value - lost) < 0.1 * lost ? 0 : 1;
}
