// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Torques of the rigid chain, linear in the links' inertial parameters: tau = Y(q, qd, qdd) pi (Atkeson, An and
// Hollerbach 1986).

#include <vector>

#include <Eigen/Core>

#include "rooms.hpp"
#include "truing/model/robot.hpp"

namespace truing::dynamics {

/// Of a link: mass, mass times centre of mass (3), inertia about the origin of the frame after the link (xx, yy, zz,
/// xy, xz, yz), in that frame's axes.
constexpr Eigen::Index kLinkParameters = 10;
using LinkParameters = Eigen::Matrix<double, kLinkParameters, 1>;

/// Of a joint's link as the robot has it; what is not known is zero.
LinkParameters link_parameters(const Joint& joint);
/// The other way: sets mass, centre of mass and inertia.
void set_link_parameters(const LinkParameters& parameters, Joint* joint);
/// Of all links one after the other: shape=(10 * joints,).
Eigen::VectorXd link_parameters(const Robot& robot);

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
