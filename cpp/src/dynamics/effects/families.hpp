// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The families of effects on torques; each file is one.

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/dynamics/effect.hpp"

namespace truing::dynamics {

std::vector<TorqueEffect> friction_effects();
std::vector<TorqueEffect> inertia_effects();
std::vector<TorqueEffect> drive_effects();
std::vector<TorqueEffect> transmission_effects();
std::vector<TorqueEffect> thermal_effects();

// --- what the families share
// ------------------------------------------------------------------------------------------

/// The number of a joint among those that have a reading; throws std::invalid_argument that lists them.
std::size_t driven_number(const Robot& robot, const std::string& joint);
/// The name of a joint that has a reading, by its number among those.
const std::string& driven_name(const Robot& robot, std::size_t joint);
bool is_revolute(const Robot& robot, std::size_t joint);
/// "Nm" or "N".
std::string torque_unit(const Robot& robot, std::size_t joint);
/// "rad" or "m".
std::string angle_unit(const Robot& robot, std::size_t joint);

/// [rad/s | m/s] that a joint reaches, and faster than rest.
double fastest_of(const Robot& robot, const MotionRange& range, std::size_t joint);

/// Standard deviation of a joint's torque [Nm | N], and more than nothing: what effects on it may well make.
double torque_prior(const MotionRange& range, std::size_t joint);

/// How the dry friction that the robot carries turns round, by joint.
std::vector<FrictionTurn> turns_of(const Robot& robot);

/// One column of one joint's torque, phi, which the law writes where it stands.
using Phi = Eigen::Map<Eigen::ArrayXd>;
using Column = std::function<void(const Motion&, Phi phi)>;
TorqueTerm term_at(std::size_t joint, std::string parameter, std::string unit, double prior, Column column,
                   bool needs_torque = false);

/// The same term of a parameter that machines have between these bounds.
/// The term again, of a basis that does not look at Motion::direction.
TorqueTerm undirected(TorqueTerm term);
TorqueTerm within(TorqueTerm term, double least, double most = std::numeric_limits<double>::infinity());

/// Of angles [rad], on the kernel.
Eigen::ArrayXd sines(const Eigen::VectorXd& angles);
Eigen::ArrayXd cosines(const Eigen::VectorXd& angles);

/// "coulomb.J2"
std::string parameter_name(const char* effect, const Robot& robot, std::size_t joint, const char* part = nullptr);

/// The value of a constant by its full name; throws std::invalid_argument: it is not there.
double constant_of(const std::map<std::string, double>& constants, const std::string& name);

}  // namespace truing::dynamics
