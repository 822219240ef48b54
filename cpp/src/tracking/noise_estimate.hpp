// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Noise of the sensors while the filter runs: of the tracker from three samples in a row and the path that the inertial
// sensor gives between them, of the inertial sensor by how like each other neighbouring innovations are.

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>

#include "math/rotation.hpp"
#include "rooms.hpp"
#include "truing/tracking/tracker.hpp"

namespace truing::tracking {

/// What an update moved: the predicted receiver [m], [rad], and the speed of its position [m/s].
struct Correction {
  Vector6d receiver = Vector6d::Zero();
  Eigen::Vector3d speed = Eigen::Vector3d::Zero();
};

/// Innovations, with what the updates between them moved added back, are the tracker against the inertial path alone.
/// That path is off by a start and a speed, which the second difference of three samples takes away; what is left is
/// the tracker's white noise, whatever noise the filter expects of either sensor: covariance matching (Mehra 1972)
/// leaves open which of the two sensors an innovation comes from, this does not.
///
/// With the tracker's noise known, that of the inertial sensor follows from the order of the innovations: those of a
/// filter that expects the right noise are white (Mehra 1970); those that resemble their neighbours say that it follows
/// the tracker too slowly, those that alternate that it follows too fast. Where the inertial sensor makes most of what
/// is expected of an innovation, neighbours say little, but its square says how large noise is: there what is expected
/// of both sensors is scaled together, so that the filter's gains, which were chosen by what predicts best, stay.
class NoiseEstimate {
 public:
  NoiseEstimate() = default;
  explicit NoiseEstimate(const FilterOptions& o)
      : given_{o.position_sigma * o.position_sigma, o.rotation_sigma * o.rotation_sigma}, found_(given_) {}

  /// What the filter takes: variances of the tracker, factors of the inertial sensor's given ones.
  double position_variance() const { return common_[0] * found_[0]; }  ///< [m^2] of a component
  double rotation_variance() const { return common_[1] * found_[1]; }  ///< [rad^2]
  double accel_factor() const { return common_[0] * factor_[0]; }
  double gyro_factor() const { return common_[1] * factor_[1]; }
  /// White noise of the tracker, standard deviation of a component: position [m], rotation [rad].
  std::array<double, 2> white() const { return {std::sqrt(found_[0]), std::sqrt(found_[1])}; }

  /// A sample at t with its innovation (before the update), the variances expected of it and what the update moved, in
  /// the order of time.
  void push(double t, const Vector6d& innovation, const Vector6d& variance, bool has_orientation,
            const Correction& correction, const FilterOptions& o) {
    if (!(o.noise_time > 0.0)) return;
    const double dt = t - t_;
    seconds_ = dt > 0.0 && dt < kLongest ? seconds_ + dt : 0.0;
    Vector6d difference = innovation + last_.receiver - innovation_;
    difference.head<3>() += dt * last_.speed;
    if (seconds_ > kSettling) {
      const Vector6d u = innovation.cwiseQuotient(variance.cwiseSqrt());
      const bool far = u.head<3>().norm() > kFarthest || u.tail<3>().norm() > kFarthest;
      jumped_ = far && (jumped_ || has_jumped(difference, dt));
      if (!jumped_) {
        follow(0, u.head<3>(), variance.head<3>().mean(), dt, o);
        if (has_orientation) follow(1, u.tail<3>(), variance.tail<3>().mean(), dt, o);
      }
    }
    if (!(dt > 0.0 && dt < kLongest)) {
      known_ = 0;
    } else {
      if (known_ >= 2) {
        const double ratio = dt / step_;
        Vector6d second = difference - ratio * difference_;
        second.head<3>() += dt * before_;
        const double size = 1.0 + (1.0 + ratio) * (1.0 + ratio) + ratio * ratio;  // of its variance, in that of one
        if (ratio > 0.5 && ratio < 2.0) {
          learn(0, second.head<3>().squaredNorm() / (3.0 * size), dt, o);
          if (has_orientation && had_orientation_) learn(1, second.tail<3>().squaredNorm() / (3.0 * size), dt, o);
        }
      }
      difference_ = difference;
      step_ = dt;
      before_ = last_.speed;
    }
    known_ = std::min(known_ + 1, 2);
    had_orientation_ = has_orientation;
    t_ = t;
    innovation_ = innovation;
    last_ = correction;
  }

