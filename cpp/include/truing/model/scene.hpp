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

/// Something that stands still.
struct Obstacle {
  std::string name;
  Shape shape = Shape::box;
  Eigen::Isometry3d T_measurement_shape = Eigen::Isometry3d::Identity();
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< whole lengths, of a box; of a capsule z alone [m]
  double radius = 0.0;                             ///< of spheres and capsules [m]
};

/// Part of a link, a capsule: `radius` about the segment between two points.
struct LinkCapsule {
  std::string name;
  std::string link;  ///< the joint whose link carries it, in the frame after it; "base": the base frame; "tool": the
                     ///< target's frame
  Eigen::Vector3d from = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d to = Eigen::Vector3d::Zero();    ///< [m]
  double radius = 0.0;                             ///< [m]
};

struct Scene {
  std::vector<Obstacle> obstacles;
  std::vector<LinkCapsule> capsules;
  double clearance = 0.0;  ///< what comes nearer than this collides [m]
  /// Pairs of names that are not looked at. Capsules of one link and of neighbouring links never are, nor is the base's
  /// with what stands still.
  std::vector<std::pair<std::string, std::string>> ignored;

  bool empty() const { return capsules.empty(); }
};

/// The pair that collides most deeply, or comes nearest.
struct Contact {
  std::string first, second;  ///< a capsule, and a capsule or obstacle
  double distance = 0.0;      ///< between their surfaces; negative: how deep they are in each other [m]
};

/// Throws std::invalid_argument on unknown links, empty or equal names, sizes that are not positive, frames that are
/// not rigid.
void validate(const Scene& scene, const Robot& robot);

/// The nearest pair at these readings (effects left out); no names when there is none to look at.
Contact nearest_contact(const Scene& scene, const Robot& robot, const Eigen::VectorXd& readings,
                        std::size_t target = 0);

}  // namespace truing
