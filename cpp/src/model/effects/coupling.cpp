// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Joints that move other joints.

#include <algorithm>
#include <cmath>
#include <utility>

#include "math/constants.hpp"
#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"
#include "model/gravity.hpp"
#include "model/motion.hpp"

namespace truing::model {
namespace {

bool is_wrist(const Robot& robot) {
  return robot.joints.size() >= 3 && std::all_of(robot.joints.end() - 3, robot.joints.end(), [](const Joint& joint) {
           return is_revolute(joint) && !joint.passive();
         });
}

// Concentric shafts of a wrist: turning one joint turns the next ones a little. dq5 = c q4, dq6 = c' q4 + c"
// q5, for the last three joints, each ratio on its own.
std::vector<Term> joint_coupling(const Robot& robot, std::size_t, const Measurements&) {
  const std::size_t n = robot.joints.size();
  if (!is_wrist(robot)) {
    throw Unsuited("joint_coupling needs a wrist: the last three joints revolute and with readings");
  }
  std::vector<Term> terms;
  for (const auto& [moved, mover] :
       {std::make_pair(n - 2, n - 3), std::make_pair(n - 1, n - 3), std::make_pair(n - 1, n - 2)}) {
    const std::string site = robot.joints[moved].name;
    terms.push_back(
        make_term("joint_coupling." + site + "." + robot.joints[mover].name, "-", site,
                  [index = static_cast<Eigen::Index>(mover)](const Inputs& in) { return in.joints[index]; }));
  }
  return terms;
}

// The angle of a parallelogram's crank against its base bar, but for the phase: the difference of the passive joint's
// first and last driver (q3 - q2 of a palletizer), or, where the base bar is fixed to the base or to the wrist's plate,
// the first driver's angle or their sum.
struct CrankAngle {
  std::string suffix;
  Eigen::Index first, last;
  double of_first, of_last;
  bool mastered = false;  ///< the joint was set to zero: it is right where the crank is square

  double operator()(const Eigen::VectorXd& joints) const { return of_first * joints[first] + of_last * joints[last]; }
};

std::vector<CrankAngle> crank_angles(const Robot& robot, const Joint& at) {
  if (!at.passive()) unsuited("linkage", at, "needs a passive joint; " + at.name + " has a reading of its own");
  std::vector<Eigen::Index> drivers;
  for (const auto& driver : at.driven_by) drivers.push_back(static_cast<Eigen::Index>(robot.joint_index(driver.first)));
  const auto [first, last] = std::minmax_element(drivers.begin(), drivers.end());
  if (*first == *last) return {{"", *first, *last, 0.0, 1.0}};
  return {{"", *first, *last, -1.0, 1.0}, {"_first", *first, *last, 1.0, 0.0}, {"_sum", *first, *last, 1.0, 1.0}};
}

// Least and largest crank angle in the data [rad]; without data: 0 and 0.
std::pair<double, double> range_of(const CrankAngle& angle, const Robot& robot, const Measurements& data) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  const Eigen::MatrixXd coupling = coupling_matrix(robot);
  double low = kInfinity, high = -kInfinity;
  Eigen::VectorXd readings = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(robot.joints.size()));
  for (std::size_t row = 0; row < data.rows && data.joints.size() == driven.size(); ++row) {
    for (std::size_t k = 0; k < driven.size(); ++k)
      readings[static_cast<Eigen::Index>(driven[k])] = data.joints[k][row];
    const double now = angle(coupling * readings);
    low = std::min(low, now);
    high = std::max(high, now);
  }
  return low <= high ? std::make_pair(low, high) : std::make_pair(0.0, 0.0);
}

// No parallelogram comes nearer to its dead centres, where all bars lie in line [rad].
constexpr double kDeadCentre = 0.2;

std::string name_of(const char* effect, const Joint& at, const char* part, const CrankAngle& angle) {
  return std::string(effect) + "." + at.name + "." + part + angle.suffix;
}

std::vector<Term> terms_of_bars(const char* effect, const Joint& at, const CrankAngle& angle, double phase) {
  const auto law = [angle, phase](const Inputs& in, bool rods) {
    const double theta = angle(in.joints) + phase;
    const double sine = std::copysign(std::max(std::abs(std::sin(theta)), std::sin(kDeadCentre)), std::sin(theta));
    return rods ? 1.0 / sine - (angle.mastered ? 1.0 : 0.0) : std::cos(theta) / sine;
  };
  std::vector<Term> terms;
  for (const bool rods : {true, false}) {
    terms.push_back(make_term(name_of(effect, at, rods ? "rods" : "arms", angle), motion_unit(at), at.name,
                              [law, rods](const Inputs& in) { return law(in, rods); }));
    terms.back().constants = {{name_of(effect, at, "phase", angle), phase}};
  }
  return terms;
}

