// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "inverse_kinematics/arm.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "math/trigonometry.hpp"
#include "model/gravity.hpp"
#include "model/motion.hpp"

namespace truing::inverse_kinematics {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr int kMostSteps = 96;

/// Turns z into the axis that an elementary transform turns about or moves along.
Matrix3d z_to_axis(Motion motion) {
  Matrix3d R = Matrix3d::Identity();
  switch (motion) {
    case Motion::rotate_x:
    case Motion::translate_x:
      R << 0, 0, 1, 1, 0, 0, 0, 1, 0;
      break;
    case Motion::rotate_y:
    case Motion::translate_y:
      R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
      break;
    default:
      break;
  }
  return R;
}

Isometry3d about_z(double angle) { return Isometry3d(AngleAxisd(angle, Vector3d::UnitZ())); }
Isometry3d along_z(double length) { return Isometry3d(Translation3d(0.0, 0.0, length)); }

JointFrame joint_frame(Convention convention, const Joint& joint) {
  JointFrame frame{Isometry3d::Identity(), Isometry3d::Identity(), joint.type == JointType::prismatic};
  const Isometry3d link(Translation3d(joint.a, 0.0, 0.0));
  switch (convention) {
    case Convention::dh:
      frame.after = about_z(joint.theta) * along_z(joint.d) * link * AngleAxisd(joint.alpha, Vector3d::UnitX()) *
                    AngleAxisd(joint.beta, Vector3d::UnitY());
      break;
    case Convention::mdh:
      frame.before = Isometry3d(AngleAxisd(joint.alpha, Vector3d::UnitX())) * link *
                     AngleAxisd(joint.beta, Vector3d::UnitY()) * about_z(joint.theta) * along_z(joint.d);
      break;
    case Convention::urdf: {
      const Isometry3d z_to_joint(Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), joint.axis));
      frame.before = joint.T_parent_joint * z_to_joint;
      frame.after = z_to_joint.inverse();
      break;
    }
  }
  return frame;
}

/// Measurements of one row whose columns are those that `available` has.
void add_columns(const Conditions& available, EffectScratch* scratch) {
  scratch->data.rows = 1;
  for (double& reading : scratch->reading) scratch->data.joints.push_back({&reading, 1});
  for (double& direction : scratch->direction) scratch->data.direction.push_back({&direction, 1});
  for (double& speed : scratch->speed) scratch->data.joint_speed.push_back({&speed, 1});
  scratch->data.payload = {&scratch->payload, 1};
  if (std::isfinite(available.temperature)) scratch->data.temperature = {&scratch->temperature, 1};
  if (std::isfinite(available.time)) scratch->data.time = {&scratch->time, 1};
  std::size_t at = 0;
  for (const auto& covariate : available.covariates)
    scratch->data.covariates[covariate.first] = {&scratch->covariates[at++], 1};
}

std::unique_ptr<EffectScratch> scratch_for(const Conditions& available, std::size_t driven) {
  auto scratch = std::make_unique<EffectScratch>();
  scratch->reading.assign(driven, 0.0);
  scratch->direction.assign(driven, 0.0);
  scratch->speed.assign(available.joint_speed.empty() ? 0 : driven, 0.0);
  scratch->covariates.assign(available.covariates.size(), 0.0);
  add_columns(available, scratch.get());
  return scratch;
}

Model model_for(const Robot& robot, const Conditions& available, const std::vector<Effect>& own_effects) {
  validate(robot);
  const std::size_t driven = robot.driven_count();
  if (driven == 0) throw std::invalid_argument("the robot has no joint with a reading");
  if (driven > static_cast<std::size_t>(kMaxDrivenJoints)) {
    throw std::invalid_argument("the robot has " + std::to_string(driven) +
                                " driven joints; inverse kinematics takes at most " + std::to_string(kMaxDrivenJoints));
  }
  const std::unique_ptr<EffectScratch> scratch = scratch_for(available, driven);
  return make_model(robot, scratch->data, {}, own_effects);
}

}  // namespace

