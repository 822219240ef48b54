// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "dynamics/filter.hpp"
#include "dynamics/spline.hpp"

using truing::dynamics::Bends;
using truing::dynamics::SplineBetween;

TEST_CASE("the spline goes through the rows, and is any polynomial of fifth order that they lie on") {
  constexpr double kStep = 0.1;
  const auto value = [](double t) { return 1.0 + t - 2.0 * t * t + 0.3 * std::pow(t, 3) - 0.05 * std::pow(t, 5); };
  const auto rate = [](double t) { return 1.0 - 4.0 * t + 0.9 * t * t - 0.25 * std::pow(t, 4); };
  const auto acceleration = [](double t) { return -4.0 + 1.8 * t - std::pow(t, 3); };
  Eigen::VectorXd x(101);
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = value(kStep * static_cast<double>(i) - 5.0);
  for (const double part : {0.0, 0.25, 0.5, 0.9}) {
    const Eigen::MatrixXd found = SplineBetween(part, kStep).at(x, 40, 20);
    for (Eigen::Index i = 0; i < found.rows(); ++i) {
      const double t = kStep * (static_cast<double>(40 + i) + part) - 5.0;
      CHECK(std::abs(found(i, 0) - value(t)) < 1e-6);
      CHECK(std::abs(found(i, 1) - rate(t)) < 1e-5);
      CHECK(std::abs(found(i, 2) - acceleration(t)) < 1e-4);
    }
  }
}

TEST_CASE("of a wave of ten rows the spline has the acceleration, of which central differences lose an eighth") {
  constexpr double kStep = 0.1, kRate = 2.0 * 3.14159265358979;
  Eigen::VectorXd x(201);
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = std::sin(kRate * kStep * static_cast<double>(i));
  const Eigen::MatrixXd found = SplineBetween(0.5, kStep).at(x, 60, 80);
  for (Eigen::Index i = 0; i < found.rows(); ++i) {
    const double t = kStep * (static_cast<double>(60 + i) + 0.5);
    CHECK(std::abs(found(i, 0) - std::sin(kRate * t)) < 1e-4);
    CHECK(std::abs(found(i, 2) + kRate * kRate * std::sin(kRate * t)) < 1e-3 * kRate * kRate);
  }
}

TEST_CASE("at the ends of rows that begin and end in motion the spline accelerates as it does within") {
  constexpr double kStep = 0.04, kRate = 2.0 * 3.14159265358979 * 0.9;
  const Eigen::Index rows = 100;
  const auto at = [](double row) { return std::sin(kRate * kStep * row + 1.2); };  // near its largest acceleration
  Eigen::VectorXd x(rows);
  for (Eigen::Index i = 0; i < rows; ++i) x[i] = at(static_cast<double>(i));
  const auto largest_error = [&](const Bends& bends) {
    const Eigen::MatrixXd found = SplineBetween(0.5, kStep).at(x, 0, rows - 1, bends);
    double error = 0.0;
    for (Eigen::Index i = 0; i < rows - 1; ++i)
      error = std::max(error, std::abs(found(i, 2) / (kRate * kRate) + at(static_cast<double>(i) + 0.5)));
    return error;
  };
  using truing::dynamics::bend_of;
  CHECK(largest_error({bend_of(x.data(), 1, 8), bend_of(x.data() + rows - 1, -1, 8)}) < 0.08);
  CHECK(largest_error({}) > 0.25);
}
