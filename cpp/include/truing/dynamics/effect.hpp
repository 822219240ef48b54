// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/model/effect.hpp"
#include "truing/model/robot.hpp"

namespace truing {

// A joint's torque is one more site: tau_j = Y_j(q, qd, qdd) pi + sum theta_k phi_k. An effect is a list of (joint,
// basis), and a basis is a column over a stretch of a recording.

/// What a basis may look at: a stretch of one recording, evenly sampled, derivatives by a filter without phase. Joints
/// are those that have a reading, in chain order.
struct Motion {
  const Robot* robot = nullptr;
  double step = 0.0;          ///< [s] between rows
  Eigen::VectorXd time;       ///< shape=(rows,) [s] from the start of the recording
  Eigen::MatrixXd q;          ///< shape=(rows, joints) [rad | m]
  Eigen::MatrixXd qd;         ///< shape=(rows, joints) [rad/s | m/s]
  Eigen::MatrixXd qdd;        ///< shape=(rows, joints) [rad/s^2 | m/s^2]
  Eigen::MatrixXd direction;  ///< shape=(rows, joints) -1 ... 1: of the motion, as dry friction knows it
  Eigen::MatrixXd torque;     ///< shape=(rows, joints) [Nm | N] that the model predicts in all, friction included
  Eigen::VectorXd bodies;     ///< shape=(10 * links,) inertial parameters of the links in the model that predicts it
  Eigen::MatrixXd links;      ///< shape=(rows, joints) [Nm | N] of the links alone, as `robot` has them
  Eigen::MatrixXd carried;    ///< the same as the model that predicts `torque` has them, and its payload
  /// Of every joint, shape=(rows, 10 * links) each: torque for an inertial parameter of one (mass, first moments, xx yy
  /// zz xy xz yz about the origin of the frame after the link), link after link. Empty where no term needs it.
  std::vector<Eigen::MatrixXd> rigid;
  /// Of every joint, shape=(rows, joints) each: torques for an acceleration of one of this joint alone, its column of
  /// the mass matrix of `bodies`. Empty where no term needs it.
  std::vector<Eigen::MatrixXd> inertia;
  /// Of every joint, shape=(rows, joints) each: what the torques change by when the link of this joint alone stands
  /// `torque` times 1 rad/Nm (m/N) behind its motor, to first order. Empty where no term needs it.
  std::vector<Eigen::MatrixXd> yielding;
  /// shape=(rows,) each: the further columns of the recording.
  std::map<std::string, Eigen::VectorXd> columns;

