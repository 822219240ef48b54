// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "truing/version.hpp"

namespace truing {

/// How a joint's link values are read.
enum class Convention {
  dh,    ///< Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta): Denavit-Hartenberg, distal
  mdh,   ///< Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d): modified DH (Craig), proximal
  urdf,  ///< T_parent_joint, then the motion about or along `axis`
};

enum class JointType { revolute, prismatic };

/// One joint and the link that belongs to it. Lengths in m, angles in rad, masses in kg.
///
/// A driven joint moves by `ratio * reading + offset`. A passive joint has no reading: it moves by the weighted
/// sum of the *corrected* motions of the joints in `driven_by` (a palletizer's q4 = -(q2 + q3)), so their ratios
/// and offsets act through it too. The motion adds to `theta` (revolute) or `d` (prismatic).
struct Joint {
  std::string name;                      ///< name, unique within the robot
  JointType type = JointType::revolute;  ///< the kind of motion
  double theta = 0.0;                    ///< [rad] the motion of a revolute joint adds to it
  double d = 0.0;                        ///< [m] the motion of a prismatic joint adds to it
  double a = 0.0;                        ///< [m] link length
  double alpha = 0.0;                    ///< [rad] link twist
  double beta = 0.0;                     ///< [rad] Hayati's twist about y, for near-parallel neighbouring axes
  Eigen::Isometry3d T_parent_joint = Eigen::Isometry3d::Identity();  ///< shape=(4, 4) [m], convention `urdf` only
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();                   ///< shape=(3,) unit vector, convention `urdf` only
  double ratio = 1.0;                                                ///< [-] gear-ratio correction
  double offset = 0.0;                                               ///< [rad | m] joint zero
  /// Pairs of driving joint and weight; empty: the joint has a reading.
  std::vector<std::pair<std::string, double>> driven_by;
  double lower = -std::numeric_limits<double>::infinity();   ///< [rad | m] lower limit, -inf if there is none
  double upper = std::numeric_limits<double>::infinity();    ///< [rad | m] upper limit, inf if there is none
  std::optional<double> mass;                                ///< [kg] of the link that this joint moves, if known
  Eigen::Vector3d center_of_mass = Eigen::Vector3d::Zero();  ///< shape=(3,) [m] in the frame after the link
  /// shape=(3, 3) [kg m^2] of the link about its centre of mass, in the axes of the frame after the link, if known
  std::optional<Eigen::Matrix3d> inertia;
  double rotor_inertia = 0.0;               ///< [kg m^2 | kg] of the motor's rotor, as the joint feels it
  std::optional<double> torque_per_ampere;  ///< [Nm/A | N/A] at the joint, of the drive, if known
  double speed_limit = std::numeric_limits<double>::infinity();   ///< [rad/s | m/s] inf if there is none
  double torque_limit = std::numeric_limits<double>::infinity();  ///< [Nm | N] inf if there is none

  bool passive() const { return !driven_by.empty(); }
};

/// A measured point (and orientation) on the last link.
struct Target {
  std::string name;  ///< name, unique within the robot
  /// shape=(4, 4) [m]: target in the frame after the last link.
  Eigen::Isometry3d T_last_target = Eigen::Isometry3d::Identity();
};

/// An effect with its fitted parameters, as `identify` found them, e.g. {"backlash", {"J3"}, {{"backlash.J3", 2e-4}}}.
struct AppliedEffect {
  std::string effect;                        ///< name, as in `catalogue()`
  std::vector<std::string> joints;           ///< names of the joints it acts on
  std::map<std::string, double> parameters;  ///< value by full name: {'backlash.J3': 2e-4}
};

/// The far end of a draw-wire or ballbar: reading = distance + zero.
struct Anchor {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< shape=(3,) [m] in the measurement frame
  double zero = 0.0;                                ///< [m] the length that the instrument leaves out
};

/// A robot model, nominal or calibrated: a plain value. `validate` says whether it can be used.
struct Robot {
  std::string name;                          ///< name of the model
  Convention convention = Convention::dh;    ///< how the links are read
  Eigen::Vector3d gravity{0.0, 0.0, -9.81};  ///< shape=(3,) [m/s^2] in the base frame
  /// shape=(4, 4) [m]: base in the measurement frame.
  Eigen::Isometry3d T_measurement_base = Eigen::Isometry3d::Identity();
  std::vector<Joint> joints;           ///< the joints in chain order
  std::vector<Target> targets;         ///< the targets, the tool first
  std::vector<AppliedEffect> effects;  ///< effects with their fitted parameters
  std::optional<Anchor> anchor;        ///< the far end of a draw-wire or ballbar, if there is one
  /// Smallest and largest value of the inputs that the effects were fitted on: 'q1' … [rad | m], 'qd1' … [rad/s | m/s],
  /// 'payload' [kg], 'temp' [deg C], and 'frequency' [Hz] of the motion and torques that effects on torques were fitted
  /// on. Beyond it nobody has seen what they do. Empty: not known.
  std::map<std::string, std::pair<double, double>> fitted_range;
  /// Effects on the torques of the joints with their parameters, as in `torque_catalogue()`: friction that the file
  /// states, and what `truing::dynamics` found.
  std::vector<AppliedEffect> torque_effects;

  /// Number of joints that have a reading.
  std::size_t driven_count() const;
  /// Index in `joints` of each driven joint, in chain order.
  std::vector<std::size_t> driven_joints() const;
  /// Index of the joint of that name; throws std::invalid_argument that lists the joints there are.
  std::size_t joint_index(const std::string& joint_name) const;
};

/// Throws std::invalid_argument, naming the joint and what is wrong, when the robot cannot be used: no joints,
/// duplicate or empty names, unknown or circular `driven_by`, values that are not finite, axis not of unit length,
/// lower > upper, an inertia that is not symmetric (principal moments may be anything), a negative rotor inertia,
/// limits of speed or torque that are not above zero, torque_per_ampere of zero.
void validate(const Robot& robot);

/// Roll-pitch-yaw as in URDF: R = Rz(yaw) Ry(pitch) Rx(roll). [rad]
Eigen::Matrix3d rotation_from_rpy(const Eigen::Vector3d& rpy);
/// The inverse of rotation_from_rpy; at pitch = +-pi/2 roll is set to 0. [rad]
Eigen::Vector3d rpy_from_rotation(const Eigen::Matrix3d& rotation);
Eigen::Isometry3d frame_from_xyz_rpy(const Eigen::Vector3d& xyz, const Eigen::Vector3d& rpy);

/// T_measurement_link of the frame after every joint, then T_measurement_target of target `target`: size n_joints + 1.
/// `reading`: driven joints in chain order [rad | m]. Effects are left out. The readable twin of the kernel: tests hold
/// them together.
std::vector<Eigen::Isometry3d> forward_kinematics(const Robot& robot, const Eigen::VectorXd& reading,
                                                  std::size_t target = 0);

}  // namespace truing