Arm::Arm(const Robot& robot, const Conditions& available, std::size_t target, const std::vector<Effect>& own_effects)
    : model_(model_for(robot, available, own_effects)),
      available_(available),
      target_(target),
      driven_(static_cast<int>(robot.driven_count())) {
  if (target >= model_.robot.targets.size()) {
    throw std::invalid_argument("target " + std::to_string(target) + " does not exist; the robot has " +
                                std::to_string(model_.robot.targets.size()) + " targets, counted from 0");
  }
  T_last_target_ = model_.robot.targets[target].T_last_target;
  const Eigen::VectorXd values = initial_values(model_);

  // What moves each site: readings and terms, each with a weight, on top of a constant.
  struct Moved {
    double constant = 0.0;
    std::vector<std::pair<int, double>> joints, terms;
  };
  std::vector<Moved> moved(model_.sites.size());
  for (std::size_t s = 0; s < moved.size(); ++s) {
    if (model_.sites[s].parameter >= 0) moved[s].constant = values[model_.sites[s].parameter];
  }
  for (const Coordinate& coordinate : model_.coordinates) {
    for (const auto& [site, weight] : coordinate.sites) {
      if (coordinate.offset >= 0) moved[site].constant += weight * values[coordinate.offset];
      if (coordinate.reading >= 0)
        moved[site].joints.push_back({coordinate.reading, weight * values[coordinate.ratio]});
      for (const int term : coordinate.terms) {
        const double theta = values[model_.term_parameter[term]];
        if (theta == 0.0) continue;
        moved[site].terms.push_back({term, weight * theta});
      }
    }
  }

  for (const Term& term : model_.terms) gravity_ = gravity_ || term.needs_gravity;

  // What does not move is folded into the frame before the next motion.
  Isometry3d fixed = Isometry3d::Identity();
  const auto add_site = [&](int index) {
    const Site& site = model_.sites[index];
    if (site.motion == Motion::fixed) {
      fixed = fixed * Isometry3d(site.fixed);
      return;
    }
    const Moved& move = moved[index];
    const Isometry3d to_axis(z_to_axis(site.motion));
    fixed = fixed * to_axis * (is_rotation(site.motion) ? about_z(move.constant) : along_z(move.constant));
    if (!move.joints.empty() || !move.terms.empty()) {
      joint_weights_.insert(joint_weights_.end(), move.joints.begin(), move.joints.end());
      term_weights_.insert(term_weights_.end(), move.terms.begin(), move.terms.end());
      add_step(fixed, !is_rotation(site.motion));
      fixed = Isometry3d::Identity();
    }
    fixed = fixed * to_axis.inverse();
  };
  for (int s = 0; s < model_.common_sites; ++s) add_site(s);
  for (int s = model_.target_first[target]; s < model_.target_first[target + 1]; ++s) add_site(s);
  last_rotation_ = fixed.linear();
  last_shift_ = fixed.translation();

  for (const Joint& joint : model_.robot.joints) joint_frames_.push_back(joint_frame(model_.robot.convention, joint));
  coupling_ = coupling_matrix(model_.robot);
  const auto n = static_cast<Eigen::Index>(model_.robot.joints.size());
  motion_weights_ = Eigen::MatrixXd::Zero(n, driven_);
  motion_constants_ = Eigen::VectorXd::Zero(n);
  Eigen::Index reading = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Joint& joint = model_.robot.joints[static_cast<std::size_t>(k)];
    motion_constants_ += joint.offset * coupling_.col(k);
    if (joint.passive()) continue;
    turns_[reading] = joint.type == JointType::revolute;
    motion_weights_.col(reading++) = joint.ratio * coupling_.col(k);
  }
}

void Arm::add_step(const Isometry3d& fixed, bool prismatic) {
  Step step;
  step.rotation = fixed.linear();
  step.shift = fixed.translation();
  step.turns = !fixed.linear().isIdentity(0.0);
  step.prismatic = prismatic;
  step.first_joint = steps_.empty() ? 0 : steps_.back().end_joint;
  step.end_joint = static_cast<int>(joint_weights_.size());
  step.first_term = steps_.empty() ? 0 : steps_.back().end_term;
  step.end_term = static_cast<int>(term_weights_.size());
  steps_.push_back(step);
  if (steps_.size() > static_cast<std::size_t>(kMostSteps))
    throw std::invalid_argument("too many moving transforms: fewer effects, please");
}

