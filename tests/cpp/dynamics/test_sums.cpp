// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include <doctest/doctest.h>

#include "support/swung_arm.hpp"
#include "truing/dynamics.hpp"

using namespace truing;
using swung::level_arm;
using swung::measured;
using swung::swing;
using swung::with_friction;

namespace {

/// The blocks of a joint together.
TorqueBlock of_joint(const std::vector<TorqueBlock>& blocks, std::size_t joint, std::size_t joints) {
  TorqueBlock out = blocks[joint];
  for (std::size_t k = joint + joints; k < blocks.size(); k += joints) {
    if (blocks[k].rows == 0.0) continue;
    out.gram += blocks[k].gram;
    out.right += blocks[k].right;
    out.squares += blocks[k].squares;
    out.rows += blocks[k].rows;
  }
  return out;
}

}  // namespace

TEST_CASE("sums of torques say what friction a joint has that the file does not") {
  const Robot truth = with_friction(level_arm()), nominal = level_arm();
  const TorqueColumns columns = dynamics::torque_columns(nominal);
  const Recording recording = measured(truth, swing(1, 20.0), 5);
  const std::vector<TorqueBlock> blocks = dynamics::sum_torques(nominal, recording);
  const std::size_t joints = columns.joints.size();
  REQUIRE(blocks.size() == 9 * joints);  // 19.99 s, in blocks of no less than 2 s
  for (std::size_t j = 0; j < joints; ++j) {
    const TorqueBlock block = of_joint(blocks, j, joints);
    REQUIRE(block.gram.rows() == static_cast<Eigen::Index>(columns.of_joint[j].size()) + 1);
    std::vector<Eigen::Index> friction;
    std::vector<double> values;
    for (const char* effect : {"coulomb", "viscous"}) {
      const std::string name = std::string(effect) + "." + columns.joints[j];
      const auto number = std::find(columns.names.begin(), columns.names.end(), name) - columns.names.begin();
      const std::vector<int>& of = columns.of_joint[j];
      friction.push_back(std::find(of.begin(), of.end(), static_cast<int>(number)) - of.begin());
      for (const AppliedEffect& applied : truth.torque_effects) {
        const auto at = applied.parameters.find(name);
        if (at != applied.parameters.end()) values.push_back(at->second);
      }
    }
    REQUIRE(values.size() == 2);
    const Eigen::VectorXd found = block.gram(friction, friction).ldlt().solve(block.right(friction));
    CHECK(std::abs(found[0] - values[0]) < 0.1 * std::abs(values[0]));
    CHECK(std::abs(found[1] - values[1]) < 0.2 * std::abs(values[1]));
  }
}

TEST_CASE("sums of torques have the same bits on one thread and on three") {
  const Recording recording = measured(with_friction(level_arm()), swing(2, 20.0), 6);
  TorqueSumOptions options;
  options.threads = 3;
  const std::vector<TorqueBlock> one = dynamics::sum_torques(level_arm(), recording);
  const std::vector<TorqueBlock> three = dynamics::sum_torques(level_arm(), recording, options);
  REQUIRE(one.size() == three.size());
  for (std::size_t k = 0; k < one.size(); ++k) {
    CHECK(one[k].gram == three[k].gram);
    CHECK(one[k].right == three[k].right);
    CHECK(one[k].squares == three[k].squares);
  }
}

TEST_CASE("values of all parameters make another robot, and wrong sizes are refused") {
  const Robot robot = level_arm();
  const TorqueColumns columns = dynamics::torque_columns(robot);
  Eigen::VectorXd values = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(columns.names.size()));
  const auto at = std::find(columns.names.begin(), columns.names.end(), "link_inertia." + columns.joints[0] + ".m");
  values[at - columns.names.begin()] = 0.5;
  const Robot heavier = dynamics::robot_with_torques(robot, values);
  CHECK(*heavier.joints[0].mass == doctest::Approx(*robot.joints[0].mass + 0.5));
  CHECK_THROWS_AS(dynamics::robot_with_torques(robot, Eigen::VectorXd::Zero(3)), std::invalid_argument);
  CHECK_THROWS_AS(dynamics::torques_of_bodies(robot, Eigen::MatrixXd::Identity(3, 3), values), std::invalid_argument);
  TorqueSumOptions options;
  options.shortest = 0.0;
  CHECK_THROWS_AS(dynamics::sum_torques(robot, measured(robot, swing(1, 20.0), 5), options), std::invalid_argument);
}
