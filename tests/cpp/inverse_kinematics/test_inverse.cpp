// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Inverse kinematics against forward kinematics: what is claimed to be reached is looked at again by
// forward_kinematics, which shares no code with the solver.

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "support/contains.hpp"
#include "support/inverse_arms.hpp"

using namespace arms;
using namespace inverse_arms;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using truing::Branches;
using truing::InverseOptions;
using truing::InverseSolver;
using truing::Joints;
using truing::Reason;
using truing::Solution;
using truing::Task;
using truing::TaskKind;

namespace {

std::string complaint(const InverseSolver& solver, const Task& task, const Joints& seed) {
  try {
    solver.solve(task, seed);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

double turns_apart(const Joints& a, const Joints& b) {
  double most = 0.0;
  for (Eigen::Index k = 0; k < a.size(); ++k) most = std::max(most, std::abs(std::remainder(a[k] - b[k], 2 * M_PI)));
  return most;
}

bool has(const Branches& found, const Joints& q, double tolerance) {
  for (int k = 0; k < found.count; ++k) {
    if (turns_apart(found.solution[static_cast<std::size_t>(k)].joints, q) < tolerance) return true;
  }
  return false;
}

}  // namespace

// ---- Forward --------------------------------------------------------------------------------------------------------

TEST_CASE("the compiled arm is forward_kinematics, in every convention, with ratios, zeros, rails and passive joints") {
  for (Robot robot : {ur10(), wrist_arm(), palletizer(), rail_arm(), urdf_arm(), gantry(), as_urdf(ur10())}) {
    CAPTURE(robot.name);
    robot = perturbed(robot, 1e-2, 1e-2, 3);
    robot.T_measurement_base = somewhere();
    robot.joints[1].ratio = 1.003;
    for (Joint& j : robot.joints) {
      j.offset = 0.01;
      j.beta = 0.002;
    }
    robot.targets.push_back({"second", truing::frame_from_xyz_rpy({0.1, 0.2, -0.3}, {1.0, 0.2, 0.3})});
    for (const std::size_t target : {0u, 1u}) {
      const InverseSolver solver(robot, {}, {}, target);
      Sampler sampler(robot, 5);
      for (int k = 0; k < 20; ++k) {
        const Joints q = sampler.joints();
        CHECK((solver.forward(q).matrix() - truing::forward_kinematics(robot, q, target).back().matrix())
                  .cwiseAbs()
                  .maxCoeff() < 1e-12);
      }
    }
  }
}

TEST_CASE("its Jacobian is the derivative") {
  for (const Robot& robot : {ur10(), palletizer(), rail_arm(), urdf_arm(), gantry()}) {
    CAPTURE(robot.name);
    const InverseSolver solver(robot);
    Sampler sampler(robot, 6);
    const Joints q = sampler.joints();
    truing::TipJacobian J;
    const Isometry3d T = solver.forward(q, &J);
    REQUIRE(J.cols() == q.size());
    for (Eigen::Index k = 0; k < q.size(); ++k) {
      constexpr double h = 1e-6;
      Joints low = q, high = q;
      low[k] -= h;
      high[k] += h;
      const Isometry3d a = solver.forward(low), b = solver.forward(high);
      const Vector3d linear = (b.translation() - a.translation()) / (2 * h);
      const Matrix3d spin = (b.linear() - a.linear()) / (2 * h) * T.linear().transpose();
      CHECK((J.col(k).head<3>() - linear).norm() < 1e-8);
      CHECK((J.col(k).tail<3>() - Vector3d(spin(2, 1), spin(0, 2), spin(1, 0))).norm() < 1e-8);
    }
  }
}

// ---- Branches -------------------------------------------------------------------------------------------------------

TEST_CASE("closed forms are found from the axes, whatever convention they are written in, and with rails before them") {
  CHECK(InverseSolver(ur()).closed_form() == truing::ClosedFormKind::three_parallel);
  CHECK(InverseSolver(as_urdf(ur())).closed_form() == truing::ClosedFormKind::three_parallel);
  CHECK(InverseSolver(wrist_arm()).closed_form() == truing::ClosedFormKind::spherical_wrist);
  CHECK(InverseSolver(as_urdf(wrist_arm())).closed_form() == truing::ClosedFormKind::spherical_wrist);
  CHECK(InverseSolver(gantry()).closed_form() == truing::ClosedFormKind::spherical_wrist);
  CHECK(InverseSolver(perturbed(wrist_arm(), 1e-3, 1e-3, 1)).closed_form() == truing::ClosedFormKind::spherical_wrist);
  CHECK(InverseSolver(palletizer()).closed_form() == truing::ClosedFormKind::none);
  Robot offset_wrist = wrist_arm();
  offset_wrist.joints[4].a = 0.1;
  CHECK(InverseSolver(offset_wrist).closed_form() == truing::ClosedFormKind::none);
}

TEST_CASE("all branches of nominal arms: each is right, the target's own is among them, and conventions agree") {
  for (const Robot& robot : {ur(), wrist_arm()}) {
    CAPTURE(robot.name);
    const InverseSolver solver(robot), other(as_urdf(robot));
    Sampler sampler(robot, 7);
    int most = 0;
    for (int k = 0; k < 100; ++k) {
      const Joints truth = sampler.joints();
      const Task task = task_at(reached(robot, truth));
      Branches found, same;
      solver.branches(task, solver.middle(), &found);
      other.branches(task, solver.middle(), &same);
      REQUIRE(found.count > 0);
      CHECK(found.count <= 8);
      CHECK(found.count == same.count);
      most = std::max(most, found.count);
      for (int i = 0; i < found.count; ++i) CHECK(holds(robot, task, found.solution[static_cast<std::size_t>(i)]));
      CHECK(has(found, truth, 1e-6));
    }
    CHECK(most >= (robot.name == "ur10" ? 8 : 6));
  }
}

TEST_CASE("shoulders of the other three kinds have their branches too") {
  // Axes 1 and 2 meet; axes 2 and 3 meet; axes 1 and 2 are parallel. Axes 2 and 3 are never parallel.
  Robot meet_12 = wrist_arm(), meet_23 = wrist_arm(), parallel_12 = wrist_arm();
  meet_12.joints[0].a = 0.0;
  meet_12.joints[1].alpha = 0.5;
  meet_23.joints[1].a = 0.0;
  meet_23.joints[1].alpha = 0.9;
  parallel_12.joints[0].alpha = 0.0;
  parallel_12.joints[1].alpha = -1.2;
  for (Robot robot : {meet_12, meet_23, parallel_12}) {
    for (Joint& j : robot.joints) {
      j.lower = -M_PI;
      j.upper = M_PI;
    }
    const InverseSolver solver(robot);
    REQUIRE(solver.closed_form() == truing::ClosedFormKind::spherical_wrist);
    Sampler sampler(robot, 8);
    for (int k = 0; k < 50; ++k) {
      const Joints truth = sampler.joints();
      const Task task = task_at(reached(robot, truth));
      Branches found;
      solver.branches(task, solver.middle(), &found);
      for (int i = 0; i < found.count; ++i) CHECK(holds(robot, task, found.solution[static_cast<std::size_t>(i)]));
      CHECK(has(found, truth, 1e-6));
    }
  }
}

TEST_CASE("a parallelogram's passive joint on the next joint's axis leaves the closed form as it is") {
  // J3 is held in space: its link turns by q3 - q2.
  Robot robot = wrist_arm();
  Joint passive = joint("P", 0, 0, 0, 0);
  passive.driven_by = {{"J2", -1.0}};
  robot.joints.insert(robot.joints.begin() + 2, passive);
  for (Joint& j : robot.joints) {
    j.lower = -3.0;
    j.upper = 3.0;
  }
  const InverseSolver solver(robot);
  REQUIRE(solver.closed_form() == truing::ClosedFormKind::spherical_wrist);
  Sampler sampler(robot, 9);
  for (int k = 0; k < 50; ++k) {
    const Joints truth = sampler.joints();
    const Task task = task_at(reached(robot, truth));
    Branches found;
    solver.branches(task, solver.middle(), &found);
    for (int i = 0; i < found.count; ++i) CHECK(holds(robot, task, found.solution[static_cast<std::size_t>(i)]));
    CHECK(has(found, truth, 1e-6));
  }
}

TEST_CASE("a calibrated arm has the branches that a general search finds") {
  InverseOptions search;  // no closed form: descents from everywhere
  search.wrist_tolerance = search.parallel_tolerance = 0.0;
  search.max_restarts = 60;
  for (const Robot& nominal : {ur(), wrist_arm()}) {
    CAPTURE(nominal.name);
    Robot robot = perturbed(nominal, 1e-3, 1e-3, 11);
    for (Joint& j : robot.joints) {
      j.lower = -M_PI;
      j.upper = M_PI;
    }
    const InverseSolver solver(robot), general(robot, search);
    REQUIRE(general.closed_form() == truing::ClosedFormKind::none);
    Sampler sampler(robot, 12);
    for (int k = 0; k < 15; ++k) {
      const Task task = task_at(reached(robot, sampler.joints()));
      Branches found, all;
      solver.branches(task, solver.middle(), &found);
      general.branches(task, solver.middle(), &all);
      for (int i = 0; i < found.count; ++i)
        CHECK(holds(robot, task, found.solution[static_cast<std::size_t>(i)], 1e-9, 1e-9));
      for (int i = 0; i < all.count; ++i) CHECK(has(found, all.solution[static_cast<std::size_t>(i)].joints, 1e-4));
    }
  }
}

// ---- One answer -----------------------------------------------------------------------------------------------------

TEST_CASE("every reachable pose is reached from a random seed, and never claimed when it is not") {
  for (const Robot& nominal : {ur(), wrist_arm(), gantry(), as_urdf(gantry())}) {
    for (const bool calibrated : {false, true}) {
      const Robot robot = calibrated ? perturbed(nominal, 1e-3, 1e-3, 13) : nominal;
      CAPTURE(robot.name);
      const InverseSolver solver(robot);
      Sampler sampler(robot, 14);
      for (int k = 0; k < 100; ++k) {
        const Task task = task_at(reached(robot, sampler.joints()));
        const Solution solution = solver.solve(task, sampler.joints());
        CHECK(solution.reached());
        CHECK(holds(robot, task, solution));
      }
    }
  }
}

TEST_CASE("robots without closed form: four joints and a coupled one, a rail, any axes") {
  for (const Robot& robot : {palletizer(), rail_arm(), urdf_arm()}) {
    CAPTURE(robot.name);
    const InverseSolver solver(robot);
    Sampler sampler(robot, 15);
    for (int k = 0; k < 50; ++k) {
      Joints truth = sampler.joints();
      if (robot.name == "palletizer" && std::abs(truth[1] + truth[2]) > 1.2) continue;  // the passive joint's limit
      const Task task = task_at(reached(robot, truth));
      const Solution solution = solver.solve(task, sampler.joints());
      CHECK(solution.reached());
      CHECK(holds(robot, task, solution));
      if (robot.name == "palletizer") CHECK(std::abs(solution.joints[1] + solution.joints[2]) <= 1.2);
    }
  }
}

TEST_CASE("the nearest turn within the limits is taken") {
  const Robot robot = ur();
  const InverseSolver solver(robot);
  Sampler sampler(robot, 16);
  for (int k = 0; k < 100; ++k) {
    const Joints truth = sampler.joints();
    const Solution solution = solver.solve(task_at(reached(robot, truth)), truth);
    REQUIRE(solution.reached());
    CHECK((solution.joints - truth).cwiseAbs().maxCoeff() < 1e-6);
  }
}

TEST_CASE("targets that need a joint at its very limit are reached, within it") {
  for (const Robot& nominal : {wrist_arm(), gantry()}) {
    for (const bool calibrated : {false, true}) {
      const Robot robot = calibrated ? perturbed(nominal, 1e-3, 1e-3, 17) : nominal;
      const InverseSolver solver(robot);
      Sampler sampler(robot, 18);
      const auto driven = robot.driven_joints();
      for (int k = 0; k < 60; ++k) {
        Joints truth = sampler.joints();
        const auto at = static_cast<std::size_t>(k) % driven.size();
        truth[static_cast<Eigen::Index>(at)] = k % 2 ? robot.joints[driven[at]].lower : robot.joints[driven[at]].upper;
        const Task task = task_at(reached(robot, truth));
        const Solution solution = solver.solve(task, truth);
        CHECK(solution.reached());
        CHECK(holds(robot, task, solution));
      }
    }
  }
}

TEST_CASE("singular targets are reached: wrist straight, arm stretched, wrist above the first axis") {
  for (const bool calibrated : {false, true}) {
    const Robot robot = calibrated ? perturbed(ur(), 1e-3, 1e-3, 19) : ur();
    const InverseSolver solver(robot);
    for (const double tiny : {0.0, 1e-9, 1e-6, 1e-3}) {
      Joints wrist(6), stretched(6), both(6);
      wrist << 0.3, -1.0, 1.2, 0.4, tiny, 0.7;
      stretched << 0.3, -1.0, tiny, 0.4, 0.9, 0.7;
      both << 0.3, -1.0, tiny, 0.4, tiny, 0.7;
      for (const Joints& truth : {wrist, stretched, both}) {
        const Task task = task_at(reached(robot, truth));
        for (const double off : {0.0, 0.5}) {
          const Solution solution = solver.solve(task, (truth.array() + off).matrix());
          CHECK(solution.reached());
          CHECK(holds(robot, task, solution));
        }
      }
    }
  }
}

// ---- Tasks ----------------------------------------------------------------------------------------------------------

TEST_CASE("a torch's axis is met in the tool's frame, whichever way the roll goes") {
  // A mask of the rotation about z acts in the base's frame elsewhere, and success is claimed with the axis 0.2 to 0.33
  // rad off.
  for (const Robot& nominal : {ur(), wrist_arm(), gantry()}) {
    const Robot robot = perturbed(nominal, 1e-3, 1e-3, 21);
    const InverseSolver solver(robot);
    Sampler sampler(robot, 22);
    for (int k = 0; k < 100; ++k) {
      Task task = task_at(reached(robot, sampler.joints()), TaskKind::torch);
      task.axis = Vector3d(0.6, 0.0, 0.8);
      task.T_measurement_target.linear() *= Eigen::AngleAxisd(sampler.uniform(-3, 3), task.axis).toRotationMatrix();
      const Solution solution = solver.solve(task, sampler.joints());
      CHECK(solution.reached());
      CHECK(holds(robot, task, solution));
      const Matrix3d rolled =
          task.T_measurement_target.linear() * Eigen::AngleAxisd(solution.roll, task.axis).toRotationMatrix();
      CHECK(turn_between(rolled, reached(robot, solution.joints).linear()) < 1e-5);
    }
  }
}

TEST_CASE("a window of roll is kept, across half a turn too") {
  const Robot robot = gantry();
  const InverseSolver solver(robot);
  Sampler sampler(robot, 23);
  for (int k = 0; k < 60; ++k) {
    Task task = task_at(reached(robot, sampler.joints()), TaskKind::torch);
    const double middle = sampler.uniform(-3, 3);
    task.roll = {middle - 0.2, middle + 0.2};
    task.T_measurement_target.linear() *= Eigen::AngleAxisd(-middle, Vector3d::UnitZ()).toRotationMatrix();
    const Solution solution = solver.solve(task, sampler.joints());
    CHECK(solution.reached());
    CHECK(holds(robot, task, solution));
    CHECK(std::abs(std::remainder(solution.roll - middle, 2 * M_PI)) <= 0.2 + 1e-9);
  }
}

TEST_CASE("lead and work angles are inequalities that hold to the last digit") {
  // A cone constraint elsewhere leaves up to 6e-4 rad.
  const Robot robot = perturbed(wrist_arm(), 1e-3, 1e-3, 24);
  const InverseSolver solver(robot);
  Sampler sampler(robot, 25);
  for (int k = 0; k < 60; ++k) {
    Task task = task_at(reached(robot, sampler.joints()), TaskKind::torch);
    task.lead = {0.1, 0.2};
    task.work = {-0.15, 0.0};
    // The wanted frame leans back, so that what was reached lies in the window's middle.
    const Vector3d leant = Vector3d(std::tan(0.15), std::tan(-0.075), 1.0).normalized();
    task.T_measurement_target.linear() *=
        Eigen::Quaterniond::FromTwoVectors(leant, Vector3d::UnitZ()).toRotationMatrix();
    const Solution solution = solver.solve(task, sampler.joints());
    CHECK(solution.reached());
    CHECK(holds(robot, task, solution));
    const Vector3d a = task.T_measurement_target.linear().transpose() * reached(robot, solution.joints).linear().col(2);
    const double lead = std::atan2(a.x(), a.z()), work = std::atan2(a.y(), a.z());
    CHECK(lead >= 0.1);
    CHECK(lead <= 0.2);
    CHECK(work >= -0.15);
    CHECK(work <= 0.0);
  }
}

TEST_CASE("a point is reached whatever the orientation") {
  const Robot robot = palletizer();
  const InverseSolver solver(robot);
  Sampler sampler(robot, 26);
  for (int k = 0; k < 60; ++k) {
    const Joints truth = sampler.joints();
    if (std::abs(truth[1] + truth[2]) > 1.2) continue;  // the passive joint's limit
    Task task = task_at(reached(robot, truth), TaskKind::point);
    task.T_measurement_target.linear() = somewhere().linear();
    const Solution solution = solver.solve(task, sampler.joints());
    if (solution.reached()) CHECK(holds(robot, task, solution));
    CHECK(solution.reached());
  }
}

TEST_CASE("prismatic joints are never taken for turning ones") {
  // Rails of 20 m wrapped by 2 pi end somewhere else.
  Robot robot = gantry();
  for (int k = 0; k < 3; ++k) {
    robot.joints[k].lower = -20.0;
    robot.joints[k].upper = 20.0;
  }
  const InverseSolver solver(robot);
  Sampler sampler(robot, 27);
  for (int k = 0; k < 60; ++k) {
    const Joints truth = sampler.joints();
    const Task task = task_at(reached(robot, truth));
    const Solution solution = solver.solve(task, truth);
    REQUIRE(solution.reached());
    CHECK((solution.joints.head(3) - truth.head(3)).norm() < 1e-6);
    CHECK(holds(robot, task, solver.solve(task, sampler.joints())));
  }
}

TEST_CASE("a robot of prismatic joints alone is as good as any") {
  Robot robot;
  robot.joints = {joint("X", 0, 0, 0, -M_PI / 2), joint("Y", M_PI / 2, 0, 0, M_PI / 2), joint("Z", 0, 0, 0, 0)};
  for (Joint& j : robot.joints) {
    j.type = JointType::prismatic;
    j.lower = 0.0;
    j.upper = 3.0;
  }
  const InverseSolver solver(robot);
  const Joints truth = Vector3d(1.0, 2.0, 0.5);
  const Solution solution = solver.solve(task_at(reached(robot, truth)), solver.middle());
  REQUIRE(solution.reached());
  CHECK((solution.joints - truth).norm() < 1e-9);
}

TEST_CASE("a portal reaches across its hall, however short its wrist is") {
  Robot robot;
  robot.convention = Convention::urdf;
  const auto axis = [&robot](const char* name, JointType type, int along, double range) {
    Joint j;
    j.name = name;
    j.type = type;
    j.axis = Vector3d::Unit(along);
    j.lower = -range;
    j.upper = range;
    robot.joints.push_back(j);
  };
  for (int k = 0; k < 3; ++k) axis(k == 0 ? "X" : k == 1 ? "Y" : "Z", JointType::prismatic, k, 20.0);
  for (int k = 0; k < 3; ++k) axis(k == 0 ? "A" : k == 1 ? "B" : "C", JointType::revolute, k, 3.1);
  robot.targets = {{"tool", truing::frame_from_xyz_rpy({0.0, 0.0, 0.1}, {0.0, 0.0, 0.0})}};
  const InverseSolver solver(robot);
  Sampler sampler(robot, 16);
  for (int k = 0; k < 300; ++k) {
    Task task = task_at(reached(robot, sampler.joints()));
    const Joints seed = sampler.joints();
    for (const TaskKind kind : {TaskKind::pose, TaskKind::torch, TaskKind::point}) {
      task.kind = kind;
      const Solution solution = solver.solve(task, seed);
      CHECK(solution.reached());
      CHECK(holds(robot, task, solution));
      if (kind == TaskKind::point) CHECK(solution.iterations < 20);  // from the first seed
    }
  }
}

TEST_CASE("an arm on a rail that comes to its end keeps its configuration") {
  // Clamping flips it elsewhere: here the error goes to the joints that still can move.
  Robot robot = gantry();
  robot.joints[0].upper = 5.2;
  const InverseSolver solver(robot);
  Joints q(9);
  q << 5.0, 2.0, 1.0, 0.3, 0.4, -0.3, 0.5, 0.8, 0.2;
  Isometry3d T = reached(robot, q);
  const Vector3d along = (reached(robot, q + Joints::Unit(9, 0)).translation() - T.translation()).normalized();
  double longest = 0.0;
  for (int k = 0; k < 120; ++k) {
    T.translation() += 0.005 * along;
    const Solution solution = solver.follow(task_at(T), q);
    REQUIRE(solution.reached());
    CHECK(holds(robot, task_at(T), solution));
    longest = std::max(longest, (solution.joints - q).tail(6).cwiseAbs().maxCoeff());
    q = solution.joints;
  }
  CHECK(q[0] == doctest::Approx(5.2));
  CHECK(longest < 0.05);
}

// ---- Effects --------------------------------------------------------------------------------------------------------

namespace {

struct Loaded {
  Robot robot;
  truing::Conditions conditions;
};

/// A UR10 that has about everything, and what its effects look at.
Loaded loaded_ur() {
  Loaded out{perturbed(ur(), 1e-3, 1e-3, 31), {}};
  auto add = [&](const std::string& effect, std::vector<std::string> joints, std::map<std::string, double> parameters) {
    out.robot.effects.push_back({effect, std::move(joints), std::move(parameters)});
  };
  add("backlash", {"J1", "J2"}, {{"backlash.J1", 3e-4}, {"backlash.J2", 5e-4}});
  add("joint_compliance", {"J2", "J3"}, {{"joint_compliance.J2", 2e-5}, {"joint_compliance.J3", 3e-5}});
  add("link_compliance", {"J2"}, {{"link_compliance.J2.ry", 1e-5}, {"link_compliance.J2.rz", 1e-5}});
  add("gravity_backlash", {"J3"}, {{"gravity_backlash.J3", 1e-4}});
  add("harmonic", {"J2"},
      {{"harmonic.J2.cos1", 1e-3},
       {"harmonic.J2.sin1", -5e-4},
       {"harmonic.J2.cos2", 2e-4},
       {"harmonic.J2.sin2", 1e-4}});
  add("transmission_error@24", {"J1"},
      {{"transmission_error@24.J1.cos", 1e-4}, {"transmission_error@24.J1.sin", 2e-4}});
  add("thermal", {"J3"}, {{"thermal.J3", 2e-5}, {"thermal.reference_C", 22.0}});
  add("drift", {}, {{"drift.base.x", 1e-7}, {"drift.base.rz", 1e-8}, {"drift.reference_s", 100.0}});
  add("joint_coupling", {}, {{"joint_coupling.J6.J4", 1e-3}});
  add("axis_wobble", {"J1"}, {{"axis_wobble.J1.cos_x", 1e-4}});
  add("scale", {}, {{"scale", 1e-4}});
  out.conditions.direction = {1, -1, 1, 1, -1, 1};
  out.conditions.payload = 4.0;
  out.conditions.temperature = 30.0;
  out.conditions.time = 1000.0;
  return out;
}

/// What `predict` says of these joints.
Isometry3d predicted(const Robot& robot, const Joints& q, const truing::Conditions& conditions) {
  Table table(1);
  for (Eigen::Index k = 0; k < q.size(); ++k) table.data.joints.push_back(table.add({q[k]}));
  for (const int direction : conditions.direction)
    table.data.direction.push_back(table.add({static_cast<double>(direction)}));
  table.data.payload = table.add({conditions.payload});
  if (std::isfinite(conditions.temperature)) table.data.temperature = table.add({conditions.temperature});
  if (std::isfinite(conditions.time)) table.data.time = table.add({conditions.time});
  const truing::Prediction p = truing::predict(robot, table.data);
  Isometry3d T = Isometry3d::Identity();
  T.translation() = p.position.row(0);
  T.linear() = Eigen::Quaterniond(p.orientation(0, 0), p.orientation(0, 1), p.orientation(0, 2), p.orientation(0, 3))
                   .toRotationMatrix();
  return T;
}

}  // namespace

TEST_CASE("effects in the inverse are those of predict") {
  const Loaded loaded = loaded_ur();
  const InverseSolver solver(loaded.robot, {}, loaded.conditions);
  Sampler sampler(loaded.robot, 32);
  double least_effect = 1e9;
  for (int k = 0; k < 30; ++k) {
    const Joints q = sampler.joints();
    const Isometry3d T = predicted(loaded.robot, q, loaded.conditions);
    CHECK((solver.forward(q).matrix() - T.matrix()).cwiseAbs().maxCoeff() < 1e-10);
    least_effect = std::min(least_effect, (reached(loaded.robot, q).translation() - T.translation()).norm());
    for (const Joints& seed : {q, sampler.joints()}) {
      const Solution solution = solver.solve(task_at(T), seed);
      REQUIRE(solution.reached());
      const Isometry3d again = predicted(loaded.robot, solution.joints, loaded.conditions);
      CHECK((again.translation() - T.translation()).norm() < 1e-9);
      CHECK(turn_between(again.linear(), T.linear()) < 1e-8);  // the angle of nearly equal quaternions
    }
  }
  CHECK(least_effect > 1e-5);
}

TEST_CASE("effects at a second target, and with rails and passive joints, are those of predict too") {
  Robot robot = palletizer();
  for (Joint& j : robot.joints) {
    j.lower = -1.5;
    j.upper = 1.5;
  }
  robot.effects = {
      {"joint_compliance", {"J2"}, {{"joint_compliance.J2", 1e-6}}},
      {"linkage",
       {"J4"},
       {{"linkage.J4.rods_first", 1e-3}, {"linkage.J4.arms_first", 5e-4}, {"linkage.J4.phase_first", 1.5}}}};
  const InverseSolver solver(robot);
  Sampler sampler(robot, 33);
  for (int k = 0; k < 20; ++k) {
    Joints q = 0.5 * sampler.joints();
    const Isometry3d T = predicted(robot, q, {});
    CHECK((solver.forward(q).matrix() - T.matrix()).cwiseAbs().maxCoeff() < 1e-10);
    const Solution solution = solver.solve(task_at(T), solver.middle());
    REQUIRE(solution.reached());
    CHECK((predicted(robot, solution.joints, {}).translation() - T.translation()).norm() < 1e-9);
  }
}

TEST_CASE("backlash goes by the way from the seed, where nobody says otherwise") {
  Robot robot = wrist_arm();
  robot.effects = {{"backlash", {"J1", "J2"}, {{"backlash.J1", 1e-3}, {"backlash.J2", 2e-3}}}};
  const InverseSolver solver(robot);
  Joints q(6), below(6), above(6);
  q << 0.3, 0.4, -0.3, 0.5, 0.8, 0.2;
  below = q.array() - 0.1;
  above = q.array() + 0.1;
  const Task task = task_at(reached(robot, q));
  for (const bool rising : {true, false}) {
    const Solution solution = solver.solve(task, rising ? below : above);
    REQUIRE(solution.reached());
    truing::Conditions conditions;
    conditions.direction.assign(6, rising ? 1 : -1);
    CHECK(
        (predicted(robot, solution.joints, conditions).translation() - task.T_measurement_target.translation()).norm() <
        1e-9);
    CHECK(solution.joints[1] == doctest::Approx(q[1] + (rising ? -1e-3 : 1e-3)).scale(0).epsilon(1e-6));
  }
}

TEST_CASE("an input that effects lack is named") {
  Robot robot = wrist_arm();
  robot.effects = {{"thermal", {"J2"}, {{"thermal.J2", 1e-5}, {"thermal.reference_C", 20.0}}}};
  CHECK_THROWS_WITH_AS(InverseSolver{robot}, doctest::Contains("temp_C"), std::invalid_argument);
}

// ---- Why not --------------------------------------------------------------------------------------------------------

TEST_CASE("out of reach: by how much, in which direction, and the nearest that can be reached") {
  for (const Robot& nominal : {ur(), gantry()}) {
    for (const bool calibrated : {false, true}) {
      const Robot robot = calibrated ? perturbed(nominal, 1e-3, 1e-3, 41) : nominal;
      CAPTURE(robot.name);
      const InverseSolver solver(robot);
      Sampler sampler(robot, 42);
      const Vector3d far(20.0, 0.0, 0.0);
      Task task = task_at(reached(robot, sampler.joints()));
      task.T_measurement_target.translation() = far;
      const Solution solution = solver.solve(task, sampler.joints());
      CHECK_FALSE(solution.reached());
      CHECK((solution.reason == Reason::out_of_reach || solution.reason == Reason::limit));
      CHECK(within_limits(robot, solution.joints));
      const Vector3d way = far - reached(robot, solution.joints).translation();
      CHECK(solution.miss == doctest::Approx(way.norm()).scale(0).epsilon(1e-6));
      CHECK(solution.direction.dot(way.normalized()) == doctest::Approx(1.0).scale(0).epsilon(1e-9));
      if (robot.name != "gantry") {
        CHECK(solution.reason == Reason::out_of_reach);
        CHECK(contains(solver.describe(solution), "out of reach by 1"));
        CHECK(solution.miss < 19.2);
        CHECK(solution.miss > 18.4);
      } else {
        CHECK(solution.reason == Reason::limit);
        CHECK(contains(solver.describe(solution), "X would have to go"));
      }
    }
  }
}

TEST_CASE("a limit that stands in the way is named, with how far it is exceeded") {
  Robot robot = wrist_arm();
  Joints q(6);
  q << 0.3, 0.4, -0.3, 0.5, 0.8, 0.2;
  const Task task = task_at(reached(robot, q));
  robot.joints[1].upper = 0.3;
  robot.joints[0].lower = -1.0;  // no way round by turning the shoulder about
  robot.joints[0].upper = 1.0;
  const InverseSolver solver(robot);
  const Solution solution = solver.solve(task, solver.middle());
  CHECK(solution.reason == Reason::limit);
  CHECK(solution.joint == 1);
  CHECK(solution.excess == doctest::Approx(0.1).scale(0).epsilon(1e-3));
  CHECK(within_limits(robot, solution.joints));
  CHECK(contains(solver.describe(solution), "J2 would have to go 0.1 rad beyond its limit"));
}

TEST_CASE("the flag of success is of the joints that are returned: random targets with narrow limits") {
  Robot robot = perturbed(wrist_arm(), 1e-3, 1e-3, 43);
  Sampler everywhere(robot, 44);
  std::vector<Joints> truths;
  for (int k = 0; k < 60; ++k) truths.push_back(everywhere.joints());
  for (Joint& j : robot.joints) {
    j.lower *= 0.5;
    j.upper *= 0.5;
  }
  const InverseSolver solver(robot);
  int good = 0;
  for (const Joints& truth : truths) {
    const Task task = task_at(reached(robot, truth));
    const Solution solution = solver.solve(task, solver.middle());
    CHECK(within_limits(robot, solution.joints));
    CHECK(solution.reached() == holds(robot, task, solution));
    good += solution.reached();
  }
  CHECK(good > 5);
  CHECK(good < 55);
}

// ---- Bad input, threads ---------------------------------------------------------------------------------------------

TEST_CASE("bad input is one clear error") {
  const Robot robot = wrist_arm();
  const InverseSolver solver(robot);
  const Joints seed = solver.middle();
  Task task = task_at(reached(robot, seed));
  CHECK(complaint(solver, task, seed).empty());
  CHECK(contains(complaint(solver, task, Joints::Zero(5)), "got 5 joint readings, the robot has 6 driven joints"));
  Joints nan = seed;
  nan[2] = std::numeric_limits<double>::quiet_NaN();
  CHECK(contains(complaint(solver, task, nan), "not a finite number"));
  Task bad = task;
  bad.T_measurement_target.translation().x() = std::numeric_limits<double>::infinity();
  CHECK(contains(complaint(solver, bad, seed), "not finite"));
  bad = task;
  bad.T_measurement_target.linear() *= 1.01;
  CHECK(contains(complaint(solver, bad, seed), "not rigid"));
  bad = task;
  bad.kind = TaskKind::torch;
  bad.axis *= 2.0;
  CHECK(contains(complaint(solver, bad, seed), "unit length"));
  bad = task;
  bad.kind = TaskKind::torch;
  bad.roll = {0.5, 0.1};
  CHECK(contains(complaint(solver, bad, seed), "window of roll is empty"));
  InverseOptions options;
  options.position_tolerance = 0.0;
  CHECK_THROWS_AS(InverseSolver(robot, options), std::invalid_argument);
  CHECK_THROWS_AS(InverseSolver(robot, {}, {}, 3), std::invalid_argument);
}

TEST_CASE("a batch gives the same bits on any number of threads, and can be stopped") {
  for (const Robot& robot : {perturbed(gantry(), 1e-3, 1e-3, 51), loaded_ur().robot}) {
    truing::Conditions conditions = loaded_ur().conditions;
    conditions.direction.clear();
    const InverseSolver solver(robot, {}, conditions);
    Sampler sampler(robot, 52);
    std::vector<Task> tasks;
    for (int k = 0; k < 300; ++k)
      tasks.push_back(task_at(reached(robot, sampler.joints()), k % 3 ? TaskKind::pose : TaskKind::torch));
    const std::vector<Joints> seed = {sampler.joints()};
    const auto one = solver.solve_batch(tasks, seed, {}, 1);
    for (const int threads : {2, 3}) {
      const auto many = solver.solve_batch(tasks, seed, {}, threads);
      for (std::size_t k = 0; k < tasks.size(); ++k) {
        REQUIRE(one[k].joints == many[k].joints);
        REQUIRE(one[k].reason == many[k].reason);
      }
    }
    std::size_t told = 0;
    solver.solve_batch(tasks, seed, {}, 1, [&told](std::size_t done) {
      told = done;
      return false;
    });
    CHECK(told == 64);
  }
}

// ---- Which of several answers ---------------------------------------------------------------------------------------

namespace {

double limits_margin(const Robot& robot, const Joints& q) {
  double least = 1.0;
  Eigen::Index k = 0;
  for (const std::size_t j : robot.driven_joints()) {
    const Joint& joint = robot.joints[j];
    least = std::min(least, std::min(q[k] - joint.lower, joint.upper - q[k]) / (joint.upper - joint.lower));
    ++k;
  }
  return least;
}

double rail_travel(const Joints& a, const Joints& b, int rails) { return (a - b).head(rails).norm(); }

}  // namespace

TEST_CASE("the best over rails is no worse than that of a grid of 0.1 m") {
  Robot robot = gantry();
  robot.joints.erase(robot.joints.begin(), robot.joints.begin() + 2);  // one rail
  robot.joints[0].upper = 6.0;
  const InverseSolver nearest(robot);
  for (const truing::Choose choose : {truing::Choose::limits_margin, truing::Choose::rail_travel}) {
    InverseOptions options;
    options.choose = choose;
    const InverseSolver solver(robot, options);
    Sampler sampler(robot, 81);
    for (int k = 0; k < 25; ++k) {
      const Task task = task_at(reached(robot, sampler.joints()));
      const Joints seed = sampler.joints();
      const Solution best = solver.solve(task, seed);
      REQUIRE(best.reached());
      CHECK(holds(robot, task, best));
      double grid = -1e9;
      for (double rail = 0.0; rail <= 6.0; rail += 0.1) {
        Joints from = choose == truing::Choose::limits_margin ? solver.middle() : seed;
        from[0] = rail;
        Branches found;
        nearest.branches(task, from, &found);
        for (int i = 0; i < found.count; ++i) {
          const Joints& q = found.solution[static_cast<std::size_t>(i)].joints;
          grid = std::max(grid,
                          choose == truing::Choose::limits_margin ? limits_margin(robot, q) : -rail_travel(q, seed, 1));
        }
      }
      const double ours = choose == truing::Choose::limits_margin ? limits_margin(robot, best.joints)
                                                                  : -rail_travel(best.joints, seed, 1);
      CHECK(ours >= grid - 1e-3);
    }
  }
}

TEST_CASE("the best of a robot without closed form is better than the nearest") {
  const Robot robot = wrist_arm();
  InverseOptions options;
  options.wrist_tolerance = options.parallel_tolerance = 0.0;
  InverseOptions plain = options;
  options.choose = truing::Choose::manipulability;
  const Robot bent = perturbed(robot, 1e-3, 1e-3, 83);
  const InverseSolver solver(bent, options), nearest(bent, plain);
  REQUIRE(solver.closed_form() == truing::ClosedFormKind::none);
  Sampler sampler(robot, 82);
  const auto manipulability = [&](const Joints& q) {
    truing::TipJacobian J;
    solver.forward(q, &J);
    return std::sqrt(std::max(0.0, (J * J.transpose()).determinant()));
  };
  int better = 0;
  for (int k = 0; k < 20; ++k) {
    const Task task = task_at(reached(bent, sampler.joints()), TaskKind::torch);
    const Joints seed = sampler.joints();
    const Solution best = solver.solve(task, seed), any = nearest.solve(task, seed);
    REQUIRE(best.reached());
    CHECK(holds(bent, task, best));
    if (!any.reached()) continue;
    CHECK(manipulability(best.joints) > 0.9 * manipulability(any.joints));
    better += manipulability(best.joints) > 1.05 * manipulability(any.joints);
  }
  CHECK(better > 5);
}