// A parallelogram whose opposite bars are not quite equal: base bar l + dl, coupler l + dc, crank r + dr_crank, rocker
// r
// + dr_rocker. With the crank at theta against the base bar, and the rocker at theta + delta, the coupler's length says
//   | (l + dl, 0) + (r + dr_rocker) e(theta + delta) - (r + dr_crank) e(theta) | = l + dc,   e(x) = (cos x, sin x),
// which is, to first order, l + dl + (dr_rocker - dr_crank) cos theta - r delta sin theta = l + dc, so that
//   delta = (dl - dc + (dr_rocker - dr_crank) cos theta) / (r sin theta).
// Two parameters: `rods` = (dl - dc) / r and `arms` = (dr_rocker - dr_crank) / r. theta is a sum of readings plus a
// phase, where the base bar points. Nobody says it: the middle of the range is taken for square, as it is built, unless
// the robot carries the phases of some parallelograms, which then are all there are.
std::vector<Term> unequal_bars(const char* effect, const Robot& robot, std::size_t joint,
                               const std::vector<CrankAngle>& angles, const Measurements& data) {
  const Joint& at = robot.joints[joint];
  std::vector<Term> known, usual;
  for (const CrankAngle& angle : angles) {
    const double phase = remembered(robot, effect, name_of(effect, at, "phase", angle), [] { return kNaN; });
    const auto [low, high] = range_of(angle, robot, data);
    const bool passes_dead_centre = high - low > kPi - 2.0 * kDeadCentre;
    if (!std::isfinite(phase) && passes_dead_centre) continue;  // no crank turns that far
    const std::vector<Term> terms =
        terms_of_bars(effect, at, angle, std::isfinite(phase) ? phase : kPi / 2.0 - 0.5 * (low + high));
    (std::isfinite(phase) ? known : usual)
        .insert((std::isfinite(phase) ? known : usual).end(), terms.begin(), terms.end());
  }
  if (known.empty() && usual.empty())
    unsuited(effect, at, "needs a crank that stays clear of its dead centres; every angle of the drivers passes one");
  return known.empty() ? usual : known;
}

// Every phase that keeps the crank clear of its dead centres, in steps that a law hardly changes over.
std::vector<EffectForm> phases_of_bars(const char* effect, const Robot& robot, std::size_t joint,
                                       const std::vector<CrankAngle>& angles, const Measurements& data) {
  constexpr double kStep = 0.065;  // [rad]
  const Joint& at = robot.joints.at(joint);
  std::vector<EffectForm> forms;
  for (const CrankAngle& angle : angles) {
    const auto [low, high] = range_of(angle, robot, data);
    const double least = kDeadCentre - low, most = kPi - kDeadCentre - high;
    if (least > most) continue;
    const int steps = std::max(2, 2 * static_cast<int>(std::ceil(0.5 * (most - least) / kStep)));
    for (int k = 0; k <= steps; ++k) {  // from square outwards
      const int step = steps / 2 + (k % 2 ? 1 : -1) * ((k + 1) / 2);
      forms.push_back({{name_of(effect, at, "rods", angle), name_of(effect, at, "arms", angle)},
                       {{name_of(effect, at, "phase", angle), least + (most - least) * step / steps}}});
    }
  }
  return forms;
}

constexpr const char* kLinkage = "linkage";

std::vector<Term> linkage(const Robot& robot, std::size_t joint, const Measurements& data) {
  return unequal_bars(kLinkage, robot, joint, crank_angles(robot, robot.joints.at(joint)), data);
}

std::vector<EffectForm> phases_of_linkage(const Robot& robot, std::size_t joint, const Measurements& data) {
  return phases_of_bars(kLinkage, robot, joint, crank_angles(robot, robot.joints.at(joint)), data);
}

// The motor of an elbow stands at the shoulder and drives it by a rod along the upper arm. Shoulder, crank and rocker
// turn about parallel axes, the upper arm is the base bar, and crank and rocker stand at the elbow's own angle to it.
constexpr const char* kElbowLinkage = "elbow_linkage";

bool is_parallel_to_last_axis(const Robot& robot, std::size_t joint) {
  constexpr double kParallel = 5.0 * kDegree;
  if (joint == 0 || !is_revolute(robot.joints[joint - 1])) return false;
  const auto driven = static_cast<Eigen::Index>(robot.driven_joints().size());
  const std::vector<Eigen::Isometry3d> frames = forward_kinematics(robot, Eigen::VectorXd::Zero(driven));
  const Eigen::Vector3d last = joint_axis(robot, frames, joint - 1).direction;
  return last.cross(joint_axis(robot, frames, joint).direction).norm() < std::sin(kParallel);
}

std::vector<CrankAngle> crank_of_elbow(const Robot& robot, std::size_t joint) {
  const Joint& at = robot.joints.at(joint);
  require_driven(kElbowLinkage, at);
  require_revolute(kElbowLinkage, at, "");
  if (!is_parallel_to_last_axis(robot, joint))
    unsuited(kElbowLinkage, at, "needs an axis parallel to the one before: rods turn in one plane");
  const auto own = static_cast<Eigen::Index>(joint);
  return {{"", own, own, 0.0, 1.0, true}};
}

std::vector<Term> elbow_linkage(const Robot& robot, std::size_t joint, const Measurements& data) {
  return unequal_bars(kElbowLinkage, robot, joint, crank_of_elbow(robot, joint), data);
}

