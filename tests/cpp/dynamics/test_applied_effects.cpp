// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What a robot carries acts in every motion, also in one that could not have shown it.

#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "dynamics/torque_model.hpp"
#include "truing/dynamics/effect.hpp"

using namespace truing;

namespace {

Robot one_joint() {
  Robot robot;
  Joint joint;
  joint.name = "J1";
  joint.mass = 2.0;
  joint.center_of_mass = Eigen::Vector3d(0.1, 0.0, 0.0);
  robot.joints.push_back(joint);
  return robot;
}

/// Of an arm that stands still for a second, at one temperature.
MotionRange at_rest(const Robot& robot) {
  const auto n = static_cast<Eigen::Index>(robot.driven_count());
  MotionRange out;
  out.lower = out.upper = out.speed = out.acceleration = Eigen::VectorXd::Zero(n);
  out.torque = Eigen::VectorXd::Ones(n);
  out.duration = 1.0;
  out.columns["temp_C"] = {20.0, 20.0};
  return out;
}

std::vector<TorqueTerm> terms(const std::string& effect, const std::map<std::string, double>& parameters) {
  const Robot robot = one_joint();
  const std::string& joint = robot.joints.front().name;
  std::map<std::string, double> named;
  for (const auto& [part, value] : parameters) named[effect + "." + joint + part] = value;
  return terms_of({effect, {joint}, named}, robot, at_rest(robot));
}

}  // namespace

TEST_CASE("effects that a robot carries have their terms whatever the motion") {
  CHECK(terms("warmup", {{".coulomb", 0.1}, {".viscous", 0.2}}).size() == 2);
  CHECK(terms("thermal_friction", {{".coulomb", 0.1}, {".viscous", 0.2}}).size() == 2);
  CHECK(terms("stribeck", {{"", 1.0}, {".vs", 0.05}}).size() == 1);
  CHECK(terms("presliding", {{"", 1.0}, {".x0", 1e-3}}).size() == 1);
  CHECK(terms("ripple", {{".sin1", 0.1}, {".cos1", 0.2}}).size() == 2);
}

TEST_CASE("a Stribeck curve that falls nowhere beside the drag may as well be drag that is not linear") {
  const TorqueTerm term = terms("stribeck", {{"", 1.0}, {".vs", 0.1}}).front();
  const auto other = [&](double drag) { return term.may_as_well_be({{"stribeck.J1", 2.0}, {"viscous.J1", drag}}); };
  double fall = 0.0;  // of 2 exp(-(v / 0.1)^2) at most, by differences
  const auto curve = [](double v) { return 2.0 * std::exp(-v * v / 0.01); };
  for (double v = 0.0; v < 0.5; v += 1e-4) fall = std::max(fall, (curve(v) - curve(v + 1e-4)) / 1e-4);
  CHECK(other(1.001 * fall) == "viscous_law");
  CHECK(other(0.99 * fall) == "");
  CHECK(term.may_as_well_be({{"stribeck.J1", 2.0}}) == "");
}

TEST_CASE("what a model needs the torque for sees that of another where it was told so") {
  const Robot robot = one_joint();
  const std::vector<TorqueTerm> of_load = terms("load_friction", {{"", 0.5}}), sliding = terms("viscous", {{"", 1.0}});
  const dynamics::TorqueModel bare(robot, {}), strong(robot, {{sliding.front(), 100.0}});
  const dynamics::TorqueModel model(robot, {{of_load.front(), 0.5}});
  Motion motion;
  motion.robot = &robot;
  motion.q = motion.qdd = Eigen::MatrixXd::Zero(4, 1);
  motion.qd = Eigen::MatrixXd::Ones(4, 1);
  motion.time = Eigen::VectorXd::LinSpaced(4, 0.0, 0.3);
  const Eigen::MatrixXd others = bare.torque(&motion);
  CHECK((model.torque(&motion) - others - 0.5 * others.cwiseAbs()).cwiseAbs().maxCoeff() < 1e-12);
  const Eigen::MatrixXd seen = strong.torque(&motion);
  const Eigen::MatrixXd found = model.seeing(strong).torque(&motion);
  CHECK((found - others - 0.5 * seen.cwiseAbs()).cwiseAbs().maxCoeff() < 1e-9);
  CHECK((seen - others).cwiseAbs().minCoeff() > 99.0);
}

