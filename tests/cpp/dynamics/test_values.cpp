// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numeric>
#include <vector>

#include <doctest/doctest.h>

#include "dynamics/columns.hpp"
#include "dynamics/problem.hpp"
#include "support/swung_arm.hpp"

using namespace truing;
using namespace truing::dynamics;
using swung::level_arm;
using swung::measured;
using swung::swing;
using swung::with_friction;

namespace {

std::vector<Recording> recorded() {
  std::vector<Recording> out;
  for (int k = 0; k < 5; ++k) {
    out.push_back(measured(with_friction(level_arm()), swing(k, 8.0), static_cast<std::uint64_t>(k), {}));
    out.back().test = k > 2;
  }
  return out;
}

TorqueDesign whole(const Problem& problem) { return design_of(problem.robot, problem.range, {}, {}, true); }

}  // namespace

TEST_CASE("values with each joint's own columns eliminated are those of one fit of all columns") {
  const std::vector<Recording> recordings = recorded();
  Problem problem(level_arm(), recordings, {});
  const TorqueDesign design = whole(problem);
  const TorqueGrams grams =
      sum_grams(DesignColumns(problem.tiles, design), problem.nominal, problem.nominal, problem.train);
  std::vector<Noise> noise(problem.robot.driven_count());
  for (Noise& one : noise) one.sigma = 0.1;

  const auto p = design.terms.size();
  std::vector<int> every(p);
  std::iota(every.begin(), every.end(), 0);
  const Fit fit = fit_of(sums_of(grams, noise, design, std::vector<bool>(p, true)), every);
  const Eigen::VectorXd values = values_of(grams, noise, design, std::vector<bool>(p, true), 2);
  // Columns may be nearly alike: what they do together is what is known.
  const Gram all = sum_of_folds(*grams, noise, p);
  const Eigen::VectorXd apart = values - fit.values;
  CHECK(apart.dot(all.xx * apart) < 1e-8 * fit.values.dot(all.xx * fit.values));

  std::vector<bool> some(p, true);
  some[3] = false;
  CHECK(values_of(grams, noise, design, some, 1)[3] == 0.0);
  CHECK(values_of(grams, noise, design, some, 1) == values_of(grams, noise, design, some, 2));
}

TEST_CASE("columns kept while friction turns otherwise are those made anew") {
  const std::vector<Recording> recordings = recorded();
  Problem problem(level_arm(), recordings, {});
  const TorqueDesign design = whole(problem);
  const DesignColumns kept(problem.tiles, design);
  DesignColumns turned(problem.tiles, design);
  const auto sums = [&](const DesignColumns& columns, const FrictionTurn& turn) {
    const std::vector<FrictionTurn> turns(problem.robot.driven_count(), turn);
    return sum_grams(columns, problem.nominal, problem.nominal.turning(turns), problem.train);
  };
  const FrictionTurn slow{0.01, 0.0}, by_travel{0.01, 1e-4};
  sums(kept, slow);
  sums(turned, slow);
  turned.turned();
  const TorqueGrams again = sums(turned, by_travel), anew = sums(DesignColumns(problem.tiles, design), by_travel);
  const TorqueGrams before = sums(kept, slow);
  for (std::size_t j = 0; j < anew->size(); ++j) {
    CHECK((*again)[j].folds[0].xx == (*anew)[j].folds[0].xx);
    CHECK((*before)[j].folds[0].xx != (*anew)[j].folds[0].xx);
  }
}

namespace {

/// The model with a torque that it did not have.
TorqueModel with_more(const TorqueModel& model, const TorqueDesign& design) {
  for (const TorqueTerm& term : design.terms) {
    if (term.link_parameter < 0 && !term.needs_torque) return model.with({{term, 0.3}});
  }
  return model;
}

void check_same(const TorqueGrams& some, const TorqueGrams& others) {
  for (std::size_t j = 0; j < others->size(); ++j) {
    for (std::size_t f = 0; f < (*others)[j].folds.size(); ++f) {
      const Gram &a = (*some)[j].folds[f], &b = (*others)[j].folds[f];
      CHECK(a.xx == b.xx);
      CHECK(a.xy == b.xy);
      CHECK(a.yy == b.yy);
      CHECK(a.n == b.n);
    }
  }
}

}  // namespace

TEST_CASE("sums with what is known from before are those made anew, to the bit") {
  const std::vector<Recording> recordings = recorded();
  Problem problem(level_arm(), recordings, {});
  const TorqueDesign design = whole(problem);
  DesignColumns columns(problem.tiles, design);
  const TorqueGrams before = sum_grams(columns, problem.nominal, problem.nominal, problem.train);
  const TorqueModel more = with_more(problem.nominal, design);
  const TorqueGrams seen = sum_grams(columns, problem.nominal, more, problem.train, {{before}});
  check_same(seen, sum_grams(DesignColumns(problem.tiles, design), problem.nominal, more, problem.train));
  CHECK((*seen)[0].folds[0].xx != (*before)[0].folds[0].xx);

  const TorqueModel turning = more.turning({problem.robot.driven_count(), FrictionTurn{0.01, 1e-4}});
  columns.turned();
  const TorqueGrams turned = sum_grams(columns, problem.nominal, turning, problem.train, {{seen}, true});
  check_same(turned, sum_grams(DesignColumns(problem.tiles, design), problem.nominal, turning, problem.train));
  CHECK((*turned)[0].folds[0].xx != (*seen)[0].folds[0].xx);
}

