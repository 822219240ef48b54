// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <doctest/doctest.h>

#include "kernel/drive.hpp"
#include "kernel/rigid.hpp"
#include "truing/dynamics/servo.hpp"

using namespace truing::dynamics;
using Eigen::Index;
using Eigen::MatrixXd;

namespace {

constexpr Index kJoints = 3;
using Engine = std::mt19937;

double between(Engine& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

MatrixXd waves(Engine& random, Index rows, double step, double size) {
  MatrixXd out(rows, kJoints);
  for (Index j = 0; j < kJoints; ++j) {
    const double rate = between(random, 2.0, 9.0), phase = between(random, 0.0, 6.0);
    for (Index k = 0; k < rows; ++k) out(k, j) = size * std::sin(rate * step * static_cast<double>(k) + phase);
  }
  return out;
}

ServoRecording recording_of(Engine& random, Index rows, bool varies) {
  ServoRecording out;
  out.step = 0.02;
  out.command = waves(random, rows, out.step, 0.8);
  out.position = waves(random, rows, out.step, 0.7);
  out.speed = waves(random, rows, out.step, 2.0);
  out.gain = out.supply = out.enabled = MatrixXd::Ones(1, 1);
  out.warmth = MatrixXd::Zero(1, 1);
  if (!varies) return out;
  out.gain = MatrixXd::Constant(rows, kJoints, 1.3) + waves(random, rows, out.step, 0.2);
  out.supply = MatrixXd::Ones(rows, 1) + waves(random, rows, out.step, 0.1).leftCols(1);
  out.warmth = waves(random, rows, out.step, 9.0);
  out.enabled = (waves(random, rows, out.step, 1.0).array() > -0.8).cast<double>();
  return out;
}

ServoPath path_of(Engine& random, Index rows) {
  ServoPath out;
  out.inertia = MatrixXd::Constant(rows, kJoints, 0.04) + waves(random, rows, 0.02, 0.01);
  out.bias = waves(random, rows, 0.02, 0.5);
  out.cosine = waves(random, rows, 0.02, 0.5);
  out.sine = waves(random, rows, 0.02, 0.5);
  out.turns = Eigen::VectorXd::Ones(kJoints);
  out.turns[kJoints - 1] = 0.0;
  return out;
}

/// A chain with some of the laws that a lane knows; `number` says which.
ServoSet set_of(Engine& random, unsigned number) {
  ServoSet out;
  out.chain = MatrixXd::Zero(kJoints, kServoFields);
  out.weight_scale = between(random, 0.8, 1.2);
  out.bodies = 0;
  const auto infinite = std::numeric_limits<double>::infinity();
  for (Index j = 0; j < kJoints; ++j) {
    const auto put = [&](ServoField field, double value) { out.chain(j, static_cast<int>(field)) = value; };
    const auto some = [&](unsigned bit, ServoField field, double low, double high, double usual = 0.0) {
      put(field, (number >> bit & 1U) != 0 ? between(random, low, high) : usual);
    };
    put(ServoField::command_gain, between(random, 5.0, 20.0));
    put(ServoField::gain_law, between(random, 0.5, 1.5));
    put(ServoField::delay, between(random, 0.0, 0.05));
    put(ServoField::coulomb, between(random, 0.02, 0.2));
    put(ServoField::viscous, between(random, 0.1, 0.6));
    put(ServoField::armature, between(random, 0.005, 0.02));
    put(ServoField::drive_reference, 1.0);
    put(ServoField::gravity_scale, between(random, 0.9, 1.1));
    put(ServoField::zero, between(random, -0.02, 0.02));
    put(ServoField::stribeck_speed, 0.1);
    put(ServoField::supply_gain, 1.0);
    some(0, ServoField::damping_gain, 0.1, 0.5);
    some(1, ServoField::rate_limit, 1.0, 3.0, infinite);
    some(2, ServoField::drive_law, 0.6, 1.4, 1.0);
    some(3, ServoField::stribeck, 0.05, 0.2);
    some(4, ServoField::asymmetric_friction, -0.05, 0.05);
    some(5, ServoField::presliding, 0.001, 0.01);
    some(6, ServoField::integral_gain, 1.0, 5.0);
    some(7, ServoField::dead_band, 0.001, 0.02);
    some(8, ServoField::saturation, 0.5, 2.0, infinite);
    some(9, ServoField::viscous_law, -0.05, 0.2);
    some(10, ServoField::load_friction, 0.02, 0.2);
    some(11, ServoField::spring, 0.1, 1.0);
    some(12, ServoField::warmup, -0.05, 0.05);
    some(13, ServoField::thermal_friction, -0.02, 0.02);
    some(14, ServoField::back_emf, 0.2, 0.8);
    some(15, ServoField::current_offset, -0.1, 0.1);
    some(16, ServoField::limited_damping, 0.2, 1.0);
  }
  return out;
}

/// A function of every input.
void add_functions(Engine& random, ServoSet* set) {
  for (int input = 0; input < static_cast<int>(ServoInput::count); ++input) {
    ServoFunction f;
    f.joint = input % static_cast<int>(kJoints);
    f.input = static_cast<ServoInput>(input);
    f.low = -1.0;
    f.width = 0.4;
    f.values = Eigen::VectorXd(6);
    for (double& value : f.values) value = between(random, -0.1, 0.1);
    set->functions.push_back(f);
  }
}

/// The same chain by itself: a supply that sags by what no sum can show is not a lane's.
ServoSet by_itself(ServoSet set) {
  set.chain.col(static_cast<int>(ServoField::supply_sag)).setConstant(1e-300);
  return set;
}

struct ServoScene {
  ServoArm arm;
  std::vector<ServoRecording> recordings;
  std::vector<std::vector<ServoPath>> paths{1};
  std::vector<ServoWindow> windows;
  std::vector<ServoSet> sets;

  ServoMotion run(int threads) const {
    return simulate_servos_apart(arm, paths, recordings, windows, sets, threads, true);
  }
};

ServoScene scene_of(Engine& random) {
  ServoScene out;
  out.arm.qpos = out.arm.dof = {0, 1, 2};
  out.arm.step = 0.004;
  for (int k = 0; k < 2; ++k) {
    out.recordings.push_back(recording_of(random, 90, k == 1));
    out.paths[0].push_back(path_of(random, 90));
  }
  out.windows = {{0, 0, 40}, {0, 40, 49}, {1, 3, 21}, {1, 24, 65}};
  for (int k = 0; k < 40; ++k) {
    out.sets.push_back(set_of(random, k == 0 ? 0 : k == 1 ? 0x1FFFF : random()));
    out.sets.back().only = k % 3 == 2 ? k % static_cast<int>(kJoints) : -1;
    if (k % 5 == 0) add_functions(random, &out.sets.back());
  }
  return out;
}

}  // namespace

TEST_CASE("a joint in lanes moves as it does by itself, to the bit") {
  Engine random(5);
  ServoScene scene = scene_of(random);
  ServoSet& leaves = scene.sets[3];  // a drive that pushes away what it is to hold
  leaves.chain(0, static_cast<int>(ServoField::command_gain)) = -4000.0;
  leaves.chain(0, static_cast<int>(ServoField::saturation)) = std::numeric_limits<double>::infinity();
  const ServoMotion lanes = scene.run(1), again = scene.run(3);
  for (ServoSet& set : scene.sets) set = by_itself(set);
  const ServoMotion alone = scene.run(1);
  double moved = 0.0;
  for (std::size_t k = 0; k < scene.sets.size(); ++k) {
    CAPTURE(k);
    CHECK((lanes.position[k].array() == alone.position[k].array()).all());
    CHECK((lanes.torque[k].array() == alone.torque[k].array()).all());
    CHECK((lanes.position[k].array() == again.position[k].array()).all());
    const double farthest = lanes.position[k].cwiseAbs().maxCoeff();
    if (k == 3) CHECK(farthest == 1e3);
    if (farthest < 10.0) moved = std::max(moved, (lanes.position[k] - lanes.position[0]).cwiseAbs().maxCoeff());
  }
  CHECK(moved > 0.05);  // chains differ
}

TEST_CASE("every copy of the kernel turns joints alike, to the bit") {
  namespace kernel = truing::kernel;
  Engine random(8);
  constexpr int lanes = 2 * kernel::kSampleMultiple, steps = 5;
  std::vector<double> table(static_cast<std::size_t>(lanes * kernel::drive_rows(steps)));
  for (double& value : table) value = between(random, 0.2, 0.9);
  const std::vector<double> places{0.1, -0.2, 0.3};
  const kernel::DriveFunction function{kernel::DriveFunction::Input::angle, -1.0, 1.0, places.data(), 3};
  std::vector<const kernel::DriveFunction*> functions(lanes + 1, &function + 1);
  functions[0] = &function;
  std::vector<std::vector<double>> found;
  for (const char* name : {"scalar", "sse2", "avx2", "avx512"}) {
    const kernel::DriveFunctions* copy = kernel::drive_functions(name);
    if (!copy) continue;
    found.push_back(table);
    copy->turn({found.back().data(), lanes, steps, 0.004, 63, functions.data()});
    CHECK(found.back() == found.front());
    CHECK(found.back() != table);
  }
  CHECK(found.size() >= 2);
}
