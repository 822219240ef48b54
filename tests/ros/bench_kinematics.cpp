// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// How long the plugins of ros/truing_ros take for an answer, called as MoveIt and ros2_control call them (against the
// headers of include/): median and 99th percentile of the CPU time, of every goal the best of several runs.
//
//     cmake --build build/consumer --target bench_truing_ros && build/consumer/ros/bench_truing_ros

#include <time.h>

#include <algorithm>
#include <functional>

#include <kinematics_interface/kinematics_interface.hpp>

#include "arms.hpp"

using namespace ros_arms;

namespace {

constexpr int kGoals = 2000, kRuns = 5;

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Times {
  double median = 0.0, p99 = 0.0;  // [us]
};

Times timed(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::vector<double> best(count, 1e9);
  for (int run = 0; run < kRuns; ++run) {
    for (std::size_t k = 0; k < count; ++k) {
      const double start = cpu_seconds();
      work(k);
      best[k] = std::min(best[k], cpu_seconds() - start);
    }
  }
  std::sort(best.begin(), best.end());
  return {1e6 * best[count / 2], 1e6 * best[count * 99 / 100]};
}

struct Goal {
  geometry_msgs::msg::Pose pose;
  std::vector<double> seed;
};

void solve(const std::string& name, const std::string& of_goals, const std::string& description) {
  const Robot drawn = truing::robot_from_urdf(of_goals);
  Cell cell(description);
  if (!cell.start()) throw std::runtime_error(rclcpp::last_error());
  std::mt19937_64 random(11);
  std::vector<Goal> solved, not_solved;
  std::vector<double> solution;
  moveit_msgs::msg::MoveItErrorCodes code;
  for (int k = 0; k < kGoals; ++k) {
    const Goal goal{pose_of(forward(drawn, random_joints(drawn, &random))), random_joints(drawn, &random)};
    (cell.plugin->searchPositionIK(goal.pose, goal.seed, 0.05, solution, code) ? solved : not_solved).push_back(goal);
  }
  const auto answer = [&](const Goal& goal) {
    cell.plugin->searchPositionIK(goal.pose, goal.seed, 0.05, solution, code);
  };
  const Times times = timed(solved.size(), [&](std::size_t k) { answer(solved[k]); });
  std::printf("| %s | %zu of %d | %.1f / %.1f |", name.c_str(), solved.size(), kGoals, times.median, times.p99);
  if (not_solved.empty()) {
    std::printf(" |\n");
    return;
  }
  const Times refused = timed(not_solved.size(), [&](std::size_t k) { answer(not_solved[k]); });
  std::printf(" %.0f |\n", refused.median);
}

void steps(const std::string& name, const std::string& description) {
  auto parameters = std::make_shared<rclcpp::node_interfaces::NodeParametersInterface>();
  parameters->values["kinematics.tip"] = std::string("tool0");
  const auto plugin = make_plugin<kinematics_interface::KinematicsInterface>();
  if (!plugin->initialize(description, parameters, "kinematics")) throw std::runtime_error(rclcpp::last_error());
  const Robot robot = truing::robot_from_urdf(description);
  std::mt19937_64 random(11);
  std::vector<Eigen::VectorXd> joints;
  for (int k = 0; k < kGoals; ++k) {
    const std::vector<double> q = random_joints(robot, &random);
    joints.push_back(Eigen::Map<const Eigen::VectorXd>(q.data(), static_cast<Eigen::Index>(q.size())));
  }
  Eigen::VectorXd step(joints.front().size());
  const auto twist = kinematics_interface::KinematicsInterface::Vector6::Constant(1e-3).eval();
  const Times times = timed(joints.size(), [&](std::size_t k) {
    plugin->convert_cartesian_deltas_to_joint_deltas(joints[k], twist, "tool0", step);
  });
  std::printf("| %s | | %.2f / %.2f | |\n", name.c_str(), times.median, times.p99);
}

}  // namespace

int main() {
  std::printf("| | goals solved | median / p99 [us] | median of a refusal [us] |\n| --- | --- | --- | --- |\n");
  const std::string ur = ur10e(), wrist = wrist_arm();
  const std::string real_ur = calibrated(ur, 1e-3, 3e-3, 1), real_wrist = calibrated(wrist, 1e-3, 1e-3, 4);
  solve("UR10e as drawn", ur, ur);
  solve("UR10e calibrated", real_ur, real_ur);
  solve("UR10e calibrated, goals of the drawn one", ur, real_ur);
  solve("spherical wrist as drawn", wrist, wrist);
  solve("spherical wrist calibrated", real_wrist, real_wrist);
  solve("spherical wrist calibrated, goals of the drawn one", wrist, real_wrist);
  solve("seven joints as drawn", redundant_arm(), redundant_arm());
  solve("seven joints calibrated", calibrated(redundant_arm(), 1e-3, 1e-3, 5),
        calibrated(redundant_arm(), 1e-3, 1e-3, 5));
  steps("Cartesian to joint step, UR10e calibrated", real_ur);
}
