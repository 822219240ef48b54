// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Laws of single effects, at one configuration. What all effects have in common is in test_effect_laws.cpp.

#include <doctest/doctest.h>

#include <cmath>

#include "support/arms.hpp"

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
  CHECK(truing::find_effect("axis_wobble_twice").traits.search == Search::if_asked);
}

TEST_CASE("a joint is turned by the joints on both sides of it in the chain, each by its own ratio") {
  const truing::Measurements data;
  Inputs in;
  in.data = &data;
  in.joints = Eigen::VectorXd::LinSpaced(6, 0.1, 0.6);
  const auto inner = values_at("neighbour_coupling", {"J3"}, arms::ur10(), in);
  REQUIRE(inner.size() == 2);
  CHECK(inner.at("neighbour_coupling.J3.J2") == doctest::Approx(0.2));
  CHECK(inner.at("neighbour_coupling.J3.J4") == doctest::Approx(0.4));
  CHECK(values_at("neighbour_coupling", {"J1"}, arms::ur10(), in).size() == 1);
  // Of the palletizer's fifth joint the neighbour is passive: its motion is that of others.
  CHECK_THROWS_AS(truing::effect_terms({{"neighbour_coupling", {"J5"}}}, arms::palletizer(), data), truing::Unsuited);
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
