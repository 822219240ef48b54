// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Which poses agree, and what is the matter with those that do not.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hand_eye/closed_form.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {

/// X and Y, and how well most poses close with them.
struct Agreement {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity(), Y = Eigen::Isometry3d::Identity();
  Rows rows;                  ///< that agree
  std::vector<int> symmetry;  ///< per pose of the problem: the turn of the board it was read in, 0 as given
  double scale = 0.0;         ///< distance within which three of five rows close [rad]
  double position = 0.0;      ///< median closure of the agreeing rows [m]
  double rotation = 0.0;      ///< [rad]
};

/// How X is found from some poses: by all motions, or where all axes are parallel.
struct CameraSolver {
  std::optional<Eigen::Vector3d> axis;  ///< the only one
  double height = 0.0;                  ///< [m] the camera's coordinate along it
  Eigen::Isometry3d operator()(const Frames& M, const Frames& B, const Rows& rows) const;
};

struct ConsensusOptions {
  bool search = true;  ///< try triples where some poses stand out; else all rows are taken to agree
  int triples = 200;
};

/// Deterministic: triples of poses, in an order that depends on nothing but the poses, each solved and judged by how
/// well three of five close (least quantile of squares, Rousseeuw 1984); the best one is then refitted to the poses
/// that agree with it. Of fewer than six, all do.
Agreement find_agreement(const Frames& M, const Frames& B, const Rows& rows,
                         const std::vector<Eigen::Isometry3d>& symmetries, const CameraSolver& solve,
                         const ConsensusOptions& options);

/// The turn of its board (0 as given) in which a pose closes best: for poses that had no say in the agreement.
int nearest_symmetry(const Frames& M, const Frames& B, const std::vector<Eigen::Isometry3d>& symmetries,
                     const Agreement& agreement, double length, std::size_t i);

/// Pose numbers in an order that depends on nothing but the frames.
Rows canonical_order(const Frames& frames, const Rows& rows);

/// What a pose that does not close looks like: a coordinate mistyped, a board seen upside down, another pose's row …
/// Empty: nothing known. `closure_noise`: what poses that agree leave (position [m], rotation [rad]).
std::string likely_cause(const Frames& A, const Frames& B, HandEyeSetup setup, std::size_t i, const Rows& agreeing,
                         const Eigen::Isometry3d& X, const Eigen::Isometry3d& Y, double position_noise,
                         double rotation_noise);

}  // namespace truing::hand_eye
