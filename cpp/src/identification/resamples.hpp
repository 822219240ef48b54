// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "rooms.hpp"
#include "truing/identify.hpp"

namespace truing::identification {

// Standard errors where columns at one fit cannot tell them, as fits to other poses end in other hollows.

/// Puts what `options.resamples` fits scatter by into covariance and standard errors: the Bayesian bootstrap (Rubin,
/// Annals of Statistics 9 (1981) 130), every pose with a weight drawn from an exponential distribution. Gives how many
/// fits there are; 0: nothing is changed.
int count_scatter(const Robot& nominal, const Measurements& data, const IdentifyOptions& options,
                  const std::vector<std::int32_t>& pose, Identification* result);

}  // namespace truing::identification
