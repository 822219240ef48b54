// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Arms whose links have inertias, and their torques twice over, sharing nothing with the library but
// forward_kinematics: by recursion over forces and moments, and from the energy alone.

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "support/arms.hpp"

namespace rigid {

using Eigen::Index;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using truing::Convention;
using truing::Joint;
using truing::JointType;
using truing::Robot;

inline VectorXd random_vector(Index size, double reach, std::mt19937_64* random) {
  VectorXd out(size);
  for (double& value : out) value = reach * (2.0 * static_cast<double>((*random)() >> 11) * 0x1.0p-53 - 1.0);
  return out;
}

/// Masses, centres and inertias that bodies can have, for every link: each is ten point masses.
inline void give_inertias(Robot* robot, std::mt19937_64* random) {
  for (Joint& joint : robot->joints) {
    const VectorXd masses = random_vector(10, 0.5, random).array() + 0.6;
    const MatrixXd points = random_vector(30, 0.3, random).reshaped(3, 10);
    joint.mass = masses.sum();
    joint.center_of_mass = points * masses / masses.sum();
    const MatrixXd from_centre = points.colwise() - joint.center_of_mass;
    Matrix3d second = from_centre * masses.asDiagonal() * from_centre.transpose();
    joint.inertia = second.trace() * Matrix3d::Identity() - second;
  }
}

/// Five joints of any convention, values throughout: the third is a rail, the fourth follows the second and the third;
/// ratios, offsets, a base that stands askew and gravity that does not point down.
inline Robot linked_arm(Convention convention, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto any = [&](double reach) { return random_vector(1, reach, &random)[0]; };
  Robot robot;
  robot.name = "linked";
  robot.convention = convention;
  robot.T_measurement_base = truing::frame_from_xyz_rpy({1.0, -2.0, 0.5}, {0.4, -0.3, 2.0});
  robot.gravity = random_vector(3, 9.0, &random);
  for (int k = 0; k < 5; ++k) {
    Joint joint = arms::joint("J" + std::to_string(k + 1), any(2.0), any(0.5), any(0.5), any(2.0));
    joint.beta = any(0.2);
    joint.T_parent_joint = truing::frame_from_xyz_rpy(random_vector(3, 0.5, &random), random_vector(3, 1.5, &random));
    joint.axis = random_vector(3, 1.0, &random).normalized();
    joint.ratio = 1.0 + any(0.3);
    joint.offset = any(0.5);
    robot.joints.push_back(joint);
  }
  robot.joints[2].type = JointType::prismatic;
  robot.joints[3].driven_by = {{"J2", -1.0}, {"J3", 0.7}};
  give_inertias(&robot, &random);
  return robot;
}

/// By how much each joint moves for a reading of one at each of those that have one, shape=(joints, driven).
inline MatrixXd joint_rates(const Robot& robot) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  MatrixXd out = MatrixXd::Zero(static_cast<Index>(robot.joints.size()), static_cast<Index>(driven.size()));
  for (std::size_t k = 0; k < driven.size(); ++k)
    out(static_cast<Index>(driven[k]), static_cast<Index>(k)) = robot.joints[driven[k]].ratio;
  for (const Joint& joint : robot.joints) {  // no passive joint follows another one here
    for (const auto& [driver, weight] : joint.driven_by)
      out.row(static_cast<Index>(robot.joint_index(joint.name))) +=
          weight * out.row(static_cast<Index>(robot.joint_index(driver)));
  }
  return out;
}