TEST_CASE("load friction is of what the motor gives, or of what the links take: not of friction and rotors") {
  Robot robot = one_joint();
  robot.joints.front().rotor_inertia = 0.7;
  Motion motion;
  motion.robot = &robot;
  motion.q = Eigen::MatrixXd::Zero(4, 1);
  motion.qd = Eigen::MatrixXd::Ones(4, 1);
  motion.qdd = Eigen::VectorXd::LinSpaced(4, -3.0, 3.0);
  motion.time = Eigen::VectorXd::LinSpaced(4, 0.0, 0.3);
  const dynamics::TorqueModel sliding(robot, {{terms("viscous", {{"", 1.0}}).front(), 5.0}});
  const Eigen::MatrixXd whole = sliding.torque(&motion);
  const Eigen::MatrixXd links = whole - 5.0 * motion.qd - 0.7 * motion.qdd;
  CHECK((motion.carried - links).cwiseAbs().maxCoeff() < 1e-12);
  CHECK((terms("load_friction", {{"", 1.0}}).front().basis(motion) - whole.cwiseAbs()).cwiseAbs().maxCoeff() < 1e-9);
  const Eigen::MatrixXd found = terms("load_friction", {{".links", 1.0}}).front().basis(motion);
  CHECK((found - links.cwiseAbs()).cwiseAbs().maxCoeff() < 1e-9);
  CHECK(links.cwiseAbs().maxCoeff() > 0.01);
}

TEST_CASE("a link that crosses its play falls out of the motor's torque, and its impact gives back what it missed") {
  const Robot robot = one_joint();  // its axis is upright: inertia is all the load
  const double play = 5e-3, step = 0.01, inertia = 2.0 * 0.1 * 0.1;
  const std::vector<TorqueTerm> found = terms("backlash", {{"", play}, {".crossed", play}});
  REQUIRE(found.size() == 1);
  CHECK(terms("backlash", {{"", play}}).size() == 1);  // crossed as wide as it is
  const Eigen::Index rows = 200, turn = 100;
  Motion motion;
  motion.robot = &robot;
  motion.step = step;
  motion.time = Eigen::VectorXd::LinSpaced(rows, 0.0, step * (rows - 1));
  motion.q = motion.qd = Eigen::MatrixXd::Zero(rows, 1);
  motion.qdd = Eigen::MatrixXd::Ones(rows, 1);
  motion.qdd.bottomRows(rows - turn).setConstant(-1.0);  // from here on the link is faster than the motor
  const Eigen::VectorXd load = dynamics::TorqueModel(robot, {}).torque(&motion);
  CHECK(load[0] == doctest::Approx(inertia));
  motion.inertia = dynamics::mass_matrix_columns(robot, motion.q, motion.bodies);
  const Eigen::VectorXd change = play * found.front().basis(motion);
  const Eigen::Index landed = turn + 10;  // sqrt(2 play / 1 rad/s^2) = 0.1 s
  CHECK(change.head(turn - 2).cwiseAbs().maxCoeff() < 1e-12);
  CHECK((load + change).segment(turn + 2, 6).cwiseAbs().maxCoeff() < 1e-9 * inertia);
  CHECK(change.tail(rows - landed - 4).cwiseAbs().maxCoeff() < 1e-12);
  double speed = 0.0, place = 0.0;
  for (const double torque : change) place += step * (speed += step * torque / inertia);
  CHECK(place == doctest::Approx(play));
  CHECK(std::abs(speed) < 1e-9);
}
