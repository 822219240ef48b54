// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/physical.hpp"

#include <stdexcept>

#include <doctest/doctest.h>
#include <Eigen/Cholesky>

#include "dynamics/regressor.hpp"
#include "math/linear_algebra.hpp"
#include "support/newton_euler.hpp"
#include "support/sanitized.hpp"

namespace {

using namespace rigid;
using namespace truing::dynamics;

/// What noisy torques at random states say of the links.
struct Data {
  MatrixXd Y, information;
  VectorXd gradient;

  Data(const Robot& truth, Index rows, double sigma, std::mt19937_64* random) {
    const auto joints = static_cast<Index>(truth.driven_count());
    const auto table = [&](double reach) {
      return MatrixXd(random_vector(rows * joints, reach, random).reshaped(rows, joints));
    };
    const MatrixXd q = table(3.0), qd = table(2.0), qdd = table(5.0);
    Y = torque_regressor(truth, q, qd, qdd);
    VectorXd torque = Y * link_parameters(truth);
    for (double& value : torque) value += sigma * std::sqrt(3.0) * random_vector(1, 1.0, random)[0];
    const double s = std::max(sigma, 1e-3);
    information = Y.transpose() * Y / (s * s);
    gradient = Y.transpose() * torque / (s * s);
  }
};

bool positive(const VectorXd& parameters) {
  for (Index at = 0; at < parameters.size(); at += 10) {
    const Eigen::LLT<Eigen::Matrix4d> factor(pseudo_inertia(parameters.segment<10>(at)));
    if (factor.info() != Eigen::Success) return false;
  }
  return true;
}

/// Every parameter changed by about `share` of the link's size, so that it stays a body: point masses are reweighted.
Robot reweighted(Robot robot, double share, std::mt19937_64* random) {
  for (Joint& joint : robot.joints) {
    const Eigen::Matrix4d P = pseudo_inertia(link_parameters(joint));
    const Eigen::Matrix4d L = P.llt().matrixL();
    const VectorXd factors = (share * random_vector(4, 1.0, random)).array().exp();
    const Eigen::Matrix4d changed = L * factors.asDiagonal() * L.transpose();
    set_link_parameters(parameters_of(changed), &joint);
  }
  return robot;
}

}  // namespace

TEST_CASE("the pseudo-inertia is the second moment of the points of a body") {
  std::mt19937_64 random(1);
  Eigen::Matrix4d expected = Eigen::Matrix4d::Zero();
  Joint joint;
  Matrix3d I = Matrix3d::Zero();
  double mass = 0.0;
  Vector3d moment = Vector3d::Zero();
  for (int k = 0; k < 6; ++k) {
    const Vector3d r = random_vector(3, 0.5, &random);
    const double m = 0.3 + 0.1 * k;
    expected += m * r.homogeneous() * r.homogeneous().transpose();
    I += m * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
    mass += m;
    moment += m * r;
  }
  LinkParameters p;
  p << mass, moment, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2);
  CHECK((pseudo_inertia(p) - expected).norm() < 1e-14);
  CHECK((parameters_of(pseudo_inertia(p)) - p).norm() < 1e-14);
}

