// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truing/model/measurement.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// What a basis function may look at: the recorded inputs of one row, never the parameters.
struct Inputs {
  std::size_t row = 0;
  const Measurements* data = nullptr;
  Eigen::VectorXd joints;  ///< every joint's motion as read (passive ones from their drivers) [rad | m]

  // Only if a term asks for them (needs_gravity), at the readings' configuration of the robot without its effects:
  Eigen::VectorXd gravity_torque;                 ///< of every joint coordinate, gravity of links and payload [Nm | N]
  std::vector<Eigen::Isometry3d> frames;          ///< T_measurement_link after every joint, then that of the tool
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();  ///< of the row's own target, in the measurement frame [m]
};

/// One term of an effect: parameter * basis(inputs) is added to the value of a site.
///
/// A site is a joint ("J2": what moves with it, passive joints included), a link value ("J2.a", "J2.alpha", URDF "J2.x"
/// …), or a coordinate of the base or of a target ("base.z", "tool.x").
struct Term {
  std::string parameter;  ///< full name, e.g. "backlash.J2"
  std::string unit;
  std::string site;
  std::function<double(const Inputs&)> basis;
  /// The basis depends on the robot: torques, frames, lengths. `identify` takes these from the robot as found until
  /// they settle.
  bool needs_gravity = false;
  std::string joint{};  ///< set by effect_terms: the joint it was made for; empty when the effect belongs to no joint
  /// Numbers that the basis took from the data (a mean temperature, knots): kept by full name among the parameters in
  /// Robot::effects, and used again from there, so that the robot predicts the same with other data.
  std::map<std::string, double> constants{};
};

/// Thrown by Effect::terms when the joint or robot is not of the kind that the effect acts on. A request that names no
/// joints skips it.
class Unsuited : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// A named effect: the terms that it puts on one joint, or (per_joint = false) on the robot as a whole.
struct Effect {
  std::string name;
  std::string summary;
  /// Terms on joint `joint` of `robot`; throws std::invalid_argument when the robot or the data lack what it needs
  /// (names the missing column).
  std::function<std::vector<Term>(const Robot& robot, std::size_t joint, const Measurements& data)> terms;
  bool per_joint = true;  ///< false: `terms` is called once, with joint 0, and a request must not name joints
};

/// The effects that truing knows by name (docs/reference/effects.md has their laws). gear_ratio, joint_offset,
/// link_geometry, base_frame and tool_frame free parameters of the model itself and have no terms.
const std::vector<Effect>& catalogue();

/// Tooth meshing: cos and sin of `order` times the joint's angle; its name is "transmission_error@order", which
/// find_effect knows too. The order [1 per turn] is that of the gear (teeth, or twice them in a strain-wave gear), or
/// found by trying several. Throws std::invalid_argument unless the order is positive and finite.
Effect transmission_error(double order);

/// Catalogue plus the caller's own, by name; throws std::invalid_argument that lists the names there are.
const Effect& find_effect(const std::string& name, const std::vector<Effect>& own = {});

/// An effect asked for: its name, and joints ({}: every driven joint that suits, or every passive one if only those
/// do).
struct EffectRequest {
  std::string effect;
  std::vector<std::string> joints;
};

/// Terms of the requested effects, in order. Effects that are model parameters give none.
/// Throws std::invalid_argument naming what is missing; without joints named, only when a column is missing or no joint
/// suits.
std::vector<Term> effect_terms(const std::vector<EffectRequest>& requests, const Robot& robot, const Measurements& data,
                               const std::vector<Effect>& own = {});

/// Gravity torque on every joint coordinate (virtual work, coupled passive joints included) at the readings'
/// configuration [Nm | N], with `payload` [kg] at the tool. Throws std::invalid_argument when no mass is known and the
/// payload is zero.
Eigen::VectorXd gravity_torques(const Robot& robot, const Eigen::VectorXd& reading, double payload = 0.0);

}  // namespace truing
