// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The filter with its window, the deviation from the plan, and what becomes of faulty samples. Seeds are named in every
// case.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include "math/random.hpp"
#include "support/sanitized.hpp"
#include "support/streams.hpp"
#include "tracking/correction_limiter.hpp"
#include "tracking/deviation.hpp"
#include "tracking/pose_filter.hpp"
#include "truing/tracking/simulation.hpp"
#include "truing/tracking/tracker.hpp"

using namespace streams;
using namespace truing;
using namespace truing::tracking;
using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

double position_error(const SimulatedStreams& s, Tracker* tracker, double t) {
  return (tracker->predict(t).T_base_tool.translation() - s.tool_at(t).translation()).norm();
}

bool equal(const Belief& a, const Belief& b) {
  return a.x.p == b.x.p && a.x.v == b.x.v && a.x.q.coeffs() == b.x.q.coeffs() && a.P == b.P;
}

}  // namespace

TEST_CASE("the filter's transition over a segment agrees with one that is stepped sample by sample: seed 3") {
  const SimulatedStreams s = boom(SimulatedMotion::stop_and_go, 3, 3.0);
  PoseFilter filter(s.setup, FilterOptions());  // no tracker sample falls into the segment
  std::size_t pose = 0;
  for (const ImuSample& sample : s.imu) {
    if (sample.t > 2.5) break;
    for (; pose < s.tracker.size() && s.tracker[pose].t < std::min(sample.t, 2.415); ++pose)
      filter.push_pose(s.tracker[pose]);
    filter.push_imu(sample);
  }
  filter.update();
  const Belief from = filter.belief_at(2.42), to = filter.belief_at(2.49);
  const FilterOptions o;
  const double dt = 1e-3;
  Covariance P = from.P;
  for (int n = 0; n < 70; ++n) {
    const Motion m = filter.motion_at(2.42 + (n + 0.5) * dt);
    Covariance F = Covariance::Identity();
    F.block<3, 3>(kP, kV) = dt * Eigen::Matrix3d::Identity();
    F.block<3, 3>(kV, kTheta) = -dt * skew(m.acceleration - s.setup.gravity);
    F.block<3, 3>(kV, kAccelBias) = -dt * m.x.q.toRotationMatrix();
    F.block<3, 3>(kTheta, kGyroBias) = -dt * m.x.q.toRotationMatrix();
    F(kClock, kDrift) = dt;
    P = F * P * F.transpose();
    for (int i = 0; i < 3; ++i) {
      P(kV + i, kV + i) += o.accel_noise * o.accel_noise * dt;
      P(kTheta + i, kTheta + i) += o.gyro_noise * o.gyro_noise * dt;
    }
  }
  for (int i = 0; i < 9; ++i) {
    CHECK(std::abs(std::sqrt(to.P(i, i)) / std::sqrt(P(i, i)) - 1.0) < 0.02);
    for (int j = 0; j < 15; ++j) CHECK(std::abs(to.P(i, j) - P(i, j)) < 0.03 * std::sqrt(P(i, i) * P(j, j)));
  }
}

TEST_CASE("the pose is known to a fraction of the tracker's noise, and the filter knows how well: seeds 1 to 20") {
  double nees = 0.0, squares = 0.0;
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 20); ++seed) {
    const SimulatedStreams s = boom(SimulatedMotion::gentle, seed, 8.0);
    PoseFilter filter(s.setup, FilterOptions());
    Player player;
    play(s, 8.0, &filter, &player);
    filter.update();
    const Belief belief = filter.belief_at(filter.newest_imu());
    const Isometry3d truth = s.flange_at(belief.t) * s.setup.T_flange_imu;
    Vector6d e;
    e << truth.translation() - belief.x.p, log_rotation(Quaterniond(truth.linear()) * belief.x.q.conjugate());
    Matrix6d P;
    P << belief.P.block<3, 3>(kP, kP), belief.P.block<3, 3>(kP, kTheta), belief.P.block<3, 3>(kTheta, kP),
        belief.P.block<3, 3>(kTheta, kTheta);
    nees += e.dot(P.ldlt().solve(e)) / 20.0;
    squares += e.head<3>().squaredNorm() / 20.0;
  }
  if (kSanitized) return;
  CHECK(nees > 4.2);  // 99.9 % band of 120 degrees of freedom
  CHECK(nees < 8.3);
  CHECK(std::sqrt(squares) < 0.6e-3);
}

/// Innovations squared over what was expected, per dimension, and errors of the position now [m, rms], from 5 s on.
struct Consistency {
  double nis = 0.0, error = 0.0;
};
Consistency consistency(const SimulatedStreams& s, const FilterOptions& filter) {
  TrackOptions options;
  options.filter = filter;
  Tracker tracker(s.setup, options);
  Player player;
  double squares = 0.0, dimensions = 0.0, errors = 0.0, count = 0.0;
  std::size_t k = 0;
  for (double t = 0.1; t < s.imu.back().t; t += 0.1) {
    k = play(s, t, &tracker, &player, k);
    Innovation innovations[64];
    for (int n; (n = tracker.take_innovations(innovations, 64)) > 0;) {
      for (int i = 0; i < n; ++i) {
        if (innovations[i].t < 5.0) continue;
        squares += innovations[i].nis;
        dimensions += innovations[i].dimensions;
      }
    }
    if (t < 5.0) continue;
    errors += std::pow(position_error(s, &tracker, tracker.now()), 2);
    count += 1.0;
  }
  return {squares / dimensions, std::sqrt(errors / count)};
}

