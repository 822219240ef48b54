// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// MoveIt's kinematics plugin on truing's inverse kinematics. The robot is the one of the robot description: give MoveIt
// a calibrated URDF, whose axes neither meet nor are parallel any more, and it is solved as the nominal one was.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <geometry_msgs/msg/pose.hpp>
#include <moveit/kinematics_base/kinematics_base.hpp>
#include <moveit/robot_model/robot_model.hpp>
#include <moveit_msgs/msg/move_it_error_codes.hpp>
#include <pluginlib/class_list_macros.hpp>
#include <rclcpp/logging.hpp>
#include <rclcpp/node.hpp>

#include "chain.hpp"

namespace truing_ros {
namespace {

using Clock = std::chrono::steady_clock;
using geometry_msgs::msg::Pose;
using moveit_msgs::msg::MoveItErrorCodes;

constexpr double kLeastQuaternion = 1e-6;  // [-] a shorter quaternion has no direction: the message was not filled in
constexpr std::uint64_t kSeed = 1;         // of further attempts: the same question has the same answer

rclcpp::Logger logger() { return rclcpp::get_logger("truing_ros.moveit_kinematics"); }

Eigen::Isometry3d frame_of(const Pose& pose) {
  const Eigen::Quaterniond q(pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z);
  if (!(q.norm() > kLeastQuaternion)) throw std::invalid_argument("the wanted orientation is a quaternion of zeros");
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = q.normalized().toRotationMatrix();
  T.translation() = Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z);
  return T;
}

Pose pose_of(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  Pose pose;
  pose.position.x = T.translation().x();
  pose.position.y = T.translation().y();
  pose.position.z = T.translation().z();
  pose.orientation.w = q.w();
  pose.orientation.x = q.x();
  pose.orientation.y = q.y();
  pose.orientation.z = q.z();
  return pose;
}

template <class Value>
Value parameter(rclcpp::Node& node, const std::string& name, Value value) {
  if (!node.has_parameter(name)) return node.declare_parameter<Value>(name, value);
  node.get_parameter(name, value);
  return value;
}

truing::Choose choose_named(const std::string& name) {
  if (name == "nearest") return truing::Choose::nearest;
  if (name == "limits_margin") return truing::Choose::limits_margin;
  if (name == "manipulability") return truing::Choose::manipulability;
  if (name == "rail_travel") return truing::Choose::rail_travel;
  throw std::invalid_argument("choose: found '" + name +
                              "', expected nearest, limits_margin, manipulability or rail_travel");
}

Eigen::Vector3d axis_named(const std::string& name) {
  if (name == "x") return Eigen::Vector3d::UnitX();
  if (name == "y") return Eigen::Vector3d::UnitY();
  if (name == "z") return Eigen::Vector3d::UnitZ();
  throw std::invalid_argument("free_axis: found '" + name + "', expected x, y or z");
}

}  // namespace

class MoveItKinematics : public kinematics::KinematicsBase {
 public:
  using kinematics::KinematicsBase::getPositionIK;
  using kinematics::KinematicsBase::searchPositionIK;
  using Options = kinematics::KinematicsQueryOptions;

  bool initialize(const rclcpp::Node::SharedPtr& node, const moveit::core::RobotModel& robot_model,
                  const std::string& group_name, const std::string& base_frame,
                  const std::vector<std::string>& tip_frames, double search_discretization) override {
    try {
      if (tip_frames.size() != 1) throw std::invalid_argument("one tip is solved for, not several");
      node_ = node;
      storeValues(robot_model, group_name, base_frame, tip_frames, search_discretization);
      prepare(robot_model);
      return true;
    } catch (const std::exception& error) {
      RCLCPP_ERROR(logger(), "group '%s': %s", group_name.c_str(), error.what());
      solver_.reset();
      return false;
    }
  }

  /// The solution nearest to the seed.
  bool getPositionIK(const Pose& wanted, const std::vector<double>& seed, std::vector<double>& solution,
                     MoveItErrorCodes& error_code, const Options& options = Options()) const override {
    return search(wanted, seed, 0.0, {}, solution, {}, error_code, options);
  }

  /// Every solution of one wanted pose, nearest to the seed first.
  bool getPositionIK(const std::vector<Pose>& wanted, const std::vector<double>& seed,
                     std::vector<std::vector<double>>& solutions, kinematics::KinematicsResult& result,
                     const Options& options = Options()) const override {
    solutions.clear();
    result.solution_percentage = 0.0;
    if (options.discretization_method != kinematics::DiscretizationMethods::NO_DISCRETIZATION)
      return failed(&result, kinematics::KinematicErrors::UNSUPORTED_DISCRETIZATION_REQUESTED);
    if (wanted.empty()) return failed(&result, kinematics::KinematicErrors::EMPTY_TIP_POSES);
    if (wanted.size() > 1) return failed(&result, kinematics::KinematicErrors::MULTIPLE_TIPS_NOT_SUPPORTED);
    if (!solver_) return failed(&result, kinematics::KinematicErrors::SOLVER_NOT_ACTIVE);
    std::vector<double> first;
    MoveItErrorCodes error_code;
    if (!search(wanted.front(), seed, 0.0, {}, first, {}, error_code, options))
      return failed(&result, kinematics::KinematicErrors::NO_SOLUTION);
    solutions.push_back(first);
    if (has_branches()) {
      for (const std::vector<double>& other : branches(task_at(wanted.front()), chain_.driven(seed))) {
        if (other != first) solutions.push_back(other);
      }
    }
    result.kinematic_error = kinematics::KinematicErrors::OK;
    result.solution_percentage = 1.0;
    return true;
  }

