// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "truing/model/robot.hpp"

namespace truing::dynamics {

// Torques of the rigid chain are linear in what its links weigh: tau = Y(q, qd, qdd) pi (Atkeson, An and Hollerbach
// 1986, Estimation of inertial parameters of manipulator loads and links).

/// Of a link: mass, mass times centre of mass (3), inertia about the origin of the frame after the link (xx, yy, zz,
/// xy, xz, yz), in that frame's axes.
constexpr Eigen::Index kLinkParameters = 10;
using LinkParameters = Eigen::Matrix<double, kLinkParameters, 1>;

/// Of a joint's link as the robot has it [kg, kg m, kg m^2]; what is not known is zero.
LinkParameters link_parameters(const Joint& joint);
/// The other way: sets mass, centre of mass and inertia. Throws std::invalid_argument on a first moment without a mass,
/// which no centre of mass can hold.
void set_link_parameters(const LinkParameters& parameters, Joint* joint);
/// Of all links one after the other: shape=(10 * joints,).
Eigen::VectorXd link_parameters(const Robot& robot);

/// Y of every sample, one below the other: shape=(n * driven joints, 10 * joints), so that Y times `link_parameters`
/// is what the drives must give against inertia and gravity. Passive joints pass on what they feel to the joints that
/// drive them; rotors are no part of it. `q`, `qd`, `qdd`: shape=(n, driven joints) [rad | m, s]. Throws
/// std::invalid_argument: a robot that `validate` refuses, another shape, values that are not finite.
Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> torque_regressor(const Robot& robot,
                                                                                        const Eigen::MatrixXd& q,
                                                                                        const Eigen::MatrixXd& qd,
                                                                                        const Eigen::MatrixXd& qdd);

}  // namespace truing::dynamics
