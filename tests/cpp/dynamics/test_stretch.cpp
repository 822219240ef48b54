// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <memory>

#include <doctest/doctest.h>

#include "dynamics/filter.hpp"
#include "dynamics/prepare.hpp"
#include "dynamics/tile_file.hpp"
#include "math/random.hpp"
#include "support/swung_arm.hpp"
#include "truing/dynamics.hpp"

using namespace truing;
using truing::math::Random;

namespace {

constexpr double kFineStep = 0.002;  // [s]

/// J1 swings, J2 rests after a while; steps that jitter, a gap, a column, noise on the torques.
Recording recording(double seconds) {
  Recording out;
  out.name = "long";
  Random random(7);
  std::vector<double> times;
  for (double t = 3.0; t < 3.0 + seconds; t += kFineStep * random.uniform(0.9, 1.1))
    if (t < 40.0 || t > 43.0) times.push_back(t);
  const auto rows = static_cast<Eigen::Index>(times.size());
  out.time = Eigen::Map<const Eigen::VectorXd>(times.data(), rows);
  out.position.resize(rows, 2);
  out.torque.resize(rows, 2);
  Eigen::VectorXd temperature(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = out.time[i];
    out.position.row(i) << 0.5 * std::sin(1.3 * t), 0.5 * (1.0 - std::cos(0.9 * std::min(t, 60.0)));
    out.torque.row(i) << 3.0 * std::cos(1.3 * t) + 0.1 * random.normal(), 2.0 + 0.1 * random.normal();
    temperature[i] = 20.0 + 0.1 * t;
  }
  out.columns["temp_C"] = temperature;
  return out;
}

Recording rows_of(const Recording& whole, Eigen::Index begin, Eigen::Index end) {
  Recording out;
  out.name = whole.name;
  out.time = whole.time.segment(begin, end - begin);
  out.position = whole.position.middleRows(begin, end - begin);
  out.torque = whole.torque.middleRows(begin, end - begin);
  for (const auto& [name, column] : whole.columns) out.columns[name] = column.segment(begin, end - begin);
  return out;
}

/// The same recording, so many rows at a time.
Recording read_in_pieces(const Recording& whole, Eigen::Index rows) {
  Recording out = rows_of(whole, 0, rows);
  out.test = whole.test;
  const auto all = std::make_shared<const Recording>(whole);
  out.read = [all, rows]() -> NextRows {
    return [all, rows, begin = Eigen::Index{0}](Recording* next) mutable {
      if (begin >= all->time.size()) return false;
      const Eigen::Index end = std::min(all->time.size(), begin + rows);
      *next = rows_of(*all, begin, end);
      begin = end;
      return true;
    };
  };
  out.end = whole.time[whole.time.size() - 1];
  return out;
}

std::vector<dynamics::Tile> tiles_of(const Recording& recording, const Robot& robot) {
  std::vector<dynamics::Tile> out;
  dynamics::PrepareOptions options;
  options.torque_per_ampere = {1.0, 1.0};
  dynamics::for_each_tile(recording, 0, robot, options, [&](dynamics::Tile& tile) {
    out.push_back(tile);
    return true;
  });
  return out;
}

}  // namespace

TEST_CASE("tiles of a recording that is read are those of one in memory, to the bit") {
  const Robot robot = swung::level_arm();
  const Recording whole = recording(260.0);
  const std::vector<dynamics::Tile> expected = tiles_of(whole, robot);
  REQUIRE(expected.size() == 4);  // one before the gap, three behind it
  // The usual step is that of the first rows: of as many as are looked at together.
  for (const Eigen::Index rows : {65536, 70001}) {
    const std::vector<dynamics::Tile> found = tiles_of(read_in_pieces(whole, rows), robot);
    REQUIRE(found.size() == expected.size());
    for (std::size_t k = 0; k < found.size(); ++k) {
      CHECK(found[k].first == expected[k].first);
      CHECK(found[k].motion.time == expected[k].motion.time);
      CHECK(found[k].motion.q == expected[k].motion.q);
      CHECK(found[k].motion.qdd == expected[k].motion.qdd);
      CHECK(found[k].motion.columns.at("temp_C") == expected[k].motion.columns.at("temp_C"));
      CHECK(found[k].measured == expected[k].measured);
      CHECK(found[k].moving == expected[k].moving);
      CHECK(found[k].inside == expected[k].inside);
    }
  }
}

