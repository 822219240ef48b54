// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Which effects take part in a diagnosis: by their traits, the caller's own like the catalogue's.

#include <doctest/doctest.h>

#include <algorithm>

#include "support/arms.hpp"

namespace {

using truing::Candidate;
using truing::DiagnoseOptions;
using truing::Diagnosis;
using truing::Robot;

/// Poses of the arm, measured with noise of 30 um; temperature rises.
std::unique_ptr<arms::Table> a_table(const Robot& truth, std::size_t rows, unsigned seed,
                                     const std::vector<truing::Effect>& own = {}) {
  auto table = arms::random_joints(truth, rows, seed);
  std::vector<double> temperature(rows);
  for (std::size_t row = 0; row < rows; ++row) temperature[row] = 20.0 + static_cast<double>((7 * row) % 13);
  table->data.temperature = table->add(temperature);
  const truing::Prediction predicted = truing::predict(truth, table->data, own, 1);
  std::mt19937_64 random(seed + 1);
  for (Eigen::Index k = 0; k < 3; ++k) {
    std::vector<double> values(rows);
    for (std::size_t row = 0; row < rows; ++row) {
      double noise = -6.0;
      for (int n = 0; n < 12; ++n) noise += static_cast<double>(random() >> 11) * 0x1.0p-53;
      values[row] = predicted.position(static_cast<Eigen::Index>(row), k) + 3e-5 * noise;
    }
    table->data.position[static_cast<std::size_t>(k)] = table->add(values);
  }
  return table;
}

bool is_candidate(const Diagnosis& d, const std::string& effect) {
  return std::any_of(d.candidates.begin(), d.candidates.end(), [&](const Candidate& c) { return c.effect == effect; });
}

/// A zero that jumps at 26 deg C.
truing::Effect jump() {
  truing::Effect effect;
  effect.name = "jump";
  effect.traits.driver = truing::Driver::temperature;
  effect.traits.separated_by = {{truing::Experiment::own_words, "", "keep the room below 26 deg C"}};
  effect.terms = [](const Robot& robot, std::size_t joint, const truing::Measurements&) {
    truing::Term term;
    term.parameter = "jump." + robot.joints[joint].name;
    term.unit = "rad";
    term.site = robot.joints[joint].name;
    term.basis = [](const truing::Inputs& in) { return in.data->temperature[in.row] > 26.0 ? 1.0 : 0.0; };
    return std::vector<truing::Term>{term};
  };
  return effect;
}

TEST_CASE("an effect that is searched only if asked is a candidate when it is asked for") {
  const Robot robot = arms::ur10();
  const auto table = a_table(robot, 60, 11);
  truing::Effect rare = jump();
  rare.traits.search = truing::Search::if_asked;
  DiagnoseOptions options;
  options.own_effects = {rare};
  options.resamples = 2;
  options.threads = 1;
  const Diagnosis usual = truing::diagnose(robot, table->data, options);
  CHECK(is_candidate(usual, "axis_wobble"));
  CHECK(is_candidate(usual, "axis_wobble_twice"));
  CHECK(!is_candidate(usual, "jump"));
  options.also = {"jump"};
  CHECK(is_candidate(truing::diagnose(robot, table->data, options), "jump"));
}

TEST_CASE("of an effect's forms at a joint one line is shown, and the whole robot's effect beside the joints'") {
  const Robot robot = arms::ur10();
  const auto table = a_table(robot, 60, 13);
  DiagnoseOptions options;
  options.resamples = 2;
  options.threads = 1;
  const Diagnosis d = truing::diagnose(robot, table->data, options);
  const auto count = [&](const std::string& effect, const std::vector<std::string>& joints) {
    return std::count_if(d.candidates.begin(), d.candidates.end(),
                         [&](const Candidate& c) { return c.effect == effect && c.joints == joints; });
  };
  CHECK(count("neighbour_coupling", {"J3"}) == 1);
  CHECK(count("thermal", {}) == 1);
  CHECK(count("thermal", {"J3"}) == 1);
}

TEST_CASE("an own effect is found at its joint and drawn over the input that drives it") {
  const Robot robot = arms::ur10();
  Robot truth = robot;
  truth.effects = {{"jump", {"J2"}, {{"jump.J2", 5e-4}}}};
  const auto table = a_table(truth, 120, 12, {jump()});
  DiagnoseOptions options;
  options.own_effects = {jump()};
  options.resamples = 4;
  options.threads = 1;
  const Diagnosis d = truing::diagnose(robot, table->data, options);
  INFO(d.sentence);
  REQUIRE(!d.effects.empty());
  CHECK(d.effects[0].effect == "jump");
  CHECK(d.effects[0].joints == std::vector<std::string>{"J2"});
  REQUIRE(!d.effects[0].curves.empty());
  CHECK(d.effects[0].curves[0].input == "temp");
  for (const truing::Alternative& other : d.effects[0].confounded_with) {
    if (other.probability > 0.0) CHECK(other.separated_by == "keep the room below 26 deg C");
  }
}

}  // namespace
