// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Friction that changes as the arm gets warm.

#include <algorithm>
#include <utility>

#include "dynamics/effects/families.hpp"
#include "dynamics/prepare.hpp"

namespace truing::dynamics {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

constexpr double kReference = 20.0;  ///< [deg C]

/// The temperature of a joint where there is one, else that of the robot.
std::string temperature_column(std::size_t joint, const MotionRange& range) {
  const std::string own = "temp" + std::to_string(joint + 1) + "_C";
  for (const std::string& name : {own, std::string("temp_C")}) {
    const auto found = range.columns.find(name);
    if (found != range.columns.end() && found->second.second > found->second.first) return name;
  }
  throw MissingColumn("needs the column " + own + " or temp_C with temperatures that differ");
}

/// What friction changes with.
using Factor = std::function<ArrayXd(const Motion&)>;

/// Friction that changes by more than the joint's whole torque while it is recorded stands for something else.
TorqueForm friction_times(const char* effect, const Robot& robot, std::size_t joint, const MotionRange& range,
                          double size, const std::string& per, const Factor& factor) {
  const auto at = static_cast<Index>(joint);
  const double torque = torque_prior(range, joint) / size, fastest = fastest_of(robot, range, joint);
  const std::string unit = torque_unit(robot, joint);
  TorqueTerm coulomb =
      term_at(joint, parameter_name(effect, robot, joint, "coulomb"), unit + "/" + per, 0.3 * torque,
              [at, factor](const Motion& m, Phi phi) { phi = m.direction.col(at).array() * factor(m); });
  TorqueTerm viscous = term_at(joint, parameter_name(effect, robot, joint, "viscous"),
                               unit + " s/(" + angle_unit(robot, joint) + " " + per + ")", 0.3 * torque / fastest,
                               [at, factor](const Motion& m, Phi phi) { phi = m.qd.col(at).array() * factor(m); });
  return {within(std::move(coulomb), -torque, torque), within(std::move(viscous), -torque / fastest, torque / fastest)};
}

std::vector<TorqueForm> thermal_friction(const Robot& robot, std::size_t joint, const MotionRange& range) {
  const std::string name = temperature_column(joint, range);
  const auto& [low, high] = range.columns.at(name);
  return {friction_times("thermal_friction", robot, joint, range, std::max(high - low, 1.0), "K",
                         [name](const Motion& m) -> ArrayXd { return m.columns.at(name).array() - kReference; })};
}

std::vector<TorqueForm> warmup(const Robot& robot, std::size_t joint, const MotionRange& range) {
  if (range.duration < 5.0) throw Unsuited("no recording is longer than 5 s");
  return {friction_times("warmup", robot, joint, range, range.duration, "s",
                         [](const Motion& m) -> ArrayXd { return m.time.array(); })};
}

}  // namespace

std::vector<TorqueEffect> thermal_effects() {
  std::vector<TorqueEffect> out;
  TorqueTraits traits;
  traits.family = TorqueFamily::thermal;
  traits.plain = "friction that changes with temperature";
  traits.documentation = {"s (T - 20), qd (T - 20)", "`thermal_friction.J2.coulomb` [Nm/K], `.viscous`",
                          "a column `temp2_C` or `temp_C` with several temperatures"};
  out.push_back({"thermal_friction", "friction changes with temperature", thermal_friction, true, traits});
  traits.plain = "friction that changes as the arm warms up";
  traits.documentation = {"s t, qd t, t from the start of the recording", "`warmup.J2.coulomb` [Nm/s], `.viscous`",
                          "a recording of more than 5 s"};
  out.push_back({"warmup", "friction changes with time while the arm runs", warmup, true, traits});
  return out;
}

}  // namespace truing::dynamics
