// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What is left of a joint's torque and repeats many times a turn of the joint.

#include "dynamics/problem.hpp"
#include "rooms.hpp"
#include "truing/dynamics/diagnose.hpp"

namespace truing::dynamics {

/// Orders of what the model leaves, on all rows in which a joint moves: lines of the spectrum over its angle that stand
/// out from the orders around them. Joint by joint, the strongest first.
std::vector<TorqueOrder> orders_left(const Problem& problem, const TorqueModel& model);

}  // namespace truing::dynamics