/// Torques at the readings, by the recursion of Luh, Walker and Paul (1980) over centres of mass, in the axes of the
/// measurement frame.
inline VectorXd newton_euler(const Robot& robot, const VectorXd& q, const VectorXd& qd, const VectorXd& qdd) {
  const auto frames = truing::forward_kinematics(robot, q);
  const MatrixXd rates = joint_rates(robot);
  const VectorXd speed = rates * qd, acceleration = rates * qdd;
  const std::size_t joints = robot.joints.size();
  std::vector<Vector3d> axis(joints), point(joints), force(joints), moment(joints);  // moment: about the frame's zero
  Isometry3d last = robot.T_measurement_base;
  Vector3d w = Vector3d::Zero(), alpha = w, a = -(last.linear() * robot.gravity);
  for (std::size_t i = 0; i < joints; ++i) {
    const Joint& joint = robot.joints[i];
    const Isometry3d& frame = frames[i];
    const double v = speed[static_cast<Index>(i)], dv = acceleration[static_cast<Index>(i)];
    const bool before = robot.convention == Convention::dh, turns = joint.type == JointType::revolute;
    axis[i] = (before ? last : frame).linear() *
              (robot.convention == Convention::urdf ? joint.axis : Vector3d(Vector3d::UnitZ()));
    point[i] = (before ? last : frame).translation();
    const Vector3d r = frame.translation() - last.translation();
    const Vector3d w_last = w, alpha_last = alpha;
    if (turns) {
      alpha += axis[i] * dv + w_last.cross(axis[i]) * v;
      w += axis[i] * v;
    }
    // The arm r turns with the link whose end it joins to the axis.
    const Vector3d& w_arm = before ? w : w_last;
    a += (before ? alpha : alpha_last).cross(r) + w_arm.cross(w_arm.cross(r));
    if (!turns) a += axis[i] * dv + 2.0 * w.cross(axis[i]) * v;
    const Vector3d c = frame.linear() * joint.center_of_mass;
    const Matrix3d I = frame.linear() * *joint.inertia * frame.linear().transpose();
    force[i] = *joint.mass * (a + alpha.cross(c) + w.cross(w.cross(c)));
    moment[i] = I * alpha + w.cross(I * w) + (frame.translation() + c).cross(force[i]);
    last = frame;
  }
  VectorXd torque(static_cast<Index>(joints));
  Vector3d f = Vector3d::Zero(), n = f;
  for (std::size_t i = joints; i-- > 0;) {
    f += force[i];
    n += moment[i];
    torque[static_cast<Index>(i)] =
        robot.joints[i].type == JointType::revolute ? axis[i].dot(n - point[i].cross(f)) : axis[i].dot(f);
  }
  return rates.transpose() * torque;
}

/// Derivative at zero, by differences of fourth order.
inline double derivative(const std::function<double(double)>& function, double step) {
  return (8.0 * (function(step) - function(-step)) - (function(2.0 * step) - function(-2.0 * step))) / (12.0 * step);
}

/// Kinetic less potential energy, from frames alone.
inline double lagrangian(const Robot& robot, const VectorXd& q, const VectorXd& qd) {
  constexpr double kStep = 1e-3;
  const auto at = [&](double h) { return truing::forward_kinematics(robot, q + h * qd); };
  const std::array<std::vector<Isometry3d>, 4> near{at(-2.0 * kStep), at(-kStep), at(kStep), at(2.0 * kStep)};
  const auto here = at(0.0);
  const Vector3d gravity = robot.T_measurement_base.linear() * robot.gravity;
  double out = 0.0;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    const Joint& joint = robot.joints[i];
    const Eigen::Matrix4d rate =
        (8.0 * (near[2][i].matrix() - near[1][i].matrix()) - (near[3][i].matrix() - near[0][i].matrix())) /
        (12.0 * kStep);
    const Vector3d v = (rate * joint.center_of_mass.homogeneous()).head<3>();
    const Matrix3d turning = here[i].linear().transpose() * rate.topLeftCorner<3, 3>();  // skew, in the link's axes
    const Vector3d w(turning(2, 1), turning(0, 2), turning(1, 0));
    out += 0.5 * *joint.mass * v.squaredNorm() + 0.5 * w.dot(*joint.inertia * w) +
           *joint.mass * gravity.dot(here[i] * joint.center_of_mass);
  }
  return out;
}

/// d/dt dL/dqd - dL/dq of every reading, good to about 1e-8 of the largest torque.
inline VectorXd lagrange(const Robot& robot, const VectorXd& q, const VectorXd& qd, const VectorXd& qdd) {
  constexpr double kTime = 3e-3, kSpeed = 1.0, kAngle = 3e-3;  // L is a square in qd: any step of it is exact
  VectorXd out(q.size());
  for (Index k = 0; k < q.size(); ++k) {
    const VectorXd unit = VectorXd::Unit(q.size(), k);
    const auto momentum = [&](double t) {
      const VectorXd at = q + t * qd + 0.5 * t * t * qdd, speed = qd + t * qdd;
      return (lagrangian(robot, at, speed + kSpeed * unit) - lagrangian(robot, at, speed - kSpeed * unit)) /
             (2.0 * kSpeed);
    };
    out[k] = derivative(momentum, kTime) -
             derivative([&](double step) { return lagrangian(robot, q + step * unit, qd); }, kAngle);
  }
  return out;
}

}  // namespace rigid