TEST_CASE("a joint that turns at an end of a stretch is not looked at there") {
  Recording one;
  one.name = "ends";
  one.time = Eigen::VectorXd::LinSpaced(2001, 0.0, 10.0);
  const Eigen::ArrayXd t = one.time.array();
  one.position.resize(t.size(), 2);
  one.position.col(0) = 0.4 * (1.3 * t - 0.08).cos();  // turns after 0.06 s, and not at the end
  one.position.col(1) = 0.3 * (t / 3.0).sin();         // runs on at both
  one.torque = Eigen::MatrixXd::Zero(t.size(), 2);
  const std::vector<dynamics::Tile> tiles = tiles_of(one, swung::level_arm());
  REQUIRE(tiles.size() == 1);
  const dynamics::Tile& tile = tiles.front();
  const Eigen::VectorXd time = tile.own_time();
  for (Eigen::Index i = 0; i < tile.count; ++i) {
    const bool near = time[i] < 1.0 / 8.0 - 1e-9;  // a period of the cut-off
    CHECK(tile.inside(i, 0) == (near ? 0.0 : 1.0));
    CHECK(tile.moving(i, 0) == tile.inside(i, 0));
    CHECK(tile.inside(i, 1) == 1.0);
  }
  one.position.col(0).setConstant(0.4);  // a joint that rests does not turn
  CHECK(tiles_of(one, swung::level_arm()).front().inside.minCoeff() == 1.0);
}

TEST_CASE("tiles come back from disk to the bit, in any order") {
  const Robot robot = swung::level_arm();
  const std::vector<dynamics::Tile> expected = tiles_of(recording(260.0), robot);
  dynamics::TileFile file;
  for (const dynamics::Tile& tile : expected) REQUIRE(file.add(tile));
  REQUIRE(file.size() == expected.size());
  for (const std::size_t k : {3, 0, 2, 1}) {
    const dynamics::Tile found = file.read(k, robot);
    CHECK(found.motion.robot == &robot);
    CHECK(found.motion.step == expected[k].motion.step);
    CHECK(found.weights == expected[k].weights);
    CHECK(found.stride == expected[k].stride);
    CHECK(found.first == expected[k].first);
    CHECK(found.count == expected[k].count);
    CHECK(found.motion.time == expected[k].motion.time);
    CHECK(found.motion.q == expected[k].motion.q);
    CHECK(found.motion.qd == expected[k].motion.qd);
    CHECK(found.motion.qdd == expected[k].motion.qdd);
    CHECK(found.motion.links == expected[k].motion.links);
    CHECK(found.motion.columns == expected[k].motion.columns);
    CHECK(found.measured == expected[k].measured);
    CHECK(found.moving == expected[k].moving);
    CHECK(found.inside == expected[k].inside);
  }
}

TEST_CASE("a recording that is longer than memory is read once, however many passes there are") {
  const Robot robot = swung::level_arm();
  std::vector<Recording> recordings = {read_in_pieces(recording(260.0), 65536)};
  int times = 0;
  recordings[0].read = [&times, read = recordings[0].read]() { return ++times, read(); };
  for (const bool one_pass : {false, true}) {
    dynamics::PrepareOptions options;
    options.torque_per_ampere = {1.0, 1.0};
    options.one_pass = one_pass;
    times = 0;
    const dynamics::Tiles tiles(recordings, robot, options, 2);
    std::vector<Eigen::Index> rows;
    for (int pass = 0; pass < 3; ++pass) {
      Eigen::Index counted = 0;
      std::vector<Eigen::Index> lot(dynamics::Tiles::kTogether);
      tiles.for_each([](std::size_t) { return true; },
                     [&](dynamics::Tile& tile, std::size_t k) { lot[k] = tile.count; },
                     [&](std::size_t k) { counted += lot[k]; });
      rows.push_back(counted);
    }
    CHECK(rows[0] > 0);
    CHECK(rows == std::vector<Eigen::Index>(3, rows[0]));
    CHECK(times == (one_pass ? 3 : 1));
  }
}

