// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// URDFs of arms, as they are drawn and as they are: what the tests and the benchmark of ros/truing_ros share.

#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <urdf_parser/urdf_parser.h>
#include <moveit/kinematics_base/kinematics_base.hpp>
#include <moveit/robot_model/robot_model.hpp>
#include <pluginlib/class_list_macros.hpp>
#include <rclcpp/logging.hpp>
#include <truing/model/urdf.hpp>

namespace ros_arms {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using truing::Robot;

/// theta [rad], d [m], a [m], alpha [rad] of a DH table, and limits [rad].
using Row = std::array<double, 6>;

inline std::string formatted(const char* format, double a, double b, double c) {
  char text[200];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

inline std::string origin(const Isometry3d& T) {
  const Vector3d p = T.translation(), rpy = truing::rpy_from_rotation(T.linear());
  return "<origin xyz=\"" + formatted("%.17g %.17g %.17g", p.x(), p.y(), p.z()) + "\" rpy=\"" +
         formatted("%.17g %.17g %.17g", rpy.x(), rpy.y(), rpy.z()) + "\"/>";
}

/// A URDF of a DH table: base_link, link_1 ..., and tool0, which is fixed to the last.
inline std::string urdf_of(const std::string& name, const std::vector<Row>& table) {
  Robot robot;
  robot.targets = {{"tool0", Isometry3d::Identity()}};
  std::string text = "<robot name=\"" + name + "\">\n<link name=\"base_link\"/>\n";
  Isometry3d T = Isometry3d::Identity();  // from where a joint turns to where the next one does
  for (std::size_t k = 0; k < table.size(); ++k) {
    const auto& [theta, d, a, alpha, lower, upper] = table[k];
    const std::string number = std::to_string(k + 1), before = k == 0 ? "base_link" : "link_" + std::to_string(k);
    // The motion adds to theta, so that theta's own part may stand before the joint.
    T = T * Eigen::AngleAxisd(theta, Vector3d::UnitZ());
    text += "<link name=\"link_" + number + "\"/>\n<joint name=\"joint_" + number +
            "\" type=\"revolute\"><parent link=\"" + before + "\"/><child link=\"link_" + number + "\"/>" + origin(T) +
            "<axis xyz=\"0 0 1\"/><limit lower=\"" +
            formatted("%.17g\" upper=\"%.17g\" effort=\"%.17g\" velocity=\"2\"/></joint>\n", lower, upper, 100.0);
    T = Eigen::Translation3d(a, 0, d) * Eigen::AngleAxisd(alpha, Vector3d::UnitX());
  }
  return text + "<link name=\"tool0\"/>\n<joint name=\"flange\" type=\"fixed\"><parent link=\"link_" +
         std::to_string(table.size()) + "\"/><child link=\"tool0\"/>" + origin(T) + "</joint>\n</robot>\n";
}

/// Universal Robots' data sheet of the UR10e: axes 2, 3, 4 are parallel.
inline std::string ur10e() {
  const double turn = 2 * M_PI;
  return urdf_of("ur10e", {{0, 0.1807, 0, M_PI / 2, -turn, turn},
                           {0, 0, -0.6127, 0, -turn, turn},
                           {0, 0, -0.57155, 0, -M_PI, M_PI},
                           {0, 0.17415, 0, M_PI / 2, -turn, turn},
                           {0, 0.11985, 0, -M_PI / 2, -turn, turn},
                           {0, 0.11655, 0, 0, -turn, turn}});
}

/// An arm of the size of an IRB 4600: axes 4, 5, 6 meet.
inline std::string wrist_arm() {
  const double degree = M_PI / 180;
  return urdf_of("wrist_arm", {{0, 0.495, 0.175, -M_PI / 2, -180 * degree, 180 * degree},
                               {-M_PI / 2, 0, 0.9, 0, -90 * degree, 150 * degree},
                               {0, 0, 0.175, -M_PI / 2, -180 * degree, 75 * degree},
                               {0, 0.96, 0, M_PI / 2, -400 * degree, 400 * degree},
                               {0, 0, 0, -M_PI / 2, -125 * degree, 120 * degree},
                               {0, 0.135, 0, 0, -400 * degree, 400 * degree}});
}

/// Seven joints: shoulder and wrist meet in a point each, a joint too many.
inline std::string redundant_arm() {
  const double far = 2.9;
  return urdf_of("redundant_arm", {{0, 0.36, 0, -M_PI / 2, -far, far},
                                   {0, 0, 0, M_PI / 2, -far, far},
                                   {0, 0.42, 0, M_PI / 2, -far, far},
                                   {0, 0, 0, -M_PI / 2, -far, far},
                                   {0, 0.4, 0, -M_PI / 2, -far, far},
                                   {0, 0, 0, M_PI / 2, -far, far},
                                   {0, 0.126, 0, 0, -far, far}});
}

/// The URDF with the origins that a calibration would have found: every joint off by about `length` [m] and `angle`
/// [rad] (standard deviations of each component).
inline std::string calibrated(const std::string& urdf_text, double length, double angle, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) -> Vector3d {
    return Vector3d(normal(random), normal(random), normal(random)) * sigma;
  };
  Robot robot = truing::robot_from_urdf(urdf_text);
  for (truing::Joint& joint : robot.joints) {
    const Vector3d turn = draw(angle);
    joint.T_parent_joint.translation() += draw(length);
    joint.T_parent_joint.rotate(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  }
  return truing::urdf_with_calibration(urdf_text, robot);
}

inline std::vector<double> random_joints(const Robot& robot, std::mt19937_64* random) {
  std::vector<double> q;
  for (const truing::Joint& joint : robot.joints) {
    if (!joint.passive()) q.push_back(std::uniform_real_distribution<double>(joint.lower, joint.upper)(*random));
  }
  return q;
}

inline Isometry3d forward(const Robot& robot, const std::vector<double>& q) {
  return truing::forward_kinematics(robot,
                                    Eigen::Map<const Eigen::VectorXd>(q.data(), static_cast<Eigen::Index>(q.size())))
      .back();
}

inline geometry_msgs::msg::Pose pose_of(const Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  return {{T.translation().x(), T.translation().y(), T.translation().z()}, {q.x(), q.y(), q.z(), q.w()}};
}

/// What MoveIt makes of a robot description: the model with the bounds of one group's joints, and the plugin for it.
struct Cell {
  explicit Cell(const std::string& urdf_text, std::vector<std::string> tips = {"tool0"})
      : node(std::make_shared<rclcpp::Node>()), tip_frames(std::move(tips)) {
    model.urdf = urdf::parseURDF(urdf_text);
    if (!model.urdf) throw std::runtime_error("not a URDF");
    for (const auto& [name, joint] : model.urdf->joints_) {
      if (joint->type == urdf::Joint::FIXED) continue;
      const bool bounded = joint->type != urdf::Joint::CONTINUOUS;
      moveit::core::VariableBounds bounds{-M_PI, M_PI, bounded};
      if (bounded) bounds = {joint->limits->lower, joint->limits->upper, true};
      model.groups["arm"].joints[name].bounds = {bounds};
    }
  }

  bool start(const std::string& group = "arm") {
    plugin = make_plugin<kinematics::KinematicsBase>();
    return plugin->initialize(node, model, group, "base_link", tip_frames, 0.1);
  }

  void give(const std::string& parameter, rclcpp::Parameter::Value value) {
    node->given["robot_description_kinematics.arm." + parameter] = std::move(value);
  }

  rclcpp::Node::SharedPtr node;
  moveit::core::RobotModel model;
  std::vector<std::string> tip_frames;
  std::unique_ptr<kinematics::KinematicsBase> plugin;
};

}  // namespace ros_arms
