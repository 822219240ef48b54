// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Joints that move other joints.

#include <algorithm>
#include <cmath>
#include <tuple>

#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"

namespace truing::model {
namespace {

// Concentric shafts of a wrist: turning one joint turns the next ones a little. dq5 = c q4, dq6 = c' q4 + c"
// q5, for the last three joints, each ratio on its own.
std::vector<Term> joint_coupling(const Robot& robot, std::size_t, const Measurements&) {
  const std::size_t n = robot.joints.size();
  const auto is_wrist = [](const Joint& joint) { return is_revolute(joint) && !joint.passive(); };
  if (n < 3 || !std::all_of(robot.joints.end() - 3, robot.joints.end(), is_wrist)) {
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

// Four-bar linkages whose opposite bars are not quite equal: to first order the passive joint errs by a cos u + b sin
// u, u an angle between two bars: the difference of its first and last driver (q3 - q2 of a palletizer), or, where one
// bar is fixed to the base or the wrist, the first driver's angle or their sum.
std::vector<Term> linkage(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  if (!at.passive()) unsuited("linkage", at, "needs a passive joint; " + at.name + " has a reading of its own");
  std::vector<Eigen::Index> drivers;
  for (const auto& driver : at.driven_by) drivers.push_back(static_cast<Eigen::Index>(robot.joint_index(driver.first)));
  const auto [first, last] = std::minmax_element(drivers.begin(), drivers.end());
  std::vector<std::tuple<std::string, double, double>> angles = {
      {"", -1.0, 1.0}, {"_first", 1.0, 0.0}, {"_sum", 1.0, 1.0}};
  if (*first == *last) angles = {{"", 0.0, 1.0}};
  std::vector<Term> terms;
  for (const auto& [suffix, of_first, of_last] : angles) {
    const auto angle = [a = *first, b = *last, of_first = of_first, of_last = of_last](const Inputs& in) {
      return of_first * in.joints[a] + of_last * in.joints[b];
    };
    terms.push_back(make_term("linkage." + at.name + ".cos" + suffix, motion_unit(at), at.name,
                              [angle](const Inputs& in) { return std::cos(angle(in)); }));
    terms.push_back(make_term("linkage." + at.name + ".sin" + suffix, motion_unit(at), at.name,
                              [angle](const Inputs& in) { return std::sin(angle(in)); }));
  }
  return terms;
}

// The motor of one joint is carried by the one beside it, or a belt runs over it: turning that one turns this one a
// little. dq_k = c q_(k-1) + c' q_(k+1), each ratio on its own.
std::vector<Term> neighbour_coupling(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  require_driven("neighbour_coupling", at);
  std::vector<Term> terms;
  for (const int step : {-1, 1}) {
    const auto beside = static_cast<std::size_t>(static_cast<int>(joint) + step);  // of the first: past the end
    if (beside >= robot.joints.size() || robot.joints[beside].passive()) continue;
    const Joint& mover = robot.joints[beside];
    const bool same_kind = mover.type == at.type;
    const std::string unit = same_kind ? "-" : std::string(motion_unit(at)) + "/" + motion_unit(mover);
    terms.push_back(
        make_term("neighbour_coupling." + at.name + "." + mover.name, unit, at.name,
                  [index = static_cast<Eigen::Index>(beside)](const Inputs& in) { return in.joints[index]; }));
  }
  if (terms.empty()) unsuited("neighbour_coupling", at, "needs a joint with a reading beside it");
  return terms;
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
  Effect effect{"linkage", "bars of a parallelogram are not equal: error of the passive joint", linkage};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::other_angles;
  traits.usual = 5e-4;
  traits.plausible = 1e-2;
  traits.main_part = "cos";
  traits.documentation = {
      "a cos u + b sin u on the joint that q2 and q3 drive, for u = q3 − q2, q2 (`_first`) and q2 + q3 (`_sum`): "
      "whichever bars are unequal",
      "`linkage.J4.cos`, `.sin`, `.cos_first` … [rad]", "a passive joint"};
  return effect;
}

Effect neighbour_coupling_effect() {
  Effect effect{"neighbour_coupling", "the joints beside it in the chain turn the joint", neighbour_coupling};
  EffectTraits& traits = effect.traits;
  traits.driver = Driver::other_angles;
  traits.search = Search::if_asked;
  traits.usual = 2e-4;
  traits.plausible = 5e-2;
  traits.documentation = {"c · motion of the joint before, c′ · motion of the joint after",
                          "`neighbour_coupling.J3.J2` [-, rad/m, m/rad]", "a joint with a reading beside another"};
  return effect;
}

}  // namespace

std::vector<Effect> coupling_effects() {
  return {joint_coupling_effect(), linkage_effect(), neighbour_coupling_effect()};
}

}  // namespace truing::model
