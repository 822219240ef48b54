// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
//
// ros/truing_ros against headers that were written for this test (include/): the plugins compile and do their work
// with the signatures as documented. A colcon build against MoveIt and ros2_control themselves was not run.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <chrono>

#include <Eigen/Cholesky>

#include "arms.hpp"

using namespace ros_arms;
using geometry_msgs::msg::Pose;
using moveit_msgs::msg::MoveItErrorCodes;

namespace {

constexpr double kReached = 1.1e-6;  // [m | rad] the plugin's tolerances are 1e-6, this is another forward kinematics

bool reaches(const Robot& robot, const std::vector<double>& q, const Isometry3d& wanted) {
  const Isometry3d T = forward(robot, q);
  return (T.translation() - wanted.translation()).norm() < kReached &&
         Eigen::Quaterniond(T.linear()).angularDistance(Eigen::Quaterniond(wanted.linear())) < kReached;
}

bool within_limits(const Robot& robot, const std::vector<double>& q) {
  std::size_t next = 0;
  for (const truing::Joint& joint : robot.joints) {
    if (joint.passive()) continue;
    if (q[next] < joint.lower - 1e-12 || q[next] > joint.upper + 1e-12) return false;
    ++next;
  }
  return true;
}

/// Position and rotation that are missing. [m, rad]
Eigen::Matrix<double, 6, 1> missing(const Robot& robot, const std::vector<double>& q, const Isometry3d& wanted) {
  const Isometry3d T = forward(robot, q);
  const Eigen::AngleAxisd turn(wanted.linear() * T.linear().transpose());
  Eigen::Matrix<double, 6, 1> e;
  e << wanted.translation() - T.translation(), turn.angle() * turn.axis();
  return e;
}

/// Does another solver get there, which shares nothing with the plugin's? Damped Gauss-Newton by differences, limits
/// aside, from the joints of the nominal arm and from so many random ones.
bool reachable(const Robot& robot, const Isometry3d& wanted, std::vector<double> q, std::mt19937_64* random) {
  constexpr int kStarts = 12, kSteps = 60;
  constexpr double kStep = 1e-6, kDamping = 1e-6;
  for (int start = 0; start <= kStarts; ++start, q = random_joints(robot, random)) {
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::Matrix<double, 6, 1> e = missing(robot, q, wanted);
      if (e.norm() < kReached) return true;
      Eigen::Matrix<double, 6, 6> J;
      for (std::size_t k = 0; k < 6; ++k) {
        std::vector<double> moved = q;
        moved[k] += kStep;
        J.col(static_cast<Eigen::Index>(k)) = (e - missing(robot, moved, wanted)) / kStep;
      }
      const Eigen::Matrix<double, 6, 6> normal =
          J.lazyProduct(J.transpose()) + kDamping * Eigen::Matrix<double, 6, 6>::Identity();
      const Eigen::Matrix<double, 6, 1> weighed = normal.llt().solve(e);
      for (std::size_t k = 0; k < 6; ++k) q[k] += J.col(static_cast<Eigen::Index>(k)).dot(weighed);
    }
  }
  return false;
}

struct Count {
  int solved = 0, out_of_reach = 0, lost = 0;
};

/// Goals that random joints of one arm reach, handed to the plugin of the calibrated one. `out_of_reach`: the edge of
/// the workspace lies elsewhere there: by less than `edge` [m], and no other solver gets there either.
Count solve_goals(const std::string& of_goals, const std::string& calibrated_text, int count, double edge,
                  double wrist = std::nan("")) {
  const Robot drawn = truing::robot_from_urdf(of_goals), real = truing::robot_from_urdf(calibrated_text);
  Cell cell(calibrated_text);
  REQUIRE(cell.start());
  std::mt19937_64 random(5);
  Count counted;
  for (int k = 0; k < count; ++k) {
    std::vector<double> q = random_joints(drawn, &random), solution;
    const std::vector<double> seed = random_joints(drawn, &random);
    if (std::isfinite(wrist)) q[4] = wrist;
    const Isometry3d wanted = forward(drawn, q);
    MoveItErrorCodes code;
    if (cell.plugin->searchPositionIK(pose_of(wanted), seed, 0.05, solution, code)) {
      const bool holds = reaches(real, solution, wanted) && within_limits(real, solution);
      (holds && code.val == MoveItErrorCodes::SUCCESS ? counted.solved : counted.lost) += 1;
      continue;
    }
    kinematics::KinematicsQueryOptions nearest;
    nearest.return_approximate_solution = true;
    const bool at_the_edge = cell.plugin->searchPositionIK(pose_of(wanted), seed, 0.05, solution, code, nearest) &&
                             missing(real, solution, wanted).norm() < edge && !reachable(real, wanted, q, &random);
    (at_the_edge ? counted.out_of_reach : counted.lost) += 1;
  }
  return counted;
}

