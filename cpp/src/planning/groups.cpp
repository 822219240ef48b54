// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "planning/groups.hpp"

#include <algorithm>
#include <stdexcept>

#include "estimation/selection.hpp"
#include "model/effects/traits.hpp"
#include "model/gravity.hpp"
#include "model/model.hpp"
#include "truing/identify.hpp"

namespace truing::planning {
namespace {

/// "transmission_error", of which only orders are effects: "transmission_error@96".
bool lacks_order(const Effect& effect) {
  return effect.traits.search == Search::by_order && effect.name.find('@') == std::string::npos;
}

/// The effect's function throws where a name or a joint means nothing.
void check_joint(const Robot& robot, const Effect& effect, const std::string& joint, const Measurements& data) {
  const std::size_t index = robot.joint_index(joint);
  try {
    effect.terms(robot, index, data);
  } catch (const Unsuited&) {
    throw;
  } catch (const std::invalid_argument&) {
    // A column that is missing is said in the result.
  }
}

/// The effects of the catalogue, of the caller and by order that take part, in this order.
std::vector<const Effect*> effects_of(const DistinguishOptions& options) {
  const std::vector<EffectRequest>& separate = options.separate;
  std::vector<const Effect*> effects;
  for (const Effect& effect : catalogue()) {
    const bool named =
        std::any_of(separate.begin(), separate.end(), [&](const EffectRequest& r) { return r.effect == effect.name; });
    if (named || effect.traits.search == Search::always) effects.push_back(&effect);
  }
  for (const Effect& effect : options.own_effects) effects.push_back(&effect);
  for (const EffectRequest& request : separate) {  // transmission_error@96
    const Effect& effect = find_effect(request.effect, options.own_effects);
    if (std::none_of(effects.begin(), effects.end(), [&](const Effect* e) { return e->name == effect.name; }))
      effects.push_back(&effect);
  }
  return effects;
}

/// Makes groups of effects at joints.
class Grouping {
 public:
  Grouping(const Robot& robot, const Measurements& data, const std::vector<Effect>& own)
      : robot_(robot),
        data_(data),
        own_(own),
        plain_(make_model(robot, data)),
        parallel_(near_parallel(robot, IdentifyOptions().hayati_angle)) {}

  /// Throws what Effect::terms throws.
  void add(const Effect& effect, const std::vector<std::string>& joints) {
    Group group;
    group.effect = &effect;
    if (!joints.empty()) group.joint = joints[0];
    const StandsFor what = effect.traits.stands_for;
    if (what == StandsFor::link_geometry)
      group.parameters = geometry_of_link(robot_.joint_index(group.joint));
    else if (what == StandsFor::terms)
      add_terms(effect, joints, &group);
    else if (!group.joint.empty())
      add_single_parameter(effect, &group);
    if (!group.parameters.empty()) groups_.push_back(std::move(group));
  }

  std::size_t size() const { return groups_.size(); }
  std::vector<Group> take() { return std::move(groups_); }

 private:
  std::vector<std::string> geometry_of_link(std::size_t joint) const {
    std::vector<std::string> names;
    for (const ParameterInfo& info : plain_.parameters) {
      if (info.owner == static_cast<int>(joint) && is_fitted_geometry(info, parallel_, robot_))
        names.push_back(info.name);
    }
    return names;
  }

  void add_single_parameter(const Effect& effect, Group* group) const {
    effect.terms(robot_, robot_.joint_index(group->joint), data_);
    const std::string name = parameter_of(effect.traits.stands_for, group->joint);
    if (plain_.parameter_index(name) >= 0) group->parameters = {name};
  }

  void add_terms(const Effect& effect, const std::vector<std::string>& joints, Group* group) const {
    // Weights that nobody knows: the compliance finds the first moments itself.
    const bool weights_missing = !effect.traits.weights_found_by.empty() && !knows_mass(robot_);
    if (weights_missing) group->requests.push_back({effect.traits.weights_found_by, joints});
    if (!weights_missing || data_.payload) group->requests.push_back({effect.name, joints});
    for (const Term& term : effect_terms(group->requests, robot_, data_, own_)) {
      if (std::find(group->parameters.begin(), group->parameters.end(), term.parameter) == group->parameters.end())
        group->parameters.push_back(term.parameter);
    }
  }

  const Robot& robot_;
  const Measurements& data_;
  const std::vector<Effect>& own_;
  const Model plain_;
  const std::vector<bool> parallel_;
  std::vector<Group> groups_;
};

/// Adds the effect at these joints. False: it does not suit them, or the data cannot show it, and `obstacle` says why.
bool try_to_add(Grouping* grouping, const Effect& effect, const std::vector<std::string>& joints,
                NotTestable* obstacle) {
  try {
    grouping->add(effect, joints);
    return true;
  } catch (const Unsuited&) {
  } catch (const MissingColumn& why) {
    *obstacle = {effect.name, {}, why.what(), Untestable::column_missing};
  } catch (const std::invalid_argument& why) {
    *obstacle = {effect.name, {}, why.what()};
  }
  return false;
}

void add_at_every_joint(Grouping* grouping, const Effect& effect, const Robot& robot,
                        std::vector<NotTestable>* not_testable) {
  NotTestable first;
  std::vector<std::string> missing_at;
  const std::size_t before = grouping->size();
  for (const Joint& joint : robot.joints) {
    NotTestable obstacle;
    if (try_to_add(grouping, effect, {joint.name}, &obstacle) || obstacle.why.empty()) continue;
    if (first.why.empty()) first = obstacle;
    missing_at.push_back(joint.name);
  }
  if (first.why.empty()) return;
  if (grouping->size() != before) first.joints = std::move(missing_at);  // else at any joint
  not_testable->push_back(std::move(first));
}

}  // namespace

bool is_named(const std::vector<EffectRequest>& requests, const Group& group) {
  return std::any_of(requests.begin(), requests.end(), [&](const EffectRequest& r) {
    return r.effect == group.effect->name &&
           (r.joints.empty() || std::find(r.joints.begin(), r.joints.end(), group.joint) != r.joints.end());
  });
}

void check_names(const Robot& robot, const DistinguishOptions& options, const Measurements& data) {
  for (const EffectRequest& request : options.separate) {
    const Effect& effect = find_effect(request.effect, options.own_effects);
    if (effect.traits.search == Search::never)
      throw std::invalid_argument("distinguish: " + effect.name +
                                  " is fitted in any case, and what it explains is told from nothing");
    if (lacks_order(effect)) effect.terms(robot, 0, data);  // throws
    if (!effect.per_joint && !request.joints.empty())
      throw std::invalid_argument("distinguish: effect '" + effect.name +
                                  "' belongs to the robot as a whole and takes no joints");
    for (const std::string& joint : request.joints) check_joint(robot, effect, joint, data);
  }
}

std::vector<Group> find_groups(const Robot& robot, const Measurements& data, const DistinguishOptions& options,
                               std::vector<NotTestable>* not_testable) {
  Grouping grouping(robot, data, options.own_effects);
  for (const Effect* effect : effects_of(options)) {
    if (effect->per_joint) {
      add_at_every_joint(&grouping, *effect, robot, not_testable);
      continue;
    }
    NotTestable obstacle;
    if (!try_to_add(&grouping, *effect, {}, &obstacle) && !obstacle.why.empty())
      not_testable->push_back(std::move(obstacle));
  }
  return grouping.take();
}

}  // namespace truing::planning