TEST_CASE("sensors that are three times better or worse than the options say are found out: seeds 31 to 34") {
  for (std::uint64_t seed = 31; seed <= (kSanitized ? 31 : 34); ++seed) {
    for (const double times : {1.0 / 3.0, 1.0, 3.0}) {
      CAPTURE(seed);
      CAPTURE(times);
      StreamSimulationOptions options;
      options.motion = seed % 2 == 0 ? SimulatedMotion::stop_and_go : SimulatedMotion::gentle;
      options.seed = seed;
      options.seconds = 30.0;
      options.imu.gyro_noise *= times, options.imu.accel_noise *= times;
      options.tracker.position_noise *= times, options.tracker.rotation_noise *= times;
      const SimulatedStreams s = simulate_streams(large_boom(), options);
      FilterOptions given;
      given.noise_time = 0.0;
      const Consistency found = consistency(s, FilterOptions()), believed = consistency(s, given);
      CHECK(found.nis > 0.7);
      CHECK(found.nis < 1.4);
      if (times != 1.0) CHECK(std::abs(std::log(believed.nis)) > std::log(2.0));
      CHECK(found.error < 1.15 * believed.error);
    }
  }
}

TEST_CASE("a tracker that gives no orientations starts the filter, with the encoders' orientation: seeds 41 to 43") {
  for (std::uint64_t seed = 41; seed <= (kSanitized ? 41 : 43); ++seed) {
    CAPTURE(seed);
    SimulatedStreams s = boom(SimulatedMotion::stop_and_go, seed, 20.0);
    for (PoseSample& sample : s.tracker) sample.orientation.coeffs().setZero();
    Tracker tracker(s.setup);
    Player player;
    play(s, 19.9, &tracker, &player);
    const PosePrediction now = tracker.predict(tracker.now());
    CHECK(now.status == Status::valid);
    const double off = (now.T_base_tool.translation() - s.tool_at(now.t).translation()).norm();
    CAPTURE(off);
    CHECK(off < 0.02);
    CHECK(off < 4.0 * std::sqrt(now.covariance.diagonal().head<3>().sum()));
  }
}

TEST_CASE("without orientations and without encoders nothing starts: seed 44") {
  SimulatedStreams s = boom(SimulatedMotion::gentle, 44, 3.0);
  for (PoseSample& sample : s.tracker) sample.orientation.coeffs().setZero();
  s.flange.clear();
  PoseFilter filter(s.setup, FilterOptions());
  Player player;
  play(s, 2.9, &filter, &player);
  filter.update();
  CHECK_FALSE(filter.initialised());
}

TEST_CASE("an unknown clock offset of 8 ms is found: seed 5") {
  StreamSimulationOptions options;
  options.seed = 5;
  options.seconds = 20.0;
  options.tracker.clock_offset = 0.008;
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  TrackSetup setup = s.setup;
  setup.clock_offset = 0.0;
  setup.clock_offset_sigma = 0.02;
  Tracker tracker(setup);
  Player player;
  play(s, 20.0, &tracker, &player);
  const ClockEstimate clock = tracker.clock();
  CHECK(std::abs(clock.offset - 0.008) < 3.0 * clock.sigma);
  CHECK(clock.sigma < 0.002);
  CHECK(position_error(s, &tracker, tracker.now()) < 2e-3);
}

namespace {

constexpr double kSettled = 1.5;  // [s] so early biases of an unknown sensor are still being found

/// Errors of what is predicted [m, rms] over the first moments and at the end, of a sensor with biases as large as
/// cheap ones have, by a set-up.
struct Settling {
  double first = 0.0, last = 0.0;
};
Settling settling(std::uint64_t seed, const Vector3d& gyro_bias, const Vector3d& accel_bias, const Vector3d& said_gyro,
                  const Vector3d& said_accel, double sigmas) {
  StreamSimulationOptions options;
  options.seed = seed;
  options.seconds = 8.0;
  options.imu.gyro_bias = options.imu.accel_bias = 0.0;
  SimulatedStreams s = simulate_streams(large_boom(), options);
  for (ImuSample& sample : s.imu) {
    sample.gyro += gyro_bias;
    sample.accel += accel_bias;
  }
  TrackSetup setup = s.setup;
  setup.gyro_bias = said_gyro;
  setup.accel_bias = said_accel;
  setup.gyro_bias_sigma = 1e-4 * sigmas;
  setup.accel_bias_sigma = 5e-3 * sigmas;
  Tracker tracker(setup);
  Player player;
  Settling out;
  int first = 0, last = 0;
  for (double t = 0.3; t < 8.0; t += 0.05) {
    play(s, t, &tracker, &player);
    const double error = position_error(s, &tracker, tracker.now() + 0.04);
    (t < kSettled ? out.first : out.last) += error * error;
    ++(t < kSettled ? first : last);
  }
  return {std::sqrt(out.first / first), std::sqrt(out.last / last)};
}

}  // namespace

TEST_CASE("biases of the set-up are used from the first sample on: seeds 1 to 6") {
  const Vector3d gyro(8e-3, -6e-3, 5e-3), accel(0.06, -0.05, 0.08);
  double unknown = 0.0, known = 0.0;
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 6); ++seed) {
    unknown += std::pow(settling(seed, gyro, accel, gyro, accel, 0.0).first, 2);
    known += std::pow(settling(seed, gyro, accel, gyro, accel, 1.0).first, 2);
  }
  MESSAGE("rms before " << std::sqrt(unknown / 6) << " after " << std::sqrt(known / 6));
  if (!kSanitized) CHECK(std::sqrt(known) < 0.9 * std::sqrt(unknown));
}

TEST_CASE("biases that have changed since by twice what is usual are found anew: seeds 1 to 4") {
  const Vector3d gyro(4e-3, -4e-3, 4e-3), accel(0.06, -0.06, 0.06);
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 4); ++seed) {
    const double unknown = settling(seed, gyro, accel, gyro, accel, 0.0).last;
    const double stale = settling(seed, gyro, accel, Vector3d::Zero(), Vector3d::Zero(), 1.0).last;
    CHECK(stale < 1.1 * unknown);
  }
}

