// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "identification/start.hpp"
#include "math/constants.hpp"
#include "truing/identify.hpp"

namespace truing {
using namespace identification;

/// Whether effects of the robot can be predicted with other data alone.
static bool lacks(const Robot& robot, const Measurements& data, const Measurements& with,
                  const std::vector<Effect>& own_effects) {
  const auto works_with = [&](const AppliedEffect& effect, const Measurements& some) {
    try {
      effect_terms({{effect.effect, effect.joints}}, robot, some, own_effects);
    } catch (const MissingColumn&) {
      return false;
    }
    return true;
  };
  return std::any_of(robot.effects.begin(), robot.effects.end(), [&](const AppliedEffect& effect) {
    return !works_with(effect, data) && works_with(effect, with);
  });
}

bool lacks_directions(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects) {
  return data.direction.empty() && !robot.effects.empty() &&
         lacks(robot, data, with_inferred_directions(data), own_effects);
}

bool lacks_speeds(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects) {
  return data.joint_speed.empty() && !robot.effects.empty() &&
         lacks(robot, data, with_inferred_speeds(data), own_effects);
}

Prediction predict(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects, int threads) {
  validate(data, robot, true);
  const Model model = make_model(robot, data, {}, own_effects);
  const std::vector<std::vector<double>> bases = make_bases(model, data);
  std::vector<std::int32_t> rows(data.rows);
  std::iota(rows.begin(), rows.end(), 0);
  const Evaluator evaluator(model, data, bases, make_segments(data, rows, true), {}, threads);
  Prediction out;
  const auto n = static_cast<Eigen::Index>(data.rows);
  out.position.resize(n, 3);
  out.orientation.resize(n, 4);
  if (robot.anchor) out.distance.resize(n);
  evaluator.predict(initial_values(model), [&](std::size_t row, const double* f) {
    const auto i = static_cast<Eigen::Index>(row);
    const Eigen::Vector3d p(f[0], f[1], f[2]);
    Eigen::Quaterniond q(Eigen::Map<const Eigen::Matrix3d>(f + 3));
    if (q.w() < 0.0) q.coeffs() = -q.coeffs();
    out.position.row(i) = p;
    out.orientation.row(i) << q.w(), q.x(), q.y(), q.z();
    if (robot.anchor) out.distance[i] = (p - robot.anchor->point).norm() + robot.anchor->zero;
  });
  return out;
}

Residuals residuals(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects, int threads) {
  validate(data, robot);
  const Model model = make_model(robot, data, {}, own_effects);
  const std::vector<std::vector<double>> bases = make_bases(model, data);
  std::vector<std::int32_t> rows(data.rows);
  std::iota(rows.begin(), rows.end(), 0);
  Eigen::VectorXd values = initial_values(model);
  IdentifyOptions options;
  options.own_effects = own_effects;
  options.threads = threads;
  const Job job{model, data, bases, options, rows};
  locate_points(model, job, &values);
  for (const std::int32_t row : rows) {
    if (data.has_distance(row) && !robot.anchor)
      throw std::invalid_argument("distances were measured, but the robot has no anchor: identify it first");
  }
  const Evaluator evaluator(model, data, bases, make_segments(data, rows), {}, threads);
  Residuals out;
  const auto n = static_cast<Eigen::Index>(data.rows);
  out.position = decltype(out.position)::Constant(n, 3, kNaN);
  out.rotation = decltype(out.rotation)::Constant(n, 3, kNaN);
  out.distance = Eigen::VectorXd::Constant(n, kNaN);
  evaluator.residuals(values, [&](std::size_t row, const double* r) {
    const auto i = static_cast<Eigen::Index>(row);
    const int components = components_of(data, row);
    if (components == 1) {
      out.distance[i] = r[0];
    } else {
      out.position.row(i) << r[0], r[1], r[2];
      if (components == 6) out.rotation.row(i) << r[3], r[4], r[5];
    }
  });
  return out;
}

}  // namespace truing
