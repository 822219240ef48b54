// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Tracking of simulated swaying arms with known truth: every row has its target, and what other programs do is
// implemented beside it.
//
//     bench_track [seeds, default 5] [seeds of consistency, default 100] [part of a row's name, default all] [hours of
//     watching, default 8] [first seed, default 1]
//
// Seeds: the arm of row seed s is drawn by s; its recording for the modes is made by s, what is predicted by 1000 + s;
// ten minutes of watching are drawn by 5000 + s. Times are CPU times. bench/track.py makes a page of the output.

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "math/random.hpp"
#include "math/rotation.hpp"
#include "tracking/pose_filter.hpp"
#include "truing/tracking/simulation.hpp"
#include "truing/tracking/tracker.hpp"

namespace {

using namespace truing;
using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using math::exp_rotation;
using math::log_rotation;
using math::Matrix6d;
using math::Vector6d;
using tracking::Belief;
using tracking::Motion;
using tracking::PoseFilter;

constexpr double kWarmUp = 5.0;  // what comes before is not graded [s]
int first_seed = 1;

double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// ---- Playing streams in the order of their arrival ------------------------------------------------------------------

/// Pushes everything that has arrived before each inertial sample, then that sample, then calls `then` with it.
void play(const SimulatedStreams& streams, Tracker* tracker, const std::function<void(const ImuSample&)>& then) {
  std::size_t pose = 0, flange = 0, plan = 0;
  for (const ImuSample& sample : streams.imu) {
    for (; plan < streams.plan.size() && streams.plan[plan].arrival < sample.arrival; ++plan)
      tracker->push_plan(streams.plan[plan].t, streams.plan[plan].T_base_frame);
    for (; pose < streams.tracker.size() && streams.tracker[pose].arrival < sample.arrival; ++pose)
      tracker->push_pose(streams.tracker[pose]);
    for (; flange < streams.flange.size() && streams.flange[flange].arrival < sample.arrival; ++flange)
      tracker->push_joints(streams.flange[flange].t, streams.flange[flange].T_base_frame);
    tracker->push_imu(sample);
    then(sample);
  }
}

/// The true deviation from what is predicted: position [m] and rotation vector [rad] in the base frame.
Vector6d error_of(const Isometry3d& truth, const Isometry3d& predicted) {
  Vector6d out;
  out << truth.translation() - predicted.translation(),
      log_rotation(Quaterniond(truth.linear() * predicted.linear().transpose()));
  return out;
}

struct Sum {
  double squares = 0.0, n = 0.0, largest = 0.0;
  void add(double x) { squares += x * x, n += 1.0, largest = std::max(largest, std::abs(x)); }
  double rms() const { return n > 0.0 ? std::sqrt(squares / n) : 0.0; }
};

void row(const char* what, double value, const char* unit, const char* target, bool reached) {
  std::printf("  %-74s %10.3f %-4s  target %-12s %s\n", what, value, unit, target, reached ? "reached" : "MISSED");
  std::fflush(stdout);
}
void line(const char* what, double value, const char* unit) {
  std::printf("  %-74s %10.3f %-4s\n", what, value, unit);
  std::fflush(stdout);
}

// ---- What others do -------------------------------------------------------------------------------------------------

/// Constant velocity or acceleration of the pose from the filter's state, at the tool.
Isometry3d extrapolated(const Motion& motion, double h, bool acceleration, const Isometry3d& T_imu_tool) {
  Isometry3d out = Isometry3d::Identity();
  out.translation() = motion.x.p + h * motion.x.v + (acceleration ? 0.5 * h * h : 0.0) * motion.acceleration;
  out.linear() = (exp_rotation(h * motion.rate) * motion.x.q).toRotationMatrix();
  return out * T_imu_tool;
}

/// The last tracker sample and the speed between the last two, with their stamps known.
class FiniteDifference {
 public:
  void push(const PoseSample& sample, const TrackSetup& setup) {
    if (sample.t <= t_) return;
    Isometry3d T = Isometry3d::Identity();
    T.translation() = sample.position;
    T.linear() = sample.orientation.toRotationMatrix();
    before_ = now_, before_t_ = t_;
    now_ = setup.T_tracker_base.inverse() * T * setup.T_flange_receiver.inverse();
    t_ = sample.t;
  }
  Isometry3d held() const { return now_; }
  Isometry3d at(double t) const {
    const double ratio = (t - t_) / (t_ - before_t_);
    return math::between(before_, now_, 1.0 + ratio);
  }

