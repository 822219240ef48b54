// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "dynamics/effects/families.hpp"
#include "dynamics/turn.hpp"
#include "math/random.hpp"
#include "support/sanitized.hpp"
#include "support/swung_arm.hpp"
#include "truing/dynamics.hpp"

using namespace truing;
using truing::math::Random;

namespace {

/// Slow and fast, with friction that turns where the motion does: nothing else is there.
std::vector<Recording> recorded_dry(const Robot& robot) {
  std::vector<Recording> out;
  for (int k = 0; k < 5; ++k) {
    Recording one;
    one.name = "motion" + std::to_string(k);
    const auto rows = static_cast<Eigen::Index>(200.0 * (kSanitized ? 12.0 : 30.0));
    one.time = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.005 * static_cast<double>(rows - 1));
    const Eigen::ArrayXd t = one.time.array(), phase = (0.6 + 0.05 * k) * t + k;
    one.position = (0.4 * phase.sin() + 0.15 * (2.1 * t + 2.0 * k).cos()).matrix();
    one.torque = dynamics::predict(robot, one, 40.0).torque;
    Random random(static_cast<std::uint64_t>(k));
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double speed = 0.4 * (0.6 + 0.05 * k) * std::cos(phase[i]) - 0.315 * std::sin(2.1 * t[i] + 2.0 * k);
      one.torque(i, 0) += (speed > 0.0 ? 5.0 : -5.0) + 0.1 * random.normal();
    }
    one.test = k > 2;
    out.push_back(one);
  }
  return out;
}

/// Goes to and fro, and stands still for some seconds after each way, friction of `robot` on it.
std::vector<Recording> recorded_rests(const Robot& robot, int recordings, double seconds) {
  std::vector<Recording> out;
  for (int k = 0; k < recordings; ++k) {
    Recording one;
    one.name = "motion" + std::to_string(k);
    const auto rows = static_cast<Eigen::Index>(100.0 * seconds);
    one.time = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.01 * static_cast<double>(rows - 1));
    one.position.resize(rows, 1);
    Random random(static_cast<std::uint64_t>(40 + k));
    double from = 0.3 * k, to = -0.4, begin = 0.0, way = 2.0, rest = 2.0;
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (one.time[i] > begin + way + rest) {
        from = to;
        to = random.uniform(-0.6, 0.6);
        begin = one.time[i];
        way = random.uniform(1.0, 3.0);
        rest = random.uniform(1.0, 4.0);
      }
      const double s = std::min(1.0, (one.time[i] - begin) / way);
      one.position(i, 0) = from + (to - from) * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    }
    one.torque = dynamics::predict(robot, one, 40.0).torque;
    for (Eigen::Index i = 0; i < rows; ++i) one.torque(i, 0) += 0.1 * random.normal();
    one.test = recordings > 1 && k + 2 >= recordings;
    out.push_back(one);
  }
  return out;
}

/// `fade`: [s]; 0: friction at rest stays.
Robot with_fading_friction(double fade) {
  Robot robot = swung::level_arm(1);
  std::map<std::string, double> parameters{{"coulomb.J1", 4.0}, {"coulomb.J1.turn_travel", 1e-4}};
  if (fade > 0.0) parameters["coulomb.J1.turn_fade"] = fade;
  robot.torque_effects = {{"coulomb", {"J1"}, parameters}, {"viscous", {"J1"}, {{"viscous.J1", 1.0}}}};
  return robot;
}

}  // namespace

TEST_CASE("what the stop operator remembers fades where nothing moves") {
  Eigen::VectorXd q = Eigen::VectorXd::Constant(12, 1.0);
  q[0] = 0.0;
  const Eigen::VectorXd z = dynamics::stop_operator(q, 0.1, 0.8);
  for (Eigen::Index i = 3; i < 11; ++i) CHECK(std::abs(z[i] / z[i - 1] - 0.8) < 1e-12);
  CHECK(z[2] > 0.7);
}