TEST_CASE("columns that are idle keep the torque that they saw until they are not, and others do not") {
  const std::vector<Recording> recordings = recorded();
  Problem problem(level_arm(), recordings, {});
  const TorqueDesign design = whole(problem);
  const TorqueModel more = with_more(problem.nominal, design);
  DesignColumns columns(problem.tiles, design);
  const TorqueGrams before = sum_grams(columns, problem.nominal, problem.nominal, problem.train);
  const std::vector<int>& of_joint = columns.of_joint(0);
  std::vector<bool> idle(design.terms.size(), false);
  std::vector<Eigen::Index> resting, working;
  for (std::size_t k = 0; k < of_joint.size(); ++k) {
    const auto c = static_cast<std::size_t>(of_joint[k]);
    if (!design.terms[c].needs_torque) continue;
    idle[c] = resting.size() <= working.size();
    (idle[c] ? resting : working).push_back(static_cast<Eigen::Index>(k));
  }
  REQUIRE(!working.empty());
  const auto product = [](const TorqueGrams& grams, const std::vector<Eigen::Index>& at) -> Eigen::MatrixXd {
    return (*grams)[0].folds[0].xx(at, at);
  };
  const TorqueGrams some = sum_grams(columns, problem.nominal, more, problem.train, {{before}, false, idle});
  const TorqueGrams anew = sum_grams(DesignColumns(problem.tiles, design), problem.nominal, more, problem.train);
  CHECK(product(some, resting) == product(before, resting));
  CHECK(product(some, working) == product(anew, working));
  check_same(sum_grams(columns, problem.nominal, more, problem.train, {{some}}), anew);
}

TEST_CASE("what values leave of all rows but turns at the ends is known from sums of moving and of resting rows") {
  const std::vector<Recording> recordings = recorded();
  Problem problem(level_arm(), recordings, {});
  const TorqueDesign all = whole(problem);
  std::vector<int> standard;
  for (std::size_t g = 0; g < all.groups.size(); ++g)
    if (all.groups[g].standard) standard.push_back(static_cast<int>(g));
  const TorqueDesign design = part_of(all, standard);
  const std::vector<TorqueGrams> grams =
      sum_grams(DesignColumns(problem.tiles, design), problem.nominal, problem.nominal, problem.train, {},
                {dynamics::Rows::fitted, dynamics::Rows::resting});
  Fit fit;
  for (std::size_t c = 0; c < design.terms.size(); ++c) fit.columns.push_back(static_cast<int>(c));
  fit.values = Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(design.terms.size()), 0.02, 0.1);
  const TorqueModel model = problem.nominal.with(valued(design, fit));

  const auto joints = static_cast<Eigen::Index>(problem.robot.driven_count());
  std::vector<Eigen::MatrixXd> errors(Tiles::kTogether);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(joints), rows = squares;
  problem.tiles.for_each([&](std::size_t r) { return problem.train.of_recording[r] >= 0; },
                         [&](Tile& tile, std::size_t k) {
                           errors[k] = tile.inside.cwiseProduct(tile.measured - own_torque(model, &tile));
                           errors[k].conservativeResize(Eigen::NoChange, 2 * joints);
                           errors[k].rightCols(joints) = tile.inside;
                         },
                         [&](std::size_t k) {
                           squares += errors[k].leftCols(joints).colwise().squaredNorm().transpose();
                           rows += errors[k].rightCols(joints).colwise().sum().transpose();
                         });
  const std::vector<double> rms = rms_of(grams, by_column(design, fit));
  for (Eigen::Index j = 0; j < joints; ++j)
    CHECK(rms[static_cast<std::size_t>(j)] == doctest::Approx(std::sqrt(squares[j] / rows[j])).epsilon(1e-9));
}

TEST_CASE("sums of some columns are those that all columns have, to the bit") {
  const std::vector<Recording> recordings = recorded();
  Problem problem(level_arm(), recordings, {});
  const TorqueDesign design = whole(problem);
  std::vector<int> some;  // beside what yields the mass matrix is made in other bits: that is always there
  for (std::size_t c = 0; c < design.terms.size(); ++c)
    if (c % 3 == 0 || design.terms[c].needs_yielding) some.push_back(static_cast<int>(c));
  const TorqueModel more = with_more(problem.nominal, design);
  const TorqueGrams all = sum_grams(DesignColumns(problem.tiles, design), problem.nominal, more, problem.test);
  const TorqueGrams few = sum_grams(DesignColumns(problem.tiles, design, some), problem.nominal, more, problem.test);
  const std::vector<Noise> noise(problem.robot.driven_count());
  CHECK((*few)[0].columns.size() < (*all)[0].columns.size());
  const Gram a = FoldGram(few, 0, noise).of(some), b = FoldGram(all, 0, noise).of(some);
  CHECK(a.xx == b.xx);
  CHECK(a.xy == b.xy);
  CHECK(a.xx.trace() > 0.0);
}

TEST_CASE("columns of a joint that rests all through a tile may be left out: sums stay, to the bit") {
  std::vector<Recording> recordings = recorded();
  recordings[1].position.col(1).setConstant(0.3);
  Problem problem(level_arm(), recordings, {});
  const TorqueDesign design = whole(problem);
  const TorqueModel more = with_more(problem.nominal, design);
  DesignColumns made(problem.tiles, design), left_out(problem.tiles, design, Resting::left_out);
  check_same(sum_grams(left_out, problem.nominal, more, problem.train),
             sum_grams(made, problem.nominal, more, problem.train));
  Eigen::Index rows_made = 0, rows_left = 0;
  problem.tiles.for_each(
      [](std::size_t r) { return r == 1; },
      [&](Tile& tile, std::size_t) {
        made.use(&tile, false, [&](DesignColumns::Tables& tables) { rows_made = tables.joints[1].rows(); });
        left_out.use(&tile, false, [&](DesignColumns::Tables& tables) { rows_left = tables.joints[1].rows(); });
      },
      [](std::size_t) {});
  CHECK(rows_made > 0);
  CHECK(rows_left == 0);
}