 private:
  Isometry3d before_ = Isometry3d::Identity(), now_ = Isometry3d::Identity();
  double before_t_ = -1.0, t_ = 0.0;
};

// ---- Recordings -----------------------------------------------------------------------------------------------------

StreamSimulationOptions arm(SimulatedMotion motion, std::uint64_t seed, double seconds) {
  StreamSimulationOptions options;
  options.motion = motion;
  options.seed = seed;
  options.seconds = seconds;
  options.tip_speed = motion == SimulatedMotion::stop_and_go ? 1.2 : 0.35;
  options.tracker.out_of_order = 0.02;
  return options;
}

/// Modes from a minute of the same arm in another run.
ModesResult modes_of(const SimulatedStreams& recording, const TrackOptions& options) {
  std::vector<DeviationRow> rows;
  DeviationRow buffer[64];
  Tracker tracker(recording.setup, options);
  int k = 0;
  play(recording, &tracker, [&](const ImuSample&) {
    if (++k % 100 != 0) return;
    const int n = tracker.take_rows(buffer, 64);
    rows.insert(rows.end(), buffer, buffer + n);
  });
  rows.erase(rows.begin(),
             std::upper_bound(rows.begin(), rows.end(), 3.0, [](double t, const DeviationRow& r) { return t < r.t; }));
  return identify_modes(rows, options.deviation);
}

ModalModel with_error(ModalModel model, double fraction) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(model.count); ++k)
    model.frequency[k] *= k % 2 == 0 ? 1.0 + fraction : 1.0 - fraction;
  return model;
}

// ---- Rows -----------------------------------------------------------------------------------------------------------

enum PredictionMethod { kHold, kNow, kDifference, kVelocity, kAcceleration, kNoModes, kOurs, kMethods };

/// What predictions of the tool are worth, over seeds.
struct PredictionScore {
  Sum errors[kMethods], frequency;
  double worst_ratio = 0.0, used_modes = 0.0, made = 0.0, nees = 0.0;

  double millimetres(PredictionMethod method) const { return 1e3 * errors[method].rms(); }
};

/// How far each identified frequency is from the nearest true one, as a fraction of it.
void add_frequency_errors(const ModalModel& found, const std::vector<FlexibleMode>& modes, Sum* frequency) {
  for (std::size_t k = 0; k < static_cast<std::size_t>(found.count); ++k) {
    double nearest = 1e9;
    for (const FlexibleMode& mode : modes)
      nearest = std::min(nearest, std::abs(found.frequency[k] / mode.frequency - 1.0));
    frequency->add(nearest);
  }
}

/// What others do, fed in the order of arrival.
class OtherPredictors {
 public:
  OtherPredictors(const SimulatedStreams& streams, const TrackOptions& options)
      : without_modes(streams.setup, options),
        replay(streams.setup, options.filter),
        late(streams.setup, options.filter),
        streams_(streams) {}

