// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/prepared_robot.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "math/constants.hpp"

namespace truing::inverse_kinematics {
namespace {

Limits limits_of(const Arm& arm) {
  Limits limits;
  int reading = 0;
  for (std::size_t k = 0; k < arm.robot().joints.size(); ++k) {
    const Joint& joint = arm.robot().joints[k];
    if (!joint.passive()) {
      limits.lower[reading] = joint.lower;
      limits.upper[reading++] = joint.upper;
    } else if (std::isfinite(joint.lower) || std::isfinite(joint.upper)) {
      PassiveLimit limit{{}, arm.motion_constants()[static_cast<Eigen::Index>(k)], joint.lower, joint.upper};
      for (int j = 0; j < arm.driven(); ++j) limit.weight[j] = arm.motion_weights()(static_cast<Eigen::Index>(k), j);
      limits.passive.push_back(limit);
    }
  }
  return limits;
}

/// Metres that count as a radian: the length of what turns, stretched out, over pi.
Scales scales_of(const Arm& arm) {
  Tip home;
  const std::vector<HomeAxis> axes = arm.home_axes(&home);
  double length = 0.0;
  const HomeAxis* last = nullptr;
  for (const HomeAxis& axis : axes) {
    if (axis.prismatic) continue;
    if (last) length += (axis.point - last->point).norm();
    last = &axis;
  }
  if (last) length += (home.position - last->point).norm();
  Scales scales;
  scales.length = length > 1e-3 ? length / kPi : 1.0;
  std::size_t reading = 0;
  for (const Joint& joint : arm.robot().joints) {
    if (!joint.passive()) scales.joint[reading++] = joint.type == JointType::prismatic ? scales.length : 1.0;
  }
  return scales;
}

const InverseOptions& valid(const InverseOptions& options) {
  std::string why;
  if (!options.is_valid(&why)) throw std::invalid_argument(why);
  return options;
}

/// Steps of the additive recurrence x_k = frac(1/2 + k a), a_j = g^-(j+1), g^(n+1) = g + 1: the generalised golden
/// ratio (Roberts 2018).
void golden_steps(int n, double* step) {
  double g = 2.0;
  for (int i = 0; i < 60; ++i) g = std::pow(1.0 + g, 1.0 / (n + 1));
  double power = 1.0;
  for (int j = 0; j < n; ++j) step[j] = power /= g;
}

/// Place of a driven joint in the chain.
std::size_t driven_joint(const Robot& robot, int reading) {
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    if (!robot.joints[k].passive() && reading-- == 0) return k;
  }
  return 0;
}

}  // namespace

PreparedRobot::PreparedRobot(const Robot& robot, const InverseOptions& o, const Conditions& available,
                             std::size_t target, const std::vector<Effect>& own)
    : options(valid(o)),
      arm(robot, available, target, own),
      limits(limits_of(arm)),
      scales(scales_of(arm)),
      closed(arm, o),
      surroundings(o.scene.empty() ? Surroundings() : Surroundings(o.scene, arm)) {
  golden_steps(arm.driven(), seed_step);
  for (int j = 0; j < arm.driven(); ++j) turn[j] = whole_turn(*this, j);
}

double distance2(const PreparedRobot& robot, const double* a, const double* b) {
  double sum = 0.0;
  for (int j = 0; j < robot.driven(); ++j) {
    const double d = (a[j] - b[j]) / robot.scales.joint[j];
    sum += d * d;
  }
  return sum;
}

void restart_seed(const PreparedRobot& robot, int k, const double* around, double* seed) {
  for (int j = 0; j < robot.driven(); ++j) {
    const double half = kPi * robot.scales.joint[j];
    double low = robot.limits.lower[j], high = robot.limits.upper[j];
    if (!std::isfinite(low) || !std::isfinite(high)) {
      const double middle = std::clamp(around[j], low, high);
      low = std::max(low, middle - half);
      high = std::min(high, middle + half);
    } else if (robot.arm.turns(j) && high - low > 2.0 * half) {
      const double middle = 0.5 * (low + high);
      low = middle - half;
      high = middle + half;
    }
    const double x = 0.5 + (k + 1) * robot.seed_step[j];
    seed[j] = low + (high - low) * (x - std::floor(x));
  }
}

double whole_turn(const PreparedRobot& robot, int joint) {
  const Arm& arm = robot.arm;
  int moved = 0;
  for (Eigen::Index k = 0; k < arm.motion_weights().rows(); ++k) moved += arm.motion_weights()(k, joint) != 0.0;
  if (!arm.turns(joint) || moved != 1) return 0.0;
  return 2.0 * kPi / std::abs(arm.robot().joints[driven_joint(arm.robot(), joint)].ratio);
}

void bring_near(const PreparedRobot& robot, const double* seed, double* readings) {
  for (int j = 0; j < robot.driven(); ++j) {
    const double turn = robot.turn[j];
    if (turn > 0.0) readings[j] += turn * std::floor((seed[j] - readings[j]) / turn + 0.5);
  }
}

}  // namespace truing::inverse_kinematics