const char* const kPalletizer = R"(<robot name="palletizer">
<link name="world"/><link name="base_link"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/>
<link name="pad"/><link name="tool0"/>
<joint name="stand" type="fixed"><parent link="world"/><child link="base_link"/><origin xyz="1 2 3" rpy="0 0 1"/></joint>
<joint name="j1" type="continuous"><parent link="base_link"/><child link="a"/><origin xyz="0 0 0.4"/>
  <axis xyz="0 0 2"/></joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.2 0 0.1" rpy="-1.5708 0 0"/>
  <axis xyz="0 0 1"/><limit lower="-1" upper="1.5" effort="1" velocity="1"/></joint>
<joint name="slide" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="0.9 0 0" rpy="0.1 0.2 0.3"/>
  <axis xyz="1 0 0"/><limit lower="0" upper="0.5" effort="1" velocity="1"/></joint>
<joint name="level" type="revolute"><parent link="c"/><child link="d"/><origin xyz="0.1 0 0"/>
  <axis xyz="0 0 1"/><limit lower="-4" upper="4" effort="1" velocity="1"/><mimic joint="j2" multiplier="-1" offset="0.2"/></joint>
<joint name="plate" type="fixed"><parent link="d"/><child link="pad"/><origin xyz="0.05 0 0" rpy="0 1 0"/></joint>
<joint name="flange" type="fixed"><parent link="pad"/><child link="tool0"/><origin xyz="0 0 0.1" rpy="0 0 0.5"/></joint>
</robot>)";

}  // namespace

TEST_CASE("a UR10e whose axes are out of parallel by milliradians is solved wherever it can be") {
  // The UR10e of EAIK's issue 25 has axes 2, 3 and 4 out of parallel by 0.9, 5.8 and 6.6 mrad.
  const std::string nominal = ur10e();
  for (const unsigned seed : {1u, 2u}) {
    const std::string real = calibrated(nominal, 1e-3, 3e-3, seed);
    const Count own = solve_goals(real, real, 300, 0.0);
    CHECK(own.solved == 300);
    const Count drawn = solve_goals(nominal, real, 300, 0.01);
    CHECK(drawn.lost == 0);
    CHECK(drawn.out_of_reach <= 9);  // goals within millimetres of the edge of what the nominal arm reaches
  }
}

TEST_CASE("goals where the wrist's axes are parallel are solved after calibration") {
  // Issue 931 of the UR driver: there planning failed once the calibration was in the description.
  const std::string nominal = ur10e();
  const Count counted = solve_goals(nominal, calibrated(nominal, 1e-3, 3e-3, 3), 200, 0.01, 0.0);
  CHECK(counted.lost == 0);
  CHECK(counted.out_of_reach <= 6);
}

TEST_CASE("an arm with a spherical wrist is solved when its axes do not meet any more") {
  const std::string nominal = wrist_arm(), real = calibrated(nominal, 1e-3, 1e-3, 4);
  CHECK(solve_goals(real, real, 300, 0.0).solved == 300);
  const Count drawn = solve_goals(nominal, real, 300, 0.01);
  CHECK(drawn.lost == 0);
  CHECK(drawn.out_of_reach <= 9);
}