  void push(const ImuSample& sample) {
    for (; plan_ < streams_.plan.size() && streams_.plan[plan_].arrival < sample.arrival; ++plan_)
      without_modes.push_plan(streams_.plan[plan_].t, streams_.plan[plan_].T_base_frame);
    for (; flange_ < streams_.flange.size() && streams_.flange[flange_].arrival < sample.arrival; ++flange_)
      without_modes.push_joints(streams_.flange[flange_].t, streams_.flange[flange_].T_base_frame);
    for (; pose_ < streams_.tracker.size() && streams_.tracker[pose_].arrival < sample.arrival; ++pose_) {
      replay.push_pose(streams_.tracker[pose_]);
      without_modes.push_pose(streams_.tracker[pose_]);
      difference.push(streams_.tracker[pose_], streams_.setup);
      PoseSample as_if_now = streams_.tracker[pose_];
      as_if_now.t = sample.t - 1e-6;
      late.push_pose(as_if_now);
    }
    replay.push_imu(sample);
    late.push_imu(sample);
    without_modes.push_imu(sample);
  }

  Tracker without_modes;
  PoseFilter replay;
  PoseFilter late;  ///< takes a late pose as if it were of now
  FiniteDifference difference;

 private:
  const SimulatedStreams& streams_;
  std::size_t pose_ = 0, flange_ = 0, plan_ = 0;
};

/// Errors of all methods along one recording, by a tracker that carries the identified modes.
void score_predictions(const SimulatedStreams& streams, const TrackOptions& options, const ModalModel& modes,
                       double seconds, PredictionScore* score) {
  const Isometry3d T_imu_tool = streams.setup.T_flange_imu.inverse() * streams.setup.T_flange_tool;
  const double horizon = options.deviation.horizon;
  OtherPredictors others(streams, options);
  TrackOptions with_modes = options;
  with_modes.modes = modes;
  Tracker tracker(streams.setup, with_modes);
  Sum own, acceleration;
  int k = 0;
  play(streams, &tracker, [&](const ImuSample& sample) {
    others.push(sample);
    if (++k % 10 != 0) return;
    others.replay.update();
    others.late.update();
    const double t = sample.t + horizon;
    const PosePrediction ours = tracker.predict(t), no_modes = others.without_modes.predict(t);
    if (sample.t < kWarmUp || t > seconds) return;
    const Isometry3d truth = streams.tool_at(t);
    const auto add = [&](PredictionMethod method, const Isometry3d& T) {
      const double error = (truth.translation() - T.translation()).norm();
      score->errors[method].add(error);
      return error;
    };
    const Motion replayed = others.replay.motion_at(sample.t);
    add(kHold, others.difference.held() * streams.setup.T_flange_tool);
    add(kNow, extrapolated(others.late.motion_at(sample.t), horizon, false, T_imu_tool));
    add(kDifference, others.difference.at(t) * streams.setup.T_flange_tool);
    add(kVelocity, extrapolated(replayed, horizon, false, T_imu_tool));
    acceleration.add(add(kAcceleration, extrapolated(replayed, horizon, true, T_imu_tool)));
    add(kNoModes, no_modes.T_base_tool);
    own.add(add(kOurs, ours.T_base_tool));
    const Vector6d e = error_of(truth, ours.T_base_tool);
    score->nees += e.dot(ours.covariance.ldlt().solve(e));
    score->used_modes += ours.predictor == Predictor::modes ? 1.0 : 0.0;
    score->made += 1.0;
  });
  score->worst_ratio = std::max(score->worst_ratio, own.rms() / acceleration.rms());
}