template <bool with_columns>
Tip Arm::sweep(const double* readings, EffectScratch* scratch, Columns* columns) const {
  // The motions first, and their sines and cosines side by side.
  double value[kMostSteps], sine[kMostSteps], cosine[kMostSteps];
  const int count = static_cast<int>(steps_.size());
  for (int k = 0; k < count; ++k) {
    const Step& step = steps_[static_cast<std::size_t>(k)];
    value[k] = 0.0;
    for (int i = step.first_joint; i < step.end_joint; ++i)
      value[k] += joint_weights_[i].second * readings[joint_weights_[i].first];
    for (int i = step.first_term; i < step.end_term; ++i)
      value[k] += term_weights_[i].second * scratch->basis[term_weights_[i].first];
  }
  sines_cosines(value, count, sine, cosine);

  Vector3d axis[kMostSteps], origin[kMostSteps];
  Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ(), p = Vector3d::Zero();
  const auto turn = [&x, &y, &z](const Matrix3d& R) {
    const Vector3d nx = x * R(0, 0) + y * R(1, 0) + z * R(2, 0);
    const Vector3d ny = x * R(0, 1) + y * R(1, 1) + z * R(2, 1);
    z = x * R(0, 2) + y * R(1, 2) + z * R(2, 2);
    x = nx;
    y = ny;
  };
  for (int k = 0; k < count; ++k) {
    const Step& step = steps_[static_cast<std::size_t>(k)];
    p += x * step.shift.x() + y * step.shift.y() + z * step.shift.z();
    if (step.turns) turn(step.rotation);
    if constexpr (with_columns) {
      axis[k] = z;
      origin[k] = p;
    }
    if (step.prismatic) {
      p += value[k] * z;
    } else {
      const Vector3d nx = cosine[k] * x + sine[k] * y;
      y = cosine[k] * y - sine[k] * x;
      x = nx;
    }
  }
  p += x * last_shift_.x() + y * last_shift_.y() + z * last_shift_.z();
  turn(last_rotation_);

  if constexpr (with_columns) {  // [a x (p - o); a] and [a; 0], times how much each reading moves them
    for (int j = 0; j < driven_; ++j) columns->linear[j] = columns->angular[j] = Vector3d::Zero();
    for (int k = 0; k < count; ++k) {
      const Step& step = steps_[static_cast<std::size_t>(k)];
      for (int i = step.first_joint; i < step.end_joint; ++i) {
        const auto& [joint, weight] = joint_weights_[i];
        const Vector3d a = weight * axis[k];
        if (step.prismatic) {
          columns->linear[joint] += a;
        } else {
          columns->linear[joint] += a.cross(p - origin[k]);
          columns->angular[joint] += a;
        }
      }
    }
  }
  Tip tip;
  tip.rotation.col(0) = x;
  tip.rotation.col(1) = y;
  tip.rotation.col(2) = z;
  tip.position = p;
  return tip;
}

Tip Arm::tip(const double* readings, EffectScratch* scratch) const {
  if (!term_weights_.empty()) evaluate_terms(readings, scratch);
  return sweep<false>(readings, scratch, nullptr);
}

Tip Arm::tip(const double* readings, EffectScratch* scratch, Columns* columns) const {
  if (!term_weights_.empty()) evaluate_terms(readings, scratch);
  return sweep<true>(readings, scratch, columns);
}

void Arm::link_frames(const double* readings, Isometry3d* frames) const {
  Isometry3d T = model_.robot.T_measurement_base;
  for (std::size_t k = 0; k < joint_frames_.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    double motion = motion_constants_[row];
    for (int j = 0; j < driven_; ++j) motion += motion_weights_(row, j) * readings[j];
    const JointFrame& frame = joint_frames_[k];
    T = T * frame.before * (frame.prismatic ? along_z(motion) : about_z(motion)) * frame.after;
    frames[k] = T;
  }
  frames[joint_frames_.size()] = T * T_last_target_;
}