TEST_CASE("a recording that comes a few rows at a time has the same tiles but for its usual step") {
  const Robot robot = swung::level_arm();
  const Recording whole = recording(120.0);
  const std::vector<dynamics::Tile> expected = tiles_of(whole, robot),
                                    found = tiles_of(read_in_pieces(whole, 997), robot);
  REQUIRE(found.size() == expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    const Eigen::Index rows = std::min(found[k].count, expected[k].count);
    CHECK(std::abs(found[k].count - expected[k].count) <= expected[k].count / 100);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = found[k].own_time()[i];
      REQUIRE(std::abs(found[k].motion.q((found[k].first + i) * found[k].stride, 0) - 0.5 * std::sin(1.3 * (t + 3.0))) <
              1e-3);
    }
  }
}

TEST_CASE("between rows that are far apart lies a smooth curve, and the filter sees torques where they were recorded") {
  constexpr double kRate = 2.0 * 3.14159265358979 * 0.8;                              // [rad/s] one turn in ten rows
  const auto torque = [](double t) { return std::sin(1.7 * t) > 0.0 ? 2.0 : -1.0; };  // turns between rows
  Recording slow;
  slow.name = "slow";
  slow.time = Eigen::VectorXd::LinSpaced(7001, 0.0, 875.0);
  slow.position.resize(7001, 2);
  slow.torque.resize(7001, 2);
  for (Eigen::Index i = 0; i < 7001; ++i) {
    const double t = slow.time[i];
    slow.position.row(i) << std::sin(kRate * t), std::sin(0.5 * t);
    slow.torque.row(i) << torque(t), 0.0;
  }
  const Robot robot = swung::level_arm();
  const std::vector<dynamics::Tile> tiles = tiles_of(slow, robot);
  REQUIRE(tiles.size() > 4);
  for (const dynamics::Tile& tile : tiles) {
    CHECK(tile.motion.step == doctest::Approx(0.125 / 25.0));
    const Eigen::VectorXd time = tile.own_time();
    const Eigen::VectorXd expected =
        tile.own_rows(tile.motion.time.unaryExpr([&](double t) { return torque(std::round(t * 1e6) * 1e-6); }));
    // The low-pass takes some of the amplitude, and no differences take more of the acceleration than of the angle.
    for (Eigen::Index i = 0; i < tile.count; ++i) {
      if (time[i] < 5.0 || time[i] > 870.0) continue;
      const Eigen::Index row = (tile.first + i) * tile.stride;
      REQUIRE(std::abs(tile.motion.qdd(row, 0) + kRate * kRate * tile.motion.q(row, 0)) < 1e-3 * kRate * kRate);
      REQUIRE(std::abs(tile.measured(i, 0) - expected[i]) < 1e-9);
    }
  }
  const std::vector<dynamics::Tile> read = tiles_of(read_in_pieces(slow, 1013), robot);
  REQUIRE(read.size() == tiles.size());
  for (std::size_t k = 0; k < read.size(); ++k) {
    CHECK(read[k].motion.time == tiles[k].motion.time);
    CHECK(read[k].motion.qdd == tiles[k].motion.qdd);
    CHECK(read[k].measured == tiles[k].measured);
  }
}