TEST_CASE("friction that fades at rest is found where recordings show it") {
  for (const double fade : {0.0, 1.0, 10.0}) {
    const std::vector<Recording> rests = recorded_rests(with_fading_friction(fade), 6, 30.0);
    const TorqueDiagnosis d = dynamics::diagnose(swung::level_arm(1), rests);
    CHECK(dynamics::turns_of(d.robot).front().fade == fade);
    CHECK(d.errors[2].held_out.front().rms < 0.15);
  }
}

TEST_CASE("a single recording does not say that friction fades") {
  const std::vector<Recording> rests = recorded_rests(with_fading_friction(1.0), 1, 60.0);
  const TorqueDiagnosis d = dynamics::diagnose(swung::level_arm(1), rests);
  CHECK(dynamics::turns_of(d.robot).front().fade == 0.0);
}

TEST_CASE("the stop operator's rows are means over their time") {
  // Up by 1, down by 1 in rows of 0.5: z is -1 … 1 over a travel of 0.2.
  const Eigen::VectorXd q = (Eigen::VectorXd(5) << 0.0, 0.5, 1.0, 0.5, 0.0).finished();
  const Eigen::VectorXd z = dynamics::stop_operator(q, 0.1);
  // First quarter of a row: 0 to 1 over 0.1 of its 0.25, then 1.
  CHECK(std::abs(z[0] - (0.4 * 0.5 + 0.6)) < 1e-12);
  CHECK(std::abs(z[1] - 1.0) < 1e-12);
  // Half a row at 1, half a row that goes from 1 to -1 over 0.2 of its 0.25.
  CHECK(std::abs(z[2] - 0.5 * (1.0 + (0.8 * 0.0 - 0.2))) < 1e-12);
  CHECK(std::abs(z[4] + 1.0) < 1e-12);
}

TEST_CASE("a direction by the speed turns at the speed's zero, wherever it lies between rows") {
  for (const double zero : {2.0, 2.2, 2.5, 2.7}) {
    Eigen::VectorXd speed(6);
    for (Eigen::Index i = 0; i < 6; ++i) speed[i] = zero - static_cast<double>(i);
    const Eigen::VectorXd s = dynamics::direction_by_speed(speed, 1e-6);
    // The first and the last row stand for half a row each: rows 0 … 5 hold the time from -0.5 to 5.5.
    CHECK(std::abs(s.sum() - ((zero + 0.5) - (5.5 - zero))) < 1e-4);
  }
  const Eigen::VectorXd slow = dynamics::direction_by_speed(Eigen::VectorXd::Constant(3, 0.004), 0.01);
  CHECK(std::abs(slow[1] - std::tanh(0.4)) < 1e-12);
}

TEST_CASE("friction that turns sharply is dry friction, and nothing beside it") {
  const TorqueDiagnosis d = dynamics::diagnose(swung::level_arm(1), recorded_dry(swung::level_arm(1)));
  for (const FoundTorqueEffect& effect : d.effects) CHECK_MESSAGE(effect.standard, effect.sentence);
  const FrictionTurn turn = dynamics::turns_of(d.robot).front();
  CHECK((turn.travel > 0.0 || turn.speed < 0.01));
  // What is handed over predicts with the turn that was found.
  const Recording held_out = recorded_dry(swung::level_arm(1)).back();
  const Eigen::VectorXd error = dynamics::predict(d.robot, held_out).torque.col(0) - held_out.torque.col(0);
  CHECK(std::sqrt(error.squaredNorm() / static_cast<double>(error.size())) < 1.0);  // the low-pass rounds the turns
  CHECK(d.errors[2].held_out.front().rms < 0.1);
}

TEST_CASE("a turn that the robot does not have is refused") {
  Robot robot = swung::level_arm(1);
  robot.torque_effects = {{"coulomb", {"J1"}, {{"coulomb.J1", 2.0}, {"coulomb.J1.turn_travel", -1e-4}}}};
  CHECK_THROWS_AS(dynamics::turns_of(robot), std::invalid_argument);
}
