// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Robots and data that several tests share. Every random number comes from a seed that the test names.

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "truing/truing.hpp"

namespace arms {

using truing::Column;
using truing::Convention;
using truing::Joint;
using truing::JointType;
using truing::Measurements;
using truing::Robot;

inline Joint joint(const std::string& name, double theta, double d, double a, double alpha) {
  Joint j;
  j.name = name;
  j.theta = theta;
  j.d = d;
  j.a = a;
  j.alpha = alpha;
  return j;
}

inline void set_tool(Robot* robot, const Eigen::Vector3d& xyz, const Eigen::Vector3d& rpy = Eigen::Vector3d::Zero()) {
  robot->targets = {{"tool", truing::frame_from_xyz_rpy(xyz, rpy)}};
}

/// UR10, modified DH. Axes 2, 3, 4 are parallel.
inline Robot ur10() {
  Robot robot;
  robot.name = "ur10";
  robot.convention = Convention::mdh;
  robot.joints = {joint("J1", 0, 0.1273, 0, 0),        joint("J2", 0, 0, 0, M_PI / 2),
                  joint("J3", 0, 0, -0.612, 0),        joint("J4", 0, 0.163941, -0.5723, 0),
                  joint("J5", 0, 0.1157, 0, M_PI / 2), joint("J6", 0, 0.0922, 0, -M_PI / 2)};
  const double masses[6] = {7.778, 12.93, 3.87, 1.96, 1.96, 0.202};
  for (int k = 0; k < 6; ++k) {
    robot.joints[k].mass = masses[k];
    robot.joints[k].center_of_mass = Eigen::Vector3d(k == 2 ? -0.3 : 0.01, 0.02, 0.03);
  }
  set_tool(&robot, {0.03, -0.02, 0.15});
  return robot;
}

/// The palletizer of the method: joint 4 is passive, q4 = -(q2 + q3); four driven joints, DH.
inline Robot palletizer() {
  Robot robot;
  robot.name = "palletizer";
  robot.joints = {joint("J1", 0, 0.7425, 0.26, -M_PI / 2), joint("J2", -M_PI / 2, 0, 1.3, 0),
                  joint("J3", M_PI / 2, 0, 1.6, 0), joint("J4", 0, 0.05, 0.22, M_PI / 2), joint("J5", 0, 0.2, 0, 0)};
  robot.joints[3].driven_by = {{"J2", -1.0}, {"J3", -1.0}};
  for (Joint& j : robot.joints) {
    j.lower = -1.2;
    j.upper = 1.2;
    j.mass = 50.0;
    j.center_of_mass = {-0.2, 0.05, 0.1};
  }
  set_tool(&robot, {0.15, 0.08, 0.12});
  return robot;
}

/// A rail under a 3R arm: prismatic first joint, DH.
inline Robot rail_arm() {
  Robot robot;
  robot.name = "rail";
  robot.joints = {joint("rail", 0, 0, 0.1, M_PI / 2), joint("J1", 0.3, 0.4, 0.05, -M_PI / 2),
                  joint("J2", 0, 0, 0.5, 0.02), joint("J3", 0, 0.1, 0.4, 1.0)};
  robot.joints[0].type = JointType::prismatic;
  robot.joints[0].lower = -1.0;
  robot.joints[0].upper = 1.0;
  set_tool(&robot, {0.02, 0.03, 0.1}, {0.1, 0.2, 0.3});
  return robot;
}

/// Chain of joint origins, as from a URDF, with an oblique axis and a pitch of 90 degrees.
inline Robot urdf_arm() {
  Robot robot;
  robot.name = "origins";
  robot.convention = Convention::urdf;
  const Eigen::Vector3d axes[4] = {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}, Eigen::Vector3d(0.6, 0.0, 0.8)};
  for (int k = 0; k < 4; ++k) {
    Joint j;
    j.name = "J" + std::to_string(k + 1);
    j.T_parent_joint = truing::frame_from_xyz_rpy({0.1, 0.05 * k, 0.3}, {0.1 * k, k == 2 ? M_PI / 2 : 0.2, -0.3});
    j.axis = axes[k];
    robot.joints.push_back(j);
  }
  set_tool(&robot, {0.05, 0.02, 0.1}, {0.3, -0.2, 0.1});
  return robot;
}

