// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/model/robot.hpp"

#include <cmath>
#include <set>
#include <stdexcept>

#include "math/text.hpp"
#include "model/motion.hpp"
#include "rooms.hpp"

namespace truing {
using namespace model;

namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

Isometry3d rotation_about(const Vector3d& axis, double angle) { return Isometry3d(AngleAxisd(angle, axis)); }

Isometry3d shift_along(const Vector3d& axis, double length) {
  Isometry3d T = Isometry3d::Identity();
  T.translation() = length * axis;
  return T;
}

Isometry3d Rx(double angle) { return rotation_about(Vector3d::UnitX(), angle); }
Isometry3d Ry(double angle) { return rotation_about(Vector3d::UnitY(), angle); }
Isometry3d Rz(double angle) { return rotation_about(Vector3d::UnitZ(), angle); }
Isometry3d Tx(double length) { return shift_along(Vector3d::UnitX(), length); }
Isometry3d Tz(double length) { return shift_along(Vector3d::UnitZ(), length); }

// Denavit and Hartenberg 1955; beta is the fifth value of Hayati 1983: two neighbouring axes that are
// parallel leave d without meaning, a twist about y says in its place how far from parallel they are.
Isometry3d dh_frame(double theta, double d, double a, double alpha, double beta) {
  return Rz(theta) * Tz(d) * Tx(a) * Rx(alpha) * Ry(beta);
}

// Craig, Introduction to Robotics, 1986, eq. 3.6, with the same twist before the joint.
Isometry3d mdh_frame(double theta, double d, double a, double alpha, double beta) {
  return Rx(alpha) * Tx(a) * Ry(beta) * Rz(theta) * Tz(d);
}

Isometry3d urdf_frame(const Joint& joint, double motion) {
  return joint.T_parent_joint *
         (joint.type == JointType::revolute ? rotation_about(joint.axis, motion) : shift_along(joint.axis, motion));
}

// From the frame before a joint to the frame after its link.
Isometry3d joint_frame(Convention convention, const Joint& joint, double motion) {
  const double theta = joint.theta + (joint.type == JointType::revolute ? motion : 0.0);
  const double d = joint.d + (joint.type == JointType::prismatic ? motion : 0.0);
  switch (convention) {
    case Convention::dh:
      return dh_frame(theta, d, joint.a, joint.alpha, joint.beta);
    case Convention::mdh:
      return mdh_frame(theta, d, joint.a, joint.alpha, joint.beta);
    case Convention::urdf:
      return urdf_frame(joint, motion);
  }
  throw std::invalid_argument("unknown convention");
}

// A robot without targets has the frame after its last link for a tool.
Isometry3d target_frame(const Robot& robot, std::size_t target) {
  if (target < robot.targets.size()) return robot.targets[target].T_last_target;
  if (target == 0) return Isometry3d::Identity();
  throw std::invalid_argument("target " + std::to_string(target) + " does not exist; the robot has " +
                              std::to_string(robot.targets.size()) + " targets, counted from 0");
}

std::string joint_names(const Robot& robot) {
  std::vector<std::string> names;
  for (const Joint& joint : robot.joints) names.push_back(joint.name);
  return listed(names);
}

// Passive joints follow their drivers' corrected motions. Every joint is computed once, after those that drive it:
// following each path anew would take 2^n steps where each joint is driven by the two before it.
enum class Visit { waiting, entered, done };

void visit_drivers(const Robot& robot, std::size_t index, std::vector<Visit>* state, std::vector<std::size_t>* order) {
  Visit& own = (*state)[index];
  if (own == Visit::done) return;
  if (own == Visit::entered) {
    throw std::invalid_argument("joint '" + robot.joints[index].name + "': driven_by goes round in a circle");
  }
  own = Visit::entered;
  for (const auto& driver : robot.joints[index].driven_by) {
    visit_drivers(robot, robot.joint_index(driver.first), state, order);
  }
  own = Visit::done;
  order->push_back(index);
}

std::vector<std::size_t> drivers_first(const Robot& robot) {
  std::vector<Visit> state(robot.joints.size(), Visit::waiting);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) visit_drivers(robot, i, &state, &order);
  return order;
}

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw std::invalid_argument(where + ": " + what);
}

void require_finite(const std::string& where, const char* name, double value) {
  if (!std::isfinite(value)) refuse(where, std::string(name) + " is " + number(value) + ", expected a finite number");
}

// Beyond any machine, and far within what products of a few values can hold. The kernel's sine takes no larger angles.
constexpr double kLargestNumber = 1e6;
constexpr std::size_t kMostJoints = 200;

/// False of a number that is none, too.
bool is_bounded(const Eigen::Vector3d& v) { return (v.array().abs() <= kLargestNumber).all(); }

