// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "truing/tracking/replay.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "math/constants.hpp"
#include "math/frame.hpp"
#include "math/linear_algebra.hpp"
#include "math/rotation.hpp"
#include "rooms.hpp"

namespace truing {
using namespace tracking;

namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kNotYet = std::numeric_limits<double>::infinity();
constexpr double kTimelineStep = 0.1;     // [s]
constexpr double kEncoderStep = 0.02;     // over which encoders are differenced: what is shorter is their noise [s]
constexpr double kLate = 0.05;            // a sample whose time has passed by more is not predicted any more [s]
constexpr std::size_t kFewestRows = 500;  // that identify_modes takes

template <class Sample>
void require_sorted(const std::vector<Sample>& samples, const char* name) {
  const auto earlier = [](const Sample& a, const Sample& b) { return a.arrival < b.arrival; };
  if (!std::is_sorted(samples.begin(), samples.end(), earlier))
    throw std::invalid_argument(std::string("replay: ") + name + " is not sorted by arrival");
}

Isometry3d frame_of(const PoseSample& sample) {
  Isometry3d T = Isometry3d::Identity();
  T.translation() = sample.position;
  if (sample.has_orientation()) T.linear() = sample.orientation.normalized().toRotationMatrix();
  return T;
}

/// The newest of a stream of frames, and one that is one or two `step` older.
class LastTwo {
 public:
  explicit LastTwo(double step) : step_(step) {}
  void push(double t, const Isometry3d& T) {
    if (t <= now_.t) return;
    now_ = {t, T};
    if (t - middle_.t < step_) return;
    before_ = middle_;
    middle_ = now_;
  }
  bool any() const { return now_.t > kNever; }
  bool two() const { return before_.t > kNever; }
  const Isometry3d& held() const { return now_.T; }
  Isometry3d at(double t) const { return between(before_.T, now_.T, 1.0 + (t - now_.t) / (now_.t - before_.t)); }

 private:
  struct Item {
    double t = kNever;
    Isometry3d T = Isometry3d::Identity();
  };
  double step_;
  Item before_, middle_, now_;
};

/// Covariance of a frame about the base's axes, carried over to a point `lever` from it (base frame).
Matrix6d carried(const Matrix6d& P, const Vector3d& lever) {
  Matrix6d J = Matrix6d::Identity();
  J.topRightCorner<3, 3>() = -cross_matrix(lever);
  return J * P * J.transpose();
}

/// Plays one recording.
class Replay {
 public:
  Replay(const RecordedStreams& streams, const TrackSetup& setup, const ReplayOptions& options)
      : streams_(streams),
        setup_(setup),
        options_(options),
        tracker_(setup, options.track),
        next_grade_(options.horizons.size(), 0),
        poses_(0.0),
        flanges_(kEncoderStep) {
    T_tool_receiver_ = setup.T_flange_tool.inverse() * setup.T_flange_receiver;
    T_base_tracker_ = setup.T_tracker_base.inverse();
    by_stamp_.resize(streams.tracker.size());
    for (std::size_t k = 0; k < by_stamp_.size(); ++k) by_stamp_[k] = k;
    std::stable_sort(by_stamp_.begin(), by_stamp_.end(),
                     [&](std::size_t a, std::size_t b) { return streams.tracker[a].t < streams.tracker[b].t; });
    for (const FrameSample& sample : streams.plan) {
      CompensationRow row;
      row.t = sample.t - setup.controller_clock_offset + setup.actuator_lag;
      result_.rows.push_back(row);
    }
    by_time_.resize(result_.rows.size());
    for (std::size_t k = 0; k < by_time_.size(); ++k) by_time_[k] = k;
    std::stable_sort(by_time_.begin(), by_time_.end(),
                     [&](std::size_t a, std::size_t b) { return result_.rows[a].t < result_.rows[b].t; });
  }

  ReplayResult run(const std::function<bool(double)>& progress) {
    const std::size_t all =
        streams_.imu.size() + streams_.tracker.size() + streams_.flange.size() + streams_.plan.size();
    const std::size_t step = std::max<std::size_t>(1, all / 100);
    for (std::size_t done = 0; push_next(); ++done) {
      if (now_ > kNever) make_what_is_due();
      if (progress && done % step == 0 && !progress(static_cast<double>(done) / static_cast<double>(all))) {
        result_.stopped = true;
        break;
      }
    }
    std::stable_sort(result_.graded.begin(), result_.graded.end(),
                     [](const GradedPrediction& a, const GradedPrediction& b) { return a.t < b.t; });
    result_.counters = tracker_.counters();
    result_.clock = tracker_.clock();
    result_.noise = tracker_.noise();
    return std::move(result_);
  }

