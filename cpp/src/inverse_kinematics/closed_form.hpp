// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// All configurations of a six-axis arm at once, from its axes alone: it does not matter in which convention they were
// written. Axes that nearly meet or are nearly parallel are taken to be so, and the answers are then seeds for Newton.

#include <Eigen/Core>

#include "inverse_kinematics/arm.hpp"
#include "rooms.hpp"
#include "truing/inverse.hpp"

namespace truing::inverse_kinematics {

/// One configuration: angles of the arm's six axes, each but for whole turns.
///
/// Near a singularity an arm that is not quite the closed form's may have one angle anywhere. Then there is a whole
/// circle of seeds, `place` by place, of which those where the robot's own equation passes through zero are worth a
/// descent.
struct Configuration {
  double angle[6];  ///< [rad], in (-pi, pi]
  int branch;       ///< bits: shoulder, elbow, wrist
  int circle;       ///< -1: not one of many
  int place, places;
  int about;  ///< the axis whose angle goes round
};

class ClosedForm {
 public:
  static constexpr int kWristPlaces = 8;      ///< on the circle of a wrist that is singular
  static constexpr int kShoulderPlaces = 12;  ///< around a shoulder that is
  static constexpr int kMostPlaces = 12;
  static constexpr int kCircles = 8;
  static constexpr int kMost = 4 * kMostPlaces;

  ClosedForm() = default;
  ClosedForm(const Arm& arm, const InverseOptions& options);

  ClosedFormKind kind() const { return kind_; }
  explicit operator bool() const { return kind_ != ClosedFormKind::none; }
  /// The answers are those of the robot itself: no axis had to be moved or turned, and there are no effects.
  bool exact() const { return doubt_ == 0.0; }
  int rails() const { return rails_; }  ///< prismatic joints before the arm: the first driven joints

  /// Configurations for which the arm, its rails at `readings`, brings the target to `wanted`; if inexact, also those
  /// that are lost by a little, and more than one where a wrist is nearly singular. A wrist that is singular keeps
  /// `hold`, the angle of axis 4 (spherical wrist) or 6 (three parallel axes).
  int solve(const Tip& wanted, const double* readings, double hold, Configuration* found) const;

  /// Readings of the arm's joints for angles of the axes, each plus whole turns so as to come nearest to `seed` within
  /// the limits. False: one of them cannot; `excess` says by how much, at worst, and readings are the nearest.
  bool readings_near(const Configuration& found, const double* seed, const double* lower, const double* upper,
                     double* readings, double* excess) const;
  /// Readings of rail `k` between which the arm may reach: the wrist's centre lies within its reach of the first axis,
  /// wherever the other rails are. Without `turned` the orientation is not known, and the reach is that of the target.
  void rail_range(int k, const Tip& wanted, bool turned, double* lower, double* upper) const;

  /// The angle of axis `k` at these readings.
  double angle(int k, const double* readings) const;

 private:
  enum class Shoulder { parallel_23, meet_12, meet_23, parallel_12 };
  struct Position {
    Eigen::Vector2d q[3];  ///< cosine and sine of the first three angles
    int branch;
    int place;  ///< on the shoulder's circle; -1: there is none
  };

  void find_rails(const std::vector<HomeAxis>& axes);
  bool find_wrist(const InverseOptions& options);
  bool find_three_parallel(const InverseOptions& options);
  bool find_shoulder(const InverseOptions& options);
  bool nearly_singular(const Eigen::Vector2d* q, int count) const;
  int solve_positions(const Eigen::Vector3d& wanted, Position* found) const;
  int solve_spherical(const Eigen::Matrix3d& R, const Eigen::Vector3d& p, double hold, Configuration* found) const;
  int solve_parallel(const Eigen::Matrix3d& R, const Eigen::Vector3d& p, double hold, Configuration* found) const;

  ClosedFormKind kind_ = ClosedFormKind::none;
  Shoulder shoulder_ = Shoulder::parallel_23;
  double deviation_ = 0.0;  ///< how far axes were moved [m] or turned [rad]
  double doubt_ = 0.0;      ///< a few times that
  int rails_ = 0;
  Eigen::Vector3d rail_[3];
  double reach_[2] = {0.0, 0.0};  ///< of the wrist's centre from the first axis' point, and of the target [m]
  double rail_weight_[3] = {1.0, 1.0, 1.0};
  Eigen::Vector3d h_[6];           ///< directions of the axes at zero
  Eigen::Vector3d o_[6];           ///< points on them
  Eigen::Matrix3d home_rotation_;  ///< of the target at zero
  Eigen::Vector3d home_position_;
  double weight_[6][6];                          ///< angle k = sum of weight_[k][j] * reading of arm joint j, j <= k
  double per_angle_[6], turn_[6], per_turn_[6];  ///< reading per angle; per whole turn, and its inverse
};

}  // namespace truing::inverse_kinematics
