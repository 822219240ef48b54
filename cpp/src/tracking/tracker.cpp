// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "truing/tracking/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "math/constants.hpp"
#include "rooms.hpp"
#include "tracking/correction_limiter.hpp"
#include "tracking/deviation.hpp"
#include "tracking/pose_filter.hpp"
#include "tracking/watch.hpp"

namespace truing {
using namespace tracking;

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kOutOfPlan =
    1.0;  // forward kinematics as the plan: continued at constant velocity at most so long [s]

/// Covariance of position and orientation of the sensor, carried over to a point `lever` from it (base frame).
Matrix6d moved(const Covariance& P, const Vector3d& lever) {
  Matrix6d out;
  out.topLeftCorner<3, 3>() = P.block<3, 3>(kP, kP);
  out.topRightCorner<3, 3>() = P.block<3, 3>(kP, kTheta);
  out.bottomLeftCorner<3, 3>() = P.block<3, 3>(kTheta, kP);
  out.bottomRightCorner<3, 3>() = P.block<3, 3>(kTheta, kTheta);
  Matrix6d J = Matrix6d::Identity();
  J.topRightCorner<3, 3>() = -skew(lever);
  return J * out * J.transpose();
}

}  // namespace

const char* name(Outcome outcome) {
  static const char* const names[] = {
      "accepted", "accepted_gap", "accepted_saturated", "accepted_restart", "duplicate", "backwards",
      "future",   "too_late",     "not_finite",         "not_unit",         "frozen"};
  return names[static_cast<std::size_t>(outcome)];
}
bool accepted(Outcome outcome) { return outcome <= Outcome::accepted_restart; }
const char* name(Status status) {
  static const char* const names[] = {"valid", "coasting", "hold", "lost"};
  return names[static_cast<std::size_t>(status)];
}
const char* name(ShiftCause cause) {
  static const char* const names[] = {"station_or_receiver", "station", "receiver"};
  return names[static_cast<std::size_t>(cause)];
}
const char* name(Predictor predictor) {
  static const char* const names[] = {"slow", "acceleration", "modes"};
  return names[static_cast<std::size_t>(predictor)];
}

bool FilterOptions::is_valid(std::string* error) const {
  const auto no = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(window > 0.0 && window <= 5.0)) return no("window must be above 0 and at most 5 s");
  if (!(future_limit >= 0.0 && future_limit <= 5.0)) return no("future_limit must be from 0 to 5 s");
  if (!(highest_imu_rate >= 10.0 && highest_imu_rate <= 1e5 && highest_pose_rate >= 1.0 && highest_pose_rate <= 1e4))
    return no("rates out of range");
  if (!(gyro_noise > 0.0 && accel_noise > 0.0 && position_sigma > 0.0 && rotation_sigma > 0.0))
    return no("noises must be above 0");
  if (!(noise_time >= 0.0 && noise_range >= 1.0))
    return no("noise_time must not be below 0 s, noise_range not below 1");
  if (!(reacquire_after >= 2 && frozen_after >= 1))
    return no("reacquire_after must be at least 2, frozen_after at least 1");
  if (!(gate > 6.0)) return no("gate must be above 6, the mean of the innovation squared");
  if (!(largest_gap > 0.0 && restart_gap > largest_gap))
    return no("gaps must be above 0, restart_gap above largest_gap");
  return true;
}

bool DeviationOptions::is_valid(std::string* error) const {
  const auto no = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(period >= 1e-3 && period <= 0.1)) return no("period must be from 1 to 100 ms");
  if (!(horizon >= period && horizon <= 1.0)) return no("horizon must be from one period to 1 s");
  if (!(position_noise > 0.0 && velocity_noise > 0.0 && mode_noise > 0.0 && slow_noise > 0.0))
    return no("noises must be above 0");
  if (!(static_time > 0.0 && grade_time > 0.0)) return no("times must be above 0");
  if (!(frequency_range >= 0.0 && frequency_range < 0.9)) return no("frequency_range must be from 0 to below 0.9");
  return true;
}

bool WatchOptions::is_valid(std::string* error) const {
  const auto no = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(threshold > 20.0)) return no("watch.threshold must be above 20, or it is always exceeded");
  if (!(forget > 0.0 && compare > 0.0)) return no("watch.forget and watch.compare must be above 0 s");
  if (!(least >= 0.0)) return no("watch.least must not be below 0");
  return true;
}

