// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A robot, its scene and the options made ready for inverse kinematics: built once, const from then on.

#include <memory>
#include <vector>

#include "inverse_kinematics/arm.hpp"
#include "inverse_kinematics/closed_form.hpp"
#include "inverse_kinematics/descent.hpp"
#include "inverse_kinematics/surroundings.hpp"
#include "rooms.hpp"
#include "truing/inverse.hpp"

namespace truing::inverse_kinematics {

constexpr double kLimitRounding =
    1e-9;  ///< a reading so far beyond its limit is rounding, and set to the limit [rad | m]
constexpr double kNearLimit =
    0.02;  ///< a seed so far beyond may lead to joints within: the robot is not quite the closed form's

struct PreparedRobot {
  /// Throws std::invalid_argument when robot, target or options cannot be used.
  PreparedRobot(const Robot& robot, const InverseOptions& options, const Conditions& available, std::size_t target,
                const std::vector<Effect>& own);

  const InverseOptions options;
  const Arm arm;
  const Limits limits;
  const Scales scales;
  const ClosedForm closed;
  const Surroundings surroundings;
  double turn[kMaxDrivenJoints];       ///< whole_turn of each joint
  double seed_step[kMaxDrivenJoints];  ///< of the sequence of seeds that restarts begin from, as fractions of a range

  int driven() const { return arm.driven(); }
  /// How far beyond limits a seed of the closed form may lie.
  double seed_slack() const { return closed.exact() ? kLimitRounding : kNearLimit; }
};

/// Squared distance of two configurations, joints in radians' worth.
double distance2(const PreparedRobot& robot, const double* a, const double* b);

/// Seed k of those that restarts begin from: evenly over the joints' ranges, of unlimited ones over a turn or the arm's
/// reach about `around`.
void restart_seed(const PreparedRobot& robot, int k, const double* around, double* seed);

/// Readings of a joint after which everything is where it was: a whole turn of a joint that turns nothing else. 0:
/// none.
double whole_turn(const PreparedRobot& robot, int joint);

/// Takes whole turns off joints, so that they come as near to `seed` as they can.
void bring_near(const PreparedRobot& robot, const double* seed, double* readings);

/// Scratch memory of the pool while it is needed; none for robots without effects.
class Borrowed {
 public:
  Borrowed(const Arm& arm, ScratchPool* pool, const Conditions& conditions) : pool_(pool) {
    if (!arm.has_effects()) return;
    scratch_ = pool->take();
    arm.set_conditions(conditions, scratch_.get());
  }
  ~Borrowed() {
    if (scratch_) pool_->give_back(std::move(scratch_));
  }
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;
  EffectScratch* get() const { return scratch_.get(); }

 private:
  ScratchPool* pool_;
  std::unique_ptr<EffectScratch> scratch_;
};

}  // namespace truing::inverse_kinematics
