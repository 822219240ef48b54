// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>

#include "inverse_kinematics/surroundings.hpp"
#include "support/inverse_arms.hpp"

using namespace inverse_arms;
using truing::InverseOptions;
using truing::InverseSolver;
using truing::Reason;
using truing::Scene;

namespace {

/// Capsules along the wrist arm's links.
Scene scene_of_wrist_arm() {
  Scene scene;
  scene.capsules = {{"pedestal", "base", {0, 0, 0}, {0, 0, 0.2}, 0.15},
                    {"upper arm", "J2", {-0.9, 0, 0}, {0, 0, 0}, 0.1},
                    {"forearm", "J4", {0, -0.8, 0}, {0, 0, 0}, 0.07},
                    {"torch", "tool", {0, 0, -0.2}, {0, 0, -0.02}, 0.02}};
  return scene;
}

/// Least distance over many points of both segments.
double sampled_distance(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  double least = 1e9;
  for (int i = 0; i <= 200; ++i) {
    for (int k = 0; k <= 200; ++k) least = std::min(least, (a + i / 200.0 * (b - a) - c - k / 200.0 * (d - c)).norm());
  }
  return least;
}

double sampled_box_distance(const Vector3d& a, const Vector3d& b, const Vector3d& half) {
  double least = 1e9;
  for (int i = 0; i <= 2000; ++i) {
    const Vector3d x = (a + i / 2000.0 * (b - a)).cwiseAbs() - half;
    least = std::min(least, x.maxCoeff() <= 0.0 ? x.maxCoeff() : x.cwiseMax(0.0).norm());
  }
  return least;
}

}  // namespace

TEST_CASE("distances of segments and boxes are those of their nearest points") {
  std::mt19937_64 random(1);
  const auto point = [&random](double size) {
    Vector3d p;
    for (int i = 0; i < 3; ++i) p[i] = size * (2.0 * static_cast<double>(random() >> 11) * 0x1.0p-53 - 1.0);
    return p;
  };
  for (int k = 0; k < 100; ++k) {
    const Vector3d a = point(1), b = point(1), c = point(1), d = point(1), half = point(0.5).cwiseAbs();
    CHECK(std::abs(truing::inverse_kinematics::segment_distance(a, b, c, d) - sampled_distance(a, b, c, d)) < 0.02);
    CHECK(truing::inverse_kinematics::segment_distance(a, b, c, d) <= sampled_distance(a, b, c, d) + 1e-12);
    const double box = truing::inverse_kinematics::segment_box_distance(a, b, half),
                 sampled = sampled_box_distance(a, b, half);
    CHECK(std::abs(box - sampled) < 2e-3);
    CHECK(box <= sampled + 1e-9);
  }
  const Vector3d o = Vector3d::Zero(), x = Vector3d::UnitX(), y = Vector3d::UnitY();
  CHECK(truing::inverse_kinematics::segment_distance(o, o, 2 * x, 3 * x) == doctest::Approx(2.0));  // a point
  CHECK(truing::inverse_kinematics::segment_distance(o, x, y, x + y) == doctest::Approx(1.0));      // parallel
  CHECK(truing::inverse_kinematics::segment_distance(o, x, 2 * x, 3 * x) == doctest::Approx(1.0));  // on one line
  CHECK(truing::inverse_kinematics::segment_distance(-x, x, -y, y) == doctest::Approx(0.0));        // crossing
  CHECK(truing::inverse_kinematics::segment_box_distance(2 * x, 3 * x, Vector3d::Ones()) == doctest::Approx(1.0));
  CHECK(truing::inverse_kinematics::segment_box_distance(o, 3 * x, Vector3d::Ones()) == doctest::Approx(-1.0));
}

TEST_CASE("an answer that collides is none: another branch is taken, or the pair is named with its depth") {
  const Robot robot = wrist_arm();
  Joints q(6);
  q << 0.3, 0.4, -0.3, 0.5, 0.8, 0.2;
  const Task task = task_at(reached(robot, q));
  const Eigen::VectorXd nearby = q;
  InverseOptions options;
  options.scene = scene_of_wrist_arm();
  const Vector3d wrist = truing::forward_kinematics(robot, nearby)[3].translation();
  SUBCASE("free") {
    const InverseSolver solver(robot, options);
    const Solution solution = solver.solve(task, q);
    CHECK(solution.reached());
    CHECK(solution.contact_distance > 0.0);
    CHECK(solution.contact_distance ==
          doctest::Approx(truing::nearest_contact(options.scene, robot, solution.joints).distance));
  }
  SUBCASE("a ball at the elbow leaves other ways") {
    const Vector3d elbow = truing::forward_kinematics(robot, nearby)[1].translation();
    options.scene.obstacles = {
        {"ball", truing::Shape::sphere, Isometry3d(Eigen::Translation3d(elbow)), Vector3d::Zero(), 0.05}};
    const InverseSolver solver(robot, options), blind(robot);
    CHECK(truing::nearest_contact(options.scene, robot, nearby).distance < 0.0);
    CHECK((blind.solve(task, q).joints - q).norm() < 1e-6);
    const Solution solution = solver.solve(task, q);
    REQUIRE(solution.reached());
    CHECK(holds(robot, task, solution));
    CHECK(truing::nearest_contact(options.scene, robot, solution.joints).distance > 0.0);
    CHECK((solution.joints - q).norm() > 0.1);
  }
  SUBCASE("a ball at the target leaves none") {
    options.scene.obstacles = {{"ball", truing::Shape::sphere,
                                Isometry3d(Eigen::Translation3d(task.T_measurement_target.translation())),
                                Vector3d::Zero(), 0.05}};
    options.scene.ignored = {{"forearm", "ball"}, {"upper arm", "ball"}};
    const InverseSolver solver(robot, options);
    const Solution solution = solver.solve(task, q);
    CHECK(solution.reason == Reason::collision);
    CHECK(solution.contact_distance == doctest::Approx(-0.05));
    CHECK(solver.describe(solution) == "torch and ball are 50 mm in each other");
  }
  CHECK(wrist.allFinite());
}