 private:
  /// The sample that arrives next, of any stream; the plan first, then joints and tracker, where several arrive at
  /// once.
  bool push_next() {
    const double plan = plan_ < streams_.plan.size() ? streams_.plan[plan_].arrival : kNotYet,
                 flange = flange_ < streams_.flange.size() ? streams_.flange[flange_].arrival : kNotYet;
    const double pose = pose_ < streams_.tracker.size() ? streams_.tracker[pose_].arrival : kNotYet,
                 imu = imu_ < streams_.imu.size() ? streams_.imu[imu_].arrival : kNotYet;
    const double first = std::min({plan, flange, pose, imu});
    if (first == kNotYet) return false;
    if (plan == first) {
      const FrameSample& sample = streams_.plan[plan_++];
      tracker_.push_plan(sample.t, sample.T_base_frame);
    } else if (flange == first) {
      const FrameSample& sample = streams_.flange[flange_++];
      if (accepted(tracker_.push_joints(sample.t, sample.T_base_frame))) {
        const double t = sample.t - setup_.controller_clock_offset;
        flanges_.push(t, sample.T_base_frame);
        now_ = std::max(now_, t);
      }
    } else if (pose == first) {
      const PoseSample& sample = streams_.tracker[pose_++];
      if (accepted(tracker_.push_pose(sample))) poses_.push(sample.t, T_base_tracker_ * frame_of(sample));
    } else {
      const ImuSample& sample = streams_.imu[imu_++];
      if (accepted(tracker_.push_imu(sample))) now_ = std::max(now_, sample.t);
    }
    return true;
  }

  void make_what_is_due() {
    if (start_ == kNever) start_ = next_timeline_ = now_;
    compensate_due();
    for (std::size_t k = 0; k < options_.horizons.size(); ++k) grade_due(k);
    if (now_ >= next_timeline_) note();
  }

  /// Rows of the plan whose instant is the horizon away.
  void compensate_due() {
    const double until = now_ + options_.track.deviation.horizon;
    for (; next_row_ < by_time_.size() && result_.rows[by_time_[next_row_]].t <= until; ++next_row_) {
      CompensationRow& row = result_.rows[by_time_[next_row_]];
      if (row.t < now_ - kLate) continue;
      row.compensation = tracker_.compensate(row.t);
      row.made = row.compensation.has_plan && row.compensation.predicted.status != Status::lost;
    }
  }

  /// Tracker samples that will have been taken a horizon from now: their stamps are known here, what they say is not
  /// looked at until the prediction is made.
  void grade_due(std::size_t which) {
    const double horizon = options_.horizons[which];
    for (std::size_t& next = next_grade_[which]; next < by_stamp_.size(); ++next) {
      const PoseSample& later = streams_.tracker[by_stamp_[next]];
      const double t = later.t - offset_;
      if (t > now_ + horizon) return;
      if (t < now_ + horizon - kLate || !std::isfinite(later.t)) continue;
      result_.graded.push_back(graded(later, t, horizon));
    }
  }

  GradedPrediction graded(const PoseSample& later, double t, double horizon) {
    GradedPrediction out;
    const PosePrediction predicted = tracker_.predict(t);
    out.t = t, out.made = predicted.made, out.horizon = horizon, out.status = predicted.status,
    out.predictor = predicted.predictor;
    const Isometry3d T_base_receiver = predicted.T_base_tool * T_tool_receiver_,
                     measured = T_base_tracker_ * frame_of(later);
    out.baselines = baselines(later.t, t, measured.translation());
    if (predicted.status == Status::lost) return out;
    out.dimensions = later.has_orientation() ? 6 : 3;
    out.position = measured.translation() - T_base_receiver.translation();
    if (out.dimensions == 6)
      out.rotation = log_rotation(Quaterniond(measured.linear() * T_base_receiver.linear().transpose()));
    Matrix6d S = carried(predicted.covariance, T_base_receiver.translation() - predicted.T_base_tool.translation());
    const TrackerNoise noise = tracker_.noise();
    S.diagonal().head<3>().array() += noise.position * noise.position;
    S.diagonal().tail<3>().array() += noise.rotation * noise.rotation;
    out.position_sigma = S.diagonal().head<3>().cwiseSqrt();
    Vector6d e;
    e << out.position, out.rotation;
    out.squares = out.dimensions == 6 ? e.dot(solve_symmetric<6, 1>(S, e))
                                      : e.head<3>().dot(solve_symmetric<3, 1>(S.topLeftCorner<3, 3>(), e.head<3>()));
    return out;
  }

