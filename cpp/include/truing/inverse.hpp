// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "truing/model/effect.hpp"
#include "truing/model/robot.hpp"
#include "truing/model/scene.hpp"

namespace truing {

/// Inverse kinematics: joint readings that bring a target of the robot, nominal or calibrated and with its effects, to
/// where it is wanted. docs/method/inverse.md has the method.

/// So many driven joints a robot may have here: what is computed per solve stands on the stack.
constexpr int kMaxDrivenJoints = 16;

/// Readings of the driven joints, chain order [rad | m].
using Joints = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxDrivenJoints, 1>;

/// Geometric Jacobian by readings: linear [m] above angular [rad] motion of the target, about the measurement frame's
/// axes.
using TipJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxDrivenJoints>;

/// A closed interval; empty when lower > upper.
struct Window {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

enum class TaskKind {
  pose,   ///< position and orientation
  torch,  ///< axis-symmetric tool (5-DOF task): position and axis direction; the roll about the axis is free
  point,  ///< position alone
};

/// What is wanted of one target. The wanted pose's own axes say what the angles mean: with the default axes z is the
/// torch, x the direction of travel.
struct Task {
  Eigen::Isometry3d T_measurement_target = Eigen::Isometry3d::Identity();  ///< shape=(4, 4) [m] the wanted pose
  TaskKind kind = TaskKind::pose;                                          ///< what of it is asked for
  Eigen::Vector3d axis =
      Eigen::Vector3d::UnitZ();  ///< shape=(3,) of a torch: its axis in the target's frame, unit vector
  Eigen::Vector3d travel =
      Eigen::Vector3d::UnitX();  ///< shape=(3,) across `axis`: the direction that lead is measured in
  /// (lower, upper) [rad] of a torch: the turn about `axis` that takes the wanted frame to the reached one, in (-pi,
  /// pi].
  Window roll;
  double preferred_roll = std::numeric_limits<double>::quiet_NaN();  ///< [rad] the roll is as near to it as can be
  Window lead{0.0, 0.0};  ///< (lower, upper) [rad] of a torch: how far the axis may lean towards `travel`
  Window work{0.0, 0.0};  ///< (lower, upper) [rad] of a torch: how far the axis may lean towards `axis` x `travel`
  /// shape=(3,) unit vector in the wanted frame. Where every way to the target collides, the target is moved along it
  /// by the least that frees it; by default back along the torch.
  Eigen::Vector3d retreat = -Eigen::Vector3d::UnitZ();
  double longest_retreat = 0.0;  ///< [m] maximum of that motion; 0: the target is not moved
};

/// What acts on the robot besides its joints. Only what its effects ask for is looked at.
struct Conditions {
  /// Approach direction of every driven joint, -1, 0 or 1; empty: the way from the seed to the answer.
  std::vector<int> direction;
  double payload = 0.0;                                           ///< [kg] at the tool
  double temperature = std::numeric_limits<double>::quiet_NaN();  ///< [deg C]
  double time = std::numeric_limits<double>::quiet_NaN();         ///< [s]
  std::vector<double> joint_speed;                                ///< [rad/s | m/s] of every driven joint
  std::map<std::string, double> covariates;                       ///< what else the effects look at, by column name
};

/// Which of several answers.
enum class Choose {
  nearest,         ///< nearest to the seed
  limits_margin,   ///< furthest from the joint limits: by the smallest fraction of a joint's range left on either side
  manipulability,  ///< of the joints that turn, furthest from singular: sqrt(det(J J^T)), lengths over `reach / pi`
  rail_travel,     ///< least way of the prismatic joints from the seed, then nearest
};

/// How `InverseSolver` works.
struct InverseOptions {
  double position_tolerance = 1e-6;  ///< [m] a solution misses the task by no more
  double rotation_tolerance = 1e-6;  ///< [rad] likewise
  Choose choose = Choose::nearest;   ///< which of several solutions
  int max_iterations = 60;           ///< of one descent
  int max_restarts = 200;            ///< descents from other seeds before a target is given up
  double wrist_tolerance = 0.01;  ///< [m] axes that miss each other by no more are taken to meet, for the seeds alone
  double parallel_tolerance = 0.02;  ///< [rad] axes nearer to parallel than this are taken to be, for the seeds alone
  Scene scene;                       ///< what the robot must not touch

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

enum class Reason {
  reached,       ///< the task is met
  retreated,     ///< the target was moved by `retreat`, and is reached there
  collision,     ///< it could be reached, but there is a collision: `contact`
  out_of_reach,  ///< no joints reach it, limits aside: it stays away by `miss` along `direction`
  limit,         ///< the limit of `joint` is in the way, by `excess`
  singular,      ///< the target is within reach, but the way ends where the tip cannot move along `direction`
};

/// One solution of inverse kinematics.
struct Solution {
  Joints
      joints;  ///< shape=(driven joints,) [rad | m]: readings; of a failure the nearest that was found, within limits
  Reason reason = Reason::out_of_reach;  ///< what came of it
  double position_error = 0.0;           ///< [m] of the task, from a second forward computation
  double rotation_error = 0.0;           ///< [rad] of the task: what of the orientation is asked for
  double roll = 0.0;                     ///< [rad] of a torch: the turn about the axis from the wanted frame
  int branch = -1;                       ///< which of the closed form's branches it came from; -1: by descent
  int iterations = 0;                    ///< of all descents together
  double miss = 0.0;  ///< of a failure: [m], or [rad] when the position is reached and the orientation is not
  /// Of a failure, shape=(3,): from the nearest to the wanted, in the measurement frame.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  int joint = -1;       ///< driven joint whose limit is in the way, after them passive ones with limits; -1: none
  double excess = 0.0;  ///< [rad | m] how far beyond its limit it would have to go
  /// With a scene the nearest pair: index of a capsule; of another one, or number of capsules + index of an obstacle.
  std::array<int, 2> contact{-1, -1};
  /// [m] between their surfaces; negative: so deep. Infinite without a scene.
  double contact_distance = std::numeric_limits<double>::infinity();
  double retreat = 0.0;  ///< [m] how far the target was moved along the task's `retreat`

