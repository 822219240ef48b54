// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>

#include "support/contains.hpp"
#include "truing/model/robot.hpp"

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix4d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using truing::Convention;
using truing::Joint;
using truing::JointType;
using truing::Robot;

constexpr double pi = 3.14159265358979323846;

Joint revolute(const std::string& name, double theta, double d, double a, double alpha, double beta = 0.0) {
  Joint joint;
  joint.name = name;
  joint.theta = theta;
  joint.d = d;
  joint.a = a;
  joint.alpha = alpha;
  joint.beta = beta;
  return joint;
}

/// An arm with nothing special about it: oblique twists, a rail, betas.
Robot oblique_arm() {
  Robot robot;
  robot.joints = {revolute("J1", 0.1, 0.4, 0.2, -1.4, 0.02), revolute("J2", -0.3, 0.05, 0.7, 0.1, -0.03),
                  revolute("J3", 0.7, 0.1, 0.1, 1.5), revolute("J4", 0.2, 0.6, 0.0, -1.2, 0.05)};
  robot.joints[2].type = JointType::prismatic;
  robot.targets = {{"tool", truing::frame_from_xyz_rpy({0.1, -0.2, 0.3}, {0.4, 0.5, -0.6})}};
  return robot;
}

/// A palletizer: axes 2, 3 and the passive 4 are parallel and horizontal, axis 5 is vertical.
Robot palletizing_arm() {
  Robot robot;
  robot.joints = {revolute("J1", 0.0, 0.7, 0.26, -pi / 2), revolute("J2", 0.0, 0.0, 0.9, 0.0),
                  revolute("J3", 0.0, 0.0, 1.0, 0.0), revolute("J4", 0.0, 0.0, 0.2, pi / 2),
                  revolute("J5", 0.0, -0.3, 0.0, 0.0)};
  robot.joints[3].driven_by = {{"J2", -1.0}, {"J3", -1.0}};
  robot.targets = {{"tool", Isometry3d::Identity()}};
  return robot;
}

// Elementary transforms written out, so that the test shares nothing with the library.
Matrix4d rot_x(double t) {
  Matrix4d T;
  T << 1, 0, 0, 0, 0, std::cos(t), -std::sin(t), 0, 0, std::sin(t), std::cos(t), 0, 0, 0, 0, 1;
  return T;
}
Matrix4d rot_y(double t) {
  Matrix4d T;
  T << std::cos(t), 0, std::sin(t), 0, 0, 1, 0, 0, -std::sin(t), 0, std::cos(t), 0, 0, 0, 0, 1;
  return T;
}
Matrix4d rot_z(double t) {
  Matrix4d T;
  T << std::cos(t), -std::sin(t), 0, 0, std::sin(t), std::cos(t), 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  return T;
}
Matrix4d trans(double x, double y, double z) {
  Matrix4d T = Matrix4d::Identity();
  T.col(3).head<3>() << x, y, z;
  return T;
}

double difference(const Isometry3d& a, const Isometry3d& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }
double difference(const Isometry3d& a, const Matrix4d& b) { return (a.matrix() - b).cwiseAbs().maxCoeff(); }

