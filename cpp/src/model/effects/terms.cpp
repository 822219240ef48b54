// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "model/effects/terms.hpp"

#include <algorithm>
#include <cmath>

#include "math/text.hpp"
#include "model/gravity.hpp"

namespace truing::model {

[[noreturn]] void refuse(const char* effect, const Joint& joint, const std::string& what) {
  throw MissingColumn(std::string(effect) + " at " + joint.name + " " + what);
}

[[noreturn]] void unsuited(const char* effect, const Joint& joint, const std::string& what) {
  throw Unsuited(std::string(effect) + " at " + joint.name + " " + what);
}

void require_driven(const char* effect, const Joint& joint) {
  if (!joint.passive()) return;
  std::vector<std::string> drivers;
  for (const auto& driver : joint.driven_by) drivers.push_back(driver.first);
  unsuited(effect, joint, "needs a joint with a reading; " + joint.name + " is passive, driven by " + listed(drivers));
}

void require_revolute(const char* effect, const Joint& joint, const std::string& why) {
  if (!is_revolute(joint)) unsuited(effect, joint, "needs a revolute joint; " + joint.name + " is prismatic" + why);
}

void require_weight(const char* effect, const Robot& robot, const Joint& joint, const Measurements& data,
                    const std::string& or_else) {
  if (knows_mass(robot) || data.payload) return;
  refuse(effect, joint,
         "needs gravity torques: give the links' mass and com in the robot, or the column payload_kg" + or_else);
}

std::size_t driven_number(const Robot& robot, std::size_t joint) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  return static_cast<std::size_t>(std::find(driven.begin(), driven.end(), joint) - driven.begin());
}

Term make_term(const std::string& parameter, const std::string& unit, const std::string& site, Basis basis,
               bool needs_gravity) {
  Term term;
  term.parameter = parameter;
  term.unit = unit;
  term.site = site;
  term.basis = std::move(basis);
  term.needs_gravity = needs_gravity;
  return term;
}

double remembered(const Robot& robot, const std::string& effect, const std::string& name,
                  const std::function<double()>& first) {
  for (const AppliedEffect& applied : robot.effects) {
    const auto found = applied.parameters.find(name);
    if (applied.effect == effect && found != applied.parameters.end()) return found->second;
  }
  return first();
}

double mean_of(const Column& column, std::size_t rows) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    if (!std::isfinite(column[row])) continue;
    sum += column[row];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace truing::model
