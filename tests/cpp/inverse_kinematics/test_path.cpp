// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "support/inverse_arms.hpp"

using namespace inverse_arms;
using truing::InverseOptions;
using truing::InverseSolver;
using truing::Path;
using truing::PathOptions;
using truing::Reason;

namespace {

/// Poses that a robot passes through on a smooth way of its joints.
std::vector<Task> tasks_along(const Robot& robot, const Joints& from, const Joints& to, int count, TaskKind kind) {
  std::vector<Task> tasks;
  for (int k = 0; k < count; ++k) {
    const double share = 0.5 - 0.5 * std::cos(M_PI * k / (count - 1));
    tasks.push_back(task_at(reached(robot, Joints(from + share * (to - from))), kind));
  }
  return tasks;
}

/// A straight seam, the torch turning slowly about a tilted direction.
std::vector<Task> seam(const Vector3d& from, const Vector3d& to, int count, TaskKind kind) {
  std::vector<Task> tasks;
  for (int k = 0; k < count; ++k) {
    const double share = static_cast<double>(k) / (count - 1);
    Isometry3d T = Isometry3d::Identity();
    T.translation() = from + share * (to - from);
    T.linear() = (Eigen::AngleAxisd(M_PI, Vector3d::UnitX()) * Eigen::AngleAxisd(0.3 * share, Vector3d::UnitY()))
                     .toRotationMatrix();
    tasks.push_back(task_at(T, kind));
  }
  return tasks;
}

/// Every answer holds, and every step but those of gaps is within the bounds and within what the path says is its
/// longest.
void check_path(const Robot& robot, const std::vector<Task>& tasks, const Path& path, const PathOptions& options) {
  REQUIRE(path.solutions.size() == tasks.size());
  std::vector<bool> gap(tasks.size(), false);
  for (const auto& g : path.gaps) gap.at(g.start) = true;
  const auto driven = robot.driven_joints();
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    if (path.solutions[k].reached()) CHECK(holds(robot, tasks[k], path.solutions[k]));
    if (k + 1 == tasks.size() || gap[k]) continue;
    REQUIRE(path.solutions[k].reached());
    REQUIRE(path.solutions[k + 1].reached());
    for (std::size_t j = 0; j < driven.size(); ++j) {
      const double step = std::abs(path.solutions[k + 1].joints[static_cast<Eigen::Index>(j)] -
                                   path.solutions[k].joints[static_cast<Eigen::Index>(j)]);
      const bool slides = robot.joints[driven[j]].type == JointType::prismatic;
      CHECK(step <= (slides ? options.longest_slide : options.longest_turn));
      CHECK(step <= (slides ? path.longest_slide : path.longest_turn));
    }
  }
}

}  // namespace

TEST_CASE("a path of poses is followed in one configuration, nominal and calibrated") {
  for (const Robot& nominal : {ur(), wrist_arm()}) {
    for (const bool calibrated : {false, true}) {
      const Robot robot = calibrated ? perturbed(nominal, 1e-3, 1e-3, 71) : nominal;
      CAPTURE(robot.name);
      Joints from(6), to(6);
      from << 0.2, -0.3, -0.5, 0.4, 0.7, 0.1;
      to << 1.4, 0.4, -1.0, -0.6, 1.3, 2.0;
      const auto tasks = tasks_along(robot, from, to, 200, TaskKind::pose);
      const InverseSolver solver(robot);
      const Path path = solver.path(tasks, from);
      CHECK(path.continuous());
      check_path(robot, tasks, path, {});
      CHECK((path.solutions.back().joints - to).cwiseAbs().maxCoeff() < 1e-6);
      CHECK(path.longest_turn < 0.03);
    }
  }
}

TEST_CASE("an arm under a gantry follows a seam: rails and roll are chosen along the way") {
  const Robot robot = perturbed(gantry(), 1e-3, 1e-3, 72);
  const auto tasks = seam({1.0, 1.5, 0.3}, {6.0, 2.5, 0.3}, 60, TaskKind::torch);
  const InverseSolver solver(robot);
  PathOptions options;
  options.rail_places = 3;
  options.rolls = 8;
  Joints seed = solver.middle();
  const Path path = solver.path(tasks, seed, options);
  CHECK(path.continuous());
  check_path(robot, tasks, path, options);
  CHECK(path.longest_slide < 0.2);
}

