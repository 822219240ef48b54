// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>

#include "support/contains.hpp"
#include "truing/dynamics/rigid.hpp"

namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using truing::Joint;
using truing::Robot;

constexpr double g = 9.81;

/// A rod of 1 m that turns in the vertical plane, q from the horizontal, and a second one at its end.
Joint rod(const std::string& name) {
  Joint joint;
  joint.name = name;
  joint.a = 1.0;
  joint.mass = 2.0;
  joint.center_of_mass = Vector3d(-0.5, 0.0, 0.0);  // from the frame after the link
  joint.inertia = Vector3d(0.0, 2.0 / 12.0, 2.0 / 12.0).asDiagonal();
  return joint;
}

Robot pendulum() {
  Robot robot;
  robot.gravity = Vector3d(0.0, -g, 0.0);
  robot.joints = {rod("J1")};
  return robot;
}

MatrixXd one(double value) { return MatrixXd::Constant(1, 1, value); }

std::string complaint(const Robot& robot, const MatrixXd& q, const MatrixXd& qd, const MatrixXd& qdd) {
  try {
    truing::dynamics::rigid_torques(robot, q, qd, qdd);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a rod's torque is its weight, its inertia about the joint and its rotor's") {
  Robot robot = pendulum();
  robot.joints[0].rotor_inertia = 0.3;
  for (const double q : {0.0, 0.7, -2.0}) {
    const double expected = 2.0 * g * 0.5 * std::cos(q) + (2.0 / 3.0 + 0.3) * 1.7;
    CHECK(std::abs(truing::dynamics::rigid_torques(robot, one(q), one(5.0), one(1.7))(0, 0) - expected) < 1e-13);
  }
}

TEST_CASE("a passive joint's link and rotor are felt by the joint that drives it, w and w^2 times") {
  Robot robot = pendulum();
  robot.joints[0].mass.reset();
  robot.joints[0].inertia.reset();
  robot.joints[0].a = 0.0;
  robot.joints.push_back(rod("J2"));
  robot.joints[1].driven_by = {{"J1", 2.0}};  // the rod turns by 3 q
  robot.joints[1].rotor_inertia = 0.1;
  const double q = 0.4, qdd = -0.8;
  const double expected = 3.0 * (2.0 * g * 0.5 * std::cos(3.0 * q) + 2.0 / 3.0 * 3.0 * qdd) + 4.0 * 0.1 * qdd;
  CHECK(std::abs(truing::dynamics::rigid_torques(robot, one(q), one(1.0), one(qdd))(0, 0) - expected) < 1e-13);
}

TEST_CASE("a rail is held against gravity") {
  Robot robot = pendulum();
  robot.joints[0].type = truing::JointType::prismatic;  // along z
  robot.gravity = Vector3d(0.0, 0.0, -g);
  robot.joints[0].rotor_inertia = 1.5;
  CHECK(std::abs(truing::dynamics::rigid_torques(robot, one(0.2), one(1.0), one(3.0))(0, 0) - (2.0 * g + 3.5 * 3.0)) <
        1e-13);
}

TEST_CASE("torques of tables of another shape, or of values that are none, are refused") {
  const MatrixXd q = MatrixXd::Zero(4, 1);
  CHECK(contains(complaint(pendulum(), MatrixXd::Zero(4, 2), q, q), "q has shape (4, 2), expected (4, 1)"));
  CHECK(contains(complaint(pendulum(), q, MatrixXd::Zero(3, 1), q), "qd has shape (3, 1), expected (4, 1)"));
  CHECK(contains(complaint(pendulum(), q, q, MatrixXd::Zero(1, 4)), "qdd has shape (1, 4), expected (4, 1)"));
  MatrixXd wrong = q;
  wrong(2, 0) = std::nan("");
  CHECK(contains(complaint(pendulum(), q, wrong, q), "qd, row 3, joint 1: nan, expected a finite number"));
  Robot robot = pendulum();
  robot.joints[0].mass = -1.0;
  CHECK(contains(complaint(robot, q, q, q), "mass is -1 kg"));
  CHECK(truing::dynamics::rigid_torques(pendulum(), MatrixXd::Zero(0, 1), MatrixXd::Zero(0, 1), MatrixXd::Zero(0, 1))
            .rows() == 0);
}