void print_predictions(const PredictionScore& score, SimulatedMotion motion, double horizon, double frequency_error) {
  line("hold: the last tracker sample", score.millimetres(kHold), "mm");
  line("filter, late pose used as if now, constant velocity", score.millimetres(kNow), "mm");
  line("tracker and finite-difference velocity", score.millimetres(kDifference), "mm");
  line("filter with replay, constant velocity", score.millimetres(kVelocity), "mm");
  line("filter with replay, constant acceleration", score.millimetres(kAcceleration), "mm");
  line("truing without modes (plan, deviation at constant acceleration)", score.millimetres(kNoModes), "mm");
  char what[120];
  std::snprintf(what, sizeof what, "truing, identified modes%s",
                frequency_error > 0.0 ? " with 5 % frequency error" : "");
  const bool gentle = motion == SimulatedMotion::gentle;
  const double ours = score.millimetres(kOurs), made = std::max(1.0, score.made);
  if (gentle && horizon < 0.05)
    row(what, ours, "mm", "<= 0.5 mm", ours <= 0.5);
  else if (!gentle && horizon > 0.05)
    row(what, ours, "mm", "<= 1.0 mm", ours <= 1.0);
  else
    line(what, ours, "mm");
  row("worst seed against constant acceleration", score.worst_ratio, "", "<= 1.10", score.worst_ratio <= 1.1);
  line("predictions by modes", 100.0 * score.used_modes / made, "%");
  line("mean NEES of predictions (6 expected, below: cautious)", score.nees / made, "");
  line("identified frequencies, rms error", 100.0 * score.frequency.rms(), "%");
}

/// Predictions of the tool, ours and others', over seeds.
void predictions(SimulatedMotion motion, double horizon, int seeds, double frequency_error) {
  PredictionScore score;
  for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
    StreamSimulationOptions simulation = arm(motion, static_cast<std::uint64_t>(seed), 60.0);
    const SimulatedStreams recording = simulate_streams(large_boom(), simulation);
    TrackOptions options;
    options.deviation.horizon = horizon;
    const ModesResult found = modes_of(recording, options);
    add_frequency_errors(found.model, recording.modes, &score.frequency);
    simulation.modes = recording.modes;
    simulation.frequency_spread = 0.0;
    simulation.seed = static_cast<std::uint64_t>(1000 + seed);
    simulation.seconds = 45.0;
    const SimulatedStreams streams = simulate_streams(large_boom(), simulation);
    score_predictions(streams, options, with_error(found.model, frequency_error), simulation.seconds, &score);
  }
  std::printf("%s motion, %.0f ms ahead, position error of the tool, rms over %d seeds\n",
              motion == SimulatedMotion::gentle ? "gentle" : "stop-and-go", 1e3 * horizon, seeds);
  print_predictions(score, motion, horizon, frequency_error);
}

