// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Fits that leave out a fold, from sums in which the columns that are always in are eliminated, against dense ones.

#include <memory>
#include <random>
#include <vector>

#include <doctest/doctest.h>
#include <Eigen/Dense>

#include "dynamics/search.hpp"
#include "math/batch.hpp"

using namespace truing;
using namespace truing::dynamics;

namespace {

constexpr int kFolds = 3, kColumns = 7;
const std::vector<int> kNuisance = {0, 1, 4};

/// Rows of two joints that share some columns, by joint and fold.
struct Rows {
  std::vector<std::vector<int>> columns = {{0, 1, 2, 3, 5}, {1, 3, 4, 6}};
  std::vector<std::vector<Eigen::MatrixXd>> x{2};
  std::vector<std::vector<Eigen::VectorXd>> y{2};

  Rows() {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal(0.0, 1.0);
    for (std::size_t j = 0; j < 2; ++j) {
      for (int f = 0; f < kFolds; ++f) {
        x[j].push_back(Eigen::MatrixXd::Zero(30, kColumns));
        for (const int c : columns[j])
          for (double& value : x[j].back().col(c)) value = normal(random);
        y[j].push_back(Eigen::VectorXd::Zero(30));
        for (double& value : y[j].back()) value = normal(random);
        y[j].back() += x[j].back() * Eigen::VectorXd::LinSpaced(kColumns, -1.0, 2.0);
      }
    }
  }

  TorqueGrams grams() const {
    auto out = std::make_shared<std::vector<JointGrams>>();
    for (std::size_t j = 0; j < 2; ++j) {
      out->emplace_back(columns[j], kColumns, 0);
      for (std::size_t f = 0; f < kFolds; ++f) {
        const Eigen::MatrixXd mine = x[j][f](Eigen::all, columns[j]);
        out->back().folds.push_back({mine.transpose() * mine, mine.transpose() * y[j][f], y[j][f].squaredNorm(), 30.0});
      }
    }
    return out;
  }
};

}  // namespace

TEST_CASE("a fold is judged as by a dense fit to the others") {
  const Rows rows;
  const TorqueGrams grams = rows.grams();
  std::vector<Noise> noise(2);
  noise[0].sigma = 0.5;
  noise[1].design_effect = 2.0;
  Sums sums;
  for (std::size_t f = 0; f < kFolds; ++f) sums.folds.emplace_back(grams, f, noise);
  sums.all = sum_of_folds(*grams, noise, kColumns);
  sums.precision = Eigen::VectorXd::Zero(kColumns);
  const Eigen::VectorXd flat = Eigen::VectorXd::Constant(3, 1e-3);
  for (std::size_t held = 0; held < kFolds; ++held) {
    FoldFit fit(sums, held, kNuisance, flat);
    for (const std::vector<int>& chosen : std::vector<std::vector<int>>{{}, {6}, {2, 3}, {5, 2, 6}}) {
      CAPTURE(held);
      CAPTURE(chosen.size());
      Evidence::State state;
      state.columns = kNuisance;
      state.columns.insert(state.columns.end(), chosen.begin(), chosen.end());
      state.precision = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(state.columns.size()), 0.2);
      state.precision.head(3) = flat;
      Eigen::MatrixXd normal = state.precision.asDiagonal();
      Eigen::VectorXd right = Eigen::VectorXd::Zero(normal.rows());
      const double weights[] = {1.0 / 0.25, 0.5};
      for (std::size_t f = 0; f < kFolds; ++f) {
        for (std::size_t j = 0; j < 2 && f != held; ++j) {
          const Eigen::MatrixXd x = rows.x[j][f](Eigen::all, state.columns);
          normal += weights[j] * x.transpose() * x;
          right += weights[j] * x.transpose() * rows.y[j][f];
        }
      }
      const Eigen::VectorXd solution = normal.ldlt().solve(right);
      double squares = 0.0;
      for (std::size_t j = 0; j < 2; ++j)
        squares += weights[j] * (rows.y[j][held] - rows.x[j][held](Eigen::all, state.columns) * solution).squaredNorm();
      CHECK(fit.squares(state) == doctest::Approx(squares).scale(0).epsilon(1e-11));
    }
  }
}