void require_usable(const std::string& where, const char* name, double value) {
  require_finite(where, name, value);
  if (std::abs(value) <= kLargestNumber) return;
  refuse(where, std::string(name) + " is " + number(value) + ", expected a value between -1e6 and 1e6 (m, rad, kg, N)");
}

void require_frame(const std::string& where, const char* name, const Isometry3d& T) {
  if (!T.matrix().allFinite()) refuse(where, std::string(name) + " has a value that is not finite");
  if (!is_bounded(T.translation())) refuse(where, std::string(name) + " is farther than 1e6 m");
  const Eigen::Matrix3d R = T.linear();
  const bool is_rotation = (R.transpose() * R).isIdentity(1e-6) && R.determinant() > 0.0;
  const bool is_rigid = (T.matrix().row(3) - Eigen::RowVector4d::Unit(3)).isZero(1e-12);
  if (!is_rotation || !is_rigid) {
    refuse(where,
           std::string(name) + " is not a rigid transform: its rotation part must be orthonormal and right-handed");
  }
}

// Published URDFs state inertias that no body has (principal moments below zero, or beyond the triangle's inequality):
// such a robot can be used all the same, and what is exported of it is made consistent.
void validate_inertia(const std::string& where, const Eigen::Matrix3d& inertia) {
  if (!(inertia.array().abs() <= kLargestNumber * kLargestNumber).all())
    refuse(where, "inertia has a value that is not finite, or beyond 1e12 kg m^2");
  if ((inertia - inertia.transpose()).cwiseAbs().maxCoeff() > 1e-9 * inertia.cwiseAbs().maxCoeff())
    refuse(where, "inertia is not symmetric");
}

void require_limit(const std::string& where, const char* name, double value) {
  if (value > 0.0 && (value <= kLargestNumber || std::isinf(value))) return;  // of NaN too this is false
  refuse(where, std::string(name) + " is " + number(value) + ", expected more than zero, or inf for none");
}

void validate_drive(const std::string& where, const Joint& joint) {
  require_usable(where, "rotor_inertia", joint.rotor_inertia);
  if (joint.rotor_inertia < 0.0)
    refuse(where, "rotor_inertia is " + number(joint.rotor_inertia) + ", expected zero or more");
  if (joint.torque_per_ampere) {
    require_usable(where, "torque_per_ampere", *joint.torque_per_ampere);
    if (*joint.torque_per_ampere == 0.0)
      refuse(where, "torque_per_ampere is 0: leave it out if it is not known; negative where the current's sign is");
  }
  require_limit(where, "speed_limit", joint.speed_limit);
  require_limit(where, "torque_limit", joint.torque_limit);
}

void validate_joint(const Joint& joint, Convention convention) {
  const std::string where = "joint '" + joint.name + "'";
  require_usable(where, "theta", joint.theta);
  require_usable(where, "d", joint.d);
  require_usable(where, "a", joint.a);
  require_usable(where, "alpha", joint.alpha);
  require_usable(where, "beta", joint.beta);
  require_usable(where, "ratio", joint.ratio);
  require_usable(where, "offset", joint.offset);
  if (convention == Convention::urdf) {
    require_frame(where, "T_parent_joint", joint.T_parent_joint);
    const double length = joint.axis.norm();
    if (!(std::abs(length - 1.0) <= 1e-9)) {
      refuse(where, "axis has length " + number(length, 12) + ", expected a unit vector: divide it by its length");
    }
  }
  for (const auto& [driver, weight] : joint.driven_by) {
    require_usable(where, ("weight of '" + driver + "' in driven_by").c_str(), weight);
  }
  if (std::isnan(joint.lower) || std::isnan(joint.upper)) refuse(where, "a limit is not a number");
  if (joint.lower > joint.upper) {
    refuse(where, "lower limit " + number(joint.lower) + " is above upper limit " + number(joint.upper));
  }
  if (joint.mass) {
    require_usable(where, "mass", *joint.mass);
    if (*joint.mass < 0.0) refuse(where, "mass is " + number(*joint.mass) + " kg, expected zero or more");
  }
  if (!is_bounded(joint.center_of_mass))
    refuse(where, "center_of_mass has a value that is not finite, or beyond 1e6 m");
  if (joint.inertia) validate_inertia(where, *joint.inertia);
  validate_drive(where, joint);
}

// Parameters are named after joints and targets (`J2.a`, `tool.x`, `base.rz`, `anchor.zero`), so these names
// must differ.
void validate_names(const Robot& robot) {
  std::set<std::string> taken;
  const auto take = [&taken](const std::string& kind, std::size_t number_from_1, const std::string& name) {
    if (name.empty()) refuse(kind + " " + std::to_string(number_from_1), "has no name");
    if (name == "base" || name == "anchor") {
      refuse(kind + " '" + name + "'", "this name is kept for parameters such as base.x and anchor.zero: rename it");
    }
    if (!taken.insert(name).second) refuse(kind + " '" + name + "'", "this name is used twice: rename one");
  };
  for (std::size_t i = 0; i < robot.joints.size(); ++i) take("joint", i + 1, robot.joints[i].name);
  for (std::size_t i = 0; i < robot.targets.size(); ++i) take("target", i + 1, robot.targets[i].name);
}

