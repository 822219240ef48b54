// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Arms that hang, while their file says that they stand.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/arms.hpp"
#include "support/sanitized.hpp"
#include "truing/diagnose.hpp"

using namespace arms;
using truing::diagnose;
using truing::Diagnosis;

namespace {

const truing::AppliedEffect kSprings[] = {{"joint_compliance", {"J2"}, {{"joint_compliance.J2", 6e-6}}},
                                          {"joint_compliance", {"J3"}, {{"joint_compliance.J3", 1e-5}}}};

/// A UR10 under this gravity in its base, diagnosed as one that stands. `springs`: how many joints give way.
Diagnosis diagnosed(const Eigen::Vector3d& gravity, std::size_t springs, unsigned seed,
                    std::vector<truing::AppliedEffect> others = {}) {
  Robot truth = ur10();
  truth.gravity = gravity;
  truth.T_measurement_base = somewhere();
  truth.effects = std::move(others);
  truth.effects.insert(truth.effects.end(), kSprings, kSprings + springs);
  auto table = random_joints(truth, 120, seed);
  measure(table.get(), truth, What::position, 3e-5, seed + 1);
  return diagnose(ur10(), table->data);
}

std::string said_of_gravity(const Diagnosis& d) {
  for (const truing::SanityFinding& finding : d.sanity) {
    if (finding.kind == "gravity_direction") return finding.text;
  }
  return "";
}

/// Named, or what these data cannot tell from the name.
bool has_spring(const Diagnosis& d, const std::string& joint) {
  const auto is_spring = [&](const auto& e) {
    return e.effect == "joint_compliance" && e.joints == std::vector<std::string>{joint};
  };
  return std::any_of(d.effects.begin(), d.effects.end(), [&](const truing::FoundEffect& e) {
    return is_spring(e) || std::any_of(e.confounded_with.begin(), e.confounded_with.end(), is_spring);
  });
}

/// A walking robot's leg: hip, knee and ankle turn about parallel axes, and little else.
Robot leg() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  const struct {
    const char* name;
    double height;
    Eigen::Vector3d axis;
    double lower, upper, mass;
    Eigen::Vector3d center;
  } links[] = {
      {"yaw", -0.2, z, -0.26, 0.26, 0.5, {-0.01, 0.0, 0.06}}, {"roll", 0.0, x, -0.26, 0.52, 0.7, {0.0, 0.0, 0.0}},
      {"hip", 0.0, y, -1.7, 0.4, 4.3, {-0.01, 0.0, -0.15}},   {"knee", -0.32, y, 0.0, 2.0, 2.6, {0.0, 0.0, -0.12}},
      {"ankle", -0.29, y, -0.52, 0.79, 0.5, {0.0, 0.0, 0.0}}, {"foot", 0.0, x, -0.35, 0.35, 1.1, {0.08, -0.01, -0.05}}};
  Robot robot;
  robot.name = "leg";
  robot.convention = Convention::urdf;
  for (const auto& link : links) {
    Joint j;
    j.name = link.name;
    j.T_parent_joint.translation().z() = link.height;
    j.axis = link.axis;
    j.lower = link.lower;
    j.upper = link.upper;
    j.mass = link.mass;
    j.center_of_mass = link.center;
    robot.joints.push_back(j);
  }
  set_tool(&robot, {0.03, 0.02, -0.07});
  return robot;
}

}  // namespace

TEST_CASE("an arm on a wall, a ceiling or a slope is diagnosed under the weight that its springs show" *
          doctest::skip(kSanitized)) {
  unsigned seed = 900;
  const struct {
    Eigen::Vector3d down;
    std::string words;
  } cases[] = {
      {{-1.0, 0.0, 0.0}, "-1.00 0.00 0.00"}, {{0.0, 0.0, 1.0}, "0.00 0.00 1.00"}, {{0.0, -0.5, -std::sqrt(0.75)}, ""}};
  for (const auto& [down, words] : cases) {
    const Diagnosis d = diagnosed(9.81 * down, 2, seed += 10);
    INFO(d.sentence);
    const std::string said = said_of_gravity(d);
    CAPTURE(said);
    CHECK(said.find("gravity points along " + words) == 0);
    CHECK(d.robot.gravity.normalized().dot(down) > std::cos(0.03));
    CHECK(d.robot.gravity.norm() == doctest::Approx(9.81));
    CHECK(has_spring(d, "J2"));
    CHECK(has_spring(d, "J3"));
    CHECK(d.unknown.empty());
  }
}

TEST_CASE("nothing is said of gravity where the file is right, or where nothing gives way") {
  const Eigen::Vector3d upright(0.0, 0.0, -9.81), on_a_wall(-9.81, 0.0, 0.0);
  CHECK(said_of_gravity(diagnosed(upright, 2, 940)).empty());
  if (kSanitized) return;  // one of them goes through the whole search
  CHECK(said_of_gravity(diagnosed(on_a_wall, 0, 950)).empty());
  // What a joint does with its own angle looks like weight along another axis of the base.
  const truing::AppliedEffect wave = {
      "harmonic",
      {"J1"},
      {{"harmonic.J1.cos1", 3e-4}, {"harmonic.J1.sin1", 2e-4}, {"harmonic.J1.cos2", 0.0}, {"harmonic.J1.sin2", 0.0}}};
  CHECK(said_of_gravity(diagnosed(upright, 2, 960, {wave})).empty());
}

TEST_CASE("a knee that its neighbour turns does not turn the robot upside down" * doctest::skip(kSanitized)) {
  Robot truth = leg();
  truth.T_measurement_base = somewhere();
  truth.effects = {{"neighbour_coupling", {"knee"}, {{"neighbour_coupling.knee.hip", 1e-3}}}};
  auto table = random_joints(truth, 120, 970);
  measure(table.get(), truth, What::position, 3e-5, 971);
  const Diagnosis d = diagnose(leg(), table->data);
  INFO(d.sentence);
  REQUIRE(!d.effects.empty());
  CHECK(d.effects[0].effect == "neighbour_coupling");
  CHECK(said_of_gravity(d).empty());
  CHECK(d.robot.gravity.z() == leg().gravity.z());
}
