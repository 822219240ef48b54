// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The simulated arm: its streams follow from its truth, and its truth from the laws that the header states.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "math/rotation.hpp"
#include "truing/tracking/simulation.hpp"

using namespace truing;
using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using math::exp_rotation;
using math::log_rotation;

namespace {

StreamSimulationOptions quiet(SimulatedMotion motion, double seconds) {
  StreamSimulationOptions options;
  options.motion = motion;
  options.seconds = seconds;
  options.seed = 7;
  options.imu = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  options.tracker.position_noise = options.tracker.rotation_noise = 0.0;
  options.joint_noise = 0.0;
  return options;
}

}  // namespace

TEST_CASE("rotation vectors: exp and log are inverse, small angles too, and a quaternion's sign does not matter") {
  for (const double angle : {0.0, 1e-12, 1e-6, 1e-3, 9e-3, 0.011, 0.5, 3.0, 3.14159}) {
    const Vector3d v = angle * Vector3d(0.6, -0.64, 0.48);
    const Quaterniond q = exp_rotation(v);
    CHECK(std::abs(q.norm() - 1.0) < 1e-15);
    CHECK((log_rotation(q) - v).norm() < 1e-14);
    CHECK((log_rotation(Quaterniond(-q.coeffs())) - v).norm() < 1e-14);
  }
}

TEST_CASE("streams are the same for the same seed and differ for another") {
  StreamSimulationOptions options;
  options.seconds = 1.0;
  const SimulatedStreams a = simulate_streams(large_boom(), options), b = simulate_streams(large_boom(), options);
  CHECK(a.imu.back().accel == b.imu.back().accel);
  CHECK(a.tracker.back().position == b.tracker.back().position);
  options.seed = 1;
  CHECK(simulate_streams(large_boom(), options).imu.back().accel != a.imu.back().accel);
}

TEST_CASE("inertial data without errors integrate to the truth") {
  const SimulatedStreams s = simulate_streams(large_boom(), quiet(SimulatedMotion::stop_and_go, 6.0));
  const auto truth = [&](double t) { return s.flange_at(t) * s.setup.T_flange_imu; };
  Quaterniond q(truth(0.0).linear());
  Vector3d p = truth(0.0).translation(), v = (truth(1e-3).translation() - truth(-1e-3).translation()) / 2e-3;
  const Vector3d gravity(0.0, 0.0, -9.81);
  for (std::size_t k = 0; k + 1 < s.imu.size(); ++k) {
    const double dt = s.imu[k + 1].t - s.imu[k].t;
    const Quaterniond next = q * exp_rotation(0.5 * dt * (s.imu[k].gyro + s.imu[k + 1].gyro));
    const Vector3d a = 0.5 * (q * s.imu[k].accel + next * s.imu[k + 1].accel) + gravity;
    p += dt * v + 0.5 * dt * dt * a;
    v += dt * a;
    q = next;
  }
  const Isometry3d end = truth(s.imu.back().t);
  CHECK((p - end.translation()).norm() < 1e-3);
  CHECK(log_rotation(q.conjugate() * Quaterniond(end.linear())).norm() < 1e-4);
}

