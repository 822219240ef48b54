// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What fits of torques of very many rows, or of many robots, are made of: normal equations of stretches of recordings,
// joint by joint. They are added to those of others, and everything else is then decided without any row.

#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/dynamics/recording.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// How torques are summed.
struct TorqueSumOptions {
  double cutoff =
      kUsualCutoff;       ///< [Hz] of the low-pass without phase that both sides of the equation of motion go through
  double shortest = 2.0;  ///< [s] a recording is cut into blocks of equal time that are no shorter
  int most_blocks = 100;  ///< and no more than these
  int threads = 1;        ///< 0: as many as the machine has

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// What a joint's torque may be a sum of.
struct TorqueColumns {
  std::vector<std::string> names;          ///< of the parameters: link_inertia.J2.m, armature.J2, coulomb.J2 …
  std::vector<std::string> units;          ///< of these
  std::vector<double> prior;               ///< size that each may well have; of inertias alone it says something
  std::vector<std::string> joints;         ///< names of the joints that have a reading
  std::vector<std::vector<int>> of_joint;  ///< by joint: numbers of the parameters that its torque knows, ascending
};

/// Normal equations of one joint's torque over the rows of a block in which the joint moves. What is explained is the
/// measured torque less the nominal model's [Nm | N]; behind the columns of the parameters the nominal torque itself
/// is one more.
struct TorqueBlock {
  Eigen::MatrixXd gram;   ///< shape=(p + 1, p + 1): X^T X
  Eigen::VectorXd right;  ///< shape=(p + 1,): X^T y
  double squares = 0.0;   ///< y^T y
  double rows = 0.0;      ///< how many; 0: the joint was at rest, or not measured
};

namespace dynamics {

/// The parameters that torques are summed for: inertial ones of the links, and of every joint armature, Coulomb and
/// viscous friction and an offset. They depend on the robot alone. Throws std::invalid_argument: a robot that cannot be
/// used, no link has a mass.
TorqueColumns torque_columns(const Robot& robot);

/// Sums a recording, block after block in order of time and in each joint after joint: shape=(blocks * joints,). Of one
/// that is read (Recording::read) no more than a stretch is in memory. A known payload is part of the nominal torque.
/// The same bits for any number of threads. Throws std::invalid_argument on a recording or options that cannot be used.
std::vector<TorqueBlock> sum_torques(const Robot& robot, const Recording& recording,
                                     const TorqueSumOptions& options = {});

/// Values of all parameters with inertias that bodies can have, nearest to the solution of gram * values = right (shape
/// =(p, p), (p,), of the parameters of `torque_columns`; the sum of squares is in units of the noise). Throws
/// std::invalid_argument on other shapes.
Eigen::VectorXd torques_of_bodies(const Robot& robot, const Eigen::MatrixXd& gram, const Eigen::VectorXd& right);

/// The robot with these values of all parameters of `torque_columns` added to what it has. Throws
/// std::invalid_argument on another shape.
Robot robot_with_torques(const Robot& robot, const Eigen::VectorXd& values);

}  // namespace dynamics
}  // namespace truing
