// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "truing/model/effect.hpp"

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using truing::Convention;
using truing::Inputs;
using truing::Joint;
using truing::JointType;
using truing::Measurements;
using truing::Robot;
using truing::Term;

/// Five joints with masses: J3 is a rail, J4 is passive, driven by J2 and J3.
Robot loaded_arm(Convention convention) {
  Robot robot;
  robot.convention = convention;
  robot.T_measurement_base = truing::frame_from_xyz_rpy({1.0, -2.0, 0.5}, {0.4, -0.3, 2.0});
  robot.gravity = Vector3d(0.5, -0.3, -9.7);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const auto vector = [&] { return Vector3d(any(random), any(random), any(random)); };
  for (int i = 0; i < 5; ++i) {
    Joint joint;
    joint.name = "J" + std::to_string(i + 1);
    joint.theta = any(random);
    joint.d = any(random);
    joint.a = any(random);
    joint.alpha = any(random);
    joint.beta = 0.1 * any(random);
    joint.T_parent_joint = truing::frame_from_xyz_rpy(vector(), vector());
    joint.axis = vector().normalized();
    joint.offset = 0.1 * any(random);
    joint.ratio = 1.0 + 0.01 * any(random);
    if (i != 1) joint.mass = 10.0 + 5.0 * any(random);
    joint.center_of_mass = vector();
    robot.joints.push_back(joint);
  }
  robot.joints[2].type = JointType::prismatic;
  robot.joints[3].driven_by = {{"J2", -1.0}, {"J3", 0.7}};
  robot.targets = {{"tool", truing::frame_from_xyz_rpy(vector(), vector())}};
  return robot;
}

/// Potential energy of links and payload, summed over the bodies.
double potential_energy(const Robot& robot, const VectorXd& q, double payload) {
  const auto frames = truing::forward_kinematics(robot, q);
  const Vector3d g = robot.T_measurement_base.linear() * robot.gravity;
  double energy = -payload * g.dot(frames.back().translation());
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    const Joint& joint = robot.joints[i];
    if (joint.mass) energy -= *joint.mass * g.dot(frames[i] * joint.center_of_mass);
  }
  return energy;
}

Measurements no_columns() { return Measurements(); }