bool TrackOptions::is_valid(std::string* error) const {
  if (!filter.is_valid(error) || !deviation.is_valid(error) || !watch.is_valid(error)) return false;
  const auto no = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (deviation.settle_time + deviation.period > filter.window)
    return no("settle_time must be shorter than the filter's window");
  if (modes.count < 0 || modes.count > ModalModel::kMost) return no("too many modes");
  for (std::size_t k = 0; k < static_cast<std::size_t>(modes.count); ++k) {
    if (!(modes.frequency[k] > 0.0 && modes.frequency[k] * deviation.period < 0.25))
      return no("a mode's frequency must be above 0 and below a quarter of the step rate");
    if (!(modes.damping[k] >= 0.0 && modes.damping[k] < 1.0)) return no("a mode's damping must be from 0 to below 1");
  }
  const CorrectionLimits& l = limits;
  if (!(l.position > 0.0 && l.rotation > 0.0 && l.position_rate > 0.0 && l.rotation_rate > 0.0 &&
        l.position_jerk > 0.0 && l.rotation_jerk > 0.0))
    return no("limits must be above 0");
  return true;
}

struct Tracker::Inside {
  Inside(const TrackSetup& setup_in, const TrackOptions& options_in)
      : setup(setup_in),
        options(options_in),
        filter(setup, options.filter),
        deviation(setup, options.deviation, options.modes),
        watch(setup, options.watch),
        limiter(options.limits) {
    innovations.resize(1024);
    T_imu_tool = setup.T_flange_imu.inverse() * setup.T_flange_tool;
    T_tool_flange = setup.T_flange_tool.inverse();
  }

  void update() {
    filter.update();
    deviation.update(filter, filter.changed_since());
    updated = filter.newest_imu();
    watch_settled();
  }

  /// Tracker samples that no late one will change any more.
  void watch_settled() {
    PoseGrade grade;
    while (filter.take_grades(&grade, 1) == 1) {
      Isometry3d T_base_flange;
      const bool has_flange = filter.flange_at(grade.t, &T_base_flange);
      watch.push(grade, has_flange ? &T_base_flange : nullptr);
      if (innovation_count < static_cast<int>(innovations.size()))
        innovations[static_cast<std::size_t>(innovation_count++)] = {grade.t, grade.nis, grade.dimensions,
                                                                     grade.accepted};
    }
  }

  /// Is the estimate worth more than forward kinematics? Then it is valid, or coasting without the tracker.
  bool near_enough(const Belief& belief, double newest, Status* status) const {
    const Vector6d sway = filter.sway_variance().cwiseSqrt();
    const double position = std::sqrt(belief.P.diagonal().segment<3>(kP).maxCoeff()),
                 rotation = std::sqrt(belief.P.diagonal().segment<3>(kTheta).maxCoeff());
    *status = newest - belief.last_pose < kCoastingAge ? Status::valid : Status::coasting;
    return *status == Status::valid || (position < std::max(options.coast_position, sway.head<3>().maxCoeff()) &&
                                        rotation < std::max(options.coast_rotation, sway.tail<3>().maxCoeff()));
  }

  /// T_base_imu within the window: as the filter has it.
  Isometry3d looked_up(const Belief& belief, PosePrediction* out) const {
    Isometry3d T_base_imu = Isometry3d::Identity();
    T_base_imu.translation() = belief.x.p;
    T_base_imu.linear() = belief.x.q.toRotationMatrix();
    out->covariance = moved(belief.P, belief.x.q * T_imu_tool.translation());
    return T_base_imu;
  }