  bool reached() const { return reason == Reason::reached; }
};

/// Solutions that differ in configuration, at most as many as a closed form has.
struct Branches {
  std::array<Solution, 16> solution;
  int count = 0;
  int beyond_limits = 0;  ///< number of further ones, outside the joint limits
};

/// How `InverseSolver.path` works.
struct PathOptions {
  /// [rad] maximum step of a revolute joint between neighbouring targets; more is a gap (20 deg).
  double longest_turn = 0.3490658503988659;
  double longest_slide = 0.25;  ///< [m] the same of a prismatic joint
  int rolls = 24;               ///< samples of a torch's roll, where it is free
  int rail_places = 5;          ///< samples of each rail before the arm, over what it can be reached from
  /// Smoothing iterations of the path, where the task leaves degrees of freedom; up to ten times as many while a step
  /// is longer than allowed.
  int smoothing = 20;

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// Two neighbouring targets that the joints do not pass between in steps that are allowed.
struct PathGap {
  std::size_t start = 0;  ///< index of the target before it; the next is start + 1
  int joint = -1;         ///< the joint whose step is too long; -1: one of the two is not reached
  double step = 0.0;      ///< [rad | m]
};

/// Joints along a chain of targets.
struct Path {
  std::vector<Solution> solutions;  ///< one per target
  std::vector<PathGap> gaps;        ///< empty: every step is within the bounds
  double longest_turn = 0.0;        ///< [rad] the longest step of a revolute joint that is no gap
  double longest_slide = 0.0;       ///< [m] the same of a prismatic joint

  bool continuous() const { return gaps.empty(); }
};

/// Which closed form the robot's geometry has, once axes that nearly meet are taken to meet.
enum class ClosedFormKind { none, spherical_wrist, three_parallel };

/// A robot made ready for inverse kinematics: built once, then const and safe across threads; a solve allocates
/// nothing.
class InverseSolver {
 public:
  /// `conditions`: those of every solve that names no others; they also say which inputs there are.
  /// Throws std::invalid_argument when the robot, target or options cannot be used, or effects lack an input.
  explicit InverseSolver(const Robot& robot, const InverseOptions& options = {}, const Conditions& conditions = {},
                         std::size_t target = 0, const std::vector<Effect>& own_effects = {});
  ~InverseSolver();
  InverseSolver(InverseSolver&&) noexcept;
  InverseSolver& operator=(InverseSolver&&) noexcept;

  const Robot& robot() const;
  const InverseOptions& options() const;
  int driven_count() const;
  ClosedFormKind closed_form() const;
  /// The middle of every joint's range, or 0.
  Joints middle() const;

  /// Where the target is, effects included: what `predict` says. `direction` as in Conditions; empty: 0.
  Eigen::Isometry3d forward(const Joints& joints, const Conditions* conditions = nullptr) const;
  /// The same, with the Jacobian of the chain; what effects change in it is left out.
  Eigen::Isometry3d forward(const Joints& joints, TipJacobian* jacobian, const Conditions* conditions = nullptr) const;

  /// One answer, by Choose. Throws std::invalid_argument on a seed of the wrong size, on values that are not finite, on
  /// a wanted pose that is not rigid. What cannot be reached, the result says.
  Solution solve(const Task& task, const Joints& seed, const Conditions* conditions = nullptr) const;

  /// Every solution for a full pose: of a closed form its branches, carried over to the robot as it is. Prismatic
  /// joints before the arm stay at the seed's. Of each, the turns nearest to the seed within limits. Without closed
  /// form: what descents from 8 * max_restarts seeds found, not known to be all.
  void branches(const Task& task, const Joints& seed, Branches* found, const Conditions* conditions = nullptr) const;

  /// One solution per task; `seeds`: one for all or one per task; `conditions`: none, one, or one per task. The same
  /// for any number of threads (0: as many as the machine has). `progress` (done) is called now and then from the
  /// calling thread; false stops: what is left has reason out_of_reach.
  std::vector<Solution> solve_batch(const std::vector<Task>& tasks, const std::vector<Joints>& seeds,
                                    const std::vector<Conditions>& conditions = {}, int threads = 0,
                                    const std::function<bool(std::size_t)>& progress = {}) const;

  /// The next of a chain of poses that lie close together: Newton from `previous`, which the caller has from the pose
  /// before. It stays on its branch; where it cannot, the reason says why, and nothing else is tried.
  Solution follow(const Task& task, const Joints& previous, const Conditions* conditions = nullptr) const;

  /// A path through the targets in steps as short as can be: the cheapest chain over samples of roll, rails and
  /// branches (dynamic programming), then evened out and put on the robot as it is. Where no chain keeps within the
  /// steps, the gap is listed, and the path goes on from the cheapest place beyond it. `seed`: where the robot comes
  /// from.
  Path path(const std::vector<Task>& tasks, const Joints& seed, const PathOptions& options = {},
            const Conditions* conditions = nullptr, const std::function<bool(std::size_t)>& progress = {}) const;

  /// In a sentence: "J4 would have to go 0.12 rad beyond its limit".
  std::string describe(const Solution& solution) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace truing