/// Data with memory of its own, column by column.
struct Table {
  explicit Table(std::size_t rows) { data.rows = rows; }
  Table(const Table&) = delete;

  Column add(const std::vector<double>& values) {
    columns.push_back(std::make_unique<std::vector<double>>(values));
    return {columns.back()->data(), 1};
  }

  Measurements data;
  std::vector<std::unique_ptr<std::vector<double>>> columns;
};

inline std::unique_ptr<Table> random_joints(const Robot& robot, std::size_t rows, unsigned seed) {
  auto table = std::make_unique<Table>(rows);
  std::mt19937_64 random(seed);
  for (const std::size_t k : robot.driven_joints()) {
    const double low = std::isfinite(robot.joints[k].lower) ? robot.joints[k].lower : -2.5;
    const double high = std::isfinite(robot.joints[k].upper) ? robot.joints[k].upper : 2.5;
    std::vector<double> q(rows);
    for (double& v : q) v = low + (high - low) * (static_cast<double>(random() >> 11) * 0x1.0p-53);
    table->data.joints.push_back(table->add(q));
  }
  return table;
}

enum class What { position, pose, distance };

/// Adds what `truth` would give in these joints, with Gaussian noise of `sigma` [m] (orientations: 2 sigma / m [rad]).
inline void measure(Table* table, const Robot& truth, What what, double sigma, unsigned seed) {
  const truing::Prediction p = truing::predict(truth, table->data);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  const auto rows = static_cast<Eigen::Index>(table->data.rows);
  if (what == What::distance) {
    std::vector<double> d(table->data.rows);
    for (Eigen::Index i = 0; i < rows; ++i) d[i] = p.distance[i] + sigma * normal(random);
    table->data.distance = table->add(d);
    return;
  }
  for (int k = 0; k < 3; ++k) {
    std::vector<double> x(table->data.rows);
    for (Eigen::Index i = 0; i < rows; ++i) x[i] = p.position(i, k) + sigma * normal(random);
    table->data.position[k] = table->add(x);
  }
  if (what != What::pose) return;
  std::vector<std::vector<double>> q(4, std::vector<double>(table->data.rows));
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Vector3d v(sigma * normal(random), sigma * normal(random), sigma * normal(random));
    const Eigen::Quaterniond noisy =
        Eigen::Quaterniond(1.0, v.x(), v.y(), v.z()).normalized() *
        Eigen::Quaterniond(p.orientation(i, 0), p.orientation(i, 1), p.orientation(i, 2), p.orientation(i, 3));
    const double wxyz[4] = {noisy.w(), noisy.x(), noisy.y(), noisy.z()};
    for (int k = 0; k < 4; ++k) q[k][i] = wxyz[k];
  }
  for (int k = 0; k < 4; ++k) table->data.orientation[k] = table->add(q[k]);
}

/// A copy with every length wrong by about `length` and every angle by about `angle`.
inline Robot perturbed(Robot robot, double length, double angle, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (Joint& j : robot.joints) {
    if (robot.convention == Convention::urdf) {
      j.T_parent_joint =
          j.T_parent_joint *
          truing::frame_from_xyz_rpy(length * Eigen::Vector3d(normal(random), normal(random), normal(random)),
                                     angle * Eigen::Vector3d(normal(random), normal(random), normal(random)));
      continue;
    }
    j.theta += angle * normal(random);
    j.d += length * normal(random);
    j.a += length * normal(random);
    j.alpha += angle * normal(random);
  }
  for (truing::Target& t : robot.targets)
    t.T_last_target.translation() += length * Eigen::Vector3d(normal(random), normal(random), normal(random));
  return robot;
}

inline Eigen::Isometry3d somewhere() { return truing::frame_from_xyz_rpy({2.1, -0.7, 0.4}, {0.3, -1.2, 2.5}); }

}  // namespace arms