TEST_CASE("the nearest solution is found from a seed beside it, and all solutions are listed nearest first") {
  const std::string text = calibrated(ur10e(), 1e-3, 3e-3, 1);
  const Robot robot = truing::robot_from_urdf(text);
  Cell cell(text);
  REQUIRE(cell.start());
  const std::vector<double> truth = {0.3, -1.2, 1.4, -0.7, 1.1, 0.4};
  std::vector<double> seed = truth, solution;
  for (double& q : seed) q += 0.05;
  const Isometry3d wanted = forward(robot, truth);
  MoveItErrorCodes code;
  REQUIRE(cell.plugin->getPositionIK(pose_of(wanted), seed, solution, code));
  for (std::size_t k = 0; k < truth.size(); ++k) CHECK(solution[k] == doctest::Approx(truth[k]).epsilon(1e-5));

  std::vector<std::vector<double>> solutions;
  kinematics::KinematicsResult result;
  REQUIRE(cell.plugin->getPositionIK({pose_of(wanted)}, seed, solutions, result, {}));
  CHECK(result.kinematic_error == kinematics::KinematicErrors::OK);
  REQUIRE(solutions.size() == 8);
  CHECK(solutions.front() == solution);
  double last = 0.0;
  for (const std::vector<double>& q : solutions) {
    CHECK(reaches(robot, q, wanted));
    double distance = 0.0;
    for (std::size_t k = 0; k < q.size(); ++k) distance += (q[k] - seed[k]) * (q[k] - seed[k]);
    CHECK(distance >= last);
    last = distance;
  }
}

TEST_CASE("a solution that collides is passed over for another configuration, within the time that was given") {
  const std::string text = calibrated(ur10e(), 1e-3, 3e-3, 1);
  const Robot robot = truing::robot_from_urdf(text);
  Cell cell(text);
  REQUIRE(cell.start());
  const std::vector<double> truth = {0.3, -1.2, 1.4, -0.7, 1.1, 0.4};
  const Isometry3d wanted = forward(robot, truth);
  int asked = 0;
  const auto elbow_down = [&asked](const Pose&, const std::vector<double>& q, MoveItErrorCodes& code) {
    ++asked;
    code.val = q[2] < 0.0 ? MoveItErrorCodes::SUCCESS : MoveItErrorCodes::GOAL_IN_COLLISION;
  };
  std::vector<double> solution;
  MoveItErrorCodes code;
  REQUIRE(cell.plugin->searchPositionIK(pose_of(wanted), truth, 0.5, solution, elbow_down, code));
  CHECK(code.val == MoveItErrorCodes::SUCCESS);
  CHECK(asked > 1);
  CHECK(solution[2] < 0.0);
  CHECK(reaches(robot, solution, wanted));

  const auto never = [](const Pose&, const std::vector<double>&, MoveItErrorCodes& verdict) {
    verdict.val = MoveItErrorCodes::GOAL_IN_COLLISION;
  };
  const std::vector<double> before = solution;
  const auto start = std::chrono::steady_clock::now();
  CHECK_FALSE(cell.plugin->searchPositionIK(pose_of(wanted), truth, 0.05, solution, never, code));
  CHECK(std::chrono::steady_clock::now() - start >= std::chrono::milliseconds(50));
  CHECK(code.val == MoveItErrorCodes::TIMED_OUT);
  CHECK(solution == before);
}

TEST_CASE("consistency limits keep every joint near the seed, or there is no solution") {
  const std::string text = calibrated(wrist_arm(), 1e-3, 1e-3, 4);
  const Robot robot = truing::robot_from_urdf(text);
  Cell cell(text);
  REQUIRE(cell.start());
  const std::vector<double> truth = {0.3, 0.2, -0.4, 0.7, 0.8, 0.4};
  const Isometry3d wanted = forward(robot, truth);
  std::vector<double> seed = truth, solution;
  seed[0] += 0.1;
  MoveItErrorCodes code;
  REQUIRE(cell.plugin->searchPositionIK(pose_of(wanted), seed, 0.02, std::vector<double>(6, 0.2), solution, code));
  for (std::size_t k = 0; k < 6; ++k) CHECK(std::abs(solution[k] - seed[k]) <= 0.2);
  CHECK_FALSE(cell.plugin->searchPositionIK(pose_of(wanted), seed, 0.02, std::vector<double>(6, 0.05), solution, code));
  CHECK(code.val == MoveItErrorCodes::TIMED_OUT);
}