std::vector<HomeAxis> Arm::home_axes(Tip* tip) const {
  std::vector<HomeAxis> axes;
  Isometry3d T = Isometry3d::Identity();
  for (const Step& step : steps_) {
    Isometry3d fixed(step.rotation);
    fixed.translation() = step.shift;
    T = T * fixed;
    HomeAxis axis{T.linear().col(2), T.translation(), step.prismatic, {}};
    axis.joints.assign(joint_weights_.begin() + step.first_joint, joint_weights_.begin() + step.end_joint);
    if (!axis.joints.empty()) axes.push_back(axis);
  }
  tip->rotation = T.linear() * last_rotation_;
  tip->position = T * last_shift_;
  return axes;
}

void Arm::parameter_motions(const double* readings, EffectScratch* scratch, const std::vector<int>& parameters,
                            Eigen::Matrix<double, 6, Eigen::Dynamic>* motions) const {
  const Eigen::VectorXd values = initial_values(model_);
  std::vector<double> site_value(model_.sites.size(), 0.0);
  for (std::size_t s = 0; s < site_value.size(); ++s) {
    if (model_.sites[s].parameter >= 0) site_value[s] = values[model_.sites[s].parameter];
  }
  if (!model_.terms.empty()) evaluate_terms(readings, scratch);
  for (const Coordinate& coordinate : model_.coordinates) {
    double value = coordinate.offset < 0 ? 0.0 : values[coordinate.offset];
    if (coordinate.reading >= 0) value += values[coordinate.ratio] * readings[coordinate.reading];
    for (const int term : coordinate.terms)
      value += values[model_.term_parameter[term]] * scratch->basis[static_cast<std::size_t>(term)];
    for (const auto& [site, weight] : coordinate.sites) site_value[static_cast<std::size_t>(site)] += weight * value;
  }

  // Axis and origin of every site on the way to this target.
  std::vector<Vector3d> axis(model_.sites.size(), Vector3d::Zero()), origin(model_.sites.size(), Vector3d::Zero());
  std::vector<bool> passed(model_.sites.size(), false);
  Isometry3d T = Isometry3d::Identity();
  const auto pass = [&](int index) {
    const Site& site = model_.sites[static_cast<std::size_t>(index)];
    const auto at = static_cast<std::size_t>(index);
    if (site.motion == Motion::fixed) {
      T = T * Isometry3d(site.fixed);
      return;
    }
    const Isometry3d to_axis(z_to_axis(site.motion));
    axis[at] = T.linear() * to_axis.linear().col(2);
    origin[at] = T.translation();
    passed[at] = true;
    T = T * to_axis * (is_rotation(site.motion) ? about_z(site_value[at]) : along_z(site_value[at])) *
        to_axis.inverse();
  };
  for (int s = 0; s < model_.common_sites; ++s) pass(s);
  for (int s = model_.target_first[target_]; s < model_.target_first[target_ + 1]; ++s) pass(s);

  motions->setZero();
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k] < 0) continue;
    auto motion = motions->col(static_cast<Eigen::Index>(k));
    for (const ColumnTerm& column : model_.parameters[static_cast<std::size_t>(parameters[k])].columns) {
      const double basis = column.reading >= 0 ? readings[column.reading]
                           : column.term >= 0  ? scratch->basis[static_cast<std::size_t>(column.term)]
                                               : 1.0;
      for (const auto& [site, weight] : column.sites) {
        const auto at = static_cast<std::size_t>(site);
        if (!passed[at]) continue;
        const Vector3d a = weight * basis * axis[at];
        if (is_rotation(model_.sites[at].motion)) {
          motion.head<3>() += a.cross(T.translation() - origin[at]);
          motion.tail<3>() += a;
        } else {
          motion.head<3>() += a;
        }
      }
    }
  }
}

