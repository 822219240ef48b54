// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Names that together stand for one function are held against it together.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "support/arms.hpp"
#include "support/sanitized.hpp"

using namespace arms;
using truing::diagnose;
using truing::Diagnosis;

namespace {

constexpr double kTipNoise = 3e-5;  // [m] of one coordinate

Robot arm_without_masses() {
  Robot robot = ur10();
  for (Joint& j : robot.joints) j.mass.reset();
  robot.T_measurement_base = somewhere();
  return robot;
}

/// Of row and reading.
using Beside = std::function<double(std::size_t, double)>;

/// Measured where each of some joints stands beside what was read of it.
std::unique_ptr<Table> measured_beside(std::size_t rows, unsigned seed, const std::map<std::size_t, Beside>& joints) {
  const Robot robot = arm_without_masses();
  auto table = random_joints(robot, rows, seed);
  const std::vector<Column> read = table->data.joints;
  for (const auto& [k, beside] : joints) {
    std::vector<double> stands(rows);
    for (std::size_t row = 0; row < rows; ++row) stands[row] = read[k][row] + beside(row, read[k][row]);
    table->data.joints[k] = table->add(stands);
  }
  measure(table.get(), robot, What::position, kTipNoise, seed + 1);
  table->data.joints = read;
  return table;
}

std::string what_was_said(const Diagnosis& d) {
  std::string out;
  for (const auto& e : d.effects)
    out += e.effect + (e.joints.empty() ? "" : ":" + e.joints[0]) + " " + std::to_string(e.probability) + "; ";
  for (const auto& u : d.unknown) out += "unknown " + u.joint + "; ";
  return out;
}

}  // namespace

TEST_CASE("a pack that tightens from an angle on is no wrong ratio beside a harmonic" * doctest::skip(kSanitized)) {
  for (const unsigned seed : {10u, 20u, 30u}) {
    const auto table = measured_beside(
        200, seed, {{2, [](std::size_t, double q) { return 1.6e-4 * std::pow(std::max(0.0, q + 0.2), 1.5); }}});
    const Diagnosis d = diagnose(arm_without_masses(), table->data);
    CAPTURE(seed);
    INFO(what_was_said(d));
    CHECK(d.effects.empty());
    REQUIRE(d.unknown.size() == 1);
    CHECK(d.unknown[0].joint == "J3");
    CHECK(d.unknown[0].inputs == std::vector<std::string>{"q3"});
  }
}

TEST_CASE("names that were one function leave room for what there was none for" * doctest::skip(kSanitized)) {
  const auto pack = [](double at, double q) { return std::pow(std::max(0.0, q - at), 1.5); };
  const auto table = measured_beside(200, 10,
                                     {{2, [&](std::size_t, double q) { return 1.6e-4 * pack(-0.2, q); }},
                                      {4, [&](std::size_t, double q) { return 6e-4 * pack(0.6, q); }}});
  truing::DiagnoseOptions options;
  options.max_effects = 4;  // taken by names that stand for the two packs, until they are questioned
  const Diagnosis d = diagnose(arm_without_masses(), table->data, options);
  INFO(what_was_said(d));
  CHECK(d.effects.empty());
  REQUIRE(d.unknown.size() == 2);
  for (const char* joint : {"J3", "J5"})
    CHECK(std::any_of(d.unknown.begin(), d.unknown.end(), [&](const auto& u) { return u.joint == joint; }));
}

TEST_CASE("a first joint that goes with the square of a recorded temperature is no frame that drifts") {
  constexpr std::size_t kRows = 300;
  const auto warmer = [](std::size_t row) {
    return 15.0 * std::sin(3.14 * static_cast<double>(row) / static_cast<double>(kRows));
  };
  const auto table = measured_beside(
      kRows, 40, {{0, [&](std::size_t row, double) { return 3e-5 * std::pow((warmer(row) - 9.5) / 4.6, 2.0); }}});
  std::vector<double> time(kRows), temperature(kRows);
  for (std::size_t row = 0; row < kRows; ++row) {
    time[row] = 24.0 * static_cast<double>(row);
    temperature[row] = 20.0 + warmer(row);
  }
  table->data.time = table->add(time);
  table->data.temperature = table->add(temperature);
  const Diagnosis d = diagnose(arm_without_masses(), table->data);
  INFO(what_was_said(d));
  CHECK(d.effects.empty());
  REQUIRE(d.unknown.size() == 1);
  CHECK(d.unknown[0].joint == "J1");
  CHECK(d.unknown[0].inputs == std::vector<std::string>{"temp"});
}

