// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What the diagnosis rests on: sums of rows, Gaussian evidence and its null distribution, against dense formulas.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Dense>

#include "estimation/evidence.hpp"

using namespace truing::estimation;

namespace {

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  Eigen::MatrixXd out(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index k = 0; k < columns; ++k) out(i, k) = normal(random);
  }
  return out;
}

Gram gram_of(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  return {x.transpose() * x, x.transpose() * y, y.squaredNorm(), static_cast<double>(y.size())};
}

/// Three columns that are always in, then groups of two, one, three, one … columns of the kind that a joint makes.
struct Problem {
  explicit Problem(Eigen::Index rows, unsigned seed) : x(random_matrix(rows, 12, seed)) {
    x.col(7) += 0.8 * x.col(3);  // some look alike
    x.col(9) += 0.9 * x.col(1);
    prior = Eigen::VectorXd::Constant(12, 1.0);
    prior[5] = 10.0;
    int next = 3;
    for (const int size : {2, 1, 3, 1, 2}) {
      ColumnGroup group;
      for (int k = 0; k < size; ++k) group.columns.push_back(next++);
      group.cost = std::log(5.0);
      groups.push_back(group);
    }
  }

  Eigen::VectorXd noise(double sigma, unsigned seed) const { return sigma * random_matrix(x.rows(), 1, seed); }

  Eigen::MatrixXd x;
  std::vector<int> nuisance = {0, 1, 2};
  std::vector<ColumnGroup> groups;
  Eigen::VectorXd prior;
};

/// log p(y) with the nuisance integrated over a flat prior and the noise at its most probable size, by n x n matrices:
/// y ~ N(0, sigma^2 C), C = I + X (sigma^2 P)^-1 X^T. `ridge` is sigma^2 P.
double dense_evidence(const Eigen::MatrixXd& nuisance, const Eigen::MatrixXd& x, const Eigen::VectorXd& ridge,
                      const Eigen::VectorXd& y) {
  const Eigen::Index n = y.size();
  const Eigen::MatrixXd c = Eigen::MatrixXd::Identity(n, n) + x * ridge.cwiseInverse().asDiagonal() * x.transpose();
  const Eigen::LLT<Eigen::MatrixXd> factor(c);
  const Eigen::MatrixXd cn = factor.solve(nuisance);
  const Eigen::MatrixXd inside = nuisance.transpose() * cn;
  const Eigen::VectorXd cy = factor.solve(y);
  const double rss = y.dot(cy) - (nuisance.transpose() * cy).dot(inside.llt().solve(nuisance.transpose() * cy));
  const auto freedom = static_cast<double>(n - nuisance.cols());
  const double log_c = 2.0 * Eigen::MatrixXd(factor.matrixL()).diagonal().array().log().sum();
  return -0.5 * freedom * std::log(rss) - 0.5 * log_c - 0.5 * std::log(inside.determinant());
}

}  // namespace

TEST_CASE("sums of rows equal the dense product, whatever the number of columns and rows") {
  for (const int columns : {1, 7, 38}) {
    for (const int rows : {0, 1, 8, 255, 256, 257, 700}) {
      CAPTURE(columns);
      CAPTURE(rows);
      const Eigen::MatrixXd x = random_matrix(rows, columns, 5);
      const Eigen::VectorXd y = random_matrix(rows, 1, 6);
      GramSum sum(columns);
      for (Eigen::Index i = 0; i < rows; ++i) {
        double* out = sum.row();
        for (Eigen::Index k = 0; k < columns; ++k) out[k] = x(i, k);
        out[columns] = y[i];
        sum.push();
      }
      const Gram got = sum.finish(), expected = gram_of(x, y);
      CHECK((got.xx - expected.xx).cwiseAbs().maxCoeff() <= 1e-13 * (1.0 + rows));
      CHECK((got.xy - expected.xy).cwiseAbs().maxCoeff() <= 1e-13 * (1.0 + rows));
      CHECK(std::abs(got.yy - expected.yy) <= 1e-13 * expected.yy);
      CHECK(got.n == rows);
      CHECK(got.xx == got.xx.transpose());
    }
  }
}

