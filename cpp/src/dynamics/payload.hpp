// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A payload that is known: the recording's column payload_kg, a point mass at the origin of the tool's frame, or at
// payload_x_m, payload_y_m, payload_z_m in it.

#include <string>

#include "dynamics/regressor.hpp"
#include "rooms.hpp"
#include "truing/dynamics/effect.hpp"

namespace truing::dynamics {

/// The column that says how heavy the payload is.
extern const char* const kPayload;

/// The column that is above zero where the payload was found from these torques: nobody weighed it.
extern const char* const kPayloadFound;

/// payload_kg and those that say where it is, and whether it was found.
bool is_of_payload(const std::string& column);

/// Its mass in every row [kg]; zero where the recording has no such column.
Eigen::VectorXd payload_of(const Motion& motion);

/// Torques of every joint for its centre's being a metre further along an axis (0 … 2) of the tool's frame, to first
/// order: shape=(rows, joints) [Nm | N].
Eigen::MatrixXd payload_shifted(const Motion& motion, int axis);

/// Adds its torques to `torque`, shape=(rows, joints): Y of the last link times the parameters of a point mass.
void add_payload(const Motion& motion, Eigen::MatrixXd* torque);

/// Whether it was found from torques, in some recording.
bool payload_was_found(const MotionRange& range);

/// Whether masses can be told from the drives' constants: the links alone, which are not known, take up a payload that
/// is the same everywhere.
bool payload_varies(const MotionRange& range);

}  // namespace truing::dynamics
