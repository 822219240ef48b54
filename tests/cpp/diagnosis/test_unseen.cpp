// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// How sure held-out poses are that errors fall.

#include <doctest/doctest.h>

#include <numeric>

#include "diagnosis/diagnosis.hpp"
#include "math/random.hpp"

using truing::Diagnosis;
using truing::FoundEffect;
using truing::HeldOutFall;
using truing::Verdict;
using truing::diagnosis::fall_of;
using truing::diagnosis::kConfirmed;
using truing::diagnosis::kContradicted;
using truing::diagnosis::sentence_of;

namespace {

/// Every row a pose of its own, all held out.
HeldOutFall fall_of_poses(const std::vector<double>& before, const std::vector<double>& after) {
  std::vector<std::int32_t> poses(before.size());
  std::iota(poses.begin(), poses.end(), 0);
  return fall_of(before, after, std::vector<std::int8_t>(before.size(), 1), poses);
}

bool is_sure(const HeldOutFall& fall) { return fall.probability < kContradicted || fall.probability > kConfirmed; }

}  // namespace

TEST_CASE("five poses whose errors scatter neither confirm nor contradict what was found") {
  const HeldOutFall fall = fall_of_poses({1e-3, 1e-3, 1e-3, 1e-3, 1e-3}, {0.5e-3, 0.4e-3, 0.7e-3, 0.9e-3, 3.1e-3});
  CHECK(fall.poses == 5);
  CHECK(fall.mean == doctest::Approx(-0.12e-3));  // and its rms rises by half
  CHECK(!is_sure(fall));
  CHECK(fall_of_poses({1e-3, 1.1e-3, 1.2e-3, 1e-3}, {0.5e-3, 0.7e-3, 0.6e-3, 0.6e-3}).probability > kConfirmed);
  CHECK(fall_of_poses({1e-3, 1.1e-3, 1.2e-3, 1e-3}, {1.5e-3, 1.7e-3, 1.6e-3, 1.6e-3}).probability < kContradicted);
  CHECK(fall_of_poses({1e-3}, {2e-3}).probability == 0.5);
  CHECK(fall_of_poses({1e-3, 2e-3}, {1e-3, 2e-3}).probability == 0.5);
}

TEST_CASE("rows of one held-out pose count as one, and rows that were learned from do not count") {
  const HeldOutFall fall = fall_of({1e-3, 1e-3, 2e-3, 9.0}, {0.0, 0.0, 1e-3, 0.0}, {1, 1, 1, 0}, {0, 0, 1, 2});
  CHECK(fall.poses == 2);
  CHECK(fall.mean == doctest::Approx(1e-3));
}

namespace {

/// Two candidates of one column each, on folds of 20 rows: the first makes y but for noise, the second is chance.
truing::diagnosis::Work two_candidates(double noise) {
  using truing::diagnosis::Work;
  Work work;
  work.design.x = Eigen::MatrixXd::Zero(120, 3);
  work.design.y = Eigen::VectorXd::Zero(120);
  work.design.weight = Eigen::VectorXd::Ones(120);
  work.design.prior = Eigen::VectorXd::Ones(3);
  work.design.folds = 6;
  work.design.nuisance = {0};
  truing::math::Random random(5);
  for (Eigen::Index i = 0; i < 120; ++i) {
    work.design.x.row(i) << 1.0, random.normal(), random.normal();
    work.design.y[i] = 0.3 + work.design.x(i, 1) + noise * random.normal();
    work.design.fold.push_back(static_cast<std::int32_t>(i % 6));
  }
  for (const int column : {1, 2}) {
    truing::estimation::ColumnGroup group;
    group.columns = {column};
    work.design.candidates.groups.push_back(group);
  }
  work.design.candidates.named.resize(2);
  work.grams = truing::diagnosis::make_grams(work.design, 1.0, 1);
  return work;
}

}  // namespace

TEST_CASE("the part of a fit in an average is that which poses it did not see have of it") {
  using truing::diagnosis::stacked_part;
  using truing::estimation::Choice;
  const truing::diagnosis::Work work = two_candidates(0.5);
  const Choice first = {{0}, {1.0}}, held = {{0}, {0.05}}, nothing = {}, both = {{0, 1}, {1.0, 1.0}};
  const auto part = [&](const Choice& one, const Choice& other) { return stacked_part(work, {{one}, {1.0}}, other); };
  CHECK(part(first, nothing) > 0.95);
  CHECK(part(nothing, first) < 0.05);
  // Where both predict the same, whatever rounding leaves between them.
  for (const double noise : {0.1, 0.3, 0.5, 1.0}) {
    const truing::diagnosis::Work other = two_candidates(noise);
    CHECK(stacked_part(other, {{first}, {1.0}}, first) == 1.0);
    CHECK(stacked_part(other, {{{{0, 1}, {1.0, 0.1}}}, {1.0}}, {{1, 0}, {0.1, 1.0}}) == 1.0);
  }
  // A choice and its complement share an average.
  CHECK(part(held, both) > 0.0);
  CHECK(part(held, both) < 1.0);
  CHECK(part(both, held) == doctest::Approx(1.0 - part(held, both)));
  // An average of one fit with itself is that fit.
  CHECK(stacked_part(work, {{first, first}, {0.3, 0.7}}, first) == 1.0);
}