std::vector<EffectForm> phases_of_elbow(const Robot& robot, std::size_t joint, const Measurements& data) {
  return phases_of_bars(kElbowLinkage, robot, joint, crank_of_elbow(robot, joint), data);
}

// The motor of one joint is carried by another, or its belt runs over that one: turning that one turns this one a
// little. dq_k = c q_j, each ratio on its own; those that a wrist's concentric shafts make are joint_coupling's.
std::vector<Term> neighbour_coupling(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  require_driven("neighbour_coupling", at);
  std::vector<Term> terms;
  for (std::size_t other = 0; other < robot.joints.size(); ++other) {
    const Joint& mover = robot.joints[other];
    const bool by_wrist = is_wrist(robot) && other + 3 >= robot.joints.size() && other < joint;
    if (other == joint || mover.passive() || by_wrist) continue;
    const bool same_kind = mover.type == at.type;
    const std::string unit = same_kind ? "-" : std::string(motion_unit(at)) + "/" + motion_unit(mover);
    terms.push_back(
        make_term("neighbour_coupling." + at.name + "." + mover.name, unit, at.name,
                  [index = static_cast<Eigen::Index>(other)](const Inputs& in) { return in.joints[index]; }));
  }
  if (terms.empty()) unsuited("neighbour_coupling", at, "needs another joint with a reading");
  return terms;
}

// One joint that moves it, each by itself, the nearest first.
std::vector<EffectForm> pairs_of_coupling(const Robot& robot, std::size_t joint, const Measurements& data) {
  const std::vector<Term> terms = neighbour_coupling(robot, joint, data);
  std::vector<EffectForm> forms;
  for (std::size_t away = 1; away < robot.joints.size(); ++away) {
    for (const std::size_t other : {joint - away, joint + away}) {
      if (other >= robot.joints.size()) continue;  // before the first as well: it wraps around
      const std::string name = "neighbour_coupling." + robot.joints[joint].name + "." + robot.joints[other].name;
      if (std::any_of(terms.begin(), terms.end(), [&](const Term& term) { return term.parameter == name; }))
        forms.push_back({{name}});
    }
  }
  return forms;
}

Effect joint_coupling_effect() {
  Effect effect{"joint_coupling", "wrist joints turn each other", joint_coupling, false};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::other_angles;
  traits.usual = 2e-4;
  traits.plausible = 5e-2;
  traits.documentation = {"wrist: c q4 on q5, c′ q4 + c″ q5 on q6", "`joint_coupling.J6.J4` … [-]",
                          "last three joints revolute and driven"};
  return effect;
}

Effect linkage_effect() {
  Effect effect{kLinkage, "bars of a parallelogram are not equal: error of the passive joint", linkage};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::other_angles;
  traits.usual = 5e-4;
  traits.plausible = 1e-2;
  traits.main_part = "rods_first";
  traits.documentation = {
      "(a + b cos θ) / sin θ on the joint that q2 and q3 drive, θ a crank against its base bar: a phase and q3 − q2, "
      "q2 "
      "(`_first`) or q2 + q3 (`_sum`); a = `rods`, base bar less coupler, b = `arms`, rocker less crank, by the "
      "crank's "
      "length",
      "`linkage.J4.rods`, `.arms`, `.rods_first` … [rad]",
      "a passive joint; a crank that stays clear of its dead centres"};
  effect.forms = phases_of_linkage;
  return effect;
}

Effect elbow_linkage_effect() {
  Effect effect{kElbowLinkage, "bars of the parallelogram that drives an elbow are not equal", elbow_linkage};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::angle;
  traits.law = Law::of_angle;
  traits.separated_by = {{Experiment::own_words, "", "look whether a rod drives the joint; use its full range"}};
  traits.usual = 5e-4;
  traits.plausible = 1e-2;
  traits.main_part = "rods";
  traits.documentation = {
      "(a (1 − sin θ) + b cos θ) / sin θ on a joint that a rod along the link before it drives, θ "
      "the joint's angle and a phase; a, b as of `linkage`",
      "`elbow_linkage.J3.rods`, `.arms` [rad]",
      "a driven joint whose axis is parallel to the one before; a crank that stays clear of its "
      "dead centres"};
  effect.forms = phases_of_elbow;
  return effect;
}

Effect neighbour_coupling_effect() {
  Effect effect{"neighbour_coupling", "another joint of the chain turns the joint: its motor or belt is carried along",
                neighbour_coupling};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::other_angles;
  traits.usual = 2e-4;
  traits.plausible = 5e-2;
  traits.documentation = {"c · motion of another joint, for each of them; not what `joint_coupling` has",
                          "`neighbour_coupling.J3.J2` [-, rad/m, m/rad]", "two joints with a reading"};
  effect.forms = pairs_of_coupling;
  return effect;
}

}  // namespace

std::vector<Effect> coupling_effects() {
  return {joint_coupling_effect(), linkage_effect(), elbow_linkage_effect(), neighbour_coupling_effect()};
}

}  // namespace truing::model