  /// T_base_imu to come, by the predictor that has done best; without a plan (null) at constant acceleration.
  Isometry3d ahead(const Belief& belief, const PlanPoint* reference, PosePrediction* out) {
    const double newest = out->made, h = std::max(0.0, out->t - newest);
    const Motion motion = filter.motion_at(newest);
    Isometry3d T_base_imu = Isometry3d::Identity();
    PlanPoint here;
    Vector6d d = Vector6d::Zero();
    out->predictor = deviation.best();
    if (reference && deviation.reference_at(newest, &here, kOutOfPlan) &&
        deviation.predict(out->predictor, newest, deviation_of(motion, here), out->t, &d)) {
      T_base_imu = deviated(reference->T, d);
    } else {
      out->predictor = Predictor::acceleration;
      T_base_imu.translation() = motion.x.p + h * motion.x.v + 0.5 * h * h * motion.acceleration;
      T_base_imu.linear() = (exp_rotation(h * motion.rate) * motion.x.q).toRotationMatrix();
    }
    // What predictions were found to be wrong by, at the graded horizon; it grows with the horizon's square where
    // acceleration is unknown.
    const double ratio = h / options.deviation.horizon;
    const Vector6d growth = deviation.grade(out->predictor) * (ratio * ratio);
    out->covariance = moved(belief.P, T_base_imu.linear() * T_imu_tool.translation());
    const Matrix3d R = T_base_imu.linear();
    out->covariance.topLeftCorner<3, 3>() += R * growth.head<3>().asDiagonal() * R.transpose();
    out->covariance.bottomRightCorner<3, 3>() += R * growth.tail<3>().asDiagonal() * R.transpose();
    return T_base_imu;
  }

  /// T_base_imu by forward kinematics or plan, and the last static deviation.
  Isometry3d held(const PlanPoint& reference, const Belief& belief, bool imu_alive, PosePrediction* out) {
    out->predictor = Predictor::slow;
    const Isometry3d T_base_imu = deviated(reference.T, deviation.slow());
    const FilterOptions& f = options.filter;
    const double away = filter.initialised() ? std::max(0.0, out->t - belief.last_pose) : 0.0,
                 wander = imu_alive ? std::min(away, 1e4) : 0.0;
    const double slow_p = deviation.ready() ? 0.0 : f.slow_position * f.slow_position,
                 slow_r = deviation.ready() ? 0.0 : f.slow_rotation * f.slow_rotation;
    Vector6d sway;
    sway << Vector3d::Constant(f.sway_position * f.sway_position),
        Vector3d::Constant(f.sway_rotation * f.sway_rotation);
    if (filter.initialised()) sway = filter.sway_variance();
    const Matrix3d R = T_base_imu.linear() * setup.T_flange_imu.linear().transpose();
    out->covariance.topLeftCorner<3, 3>() = R * sway.head<3>().asDiagonal() * R.transpose();
    out->covariance.bottomRightCorner<3, 3>() = R * sway.tail<3>().asDiagonal() * R.transpose();
    out->covariance.diagonal().head<3>().array() += f.slow_position_walk * f.slow_position_walk * wander + slow_p;
    out->covariance.diagonal().tail<3>().array() += f.slow_rotation_walk * f.slow_rotation_walk * wander + slow_r;
    return T_base_imu;
  }

  TrackSetup setup;
  TrackOptions options;
  PoseFilter filter;
  DeviationModel deviation;
  ShiftWatch watch;
  CorrectionLimiter limiter;
  std::vector<Innovation> innovations;
  int innovation_count = 0;
  Isometry3d T_imu_tool, T_tool_flange;
  double newest_joints = kNever, updated = kNever;
  Counters counters;
};

Tracker::Tracker(const TrackSetup& setup, const TrackOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("TrackOptions: " + error);
  inside_ = std::make_unique<Inside>(setup, options);
}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

Outcome Tracker::push_imu(const ImuSample& sample) {
  const Outcome outcome = inside_->filter.push_imu(sample);
  // The deviation is read from the filter's window: nobody asks, and it has to be read before the window has moved on.
  if (now() - inside_->updated > 0.3 * inside_->options.filter.window) inside_->update();
  return outcome;
}
Outcome Tracker::push_pose(const PoseSample& sample) { return inside_->filter.push_pose(sample); }

Outcome Tracker::push_joints(double t, const Isometry3d& T_base_flange) {
  const double at = t - inside_->setup.controller_clock_offset;
  const Outcome outcome = inside_->filter.push_flange(at, T_base_flange);
  if (outcome == Outcome::accepted) {
    inside_->deviation.push_flange(at, T_base_flange);
    inside_->newest_joints = std::max(inside_->newest_joints, at);
  }
  return outcome;
}

Outcome Tracker::push_plan(double t, const Isometry3d& T_base_tool) {
  const Outcome outcome = inside_->deviation.push_plan(t, T_base_tool, now());
  ++inside_->counters.plan[static_cast<std::size_t>(outcome)];
  return outcome;
}

