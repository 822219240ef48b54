// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Laws of single effects, at one configuration. What all effects have in common is in test_effect_laws.cpp.

#include <doctest/doctest.h>

#include <cmath>

#include "support/arms.hpp"
#include "support/contains.hpp"
#include "support/four_bar.hpp"

namespace {

using truing::Inputs;
using truing::Search;
using truing::Term;

/// What the terms of an effect at a joint add to their sites, by parameter, at these motions.
std::map<std::string, double> values_at(const std::string& effect, const std::vector<std::string>& joints,
                                        const truing::Robot& robot, Inputs in) {
  std::map<std::string, double> out;
  for (const Term& term : truing::effect_terms({{effect, joints}}, robot, *in.data))
    out[term.parameter] = term.basis(in);
  return out;
}

TEST_CASE("an axis that wobbles twice per turn does at q what one that wobbles once does at 2q") {
  const truing::Robot robot = arms::ur10();
  const truing::Measurements data;
  Inputs in;
  in.data = &data;
  in.joints = Eigen::VectorXd::Constant(6, 0.3);
  const auto twice = values_at("axis_wobble_twice", {"J2"}, robot, in);
  in.joints *= 2.0;
  const auto once = values_at("axis_wobble", {"J2"}, robot, in);
  REQUIRE(twice.size() == 4);
  for (const char* part : {"cos_x", "sin_x", "cos_y", "sin_y"}) {
    CHECK(twice.at(std::string("axis_wobble_twice.J2.") + part) ==
          doctest::Approx(once.at(std::string("axis_wobble.J2.") + part)));
  }
  CHECK(truing::find_effect("axis_wobble_twice").traits.search == Search::always);
}

TEST_CASE("a joint is turned by every other joint with a reading, each by its own ratio and each a form of its own") {
  const truing::Measurements data;
  Inputs in;
  in.data = &data;
  in.joints = Eigen::VectorXd::LinSpaced(6, 0.1, 0.6);
  const truing::Robot robot = arms::ur10();
  const auto inner = values_at("neighbour_coupling", {"J3"}, robot, in);
  REQUIRE(inner.size() == 5);
  CHECK(inner.at("neighbour_coupling.J3.J2") == doctest::Approx(0.2));
  CHECK(inner.at("neighbour_coupling.J3.J4") == doctest::Approx(0.4));
  CHECK(inner.at("neighbour_coupling.J3.J6") == doctest::Approx(0.6));
  // What concentric shafts do in the wrist is joint_coupling's.
  CHECK(values_at("neighbour_coupling", {"J6"}, robot, in).count("neighbour_coupling.J6.J5") == 0);
  CHECK(values_at("neighbour_coupling", {"J5"}, robot, in).count("neighbour_coupling.J5.J6") == 1);
  const auto forms = truing::find_effect("neighbour_coupling").forms(robot, 2, data);
  REQUIRE(forms.size() == 5);
  for (const truing::EffectForm& form : forms) {
    REQUIRE(form.parameters.size() == 1);
    CHECK(inner.count(form.parameters[0]) == 1);
    CHECK(form.constants.empty());
  }
  // The palletizer's fourth joint has no reading.
  CHECK(values_at("neighbour_coupling", {"J5"}, arms::palletizer(), in).count("neighbour_coupling.J5.J4") == 0);
  CHECK_THROWS_AS(truing::effect_terms({{"neighbour_coupling", {"J4"}}}, arms::palletizer(), data), truing::Unsuited);
}

/// Readings of a palletizer's joints, one row each.
struct Crank {
  std::vector<double> first, last, others;
  truing::Measurements data;

  explicit Crank(const std::vector<std::pair<double, double>>& angles) : others(angles.size(), 0.0) {
    for (const auto& [a, b] : angles) {
      first.push_back(a);
      last.push_back(b);
    }
    data.rows = angles.size();
    data.joints = {{others.data(), 1}, {first.data(), 1}, {last.data(), 1}, {others.data(), 1}};
  }
  Crank(const Crank&) = delete;

