// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Errors that repeat with a gear: found alone, at several joints, at any order; and what a grid of angles cannot tell.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>

#include "model/effects/traits.hpp"
#include "support/arms.hpp"
#include "support/sanitized.hpp"

namespace {

using truing::Diagnosis;
using truing::FoundEffect;
using truing::NotTestable;
using truing::Robot;

constexpr double kWhiteNoise = 3e-5;  // [m] of one coordinate
constexpr double kDegree = 0.017453292519943295;

/// An arm like a UR10, without masses: fewer candidates, and quicker.
Robot arm_of_gears() {
  Robot robot = arms::ur10();
  for (truing::Joint& joint : robot.joints) joint.mass.reset();
  return robot;
}

struct Wave {
  double order;      ///< per turn
  double amplitude;  ///< [rad]
};

/// Poses where joints stand on a grid of `step` (0: anywhere) and move by waves of their own angle.
std::unique_ptr<arms::Table> waving(std::size_t rows, unsigned seed, const std::map<std::size_t, Wave>& waves,
                                    double step = 0.0) {
  const Robot robot = arm_of_gears();
  auto table = arms::random_joints(robot, rows, seed);
  std::vector<truing::Column> read;
  for (std::size_t k = 0; k < table->data.joints.size(); ++k) {
    std::vector<double> angles(rows), moved(rows);
    for (std::size_t row = 0; row < rows; ++row) {
      const double q = table->data.joints[k][row];
      angles[row] = step > 0.0 ? step * std::round(q / step) : q;
      const auto wave = waves.find(k);
      const double k_turn = wave == waves.end() ? 0.0 : wave->second.order;
      moved[row] =
          angles[row] + (wave == waves.end() ? 0.0 : wave->second.amplitude) * std::cos(k_turn * angles[row] + 0.3);
    }
    read.push_back(table->add(angles));
    table->data.joints[k] = table->add(moved);
  }
  arms::measure(table.get(), robot, arms::What::position, kWhiteNoise, seed + 1);
  table->data.joints = read;
  return table;
}

std::string said(const Diagnosis& d) {
  std::string out = d.sentence;
  for (const FoundEffect& e : d.effects) {
    out += "\n" + e.effect;
    for (const std::string& joint : e.joints) out += " " + joint;
    for (const truing::Alternative& other : e.confounded_with) out += " | " + other.effect;
  }
  for (const truing::UnknownEffect& u : d.unknown) out += "\nunknown " + u.joint;
  for (const NotTestable& n : d.not_testable) out += "\n- " + n.effect + ": " + n.why;
  return out;
}

const FoundEffect* found(const Diagnosis& d, const std::string& effect) {
  for (const FoundEffect& e : d.effects) {
    if (e.effect == effect) return &e;
  }
  return nullptr;
}

bool finds_an_order(const Diagnosis& d) {
  return std::any_of(d.effects.begin(), d.effects.end(),
                     [](const FoundEffect& e) { return e.effect.find("transmission_error@") == 0; });
}

}  // namespace

TEST_CASE("orders that gears make are likelier than others, and the probabilities are whole") {
  std::map<double, double> likely;
  double sum = 0.0;
  for (const truing::model::LikelyOrder& one : truing::model::likely_orders()) {
    likely[one.order] = one.probability;
    sum += one.probability;
  }
  CHECK(sum == doctest::Approx(1.0).scale(0));
  CHECK(likely.begin()->first == 15.0);              // half of 30
  CHECK(std::prev(likely.end())->first == 322.0);    // twice 161
  CHECK(likely.at(100.0) > 10.0 * likely.at(99.0));  // a ratio that is sold
  CHECK(likely.count(37.3) == 0);
  CHECK(truing::model::related_orders(100.0) == std::vector<double>{50.0, 200.0});
  CHECK(truing::model::related_orders(20.0) == std::vector<double>{40.0});
}

TEST_CASE("an order at six times the noise is found though it is the only effect") {
  // Amplitude times the lever of J2, 0.8 m rms, over the root of 2.
  const auto table = waving(200, 700, {{1, {27.0, 3.2e-4}}});
  const Diagnosis d = truing::diagnose(arm_of_gears(), table->data);
  INFO(said(d));
  CHECK(d.verdict == truing::Verdict::effects);
  CHECK(d.p_gap < 0.01);
  REQUIRE(d.effects.size() == 1);
  CHECK(d.effects[0].effect == "transmission_error@27");
  CHECK(d.effects[0].joints == std::vector<std::string>{"J2"});
  CHECK(d.effects[0].probability > 0.9);
  CHECK(d.after.rms < 1.15 * std::sqrt(3.0) * kWhiteNoise);
}