 private:
  static constexpr double kLongest = 0.1;   // between two samples: the inertial path is not known better for longer [s]
  static constexpr double kClipped = 4.0;   // times what is expected, one sample counts with at most: an outlier
  static constexpr double kPrior = 5.0;     // samples that the given noise counts for
  static constexpr double kFarthest = 5.0;  // length that a whitened innovation counts with at most
  static constexpr double kSettling = 2.0;  // after a start or a gap: what is expected is what is not known yet [s]
  static constexpr double kAveraged = 50.0;                    // innovations that one is compared with
  static constexpr double kBySize = 5.0, kByLikeness = 100.0;  // how fast factors move, over `noise_time`
  static constexpr double kSlip = 0.5;    // speed that the inertial path may be off by [m/s], [rad/s]
  static constexpr double kAtOnce = 1.4;  // logarithm that noise grows by with a sample that is far off: four times

  /// Whether the tracker alone can have made the difference to the sample before: no error of the inertial sensor does
  /// in so short a time.
  bool has_jumped(const Vector6d& difference, double dt) const {
    const auto most = [&](double variance) { return kFarthest * std::sqrt(2.0 * variance) + kSlip * dt; };
    return known_ > 0 &&
           (difference.head<3>().norm() > most(found_[0]) || difference.tail<3>().norm() > most(found_[1]));
  }

  /// Whitened innovations against one, and against the average of those before, each as far as it can tell.
  void follow(std::size_t which, const Eigen::Vector3d& whitened, double variance, double dt, const FilterOptions& o) {
    const double length = whitened.norm(), range = o.noise_range * o.noise_range;
    const bool far = length > kFarthest;
    const Eigen::Vector3d u = far ? Eigen::Vector3d(whitened * (kFarthest / length)) : whitened;
    // fraction of the variance that is the inertial sensor's
    const double inertial = std::max(0.0, 1.0 - common_[which] * found_[which] / variance);
    const auto move = [&](double* factor, double by) {
      *factor = std::clamp(*factor * std::exp(by), 1.0 / range, range);
    };
    const double size = u.squaredNorm() / 3.0 - 1.0, alike = u.dot(average_[which]) / 3.0;
    move(&common_[which], inertial * (kBySize * size * dt / o.noise_time + (far ? kAtOnce : 0.0)));
    move(&factor_[which], (1.0 - inertial) * kByLikeness * alike * dt / o.noise_time);
    average_[which] += (u - average_[which]) / kAveraged;
  }

  void learn(std::size_t which, double square, double dt, const FilterOptions& o) {
    double &found = found_[which], &count = count_[which];
    count = std::min(count + 1.0, o.noise_time / dt);
    const double range = o.noise_range * o.noise_range;
    found += (std::min(square, kClipped * found) - found) / std::max(1.0, count + kPrior);
    found = std::clamp(found, given_[which] / range, given_[which] * range);
  }

  std::array<double, 2> given_{1.0, 1.0}, found_{1.0, 1.0}, count_{0.0, 0.0}, factor_{1.0, 1.0}, common_{1.0, 1.0};
  std::array<Eigen::Vector3d, 2> average_{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double t_ = -1e300, step_ = 0.0, seconds_ = 0.0;
  int known_ = 0;  // samples behind `innovation_` and `difference_`
  bool had_orientation_ = false;
  bool jumped_ =
      false;  // the tracker has, and its samples are far off since: reflected signals, or a station has moved
  Vector6d innovation_ = Vector6d::Zero(), difference_ = Vector6d::Zero();
  Correction last_;
  Eigen::Vector3d before_ = Eigen::Vector3d::Zero();
};

}  // namespace truing::tracking
