// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/inverse.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "inverse_kinematics/path.hpp"
#include "inverse_kinematics/solve.hpp"
#include "math/batch.hpp"
#include "math/text.hpp"
#include "rooms.hpp"

namespace truing {
using namespace inverse_kinematics;

namespace {
using Eigen::Matrix3d;
using Eigen::Vector3d;

void require_finite(const char* what, double value) {
  if (!std::isfinite(value)) throw std::invalid_argument(std::string(what) + " is not a finite number");
}

void require_task(const Task& task) {
  const Matrix3d R = task.T_measurement_target.linear();
  if (!task.T_measurement_target.matrix().allFinite())
    throw std::invalid_argument("the wanted pose has a value that is not finite");
  if ((R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff() > 1e-6 || R.determinant() < 0.0) {
    throw std::invalid_argument("the wanted pose is not rigid: its rotation must be orthonormal and right-handed");
  }
  if (!(std::abs(task.retreat.norm() - 1.0) <= 1e-6))
    throw std::invalid_argument("the direction of retreat is not of unit length");
  if (task.kind != TaskKind::torch) return;
  if (!(std::abs(task.axis.norm() - 1.0) <= 1e-6)) throw std::invalid_argument("the tool's axis is not of unit length");
  if (!(task.travel.cross(task.axis).norm() > 1e-6))
    throw std::invalid_argument("the direction of travel lies along the tool's axis");
  for (const auto& [name, window] :
       {std::make_pair("roll", task.roll), std::make_pair("lead", task.lead), std::make_pair("work", task.work)}) {
    if (!(window.lower <= window.upper))
      throw std::invalid_argument(std::string("the window of ") + name +
                                  " is empty: its lower end is above its upper one");
  }
}

void require_readings(const Joints& seed, int driven) {
  if (seed.size() != driven) {
    throw std::invalid_argument("got " + std::to_string(seed.size()) + " joint readings, the robot has " +
                                std::to_string(driven) + " driven joints");
  }
  for (Eigen::Index j = 0; j < seed.size(); ++j) require_finite("a joint reading", seed[j]);
}

/// Effects ask for approach directions, and nobody said which: those of the way from the seed.
bool by_way(const Borrowed& scratch, const Conditions& given) { return scratch.get() && given.direction.empty(); }

Eigen::Isometry3d isometry(const Tip& tip) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = tip.rotation;
  T.translation() = tip.position;
  return T;
}

}  // namespace

bool InverseOptions::is_valid(std::string* error) const {
  const auto refuse = [error](const std::string& why) {
    if (error) *error = why;
    return false;
  };
  if (!(position_tolerance >= 1e-12)) return refuse("position_tolerance must be 1e-12 m or more");
  if (!(rotation_tolerance >= 1e-12)) return refuse("rotation_tolerance must be 1e-12 rad or more");
  if (max_iterations < 1) return refuse("max_iterations must be 1 or more");
  if (max_restarts < 0) return refuse("max_restarts must not be negative");
  if (!(wrist_tolerance >= 0.0)) return refuse("wrist_tolerance must not be negative");
  if (!(parallel_tolerance >= 0.0 && parallel_tolerance < 0.1))
    return refuse("parallel_tolerance must be from 0 to 0.1 rad");
  return true;
}

bool PathOptions::is_valid(std::string* error) const {
  const auto refuse = [error](const std::string& why) {
    if (error) *error = why;
    return false;
  };
  if (!(longest_turn > 0.0 && longest_slide > 0.0)) return refuse("the longest steps must be more than zero");
  if (rolls < 1 || rail_places < 1) return refuse("rolls and rail_places must be 1 or more");
  if (smoothing < 0) return refuse("smoothing must not be negative");
  return true;
}

struct InverseSolver::Impl {
  Impl(const Robot& r, const InverseOptions& options, const Conditions& available, std::size_t target,
       const std::vector<Effect>& own)
      : robot(r, options, available, target, own), conditions(available), pool(robot.arm) {
    Borrowed(robot.arm, &pool, conditions);  // complains about inputs that are missing
  }

