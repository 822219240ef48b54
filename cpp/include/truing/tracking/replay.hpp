// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "truing/tracking/streams.hpp"
#include "truing/tracking/tracker.hpp"

namespace truing {

// A recording played through `Tracker` as it would have gone on the day: nothing is used before it arrived.

/// Every stream sorted by arrival. Arrivals are of one clock, the computer's; stamps are of each device's own.
struct RecordedStreams {
  std::vector<ImuSample> imu;
  std::vector<PoseSample> tracker;
  std::vector<FrameSample> flange;  ///< forward kinematics of the encoders
  std::vector<FrameSample> plan;    ///< planned tool
};

struct ReplayOptions {
  TrackOptions track;  ///< compensations are made `track.deviation.horizon` before the instant they are for
  /// [s] leads at which predictions are graded against the tracker's later samples.
  std::vector<double> horizons = {0.02, 0.04, 0.08};
  double learn_modes =
      0.0;  ///< [s] modes are identified from the start of this length, and used from then on; 0: never

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// What others would say, from the same samples at the same moment.
enum class Baseline {
  hold,         ///< the last tracker sample
  velocity,     ///< the last two tracker samples, at constant velocity
  fk,           ///< the last encoder readings
  fk_velocity,  ///< encoder readings at constant velocity
};
constexpr std::size_t kBaselines = 4;
const char* name(Baseline baseline);

/// A row of the plan: what to add there.
struct CompensationRow {
  bool made = false;          ///< false: the streams do not reach there, and nothing else is set but `t`
  double t = 0.0;             ///< [s] when the tool is to be there, the inertial sensor's clock
  Compensation compensation;  ///< what to add there
};

/// A prediction, and what the tracker said when its time had come. Errors are measured minus predicted, of the
/// receiver, in the base frame.
struct GradedPrediction {
  double t = 0.0, made = 0.0;    ///< the inertial sensor's clock [s]
  double horizon = 0.0;          ///< asked for [s]
  Status status = Status::lost;  ///< lost: nothing was predicted
  Predictor predictor = Predictor::slow;
  int dimensions = 0;  ///< 6, 3 for a tracker without orientations, 0 where nothing was predicted
  Eigen::Vector3d position = Eigen::Vector3d::Zero();        ///< error [m]
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();        ///< error, rotation vector [rad]
  Eigen::Vector3d position_sigma = Eigen::Vector3d::Zero();  ///< expected, tracker noise included [m]
  double squares = 0.0;                                      ///< normalised error squared, `dimensions` expected
  std::array<double, kBaselines> baselines{};  ///< length of the position error [m]; infinite: not to be had yet
};

/// How things stood, every tenth of a second.
struct TimelineRow {
  double t = 0.0;  ///< [s]
  Status status = Status::lost;
  Predictor predictor = Predictor::slow;
  ClockEstimate clock;
  std::array<double, ModalModel::kMost> frequencies{};  ///< [Hz]
};

/// What a replay gave. Times are of the inertial sensor's clock.
struct ReplayResult {
  std::vector<CompensationRow> rows;     ///< one per row of the plan, in its order
  std::vector<GradedPrediction> graded;  ///< by tracker sample, then by horizon
  std::vector<Innovation> innovations;
  std::vector<TimelineRow> timeline;
  std::vector<Shift> shifts;  ///< of the tracker, as they were noticed
  ModesResult modes;          ///< as identified in the replay; none where none were asked for or found
  double modes_from = 0.0;    ///< [s] they are used from then on; 0: never
  Counters counters;
  ClockEstimate clock;   ///< at the end
  TrackerNoise noise;    ///< at the end
  bool stopped = false;  ///< `progress` said so
};

/// `progress` is given the fraction that is done, about a hundred times; false stops the replay.
/// Throws std::invalid_argument on options that make no sense, and on streams that are not sorted by arrival.
ReplayResult replay(const RecordedStreams& streams, const TrackSetup& setup, const ReplayOptions& options = {},
                    const std::function<bool(double)>& progress = {});

}  // namespace truing
