// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The small least-squares solvers: against answers in closed form, and against Ceres.

#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>
#undef CHECK  // Ceres' logging has one of its own

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

#include "math/gauss_newton.hpp"

using namespace truing::math;

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// A line through points, weighed or not: the plainest problem with a closed form.
struct Line {
  std::vector<double> t, y, w;
  Vector2d x = Vector2d::Zero();
  int moves = 0;

  NormalSystem<2> system() const {
    NormalSystem<2> out{Matrix2d::Zero(), Vector2d::Zero(), 0.0};
    for (std::size_t i = 0; i < t.size(); ++i) {
      const Vector2d J(1.0, t[i]);
      const double r = x.dot(J) - y[i];
      out.gram += w[i] * J * J.transpose();
      out.gradient += w[i] * r * J;
      out.cost += w[i] * r * r;
    }
    return out;
  }
  void move(const Vector2d& step) { x += step, ++moves; }
  bool settled(const NormalSystem<2>&, const Vector2d& step) const { return step.norm() < 1e-12; }
};

/// y = a exp(b t), where Gauss-Newton from far away overshoots.
struct Growth {
  std::vector<double> t, y;
  Vector2d x, next;
  int systems = 0, attempts = 0;

  static Growth example(const Vector2d& start = Vector2d::Zero()) {
    Growth out;
    for (int i = 0; i < 20; ++i) {
      out.t.push_back(0.1 * i);
      out.y.push_back(2.0 * std::exp(1.3 * 0.1 * i) + (i % 3 == 0 ? 0.02 : -0.01));
    }
    out.x = start;
    return out;
  }
  double cost(const Vector2d& at) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < t.size(); ++i) sum += std::pow(at[0] * std::exp(at[1] * t[i]) - y[i], 2.0);
    return sum;
  }
  NormalSystem<2> system() {
    ++systems;
    NormalSystem<2> out{Matrix2d::Zero(), Vector2d::Zero(), cost(x)};
    for (std::size_t i = 0; i < t.size(); ++i) {
      const double e = std::exp(x[1] * t[i]);
      const Vector2d J(e, x[0] * t[i] * e);
      out.gram += J * J.transpose();
      out.gradient += (x[0] * e - y[i]) * J;
    }
    return out;
  }
  double attempt(const Vector2d& step) {
    ++attempts;
    next = x + step;
    return cost(next);
  }
  void accept() { x = next; }
  void move(const Vector2d& step) { x += step; }
  bool settled(const NormalSystem<2>&, const Vector2d& step) const { return step.norm() < 1e-13; }
};

/// One point of it, for Ceres.
struct GrowthCost : ceres::SizedCostFunction<1, 2> {
  GrowthCost(double at, double value) : t(at), y(value) {}
  bool Evaluate(double const* const* x, double* r, double** J) const override {
    const double e = std::exp(x[0][1] * t);
    r[0] = x[0][0] * e - y;
    if (J && J[0]) J[0][0] = e, J[0][1] = x[0][0] * t * e;
    return true;
  }
  double t, y;
};

Vector2d by_ceres(const Growth& growth, Vector2d x) {
  ceres::Problem problem;
  for (std::size_t i = 0; i < growth.t.size(); ++i)
    problem.AddResidualBlock(new GrowthCost(growth.t[i], growth.y[i]), nullptr, x.data());
  ceres::Solver::Options options;
  options.function_tolerance = options.parameter_tolerance = 1e-16;
  options.gradient_tolerance = 1e-20;
  options.max_num_iterations = 200;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return x;
}

}  // namespace

TEST_CASE("a linear problem takes one step, and one more to see that it was the last") {
  Line line{{0.0, 1.0, 2.0, 4.0}, {1.0, 2.5, 2.0, 5.0}, {1.0, 2.0, 1.0, 0.5}};
  const Iterations iterations = gauss_newton(&line, 50);
  CHECK(iterations.reason == StopReason::settled);
  CHECK(converged(iterations.reason));
  CHECK(iterations.steps == 2);
  // Weighted regression: slope = S_ty / S_tt about the weighted means.
  double w = 0.0, t = 0.0, y = 0.0, tt = 0.0, ty = 0.0;
  for (std::size_t i = 0; i < line.t.size(); ++i)
    w += line.w[i], t += line.w[i] * line.t[i], y += line.w[i] * line.y[i];
  for (std::size_t i = 0; i < line.t.size(); ++i) {
    tt += line.w[i] * std::pow(line.t[i] - t / w, 2.0);
    ty += line.w[i] * (line.t[i] - t / w) * (line.y[i] - y / w);
  }
  CHECK(line.x[1] == doctest::Approx(ty / tt).scale(0).epsilon(1e-13));
  CHECK(line.x[0] == doctest::Approx(y / w - ty / tt * t / w).scale(0).epsilon(1e-13));
}