  const PreparedRobot robot;
  const Conditions conditions;
  mutable ScratchPool pool;
};

InverseSolver::InverseSolver(const Robot& robot, const InverseOptions& options, const Conditions& conditions,
                             std::size_t target, const std::vector<Effect>& own_effects)
    : impl_(std::make_unique<Impl>(robot, options, conditions, target, own_effects)) {}
InverseSolver::~InverseSolver() = default;
InverseSolver::InverseSolver(InverseSolver&&) noexcept = default;
InverseSolver& InverseSolver::operator=(InverseSolver&&) noexcept = default;

const Robot& InverseSolver::robot() const { return impl_->robot.arm.robot(); }
const InverseOptions& InverseSolver::options() const { return impl_->robot.options; }
int InverseSolver::driven_count() const { return impl_->robot.driven(); }
ClosedFormKind InverseSolver::closed_form() const { return impl_->robot.closed.kind(); }

Joints InverseSolver::middle() const {
  Joints q(driven_count());
  for (int j = 0; j < driven_count(); ++j) {
    const double low = impl_->robot.limits.lower[j], high = impl_->robot.limits.upper[j];
    q[j] = std::isfinite(low) && std::isfinite(high) ? 0.5 * (low + high) : std::clamp(0.0, low, high);
  }
  return q;
}

Eigen::Isometry3d InverseSolver::forward(const Joints& joints, const Conditions* conditions) const {
  require_readings(joints, driven_count());
  const Borrowed scratch(impl_->robot.arm, &impl_->pool, conditions ? *conditions : impl_->conditions);
  return isometry(impl_->robot.arm.tip(joints.data(), scratch.get()));
}

Eigen::Isometry3d InverseSolver::forward(const Joints& joints, TipJacobian* jacobian,
                                         const Conditions* conditions) const {
  require_readings(joints, driven_count());
  const Borrowed scratch(impl_->robot.arm, &impl_->pool, conditions ? *conditions : impl_->conditions);
  Columns columns;
  const Tip tip = impl_->robot.arm.tip(joints.data(), scratch.get(), &columns);
  jacobian->resize(6, driven_count());
  for (int j = 0; j < driven_count(); ++j) jacobian->col(j) << columns.linear[j], columns.angular[j];
  return isometry(tip);
}

Solution InverseSolver::solve(const Task& task, const Joints& seed, const Conditions* conditions) const {
  require_task(task);
  require_readings(seed, driven_count());
  const Conditions& given = conditions ? *conditions : impl_->conditions;
  const Borrowed scratch(impl_->robot.arm, &impl_->pool, given);
  const Goal goal(task);
  Trace trace;
  return inverse_kinematics::solve({impl_->robot, goal, seed.data(), scratch.get()}, by_way(scratch, given), &trace);
}

void InverseSolver::branches(const Task& task, const Joints& seed, Branches* found,
                             const Conditions* conditions) const {
  require_task(task);
  require_readings(seed, driven_count());
  if (task.kind != TaskKind::pose)
    throw std::invalid_argument(
        "branches are those of a full pose: a task that leaves something free has endlessly many");
  const Conditions& given = conditions ? *conditions : impl_->conditions;
  const Borrowed scratch(impl_->robot.arm, &impl_->pool, given);
  const Goal goal(task);
  find_branches({impl_->robot, goal, seed.data(), scratch.get()}, by_way(scratch, given), found);
}

Solution InverseSolver::follow(const Task& task, const Joints& previous, const Conditions* conditions) const {
  require_task(task);
  require_readings(previous, driven_count());
  const Conditions& given = conditions ? *conditions : impl_->conditions;
  const Borrowed scratch(impl_->robot.arm, &impl_->pool, given);
  const Goal goal(task);
  return inverse_kinematics::follow({impl_->robot, goal, previous.data(), scratch.get()}, by_way(scratch, given));
}

Path InverseSolver::path(const std::vector<Task>& tasks, const Joints& seed, const PathOptions& options,
                         const Conditions* conditions, const std::function<bool(std::size_t)>& progress) const {
  std::string why;
  if (!options.is_valid(&why)) throw std::invalid_argument(why);
  require_readings(seed, driven_count());
  std::vector<Goal> goals;
  for (const Task& task : tasks) {
    require_task(task);
    goals.emplace_back(task);
  }
  const Conditions& given = conditions ? *conditions : impl_->conditions;
  const Borrowed scratch(impl_->robot.arm, &impl_->pool, given);
  return find_path(impl_->robot, goals, seed.data(), options, scratch.get(), by_way(scratch, given), progress);
}

std::vector<Solution> InverseSolver::solve_batch(const std::vector<Task>& tasks, const std::vector<Joints>& seeds,
                                                 const std::vector<Conditions>& conditions, int threads,
                                                 const std::function<bool(std::size_t)>& progress) const {
  if (seeds.size() != 1 && seeds.size() != tasks.size()) {
    throw std::invalid_argument("got " + std::to_string(seeds.size()) + " seeds for " + std::to_string(tasks.size()) +
                                " tasks: give one, or one for each");
  }
  if (conditions.size() > 1 && conditions.size() != tasks.size()) {
    throw std::invalid_argument("got " + std::to_string(conditions.size()) + " conditions for " +
                                std::to_string(tasks.size()) + " tasks: give none, one, or one for each");
  }
  for (const Task& task : tasks) require_task(task);
  for (const Joints& seed : seeds) require_readings(seed, driven_count());
  const auto conditions_of = [&](std::size_t k) -> const Conditions* {
    return conditions.empty() ? nullptr : &conditions[conditions.size() == 1 ? 0 : k];
  };
  std::vector<Solution> solutions(tasks.size());
  for_each_on_threads(tasks.size(), threads, progress, [&](std::size_t k) {
    solutions[k] = solve(tasks[k], seeds[seeds.size() == 1 ? 0 : k], conditions_of(k));
  });
  return solutions;
}

std::string InverseSolver::describe(const Solution& solution) const {
  const auto direction = [&] {
    return "(" + number(solution.direction.x(), 3) + ", " + number(solution.direction.y(), 3) + ", " +
           number(solution.direction.z(), 3) + ")";
  };
  const auto contact = [&] {
    const Scene& scene = impl_->robot.options.scene;
    const auto second = static_cast<std::size_t>(solution.contact[1]);
    return scene.capsules[static_cast<std::size_t>(solution.contact[0])].name + " and " +
           (second < scene.capsules.size() ? scene.capsules[second].name
                                           : scene.obstacles[second - scene.capsules.size()].name);
  };
  const bool turned = solution.position_error <= impl_->robot.options.position_tolerance;
  const std::string miss = turned ? number(solution.miss, 3) + " rad about " + direction()
                                  : number(1e3 * solution.miss, 4) + " mm in direction " + direction();
  switch (solution.reason) {
    case Reason::reached:
      return "reached";
    case Reason::retreated:
      return "reached " + number(1e3 * solution.retreat, 4) + " mm back, free of what is in the way";
    case Reason::collision:
      return contact() + " are " + number(-1e3 * solution.contact_distance, 4) + " mm in each other";
    case Reason::out_of_reach:
      return "out of reach by " + miss;
    case Reason::singular:
      return "singular: the tip cannot move along " + direction() + "; " + number(1e3 * solution.position_error, 4) +
             " mm are left";
    case Reason::limit:
      break;
  }
  std::vector<const Joint*> joints;
  for (const Joint& joint : robot().joints) {
    if (!joint.passive()) joints.push_back(&joint);
  }
  for (const Joint& joint : robot().joints) {
    if (joint.passive() && (std::isfinite(joint.lower) || std::isfinite(joint.upper))) joints.push_back(&joint);
  }
  const Joint& joint = *joints.at(static_cast<std::size_t>(solution.joint));
  return joint.name + " would have to go " + number(solution.excess, 3) +
         (joint.type == JointType::revolute ? " rad" : " m") + " beyond its limit; nearest: " + miss;
}

}  // namespace truing
