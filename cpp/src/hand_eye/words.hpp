// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What hand-eye has to say, made from reasons and numbers at the very end. Nothing goes by these texts.

#include <string>

#include <Eigen/Core>

#include "rooms.hpp"
#include "truing/handeye.hpp"

namespace truing::hand_eye {

/// The frame that carries the camera.
std::string camera_parent(HandEyeSetup setup);

/// With what it is called and what to do about it.
Unobservable unobservable(UnobservableReason reason, const Eigen::Vector3d& direction, HandEyeSetup setup,
                          bool rotation = false, double sigma = std::numeric_limits<double>::infinity());

/// Of a result that is refused: what is not observable, and what to do.
std::string unobservable_message(const std::vector<Unobservable>& all);

/// Of a result whose loop does not close: as given, and in the reading that closes it, if there is one.
std::string not_closing_message(const HandEyeResult& result, HandEyeSetup setup);

std::string text_of(const HandEyeConcern& concern);

/// Adds a concern, and the warning that says it.
void warn(HandEyeResult* result, const HandEyeConcern& concern);

}  // namespace truing::hand_eye