// Depth first along `driven_by`; `path` is how we came here, `done` the joints known to be sound.
void validate_drivers(const Robot& robot, std::size_t index, std::vector<std::string> path, std::vector<bool>& done) {
  const Joint& joint = robot.joints[index];
  const std::string where = "joint '" + joint.name + "'";
  for (const std::string& earlier : path) {
    if (earlier == joint.name) {
      path.push_back(joint.name);
      refuse(where, "driven_by goes round in a circle (" + listed(path) + "); one of them must have a reading");
    }
  }
  if (done[index]) return;
  path.push_back(joint.name);
  for (const auto& driver : joint.driven_by) {
    bool known = false;
    for (std::size_t i = 0; i < robot.joints.size(); ++i) {
      if (robot.joints[i].name != driver.first) continue;
      known = true;
      validate_drivers(robot, i, path, done);
    }
    if (!known) refuse(where, "driven_by names '" + driver.first + "', but the joints are " + joint_names(robot));
  }
  done[index] = true;
}

void validate_effects(const Robot& robot) {
  for (const AppliedEffect& applied : robot.effects) {
    const std::string where = "effect '" + applied.effect + "'";
    if (applied.effect.empty()) refuse("effects", "one has no name");
    for (const std::string& joint : applied.joints) {
      bool known = false;
      for (const Joint& other : robot.joints) known = known || other.name == joint;
      if (!known) refuse(where, "joint '" + joint + "' does not exist; the joints are " + joint_names(robot));
    }
    for (const auto& [name, value] : applied.parameters) require_finite(where, name.c_str(), value);
  }
}

// Whether an effect has such parameters and acts at such joints is known where its law is.
void validate_torque_effects(const Robot& robot) {
  for (const AppliedEffect& applied : robot.torque_effects) {
    if (applied.effect.empty()) refuse("torque_effects", "one has no name");
    const std::string where = "torque effect '" + applied.effect + "'";
    for (const auto& [name, value] : applied.parameters) require_usable(where, name.c_str(), value);
  }
}

}  // namespace

std::size_t Robot::driven_count() const { return driven_joints().size(); }

std::vector<std::size_t> Robot::driven_joints() const {
  std::vector<std::size_t> driven;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (!joints[i].passive()) driven.push_back(i);
  }
  return driven;
}

std::size_t Robot::joint_index(const std::string& joint_name) const {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].name == joint_name) return i;
  }
  throw std::invalid_argument("joint '" + joint_name + "' does not exist; the joints are " + joint_names(*this));
}

/// A name that Robot::fitted_range may have.
static bool is_input(const std::string& name, const Robot& robot) {
  if (name == "payload" || name == "temp" || name == "frequency") return true;
  for (std::size_t k = 1; k <= robot.driven_count(); ++k) {
    const std::string number = std::to_string(k);
    if (name == "q" + number || name == "qd" + number) return true;
  }
  return false;
}

void validate(const Robot& robot) {
  const std::string where = robot.name.empty() ? "robot" : "robot '" + robot.name + "'";
  if (robot.joints.empty()) refuse(where, "has no joints");
  if (robot.joints.size() > kMostJoints) {
    refuse(where,
           "has " + std::to_string(robot.joints.size()) + " joints, expected at most " + std::to_string(kMostJoints));
  }
  validate_names(robot);
  for (const Joint& joint : robot.joints) validate_joint(joint, robot.convention);
  std::vector<bool> done(robot.joints.size(), false);
  for (std::size_t i = 0; i < robot.joints.size(); ++i) validate_drivers(robot, i, {}, done);
  if (!is_bounded(robot.gravity)) refuse(where, "gravity has a value that is not finite, or beyond 1e6 m/s^2");
  require_frame(where, "T_measurement_base", robot.T_measurement_base);
  for (const Target& target : robot.targets)
    require_frame("target '" + target.name + "'", "T_last_target", target.T_last_target);
  validate_effects(robot);
  validate_torque_effects(robot);
  if (robot.anchor && !(is_bounded(robot.anchor->point) && std::abs(robot.anchor->zero) <= kLargestNumber)) {
    refuse(where, "anchor has a value that is not finite, or beyond 1e6 m");
  }
  for (const auto& [name, ends] : robot.fitted_range) {
    if (!(std::isfinite(ends.first) && std::isfinite(ends.second) && ends.first <= ends.second))
      refuse(where, "fitted_range of '" + name + "' is not a smallest and a largest value");
    if (name == "frequency" && !(ends.second > 0.0))
      refuse(where, "fitted_range of 'frequency' ends at " + math::number(ends.second) + " Hz, expected above 0 Hz");
    if (!is_input(name, robot))
      refuse(where, "fitted_range has '" + name + "', expected q1 ..., qd1 ..., payload, temp or frequency");
  }
}

