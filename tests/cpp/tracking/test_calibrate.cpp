// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Calibration of the tracking set-up: zero residual at the truth, standard errors that are the scatter, and faults by
// their name.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "math/random.hpp"
#include "math/rotation.hpp"
#include "support/sanitized.hpp"
#include "truing/tracking/calibrate.hpp"
#include "truing/tracking/simulation.hpp"

using namespace truing;
using namespace truing::tracking;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

namespace {

Vector3d normal3(Random* random, double sigma) {
  const double x = random->normal(), y = random->normal(), z = random->normal();
  return sigma * Vector3d(x, y, z);
}

Isometry3d frame(const Vector3d& p, const Vector3d& r) {
  Isometry3d out = Isometry3d::Identity();
  out.translation() = p;
  out.linear() = exp_rotation(r).toRotationMatrix();
  return out;
}

const Isometry3d kTrackerBase = frame({9.0, -4.0, 1.2}, {0.01, -0.02, 2.1}),
                 kFlangeReceiver = frame({0.15, 0.10, 0.20}, {0.3, -0.2, 1.0});

struct Positions {
  std::vector<Isometry3d> flange, receiver;
};

Positions positions(std::size_t n, double position_noise, double rotation_noise, std::uint64_t seed) {
  Random random(seed);
  Positions out;
  for (std::size_t k = 0; k < n; ++k) {
    const Isometry3d F = frame(Vector3d(8.0, 0.0, 2.0) + normal3(&random, 2.0), normal3(&random, 0.5));
    Isometry3d T = kTrackerBase * F * kFlangeReceiver;
    T.translation() += normal3(&random, position_noise);
    T.linear() = exp_rotation(normal3(&random, rotation_noise)).toRotationMatrix() * T.linear();
    out.flange.push_back(F);
    out.receiver.push_back(T);
  }
  return out;
}

Vector6d difference(const Isometry3d& found, const Isometry3d& truth) {
  Vector6d out;
  out << found.translation() - truth.translation(),
      log_rotation(Quaterniond(found.linear() * truth.linear().transpose()));
  return out;
}

/// A boom that slews and luffs about, with a tool-side motion that turns about all axes.
SimulatedStreams motion(std::uint64_t seed, double seconds, double offset, double speed = 1.0) {
  StreamSimulationOptions options;
  options.motion = SimulatedMotion::stop_and_go;
  options.tip_speed = speed;
  options.seed = seed;
  options.seconds = seconds;
  options.tracker.clock_offset = offset;
  return simulate_streams(large_boom(), options);
}

std::vector<PoseSample> in_order(std::vector<PoseSample> tracker) {
  std::sort(tracker.begin(), tracker.end(), [](const PoseSample& a, const PoseSample& b) { return a.t < b.t; });
  return tracker;
}

}  // namespace

TEST_CASE("test positions without noise give the frames exactly: seed 1") {
  const Positions p = positions(12, 0.0, 0.0, 1);
  const FramesResult r = calibrate_frames(p.flange, p.receiver);
  REQUIRE(r.status == CalibrationStatus::done);
  CHECK(difference(r.T_tracker_base.T, kTrackerBase).norm() < 1e-7);
  CHECK(difference(r.T_flange_receiver.T, kFlangeReceiver).norm() < 1e-7);
  for (const PositionError& e : r.errors) CHECK(e.position < 1e-7);
}

TEST_CASE("standard errors of the frames are the scatter over 200 seeds") {
  Vector6d squares = Vector6d::Zero();
  const int seeds = kSanitized ? 2 : 200;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Positions p = positions(15, 1e-3, 1e-3, static_cast<std::uint64_t>(seed));
    const FramesResult r = calibrate_frames(p.flange, p.receiver);
    REQUIRE(r.status == CalibrationStatus::done);
    const Vector6d e = difference(r.T_flange_receiver.T, kFlangeReceiver);
    squares += e.cwiseAbs2().cwiseQuotient(r.T_flange_receiver.covariance.diagonal()) / seeds;
  }
  if (kSanitized) return;
  for (int i = 0; i < 6; ++i) {
    CHECK(squares[i] > 0.7);
    CHECK(squares[i] < 1.4);
  }
}