PosePrediction Tracker::predict(double t) {
  Inside& in = *inside_;
  in.update();
  PosePrediction out;
  out.t = t;
  out.made = now();
  const bool joints_alive = in.newest_joints > out.made - in.options.joints_timeout;
  const bool imu_alive = in.filter.initialised() && out.made > in.newest_joints - in.options.imu_timeout;
  Belief belief;
  if (imu_alive) belief = in.filter.belief_at(std::min(t, out.made));
  if (!imu_alive || !in.near_enough(belief, out.made, &out.status))
    out.status = joints_alive ? Status::hold : Status::lost;
  PlanPoint reference;
  const bool has_reference = in.deviation.reference_at(t, &reference, kOutOfPlan);
  Isometry3d T_base_imu = Isometry3d::Identity();
  if (out.status == Status::valid || out.status == Status::coasting)
    T_base_imu =
        t <= out.made ? in.looked_up(belief, &out) : in.ahead(belief, has_reference ? &reference : nullptr, &out);
  else if (has_reference)
    T_base_imu = in.held(reference, belief, imu_alive, &out);
  else
    out.status = Status::lost;
  if (out.status == Status::lost) out.covariance = Matrix6d::Identity() * 1e6;
  out.T_base_tool = T_base_imu * in.T_imu_tool;
  return out;
}

Compensation Tracker::compensate(double t) {
  Inside& in = *inside_;
  Compensation out;
  out.predicted = predict(t);
  PlanPoint plan;
  out.has_plan = in.deviation.reference_at(t, &plan, kOutOfPlan);
  if (out.has_plan) {
    out.T_base_tool_planned = plan.T * in.T_imu_tool;
    if (out.predicted.status != Status::lost) {
      out.wanted.head<3>() = out.T_base_tool_planned.translation() - out.predicted.T_base_tool.translation();
      out.wanted.tail<3>() =
          log_rotation(Quaterniond(out.T_base_tool_planned.linear() * out.predicted.T_base_tool.linear().transpose()));
    }
  }
  out.correction = in.limiter.follow(t, out.wanted);
  out.limited = (out.correction - out.wanted).cwiseAbs().maxCoeff() > 1e-3;
  Isometry3d corrected = Isometry3d::Identity();
  corrected.translation() = out.T_base_tool_planned.translation() + out.correction.head<3>();
  corrected.linear() = exp_rotation(out.correction.tail<3>()).toRotationMatrix() * out.T_base_tool_planned.linear();
  out.T_base_flange = corrected * in.T_tool_flange;
  return out;
}

void Tracker::set_modes(const ModalModel& modes) {
  TrackOptions options = inside_->options;
  options.modes = modes;
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("TrackOptions: " + error);
  inside_->options = options;
  inside_->deviation.set_modes(modes);
}

double Tracker::now() const { return inside_->filter.newest_imu(); }

ClockEstimate Tracker::clock() {
  Inside& in = *inside_;
  in.update();
  if (!in.filter.initialised()) return {in.setup.clock_offset, in.setup.clock_offset_sigma, 0.0};
  const Belief belief = in.filter.belief_at(now());
  return {belief.x.clock, std::sqrt(belief.P(kClock, kClock)), belief.x.drift};
}

TrackerNoise Tracker::noise() {
  inside_->update();
  const NoiseEstimate& found = inside_->filter.noise();
  const std::array<double, 2> white = found.white();
  return {white[0], white[1], std::sqrt(found.accel_factor()), std::sqrt(found.gyro_factor())};
}

std::array<double, ModalModel::kMost> Tracker::frequencies() const { return inside_->deviation.frequencies(); }
int Tracker::take_rows(DeviationRow* out, int capacity) {
  inside_->update();
  return inside_->deviation.take_rows(out, capacity);
}

int Tracker::take_innovations(Innovation* out, int capacity) {
  Inside& in = *inside_;
  in.update();
  const int n = std::min(capacity, in.innovation_count);
  std::copy(in.innovations.begin(), in.innovations.begin() + n, out);
  std::move(in.innovations.begin() + n, in.innovations.begin() + in.innovation_count, in.innovations.begin());
  in.innovation_count -= n;
  return n;
}

const Shift& Tracker::shift() {
  inside_->update();
  return inside_->watch.last();
}

const Counters& Tracker::counters() const {
  Counters& out = inside_->counters;
  const auto plan = out.plan;
  out = inside_->filter.counters();
  out.plan = plan;
  return out;
}

}  // namespace truing
