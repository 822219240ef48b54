// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone: the virtual functions of MoveIt 2.12 (Jazzy) that a kinematics plugin overrides, with their
// signatures, and the little of the base class that ros/truing_ros uses. docs.ros.org has the real one.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <geometry_msgs/msg/pose.hpp>
#include <moveit_msgs/msg/move_it_error_codes.hpp>
#include <rclcpp/node.hpp>

namespace moveit::core {
class RobotModel;
}

namespace kinematics {

namespace DiscretizationMethods {
enum DiscretizationMethod { NO_DISCRETIZATION = 1, ALL_DISCRETIZED };
}
using DiscretizationMethod = DiscretizationMethods::DiscretizationMethod;

namespace KinematicErrors {
enum KinematicError {
  OK = 1,
  UNSUPORTED_DISCRETIZATION_REQUESTED,  // spelt so there
  DISCRETIZATION_NOT_INITIALIZED,
  MULTIPLE_TIPS_NOT_SUPPORTED,
  EMPTY_TIP_POSES,
  IK_SEED_OUTSIDE_LIMITS,
  SOLVER_NOT_ACTIVE,
  NO_SOLUTION
};
}
using KinematicError = KinematicErrors::KinematicError;

struct KinematicsQueryOptions {
  bool lock_redundant_joints = false;
  bool return_approximate_solution = false;
  DiscretizationMethod discretization_method = DiscretizationMethods::NO_DISCRETIZATION;
};

struct KinematicsResult {
  KinematicError kinematic_error = KinematicErrors::NO_SOLUTION;
  double solution_percentage = 0.0;
};

class KinematicsBase {
 public:
  using Poses = std::vector<geometry_msgs::msg::Pose>;
  using IKCallbackFn = std::function<void(const geometry_msgs::msg::Pose&, const std::vector<double>&,
                                          moveit_msgs::msg::MoveItErrorCodes&)>;

  virtual ~KinematicsBase() = default;

  virtual bool getPositionIK(const geometry_msgs::msg::Pose&, const std::vector<double>&, std::vector<double>&,
                             moveit_msgs::msg::MoveItErrorCodes&,
                             const KinematicsQueryOptions& = KinematicsQueryOptions()) const = 0;
  virtual bool getPositionIK(const Poses&, const std::vector<double>&, std::vector<std::vector<double>>&,
                             KinematicsResult&, const KinematicsQueryOptions&) const {
    return false;
  }
  virtual bool searchPositionIK(const geometry_msgs::msg::Pose&, const std::vector<double>&, double,
                                std::vector<double>&, moveit_msgs::msg::MoveItErrorCodes&,
                                const KinematicsQueryOptions& = KinematicsQueryOptions()) const = 0;
  virtual bool searchPositionIK(const geometry_msgs::msg::Pose&, const std::vector<double>&, double,
                                const std::vector<double>&, std::vector<double>&, moveit_msgs::msg::MoveItErrorCodes&,
                                const KinematicsQueryOptions& = KinematicsQueryOptions()) const = 0;
  virtual bool searchPositionIK(const geometry_msgs::msg::Pose&, const std::vector<double>&, double,
                                std::vector<double>&, const IKCallbackFn&, moveit_msgs::msg::MoveItErrorCodes&,
                                const KinematicsQueryOptions& = KinematicsQueryOptions()) const = 0;
  virtual bool searchPositionIK(const geometry_msgs::msg::Pose&, const std::vector<double>&, double,
                                const std::vector<double>&, std::vector<double>&, const IKCallbackFn&,
                                moveit_msgs::msg::MoveItErrorCodes&,
                                const KinematicsQueryOptions& = KinematicsQueryOptions()) const = 0;
  virtual bool getPositionFK(const std::vector<std::string>&, const std::vector<double>&, Poses&) const = 0;
  virtual bool initialize(const rclcpp::Node::SharedPtr&, const moveit::core::RobotModel&, const std::string&,
                          const std::string&, const std::vector<std::string>&, double) {
    return false;
  }
  virtual const std::vector<std::string>& getJointNames() const = 0;
  virtual const std::vector<std::string>& getLinkNames() const = 0;

 protected:
  void storeValues(const moveit::core::RobotModel&, const std::string& group_name, const std::string& base_frame,
                   const std::vector<std::string>& tip_frames, double) {
    group_name_ = group_name;
    base_frame_ = base_frame;
    tip_frames_ = tip_frames;
  }

  rclcpp::Node::SharedPtr node_;
  std::string group_name_, base_frame_;
  std::vector<std::string> tip_frames_;
};

}  // namespace kinematics
