// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Functions that no law describes, as a robot carries them.

#include <doctest/doctest.h>

#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/effects/tables.hpp"
#include "support/contains.hpp"
#include "truing/model/effect.hpp"

using namespace truing;
using model::add_table;
using model::LookupTable;

namespace {

Robot three_joints() {
  Robot robot;
  for (const char* name : {"J1", "J2", "J3"}) {
    Joint joint;
    joint.name = name;
    joint.a = 0.4;
    joint.mass = 2.0;
    robot.joints.push_back(joint);
  }
  robot.joints[2].type = JointType::prismatic;
  robot.targets.resize(1);
  return robot;
}

/// What the terms of the effect add to a site, parameters as the robot has them.
double added(const Robot& robot, const std::string& site, const Inputs& in) {
  double sum = 0.0;
  for (const Term& term : effect_terms({{"lookup_table", {}}}, robot, *in.data)) {
    if (term.site != site) continue;
    for (const AppliedEffect& applied : robot.effects) {
      const auto found = applied.parameters.find(term.parameter);
      if (found != applied.parameters.end()) sum += found->second * term.basis(in);
    }
  }
  return sum;
}

Inputs row_at(const Measurements& data, const Eigen::Vector3d& joints, std::size_t row = 0) {
  Inputs in;
  in.row = row;
  in.data = &data;
  in.joints = joints;
  return in;
}

std::string refusal_of_tables(const Robot& robot, const Measurements& data = {}) {
  try {
    effect_terms({{"lookup_table", {}}}, robot, data);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a table is linear between its knots and flat beyond them") {
  Robot robot = three_joints();
  add_table({"J2", {"q1"}, {{-1.0, 0.0, 2.0}}, {3e-3, -1e-3, 5e-3}}, &robot);
  const Measurements none;
  for (const auto& [q1, expected] : std::vector<std::pair<double, double>>{
           {-4.0, 3e-3}, {-1.0, 3e-3}, {-0.25, 0.0}, {0.0, -1e-3}, {0.5, 5e-4}, {2.0, 5e-3}, {9.0, 5e-3}}) {
    CAPTURE(q1);
    CHECK(added(robot, "J2", row_at(none, {q1, 0.7, 0.1})) == doctest::Approx(expected).scale(1e-3));
  }
}

TEST_CASE("of two inputs it is bilinear") {
  Robot robot = three_joints();
  add_table({"J1", {"q2", "dir3"}, {{0.0, 1.0}, {-1.0, 1.0}}, {1e-3, 2e-3, 4e-3, 8e-3}}, &robot);
  const double directions[] = {-1.0, 1.0, 0.0};
  Measurements data;
  data.rows = 3;
  data.direction.assign(3, Column{directions});
  CHECK(added(robot, "J1", row_at(data, {0.0, 0.25, 0.0}, 0)) == doctest::Approx(1.75e-3).scale(1e-3));
  CHECK(added(robot, "J1", row_at(data, {0.0, 0.25, 0.0}, 1)) == doctest::Approx(3.5e-3).scale(1e-3));
  CHECK(added(robot, "J1", row_at(data, {0.0, 0.25, 0.0}, 2)) == doctest::Approx(2.625e-3).scale(1e-3));
  CHECK(contains(refusal_of_tables(robot), "over dir3 needs its column"));
}

TEST_CASE("two tables of the same inputs at a site are one, their sum") {
  Robot robot = three_joints();
  add_table({"J2", {"q1"}, {{0.0, 1.0}}, {1e-3, 2e-3}}, &robot);
  add_table({"J2", {"q1"}, {{0.5, 1.5}}, {0.0, 4e-3}}, &robot);
  add_table({"J2", {"q3"}, {{0.0, 1.0}}, {0.0, 1e-2}}, &robot);
  REQUIRE(robot.effects.size() == 1);
  const Measurements none;
  CHECK(added(robot, "J2", row_at(none, {0.75, 0.0, 0.0})) == doctest::Approx(2.75e-3).scale(1e-3));
  CHECK(added(robot, "J2", row_at(none, {3.0, 0.0, 0.5})) == doctest::Approx(1.1e-2).scale(1e-3));
}

TEST_CASE("a table has the unit of its site, and gravity torques are asked for") {
  Robot robot = three_joints();
  add_table({"base.z", {"torque2"}, {{-10.0, 10.0}}, {-1e-3, 1e-3}}, &robot);
  add_table({"J3", {"q3"}, {{0.0, 1.0}}, {0.0, 1e-3}}, &robot);
  add_table({"J2.alpha", {"q1"}, {{0.0, 1.0}}, {0.0, 1e-3}}, &robot);
  REQUIRE(robot.effects.size() == 1);
  std::map<std::string, std::string> unit;
  for (const Term& term : effect_terms({{"lookup_table", {}}}, robot, {})) {
    unit[term.site] = term.unit;
    CHECK(term.needs_gravity == (term.site == "base.z"));
  }
  CHECK(unit == std::map<std::string, std::string>{{"base.z", "m"}, {"J3", "m"}, {"J2.alpha", "rad"}});
  CHECK(contains(refusal_of_tables(three_joints()), "needs a robot that carries one"));
  for (Joint& joint : robot.joints) joint.mass.reset();
  CHECK(contains(refusal_of_tables(robot), "needs gravity torques"));
}

TEST_CASE("names of parameters that are none of a table's are refused") {
  for (const char* name : {"lookup_table.J2", "lookup_table.J2:q1", "lookup_table.J2:q1@", "lookup_table.J2:q1@nan",
                           "lookup_table.J2:q1@0x", "lookup_table.J2:q1@0,q2@0,q3@0", "lookup_table.:q1@0", "J2:q1@0",
                           "lookup_table.J2:@1,q2@0"}) {
    CAPTURE(name);
    Robot robot = three_joints();
    robot.effects = {{"lookup_table", {}, {{name, 1e-3}}}};
    CHECK(contains(refusal_of_tables(robot), "expected"));
  }
  for (const char* input : {"q0", "q4", "order", "q1x", "x1"}) {
    CAPTURE(input);
    Robot robot = three_joints();
    robot.effects = {{"lookup_table", {}, {{std::string("lookup_table.J2:") + input + "@0", 1e-3}}}};
    CHECK(contains(refusal_of_tables(robot), "expected q1 ..., dir1"));
  }
}