TEST_CASE("the inverse of a factored matrix, and its diagonal, on one thread and on two") {
  for (const Eigen::Index n : {1, 63, 64, 130}) {
    CAPTURE(n);
    const Eigen::MatrixXd x = random_matrix(n + 20, n, 7);
    const Eigen::MatrixXd a = x.transpose() * x;
    const Eigen::LLT<Eigen::MatrixXd> factor(a);
    const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(n, n)), upper = upper_inverse(factor);
    const Eigen::VectorXd diagonal = diagonal_of_inverse(factor);
    const double scale = inverse.cwiseAbs().maxCoeff();
    CHECK((upper - inverse).triangularView<Eigen::Upper>().toDenseMatrix().cwiseAbs().maxCoeff() <= 1e-11 * scale);
    CHECK((diagonal - inverse.diagonal()).cwiseAbs().maxCoeff() <= 1e-11 * scale);
    CHECK(diagonal_of_inverse(factor, 2) == diagonal);
    CHECK(upper_inverse(factor, 2).triangularView<Eigen::Upper>().toDenseMatrix() ==
          upper.triangularView<Eigen::Upper>().toDenseMatrix());
    CHECK(trace_of_product(upper, a) == doctest::Approx(static_cast<double>(n)).epsilon(1e-10));
  }
}

TEST_CASE("Gram matrices add up, and leave out columns") {
  const Eigen::MatrixXd x = random_matrix(40, 5, 1);
  const Eigen::VectorXd y = random_matrix(40, 1, 2);
  Gram sum;
  sum.add(gram_of(x.topRows(15), y.head(15)));
  sum.add(gram_of(x.bottomRows(25), y.tail(25)), 0.5);
  CHECK(sum.n == 27.5);
  CHECK((sum.xx - x.topRows(15).transpose() * x.topRows(15) - 0.5 * x.bottomRows(25).transpose() * x.bottomRows(25))
            .cwiseAbs()
            .maxCoeff() < 1e-13);
  const Gram some = sum.of({4, 1});
  CHECK(some.xx(0, 1) == sum.xx(4, 1));
  CHECK(some.xy[1] == sum.xy[1]);
  CHECK(some.yy == sum.yy);
}

TEST_CASE("the evidence of a choice is that of the dense formula") {
  const Problem problem(60, 11);
  const Eigen::VectorXd y =
      2.0 * problem.x.col(0) + 0.3 * problem.x.col(4) + 0.05 * problem.x.col(6) + problem.noise(0.1, 12);
  const Gram gram = gram_of(problem.x, y);
  const Evidence evidence(gram, problem.groups, problem.nuisance, problem.prior);
  const Eigen::MatrixXd flat = problem.x.leftCols(3);
  const double nothing = evidence.evaluate({}).evidence;
  const double dense_nothing = dense_evidence(flat, Eigen::MatrixXd(60, 0), Eigen::VectorXd(0), y);
  const std::vector<Choice> choices = {
      {{0}, {1.0}}, {{0}, {0.1}}, {{1, 2}, {0.1, 0.01}}, {{4, 0, 3}, {1.0, 0.1, 0.001}}};
  for (const Choice& choice : choices) {
    CAPTURE(choice.groups[0]);
    const Evidence::State state = evidence.evaluate(choice);
    const auto columns = static_cast<Eigen::Index>(state.columns.size()) - 3;
    Eigen::MatrixXd x(60, columns);
    for (Eigen::Index k = 0; k < columns; ++k) {
      x.col(k) = problem.x.col(state.columns[static_cast<std::size_t>(k + 3)]);
      const double own =
          state.precision[k + 3] * std::pow(problem.prior[state.columns[static_cast<std::size_t>(k + 3)]], 2.0);
      double scale = 0.0;
      for (std::size_t g = 0; g < choice.groups.size(); ++g) {
        const std::vector<int>& of = problem.groups[static_cast<std::size_t>(choice.groups[g])].columns;
        if (std::find(of.begin(), of.end(), state.columns[static_cast<std::size_t>(k + 3)]) != of.end())
          scale = choice.scales[g];
      }
      CHECK(own * scale * scale == doctest::Approx(state.sigma2).scale(0).epsilon(5e-3));  // the noise has settled
    }
    const double dense = dense_evidence(flat, x, state.precision.tail(columns), y);
    CHECK(state.evidence - nothing == doctest::Approx(dense - dense_nothing).scale(0).epsilon(1e-6));
    CHECK(state.score == doctest::Approx(state.evidence - static_cast<double>(choice.groups.size()) * std::log(5.0))
                             .scale(0)
                             .epsilon(1e-12));
    // The solution is that of ridge regression.
    Eigen::MatrixXd all(60, 3 + columns);
    all << flat, x;
    Eigen::MatrixXd normal = all.transpose() * all;
    normal.diagonal().tail(columns) += state.precision.tail(columns);
    CHECK((state.solution - normal.ldlt().solve(all.transpose() * y)).cwiseAbs().maxCoeff() < 1e-7);
  }
}