  std::array<double, kBaselines> baselines(double stamp, double t, const Vector3d& measured) const {
    std::array<double, kBaselines> out;
    out.fill(kNotYet);
    const auto set = [&](Baseline which, const Vector3d& receiver) {
      out[static_cast<std::size_t>(which)] = (measured - receiver).norm();
    };
    const Vector3d lever = setup_.T_flange_receiver.translation();
    if (poses_.any()) set(Baseline::hold, poses_.held().translation());
    if (poses_.two()) set(Baseline::velocity, poses_.at(stamp).translation());
    if (flanges_.any()) set(Baseline::fk, flanges_.held() * lever);
    if (flanges_.two()) set(Baseline::fk_velocity, flanges_.at(t) * lever);
    return out;
  }

  /// A row of the timeline; what has settled since the last one is taken out of the tracker.
  void note() {
    TimelineRow row;
    const PosePrediction predicted = tracker_.predict(now_ + options_.track.deviation.horizon);
    row.t = now_, row.status = predicted.status, row.predictor = predicted.predictor;
    row.clock = tracker_.clock();
    row.frequencies = tracker_.frequencies();
    result_.timeline.push_back(row);
    offset_ = row.clock.offset;
    next_timeline_ = now_ + kTimelineStep;
    if (tracker_.shift().count > result_.shifts.size())
      result_.shifts.push_back(tracker_.shift());
    else if (!result_.shifts.empty())
      result_.shifts.back() = tracker_.shift();  // its cause becomes clearer
    Innovation innovations[64];
    for (int n; (n = tracker_.take_innovations(innovations, 64)) > 0;)
      result_.innovations.insert(result_.innovations.end(), innovations, innovations + n);
    DeviationRow rows[64];
    for (int n; (n = tracker_.take_rows(rows, 64)) > 0;) {
      if (learning()) rows_.insert(rows_.end(), rows, rows + n);
    }
    if (learning() && now_ - start_ >= options_.learn_modes) learn();
  }

  bool learning() const { return options_.learn_modes > 0.0 && !learnt_; }

  /// Modes of what has been recorded so far; the first moments, in which the filter settles, tell nothing.
  void learn() {
    learnt_ = true;
    const double settled = start_ + std::min(3.0, 0.2 * options_.learn_modes);
    rows_.erase(rows_.begin(),
                std::find_if(rows_.begin(), rows_.end(), [&](const DeviationRow& row) { return row.t >= settled; }));
    if (rows_.size() < kFewestRows) return;
    result_.modes = identify_modes(rows_, options_.track.deviation);
    rows_.clear();
    if (result_.modes.model.count == 0) return;
    tracker_.set_modes(result_.modes.model);
    result_.modes_from = now_;
  }

  const RecordedStreams& streams_;
  const TrackSetup& setup_;
  const ReplayOptions& options_;
  Tracker tracker_;
  ReplayResult result_;
  Isometry3d T_tool_receiver_, T_base_tracker_;
  std::vector<std::size_t> by_stamp_, by_time_, next_grade_;  // places in the tracker's stream and in the plan
  LastTwo poses_, flanges_;
  std::vector<DeviationRow> rows_;
  std::size_t imu_ = 0, pose_ = 0, flange_ = 0, plan_ = 0, next_row_ = 0;
  double now_ = kNever, start_ = kNever, next_timeline_ = 0.0, offset_ = setup_.clock_offset;
  bool learnt_ = false;
};

}  // namespace

const char* name(Baseline baseline) {
  static const char* const names[] = {"hold", "velocity", "fk", "fk_velocity"};
  return names[static_cast<std::size_t>(baseline)];
}

bool ReplayOptions::is_valid(std::string* error) const {
  if (!track.is_valid(error)) return false;
  const auto no = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  for (const double horizon : horizons) {
    if (!(horizon >= 0.0 && horizon <= 1.0)) return no("horizons must be from 0 to 1 s");
  }
  if (!(learn_modes >= 0.0 && std::isfinite(learn_modes))) return no("learn_modes must not be below 0");
  return true;
}

ReplayResult replay(const RecordedStreams& streams, const TrackSetup& setup, const ReplayOptions& options,
                    const std::function<bool(double)>& progress) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("ReplayOptions: " + error);
  require_sorted(streams.imu, "imu");
  require_sorted(streams.tracker, "tracker");
  require_sorted(streams.flange, "flange");
  require_sorted(streams.plan, "plan");
  return Replay(streams, setup, options).run(progress);
}

}  // namespace truing
