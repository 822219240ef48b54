// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "math/random.hpp"
#include "model/effects/traits.hpp"
#include "support/arms.hpp"

namespace {

using truing::Distinction;
using truing::DistinguishOptions;
using truing::EffectPair;
using truing::EffectSize;

Eigen::MatrixXd random_poses(const truing::Robot& robot, int count, std::uint64_t seed) {
  truing::math::Random random(seed);
  Eigen::MatrixXd out(count, static_cast<Eigen::Index>(robot.driven_count()));
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (Eigen::Index k = 0; k < out.cols(); ++k) {
    const truing::Joint& joint = robot.joints[driven[static_cast<std::size_t>(k)]];
    const double low = std::isfinite(joint.lower) ? joint.lower : -2.5,
                 high = std::isfinite(joint.upper) ? joint.upper : 2.5;
    for (Eigen::Index i = 0; i < count; ++i) out(i, k) = random.uniform(low, high);
  }
  return out;
}

const EffectSize* size_of(const Distinction& d, const std::string& effect, const std::string& joint) {
  for (const EffectSize& e : d.effects) {
    if (e.effect == effect && e.joint == joint) return &e;
  }
  return nullptr;
}

const EffectPair* pair_of(const std::vector<EffectPair>& pairs, const std::string& effect, const std::string& other,
                          const std::string& joint) {
  for (const EffectPair& p : pairs) {
    if (p.joint == joint && p.other_joint == joint &&
        ((p.effect == effect && p.other == other) || (p.effect == other && p.other == effect)))
      return &p;
  }
  return nullptr;
}

const truing::NotTestable* not_testable(const Distinction& d, const std::string& effect,
                                        const std::string& joint = "") {
  for (const truing::NotTestable& n : d.not_testable) {
    if (n.effect == effect && (joint.empty() ? n.joints.empty() : n.joints == std::vector<std::string>{joint}))
      return &n;
  }
  return nullptr;
}

bool complains(const truing::Robot& robot, const DistinguishOptions& options, const std::string& part) {
  try {
    truing::distinguish(robot, random_poses(robot, 20, 1), options);
  } catch (const std::invalid_argument& error) {
    INFO(error.what());
    CHECK(std::string(error.what()).find(part) != std::string::npos);
    return true;
  }
  return false;
}

TEST_CASE("backlash is a joint's zero when every pose is approached from one side, and something else from both") {
  const truing::Robot robot = arms::ur10();
  DistinguishOptions options;
  options.separate = {{"backlash", {}}, {"joint_offset", {}}};
  const Distinction one_sided = truing::distinguish(robot, random_poses(robot, 40, 2), options);
  for (const char* joint : {"J2", "J3", "J4", "J5"}) {
    const EffectPair* pair = pair_of(one_sided.alike, "backlash", "joint_offset", joint);
    REQUIRE(pair != nullptr);
    CHECK(pair->r2 == doctest::Approx(1.0));
    CHECK(std::isnan(pair->size));
    CHECK(pair->separated_by.find("both sides") != std::string::npos);
  }
  CHECK(not_testable(one_sided, "backlash") != nullptr);
  CHECK(one_sided.direction.size() == 0);

  options.columns = {"dir"};
  const Distinction two_sided = truing::distinguish(robot, random_poses(robot, 40, 2), options);
  for (const char* joint : {"J2", "J3", "J4", "J5"}) {
    const EffectPair* pair = pair_of(two_sided.separated, "backlash", "joint_offset", joint);
    REQUIRE(pair != nullptr);
    CHECK(pair->r2 < 0.5);
    CHECK(std::isfinite(pair->size));
    CHECK(pair_of(two_sided.alike, "backlash", "joint_offset", joint) == nullptr);
  }
  CHECK(not_testable(two_sided, "backlash") == nullptr);
  REQUIRE(two_sided.direction.rows() == 40 + two_sided.added);
  CHECK(two_sided.direction.cwiseAbs().minCoeff() == 1.0);
  CHECK(two_sided.direction.minCoeff() == -1.0);
  CHECK(two_sided.direction.maxCoeff() == 1.0);
}

TEST_CASE("the first joint's zero is the base, the last one's the tool, and geometry takes up every zero") {
  const truing::Robot robot = arms::ur10();
  const Distinction d = truing::distinguish(robot, random_poses(robot, 40, 3));
  REQUIRE(not_testable(d, "joint_offset", "J1") != nullptr);
  CHECK(not_testable(d, "joint_offset", "J1")->why.find("base") != std::string::npos);
  REQUIRE(not_testable(d, "joint_offset", "J6") != nullptr);
  CHECK(not_testable(d, "joint_offset", "J6")->why.find("tool") != std::string::npos);
  for (const char* joint : {"J2", "J3", "J4", "J5"}) {
    const EffectSize* zero = size_of(d, "joint_offset", joint);
    REQUIRE(zero != nullptr);
    CHECK(zero->parameter == std::string(joint) + ".offset");
    CHECK(zero->size > 0.0);
    CHECK(std::isnan(zero->size_with_geometry));
    REQUIRE(pair_of(d.alike, "joint_offset", "link_geometry", joint) != nullptr);
  }
  for (const EffectSize& e : d.effects) {
    CHECK(e.size > 0.0);
    CHECK(e.size_at_tip > 0.0);
    CHECK_FALSE(e.size_with_geometry < 0.999 * e.size);
    CHECK(e.standard_errors > 3.0);
  }
  CHECK(d.r2.rows() == static_cast<Eigen::Index>(d.effects.size()));
  CHECK(d.r2.minCoeff() >= 0.0);
  CHECK(d.r2.maxCoeff() <= 1.0);
}

TEST_CASE("what no column shows is said with the column's name") {
  const truing::Robot robot = arms::ur10();
  const Distinction bare = truing::distinguish(robot, random_poses(robot, 30, 4));
  for (const auto& [effect, column] : {std::pair{"thermal", "temp_C"},
                                       {"thermal_zero", "temp_C"},
                                       {"drift", "t_s"},
                                       {"windup", "tau1"},
                                       {"time_offset", "qd1"}}) {
    const truing::NotTestable* why = not_testable(bare, effect);
    REQUIRE(why != nullptr);
    CHECK(why->why.find(column) != std::string::npos);
  }
  DistinguishOptions options;
  options.columns = {"payload", "dir", "temp", "t"};
  const Distinction full = truing::distinguish(robot, random_poses(robot, 30, 4), options);
  for (const char* effect : {"thermal", "thermal_zero", "drift"}) CHECK(not_testable(full, effect) == nullptr);
  CHECK(full.payload.maxCoeff() == 5.0);
  CHECK(full.payload.minCoeff() == 0.0);
  CHECK(full.temperature.maxCoeff() <= 35.0);
  CHECK(full.temperature[0] == doctest::Approx(20.0));
  CHECK(full.time.size() == 30);
  // Without masses the payload alone loads the joints; without a payload either, first moments are found.
  truing::Robot light = robot;
  for (truing::Joint& joint : light.joints) joint.mass.reset();
  CHECK(size_of(truing::distinguish(light, random_poses(light, 60, 4)), "joint_compliance", "J2") != nullptr);
  CHECK(size_of(truing::distinguish(light, random_poses(light, 60, 4), options), "link_compliance", "J3") != nullptr);
}

TEST_CASE("an effect that only a size beyond every robot would show is not testable there") {
  // The tool lies on the last axis but for `off`: what turns the last joint alone moves it little or not at all.
  for (const double off : {0.0, 1e-15, 1e-5}) {
    CAPTURE(off);
    truing::Robot robot = arms::ur10();
    arms::set_tool(&robot, {off, 0.0, 0.15});
    DistinguishOptions options;
    options.columns = {"dir", "payload", "temp", "t"};
    const Distinction d = truing::distinguish(robot, random_poses(robot, 40, 6), options);
    for (const char* effect : {"backlash", "harmonic", "gear_ratio"}) {
      CAPTURE(effect);
      CHECK(size_of(d, effect, "J6") == nullptr);
      CHECK(not_testable(d, effect, "J6") != nullptr);
    }
    for (const EffectSize& e : d.effects) {
      CAPTURE(e.effect);
      CAPTURE(e.joint);
      if (e.unit == "rad" || e.unit == "-") CHECK(e.size < 1.0);
      CHECK(e.size_at_tip < 0.15);
    }
  }
}

TEST_CASE("an effect that would show only where it is larger than machines have it is not testable there") {
  // 0.2 mm beside the last axis: play of 5 mrad moves the tip by a thousandth of a millimetre.
  truing::Robot robot = arms::ur10();
  arms::set_tool(&robot, {2e-4, 0.0, 0.15});
  DistinguishOptions options;
  options.columns = {"dir", "payload", "temp", "t"};
  const Distinction d = truing::distinguish(robot, random_poses(robot, 40, 6), options);
  for (const EffectSize& e : d.effects) {
    CAPTURE(e.effect);
    CAPTURE(e.joint);
    const double plausible = truing::model::traits_of(e.effect, {}).plausible;
    if (plausible > 0.0) CHECK(e.size <= plausible);
  }
  CHECK(size_of(d, "backlash", "J6") == nullptr);
  const truing::NotTestable* backlash = not_testable(d, "backlash", "J6");
  REQUIRE(backlash);
  CHECK_MESSAGE(backlash->why.find("rad on, more than machines have") != std::string::npos, backlash->why);
  // A whole turn is what it takes without the limit of machines: between the two lies what this test is of.
  CHECK(std::stod(backlash->why.substr(backlash->why.find("from ") + 5)) < 1.0);
  CHECK(size_of(d, "backlash", "J2") != nullptr);
}

TEST_CASE("a promised smallest size is as many of identify's standard errors as it says") {
  const truing::Robot robot = arms::ur10();
  const double noise = 5e-5;
  DistinguishOptions options;
  options.columns = {"dir", "payload"};
  options.position_sigma = noise;
  const Distinction d = truing::distinguish(robot, random_poses(robot, 60, 5), options);
  const auto rows = static_cast<std::size_t>(d.joints.rows());
  for (const std::string effect : {"backlash", "joint_compliance"}) {
    const EffectSize* promised = size_of(d, effect, "J3");
    REQUIRE(promised != nullptr);
    for (const bool geometry : {false, true}) {
      CAPTURE(effect);
      CAPTURE(geometry);
      const double sigma = (geometry ? promised->size_with_geometry : promised->size) / promised->standard_errors;
      double squares = 0.0, said = 0.0;
      constexpr int kSeeds = 20;
      for (unsigned seed = 0; seed < kSeeds; ++seed) {
        arms::Table table(rows);
        const auto column = [&](const auto& value) {
          std::vector<double> values(rows);
          for (std::size_t row = 0; row < rows; ++row) values[row] = value(static_cast<Eigen::Index>(row));
          return table.add(values);
        };
        for (Eigen::Index k = 0; k < 6; ++k)
          table.data.joints.push_back(column([&](Eigen::Index i) { return d.joints(i, k); }));
        for (Eigen::Index k = 0; k < 6; ++k)
          table.data.direction.push_back(column([&](Eigen::Index i) { return d.direction(i, k); }));
        table.data.payload = column([&](Eigen::Index i) { return d.payload[i]; });
        truing::Robot truth = robot;
        truth.effects = {{effect, {"J3"}, {{promised->parameter, promised->size}}}};
        arms::measure(&table, truth, arms::What::position, noise, 100 + seed);
        truing::IdentifyOptions identify;
        identify.effects = {{effect, {"J3"}}};
        if (!geometry) identify.free = {"tool.x", "tool.y", "tool.z"};
        identify.test_share = 0.0;
        identify.loss = truing::Loss::none;
        identify.threads = 1;
        const truing::Identification found = truing::identify(robot, table.data, identify);
        for (const truing::Parameter& p : found.parameters) {
          if (p.name != promised->parameter) continue;
          squares += (p.value - promised->size) * (p.value - promised->size);
          said += p.sigma;
        }
      }
      const double scatter = std::sqrt(squares / kSeeds);
      CHECK(scatter > 0.5 * sigma);
      CHECK(scatter < 2.0 * sigma);
      CHECK(said / kSeeds > 0.8 * sigma);
      CHECK(said / kSeeds < 1.25 * sigma);
    }
  }
}

TEST_CASE("poses are added until the named effects differ, within the limits, and only with the columns asked for") {
  const truing::Robot robot = arms::palletizer();
  // A joint that hardly moves: its ratio looks like its zero.
  Eigen::MatrixXd poses = random_poses(robot, 30, 6);
  poses.col(1) = (0.8 + 0.01 * poses.col(1).array()).matrix();
  DistinguishOptions options;
  options.separate = {{"gear_ratio", {"J2"}}, {"joint_offset", {"J2"}}};
  const Distinction without = truing::distinguish(robot, poses, options);
  options.columns = {"payload"};
  const Distinction d = truing::distinguish(robot, poses, options);
  for (const Distinction* result : {&without, &d}) {
    REQUIRE(result->separated.size() == 1);
    const EffectPair& pair = result->separated[0];
    CAPTURE(pair.r2);
    CHECK(pair.r2 > 0.98);
    CHECK(result->added > 0);
    CHECK(result->added < options.add);
    CHECK(pair.r2_after < 0.98);
    CHECK(pair.size_after < 0.5 * pair.size);
    REQUIRE(result->joints.rows() == 30 + result->added);
    CHECK(result->joints.topRows(30) == poses);
    for (Eigen::Index k = 29; k + 1 < result->joints.rows(); ++k) {
      CHECK((result->joints.row(k + 1) - result->joints.row(k)).cwiseAbs().minCoeff() > options.min_step);
    }
    CHECK(result->joints.cwiseAbs().maxCoeff() <= 1.2);
  }
  CHECK(without.payload.size() == 0);
  CHECK(d.payload.size() == d.joints.rows());
  // What nothing separates gets no poses.
  options.separate = {{"joint_offset", {"J2"}}, {"link_geometry", {"J2"}}};
  const truing::Robot ur10 = arms::ur10();
  const Distinction never = truing::distinguish(ur10, random_poses(ur10, 30, 6), options);
  CHECK(never.added == 0);
  REQUIRE(never.separated.size() == 1);
  CHECK(never.separated[0].r2_after == doctest::Approx(1.0));
}

TEST_CASE("the same seed gives the same plan, and another robot's frames do not matter") {
  truing::Robot robot = arms::rail_arm();
  DistinguishOptions options;
  options.columns = {"dir", "temp"};
  const Eigen::MatrixXd poses = random_poses(robot, 40, 7);
  const Distinction a = truing::distinguish(robot, poses, options), b = truing::distinguish(robot, poses, options);
  CHECK(a.direction == b.direction);
  CHECK(a.r2 == b.r2);
  robot.T_measurement_base = arms::somewhere();
  robot.gravity = robot.T_measurement_base.linear().transpose() * robot.gravity;
  const Distinction elsewhere = truing::distinguish(robot, poses, options);
  REQUIRE(elsewhere.effects.size() == a.effects.size());
  const EffectSize *here = size_of(a, "backlash", "J2"), *there = size_of(elsewhere, "backlash", "J2");
  REQUIRE(here != nullptr);
  REQUIRE(there != nullptr);
  CHECK(there->size == doctest::Approx(here->size).scale(0).epsilon(1e-6));
}

TEST_CASE("with orientations more is seen") {
  const truing::Robot robot = arms::ur10();
  DistinguishOptions options;
  options.columns = {"dir"};
  const Eigen::MatrixXd poses = random_poses(robot, 30, 8);
  const Distinction positions = truing::distinguish(robot, poses, options);
  options.orientation = true;
  const Distinction full = truing::distinguish(robot, poses, options);
  const EffectSize *less = size_of(positions, "backlash", "J5"), *more = size_of(full, "backlash", "J5");
  REQUIRE(less != nullptr);
  REQUIRE(more != nullptr);
  CHECK(more->size < less->size);
}

TEST_CASE("names and options that mean nothing are errors that say what there is") {
  const truing::Robot robot = arms::ur10();
  DistinguishOptions options;
  options.columns = {"humidity"};
  CHECK(complains(robot, options, "dir, payload, temp, t"));
  options = {};
  options.separate = {{"slack", {}}};
  CHECK(complains(robot, options, "backlash"));
  options.separate = {{"backlash", {"J9"}}};
  CHECK(complains(robot, options, "J6"));
  options.separate = {{"base_frame", {}}};
  CHECK(complains(robot, options, "fitted in any case"));
  options.separate = {{"scale", {"J2"}}};
  CHECK(complains(robot, options, "no joints"));
  options.separate = {{"transmission_error", {}}};
  CHECK(complains(robot, options, "transmission_error@96"));
  options = {};
  options.payload = 0.0;
  CHECK(complains(robot, options, "payload"));
  options = {};
  CHECK_THROWS_AS(truing::distinguish(robot, Eigen::MatrixXd::Zero(20, 5), options), std::invalid_argument);
  CHECK_THROWS_AS(truing::distinguish(robot, Eigen::MatrixXd::Zero(2, 6), options), std::invalid_argument);
}

}  // namespace
