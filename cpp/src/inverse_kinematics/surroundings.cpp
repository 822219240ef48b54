// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>

#include "math/text.hpp"
#include "rooms.hpp"

namespace truing::inverse_kinematics {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Parameter of the point of a segment that is nearest to `point`.
double nearest_on_segment(const Vector3d& a, const Vector3d& way, const Vector3d& point) {
  const double length2 = way.squaredNorm();
  return length2 > 0.0 ? std::clamp((point - a).dot(way) / length2, 0.0, 1.0) : 0.0;
}

/// How deep a point is inside the box: its distance from the nearest face.
double depth_in_box(const Vector3d& point, const Vector3d& half) { return (half - point.cwiseAbs()).minCoeff(); }

}  // namespace

double segment_distance(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  // The square of the distance is convex in both parameters: its minimum is where the lines come nearest, if that is
  // within both segments, or on one of the four edges.
  const Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double determinant = uu * vv - uv * uv;
  if (determinant > 1e-14 * uu * vv) {
    const double s = (uv * v.dot(w) - vv * u.dot(w)) / determinant;
    const double t = (uu * v.dot(w) - uv * u.dot(w)) / determinant;
    if (s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0) return (w + s * u - t * v).norm();
  }
  double least = std::numeric_limits<double>::infinity();
  for (const Vector3d& end : {a, b})
    least = std::min(least, (end - (c + nearest_on_segment(c, v, end) * v)).squaredNorm());
  for (const Vector3d& end : {c, d})
    least = std::min(least, (end - (a + nearest_on_segment(a, u, end) * u)).squaredNorm());
  return std::sqrt(least);
}

double segment_box_distance(const Vector3d& a, const Vector3d& b, const Vector3d& half) {
  // f(t) = sum of max(|x_i(t)| - half_i, 0)^2 is convex, and a parabola between the places where x(t) passes a face's
  // plane.
  const Vector3d way = b - a;
  double place[8] = {0.0};  // rising
  int places = 1;
  const auto insert = [&place, &places](double t) {
    int at = places++;
    for (; at > 0 && place[at - 1] > t; --at) place[at] = place[at - 1];
    place[at] = t;
  };
  for (int i = 0; i < 3; ++i) {
    if (way[i] == 0.0) continue;
    for (const double face : {-half[i], half[i]}) {
      const double t = (face - a[i]) / way[i];
      if (t > 0.0 && t < 1.0) insert(t);
    }
  }
  insert(1.0);
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k + 1 < places; ++k) {
    // Which faces are passed is the same all along: f = sum over them of (p + q t)^2.
    const Vector3d middle = a + 0.5 * (place[k] + place[k + 1]) * way;
    double pq = 0.0, qq = 0.0;
    for (int i = 0; i < 3; ++i) {
      if (std::abs(middle[i]) <= half[i]) continue;
      const double p = a[i] - std::copysign(half[i], middle[i]);
      pq += p * way[i];
      qq += way[i] * way[i];
    }
    const double t = qq > 0.0 ? std::clamp(-pq / qq, place[k], place[k + 1]) : place[k];
    least = std::min(least, ((a + t * way).cwiseAbs() - half).cwiseMax(0.0).squaredNorm());
  }
  if (least > 0.0) return std::sqrt(least);
  // Inside the depth is concave along the segment: thirds close in on its maximum.
  double low = 0.0, high = 1.0;
  for (int k = 0; k < 60; ++k) {
    const double first = low + (high - low) / 3.0, second = high - (high - low) / 3.0;
    if (depth_in_box(a + first * way, half) < depth_in_box(a + second * way, half)) {
      low = first;
    } else {
      high = second;
    }
  }
  return -std::max(0.0, depth_in_box(a + 0.5 * (low + high) * way, half));
}

Surroundings::Surroundings(const Scene& scene, const Arm& arm) : clearance_(scene.clearance) {
  validate(scene, arm.robot());
  const std::size_t joints = arm.robot().joints.size();
  if (joints + 1 > kMostFrames) throw std::invalid_argument("too many joints for a scene");
  for (const LinkCapsule& capsule : scene.capsules) {
    const int frame = capsule.link == "base"   ? -1
                      : capsule.link == "tool" ? static_cast<int>(joints)
                                               : static_cast<int>(arm.robot().joint_index(capsule.link));
    capsules_.push_back({frame, capsule.start, capsule.end, capsule.radius});
  }
  for (const Obstacle& obstacle : scene.obstacles) {
    const Isometry3d& T = obstacle.T_measurement_shape;
    solids_.push_back({obstacle.shape, T.inverse(), T.translation(),
                       T * Vector3d(0.0, 0.0, obstacle.shape == Shape::capsule ? obstacle.size.z() : 0.0),
                       0.5 * obstacle.size, obstacle.shape == Shape::box ? 0.0 : obstacle.radius});
  }
  std::set<std::pair<std::string, std::string>> ignored;
  for (const auto& [a, b] : scene.ignored) {
    ignored.insert({a, b});
    ignored.insert({b, a});
  }
  // The tool sits on the last link.
  const auto link = [joints](int frame) { return std::min(frame, static_cast<int>(joints) - 1); };
  for (std::size_t i = 0; i < capsules_.size(); ++i) {
    for (std::size_t k = i + 1; k < capsules_.size(); ++k) {
      if (std::abs(link(capsules_[i].frame) - link(capsules_[k].frame)) <= 1) continue;
      if (ignored.count({scene.capsules[i].name, scene.capsules[k].name})) continue;
      pairs_.push_back({static_cast<int>(i), static_cast<int>(k)});
    }
    for (std::size_t k = 0; k < solids_.size(); ++k) {
      if (capsules_[i].frame < 0 || ignored.count({scene.capsules[i].name, scene.obstacles[k].name})) continue;
      pairs_.push_back({static_cast<int>(i), static_cast<int>(capsules_.size() + k)});
    }
  }
}

