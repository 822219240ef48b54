// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "support/contains.hpp"
#include "truing/model/measurement.hpp"

namespace {

using truing::Column;
using truing::Measurements;
using truing::Robot;

constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Three joints, of which the second is passive.
Robot small_robot() {
  Robot robot;
  robot.joints.resize(3);
  robot.joints[0].name = "J1";
  robot.joints[1].name = "J2";
  robot.joints[2].name = "J3";
  robot.joints[1].driven_by = {{"J1", -1.0}};
  robot.targets = {{"tool", Eigen::Isometry3d::Identity()}};
  return robot;
}

/// Four rows, row-major: q1 q3 x y z qw qx qy qz distance other.
struct Written {
  std::vector<double> values;
  static constexpr std::ptrdiff_t columns = 11;

  Written() {
    for (int row = 0; row < 4; ++row) {
      for (const double v : {0.1 * row, 0.2, 1.0, 2.0, 3.0, 0.6, 0.0, -0.8, 0.0, 1.5, 1.0}) values.push_back(v);
    }
  }
  double& at(std::size_t row, std::size_t column) { return values[row * columns + column]; }
  Column column(std::size_t column) const { return {values.data() + column, columns}; }

  Measurements measurements() const {
    Measurements data;
    data.rows = 4;
    data.joints = {column(0), column(1)};
    data.position = {column(2), column(3), column(4)};
    data.orientation = {column(5), column(6), column(7), column(8)};
    data.distance = column(9);
    return data;
  }
};

std::string complaint(const Measurements& data, bool joints_only = false) {
  try {
    truing::validate(data, small_robot(), joints_only);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("validate accepts every kind of row") {
  Written table;
  for (const std::size_t column : {2, 3, 4, 5, 6, 7, 8}) table.at(0, column) = not_measured;  // a distance only
  for (const std::size_t column : {5, 6, 7, 8, 9}) table.at(1, column) = not_measured;        // a position only
  for (const std::size_t column : {2, 3, 4, 5, 6, 7, 8, 9})
    table.at(2, column) = not_measured;  // touches a fixed point
  Measurements data = table.measurements();
  data.fixed_point_names = {"ball"};
  data.fixed_point = {-1, -1, 0, -1};
  data.target = {0, 0, 0, 0};
  data.set = {0, 1, 0, 1};
  data.direction = {table.column(10), Column()};  // one joint without its direction
  data.weight = data.position_sigma = data.payload = table.column(10);
  CHECK(complaint(data) == "");
}

TEST_CASE("validate names the row and what is wrong with it") {
  Written table;
  Measurements data = table.measurements();
  SUBCASE("no rows") {
    data.rows = 0;
    CHECK(complaint(data) == "there are no rows");
  }
  SUBCASE("a column for the passive joint") {
    data.joints.push_back(table.column(10));
    CHECK(contains(complaint(data), "got 3 columns of joint readings, the robot has 2 driven joints"));
  }
  SUBCASE("a reading that is not finite") {
    table.at(2, 1) = not_measured;
    CHECK(complaint(data) == "row 2: reading of joint J3 is nan, expected a finite number");
  }
  SUBCASE("half a position") {
    table.at(3, 4) = not_measured;
    CHECK(contains(complaint(data), "row 3: position is half measured: 2 of 3"));
    data.position[2] = Column();
    CHECK(contains(complaint(data), "position has 2 of its 3 columns"));
  }
  SUBCASE("half an orientation, an infinite position") {
    table.at(1, 5) = not_measured;
    CHECK(contains(complaint(data), "row 1: orientation is half measured"));
    table.at(1, 2) = infinity;
    CHECK(contains(complaint(data), "row 1: position is infinite"));
  }
  SUBCASE("a quaternion that is not of unit length") {
    table.at(1, 5) = 0.61;
    CHECK(contains(complaint(data), "row 1: orientation has length 1.006"));
  }
  SUBCASE("nothing measured") {
    for (const std::size_t column : {2, 3, 4, 5, 6, 7, 8, 9}) table.at(2, column) = not_measured;
    CHECK(contains(complaint(data), "row 2: nothing is measured"));
    CHECK(complaint(data, true) == "");
  }
  SUBCASE("an approach direction between the two") {
    table.at(1, 10) = 0.5;
    data.direction = {Column(), table.column(10)};
    CHECK(complaint(data) == "row 1: approach direction of joint J3 is 0.5, expected -1, 0 or 1");
  }
  SUBCASE("sigma, weight and payload") {
    table.at(1, 10) = 0.0;
    data.position_sigma = table.column(10);
    CHECK(complaint(data) == "row 1: position_sigma is 0, expected more than zero");
    data.position_sigma = Column();
    data.weight = table.column(10);
    CHECK(complaint(data) == "");
    table.at(1, 10) = -1.0;
    CHECK(complaint(data) == "row 1: weight is -1, expected zero or more");
  }
  SUBCASE("holes in covariates are left to the effects that need them") {
    table.at(3, 10) = not_measured;
    data.temperature = table.column(10);
    data.covariates["current"] = table.column(10);
    CHECK(complaint(data) == "");
  }
  SUBCASE("indices that point nowhere, counts that do not fit") {
    data.target = {0, 1, 0, 0};
    CHECK(contains(complaint(data), "row 1: target is 1"));
    data.target = {0};
    CHECK(contains(complaint(data), "target has 1 entries, there are 4 rows"));
    data.target.clear();
    data.fixed_point = {-1, -1, -1, 0};
    CHECK(contains(complaint(data), "row 3: fixed_point is 0"));
    data.fixed_point.clear();
    data.set = {0, 0, 0, 2};
    CHECK(contains(complaint(data), "row 3: set is 2, expected 0 (train) or 1 (test)"));
  }
}

TEST_CASE("rows with equal readings are one pose, numbered as they appear") {
  const std::vector<double> q = {0.5, 1.0, 0.5, 2.0, 0.5, 1.0, -0.0, 2.0, 0.0, 2.0};
  Measurements data;
  data.rows = 5;
  data.joints = {{q.data(), 2}, {q.data() + 1, 2}};
  CHECK(truing::pose_groups(data) == std::vector<std::int32_t>{0, 1, 0, 2, 2});
}

TEST_CASE("a given pose number wins over the readings") {
  const std::vector<double> q = {0.5, 0.5, 0.5, 0.7};
  Measurements data;
  data.rows = 4;
  data.joints = {{q.data(), 1}};
  data.pose = {70, -3, 70, -3};
  CHECK(truing::pose_groups(data) == std::vector<std::int32_t>{0, 1, 0, 1});
  data.pose.pop_back();
  CHECK_THROWS_AS(truing::pose_groups(data), std::invalid_argument);
}

TEST_CASE("many poses with repeats are told apart") {
  // Readings on a coarse grid share most of their bits; every pose comes three times, far apart.
  constexpr std::size_t poses = 40000;
  std::vector<double> q;
  for (std::size_t row = 0; row < 3 * poses; ++row) {
    const std::size_t pose = row % poses;
    q.push_back(0.25 * static_cast<double>(pose % 200));
    q.push_back(-0.25 * static_cast<double>(pose / 200));
  }
  Measurements data;
  data.rows = 3 * poses;
  data.joints = {{q.data(), 2}, {q.data() + 1, 2}};
  const auto groups = truing::pose_groups(data);
  bool all_right = true;
  for (std::size_t row = 0; row < data.rows; ++row) {
    all_right = all_right && groups[row] == static_cast<std::int32_t>(row % poses);
  }
  CHECK(all_right);
}

TEST_CASE("no rows make no groups") { CHECK(truing::pose_groups(Measurements()).empty()); }
