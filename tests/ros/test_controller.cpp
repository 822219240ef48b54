// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <doctest/doctest.h>

#include <kinematics_interface/kinematics_interface.hpp>

#include "arms.hpp"

using namespace ros_arms;
using kinematics_interface::KinematicsInterface;

namespace {

using Parameters = rclcpp::node_interfaces::NodeParametersInterface;
using Vector6 = KinematicsInterface::Vector6;

std::unique_ptr<KinematicsInterface> started(const std::string& urdf_text) {
  auto parameters = std::make_shared<Parameters>();
  parameters->values = {{"kinematics.tip", std::string("tool0")}, {"kinematics.base", std::string("base_link")}};
  auto plugin = make_plugin<KinematicsInterface>();
  REQUIRE(plugin->initialize(urdf_text, parameters, "kinematics"));
  return plugin;
}

Vector6 difference(const Isometry3d& from, const Isometry3d& to) {
  const Eigen::AngleAxisd turn(to.linear() * from.linear().transpose());
  Vector6 d;
  d << to.translation() - from.translation(), turn.angle() * turn.axis();
  return d;
}

const Eigen::VectorXd kJoints = (Eigen::VectorXd(6) << 0.3, -1.2, 1.4, -0.7, 1.1, 0.4).finished();

}  // namespace

TEST_CASE("transform and Jacobian of every link are those of the calibrated description") {
  const std::string text = calibrated(ur10e(), 1e-3, 3e-3, 1);
  const auto plugin = started(text);
  for (const std::string link : {"base_link", "link_1", "link_3", "link_6", "tool0"}) {
    CAPTURE(link);
    Isometry3d T;
    REQUIRE(plugin->calculate_link_transform(kJoints, link, T));
    if (link == "tool0") {
      const Isometry3d expected = truing::forward_kinematics(truing::robot_from_urdf(text), kJoints).back();
      CHECK(T.isApprox(expected, 1e-13));
    }
    KinematicsInterface::Jacobian J;
    REQUIRE(plugin->calculate_jacobian(kJoints, link, J));
    REQUIRE(J.cols() == 6);
    constexpr double step = 1e-6;  // [rad] central differences: errors of the order of 1e-10
    for (Eigen::Index k = 0; k < 6; ++k) {
      Isometry3d before, after;
      Eigen::VectorXd q = kJoints;
      q[k] = kJoints[k] - step;
      REQUIRE(plugin->calculate_link_transform(q, link, before));
      q[k] = kJoints[k] + step;
      REQUIRE(plugin->calculate_link_transform(q, link, after));
      CHECK((difference(before, after) / (2 * step) - J.col(k)).norm() < 1e-8);
    }
  }
}

TEST_CASE("steps in space and of the joints are each other's inverse, and finite where the arm is singular") {
  const auto plugin = started(calibrated(ur10e(), 1e-3, 3e-3, 1));
  const Vector6 wanted = (Vector6() << 1e-3, -2e-3, 5e-4, 1e-3, 2e-3, -1e-3).finished();
  Eigen::VectorXd step;
  Vector6 back;
  REQUIRE(plugin->convert_cartesian_deltas_to_joint_deltas(kJoints, wanted, "tool0", step));
  REQUIRE(plugin->convert_joint_deltas_to_cartesian_deltas(kJoints, step, "tool0", back));
  CHECK((back - wanted).norm() < 1e-3 * wanted.norm());  // but for the damping
  KinematicsInterface::Jacobian J;
  KinematicsInterface::JacobianInverse inverse;
  REQUIRE(plugin->calculate_jacobian(kJoints, "tool0", J));
  REQUIRE(plugin->calculate_jacobian_inverse(kJoints, "tool0", inverse));
  CHECK((J * inverse - Eigen::Matrix<double, 6, 6>::Identity()).norm() < 1e-2);

  REQUIRE(plugin->convert_cartesian_deltas_to_joint_deltas(Eigen::VectorXd::Zero(6), wanted, "tool0", step));
  CHECK(step.allFinite());
  CHECK(step.norm() < 5.0);
}

TEST_CASE("what a controller asks wrongly ends with false and a sentence in the log") {
  auto parameters = std::make_shared<Parameters>();
  auto plugin = make_plugin<KinematicsInterface>();
  Isometry3d T;
  CHECK_FALSE(plugin->calculate_link_transform(kJoints, "tool0", T));
  CHECK(rclcpp::last_error() == "the plugin was not initialised");
  CHECK_FALSE(plugin->initialize(ur10e(), parameters, "kinematics"));
  CHECK(rclcpp::last_error() == "parameter 'kinematics.tip' is missing: the last link");
  CHECK_FALSE(plugin->initialize("", parameters, "kinematics"));
  parameters->values["robot_description"] = ur10e();
  parameters->values["tip"] = std::string("tool0");
  CHECK(plugin->initialize("", parameters, ""));
  CHECK_FALSE(plugin->calculate_link_transform(Eigen::VectorXd::Zero(5), "tool0", T));
  CHECK(rclcpp::last_error() == "found 5 joints, expected 6");
  CHECK_FALSE(plugin->calculate_link_transform(kJoints, "thumb", T));
}