TEST_CASE("a position that is off is reported, and counts little: seed 3") {
  Positions p = positions(15, 5e-4, 5e-4, 3);
  const Positions clean = p;
  p.receiver[6].translation() += Vector3d(0.03, -0.02, 0.0);
  const FramesResult r = calibrate_frames(p.flange, p.receiver),
                     without = calibrate_frames(clean.flange, clean.receiver);
  REQUIRE(r.status == CalibrationStatus::done);
  CHECK(r.errors[6].position > 0.03);
  CHECK(r.errors[6].weight < 0.05);
  CHECK(difference(r.T_flange_receiver.T, without.T_flange_receiver.T).head<3>().norm() < 5e-4);
}

TEST_CASE("readings of the tracker's numbers are named: mm for m, left-handed, degrees for radians: seed 4") {
  Positions p = positions(15, 5e-4, 5e-4, 4);
  const auto said = [](const FramesResult& r, const char* what) {
    return std::any_of(r.warnings.begin(), r.warnings.end(),
                       [&](const std::string& text) { return text.find(what) != std::string::npos; });
  };
  SUBCASE("mm") {
    for (Isometry3d& T : p.receiver) T.translation() *= 1000.0;
    const FramesResult r = calibrate_frames(p.flange, p.receiver);
    CHECK(r.status == CalibrationStatus::not_consistent);
    CHECK(said(r, "receiver positions are in mm"));
  }
  SUBCASE("left-handed") {
    const Eigen::DiagonalMatrix<double, 3> mirror(1.0, -1.0, 1.0);
    for (Isometry3d& T : p.receiver) {
      T.translation() = mirror * T.translation();
      T.linear() = mirror * T.linear() * mirror;
    }
    const FramesResult r = calibrate_frames(p.flange, p.receiver);
    CHECK(r.status == CalibrationStatus::not_consistent);
    CHECK(said(r, "left-handed"));
  }
  SUBCASE("inverted") {
    for (Isometry3d& T : p.receiver) T = T.inverse(Eigen::Isometry);
    const FramesResult r = calibrate_frames(p.flange, p.receiver);
    CHECK(r.status == CalibrationStatus::not_consistent);
    CHECK(said(r, "inverted"));
    CHECK(!said(r, "set-up"));  // closes as well, but a tracker does not ride on the flange
  }
  SUBCASE("degrees") {
    for (Isometry3d& T : p.flange)
      T.linear() = exp_rotation(M_PI / 180.0 * log_rotation(Quaterniond(T.linear()))).toRotationMatrix();
    const FramesResult r = calibrate_frames(p.flange, p.receiver);
    CHECK(r.status == CalibrationStatus::not_consistent);
    CHECK(said(r, "radians"));
  }
  SUBCASE("the flange does not turn") {
    for (Isometry3d& T : p.flange) T.linear().setIdentity();
    for (std::size_t k = 0; k < p.flange.size(); ++k) p.receiver[k] = kTrackerBase * p.flange[k] * kFlangeReceiver;
    const FramesResult r = calibrate_frames(p.flange, p.receiver);
    CHECK(r.status == CalibrationStatus::not_observable);
    CHECK(r.message.find("Rotate") != std::string::npos);
  }
}

TEST_CASE("what is wrong is said of flange, tracker and receiver, not of hand, camera and board: seed 5") {
  const Positions good = positions(15, 5e-4, 5e-4, 5);
  Positions inverted = good, scaled = good, still = good;
  for (Isometry3d& T : inverted.flange) T = T.inverse();
  for (Isometry3d& T : scaled.receiver) T.translation() *= 1.01;
  for (std::size_t k = 0; k < still.flange.size(); ++k) {
    still.flange[k].linear().setIdentity();
    still.receiver[k] = kTrackerBase * still.flange[k] * kFlangeReceiver;
  }
  for (const Positions& p : {inverted, scaled, still}) {
    const FramesResult r = calibrate_frames(p.flange, p.receiver);
    std::string said = r.message;
    for (const std::string& warning : r.warnings) said += " " + warning;
    CAPTURE(said);
    CHECK((said.find("flange") != std::string::npos || said.find("tracker") != std::string::npos));
    for (const char* theirs : {"camera", "board", "the hand", "hand poses"})
      CHECK(said.find(theirs) == std::string::npos);
  }
}