/// NEES of the filter and of its clock offset over seeds, one instant of each run.
void consistency(int seeds, double offset, double drift, bool estimate) {
  double nees = 0.0, clock_within = 0.0, clock_worst = 0.0;
  Sum position, clock;
  for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
    StreamSimulationOptions simulation = arm(SimulatedMotion::gentle, static_cast<std::uint64_t>(seed), 20.0);
    simulation.tracker.clock_offset = offset;
    simulation.tracker.clock_drift = drift;
    const SimulatedStreams streams = simulate_streams(large_boom(), simulation);
    TrackSetup setup = streams.setup;
    setup.clock_offset = 0.0;
    setup.clock_offset_sigma = estimate ? 0.01 : 0.0;
    FilterOptions options;  // as the simulated sensor's data sheet has it
    options.gyro_bias_walk = simulation.imu.gyro_bias_walk;
    options.accel_bias_walk = simulation.imu.accel_bias_walk;
    options.imu_scale = simulation.imu.gyro_scale;
    PoseFilter filter(setup, options);
    std::size_t pose = 0;
    Belief belief;
    for (const ImuSample& sample : streams.imu) {
      for (; pose < streams.tracker.size() && streams.tracker[pose].arrival < sample.arrival; ++pose)
        filter.push_pose(streams.tracker[pose]);
      filter.push_imu(sample);
      if (static_cast<long>(sample.t * 1000.0 + 0.5) % 500 != 0 || sample.t < kWarmUp) continue;
      filter.update();
      belief = filter.belief_at(sample.t);
      position.add(((streams.flange_at(belief.t) * streams.setup.T_flange_imu).translation() - belief.x.p).norm());
    }
    filter.update();
    belief = filter.belief_at(filter.newest_imu());
    const Isometry3d truth = streams.flange_at(belief.t) * streams.setup.T_flange_imu;
    Isometry3d found = Isometry3d::Identity();
    found.translation() = belief.x.p;
    found.linear() = belief.x.q.toRotationMatrix();
    Matrix6d P;
    P << belief.P.block<3, 3>(tracking::kP, tracking::kP), belief.P.block<3, 3>(tracking::kP, tracking::kTheta),
        belief.P.block<3, 3>(tracking::kTheta, tracking::kP), belief.P.block<3, 3>(tracking::kTheta, tracking::kTheta);
    const Vector6d e = error_of(truth, found);
    nees += e.dot(P.ldlt().solve(e)) / seeds;
    const double error = belief.x.clock - (offset + drift * belief.t),
                 sigma = std::sqrt(belief.P(tracking::kClock, tracking::kClock));
    clock.add(error);
    if (sigma > 0.0) clock_worst = std::max(clock_worst, std::abs(error) / sigma);
    if (std::abs(error) <= 3.0 * sigma) clock_within += 1.0;
  }
  // 95 % band of the mean of `seeds` chi-square values of six degrees (Wilson and Hilferty).
  const double n = 6.0 * seeds, spread = 1.96 * std::sqrt(2.0 / (9.0 * n)), centre = 1.0 - 2.0 / (9.0 * n);
  const double low = 6.0 * std::pow(centre - spread, 3), high = 6.0 * std::pow(centre + spread, 3);
  char band[40];
  std::snprintf(band, sizeof band, "%.2f-%.2f", low, high);
  std::printf("clock offset %.0f ms, drift %.0f ppm, %s, %d seeds\n", 1e3 * offset, 1e6 * drift,
              estimate ? "estimated" : "not estimated", seeds);
  if (estimate || offset == 0.0)
    row("NEES of the pose at the end of the run", nees, "", band, nees >= low && nees <= high);
  else
    line("NEES of the pose at the end of the run", nees, "");
  const double rms = position.rms();
  if (estimate)
    row("position error now", 1e3 * rms, "mm", "<= 1.0 mm", rms <= 1e-3);
  else
    line("position error now", 1e3 * rms, "mm");
  if (estimate) {
    line("clock offset, rms error", 1e3 * clock.rms(), "ms");
    row("clock offset within 3 sigma", 100.0 * clock_within / seeds, "%", ">= 99 %", clock_within >= 0.99 * seeds);
    line("largest error of the clock offset in sigmas", clock_worst, "");
  }
}

/// The same samples in order and shuffled within the window: largest difference of states.
void order(int seeds) {
  double largest = 0.0;
  for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
    StreamSimulationOptions simulation = arm(SimulatedMotion::stop_and_go, static_cast<std::uint64_t>(seed), 6.0);
    simulation.tracker.clock_offset = 0.004;
    SimulatedStreams streams = simulate_streams(large_boom(), simulation);
    TrackSetup setup = streams.setup;
    setup.clock_offset = 0.0;
    setup.clock_offset_sigma = 0.01;
    Belief end[2];
    for (int shuffled = 0; shuffled < 2; ++shuffled) {
      math::Random random(static_cast<std::uint64_t>(seed));
      struct Item {
        double arrival;
        bool pose;
        std::size_t k;
      };
      std::vector<Item> items;
      for (std::size_t k = 0; k < streams.tracker.size(); ++k)
        items.push_back({streams.tracker[k].t + (shuffled ? random.uniform(0.0, 0.45) : 0.01), true, k});
      for (std::size_t k = 0; k < streams.flange.size(); ++k)
        items.push_back({streams.flange[k].t + (shuffled ? random.uniform(0.0, 0.45) : 0.01), false, k});
      std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.arrival < b.arrival; });
      PoseFilter filter(setup, FilterOptions());
      std::size_t item = 0;
      for (const ImuSample& sample : streams.imu) {
        for (; item < items.size() && items[item].arrival < sample.t; ++item) {
          if (items[item].pose)
            filter.push_pose(streams.tracker[items[item].k]);
          else
            filter.push_flange(streams.flange[items[item].k].t, streams.flange[items[item].k].T_base_frame);
        }
        filter.push_imu(sample);
        if (static_cast<long>(sample.t * 1000.0 + 0.5) % 37 == 0) filter.update();
      }
      for (; item < items.size(); ++item) {
        if (items[item].pose)
          filter.push_pose(streams.tracker[items[item].k]);
        else
          filter.push_flange(streams.flange[items[item].k].t, streams.flange[items[item].k].T_base_frame);
      }
      filter.update();
      end[shuffled] = filter.belief_at(filter.newest_imu());
    }
    largest = std::max({largest, (end[0].x.p - end[1].x.p).cwiseAbs().maxCoeff(),
                        (end[0].x.v - end[1].x.v).cwiseAbs().maxCoeff(),
                        (end[0].x.q.coeffs() - end[1].x.q.coeffs()).cwiseAbs().maxCoeff(),
                        (end[0].P - end[1].P).cwiseAbs().maxCoeff()});
  }
  std::printf("order of arrival, delays up to 0.45 s in a window of 0.5 s, %d seeds\n", seeds);
  row("largest difference from in-order (1e-12)", largest * 1e12, "", "<= 1", largest <= 1e-12);
}

