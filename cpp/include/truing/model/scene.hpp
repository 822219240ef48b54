// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truing/model/robot.hpp"

namespace truing {

/// What the robot must not touch, and what of it must not: simple shapes, whose distances are exact.

enum class Shape {
  sphere,   ///< `radius` about the frame's origin
  capsule,  ///< `radius` about the segment from the origin to (0, 0, `size.z()`)
  box,      ///< `size` along the frame's axes, its centre at the origin
};

/// A fixed obstacle.
struct Obstacle {
  std::string name;                                                       ///< unique within the scene
  Shape shape = Shape::box;                                               ///< what it is
  Eigen::Isometry3d T_measurement_shape = Eigen::Isometry3d::Identity();  ///< shape=(4, 4) [m]
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< shape=(3,) [m] whole lengths, of a box; of a capsule z alone
  double radius = 0.0;                             ///< [m] of spheres and capsules
};

/// Part of a link, a capsule: `radius` about the segment between two points.
struct LinkCapsule {
  std::string name;  ///< unique within the scene
  /// The joint whose link carries it, in the frame after it; 'base': the base frame; 'tool': the target's frame.
  std::string link;
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< shape=(3,) [m]
  Eigen::Vector3d end = Eigen::Vector3d::Zero();    ///< shape=(3,) [m]
  double radius = 0.0;                              ///< [m]
};

/// The obstacles around the robot, and the capsules of the robot that must not touch them or each other.
struct Scene {
  std::vector<Obstacle> obstacles;    ///< what the robot must not touch
  std::vector<LinkCapsule> capsules;  ///< the robot's own shape
  double clearance = 0.0;             ///< [m] smallest distance that is no collision
  /// Pairs of names that are not checked. Capsules of one link and of neighbouring links never are, nor is the base's
  /// with obstacles.
  std::vector<std::pair<std::string, std::string>> ignored;

  bool empty() const { return capsules.empty(); }
};

/// The pair that collides most deeply, or comes nearest.
struct Contact {
  std::string first;      ///< a capsule
  std::string second;     ///< a capsule or an obstacle
  double distance = 0.0;  ///< [m] between their surfaces; negative: how deep they are in each other
};

/// Throws std::invalid_argument on unknown links, empty or equal names, sizes that are not positive, frames that are
/// not rigid.
void validate(const Scene& scene, const Robot& robot);

/// The nearest pair at these readings (effects left out); no names when there is none to look at.
Contact nearest_contact(const Scene& scene, const Robot& robot, const Eigen::VectorXd& readings,
                        std::size_t target = 0);

}  // namespace truing