namespace {

/// One effect in two forms, whose values must be positive, at one joint. The torque is that of the first form, and of
/// what only the second one, less than nothing of it, makes.
struct TwoForms {
  TorqueDesign design;
  Sums sums;

  explicit TwoForms(double of_second_alone) {
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal(0.0, 1.0);
    auto grams = std::make_shared<std::vector<JointGrams>>();
    grams->emplace_back(std::vector<int>{0, 1}, 2, 0);
    for (int f = 0; f < 4; ++f) {
      Eigen::MatrixXd x(40, 2);
      Eigen::VectorXd y(40);
      for (Eigen::Index row = 0; row < 40; ++row) {
        const double first = normal(random), alone = normal(random);
        x.row(row) << first, -first + alone;
        y[row] = first - of_second_alone * alone + normal(random);
      }
      grams->back().folds.push_back({x.transpose() * x, x.transpose() * y, y.squaredNorm(), 40.0});
    }
    for (int form = 0; form < 2; ++form) {
      TorqueTerm term;
      term.joints = {0};
      term.least = 0.0;
      design.terms.push_back(term);
      TorqueGroup group;
      group.effect = "law";
      group.joints = {"J1"};
      group.joint = 0;
      group.forms = 2;
      group.columns = {form};
      design.groups.push_back(group);
    }
    const std::vector<Noise> noise(1);
    for (std::size_t f = 0; f < 4; ++f) sums.folds.emplace_back(grams, f, noise);
    sums.all = sum_of_folds(*grams, noise, 2);
    sums.precision = Eigen::VectorXd::Zero(2);
  }

  std::vector<int> found() const { return dynamics::Search(design, sums, {}).run({}, {}, false).groups; }
};

}  // namespace

TEST_CASE("a form that no machine has takes no place where one that machines have explains as much") {
  const TwoForms alike(0.5);
  const dynamics::Search search(alike.design, alike.sums, {});
  const std::vector<Evidence::Gain> gains = search.gains({});
  REQUIRE(gains[1].score > gains[0].score);  // with less than nothing of it
  REQUIRE(gains[1].score < gains[0].score + SearchLimits{}.threshold);
  CHECK(alike.found() == std::vector<int>{0});
}

TEST_CASE("what a form that no machine has explains far better is something else") {
  CHECK(TwoForms(1.5).found().empty());
}

TEST_CASE("choices that were looked at side by side are as those that were looked at one by one") {
  const TwoForms some(0.5);
  const std::vector<Choice> choices = {{}, {{0}, {1.0}}, {{1}, {1.0}}, {{0, 1}, {1.0, 0.1}}, {{0}, {1.0}}};
  const dynamics::Search alone(some.design, some.sums, {}, 1);
  const auto check_as_alone = [&](const dynamics::Search& together) {
    for (const Choice& choice : choices) {
      CAPTURE(choice.groups.size());
      CHECK(together.squares_of_folds(choice) == alone.squares_of_folds(choice));
      CHECK(together.state(choice).score == alone.state(choice).score);
    }
  };
  for (const int threads : {1, 2}) {
    const dynamics::Search together(some.design, some.sums, {}, threads);
    together.look_ahead(choices, dynamics::Search::Ahead::squares);
    check_as_alone(together);
  }
  // Threads that ask for what nobody has looked at.
  const dynamics::Search unseen(some.design, some.sums, {}, 2);
  truing::math::for_each_on_threads(
      choices.size(), 2, {}, [&](std::size_t k) { unseen.squares_of_folds(choices[k]); }, 1);
  check_as_alone(unseen);
}
