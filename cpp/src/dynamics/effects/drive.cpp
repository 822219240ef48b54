// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What stands between the current that is read and the torque that acts: gains, offsets, lags.

#include <algorithm>

#include "dynamics/effects/families.hpp"
#include "dynamics/filter.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

std::vector<TorqueForm> current_offset(const Robot& robot, std::size_t joint, const MotionRange& range) {
  return {{undirected(term_at(joint, parameter_name("current_offset", robot, joint), torque_unit(robot, joint),
                              0.3 * std::max(range.torque[static_cast<Index>(joint)], 1e-3),
                              [](const Motion&, Phi phi) { phi = 1.0; }))}};
}

std::vector<TorqueForm> motor_constant(const Robot& robot, std::size_t joint, const MotionRange&) {
  // A constant that is further off is another unit, or was never stated.
  return {
      {within(term_at(
                  joint, parameter_name("motor_constant", robot, joint), "-", 0.2,
                  [joint](const Motion& m, Phi phi) { phi = m.torque.col(static_cast<Index>(joint)).array(); }, true),
              -0.5, 1.0)}};
}

std::vector<TorqueForm> torque_lag(const Robot& robot, std::size_t joint, const MotionRange&) {
  const auto column = [joint](const Motion& m, Phi phi) {
    phi = -rate_of(m.torque.col(static_cast<Index>(joint)), m.step).array();
  };
  return {{within(term_at(joint, parameter_name("torque_lag", robot, joint), "s", 0.01, column, true), 0.0)}};
}

std::vector<TorqueForm> time_offset(const Robot& robot, std::size_t, const MotionRange&) {
  TorqueTerm term;
  term.parameter = "time_offset";
  term.unit = "s";
  term.prior = 0.01;
  term.needs_torque = true;
  term.needs_rigid = false;
  for (std::size_t j = 0; j < robot.driven_count(); ++j) term.joints.push_back(j);
  term.basis = [](const Motion& m) -> MatrixXd { return rate_of(m.torque, m.step); };
  return {{term}};
}

}  // namespace

std::vector<TorqueEffect> drive_effects() {
  std::vector<TorqueEffect> out;
  TorqueTraits traits;
  traits.family = TorqueFamily::drive;
  traits.standard = traits.usual = true;
  traits.mujoco = SimulatorPlace::field;
  traits.plain = "an offset of the torque";
  traits.documentation = {"1", "`current_offset.J2` [Nm]", "-"};
  out.push_back(
      {"current_offset", "a constant torque that is read, or acts, beside all others", current_offset, true, traits});
  traits.standard = traits.usual = false;
  traits.scales_masses = true;
  traits.plain = "a motor constant that is off";
  traits.documentation = {"tau, the whole torque that the model predicts", "`motor_constant.J2` [-]",
                          "a known payload: a column `payload_kg` that differs between recordings"};
  out.push_back(
      {"motor_constant", "the drive gives another torque per ampere than assumed", motor_constant, true, traits});
  traits.scales_masses = false;
  traits.mujoco = SimulatorPlace::none;
  traits.family = TorqueFamily::measurement;
  traits.plain = "a torque that is read late";
  traits.documentation = {"-d tau / dt", "`torque_lag.J2` [s]", "torque that changes fast"};
  out.push_back({"torque_lag", "the torque of one joint is read late, or filtered", torque_lag, true, traits});
  traits.plain = "torques and angles recorded at different times";
  traits.documentation = {"d tau / dt at all joints", "`time_offset` [s]", "torque that changes fast"};
  out.push_back({"time_offset", "all torques are recorded at other times than the angles", time_offset, false, traits});
  return out;
}

}  // namespace truing::dynamics