TEST_CASE("standstills are found, and averaged over the sway") {
  std::vector<FrameSample> flange;
  std::vector<PoseSample> tracker;
  const auto where = [](double t) {
    return frame({8.0 + 0.5 * std::clamp(t - 6.0, 0.0, 2.0), 0.0, 2.0}, {0.0, 0.0, 0.0});
  };
  for (int k = 0; k <= 1400; ++k) flange.push_back({0.01 * k, 0.01 * k, where(0.01 * k)});
  for (int k = 0; k <= 1400; ++k) {
    const double t = 0.01 * k;
    PoseSample sample;
    sample.t = t;
    sample.position = where(t).translation() + Vector3d(0.0, 0.02 * std::sin(2.0 * M_PI * 1.0 * t), 0.0);
    sample.orientation = Quaterniond::Identity();
    tracker.push_back(sample);
  }
  const std::vector<RestPose> rests = find_rests(flange, tracker);
  REQUIRE(rests.size() == 2);
  CHECK(rests[0].end < 6.0);
  CHECK(rests[1].start > 8.0);
  for (const RestPose& rest : rests) {
    CHECK((rest.T_tracker_receiver.translation() - rest.T_base_flange.translation()).norm() < 1e-3);
    CHECK(rest.scatter > 0.005);
  }
  tracker[700].t = 3.0;
  CHECK_THROWS_WITH_AS(find_rests(flange, tracker), doctest::Contains("row 700"), std::invalid_argument);
}

TEST_CASE("tool: point from pivot poses, orientation from prescribed ones, errors that are the scatter: 2000 seeds") {
  const Isometry3d tool = frame({0.3, 0.0, -0.4}, {0.2, -0.1, 0.4});
  const Vector3d point(8.0, 1.0, 2.0);
  Vector3d squares = Vector3d::Zero();
  const std::uint64_t seeds = kSanitized ? 20 : 2000;
  for (std::uint64_t seed = 0; seed <= seeds; ++seed) {
    const double noise = seed == 0 ? 0.0 : 1e-3;
    Random random(seed);
    ToolPoses poses;
    for (int k = 0; k < 8; ++k) {
      Isometry3d F = frame(Vector3d::Zero(), normal3(&random, 0.4));
      F.translation() = point - F.linear() * tool.translation() + normal3(&random, noise);
      poses.pivot.push_back(F);
    }
    for (int k = 0; k < 3; ++k) {
      const Matrix3d prescribed = exp_rotation(normal3(&random, 0.3)).toRotationMatrix();
      poses.prescribed.push_back(prescribed);
      poses.orientation.push_back(frame(point, Vector3d::Zero()));
      poses.orientation.back().linear() =
          exp_rotation(normal3(&random, noise)).toRotationMatrix() * prescribed * tool.linear().transpose();
    }
    const ToolResult r = calibrate_tool(poses);
    REQUIRE(r.status == CalibrationStatus::done);
    const Vector6d e = difference(r.T_flange_tool.T, tool);
    if (seed == 0)
      CHECK(e.norm() < 1e-10);
    else
      squares += e.head<3>().cwiseAbs2().cwiseQuotient(r.T_flange_tool.covariance.diagonal().head<3>()) /
                 static_cast<double>(seeds);
  }
  if (kSanitized) return;
  for (int i = 0; i < 3; ++i) {  // of a t distribution with 18 degrees of freedom: 1.125
    CHECK(squares[i] > 1.0);
    CHECK(squares[i] < 1.27);
  }
}

