// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What a robot, with its rotors and the effects that it carries, needs of torque along a motion.

#include <cstdint>
#include <memory>
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

/// Make Motion::inertia, of Motion::bodies, and Motion::yielding, with which Motion::inertia is found where it is
/// wanted.
void fill_inertia(Motion* motion);
void fill_yielding(Motion* motion, bool with_inertia);
/// And Motion::rigid: they are large, and soon made again.
void clear_tables(Motion* motion);

/// What is known of a motion's torques.
struct KnownTorque {
  std::uint64_t of = 0;        ///< number that models share which differ in how friction turns alone …
  Eigen::MatrixXd undirected;  ///< … and torques of theirs that neither look at the direction nor ask for the torque
  std::uint64_t seen = 0;      ///< TorqueModel::number() of the one whose torque Motion::torque is
};

/// A robot's torques with the payload that the recording states, and a correction beside them.
class TorqueModel {
 public:
  TorqueModel(const Robot& robot, std::vector<ValuedTerm> own);

  /// The same with more terms.
  TorqueModel with(const std::vector<ValuedTerm>& more) const;

  /// The same with friction that turns so.
  TorqueModel turning(const std::vector<FrictionTurn>& turns) const;

  /// The same, whose terms that ask for the torque see that of `other`.
  TorqueModel seeing(const TorqueModel& other) const;

  /// Torques of every row [Nm | N], shape=(rows, joints). Sets Motion::direction to what this robot's friction knows of
  /// it, and Motion::torque to what the terms that ask for it see: the torques of all others.
  Eigen::MatrixXd torque(Motion* motion) const;
  /// The same where Motion::direction is set already. `known`: of this motion, from before and for the next time.
  Eigen::MatrixXd torque_by_direction(Motion* motion, KnownTorque* known = nullptr) const;

  const std::vector<FrictionTurn>& turns() const { return turns_; }
  /// Models of one number have the same torques.
  std::uint64_t number() const { return number_; }

  /// A term may look at Motion::rigid.
  bool needs_rigid() const;

  const Robot& robot() const { return robot_; }

 private:
  /// Sets Motion::bodies and Motion::carried to this model's.
  void carry(Motion* motion) const;
  /// Of all but the terms that ask for the torque, by Motion::direction.
  Eigen::MatrixXd torque_of_others(Motion* motion, KnownTorque* known = nullptr) const;
  /// Of these the links, the rotors and the terms that do not look at the direction.
  Eigen::MatrixXd undirected_torque(const Motion& motion) const;
  void add(std::vector<ValuedTerm> more);
  bool any(bool TorqueTerm::* needs) const;

  Robot robot_;
  RigidChain chain_;
  Eigen::VectorXd links_;          ///< inertial parameters, those of the terms among them
  Eigen::MatrixXd rotors_;         ///< mass matrix of the rotors
  std::vector<ValuedTerm> terms_;  ///< the others
  std::vector<FrictionTurn> turns_;
  std::shared_ptr<const TorqueModel> seen_;  ///< null: itself
  std::uint64_t number_;
  std::uint64_t undirected_number_ = number_;  ///< models that differ in how friction turns alone share it
};

}  // namespace truing::dynamics
