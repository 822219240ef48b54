// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What diagnosis and planning ask of effects: by traits, never by name.

#include <functional>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/model/effect.hpp"

namespace truing::model {

/// As find_effect; nullptr when there is none of that name.
const Effect* effect_or_null(const std::string& name, const std::vector<Effect>& own);

/// Those of an effect; usual ones for a name that is no effect's (a free function's).
const EffectTraits& traits_of(const std::string& name, const std::vector<Effect>& own);

/// The first effect of the catalogue that has these traits; throws std::logic_error: there is none.
const Effect& effect_that(const std::function<bool(const EffectTraits&)>& has);
const Effect& effect_that_stands_for(StandsFor what);

/// Name of the parameter that an effect stands for at a joint: "J2.ratio", "J2.offset"; empty: it is not a single one.
std::string parameter_of(StandsFor what, const std::string& joint);

/// True when the effect `large` contains the one with these traits.
bool is_contained(const EffectTraits& small, const std::string& large, Containment how);

/// The joint moves as a function of where the robot stands, and of nothing else that is recorded.
inline bool follows_configuration(const EffectTraits& traits) {
  return (traits.moves == Moves::joint || traits.moves == Moves::axis) &&
         (traits.driver == Driver::constant || traits.driver == Driver::angle ||
          traits.driver == Driver::gravity_torque);
}

/// It depends on the joint's own angle at most.
inline bool follows_own_angle(const EffectTraits& traits) {
  return traits.driver == Driver::constant || traits.driver == Driver::angle;
}

/// An order [1 per turn of the joint] that a gear train may make.
struct LikelyOrder {
  double order = 0.0;
  double probability = 0.0;
};

/// Of an effect whose order is found by trying many (Search::by_order): every order that a ratio of 30 to 161 makes, in
/// increasing order; their probabilities add up to one, of what is not kept for belts and several stages: kOtherOrders.
const std::vector<LikelyOrder>& likely_orders();
constexpr double kOtherOrders =
    1.0 / 3.0;                           ///< probability of an order, between the two below, that no such ratio makes
constexpr double kLowestOrder = 15.0;    ///< [1 per turn] half of the smallest ratio
constexpr double kHighestOrder = 322.0;  ///< [1 per turn] twice the largest ratio

/// Orders that the same gear makes as well: half and twice as many.
std::vector<double> related_orders(double order);

/// What is recorded and varied beside joints and tip, as far as it tells effects apart.
struct Recorded {
  bool direction = false;  ///< poses are approached from both sides
  bool payload = false, temperature = false, time = false;
  bool orientation = false;
};

/// One of a pair.
struct EffectAt {
  const Effect* effect;
  std::vector<std::string> joints;
};

/// What to measure to tell two effects apart; `where_they_differ`: what to say if no experiment is known.
std::string separated_by(const EffectAt& a, const EffectAt& b, const Recorded& recorded,
                         const std::string& where_they_differ);

}  // namespace truing::model
