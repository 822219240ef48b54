// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <thread>

#include <doctest/doctest.h>

#include "dynamics/prepare.hpp"
#include "support/swung_arm.hpp"
#include "truing/dynamics.hpp"

using namespace truing;

namespace {

constexpr double kRowStep = 0.01;  // [s]

/// J1 swings all the time, J2 until it stops.
Recording recording(double seconds, double stops) {
  Recording out;
  out.name = "motion";
  const auto rows = static_cast<Eigen::Index>(std::lround(seconds / kRowStep));
  out.time = Eigen::VectorXd::LinSpaced(rows, 0.0, kRowStep * static_cast<double>(rows - 1));
  out.position.resize(rows, 2);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = std::min(out.time[i], stops);
    out.position(i, 0) = 0.5 * std::sin(1.3 * out.time[i]);
    out.position(i, 1) = 0.5 * (1.0 - std::cos(0.9 * t));
  }
  return out;
}

/// The same without the rows between two times.
Recording with_gap(const Recording& whole, double from, double to) {
  Recording out = whole;
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < whole.time.size(); ++i) {
    if (whole.time[i] > from && whole.time[i] < to) continue;
    out.time[kept] = whole.time[i];
    out.position.row(kept++) = whole.position.row(i);
  }
  out.time.conservativeResize(kept);
  out.position.conservativeResize(kept, Eigen::NoChange);
  return out;
}

}  // namespace

TEST_CASE("a joint that came to rest keeps the friction of its last motion, however a recording is parted") {
  Robot robot = swung::level_arm();
  robot.torque_effects = {{"presliding", {"J2"}, {{"presliding.J2", 2.0}, {"presliding.J2.x0", 1e-3}}}};
  const Recording motion = recording(110.0, 60.0);
  const Eigen::MatrixXd torque = dynamics::predict(robot, motion).torque;
  const Eigen::MatrixXd bare = dynamics::predict(swung::level_arm(), motion).torque;
  const double last = torque(6200, 1) - bare(6200, 1);
  REQUIRE(std::abs(last) > 0.5);
  for (Eigen::Index i = 6200; i < torque.rows(); ++i) REQUIRE(std::abs(torque(i, 1) - bare(i, 1) - last) < 1e-6);
}

TEST_CASE("the way across a gap is no motion") {
  dynamics::PrepareOptions options;
  options.torque_per_ampere = {1.0, 1.0};
  const Recording whole = recording(20.0, 20.0);
  const Robot robot = swung::level_arm();
  const std::vector<Recording> one{whole}, other{with_gap(whole, 6.0, 9.0)};
  const MotionRange smooth = dynamics::range_of(dynamics::Tiles(one, robot, options, 1));
  const MotionRange cut = dynamics::range_of(dynamics::Tiles(other, robot, options, 1));
  CHECK(std::abs(smooth.speed[0] - 0.65) < 0.01);
  CHECK(cut.speed[0] < 1.02 * smooth.speed[0]);
  CHECK(cut.acceleration[0] < 1.3 * smooth.acceleration[0]);
}

TEST_CASE("rows between gaps are predicted by their own motion, however few they are") {
  Robot robot = swung::level_arm();
  robot.torque_effects = {{"viscous", {"J1"}, {{"viscous.J1", 3.0}}}};
  const Recording whole = recording(20.0, 20.0);
  const Recording cut = with_gap(with_gap(whole, 6.0, 9.0), 9.3, 12.0);  // 0.3 s are left between
  const Eigen::MatrixXd torque =
      dynamics::predict(robot, cut).torque - dynamics::predict(swung::level_arm(), cut).torque;
  REQUIRE(torque.rows() == cut.time.size());
  for (Eigen::Index i = 0; i < torque.rows(); ++i) {
    const double t = cut.time[i];
    if (t > 9.05 && t < 9.25) CHECK(std::abs(torque(i, 0) - 3.0 * 0.65 * std::cos(1.3 * t)) < 0.15);
  }
}

TEST_CASE("tiles are added up in their order, however long each of them takes") {
  const Robot robot = swung::level_arm();
  std::vector<Recording> recordings;
  for (int r = 0; r < 30; ++r) recordings.push_back(recording(3.0, 2.0));
  const dynamics::Tiles tiles(recordings, robot, {}, 3);
  std::array<std::size_t, dynamics::Tiles::kTogether> in_slot{};
  std::vector<std::size_t> order;
  const auto all = [](std::size_t) { return true; };
  tiles.for_each(
      all,
      [&](dynamics::Tile& tile, std::size_t k) {
        if (tile.recording % 7 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        in_slot[k] = tile.recording;
      },
      [&](std::size_t k) { order.push_back(in_slot[k]); });
  std::vector<std::size_t> expected(recordings.size());
  std::iota(expected.begin(), expected.end(), 0);
  CHECK(order == expected);
}

TEST_CASE("what one tile's work throws comes out, and nobody waits for it") {
  const Robot robot = swung::level_arm();
  const std::vector<Recording> recordings(30, recording(3.0, 2.0));
  const dynamics::Tiles tiles(recordings, robot, {}, 3);
  const auto work = [](dynamics::Tile& tile, std::size_t) {
    if (tile.recording == 1) throw std::runtime_error("no more");
  };
  CHECK_THROWS_WITH(tiles.for_each([](std::size_t) { return true; }, work, [](std::size_t) {}), "no more");
}