TEST_CASE("a redundant arm goes on looking until a solution will do") {
  const std::string text = redundant_arm();
  const Robot robot = truing::robot_from_urdf(text);
  Cell cell(text);
  REQUIRE(cell.start());
  const std::vector<double> truth = {0.3, 0.5, -0.2, 1.2, 0.3, -0.6, 0.4};
  const Isometry3d wanted = forward(robot, truth);
  const auto far_elbow = [](const Pose&, const std::vector<double>& q, MoveItErrorCodes& code) {
    code.val = std::abs(q[2]) > 1.0 ? MoveItErrorCodes::SUCCESS : MoveItErrorCodes::GOAL_IN_COLLISION;
  };
  std::vector<double> solution;
  MoveItErrorCodes code;
  REQUIRE(cell.plugin->searchPositionIK(pose_of(wanted), truth, 5.0, solution, far_elbow, code));
  CHECK(std::abs(solution[2]) > 1.0);
  CHECK(reaches(robot, solution, wanted));
}

TEST_CASE("what cannot be reached is said so; asked for, the nearest is given instead") {
  Cell cell(ur10e());
  REQUIRE(cell.start());
  const std::vector<double> seed = {0.3, -1.2, 1.4, -0.7, 1.1, 0.4};
  Pose far;
  far.position.x = 3.0;
  std::vector<double> solution;
  MoveItErrorCodes code;
  CHECK_FALSE(cell.plugin->searchPositionIK(far, seed, 0.02, solution, code));
  CHECK(code.val == MoveItErrorCodes::NO_IK_SOLUTION);
  CHECK(solution.empty());
  kinematics::KinematicsQueryOptions options;
  options.return_approximate_solution = true;
  REQUIRE(cell.plugin->searchPositionIK(far, seed, 0.02, solution, code, options));
  CHECK(within_limits(truing::robot_from_urdf(ur10e()), solution));
}

TEST_CASE("joint_limits.yaml narrows what the description allows") {
  Cell cell(ur10e());
  cell.model.groups.at("arm").joints.at("joint_3").bounds.front() = {-M_PI, 0.0, true};
  REQUIRE(cell.start());
  const Robot robot = truing::robot_from_urdf(ur10e());
  std::vector<double> solution;
  MoveItErrorCodes code;
  const std::vector<double> seed = {0.3, -1.2, 1.4, -0.7, 1.1, 0.4};
  REQUIRE(cell.plugin->getPositionIK(pose_of(forward(robot, seed)), seed, solution, code));
  CHECK(solution[2] <= 0.0);
}

