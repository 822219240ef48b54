// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Base parameters: which combinations of the inertial parameters motion can see (Gautier and Khalil 1990, Direct
// calculation of minimum set of inertial parameters of serial robots; numerically: Gautier 1991).

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "math/observability.hpp"
#include "rooms.hpp"
#include "truing/dynamics/regressor.hpp"

namespace truing::dynamics {

/// Torque = (kept columns of Y) * (kept + combination * grouped) parameters, whatever the unseen ones are.
struct BaseParameters {
  std::vector<int> kept;        ///< of the 10 * joints columns: one a base parameter, ascending
  std::vector<int> grouped;     ///< seen only together with kept ones
  std::vector<int> unseen;      ///< no torque depends on them
  Eigen::MatrixXd combination;  ///< shape=(kept, grouped)

  /// Values of the base parameters: shape=(kept,).
  Eigen::VectorXd values(const Eigen::VectorXd& parameters) const;
  /// All parameters with base values changed to `base`: the change goes to the kept ones, the others stay.
  Eigen::VectorXd with_values(const Eigen::VectorXd& parameters, const Eigen::VectorXd& base) const;
};

/// What any motion could see (structure): from the regressor at `states` random states, within the joints' limits.
/// Throws std::invalid_argument: a robot that `validate` refuses.
BaseParameters base_parameters(const Robot& robot, int states = 500, std::uint64_t seed = 0);

/// What recordings see (excitation): `gram` of the regressor over their rows, shape=(10 * joints, 10 * joints). A
/// column that others explain but for `tolerance` of its length is grouped. Throws std::invalid_argument on another
/// shape.
BaseParameters base_parameters(const Robot& robot, const Eigen::MatrixXd& gram, double tolerance = 1e-6);

/// "link_inertia.J2.xx" of a column.
std::string inertial_name(const Robot& robot, int column);
/// A line for each parameter that is not a base parameter of its own: "link_inertia.J3.m grouped into
/// link_inertia.J2.xx (0.25) and link_inertia.J2.mx (0.5)", "link_inertia.J1.m is not seen".
std::vector<std::string> in_words(const BaseParameters& base, const Robot& robot);

}  // namespace truing::dynamics
