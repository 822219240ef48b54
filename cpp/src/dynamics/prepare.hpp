// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Recordings as the fit sees them: evenly sampled, filtered without phase, cut at gaps, in tiles.

#include <functional>
#include <string>
#include <vector>

#include "dynamics/regressor.hpp"
#include "rooms.hpp"
#include "truing/dynamics/effect.hpp"
#include "truing/dynamics/recording.hpp"

namespace truing::dynamics {

/// A joint whose speed [rad/s | m/s] stays below this is at rest.
constexpr double kSpeedAtRest = 0.01;

/// A stretch of a recording. Basis functions see every row of `motion`; the fit sees every `stride`-th row of what they
/// give, filtered as the measured torques were.
struct Tile {
  std::size_t recording = 0;
  Motion motion;            ///< as fine as the basis functions need it; Motion::torque is for the caller to fill
  Eigen::VectorXd weights;  ///< of the filter
  Eigen::Index stride = 1;
  Eigen::Index first = 0;    ///< of the filtered rows those before it only lead in
  Eigen::Index count = 0;    ///< of filtered rows that are this tile's own
  Eigen::MatrixXd measured;  ///< shape=(count, joints) [Nm | N] filtered; NaN: not measured
  Eigen::MatrixXd moving;    ///< shape=(count, joints): 1 where the joint moves, 0 where it has been at rest a while

  /// The tile's own rows of basis values given at every row of the motion.
  Eigen::MatrixXd own_rows(const Eigen::MatrixXd& values) const {
    return filtered_rows(values).middleRows(first, count);
  }
  Eigen::MatrixXd filtered_rows(const Eigen::MatrixXd& values) const;
  /// Time of the tile's own rows [s].
  Eigen::VectorXd own_time() const;
};

struct PrepareOptions {
  double cutoff = 8.0;                    ///< [Hz]
  std::vector<double> torque_per_ampere;  ///< [Nm/A | N/A] of joints measured by current
  bool short_stretches = false;           ///< those between gaps that are shorter than the filter, too
};

/// Calls `use` with each tile of a recording, in order of time. Throws std::invalid_argument: too short to be filtered.
void for_each_tile(const Recording& recording, std::size_t number, const Robot& robot, const RigidChain& chain,
                   const PrepareOptions& options, const std::function<void(Tile&)>& use);

/// Torques measured, or currents times the drives' constants: shape=(n, joints), NaN throughout where there is neither.
Eigen::MatrixXd measured_torque(const Recording& recording, const std::vector<double>& torque_per_ampere);

/// What the recordings hold together; throws as for_each_tile.
MotionRange range_of(const std::vector<Recording>& recordings, const Robot& robot, const RigidChain& chain,
                     const PrepareOptions& options);

}  // namespace truing::dynamics
