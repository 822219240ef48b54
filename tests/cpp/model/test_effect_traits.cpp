// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What effects say of themselves, and the experiments that tell them apart.

#include <doctest/doctest.h>

#include <algorithm>
#include <set>

#include "model/effects/traits.hpp"

using namespace truing;
using model::EffectAt;
using model::Recorded;

namespace {

std::set<std::string> names() {
  std::set<std::string> out;
  for (const Effect& effect : catalogue()) out.insert(effect.name);
  return out;
}

EffectAt at(const std::string& effect, const std::vector<std::string>& joints = {}) {
  return {&find_effect(effect), joints};
}

std::string told_apart(const EffectAt& a, const EffectAt& b, const Recorded& recorded = {}) {
  const std::string text = model::separated_by(a, b, recorded, "where they differ");
  CHECK(model::separated_by(b, a, recorded, "where they differ") == text);
  return text;
}

TEST_CASE("the effects that traits name are there") {
  const std::set<std::string> known = names();
  for (const Effect& effect : catalogue()) {
    CAPTURE(effect.name);
    const EffectTraits& traits = effect.traits;
    for (const std::string& name : traits.mimicked_by) CHECK(known.count(name) == 1);
    for (const ContainedIn& in : traits.contained_in) CHECK(known.count(in.effect) == 1);
    for (const SeparatedBy& by : traits.separated_by) CHECK((by.from.empty() || known.count(by.from) == 1));
    if (!traits.weights_found_by.empty()) CHECK(known.count(traits.weights_found_by) == 1);
    CHECK((traits.law_test == LawTest::none || traits.law != Law::none));
    CHECK(!traits.documentation.law.empty());
    CHECK(!traits.documentation.parameters.empty());
  }
}

TEST_CASE("an effect that stands for parameters of the model is found by what it stands for") {
  for (const StandsFor what : {StandsFor::gear_ratio, StandsFor::joint_offset, StandsFor::link_geometry,
                               StandsFor::base_frame, StandsFor::tool_frame}) {
    CHECK(model::effect_that_stands_for(what).traits.stands_for == what);
  }
}

TEST_CASE("every order of tooth errors has the traits of their family") {
  const EffectTraits& family = find_effect("transmission_error").traits;
  const EffectTraits& order = find_effect("transmission_error@96").traits;
  CHECK(family.search == Search::by_order);
  CHECK(order.search == family.search);
  CHECK(order.driver == family.driver);
  CHECK(transmission_error(14).traits.driver == family.driver);
}

TEST_CASE("the most telling experiment of a pair is named, whichever of the two names it") {
  CHECK(told_apart(at("scale"), at("thermal", {"J2"})) == "measure a scale bar of known length");
  CHECK(told_apart(at("thermal", {"J2"}), at("drift")).find("warm-up and cool-down") != std::string::npos);
  CHECK(told_apart(at("joint_compliance", {"J2"}), at("link_compliance", {"J2"})).find("elbow") != std::string::npos);
  CHECK(told_apart(at("joint_coupling"), at("linkage", {"J4"})) == "where they differ");
}

TEST_CASE("what was recorded already is not asked for again") {
  Recorded recorded;
  const EffectAt play = at("backlash", {"J2"}), zero = at("joint_offset", {"J2"});
  CHECK(told_apart(play, zero).find("both sides") != std::string::npos);
  recorded.direction = true;
  CHECK(told_apart(play, zero, recorded) == "where they differ");
  const EffectAt wobble = at("axis_wobble", {"J2"});
  CHECK(told_apart(wobble, zero) == "measure orientations as well");
  recorded.orientation = true;
  CHECK(told_apart(wobble, zero, recorded) == "where they differ");
}

TEST_CASE("no measurement tells an effect from a larger one that contains it at the same joint") {
  const std::string text = told_apart(at("joint_offset", {"J2"}), at("link_geometry", {"J2"}));
  CHECK(text == "no measurement; a joint's zero is part of its link's geometry");
  CHECK(told_apart(at("joint_offset", {"J2"}), at("link_geometry", {"J3"})) == "where they differ");
}

TEST_CASE("an own effect speaks in its own words") {
  Effect own;
  own.name = "creep";
  own.traits.separated_by = {{Experiment::own_words, "", "let the arm cool down"}};
  CHECK(told_apart({&own, {"J2"}}, at("scale")) == "let the arm cool down");
}

}  // namespace
