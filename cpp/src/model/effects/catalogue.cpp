// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <set>
#include <stdexcept>

#include "math/near_names.hpp"
#include "math/text.hpp"
#include "model/effects/families.hpp"
#include "model/effects/traits.hpp"

namespace truing {
using namespace model;

namespace model {
namespace {

constexpr std::size_t kRobot = std::numeric_limits<std::size_t>::max();  // in place of a joint: the robot as a whole

// Terms of one effect at one joint, or of the robot as a whole.
std::vector<Term> terms_at(const Effect& effect, const Robot& robot, std::size_t joint, const Measurements& data) {
  std::vector<Term> terms = joint == kRobot && effect.terms_of_robot
                                ? effect.terms_of_robot(robot, data)
                                : effect.terms(robot, joint == kRobot ? 0 : joint, data);
  for (Term& term : terms) {
    if (term.parameter.empty() || !term.basis) {
      throw std::invalid_argument("effect '" + effect.name + "' gives a term without parameter name or basis");
    }
    term.joint = joint == kRobot ? "" : robot.joints[joint].name;
  }
  return terms;
}

using Place = std::pair<std::size_t, std::vector<Term>>;

// What a request without joints means: the driven joints, less those that the effect has no meaning for; if
// there is none left, the passive ones.
std::vector<Place> suitable_places(const Effect& effect, const Robot& robot, const Measurements& data) {
  std::vector<Place> places;
  std::string first_complaint;
  for (const bool passive : {false, true}) {
    for (std::size_t joint = 0; joint < robot.joints.size(); ++joint) {
      if (robot.joints[joint].passive() != passive) continue;
      try {
        places.emplace_back(joint, terms_at(effect, robot, joint, data));
      } catch (const Unsuited& why) {
        if (first_complaint.empty()) first_complaint = why.what();
      }
    }
    if (!places.empty()) return places;
  }
  throw Unsuited(effect.name + " suits no joint of this robot: " + first_complaint);
}

std::vector<Place> requested_places(const EffectRequest& request, const Effect& effect, const Robot& robot,
                                    const Measurements& data) {
  if (!effect.per_joint) {
    if (!request.joints.empty()) {
      throw std::invalid_argument(effect.name + " belongs to the robot as a whole: ask for it without joints, not at " +
                                  listed(request.joints));
    }
    return {{kRobot, terms_at(effect, robot, kRobot, data)}};
  }
  if (request.joints.empty() && effect.terms_of_robot) return {{kRobot, terms_at(effect, robot, kRobot, data)}};
  if (request.joints.empty()) return suitable_places(effect, robot, data);
  std::vector<Place> places;
  for (const std::string& name : request.joints) {
    const std::size_t joint = robot.joint_index(name);
    places.emplace_back(joint, terms_at(effect, robot, joint, data));
  }
  return places;
}

}  // namespace

const Effect* effect_or_null(const std::string& name, const std::vector<Effect>& own) {
  const Effect* found = nullptr;
  for (const std::vector<Effect>* effects : {&catalogue(), &own}) {
    for (const Effect& effect : *effects) {
      if (effect.name != name) continue;
      if (found) throw std::invalid_argument("effect '" + name + "' exists twice: give your own effect another name");
      found = &effect;
    }
  }
  return found ? found : transmission_error_of(name);
}

const EffectTraits& traits_of(const std::string& name, const std::vector<Effect>& own) {
  static const EffectTraits none;
  const Effect* effect = effect_or_null(name, own);
  return effect ? effect->traits : none;
}

const Effect& effect_that(const std::function<bool(const EffectTraits&)>& has) {
  for (const Effect& effect : catalogue()) {
    if (has(effect.traits)) return effect;
  }
  throw std::logic_error("no effect of the catalogue has these traits");
}

const Effect& effect_that_stands_for(StandsFor what) {
  return effect_that([what](const EffectTraits& traits) { return traits.stands_for == what; });
}

std::string parameter_of(StandsFor what, const std::string& joint) {
  if (what == StandsFor::gear_ratio) return joint + ".ratio";
  return what == StandsFor::joint_offset ? joint + ".offset" : "";
}

}  // namespace model

const std::vector<Effect>& catalogue() {
  static const std::vector<Effect> effects = [] {
    std::vector<Effect> all;
    for (const auto family : {geometry_effects, compliance_effects, transmission_effects, thermal_effects,
                              coupling_effects, bearing_effects, instrument_effects, table_effects}) {
      for (Effect& effect : family()) all.push_back(std::move(effect));
    }
    return all;
  }();
  return effects;
}

const Effect& find_effect(const std::string& name, const std::vector<Effect>& own) {
  if (const Effect* found = effect_or_null(name, own)) return *found;
  std::vector<std::string> names;
  for (const std::vector<Effect>* effects : {&catalogue(), &own}) {
    for (const Effect& effect : *effects) names.push_back(effect.name);
  }
  throw std::invalid_argument("effect '" + name + "' does not exist" + did_you_mean(name, names) + "; there are " +
                              listed(names));
}

std::vector<Term> effect_terms(const std::vector<EffectRequest>& requests, const Robot& robot, const Measurements& data,
                               const std::vector<Effect>& own) {
  std::vector<Term> all;
  std::set<std::pair<std::string, std::size_t>> seen;
  for (const EffectRequest& request : requests) {
    const Effect& effect = find_effect(request.effect, own);
    if (!effect.terms) throw std::invalid_argument("effect '" + effect.name + "' has no function that gives its terms");
    for (Place& place : requested_places(request, effect, robot, data)) {
      // Twice the same columns would make both parameters invisible.
      if (!seen.insert({effect.name, place.first}).second) {
        throw std::invalid_argument(effect.name +
                                    (place.first == kRobot ? "" : " at " + robot.joints[place.first].name) +
                                    " is asked for twice");
      }
      std::move(place.second.begin(), place.second.end(), std::back_inserter(all));
    }
  }
  return all;
}

}  // namespace truing
