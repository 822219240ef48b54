// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// How much each cause counts, on simulated robots whose causes are known, and what the badge says.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/diagnosis.hpp"
#include "support/arms.hpp"

using namespace arms;
using truing::Diagnosis;
using truing::Explained;
using truing::FoundEffect;
using truing::Verdict;
using truing::diagnosis::answerable_questions;
using truing::diagnosis::explained_by;
using truing::diagnosis::largest_causes;
using truing::diagnosis::sentence_of;

namespace {

/// Two lost motions of an arm without masses, seed 11.
Diagnosis two_backlashes(double at_second, const std::string& joint, double at_joint) {
  Robot truth = ur10();
  for (Joint& j : truth.joints) j.mass.reset();
  const Robot nominal = truth;
  truth.T_measurement_base = somewhere();
  truth.effects = {{"backlash", {"J2"}, {{"backlash.J2", at_second}}},
                   {"backlash", {joint}, {{"backlash." + joint, at_joint}}}};
  auto table = random_joints(truth, 160, 11);
  std::mt19937_64 random(12);
  for (std::size_t k = 0; k < 6; ++k) {
    std::vector<double> directions(table->data.rows);
    for (double& d : directions) d = random() & 1 ? 1.0 : -1.0;
    table->data.direction.push_back(table->add(directions));
  }
  measure(table.get(), truth, What::position, 3e-5, 13);
  return truing::diagnose(nominal, table->data);
}

const FoundEffect* found_at(const Diagnosis& d, const std::string& joint) {
  for (const FoundEffect& effect : d.effects)
    if (effect.joints == std::vector<std::string>{joint}) return &effect;
  return nullptr;
}

FoundEffect cause(const std::string& effect, const std::vector<std::string>& joints, double share) {
  FoundEffect out;
  out.effect = effect;
  out.joints = joints;
  out.share = share;
  out.probability = 0.9;
  return out;
}

}  // namespace

TEST_CASE("fractions of the gap add up to what is closed, and are as the squares of what moves the tip") {
  const Diagnosis d = two_backlashes(8e-4, "J3", 8e-4);
  const FoundEffect *second = found_at(d, "J2"), *third = found_at(d, "J3");
  REQUIRE(second);
  REQUIRE(third);
  double total = 0.0;
  for (const FoundEffect& effect : d.effects) total += effect.share;
  for (const truing::UnknownEffect& unknown : d.unknown) total += unknown.share;
  const double closed = 1.0 - std::pow(d.after_unknown.rms / d.gap.rms, 2.0);
  CHECK(total == doctest::Approx(closed).scale(0).epsilon(1e-9));
  // Independent directions: neither does the other's work. The gap is half of the play to either side.
  CHECK(second->share / third->share ==
        doctest::Approx(std::pow(second->size_at_tip / third->size_at_tip, 2.0)).scale(0).epsilon(0.25));
  const double together = std::hypot(second->size_at_tip, third->size_at_tip);
  CHECK(together ==
        doctest::Approx(std::sqrt(std::pow(d.gap.rms, 2.0) - std::pow(d.noise_floor, 2.0))).scale(0).epsilon(0.15));
  CHECK(d.explained == Explained::explained);
}

TEST_CASE("an effect that closes little of the gap has a small fraction of it") {
  const Diagnosis d = two_backlashes(2e-3, "J4", 3e-4);
  const FoundEffect *second = found_at(d, "J2"), *fourth = found_at(d, "J4");
  REQUIRE(second);
  REQUIRE(fourth);
  CHECK(fourth->share < 0.02);
  CHECK(second->share > 0.95);
}