TEST_CASE("gradient and curvature of what is minimised are those of differences") {
  std::mt19937_64 random(2);
  const Robot robot = linked_arm(Convention::dh, 3);
  const Data data(robot, 30, 1.0, &random);
  const PhysicalObjective objective(link_parameters(reweighted(robot, 0.5, &random)), data.information, data.gradient);
  const VectorXd x = random_vector(objective.size(), 0.2, &random);
  for (const double weight : {1e-3, 4.0, 1e5}) {
    CAPTURE(weight);
    const PhysicalObjective::Local local = objective.local(x, weight);
    const VectorXd gradient = local.rows.transpose() * local.residuals;
    const MatrixXd hessian = local.rows.transpose() * local.rows;
    double worst = 0.0, worst_curvature = 0.0;
    for (Index k = 0; k < x.size(); ++k) {
      const VectorXd unit = local.to_x(VectorXd::Unit(x.size(), k));
      const auto change = [&](double t) { return objective.along(x, unit, weight).change(t); };
      worst = std::max(worst, std::abs(derivative(change, 1e-3) - gradient[k]));
      const double curvature =
          derivative([&](double t) { return derivative([&](double u) { return change(t + u); }, 1e-2); }, 1e-2);
      worst_curvature = std::max(worst_curvature, std::abs(curvature - hessian(k, k)));
      CHECK(std::abs(objective.along(x, unit, weight).slope_at(0.0) - gradient[k]) <
            1e-10 * gradient.cwiseAbs().maxCoeff());
      // What a line says far off is what another from there would say back.
      const double there = change(0.3), back = objective.along(x + 0.3 * unit, -unit, weight).change(0.3);
      CHECK(std::abs(there + back) < 1e-10 * (std::abs(there) + weight));
    }
    CHECK(worst < 1e-8 * gradient.cwiseAbs().maxCoeff());
    CHECK(worst_curvature < 1e-5 * hessian.cwiseAbs().maxCoeff());
    // Off the diagonal: along the sum of two.
    for (Index k = 1; k < x.size(); k += 7) {
      const auto curvature = [&](const VectorXd& y) {
        const PhysicalObjective::Line line = objective.along(x, local.to_x(y), weight);
        return derivative([&](double t) { return line.slope_at(t); }, 1e-3);
      };
      const VectorXd one = VectorXd::Unit(x.size(), k), two = VectorXd::Unit(x.size(), k - 1);
      CHECK(std::abs(0.5 * (curvature(one + two) - curvature(one) - curvature(two)) - hessian(k, k - 1)) <
            1e-6 * hessian.cwiseAbs().maxCoeff());
    }
  }
}

TEST_CASE("the truth comes back from torques without noise") {
  for (const Convention convention : {Convention::dh, Convention::mdh, Convention::urdf}) {
    std::mt19937_64 random(3);
    const Robot truth = linked_arm(convention, 4);
    const Data data(truth, 300, 0.0, &random);
    const PhysicalInertias found = physical_inertias(reweighted(truth, 0.4, &random), data.information, data.gradient);
    CHECK(truing::math::converged(found.reason));
    CHECK(positive(found.parameters));
    CHECK(found.lifted.empty());
    const VectorXd torque = data.Y * link_parameters(truth);
    CHECK((data.Y * found.parameters - torque).norm() < 1e-5 * torque.norm());
    CHECK((link_parameters(found.robot) - found.parameters).norm() < 1e-12 * found.parameters.norm());
    CHECK(found.increase < 1.0);
  }
}

TEST_CASE("a fit that no body could have is repaired at a small cost") {
  int infeasible = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    Robot truth = linked_arm(Convention::urdf, seed);
    const Robot nominal = reweighted(truth, 0.3, &random);
    const Data data(truth, 60, 3.0, &random);
    const VectorXd free =
        link_parameters(nominal) +
        truing::math::least_squares(data.information, data.gradient - data.information * link_parameters(nominal));
    infeasible += positive(free) ? 0 : 1;
    const PhysicalInertias found = physical_inertias(nominal, data.information, data.gradient);
    CHECK(truing::math::converged(found.reason));
    CHECK(found.steps < 40);
    CHECK(positive(found.parameters));
    CHECK(found.smallest_eigenvalue.minCoeff() > 0.0);
    // The truth is a body, and costs about as many as there are parameters that can be seen.
    CHECK(found.increase < 100.0);
    const auto squares = [&](const VectorXd& p) { return p.dot(data.information * p) - 2.0 * data.gradient.dot(p); };
    CHECK(found.increase == doctest::Approx(squares(found.parameters) - squares(free)).epsilon(1e-3));
    CHECK(found.increase >= 0.0);
    // Nearer to the truth's torques than the free fit was.
    CHECK((data.Y * (found.parameters - link_parameters(truth))).norm() <
          1.05 * (data.Y * (free - link_parameters(truth))).norm());
  }
  CHECK(infeasible >= 8);
}

