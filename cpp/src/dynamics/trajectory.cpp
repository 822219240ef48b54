// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dynamics/filter.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSlowShare = 0.35;  ///< of the time, for reversals
constexpr double kEase = 1.0;        ///< [s] from rest, and to it
constexpr double kInside = 0.95;     ///< of the range between a joint's limits
constexpr double kLeastRoom = 0.02;  ///< [rad | m] to either side
constexpr double kTurn = 2.0 * M_PI;

double log_uniform(math::Random* random, double low, double high) {
  return std::exp(random->uniform(std::log(low), std::log(high)));
}

/// 0 to 1 with speed and acceleration zero at both ends.
ArrayXd ease(const ArrayXd& x) {
  const ArrayXd y = x.max(0.0).min(1.0);
  return y.cube() * (10.0 - 15.0 * y + 6.0 * y.square());
}

/// 1 within a stretch of this length, from 0 and to 0.
ArrayXd envelope(const ArrayXd& time, double length) {
  const double slope = std::min(kEase, 0.25 * length);
  return ease(time / slope) * ease((length - time) / slope);
}

/// The wave as large as the limits allow at most: of `room`, speed and acceleration.
ArrayXd within(const ArrayXd& wave, double room, double speed, double acceleration, double step) {
  const MatrixXd rate = rate_of(wave.matrix(), step);
  const double largest = wave.abs().maxCoeff(), fastest = rate.cwiseAbs().maxCoeff(),
               hardest = rate_of(rate, step).cwiseAbs().maxCoeff();
  if (!(largest > 0.0)) return wave;
  return wave * std::min({room / largest, speed / fastest, acceleration / hardest});
}

/// Swevers et al. 1997, eq. (12), without its offset.
ArrayXd fourier(const Trajectory::OfJoint& joint, double period, const ArrayXd& time) {
  ArrayXd out = ArrayXd::Zero(time.size());
  for (int k = 1; k <= Trajectory::kHarmonics; ++k) {
    const double omega = kTurn * k / period;
    const auto at = static_cast<std::size_t>(k - 1);
    out += (joint.sine[at] * (omega * time).sin() - joint.cosine[at] * (omega * time).cos()) / omega;
  }
  return out - out.mean();
}

/// A sine by its stroke and largest speed.
ArrayXd reversals(double stroke, double speed, double phase, const ArrayXd& time) {
  return stroke * (time * (speed / stroke) + phase).sin();
}

}  // namespace

MotionLimits motion_limits(const Robot& robot, const TorquePlanOptions& options) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  const auto joints = static_cast<Index>(driven.size());
  if (!options.home.empty() && options.home.size() != driven.size())
    throw std::invalid_argument("home has " + std::to_string(options.home.size()) + " numbers, expected " +
                                std::to_string(joints) + ", one for each joint with a reading");
  MotionLimits out;
  out.home = out.lower = out.upper = out.speed = VectorXd::Zero(joints);
  out.acceleration = VectorXd::Constant(joints, options.acceleration);
  for (Index k = 0; k < joints; ++k) {
    const Joint& joint = robot.joints[driven[static_cast<std::size_t>(k)]];
    const bool limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
    const double middle = limited ? 0.5 * (joint.lower + joint.upper) : 0.0;
    const double half = limited ? 0.5 * kInside * (joint.upper - joint.lower) : options.reach;
    out.home[k] = options.home.empty() ? middle : options.home[static_cast<std::size_t>(k)];
    double room = options.reach;
    if (std::isfinite(joint.upper)) room = std::min(room, (limited ? middle + half : joint.upper) - out.home[k]);
    if (std::isfinite(joint.lower)) room = std::min(room, out.home[k] - (limited ? middle - half : joint.lower));
    if (!(room > kLeastRoom))
      throw std::invalid_argument("joint '" + joint.name + "' has no room to move around " +
                                  math::number(out.home[k], 4) + ": its limits are " + math::number(joint.lower, 4) +
                                  " and " + math::number(joint.upper, 4));
    out.lower[k] = out.home[k] - room;
    out.upper[k] = out.home[k] + room;
    out.speed[k] = options.speed * std::min(joint.speed_limit,
                                            std::isfinite(joint.speed_limit) ? joint.speed_limit : options.usual_speed);
  }
  return out;
}

