// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What noise is: its size, rows far out, rows that err together; and the sums of weighted rows.

#include <doctest/doctest.h>

#include <cmath>

#include "diagnosis/diagnosis.hpp"
#include "math/random.hpp"

using namespace truing;
using namespace truing::diagnosis;

namespace {

/// Positions of `poses` poses, measured `repeats` times each; errors of `sigma`, and of `common` for all of a pose.
struct Weighed {
  Design design;
  Measurements data;

  Weighed(int poses, int repeats, double sigma, double common) {
    constexpr Eigen::Index kColumns = 4;
    Random random(11);
    const Eigen::Index n = 3 * poses * repeats;
    design.x.resize(n, kColumns);
    design.y.resize(n);
    design.folds = 4, design.test_folds = 2;
    design.nuisance = {0, 1};
    design.prior = Eigen::VectorXd::Constant(kColumns, kLargest);
    Eigen::Index i = 0;
    for (int pose = 0; pose < poses; ++pose) {
      const Eigen::Vector3d of_pose = common * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      for (int repeat = 0; repeat < repeats; ++repeat) {
        for (int k = 0; k < 3; ++k, ++i) {
          for (Eigen::Index c = 0; c < kColumns; ++c) design.x(i, c) = random.normal();
          design.y[i] = 0.3 * design.x(i, 0) + of_pose[k] + sigma * random.normal();
          design.row.push_back(pose * repeats + repeat);
          design.component.push_back(static_cast<std::int8_t>(k));
          design.fold.push_back(pose % (design.folds + design.test_folds));
          design.cluster.push_back(pose);
        }
      }
    }
    data.rows = static_cast<std::size_t>(poses * repeats);
  }
};

}  // namespace

TEST_CASE("noise is found, and weights are its inverse") {
  const Weighed scene(400, 1, 2e-4, 0.0);
  const Weighted weighted = weigh(scene.design, scene.data, 1);
  CHECK(weighted.noise.position_sigma == doctest::Approx(2e-4).scale(0).epsilon(0.06));
  CHECK(weighted.noise.design_effect == doctest::Approx(1.0));  // nothing is repeated
  CHECK(weighted.noise.outliers.empty());
  CHECK(weighted.weight.minCoeff() == doctest::Approx(weighted.weight.maxCoeff()));
  CHECK(weighted.weight[0] * weighted.noise.position_sigma == doctest::Approx(1.0).scale(0).epsilon(1e-3));
}

namespace {

/// The design with free columns of chance beside its own, one candidate of all of them.
Design with_chance(Design design, Eigen::Index columns) {
  const Eigen::Index own = design.x.cols();
  design.x.conservativeResize(Eigen::NoChange, columns);
  Random random(13);
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    for (Eigen::Index c = own; c < columns; ++c) design.x(i, c) = random.normal();
  }
  design.prior = Eigen::VectorXd::Constant(columns, kLargest);
  design.candidates.groups.resize(1);
  design.candidates.named.resize(1);
  for (Eigen::Index c = own; c < columns; ++c) design.candidates.groups[0].columns.push_back(static_cast<int>(c));
  return design;
}

}  // namespace

TEST_CASE("rows held out do not stand far out because a flexible fit did not see them") {
  // 240 poses of 3 values each, and 340 free columns: of other poses they leave twice the square of the noise.
  const Weighed few(360, 1, 2e-4, 0.0);
  const Design design = with_chance(few.design, 340);
  const Weighted weighted = weigh(design, few.data, 1);
  CHECK(weighted.noise.outliers.empty());
  int less = 0;  // of 120 rows held out, one in 34 beyond three standard deviations
  for (Eigen::Index i = 0; i < design.x.rows(); i += 3) {
    const bool held_out = design.fold[static_cast<std::size_t>(i)] >= design.folds;
    less += held_out && weighted.weight[i] < 0.999 * weighted.weight.maxCoeff() ? 1 : 0;
  }
  CHECK(less <= 8);
}

TEST_CASE("what a fit of everything predicts badly of few poses is not their noise") {
  // 120 poses of 3 values each, and as many free columns: frames alone predict other poses better.
  const Weighed few(180, 1, 2e-4, 0.0);
  CHECK(weigh(with_chance(few.design, 360), few.data, 1).noise.position_sigma ==
        doctest::Approx(2e-4).scale(0).epsilon(0.12));
}

TEST_CASE("a row far out counts for nothing, and is named") {
  Weighed scene(400, 1, 2e-4, 0.0);
  scene.design.y[3 * 70 + 1] += 0.05;
  const Weighted weighted = weigh(scene.design, scene.data, 1);
  CHECK(weighted.noise.outliers == std::vector<std::int32_t>{70});
  CHECK(weighted.weight[3 * 70] < 0.01 * weighted.weight[0]);
}