// As make_bases does it for all rows of a table.
void Arm::evaluate_terms(const double* readings, EffectScratch* scratch) const {
  Inputs& inputs = scratch->inputs;
  for (int j = 0; j < driven_; ++j) scratch->reading[static_cast<std::size_t>(j)] = readings[j];
  for (Eigen::Index k = 0; k < inputs.joints.size(); ++k) {  // as read: ratios and zeros left out
    double motion = 0.0;
    int j = 0;
    for (std::size_t m = 0; m < model_.robot.joints.size(); ++m) {
      if (!model_.robot.joints[m].passive()) motion += coupling_(k, static_cast<Eigen::Index>(m)) * readings[j++];
    }
    inputs.joints[k] = motion;
  }
  if (gravity_) {
    // The frames' last one is the tool's, whichever target this arm was made for.
    link_frames(readings, inputs.frames.data());
    const Isometry3d& T_measurement_last = inputs.frames[inputs.frames.size() - 2];
    inputs.tip = T_measurement_last * T_last_target_.translation();
    inputs.frames.back() = T_measurement_last * model_.robot.targets[0].T_last_target;
    gravity_torques_at(model_.robot, coupling_, inputs.frames, scratch->payload, inputs.gravity_torque);
  }
  for (std::size_t t = 0; t < model_.terms.size(); ++t) {
    scratch->basis[t] = model_.terms[t].basis(inputs);
  }
}

std::unique_ptr<EffectScratch> Arm::make_scratch() const {
  std::unique_ptr<EffectScratch> scratch = scratch_for(available_, static_cast<std::size_t>(driven_));
  const auto n = static_cast<Eigen::Index>(model_.robot.joints.size());
  scratch->basis.assign(model_.terms.size(), 0.0);
  scratch->inputs.data = &scratch->data;
  scratch->inputs.joints = Eigen::VectorXd::Zero(n);
  scratch->inputs.gravity_torque = Eigen::VectorXd::Zero(n);
  scratch->inputs.frames.assign(model_.robot.joints.size() + 1, Isometry3d::Identity());
  return scratch;
}

void Arm::set_conditions(const Conditions& conditions, EffectScratch* scratch) const {
  const auto require_count = [this](const char* what, std::size_t count) {
    if (count == static_cast<std::size_t>(driven_)) return;
    throw std::invalid_argument(std::string(what) + " has " + std::to_string(count) + " values, the robot has " +
                                std::to_string(driven_) + " driven joints");
  };
  std::fill(scratch->direction.begin(), scratch->direction.end(), 0.0);
  if (!conditions.direction.empty()) {
    require_count("direction", conditions.direction.size());
    std::copy(conditions.direction.begin(), conditions.direction.end(), scratch->direction.begin());
  }
  if (!scratch->speed.empty()) {
    require_count("joint_speed", conditions.joint_speed.size());
    std::copy(conditions.joint_speed.begin(), conditions.joint_speed.end(), scratch->speed.begin());
  }
  const auto require_finite = [](const char* what, double value) {
    if (!std::isfinite(value))
      throw std::invalid_argument(std::string(what) +
                                  " is not a finite number, but the robot's effects were built with one");
  };
  require_finite("payload", conditions.payload);
  if (scratch->data.temperature) require_finite("temperature", conditions.temperature);
  if (scratch->data.time) require_finite("time", conditions.time);
  scratch->payload = conditions.payload;
  scratch->temperature = conditions.temperature;
  scratch->time = conditions.time;
  std::size_t at = 0;
  for (const auto& covariate : available_.covariates) {
    const auto found = conditions.covariates.find(covariate.first);
    if (found == conditions.covariates.end())
      throw std::invalid_argument("conditions lack the covariate '" + covariate.first + "'");
    scratch->covariates[at++] = found->second;
  }
}

std::unique_ptr<EffectScratch> ScratchPool::take() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<EffectScratch> scratch = std::move(idle_.back());
      idle_.pop_back();
      return scratch;
    }
  }
  return arm_.make_scratch();
}

void ScratchPool::give_back(std::unique_ptr<EffectScratch> scratch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  idle_.push_back(std::move(scratch));
}

}  // namespace truing::inverse_kinematics
