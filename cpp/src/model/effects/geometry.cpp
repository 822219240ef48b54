// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Effects that are parameters of the model itself: identify frees them, and they have no terms.

#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"

namespace truing::model {
namespace {

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

std::vector<Term> no_terms(const Robot&, std::size_t, const Measurements&) { return {}; }

Effect gear_ratio_effect() {
  Effect effect{"gear_ratio", "the joint turns by ratio * reading: wrong gear ratio or encoder scale", gear_ratio};
  EffectTraits& traits = effect.traits;
  traits.stands_for = StandsFor::gear_ratio;
  traits.driver = Driver::angle;
  traits.separated_by = {{Experiment::full_range}};
  traits.usual = 3e-4;
  traits.plausible = 1e-2;
  traits.documentation = {"ratio · reading, at the joint", "`J2.ratio`", "a driven joint"};
  return effect;
}

Effect joint_offset_effect() {
  Effect effect{"joint_offset", "the joint's zero is elsewhere", joint_offset};
  EffectTraits& traits = effect.traits;
  traits.stands_for = StandsFor::joint_offset;
  traits.driver = Driver::constant;
  traits.contained_in = {{"link_geometry", Containment::part, "a joint's zero is part of its link's geometry"}};
  traits.usual = 1e-3;
  traits.documentation = {"its zero", "`J2.offset`", ""};
  return effect;
}

Effect link_geometry_effect() {
  Effect effect{"link_geometry", "lengths and angles of the link differ from the drawing", link_geometry};
  EffectTraits& traits = effect.traits;
  traits.stands_for = StandsFor::link_geometry;
  traits.driver = Driver::constant;
  traits.moves = Moves::link;
  traits.documentation = {"– frees all values of the link", "`J2.a` …", ""};
  return effect;
}

Effect base_frame_effect() {
  Effect effect{"base_frame", "the robot stands elsewhere in the measurement frame", no_terms, false};
  EffectTraits& traits = effect.traits;
  traits.stands_for = StandsFor::base_frame;
  traits.driver = Driver::constant;
  traits.moves = Moves::base;
  traits.search = Search::never;
  traits.of_instrument = true;
  traits.documentation = {"– frees the base", "`base.x` …", ""};
  return effect;
}

Effect tool_frame_effect() {
  Effect effect{"tool_frame", "the targets sit elsewhere on the last link", no_terms, false};
  EffectTraits& traits = effect.traits;
  traits.stands_for = StandsFor::tool_frame;
  traits.driver = Driver::constant;
  traits.moves = Moves::target;
  traits.search = Search::never;
  traits.of_instrument = true;
  traits.wanders = true;
  traits.documentation = {"– frees the targets", "`tool.x` …", ""};
  return effect;
}

}  // namespace

std::vector<Effect> geometry_effects() {
  return {gear_ratio_effect(), joint_offset_effect(), link_geometry_effect(), base_frame_effect(), tool_frame_effect()};
}

}  // namespace truing::model