  bool searchPositionIK(const Pose& wanted, const std::vector<double>& seed, double timeout,
                        std::vector<double>& solution, MoveItErrorCodes& error_code,
                        const Options& options = Options()) const override {
    return search(wanted, seed, timeout, {}, solution, {}, error_code, options);
  }

  bool searchPositionIK(const Pose& wanted, const std::vector<double>& seed, double timeout,
                        const std::vector<double>& consistency_limits, std::vector<double>& solution,
                        MoveItErrorCodes& error_code, const Options& options = Options()) const override {
    return search(wanted, seed, timeout, consistency_limits, solution, {}, error_code, options);
  }

  bool searchPositionIK(const Pose& wanted, const std::vector<double>& seed, double timeout,
                        std::vector<double>& solution, const IKCallbackFn& solution_callback,
                        MoveItErrorCodes& error_code, const Options& options = Options()) const override {
    return search(wanted, seed, timeout, {}, solution, solution_callback, error_code, options);
  }

  bool searchPositionIK(const Pose& wanted, const std::vector<double>& seed, double timeout,
                        const std::vector<double>& consistency_limits, std::vector<double>& solution,
                        const IKCallbackFn& solution_callback, MoveItErrorCodes& error_code,
                        const Options& options = Options()) const override {
    return search(wanted, seed, timeout, consistency_limits, solution, solution_callback, error_code, options);
  }

  bool getPositionFK(const std::vector<std::string>& link_names, const std::vector<double>& positions,
                     std::vector<Pose>& poses) const override {
    try {
      require_ready(positions);
      std::vector<Pose> found;
      for (const std::string& name : link_names)
        found.push_back(pose_of(link_pose(chain_, chain_.link(name), chain_.driven(positions))));
      poses = found;
      return true;
    } catch (const std::exception& error) {
      RCLCPP_ERROR(logger(), "%s", error.what());
      return false;
    }
  }

  const std::vector<std::string>& getJointNames() const override { return chain_.names; }
  const std::vector<std::string>& getLinkNames() const override { return tip_frames_; }

 private:
  /// What one question asks for besides the pose.
  struct Wish {
    const Pose* wanted;
    const std::vector<double>* seed;
    const std::vector<double>* consistency_limits;  ///< [rad | m] how far each joint may be from the seed; empty: any
    const IKCallbackFn* callback;                   ///< says whether a solution will do (collisions); may be empty
  };

  static bool failed(kinematics::KinematicsResult* result, kinematics::KinematicError why) {
    result->kinematic_error = why;
    return false;
  }

  void prepare(const moveit::core::RobotModel& robot_model) {
    const moveit::core::JointModelGroup* const group = robot_model.getJointModelGroup(group_name_);
    if (group == nullptr) throw std::invalid_argument("the robot has no such group");
    chain_ = chain_between(*robot_model.getURDF(), base_frame_, tip_frames_.front());
    for (truing::Joint& joint : chain_.robot.joints) {
      if (!group->hasJointModel(joint.name))
        throw std::invalid_argument("joint '" + joint.name + "' moves between base and tip, but is not in the group");
      // joint_limits.yaml may have narrowed what the URDF says.
      const auto& bounds = group->getJointModel(joint.name)->getVariableBounds().front();
      if (!bounds.position_bounded_) continue;
      joint.lower = bounds.min_position_;
      joint.upper = bounds.max_position_;
    }
    const std::string prefix = "robot_description_kinematics." + group_name_ + ".";
    truing::InverseOptions options;
    options.position_tolerance = parameter<double>(*node_, prefix + "position_tolerance", options.position_tolerance);
    options.rotation_tolerance = parameter<double>(*node_, prefix + "rotation_tolerance", options.rotation_tolerance);
    options.choose = choose_named(parameter<std::string>(*node_, prefix + "choose", "nearest"));
    const std::string free_axis = parameter<std::string>(*node_, prefix + "free_axis", "");
    task_ = {};
    if (parameter<bool>(*node_, prefix + "position_only_ik", false)) {
      task_.kind = truing::TaskKind::point;
    } else if (!free_axis.empty()) {
      task_.kind = truing::TaskKind::torch;
      task_.axis = axis_named(free_axis);
      // Any direction across it: lean is not asked for.
      task_.travel = free_axis == "x" ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitX();
      task_.retreat = -task_.axis;
    }
    solver_ = std::make_unique<truing::InverseSolver>(chain_.robot, options);
  }

  void require_ready(const std::vector<double>& positions) const {
    if (!solver_) throw std::invalid_argument("the solver was not initialised");
    if (positions.size() != chain_.names.size())
      throw std::invalid_argument("found " + std::to_string(positions.size()) + " joint positions, expected " +
                                  std::to_string(chain_.names.size()));
  }