TEST_CASE("rows of a pose that err together count by the design effect 1 + (m - 1) rho") {
  for (const double rho : {0.0, 0.5, 0.9}) {
    CAPTURE(rho);
    const Weighed scene(600, 4, 2e-4 * std::sqrt(1.0 - rho), 2e-4 * std::sqrt(rho));
    CHECK(weigh(scene.design, scene.data, 1).noise.design_effect ==
          doctest::Approx(1.0 + 3.0 * rho).scale(0).epsilon(0.08));
  }
}

TEST_CASE("a fit that passes through all poses does not hide what their repeats share") {
  // 20 poses of 3 values each, and 60 free columns: what is left of the poses seen is the repeats' own scatter.
  const Weighed small(30, 3, 1e-6, 1e-3);
  Design design = small.design;
  design.x.conservativeResize(Eigen::NoChange, 100);
  Random random(12);
  for (Eigen::Index pose = 0; pose < 30; ++pose) {
    for (Eigen::Index k = 0; k < 3; ++k) {
      for (Eigen::Index c = 4; c < 100; ++c) {
        const double value = random.normal();
        for (Eigen::Index repeat = 0; repeat < 3; ++repeat) design.x(9 * pose + 3 * repeat + k, c) = value;
      }
    }
  }
  design.prior = Eigen::VectorXd::Constant(100, kLargest);
  design.candidates.groups.resize(1);
  design.candidates.named.resize(1);
  for (int c = 4; c < 100; ++c) design.candidates.groups[0].columns.push_back(c);
  CHECK(weigh(design, small.data, 1).noise.design_effect > 2.5);
}

TEST_CASE("sums of appended columns are those of all columns made afresh") {
  Weighed scene(60, 2, 2e-4, 1e-4);
  Design& design = scene.design;
  design.weight = weigh(design, scene.data, 1).weight;
  const Design::Rows all = design.x;
  design.x = all.leftCols(2);
  Grams grown = make_grams(design, 1.7, 1);
  design.x = all;
  extend_grams(design, 1.7, &grown);
  const Grams afresh = make_grams(design, 1.7, 2);
  REQUIRE(grown.train_folds.size() == 4);
  REQUIRE(grown.test_folds.size() == 2);
  const auto same = [](const Gram& a, const Gram& b) {
    CHECK((a.xx - b.xx).norm() < 1e-12 * b.xx.norm());
    CHECK((a.xy - b.xy).norm() < 1e-12 * b.xy.norm());
    CHECK(a.yy == doctest::Approx(b.yy));
    CHECK(a.n == doctest::Approx(b.n));
  };
  same(grown.train, afresh.train);
  same(grown.test, afresh.test);
  for (std::size_t f = 0; f < 4; ++f) same(grown.train_folds[f], afresh.train_folds[f]);
  for (std::size_t f = 0; f < 2; ++f) same(grown.test_folds[f], afresh.test_folds[f]);
}

namespace {

/// Of what angles of links may be over what they were: six lengths and six angles of all links together, of so many
/// poses. `angle` and `length` are true sizes over the noise of a value.
double ratio_of_links(int poses, double length, double angle, std::uint64_t seed) {
  Work work;
  Weighed scene(poses, 1, 1.0, 0.0);
  work.design = std::move(scene.design);
  Design& design = work.design;
  constexpr Eigen::Index kAll = 16;
  Random random(seed);
  design.x.conservativeResize(Eigen::NoChange, kAll);
  design.prior = Eigen::VectorXd::Constant(kAll, kLargest);
  design.column_units.assign(kAll, "m");
  design.candidates.groups.resize(1);
  design.candidates.named.resize(1);
  design.candidates.named[0].kind = Explanation::Kind::all_geometry;
  design.y *= 1e-5;  // of noise, in metres
  for (Eigen::Index c = 4; c < kAll; ++c) {
    for (Eigen::Index i = 0; i < design.x.rows(); ++i) design.x(i, c) = random.normal();
    design.y += 1e-5 * (c % 2 ? angle : length) * random.normal() * design.x.col(c);
    design.column_units[static_cast<std::size_t>(c)] = c % 2 ? "rad" : "m";
    design.candidates.groups[0].columns.push_back(static_cast<int>(c));
  }
  design.weight = Eigen::VectorXd::Constant(design.x.rows(), 1e5);
  work.grams = make_grams(design, 1.0, 1);
  size_angles_of_links(&work);
  CHECK(design.prior[4] == kLargest);
  return design.prior[5] / kLargest;
}

}  // namespace

TEST_CASE("angles of links are as large against lengths as few poses have them") {
  for (const std::uint64_t seed : {31u, 32u, 33u}) {
    CHECK(ratio_of_links(40, 1.0, 1.0, seed) == 1.0);
    CHECK(ratio_of_links(40, 1.0, 30.0, seed) > 2.0);
    CHECK(ratio_of_links(40, 30.0, 1.0, seed) < 0.5);
    CHECK(ratio_of_links(400, 1.0, 30.0, seed) == 1.0);  // so many need no prior
  }
}