  Inputs row(std::size_t at) const {
    Inputs in;
    in.row = at;
    in.data = &data;
    in.joints = Eigen::VectorXd::Zero(5);
    in.joints << 0.0, first[at], last[at], -first[at] - last[at], 0.0;
    return in;
  }
};

TEST_CASE("the law of unequal bars is the exact closure of the linkage, to first order") {
  const double length = 0.4, crank = 0.25, phase = 1.3;
  const Crank readings({{-0.6, 0.1}, {-0.2, 0.1}, {0.1, -0.3}, {0.5, 0.0}, {0.8, -0.4}});
  truing::Robot robot = arms::palletizer();
  robot.effects = {{"linkage", {"J4"}, {{"linkage.J4.phase_first", phase}}}};
  const std::vector<four_bar::Bars> changes = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}, {3, -2, 1, 2}};
  for (const four_bar::Bars& d : changes) {
    for (std::size_t row = 0; row < 5; ++row) {
      const auto law = values_at("linkage", {"J4"}, robot, readings.row(row));
      REQUIRE(law.size() == 2);
      const double rods = (d.base - d.coupler) / crank, arms = (d.rocker - d.crank) / crank;
      const double first_order = rods * law.at("linkage.J4.rods_first") + arms * law.at("linkage.J4.arms_first");
      const double theta = phase + readings.first[row];
      const auto exact = [&](double size) {
        const four_bar::Bars bars = {length + size * d.base, crank + size * d.crank, length + size * d.coupler,
                                     crank + size * d.rocker};
        return four_bar::rocker_angle(bars, theta) - theta;
      };
      const double step = 1e-6;
      CHECK((exact(step) - exact(-step)) / (2.0 * step) == doctest::Approx(first_order).epsilon(1e-6));
    }
  }
}

TEST_CASE("a parallelogram is square in the middle of its range, unless the robot carries its phase") {
  const Crank readings({{-0.5, 0.1}, {0.1, -0.3}, {0.9, -0.4}});
  truing::Robot robot = arms::palletizer();
  const auto terms = truing::effect_terms({{"linkage", {"J4"}}}, robot, readings.data);
  REQUIRE(terms.size() == 6);  // by the difference of the drivers, by the first and by their sum
  CHECK(terms[2].parameter == "linkage.J4.rods_first");
  CHECK(terms[3].parameter == "linkage.J4.arms_first");
  CHECK(terms[2].constants.at("linkage.J4.phase_first") == doctest::Approx(M_PI / 2.0 - 0.2));
  CHECK(terms[2].basis(readings.row(0)) == doctest::Approx(terms[2].basis(readings.row(2))));
  CHECK(terms[3].basis(readings.row(0)) == doctest::Approx(-terms[3].basis(readings.row(2))));
  robot.effects = {{"linkage", {"J4"}, {{"linkage.J4.phase_sum", 1.0}}}};
  const auto carried = truing::effect_terms({{"linkage", {"J4"}}}, robot, readings.data);
  REQUIRE(carried.size() == 2);
  CHECK(carried[0].parameter == "linkage.J4.rods_sum");
  CHECK(carried[0].basis(readings.row(1)) == doctest::Approx(1.0 / std::sin(1.0 - 0.2)));
}

TEST_CASE(
    "rods that drive an elbow act where its axis is parallel to the one before, and are right where they are square") {
  const std::vector<double> elbow = {-0.8, 0.3, 0.9}, still = {0.0, 0.0, 0.0};
  truing::Measurements data;
  data.rows = 3;
  data.joints.assign(6, {still.data(), 1});
  data.joints[2] = {elbow.data(), 1};
  truing::Robot robot = arms::ur10();
  CHECK_THROWS_AS(truing::effect_terms({{"elbow_linkage", {"J2"}}}, robot, data), truing::Unsuited);
  CHECK_THROWS_AS(truing::effect_terms({{"elbow_linkage", {"J5"}}}, robot, data), truing::Unsuited);
  CHECK_THROWS_AS(truing::effect_terms({{"elbow_linkage", {"J4"}}}, arms::palletizer(), Crank({{0, 0}}).data),
                  truing::Unsuited);
  robot.effects = {{"elbow_linkage", {"J3"}, {{"elbow_linkage.J3.phase", 1.3}}}};
  const auto terms = truing::effect_terms({{"elbow_linkage", {"J3"}}}, robot, data);
  REQUIRE(terms.size() == 2);
  Inputs in;
  in.data = &data;
  in.joints = Eigen::VectorXd::Zero(6);
  for (const double q : elbow) {
    in.joints[2] = q;
    CHECK(terms[0].basis(in) == doctest::Approx(1.0 / std::sin(q + 1.3) - 1.0));
    CHECK(terms[1].basis(in) == doctest::Approx(1.0 / std::tan(q + 1.3)));
  }
  in.joints[2] = M_PI / 2.0 - 1.3;
  CHECK(std::abs(terms[0].basis(in)) < 1e-12);
  CHECK(std::abs(terms[1].basis(in)) < 1e-12);
  for (const truing::EffectForm& form : truing::find_effect("elbow_linkage").forms(arms::ur10(), 2, data)) {
    for (const double q : elbow) CHECK(std::sin(q + form.constants.at("elbow_linkage.J3.phase")) > 0.19);
  }
}

