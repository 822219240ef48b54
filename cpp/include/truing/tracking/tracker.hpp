// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "truing/tracking/streams.hpp"

namespace truing {

// Where the tool of a large, swaying arm will be: from an inertial sensor and a receiver of base-station signals on the
// last link, encoders, and the plan. See docs/method/track.md.

/// What became of a sample. Refused samples leave everything as it was.
enum class Outcome {
  accepted,
  accepted_gap,        ///< inertial sample after a gap: accepted, uncertainty widened for the time between
  accepted_saturated,  ///< inertial sample at the end of its range: accepted, uncertainty widened
  accepted_restart,    ///< inertial sample after a gap too long to bridge: the filter starts anew
  duplicate,           ///< refused: this sensor has a sample with this stamp already
  backwards,           ///< refused: older than the sensor's newest sample (inertial sensor, plan)
  future,              ///< refused: stamp further ahead of the newest inertial sample than the options allow
  too_late,            ///< refused: older than the window
  not_finite,          ///< refused: NaN or infinite
  not_unit,            ///< refused: quaternion not of length one
  frozen,              ///< refused: the tracker repeats itself to the last bit
};
/// "accepted", "duplicate", …
const char* name(Outcome outcome);
/// True for the outcomes that begin with accepted.
bool accepted(Outcome outcome);

/// Number of samples by outcome.
struct Counters {
  std::array<std::uint64_t, 11> imu{}, pose{}, joints{}, plan{};  ///< by Outcome
  std::uint64_t outliers = 0;    ///< tracker samples that the gate rejected (those that left the window)
  std::uint64_t reacquired = 0;  ///< times that the filter followed a tracker that had disagreed for long
};

/// Noise, gaps and gates of the filter.
struct FilterOptions {
  double window = 0.5;               ///< [s] maximum lateness of a measurement that is still put at its place
  double future_limit = 0.1;         ///< [s] maximum lead of a stamp over the newest inertial sample
  double highest_imu_rate = 2000.0;  ///< [Hz] sizes the ring buffer
  double highest_pose_rate = 400.0;  ///< [Hz] likewise
  double gyro_noise = 1e-4;          ///< [rad/s/sqrt(Hz)] noise density
  double accel_noise = 1e-3;         ///< [m/s^2/sqrt(Hz)] noise density
  double gyro_bias = 1e-2;           ///< [rad/s] standard deviation before any data, of a sensor not calibrated
  double accel_bias = 1e-1;          ///< [m/s^2] likewise
  double gyro_bias_change = 2e-3;    ///< [rad/s] standard deviation of its change since it was calibrated
  double accel_bias_change = 3e-2;   ///< [m/s^2] likewise
  double gyro_bias_walk = 2e-5;      ///< [rad/s/sqrt(s)] random walk of the bias
  double accel_bias_walk = 2e-4;     ///< [m/s^2/sqrt(s)] random walk of the bias
  double imu_scale = 5e-4;           ///< standard deviation of the relative scale error of gyro and accelerometer
  double gyro_range = 34.0;          ///< [rad/s] a component at or beyond is saturated
  double accel_range = 156.0;        ///< [m/s^2] a component at or beyond is saturated
  double largest_gap = 0.02;         ///< [s] maximum gap between inertial samples before uncertainty is widened
  double restart_gap = 5.0;          ///< [s] gap between inertial samples after which the filter starts anew
  double gap_acceleration = 2.0;     ///< [m/s^2] standard deviation of what a gap or saturation hides
  double gap_rate = 0.2;             ///< [rad/s] likewise
  double position_sigma = 1e-3;      ///< [m] noise of the tracker, one component
  double rotation_sigma = 1e-3;      ///< [rad] likewise
  /// [s] over which the noise of the tracker is averaged, and that of the inertial sensor follows; 0: as given.
  double noise_time = 10.0;
  double noise_range = 10.0;       ///< maximum ratio of a noise so found to the given one, and of the given to it
  double gate = 50.0;              ///< tracker samples with a larger normalised innovation squared are outliers
  int reacquire_after = 25;        ///< consecutive outliers after which the filter follows the tracker again
  int frozen_after = 3;            ///< consecutive equal tracker samples after which they are refused
  double clock_walk = 2e-5;        ///< [s/sqrt(s)] random walk of the tracker's clock
  double clock_drift = 1e-4;       ///< [s/s] standard deviation of the clock's drift
  double clock_drift_walk = 1e-6;  ///< [1/sqrt(s)] random walk of the clock's drift
  /// [m] standard deviation of the tip about its slow mean before any data; afterwards it is estimated.
  double sway_position = 0.02;
  double sway_rotation = 0.003;   ///< [rad] likewise
  double sway_correlation = 0.5;  ///< [s] correlation time of the sway
  double slow_position = 0.05;    ///< [m] standard deviation of the deviation from forward kinematics before any data
  double slow_rotation = 0.02;    ///< [rad] likewise
  double slow_position_walk = 3e-3;  ///< [m/sqrt(s)] random walk of that deviation
  double slow_rotation_walk = 5e-4;  ///< [rad/sqrt(s)] likewise

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// The sway as damped modes: each component c of the deviation from the plan is slow + sum of modes, and mode k of it
/// obeys
///
///     x'' + 2 zeta_k omega_k x' + omega_k^2 x = gain_k(c, :) . a_plan + noise
///
/// with the planned acceleration in the frame of the planned inertial sensor. Components: translation [m], rotation
/// vector [rad], in that frame.
struct ModalModel {
  static constexpr int kMost = 4;
  int count = 0;
  std::array<double, kMost> frequency{};                  ///< [Hz] undamped
  std::array<double, kMost> damping{};                    ///< ratio
  std::array<double, kMost> frequency_sigma{};            ///< [Hz] standard error
  std::array<Eigen::Matrix<double, 6, 3>, kMost> gain{};  ///< [-], [rad/m]