TEST_CASE("a mode rings at its damped frequency and dies away as it should") {
  StreamSimulationOptions options = quiet(SimulatedMotion::stop_and_go, 12.0);
  FlexibleMode mode;
  mode.frequency = 2.0;
  mode.damping = 0.02;
  mode.participation = {0.0, 0.0, 0.5};
  options.modes = {mode};
  options.frequency_spread = 0.0;
  options.reach_exponent = 0.0;
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  // During a rest the encoders stand still, and what is left is the free oscillation about the sag.
  std::size_t rest = 0;
  double start = 0.0;
  for (std::size_t k = 1; k < s.joints_t.size() && rest < 180; ++k) {
    rest =
        s.joints_t[k] > 3.0 &&
                (s.joints.row(static_cast<Eigen::Index>(k)) - s.joints.row(static_cast<Eigen::Index>(k - 1))).norm() <
                    1e-9
            ? rest + 1
            : 0;
    if (rest == 1) start = s.joints_t[k];
  }
  REQUIRE(rest == 180);
  start += 0.05;
  const double omega = 2.0 * M_PI * 2.0, period = 2.0 * M_PI / (omega * std::sqrt(1.0 - 0.0004));
  const double rigid =
      s.flange[static_cast<std::size_t>(std::lround((start + 0.1) * 250.0))].T_base_frame.translation().z();
  const auto height = [&](double t) { return s.flange_at(t).translation().z() - rigid; };
  // x(t) - sag shrinks by exp(-zeta omega period) over one period, at any phase: solve for the sag from three instants
  // and check a fourth.
  const double shrink = std::exp(-0.02 * omega * period);
  for (const double t : {start, start + 0.03}) {
    const double x0 = height(t), x1 = height(t + period / 2.0), half = -std::sqrt(shrink);
    const double sag = (x1 - half * x0) / (1.0 - half);
    CHECK(std::abs(height(t + period) - sag - shrink * (x0 - sag)) < 0.01 * std::abs(x0 - sag) + 1e-6);
  }
}

TEST_CASE("encoders do not see the sway, and follow the plan by the actuator's lag") {
  const SimulatedStreams s = simulate_streams(large_boom(), quiet(SimulatedMotion::gentle, 4.0));
  double sway = 0.0;
  for (const FrameSample& sample : s.flange)
    sway = std::max(sway, (s.flange_at(sample.t).translation() - sample.T_base_frame.translation()).norm());
  CHECK(sway > 0.01);
  const FrameSample& late = s.flange[500];  // t = 2 s
  const double planned_at = late.t - 0.04;
  const auto row = static_cast<std::size_t>(std::lround((planned_at - s.plan.front().t) * 100.0));
  CHECK(std::abs(s.plan[row].t - planned_at) < 1e-9);
  CHECK((s.plan[row].T_base_frame.translation() - (late.T_base_frame * s.setup.T_flange_tool).translation()).norm() <
        1e-9);
}

TEST_CASE("the tracker: late, lost in dropouts, out of order, on its own clock, and shifted when its station is") {
  StreamSimulationOptions options = quiet(SimulatedMotion::gentle, 6.0);
  options.tracker.clock_offset = 0.5;
  options.tracker.clock_drift = 1e-3;
  options.tracker.out_of_order = 0.1;
  options.dropouts = {{2.0, 1.0}};
  StationShift shift;
  shift.start = 4.0;
  shift.T_old_new.translation() = Vector3d(0.005, 0.0, 0.0);
  options.shifts = {shift};
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  double delay = 0.0;
  int backwards = 0;
  for (std::size_t k = 0; k < s.tracker.size(); ++k) {
    const PoseSample& sample = s.tracker[k];
    const double t = (sample.t - 0.5) / (1.0 + 1e-3);
    CHECK(!(t >= 2.0 && t < 3.0));
    delay += (sample.arrival - t) / static_cast<double>(s.tracker.size());
    if (k > 0 && sample.t < s.tracker[k - 1].t) ++backwards;
    const Vector3d expected = (s.setup.T_tracker_base * s.flange_at(t) * s.setup.T_flange_receiver).translation();
    CHECK((sample.position - expected - (t >= 4.0 ? Vector3d(-0.005, 0.0, 0.0) : Vector3d::Zero())).norm() < 1e-9);
  }
  CHECK(delay > 0.029);
  CHECK(delay < 0.036);
  CHECK(backwards > 10);
}

TEST_CASE("simulation options that make no sense are refused in words") {
  StreamSimulationOptions options;
  options.seconds = -1.0;
  CHECK_THROWS_WITH_AS(simulate_streams(large_boom(), options), doctest::Contains("seconds"), std::invalid_argument);
  options.seconds = 1.0;
  options.modes.resize(1);
  options.modes[0].damping = 2.0;
  CHECK_THROWS_WITH_AS(simulate_streams(large_boom(), options), doctest::Contains("damping"), std::invalid_argument);
}