TEST_CASE("a clock that drifts by 50 ppm is followed over two minutes: seed 6") {
  StreamSimulationOptions options;
  options.seed = 6;
  options.seconds = 120.0;
  options.tracker.clock_drift = 50e-6;
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  TrackSetup setup = s.setup;
  setup.clock_offset_sigma = 0.005;
  Tracker tracker(setup);
  Player player;
  play(s, 120.0, &tracker, &player);
  const ClockEstimate clock = tracker.clock();
  CHECK(std::abs(clock.offset - 0.006) < 3.5 * clock.sigma);
  CHECK(position_error(s, &tracker, tracker.now()) < 2e-3);
}

TEST_CASE("samples in any order within the window give the same state to the last bit: seeds 1 to 3") {
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 3); ++seed) {
    const SimulatedStreams s = boom(SimulatedMotion::stop_and_go, seed, 5.0);
    TrackSetup setup = s.setup;
    setup.clock_offset_sigma = 0.01;
    Belief end[2];
    for (int shuffled = 0; shuffled < 2; ++shuffled) {
      Random random(seed);
      struct Item {
        double arrival;
        bool pose;
        std::size_t k;
      };
      std::vector<Item> items;
      for (std::size_t k = 0; k < s.tracker.size(); ++k)
        items.push_back({s.tracker[k].t + (shuffled ? random.uniform(0.0, 0.45) : 0.01), true, k});
      for (std::size_t k = 0; k < s.flange.size(); ++k)
        items.push_back({s.flange[k].t + (shuffled ? random.uniform(0.0, 0.45) : 0.01), false, k});
      std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.arrival < b.arrival; });
      PoseFilter filter(setup, FilterOptions());
      std::size_t item = 0;
      const auto push = [&](double until) {
        for (; item < items.size() && items[item].arrival < until; ++item) {
          if (items[item].pose)
            CHECK(filter.push_pose(s.tracker[items[item].k]) == Outcome::accepted);
          else
            CHECK(filter.push_flange(s.flange[items[item].k].t, s.flange[items[item].k].T_base_frame) ==
                  Outcome::accepted);
        }
      };
      for (std::size_t k = 0; k < s.imu.size(); ++k) {
        push(s.imu[k].t);
        filter.push_imu(s.imu[k]);
        if (k % 37 == 0) filter.update();
      }
      push(1e9);
      filter.update();
      end[shuffled] = filter.belief_at(filter.newest_imu());
    }
    CHECK((end[0].x.p - end[1].x.p).cwiseAbs().maxCoeff() <= 1e-12);
    CHECK((end[0].x.q.coeffs() - end[1].x.q.coeffs()).cwiseAbs().maxCoeff() <= 1e-12);
    CHECK((end[0].P - end[1].P).cwiseAbs().maxCoeff() <= 1e-12);
  }
}

TEST_CASE("a late sample does what it would have done in time") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 4, 3.0);
  PoseFilter in_time(s.setup, FilterOptions()), late(s.setup, FilterOptions());
  Player a, b;
  const std::size_t k = play(s, 2.0, &in_time, &a);
  play(s, 2.0, &late, &b);
  const PoseSample& held = s.tracker[a.pose];
  in_time.push_pose(held);
  for (std::size_t i = k; i < k + 300; ++i) in_time.push_imu(s.imu[i]), late.push_imu(s.imu[i]);
  late.update();
  CHECK_FALSE(equal(in_time.belief_at(2.2), late.belief_at(2.2)));
  late.push_pose(held);
  in_time.update();
  late.update();
  CHECK(equal(in_time.belief_at(2.2), late.belief_at(2.2)));
}

TEST_CASE("faulty samples are refused by name and change nothing: seed 8") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 8, 4.0);
  PoseFilter filter(s.setup, FilterOptions());
  Player player;
  const std::size_t k = play(s, 3.0, &filter, &player);
  filter.update();
  const Belief before = filter.belief_at(3.0);

  SUBCASE("inertial") {
    ImuSample sample = s.imu[k - 1];
    CHECK(filter.push_imu(sample) == Outcome::duplicate);
    sample.t -= 0.5;
    CHECK(filter.push_imu(sample) == Outcome::backwards);
    sample = s.imu[k];
    sample.gyro.x() = kNaN;
    CHECK(filter.push_imu(sample) == Outcome::not_finite);
    sample = s.imu[k];
    sample.t = kNaN;
    CHECK(filter.push_imu(sample) == Outcome::not_finite);
  }
  SUBCASE("tracker") {
    PoseSample sample = s.tracker[player.pose - 1];
    CHECK(filter.push_pose(sample) == Outcome::duplicate);
    sample.t = 3.5;
    CHECK(filter.push_pose(sample) == Outcome::future);
    sample.t = 1.0;
    CHECK(filter.push_pose(sample) == Outcome::too_late);
    sample = s.tracker[player.pose];
    sample.position.y() = std::numeric_limits<double>::infinity();
    CHECK(filter.push_pose(sample) == Outcome::not_finite);
    sample = s.tracker[player.pose];
    sample.orientation.coeffs() *= 1.1;
    CHECK(filter.push_pose(sample) == Outcome::not_unit);
    CHECK(std::string(name(Outcome::not_unit)) == "not_unit");
  }
  SUBCASE("joints") {
    const FrameSample sample = s.flange[player.flange - 1];
    CHECK(filter.push_flange(sample.t, sample.T_base_frame) == Outcome::duplicate);
    CHECK(filter.push_flange(9.0, sample.T_base_frame) == Outcome::future);
    CHECK(filter.push_flange(1.0, sample.T_base_frame) == Outcome::too_late);
    CHECK(filter.push_flange(kNaN, sample.T_base_frame) == Outcome::not_finite);
  }
  filter.update();
  CHECK(equal(filter.belief_at(3.0), before));
}