TEST_CASE("a tool that only turned about one axis is not known along it") {
  ToolPoses poses;
  for (int k = 0; k < 6; ++k) poses.pivot.push_back(frame({1.0, 0.0, 0.0}, {0.0, 0.0, 0.4 * k}));
  const ToolResult r = calibrate_tool(poses);
  CHECK(r.status == CalibrationStatus::not_observable);
  CHECK(r.message.find("two axes") != std::string::npos);
  poses.pivot.resize(2);
  CHECK_THROWS_WITH_AS(calibrate_tool(poses), doctest::Contains("three"), std::invalid_argument);
}

TEST_CASE("inertial sensor, gravity and clock without noise: seed 1") {
  StreamSimulationOptions options;
  options.motion = SimulatedMotion::stop_and_go;
  options.tip_speed = 1.0;
  options.seconds = 40.0;
  options.seed = 1;
  options.imu = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  options.tracker.position_noise = options.tracker.rotation_noise = 0.0;
  options.tracker.clock_offset = 0.137;
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  const InertialResult r = calibrate_inertial(s.imu, in_order(s.tracker));
  REQUIRE(r.status == CalibrationStatus::done);
  CHECK(std::abs(r.clock_offset - 0.137) < 2e-5);
  const Vector6d e = difference(r.T_receiver_imu.T, s.setup.T_flange_receiver.inverse() * s.setup.T_flange_imu);
  CHECK(e.head<3>().norm() < 2e-3);
  CHECK(e.tail<3>().norm() < 1e-3);
  CHECK((r.gravity - s.setup.T_tracker_base.linear() * Vector3d(0.0, 0.0, -9.81)).norm() < 5e-3);
  CHECK(r.position_rms < 2e-5);
}

TEST_CASE("biases of the inertial sensor are within their standard errors, and go into the set-up: seeds 1 to 4") {
  const Vector3d gyro(4e-3, -3e-3, 2e-3), accel(0.05, -0.04, 0.03);
  for (std::uint64_t seed = 1; seed <= (kSanitized ? 1 : 4); ++seed) {
    StreamSimulationOptions options;
    options.motion = SimulatedMotion::stop_and_go;
    options.tip_speed = 1.0;
    options.seconds = 40.0;
    options.seed = seed;
    options.imu.gyro_bias = options.imu.accel_bias = options.imu.gyro_bias_walk = options.imu.accel_bias_walk = 0.0;
    SimulatedStreams s = simulate_streams(large_boom(), options);
    for (ImuSample& sample : s.imu) {
      sample.gyro += gyro;
      sample.accel += accel;
    }
    const InertialResult r = calibrate_inertial(s.imu, in_order(s.tracker));
    REQUIRE(r.status == CalibrationStatus::done);
    CHECK((r.gyro_bias - gyro).norm() < 4.0 * std::sqrt(3.0) * r.gyro_bias_sigma);
    CHECK((r.accel_bias - accel).norm() < 4.0 * std::sqrt(3.0) * r.accel_bias_sigma);
    CHECK(r.gyro_bias_sigma < 1e-3);
    CHECK(r.accel_bias_sigma < 0.1);
    const TrackSetup setup = assemble_setup(FramesResult{}, ToolResult{}, r);
    CHECK(setup.gyro_bias == r.gyro_bias);
    CHECK(setup.accel_bias == r.accel_bias);
    CHECK(setup.gyro_bias_sigma == r.gyro_bias_sigma);
    CHECK(setup.accel_bias_sigma == r.accel_bias_sigma);
  }
}

