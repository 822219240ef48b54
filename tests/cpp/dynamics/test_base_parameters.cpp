// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/base_parameters.hpp"

#include <algorithm>
#include <stdexcept>

#include <doctest/doctest.h>

#include "math/linear_algebra.hpp"
#include "support/newton_euler.hpp"

namespace {

using namespace rigid;
using namespace truing::dynamics;

/// Two links of .5 m that turn about parallel axes.
Robot planar(const Vector3d& gravity) {
  Robot robot;
  robot.name = "planar";
  robot.joints = {arms::joint("J1", 0, 0, 0.5, 0), arms::joint("J2", 0, 0, 0.5, 0)};
  robot.gravity = gravity;
  return robot;
}

/// Three axes for the position, the second and third parallel, and a wrist whose axes meet.
Robot anthropomorphic() {
  Robot robot;
  robot.name = "anthropomorphic";
  robot.joints = {arms::joint("J1", 0, 0.4, 0, M_PI / 2),    arms::joint("J2", 0, 0, 0.45, 0),
                  arms::joint("J3", 0, 0.1, 0.05, M_PI / 2), arms::joint("J4", 0, 0.4, 0, -M_PI / 2),
                  arms::joint("J5", 0, 0, 0, M_PI / 2),      arms::joint("J6", 0, 0.1, 0, 0)};
  return robot;
}

MatrixXd random_regressor(const Robot& robot, Index rows, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto joints = static_cast<Index>(robot.driven_count());
  const auto table = [&](double reach) {
    return MatrixXd(random_vector(rows * joints, reach, &random).reshaped(rows, joints));
  };
  const MatrixXd q = table(3.0), qd = table(3.0), qdd = table(10.0);
  return torque_regressor(robot, q, qd, qdd);
}

/// Singular values of unit columns above 1e-9 of the largest.
Index rank_by_singular_values(MatrixXd Y) {
  const double largest = Y.colwise().norm().maxCoeff();
  for (Index k = 0; k < Y.cols(); ++k) {
    const double length = Y.col(k).norm();
    if (length > 1e-12 * largest)
      Y.col(k) /= length;
    else
      Y.col(k).setZero();
  }
  const VectorXd values = truing::math::thin_singular_values(Y).values;
  return (values.array() > 1e-9 * values[0]).count();
}

std::vector<std::string> names(const Robot& robot, const std::vector<int>& columns) {
  std::vector<std::string> out;
  for (const int column : columns) out.push_back(inertial_name(robot, column).substr(13));
  return out;
}

}  // namespace

TEST_CASE("two parallel axes see six parameters where gravity pulls, four where it does not") {
  const Robot upright = planar({0.0, -9.81, 0.0});
  const BaseParameters seen = base_parameters(upright);
  CHECK(seen.kept.size() == 6);
  // Of the first link the inertia about its axis and the centre of mass, of the second likewise (Khalil and Dombre).
  CHECK(base_parameters(planar({0.0, 0.0, -9.81})).kept.size() == 4);
  CHECK(base_parameters(planar(Vector3d::Zero())).kept.size() == 4);
  for (const char* part : {"J1.xx", "J1.yy", "J1.mz", "J2.xy", "J2.yz"}) {
    CAPTURE(part);
    const std::vector<std::string> unseen = names(upright, seen.unseen);
    CHECK(std::find(unseen.begin(), unseen.end(), part) != unseen.end());
  }
}

TEST_CASE("a turntable under gravity sees its own inertia alone") {
  Robot robot;
  robot.joints = {arms::joint("J1", 0, 0.3, 0, 0)};
  const BaseParameters seen = base_parameters(robot);
  CHECK(names(robot, seen.kept) == std::vector<std::string>{"J1.zz"});
  CHECK(seen.unseen.size() == 9);
}