Trajectory random_trajectory(Index joints, math::Random* random) {
  Trajectory out;
  out.period = random->uniform(6.0, 14.0);
  for (Index k = 0; k < joints; ++k) {
    Trajectory::OfJoint joint;
    joint.centre = random->uniform(-0.3, 0.3);
    joint.size = random->uniform(0.6, 1.0);
    for (double& a : joint.sine) a = random->normal();
    for (double& b : joint.cosine) b = random->normal();
    joint.slow_stroke = log_uniform(random, 0.05, 0.3);
    joint.slow_speed = log_uniform(random, 0.03, 0.3);
    joint.slow_phase = random->uniform(0.0, kTurn);
    joint.small_stroke = log_uniform(random, 0.003, 0.03);
    joint.small_speed = log_uniform(random, 0.02, 0.1);
    joint.small_phase = random->uniform(0.0, kTurn);
    out.joints.push_back(joint);
  }
  return out;
}

Trajectory varied(const Trajectory& from, double size, math::Random* random) {
  Trajectory out = from;
  out.period = std::clamp(from.period * std::exp(0.1 * size * random->normal()), 5.0, 16.0);
  Trajectory::OfJoint& joint = out.joints[random->below(out.joints.size())];
  const auto factor = [&] { return std::exp(size * random->normal()); };
  joint.centre = std::clamp(joint.centre + 0.3 * size * random->normal(), -0.6, 0.6);
  joint.size = std::clamp(joint.size + 0.2 * size * random->normal(), 0.3, 1.0);
  for (double& a : joint.sine) a += size * random->normal();
  for (double& b : joint.cosine) b += size * random->normal();
  joint.slow_stroke = std::clamp(joint.slow_stroke * factor(), 0.03, 0.5);
  joint.slow_speed = std::clamp(joint.slow_speed * factor(), 0.02, 0.5);
  joint.slow_phase += size * random->normal();
  joint.small_stroke = std::clamp(joint.small_stroke * factor(), 0.002, 0.05);
  joint.small_speed = std::clamp(joint.small_speed * factor(), 0.015, 0.2);
  joint.small_phase += size * random->normal();
  return out;
}

MatrixXd sampled(const Trajectory& trajectory, const MotionLimits& limits, double duration, double rate) {
  const auto rows = static_cast<Index>(std::floor(duration * rate + 1e-9)) + 1;
  const auto fast_rows = static_cast<Index>(std::floor((1.0 - kSlowShare) * static_cast<double>(rows)));
  const double step = 1.0 / rate;
  const ArrayXd time = ArrayXd::LinSpaced(rows, 0.0, static_cast<double>(rows - 1) * step);
  const ArrayXd fast = time.head(fast_rows), slow = time.tail(rows - fast_rows) - time[fast_rows - 1];
  const ArrayXd around_fast = envelope(fast, fast[fast_rows - 1]), around_slow = envelope(slow, slow[slow.size() - 1]);
  MatrixXd out(rows, limits.home.size());
  for (Index k = 0; k < out.cols(); ++k) {
    const Trajectory::OfJoint& joint = trajectory.joints[static_cast<std::size_t>(k)];
    const double half = limits.upper[k] - limits.home[k], room = half * (1.0 - std::abs(joint.centre));
    const ArrayXd wave = fourier(joint, trajectory.period, fast) * around_fast;
    out.col(k).head(fast_rows) = joint.size * within(wave, room, limits.speed[k], limits.acceleration[k], step);
    const ArrayXd back = (reversals(joint.slow_stroke, joint.slow_speed, joint.slow_phase, slow) +
                          reversals(joint.small_stroke, joint.small_speed, joint.small_phase, slow)) *
                         around_slow;
    // As they are, unless the limits ask for less.
    const ArrayXd most = within(back, room, limits.speed[k], limits.acceleration[k], step);
    const bool fits = most.abs().maxCoeff() >= back.abs().maxCoeff();
    out.col(k).tail(rows - fast_rows) = fits ? back : most;
    out.col(k).array() += limits.home[k] + joint.centre * half;
  }
  return out;
}

}  // namespace truing::dynamics