TEST_CASE("standard errors of clock, lever arm and orientation hold over 24 seeds") {
  double clock = 0.0, lever = 0.0, turn = 0.0;
  const int seeds = kSanitized ? 1 : 24;
  int within = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const SimulatedStreams s = motion(static_cast<std::uint64_t>(seed), 60.0, 0.0421);
    const InertialResult r = calibrate_inertial(s.imu, in_order(s.tracker));
    REQUIRE(r.status == CalibrationStatus::done);
    const Vector6d e = difference(r.T_receiver_imu.T, s.setup.T_flange_receiver.inverse() * s.setup.T_flange_imu);
    const double z = (r.clock_offset - 0.0421) / r.clock_offset_sigma;
    clock += z * z / seeds;
    within += std::abs(z) < 3.0 ? 1 : 0;
    lever += e.head<3>().cwiseAbs2().cwiseQuotient(r.T_receiver_imu.covariance.diagonal().head<3>()).mean() / seeds;
    turn += e.tail<3>().cwiseAbs2().cwiseQuotient(r.T_receiver_imu.covariance.diagonal().tail<3>()).mean() / seeds;
  }
  if (kSanitized) return;
  CAPTURE(clock);
  CAPTURE(lever);
  CAPTURE(turn);
  CHECK(within >= seeds - 1);
  CHECK(clock > 0.4);
  CHECK(clock < 2.0);
  CHECK(lever > 0.3);
  CHECK(lever < 2.0);
  CHECK(turn > 0.3);
  CHECK(turn < 1.8);
}

TEST_CASE("a motion that is too poor is said, with what would do: seed 2") {
  StreamSimulationOptions options;
  options.motion = SimulatedMotion::gentle;
  options.tip_speed = 0.2;
  options.seed = 2;
  options.seconds = 20.0;
  const SimulatedStreams s = simulate_streams(large_boom(), options);
  InertialOptions wanted;
  wanted.clock_wanted = 1e-4;
  const InertialResult r = calibrate_inertial(s.imu, in_order(s.tracker), wanted);
  REQUIRE(r.status == CalibrationStatus::done);
  CHECK_FALSE(r.rich_enough);
  CHECK(r.advice.find("rad/s") != std::string::npos);
  CHECK(r.advice.find("0.1 ms") != std::string::npos);
}

TEST_CASE("units and hands of inertial sensor and tracker are named: seed 3") {
  SimulatedStreams s = motion(3, 30.0, 0.02);
  s.tracker = in_order(s.tracker);
  const auto says = [&](const char* what) {
    const InertialResult r = calibrate_inertial(s.imu, s.tracker);
    CAPTURE(r.message);
    CHECK(r.status == CalibrationStatus::not_consistent);
    CHECK(r.message.find(what) != std::string::npos);
  };
  SUBCASE("deg/s") {
    for (ImuSample& sample : s.imu) sample.gyro *= 180.0 / M_PI;
    says("deg/s");
  }
  SUBCASE("g") {
    for (ImuSample& sample : s.imu) sample.accel /= 9.80665;
    says("in g");
  }
  SUBCASE("mm") {
    for (PoseSample& sample : s.tracker) sample.position *= 1000.0;
    says("mm");
  }
  SUBCASE("left-handed tracker") {
    for (PoseSample& sample : s.tracker) {
      sample.position.y() *= -1.0;
      sample.orientation =
          Quaterniond(sample.orientation.w(), -sample.orientation.x(), sample.orientation.y(), -sample.orientation.z());
    }
    says("left-handed");
  }
}

/// A sensor on the receiver that is shaken to and fro along x by `acceleration` [m/s^2] and turns about all axes.
struct Shaken {
  std::vector<ImuSample> imu;
  std::vector<PoseSample> tracker;
};
Shaken shaken(double acceleration, double seconds) {
  const double omega = 2.0 * M_PI * 1.5, size = acceleration / (omega * omega), h = 1e-4;
  const auto turn = [](double t) {
    return exp_rotation(0.4 * Vector3d(std::sin(2.1 * t), std::sin(1.3 * t), std::sin(1.7 * t)));
  };
  Shaken out;
  for (int k = 0; k <= 500 * seconds; ++k) {
    const double t = k / 500.0;
    const Vector3d force(-size * omega * omega * std::sin(omega * t), 0.0, 9.81);
    out.imu.push_back(
        {t, t, log_rotation(turn(t - h).conjugate() * turn(t + h)) / (2.0 * h), turn(t).conjugate() * force});
  }
  for (int k = 0; k <= 100 * seconds; ++k) {
    const double t = k / 100.0;
    out.tracker.push_back({t, t, Vector3d(size * std::sin(omega * t), 0.0, 2.0), turn(t)});
  }
  return out;
}

