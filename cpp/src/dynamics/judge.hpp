// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Where the gap lies, and what it looks like along a held-out recording.

#include "dynamics/problem.hpp"
#include "rooms.hpp"
#include "truing/dynamics/diagnose.hpp"

namespace truing::dynamics {

/// The gap of every joint by speed, direction, acceleration, load, angle and time, on held-out rows.
std::vector<TorqueRegime> regimes_of(const Problem& problem, const TorqueModel& standard, const TorqueModel& named);

/// At most `seconds` of a held-out recording by joint: the first stretch in which it moves about as much as in any.
/// Where one joint is moved after the other, each has a time of its own to be looked at.
std::vector<TorqueTrace> traces_of(const Problem& problem, const TorqueModel& standard, const TorqueModel& named,
                                   double seconds = 12.0);

constexpr double kWorse = 1.05;  ///< an error that is larger by less than this factor is not clearly larger

/// Joints at which `standard` predicts held-out rows better than `named` does, with both errors, in words.
std::vector<std::string> worse_joints(const TorqueErrors& standard, const TorqueErrors& named);

}  // namespace truing::dynamics