TEST_CASE("the curve of an order is folded by its period") {
  const auto table = waving(200, 700, {{1, {27.0, 3.2e-4}}});
  const Diagnosis d = truing::diagnose(arm_of_gears(), table->data);
  const FoundEffect* e = found(d, "transmission_error@27");
  REQUIRE(e);
  REQUIRE(e->curves.size() == 1);
  const truing::Curve& curve = e->curves[0];
  const double period = 360.0 / 27.0 * kDegree;
  CHECK(curve.input == "q2");
  CHECK(curve.period == doctest::Approx(period).scale(0));
  REQUIRE(curve.samples.size() > 100);
  for (const auto& [x, value] : curve.samples) CHECK((x >= 0.0 && x < period));
  REQUIRE(curve.points.size() == 24);
  for (const auto& point : curve.points)
    CHECK(std::abs(point[1] - 3.2e-4 * std::cos(27.0 * point[0] + 0.3)) < 0.15 * 3.2e-4);
}

TEST_CASE("orders of twice the largest ratio, and of no ratio at all, are found" * doctest::skip(kSanitized)) {
  for (const double order : {15.0, 62.7, 160.0, 322.0}) {
    CAPTURE(order);
    const auto table = waving(200, 710, {{2, {order, 4e-4}}});
    const Diagnosis d = truing::diagnose(arm_of_gears(), table->data);
    INFO(said(d));
    REQUIRE(d.effects.size() == 1);
    const std::string& name = d.effects[0].effect;
    REQUIRE(name.find("transmission_error@") == 0);
    // 200 poses over 5 rad at this size: to a tenth.
    CHECK(std::abs(std::stod(name.substr(19)) - order) < 0.11);
    CHECK(d.effects[0].joints == std::vector<std::string>{"J3"});
  }
}

TEST_CASE("an order that several joints share is one effect, with all of them" * doctest::skip(kSanitized)) {
  const auto table =
      waving(250, 720, {{0, {100.0, 8e-5}}, {1, {100.0, 8e-5}}, {2, {100.0, 9e-5}}, {3, {100.0, 2.4e-4}}});
  const Diagnosis d = truing::diagnose(arm_of_gears(), table->data);
  INFO(said(d));
  const FoundEffect* e = found(d, "transmission_error@100");
  REQUIRE(e);
  CHECK(e->joints == std::vector<std::string>{"J1", "J2", "J3", "J4"});
  CHECK(e->parameters.size() == 8);
  CHECK(e->curves.size() == 4);
  CHECK(e->identify_as == "transmission_error@100:J1+J2+J3+J4");
  CHECK(d.effects.size() == 1);
  CHECK(d.after.rms < 1.2 * std::sqrt(3.0) * kWhiteNoise);
}

TEST_CASE("on a grid of angles orders stand for each other, and that is the answer" * doctest::skip(kSanitized)) {
  // 20 deg apart: orders that differ by 18 per turn, or add up to a multiple of it, move the joint alike.
  const auto table = waving(200, 730, {{1, {96.0, 4e-4}}}, 20.0 * kDegree);
  const Diagnosis d = truing::diagnose(arm_of_gears(), table->data);
  INFO(said(d));
  const auto says = std::find_if(d.not_testable.begin(), d.not_testable.end(),
                                 [](const NotTestable& n) { return n.effect == "transmission_error"; });
  REQUIRE(says != d.not_testable.end());
  CHECK(says->joints.size() == 6);
  CHECK(says->why.find("angles 20 deg apart: orders that differ by 18 per turn, or add up to it") != std::string::npos);
  const auto order_at_J2 = std::find_if(d.effects.begin(), d.effects.end(), [](const FoundEffect& e) {
    return e.effect.find("transmission_error@") == 0 && e.joints == std::vector<std::string>{"J2"};
  });
  REQUIRE(order_at_J2 != d.effects.end());
  REQUIRE(!order_at_J2->confounded_with.empty());
  std::vector<std::string> named = {order_at_J2->effect};
  for (const truing::Alternative& other : order_at_J2->confounded_with) named.push_back(other.effect);
  for (const std::string& name : named) {
    const std::size_t at = name.find('@');
    if (at == std::string::npos) continue;
    const double order = std::stod(name.substr(at + 1));  // 96 = 5 * 18 + 6
    const double from = std::abs(std::remainder(order, 18.0));
    CHECK(std::abs(from - 6.0) < 0.3);
  }
}

TEST_CASE("a joint that stood at few angles, or hardly turned, is said not to show orders") {
  auto table = waving(120, 740, {});
  std::vector<double> few(120), narrow(120);
  for (std::size_t row = 0; row < 120; ++row) {
    few[row] = 0.4 * static_cast<double>(row % 3);
    narrow[row] = 0.1 * table->data.joints[3][row];
  }
  table->data.joints[2] = table->add(few);
  table->data.joints[3] = table->add(narrow);
  arms::measure(table.get(), arm_of_gears(), arms::What::position, kWhiteNoise, 741);
  const Diagnosis d = truing::diagnose(arm_of_gears(), table->data);
  INFO(said(d));
  std::map<std::string, std::string> why;
  for (const NotTestable& n : d.not_testable) {
    if (n.effect == "transmission_error") why[n.joints.at(0)] = n.why;
  }
  CHECK(why.size() == 2);
  CHECK(why["J3"].find("J3 stood at 3 angles only") == 0);
  CHECK(why["J4"].find("J4 turns too little for two whole waves of orders below 2") == 0);
}

