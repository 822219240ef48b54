// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Which effects take part in a diagnosis: by their traits, the caller's own like the catalogue's.

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <optional>

#include "diagnosis/design.hpp"
#include "diagnosis/inputs.hpp"
#include "diagnosis/linearise.hpp"
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

TEST_CASE("a spring at a joint that stands still is named, with the bending that looks the same") {
  const Robot robot = arms::ur10();
  Robot truth = robot;
  truth.effects = {{"joint_compliance", {"J3"}, {{"joint_compliance.J3", 2e-6}}}};
  truth.T_measurement_base.translation() = Eigen::Vector3d(0.5, -0.2, 0.8);
  const auto table = arms::random_joints(truth, 150, 21);
  for (const std::size_t still : {2U, 3U, 4U}) table->data.joints[still] = table->add(std::vector<double>(150, 0.4));
  arms::measure(table.get(), truth, arms::What::position, 3e-5, 22);
  DiagnoseOptions options;
  options.threads = 1;
  const Diagnosis d = truing::diagnose(robot, table->data, options);
  INFO(d.sentence);
  REQUIRE(d.effects.size() == 1);
  const truing::FoundEffect& named = d.effects[0];
  const auto is_said = [&](const std::string& effect, const std::string& joint) {
    const std::vector<std::string> at = {joint};
    return (named.effect == effect && named.joints == at) ||
           std::any_of(named.confounded_with.begin(), named.confounded_with.end(),
                       [&](const truing::Alternative& a) { return a.effect == effect && a.joints == at; });
  };
  CHECK(is_said("joint_compliance", "J3"));
  CHECK(is_said("link_compliance", "J2"));
  // What follows the joint's own motion cannot be judged, and is no candidate.
  for (const char* effect : {"gear_ratio", "harmonic", "axis_wobble"}) {
    CHECK(std::none_of(d.candidates.begin(), d.candidates.end(), [&](const Candidate& c) {
      return c.effect == effect && c.joints == std::vector<std::string>{"J3"};
    }));
  }
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

/// Columns of all rows where a robot stands at `at`.
truing::diagnosis::Design design_at(const Robot& nominal, const Robot& at, const truing::Measurements& data) {
  const std::vector<truing::diagnosis::InputColumn> inputs =
      truing::diagnosis::make_inputs(truing::diagnosis::links_as_drawn(at, nominal), data);
  std::vector<std::int32_t> rows(data.rows);
  std::iota(rows.begin(), rows.end(), 0);
  const std::vector<std::int8_t> set(rows.size(), 0);
  const DiagnoseOptions options;
  return truing::diagnosis::make_design({nominal, at, {}, data, inputs, rows, set, rows, options});
}

}  // namespace

TEST_CASE("a weight that hardly loads a joint is not thought larger for it than machines are") {
  Robot nominal = arms::palletizer();  // joint 4 holds what it carries upright: that loads neither joint 2 nor 3
  for (truing::Joint& joint : nominal.joints) joint.mass = std::nullopt;
  Robot at = nominal;
  at.joints[2].alpha += 0.01;  // but for bars that are not quite parallel
  const auto table = a_table(nominal, 60, 31);
  const truing::diagnosis::Design design = design_at(nominal, at, table->data);
  const auto size_of = [&](const std::string& moment) {
    const int column = design.column("gravity_moment.J2." + moment);
    REQUIRE(column >= 0);
    return design.prior[column];
  };
  CHECK(size_of("J2.x") > 1e-4);
  for (const std::string moment : {"J2.x", "J2.y", "J3.x", "J3.y", "J4.x", "J4.y", "J4.z", "J5.x", "J5.y", "J5.z"}) {
    CAPTURE(moment);
    CHECK(size_of(moment) <= 5e-3);
  }
}

TEST_CASE("a balanced joint has no side, though the last link is a little off where columns are taken") {
  Robot nominal = arms::rail_arm();
  for (truing::Joint& joint : nominal.joints) joint.mass = 2.0;
  nominal.joints[3].center_of_mass = {-0.4, 0.0, 0.0};  // on the joint's axis
  Robot at = nominal;
  at.joints[3].a += 1e-3;  // which the data cannot tell from the tool
  const auto table = a_table(nominal, 60, 41);
  const truing::diagnosis::Design design = design_at(nominal, at, table->data);
  const auto moves_the_tip = [&](const std::string& name) {
    const int column = design.column(name);
    REQUIRE(column >= 0);
    return !design.x.col(column).isZero(0.0);
  };
  CHECK(!moves_the_tip("gravity_backlash.J3"));
  CHECK(moves_the_tip("gravity_backlash.J2"));
}
