// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truing/identify.hpp"
#include "truing/inverse.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// Compensation: what to command of a controller that computes with the nominal robot, so that the real one, which the
/// calibrated robot describes, goes where it is wanted.

/// How `Compensator` works.
struct CompensateOptions {
  InverseOptions inverse;  ///< of both solvers
  /// Wanted poses and commands are in each robot's own base frame, as programs have them; else in the measurement
  /// frame.
  bool in_base = false;
};

/// What to command of a controller that computes with the nominal robot.
struct Compensated {
  /// Of the calibrated robot: joints to command, whether the target is reached with them, and why not if it is not.
  Solution solution;
  /// shape=(4, 4) [m]: pose to command. A controller whose inverse kinematics is the nominal robot's takes these joints
  /// for it, if it stays in their configuration.
  Eigen::Isometry3d T_command = Eigen::Isometry3d::Identity();
  /// The joints are more than half a radian from those that the nominal robot would take: a controller that is given
  /// T_command may choose others.
  bool other_configuration = false;
  /// [m] how far the real robot would be from the task if the wanted pose were commanded as it is; not known where the
  /// nominal robot cannot reach it.
  double position_before = std::numeric_limits<double>::quiet_NaN();
  double rotation_before = std::numeric_limits<double>::quiet_NaN();  ///< [rad] likewise
  /// shape=(6,): standard error of where the target will be, from the covariance of the calibration: position [m] and
  /// rotation [rad] along the measurement frame's axes. NaN: no uncertainty was given.
  Eigen::Matrix<double, 6, 1> sigma = Eigen::Matrix<double, 6, 1>::Constant(std::numeric_limits<double>::quiet_NaN());
};

/// Built once from both robots, then const and safe across threads.
class Compensator {
 public:
  /// Throws std::invalid_argument when the robots have different joints, or as InverseSolver does.
  Compensator(const Robot& nominal, const Robot& calibrated, const CompensateOptions& options = {},
              const Conditions& conditions = {}, std::size_t target = 0, const std::vector<Effect>& own_effects = {});
  ~Compensator();
  Compensator(Compensator&&) noexcept;
  Compensator& operator=(Compensator&&) noexcept;

  /// What `identify` says of its parameters: `parameters` as it lists them, `covariance` of those that are not frozen.
  /// Throws std::invalid_argument on a parameter that the calibrated robot does not have, or a covariance of another
  /// size.
  void set_uncertainty(const std::vector<Parameter>& parameters, const Eigen::MatrixXd& covariance);

  const InverseSolver& nominal() const;
  const InverseSolver& calibrated() const;

  /// A pose of a program. `seed`: where the robot comes from; it decides the configuration, and of backlash the side.
  Compensated pose(const Task& task, const Joints& seed, const Conditions* conditions = nullptr) const;
  /// A joint position of a program: the nominal robot's pose there is what is wanted, all of it or what `like` asks
  /// for; arms of less than six joints seldom have all of it. The configuration stays, or the target is not reached.
  Compensated joints(const Joints& program, const Joints& seed, const Conditions* conditions = nullptr,
                     const Task& like = {}) const;

  /// One result per task, the same for any number of threads; seeds, conditions and progress as in
  /// InverseSolver::solve_batch.
  std::vector<Compensated> pose_batch(const std::vector<Task>& tasks, const std::vector<Joints>& seeds,
                                      const std::vector<Conditions>& conditions = {}, int threads = 0,
                                      const std::function<bool(std::size_t)>& progress = {}) const;
  /// One result per joint position of a program; the robot comes from the one before, to the first it does not move.
  std::vector<Compensated> joints_batch(const std::vector<Joints>& program,
                                        const std::vector<Conditions>& conditions = {}, int threads = 0,
                                        const std::function<bool(std::size_t)>& progress = {},
                                        const Task& like = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace truing
