// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <doctest/doctest.h>

#include "dynamics/spline.hpp"

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