TEST_CASE("whatever the data, the nominal and the rank, the answer is a body") {
  const int problems = kSanitized ? 30 : 300;
  std::mt19937_64 random(7);
  int ended_early = 0;  // nominals of next to no mass under loose priors, and data of a few directions alone
  for (int problem = 0; problem < problems; ++problem) {
    CAPTURE(problem);
    Robot nominal = linked_arm(problem % 2 ? Convention::dh : Convention::urdf, static_cast<unsigned>(problem));
    nominal.joints.resize(3);
    nominal.joints[1].driven_by.clear();
    for (Joint& joint : nominal.joints) {
      const double kind = random_vector(1, 1.0, &random)[0];
      if (kind < -0.5) joint.mass = 0.0;
      if (kind > 0.0 && kind < 0.3) joint.inertia.reset();
      if (kind > 0.3 && kind < 0.6) joint.inertia = -*joint.inertia;
      if (kind > 0.6 && kind < 0.8) joint.inertia = Vector3d(1.0, 0.1, 0.1).asDiagonal();  // beyond the triangle
    }
    const Index rank = 1 + problem % 30;
    const MatrixXd X = random_vector(rank * 30, std::pow(10.0, problem % 9 - 3), &random).reshaped(rank, 30);
    const MatrixXd information = X.transpose() * X;
    // Two in three are of some body, more or less; the others of what no body could be, masses below zero.
    Robot other = nominal;
    give_inertias(&other, &random);
    const bool plausible = problem % 3 != 0;
    const VectorXd wanted =
        plausible ? link_parameters(other) + random_vector(30, 1e-3, &random) : random_vector(30, 3.0, &random);
    const VectorXd gradient = information * wanted;
    PhysicalOptions options;
    options.spread = std::pow(10.0, random_vector(1, 1.0, &random)[0]);
    const PhysicalInertias found = physical_inertias(nominal, information, gradient, options);
    REQUIRE(found.parameters.allFinite());
    CHECK(positive(found.parameters));
    CHECK(found.smallest_eigenvalue.minCoeff() > 0.0);
    ended_early += plausible && !truing::math::converged(found.reason) ? 1 : 0;
    CHECK(found.increase >= 0.0);
    CHECK(found.distance.allFinite());
  }
  CHECK(ended_early <= problems / 50);
}

TEST_CASE("where the data say nothing the nominal stays") {
  std::mt19937_64 random(8);
  const Robot nominal = linked_arm(Convention::mdh, 5);
  const VectorXd before = link_parameters(nominal);
  const PhysicalInertias unmoved = physical_inertias(nominal, MatrixXd::Zero(50, 50), VectorXd::Zero(50));
  CHECK((unmoved.parameters - before).norm() < 1e-12);
  CHECK(unmoved.distance.norm() < 1e-9);
  CHECK(unmoved.increase == 0.0);

  // The third link alone is seen, and its mass alone.
  MatrixXd information = MatrixXd::Zero(50, 50);
  information(20, 20) = 1e8;
  const PhysicalInertias moved =
      physical_inertias(nominal, information, information * (before + 2.0 * VectorXd::Unit(50, 20)));
  CHECK(moved.parameters[20] == doctest::Approx(before[20] + 2.0).epsilon(1e-6));
  CHECK((moved.parameters - before).head(20).norm() < 1e-9);
  CHECK((moved.parameters - before).tail(20).norm() < 1e-9);
  CHECK(moved.distance[2] > 0.05);
}

TEST_CASE("a nominal that no body could have is lifted, and that is said") {
  Robot nominal = linked_arm(Convention::dh, 6);
  nominal.joints[1].mass = 0.0;
  nominal.joints[1].inertia.reset();
  nominal.joints[3].inertia.reset();  // a point
  const PhysicalInertias found = physical_inertias(nominal, MatrixXd::Zero(50, 50), VectorXd::Zero(50));
  REQUIRE(found.lifted.size() == 2);
  CHECK(found.lifted[0].joint == "J2");
  CHECK(found.lifted[0].from.isZero(0.0));
  CHECK(found.lifted[0].to[0] == doctest::Approx(0.01));
  CHECK(found.lifted[1].joint == "J4");
  CHECK(found.lifted[1].to[0] == *nominal.joints[3].mass);
  CHECK(*found.robot.joints[3].mass == doctest::Approx(*nominal.joints[3].mass));
  CHECK((found.robot.joints[3].center_of_mass - nominal.joints[3].center_of_mass).norm() < 1e-12);
  const double least = 2.0 * *nominal.joints[3].mass * 1e-4;  // a ball's: two directions add up about every axis
  CHECK((*found.robot.joints[3].inertia - least * Matrix3d::Identity()).norm() < 1e-10);
  CHECK(positive(found.parameters));
}

