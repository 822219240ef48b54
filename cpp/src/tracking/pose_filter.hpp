// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Error-state Kalman filter on SE(3) over a window in which measurements may arrive in any order.
//
// The body is the inertial sensor; time is its clock. Nominal state: position and velocity of the sensor in the base
// frame, orientation, gyro and accelerometer bias, offset and drift of the tracker's clock, and the slow deviation of
// forward kinematics (flange = fk * Exp(s)). Orientation errors are global, R_true = Exp(dtheta) R (Solà 2017, section
// 7): with them the transition over a whole segment between two measurements depends on the inertial data through their
// first and second integral only, so covariances need no step per sample.

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "math/rotation.hpp"
#include "rooms.hpp"
#include "tracking/noise_estimate.hpp"
#include "truing/tracking/streams.hpp"
#include "truing/tracking/tracker.hpp"

namespace truing::tracking {

/// Places of the error state.
enum State : int {
  kP = 0,
  kV = 3,
  kTheta = 6,
  kGyroBias = 9,
  kAccelBias = 12,
  kClock = 15,
  kDrift = 16,
  kSlowP = 17,
  kSlowTheta = 20,
  kStates = 23
};
constexpr double kCoastingAge = 0.2;  ///< without tracker samples for so long, the filter coasts [s]
using Covariance = Eigen::Matrix<double, kStates, kStates>;

struct Nominal {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();  ///< sensor in the base frame [m], [m/s]
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();                     ///< base from sensor
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
  double clock = 0.0, drift = 0.0;  ///< t_imu = t_tracker - clock
  Eigen::Vector3d slow_p = Eigen::Vector3d::Zero(),
                  slow_theta = Eigen::Vector3d::Zero();  ///< in the flange of forward kinematics
};

struct Belief {
  double t = 0.0;
  Nominal x;
  Covariance P = Covariance::Zero();
  double last_pose = -1e300;         ///< time of the last accepted tracker sample
  int rejected = 0;                  ///< tracker samples rejected in a row
  double clock_from = 0.0;           ///< before, the clock is considered and not estimated
  Vector6d sway = Vector6d::Zero();  ///< variance of the deviation from forward kinematics and slow deviation, in the
                                     ///< flange [m^2], [rad^2]
  NoiseEstimate noise;               ///< of the sensors
};

/// What a tracker sample came to when it was last processed.
struct PoseGrade {
  double t = 0.0;      ///< where it was placed [s]
  double nis = 0.0;    ///< normalised innovation squared
  int dimensions = 0;  ///< 6, or 3 without orientation
  bool accepted = false;
  bool reacquired = false;                 ///< accepted only after the covariance had been widened
  Vector6d innovation = Vector6d::Zero();  ///< measured minus predicted, base frame [m], [rad]
  Matrix6d S = Matrix6d::Identity();       ///< its covariance
  Vector6d R = Vector6d::Ones();           ///< variance of the tracker's noise in it
  std::array<double, 2> noise{};           ///< white noise of the tracker [m], [rad]
  Eigen::Isometry3d T_base_receiver = Eigen::Isometry3d::Identity();  ///< measured
};

/// The moving sensor at one instant, between measurements.
struct Motion {
  double t = 0.0;
  Nominal x;
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();          ///< in the base frame, bias taken away [rad/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< of the sensor in the base frame [m/s^2]
};

class PoseFilter {
 public:
  PoseFilter(const TrackSetup& setup, const FilterOptions& options);

  Outcome push_imu(const ImuSample& sample);
  Outcome push_pose(const PoseSample& sample);
  /// Flange by forward kinematics, on the inertial sensor's clock.
  Outcome push_flange(double t, const Eigen::Isometry3d& T_base_flange);

  /// Works off everything that has arrived since the last call. Nothing else changes beliefs.
  void update();

  bool initialised() const { return initialised_; }
  double newest_imu() const { return imu_count_ == 0 ? -1e300 : imu(imu_count_ - 1).t; }
  double window_start() const { return base_.t; }
  /// State at `t` from the window's start to the newest inertial sample; `update` first.
  Motion motion_at(double t) const;
  /// With covariance, from the last event before.
  Belief belief_at(double t) const;
  /// Mean variance of a component of position and of velocity at the last event before t, and how long ago the last
  /// tracker sample was then.
  void sigmas_at(double t, double* position_variance, double* velocity_variance, double* pose_age) const;
  /// Variance of the sway about the slow deviation, per component in the flange of forward kinematics.
  Vector6d sway_variance() const { return (dirty_ == 0 ? base_ : event(dirty_ - 1).after).sway; }
  /// Place of the newest tracker sample that was taken.
  double newest_pose() const { return (dirty_ == 0 ? base_ : event(dirty_ - 1).after).last_pose; }
  /// Of the sensors, as found by the last event.
  const NoiseEstimate& noise() const { return (dirty_ == 0 ? base_ : event(dirty_ - 1).after).noise; }
  /// The earliest time whose state changed since the last call of this function; +inf: none.
  double changed_since();
  /// Flange by forward kinematics at `t`; false when no samples are around it.
  bool flange_at(double t, Eigen::Isometry3d* T_base_flange) const;
  double newest_flange() const { return flange_count_ == 0 ? -1e300 : flange(flange_count_ - 1).t; }
  /// Grades of the tracker samples that left the window since the last call, oldest first; at most `capacity`.
  int take_grades(PoseGrade* out, int capacity);
  const Counters& counters() const { return counters_; }
  const TrackSetup& setup() const { return setup_; }
  const FilterOptions& options() const { return options_; }

