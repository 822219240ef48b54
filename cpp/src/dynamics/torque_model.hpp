// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a robot, with its rotors and the effects that it carries, needs of torque along a motion.

#include <vector>

#include "dynamics/regressor.hpp"
#include "rooms.hpp"
#include "truing/dynamics/effect.hpp"

namespace truing::dynamics {

/// A term with the value of its parameter.
struct ValuedTerm {
  TorqueTerm term;
  double value = 0.0;
};

/// The terms of the effects that the robot carries. Throws as terms_of.
std::vector<ValuedTerm> valued_terms(const Robot& robot, const MotionRange& range,
                                     const std::vector<TorqueEffect>& own);

/// Adds value * basis of every term that needs (or does not need) Motion::torque to `torque`, shape=(rows, joints).
void add_terms(const std::vector<ValuedTerm>& terms, bool that_need_torque, const Motion& motion,
               Eigen::MatrixXd* torque);

/// A robot's torques with the payload that the recording states, and a correction beside them.
class TorqueModel {
 public:
  TorqueModel(const Robot& robot, std::vector<ValuedTerm> own);

  /// The same with more terms.
  TorqueModel with(const std::vector<ValuedTerm>& more) const;

  /// Torques of every row [Nm | N], shape=(rows, joints). Sets Motion::torque to what the terms that ask for it see:
  /// the torques of all others.
  Eigen::MatrixXd torque(Motion* motion) const;

  const Robot& robot() const { return robot_; }

 private:
  Robot robot_;
  Eigen::VectorXd links_;   ///< inertial parameters
  Eigen::MatrixXd rotors_;  ///< mass matrix of the rotors
  std::vector<ValuedTerm> terms_;
};

}  // namespace truing::dynamics
