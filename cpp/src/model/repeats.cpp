// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "model/repeats.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace truing::model {
namespace {

/// What must be equal for rows to be of one pose.
std::vector<Column> setting_of(const Measurements& data) {
  std::vector<Column> out = data.joints;
  for (const Column& column : data.direction) {
    if (column) out.push_back(column);
  }
  if (data.payload) out.push_back(data.payload);
  return out;
}

/// Orders rows by setting, target and kind, rows of one pose by what was measured: what is equal stands together.
class Order {
 public:
  explicit Order(const Measurements& data) : data_(data), setting_(setting_of(data)) {}

  bool operator()(std::int32_t a, std::int32_t b) const {
    const int order = of_settings(a, b);
    return order != 0 ? order < 0 : of_values(a, b) < 0;
  }
  bool same_setting(std::int32_t a, std::int32_t b) const { return of_settings(a, b) == 0; }
  bool copies(std::int32_t a, std::int32_t b) const { return same_setting(a, b) && of_values(a, b) == 0; }

 private:
  static int of(double a, double b) { return a < b ? -1 : a > b ? 1 : 0; }

  int of_settings(std::int32_t first, std::int32_t second) const {
    const auto a = static_cast<std::size_t>(first), b = static_cast<std::size_t>(second);
    for (const Column& column : setting_) {
      if (const int order = of(column[a], column[b])) return order;
    }
    if (!data_.target.empty() && data_.target[a] != data_.target[b]) return data_.target[a] < data_.target[b] ? -1 : 1;
    return of(data_.has_distance(a), data_.has_distance(b));
  }

  int of_values(std::int32_t first, std::int32_t second) const {
    const auto a = static_cast<std::size_t>(first), b = static_cast<std::size_t>(second);
    if (data_.has_distance(a)) return of(data_.distance[a], data_.distance[b]);
    for (const Column& column : data_.position) {
      if (const int order = of(column[a], column[b])) return order;
    }
    return 0;
  }

  const Measurements& data_;
  std::vector<Column> setting_;
};

using Rows = std::vector<std::int32_t>;

/// Sum of squares about the mean of the rows first ... last - 1.
double scatter(const Column& column, Rows::const_iterator first, Rows::const_iterator last) {
  const auto count = static_cast<double>(last - first);
  double mean = 0.0, sum = 0.0;
  for (auto row = first; row != last; ++row) mean += column[static_cast<std::size_t>(*row)] / count;
  for (auto row = first; row != last; ++row) sum += std::pow(column[static_cast<std::size_t>(*row)] - mean, 2.0);
  return sum;
}

}  // namespace

Repeats noise_of_repeats(const Measurements& data) {
  Rows rows;
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (data.has_position(row) || data.has_distance(row)) rows.push_back(static_cast<std::int32_t>(row));
  }
  const Order order(data);
  std::sort(rows.begin(), rows.end(), order);
  rows.erase(std::unique(rows.begin(), rows.end(), [&](std::int32_t a, std::int32_t b) { return order.copies(a, b); }),
             rows.end());
  Repeats out;
  double sum = 0.0;
  for (auto first = rows.cbegin(), last = first; first != rows.cend(); first = last) {
    last = std::find_if(first, rows.cend(), [&](std::int32_t row) { return !order.same_setting(*first, row); });
    if (last - first < 2) continue;
    const auto add = [&](const Column& column) {
      sum += scatter(column, first, last);
      out.degrees_of_freedom += static_cast<double>(last - first - 1);
    };
    if (data.has_distance(static_cast<std::size_t>(*first))) {
      add(data.distance);
    } else {
      for (const Column& column : data.position) add(column);
    }
  }
  if (out.degrees_of_freedom > 0.0) out.sigma = std::sqrt(sum / out.degrees_of_freedom);
  return out;
}

}  // namespace truing::model