TEST_CASE("what a group wins is the difference of two evaluations") {
  const Problem problem(90, 21);
  const Eigen::VectorXd y =
      problem.x.col(2) + 0.2 * problem.x.col(3) - 0.1 * problem.x.col(10) + problem.noise(0.1, 22);
  const Gram gram = gram_of(problem.x, y);
  const Evidence evidence(gram, problem.groups, problem.nuisance, problem.prior);
  const std::vector<Choice> starts = {{}, {{0}, {0.1}}, {{0, 4}, {0.1, 0.1}}};
  for (const Choice& start : starts) {
    const Evidence::State state = evidence.evaluate(start);
    for (const Evidence::Gain& gain : evidence.gains(state)) {
      if (std::find(start.groups.begin(), start.groups.end(), gain.group) != start.groups.end()) continue;
      CAPTURE(start.groups.size());
      CAPTURE(gain.group);
      const auto difference = [&](double scale) {
        Choice grown = start;
        grown.groups.push_back(gain.group);
        grown.scales.push_back(scale);
        return evidence.evaluate(grown).evidence - state.evidence;
      };
      // Exact but for the noise that has not quite settled; with groups in, their shrinkage stays that of the larger
      // noise.
      const double tolerance =
          start.groups.empty() ? 0.02 + 0.01 * std::abs(gain.evidence) : 0.05 + 0.06 * std::abs(gain.evidence);
      CHECK(std::abs(gain.evidence - difference(gain.scale)) < tolerance);
      CHECK(gain.score == doctest::Approx(gain.evidence - std::log(5.0)).scale(0).epsilon(1e-12));
      CHECK(gain.rank == static_cast<int>(problem.groups[static_cast<std::size_t>(gain.group)].columns.size()));
      // No other scale of its prior would have won more.
      for (const double scale : {1.0, 0.1, 0.01, 0.001}) CHECK(difference(scale) < gain.evidence + 0.1 + tolerance);
    }
  }
}

TEST_CASE("the search finds the groups that are there, and none in noise") {
  int none = 0, exact = 0;
  for (unsigned seed = 30; seed < 50; ++seed) {
    const Problem problem(150, seed);
    const Eigen::VectorXd y = problem.x.col(1) + problem.noise(0.1, seed + 100);
    const Gram noise = gram_of(problem.x, y),
               signal = gram_of(problem.x, y + 0.2 * problem.x.col(5) + 0.1 * problem.x.col(8));
    none += Evidence(noise, problem.groups, problem.nuisance, problem.prior).search({}).choice.groups.empty() ? 1 : 0;
    std::vector<int> found = Evidence(signal, problem.groups, problem.nuisance, problem.prior).search({}).choice.groups;
    std::sort(found.begin(), found.end());
    exact += found == std::vector<int>{1, 2} ? 1 : 0;
  }
  CHECK(none >= 19);
  CHECK(exact >= 19);
}

