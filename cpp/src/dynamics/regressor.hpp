// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The chain that the torque regressor runs over, compiled once.

#include <vector>

#include <Eigen/Core>

#include "rooms.hpp"
#include "truing/dynamics/regressor.hpp"
#include "truing/model/robot.hpp"

namespace truing::dynamics {

/// What of a robot the regressor needs, made once.
class RigidChain {
 public:
  explicit RigidChain(const Robot& robot);

  Eigen::Index links() const { return static_cast<Eigen::Index>(links_.size()); }
  Eigen::Index driven() const { return coupling_.cols(); }

  /// Y of one sample, shape=(driven, 10 * links): readings, their speeds and accelerations [rad | m, s].
  void regressor(const double* q, const double* qd, const double* qdd, Eigen::Ref<Eigen::MatrixXd> Y) const;

 private:
  struct Link {
    Eigen::Isometry3d before, after;  ///< the fixed parts: T = before * motion * after
    Eigen::Vector3d axis;
    bool revolute;
  };
  std::vector<Link> links_;
  Eigen::MatrixXd coupling_;  ///< shape=(links, driven): motion of every joint for a reading's change of one
  Eigen::VectorXd zero_;      ///< motion of every joint at readings of zero [rad | m]
  Eigen::Vector3d gravity_;   ///< in the base's axes
};

}  // namespace truing::dynamics
