// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The deviation of the moving sensor from where the plan has it, and its prediction. Time is the inertial sensor's
// clock.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "math/rotation.hpp"
#include "rooms.hpp"
#include "tracking/pose_filter.hpp"
#include "truing/tracking/tracker.hpp"

namespace truing::tracking {

/// A planned frame with its derivatives.
struct PlanPoint {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< of its origin, base frame [m/s]
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();          ///< in its own frame [rad/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< base frame [m/s^2]
};

/// Frames over time, by a cubic through the four samples around (Lagrange); orientations as rotation vectors from the
/// nearest one before.
class FrameBuffer {
 public:
  explicit FrameBuffer(int capacity) : rows_(static_cast<std::size_t>(capacity)) {}
  Outcome push(double t, const Eigen::Isometry3d& T);
  bool empty() const { return count_ == 0; }
  double newest() const { return count_ == 0 ? -1e300 : row(count_ - 1).t; }
  double oldest() const { return count_ == 0 ? 1e300 : row(first()).t; }
  /// False outside the samples. `extrapolate`: up to so long after the newest at constant velocity.
  bool at(double t, PlanPoint* out, double extrapolate = 0.0) const;
  void clear() { count_ = 0; }

 private:
  struct Row {
    double t = 0.0;
    Eigen::Vector3d p;
    Eigen::Quaterniond q;
  };
  const Row& row(std::int64_t k) const { return rows_[static_cast<std::size_t>(k) % rows_.size()]; }
  std::int64_t first() const { return std::max<std::int64_t>(0, count_ - static_cast<std::int64_t>(rows_.size())); }
  std::vector<Row> rows_;
  std::int64_t count_ = 0;
};

// ---- Slow part and damped modes, for all six components at once -----------------------------------------------------

constexpr int kParts = 1 + ModalModel::kMost;  ///< the slow one, then the modes
constexpr int kModalStates = 2 * kParts;
/// Rows: displacement and speed of every part. Columns: components (or whatever shares the filter's gain).
template <int Columns>
using ModalState = Eigen::Matrix<double, Eigen::Dynamic, Columns, 0, kModalStates, Columns>;
using ModalCovariance = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kModalStates, kModalStates>;
using ModalVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kModalStates, 1>;

/// A damped oscillator over a step, input held: state <- transition * state + input * force. With omega = 0 it drifts:
/// the slow part.
struct OscillatorStep {
  Eigen::Matrix2d transition;
  Eigen::Vector2d input;
};
OscillatorStep oscillator_step(double omega, double damping, double dt);
using ModalSteps = std::array<OscillatorStep, kParts>;

/// The model's Kalman filter. All components have the same dynamics and the same ratio of noises, so one covariance and
/// one gain serve them all.
struct ModalFilter {
  int parts = 1;
  std::array<double, kParts> omega{}, damping{};
  ModalCovariance P;

  ModalFilter() = default;
  explicit ModalFilter(const ModalModel& model);
  int states() const { return 2 * parts; }
  void steps(double dt, ModalSteps* out) const;
  /// Covariance over one step.
  void predict_covariance(const ModalSteps& steps, double dt, const DeviationOptions& options);
  /// Gain for an observation of displacement (first = 0) or speed (first = 1), and the innovation's variance; the
  /// covariance is updated.
  double observe(int first, double variance, ModalVector* gain);
};

/// State of all components over one step, each part pushed by its force (parts x columns; none on the slow one).
template <int Columns, typename Forces>
void step_state(const ModalSteps& steps, int parts, const Forces& forces, ModalState<Columns>* X) {
  for (int k = 0; k < parts; ++k) {
    const OscillatorStep& s = steps[static_cast<std::size_t>(k)];
    const Eigen::Matrix<double, 1, Columns> x = X->row(2 * k), v = X->row(2 * k + 1);
    X->row(2 * k) = s.transition(0, 0) * x + s.transition(0, 1) * v + s.input[0] * forces.row(k);
    X->row(2 * k + 1) = s.transition(1, 0) * x + s.transition(1, 1) * v + s.input[1] * forces.row(k);
  }
}

/// Of all parts together; `first`: 0 for displacement, 1 for speed.
template <int Columns>
Eigen::Matrix<double, 1, Columns> sum_of(const ModalState<Columns>& X, int first) {
  Eigen::Matrix<double, 1, Columns> out = X.row(first);
  for (Eigen::Index k = first + 2; k < X.rows(); k += 2) out += X.row(k);
  return out;
}
template <int Columns>
Eigen::Matrix<double, 1, Columns> displacement_of(const ModalState<Columns>& X) {
  return sum_of<Columns>(X, 0);
}
template <int Columns>
Eigen::Matrix<double, 1, Columns> speed_of(const ModalState<Columns>& X) {
  return sum_of<Columns>(X, 1);
}

/// The modes' frequencies, followed by what their errors do to the innovations.
struct FrequencyTracker {
  std::array<ModalState<3>, kParts>
      sensitivity;  ///< derivative of the translation's state with respect to the frequency of every mode
  Eigen::Matrix<double, ModalModel::kMost, ModalModel::kMost> P =
      Eigen::Matrix<double, ModalModel::kMost, ModalModel::kMost>::Zero();
  Eigen::Matrix<double, ModalModel::kMost, 1> change =
      Eigen::Matrix<double, ModalModel::kMost, 1>::Zero();  ///< of this step [rad/s]

