// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "model/time_series.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "math/statistics.hpp"
#include "math/text.hpp"
#include "model/readings.hpp"

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

namespace {

/// The last row that is not later than an instant and has one after it.
std::size_t row_before(const Measurements& data, double at) {
  std::size_t low = 0, high = data.rows - 1;
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (data.time[middle] <= at ? low : high) = middle;
  }
  return low;
}

/// Is there a reading on both sides of an instant?
bool is_between(const Measurements& data, double at, double longest) {
  if (at < data.time[0] || at > data.time[data.rows - 1]) return false;
  const std::size_t row = row_before(data, at);
  return step_after(data, row) < longest || at == data.time[row] || at == data.time[row + 1];
}

/// A joint's reading and speed at an instant: the cubic through two rows (Hermite).
struct Moment {
  double reading, speed;
};

Moment moment_of(const Measurements& data, const Column& joint, const std::vector<double>& speed, double at) {
  const std::size_t row = row_before(data, at);
  const double h = step_after(data, row), u = std::clamp((at - data.time[row]) / h, 0.0, 1.0), v = 1.0 - u;
  const double q0 = joint[row], q1 = joint[row + 1], d0 = h * speed[row], d1 = h * speed[row + 1];
  return {v * v * ((1.0 + 2.0 * u) * q0 + u * d0) + u * u * ((1.0 + 2.0 * v) * q1 - v * d1),
          (6.0 * u * v * (q1 - q0) + v * (v - 2.0 * u) * d0 + u * (u - 2.0 * v) * d1) / h};
}

}  // namespace

Measurements with_joints_at(const Measurements& data, double later) {
  const double longest = kGap * usual_step(data);
  const std::size_t joints = data.joints.size();
  auto owned = std::make_shared<Replaced>();
  owned->columns.assign(2 * joints + 1, std::vector<double>(data.rows, 0.0));
  std::vector<double>& weight = owned->columns.back();
  std::vector<std::size_t> like(data.rows);
  std::size_t last = 0;  // before the first row that has a partner, the first row
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (is_between(data, data.time[row] + later, longest)) {
      last = row;
      weight[row] = data.weight ? data.weight[row] : 1.0;
    }
    like[row] = last;
  }
  const auto first = static_cast<std::size_t>(
      std::find_if(weight.begin(), weight.end(), [](double w) { return w > 0.0; }) - weight.begin());
  for (std::size_t row = 0; row < std::min(first, data.rows); ++row) like[row] = first < data.rows ? first : row;
  const Table speeds = speeds_of(data);
  for (std::size_t k = 0; k < joints; ++k) {
    for (std::size_t row = 0; row < data.rows; ++row) {
      const Moment then = moment_of(data, data.joints[k], speeds[k], data.time[like[row]] + later);
      owned->columns[k][row] = then.reading;
      owned->columns[joints + k][row] = then.speed;
    }
  }
  Measurements out = with_rows_paired(data, like, like);
  owned->rest = out.owner;
  out.joint_speed.resize(joints);
  for (std::size_t k = 0; k < joints; ++k) {
    out.joints[k] = {owned->columns[k].data(), 1};
    out.joint_speed[k] = {owned->columns[joints + k].data(), 1};
  }
  out.weight = {weight.data(), 1};
  out.owner = owned;
  return out;
}

Measurements middle_rows(const Measurements& data, std::size_t most) {
  if (data.rows <= most) return data;
  const std::size_t first = (data.rows - most) / 2;
  Measurements out = data;
  out.rows = most;
  std::vector<Column*> columns = {&out.distance,       &out.payload,        &out.temperature, &out.time,
                                  &out.position_sigma, &out.rotation_sigma, &out.weight};
  for (auto* block : {&out.joints, &out.direction, &out.joint_speed}) {
    for (Column& column : *block) columns.push_back(&column);
  }
  for (Column& column : out.position) columns.push_back(&column);
  for (Column& column : out.orientation) columns.push_back(&column);
  for (auto& named : out.covariates) columns.push_back(&named.second);
  for (Column* column : columns) {
    if (*column) column->data += static_cast<std::ptrdiff_t>(first) * column->stride;
  }
  const auto cut = [&](auto* numbers) {
    if (numbers->empty()) return;
    numbers->erase(numbers->begin(), numbers->begin() + static_cast<std::ptrdiff_t>(first));
    numbers->resize(most);
  };
  for (auto* numbers : {&out.fixed_point, &out.target, &out.pose}) cut(numbers);
  cut(&out.set);
  return out;
}

bool has_most_rows(const Measurements& data) {
  std::size_t counted = 0;
  for (std::size_t row = 0; row < data.rows; ++row) counted += data.weight[row] > 0.0;
  return 2 * counted >= data.rows;
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
  if (std::abs(best) > kMostLag - 0.5 * kLagStep) return 0.0;
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

std::string text_of_lag(double later) {
  return "the clocks of joints and measurement differ: what was measured belongs to where the joints were " +
         math::number(1e3 * std::abs(later), 3) + " ms " + (later > 0.0 ? "later" : "earlier");
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
