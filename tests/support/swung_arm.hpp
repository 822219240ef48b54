// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// An arm whose links swing in a vertical plane, its friction, and recordings of its motion.

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "math/random.hpp"
#include "truing/dynamics.hpp"

namespace swung {

/// Joints J1, J2 … turn about parallel, level axes; the tool is the last frame.
inline truing::Robot level_arm(int joints = 2) {
  truing::Robot out;
  out.name = "arm";
  for (int k = 1; k <= joints; ++k) {
    truing::Joint joint;
    joint.name = "J" + std::to_string(k);
    joint.a = 0.4;
    joint.mass = 3.0;
    joint.center_of_mass = {-0.2, 0.0, 0.0};
    joint.inertia = Eigen::Vector3d(0.004, 0.04, 0.04).asDiagonal();
    out.joints.push_back(joint);
  }
  out.gravity = {0.0, -9.81, 0.0};
  out.targets = {{"tool", Eigen::Isometry3d::Identity()}};
  return out;
}

/// The same with Coulomb and viscous friction in every joint.
inline truing::Robot with_friction(truing::Robot robot) {
  for (const truing::Joint& joint : robot.joints) {
    robot.torque_effects.push_back({"coulomb", {joint.name}, {{"coulomb." + joint.name, 1.5}}});
    robot.torque_effects.push_back({"viscous", {joint.name}, {{"viscous." + joint.name, 0.8}}});
  }
  return robot;
}

/// Both joints swing, each at two frequencies; every number begins elsewhere. 100 rows a second.
inline truing::Recording swing(int number, double seconds) {
  truing::Recording out;
  out.name = "motion" + std::to_string(number);
  const auto rows = static_cast<Eigen::Index>(100.0 * seconds);
  out.time = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.01 * static_cast<double>(rows - 1));
  out.position.resize(rows, 2);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = out.time[i], phase = 1.3 * number;
    out.position(i, 0) = 0.8 * std::sin(0.9 * t + phase) + 0.3 * std::sin(2.3 * t);
    out.position(i, 1) = 0.9 * std::sin(1.1 * t + 2.0 * phase) + 0.3 * std::cos(2.9 * t + phase);
  }
  return out;
}

/// The motion with the torques that it takes of a robot, and noise on them.
inline truing::Recording measured(const truing::Robot& truth, truing::Recording motion, std::uint64_t seed,
                                  const std::vector<truing::TorqueEffect>& own = {}) {
  motion.torque = truing::dynamics::predict(truth, motion, 30.0, own).torque;
  truing::math::Random random(seed);
  for (double& value : motion.torque.reshaped()) value += 0.05 * random.normal();
  return motion;
}

}  // namespace swung