TEST_CASE("position alone, and an axis that may turn, are asked for by parameters") {
  const std::string text = ur10e();
  const Robot robot = truing::robot_from_urdf(text);
  const std::vector<double> truth = {0.3, -1.2, 1.4, -0.7, 1.1, 0.4};
  Isometry3d wanted = forward(robot, truth);
  std::vector<double> solution;
  MoveItErrorCodes code;

  Cell torch(text);
  torch.give("free_axis", std::string("x"));
  REQUIRE(torch.start());
  wanted.rotate(Eigen::AngleAxisd(2.0, Vector3d::UnitX()));
  REQUIRE(torch.plugin->getPositionIK(pose_of(wanted), truth, solution, code));
  const Isometry3d reached = forward(robot, solution);
  CHECK((reached.translation() - wanted.translation()).norm() < kReached);
  CHECK((reached.linear().col(0) - wanted.linear().col(0)).norm() < kReached);
  CHECK((reached.linear().col(1) - wanted.linear().col(1)).norm() > 0.1);

  Cell point(text);
  point.give("position_only_ik", true);
  REQUIRE(point.start());
  wanted.linear() = Eigen::AngleAxisd(1.0, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  REQUIRE(point.plugin->getPositionIK(pose_of(wanted), truth, solution, code));
  CHECK((forward(robot, solution).translation() - wanted.translation()).norm() < kReached);

  Cell wrong(text);
  wrong.give("free_axis", std::string("w"));
  CHECK_FALSE(wrong.start());
  CHECK(rclcpp::last_error() == "group 'arm': free_axis: found 'w', expected x, y or z");
}

TEST_CASE("fixed, prismatic and continuous joints and those that mimic are as truing reads them from the text") {
  const Robot robot = truing::robot_from_urdf(kPalletizer, "base_link", "tool0");
  Cell cell(kPalletizer);
  REQUIRE(cell.start());
  CHECK(cell.plugin->getJointNames() == std::vector<std::string>{"j1", "j2", "slide", "level"});
  for (const std::vector<double>& q : {std::vector<double>{4.0, 0.3, 0.2}, {-0.5, -0.9, 0.45}}) {
    const std::vector<double> positions = {q[0], q[1], q[2], -q[1] + 0.2};
    std::vector<Pose> poses;
    REQUIRE(cell.plugin->getPositionFK({"tool0", "base_link", "c"}, positions, poses));
    const auto frames = truing::forward_kinematics(robot, Eigen::Vector3d(q[0], q[1], q[2]));
    const Pose tip = pose_of(frames.back()), slide = pose_of(frames[2]);
    CHECK(poses[0].position.x == doctest::Approx(tip.position.x).epsilon(1e-13));
    CHECK(poses[0].position.z == doctest::Approx(tip.position.z).epsilon(1e-13));
    CHECK(poses[0].orientation.w == doctest::Approx(tip.orientation.w).epsilon(1e-13));
    CHECK(poses[1].position.x == 0.0);
    CHECK(poses[2].position.y == doctest::Approx(slide.position.y).epsilon(1e-13));

    cell.give("position_only_ik", true);
    std::vector<double> solution;
    MoveItErrorCodes code;
    Cell point(kPalletizer);
    point.give("position_only_ik", true);
    REQUIRE(point.start());
    REQUIRE(point.plugin->getPositionIK(tip, positions, solution, code));
    REQUIRE(solution.size() == 4);
    CHECK(solution[3] == doctest::Approx(-solution[1] + 0.2));
  }
}

TEST_CASE("what cannot be used ends with false and a sentence in the log, never with an exception") {
  Cell cell(ur10e());
  std::vector<double> solution;
  MoveItErrorCodes code;
  cell.plugin = make_plugin<kinematics::KinematicsBase>();
  CHECK_FALSE(cell.plugin->getPositionIK(Pose(), {0, 0, 0, 0, 0, 0}, solution, code));
  CHECK(rclcpp::last_error() == "the solver was not initialised");
  CHECK_FALSE(cell.start("leg"));
  CHECK(rclcpp::last_error() == "group 'leg': the robot has no such group");

  REQUIRE(cell.start());
  CHECK_FALSE(cell.plugin->getPositionIK(Pose(), {0, 0}, solution, code));
  CHECK(rclcpp::last_error() == "found 2 joint positions, expected 6");
  Pose empty;
  empty.orientation.w = 0.0;
  CHECK_FALSE(cell.plugin->getPositionIK(empty, {0, 0, 0, 0, 0, 0}, solution, code));
  CHECK(rclcpp::last_error() == "the wanted orientation is a quaternion of zeros");
  CHECK(code.val == MoveItErrorCodes::NO_IK_SOLUTION);
  Pose nowhere;
  nowhere.position.x = std::nan("");
  CHECK_FALSE(cell.plugin->getPositionIK(nowhere, {0, 0, 0, 0, 0, 0}, solution, code));
  std::vector<Pose> poses;
  CHECK_FALSE(cell.plugin->getPositionFK({"thumb"}, {0, 0, 0, 0, 0, 0}, poses));
  CHECK(rclcpp::last_error() ==
        "link 'thumb' is not in the chain; its links are base_link, link_1, link_2, link_3, link_4, link_5, link_6, "
        "tool0");

  Cell two(ur10e(), {"tool0", "link_3"});
  CHECK_FALSE(two.start());
  Cell unknown(ur10e(), {"tool1"});
  CHECK_FALSE(unknown.start());
  CHECK(rclcpp::last_error() == "group 'arm': the robot description has no link 'tool1'");
  Cell outside(ur10e());
  outside.model.groups.at("arm").joints.erase("joint_2");
  CHECK_FALSE(outside.start());
  CHECK(rclcpp::last_error() == "group 'arm': joint 'joint_2' moves between base and tip, but is not in the group");
}