TEST_CASE("a quaternion and its negative are the same measurement: seed 9") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 9, 3.0);
  SimulatedStreams flipped = s;
  for (std::size_t k = 0; k < flipped.tracker.size(); k += 2) flipped.tracker[k].orientation.coeffs() *= -1.0;
  PoseFilter a(s.setup, FilterOptions()), b(s.setup, FilterOptions());
  Player pa, pb;
  play(s, 3.0, &a, &pa);
  play(flipped, 3.0, &b, &pb);
  a.update();
  b.update();
  CHECK((a.belief_at(3.0).x.p - b.belief_at(3.0).x.p).norm() < 1e-12);
  CHECK((a.belief_at(3.0).P - b.belief_at(3.0).P).cwiseAbs().maxCoeff() < 1e-15);
}

TEST_CASE("two sensors on one stamp are both taken, in whatever order they come: seed 19") {
  SimulatedStreams s = boom(SimulatedMotion::gentle, 19, 3.0);
  std::sort(s.tracker.begin(), s.tracker.end(), [](const PoseSample& a, const PoseSample& b) { return a.t < b.t; });
  for (PoseSample& sample : s.tracker)
    sample.t = std::round(sample.t * 1000.0) / 1000.0;  // on stamps of the inertial sensor
  PoseFilter pose_first(s.setup, FilterOptions()), imu_first(s.setup, FilterOptions());
  std::size_t pose = 0;
  for (const ImuSample& sample : s.imu) {
    const bool both = pose < s.tracker.size() && std::abs(s.tracker[pose].t - sample.t) < 1e-9;
    if (both) {
      s.tracker[pose].t = sample.t;
      CHECK(pose_first.push_pose(s.tracker[pose]) == Outcome::accepted);
    }
    CHECK(pose_first.push_imu(sample) == Outcome::accepted);
    CHECK(imu_first.push_imu(sample) == Outcome::accepted);
    if (both) CHECK(imu_first.push_pose(s.tracker[pose++]) == Outcome::accepted);
  }
  CHECK(pose > 200);
  pose_first.update();
  imu_first.update();
  CHECK(equal(pose_first.belief_at(3.0), imu_first.belief_at(3.0)));
}

TEST_CASE("gaps of 3 microseconds and of 362 ms: seed 10") {
  const SimulatedStreams s = boom(SimulatedMotion::stop_and_go, 10, 6.0);
  Tracker tracker(s.setup);
  Player player;
  std::size_t k = play(s, 3.0, &tracker, &player);
  ImuSample close = s.imu[k - 1];
  close.t += 3e-6;
  CHECK(tracker.push_imu(close) == Outcome::accepted);
  const double sigma_before = std::sqrt(tracker.predict(tracker.now()).covariance(0, 0));
  k += 361;
  CHECK(tracker.push_imu(s.imu[k]) == Outcome::accepted_gap);
  const PosePrediction after = tracker.predict(tracker.now());
  CHECK(std::sqrt(after.covariance(0, 0)) > 5.0 * sigma_before);
  Vector6d e;
  e << s.tool_at(after.t).translation() - after.T_base_tool.translation(), Vector3d::Zero();
  for (int i = 0; i < 3; ++i) CHECK(std::abs(e[i]) < 4.0 * std::sqrt(after.covariance(i, i)));
  play(s, 5.5, &tracker, &player, k + 1);
  CHECK(tracker.predict(tracker.now()).status == Status::valid);
  CHECK(position_error(s, &tracker, tracker.now()) < 2e-3);
}

TEST_CASE("after a gap too long to bridge the filter starts anew: seed 11") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 11, 14.0);
  Tracker tracker(s.setup);
  Player player;
  std::size_t k = play(s, 3.0, &tracker, &player);
  k += 6000;
  CHECK(tracker.push_imu(s.imu[k]) == Outcome::accepted_restart);
  play(s, 13.5, &tracker, &player, k + 1);
  CHECK(tracker.predict(tracker.now()).status == Status::valid);
  CHECK(position_error(s, &tracker, tracker.now()) < 2e-3);
}

TEST_CASE("first pose before the first inertial sample, and the reverse: seed 12") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 12, 4.0);
  SUBCASE("poses first") {
    PoseFilter filter(s.setup, FilterOptions());
    for (std::size_t k = 0; k < 5; ++k) CHECK(accepted(filter.push_pose(s.tracker[k])));
    CHECK_FALSE(filter.initialised());
    Player player;
    player.pose = 5;
    play(s, 4.0, &filter, &player);
    filter.update();
    CHECK(filter.initialised());
    CHECK((filter.belief_at(4.0).x.p - (s.flange_at(4.0) * s.setup.T_flange_imu).translation()).norm() < 2e-3);
  }
  SUBCASE("inertial samples first") {
    PoseFilter filter(s.setup, FilterOptions());
    for (std::size_t k = 0; k < 1500; ++k) CHECK(accepted(filter.push_imu(s.imu[k])));
    filter.update();
    CHECK_FALSE(filter.initialised());
    Player player;
    while (s.tracker[player.pose].arrival < 1.5) ++player.pose;
    while (s.flange[player.flange].arrival < 1.5) ++player.flange;
    play(s, 4.0, &filter, &player, 1500);
    filter.update();
    CHECK((filter.belief_at(4.0).x.p - (s.flange_at(4.0) * s.setup.T_flange_imu).translation()).norm() < 2e-3);
  }
}

