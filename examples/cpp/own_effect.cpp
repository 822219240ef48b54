// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// An effect that no catalogue has: joint 2's belt stretches with the payload, more so the further the arm
// leans out. An effect is a list of terms, parameter * basis(recorded inputs) on a site; nobody writes a
// derivative.

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include <truing/truing.hpp>

namespace {

truing::Effect belt_stretch() {
  truing::Effect effect;
  effect.name = "belt_stretch";
  effect.summary = "the belt gives way under the payload, with the cosine of the joint";
  effect.terms = [](const truing::Robot& robot, std::size_t joint, const truing::Measurements& data) {
    if (!data.payload) throw std::invalid_argument("belt_stretch needs the column payload_kg");
    truing::Term term;
    term.parameter = "belt_stretch." + robot.joints[joint].name;
    term.unit = "rad/kg";
    term.site = robot.joints[joint].name;  // a joint: whatever moves with it
    term.basis = [joint](const truing::Inputs& in) {
      return in.data->payload[in.row] * std::cos(in.joints[static_cast<Eigen::Index>(joint)]);
    };
    return std::vector<truing::Term>{term};
  };
  return effect;
}

truing::Robot three_axes() {
  truing::Robot robot;
  robot.name = "three axes";
  const double alpha[] = {-std::acos(0.0), 0.0, 0.0}, a[] = {0.1, 0.6, 0.5}, d[] = {0.4, 0.0, 0.0};
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
  robot.targets = {tool};
  return robot;
}

}  // namespace

int main() {
  const truing::Robot nominal = three_axes();
  constexpr double stretch = 5e-5;  // [rad/kg]
  truing::Robot real = nominal;
  real.joints[1].a += 1e-3;
  real.effects = {{"belt_stretch", {"J2"}, {{"belt_stretch.J2", stretch}}}};

  constexpr std::size_t rows = 90;
  std::vector<double> reading(rows * 3), payload(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    const auto t = static_cast<double>(row);
    reading[row * 3] = 2.6 * std::sin(0.7 * t);
    reading[row * 3 + 1] = 1.2 * std::sin(1.9 * t + 1.0);
    reading[row * 3 + 2] = 1.4 * std::sin(3.1 * t + 2.0);
    payload[row] = 5.0 * static_cast<double>(row % 3);
  }
  truing::Measurements data;
  data.rows = rows;
  for (std::size_t k = 0; k < 3; ++k) data.joints.push_back({&reading[k], 3});
  data.payload = {payload.data(), 1};

  // What the real robot does, and so what would be measured; `predict` and `identify` are told what the
  // effect means.
  const std::vector<truing::Effect> own = {belt_stretch()};
  const truing::Prediction measured = truing::predict(real, data, own);
  for (std::size_t axis = 0; axis < 3; ++axis) data.position[axis] = {measured.position.data() + axis, 3};

  truing::IdentifyOptions options;
  options.effects = {{"belt_stretch", {"J2"}}};
  options.own_effects = own;
  const truing::Identification found = truing::identify(nominal, data, options);

  const double value = found.robot.effects.at(0).parameters.at("belt_stretch.J2");
  std::printf("belt_stretch.J2 = %.4g rad/kg, hidden were %.4g; held-out error %.3g mm after %.3g mm\n", value, stretch,
              1e3 * found.test->after.mean, 1e3 * found.test->before.mean);
  return std::abs(value - stretch) < 1e-3 * stretch ? 0 : 1;
}
