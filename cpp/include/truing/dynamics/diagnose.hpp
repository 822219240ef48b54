// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "truing/diagnose.hpp"
#include "truing/dynamics/identify.hpp"

namespace truing {

/// How a gap of torques is diagnosed.
struct TorqueDiagnoseOptions {
  std::vector<TorqueEffect> own_effects;  ///< take part beside the catalogue
  std::vector<std::string> leave_out;     ///< effects that are not to be considered, by name
  double cutoff =
      kUsualCutoff;         ///< [Hz] of the low-pass without phase that both sides of the equation of motion go through
  double test_share = 0.3;  ///< fraction of the time held out when there is one recording, or none is marked as test
  int max_effects = 40;     ///< maximum number of effects named
  double least_gain = 0.01;  ///< [-] fraction of a joint's squared error on unseen recordings that a name must remove
  int threads = 0;           ///< 0: as many as the machine has

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// An effect that explains torques as well as the one named.
struct TorqueAlternative {
  std::string effect;               ///< its name
  std::vector<std::string> joints;  ///< where
  double probability = 0.0;         ///< its part of the class's posterior probability
};

/// An effect on the torques that `diagnose` named.
struct FoundTorqueEffect {
  std::string effect;                     ///< its name, as in `torque_catalogue()`
  std::vector<std::string> joints;        ///< where; of a coupling the joint that is moved first, the acting one second
  bool standard = false;                  ///< what everybody fits: inertial parameters, Coulomb, viscous, an offset
  double probability = 0.0;               ///< posterior of the class: this effect or one of `confounded_with`
  std::map<std::string, double> grounds;  ///< what that was worked out from, as in `FoundEffect`
  std::vector<Parameter> parameters;      ///< values and standard errors, constants of its law among them
  double rms = 0.0;                       ///< [Nm | N] of its torque
  /// Fraction of the squared error that standard practice leaves (of a standard one: that the nominal model leaves)
  /// that it removes, all others in, on recordings that were not fitted; over all joints, each by its noise.
  Share share;
  std::vector<TorqueAlternative> confounded_with;  ///< effects that would explain these recordings as well
  std::string plain;                               ///< what it is in plain words, without the joints
  std::string sentence;                            ///< what it is, where, and how large
};

/// A part of the torques that goes with an input, and that no effect of the catalogue explains.
struct UnknownTorque {
  std::string joint;  ///< its name
  /// 'angle', 'angle J2' (another joint's), 'speed', 'load', 'time', 'direction' or a column; 'its past' after 'load'
  /// where the load is remembered.
  std::vector<std::string> inputs;
  double probability = 0.0;  ///< posterior that there is such a thing
  Share share;               ///< as that of an effect
  double rms = 0.0;          ///< [Nm | N] of its torque
  std::vector<std::array<double, 3>>
      curve;  ///< shape=(n, 3): input, torque, standard error [Nm | N]; empty where its past counts
};

/// How much of the gap lies in one part of the motion.
struct TorqueRegime {
  std::string joint;      ///< its name
  std::string input;      ///< 'speed', 'direction', 'acceleration', 'load', 'time', 'temperature', 'angle'
  double low = 0.0;       ///< of the input: lower end
  double high = 0.0;      ///< of the input: upper end
  double standard = 0.0;  ///< [Nm | N] rms error that standard practice leaves there
  double named = 0.0;     ///< [Nm | N] rms error that is left with what was named
  double n = 0.0;         ///< number of rows
};

/// Waves of the torque that are left and repeat with the turn of a joint, so often that something turns faster behind
/// it: its motor (as often as the gear reduces), the wave generator of a harmonic drive (twice as often), teeth.
struct TorqueOrder {
  std::string joint;            ///< its name
  double order = 0.0;           ///< waves in a turn of the joint, to half of one
  bool with_direction = false;  ///< they change their sign with the direction of motion, as friction does
  double amplitude = 0.0;       ///< [Nm] of the waves, low-passed
  double share = 0.0;           ///< of the squares that what was named leaves at this joint while it moves
};

/// What cannot be told apart from these recordings.
struct TorqueClass {
  std::vector<std::string> effects;  ///< 'motor_constant:J2', 'payload' …
  std::string sentence;              ///< in words, with what to record to tell
};

/// A stretch of a held-out recording, to look at.
struct TorqueTrace {
  std::string recording;         ///< its name
  std::string joint;             ///< its name
  std::vector<double> time;      ///< shape=(n,) [s]
  std::vector<double> measured;  ///< shape=(n,) [Nm | N]
  std::vector<double> nominal;   ///< shape=(n,) [Nm | N]
  std::vector<double> standard;  ///< shape=(n,) [Nm | N]
  std::vector<double> named;     ///< shape=(n,) [Nm | N]
};

/// What `truing::dynamics::diagnose` found.
struct TorqueDiagnosis {
  Verdict verdict = Verdict::none;  ///< whether there is a gap beyond standard practice, and whether names explain it
  std::string sentence;             ///< the verdict in words
  /// Beyond standard practice, by share: what `identify` would not have fitted unasked and is likelier than not, then
  /// the others; then what is standard.
  std::vector<FoundTorqueEffect> effects;
  Eigen::MatrixXd covariance;  ///< shape=(m, m): of the effects' parameters that are not frozen, one after the other
  std::vector<UnknownTorque> unknown;  ///< what no effect explains
  /// Joints at which 'with_unknown' has a little of every other effect beside what was named, for folds gain by it:
  /// what is left there is no noise, but small causes or other laws that cannot be told apart.
  std::vector<std::string> remainders;
  std::vector<TorqueErrors> errors;       ///< 'nominal', 'standard', 'named', 'with_unknown'
  double without_names = 0.0;             ///< [%] held-out error, geometric mean over the joints, that names start from
  std::vector<TorqueRegime> where;        ///< the gap by joint and part of the motion
  std::vector<TorqueOrder> orders;        ///< what is left and repeats many times a turn
  std::vector<TorqueClass> classes;       ///< what cannot be told apart
  std::vector<NotTestable> not_testable;  ///< what the recordings could not show
  std::vector<TorqueTrace> traces;        ///< a held-out stretch of every joint
  double cutoff = 0.0;                    ///< [Hz] of the low-pass
  std::vector<double> design_effect;      ///< shape=(joints,): rows that count as one
  std::vector<std::string>
      held_out;  ///< names of the recordings that were held out; of one recording: 'blocks of time'
  Robot robot;   ///< with what was named
  std::vector<std::string> warnings;  ///< what to know before trusting it
};

namespace dynamics {

/// Which effects stand between a robot's model and the torques that it was recorded with.
///
/// Inertial parameters, Coulomb and viscous friction and an offset are the groundwork, unless the robot is one that was
/// fitted before; then everything is a departure from it. Every effect of the catalogue at every joint competes; what
/// is named predicts recordings that were not fitted. Throws std::invalid_argument on recordings or options that cannot
/// be used.
TorqueDiagnosis diagnose(const Robot& robot, const std::vector<Recording>& recordings,
                         const TorqueDiagnoseOptions& options = {});

}  // namespace dynamics
}  // namespace truing
