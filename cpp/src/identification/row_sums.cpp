// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Normal equations of some rows at given parameters: the evaluator that `identify` iterates on, asked once.

#include <cmath>
#include <limits>
#include <stdexcept>

#include "estimation/clustered.hpp"
#include "estimation/evaluate.hpp"
#include "estimation/selection.hpp"
#include "model/model.hpp"
#include "rooms.hpp"
#include "truing/fleet.hpp"

namespace truing {
using namespace identification;

namespace identification {
namespace {

const char* word_of(Role role) {
  switch (role) {
    case Role::base:
      return "base";
    case Role::geometry:
      return "geometry";
    case Role::offset:
      return "offset";
    case Role::ratio:
      return "ratio";
    case Role::target:
      return "target";
    case Role::anchor:
      return "anchor";
    case Role::point:
      return "point";
    case Role::effect:
      return "effect";
  }
  return "effect";
}

void refuse_fixed_points(const Measurements& data) {
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (data.has_fixed_point(row))
      throw std::invalid_argument("row " + std::to_string(row) + " touches the fixed point '" +
                                  data.fixed_point_names[static_cast<std::size_t>(data.fixed_point[row])] +
                                  "': sums of partitions take positions, poses and distances only");
  }
}

std::vector<int> indices_of(const Model& model, const std::vector<std::string>& names) {
  std::vector<int> out;
  for (const std::string& name : names) {
    const int index = model.parameter_index(name);
    if (index < 0) throw std::invalid_argument("the model of these rows has no parameter '" + name + "'");
    if (!out.empty() && index <= out.back())
      throw std::invalid_argument("parameters must be in the model's own order, and '" + name + "' is not");
    out.push_back(index);
  }
  return out;
}

Eigen::VectorXd values_of(const Model& model, const std::vector<int>& free, const Eigen::VectorXd& values) {
  if (values.size() != static_cast<Eigen::Index>(free.size()))
    throw std::invalid_argument("expected a value for each of " + std::to_string(free.size()) + " parameters, found " +
                                std::to_string(values.size()));
  Eigen::VectorXd out = initial_values(model);
  for (std::size_t k = 0; k < free.size(); ++k) out[free[k]] = values[static_cast<Eigen::Index>(k)];
  return out;
}

/// Row numbers of all rows, and of those that count.
struct Rows {
  std::vector<std::int32_t> all, counted;
};

Rows rows_of(const Measurements& data, const std::vector<std::int8_t>& counts) {
  if (!counts.empty() && counts.size() != data.rows)
    throw std::invalid_argument("counts has " + std::to_string(counts.size()) + " rows, the data " +
                                std::to_string(data.rows));
  Rows out;
  for (std::size_t row = 0; row < data.rows; ++row) {
    const auto number = static_cast<std::int32_t>(row);
    out.all.push_back(number);
    const bool weightless = data.weight && data.weight[row] == 0.0;
    if (!weightless && (counts.empty() || counts[row])) out.counted.push_back(number);
  }
  return out;
}

void sum_counted(const FittedRows& fitted, const Eigen::VectorXd& values, const SumOptions& options, RowSums* out) {
  const Evaluator evaluator(fitted.model, fitted.data, fitted.bases, make_segments(fitted.data, fitted.rows),
                            fitted.free, options.threads);
  Weighing weighing;
  weighing.rotation_scale = options.rotation_length;
  NormalEquations normal;
  evaluator.normal_equations(values, weighing, &normal);
  out->values = normal.components;
  out->squares = normal.squares;
  if (options.scores) {
    // Without leverages: of so many rows none decides anything alone.
    const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(normal.gram.rows(), normal.gram.cols());
    out->scores = clustered_scores(fitted, values, weighing, none, pose_groups(fitted.data));
  }
  out->gram = std::move(normal.gram);
  out->gradient = std::move(normal.gradient);
}

void tell_errors(const FittedRows& fitted, const Eigen::VectorXd& values, int threads, RowSums* out) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const Measurements& data = fitted.data;
  out->position_error.assign(data.rows, kNaN);
  if (data.orientation[0]) out->rotation_error.assign(data.rows, kNaN);
  const Evaluator evaluator(fitted.model, data, fitted.bases, make_segments(data, fitted.rows), fitted.free, threads);
  evaluator.residuals(values, [&](std::size_t row, const double* r) {
    out->position_error[row] = std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    if (data.has_orientation(row) && !data.has_distance(row))
      out->rotation_error[row] = std::sqrt(r[3] * r[3] + r[4] * r[4] + r[5] * r[5]);
  });
}

}  // namespace
}  // namespace identification

std::vector<FreeParameter> free_parameters(const Robot& robot, const Measurements& data,
                                           const ParameterSelection& selection) {
  validate(robot);
  validate(data, robot);
  refuse_fixed_points(data);
  const Model model = make_model(robot, data, selection.effects);
  const Eigen::VectorXd start = initial_values(model);
  std::vector<FreeParameter> out;
  const Content content = content_of(model, make_segments(data, rows_of(data, {}).all));
  for (const int k : select_free(model, content, selection)) {
    const ParameterInfo& info = model.parameters[static_cast<std::size_t>(k)];
    out.push_back({info.name, info.unit, word_of(info.role), start[k]});
  }
  return out;
}

Robot robot_at(const Robot& robot, const Measurements& data, const std::vector<std::string>& names,
               const Eigen::VectorXd& values, const std::vector<EffectRequest>& effects) {
  const Model model = make_model(robot, data, effects);
  return robot_with(model, values_of(model, indices_of(model, names), values));
}

RowSums sum_rows(const Robot& robot, const Measurements& data, const std::vector<std::string>& names,
                 const Eigen::VectorXd& values, const std::vector<std::int8_t>& counts, const SumOptions& options) {
  validate(data, robot);
  refuse_fixed_points(data);
  const Model model = make_model(robot, data, options.effects);
  const std::vector<int> free = indices_of(model, names);
  const Eigen::VectorXd at = values_of(model, free, values);
  const std::vector<std::vector<double>> bases = make_bases(model, data);
  const Rows rows = rows_of(data, counts);
  RowSums out;
  for (const int k : free) out.units.push_back(model.parameters[static_cast<std::size_t>(k)].unit);
  sum_counted({model, data, bases, free, rows.counted}, at, options, &out);
  tell_errors({model, data, bases, free, rows.all}, at, options.threads, &out);
  return out;
}

}  // namespace truing
