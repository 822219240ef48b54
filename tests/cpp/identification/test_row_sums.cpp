// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <doctest/doctest.h>

#include <random>

#include "support/arms.hpp"
#include "truing/fleet.hpp"
#include "truing/identify.hpp"

using namespace truing;

namespace {

struct Case {
  Robot nominal;
  std::unique_ptr<arms::Table> table;
  std::vector<std::string> names;
  Eigen::VectorXd start;
};

Case make_case(arms::What what, std::size_t rows) {
  Case out{arms::ur10(), arms::random_joints(arms::ur10(), rows, 7), {}, {}};
  arms::measure(out.table.get(), arms::perturbed(out.nominal, 1e-3, 1e-3, 3), what, 5e-5, 11);
  std::vector<double> start;
  for (const FreeParameter& parameter : free_parameters(out.nominal, out.table->data)) {
    out.names.push_back(parameter.name);
    start.push_back(parameter.value);
  }
  out.start = Eigen::Map<const Eigen::VectorXd>(start.data(), static_cast<Eigen::Index>(start.size()));
  return out;
}

std::vector<std::int8_t> every_other(std::size_t rows, std::size_t first) {
  std::vector<std::int8_t> out(rows, 0);
  for (std::size_t row = first; row < rows; row += 2) out[row] = 1;
  return out;
}

}  // namespace

TEST_CASE("sums of two halves add to the sum of all rows") {
  for (const arms::What what : {arms::What::position, arms::What::pose}) {
    const Case c = make_case(what, 301);
    SumOptions options;
    options.scores = true;
    const auto sums = [&](const std::vector<std::int8_t>& counts) {
      return sum_rows(c.nominal, c.table->data, c.names, c.start, counts, options);
    };
    const RowSums all = sums({}), even = sums(every_other(301, 0)), odd = sums(every_other(301, 1));
    CHECK(even.values + odd.values == all.values);
    CHECK((even.gram + odd.gram - all.gram).norm() < 1e-12 * all.gram.norm());
    CHECK((even.gradient + odd.gradient - all.gradient).norm() < 1e-12 * all.gradient.norm());
    CHECK((even.scores + odd.scores - all.scores).norm() < 1e-12 * all.scores.norm());
    CHECK(even.squares + odd.squares == doctest::Approx(all.squares).epsilon(1e-13));
  }
}

TEST_CASE("rows that do not count have errors all the same") {
  const Case c = make_case(arms::What::position, 60);
  const RowSums half = sum_rows(c.nominal, c.table->data, c.names, c.start, every_other(60, 1));
  const Residuals residual = residuals(c.nominal, c.table->data);
  REQUIRE(half.position_error.size() == 60);
  CHECK(half.rotation_error.empty());
  for (Eigen::Index row = 0; row < 60; ++row)
    CHECK(half.position_error[static_cast<std::size_t>(row)] ==
          doctest::Approx(residual.position.row(row).norm()).epsilon(1e-12));
}

TEST_CASE("steps on the sums end where identify ends") {
  const Case c = make_case(arms::What::position, 400);
  IdentifyOptions options;
  options.loss = Loss::none;
  options.test_share = 0.0;
  const Identification found = identify(c.nominal, c.table->data, options);
  Eigen::VectorXd values = c.start;
  for (int step = 0; step < 8; ++step) {
    const RowSums sums = sum_rows(c.nominal, c.table->data, c.names, values);
    const SeenColumns seen = seen_columns(sums.gram, std::vector<int>(c.names.size(), 0));
    CHECK(seen.kept.size() == static_cast<std::size_t>(found.rank));
    const Eigen::MatrixXd gram = sums.gram(seen.kept, seen.kept);
    const Eigen::VectorXd gradient = sums.gradient(seen.kept);
    values(seen.kept) -= gram.ldlt().solve(gradient);
  }
  const Robot robot = robot_at(c.nominal, c.table->data, c.names, values);
  const Prediction ours = predict(robot, c.table->data), theirs = predict(found.robot, c.table->data);
  CHECK((ours.position - theirs.position).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("names out of order, unknown names and fixed points are refused") {
  Case c = make_case(arms::What::position, 20);
  const std::vector<std::string> names{"J2.a", "J1.d"};
  CHECK_THROWS_AS(sum_rows(c.nominal, c.table->data, names, Eigen::VectorXd::Zero(2)), std::invalid_argument);
  CHECK_THROWS_AS(sum_rows(c.nominal, c.table->data, {"J9.a"}, Eigen::VectorXd::Zero(1)), std::invalid_argument);
  CHECK_THROWS_AS(sum_rows(c.nominal, c.table->data, c.names, Eigen::VectorXd::Zero(2)), std::invalid_argument);
  c.table->data.fixed_point.assign(20, 0);
  c.table->data.fixed_point_names = {"cone"};
  CHECK_THROWS_AS(free_parameters(c.nominal, c.table->data), std::invalid_argument);
}

TEST_CASE("the groups that made y are chosen from the sums, and twins are named as rivals") {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  const Eigen::Index n = 2000, p = 6;
  Eigen::MatrixXd x = Eigen::MatrixXd::NullaryExpr(n, p, [&] { return normal(random); });
  x.col(5) = x.col(1) + 1e-4 * x.col(5);
  const Eigen::VectorXd noise = Eigen::VectorXd::NullaryExpr(n, [&] { return normal(random); });
  const Eigen::VectorXd y = 0.5 * x.col(1) - 0.4 * x.col(3) + noise;
  const GroupChoice found = choose_groups(x.transpose() * x, x.transpose() * y, y.squaredNorm(), static_cast<double>(n),
                                          {{0}, {1}, {2, 3}, {4}, {5}}, Eigen::VectorXd::Ones(p), std::log(5.0));
  REQUIRE(found.groups.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(found.nats[k] > 20.0);
    const bool twin = found.groups[k] == 1 || found.groups[k] == 4;
    CHECK(found.rivals[k].size() == (twin ? 1u : 0u));
    CHECK((twin || found.groups[k] == 2));
  }
  CHECK(found.sigma == doctest::Approx(1.0).epsilon(0.05));
}