/// What validate says, "" when it says nothing.
std::string complaint(const Robot& robot) {
  try {
    truing::validate(robot);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("DH frames are Rz Tz Tx Rx Ry, one joint after the other") {
  Robot robot = oblique_arm();
  robot.T_measurement_base = truing::frame_from_xyz_rpy({1.0, 2.0, 3.0}, {0.1, 0.2, 0.3});
  const VectorXd q = (VectorXd(4) << 0.3, -0.8, 0.15, 1.1).finished();
  const auto frames = truing::forward_kinematics(robot, q);
  REQUIRE(frames.size() == 5);
  Matrix4d T = trans(1, 2, 3) * rot_z(0.3) * rot_y(0.2) * rot_x(0.1);
  for (std::size_t i = 0; i < 4; ++i) {
    const Joint& joint = robot.joints[i];
    const double motion = q[static_cast<Eigen::Index>(i)];
    const bool turns = joint.type == JointType::revolute;
    T = T * rot_z(joint.theta + (turns ? motion : 0.0)) * trans(0, 0, joint.d + (turns ? 0.0 : motion)) *
        trans(joint.a, 0, 0) * rot_x(joint.alpha) * rot_y(joint.beta);
    CHECK(difference(frames[i], T) < 1e-14);
  }
  T = T * trans(0.1, -0.2, 0.3) * rot_z(-0.6) * rot_y(0.5) * rot_x(0.4);
  CHECK(difference(frames[4], T) < 1e-14);
}

TEST_CASE("the same arm in DH and in modified DH has the same tool") {
  const Robot distal = oblique_arm();
  Robot proximal = distal;
  proximal.convention = Convention::mdh;
  // Modified DH puts a link's a, alpha, beta before the next joint; what is left after the last joint goes to
  // the tool.
  proximal.joints[0].a = proximal.joints[0].alpha = proximal.joints[0].beta = 0.0;
  for (std::size_t i = 1; i < 4; ++i) {
    proximal.joints[i].a = distal.joints[i - 1].a;
    proximal.joints[i].alpha = distal.joints[i - 1].alpha;
    proximal.joints[i].beta = distal.joints[i - 1].beta;
  }
  const Joint& last = distal.joints[3];
  proximal.targets[0].T_last_target =
      Isometry3d(trans(last.a, 0, 0) * rot_x(last.alpha) * rot_y(last.beta)) * distal.targets[0].T_last_target;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  for (int k = 0; k < 20; ++k) {
    const VectorXd q = VectorXd::NullaryExpr(4, [&] { return angle(random); });
    const Isometry3d T_distal = truing::forward_kinematics(distal, q).back();
    const Isometry3d T_proximal = truing::forward_kinematics(proximal, q).back();
    CHECK(difference(T_distal, T_proximal) < 1e-13);
  }
}

TEST_CASE("a URDF joint moves about its axis, after its origin") {
  Robot robot;
  robot.convention = Convention::urdf;
  robot.joints.resize(2);
  robot.joints[0].name = "turn";
  robot.joints[0].T_parent_joint = truing::frame_from_xyz_rpy({0.1, 0.2, 0.3}, {0.3, 0.2, 0.1});
  robot.joints[0].axis = -Vector3d::UnitY();
  robot.joints[1].name = "slide";
  robot.joints[1].type = JointType::prismatic;
  robot.joints[1].axis = Vector3d(1, 2, 2) / 3.0;
  robot.targets = {{"tool", Isometry3d(trans(0, 0, 0.1))}};
  const VectorXd q = (VectorXd(2) << 0.7, 0.3).finished();
  const Matrix4d expected = trans(0.1, 0.2, 0.3) * rot_z(0.1) * rot_y(0.2) * rot_x(0.3) * rot_y(-0.7) *
                            trans(0.1, 0.2, 0.2) * trans(0, 0, 0.1);
  CHECK(difference(truing::forward_kinematics(robot, q).back(), expected) < 1e-15);
}

TEST_CASE("a joint moves by ratio * reading + offset") {
  Robot robot = oblique_arm();
  const VectorXd q = (VectorXd(4) << 0.3, -0.8, 0.15, 1.1).finished();
  VectorXd moved = q;
  for (Eigen::Index i = 0; i < 4; ++i) moved[i] = (1.0 + 0.01 * double(i)) * q[i] + 0.02;
  const Isometry3d expected = truing::forward_kinematics(robot, moved).back();
  for (std::size_t i = 0; i < 4; ++i) {
    robot.joints[i].ratio = 1.0 + 0.01 * double(i);
    robot.joints[i].offset = 0.02;
  }
  CHECK(difference(truing::forward_kinematics(robot, q).back(), expected) < 1e-15);
}

TEST_CASE("a palletizer's q4 = -(q2 + q3) keeps the tool level, whatever the joints' own errors") {
  Robot robot = palletizing_arm();
  CHECK(robot.driven_count() == 4);
  CHECK(robot.driven_joints() == std::vector<std::size_t>{0, 1, 2, 4});
  const VectorXd home = (VectorXd(4) << 0.4, 0.0, 0.0, -0.3).finished();
  const Eigen::Matrix3d level = truing::forward_kinematics(robot, home).back().linear();
  CHECK(std::abs(std::abs(level(2, 2)) - 1.0) < 1e-15);
  robot.joints[1].ratio = 1.01;  // corrected motions are what the linkage passes on
  robot.joints[2].offset = 0.03;
  for (const double q2 : {-0.9, 0.2, 1.0}) {
    for (const double q3 : {-0.5, 0.8}) {
      const VectorXd q = (VectorXd(4) << 0.4, q2, q3, -0.3).finished();
      const Isometry3d T = truing::forward_kinematics(robot, q).back();
      CHECK((T.linear() - level).cwiseAbs().maxCoeff() < 1e-14);
    }
  }
}

TEST_CASE("a passive joint adds its own offset, ignores its ratio, and may drive another passive joint") {
  Robot robot = oblique_arm();
  for (Joint& joint : robot.joints) joint.type = JointType::revolute;
  robot.joints[1].driven_by = {{"J3", 0.5}};  // J3 is passive itself, and comes later in the chain
  robot.joints[1].offset = 0.01;
  robot.joints[1].ratio = 7.0;
  robot.joints[2].driven_by = {{"J1", -2.0}, {"J4", 1.0}};
  robot.joints[2].offset = 0.2;
  CHECK(complaint(robot) == "");
  Robot open = robot;
  open.joints[1] = oblique_arm().joints[1];
  open.joints[2] = oblique_arm().joints[2];
  open.joints[2].type = JointType::revolute;
  const double q1 = 0.3, q4 = -0.7, q3 = -2.0 * q1 + q4 + 0.2, q2 = 0.5 * q3 + 0.01;
  const Isometry3d coupled = truing::forward_kinematics(robot, (VectorXd(2) << q1, q4).finished()).back();
  const Isometry3d by_hand = truing::forward_kinematics(open, (VectorXd(4) << q1, q2, q3, q4).finished()).back();
  CHECK(difference(coupled, by_hand) < 1e-15);
}

TEST_CASE("every target has its own frame; without targets the last frame is the tool") {
  Robot robot = oblique_arm();
  robot.targets.push_back({"smr2", Isometry3d(trans(0, 0.05, 0.12))});
  const VectorXd q = VectorXd::Constant(4, 0.2);
  const auto frames = truing::forward_kinematics(robot, q, 1);
  CHECK(difference(frames[4], Matrix4d(frames[3].matrix() * trans(0, 0.05, 0.12))) < 1e-15);
  CHECK_THROWS_AS(truing::forward_kinematics(robot, q, 2), std::invalid_argument);
  robot.targets.clear();
  CHECK(complaint(robot) == "");
  const auto bare = truing::forward_kinematics(robot, q);
  CHECK(difference(bare[4], bare[3]) == 0.0);
}

TEST_CASE("forward kinematics says how many readings it expects") {
  CHECK_THROWS_WITH_AS(truing::forward_kinematics(palletizing_arm(), VectorXd::Zero(5)),
                       "got 5 joint readings, the robot has 4 driven joints", std::invalid_argument);
}

TEST_CASE("roll, pitch and yaw give the rotation back, at and near the poles too") {
  const Eigen::Matrix3d by_hand = (rot_z(0.3) * rot_y(-0.4) * rot_x(1.2)).topLeftCorner<3, 3>();
  CHECK((truing::rotation_from_rpy({1.2, -0.4, 0.3}) - by_hand).cwiseAbs().maxCoeff() < 1e-15);
  for (const double from_pole : {0.0, 1e-14, 1e-11, 1e-8, 1e-5, 0.1, 1.0}) {
    for (const double sign : {-1.0, 1.0}) {
      const Eigen::Matrix3d R = truing::rotation_from_rpy({0.7, sign * (pi / 2 - from_pole), -2.1});
      const Vector3d rpy = truing::rpy_from_rotation(R);
      CAPTURE(from_pole);
      CHECK((truing::rotation_from_rpy(rpy) - R).cwiseAbs().maxCoeff() < 2e-15);
      if (from_pole == 0.0) CHECK(rpy.x() == 0.0);
    }
  }
}

TEST_CASE("validate accepts a robot that can be used") {
  CHECK(complaint(oblique_arm()) == "");
  CHECK(complaint(palletizing_arm()) == "");
}

TEST_CASE("validate refuses what no machine has: angles of 1e50, thousands of joints") {
  Robot robot = palletizing_arm();
  robot.joints[1].theta = 1e50;
  CHECK(contains(complaint(robot), "theta is 1e+50"));
  robot = palletizing_arm();
  robot.joints[0].d = -2e6;
  CHECK(contains(complaint(robot), "d is -2e+06"));
  robot = palletizing_arm();
  robot.targets = {{"tool", Isometry3d(Eigen::Translation3d(0.0, 1e7, 0.0))}};
  CHECK(contains(complaint(robot), "T_last_target is farther than 1e6 m"));
  robot = palletizing_arm();
  robot.joints.assign(3000, Joint());
  for (std::size_t k = 0; k < robot.joints.size(); ++k) robot.joints[k].name = "K" + std::to_string(k);
  CHECK(contains(complaint(robot), "has 3000 joints, expected at most 200"));
}

TEST_CASE("validate refuses ranges that are none, and of what is no input") {
  Robot robot = oblique_arm();
  robot.fitted_range = {{"q1", {-1.0, 1.0}}, {"qd1", {-2.0, 2.0}}, {"payload", {0.0, 0.0}}, {"temp", {18.0, 25.0}}};
  robot.fitted_range["frequency"] = {0.0, 8.0};
  CHECK(complaint(robot) == "");
  robot.fitted_range["q1"] = {1.0, -1.0};
  CHECK(contains(complaint(robot), "fitted_range of 'q1'"));
  robot.fitted_range["q1"] = {0.0, std::numeric_limits<double>::infinity()};
  CHECK(contains(complaint(robot), "fitted_range of 'q1'"));
  robot.fitted_range = {{"frequency", {0.0, 0.0}}};
  CHECK(contains(complaint(robot), "fitted_range of 'frequency' ends at 0"));
  robot.fitted_range = {{"q99", {0.0, 1.0}}};
  CHECK(contains(complaint(robot), "fitted_range has 'q99'"));
  robot.fitted_range = {{"qd99", {0.0, 1.0}}};
  CHECK(contains(complaint(robot), "fitted_range has 'qd99'"));
}

TEST_CASE("validate names the joint and what is wrong with it") {
  Robot robot = palletizing_arm();
  SUBCASE("no joints") {
    robot.joints.clear();
    CHECK(contains(complaint(robot), "no joints"));
  }
  SUBCASE("names twice, empty, or taken by parameters") {
    robot.joints[2].name = "J2";
    CHECK(contains(complaint(robot), "'J2': this name is used twice"));
    robot.joints[2].name = "";
    CHECK(contains(complaint(robot), "joint 3: has no name"));
    robot.joints[2].name = "base";
    CHECK(contains(complaint(robot), "'base'"));
  }
  SUBCASE("a target named like a joint") {
    robot.targets.push_back({"J1", Isometry3d::Identity()});
    CHECK(contains(complaint(robot), "target 'J1'"));
  }
  SUBCASE("an unknown driver") {
    robot.joints[3].driven_by = {{"J9", 1.0}};
    CHECK(contains(complaint(robot), "joint 'J4': driven_by names 'J9', but the joints are J1, J2, J3, J4, J5"));
    CHECK_THROWS_AS(truing::forward_kinematics(robot, VectorXd::Zero(4)), std::invalid_argument);
  }
  SUBCASE("drivers in a circle") {
    robot.joints[1].driven_by = {{"J4", 1.0}};
    CHECK(contains(complaint(robot), "circle (J2, J4, J2)"));
    CHECK_THROWS_AS(truing::forward_kinematics(robot, VectorXd::Zero(3)), std::invalid_argument);
    robot.joints[1].driven_by = {{"J2", 1.0}};
    CHECK(contains(complaint(robot), "circle (J2, J2)"));
  }
  SUBCASE("values that are not finite") {
    robot.joints[1].a = std::numeric_limits<double>::quiet_NaN();
    CHECK(contains(complaint(robot), "joint 'J2': a is nan"));
    robot = palletizing_arm();
    robot.targets[0].T_last_target.translation().x() = std::numeric_limits<double>::infinity();
    CHECK(contains(complaint(robot), "target 'tool'"));
    robot = palletizing_arm();
    robot.gravity.x() = std::numeric_limits<double>::quiet_NaN();
    CHECK(contains(complaint(robot), "gravity"));
  }
  SUBCASE("a frame that is not rigid") {
    robot.T_measurement_base.linear() *= 1.1;
    CHECK(contains(complaint(robot), "T_measurement_base is not a rigid transform"));
  }
  SUBCASE("an axis that is not of unit length") {
    robot.convention = Convention::urdf;
    robot.joints[0].axis = Vector3d(1, 1, 0);
    CHECK(contains(complaint(robot), "joint 'J1': axis has length 1.41421356237"));
  }
  SUBCASE("limits the wrong way round") {
    robot.joints[4].lower = 1.0;
    robot.joints[4].upper = -1.0;
    CHECK(contains(complaint(robot), "joint 'J5': lower limit 1 is above upper limit -1"));
  }
  SUBCASE("a negative mass") {
    robot.joints[0].mass = -1.0;
    CHECK(contains(complaint(robot), "joint 'J1': mass is -1 kg"));
  }
  SUBCASE("an effect at a joint that is not there") {
    robot.effects = {{"backlash", {"J7"}, {}}};
    CHECK(contains(complaint(robot), "effect 'backlash': joint 'J7' does not exist"));
  }
}

TEST_CASE("validate refuses what no drive and no link has, and takes inertias as they are published") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  Robot robot = palletizing_arm();
  truing::Joint& joint = robot.joints[1];
  joint.inertia = Vector3d(-1.0, 5.0, 0.1).asDiagonal();  // of no body
  joint.mass = 0.0;
  joint.torque_per_ampere = -3.0;
  joint.rotor_inertia = 0.2;
  joint.speed_limit = inf;
  joint.torque_limit = 10.0;
  robot.torque_effects = {{"coulomb", {"J2"}, {{"coulomb.J2", 1.0}}}, {"payload", {}, {{"payload.m", 2.0}}}};
  CHECK(complaint(robot) == "");
  SUBCASE("inertia") {
    (*joint.inertia)(0, 1) = 1e-6;
    CHECK(complaint(robot) == "joint 'J2': inertia is not symmetric");
    (*joint.inertia)(1, 0) = 1e-6;
    CHECK(complaint(robot) == "");
    (*joint.inertia)(2, 2) = nan;
    CHECK(contains(complaint(robot), "joint 'J2': inertia has a value that is not finite"));
  }
  SUBCASE("rotor") {
    for (const double value : {-1e-9, nan, inf}) {
      joint.rotor_inertia = value;
      CHECK(contains(complaint(robot), "joint 'J2': rotor_inertia is"));
    }
  }
  SUBCASE("drive") {
    for (const double value : {0.0, nan, inf}) {
      joint.torque_per_ampere = value;
      CHECK(contains(complaint(robot), "joint 'J2': torque_per_ampere is"));
    }
  }
  SUBCASE("limits") {
    for (const double value : {0.0, -1.0, nan}) {
      joint.torque_limit = value;
      CHECK(contains(complaint(robot), "joint 'J2': torque_limit is"));
      joint.speed_limit = value;
      CHECK(contains(complaint(robot), "joint 'J2': speed_limit is"));
      joint.speed_limit = 1.0;
    }
  }
  SUBCASE("torque effects") {
    robot.torque_effects[1].parameters["payload.m"] = nan;
    CHECK(contains(complaint(robot), "torque effect 'payload': payload.m is nan"));
    robot.torque_effects = {{"", {}, {}}};
    CHECK(contains(complaint(robot), "torque_effects: one has no name"));
  }
}

TEST_CASE("an unknown joint name is answered with the names there are") {
  CHECK(palletizing_arm().joint_index("J3") == 2);
  CHECK_THROWS_WITH_AS(palletizing_arm().joint_index("j3"),
                       "joint 'j3' does not exist; the joints are J1, J2, J3, J4, J5", std::invalid_argument);
}
