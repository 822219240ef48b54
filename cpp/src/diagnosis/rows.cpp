// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/rows.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "math/constants.hpp"

namespace truing::diagnosis {

std::vector<std::string> targets_of(const Robot& robot) {
  std::vector<std::string> out;
  for (const Target& target : robot.targets) out.push_back(target.name + ".*");
  if (out.empty()) out.push_back("tool.*");
  return out;
}

std::vector<double> lengths_of(const Residuals& residuals, std::size_t rows) {
  std::vector<double> out(rows, kNaN);
  for (std::size_t row = 0; row < rows; ++row) {
    const auto i = static_cast<Eigen::Index>(row);
    const double d = residuals.distance[i];
    out[row] = d == d ? std::abs(d) : residuals.position.row(i).norm();
  }
  return out;
}

std::vector<double> held_out(const std::vector<double>& lengths, const std::vector<std::int8_t>& set) {
  std::vector<double> out;
  for (std::size_t row = 0; row < lengths.size(); ++row) {
    if (set[row] && std::isfinite(lengths[row])) out.push_back(lengths[row]);
  }
  return out;
}

std::vector<std::int32_t> thinned_rows(const Measurements& data, const std::vector<std::int32_t>& cluster,
                                       std::size_t most) {
  const std::size_t clusters =
      cluster.empty() ? 0 : static_cast<std::size_t>(*std::max_element(cluster.begin(), cluster.end())) + 1;
  std::vector<std::int32_t> rows;
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (data.weight && data.weight[row] == 0.0) continue;
    // Evenly in order of appearance: of n clusters, `most`.
    const auto c = static_cast<std::size_t>(cluster[row]);
    if (clusters > most && c * most / clusters == (c + 1) * most / clusters) continue;
    rows.push_back(static_cast<std::int32_t>(row));
  }
  return rows;
}

/// The rows as data of their own, so that nothing is computed for the others.
struct SubsetColumns {
  std::vector<std::vector<double>> columns;
};

Measurements subset_of(const Measurements& data, const std::vector<std::int32_t>& rows) {
  auto owned = std::make_shared<SubsetColumns>();
  Measurements out;
  out.rows = rows.size();
  const auto take = [&](const Column& from, Column* to) {
    if (!from) return;
    std::vector<double> values(rows.size());
    for (std::size_t k = 0; k < rows.size(); ++k) values[k] = from[static_cast<std::size_t>(rows[k])];
    owned->columns.push_back(std::move(values));
    *to = {owned->columns.back().data(), 1};  // a vector keeps its memory when it is moved
  };
  const auto take_all = [&](const std::vector<Column>& from, std::vector<Column>* to) {
    to->resize(from.size());
    for (std::size_t k = 0; k < from.size(); ++k) take(from[k], &(*to)[k]);
  };
  take_all(data.joints, &out.joints);
  take_all(data.direction, &out.direction);
  take_all(data.joint_speed, &out.joint_speed);
  for (std::size_t k = 0; k < 3; ++k) take(data.position[k], &out.position[k]);
  for (std::size_t k = 0; k < 4; ++k) take(data.orientation[k], &out.orientation[k]);
  take(data.distance, &out.distance);
  take(data.payload, &out.payload);
  take(data.temperature, &out.temperature);
  take(data.time, &out.time);
  take(data.position_sigma, &out.position_sigma);
  take(data.rotation_sigma, &out.rotation_sigma);
  take(data.weight, &out.weight);
  for (const auto& [name, column] : data.covariates) take(column, &out.covariates[name]);
  out.fixed_point_names = data.fixed_point_names;
  for (const std::int32_t row : rows) {
    const auto r = static_cast<std::size_t>(row);
    if (!data.fixed_point.empty()) out.fixed_point.push_back(data.fixed_point[r]);
    if (!data.target.empty()) out.target.push_back(data.target[r]);
    if (!data.set.empty()) out.set.push_back(data.set[r]);
  }
  out.owner = owned;
  return out;
}

std::vector<Effect> mapped(const std::vector<Effect>& own, const Measurements& whole,
                           const std::vector<std::int32_t>& rows) {
  std::vector<Effect> out = own;
  for (Effect& effect : out) {
    effect.terms = [terms = effect.terms, &whole, &rows](const Robot& robot, std::size_t joint, const Measurements&) {
      std::vector<Term> made = terms(robot, joint, whole);
      for (Term& term : made) {
        term.basis = [basis = term.basis, &whole, &rows](const Inputs& in) {
          Inputs of_whole = in;
          of_whole.data = &whole;
          of_whole.row = static_cast<std::size_t>(rows[in.row]);
          return basis(of_whole);
        };
      }
      return made;
    };
  }
  return out;
}

}  // namespace truing::diagnosis