/// A constant, two plain columns, and one variable's hats on 10 to 17 knots, a group each.
struct Hats {
  static constexpr Eigen::Index kForms = 8;
  Eigen::MatrixXd x;
  std::vector<ColumnGroup> groups = {{{1}, 2.0}, {{2}, 2.0}};

  explicit Hats(Eigen::Index rows) : x(Eigen::MatrixXd::Ones(rows, 3)) {
    for (Eigen::Index form = 0; form < kForms; ++form) {
      const Eigen::Index knots = 10 + form, first = x.cols();
      x.conservativeResize(Eigen::NoChange, first + knots);
      groups.push_back({{}, 2.0});
      for (Eigen::Index k = 0; k < knots; ++k) groups.back().columns.push_back(static_cast<int>(first + k));
      for (Eigen::Index i = 0; i < rows; ++i) {
        const double at = static_cast<double>(i * (knots - 1)) / static_cast<double>(rows);
        for (Eigen::Index k = 0; k < knots; ++k)
          x(i, first + k) = std::max(0.0, 1.0 - std::abs(at - static_cast<double>(k)));
      }
    }
  }
};

TEST_CASE("a flexible group, of which there are several, does not stand for two plain ones") {
  constexpr Eigen::Index kRows = 300;
  Hats hats(kRows);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double at = static_cast<double>(i) / kRows;
    hats.x(i, 1) = at;
    hats.x(i, 2) = std::sin(6.0 * at);
  }
  for (const unsigned seed : {41u, 42u, 43u}) {
    CAPTURE(seed);
    const Eigen::VectorXd y = hats.x.col(1) + 0.1 * hats.x.col(2) + 0.05 * random_matrix(kRows, 1, seed);
    const Gram gram = gram_of(hats.x, y);
    const Evidence evidence(gram, hats.groups, {0}, Eigen::VectorXd::Ones(hats.x.cols()));
    const auto gains = evidence.gains(evidence.evaluate({}));
    for (std::size_t g = 2; g < hats.groups.size(); ++g) CHECK(gains[g].score > gains[0].score);  // they come first
    std::vector<int> found = evidence.search({}).choice.groups;
    std::sort(found.begin(), found.end());
    CHECK(found == std::vector<int>{0, 1});
  }
}

TEST_CASE("two groups in the place of one let nothing in that is too small to be added") {
  constexpr Eigen::Index kRows = 4000;
  Hats hats(kRows);
  hats.x.col(1) = random_matrix(kRows, 1, 51);
  hats.x.col(2) = random_matrix(kRows, 1, 52);
  Eigen::VectorXd wave(kRows);
  for (Eigen::Index i = 0; i < kRows; ++i) wave[i] = 0.2 * std::sin(9.0 * static_cast<double>(i) / kRows);
  for (const unsigned seed : {53u, 54u, 55u}) {
    CAPTURE(seed);
    const Eigen::VectorXd y = wave + 0.01 * (hats.x.col(1) + hats.x.col(2)) + 0.1 * random_matrix(kRows, 1, seed);
    const Gram gram = gram_of(hats.x, y);
    const Evidence evidence(gram, hats.groups, {0}, Eigen::VectorXd::Ones(hats.x.cols()));
    const Evidence::State found = evidence.search({});
    REQUIRE(found.choice.groups.size() == 1);
    const auto gains = evidence.gains(found);
    for (const std::size_t small : {0u, 1u}) {
      CHECK(gains[small].score > SearchOptions{}.threshold);
      CHECK(gains[small].share < SearchOptions{}.least_share);
    }
  }
}