  FrequencyTracker() = default;
  FrequencyTracker(const ModalFilter& filter, double sigma);
  void step(const ModalSteps& steps, const ModalFilter& filter, const ModalState<6>& before,
            const Eigen::Matrix<double, kParts, 6>& forces, double dt, double walk);
  void observe(int first, const Eigen::Matrix<double, 1, 3>& e, double variance, const ModalVector& gain, int parts);
};

// ---- The deviation, step by step ------------------------------------------------------------------------------------

/// Deviation of a moving sensor from a planned one, in the planned one's frame: translation and rotation vector, their
/// rates and second derivative.
struct Deviation {
  Vector6d d = Vector6d::Zero(), rate = Vector6d::Zero(), acceleration = Vector6d::Zero();
};
Deviation deviation_of(const Motion& motion, const PlanPoint& plan);
/// Planned frame and deviation put together again.
Eigen::Isometry3d deviated(const Eigen::Isometry3d& T, const Vector6d& d);

class DeviationModel {
 public:
  DeviationModel(const TrackSetup& setup, const DeviationOptions& options, const ModalModel& modes);

  void set_modes(const ModalModel& modes);
  /// Tool in the base frame, on the controller's clock.
  Outcome push_plan(double t, const Eigen::Isometry3d& T_base_tool, double now);
  /// Where the plan (or, without one, forward kinematics) has the inertial sensor at t of its own clock.
  bool reference_at(double t, PlanPoint* out, double extrapolate = 0.0) const;
  /// Forward kinematics as the plan when there is none.
  void push_flange(double t, const Eigen::Isometry3d& T_base_flange);

  /// Runs the steps up to the newest inertial sample; those after `changed` again.
  void update(const PoseFilter& filter, double changed);
  /// Deviation at t by one predictor, from the newest step; `now`: the deviation at the filter's newest time. False
  /// when nothing is known yet.
  bool predict(Predictor predictor, double from, const Deviation& now, double t, Vector6d* d) const;

  /// Mean square of graded errors at the nominal horizon, per component; of the best predictor.
  const Vector6d& grade(Predictor predictor) const { return grades_[static_cast<std::size_t>(predictor)].mean_square; }
  double evidence(Predictor predictor) const { return grades_[static_cast<std::size_t>(predictor)].seconds; }
  Predictor best() const { return best_; }
  bool ready() const { return tick_count_ > 0; }
  double newest_tick() const { return tick_count_ == 0 ? -1e300 : tick(tick_count_ - 1).t; }
  Vector6d slow() const;
  std::array<double, ModalModel::kMost> frequencies() const;  ///< as tracked [Hz]
  /// Settled rows since the last call, for identify_modes; at most `capacity`.
  int take_rows(DeviationRow* out, int capacity);

 private:
  struct Tick {
    double t = 0.0;
    bool observed = false;
    Deviation z;
    Eigen::Vector3d push = Eigen::Vector3d::Zero();  // planned acceleration over the next step
    Vector6d mean = Vector6d::Zero();                // deviation averaged over sway
    double velocity_variance = 0.0;                  // of the filter, a component [m^2/s^2]
    ModalState<6> X;
    ModalFilter filter;
    FrequencyTracker frequencies;
  };
  struct Guess {
    double t = -1e300;
    std::array<Vector6d, kPredictors> d;
    double velocity_variance = 0.0;  // when it was made
    bool made = false;
  };
  struct Grade {
    Vector6d mean_square = Vector6d::Zero();
    double seconds = 0.0;
  };

  const Tick& tick(std::int64_t k) const { return ticks_[static_cast<std::size_t>(k) % ticks_.size()]; }
  Tick& tick(std::int64_t k) { return ticks_[static_cast<std::size_t>(k) % ticks_.size()]; }
  void run(std::int64_t k, const PoseFilter& filter);
  void guess(std::int64_t k, double now);
  void settle(double now, double seen);
  /// What the plan's acceleration pushes every part with.
  using Forces = Eigen::Matrix<double, kParts, 6>;
  Forces forces_of(const Eigen::Vector3d& push) const;
  Eigen::Vector3d push_at(double t) const;
  void choose(const PoseFilter& filter);

  TrackSetup setup_;
  DeviationOptions options_;
  ModalModel modes_;
  Eigen::Isometry3d T_tool_imu_, T_flange_imu_;
  FrameBuffer plan_, flange_;
  std::vector<Tick> ticks_;
  std::int64_t tick_count_ = 0, settled_ = 0;
  std::int64_t first_index_ = 0;  // t of tick k is (first_index_ + k) * period
  std::vector<Guess> guesses_;
  std::array<Grade, kPredictors> grades_;
  Predictor best_ = Predictor::slow;
  std::vector<DeviationRow> rows_;
  int row_count_ = 0;
};

}  // namespace truing::tracking