/// Dropouts of the tracker: is the truth inside 3 sigma, and is there a step in what is sent when it returns?
void dropouts(double seconds, int seeds) {
  double outside = 0.0, graded = 0.0, rate = 0.0, jerk = 0.0, worst = 0.0, runs_outside = 0.0;
  Sum error;
  TrackOptions options;
  for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
    StreamSimulationOptions simulation = arm(SimulatedMotion::stop_and_go, static_cast<std::uint64_t>(seed), 40.0);
    simulation.dropouts = {{20.0, seconds}};
    const SimulatedStreams streams = simulate_streams(large_boom(), simulation);
    Tracker tracker(streams.setup, options);
    int k = 0;
    Vector3d x[4] = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
    int sent = 0;
    const double before = outside;
    play(streams, &tracker, [&](const ImuSample& sample) {
      if (++k % 10 != 0 || sample.t < 1.0) return;
      const Compensation compensation = tracker.compensate(sample.t + 0.04);
      std::rotate(x, x + 3, x + 4);
      x[0] = compensation.correction.head<3>();
      ++sent;
      if (sample.t < 19.0 || sample.t > 22.0 + seconds || sample.t > 39.8 || sent < 4) return;
      rate = std::max(rate, (x[0] - x[1]).norm() / 0.01);
      jerk = std::max(jerk, (x[0] - 3.0 * x[1] + 3.0 * x[2] - x[3]).norm() / 1e-6);
      if (sample.t < 20.0 || sample.t > 20.0 + seconds + 0.03) return;
      const PosePrediction now = tracker.predict(sample.t);
      const Vector6d e = error_of(streams.tool_at(sample.t), now.T_base_tool);
      error.add(e.head<3>().norm());
      for (int i = 0; i < 6; ++i) {
        const double ratio = std::abs(e[i]) / std::sqrt(now.covariance(i, i));
        worst = std::max(worst, ratio);
        if (ratio > 3.0) outside += 1.0;
        graded += 1.0;
      }
    });
    if (outside > before) runs_outside += 1.0;
  }
  std::printf("dropout of %.1f s in stop-and-go motion, %d seeds\n", seconds, seeds);
  line("position error during it, rms", 1e3 * error.rms(), "mm");
  line("position error during it, largest", 1e3 * error.largest, "mm");
  row("components outside 3 sigma (0.27 % expected, errors of one run are alike)",
      100.0 * outside / std::max(1.0, graded), "%", "<= 0.5 %", outside <= 0.005 * graded);
  line("dropouts with a component outside 3 sigma at any moment", runs_outside, "");
  line("largest error in sigmas", worst, "");
  row("highest rate sent around it", rate, "m/s", "<= limit", rate <= 1.001 * options.limits.position_rate);
  row("highest jerk sent around it", jerk, "m/s3", "<= limit", jerk <= 1.001 * options.limits.position_jerk);
}

