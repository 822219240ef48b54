// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Effects that fit the data and that no machine has: they get no name.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "model/effects/traits.hpp"
#include "support/arms.hpp"
#include "support/sanitized.hpp"

using namespace arms;
using truing::diagnose;
using truing::Diagnosis;

namespace plausible {
namespace {

constexpr double kNoise = 3e-5;  // [m] of one coordinate

/// Random poses of `truth` where the joint numbered `k` is off by `error` of the readings [rad].
std::unique_ptr<Table> measured(Robot truth, std::size_t rows, unsigned seed, std::size_t k,
                                const std::function<double(const Table&, std::size_t row)>& error) {
  auto table = random_joints(truth, rows, seed);
  const Column read = table->data.joints[k];
  std::vector<double> moved(rows);
  for (std::size_t row = 0; row < rows; ++row) moved[row] = read[row] + error(*table, row);
  table->data.joints[k] = table->add(moved);
  measure(table.get(), truth, What::position, kNoise, seed + 2);
  table->data.joints[k] = read;
  return table;
}

const truing::UnknownEffect* unknown_at(const Diagnosis& d, const std::string& joint) {
  const auto at = std::find_if(d.unknown.begin(), d.unknown.end(),
                               [&](const truing::UnknownEffect& unknown) { return unknown.joint == joint; });
  return at == d.unknown.end() ? nullptr : &*at;
}

bool is_named(const Diagnosis& d, const std::string& effect, const std::string& joint) {
  return std::any_of(d.effects.begin(), d.effects.end(), [&](const truing::FoundEffect& e) {
    return e.effect == effect && std::find(e.joints.begin(), e.joints.end(), joint) != e.joints.end();
  });
}

/// A table-top arm: 0.4 m of reach, a thirtieth of the weights.
Robot small_arm() {
  Robot out = ur10();
  for (truing::Joint& joint : out.joints) {
    joint.a *= 0.3;
    joint.d *= 0.3;
    joint.mass = *joint.mass / 30.0;
    joint.center_of_mass *= 0.3;
  }
  return out;
}

}  // namespace

TEST_CASE("a harmonic four times as large as machines have them is unknown, and said to look like one") {
  Robot truth = ur10();
  truth.T_measurement_base = somewhere();
  const auto table = measured(truth, 200, 41, 2, [](const Table& t, std::size_t row) {
    const double q = t.data.joints[2][row];
    return 0.02 * std::cos(q) + 0.005 * std::sin(2.0 * q);
  });
  const Diagnosis d = diagnose(ur10(), table->data);
  CHECK(!is_named(d, "harmonic", "J3"));
  const truing::UnknownEffect* unknown = unknown_at(d, "J3");
  REQUIRE(unknown);
  CHECK(unknown->inputs == std::vector<std::string>{"q3"});
  CHECK_MESSAGE(unknown->looks_like.find("more than machines have") != std::string::npos, unknown->looks_like);
}

TEST_CASE("a bend over 40 degrees of travel is no harmonic with an amplitude beyond machines") {
  Robot truth = ur10();
  truth.joints[3].lower = 0.5;
  truth.joints[3].upper = 1.2;
  truth.T_measurement_base = somewhere();
  for (const unsigned seed : {51u, 52u, 53u}) {
    const auto table = measured(truth, 200, seed, 3, [](const Table& t, std::size_t row) {
      const double x = (t.data.joints[3][row] - 0.85) / 0.35;
      return 2e-3 * (x * x * x - 0.6 * x);
    });
    const Diagnosis d = diagnose(ur10(), table->data);
    CAPTURE(seed);
    for (const truing::AppliedEffect& effect : d.robot.effects) {
      const double most = truing::model::traits_of(effect.effect, {}).plausible;
      for (const auto& parameter : effect.parameters) {
        CAPTURE(parameter.first);
        if (most > 0.0 && parameter.first.rfind("harmonic", 0) == 0) CHECK(std::abs(parameter.second) < 1.5 * most);
      }
    }
  }
}

TEST_CASE("a vertical joint of a base that leans a little is no spring" * doctest::skip(kSanitized)) {
  // It carries next to nothing, 0.006 degrees of the arm's weight. What looks like its spring is smaller than
  // what machines may have, and would give way by a radian under the weight that other joints carry.
  Robot leaning = ur10();
  leaning.gravity = Eigen::AngleAxisd(1e-4, Eigen::Vector3d(0.6, 0.8, 0.0)) * leaning.gravity;
  Robot truth = leaning;
  truth.T_measurement_base = somewhere();
  truth.effects = {{"joint_compliance", {"J1"}, {{"joint_compliance.J1", 4.5e-3}}}};
  for (const unsigned seed : {61u, 62u, 63u}) {
    const auto table = measured(truth, 300, seed, 0, [](const Table&, std::size_t) { return 0.0; });
    const Diagnosis d = diagnose(leaning, table->data);
    CAPTURE(seed);
    CHECK(!is_named(d, "joint_compliance", "J1"));
    CHECK(!is_named(d, "stiffness_zones", "J1"));
  }
}

TEST_CASE("a joint that is as soft as the smallest strain wave gears is a spring") {
  Robot truth = small_arm();
  truth.T_measurement_base = somewhere();
  truth.effects = {{"joint_compliance", {"J3"}, {{"joint_compliance.J3", 1.0 / 90.0}}}};
  const auto table = measured(truth, 200, 81, 2, [](const Table&, std::size_t) { return 0.0; });
  const Diagnosis d = diagnose(small_arm(), table->data);
  INFO(d.sentence);
  CHECK(is_named(d, "joint_compliance", "J3"));
  CHECK(d.unknown.empty());
}

TEST_CASE("what gives way under the first torque and no more is play that closes, no gear of three stiffnesses") {
  Robot truth = ur10();
  truth.T_measurement_base = somewhere();
  const auto torque = [&truth](const Table& t, std::size_t row) {
    Eigen::VectorXd reading(6);
    for (Eigen::Index k = 0; k < 6; ++k) reading[k] = t.data.joints[static_cast<std::size_t>(k)][row];
    return truing::gravity_torques(truth, reading, 0.0)[1];
  };
  for (const unsigned seed : {91u, 92u, 93u}) {
    const auto table = measured(truth, 300, seed, 1, [&](const Table& t, std::size_t row) {
      return 2e-4 * std::tanh(torque(t, row) / 12.0);  // of 160 Nm
    });
    const Diagnosis d = diagnose(ur10(), table->data);
    CAPTURE(seed);
    INFO(d.sentence);
    CHECK(is_named(d, "gravity_backlash", "J2"));
    CHECK(!is_named(d, "stiffness_zones", "J2"));
  }
}

TEST_CASE("effects of a usual size are named as ever") {
  Robot truth = ur10();
  truth.T_measurement_base = somewhere();
  truth.effects = {{"joint_compliance", {"J2"}, {{"joint_compliance.J2", 4e-6}}},
                   {"harmonic", {"J3"}, {{"harmonic.J3.cos1", 1e-3}, {"harmonic.J3.sin2", 4e-4}}}};
  const auto table = measured(truth, 200, 71, 0, [](const Table&, std::size_t) { return 0.0; });
  const Diagnosis d = diagnose(ur10(), table->data);
  CHECK(is_named(d, "joint_compliance", "J2"));
  CHECK(is_named(d, "harmonic", "J3"));
  CHECK(d.unknown.empty());
}

}  // namespace plausible
