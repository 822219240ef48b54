// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "hand_eye/closed_form.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {

/// Of the residuals of `rows`, as fitted or left out.
HandEyeErrors errors_of(const std::vector<HandEyeResidual>& residuals, const Rows& rows, bool left_out);

/// Covariance of a point of the camera frame [m] in the frame that carries the camera: it moves by d_t + d_r x (R p).
Eigen::Matrix3d at_working_point(const UncertainFrame& camera, const Eigen::Vector3d& point);

}  // namespace truing::hand_eye
