// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Errors that repeat many times per turn of a joint, as gears make them: which order, at which joints, and which orders
// the sampled angles cannot tell apart.

#include <cstddef>
#include <functional>
#include <vector>

#include "diagnosis/design.hpp"
#include "diagnosis/free_search.hpp"
#include "estimation/evidence.hpp"
#include "math/constants.hpp"
#include "rooms.hpp"

namespace truing::diagnosis {

/// An order at one joint, or the same at several.
struct OrderAt {
  double order = 0.0;                ///< [1 per turn]
  std::vector<std::size_t> joints;   ///< of Robot::joints, increasing
  double nats = 0.0;                 ///< log Bayes factor of what is new in it
  double score = -1e300;             ///< the same less what looking at all orders and joints costs
  double in_noise = -1e300;          ///< score against the state's noise alone, whatever else is left around the order
  double low = 0.0, high = 0.0;      ///< orders next to it that fit about as well
  std::vector<double> stands_for{};  ///< other orders, further off, that fit about as well
  std::size_t tried = 0;             ///< orders looked at
};

/// How a joint's sampled angles tell orders apart.
struct Sampling {
  std::size_t joint = 0;
  std::size_t angles = 0;  ///< distinct ones
  double travel = 0.0;     ///< [rad]
  double lowest = 0.0;     ///< order below which there are less than two waves in the travel
  double repeats = 0.0;    ///< orders that differ by this, or add up to it, make the same motion; 0: there is none
};

constexpr std::size_t kFewAngles = 4;  ///< of so many, any function is a wave of any order
constexpr double kAsWell = 3.0;        ///< nats: an order that loses less fits about as well
/// [rad] of a joint's travel, over which orders are looked for: their number grows with it, and the time with its
/// square.
constexpr double kMostTravel = 32.0 * kTwoPi;

/// Of every driven revolute joint that moves, on the design's training rows.
std::vector<Sampling> samplings(const Design& design, const std::vector<InputColumn>& inputs, const Robot& robot);

/// What waves of every order explain of what is left, joint by joint.
class OrderScan {
 public:
  struct AtJoint {
    Sampling sampling;
    std::vector<double> nats;      ///< log Bayes factor of every order, standing out from its neighbours
    std::vector<double> in_noise;  ///< the same from the state's noise alone
    /// The same of `count` orders from `first` on.
    std::function<std::vector<double>(double first, double step, std::size_t count)> between;
  };

  OrderScan(const Design& design, const Evidence& evidence, const Evidence::State& state,
            const std::vector<InputColumn>& inputs, const std::vector<Sampling>& samplings, double design_effect,
            int threads, std::size_t most_values = 20000);

  /// The most probable order at one joint, or at several together. Those `known` are in the state: the same at further
  /// joints, and what the same gear makes beside, are then as probable as all others. No joints: nothing was scanned.
  /// `passed_over`: already tried, and not to be given again.
  OrderAt best(const std::vector<OrderAt>& known, const std::vector<OrderAt>& passed_over) const;

  /// An order that is not in the state, chosen again among its neighbours that fit about as well, those `known` given.
  OrderAt again(const OrderAt& one, const std::vector<OrderAt>& known) const;

  /// Chance, at most, that noise alone scores as high: a Bayes factor averaged over all that was looked at exceeds
  /// 1 / alpha with a probability below alpha (Markov's inequality, as in Ville 1939). At every joint the best of
  /// several sizes counts.
  static double chance_of(const OrderAt& order);

 private:
  std::vector<double> log_prior(const std::vector<OrderAt>& known) const;
  OrderAt described(const std::vector<double>& prior, const std::vector<std::size_t>& at, std::size_t order,
                    double cost) const;
  double search_cost(std::size_t joints) const;
  void refine(const std::vector<std::size_t>& at, double prior, OrderAt* out) const;

  std::vector<double> orders_;
  std::vector<AtJoint> joints_;
};

}  // namespace truing::diagnosis
