// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/measurement.hpp"
#include "truing/robot.hpp"

namespace truing {

/// What a basis function may look at: the recorded inputs of one row, never the parameters.
struct Inputs {
  std::size_t row = 0;
  const Measurements* data = nullptr;
  Eigen::VectorXd joints;          ///< every joint's motion as read (passive ones from their drivers) [rad | m]
  Eigen::VectorXd gravity_torque;  ///< of every joint coordinate, gravity of links and payload [Nm | N]; only if a term asks for it
};

/// One term of an effect: parameter * basis(inputs) is added to the value of a site.
///
/// A site is a joint ("J2": what moves with it, passive joints included), a link value ("J2.a", "J2.alpha", URDF "J2.x" …),
/// or a coordinate of the base or of a target ("base.z", "tool.x").
struct Term {
  std::string parameter;  ///< full name, e.g. "backlash.J2"
  std::string unit;
  std::string site;
  std::function<double(const Inputs&)> basis;
  bool needs_gravity = false;
};

/// A named effect: the terms that it puts on one joint.
struct Effect {
  std::string name;
  std::string summary;
  /// Terms on joint `joint` of `robot`; throws std::invalid_argument when the robot or the data lack what it needs (names the missing column).
  std::function<std::vector<Term>(const Robot& robot, std::size_t joint, const Measurements& data)> terms;
};

/// The effects that truing knows by name: gear_ratio, joint_offset, link_geometry (these three free model parameters
/// and have no terms), joint_compliance, harmonic, backlash.
const std::vector<Effect>& catalogue();

/// Catalogue plus the caller's own, by name; throws std::invalid_argument that lists the names there are.
const Effect& find_effect(const std::string& name, const std::vector<Effect>& own = {});

/// An effect asked for: its name, and joints ({}: every driven joint).
struct EffectRequest {
  std::string effect;
  std::vector<std::string> joints;
};

/// Terms of the requested effects, in order. The three effects that are model parameters give none.
std::vector<Term> effect_terms(const std::vector<EffectRequest>& requests, const Robot& robot, const Measurements& data,
                               const std::vector<Effect>& own = {});

/// Gravity torque on every joint coordinate (virtual work, coupled passive joints included) at the readings' configuration
/// [Nm | N], with `payload` [kg] at the tool. Throws std::invalid_argument when no mass is known and the payload is zero.
Eigen::VectorXd gravity_torques(const Robot& robot, const Eigen::VectorXd& reading, double payload = 0.0);

}  // namespace truing
