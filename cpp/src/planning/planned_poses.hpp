// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Poses of a plan with the inputs that they are measured with, as measurements of the robot itself.

#include <vector>

#include "math/random.hpp"
#include "model/effects/traits.hpp"
#include "planning/poses.hpp"
#include "rooms.hpp"
#include "truing/identify.hpp"
#include "truing/plan.hpp"

namespace truing::planning {

/// One pose, and the inputs that it is measured with.
struct Planned {
  Pose joints;
  std::vector<double> direction;
  double payload = 0.0, temperature = 0.0, time = 0.0;
};

/// What the options want recorded. Throws std::invalid_argument: a column that does not exist.
Recorded recorded(const DistinguishOptions& options);

/// Planned poses as measurements of the robot itself.
class Measured {
 public:
  Measured(const Robot& robot, const std::vector<Planned>& poses, const DistinguishOptions& options);
  Measured(const Measured&) = delete;
  Measured& operator=(const Measured&) = delete;

  Measurements data;

 private:
  std::vector<std::vector<double>> columns_;
  Prediction predicted_;
};

/// Draws the inputs of poses.
class InputDraw {
 public:
  InputDraw(const DistinguishOptions& options, std::size_t driven);

  /// Of the plan's own poses: warm-up and cool-down, half a sine, so that temperature is no function of time alone.
  Planned planned(const Pose& joints, std::size_t k, std::size_t count);

  /// Of poses to choose from, measured as number `k`: warm or cold.
  Planned drawn(const Pose& joints, std::size_t k);

  Random& random() { return random_; }

 private:
  bool coin() { return (random_.next() & 1u) != 0; }

  const DistinguishOptions& options_;
  Recorded with_;
  std::size_t driven_;
  Random random_;
};

}  // namespace truing::planning