TEST_CASE("a part that poses do not know is that of equal parts of all fits") {
  using truing::diagnosis::stacked_part;
  using truing::estimation::Choice;
  const truing::diagnosis::Work work = two_candidates(0.5);
  // The second column says nothing: with it and without it, folds are predicted alike but for chance.
  const Choice first = {{0}, {1.0}}, both = {{0, 1}, {1.0, 1.0}};
  const double of_two = stacked_part(work, {{first}, {1.0}}, both);
  const double of_three = stacked_part(work, {{first, first}, {0.5, 0.5}}, both);
  CHECK(of_three > of_two);  // two of three, not one of two
  CHECK(of_three - of_two < 1.0 / 6.0);
}

TEST_CASE("the noise of a fit is what its own groups leave, whatever else was found") {
  using truing::diagnosis::evidence_now;
  truing::diagnosis::Work work = two_candidates(0.1);
  work.design.column_names = {"base", "first", "second"};
  work.noise.unit = 2.0;
  const truing::estimation::Evidence::State both = evidence_now(work).evaluate({{0, 1}, {1.0, 1.0}});
  const auto noise = [&](const std::vector<int>& groups) {
    return truing::diagnosis::refit_task(work, {}, {}, both, groups).options.prior_noise;
  };
  CHECK(noise({0, 1}) == doctest::Approx(2.0 * std::sqrt(both.sigma2)));
  CHECK(noise({0}) == doctest::Approx(2.0 * 0.1).epsilon(0.1));
  CHECK(noise({1}) == doctest::Approx(2.0).epsilon(0.2));  // the first column's part of y is noise to it
}

namespace {

/// Links of few rows: most values are seen well and are right, the last six are seen badly and far off. One size of all
/// of them has a low evidence.
truing::diagnosis::Work some_links_far_off(unsigned seed) {
  constexpr Eigen::Index kRows = 30, kRight = 14, kOff = 6, kLinks = kRight + kOff;
  constexpr double kScatter = 0.1;
  truing::diagnosis::Work work;
  work.design.x = Eigen::MatrixXd::Ones(kRows, 1 + kLinks);
  work.design.y = Eigen::VectorXd::Zero(kRows);
  work.design.weight = Eigen::VectorXd::Ones(kRows);
  work.design.prior = Eigen::VectorXd::Ones(1 + kLinks);
  work.design.folds = 12;
  work.design.nuisance = {0};
  truing::math::Random random(seed);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    for (Eigen::Index k = 1; k <= kLinks; ++k) work.design.x(i, k) = (k <= kRight ? 10.0 : 0.3) * random.normal();
    work.design.y[i] = 0.3 + work.design.x.row(i).tail(kOff).sum() + kScatter * random.normal();
    work.design.fold.push_back(static_cast<std::int32_t>(i % 12));
  }
  truing::estimation::ColumnGroup group;
  for (int k = 1; k <= static_cast<int>(kLinks); ++k) group.columns.push_back(k);
  work.design.candidates.groups = {group};
  work.design.candidates.named.resize(1);
  work.design.candidates.named[0].kind = truing::diagnosis::Explanation::Kind::all_geometry;
  work.grams = truing::diagnosis::make_grams(work.design, 1.0, 1);
  return work;
}

}  // namespace

TEST_CASE("links predict few poses by either of the priors that are averaged") {
  using namespace truing::diagnosis;
  int of_evidence = 0, of_any = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Work work = some_links_far_off(seed);
    const truing::estimation::Evidence evidence = evidence_now(work);
    const std::vector<int>& links = work.design.candidates.groups[0].columns;
    const double likeliest = evidence.gain(evidence.evaluate({}), links, 0.0).scale;
    of_evidence += predicts_better(squares_of_folds(work, {{0}, {likeliest}}), squares_of_folds(work, {}), 1.05);
    of_any += links_predict_alone(work);
  }
  CHECK(of_evidence <= 2);
  CHECK(of_any >= 8);
}

TEST_CASE("the sentence says how sure held-out poses are") {
  Diagnosis d;
  d.verdict = Verdict::effects;
  d.gap.rms = 1e-3;
  d.after.rms = 0.8e-3;
  FoundEffect spring;
  spring.effect = "joint_compliance";
  spring.joints = {"J2"};
  d.effects = {spring};
  d.held_out_fall = {5, 0.1e-3, 0.1e-3, 0.8};
  CHECK(sentence_of(d) ==
        "The gap of 1 mm shrinks to 0.8 mm: joint compliance at J2. That other poses gain by it is sure to 80 %: the "
        "error of the 5 poses held out falls by 0.1 mm in the mean, with a standard error of 0.1 mm. Measure more "
        "poses.");
  d.after.rms = 1.2e-3;
  d.held_out_fall = {5, -0.1e-3, 0.1e-3, 0.2};
  CHECK(sentence_of(d).find("Held-out poses neither confirm nor contradict what explains the others: joint "
                            "compliance at J2. That other poses gain by it is sure to 20 %: the error of the 5 poses "
                            "held out rises by 0.1 mm") == 0);
  d.after.rms = 0.8e-3;
  d.held_out_fall = {30, 0.2e-3, 0.02e-3, 0.999};
  CHECK(sentence_of(d) == "The gap of 1 mm shrinks to 0.8 mm: joint compliance at J2.");
}