  Eigen::Index rows() const { return time.size(); }
};

/// One term of an effect: parameter * basis(motion) is added to the torques of `joints`.
struct TorqueTerm {
  std::string parameter;            ///< full name, e.g. "coulomb.J2"
  std::string unit;                 ///< of the parameter
  std::vector<std::size_t> joints;  ///< whose torque it adds to: numbers among those that have a reading
  /// shape=(rows, joints.size()) [Nm | N] for a parameter of one; without rows: nought. Rows depend on each other only
  /// through what came shortly before (a play operator); `Motion` begins early enough for that.
  std::function<Eigen::MatrixXd(const Motion&)> basis;
  bool needs_torque = false;  ///< the basis depends on Motion::torque
  /// The recordings show too little of it to name it, but it may stand for what they show.
  bool only_alternative = false;
  bool needs_rigid = true;      ///< the basis may look at Motion::rigid
  bool needs_direction = true;  ///< the basis may look at Motion::direction
  bool needs_inertia = false;   ///< the basis looks at Motion::inertia
  bool needs_yielding = false;  ///< the basis looks at Motion::yielding
  /// Terms of one joint each that have the same name here have the same basis: it is evaluated once. Empty: no other
  /// has it.
  std::string column{};
  /// The basis is this column of Motion::rigid at `joints`: number of an inertial parameter, 10 * link + part; -1: it
  /// is none of them. Then it is not called.
  int link_parameter = -1;
  double prior = 1.0;                                       ///< size that the parameter may well have
  double least = -std::numeric_limits<double>::infinity();  ///< no machine has less than this
  double most = std::numeric_limits<double>::infinity();    ///< no machine has more
  /// Numbers that the basis was made with (a Stribeck speed): kept by full name among the parameters of
  /// Robot::torque_effects.
  std::map<std::string, double> constants{};
  /// The effect at the same joint that it may as well be with these values of the joint's parameters, by full name;
  /// empty: none. A diagnosis says it beside its own.
  std::function<std::string(const std::map<std::string, double>&)> may_as_well_be{};
};

/// What kind of law an effect is: those of one kind trade places, and are told apart last.
enum class TorqueFamily { friction, inertia, gravity, drive, coupling, transmission, thermal, measurement, own };

/// What a simulator can be told of an effect.
enum class SimulatorPlace {
  none,           ///< it is the measurement's, or no simulator holds it
  field,          ///< a field of the model
  extra_element,  ///< further hinges, tendons or actuators of the model
  callback,       ///< code that runs beside the simulator
};

struct TorqueTraits {
  TorqueFamily family = TorqueFamily::own;
  bool standard = false;       ///< what everybody fits beside the inertias: offset, Coulomb, viscous
  bool usual = false;          ///< `identify` fits it where nothing in particular is asked for
  bool scales_masses = false;  ///< where inertial parameters are fitted it is the same as all of them times a factor
  SimulatorPlace mujoco = SimulatorPlace::callback;
  SimulatorPlace urdf = SimulatorPlace::none;
  std::string plain{};  ///< in plain words, without the joint: "friction that grows with the load"
  EffectDocumentation documentation{};
};

/// One form of an effect at a joint: its law with its inner constants. A diagnosis tries all forms.
using TorqueForm = std::vector<TorqueTerm>;

/// How dry friction turns round with the motion: by the speed, tanh(qd / speed), or by the travel, as Prandtl's stop
/// operator (1928), which remembers at rest where it came from; for ever, or as a Maxwell body (1867) does, whose
/// stress fades.
struct FrictionTurn {
  double speed = 0.01;  ///< [rad/s | m/s]
  double travel = 0.0;  ///< [rad | m]; 0: by the speed
  double fade = 0.0;    ///< [s] in which what is remembered falls to 1 / e; 0: it does not
};

/// What the recordings hold, and how far they reach.
struct MotionRange {
  Eigen::VectorXd lower, upper;                              ///< [rad | m] of every joint that has a reading
  Eigen::VectorXd speed;                                     ///< [rad/s | m/s] largest
  Eigen::VectorXd acceleration;                              ///< [rad/s^2 | m/s^2] largest
  Eigen::VectorXd torque;                                    ///< [Nm | N] standard deviation of the measured torque
  std::vector<FrictionTurn> turns;                           ///< of every joint that has a reading
  double duration = 0.0;                                     ///< [s] of the longest recording
  double frequency = 0.0;                                    ///< [Hz] highest that the low-pass leaves
  std::map<std::string, std::pair<double, double>> columns;  ///< smallest and largest value of the further columns
};

/// A named effect on the torques.
struct TorqueEffect {
  std::string name;
  std::string summary;
  /// Forms at joint `joint` (number among those that have a reading) of `robot`. Throws Unsuited where the effect
  /// cannot act, MissingColumn where the recordings lack a column that it needs.
  std::function<std::vector<TorqueForm>(const Robot& robot, std::size_t joint, const MotionRange& range)> forms;
  bool per_joint = true;  ///< false: `forms` is called once, with joint 0
  TorqueTraits traits{};
  /// The form with these constants (by full name, as in TorqueTerm::constants). None: the effect's forms have none.
  std::function<TorqueForm(const Robot& robot, std::size_t joint, const std::map<std::string, double>& constants)>
      form_with{};
};

/// The effects that truing knows by name; docs/reference/torque_effects.md has their laws.
const std::vector<TorqueEffect>& torque_catalogue();

/// Catalogue plus the caller's own, by name; throws std::invalid_argument that lists the names there are.
const TorqueEffect& find_torque_effect(const std::string& name, const std::vector<TorqueEffect>& own = {});

/// The terms of an effect that a robot carries (Robot::torque_effects), made with its constants. Throws
/// std::invalid_argument: unknown effect, joint or parameter.
std::vector<TorqueTerm> terms_of(const AppliedEffect& effect, const Robot& robot, const MotionRange& range,
                                 const std::vector<TorqueEffect>& own = {});

namespace dynamics {
using truing::Motion;  // and no other room's, where one has a name alike
}

}  // namespace truing