/// Shifts of a base station after 20 s, and hours without one.
void watch(int seeds, double hours) {
  const auto told = [](const StreamSimulationOptions& simulation, double start, double* delay) {
    const SimulatedStreams streams = simulate_streams(large_boom(), simulation);
    Tracker tracker(streams.setup);
    std::uint64_t before = 0;
    int k = 0;
    *delay = -1.0;
    play(streams, &tracker, [&](const ImuSample& sample) {
      if (++k % 50 != 0) return;
      const std::uint64_t count = tracker.shift().count;
      if (sample.t < start)
        before = count;
      else if (count > before && *delay < 0.0)
        *delay = sample.t - start;
    });
    return before;
  };
  double slowest = 0.0, missed = 0.0, early = 0.0;
  for (int seed = first_seed; seed < first_seed + seeds; ++seed) {
    for (const bool turned : {false, true}) {
      for (const SimulatedMotion motion : {SimulatedMotion::gentle, SimulatedMotion::stop_and_go}) {
        StreamSimulationOptions simulation = arm(motion, static_cast<std::uint64_t>(seed), 23.0);
        math::Random random(static_cast<std::uint64_t>(seed));
        const Vector3d direction = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
        StationShift shift;
        shift.start = 20.0;
        if (turned)
          shift.T_old_new.linear() = exp_rotation(M_PI / 1800.0 * direction).toRotationMatrix();
        else
          shift.T_old_new.translation() = 0.005 * direction;
        simulation.shifts = {shift};
        double delay = 0.0;
        early += static_cast<double>(told(simulation, 20.0, &delay));
        if (delay < 0.0) missed += 1.0;
        slowest = std::max(slowest, delay);
      }
    }
  }
  std::printf("base station shifted by 5 mm or 0.1 degrees in any direction, gentle and stop-and-go, %d seeds\n",
              seeds);
  row("not noticed", missed, "", "0", missed == 0.0);
  row("slowest", slowest, "s", "< 2 s", slowest < 2.0);
  double alarms = early, seconds = 0.0;
  for (std::uint64_t seed = 5000 + static_cast<std::uint64_t>(first_seed); seconds < 3600.0 * hours; ++seed) {
    StreamSimulationOptions simulation =
        arm(seed % 2 == 0 ? SimulatedMotion::gentle : SimulatedMotion::stop_and_go, seed, 600.0);
    simulation.tracker.lost = 0.01;
    if (seed % 4 < 2) simulation.dropouts = {{100.0, 0.5}, {200.0, 2.0}, {300.0, 10.0}};
    double delay = 0.0;
    alarms += static_cast<double>(told(simulation, 1e9, &delay));
    seconds += 600.0;
  }
  char what[80];
  std::snprintf(what, sizeof what, "false alarms in %.1f simulated hours", seconds / 3600.0);
  row(what, alarms, "", "< 1 in 8 h", alarms < std::max(1.0, seconds / 3600.0 / 8.0));
}