  truing::Task task_at(const Pose& wanted) const {
    truing::Task task = task_;
    task.T_measurement_target = frame_of(wanted);
    return task;
  }

  /// Only a full pose on an arm with a closed form has a list of solutions that is known to be whole.
  bool has_branches() const {
    return task_.kind == truing::TaskKind::pose && solver_->closed_form() != truing::ClosedFormKind::none;
  }

  std::vector<std::vector<double>> branches(const truing::Task& task, const truing::Joints& seed) const {
    truing::Branches found;
    solver_->branches(task, seed, &found);
    std::sort(found.solution.begin(), found.solution.begin() + found.count,
              [&seed](const truing::Solution& a, const truing::Solution& b) {
                return (a.joints - seed).squaredNorm() < (b.joints - seed).squaredNorm();
              });
    std::vector<std::vector<double>> positions;
    for (int k = 0; k < found.count; ++k)
      positions.push_back(chain_.all(found.solution[static_cast<std::size_t>(k)].joints));
    return positions;
  }

  static bool accepts(const Wish& wish, const std::vector<double>& positions) {
    const std::vector<double>& limits = *wish.consistency_limits;
    for (std::size_t k = 0; k < limits.size(); ++k) {
      if (std::abs(positions[k] - (*wish.seed)[k]) > limits[k]) return false;
    }
    if (!*wish.callback) return true;
    MoveItErrorCodes verdict;
    verdict.val = MoveItErrorCodes::SUCCESS;
    (*wish.callback)(*wish.wanted, positions, verdict);
    return verdict.val == MoveItErrorCodes::SUCCESS;
  }

  /// Somewhere to start from: anywhere within the limits, near the seed where that is asked for.
  truing::Joints another_start(const Wish& wish, const truing::Joints& seed, std::mt19937_64* random) const {
    truing::Joints start = seed;
    Eigen::Index next = 0;
    for (std::size_t k = 0; k < chain_.robot.joints.size(); ++k) {
      const truing::Joint& joint = chain_.robot.joints[k];
      if (joint.passive()) continue;
      const double near = wish.consistency_limits->empty() ? M_PI : (*wish.consistency_limits)[k];
      double lower = std::isfinite(joint.lower) ? joint.lower : seed[next] - near;
      double upper = std::isfinite(joint.upper) ? joint.upper : seed[next] + near;
      if (!wish.consistency_limits->empty()) {
        lower = std::max(lower, seed[next] - near);
        upper = std::min(upper, seed[next] + near);
      }
      if (lower < upper) start[next] = std::uniform_real_distribution<double>(lower, upper)(*random);
      ++next;
    }
    return start;
  }

  /// The answer by Choose; where that will not do, the other configurations; then, until the time is over, answers from
  /// other starts: of a redundant arm there are always more.
  bool search(const Pose& wanted, const std::vector<double>& seed, double timeout,
              const std::vector<double>& consistency_limits, std::vector<double>& solution,
              const IKCallbackFn& callback, MoveItErrorCodes& error_code, const Options& options) const {
    const auto end = Clock::now() + std::chrono::duration<double>(timeout);
    const Wish wish{&wanted, &seed, &consistency_limits, &callback};
    error_code.val = MoveItErrorCodes::NO_IK_SOLUTION;
    try {
      require_ready(seed);
      if (!consistency_limits.empty()) require_ready(consistency_limits);
      const truing::Task task = task_at(wanted);
      const truing::Joints start = chain_.driven(seed);
      const truing::Solution best = solver_->solve(task, start);
      std::vector<double> positions = chain_.all(best.joints);
      bool found = (best.reached() || options.return_approximate_solution) && accepts(wish, positions);
      if (!best.reached() && !found) {
        RCLCPP_DEBUG(logger(), "%s", solver_->describe(best).c_str());
        return false;
      }
      if (!found && has_branches()) {
        for (const std::vector<double>& other : branches(task, start)) {
          found = accepts(wish, other);
          if (!found) continue;
          positions = other;
          break;
        }
      }
      std::mt19937_64 random(kSeed);
      while (!found && Clock::now() < end) {
        const truing::Solution other = solver_->solve(task, another_start(wish, start, &random));
        positions = chain_.all(other.joints);
        found = other.reached() && accepts(wish, positions);
      }
      if (!found) {
        error_code.val = timeout > 0.0 ? MoveItErrorCodes::TIMED_OUT : MoveItErrorCodes::NO_IK_SOLUTION;
        return false;
      }
      solution = positions;
      error_code.val = MoveItErrorCodes::SUCCESS;
      return true;
    } catch (const std::exception& error) {
      RCLCPP_ERROR(logger(), "%s", error.what());
      return false;
    }
  }

  Chain chain_;
  std::unique_ptr<truing::InverseSolver> solver_;
  truing::Task task_;  ///< what of a wanted pose is asked for
};

}  // namespace truing_ros

PLUGINLIB_EXPORT_CLASS(truing_ros::MoveItKinematics, kinematics::KinematicsBase)