TEST_CASE("a saturated gyro is said, and widens what is known: seed 13") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 13, 4.0);
  Tracker tracker(s.setup);
  Player player;
  const std::size_t k = play(s, 3.0, &tracker, &player);
  const double before = tracker.predict(tracker.now()).covariance(3, 3);
  for (std::size_t i = k; i < k + 5; ++i) {
    ImuSample sample = s.imu[i];
    sample.gyro.z() = 34.9;
    CHECK(tracker.push_imu(sample) == Outcome::accepted_saturated);
  }
  CHECK(tracker.predict(tracker.now()).covariance(3, 3) > 25.0 * before);
  CHECK(tracker.counters().imu[static_cast<std::size_t>(Outcome::accepted_saturated)] == 5);
}

TEST_CASE("a frozen tracker is refused after its third repetition, and the status says that it is away: seed 14") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 14, 6.0);
  Tracker tracker(s.setup);
  Player player;
  std::size_t k = play(s, 3.0, &tracker, &player);
  PoseSample frozen = s.tracker[player.pose - 1];
  int refused = 0;
  for (; s.imu[k].t < 4.0; ++k) {
    tracker.push_imu(s.imu[k]);
    for (; player.flange < s.flange.size() && s.flange[player.flange].arrival < s.imu[k].t; ++player.flange)
      tracker.push_joints(s.flange[player.flange].t, s.flange[player.flange].T_base_frame);
    for (; player.plan < s.plan.size() && s.plan[player.plan].arrival < s.imu[k].t; ++player.plan)
      tracker.push_plan(s.plan[player.plan].t, s.plan[player.plan].T_base_frame);
    if (k % 10 == 0) {
      frozen.t += 0.01;
      refused += tracker.push_pose(frozen) == Outcome::frozen ? 1 : 0;
    }
  }
  CHECK(refused >= 95);
  CHECK(tracker.predict(tracker.now()).status == Status::coasting);
}

TEST_CASE("gross outliers of the tracker are left out: seed 15") {
  SimulatedStreams s = boom(SimulatedMotion::gentle, 15, 6.0);
  for (std::size_t k = 150; k < s.tracker.size(); k += 11) s.tracker[k].position.x() += 0.05;
  Tracker tracker(s.setup);
  Player player;
  play(s, 6.0, &tracker, &player);
  CHECK(position_error(s, &tracker, tracker.now()) < 2e-3);
  CHECK(tracker.counters().outliers > 25);
  CHECK(tracker.counters().reacquired == 0);
}

TEST_CASE(
    "without the tracker it coasts inside its covariance, without anything it is lost, never at zero velocity: seed "
    "16") {
  StreamSimulationOptions options;
  options.motion = SimulatedMotion::stop_and_go;
  options.seed = 16;
  options.seconds = 20.0;
  options.dropouts = {{8.0, 5.0}};
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  Tracker tracker(s.setup);
  CHECK(tracker.predict(0.0).status == Status::lost);
  Player player;
  std::size_t k = play(s, 7.9, &tracker, &player);
  CHECK(tracker.predict(tracker.now()).status == Status::valid);
  for (double t = 8.4; t < 12.95; t += 0.25) {
    k = play(s, t, &tracker, &player, k);
    const PosePrediction now = tracker.predict(tracker.now());
    CHECK(now.status == Status::coasting);
    for (int i = 0; i < 3; ++i)
      CHECK(std::abs((s.tool_at(now.t).translation() - now.T_base_tool.translation())[i]) <
            3.0 * std::sqrt(now.covariance(i, i)));
  }
  play(s, 15.0, &tracker, &player, k);
  CHECK(tracker.predict(tracker.now()).status == Status::valid);
}

TEST_CASE("when the inertial sensor dies, forward kinematics and the last static deviation hold: seed 17") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 17, 10.0);
  Tracker tracker(s.setup);
  Player player;
  play(s, 7.0, &tracker, &player);
  for (; player.flange < s.flange.size() && s.flange[player.flange].t < 7.09; ++player.flange)
    tracker.push_joints(s.flange[player.flange].t, s.flange[player.flange].T_base_frame);
  CHECK(tracker.predict(7.05).status == Status::valid);
  for (; player.flange < s.flange.size() && s.flange[player.flange].t < 7.5; ++player.flange)
    tracker.push_joints(s.flange[player.flange].t, s.flange[player.flange].T_base_frame);
  const PosePrediction held = tracker.predict(7.5);
  CHECK(held.status == Status::hold);
  const Vector3d error = held.T_base_tool.translation() - s.tool_at(7.5).translation();
  for (int i = 0; i < 3; ++i) CHECK(std::abs(error[i]) < 3.0 * std::sqrt(held.covariance(i, i)));
  CHECK(error.norm() <
        0.5 * (s.tool_at(7.0).translation() - s.tool_at(7.5).translation()).norm());  // better than to stand still
}

TEST_CASE("predictions of the deviation beat constant acceleration when the arm stops and goes: seeds 1 and 1001") {
  StreamSimulationOptions options;
  options.motion = SimulatedMotion::stop_and_go;
  options.tip_speed = 1.2;
  options.seconds = 40.0;
  options.seed = 1;
  const SimulatedStreams recording = simulate_streams(large_boom(), options);
  TrackOptions track;
  track.deviation.horizon = 0.08;
  std::vector<DeviationRow> rows;
  {
    Tracker tracker(recording.setup, track);
    Player player;
    DeviationRow buffer[64];
    std::size_t k = 0;
    for (double t = 0.5; t < 40.0; t += 0.5) {
      k = play(recording, t, &tracker, &player, k);
      const int n = tracker.take_rows(buffer, 64);
      rows.insert(rows.end(), buffer, buffer + n);
    }
  }
  const ModesResult found = identify_modes(rows, track.deviation);
  REQUIRE(found.model.count >= 3);
  for (std::size_t k = 0; k < static_cast<std::size_t>(found.model.count); ++k) {
    double nearest = 1.0;
    for (const FlexibleMode& mode : recording.modes)
      nearest = std::min(nearest, std::abs(found.model.frequency[k] / mode.frequency - 1.0));
    CHECK(nearest < 0.05);
  }
  for (std::size_t n = 1; n < found.error.size(); ++n) CHECK(found.error[n] < found.error[n - 1]);

  options.modes = recording.modes;
  options.frequency_spread = 0.0;
  options.seed = 1001;
  options.seconds = 25.0;
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  Tracker plain(s.setup, track);
  track.modes = found.model;
  Tracker modal(s.setup, track);
  Player a, b;
  double error[2] = {0.0, 0.0};
  std::size_t k[2] = {0, 0};
  for (double t = 6.0; t < 24.9; t += 0.01) {
    k[0] = play(s, t, &plain, &a, k[0]);
    k[1] = play(s, t, &modal, &b, k[1]);
    error[0] += std::pow(position_error(s, &plain, t + 0.08), 2);
    error[1] += std::pow(position_error(s, &modal, t + 0.08), 2);
  }
  CHECK(std::sqrt(error[1]) < 0.8 * std::sqrt(error[0]));
  CHECK(std::sqrt(error[1] / 1890.0) < 1.5e-3);
}