namespace {

/// What a robot with these effects is said to have.
Diagnosis diagnosis_of(const std::vector<truing::AppliedEffect>& effects, unsigned seed) {
  Robot truth = arm_without_masses();
  truth.effects = effects;
  auto table = random_joints(truth, 200, seed);
  measure(table.get(), truth, What::position, kTipNoise, seed + 1);
  return diagnose(arm_without_masses(), table->data);
}

bool is_named_at(const Diagnosis& d, const std::string& effect, const std::string& joint) {
  return std::any_of(d.effects.begin(), d.effects.end(),
                     [&](const auto& e) { return e.effect == effect && e.joints == std::vector<std::string>{joint}; });
}

}  // namespace

TEST_CASE("two laws of one joint's angle that are both there keep their names") {
  const Diagnosis d =
      diagnosis_of({{"harmonic", {"J3"}, {{"harmonic.J3.cos1", 4e-4}, {"harmonic.J3.sin1", 2e-4}}},
                    {"axis_wobble", {"J3"}, {{"axis_wobble.J3.cos_x", 4e-4}, {"axis_wobble.J3.sin_y", 4e-4}}}},
                   50);
  INFO(what_was_said(d));
  CHECK(d.unknown.empty());
  CHECK(is_named_at(d, "harmonic", "J3"));
  CHECK(is_named_at(d, "axis_wobble", "J3"));
}

TEST_CASE("an eccentric disc keeps its name beside a larger tilting axis of its joint: that leaves no turn about it") {
  const Diagnosis d =
      diagnosis_of({{"harmonic", {"J3"}, {{"harmonic.J3.cos1", 8e-5}, {"harmonic.J3.sin1", 6e-5}}},
                    {"axis_wobble", {"J3"}, {{"axis_wobble.J3.cos_x", 1.2e-3}, {"axis_wobble.J3.sin_y", 1.2e-3}}}},
                   50);
  INFO(what_was_said(d));
  CHECK(is_named_at(d, "harmonic", "J3"));
  CHECK(is_named_at(d, "axis_wobble", "J3"));
}

TEST_CASE("a joint that carries another along and errs by itself keeps both names") {
  for (const unsigned seed : {60u, 70u}) {
    const Diagnosis d = diagnosis_of({{"neighbour_coupling", {"J2"}, {{"neighbour_coupling.J2.J3", 2e-4}}},
                                      {"harmonic", {"J3"}, {{"harmonic.J3.cos1", 3e-4}, {"harmonic.J3.sin1", 2e-4}}}},
                                     seed);
    INFO(what_was_said(d));
    CHECK(d.unknown.empty());
    CHECK(is_named_at(d, "neighbour_coupling", "J2"));
    CHECK(is_named_at(d, "harmonic", "J3"));
  }
}

TEST_CASE("a joint that gives way and is carried along keeps both names") {
  Robot robot = ur10();
  robot.T_measurement_base = somewhere();
  for (const unsigned seed : {80u, 90u}) {
    Robot truth = robot;
    truth.effects = {{"joint_compliance", {"J2"}, {{"joint_compliance.J2", 1e-6}}},
                     {"neighbour_coupling", {"J2"}, {{"neighbour_coupling.J2.J3", 1e-4}}}};
    auto table = random_joints(truth, 200, seed);
    measure(table.get(), truth, What::position, kTipNoise, seed + 1);
    const Diagnosis d = diagnose(robot, table->data);
    INFO(what_was_said(d));
    CHECK(d.unknown.empty());
    CHECK(is_named_at(d, "joint_compliance", "J2"));
    CHECK(is_named_at(d, "neighbour_coupling", "J2"));
  }
}
