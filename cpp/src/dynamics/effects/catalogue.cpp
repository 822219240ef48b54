// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The effects on torques by name.

#include <algorithm>
#include <cmath>
#include <set>

#include "dynamics/effects/families.hpp"
#include "dynamics/prepare.hpp"
#include "dynamics/regressor.hpp"
#include "kernel/rigid.hpp"
#include "math/near_names.hpp"
#include "math/text.hpp"
#include "truing/dynamics/effect_values.hpp"

namespace truing {
using namespace dynamics;

namespace {

const TorqueEffect* find(const std::vector<TorqueEffect>& effects, const std::string& name) {
  const auto found =
      std::find_if(effects.begin(), effects.end(), [&](const TorqueEffect& e) { return e.name == name; });
  return found == effects.end() ? nullptr : &*found;
}

bool has_all(const TorqueForm& form, const std::map<std::string, double>& values) {
  return std::all_of(form.begin(), form.end(), [&](const TorqueTerm& t) { return values.count(t.parameter) > 0; });
}

/// What a robot carries acts in any motion: a range in which no law is left out because it would not show.
MotionRange unlimited(MotionRange range) {
  constexpr double kFar = 1e3;  // [rad, m, rad/s, s] more than any law asks for
  range.upper = range.lower.array() + kFar;
  range.speed.setConstant(kFar);
  range.duration = kFar;
  for (auto& column : range.columns) column.second.second = std::max(column.second.second, column.second.first + 1.0);
  return range;
}

/// A parameter of the form is among the terms already.
bool has_any(const std::vector<TorqueTerm>& terms, const TorqueForm& form) {
  return std::any_of(terms.begin(), terms.end(), [&](const TorqueTerm& t) {
    return std::any_of(form.begin(), form.end(), [&](const TorqueTerm& f) { return f.parameter == t.parameter; });
  });
}

/// A misspelt value would do nothing.
void require_known(const AppliedEffect& applied, const std::vector<TorqueTerm>& terms) {
  std::set<std::string> known;
  for (const TorqueTerm& term : terms) {
    known.insert(term.parameter);
    for (const auto& [name, value] : term.constants) known.insert(name);
  }
  for (const auto& [name, value] : applied.parameters) {
    if (known.count(name)) continue;
    const std::vector<std::string> has(known.begin(), known.end());
    throw std::invalid_argument("effect '" + applied.effect + "' has a value '" + name +
                                "', which its law does not look at" + did_you_mean(name, has) + "; it has " +
                                listed(has));
  }
}

MotionRange at_rest(const Robot& robot) {
  MotionRange range;
  const auto n = static_cast<Eigen::Index>(robot.driven_count());
  range.lower = range.upper = range.speed = range.acceleration = range.torque = Eigen::VectorXd::Zero(n);
  range.turns.resize(static_cast<std::size_t>(n));
  return range;
}

}  // namespace

const std::vector<TorqueEffect>& torque_catalogue() {
  static const std::vector<TorqueEffect> all = [] {
    std::vector<TorqueEffect> out;
    for (auto family : {friction_effects, inertia_effects, drive_effects, transmission_effects, thermal_effects}) {
      for (TorqueEffect& effect : family()) out.push_back(std::move(effect));
    }
    return out;
  }();
  return all;
}

const TorqueEffect& find_torque_effect(const std::string& name, const std::vector<TorqueEffect>& own) {
  if (const TorqueEffect* effect = find(own, name)) return *effect;
  if (const TorqueEffect* effect = find(torque_catalogue(), name)) return *effect;
  std::vector<std::string> names;
  for (const auto* list : {&torque_catalogue(), &own}) {
    for (const TorqueEffect& effect : *list) names.push_back(effect.name);
  }
  throw std::invalid_argument("there is no effect '" + name + "' on torques" + did_you_mean(name, names) +
                              "; there are: " + listed(names));
}

std::vector<TorqueTerm> terms_of(const AppliedEffect& applied, const Robot& robot, const MotionRange& given,
                                 const std::vector<TorqueEffect>& own) {
  const MotionRange range = unlimited(given);
  const TorqueEffect& effect = find_torque_effect(applied.effect, own);
  std::vector<std::size_t> joints;
  if (effect.per_joint) {
    for (const std::string& joint : applied.joints) joints.push_back(driven_number(robot, joint));
  } else {
    joints.push_back(0);
  }
  std::vector<TorqueTerm> out;
  for (const std::size_t joint : joints) {
    const auto take = [&](const TorqueForm& form) { out.insert(out.end(), form.begin(), form.end()); };
    // The largest first: a smaller form may be a part of it.
    std::vector<TorqueForm> forms = effect.forms(robot, joint, range);
    std::stable_sort(forms.begin(), forms.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
    for (const TorqueForm& form : forms) {
      if (!has_all(form, applied.parameters) || has_any(out, form)) continue;
      take(form.front().constants.empty() ? form : effect.form_with(robot, joint, applied.parameters));
    }
  }
  if (out.empty()) {
    throw std::invalid_argument("effect '" + applied.effect + "' of the robot has no parameters that belong to it");
  }
  require_known(applied, out);
  return out;
}

std::vector<std::string> unknown_torque_values(const Robot& robot) {
  std::vector<std::string> texts;
  for (const AppliedEffect& applied : robot.torque_effects) {
    texts.emplace_back();
    if (find(torque_catalogue(), applied.effect) == nullptr) continue;
    try {
      terms_of(applied, robot, at_rest(robot));
    } catch (const MissingColumn&) {  // is said where the effect is used
    } catch (const Unsuited&) {
    } catch (const std::invalid_argument& error) {
      texts.back() = error.what();
    }
  }
  return texts;
}

namespace dynamics {

double fastest_of(const Robot& robot, const MotionRange& range, std::size_t joint) {
  const auto at = static_cast<Index>(joint);
  return std::max(range.speed[at], speeds_at_rest(robot)[at]);
}

double torque_prior(const MotionRange& range, std::size_t joint) {
  return std::max(range.torque[static_cast<Eigen::Index>(joint)], 1e-3);
}

std::size_t driven_number(const Robot& robot, const std::string& joint) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < robot.driven_count(); ++k) {
    names.push_back(driven_name(robot, k));
    if (names.back() == joint) return k;
  }
  throw std::invalid_argument("there is no joint '" + joint + "' that has a reading" + did_you_mean(joint, names) +
                              "; there are: " + listed(names));
}

const std::string& driven_name(const Robot& robot, std::size_t joint) {
  return robot.joints[robot.driven_joints().at(joint)].name;
}
bool is_revolute(const Robot& robot, std::size_t joint) {
  return robot.joints[robot.driven_joints().at(joint)].type == JointType::revolute;
}
std::string torque_unit(const Robot& robot, std::size_t joint) { return is_revolute(robot, joint) ? "Nm" : "N"; }
std::string angle_unit(const Robot& robot, std::size_t joint) { return is_revolute(robot, joint) ? "rad" : "m"; }

TorqueTerm term_at(std::size_t joint, std::string parameter, std::string unit, double prior, Column column,
                   bool needs_torque) {
  TorqueTerm term;
  term.parameter = std::move(parameter);
  term.unit = std::move(unit);
  term.joints = {joint};
  term.prior = prior;
  term.needs_torque = needs_torque;
  term.needs_rigid = false;
  term.basis = [column = std::move(column)](const Motion& m) {
    Eigen::MatrixXd out(m.rows(), 1);
    column(m, Phi(out.data(), m.rows()));
    return out;
  };
  return term;
}

TorqueTerm undirected(TorqueTerm term) {
  term.needs_direction = false;
  return term;
}

TorqueTerm within(TorqueTerm term, double least, double most) {
  term.least = least;
  term.most = most;
  return term;
}

namespace {

/// Sines and cosines beside each other.
Eigen::ArrayX2d waves(const Eigen::VectorXd& angles) {
  constexpr double kFar = 1e5;  // [rad] beyond which the kernel does not go
  if (angles.size() > 0 && !(angles.cwiseAbs().maxCoeff() < kFar)) {
    Eigen::ArrayX2d out(angles.size(), 2);
    out << angles.array().sin(), angles.array().cos();
    return out;
  }
  const Eigen::Index all = RigidChain::padded(angles.size());
  Eigen::ArrayX2d out = Eigen::ArrayX2d::Zero(all, 2);
  out.col(0).head(angles.size()) = angles;
  kernel::rigid_functions().sine_cosine(out.data(), static_cast<int>(all), out.data(), out.data() + all);
  return out;
}

}  // namespace

Eigen::ArrayXd sines(const Eigen::VectorXd& angles) { return waves(angles).col(0).head(angles.size()); }
Eigen::ArrayXd cosines(const Eigen::VectorXd& angles) { return waves(angles).col(1).head(angles.size()); }

std::string parameter_name(const char* effect, const Robot& robot, std::size_t joint, const char* part) {
  return std::string(effect) + "." + driven_name(robot, joint) + (part != nullptr ? "." + std::string(part) : "");
}

double constant_of(const std::map<std::string, double>& constants, const std::string& name) {
  const auto found = constants.find(name);
  if (found == constants.end() || !std::isfinite(found->second) || found->second <= 0.0)
    throw std::invalid_argument("the robot's effects lack the constant '" + name + "', a positive number");
  return found->second;
}

}  // namespace dynamics
}  // namespace truing
