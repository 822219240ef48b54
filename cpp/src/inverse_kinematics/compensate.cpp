// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/compensate.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "inverse_kinematics/arm.hpp"
#include "inverse_kinematics/descent.hpp"
#include "math/batch.hpp"
#include "rooms.hpp"

namespace truing {
using namespace inverse_kinematics;

namespace {
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

std::string frame_of(const std::string& parameter) { return parameter.substr(0, parameter.rfind('.')); }

/// 0, 1, 2 for the reported rotation vector of a frame (not for effects, whose names have more parts); -1 else.
int orientation_axis(const ParameterInfo& info) {
  const std::string name = info.name.substr(info.name.rfind('.') + 1);
  if (info.role == Role::effect) return -1;
  return name == "rx" ? 0 : name == "ry" ? 1 : name == "rz" ? 2 : -1;
}

void require_one_or_each(const char* what, std::size_t found, std::size_t rows) {
  if (found == 1 || found == rows) return;
  throw std::invalid_argument("got " + std::to_string(found) + " " + what + " for " + std::to_string(rows) +
                              " rows: give one, or one for each");
}

const Conditions* one_or_each(const std::vector<Conditions>& conditions, std::size_t k) {
  return conditions.empty() ? nullptr : &conditions[conditions.size() == 1 ? 0 : k];
}

/// Compensation moves joints by milliradians, near singularities by more: what turns further is another configuration.
bool same_configuration(const Robot& robot, const Joints& a, const Joints& b) {
  constexpr double kTurn = 0.5;   // [rad]
  constexpr double kSlide = 0.1;  // [m]
  Eigen::Index k = 0;
  for (const std::size_t joint : robot.driven_joints()) {
    if (std::abs(a[k] - b[k]) >
        (robot.joints[joint].type == JointType::prismatic ? kSlide : kTurn * std::abs(1.0 / robot.joints[joint].ratio)))
      return false;
    ++k;
  }
  return true;
}

/// dw = J dv for a rotation exp(v): the left Jacobian of SO(3) (Sola, Deray, Atchuthan 2018, eq. 145).
Matrix3d left_jacobian(const Vector3d& v) {
  Matrix3d cross;
  cross << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  const double angle = v.norm();
  if (angle < 1e-4) return Matrix3d::Identity() + 0.5 * cross;
  return Matrix3d::Identity() + (1.0 - std::cos(angle)) / (angle * angle) * cross +
         (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
}

}  // namespace

struct Compensator::Impl {
  CompensateOptions options;
  Conditions conditions;
  InverseSolver nominal, calibrated;
  Arm arm;  ///< the calibrated one, for what its parameters do
  mutable ScratchPool pool;
  std::vector<int> parameters;  ///< of the model, those that are known but for `covariance`
  Eigen::MatrixXd covariance;   ///< of the parameters' own motions: rotation vectors turned into rotations

  Impl(const Robot& n, const Robot& c, const CompensateOptions& o, const Conditions& given, std::size_t target,
       const std::vector<Effect>& own)
      : options(o),
        conditions(given),
        nominal(n, o.inverse, given, target, own),
        calibrated(c, o.inverse, given, target, own),
        arm(c, given, target, own),
        pool(arm) {
    if (nominal.driven_count() != calibrated.driven_count()) {
      throw std::invalid_argument("the nominal robot has " + std::to_string(nominal.driven_count()) +
                                  " driven joints, the calibrated one " + std::to_string(calibrated.driven_count()));
    }
  }

  /// The way from the seed, where effects ask for it and nobody said: as the nominal robot goes.
  const Conditions* with_direction(const Conditions& given, const Joints& seed, const Joints& way_to,
                                   Conditions* own) const {
    if (!arm.has_effects() || !given.direction.empty()) return &given;
    *own = given;
    own->direction.resize(static_cast<std::size_t>(seed.size()));
    for (Eigen::Index j = 0; j < seed.size(); ++j)
      own->direction[static_cast<std::size_t>(j)] = way_to[j] > seed[j] ? 1 : way_to[j] < seed[j] ? -1 : 0;
    return own;
  }

  void before(const Task& task, const Joints& nominal_joints, const Conditions* given, Compensated* out) const {
    const Isometry3d T = calibrated.forward(nominal_joints, given);
    const Miss miss = miss_of(Goal(task), {T.linear(), T.translation()});
    out->position_before = miss.position;
    out->rotation_before = miss.rotation;
  }