TEST_CASE("weights may change after every step: the fit of least absolute errors of a constant is the median") {
  struct Constant {
    std::vector<double> y, w;
    double x = 0.0;
    NormalSystem<1> system() const {
      NormalSystem<1> out;
      out.gram.setZero(), out.gradient.setZero();
      for (std::size_t i = 0; i < y.size(); ++i) out.gram[0] += w[i], out.gradient[0] += w[i] * (x - y[i]);
      return out;
    }
    void move(const Eigen::Matrix<double, 1, 1>& step) { x += step[0]; }
    bool settled(const NormalSystem<1>&, const Eigen::Matrix<double, 1, 1>& step) {
      for (std::size_t i = 0; i < y.size(); ++i) w[i] = 1.0 / std::max(1e-9, std::abs(x - y[i]));
      return std::abs(step[0]) < 1e-12;
    }
  };
  Constant constant{{1.0, 7.0, 2.0, 3.5, 100.0}, std::vector<double>(5, 1.0)};
  CHECK(gauss_newton(&constant, 500).reason == StopReason::settled);
  CHECK(constant.x == doctest::Approx(3.5).scale(0).epsilon(1e-8));
}

TEST_CASE("Gauss-Newton says that there is no solution, and when its steps are used up") {
  Line same{{1.0, 1.0, 1.0}, {1.0, 2.0, 3.0}, {0.0, 0.0, 0.0}};
  const auto none = [](const NormalSystem<2>& system) {
    return Vector2d(Vector2d::Constant(system.gram.determinant() > 0.0 ? 0.0 : std::nan("")));
  };
  const Iterations singular = gauss_newton(&same, 50, none);
  CHECK(singular.reason == StopReason::singular);
  CHECK_FALSE(converged(singular.reason));
  CHECK(same.moves == 0);

  Growth growth = Growth::example({1.9, 1.2});
  const Iterations few = gauss_newton(&growth, 2);
  CHECK(few.reason == StopReason::iteration_limit);
  CHECK(few.steps == 2);
  CHECK_FALSE(converged(few.reason));
}

TEST_CASE("Gauss-Newton, Levenberg-Marquardt and Ceres end at the same minimum") {
  const Vector2d wanted = by_ceres(Growth::example(), {1.5, 1.0});
  Growth plain = Growth::example({1.5, 1.0}), damped = plain;
  CHECK(gauss_newton(&plain, 100).reason == StopReason::settled);
  CHECK((plain.x - wanted).norm() < 1e-9);
  for (const double damping : {0.0, 1e-9, 1e-3}) {
    CAPTURE(damping);
    damped.x = {1.5, 1.0};
    LevenbergMarquardtOptions options;
    options.damping = damping;
    options.least_damping = 1e-15;
    const Iterations iterations = levenberg_marquardt(&damped, options);
    CHECK(iterations.reason == StopReason::rounding);
    CHECK((damped.x - wanted).norm() < 1e-9);
  }
}

TEST_CASE("Levenberg-Marquardt takes steps back that do not lower the cost") {
  Growth far = Growth::example({0.01, 6.0});
  LevenbergMarquardtOptions options;
  options.damping = 0.0;
  const Iterations iterations = levenberg_marquardt(&far, options);
  CHECK(converged(iterations.reason));
  CHECK(far.attempts > far.systems);  // some failed
  CHECK((far.x - by_ceres(far, {1.5, 1.0})).norm() < 1e-8);
}

TEST_CASE("Levenberg-Marquardt says why it stopped") {
  SUBCASE("nothing to fit") {
    struct Nothing {
      NormalSystem<> system() const { return {Eigen::MatrixXd(0, 0), Eigen::VectorXd(0), 1.0}; }
      double attempt(const Eigen::VectorXd&) { return 0.0; }
      void accept() {}
      void move(const Eigen::VectorXd&) {}
    } nothing;
    CHECK(levenberg_marquardt(&nothing, {}).reason == StopReason::nothing_to_fit);
  }
  SUBCASE("limits") {
    Growth growth = Growth::example({0.01, 6.0});
    LevenbergMarquardtOptions options;
    options.max_steps = 3;
    Iterations iterations = levenberg_marquardt(&growth, options);
    CHECK(iterations.reason == StopReason::iteration_limit);
    CHECK(iterations.steps == 3);
    growth = Growth::example({1.5, 1.0});
    options = {};
    options.max_linearisations = 2;
    iterations = levenberg_marquardt(&growth, options);
    CHECK(iterations.reason == StopReason::iteration_limit);
    CHECK(growth.systems == 2);
  }
  SUBCASE("gradient") {
    Growth growth = Growth::example({1.5, 1.0});
    LevenbergMarquardtOptions options;
    options.gradient = 1e-4;
    CHECK(levenberg_marquardt(&growth, options).reason == StopReason::gradient);
  }
  SUBCASE("a fall that is not worth going on") {
    Growth growth = Growth::example({1.5, 1.0});
    LevenbergMarquardtOptions options;
    options.small_fall = [](double from, double to) { return 1.0 - to / from < 1e-4; };
    CHECK(levenberg_marquardt(&growth, options).reason == StopReason::small_fall);
    CHECK((growth.x - by_ceres(growth, {1.5, 1.0})).norm() < 1e-2);
  }
  SUBCASE("no descent, by so many failures or by the damping's end") {
    struct Wall : Growth {
      explicit Wall(const Growth& growth) : Growth(growth) {}
      double attempt(const Vector2d&) { return ++attempts, std::numeric_limits<double>::infinity(); }
    } wall(Growth::example({1.5, 1.0}));
    LevenbergMarquardtOptions options;
    options.max_failures = 5;
    CHECK(levenberg_marquardt(&wall, options).reason == StopReason::no_descent);
    CHECK(wall.attempts == 5);
    options = {};
    options.damping = 1.0, options.most_damping = 1e6;
    const Iterations iterations = levenberg_marquardt(&wall, options);
    CHECK(iterations.reason == StopReason::no_descent);
    CHECK(iterations.steps == 7);
    options.small_promise = [](double from, double to) { return from - to < 1e9; };
    CHECK(levenberg_marquardt(&wall, options).reason == StopReason::small_promise);
    CHECK(wall.x == Vector2d(1.5, 1.0));
  }
}