/// CPU time with predictions every 10 ms, and of single late updates.
void cost() {
  const SimulatedStreams streams = simulate_streams(large_boom(), arm(SimulatedMotion::stop_and_go, 1, 60.0));
  TrackOptions options;
  options.modes = modes_of(streams, options).model;
  double best = 1e9;
  for (int run = 0; run < 3; ++run) {
    Tracker tracker(streams.setup, options);
    int k = 0;
    const double start = cpu_seconds();
    play(streams, &tracker, [&](const ImuSample& sample) {
      if (++k % 10 == 0) tracker.predict(sample.t + 0.04);
    });
    best = std::min(best, cpu_seconds() - start);
  }
  const auto samples = static_cast<double>(streams.imu.size() + streams.tracker.size() + streams.flange.size());
  // A late update: one tracker sample held back by 30 to 80 ms or by up to 0.45 s, and a prediction right after it.
  std::printf("cost on one core, 1 kHz inertial, 100 Hz tracker, 250 Hz joints, prediction every 10 ms, four modes\n");
  row("a sample (of any sensor), predictions included", 1e6 * best / samples, "us", "<= 2 us",
      1e6 * best / samples <= 2.0);
  line("an inertial sample, everything else included", 1e6 * best / static_cast<double>(streams.imu.size()), "us");
  for (const double delay : {0.03, 0.45}) {
    Tracker tracker(streams.setup, options);
    std::vector<double> times;
    std::size_t pose = 0, flange = 0, plan = 0;
    for (const ImuSample& sample : streams.imu) {
      for (; plan < streams.plan.size() && streams.plan[plan].arrival < sample.arrival; ++plan)
        tracker.push_plan(streams.plan[plan].t, streams.plan[plan].T_base_frame);
      for (; flange < streams.flange.size() && streams.flange[flange].arrival < sample.arrival; ++flange)
        tracker.push_joints(streams.flange[flange].t, streams.flange[flange].T_base_frame);
      tracker.push_imu(sample);
      // With the long delay every tenth sample is that late, the others are not: the whole window is worked off again.
      for (; pose < streams.tracker.size() && streams.tracker[pose].t + 0.03 < sample.t; ++pose) {
        const bool held = delay > 0.1 && pose % 10 == 0;
        const std::size_t which = held ? (pose >= 42 ? pose - 42 : pose) : pose;
        if (delay > 0.1 && !held && (pose + 42) % 10 == 0 && pose + 42 < streams.tracker.size()) continue;
        const double start = cpu_seconds();
        tracker.push_pose(streams.tracker[which]);
        tracker.predict(sample.t + 0.04);
        if (delay < 0.1 || held) times.push_back(cpu_seconds() - start);
      }
    }
    std::sort(times.begin(), times.end());
    char what[100];
    std::snprintf(what, sizeof what, "an update %.0f ms late with the prediction after it, p99", 1e3 * delay);
    const double p99 = times[times.size() * 99 / 100];
    row(what, 1e6 * p99, "us", "< 500 us", p99 < 500e-6);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 5, many = argc > 2 ? std::atoi(argv[2]) : 100;
  const std::string only = argc > 3 ? argv[3] : "";
  const double hours = argc > 4 ? std::atof(argv[4]) : 8.0;
  first_seed = argc > 5 ? std::atoi(argv[5]) : 1;
  std::printf("command: bench_track");
  for (int k = 1; k < argc; ++k) std::printf(" %s", argv[k][0] == '\0' ? "\"\"" : argv[k]);
  std::printf("\n");
  const auto wanted = [&](const char* name) {
    return only.empty() || std::string(name).find(only) != std::string::npos;
  };
  if (wanted("gentle")) {
    predictions(SimulatedMotion::gentle, 0.04, seeds, 0.0);
    predictions(SimulatedMotion::gentle, 0.08, seeds, 0.05);
  }
  if (wanted("stop")) {
    predictions(SimulatedMotion::stop_and_go, 0.04, seeds, 0.05);
    predictions(SimulatedMotion::stop_and_go, 0.08, seeds, 0.05);
  }
  if (wanted("clock")) {
    consistency(many, 0.0, 0.0, false);
    consistency(many, 0.008, 0.0, false);
    consistency(many, 0.008, 0.0, true);
    consistency(many, 0.008, 50e-6, true);
  }
  if (wanted("order")) order(seeds);
  if (wanted("dropout")) {
    for (const double seconds : {0.5, 2.0, 10.0}) dropouts(seconds, seeds);
  }
  if (wanted("watch")) watch(seeds, hours);
  if (wanted("cost")) cost();
  return 0;
}