TEST_CASE("a target that collides is moved back by the least that frees it, and the result says so") {
  const Robot robot = perturbed(wrist_arm(), 1e-3, 1e-3, 3);
  Joints q(6);
  q << 0.3, 0.4, -0.3, 0.5, 0.8, 0.2;
  Task task = task_at(reached(robot, q));
  InverseOptions options;
  options.scene = scene_of_wrist_arm();
  options.scene.clearance = 0.005;
  // A plate across the torch, its face 10 mm behind the torch's end: 20 mm radius, 5 mm clearance, 20 mm from the end
  // to the point.
  Isometry3d T_plate = task.T_measurement_target;
  T_plate.translation() += T_plate.linear() * Vector3d(0, 0, -0.03 + 0.05);
  options.scene.obstacles = {{"plate", truing::Shape::box, T_plate, {0.4, 0.4, 0.1}, 0.0}};
  options.scene.ignored = {{"forearm", "plate"}, {"upper arm", "plate"}};
  CHECK(InverseSolver(robot, options).solve(task, q).reason == Reason::collision);
  task.longest_retreat = 0.1;
  const InverseSolver solver(robot, options);
  const Solution solution = solver.solve(task, q);
  REQUIRE(solution.reason == Reason::retreated);
  CHECK(solution.retreat == doctest::Approx(0.035).scale(0).epsilon(0.003));
  CHECK(truing::nearest_contact(options.scene, robot, solution.joints).distance >= 0.005 - 1e-6);
  Task moved = task;
  moved.T_measurement_target.translation() -= solution.retreat * task.T_measurement_target.linear().col(2);
  CHECK(holds(robot, moved, solution));
  task.longest_retreat = 0.02;
  CHECK(solver.solve(task, q).reason == Reason::collision);
}

TEST_CASE("links collide with each other, but not with their neighbours") {
  const Robot robot = wrist_arm();
  Scene scene = scene_of_wrist_arm();
  Joints folded(6), open(6);
  folded << 0.0, -1.2, 1.2, 0.0, 1.2, 0.0;
  open << 0.0, 0.3, -0.3, 0.0, 0.5, 0.0;
  CHECK(truing::nearest_contact(scene, robot, open).distance > 0.0);
  scene.capsules.push_back({"sword", "tool", {0, 0, 0}, {0, 0, 3.0}, 0.01});
  bool touched = false;
  for (double q5 = -3.1; q5 < 3.1; q5 += 0.05) {
    Joints q = open;
    q[4] = q5;
    const auto contact = truing::nearest_contact(scene, robot, q);
    CHECK(contact.first != contact.second);
    touched = touched || contact.distance < 0.0;
  }
  CHECK(touched);
}

TEST_CASE("a scene that makes no sense is one clear error") {
  const Robot robot = wrist_arm();
  const auto complaint = [&robot](const Scene& scene) -> std::string {
    try {
      truing::validate(scene, robot);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  Scene scene = scene_of_wrist_arm();
  CHECK(complaint(scene).empty());
  scene.capsules[1].link = "J9";
  CHECK(complaint(scene).find("J9") != std::string::npos);
  scene = scene_of_wrist_arm();
  scene.obstacles = {{"torch", truing::Shape::sphere, Isometry3d::Identity(), Vector3d::Zero(), 0.1}};
  CHECK(complaint(scene).find("twice") != std::string::npos);
  scene.obstacles[0].name = "ball";
  scene.obstacles[0].radius = 0.0;
  CHECK(complaint(scene).find("more than zero") != std::string::npos);
  scene.obstacles[0].radius = 0.1;
  scene.ignored = {{"ball", "nothing"}};
  CHECK(complaint(scene).find("nothing") != std::string::npos);
}
