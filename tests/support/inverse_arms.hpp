// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Arms that the tests of inverse kinematics share, and forward_kinematics' opinion of what is claimed to be reached.

#include <cmath>
#include <random>

#include "math/constants.hpp"
#include "support/arms.hpp"
#include "truing/inverse.hpp"

namespace inverse_arms {

using namespace arms;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using truing::Joints;
using truing::Solution;
using truing::Task;
using truing::TaskKind;
using truing::math::kDegree;

/// An arm with a spherical wrist, axes 2 and 3 parallel, and limits beyond half a turn. DH.
inline Robot wrist_arm() {
  Robot robot;
  robot.name = "wrist";
  robot.joints = {joint("J1", 0, 0.495, 0.175, -M_PI / 2), joint("J2", -M_PI / 2, 0, 0.9, 0),
                  joint("J3", 0, 0, 0.175, -M_PI / 2),     joint("J4", 0, 0.96, 0, M_PI / 2),
                  joint("J5", 0, 0, 0, -M_PI / 2),         joint("J6", 0, 0.135, 0, 0)};
  const double limits[6][2] = {{-180, 180}, {-90, 150}, {-180, 75}, {-400, 400}, {-125, 120}, {-400, 400}};
  for (int k = 0; k < 6; ++k) {
    robot.joints[k].lower = limits[k][0] * kDegree;
    robot.joints[k].upper = limits[k][1] * kDegree;
  }
  set_tool(&robot, {0.05, 0.0, 0.25}, {0.0, 0.6, 0.0});
  return robot;
}

/// UR10 whose joints turn twice.
inline Robot ur() {
  Robot robot = ur10();
  for (Joint& j : robot.joints) {
    j.lower = -2 * M_PI;
    j.upper = 2 * M_PI;
  }
  set_tool(&robot, {0.03, -0.02, 0.15}, {0.0, 0.5, 0.0});
  return robot;
}

/// The wrist arm under a gantry of three rails, hanging.
inline Robot gantry() {
  Robot robot = wrist_arm();
  robot.name = "gantry";
  std::vector<Joint> rails = {joint("X", 0, 0, 0, -M_PI / 2), joint("Y", M_PI / 2, 0, 0, M_PI / 2),
                              joint("Z", 0, 0, 0, 0)};
  const double lengths[3] = {10, 4, 2};
  for (int k = 0; k < 3; ++k) {
    rails[k].type = JointType::prismatic;
    rails[k].lower = 0.0;
    rails[k].upper = lengths[k];
  }
  robot.T_measurement_base = truing::frame_from_xyz_rpy({0, 0, 3}, {0, M_PI / 2, 0});
  robot.joints.insert(robot.joints.begin(), rails.begin(), rails.end());
  return robot;
}

/// The same arm written as a chain of origins.
inline Robot as_urdf(const Robot& robot) {
  Robot out = robot;
  out.convention = Convention::urdf;
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(robot.driven_count()));
  const auto frames = truing::forward_kinematics(robot, zero);
  Isometry3d before = robot.T_measurement_base;
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    // Where the joint turns: z of the frame before its link (DH) or after it (modified DH).
    const Isometry3d here =
        robot.convention == Convention::dh ? (k ? frames[k - 1] : robot.T_measurement_base) : frames[k];
    out.joints[k].T_parent_joint = before.inverse() * here;
    out.joints[k].axis = Vector3d::UnitZ();
    before = here;
  }
  out.targets[0].T_last_target = before.inverse() * frames.back();
  return out;
}

struct Sampler {
  explicit Sampler(const Robot& r, unsigned seed) : robot(r), random(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1.0p-53);
  }
  Joints joints() {
    Joints q(static_cast<Eigen::Index>(robot.driven_count()));
    Eigen::Index k = 0;
    for (const std::size_t j : robot.driven_joints()) {
      const double low = std::isfinite(robot.joints[j].lower) ? robot.joints[j].lower : -2.5;
      const double high = std::isfinite(robot.joints[j].upper) ? robot.joints[j].upper : 2.5;
      q[k++] = uniform(low, high);
    }
    return q;
  }
  const Robot& robot;
  std::mt19937_64 random;
};

inline Task task_at(const Isometry3d& T, TaskKind kind = TaskKind::pose) {
  Task task;
  task.kind = kind;
  task.T_measurement_target = T;
  return task;
}

inline Isometry3d reached(const Robot& robot, const Joints& q) { return truing::forward_kinematics(robot, q).back(); }

inline double angle_between(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }
inline double turn_between(const Matrix3d& a, const Matrix3d& b) {
  return Eigen::Quaterniond(a).angularDistance(Eigen::Quaterniond(b));
}

inline bool within_limits(const Robot& robot, const Joints& q) {
  Eigen::Index k = 0;
  for (const std::size_t j : robot.driven_joints()) {
    if (q[k] < robot.joints[j].lower || q[k] > robot.joints[j].upper) return false;
    ++k;
  }
  return true;
}

/// What the solver claims, looked at by forward_kinematics.
inline bool holds(const Robot& robot, const Task& task, const Solution& solution, double position = 1e-6,
                  double rotation = 1e-6) {
  const Isometry3d T = reached(robot, solution.joints);
  const Isometry3d& wanted = task.T_measurement_target;
  if (!within_limits(robot, solution.joints) || (T.translation() - wanted.translation()).norm() > position)
    return false;
  if (task.kind == TaskKind::pose) return turn_between(T.linear(), wanted.linear()) <= rotation;
  if (task.kind == TaskKind::torch && task.lead.lower == 0.0 && task.lead.upper == 0.0 && task.work.lower == 0.0 &&
      task.work.upper == 0.0) {
    return angle_between(T.linear() * task.axis, wanted.linear() * task.axis) <= rotation;
  }
  return true;
}

}  // namespace inverse_arms
