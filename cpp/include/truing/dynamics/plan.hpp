// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/common/not_testable.hpp"
#include "truing/dynamics/effect.hpp"
#include "truing/dynamics/recording.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// Which motions to plan, within which limits, and what will be recorded along them.
struct TorquePlanOptions {
  double duration = 40.0;     ///< [s] of the motion
  double rate = 100.0;        ///< [Hz] of its rows
  double speed = 0.8;         ///< fraction of the joints' speed limits that is used
  double usual_speed = 1.5;   ///< [rad/s | m/s] speed limit of joints that state none
  double acceleration = 5.0;  ///< [rad/s^2 | m/s^2] largest acceleration of a joint
  double reach = 1.5;         ///< [rad | m] farthest to either side of `home`, within 95 % of the joint's range
  std::vector<double> home;   ///< [rad | m] around which the joints move; none: the middle of their limits, or zero
  /// What is recorded beside joints and torques: 'current' (torques are drives' currents), 'torque' (they are
  /// sensors'), 'payload' (a known one, in half of the recordings), 'temp'.
  std::vector<std::string> columns;
  double payload = 2.0;                   ///< [kg] at the tool in half of the recordings, if 'payload' is recorded
  double temperature_low = 20.0;          ///< [deg C] of cold recordings, if 'temp' is recorded
  double temperature_high = 35.0;         ///< [deg C] of warm ones
  std::vector<EffectRequest> separate;    ///< effects to be told from each other; none: all effects count alike
  std::vector<TorqueEffect> own_effects;  ///< known beside the catalogue
  /// Standard deviation of the torques' noise, as a fraction of that of the torque along a random motion (of a joint
  /// with little torque: of 5 % of the largest joint's).
  double noise = 0.02;
  std::vector<double> torque_noise;  ///< [Nm | N] of every joint, instead of `noise`
  double noise_time = 0.2;           ///< [s] correlation time of the noise
  double cutoff = kUsualCutoff;      ///< [Hz] of the low-pass that a diagnosis will use
  double alike = 0.98;               ///< an effect of which another explains a larger fraction is not told from it
  int starts = 12;                   ///< random motions, the best of which is refined
  int rounds = 24;                   ///< of refinement, four proposals each
  std::uint64_t seed = 0;            ///< of all random choices
  int threads = 0;                   ///< 0: as many as the machine has

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// The smallest size of an effect that motions would show.
struct TorqueEffectSize {
  std::string effect;               ///< its name
  std::vector<std::string> joints;  ///< where; empty: it belongs to no joint
  std::string parameter;            ///< the one of its parameters that shows best
  std::string unit;                 ///< of `size`
  double size = 0.0;                ///< in `unit`: seen beside inertias, Coulomb and viscous friction, and an offset
  std::string joint;                ///< the joint at whose torque it shows most
  double torque = 0.0;              ///< [Nm | N] rms of its torque there at this size
  /// In `unit`: told from the effect that is most like it; NaN: never.
  double size_apart = std::numeric_limits<double>::quiet_NaN();
  std::string closest;                      ///< that effect, 'none' where no other shows
  std::vector<std::string> closest_joints;  ///< where that is
  double r2 = 0.0;                          ///< fraction of its torque that that one explains
};

/// Two effects that motions do not tell apart.
struct TorqueEffectPair {
  std::string effect;                     ///< the first
  std::vector<std::string> joints;        ///< where
  std::string other;                      ///< the other
  std::vector<std::string> other_joints;  ///< where the other is
  double r2 = 0.0;                        ///< fraction of the first's torque that the other explains
  std::string separated_by;               ///< what to record to tell
};

/// What motions could show, before any torque is measured.
struct TorqueOutlook {
  std::vector<TorqueEffectSize> effects;  ///< the smallest sizes, by effect and joint
  std::vector<TorqueEffectPair> alike;    ///< not told apart, largest r2 first
  std::vector<NotTestable> not_testable;  ///< effects that would not show, and why
};

/// One recording to make.
struct TorqueRun {
  double payload = 0.0;                                           ///< [kg] at the tool
  double temperature = std::numeric_limits<double>::quiet_NaN();  ///< [deg C] of the joints; NaN: any
};

/// What `truing::dynamics::plan` found.
struct TorquePlan {
  Eigen::VectorXd time;                     ///< shape=(n,) [s]
  Eigen::MatrixXd position;                 ///< shape=(n, joints) [rad | m]
  Eigen::MatrixXd speed;                    ///< shape=(n, joints) [rad/s | m/s]
  Eigen::MatrixXd acceleration;             ///< shape=(n, joints) [rad/s^2 | m/s^2]
  std::vector<TorqueRun> runs;              ///< recordings to make, each along the whole motion
  TorqueOutlook planned;                    ///< what these recordings would show
  TorqueOutlook random;                     ///< what recordings along a random motion as long would show
  TorqueOutlook given;                      ///< what the recordings that were given can show
  std::vector<TorqueEffectPair> separated;  ///< pairs that were to be told apart, along the planned motion
  double information_random = 0.0;          ///< [nats] along the random motion (Chaloner and Verdinelli 1995)
  double information = 0.0;                 ///< [nats] along the planned motion
  int evaluated = 0;                        ///< number of motions looked at
  std::vector<double> torque_noise;         ///< [Nm | N] of every joint that sizes are for
  std::vector<std::string> warnings;        ///< what to know before moving
};

namespace dynamics {

/// A motion that tells effects on torques apart: Fourier trajectories, then slow reversals, within the joints' limits.
/// Of random ones the best is refined; what counts is the information on all effects of the catalogue (Bayesian
/// D-optimality), or on the difference of those to be told apart.
///
/// `recordings`: looked at as well, for what they can show; their torques are not used. Throws std::invalid_argument:
/// options, names or recordings that cannot be used, a robot without masses, a joint without room to move.
TorquePlan plan(const Robot& robot, const TorquePlanOptions& options = {},
                const std::vector<Recording>& recordings = {});

}  // namespace dynamics
}  // namespace truing