TEST_CASE("identify_modes wants rows enough") {
  CHECK_THROWS_WITH_AS(identify_modes(std::vector<DeviationRow>(10)), doctest::Contains("500"), std::invalid_argument);
}

TEST_CASE("an oscillator's step is the exact solution") {
  const double omega = 7.0, zeta = 0.1, dt = 0.05, force = 2.0;
  double x = 0.3, v = -1.0;
  const OscillatorStep step = oscillator_step(omega, zeta, dt);
  const double X = step.transition(0, 0) * x + step.transition(0, 1) * v + step.input[0] * force;
  const double V = step.transition(1, 0) * x + step.transition(1, 1) * v + step.input[1] * force;
  const int n = 50000;
  for (int k = 0; k < n; ++k) {  // midpoint rule
    const double h = dt / n, a = force - 2.0 * zeta * omega * v - omega * omega * x;
    const double xm = x + 0.5 * h * v, vm = v + 0.5 * h * a;
    x += h * vm;
    v += h * (force - 2.0 * zeta * omega * vm - omega * omega * xm);
  }
  CHECK(std::abs(X - x) < 1e-9);
  CHECK(std::abs(V - v) < 1e-8);
}

TEST_CASE("planned frames: a cubic is met exactly with its derivatives, and time must not go backwards") {
  FrameBuffer plan(64);
  const auto at = [](double t) {
    Isometry3d T = Isometry3d::Identity();
    T.translation() = Vector3d(1.0 + 2.0 * t - t * t, t * t * t, 0.5);
    T.linear() = exp_rotation(Vector3d(0.0, 0.0, 0.3 * t)).toRotationMatrix();
    return T;
  };
  for (int k = 0; k < 20; ++k) CHECK(plan.push(0.1 * k, at(0.1 * k)) == Outcome::accepted);
  CHECK(plan.push(0.1 * 19, at(1.9)) == Outcome::duplicate);
  CHECK(plan.push(1.0, at(1.0)) == Outcome::backwards);
  CHECK(plan.push(kNaN, at(1.0)) == Outcome::not_finite);
  for (const double t : {0.0, 0.04, 0.55, 1.23, 1.9}) {
    PlanPoint point;
    REQUIRE(plan.at(t, &point));
    CHECK((point.T.matrix() - at(t).matrix()).norm() < 1e-10);
    CHECK((point.velocity - Vector3d(2.0 - 2.0 * t, 3.0 * t * t, 0.0)).norm() < 1e-9);
    CHECK((point.acceleration - Vector3d(-2.0, 6.0 * t, 0.0)).norm() < 1e-8);
    CHECK((point.rate - Vector3d(0.0, 0.0, 0.3)).norm() < 1e-9);
  }
  PlanPoint point;
  CHECK_FALSE(plan.at(1.91, &point));
  CHECK(plan.at(2.0, &point, 0.2));
}

TEST_CASE("corrections: a step is taken within rate and jerk, a sway is followed without lag, size is bounded") {
  const CorrectionLimits limits;
  SUBCASE("step") {
    CorrectionLimiter limiter(limits);
    Vector6d wanted = Vector6d::Zero();
    Vector3d x[4] = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
    double overshoot = 0.0;
    for (int k = 0; k < 400; ++k) {
      if (k > 10) wanted.head<3>() = Vector3d(0.06, -0.08, 0.0);
      std::rotate(x, x + 3, x + 4);
      x[0] = limiter.follow(0.01 * k, wanted).head<3>();
      CHECK((x[0] - x[1]).norm() / 0.01 <= limits.position_rate);
      CHECK((x[0] - 3.0 * x[1] + 3.0 * x[2] - x[3]).norm() / 1e-6 <= 1.0001 * limits.position_jerk);
      overshoot = std::max(overshoot, x[0].norm() - 0.1);
    }
    CHECK((x[0] - Vector3d(0.06, -0.08, 0.0)).norm() < 1e-4);
    CHECK(overshoot < 0.002);
  }
  SUBCASE("sway") {
    CorrectionLimiter limiter(limits);
    double worst = 0.0;
    for (int k = 0; k < 1000; ++k) {
      Vector6d wanted = Vector6d::Zero();
      wanted[2] = 0.03 * std::sin(2.0 * M_PI * 1.3 * 0.01 * k);
      const Vector6d out = limiter.follow(0.01 * k, wanted);
      if (k > 200) worst = std::max(worst, std::abs(out[2] - wanted[2]));
    }
    CHECK(worst < 2e-3);
  }
  SUBCASE("size") {
    CorrectionLimiter limiter(limits);
    Vector6d wanted = Vector6d::Zero(), out;
    wanted[0] = 1.0;
    wanted[5] = 1.0;
    for (int k = 0; k < 400; ++k) out = limiter.follow(0.01 * k, wanted);
    CHECK(std::abs(out[0] - limits.position) < 1e-3);
    CHECK(std::abs(out[5] - limits.rotation) < 1e-3);
  }
}