 private:
  struct ImuRow {
    double t = 0.0;
    Eigen::Vector3d gyro, accel;
    double extra_gyro = 0.0, extra_accel = 0.0;  ///< variance that gaps and saturation added, summed since the start
    Eigen::Vector3d p, v;                        ///< nominal state here, as of the last update
    Eigen::Quaterniond q;
  };
  struct FlangeRow {
    double t = 0.0;
    Eigen::Isometry3d T_base_flange;
  };
  enum class Kind { mark, pose };
  struct Event {
    double t = 0.0;
    Kind kind = Kind::mark;
    double stamp = 0.0, place = 0.0;    // t = stamp - place
    Eigen::Isometry3d T_base_receiver;  // measured
    bool has_orientation = false;
    PoseGrade grade;
    Belief after;
  };

  const ImuRow& imu(std::int64_t k) const { return imu_[static_cast<std::size_t>(k & imu_mask_)]; }
  ImuRow& imu(std::int64_t k) { return imu_[static_cast<std::size_t>(k & imu_mask_)]; }
  const FlangeRow& flange(std::int64_t k) const { return flange_[static_cast<std::size_t>(k & flange_mask_)]; }
  FlangeRow& flange(std::int64_t k) { return flange_[static_cast<std::size_t>(k & flange_mask_)]; }
  Event& event(int k) { return events_[static_cast<std::size_t>(order_[static_cast<std::size_t>(k)])]; }
  const Event& event(int k) const { return events_[static_cast<std::size_t>(order_[static_cast<std::size_t>(k)])]; }
  int event_count() const { return static_cast<int>(order_.size()); }

  std::int64_t imu_before(double t) const;
  void imu_between(std::int64_t k, double t, Eigen::Vector3d* gyro, Eigen::Vector3d* accel) const;
  double place_of(double stamp);
  int first_event_after(double t) const;
  Outcome insert(const Event& event);
  void set_dirty(int k);
  void add_marks();
  void trim();
  void settle(int settled);
  void make_room();
  bool can_start_from(const Event& event) const;
  void start_from(const Event& first);
  void propagate(Belief* belief, double t);
  void integrate(Nominal* x, std::int64_t k, double t0, double t1) const;
  void transition(const Belief& from, const Nominal& to_x, double t, Covariance* P) const;
  double extra(double t, bool gyro) const;
  void measure_pose(Event* event, Belief* belief) const;
  void measure_flange(double t, Belief* belief) const;
  void learn_sway(const Vector6d& sway, Belief* belief) const;
  Motion motion_of(const Nominal& x, std::int64_t k, double t) const;

  TrackSetup setup_;
  FilterOptions options_;
  Eigen::Isometry3d T_imu_receiver_, T_imu_flange_, T_base_tracker_;

  std::vector<ImuRow> imu_;
  std::int64_t imu_mask_ = 0, imu_count_ = 0, cached_ = -1;  // last row whose nominal state is right
  std::vector<FlangeRow> flange_;
  std::int64_t flange_mask_ = 0, flange_count_ = 0;
  std::vector<Event> events_;
  std::vector<int> order_, free_;
  int dirty_ = 0;  // first event whose belief is not right
  int marks_ = 0;  // places among the events that are kept for marks
  double next_mark_ = 0.0;
  Belief base_;
  bool initialised_ = false, base_is_first_pose_ = false;
  double changed_ = 0.0;
  PoseSample last_pushed_;
  int frozen_ = 0;
  static constexpr int kPlaces = 8;
  std::array<double, kPlaces> place_{};  // clock offset with which stamps of second k are placed, k modulo kPlaces
  std::array<std::int64_t, kPlaces> place_second_{};
  std::vector<PoseGrade> grades_;
  int grade_count_ = 0;
  Counters counters_;
};

}  // namespace truing::tracking
