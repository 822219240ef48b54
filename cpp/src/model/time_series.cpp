// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "model/time_series.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "math/statistics.hpp"

namespace truing {
namespace model {
namespace {

using Table = std::vector<std::vector<double>>;  ///< by joint, then by row

constexpr double kStops = 0.25;  ///< [s] a robot that stops for every row needs longer from one to the next
constexpr double kGap = 3.0;     ///< times the usual step
constexpr double kMidway = 0.3;  ///< of the way from row to next but one, that the row between may lie off its middle

constexpr double kMostLag = 0.5, kLagStep = 0.02, kLagResolution = 1e-5;  ///< [s]

double step_after(const Measurements& data, std::size_t row) { return data.time[row + 1] - data.time[row]; }

/// [s] from row to row; 0: there is no time, or it does not ascend.
double usual_step(const Measurements& data) {
  if (!data.time || data.rows < 3) return 0.0;
  std::vector<double> steps;
  for (std::size_t row = 0; row + 1 < data.rows; ++row) {
    if (!(step_after(data, row) > 0.0)) return 0.0;
    steps.push_back(step_after(data, row));
  }
  return math::median_of(steps);
}

/// Slope of the parabola through three rows; beside a gap, of the line to the one neighbour.
double speed_at(const Measurements& data, const Column& joint, std::size_t row, double longest) {
  const double before = row > 0 ? step_after(data, row - 1) : 2.0 * longest;
  const double after = row + 1 < data.rows ? step_after(data, row) : 2.0 * longest;
  const double behind = before < longest ? (joint[row] - joint[row - 1]) / before : 0.0;
  const double ahead = after < longest ? (joint[row + 1] - joint[row]) / after : 0.0;
  if (before < longest && after < longest) return (before * ahead + after * behind) / (before + after);
  return behind + ahead;
}

Table speeds_of(const Measurements& data) {
  const double longest = kGap * usual_step(data);
  Table out(data.joints.size(), std::vector<double>(data.rows));
  for (std::size_t k = 0; k < out.size(); ++k) {
    for (std::size_t row = 0; row < data.rows; ++row) out[k][row] = speed_at(data, data.joints[k], row, longest);
  }
  return out;
}

/// Columns of the data that are these now.
struct Replaced {
  std::shared_ptr<const void> rest;
  Table columns;
};

void point_to(const Table& table, std::vector<Column>* columns) {
  columns->clear();
  for (const std::vector<double>& column : table) columns->push_back({column.data(), 1});
}

}  // namespace

bool moved_while_measured(const Measurements& data) {
  const double step = usual_step(data);
  if (!(step > 0.0 && step < kStops)) return false;
  double way = 0.0, off = 0.0;
  for (std::size_t row = 1; row + 1 < data.rows; ++row) {
    const double before = step_after(data, row - 1), after = step_after(data, row);
    if (std::max(before, after) > kGap * step) continue;
    for (const Column& joint : data.joints) {
      const double between = (after * joint[row - 1] + before * joint[row + 1]) / (before + after);
      off += std::pow(joint[row] - between, 2.0);
      way += std::pow(joint[row + 1] - joint[row - 1], 2.0);
    }
  }
  return off < kMidway * kMidway * way;
}

Measurements with_joints_at(const Measurements& data, double later) {
  const Table speeds = speeds_of(data);
  const double longest = kGap * usual_step(data);
  const std::size_t joints = data.joints.size();
  auto owned =
      std::make_shared<Replaced>(Replaced{data.owner, Table(2 * joints + 1, std::vector<double>(data.rows, 0.0))});
  std::vector<double>& weight = owned->columns.back();
  std::size_t left = 0;  // the last row that is not later than the instant
  for (std::size_t row = 0; row < data.rows; ++row) {
    const double at = data.time[row] + later;
    while (left + 2 < data.rows && data.time[left + 1] <= at) ++left;
    const double h = step_after(data, left), u = std::clamp((at - data.time[left]) / h, 0.0, 1.0);
    const double v = 1.0 - u;
    for (std::size_t k = 0; k < joints; ++k) {
      const double q0 = data.joints[k][left], q1 = data.joints[k][left + 1];
      const double d0 = h * speeds[k][left], d1 = h * speeds[k][left + 1];
      owned->columns[k][row] = v * v * ((1.0 + 2.0 * u) * q0 + u * d0) + u * u * ((1.0 + 2.0 * v) * q1 - v * d1);
      owned->columns[joints + k][row] = (6.0 * u * v * (q1 - q0) + v * (v - 2.0 * u) * d0 + u * (u - 2.0 * v) * d1) / h;
    }
    const bool between = at >= data.time[0] && at <= data.time[data.rows - 1] && h < longest;
    if (between) weight[row] = data.weight ? data.weight[row] : 1.0;
  }
  Measurements out = data;
  const auto of = [&](std::size_t k) { return Column{owned->columns[k].data(), 1}; };
  out.joint_speed.resize(joints);
  for (std::size_t k = 0; k < joints; ++k) {
    out.joints[k] = of(k);
    out.joint_speed[k] = of(joints + k);
  }
  out.weight = of(2 * joints);
  out.owner = owned;
  return out;
}

double best_lag(const std::function<double(double)>& error) {
  constexpr double kGolden = 0.6180339887498949;
  double best = 0.0, least = error(0.0);
  for (double later = -kMostLag; later < kMostLag + 0.5 * kLagStep; later += kLagStep) {
    const double here = error(later);
    if (!(here < least)) continue;
    least = here;
    best = later;
  }
  double low = best - kLagStep, high = best + kLagStep;
  double one = high - kGolden * (high - low), other = low + kGolden * (high - low);
  double at_one = error(one), at_other = error(other);
  while (high - low > kLagResolution) {
    if (at_one < at_other) {
      high = other;
      other = one;
      at_other = at_one;
      one = high - kGolden * (high - low);
      at_one = error(one);
    } else {
      low = one;
      one = other;
      at_one = at_other;
      other = low + kGolden * (high - low);
      at_other = error(other);
    }
  }
  return 0.5 * (low + high);
}

}  // namespace model

Measurements with_inferred_speeds(const Measurements& data) {
  if (!data.joint_speed.empty() || !model::moved_while_measured(data)) return data;
  auto owned = std::make_shared<model::Replaced>(model::Replaced{data.owner, model::speeds_of(data)});
  Measurements out = data;
  model::point_to(owned->columns, &out.joint_speed);
  out.owner = owned;
  return out;
}

}  // namespace truing