TEST_CASE("where no continuous way exists, the gap is told and the path goes on behind it") {
  const Robot robot = wrist_arm();
  Joints a(6), b(6);
  a << 0.2, 0.3, -0.4, 0.4, 0.7, 0.1;
  b << 2.6, 0.3, -0.4, -0.4, -0.7, 0.1;
  auto tasks = tasks_along(robot, a, a + 0.2 * Joints::Ones(6), 20, TaskKind::pose);
  for (const Task& task : tasks_along(robot, b, b + 0.2 * Joints::Ones(6), 20, TaskKind::pose)) tasks.push_back(task);
  const InverseSolver solver(robot);
  Path path = solver.path(tasks, a);
  REQUIRE(path.gaps.size() == 1);
  CHECK(path.gaps[0].start == 19);
  CHECK(path.gaps[0].joint >= 0);
  CHECK(path.gaps[0].step > PathOptions().longest_turn);
  check_path(robot, tasks, path, {});

  // A target that nobody can reach: the gaps are to both sides of it, and it says why.
  tasks.resize(20);
  tasks[7].T_measurement_target.translation() = Vector3d(30, 0, 0);
  path = solver.path(tasks, a);
  REQUIRE(path.gaps.size() == 2);
  CHECK(path.gaps[0].start == 6);
  CHECK(path.gaps[1].start == 7);
  CHECK(path.gaps[0].joint == -1);
  CHECK(path.solutions[7].reason == Reason::out_of_reach);
  check_path(robot, tasks, path, {});
}

TEST_CASE("a path looks ahead: the branch that runs into a limit later is not taken") {
  Robot robot = wrist_arm();
  robot.joints[5].lower = -1.0;  // J6
  robot.joints[5].upper = 4.0;
  Joints from(6), to(6);
  from << 0.2, 0.3, -0.4, 0.5, 0.8, 2.0;
  to << 0.6, 0.5, -0.6, 0.9, 1.0, 3.8;
  const auto tasks = tasks_along(robot, from, to, 100, TaskKind::pose);
  const InverseSolver solver(robot);
  // The other wrist: J4 and J6 half a turn on; its J6 would leave the range on the way.
  Joints seed = from;
  seed[3] -= M_PI;
  seed[4] = -seed[4];
  seed[5] -= M_PI;
  REQUIRE(reached(robot, seed).isApprox(reached(robot, from), 1e-9));
  seed[5] = -1.0;
  const Path path = solver.path(tasks, seed);
  CHECK(path.continuous());
  check_path(robot, tasks, path, {});
}

TEST_CASE("a path keeps clear of what is in the way") {
  const Robot robot = wrist_arm();
  Joints from(6), to(6);
  from << -0.6, 0.4, -0.3, 0.0, 0.8, 0.2;
  to << 0.6, 0.4, -0.3, 0.0, 0.8, 0.2;
  const auto tasks = tasks_along(robot, from, to, 40, TaskKind::torch);
  InverseOptions options;
  options.scene.capsules = {{"torch", "tool", {0, 0, -0.2}, {0, 0, -0.02}, 0.02}};
  Joints middle = 0.5 * (from + to);
  const Isometry3d T = reached(robot, middle);
  options.scene.obstacles = {{"ball", truing::Shape::sphere,
                              Isometry3d(Eigen::Translation3d(T * Vector3d(0.1, 0.0, -0.1))), Vector3d::Zero(), 0.04}};
  const InverseSolver solver(robot, options);
  const Path path = solver.path(tasks, from);
  check_path(robot, tasks, path, {});
  for (const Solution& s : path.solutions) {
    if (s.reached()) CHECK(truing::nearest_contact(options.scene, robot, s.joints).distance >= 0.0);
  }
}

TEST_CASE("effects go by the way along a path too") {
  Robot robot = wrist_arm();
  robot.effects.push_back({"backlash", {"J2"}, {{"backlash.J2", 1e-3}}});
  Joints from(6), to(6);
  from << 0.2, -0.3, -0.5, 0.4, 0.7, 0.1;
  to << 0.4, 0.4, -0.5, 0.4, 0.7, 0.1;
  const auto tasks = tasks_along(wrist_arm(), from, to, 30, TaskKind::pose);
  const InverseSolver solver(robot);
  const Path path = solver.path(tasks, from);
  CHECK(path.continuous());
  truing::Conditions up;
  up.direction = {0, 1, 0, 0, 0, 0};
  for (std::size_t k = 1; k < tasks.size(); ++k) {
    const Isometry3d T = solver.forward(path.solutions[k].joints, &up);
    CHECK((T.translation() - tasks[k].T_measurement_target.translation()).norm() < 1e-6);
  }
}

TEST_CASE("paths refuse bad options, and can be stopped") {
  const InverseSolver solver(ur());
  PathOptions options;
  options.rolls = 0;
  const Joints seed = solver.middle();
  CHECK_THROWS_AS(solver.path({}, seed, options), std::invalid_argument);
  CHECK(solver.path({}, seed).solutions.empty());
}
