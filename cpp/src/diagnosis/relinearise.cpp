// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Columns taken anew where what was found leads, of targets that the rows barely see.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>

#include "model/model.hpp"

namespace truing::diagnosis {
namespace {

using model::ParameterInfo;
using model::Role;

constexpr double kNear = 1e-2;  ///< [m] a target that is less far off has about the same columns
constexpr double kPlain = 3.0;  ///< standard errors of a target's step

bool is_place_of_target(const ParameterInfo& info) { return info.role == Role::target && !info.rotation; }

bool is_in_robot(const ParameterInfo& info) {
  return info.role == Role::base || info.role == Role::target || info.role == Role::anchor ||
         info.role == Role::geometry;
}

/// Frames alone, which take upon themselves what they can of an effect, may be far off.
bool barely_sees_a_target(const model::Model& model, const std::vector<Parameter>& frames) {
  return std::any_of(frames.begin(), frames.end(), [&](const Parameter& found) {
    const int parameter = model.parameter_index(found.name);
    return parameter >= 0 && found.sigma > kNear &&
           is_place_of_target(model.parameters[static_cast<std::size_t>(parameter)]);
  });
}

/// Nominal, with base and targets as where the columns are taken.
Robot nominal_there(const Work& work) {
  Robot out = work.given.frames.robot;
  out.T_measurement_base = work.linear.at.T_measurement_base;
  out.targets = work.linear.at.targets;
  out.anchor = work.linear.at.anchor;
  return out;
}

double standard_error(const Evidence::State& state, Eigen::Index at) {
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(state.solution.size(), at);
  return std::sqrt(state.sigma2 * state.factor.solve(unit)[at]);
}

}  // namespace

std::optional<Linearisation> where_it_leads(const Work& work, const Evidence::State& state) {
  const model::Model model = model::make_model(nominal_there(work), work.given.data);
  if (work.given.mistaken || !barely_sees_a_target(model, work.given.frames.parameters)) return std::nullopt;
  Eigen::VectorXd values = model::initial_values(model);
  Linearisation out;
  bool far = false;
  for (Eigen::Index k = 0; k < state.solution.size(); ++k) {
    const auto column = static_cast<std::size_t>(state.columns[static_cast<std::size_t>(k)]);
    const int parameter = model.parameter_index(work.design.column_names[column]);
    if (parameter < 0) continue;
    const ParameterInfo& info = model.parameters[static_cast<std::size_t>(parameter)];
    if (!is_in_robot(info)) continue;
    const double step = state.solution[k];
    values[parameter] += step;
    if (info.role == Role::geometry) out.shift[info.name] = step;
    if (is_place_of_target(info) && std::abs(step) > kNear)
      far = far || std::abs(step) > kPlain * standard_error(state, k);
  }
  if (!far) return std::nullopt;
  out.at = model::robot_with(model, values);
  return out;
}

}  // namespace truing::diagnosis
