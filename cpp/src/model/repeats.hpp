// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rooms.hpp"
#include "truing/model/measurement.hpp"

namespace truing::model {

/// Noise of one value [m], as rows measured again at the same pose show it.
struct Repeats {
  static constexpr double kEnough = 20.0;  ///< degrees of freedom, for the noise to be taken from repeats

  double sigma = 0.0;
  double degrees_of_freedom = 0.0;  ///< that it rests on

  bool enough() const { return degrees_of_freedom >= kEnough; }
};

/// From rows of one target at equal joints, directions and payload; copies of a row are no repeats.
Repeats noise_of_repeats(const Measurements& data);

}  // namespace truing::model