TEST_CASE("a tighter prior stays nearer to the nominal") {
  std::mt19937_64 random(9);
  const Robot truth = linked_arm(Convention::dh, 7);
  const Robot nominal = reweighted(truth, 0.8, &random);
  const Data data(truth, 20, 3.0, &random);
  double last = 0.0;
  for (const double spread : {1e-3, 1e-2, 0.1, 1.0}) {
    PhysicalOptions options;
    options.spread = spread;
    const double distance = physical_inertias(nominal, data.information, data.gradient, options).distance.norm();
    CHECK(distance > last);
    last = distance;
  }
}

TEST_CASE("from what fits nearly the same data the same bodies are found in fewer steps") {
  int steps = 0, steps_from_afar = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    std::mt19937_64 random(seed);
    const Robot truth = linked_arm(Convention::urdf, seed), nominal = reweighted(truth, 0.3, &random);
    const Data data(truth, 60, 3.0, &random), more(truth, 10, 3.0, &random);
    const VectorXd near = physical_inertias(nominal, data.information, data.gradient).parameters;
    const MatrixXd information = data.information + more.information;
    const VectorXd gradient = data.gradient + more.gradient;
    const PhysicalInertias far = physical_inertias(nominal, information, gradient),
                           found = physical_inertias(nominal, information, gradient, {}, near);
    CHECK(truing::math::converged(found.reason));
    steps += found.steps;
    steps_from_afar += far.steps;
    CHECK((data.Y * (found.parameters - far.parameters)).norm() < 1e-4 * (data.Y * far.parameters).norm());
    CHECK(found.increase == doctest::Approx(far.increase).epsilon(1e-4));
    // No bodies: as if nothing were known.
    CHECK(physical_inertias(nominal, information, gradient, {}, -near).increase ==
          doctest::Approx(far.increase).epsilon(1e-4));
  }
  CHECK(2 * steps < steps_from_afar);
}

TEST_CASE("what cannot be used is refused in words") {
  const Robot robot = linked_arm(Convention::dh, 8);
  const MatrixXd H = MatrixXd::Identity(50, 50);
  const VectorXd g = VectorXd::Zero(50);
  const auto refused = [&](const MatrixXd& information, const VectorXd& gradient, const char* words) {
    CHECK_THROWS_WITH_AS(physical_inertias(robot, information, gradient), doctest::Contains(words),
                         std::invalid_argument);
  };
  refused(MatrixXd::Identity(60, 60), g, "shape (60, 60), expected 50");
  refused(H, VectorXd::Zero(49), "49 values");
  CHECK_THROWS_WITH_AS(physical_inertias(robot, H, g, {}, VectorXd::Ones(49)), doctest::Contains("near has 49 values"),
                       std::invalid_argument);
  CHECK_THROWS_WITH_AS(physical_inertias(robot, H, g, {}, VectorXd::Constant(50, std::nan(""))),
                       doctest::Contains("near has a value that is not finite"), std::invalid_argument);
  MatrixXd other = H;
  other(3, 4) = std::nan("");
  refused(other, g, "not finite");
  other = H;
  other(3, 4) = 0.5;
  refused(other, g, "not symmetric");
  other(4, 3) = 0.5;
  other(3, 3) = 0.01;
  refused(other, g, "negative eigenvalue");
  PhysicalOptions options;
  options.spread = 0.0;
  CHECK_THROWS_WITH_AS(physical_inertias(robot, H, g, options), doctest::Contains("more than zero"),
                       std::invalid_argument);
}
