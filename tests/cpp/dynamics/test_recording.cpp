// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/recording.hpp"

#include <functional>
#include <limits>
#include <stdexcept>

#include <doctest/doctest.h>

#include "support/contains.hpp"

namespace {

using namespace truing;

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// Three joints, of which the second follows the first: two have a reading.
Robot two_readings() {
  Robot robot;
  for (const char* name : {"J1", "P", "J2"}) {
    robot.joints.emplace_back();
    robot.joints.back().name = name;
  }
  robot.joints[1].driven_by = {{"J1", -1.0}};
  return robot;
}

Recording sound() {
  Recording recording;
  recording.name = "swing";
  recording.time = Eigen::VectorXd::LinSpaced(30, 0.0, 0.29);
  recording.position = Eigen::MatrixXd::Random(30, 2);
  recording.torque = Eigen::MatrixXd::Random(30, 2);
  recording.torque.col(0).setConstant(kNotANumber);
  recording.columns["payload_kg"] = Eigen::VectorXd::Constant(30, 2.5);
  return recording;
}

std::string complaint(const std::function<void(Recording&)>& spoil) {
  Recording recording = sound();
  spoil(recording);
  try {
    validate(recording, two_readings());
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

}  // namespace

TEST_CASE("a sound recording is taken, with joints that were not recorded") {
  CHECK(complaint([](Recording&) {}) == "none");
  CHECK(complaint([](Recording& r) { r.torque.resize(0, 0); }) == "none");
}

TEST_CASE("a value that is not finite is refused at its column and row") {
  const std::string torque = complaint([](Recording& r) { r.torque(11, 1) = kNotANumber; });
  CHECK_MESSAGE(contains(torque, "recording 'swing', column tau2, row 12: found nan, expected a finite number"),
                torque);
  CHECK(contains(torque, "leave the rows out"));
  const std::string position = complaint([](Recording& r) { r.position.col(1).setConstant(kNotANumber); });
  CHECK_MESSAGE(contains(position, "column q2, row 1: found nan"), position);
  const std::string own = complaint([](Recording& r) { r.columns["payload_kg"][29] = -1.0 / 0.0; });
  CHECK_MESSAGE(contains(own, "column payload_kg, row 30: found -inf"), own);
  const std::string command = complaint([](Recording& r) {
    r.torque_command = r.position;
    r.torque_command(3, 0) = 1e200;
  });
  CHECK_MESSAGE(contains(command, "column u1 (torque), row 4: found 1e+200, expected a number between"), command);
}

TEST_CASE("times that do not increase are refused at their row") {
  const std::string twice = complaint([](Recording& r) { r.time[7] = r.time[6]; });
  CHECK_MESSAGE(contains(twice, "column t, row 8: found 0.06, expected a time after 0.06"), twice);
  CHECK(contains(complaint([](Recording& r) { r.time[7] = kNotANumber; }), "column t, row 8: found nan"));
  CHECK(contains(complaint([](Recording& r) { r.time[7] = -1.0; }), "column t, row 8: found -1"));
}

TEST_CASE("tables of another shape are refused with the shape that was expected") {
  const std::string wide = complaint([](Recording& r) { r.speed = Eigen::MatrixXd::Zero(30, 3); });
  CHECK_MESSAGE(contains(wide, "speed has shape (30, 3), expected (30, 2)"), wide);
  CHECK(contains(complaint([](Recording& r) { r.current = Eigen::MatrixXd::Zero(29, 2); }), "shape (29, 2)"));
  CHECK(contains(complaint([](Recording& r) { r.position.resize(30, 0); }), "position has shape (30, 0)"));
  CHECK(contains(complaint([](Recording& r) { r.columns["volt_V"] = Eigen::VectorXd::Zero(5); }),
                 "column volt_V: has 5 rows, expected 30"));
}

TEST_CASE("a recording of a few rows is refused") {
  Recording recording = sound();
  recording.time.conservativeResize(10);
  CHECK_THROWS_WITH_AS(validate(recording, two_readings()),
                       "recording 'swing': has 10 rows, expected at least 20: record a longer motion, or leave it out",
                       std::invalid_argument);
}