Eigen::Matrix3d rotation_from_rpy(const Eigen::Vector3d& rpy) {
  return (AngleAxisd(rpy.z(), Vector3d::UnitZ()) * AngleAxisd(rpy.y(), Vector3d::UnitY()) *
          AngleAxisd(rpy.x(), Vector3d::UnitX()))
      .toRotationMatrix();
}

Eigen::Vector3d rpy_from_rotation(const Eigen::Matrix3d& rotation) {
  // Near pitch = +-pi/2 roll and yaw are badly determined each, but not together: yaw is read off what the
  // rounded roll leaves over, so that the three angles give the rotation back to the last digit everywhere.
  const bool at_pole = std::hypot(rotation(2, 1), rotation(2, 2)) < 1e-15;
  const double roll = at_pole ? 0.0 : std::atan2(rotation(2, 1), rotation(2, 2));
  const Eigen::Matrix3d Rz_Ry = rotation * AngleAxisd(-roll, Vector3d::UnitX()).toRotationMatrix();
  return {roll, std::atan2(-Rz_Ry(2, 0), Rz_Ry(2, 2)), std::atan2(-Rz_Ry(0, 1), Rz_Ry(1, 1))};
}

Eigen::Isometry3d frame_from_xyz_rpy(const Eigen::Vector3d& xyz, const Eigen::Vector3d& rpy) {
  Isometry3d T = Isometry3d::Identity();
  T.linear() = rotation_from_rpy(rpy);
  T.translation() = xyz;
  return T;
}

namespace model {

Eigen::MatrixXd coupling_matrix(const Robot& robot) {
  const auto n = static_cast<Eigen::Index>(robot.joints.size());
  Eigen::MatrixXd coupling(n, n);
  coupling.setIdentity();
  for (const std::size_t index : drivers_first(robot)) {
    for (const auto& [driver, weight] : robot.joints[index].driven_by) {
      const auto from = static_cast<Eigen::Index>(robot.joint_index(driver));
      coupling.row(static_cast<Eigen::Index>(index)) += weight * coupling.row(from);
    }
  }
  return coupling;
}

double stretched_length(const Robot& robot) {
  double length = 0.0;
  for (const Joint& joint : robot.joints)
    length += std::hypot(joint.a, joint.d) + joint.T_parent_joint.translation().norm();
  return length;
}

Eigen::VectorXd joint_motions(const Robot& robot, const Eigen::VectorXd& reading) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  if (reading.size() != static_cast<Eigen::Index>(driven.size())) {
    throw std::invalid_argument("got " + std::to_string(reading.size()) + " joint readings, the robot has " +
                                std::to_string(driven.size()) + " driven joints");
  }
  Eigen::VectorXd all_readings = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(robot.joints.size()));
  for (std::size_t k = 0; k < driven.size(); ++k) {
    all_readings[static_cast<Eigen::Index>(driven[k])] = reading[static_cast<Eigen::Index>(k)];
  }
  Eigen::VectorXd motions(all_readings.size());
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    const Joint& joint = robot.joints[k];
    const auto i = static_cast<Eigen::Index>(k);
    motions[i] = joint.passive() ? joint.offset : joint.ratio * all_readings[i] + joint.offset;
  }
  if (driven.size() == robot.joints.size()) return motions;
  for (const std::size_t index : drivers_first(robot)) {
    for (const auto& [driver, weight] : robot.joints[index].driven_by) {
      const auto from = static_cast<Eigen::Index>(robot.joint_index(driver));
      motions[static_cast<Eigen::Index>(index)] += weight * motions[from];
    }
  }
  return motions;
}

}  // namespace model

std::vector<Eigen::Isometry3d> forward_kinematics(const Robot& robot, const Eigen::VectorXd& reading,
                                                  std::size_t target) {
  const Isometry3d T_last_target = target_frame(robot, target);
  const Eigen::VectorXd motion = joint_motions(robot, reading);
  std::vector<Isometry3d> frames;
  frames.reserve(robot.joints.size() + 1);
  Isometry3d T_measurement_link = robot.T_measurement_base;
  for (std::size_t i = 0; i < robot.joints.size(); ++i) {
    T_measurement_link =
        T_measurement_link * joint_frame(robot.convention, robot.joints[i], motion[static_cast<Eigen::Index>(i)]);
    frames.push_back(T_measurement_link);
  }
  frames.push_back(T_measurement_link * T_last_target);
  return frames;
}

}  // namespace truing
