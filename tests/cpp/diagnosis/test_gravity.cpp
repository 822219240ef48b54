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
