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

/// Thrown by Effect::terms when the data lack a column that the effect needs.
class MissingColumn : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

// What diagnosis, planning, simulation and the documents know of an effect. They read these traits and no name.

/// The input that an effect's basis is a function of.
enum class Driver {
  several,         ///< more than one, or not said
  constant,        ///< none: a constant
  angle,           ///< the joint's own motion, as read
  other_angles,    ///< motions of other joints
  speed,           ///< of the joint
  direction,       ///< that the joint came from
  gravity_torque,  ///< on the joint
  motor_torque,    ///< of the joint's motor
  temperature,
  time,
};

/// What an effect moves: the joint itself, its axis, its link, the base in the measurement frame, or the targets.
enum class Moves { joint, axis, link, base, target };

/// The parameters of the model itself that an effect stands for. `terms`: none, it has terms of its own.
enum class StandsFor { terms, gear_ratio, joint_offset, link_geometry, base_frame, tool_frame };

/// What one law of one input an effect's motion of a joint follows. Effects of the same law at a joint are tested, and
/// corrected, together.
enum class Law { none = -1, of_torque, of_direction, of_angle, of_lengths_in_warmth, of_warmth };

/// The free function that a law is tested against, once the effect is named.
enum class LawTest {
  none,
  of_driver,          ///< of the driver, at the joint
  times_direction,    ///< direction times a function of the gravity torque, or of the angle where no mass is known
  times_the_lengths,  ///< the link's lengths times a function of time, or of temperature where none was recorded
};

/// When an effect takes part in a diagnosis or a plan.
enum class Search {
  always,
  if_asked,              ///< when it is asked for by name
  by_order,              ///< its order is found by trying many
  with_unknown_weights,  ///< beside the effects whose EffectTraits::weights_found_by it is
  never,                 ///< it is fitted in any case
};

/// How a larger effect contains this one.
enum class Containment {
  part,          ///< it is a part of the larger one at the same joint
  special_case,  ///< its law is one case of the larger one's at the same joint
  look_alike,    ///< the larger one, at all joints together, makes the same motion
};

struct ContainedIn {
  std::string effect;
  Containment how = Containment::part;
  std::string why;  ///< in words; of a look-alike: none
};

/// What tells two effects apart, the most telling first.
enum class Experiment {
  own_words,        ///< SeparatedBy::words
  both_directions,  ///< needed only while every pose is approached from the same side
  scale_bar,
  warm_up_and_cool_down,
  more_temperatures,
  fixed_points_again,
  target_on_elbow,
  another_payload,
  full_range,
  orientations,       ///< needed only while no orientation is measured
  where_they_differ,  ///< poses where the two differ
};

struct SeparatedBy {
  Experiment experiment = Experiment::where_they_differ;
  std::string from{};   ///< name of the other effect; empty: any
  std::string words{};  ///< of Experiment::own_words: what to measure
};

/// How a parameter is shown: values in `of` times `factor` are in `unit`. Parameters in other units are shown as they
/// are.
struct ReportUnit {
  std::string of = "rad", unit = "mrad";
  double factor = 1e3;
};

/// Its line in docs/reference/effects.md.
struct EffectDocumentation {
  std::string law;         ///< what is added, where
  std::string parameters;  ///< names and units
  std::string needs;
};

struct EffectTraits {
  Driver driver = Driver::several;
  Moves moves = Moves::joint;
  StandsFor stands_for = StandsFor::terms;
  Law law = Law::none;
  LawTest law_test = LawTest::none;
  Search search = Search::always;
  bool of_instrument = false;  ///< not a motion of the robot: instrument, frames, clocks
  /// What causes it at one joint is likely at others too (gears of one make, one load): it is tried at several at once.
  bool on_several_joints = false;
  bool wanders = false;            ///< what it moves may also wander: it is tried as a free function of time
  bool needs_masses = false;       ///< to be searched it needs the links' masses: the payload alone is not enough
  std::string weights_found_by{};  ///< the effect that finds the weights where no mass is known
  std::vector<std::string> mimicked_by{};  ///< effects that may do the same, and show only with a column of their own
  std::vector<ContainedIn> contained_in{};
  std::vector<SeparatedBy> separated_by{};
  double prior = 1e-2;        ///< motion [rad | m] of its site that it may well make
  double usual = 0.0;         ///< size of its parameters, in their unit: what a simulation draws; 0: unknown
  double plausible = 0.0;     ///< no machine in working order has more, in the same unit; 0: unknown
  std::string if_negative{};  ///< what a parameter below zero may mean, where machines have none; empty: they do
  std::string main_part{};    ///< which of several parameters is meant by the effect's name alone, "cos1"
  /// No machine has a main part of more than so many times each of the other parameters; 0: any.
  double most_times_others = 0.0;
  ReportUnit reported{};
  EffectDocumentation documentation{};
};

/// A narrower form of an effect, which a diagnosis tries by itself: some of its parameters, at these constants.
struct EffectForm {
  std::vector<std::string> parameters;        ///< full names, as the effect's terms have them
  std::map<std::string, double> constants{};  ///< by full name, as in Term::constants; none: what the terms have
};

/// A named effect: the terms that it puts on one joint, or (per_joint = false) on the robot as a whole.
struct Effect {
  std::string name;
  std::string summary;
  /// Terms on joint `joint` of `robot`; throws std::invalid_argument when the robot or the data lack what it needs
  /// (MissingColumn names the column).
  std::function<std::vector<Term>(const Robot& robot, std::size_t joint, const Measurements& data)> terms;
  bool per_joint = true;  ///< false: `terms` is called once, with joint 0, and a request must not name joints
  EffectTraits traits{};
  /// Of an effect per joint: what a request without joints means. None: `terms` at every joint that suits.
  std::function<std::vector<Term>(const Robot& robot, const Measurements& data)> terms_of_robot{};
  /// Forms at a joint that a diagnosis chooses from, each with the same name. None: the effect as it is.
  std::function<std::vector<EffectForm>(const Robot& robot, std::size_t joint, const Measurements& data)> forms{};
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

/// An effect asked for: its name, and joints ({}: every driven joint that suits, or every passive one if only those do;
/// of an effect that has Effect::terms_of_robot, the robot as a whole).
struct EffectRequest {
  std::string effect;               ///< name, as in `catalogue()`
  std::vector<std::string> joints;  ///< names of joints; none: every driven one
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