  ModalModel() {
    for (auto& g : gain) g.setZero();
  }
};

/// The model of the deviation from the plan.
struct DeviationOptions {
  double period = 0.01;           ///< [s] step of the model
  double horizon = 0.04;          ///< [s] lead for which predictions are graded
  double position_noise = 3e-4;   ///< [m] noise of the filter's position as the model sees it, rotations as 1 m
  double velocity_noise = 1e-3;   ///< [m/s] likewise
  double slow_noise = 3e-3;       ///< [m/s^2/sqrt(Hz)] acceleration that drives the slow part
  double static_time = 2.0;       ///< [s] averaging time of the static deviation
  double mode_noise = 2e-2;       ///< [m/s^2/sqrt(Hz)] acceleration that drives a mode beside the plan's
  double frequency_sigma = 0.05;  ///< relative standard deviation of the given frequencies; 0: they stay
  double frequency_walk = 0.003;  ///< [1/sqrt(s)] relative random walk of the frequencies
  double frequency_range = 0.2;   ///< maximum relative change of a frequency
  double grade_time = 3.0;        ///< [s] averaging time of the grades
  double settle_time = 0.1;       ///< [s] delay before a prediction is graded, in which late samples may come
  double least_evidence = 1.0;    ///< [s] duration of grades after which predictions of modes are used
  double plan_limit = 10.0;       ///< [s] plan samples further ahead are refused

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// How predictions are made, the best-graded one is used.
enum class Predictor {
  slow,          ///< plan and slow deviation: what forward kinematics would give, and the last static deviation
  acceleration,  ///< plan and deviation at constant acceleration
  modes,         ///< plan, slow deviation and damped modes driven by the plan
};
constexpr int kPredictors = 3;

/// One row for `identify_modes`: the deviation, its rate, and the plan's acceleration, in the frame of the planned
/// inertial sensor.
struct DeviationRow {
  double t = 0.0;
  Eigen::Matrix<double, 6, 1> deviation = Eigen::Matrix<double, 6, 1>::Zero();  ///< [m], [rad]
  Eigen::Matrix<double, 6, 1> rate = Eigen::Matrix<double, 6, 1>::Zero();       ///< [m/s], [rad/s]
  Eigen::Vector3d plan_acceleration = Eigen::Vector3d::Zero();                  ///< [m/s^2] over the following period
};

/// What `identify_modes` found.
struct ModesResult {
  ModalModel model;  ///< the modes
  /// [m] rms of predictions twice the horizon ahead: of no change, with one mode, with two …
  std::vector<double> error;
  double rows = 0;              ///< number of rows used
  std::string stopped_because;  ///< why there are no more modes
};

/// Frequencies, damping and gains from a recording of rows `options.period` apart. The start is the eigensystem
/// realisation of the acceleration's autocovariance; then the errors of predictions `2 * options.horizon` ahead by the
/// model's own Kalman filter are made least. Another mode is taken while it lowers that error by at least `worth`.
/// Throws std::invalid_argument on fewer than 500 rows.
ModesResult identify_modes(const std::vector<DeviationRow>& rows, const DeviationOptions& options = {},
                           int most = ModalModel::kMost, double worth = 0.03);

/// Bounds of the corrections that are sent to the arm.
struct CorrectionLimits {
  double position = 0.15;        ///< [m] maximum length
  double rotation = 0.05;        ///< [rad] maximum angle
  double position_rate = 0.5;    ///< [m/s]
  double rotation_rate = 0.2;    ///< [rad/s]
  double position_jerk = 100.0;  ///< [m/s^3]
  double rotation_jerk = 40.0;   ///< [rad/s^3]
};

/// Detection of jumps of the tracker against inertial sensor and forward kinematics.
struct WatchOptions {
  double threshold = 55.0;  ///< of averages that are chi-square distributed with six degrees of freedom
  double forget = 1.0;      ///< [s] after a longer gap of the tracker the averages begin anew
  /// [s] after a shift, station and receiver are told apart for this time; further jumps are taken for its
  /// after-effect.
  double compare = 120.0;
  /// A jump counts when its length or its angle is at least so many times the tracker's noise of one component.
  double least = 1.0;

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// What a jump of the tracker came from.
enum class ShiftCause {
  station_or_receiver,  ///< not told apart (yet): the arm has to move and turn
  station,              ///< constant in the tracker frame: a base station was moved
  receiver,             ///< constant on the flange: the receiver has slipped
};
const char* name(ShiftCause cause);

/// The last jump of the tracker that was noticed.
struct Shift {
  std::uint64_t count = 0;  ///< number of jumps since the start; 0: the rest means nothing
  double t = 0.0;           ///< [s] when it happened, the inertial sensor's clock
  double flagged = 0.0;     ///< [s] stamp of the tracker sample that it was noticed by
  /// shape=(6,) [m], rotation vector [rad]: of the receiver as measured, base frame.
  Eigen::Matrix<double, 6, 1> jump = Eigen::Matrix<double, 6, 1>::Zero();
  ShiftCause cause = ShiftCause::station_or_receiver;  ///< what jumped
  double odds = 0.0;                                   ///< log odds of station against receiver
  double position_noise = 0.0;                         ///< [m] of the tracker then, one component
  double rotation_noise = 0.0;                         ///< [rad] likewise
};

/// How `Tracker` works.
struct TrackOptions {
  FilterOptions filter;        ///< noise, gaps and gates of the filter
  DeviationOptions deviation;  ///< the model of the deviation from the plan
  WatchOptions watch;          ///< detection of jumps of the tracker
  ModalModel modes;            ///< of `identify_modes`; none: predictions at constant acceleration
  CorrectionLimits limits;     ///< bounds of corrections
  /// [m] without the tracker, estimates with a larger standard deviation than this and than forward kinematics' are not
  /// used.
  double coast_position = 0.03;
  double coast_rotation = 0.02;  ///< [rad] likewise
  double imu_timeout = 0.1;      ///< [s] lag behind the joints after which the inertial sensor is taken for dead
  double joints_timeout = 0.5;   ///< [s] the same of the joints

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

enum class Status {
  valid,     ///< inertial sensor and tracker
  coasting,  ///< inertial sensor and forward kinematics, the tracker is away
  hold,      ///< forward kinematics (or the plan) and the last static deviation
  lost,      ///< nothing to go by
};
const char* name(Status status);
const char* name(Predictor predictor);

/// The tool at time `t`, as known at time `made`; the inertial sensor's clock.
struct PosePrediction {
  double t = 0.0;                                                 ///< [s]
  double made = 0.0;                                              ///< [s]
  Eigen::Isometry3d T_base_tool = Eigen::Isometry3d::Identity();  ///< shape=(4, 4)
  /// shape=(6, 6), of position [m] and rotation vector [rad] about the base frame's axes.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  Status status = Status::lost;           ///< what it rests on
  Predictor predictor = Predictor::slow;  ///< how it was made
};

/// What to add to the plan so that the tool is where it was planned.
struct Compensation {
  PosePrediction predicted;  ///< the prediction behind it
  bool has_plan = false;     ///< false: the plan does not reach that far, and nothing is corrected
  Eigen::Isometry3d T_base_tool_planned = Eigen::Isometry3d::Identity();  ///< shape=(4, 4)
  /// shape=(6,) [m], rotation vector [rad]: the correction in the base frame.
  Eigen::Matrix<double, 6, 1> wanted = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 1> correction = Eigen::Matrix<double, 6, 1>::Zero();  ///< shape=(6,): within the limits
  bool limited = false;                                             ///< the two differ by more than 1 mm or 1 mrad
  Eigen::Isometry3d T_base_flange = Eigen::Isometry3d::Identity();  ///< shape=(4, 4): corrected
};

/// The tracker's clock: t_imu = t_tracker - offset.
struct ClockEstimate {
  double offset = 0.0;  ///< [s]
  double sigma = 0.0;   ///< [s] standard error
  double drift = 0.0;   ///< [s/s]
};

/// Noise of the sensors as the filter has found it.
struct TrackerNoise {
  double position = 0.0;      ///< [m] of the tracker, one component
  double rotation = 0.0;      ///< [rad] likewise
  double accel_factor = 1.0;  ///< of the accelerometer, in terms of the given
  double gyro_factor = 1.0;   ///< of the gyro, in terms of the given
};

/// A tracker sample against what was expected of it.
struct Innovation {
  double t = 0.0, nis = 0.0;
  int dimensions = 0;
  bool accepted = false;
};

/// Fusion and prediction, sample by sample. No heap allocation after construction; the same samples give the same
/// result in whatever order they arrive within the window. Not for use from two threads at once.
class Tracker {
 public:
  /// Throws std::invalid_argument on options that make no sense.
  explicit Tracker(const TrackSetup& setup, const TrackOptions& options = {});
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  Outcome push_imu(const ImuSample& sample);
  Outcome push_pose(const PoseSample& sample);
  /// Flange by forward kinematics of the encoders, stamp of the controller's clock.
  Outcome push_joints(double t, const Eigen::Isometry3d& T_base_flange);
  /// Planned tool, ahead of its time, in order; stamp of the controller's clock.
  Outcome push_plan(double t, const Eigen::Isometry3d& T_base_tool);

  /// The tool at a time of the inertial sensor's clock, past (within the window), now or to come.
  PosePrediction predict(double t);
  /// Prediction, and the correction that it asks for, within limits; to be called at growing times.
  Compensation compensate(double t);

  void set_modes(const ModalModel& modes);
  double now() const;  ///< stamp of the newest inertial sample
  ClockEstimate clock();
  TrackerNoise noise();
  std::array<double, ModalModel::kMost> frequencies() const;  ///< [Hz] as tracked
  /// Settled rows since the last call for `identify_modes`, and settled innovations: the number written, at most
  /// `capacity`. Call often: few are kept.
  int take_rows(DeviationRow* out, int capacity);
  int take_innovations(Innovation* out, int capacity);
  const Counters& counters() const;
  /// The last jump of the tracker. After one, the filter follows the tracker: calibrate anew.
  const Shift& shift();

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace truing
