// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Gears, encoders, belts: what stands between the motor and the joint.

#include <cmath>
#include <iterator>
#include <locale>
#include <map>
#include <mutex>
#include <sstream>

#include "math/text.hpp"
#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"
#include "model/effects/traits.hpp"

namespace truing::model {
namespace {

// Eccentric or tilted gears and encoder discs: once and twice per turn of the joint.
std::vector<Term> harmonic(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  require_revolute("harmonic", at, " and has no turn to be periodic in");
  const auto index = static_cast<Eigen::Index>(joint);
  std::vector<Term> terms;
  for (const int order : {1, 2}) {
    Term cosine;
    cosine.parameter = "harmonic." + at.name + ".cos" + std::to_string(order);
    cosine.unit = "rad";
    cosine.site = at.name;
    cosine.basis = [index, order](const Inputs& in) { return std::cos(order * in.joints[index]); };
    Term sine = cosine;
    sine.parameter = "harmonic." + at.name + ".sin" + std::to_string(order);
    sine.basis = [index, order](const Inputs& in) { return std::sin(order * in.joints[index]); };
    terms.push_back(cosine);
    terms.push_back(sine);
  }
  return terms;
}

constexpr const char* kTransmission = "transmission_error";

std::vector<Term> transmission_error_at(const std::string& name, double order, const Robot& robot, std::size_t joint) {
  const Joint& at = robot.joints.at(joint);
  require_revolute(kTransmission, at, " and has no turn to be periodic in");
  const auto index = static_cast<Eigen::Index>(joint);
  return {make_term(name + "." + at.name + ".cos", "rad", at.name,
                    [index, order](const Inputs& in) { return std::cos(order * in.joints[index]); }),
          make_term(name + "." + at.name + ".sin", "rad", at.name,
                    [index, order](const Inputs& in) { return std::sin(order * in.joints[index]); })};
}

std::vector<Term> transmission_error_without_order(const Robot&, std::size_t, const Measurements&) {
  throw std::invalid_argument(
      "transmission_error needs the order of the mesh in its name, e.g. transmission_error@96 (per turn of "
      "the joint)");
}

// The joint stands half the play further on in the direction that it came in: direction * play / 2.
std::vector<Term> backlash(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_driven("backlash", at);
  const std::size_t k = driven_number(robot, joint);
  if (k >= data.direction.size() || !data.direction[k]) {
    refuse("backlash", at, "needs the column dir" + std::to_string(k + 1) + " (approach direction -1, 0, 1)");
  }
  Term term;
  term.parameter = "backlash." + at.name;
  term.unit = motion_unit(at);
  term.site = at.name;
  term.basis = [k](const Inputs& in) { return 0.5 * in.data->direction[k][in.row]; };
  return {term};
}

// Play taken up by the weight, whichever way the joint came: sign(torque) * play / 2.
std::vector<Term> gravity_backlash(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_weight("gravity_backlash", robot, at, data);
  const auto index = static_cast<Eigen::Index>(joint);
  const auto side = [index](const Inputs& in) {
    const double torque = in.gravity_torque[index];
    return torque > 0.0 ? 0.5 : torque < 0.0 ? -0.5 : 0.0;
  };
  return {make_term("gravity_backlash." + at.name, motion_unit(at), at.name, side, true)};
}

// Wind-up of the drive under the torque that the motor gives, friction included: torque / K (Slocum 1992,
// Precision machine design).
std::vector<Term> windup(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_driven("windup", at);
  const std::string name = "tau" + std::to_string(driven_number(robot, joint) + 1) + (is_revolute(at) ? "_Nm" : "_N");
  if (data.covariates.count(name) == 0) refuse("windup", at, "needs the column " + name + " (torque of the joint)");
  return {make_term("windup." + at.name, is_revolute(at) ? "rad/Nm" : "m/N", at.name,
                    [name](const Inputs& in) { return in.data->covariates.at(name)[in.row]; })};
}

// A belt, or a gear with friction, gives way by the direction that the joint came from and the load that it carries:
// c * direction * torque.
std::vector<Term> loaded_play(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_driven("loaded_play", at);
  require_weight("loaded_play", robot, at, data);
  const std::size_t k = driven_number(robot, joint);
  if (k >= data.direction.size() || !data.direction[k]) {
    refuse("loaded_play", at, "needs the column dir" + std::to_string(k + 1) + " (approach direction -1, 0, 1)");
  }
  return {make_term(
      "loaded_play." + at.name, is_revolute(at) ? "rad/Nm" : "m/N", at.name,
      [k, index = static_cast<Eigen::Index>(joint)](const Inputs& in) {
        return in.data->direction[k][in.row] * in.gravity_torque[index];
      },
      true)};
}

Effect harmonic_effect() {
  Effect effect{"harmonic", "error once and twice per turn: eccentric gear or encoder disc", harmonic};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::angle;
  traits.law = Law::of_angle;
  traits.law_test = LawTest::of_driver;
  traits.separated_by = {{Experiment::full_range}};
  traits.usual = 4e-4;
  traits.plausible = 5e-3;
  traits.main_part = "cos1";
  traits.documentation = {"c₁ cos q + s₁ sin q + c₂ cos 2q + s₂ sin 2q", "`harmonic.J2.cos1` … `sin2` [rad]",
                          "a revolute joint"};
  return effect;
}

// What every order of it has in common.
EffectTraits transmission_error_traits() {
  EffectTraits traits;
  traits.driver = Driver::angle;
  traits.search = Search::by_order;
  traits.usual = 2e-4;
  traits.plausible = 2e-3;
  traits.main_part = "cos";
  traits.documentation = {"c cos 96q + s sin 96q; any order, e.g. the teeth's number",
                          "`transmission_error@96.J2.cos`, `.sin` [rad]", "a revolute joint"};
  return traits;
}

Effect transmission_error_family() {
  return {kTransmission, "error that repeats with the gear's teeth; name the order: transmission_error@96",
          transmission_error_without_order, true, transmission_error_traits()};
}

Effect backlash_effect() {
  Effect effect{"backlash", "the joint's play, seen when poses are approached from both sides", backlash};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::direction;
  traits.law = Law::of_direction;
  traits.law_test = LawTest::times_direction;
  traits.mimicked_by = {"windup", "time_offset"};
  traits.separated_by = {{Experiment::both_directions}};
  traits.usual = 2e-4;
  traits.plausible = 5e-3;
  traits.documentation = {"b/2 · direction", "`backlash.J2` [rad, m]", "`dir1 … dirn`"};
  return effect;
}

Effect gravity_backlash_effect() {
  Effect effect{"gravity_backlash", "the joint's play, taken up by the weight", gravity_backlash};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::gravity_torque;
  traits.law = Law::of_torque;
  traits.needs_masses = true;
  traits.mimicked_by = {"windup"};
  traits.separated_by = {{Experiment::another_payload}};
  traits.usual = 2e-4;
  traits.plausible = 5e-3;
  traits.documentation = {"b/2 · sign(τ)", "`gravity_backlash.J2` [rad, m]", "masses or `payload_kg`"};
  return effect;
}

Effect windup_effect() {
  Effect effect{"windup", "the drive twists under the torque of the motor", windup};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::motor_torque;
  traits.usual = 2e-6;
  traits.plausible = 5e-3;
  traits.documentation = {"c · motor torque", "`windup.J2` [rad/Nm]", "`tau1_Nm …`"};
  return effect;
}

Effect loaded_play_effect() {
  Effect effect{"loaded_play", "play that grows with the load: belts, gears with friction", loaded_play};
  EffectTraits& traits = effect.traits;
  traits.mimicked_by = {"windup"};
  traits.separated_by = {{Experiment::both_directions}, {Experiment::another_payload}};
  traits.usual = 2e-6;
  traits.plausible = 5e-3;
  traits.documentation = {"c · direction · τ", "`loaded_play.J2` [rad/Nm, m/N]",
                          "`dir1 … dirn`; masses or `payload_kg`"};
  return effect;
}

// Parts of the orders that a gear of ratio N makes, per turn of the joint: the motor, or the wave generator, turns N
// times; a wave generator has two lobes, so a strain wave gear errs 2 N times as well (Tuttle and Seering 1996, A
// nonlinear model of a harmonic drive gear transmission); the two-tooth difference of its splines makes N / 2.
constexpr double kOncePerMotorTurn = 0.4, kTwicePerMotorTurn = 0.4, kHalfPerMotorTurn = 0.2;
constexpr int kSmallestRatio = 30, kLargestRatio = 161;
// Ratios in which strain wave gears are sold (Harmonic Drive, CSF and CSG: 30, 50, 80, 100, 120, 160), and one more
// when the flexspline is held. They are as likely as all others, those of RV and planetary gears, together.
constexpr int kStrainWaves[] = {30, 50, 80, 100, 120, 160};
constexpr double kOfStrainWaves = 0.5;

void add_orders_of(int ratio, double probability, std::map<double, double>* out) {
  (*out)[ratio] += kOncePerMotorTurn * probability;
  (*out)[2.0 * ratio] += kTwicePerMotorTurn * probability;
  (*out)[0.5 * ratio] += kHalfPerMotorTurn * probability;
}

std::vector<LikelyOrder> make_likely_orders() {
  std::map<double, double> all;
  constexpr double kSold = 2.0 * std::size(kStrainWaves), kRatios = kLargestRatio - kSmallestRatio + 1;
  for (const int ratio : kStrainWaves) {
    for (const int turned : {ratio, ratio + 1}) add_orders_of(turned, kOfStrainWaves / kSold, &all);
  }
  for (int ratio = kSmallestRatio; ratio <= kLargestRatio; ++ratio)
    add_orders_of(ratio, (1.0 - kOfStrainWaves) / kRatios, &all);
  std::vector<LikelyOrder> out;
  for (const auto& [order, probability] : all) out.push_back({order, probability});
  return out;
}

}  // namespace

const std::vector<LikelyOrder>& likely_orders() {
  static const std::vector<LikelyOrder> orders = make_likely_orders();
  return orders;
}

std::vector<double> related_orders(double order) {
  std::vector<double> out;
  for (const double related : {0.5 * order, 2.0 * order}) {
    if (related >= kLowestOrder && related <= kHighestOrder) out.push_back(related);
  }
  return out;
}

std::vector<Effect> transmission_effects() {
  return {harmonic_effect(), transmission_error_family(), backlash_effect(), gravity_backlash_effect(),
          windup_effect(),   loaded_play_effect()};
}

// "transmission_error@96" -> its effect; nullptr when the name is of another form. Made once and kept:
// find_effect hands out references.
const Effect* transmission_error_of(const std::string& name) {
  const std::string prefix = std::string(kTransmission) + "@";
  if (name.compare(0, prefix.size(), prefix) != 0) return nullptr;
  const std::string text = name.substr(prefix.size());
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  double order = 0.0;
  if (!(in >> order) || !in.eof()) {
    throw std::invalid_argument("effect '" + name + "': the order '" + text +
                                "' is not a number; expected e.g. transmission_error@96");
  }
  static std::mutex mutex;
  static std::map<std::string, Effect> made;
  Effect effect = transmission_error(order);
  effect.name = name;
  effect.terms = [name, order](const Robot& robot, std::size_t joint, const Measurements&) {
    return transmission_error_at(name, order, robot, joint);
  };
  const std::lock_guard<std::mutex> lock(mutex);
  return &made.emplace(name, std::move(effect)).first->second;
}

}  // namespace truing::model

namespace truing {
using namespace model;

Effect transmission_error(double order) {
  if (!(std::isfinite(order) && order > 0.0)) {
    throw std::invalid_argument("transmission_error: order is " + number(order) +
                                " per turn, expected a positive number");
  }
  const std::string name = std::string(kTransmission) + "@" + exact_number(order);
  return {name, "error that repeats with the gear's teeth, order times per turn",
          [name, order](const Robot& robot, std::size_t joint, const Measurements&) {
            return transmission_error_at(name, order, robot, joint);
          },
          true, transmission_error_traits()};
}

}  // namespace truing