TEST_CASE("the step of a damped system is that of the rows with sqrt(mu) of each column's length below them") {
  const Eigen::MatrixXd J = Eigen::MatrixXd::Random(9, 3) * Eigen::Vector3d(1.0, 1e-3, 1e3).asDiagonal();
  const Eigen::VectorXd r = Eigen::VectorXd::Random(9);
  const double mu = 0.3;
  Eigen::MatrixXd rows(12, 3);
  rows << J, Eigen::MatrixXd(std::sqrt(mu) * J.colwise().norm().transpose().asDiagonal());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(12);
  right.head(9) = -r;
  const Eigen::VectorXd wanted = rows.colPivHouseholderQr().solve(right);
  const NormalSystem<> system{J.transpose() * J, J.transpose() * r, r.squaredNorm()};
  const DampedStep<Eigen::Dynamic> step = damped_step(system, mu);
  for (Eigen::Index k = 0; k < 3; ++k) CHECK(step.delta[k] == doctest::Approx(wanted[k]).scale(0).epsilon(1e-11));
  CHECK(step.predicted_fall ==
        doctest::Approx(r.squaredNorm() - (r + J * step.delta).squaredNorm()).scale(0).epsilon(1e-10));
}

TEST_CASE("unknowns of blocks eliminated and recovered are those of the whole system") {
  constexpr int kShared = 4, kOwn = 3, kBlocks = 5, kRows = 6;
  using J = Eigen::Matrix<double, kRows, kShared>;
  using K = Eigen::Matrix<double, kRows, kOwn>;
  using R = Eigen::Matrix<double, kRows, 1>;
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(kBlocks * kRows, kShared + kBlocks * kOwn);
  Eigen::VectorXd r(kBlocks * kRows), w(kBlocks * kRows);
  std::vector<BlockSystem<kShared, kOwn>> blocks(kBlocks);
  NormalSystem<kShared> sum{Eigen::Matrix4d::Zero(), Eigen::Vector4d::Zero(), 0.0};
  for (int b = 0; b < kBlocks; ++b) {
    const J shared = J::Random();
    const K own = K::Random();
    const R residual = R::Random(), weight = R::Random().cwiseAbs() + R::Constant(0.1);
    whole.block<kRows, kShared>(b * kRows, 0) = shared;
    whole.block<kRows, kOwn>(b * kRows, kShared + b * kOwn) = own;
    r.segment<kRows>(b * kRows) = residual, w.segment<kRows>(b * kRows) = weight;
    blocks[static_cast<std::size_t>(b)].add(shared, own, residual, weight);
    const NormalSystem<kShared> reduced = eliminate(blocks[static_cast<std::size_t>(b)]);
    sum.gram += reduced.gram, sum.gradient += reduced.gradient, sum.cost += reduced.cost;
  }
  const Eigen::VectorXd root = w.cwiseSqrt();
  const Eigen::VectorXd wanted =
      (root.asDiagonal() * whole).colPivHouseholderQr().solve(-(root.cwiseProduct(r)).eval());
  const Eigen::Vector4d step = CholeskyStep()(sum);
  CHECK((step - wanted.head<kShared>()).norm() < 1e-10);
  for (int b = 0; b < kBlocks; ++b) {
    const Eigen::Vector3d own = recover(blocks[static_cast<std::size_t>(b)], step);
    CHECK((own - wanted.segment<kOwn>(kShared + b * kOwn)).norm() < 1e-10);
  }
  CHECK(sum.cost == doctest::Approx(r.dot(w.cwiseProduct(r))).scale(0).epsilon(1e-13));
}
