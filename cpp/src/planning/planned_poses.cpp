// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "planning/planned_poses.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "math/constants.hpp"

namespace truing::planning {

using Eigen::Index;

Recorded recorded(const DistinguishOptions& options) {
  Recorded out;
  out.orientation = options.orientation;
  const std::pair<const char*, bool*> columns[4] = {
      {"dir", &out.direction}, {"payload", &out.payload}, {"temp", &out.temperature}, {"t", &out.time}};
  for (const std::string& name : options.columns) {
    const auto found =
        std::find_if(std::begin(columns), std::end(columns), [&](const auto& column) { return column.first == name; });
    if (found == std::end(columns))
      throw std::invalid_argument("distinguish: column '" + name + "' does not exist; there are dir, payload, temp, t");
    *found->second = true;
  }
  return out;
}

Measured::Measured(const Robot& robot, const std::vector<Planned>& poses, const DistinguishOptions& options) {
  const Recorded with = recorded(options);
  const std::size_t driven = robot.driven_count();
  columns_.reserve(2 * driven + 3);  // columns keep their place
  data.rows = poses.size();
  const auto add = [&](const auto& value) {
    columns_.emplace_back();
    for (const Planned& pose : poses) columns_.back().push_back(value(pose));
    return Column{columns_.back().data(), 1};
  };
  for (std::size_t k = 0; k < driven; ++k)
    data.joints.push_back(add([k](const Planned& p) { return p.joints[static_cast<Index>(k)]; }));
  for (std::size_t k = 0; k < driven; ++k)
    data.direction.push_back(add([k](const Planned& p) { return p.direction[k]; }));
  if (with.payload) data.payload = add([](const Planned& p) { return p.payload; });
  if (with.temperature) data.temperature = add([](const Planned& p) { return p.temperature; });
  if (with.time) data.time = add([](const Planned& p) { return p.time; });
  Robot plain = robot;
  plain.effects.clear();
  predicted_ = predict(plain, data, {}, 1);
  for (std::size_t k = 0; k < 3; ++k) data.position[k] = {predicted_.position.data() + k, 3};
  for (std::size_t k = 0; k < 4 && options.orientation; ++k)
    data.orientation[k] = {predicted_.orientation.data() + k, 4};
}

InputDraw::InputDraw(const DistinguishOptions& options, std::size_t driven)
    : options_(options), with_(recorded(options)), driven_(driven), random_(options.seed + 0x51ed2701u) {}

Planned InputDraw::planned(const Pose& joints, std::size_t k, std::size_t count) {
  Planned out = drawn(joints, k);
  const double part = count > 1 ? static_cast<double>(k) / static_cast<double>(count - 1) : 0.5;
  out.temperature =
      options_.temperature_low + (options_.temperature_high - options_.temperature_low) * std::sin(M_PI * part);
  return out;
}

Planned InputDraw::drawn(const Pose& joints, std::size_t k) {
  Planned out;
  out.joints = joints;
  for (std::size_t j = 0; j < driven_; ++j) out.direction.push_back(coin() || !with_.direction ? 1.0 : -1.0);
  out.payload = coin() ? options_.payload : 0.0;
  out.temperature = coin() ? options_.temperature_high : options_.temperature_low;
  out.time = options_.seconds_per_pose * static_cast<double>(k);
  return out;
}

}  // namespace truing::planning