TEST_CASE("an arm of six joints sees 36, as published, and as many as there are singular values") {
  CHECK(base_parameters(anthropomorphic()).kept.size() == 36);  // Gautier and Khalil 1990, the Puma's structure
  std::vector<Robot> robots = {anthropomorphic(), arms::ur10(), arms::palletizer(), arms::rail_arm(), arms::urdf_arm()};
  for (const Convention convention : {Convention::dh, Convention::mdh, Convention::urdf})
    robots.push_back(linked_arm(convention, 3));
  for (const Robot& robot : robots) {
    CAPTURE(robot.name);
    const BaseParameters base = base_parameters(robot);
    CHECK(static_cast<Index>(base.kept.size()) == rank_by_singular_values(random_regressor(robot, 100, 5)));
    CHECK(base.kept.size() + base.grouped.size() + base.unseen.size() == 10 * robot.joints.size());
  }
}

TEST_CASE("torques depend on the base parameters alone") {
  for (const Convention convention : {Convention::dh, Convention::mdh, Convention::urdf}) {
    const Robot robot = linked_arm(convention, 6);
    const BaseParameters base = base_parameters(robot);
    const VectorXd parameters = link_parameters(robot), values = base.values(parameters);
    const MatrixXd Y = random_regressor(robot, 50, 6);
    MatrixXd kept(Y.rows(), static_cast<Index>(base.kept.size()));
    for (Index i = 0; i < kept.cols(); ++i) kept.col(i) = Y.col(base.kept[static_cast<std::size_t>(i)]);
    CHECK((kept * values - Y * parameters).norm() < 1e-5 * (Y * parameters).norm());

    std::mt19937_64 random(8);
    const VectorXd other = parameters + random_vector(parameters.size(), 1.0, &random);
    const VectorXd back = base.with_values(other, values);
    CHECK((base.values(back) - values).norm() < 1e-12 * values.norm());
    CHECK((Y * back - Y * parameters).norm() < 1e-5 * (Y * parameters).norm());
    for (const int column : base.grouped) CHECK(back[column] == other[column]);
  }
}

TEST_CASE("recordings see what moved in them") {
  const Robot robot = anthropomorphic();
  // At rest in one posture: as many as there are joints that gravity loads, less what one posture cannot tell apart.
  std::mt19937_64 random(9);
  const MatrixXd q = random_vector(6, 2.0, &random).transpose(), still = MatrixXd::Zero(1, 6);
  const MatrixXd Y = torque_regressor(robot, q, still, still);
  const BaseParameters one = base_parameters(robot, MatrixXd(Y.transpose() * Y));
  CHECK(one.kept.size() == 5);  // the first joint stands upright
  MatrixXd many = random_vector(600, 2.0, &random).reshaped(100, 6);
  const MatrixXd rest = MatrixXd::Zero(100, 6), Y_rest = torque_regressor(robot, many, rest, rest);
  const BaseParameters gravity = base_parameters(robot, MatrixXd(Y_rest.transpose() * Y_rest));
  CHECK(static_cast<Index>(gravity.kept.size()) == rank_by_singular_values(Y_rest));
  CHECK(gravity.kept.size() < 12);
  for (const std::string& name : names(robot, gravity.kept)) CHECK(name.find(".m") != std::string::npos);
}

TEST_CASE("what is grouped is said in words") {
  const Robot robot = planar({0.0, -9.81, 0.0});
  const std::vector<std::string> words = in_words(base_parameters(robot), robot);
  CHECK(words.size() == 14);
  const auto has = [&](const std::string& wanted) {
    return std::any_of(words.begin(), words.end(),
                       [&](const std::string& line) { return line.find(wanted) != std::string::npos; });
  };
  CHECK(has(" grouped into link_inertia.J1."));
  CHECK(has("link_inertia.J1.xx is not seen"));
}

TEST_CASE("a Gram of another shape is refused") {
  CHECK_THROWS_WITH_AS(base_parameters(anthropomorphic(), MatrixXd::Identity(50, 50)),
                       doctest::Contains("shape (50, 50), expected 60"), std::invalid_argument);
}