TEST_CASE("the badge goes by the mean square beyond the noise") {
  Diagnosis d;
  d.gap.rms = 10e-4;
  d.noise_floor = 1e-4;
  d.verdict = Verdict::none;
  CHECK(explained_by(d, false) == Explained::no_gap);
  CHECK(explained_by(d, true) == Explained::not_explained);
  d.verdict = Verdict::unknown;
  CHECK(explained_by(d, false) == Explained::not_explained);
  d.verdict = Verdict::effects_and_unknown;
  d.effects = {cause("backlash", {"J2"}, 0.5)};
  const auto badge = [&](double left, double closable) {
    d.after.rms = left;
    d.closable = closable;
    return explained_by(d, false);
  };
  CHECK(badge(1.41e-4, 0.99) == Explained::explained);
  CHECK(badge(1.42e-4, 0.99) == Explained::partly_explained);
  CHECK(badge(7e-4, 0.51) == Explained::partly_explained);
  CHECK(badge(8e-4, 0.36) == Explained::not_explained);
  d.verdict = Verdict::does_not_hold;
  CHECK(badge(1e-4, 1.0) == Explained::does_not_hold);
}

TEST_CASE("the headline names the three largest causes, an effect at several joints as one") {
  Diagnosis d;
  d.effects = {cause("joint_compliance", {"J2"}, 0.3), cause("link_geometry", {"J1", "J2", "J3", "J4"}, 0.2),
               cause("joint_compliance", {"J3"}, 0.1), cause("transmission_error@81", {"J4"}, 0.05),
               cause("harmonic", {"J5"}, 0.01)};
  CHECK(largest_causes(d) ==
        "joint compliance at J2 and J3, link geometry of 4 links, transmission error (81 per turn) at J4 and "
        "1 smaller");
  d.effects[3] = cause("transmission_error@81", {"shoulder_pan", "shoulder_lift", "elbow"}, 0.05);  // no third line
  CHECK(largest_causes(d) == "joint compliance at J2 and J3, link geometry of 4 links and 2 smaller");
  d.effects.resize(1);
  d.effects[0].confounded_with = {{"harmonic", {"J3"}, 0.1, ""}};
  CHECK(largest_causes(d) == "joint compliance at J2");  // nine to one is no question
  d.effects[0].confounded_with[0].probability = 0.4;
  CHECK(largest_causes(d) == "joint compliance at J2 (or harmonic at J3: these data cannot tell)");
  d.effects[0].confounded_with[0].joints = {"J2"};
  CHECK(largest_causes(d) == "joint compliance at J2 (or harmonic: these data cannot tell)");
}

TEST_CASE("where poses are too few the sentence says which single effects they would show") {
  Diagnosis d;
  d.gap.rms = 5e-3;
  d.noise_floor = 1e-3;
  d.verdict = Verdict::none;
  const std::string none = " Nor can these poses answer whether any single effect makes the gap.";
  CHECK(answerable_questions(d) == none);
  CHECK(sentence_of(d).find("These poses are too few to tell a gap from noise") == 0);
  CHECK(sentence_of(d).find(none + " Measure more of them.") != std::string::npos);
  // Play of 60 mrad no machine has; what moves the tip by more than the gap cannot be part of it.
  d.detectable = {{"backlash", "J6", "backlash.J6", "rad", 0.06, 2e-3},
                  {"gear_ratio", "J2", "J2.ratio", "-", 1e-3, 6e-3}};
  CHECK(answerable_questions(d) == none);
  d.detectable.push_back({"backlash", "J1", "backlash.J1", "rad", 2e-3, 2e-3});
  d.detectable.push_back({"backlash", "J2", "backlash.J2", "rad", 1e-3, 3e-3});
  d.detectable.push_back({"scale", "", "scale", "-", 1e-3, 2.5e-3});
  const std::string some =
      " What these poses can answer is whether a single effect makes the gap: backlash at J1 and J2 or scale would "
      "show from 3 mm at the tip on.";
  CHECK(answerable_questions(d) == some);
  CHECK(sentence_of(d).find(some + " Measure more of them.") != std::string::npos);
  d.verdict = Verdict::does_not_hold;
  CHECK(sentence_of(d).find(some + " Measure more poses") != std::string::npos);
  for (const char* effect : {"harmonic", "joint_compliance", "axis_wobble", "joint_offset"})
    d.detectable.push_back({effect, "J1", "", "rad", 1e-6, 2e-3});
  CHECK(answerable_questions(d).find("backlash at J1 and J2, ") != std::string::npos);
  CHECK(answerable_questions(d).find(" and 1 more would show") != std::string::npos);
}
