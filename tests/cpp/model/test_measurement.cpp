// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "model/time_series.hpp"
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

namespace {

/// Two joints in motion, 50 rows a second.
struct Stream {
  std::vector<double> time, q1, q2;

  static double first(double t) { return std::sin(2.0 * t); }
  static double second(double t) { return 0.3 * t - 0.5 * std::cos(t); }

  explicit Stream(std::size_t rows) {
    for (std::size_t row = 0; row < rows; ++row) {
      time.push_back(0.02 * static_cast<double>(row) + (row >= 100 ? 1.0 : 0.0));  // a gap of a second
      q1.push_back(first(time.back()));
      q2.push_back(second(time.back()));
    }
  }
  Measurements measurements() const {
    Measurements data;
    data.rows = time.size();
    data.joints = {{q1.data(), 1}, {q2.data(), 1}};
    data.time = {time.data(), 1};
    return data;
  }
};

}  // namespace

TEST_CASE("speeds of a robot that moves while it is measured are inferred, of one that stops are not") {
  Stream stream(200);
  const Measurements with = truing::with_inferred_speeds(stream.measurements());
  REQUIRE(with.joint_speed.size() == 2);
  for (std::size_t row = 0; row < 200; ++row) {
    const double t = stream.time[row];
    const bool one_sided = row == 0 || row == 99 || row == 100 || row == 199;
    CHECK(with.joint_speed[0][row] == doctest::Approx(2.0 * std::cos(2.0 * t)).epsilon(one_sided ? 0.06 : 6e-4));
    CHECK(std::abs(with.joint_speed[1][row] - 0.3 - 0.5 * std::sin(t)) < (one_sided ? 6e-3 : 4e-5));
  }
  Measurements known = stream.measurements();
  known.joint_speed = {{stream.q2.data(), 1}, {stream.q1.data(), 1}};
  CHECK(truing::with_inferred_speeds(known).joint_speed[0].data == stream.q2.data());
  Stream slow = stream;
  for (double& t : slow.time) t *= 20.0;  // a row every 0.4 s: it may stop for each
  CHECK(truing::with_inferred_speeds(slow.measurements()).joint_speed.empty());
  Stream poses = stream;
  std::mt19937_64 random(20);
  for (double& q : poses.q1) q = static_cast<double>(random() % 1000) / 300.0;
  CHECK(truing::with_inferred_speeds(poses.measurements()).joint_speed.empty());
  std::swap(stream.time[7], stream.time[8]);
  CHECK(truing::with_inferred_speeds(stream.measurements()).joint_speed.empty());
}

TEST_CASE("joints of another instant are between the rows") {
  const Stream stream(200);
  for (const double later : {-0.035, 0.0, 0.004, 0.051}) {
    const Measurements then = truing::model::with_joints_at(stream.measurements(), later);
    for (std::size_t row = 0; row < 200; ++row) {
      const double t = stream.time[row] + later;
      const bool between =
          (t >= stream.time[0] && t <= stream.time[99]) || (t >= stream.time[100] && t <= stream.time[199]);
      CAPTURE(later);
      CAPTURE(row);
      CHECK(then.weight[row] == (between ? 1.0 : 0.0));
      if (!between) continue;
      CHECK(std::abs(then.joints[0][row] - Stream::first(t)) < 2e-4);
      CHECK(std::abs(then.joints[1][row] - Stream::second(t)) < 2e-5);
      CHECK(std::abs(then.joint_speed[1][row] - 0.3 - 0.5 * std::sin(t)) < 6e-3);
    }
  }
}

TEST_CASE("a lag is found to microseconds, and none at the end of what is tried") {
  for (const double lag : {-0.4876, -0.002, 0.0, 0.1234}) {
    const double found = truing::model::best_lag([lag](double later) { return std::abs(later - lag); });
    CHECK(std::abs(found - lag) < 1e-5);
  }
  CHECK(truing::model::best_lag([](double later) { return std::abs(later - 2.0); }) == 0.0);
}

TEST_CASE("rows from the middle are as they were") {
  Stream stream(200);
  Measurements data = stream.measurements();
  for (std::int32_t row = 0; row < 200; ++row) {
    data.target.push_back(row % 3);
    data.set.push_back(static_cast<std::int8_t>(row % 2));
  }
  const Measurements some = truing::model::middle_rows(data, 31);
  REQUIRE(some.rows == 31);
  CHECK((some.target.size() == 31 && some.set.size() == 31));
  for (std::size_t row = 0; row < 31; ++row) {
    CHECK(some.joints[1][row] == stream.q2[84 + row]);
    CHECK(some.time[row] == stream.time[84 + row]);
    CHECK(some.target[row] == data.target[84 + row]);
    CHECK(some.set[row] == data.set[84 + row]);
  }
  CHECK(truing::model::middle_rows(data, 200).rows == 200);
}