TEST_CASE("an arm that accelerates by more than gravity between its stops is calibrated all the same") {
  const Shaken s = shaken(13.0, 20.0);
  double mean = 0.0;
  for (const ImuSample& sample : s.imu) mean += sample.accel.norm() / static_cast<double>(s.imu.size());
  REQUIRE(mean > 12.3);
  const InertialResult r = calibrate_inertial(s.imu, s.tracker);
  CAPTURE(r.message);
  REQUIRE(r.status == CalibrationStatus::done);
  CHECK((r.gravity - Vector3d(0.0, 0.0, -9.81)).norm() < 0.02);
}

TEST_CASE("an accelerometer without gravity is refused, whatever the arm's accelerations add up to") {
  Shaken s = shaken(13.0, 20.0);
  for (std::size_t k = 0; k < s.imu.size(); ++k) {
    const double t = s.imu[k].t;
    const Quaterniond turn = exp_rotation(0.4 * Vector3d(std::sin(2.1 * t), std::sin(1.3 * t), std::sin(1.7 * t)));
    s.imu[k].accel -= turn.conjugate() * Vector3d(0.0, 0.0, 9.81);
  }
  const InertialResult r = calibrate_inertial(s.imu, s.tracker);
  CHECK(r.status == CalibrationStatus::not_consistent);
  CHECK(r.message.find("gravity was not taken away") != std::string::npos);
}

TEST_CASE("a tracker with y up, and gravity that is not along the base's z, are said and used: seed 4") {
  SimulatedStreams s = motion(4, 30.0, 0.0);
  s.tracker = in_order(s.tracker);
  const Quaterniond y_up = exp_rotation(Vector3d(-M_PI / 2.0, 0.0, 0.0));
  for (PoseSample& sample : s.tracker) {
    sample.position = y_up * sample.position;
    sample.orientation = y_up * sample.orientation;
  }
  const InertialResult r = calibrate_inertial(s.imu, s.tracker);
  REQUIRE(r.status == CalibrationStatus::done);
  CHECK(r.tracker_up == "+y");
  REQUIRE(r.warnings.size() >= 1);
  CHECK(r.warnings[0].find("+y") != std::string::npos);

  FramesResult frames;  // a base that is tilted by 5 degrees
  frames.T_tracker_base.T.linear() = y_up.toRotationMatrix() * s.setup.T_tracker_base.linear() *
                                     exp_rotation(Vector3d(5.0 * M_PI / 180.0, 0.0, 0.0)).toRotationMatrix();
  std::vector<std::string> notes;
  const TrackSetup setup = assemble_setup(frames, ToolResult(), r, &notes);
  REQUIRE(notes.size() == 2);
  CHECK(notes[0].find("not level") != std::string::npos);
  CHECK(std::abs(std::acos(-setup.gravity.z() / setup.gravity.norm()) - 5.0 * M_PI / 180.0) < 2e-3);
}

TEST_CASE("records that do not belong together, or cannot be used: seeds 5 and 6") {
  const SimulatedStreams a = motion(5, 20.0, 0.0), b = motion(6, 20.0, 0.0);
  const InertialResult r = calibrate_inertial(a.imu, in_order(b.tracker));
  CHECK(r.status != CalibrationStatus::done);
  std::vector<ImuSample> imu = a.imu;
  imu[70].accel.y() = std::nan("");
  CHECK_THROWS_WITH_AS(calibrate_inertial(imu, in_order(a.tracker)), doctest::Contains("row 70"),
                       std::invalid_argument);
  imu = a.imu;
  imu[70].t = imu[60].t;
  CHECK_THROWS_WITH_AS(calibrate_inertial(imu, in_order(a.tracker)), doctest::Contains("back in time"),
                       std::invalid_argument);
}