TEST_CASE("of few uneven angles a gear's error is no order, and any other is none either" * doctest::skip(kSanitized)) {
  const auto of_angles = [](std::size_t count, bool teeth) {
    const Robot robot = arm_of_gears();
    auto table = arms::random_joints(robot, 300, 744);
    std::mt19937_64 random(745);
    std::vector<double> stops, errors;
    for (std::size_t k = 0; k < count; ++k) {
      const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-53; };
      stops.push_back(5.0 * uniform() - 2.5);
      errors.push_back(teeth ? 4e-4 * std::cos(81.0 * stops.back()) + 3e-4 * std::cos(162.0 * stops.back())
                             : 1.2e-3 * (uniform() - 0.5));
    }
    std::vector<double> angles(300), moved(300);
    for (std::size_t row = 0; row < 300; ++row) {
      angles[row] = stops[row % count];
      moved[row] = angles[row] + errors[row % count];
    }
    table->data.joints[2] = table->add(moved);
    arms::measure(table.get(), robot, arms::What::position, kWhiteNoise, 746);
    table->data.joints[2] = table->add(angles);
    return truing::diagnose(robot, table->data);
  };
  const auto says_so = [](const Diagnosis& d) {
    return std::any_of(d.not_testable.begin(), d.not_testable.end(), [](const NotTestable& n) {
      return n.joints == std::vector<std::string>{"J3"} &&
             n.why.find("some gear ratio explains half") != std::string::npos;
    });
  };
  for (const bool teeth : {true, false}) {
    const Diagnosis d = of_angles(16, teeth);
    CAPTURE(teeth);
    INFO(said(d));
    REQUIRE(d.unknown.size() == 1);
    CHECK(d.unknown[0].inputs == std::vector<std::string>{"q3"});
    CHECK(says_so(d));
  }
  const Diagnosis many = of_angles(60, false);
  INFO(said(many));
  CHECK(!says_so(many));
}

TEST_CASE("a joint that moved over hundreds of turns is not looked at, in no time" * doctest::skip(kSanitized)) {
  auto table = waving(40, 742, {});
  std::vector<double> far(40);  // degrees called radians, or a wrong power of ten
  for (std::size_t row = 0; row < 40; ++row) far[row] = 1000.0 * table->data.joints[2][row];
  table->data.joints[2] = table->add(far);
  arms::measure(table.get(), arm_of_gears(), arms::What::position, kWhiteNoise, 743);
  const Diagnosis d = truing::diagnose(arm_of_gears(), table->data);
  INFO(said(d));
  const auto why = std::find_if(d.not_testable.begin(), d.not_testable.end(), [](const NotTestable& n) {
    return n.effect == "transmission_error" && n.joints == std::vector<std::string>{"J3"};
  });
  REQUIRE(why != d.not_testable.end());
  CHECK(why->why.find("J3 moved over ") == 0);
  CHECK(why->why.find("are its angles in the right unit?") != std::string::npos);
}

TEST_CASE("curves with corners at every joint are no orders" * doctest::skip(kSanitized)) {
  // Steps at random angles, another one at every joint: their spectrum is broad, and no order stands out of it.
  const Robot robot = arm_of_gears();
  std::mt19937_64 random(760);
  auto table = arms::random_joints(robot, 400, 761);
  const std::vector<truing::Column> read = table->data.joints;
  for (truing::Column& joint : table->data.joints) {
    const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1.0p-53; };
    std::vector<double> levels(14), steps(13), moved(400);
    for (double& level : levels) level = 1.5e-3 * (uniform() - 0.5);
    for (double& step : steps) step = 5.0 * uniform() - 2.5;
    std::sort(steps.begin(), steps.end());
    for (std::size_t row = 0; row < moved.size(); ++row)
      moved[row] =
          joint[row] +
          levels[static_cast<std::size_t>(std::upper_bound(steps.begin(), steps.end(), joint[row]) - steps.begin())];
    joint = table->add(moved);
  }
  arms::measure(table.get(), robot, arms::What::position, kWhiteNoise, 762);
  table->data.joints = read;
  const Diagnosis d = truing::diagnose(robot, table->data);
  INFO(said(d));
  CHECK(!finds_an_order(d));
  CHECK(!d.unknown.empty());
}

TEST_CASE("orders are not tried when they are left out") {
  const auto table = waving(150, 750, {{1, {27.0, 3.2e-4}}});
  truing::DiagnoseOptions options;
  options.leave_out = {"transmission_error"};
  CHECK(!finds_an_order(truing::diagnose(arm_of_gears(), table->data, options)));
}

TEST_SUITE("slow") {
  TEST_CASE("noise alone shows no order, wherever the angles stand") {
    int alarms = 0;
    for (const double step : {0.0, 5.0, 20.0}) {
      for (unsigned seed = 800; seed < 820; ++seed) {
        const Diagnosis d = truing::diagnose(arm_of_gears(), waving(120, seed, {}, step * kDegree)->data);
        if (finds_an_order(d)) MESSAGE("step ", step, " seed ", seed, ": ", said(d));
        alarms += finds_an_order(d) ? 1 : 0;
      }
    }
    CHECK(alarms == 0);
  }
}
