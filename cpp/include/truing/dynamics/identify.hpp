// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/common/not_testable.hpp"
#include "truing/common/parameter.hpp"
#include "truing/dynamics/effect.hpp"
#include "truing/dynamics/recording.hpp"
#include "truing/model/effect.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// How torques are fitted.
struct TorqueOptions {
  /// Effects to fit. None: what is usual, the links' inertial parameters, armature, Coulomb and viscous friction, an
  /// offset.
  std::vector<EffectRequest> effects;
  std::vector<TorqueEffect> own_effects;  ///< known beside the catalogue
  /// Forms of laws that are not fitted, by effect and part: 'viscous_law.root'.
  std::vector<std::string> leave_out_forms;
  bool fit_inertials = true;  ///< the links' inertial parameters are fitted beside the effects
  double cutoff =
      kUsualCutoff;         ///< [Hz] of the low-pass without phase that both sides of the equation of motion go through
  double test_share = 0.3;  ///< fraction of the time held out when there is one recording, or none is marked as test
  int threads = 0;          ///< 0: as many as the machine has

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// Errors of a joint's torque, both sides low-passed.
struct TorqueError {
  std::string joint;     ///< its name
  double rms = 0.0;      ///< [Nm | N]
  double percent = 0.0;  ///< [%] of the measured torque's standard deviation
  double n = 0.0;        ///< number of rows
};

/// Errors of one model on the recordings that were held out, and on the others.
struct TorqueErrors {
  std::string model;                  ///< 'nominal', 'standard', 'named' or 'with_unknown'
  std::vector<TorqueError> held_out;  ///< joint by joint
  /// Joint by joint, of the held-out rows in which it moves: at rest friction is a history, and is not fitted.
  std::vector<TorqueError> in_motion;
  std::vector<TorqueError> train;  ///< joint by joint
};

/// What a fit of torques found.
struct TorqueFit {
  Robot robot;                        ///< with the inertial parameters and Robot::torque_effects that were found
  std::vector<Parameter> parameters;  ///< of the effects, with standard errors; 'link_inertia…': change from nominal
  Eigen::MatrixXd covariance;         ///< shape=(m, m): of the parameters that are not frozen, in their order
  std::vector<TorqueErrors> errors;   ///< 'nominal', 'standard' (what is usual), 'named' (what was asked for)
  double cutoff = 0.0;                ///< [Hz] of the low-pass
  std::vector<std::string>
      held_out;  ///< names of the recordings that were held out; of one recording: 'blocks of time'
  std::vector<NotTestable> not_testable;  ///< what the recordings could not show
  std::vector<std::string> warnings;      ///< what to know before trusting it
};

/// Torques of a recording as a robot predicts them.
struct TorquePrediction {
  Eigen::VectorXd time;     ///< shape=(n,) [s] as recorded
  Eigen::MatrixXd torque;   ///< shape=(n, joints) [Nm | N]
  Eigen::MatrixXd current;  ///< shape=(n, joints) [A] of drives whose torque per ampere is known, else NaN
  double cutoff = 0.0;      ///< [Hz] of the low-pass that the angles went through for their derivatives
};

namespace dynamics {

/// Finds inertial parameters and the effects asked for from recordings with torques or currents. Throws
/// std::invalid_argument on recordings or options that cannot be used.
TorqueFit identify(const Robot& robot, const std::vector<Recording>& recordings, const TorqueOptions& options = {});

/// Torques of every row of a recording: links, rotors, and the effects that the robot carries. Angles are low-passed at
/// `cutoff` [Hz] for their derivatives; none: at the highest frequency that the robot's effects were fitted on, or at
/// kUsualCutoff. Throws std::invalid_argument on a recording that cannot be used.
TorquePrediction predict(const Robot& robot, const Recording& recording, std::optional<double> cutoff = {},
                         const std::vector<TorqueEffect>& own_effects = {});

}  // namespace dynamics
}  // namespace truing