TEST_CASE("a law's correction enters only with its law, a shadow never") {
  Problem problem(100, 61);
  problem.groups[0].law_at = 7;                                      // the law
  problem.groups[1].corrects_law_at = problem.groups[1].law_at = 7;  // its correction
  problem.groups[3].shadow = true;
  const Eigen::VectorXd noise = problem.noise(0.1, 62);
  const auto found = [&](const Eigen::VectorXd& y) {
    const Gram gram = gram_of(problem.x, y);
    std::vector<int> groups = Evidence(gram, problem.groups, problem.nuisance, problem.prior).search({}).choice.groups;
    std::sort(groups.begin(), groups.end());
    return groups;
  };
  CHECK(found(noise + problem.x.col(5)) == std::vector<int>{});
  CHECK(found(noise + problem.x.col(3) + problem.x.col(5)) == std::vector<int>{0, 1});
  CHECK(found(noise + problem.x.col(9)) == std::vector<int>{});
}

TEST_CASE("one draw of noise in a hundred scores above the 99 % quantile of the null, however few values there are") {
  for (const int rows : {120, 24, 10}) {
    CAPTURE(rows);
    const Problem problem(rows, 71);
    const Eigen::VectorXd first = problem.noise(0.1, 72);
    const Gram gram = gram_of(problem.x, first);
    const Evidence evidence(gram, problem.groups, problem.nuisance, problem.prior);
    std::vector<double> null = evidence.null_scores(evidence.evaluate({}), 2000, 73, 1);
    CHECK(null == evidence.null_scores(evidence.evaluate({}), 2000, 73, 2));
    std::sort(null.begin(), null.end());
    const double bound = null[1980];
    int above = 0;
    constexpr int kDraws = 2000;
    for (int draw = 0; draw < kDraws; ++draw) {
      const Gram fresh = gram_of(problem.x, problem.noise(0.1, 1000 + static_cast<unsigned>(draw)));
      const Evidence other(fresh, problem.groups, problem.nuisance, problem.prior);
      double largest = -1e300;
      for (const Evidence::Gain& gain : other.gains(other.evaluate({}))) largest = std::max(largest, gain.score);
      above += largest > bound ? 1 : 0;
    }
    CHECK(above > kDraws / 250);  // 0.4 %
    CHECK(above < kDraws / 50);   // 2 %
  }
}

TEST_CASE("held-out squares are those of the prediction") {
  const Eigen::MatrixXd x = random_matrix(30, 6, 81);
  const Eigen::VectorXd y = random_matrix(30, 1, 82);
  const Eigen::VectorXd solution = random_matrix(2, 1, 83);
  Eigen::MatrixXd two(30, 2);
  two << x.col(4), x.col(1);
  CHECK(held_out_squares(gram_of(x, y), {4, 1}, solution) ==
        doctest::Approx((y - two * solution).squaredNorm()).scale(0).epsilon(1e-12));
}

TEST_CASE("one group can do what another does, or a part of it") {
  Problem problem(80, 91);
  problem.x.col(8) = 0.5 * problem.x.col(5) + 2.0 * problem.x.col(0);  // the same beyond the nuisance
  const Gram gram = gram_of(problem.x, problem.noise(1.0, 92));
  const Evidence evidence(gram, problem.groups, problem.nuisance, problem.prior);
  const Evidence::State state = evidence.evaluate({});
  CHECK(evidence.explained(state, {5}, Eigen::VectorXd::Ones(1), {8}) == doctest::Approx(1.0).scale(0).epsilon(1e-6));
  CHECK(evidence.explained(state, {5}, Eigen::VectorXd::Ones(1), {4}) < 0.2);
  const Eigen::MatrixXd n = problem.x.leftCols(3);
  const Eigen::VectorXd left = problem.x.col(5) - n * n.colPivHouseholderQr().solve(problem.x.col(5));
  CHECK(evidence.visible(state, 5) == doctest::Approx(left.squaredNorm()).scale(0).epsilon(1e-6));
}