TEST_CASE("the compensation, sent, would put the tool where it was planned: seed 18") {
  const SimulatedStreams s = boom(SimulatedMotion::gentle, 18, 12.0);
  Tracker tracker(s.setup);
  Player player;
  std::size_t k = 0;
  Compensation last;
  for (double t = 1.0; t < 10.0; t += 0.01) {
    k = play(s, t, &tracker, &player, k);
    last = tracker.compensate(t + 0.04);
  }
  CHECK(last.has_plan);
  CHECK(last.predicted.status == Status::valid);
  // The correction is what the planned tool is ahead of the true one.
  CHECK((last.wanted.head<3>() - (last.T_base_tool_planned.translation() - s.tool_at(last.predicted.t).translation()))
            .norm() < 3e-3);
  CHECK((last.correction - last.wanted).norm() < 5e-3);
  const Isometry3d corrected = last.T_base_flange * s.setup.T_flange_tool;
  CHECK((corrected.translation() - last.T_base_tool_planned.translation() - last.correction.head<3>()).norm() < 1e-12);
}

TEST_CASE("options that make no sense are refused in words") {
  TrackOptions options;
  options.filter.window = 0.05;
  CHECK_THROWS_WITH_AS(Tracker(TrackSetup(), options), doctest::Contains("settle_time"), std::invalid_argument);
  options = TrackOptions();
  options.modes.count = 1;
  CHECK_THROWS_WITH_AS(Tracker(TrackSetup(), options), doctest::Contains("frequency"), std::invalid_argument);
  options = TrackOptions();
  options.filter.reacquire_after = 1;
  CHECK_THROWS_WITH_AS(Tracker(TrackSetup(), options), doctest::Contains("reacquire_after"), std::invalid_argument);
}

// ---- Watch ----------------------------------------------------------------------------------------------------------

namespace {

struct Watched {
  Shift shift;
  double worst_before = 0.0, said = -1.0;
  std::uint64_t before = 0;
};

/// Plays everything and asks every 0.1 s; `said` is when a shift after `start` was first told.
Watched watch(const SimulatedStreams& s, double start, const WatchOptions& options = {}) {
  Watched out;
  TrackOptions how;
  how.watch = options;
  Tracker tracker(s.setup, how);
  Player player;
  std::size_t k = 0;
  for (double t = 0.1; t < s.imu.back().t; t += 0.1) {
    k = play(s, t, &tracker, &player, k);
    const Shift& shift = tracker.shift();
    if (t < start)
      out.before = shift.count;
    else if (out.said < 0.0 && shift.count > out.before)
      out.said = t - start;
  }
  out.shift = tracker.shift();
  return out;
}

StreamSimulationOptions watched(std::uint64_t seed, double seconds) {
  StreamSimulationOptions options;
  options.motion = seed % 2 == 0 ? SimulatedMotion::gentle : SimulatedMotion::stop_and_go;
  options.tip_speed = 0.35;
  options.seed = seed;
  options.seconds = seconds;
  return options;
}

}  // namespace

TEST_CASE("a base station shifted by 5 mm or by 0.1 degrees is flagged within 2 s: seeds 1 to 8") {
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 2 : 8); ++seed) {
    for (const bool turned : {false, true}) {
      CAPTURE(seed);
      CAPTURE(turned);
      StreamSimulationOptions options = watched(seed, 24.0);
      Random random(seed);
      const Vector3d direction = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      StationShift shift;
      shift.start = 20.0;
      if (turned)
        shift.T_old_new.linear() = exp_rotation(M_PI / 1800.0 * direction).toRotationMatrix();
      else
        shift.T_old_new.translation() = 0.005 * direction;
      options.shifts = {shift};
      const Watched found = watch(simulate_streams(large_boom(), options), 20.0);
      CHECK(found.before == 0);
      CHECK(found.said > 0.0);
      CHECK(found.said < 2.0);
      CHECK(std::abs(found.shift.t - 20.0) < 0.3);
      if (!turned) CHECK(std::abs(found.shift.jump.head<3>().norm() - 0.005) < 0.003);
    }
  }
}

TEST_CASE("a jump is judged against the tracker's noise, which is told with it: seed 2") {
  StreamSimulationOptions options = watched(2, 24.0);
  StationShift shift;
  shift.start = 20.0;
  shift.T_old_new.translation() = Vector3d(0.005, 0.0, 0.0);
  options.shifts = {shift};
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  const Watched found = watch(s, 20.0);
  REQUIRE(found.said > 0.0);
  CHECK(found.shift.position_noise == doctest::Approx(1e-3).epsilon(0.2));
  CHECK(found.shift.rotation_noise == doctest::Approx(1e-3).epsilon(0.2));
  WatchOptions coarse;
  coarse.least = 20.0;  // a jump of 5 mm is 5 times the noise
  CHECK(watch(s, 20.0, coarse).said < 0.0);
}

TEST_CASE("a slipped receiver is flagged within 2 s: seeds 1 to 6") {
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 2 : 6); ++seed) {
    CAPTURE(seed);
    SimulatedStreams s = simulate_streams(large_boom(), watched(seed, 24.0));
    const Quaterniond turn = exp_rotation(Vector3d(0.0, M_PI / 900.0, 0.0));
    for (PoseSample& sample : s.tracker) {
      if (sample.t < 20.0) continue;
      sample.position += sample.orientation * Vector3d(0.003, 0.0, 0.003);
      sample.orientation = sample.orientation * turn;
    }
    const Watched found = watch(s, 20.0);
    CHECK(found.before == 0);
    CHECK(found.said > 0.0);
    CHECK(found.said < 2.0);
  }
}

