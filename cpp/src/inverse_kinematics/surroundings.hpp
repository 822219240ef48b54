// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A scene made ready for many configurations.

#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "inverse_kinematics/arm.hpp"
#include "rooms.hpp"
#include "truing/model/scene.hpp"

namespace truing::inverse_kinematics {

/// Distance of two segments; zero where they cross.
double segment_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                        const Eigen::Vector3d& d);

/// Distance of a segment from a box of half lengths `half` about the origin; inside, how deep its deepest point is,
/// negative.
double segment_box_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& half);

/// Indices into the scene; second: capsule, or capsule count + obstacle; -1: no pair to look at.
struct NearestPair {
  int first = -1, second = -1;
  double distance = 0.0;  ///< less the clearance: negative: a collision
};

class Surroundings {
 public:
  static constexpr std::size_t kMostFrames = 64;

  Surroundings() = default;
  Surroundings(const Scene& scene, const Arm& arm);

  bool empty() const { return pairs_.empty(); }
  NearestPair nearest(const Arm& arm, const double* readings) const;

 private:
  struct Capsule {
    int frame;  ///< in link_frames; -1: base
    Eigen::Vector3d from, to;
    double radius;
  };
  struct Solid {
    Shape shape;
    Eigen::Isometry3d T_shape_measurement;
    Eigen::Vector3d from, to, half;
    double radius;
  };
  std::vector<Capsule> capsules_;
  std::vector<Solid> solids_;
  std::vector<std::pair<int, int>> pairs_;
  double clearance_ = 0.0;
};

}  // namespace truing::inverse_kinematics