TEST_CASE("what is always in may be eliminated once: every answer stays") {
  const Problem problem(90, 101);
  const Eigen::VectorXd y =
      problem.x.col(2) + 0.2 * problem.x.col(3) - 0.1 * problem.x.col(10) + problem.noise(0.1, 102);
  const Gram gram = gram_of(problem.x, y);
  const Evidence whole(gram, problem.groups, problem.nuisance, problem.prior);
  const Evidence rest(gram, problem.groups, problem.nuisance, problem.prior, Nuisance::eliminated);
  const auto close = [](double a, double b) { return a == doctest::Approx(b).epsilon(1e-9); };
  for (const Choice& choice : std::vector<Choice>{{}, {{0}, {0.1}}, {{4, 0}, {0.1, 1.0}}}) {
    CAPTURE(choice.groups.size());
    const Evidence::State a = whole.evaluate(choice), b = rest.evaluate(choice);
    CHECK(a.columns == b.columns);
    CHECK((a.solution - b.solution).cwiseAbs().maxCoeff() < 1e-9);
    CHECK((a.precision - b.precision).cwiseAbs().maxCoeff() < 1e-9 * a.precision.maxCoeff());
    CHECK(close(a.rss, b.rss));
    CHECK(close(a.sigma2, b.sigma2));
    CHECK(close(a.score, b.score));
    const std::vector<Evidence::Gain> gains = whole.gains(a), others = rest.gains(b);
    for (std::size_t g = 0; g < gains.size(); ++g) {
      CHECK(close(gains[g].score, others[g].score));
      CHECK(gains[g].rank == others[g].rank);
      CHECK(gains[g].scale == others[g].scale);
      CHECK(close(whole.gain(a, problem.groups[g].columns, 1.0).score,
                  rest.gain(b, problem.groups[g].columns, 1.0).score));
    }
    CHECK(close(whole.visible(a, 7), rest.visible(b, 7)));
    CHECK(close(whole.explained(a, {5}, Eigen::VectorXd::Ones(1), {7, 8}),
                rest.explained(b, {5}, Eigen::VectorXd::Ones(1), {7, 8})));
    CHECK(whole.null_scores(a, 5, 103, 1).back() ==
          doctest::Approx(rest.null_scores(b, 5, 103, 1).back()).epsilon(1e-9));
  }
}

TEST_CASE("what other groups make room for is won at the noise that it leaves, not at the noise without it") {
  const Eigen::Index rows = 200;
  Eigen::MatrixXd x(rows, 9);
  x.leftCols(8) = random_matrix(rows, 8, 71);
  x.col(8) = x.col(7) + 0.03 * x.middleCols(1, 6).rowwise().sum();  // the same motion, if the six give way
  const Eigen::VectorXd y = 3.0 * x.col(7) + 0.1 * random_matrix(rows, 1, 72);
  const std::vector<ColumnGroup> groups = {{{1, 2, 3, 4, 5, 6}}, {{7}}, {{8}}};
  const Gram gram = gram_of(x, y);
  const Evidence evidence(gram, groups, {0}, Eigen::VectorXd::Ones(9));
  const Evidence::State found = evidence.evaluate({{0, 1}, {0.1, 1.0}}),
                        other = evidence.evaluate({{0, 2}, {0.1, 1.0}}), without = evidence.evaluate({{0}, {0.1}}),
                        at_noise = evidence.evaluate_at(found.sigma2, without.choice);
  const auto score_with = [&](const Evidence::State& rest, int group) {
    return rest.score + evidence.gain(rest, groups[static_cast<std::size_t>(group)].columns, 0.0).score;
  };
  CHECK(at_noise.choice.groups == without.choice.groups);
  CHECK(score_with(at_noise, 1) == doctest::Approx(found.score).scale(1.0).epsilon(0.05));
  CHECK(score_with(at_noise, 2) == doctest::Approx(other.score).scale(1.0).epsilon(0.05));
  CHECK(found.score - other.score < 5.0);
  CHECK(score_with(without, 2) < other.score - 20.0);
}