TEST_CASE("no false alarm: seeds 101 to 110, two minutes each") {
  // 20 minutes without one say little of one in 8 hours by themselves. The benchmark runs the 8 hours.
  for (std::uint64_t seed = 101; seed <= (kSanitized ? 101 : 110); ++seed) {
    CAPTURE(seed);
    StreamSimulationOptions options = watched(seed, kSanitized ? 20.0 : 120.0);
    options.tracker.out_of_order = 0.02;
    options.tracker.lost = 0.01;
    if (seed % 3 == 0) options.dropouts = {{30.0, 2.0}, {60.0, 0.4}, {80.0, 10.0}};
    CHECK(watch(simulate_streams(large_boom(), options), 1e9).before == 0);
  }
}

TEST_CASE("gross outliers are not taken for a shift: seed 15") {
  SimulatedStreams s = simulate_streams(large_boom(), watched(15, 30.0));
  for (std::size_t k = 150; k < s.tracker.size(); k += 11) s.tracker[k].position.x() += 0.05;
  CHECK(watch(s, 1e9).before == 0);
}

TEST_CASE("bursts of reflected signals, up to seven samples long, are not taken for a shift: seeds 15 to 18") {
  for (std::uint64_t seed = 15; seed <= 18; ++seed) {
    SimulatedStreams s = simulate_streams(large_boom(), watched(seed, 35.0));
    math::Random random(seed);
    for (std::size_t k = 150; k + 8 < s.tracker.size(); k += 90) {
      const Vector3d way = 0.15 * Vector3d(random.normal(), random.normal(), random.normal());
      for (std::size_t i = k; i < k + 2 + k % 6; ++i) s.tracker[i].position += way;
    }
    CHECK(watch(s, 1e9).before == 0);
  }
}

TEST_CASE("bursts of reflected signals, up to half a second, are neither followed nor a shift: seeds 19 to 22") {
  for (std::uint64_t seed = 19; seed <= (kSanitized ? 19 : 22); ++seed) {
    CAPTURE(seed);
    SimulatedStreams s = simulate_streams(large_boom(), watched(seed, 40.0));
    math::Random random(seed);
    for (std::size_t k = 150; k + 50 < s.tracker.size(); k += 300) {
      const Vector3d direction = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      const std::size_t until = k + static_cast<std::size_t>(random.uniform(3.0, 45.0));
      for (std::size_t i = k; i < until; ++i) s.tracker[i].position += random.uniform(0.05, 0.5) * direction;
    }
    CHECK(watch(s, 1e9).before == 0);
    CHECK(consistency(s, FilterOptions()).error < 5e-3);
  }
}

TEST_CASE("a tracker that is faster than the options say is followed: seed 23") {
  StreamSimulationOptions options = watched(23, 8.0);
  options.tracker_rate = 1000.0;
  CHECK(consistency(simulate_streams(large_boom(), options), FilterOptions()).error < 1e-3);
}

TEST_CASE("corrections keep their rate and jerk whatever is wanted: 300 runs of steps and sways, seed 1") {
  math::Random random(1);
  const CorrectionLimits limits;
  double rate = 0.0, jerk = 0.0;
  for (int run = 0; run < 300; ++run) {
    tracking::CorrectionLimiter limiter(limits);
    math::Vector6d size, phase, step = math::Vector6d::Zero();
    const double frequency = random.uniform(0.0, 3.0);
    for (int i = 0; i < 6; ++i) size[i] = 0.05 * random.normal(), phase[i] = random.uniform(0.0, 2.0 * M_PI);
    Eigen::Vector3d x[4] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                            Eigen::Vector3d::Zero()};
    for (int k = 0; k < 600; ++k) {
      const double t = 0.01 * k;
      if (random.uniform(0.0, 1.0) < 0.02)
        for (int i = 0; i < 6; ++i) step[i] = 0.1 * random.normal();
      const math::Vector6d wanted = step + (size.array() * (2.0 * M_PI * frequency * t + phase.array()).sin()).matrix();
      std::rotate(x, x + 3, x + 4);
      x[0] = limiter.follow(t, wanted).head<3>();
      rate = std::max(rate, (x[0] - x[1]).norm() / 0.01);
      jerk = std::max(jerk, (x[0] - 3.0 * x[1] + 3.0 * x[2] - x[3]).norm() / 1e-6);
    }
  }
  CHECK(rate > 0.9 * limits.position_rate);
  CHECK(rate <= limits.position_rate);
  CHECK(jerk <= 1.0001 * limits.position_jerk);
}

TEST_CASE("station and receiver are told apart on an arm that sways little and turns: seeds 1 and 2") {
  for (const bool station : {true, false}) {
    for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 2); ++seed) {
      CAPTURE(station);
      CAPTURE(seed);
      StreamSimulationOptions options = watched(2, 80.0);
      options.seed = seed;
      options.tip_speed = 1.0;
      options.modes = large_boom_modes();
      for (FlexibleMode& mode : options.modes) mode.participation *= 0.02, mode.gust *= 0.1;
      StationShift shift;
      shift.start = 20.0;
      shift.T_old_new.linear() = exp_rotation(Vector3d(0.0, 0.006, 0.003)).toRotationMatrix();
      if (station) options.shifts = {shift};
      SimulatedStreams s = simulate_streams(large_boom(), options);
      const Quaterniond turn = exp_rotation(Vector3d(0.01, 0.02, 0.0));
      for (PoseSample& sample : s.tracker) {
        if (station || sample.t < 20.0) continue;
        sample.position += sample.orientation * Vector3d(0.03, 0.0, 0.01);
        sample.orientation = sample.orientation * turn;
      }
      const Watched found = watch(s, 20.0);
      CHECK(found.shift.count >= 1);
      CHECK(found.shift.cause == (station ? ShiftCause::station : ShiftCause::receiver));
    }
  }
}
