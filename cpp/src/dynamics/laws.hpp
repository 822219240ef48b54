// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Functions that laws of friction are made of, number by number, on the kernel.

#include <Eigen/Core>

#include "rooms.hpp"

namespace truing::dynamics {

/// exp(x), of x up to 709.
Eigen::ArrayXd exponentials(Eigen::ArrayXd x);
/// tanh(x).
Eigen::ArrayXd tangents(Eigen::ArrayXd x);
/// log(2 cosh(x)).
Eigen::ArrayXd logs_of_two_cosh(Eigen::ArrayXd x);

}  // namespace truing::dynamics
