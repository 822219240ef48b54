// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What temperature and time do: links that grow, zeros and frames that move.

#include <algorithm>
#include <cmath>

#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"

namespace truing::model {
namespace {

using Eigen::Vector3d;

// Temperature above the one at which the robot was right: 20 deg C, at which machines are built and measured (ISO
// 1:2022), unless the robot carries another. It stays with the robot.
constexpr double kReference = 20.0;

struct Warmth {
  std::map<std::string, double> constants;
  double reference = kReference;
  double operator()(const Inputs& in) const { return in.data->temperature[in.row] - reference; }
};

Warmth warmth(const std::string& effect, const Robot& robot) {
  const std::string name = effect + ".reference_C";
  Warmth out;
  out.reference = remembered(robot, effect, name, [] { return kReference; });
  out.constants = {{name, out.reference}};
  return out;
}

constexpr const char* kNoTemperature = "needs the column temp_C (temperature)";

// Every length of a link, with the name of its value.
std::vector<std::pair<const char*, double>> lengths_of(const Robot& robot, const Joint& at) {
  const Vector3d origin = at.T_parent_joint.translation();
  std::vector<std::pair<const char*, double>> lengths = {{"a", at.a}, {"d", at.d}};
  if (robot.convention == Convention::urdf) lengths = {{"x", origin.x()}, {"y", origin.y()}, {"z", origin.z()}};
  // [m]: an offset found where the drawing has none does not make it a beam.
  const auto is_zero = [](const auto& length) { return std::abs(length.second) < 1e-3; };
  lengths.erase(std::remove_if(lengths.begin(), lengths.end(), is_zero), lengths.end());
  return lengths;
}

void add_growth(const std::string& parameter, const Robot& robot, const Joint& at, std::vector<Term>* terms) {
  const Warmth warm = warmth("thermal", robot);
  for (const auto& [value, length] : lengths_of(robot, at)) {
    terms->push_back(make_term(
        parameter, "1/K", at.name + "." + value,
        [warm, metres = length](const Inputs& in) { return warm(in) * metres; }, true));
    terms->back().constants = warm.constants;
  }
}

// The link grows: every length by k * (T - T_ref) * length, one k for the link; steel 12e-6, aluminium 23e-6
// per kelvin.
std::vector<Term> thermal(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  if (lengths_of(robot, at).empty()) unsuited("thermal", at, "needs a link with a length; this one has none");
  if (!data.temperature) refuse("thermal", at, kNoTemperature);
  std::vector<Term> terms;
  add_growth("thermal." + at.name, robot, at, &terms);
  return terms;
}

// The robot grows: all links by one k. Warm throughout, it is too long as a whole.
std::vector<Term> thermal_of_robot(const Robot& robot, const Measurements& data) {
  std::vector<Term> terms;
  for (const Joint& at : robot.joints) add_growth("thermal", robot, at, &terms);
  if (terms.empty()) throw Unsuited("thermal needs a link with a length; this robot has none");
  if (!data.temperature) throw MissingColumn(std::string("thermal ") + kNoTemperature);
  return terms;
}

// The joint's zero moves with temperature: k * (T - T_ref), T_ref as for `thermal`.
std::vector<Term> thermal_zero(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  if (!data.temperature) refuse("thermal_zero", at, kNoTemperature);
  const Warmth warm = warmth("thermal_zero", robot);
  Term term = make_term("thermal_zero." + at.name, std::string(motion_unit(at)) + "/K", at.name, warm);
  term.constants = warm.constants;
  return {term};
}

// The base wanders in the measurement frame: each of its six coordinates by rate * (t - t_ref), t_ref the
// mean time. No order of rows stands for a missing time.
std::vector<Term> drift(const Robot& robot, std::size_t, const Measurements& data) {
  if (!data.time) throw MissingColumn("drift needs the column t_s (time)");
  const double reference =
      remembered(robot, "drift", "drift.reference_s", [&] { return mean_of(data.time, data.rows); });
  std::vector<Term> terms;
  for (const char* coordinate : {"x", "y", "z", "rx", "ry", "rz"}) {
    const std::string site = std::string("base.") + coordinate;
    terms.push_back(make_term("drift." + site, coordinate[0] == 'r' ? "rad/s" : "m/s", site,
                              [reference](const Inputs& in) { return in.data->time[in.row] - reference; }));
    terms.back().constants = {{"drift.reference_s", reference}};
  }
  return terms;
}

Effect thermal_effect() {
  Effect effect{"thermal", "the robot, or one of its links, grows with temperature", thermal};
  effect.terms_of_robot = thermal_of_robot;
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::temperature;
  traits.moves = Moves::link;
  traits.law = Law::of_lengths_in_warmth;
  traits.law_test = LawTest::times_the_lengths;
  traits.mimicked_by = {"drift"};
  traits.contained_in = {{"link_geometry", Containment::look_alike, ""}};
  traits.separated_by = {{Experiment::warm_up_and_cool_down, "drift"}, {Experiment::more_temperatures}};
  traits.usual = 12e-6;
  traits.plausible = 5e-5;
  traits.documentation = {"k · (T − T_ref) · length, on every length of every link, or of one (`thermal:J2`)",
                          "`thermal`, `thermal.J2` [1/K]", "`temp_C`; a link with a length"};
  return effect;
}

Effect thermal_zero_effect() {
  Effect effect{"thermal_zero", "the joint's zero moves with temperature", thermal_zero};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::temperature;
  traits.law = Law::of_warmth;
  traits.law_test = LawTest::of_driver;
  traits.mimicked_by = {"drift"};
  traits.separated_by = {{Experiment::warm_up_and_cool_down, "drift"}, {Experiment::more_temperatures}};
  traits.usual = 1e-5;
  traits.plausible = 2e-4;
  traits.documentation = {"k · (T − T_ref), at the joint", "`thermal_zero.J2` [rad/K]", "`temp_C`"};
  return effect;
}

Effect drift_effect() {
  Effect effect{"drift", "the base wanders in the measurement frame as time goes on", drift, false};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::time;
  traits.moves = Moves::base;
  traits.of_instrument = true;
  traits.wanders = true;
  traits.mimicked_by = {"thermal", "thermal_zero"};
  traits.separated_by = {{Experiment::fixed_points_again}};
  traits.usual = 3e-8;
  traits.plausible = 1e-5;
  traits.documentation = {"rate · (t − t_ref), on the base's six coordinates", "`drift.base.x` … [m/s, rad/s]",
                          "`t_s`"};
  return effect;
}

}  // namespace

std::vector<Effect> thermal_effects() { return {thermal_effect(), thermal_zero_effect(), drift_effect()}; }

}  // namespace truing::model