NearestPair Surroundings::nearest(const Arm& arm, const double* readings) const {
  Isometry3d frames[kMostFrames];
  arm.link_frames(readings, frames);
  const auto end = [&](const Capsule& capsule, const Vector3d& point) -> Vector3d {
    return capsule.frame < 0 ? arm.robot().T_measurement_base * point : frames[capsule.frame] * point;
  };
  NearestPair found;
  found.distance = std::numeric_limits<double>::infinity();
  for (const auto& [first, second] : pairs_) {
    const Capsule& capsule = capsules_[static_cast<std::size_t>(first)];
    const Vector3d a = end(capsule, capsule.from), b = end(capsule, capsule.to);
    double distance = -capsule.radius - clearance_;
    if (second < static_cast<int>(capsules_.size())) {
      const Capsule& other = capsules_[static_cast<std::size_t>(second)];
      distance += segment_distance(a, b, end(other, other.from), end(other, other.to)) - other.radius;
    } else {
      const Solid& solid = solids_[static_cast<std::size_t>(second) - capsules_.size()];
      distance += solid.shape == Shape::box
                      ? segment_box_distance(solid.T_shape_measurement * a, solid.T_shape_measurement * b, solid.half)
                      : segment_distance(a, b, solid.from, solid.to) - solid.radius;
    }
    if (distance < found.distance) found = {first, second, distance};
  }
  return found;
}

}  // namespace truing::inverse_kinematics

namespace truing {
using namespace inverse_kinematics;

void validate(const Scene& scene, const Robot& robot) {
  std::set<std::string> names;
  const auto take = [&names](const std::string& kind, const std::string& name) {
    if (name.empty()) throw std::invalid_argument(kind + " without a name");
    if (!names.insert(name).second) throw std::invalid_argument(kind + " '" + name + "': this name is used twice");
  };
  const auto require_length = [](const std::string& where, const char* what, double value, bool zero_too) {
    if (std::isfinite(value) && (value > 0.0 || (zero_too && value == 0.0))) return;
    throw std::invalid_argument(where + ": " + what + " is " + number(value) + " m, expected " +
                                (zero_too ? "zero or more" : "more than zero"));
  };
  if (!(std::isfinite(scene.clearance) && scene.clearance >= 0.0))
    throw std::invalid_argument("clearance is not zero or more");
  for (const LinkCapsule& capsule : scene.capsules) {
    take("link capsule", capsule.name);
    const std::string where = "link capsule '" + capsule.name + "'";
    if (capsule.link != "base" && capsule.link != "tool") (void)robot.joint_index(capsule.link);
    if (!capsule.start.allFinite() || !capsule.end.allFinite())
      throw std::invalid_argument(where + ": an end is not finite");
    require_length(where, "radius", capsule.radius, true);
  }
  for (const Obstacle& obstacle : scene.obstacles) {
    take("obstacle", obstacle.name);
    const std::string where = "obstacle '" + obstacle.name + "'";
    const Eigen::Matrix3d R = obstacle.T_measurement_shape.linear();
    if (!obstacle.T_measurement_shape.matrix().allFinite() ||
        (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-6) {
      throw std::invalid_argument(where + ": its frame is not rigid");
    }
    if (obstacle.shape != Shape::box) require_length(where, "radius", obstacle.radius, false);
    if (obstacle.shape == Shape::capsule) require_length(where, "length", obstacle.size.z(), true);
    for (int i = 0; obstacle.shape == Shape::box && i < 3; ++i) require_length(where, "size", obstacle.size[i], false);
  }
  for (const auto& [first, second] : scene.ignored) {
    for (const std::string& name : {first, second}) {
      if (names.count(name) == 0) throw std::invalid_argument("ignored pair: there is no '" + name + "' in the scene");
    }
  }
}

Contact nearest_contact(const Scene& scene, const Robot& robot, const Eigen::VectorXd& readings, std::size_t target) {
  Robot bare = robot;
  bare.effects.clear();
  const Arm arm(bare, {}, target, {});
  if (readings.size() != arm.driven()) {
    throw std::invalid_argument("got " + std::to_string(readings.size()) + " joint readings, the robot has " +
                                std::to_string(arm.driven()) + " driven joints");
  }
  const Surroundings surroundings(scene, arm);
  const NearestPair pair = surroundings.nearest(arm, readings.data());
  Contact contact;
  if (pair.first < 0) return contact;
  const std::size_t second = static_cast<std::size_t>(pair.second), capsules = scene.capsules.size();
  contact.first = scene.capsules[static_cast<std::size_t>(pair.first)].name;
  contact.second = second < capsules ? scene.capsules[second].name : scene.obstacles[second - capsules].name;
  contact.distance = pair.distance + scene.clearance;
  return contact;
}

}  // namespace truing