TEST_CASE("no crank turns through its dead centres") {
  const Crank readings({{-1.0, -1.2}, {0.0, 0.0}, {1.0, 1.2}});  // the sum of the drivers does
  const auto terms = truing::effect_terms({{"linkage", {"J4"}}}, arms::palletizer(), readings.data);
  REQUIRE(terms.size() == 4);
  CHECK(terms[0].parameter == "linkage.J4.rods");
  CHECK(terms[2].parameter == "linkage.J4.rods_first");
  for (const truing::EffectForm& form : truing::find_effect("linkage").forms(arms::palletizer(), 3, readings.data)) {
    REQUIRE(form.constants.size() == 1);
    CHECK(form.constants.count("linkage.J4.phase_sum") == 0);
    if (form.constants.count("linkage.J4.phase_first") == 0) continue;
    for (const double angle : readings.first)
      CHECK(std::sin(angle + form.constants.at("linkage.J4.phase_first")) > 0.19);
  }
  const Crank all_around({{-2.0, -2.0}, {2.0, -2.0}, {-2.0, 2.0}, {2.0, 2.0}});
  CHECK_THROWS_AS(truing::effect_terms({{"linkage", {"J4"}}}, arms::palletizer(), all_around.data), truing::Unsuited);
}

TEST_CASE(
    "a warm robot is longer by one coefficient on all of its links, and right at 20 degrees unless it says else") {
  const std::vector<double> temperature = {20.0, 32.0};
  truing::Measurements data;
  data.rows = 2;
  data.temperature = {temperature.data(), 1};
  truing::Robot robot = arms::ur10();
  std::map<std::string, double> lengths;
  Inputs in;
  in.data = &data;
  in.row = 1;
  for (const Term& term : truing::effect_terms({{"thermal", {}}}, robot, data)) {
    CHECK(term.parameter == "thermal");
    CHECK(term.joint.empty());
    CHECK(term.constants.at("thermal.reference_C") == 20.0);
    lengths[term.site] = term.basis(in);
    in.row = 0;
    CHECK(term.basis(in) == 0.0);
    in.row = 1;
  }
  REQUIRE(lengths.size() == 6);
  CHECK(lengths.at("J3.a") == doctest::Approx(12.0 * -0.612));
  CHECK(lengths.at("J1.d") == doctest::Approx(12.0 * 0.1273));
  const auto link = truing::effect_terms({{"thermal", {"J3"}}}, robot, data);
  REQUIRE(link.size() == 1);
  CHECK(link[0].parameter == "thermal.J3");
  robot.effects = {{"thermal", {}, {{"thermal.reference_C", 26.0}}}};
  for (const Term& term : truing::effect_terms({{"thermal", {}}}, robot, data)) {
    if (term.site == "J3.a") CHECK(term.basis(in) == doctest::Approx(6.0 * -0.612));
  }
}

TEST_CASE("loaded play changes side with the direction and grows with the torque") {
  const truing::Robot robot = arms::ur10();
  const std::vector<double> directions = {1.0, -1.0};
  truing::Measurements data;
  data.rows = 2;
  data.direction.assign(6, {directions.data(), 1});
  Inputs in;
  in.data = &data;
  in.gravity_torque = Eigen::VectorXd::Constant(6, 30.0);
  CHECK(values_at("loaded_play", {"J2"}, robot, in).at("loaded_play.J2") == doctest::Approx(30.0));
  in.row = 1;
  in.gravity_torque *= 2.0;
  CHECK(values_at("loaded_play", {"J2"}, robot, in).at("loaded_play.J2") == doctest::Approx(-60.0));
}

}  // namespace
