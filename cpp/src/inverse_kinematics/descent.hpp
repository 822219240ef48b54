// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// From a seed to the nearest joints that fulfil a task, within limits: damped least squares on the rows that the task
// needs.

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "inverse_kinematics/arm.hpp"
#include "rooms.hpp"
#include "truing/inverse.hpp"

namespace truing::inverse_kinematics {

/// A task made ready: what is wanted of the tip, in the measurement frame.
struct Goal {
  TaskKind kind = TaskKind::pose;
  Eigen::Matrix3d rotation;  ///< wanted
  Eigen::Vector3d position;
  Eigen::Vector3d axis, travel, across;  ///< torch: a right-handed frame (travel, across, axis) on the target
  bool leans = false;                    ///< lead or work may be other than zero
  Window roll, lead, work;
  bool rolls = false;                                             ///< roll has a window
  double wanted_roll = std::numeric_limits<double>::quiet_NaN();  ///< NaN: anywhere in the window
  Eigen::Vector3d retreat;                                        ///< unit vector
  double longest_retreat = 0.0;

  explicit Goal(const Task& task);
  bool prefers_roll() const { return wanted_roll == wanted_roll; }
};

/// The wanted frame of a torch turned about its axis, and leant as little as its windows ask for.
Goal pose_at_roll(const Goal& goal, double roll);

/// How far a tip misses its goal, as tolerances count it.
struct Miss {
  double position = 0.0;  ///< [m]
  double rotation = 0.0;  ///< what of the orientation is asked for; beyond a window: how far [rad]
  double roll = 0.0;      ///< torch [rad]
};
Miss miss_of(const Goal& goal, const Tip& tip);

/// Rotation vector that takes `from` to `to`, about fixed axes: to = exp(w) from.
Eigen::Vector3d rotation_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to);

/// A limit on a passive joint's motion: lower <= weight . readings + constant <= upper.
struct PassiveLimit {
  double weight[kMaxDrivenJoints];
  double constant, lower, upper;
};

struct Limits {
  double lower[kMaxDrivenJoints], upper[kMaxDrivenJoints];
  std::vector<PassiveLimit> passive;

  /// The worst excess over any limit, 0 within; `joint`: of which driven joint, driven count + k for passive limit k.
  double excess(int driven, const double* readings, int* joint) const;
};

/// What a descent needs to know of a robot beside its kinematics.
struct Scales {
  double length = 1.0;             ///< so many metres count as a radian
  double joint[kMaxDrivenJoints];  ///< a radian's worth of each joint: 1, or `length` for prismatic ones
};

struct DescentOptions {
  int max_iterations = 60;
  double tolerance = 1e-10;      ///< done when position [m] and rotation [rad] rows are no longer
  double rotation_weight = 1.0;  ///< of a radian against `length` metres
  bool ignore_limits = false;
  int fixed_joints = 0;       ///< so many first joints stay where they are
  int patience = 6;           ///< given up after so many steps in a row that gain less than a tenth
  double longest_step = 1.0;  ///< of any joint that turns [rad]
};

struct Descent {
  double readings[kMaxDrivenJoints];
  double cost = std::numeric_limits<double>::infinity();  ///< sum of the squared rows
  int iterations = 0;
  bool converged = false;
};

/// Descends from `out->readings`, which is first brought within limits.
void descend(const Arm& arm, const Limits& limits, const Scales& scales, const Goal& goal,
             const DescentOptions& options, EffectScratch* scratch, Descent* out);

}  // namespace truing::inverse_kinematics
