// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/effect.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "gravity.hpp"
#include "text.hpp"

namespace truing {
namespace {

using detail::listed;

[[noreturn]] void refuse(const char* effect, const Joint& joint, const std::string& what) {
  throw std::invalid_argument(std::string(effect) + " at " + joint.name + " " + what);
}

const char* motion_unit(const Joint& joint) { return joint.type == JointType::revolute ? "rad" : "m"; }

void require_driven(const char* effect, const Joint& joint) {
  if (!joint.passive()) return;
  std::vector<std::string> drivers;
  for (const auto& driver : joint.driven_by) drivers.push_back(driver.first);
  refuse(effect, joint,
         "needs a joint with a reading; " + joint.name + " is passive, driven by " + listed(drivers));
}

// Place of a driven joint among the driven ones: the number in its column names, less one.
std::size_t driven_number(const Robot& robot, std::size_t joint) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  return static_cast<std::size_t>(std::find(driven.begin(), driven.end(), joint) - driven.begin());
}

// The effects that are parameters of the model itself: identify frees `ratio`, `offset` or the link's values.

std::vector<Term> gear_ratio(const Robot& robot, std::size_t joint, const Measurements&) {
  require_driven("gear_ratio", robot.joints.at(joint));  // a passive joint's ratio is not used
  return {};
}

std::vector<Term> joint_offset(const Robot& robot, std::size_t joint, const Measurements&) {
  (void)robot.joints.at(joint);  // any joint: a passive one has its own zero
  return {};
}

std::vector<Term> link_geometry(const Robot& robot, std::size_t joint, const Measurements&) {
  (void)robot.joints.at(joint);
  return {};
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

// Eccentric or tilted gears and encoder discs: once and twice per turn of the joint.
std::vector<Term> harmonic(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  if (at.type != JointType::revolute) {
    refuse("harmonic", at,
           "needs a revolute joint; " + at.name + " is prismatic and has no turn to be periodic in");
  }
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

// A linear spring: the joint gives way by compliance * torque, in the direction that the weight pulls.
std::vector<Term> joint_compliance(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  if (!detail::knows_mass(robot) && !data.payload) {
    refuse("joint_compliance", at,
           "needs gravity torques: give the links' mass and com in the robot, or the column payload_kg");
  }
  const auto index = static_cast<Eigen::Index>(joint);
  Term term;
  term.parameter = "joint_compliance." + at.name;
  term.unit = at.type == JointType::revolute ? "rad/Nm" : "m/N";
  term.site = at.name;
  term.basis = [index](const Inputs& in) { return in.gravity_torque[index]; };
  term.needs_gravity = true;
  return {term};
}

// What a request without joints means: the driven joints, less those that the effect has no meaning for.
std::vector<std::size_t> suitable_joints(const Effect& effect, const Robot& robot) {
  std::vector<std::size_t> joints = robot.driven_joints();
  if (effect.name == "harmonic") {
    const auto is_prismatic = [&robot](std::size_t i) {
      return robot.joints[i].type == JointType::prismatic;
    };
    joints.erase(std::remove_if(joints.begin(), joints.end(), is_prismatic), joints.end());
  }
  if (joints.empty()) throw std::invalid_argument(effect.name + " suits no joint of this robot");
  return joints;
}

std::vector<std::size_t> requested_joints(const EffectRequest& request, const Effect& effect,
                                          const Robot& robot) {
  if (request.joints.empty()) return suitable_joints(effect, robot);
  std::vector<std::size_t> joints;
  for (const std::string& name : request.joints) joints.push_back(robot.joint_index(name));
  return joints;
}

}  // namespace

const std::vector<Effect>& catalogue() {
  static const std::vector<Effect> effects = {
      {"gear_ratio", "the joint turns by ratio * reading: wrong gear ratio or encoder scale", gear_ratio},
      {"joint_offset", "the joint's zero is elsewhere", joint_offset},
      {"link_geometry", "lengths and angles of the link differ from the drawing", link_geometry},
      {"joint_compliance", "the joint gives way under the weight that it carries", joint_compliance},
      {"harmonic", "error once and twice per turn: eccentric gear or encoder disc", harmonic},
      {"backlash", "the joint's play, seen when poses are approached from both sides", backlash},
  };
  return effects;
}

const Effect& find_effect(const std::string& name, const std::vector<Effect>& own) {
  std::vector<std::string> names;
  const Effect* found = nullptr;
  for (const std::vector<Effect>* effects : {&catalogue(), &own}) {
    for (const Effect& effect : *effects) {
      if (effect.name == name && found != nullptr) {
        throw std::invalid_argument("effect '" + name + "' exists twice: give your own effect another name");
      }
      if (effect.name == name) found = &effect;
      names.push_back(effect.name);
    }
  }
  if (found == nullptr)
    throw std::invalid_argument("effect '" + name + "' does not exist; there are " + listed(names));
  return *found;
}

std::vector<Term> effect_terms(const std::vector<EffectRequest>& requests, const Robot& robot,
                               const Measurements& data, const std::vector<Effect>& own) {
  std::vector<Term> all;
  std::set<std::pair<std::string, std::size_t>> seen;
  for (const EffectRequest& request : requests) {
    const Effect& effect = find_effect(request.effect, own);
    if (!effect.terms)
      throw std::invalid_argument("effect '" + effect.name + "' has no function that gives its terms");
    for (const std::size_t joint : requested_joints(request, effect, robot)) {
      // Twice the same columns would make both parameters invisible.
      if (!seen.insert({effect.name, joint}).second) {
        throw std::invalid_argument(effect.name + " at " + robot.joints[joint].name + " is asked for twice");
      }
      for (Term& term : effect.terms(robot, joint, data)) {
        if (term.parameter.empty() || !term.basis) {
          throw std::invalid_argument("effect '" + effect.name +
                                      "' gives a term without parameter name or basis");
        }
        all.push_back(std::move(term));
      }
    }
  }
  return all;
}

}  // namespace truing
