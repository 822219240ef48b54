// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "math/rotation.hpp"
#include "rooms.hpp"
#include "truing/tracking/tracker.hpp"

namespace truing::tracking {

/// Follows a wanted correction within limits on size, rate and jerk: three nested loops, from position to rate to
/// acceleration to jerk, each with a bound on what it asks of the next. The wanted correction's own speed is fed
/// forward, so that a sway is followed without lag.
class CorrectionLimiter {
 public:
  explicit CorrectionLimiter(const CorrectionLimits& limits) : limits_(limits) {}

  Vector6d follow(double t, const Vector6d& wanted) {
    if (!started_) {
      started_ = true;
      t_ = t;
      last_wanted_.setZero();
    }
    const double dt = std::clamp(t - t_, 0.0, 1.0);
    t_ = t;
    if (dt > 0.0) {
      part(wanted.head<3>(), last_wanted_.head<3>(), dt, limits_.position, limits_.position_rate, limits_.position_jerk,
           &position_);
      part(wanted.tail<3>(), last_wanted_.tail<3>(), dt, limits_.rotation, limits_.rotation_rate, limits_.rotation_jerk,
           &rotation_);
      last_wanted_ = wanted;
    }
    Vector6d out;
    out << position_.x, rotation_.x;
    return out;
  }

  /// Acceleration now, to check jerks by.
  Eigen::Vector3d acceleration() const { return position_.a; }
  Eigen::Vector3d rate() const { return position_.v; }

 private:
  struct Part {
    Eigen::Vector3d x = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero(), a = Eigen::Vector3d::Zero();
  };
  static constexpr double kStep = 1e-3;                                   // of the integration [s]
  static constexpr double kFirst = 30.0, kSecond = 90.0, kThird = 270.0;  // of the loops [1/s]

  static Eigen::Vector3d bounded(const Eigen::Vector3d& v, double length) {
    const double norm = v.norm();
    return norm > length ? Eigen::Vector3d(v * (length / norm)) : v;
  }

  static void part(const Eigen::Vector3d& wanted, const Eigen::Vector3d& before, double dt, double size, double rate,
                   double jerk, Part* p) {
    const Eigen::Vector3d target = bounded(wanted, size), from = bounded(before, size);
    Eigen::Vector3d speed = (target - from) / dt;
    if (speed.norm() > rate) speed.setZero();  // a step has no speed to feed forward
    const double acceleration = 0.5 * std::sqrt(jerk * rate);
    const int steps = std::max(1, static_cast<int>(std::ceil(dt / kStep - 1e-9)));
    const double h = dt / steps;
    for (int k = 1; k <= steps; ++k) {
      const Eigen::Vector3d goal = target - (dt - k * h) * speed;
      // Far from the goal the approach is slowed down early enough to stop with the acceleration that the jerk allows.
      const Eigen::Vector3d error = goal - p->x;
      const double distance = error.norm(), braking = std::sqrt(0.5 * acceleration * distance);
      Eigen::Vector3d v = kFirst * error;
      if (v.norm() > braking) v *= braking / v.norm();
      v = bounded(speed + v, 0.94 * rate);
      Eigen::Vector3d a = bounded(kSecond * (v - p->v), acceleration);
      // Near the highest rate no more acceleration than the jerk can take away before it is reached.
      const double speed_now = p->v.norm(), most = 0.7 * std::sqrt(2.0 * jerk * std::max(0.0, 0.95 * rate - speed_now));
      if (speed_now > 0.0 && a.dot(p->v) > most * speed_now) a -= (a.dot(p->v) / speed_now - most) / speed_now * p->v;
      Eigen::Vector3d j = bounded(kThird * (a - p->a), jerk);
      // Stopped from now on, would the rate be kept? Taking away a at full jerk still adds a |a| / (2 jerk).
      const auto reached = [&](const Eigen::Vector3d& with) {
        const Eigen::Vector3d next = p->a + h * with;
        return (p->v + next * (h + next.norm() / (2.0 * jerk))).norm();
      };
      if (reached(j) > 0.98 * rate && p->a.norm() > 0.0) j = bounded(-p->a / h, jerk);
      p->a += h * j;
      p->v += h * p->a;
      p->x += h * p->v;
    }
  }

  CorrectionLimits limits_;
  bool started_ = false;
  double t_ = 0.0;
  Vector6d last_wanted_ = Vector6d::Zero();
  Part position_, rotation_;
};

}  // namespace truing::tracking