  void finish(const Conditions* given, Compensated* out) const {
    out->T_command = nominal.forward(out->solution.joints, given);
    if (options.in_base) out->T_command = nominal.robot().T_measurement_base.inverse() * out->T_command;
    if (parameters.empty()) return;
    std::unique_ptr<EffectScratch> scratch;
    if (arm.has_effects()) {
      scratch = pool.take();
      arm.set_conditions(*given, scratch.get());
    }
    Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, static_cast<Eigen::Index>(parameters.size()));
    arm.parameter_motions(out->solution.joints.data(), scratch.get(), parameters, &J);
    if (scratch) pool.give_back(std::move(scratch));
    out->sigma = (J * covariance * J.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  }
};

Compensator::Compensator(const Robot& nominal, const Robot& calibrated, const CompensateOptions& options,
                         const Conditions& conditions, std::size_t target, const std::vector<Effect>& own_effects)
    : impl_(std::make_unique<Impl>(nominal, calibrated, options, conditions, target, own_effects)) {}
Compensator::~Compensator() = default;
Compensator::Compensator(Compensator&&) noexcept = default;
Compensator& Compensator::operator=(Compensator&&) noexcept = default;

const InverseSolver& Compensator::nominal() const { return impl_->nominal; }
const InverseSolver& Compensator::calibrated() const { return impl_->calibrated; }

void Compensator::set_uncertainty(const std::vector<Parameter>& parameters, const Eigen::MatrixXd& covariance) {
  const Model& model = impl_->arm.model();
  std::vector<int> known;
  for (const Parameter& parameter : parameters) {
    if (parameter.frozen) continue;
    const int index = model.parameter_index(parameter.name);
    // Anchor and fixed points are the instrument's: they move no target.
    if (index < 0 && parameter.name.compare(0, 6, "point.") != 0) {
      throw std::invalid_argument("the calibrated robot has no parameter '" + parameter.name + "'");
    }
    known.push_back(index);
  }
  if (covariance.rows() != static_cast<Eigen::Index>(known.size()) || covariance.cols() != covariance.rows()) {
    throw std::invalid_argument("the covariance is " + std::to_string(covariance.rows()) + " x " +
                                std::to_string(covariance.cols()) + ", but " + std::to_string(known.size()) +
                                " parameters are not frozen");
  }
  // Orientations are reported as rotation vectors; what moves the target is the rotation on top.
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols());
  const auto value_of = [&parameters](const std::string& name) {
    for (const Parameter& parameter : parameters) {
      if (parameter.name == name) return parameter.value;
    }
    return 0.0;
  };
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (known[i] < 0 || orientation_axis(model.parameters[known[i]]) < 0) continue;
    const std::string frame = frame_of(model.parameters[known[i]].name);
    const Matrix3d J = left_jacobian({value_of(frame + ".rx"), value_of(frame + ".ry"), value_of(frame + ".rz")});
    for (std::size_t k = 0; k < known.size(); ++k) {
      if (known[k] < 0) continue;
      const ParameterInfo& other = model.parameters[known[k]];
      if (orientation_axis(other) < 0 || frame_of(other.name) != frame) continue;
      T(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          J(orientation_axis(model.parameters[known[i]]), orientation_axis(other));
    }
  }
  impl_->parameters = known;
  impl_->covariance = T * covariance * T.transpose();
}

Compensated Compensator::pose(const Task& task, const Joints& seed, const Conditions* conditions) const {
  const Conditions& given = conditions ? *conditions : impl_->conditions;
  Task nominal_task = task, real_task = task;
  if (impl_->options.in_base) {
    nominal_task.T_measurement_target = impl_->nominal.robot().T_measurement_base * task.T_measurement_target;
    real_task.T_measurement_target = impl_->calibrated.robot().T_measurement_base * task.T_measurement_target;
  }
  Compensated out;
  const Solution believed = impl_->nominal.solve(nominal_task, seed, &given);
  const Joints& from = believed.reached() ? believed.joints : seed;
  Conditions own;
  const Conditions* with = impl_->with_direction(given, seed, from, &own);
  if (believed.reached()) impl_->before(real_task, from, with, &out);
  out.solution = impl_->calibrated.solve(real_task, from, with);
  out.other_configuration =
      believed.reached() && !same_configuration(impl_->calibrated.robot(), out.solution.joints, from);
  impl_->finish(with, &out);
  return out;
}

Compensated Compensator::joints(const Joints& program, const Joints& seed, const Conditions* conditions,
                                const Task& like) const {
  const Conditions& given = conditions ? *conditions : impl_->conditions;
  Conditions own;
  const Conditions* with = impl_->with_direction(given, seed, program, &own);
  Task task = like;
  task.T_measurement_target = impl_->nominal.forward(program, with);
  if (impl_->options.in_base) {
    task.T_measurement_target = impl_->calibrated.robot().T_measurement_base *
                                impl_->nominal.robot().T_measurement_base.inverse() * task.T_measurement_target;
  }
  Compensated out;
  impl_->before(task, program, with, &out);
  out.solution = impl_->calibrated.follow(task, program, with);
  if (!out.solution.reached()) {
    const Solution other = impl_->calibrated.solve(task, program, with);
    if (other.reached() && same_configuration(impl_->calibrated.robot(), other.joints, program)) out.solution = other;
  }
  out.other_configuration = !same_configuration(impl_->calibrated.robot(), out.solution.joints, program);
  impl_->finish(with, &out);
  return out;
}

std::vector<Compensated> Compensator::pose_batch(const std::vector<Task>& tasks, const std::vector<Joints>& seeds,
                                                 const std::vector<Conditions>& conditions, int threads,
                                                 const std::function<bool(std::size_t)>& progress) const {
  require_one_or_each("seeds", seeds.size(), tasks.size());
  if (!conditions.empty()) require_one_or_each("conditions", conditions.size(), tasks.size());
  std::vector<Compensated> results(tasks.size());
  for_each_on_threads(tasks.size(), threads, progress, [&](std::size_t k) {
    results[k] = pose(tasks[k], seeds[seeds.size() == 1 ? 0 : k], one_or_each(conditions, k));
  });
  return results;
}

std::vector<Compensated> Compensator::joints_batch(const std::vector<Joints>& program,
                                                   const std::vector<Conditions>& conditions, int threads,
                                                   const std::function<bool(std::size_t)>& progress,
                                                   const Task& like) const {
  if (!conditions.empty()) require_one_or_each("conditions", conditions.size(), program.size());
  std::vector<Compensated> results(program.size());
  for_each_on_threads(program.size(), threads, progress, [&](std::size_t k) {
    results[k] = joints(program[k], program[k == 0 ? 0 : k - 1], one_or_each(conditions, k), like);
  });
  return results;
}

}  // namespace truing
