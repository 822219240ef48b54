// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone: the virtual functions of kinematics_interface 1.7 (Jazzy), with their signatures. The
// overloads on std::vector exist there too, and are not virtual.

#include <memory>
#include <string>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <rclcpp/node_interfaces/node_parameters_interface.hpp>

namespace kinematics_interface {

class KinematicsInterface {
 public:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;
  using JacobianInverse = Eigen::Matrix<double, Eigen::Dynamic, 6>;

  virtual ~KinematicsInterface() = default;
  virtual bool initialize(const std::string&, std::shared_ptr<rclcpp::node_interfaces::NodeParametersInterface>,
                          const std::string&) = 0;
  virtual bool convert_cartesian_deltas_to_joint_deltas(const Eigen::VectorXd&, const Vector6&, const std::string&,
                                                        Eigen::VectorXd&) = 0;
  virtual bool convert_joint_deltas_to_cartesian_deltas(const Eigen::VectorXd&, const Eigen::VectorXd&,
                                                        const std::string&, Vector6&) = 0;
  virtual bool calculate_link_transform(const Eigen::VectorXd&, const std::string&, Eigen::Isometry3d&) = 0;
  virtual bool calculate_jacobian(const Eigen::VectorXd&, const std::string&, Jacobian&) = 0;
  virtual bool calculate_jacobian_inverse(const Eigen::VectorXd&, const std::string&, JacobianInverse&) = 0;
};

}  // namespace kinematics_interface