std::string refusal(const std::vector<truing::EffectRequest>& requests, const Robot& robot, const Measurements& data,
                    const std::vector<truing::Effect>& own = {}) {
  try {
    truing::effect_terms(requests, robot, data, own);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("gravity torque is minus the derivative of potential energy, passive joints included") {
  for (const Convention convention : {Convention::dh, Convention::mdh, Convention::urdf}) {
    const Robot robot = loaded_arm(convention);
    const VectorXd q = (VectorXd(4) << 0.3, -1.1, 0.4, 2.0).finished();
    for (const double payload : {0.0, 12.0}) {
      const VectorXd torque = truing::gravity_torques(robot, q, payload);
      REQUIRE(torque.size() == 5);
      for (std::size_t i = 0; i < 5; ++i) {
        CAPTURE(i);
        const double h = 1e-5;
        Robot more = robot, less = robot;
        more.joints[i].offset += h;
        less.joints[i].offset -= h;
        const double slope = (potential_energy(more, q, payload) - potential_energy(less, q, payload)) / (2.0 * h);
        CHECK(torque[static_cast<Eigen::Index>(i)] == doctest::Approx(-slope).scale(0).epsilon(1e-7));
      }
    }
  }
}

TEST_CASE("a horizontal arm's weight pulls it down: the torque has the sign of the sag") {
  Robot robot;
  Joint joint;
  joint.name = "J1";
  joint.alpha = 0.0;
  joint.a = 2.0;
  joint.mass = 3.0;
  joint.center_of_mass = Vector3d(-1.0, 0.0, 0.0);  // half way along the link
  robot.joints = {joint};
  robot.gravity = Vector3d(0.0, -9.81, 0.0);  // the axis is horizontal
  const VectorXd torque = truing::gravity_torques(robot, VectorXd::Zero(1), 5.0);
  CHECK(torque[0] == doctest::Approx(-9.81 * (3.0 * 1.0 + 5.0 * 2.0)));
}

TEST_CASE("gravity torques without any mass are refused") {
  Robot robot = loaded_arm(Convention::dh);
  for (Joint& joint : robot.joints) joint.mass.reset();
  CHECK_THROWS_AS(truing::gravity_torques(robot, VectorXd::Zero(4)), std::invalid_argument);
  CHECK_THROWS_AS(truing::gravity_torques(robot, VectorXd::Zero(4), -1.0), std::invalid_argument);
  CHECK_NOTHROW(truing::gravity_torques(robot, VectorXd::Zero(4), 1.0));
}

TEST_CASE("every effect of the catalogue is found by its name, and a wrong name lists them all") {
  std::string names;
  for (const truing::Effect& effect : truing::catalogue()) {
    CHECK(&truing::find_effect(effect.name) == &effect);
    CHECK(!effect.summary.empty());
    names += (names.empty() ? "" : ", ") + effect.name;
  }
  const std::string complaint = "effect 'backlsh' does not exist (did you mean 'backlash'?); there are " + names;
  CHECK_THROWS_WITH_AS(truing::find_effect("backlsh"), complaint.c_str(), std::invalid_argument);
}

TEST_CASE("one's own effect stands beside the catalogue, under another name") {
  truing::Effect creep;
  creep.name = "creep";
  creep.terms = [](const Robot& robot, std::size_t joint, const Measurements&) {
    Term term;
    term.parameter = "creep." + robot.joints[joint].name;
    term.unit = "rad/s";
    term.site = robot.joints[joint].name;
    term.basis = [](const Inputs& in) { return in.data->time[in.row]; };
    return std::vector<Term>{term};
  };
  const Robot robot = loaded_arm(Convention::dh);
  const auto terms = truing::effect_terms({{"creep", {"J2"}}}, robot, no_columns(), {creep});
  REQUIRE(terms.size() == 1);
  CHECK(terms[0].parameter == "creep.J2");
  creep.name = "backlash";
  CHECK(refusal({{"backlash", {"J2"}}}, robot, no_columns(), {creep}).find("exists twice") != std::string::npos);
}

TEST_CASE("the effects that are model parameters have no terms, but look whether the joint suits") {
  const Robot robot = loaded_arm(Convention::dh);
  CHECK(truing::effect_terms({{"gear_ratio", {}}, {"joint_offset", {}}, {"link_geometry", {}}}, robot, no_columns())
            .empty());
  CHECK(refusal({{"gear_ratio", {"J4"}}}, robot, no_columns()) ==
        "gear_ratio at J4 needs a joint with a reading; J4 is passive, driven by J2, J3");
  CHECK(refusal({{"joint_offset", {"J4"}}}, robot, no_columns()) == "");
  CHECK(refusal({{"joint_offset", {"J6"}}}, robot, no_columns()) ==
        "joint 'J6' does not exist; the joints are J1, J2, J3, J4, J5");
}

TEST_CASE("backlash is half the play on the side of approach") {
  const Robot robot = loaded_arm(Convention::dh);
  const double directions[] = {1.0, -1.0, 0.0};
  Measurements data;
  data.rows = 3;
  data.direction.resize(4);
  data.direction[3].data = directions;  // of J5: the passive J4 has no column
  const auto terms = truing::effect_terms({{"backlash", {"J5"}}}, robot, data);
  REQUIRE(terms.size() == 1);
  CHECK(terms[0].parameter == "backlash.J5");
  CHECK(terms[0].site == "J5");
  CHECK(terms[0].unit == "rad");
  CHECK(!terms[0].needs_gravity);
  Inputs in;
  in.data = &data;
  for (in.row = 0; in.row < 3; ++in.row) CHECK(terms[0].basis(in) == 0.5 * directions[in.row]);
  CHECK(refusal({{"backlash", {"J2"}}}, robot, data) ==
        "backlash at J2 needs the column dir2 (approach direction -1, 0, 1)");
  CHECK(refusal({{"backlash", {"J4"}}}, robot, data).find("J4 is passive") != std::string::npos);
  CHECK(refusal({{"backlash", {}}}, robot, data).find("dir1") != std::string::npos);
  CHECK(refusal({{"backlash", {"J5"}}}, robot, no_columns()).find("dir4") != std::string::npos);
}

TEST_CASE("harmonics go once and twice per turn, at revolute joints") {
  const Robot robot = loaded_arm(Convention::dh);
  const auto terms = truing::effect_terms({{"harmonic", {"J2"}}}, robot, no_columns());
  REQUIRE(terms.size() == 4);
  const char* names[] = {"harmonic.J2.cos1", "harmonic.J2.sin1", "harmonic.J2.cos2", "harmonic.J2.sin2"};
  const double q = 0.7, expected[] = {std::cos(q), std::sin(q), std::cos(2 * q), std::sin(2 * q)};
  Inputs in;
  in.joints = (VectorXd(5) << 9.0, q, 9.0, 9.0, 9.0).finished();
  for (std::size_t k = 0; k < 4; ++k) {
    CHECK(terms[k].parameter == names[k]);
    CHECK(terms[k].basis(in) == doctest::Approx(expected[k]));
  }
  CHECK(refusal({{"harmonic", {"J3"}}}, robot, no_columns()).find("J3 is prismatic") != std::string::npos);
  CHECK(truing::effect_terms({{"harmonic", {}}}, robot, no_columns()).size() == 3 * 4);  // J1, J2, J5
}

TEST_CASE("joint compliance is a spring under gravity torque, and says when no mass is known") {
  Robot robot = loaded_arm(Convention::dh);
  const auto terms = truing::effect_terms({{"joint_compliance", {}}}, robot, no_columns());
  REQUIRE(terms.size() == 4);
  CHECK(terms[1].parameter == "joint_compliance.J2");
  CHECK(terms[1].unit == "rad/Nm");
  CHECK(terms[2].unit == "m/N");
  CHECK(terms[3].site == "J5");
  CHECK(terms[3].needs_gravity);
  Inputs in;
  in.gravity_torque = (VectorXd(5) << 1, 2, 3, 4, 5).finished();
  CHECK(terms[3].basis(in) == 5.0);
  for (Joint& joint : robot.joints) joint.mass.reset();
  CHECK(refusal({{"joint_compliance", {"J2"}}}, robot, no_columns()).find("payload_kg") != std::string::npos);
  const double payload = 10.0;
  Measurements data;
  data.payload.data = &payload;
  CHECK(refusal({{"joint_compliance", {"J2"}}}, robot, data) == "");
}

TEST_CASE("the same effect twice at one joint is refused") {
  const Robot robot = loaded_arm(Convention::dh);
  CHECK(refusal({{"harmonic", {"J2"}}, {"harmonic", {}}}, robot, no_columns()) == "harmonic at J2 is asked for twice");
}
