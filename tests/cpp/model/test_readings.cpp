// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "model/readings.hpp"
#include "model/row_slip.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "model/motion.hpp"
#include "support/arms.hpp"

using namespace arms;
using truing::model::measured_range;
using truing::model::stretched_length;

namespace of_readings {
namespace {

const double kNan = std::nan("");

}  // namespace

TEST_CASE("the measured range is the diagonal of the box around the rows asked for") {
  Table table(4);
  table.data.position[0] = table.add({0.0, 3.0, 1000.0, 1.0});
  table.data.position[1] = table.add({1.0, 5.0, 1000.0, 2.0});
  table.data.position[2] = table.add({0.0, 0.0, 1000.0, kNan});
  table.data.distance = table.add({1.0, 2.0, 9.0, 4.0});
  CHECK(measured_range(table.data, {0, 1}) == 5.0);
  CHECK(measured_range(table.data, {0, 1, 2}) > 1000.0);
  CHECK(measured_range(table.data, {1}) == 0.0);  // one point has no size, whatever its distance
}

TEST_CASE("without positions the measured range is that of the distances, without both it is none") {
  Table table(3);
  CHECK(measured_range(table.data, {0, 1, 2}) == 0.0);
  table.data.distance = table.add({1.0, kNan, 4.0});
  CHECK(measured_range(table.data, {0, 1, 2}) == 3.0);
  CHECK(measured_range(table.data, {1}) == 0.0);
  CHECK(measured_range(table.data, {}) == 0.0);
}

TEST_CASE("rows that are shifted pair every row's joints with what was measured so many rows further down") {
  Table table(10);
  std::vector<double> count;
  for (int row = 0; row < 10; ++row) count.push_back(row);
  table.data.joints = {table.add(count)};
  for (Column& column : table.data.position) column = table.add(count);
  Robot robot;
  robot.joints.resize(1);
  std::vector<double> apart;
  for (const auto& make_reading : truing::model::readings_of(robot, table.data)) {
    const truing::model::Reading reading = make_reading();
    if (reading.kind != "row_shift") continue;
    apart.push_back(reading.data.position[0][0] - reading.data.joints[0][0]);
    for (std::size_t row = 0; row < 10; ++row)
      CHECK(reading.data.position[2][row] - reading.data.joints[0][row] == apart.back());
  }
  CHECK(apart == std::vector<double>{-3.0, -2.0, -1.0, 1.0, 2.0, 3.0});
}

TEST_CASE("an undone slip pairs rows from there on anew, and those in doubt do not count") {
  for (const int shift : {-2, 1}) {
    Table table(20);
    std::vector<double> count;
    for (int row = 0; row < 20; ++row) count.push_back(row);
    table.data.joints = {table.add(count)};
    for (Column& column : table.data.position) column = table.add(count);
    const Measurements undone = truing::model::with_slip_undone(table.data, {10, shift, 0.0, 0.0});
    const int by = std::abs(shift);
    for (int row = 0; row < 20; ++row) {
      const auto i = static_cast<std::size_t>(row);
      const bool sure = (row < 10 - by || row >= 10 + by) && (row < 10 || row + shift < 20);
      CAPTURE(row);
      CHECK(undone.weight[i] == (sure ? 1.0 : 0.0));
      const bool after = sure ? row >= 10 : undone.joints[0][i] >= 10.0;
      CHECK(undone.position[0][i] - undone.joints[0][i] == (after ? shift : 0));
    }
  }
}

TEST_CASE("the stretched length adds up the links of tables and of joint origins") {
  Robot robot;
  robot.joints.resize(2);
  robot.joints[0].a = 0.3;
  robot.joints[0].d = -0.4;
  robot.joints[1].T_parent_joint.translation() = Eigen::Vector3d(0.0, 0.6, 0.8);
  CHECK(std::abs(stretched_length(robot) - 1.5) < 1e-15);
}

}  // namespace of_readings