TEST_CASE("where torques are means over the time of a row, the filter sees the means of what is between the rows") {
  const auto parabola = [](double k) { return 1.0 + 0.5 * k + k * k; };
  for (const Eigen::Index between : {2, 3, 4, 5}) {
    Eigen::VectorXd steps(10 * between + 1);
    for (Eigen::Index k = 0; k < steps.size(); ++k) steps[k] = parabola(static_cast<double>(k));
    const Eigen::VectorXd means = dynamics::means_of_rows(steps.data(), steps.size(), between);
    REQUIRE(means.size() == 11);
    CHECK(means[0] == steps[0]);
    CHECK(means[10] == steps[10 * between]);
    for (Eigen::Index row = 1; row < 10; ++row) {
      // The trapezoidal rule has w^2 / 12 + h^2 / 6 of the parabola, the midpoint rule w^2 / 12 - h^2 / 12.
      const double width = static_cast<double>(between), rest = between % 2 == 0 ? 1.0 / 6.0 : -1.0 / 12.0;
      const double mean = parabola(static_cast<double>(row * between)) + width * width / 12.0 + rest;
      CHECK(means[row] == doctest::Approx(mean).epsilon(1e-12));
    }
  }

  Recording slow = recording(30.0);
  slow.position = slow.position.topRows(200).eval();
  slow.torque = slow.torque.topRows(200).eval();
  slow.columns.clear();
  slow.time = Eigen::VectorXd::LinSpaced(200, 0.0, 199 * 0.04);
  const dynamics::Tile at_instants = tiles_of(slow, swung::level_arm()).front();
  slow.torque_is_mean = true;
  const dynamics::Tile of_means = tiles_of(slow, swung::level_arm()).front();
  REQUIRE(of_means.between == 8);
  const Eigen::VectorXd turning = (of_means.motion.time.array() * 5.0).sin().sign();
  const Eigen::VectorXd means = dynamics::means_of_rows(turning.data(), turning.size(), 8);
  const Eigen::VectorXd seen = of_means.own_rows(turning);
  CHECK(seen == dynamics::filtered(means, of_means.weights).middleRows(of_means.first / 8, of_means.count));
  CHECK((seen - at_instants.own_rows(turning)).cwiseAbs().maxCoeff() > 0.05);
}

TEST_CASE("times that go backwards from one piece to the next are refused") {
  const Recording whole = recording(20.0);
  Recording wrong = read_in_pieces(whole, 1000);
  wrong.read = [whole]() -> NextRows {
    return [whole, left = 2](Recording* next) mutable {
      *next = rows_of(whole, 0, 1000);
      return left-- > 0;
    };
  };
  CHECK_THROWS_WITH_AS(validate(wrong, swung::level_arm()),
                       doctest::Contains("column t, row 1: found 3, expected a time after"), std::invalid_argument);
}

TEST_CASE("torques of a recording that is longer than memory are not predicted row by row") {
  CHECK_THROWS_WITH_AS(dynamics::predict(swung::level_arm(), read_in_pieces(recording(20.0), 1000)),
                       doctest::Contains("longer than memory"), std::invalid_argument);
}

TEST_CASE("a fit to recordings that are read is that to recordings in memory, on one thread and on two") {
  Robot robot = swung::level_arm();
  for (Joint& joint : robot.joints) joint.inertia = Eigen::Vector3d(0.004, 0.04, 0.04).asDiagonal();
  const Recording whole = recording(150.0);
  const auto errors = [&](const Recording& one, int threads) {
    TorqueOptions options;
    options.threads = threads;
    std::vector<double> out;
    for (const TorqueErrors& of : dynamics::identify(robot, {one}, options).errors) {
      for (const TorqueError& e : of.held_out) out.push_back(e.rms);
    }
    return out;
  };
  const std::vector<double> expected = errors(whole, 1);
  CHECK(errors(whole, 2) == expected);
  const std::vector<double> found = errors(read_in_pieces(whole, 65536), 1);
  CHECK(errors(read_in_pieces(whole, 65536), 2) == found);
  REQUIRE(found.size() == expected.size());
  // Its columns are not kept, and sums are formed in another order; a sine hardly tells inertias apart.
  for (std::size_t k = 0; k < found.size(); ++k) CHECK(std::abs(found[k] / expected[k] - 1.0) < 1e-5);
}
