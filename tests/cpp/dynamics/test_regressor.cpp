// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/regressor.hpp"

#include <stdexcept>

#include <doctest/doctest.h>

#include "math/constants.hpp"
#include "support/newton_euler.hpp"
#include "truing/dynamics/rigid.hpp"

namespace {

using namespace rigid;
using truing::dynamics::kLinkParameters;
using truing::dynamics::link_parameters;
using truing::dynamics::LinkParameters;
using truing::dynamics::mass_matrix_columns;
using truing::dynamics::rigid_torques;
using truing::dynamics::RigidChain;
using truing::dynamics::set_link_parameters;
using truing::dynamics::torque_regressor;

/// Every convention, rails, passive joints, ratios and offsets, gravity askew.
std::vector<Robot> robots() {
  std::vector<Robot> out = {arms::palletizer(), arms::ur10(), arms::rail_arm(), arms::urdf_arm()};
  std::mt19937_64 random(3);
  for (Robot& robot : out) give_inertias(&robot, &random);
  for (const Convention convention : {Convention::dh, Convention::mdh, Convention::urdf}) {
    for (const unsigned seed : {1u, 2u}) out.push_back(linked_arm(convention, seed));
  }
  return out;
}

struct State {
  VectorXd q, qd, qdd;
};

State random_state(const Robot& robot, std::mt19937_64* random) {
  const auto n = static_cast<Index>(robot.driven_count());
  return {random_vector(n, 3.0, random), random_vector(n, 2.0, random), random_vector(n, 5.0, random)};
}

MatrixXd regressor(const RigidChain& chain, const State& s) {
  MatrixXd Y = MatrixXd::Constant(chain.driven(), kLinkParameters * chain.links(), 7.0);  // all of it is written
  chain.regressor(s.q.data(), s.qd.data(), s.qdd.data(), Y);
  return Y;
}

VectorXd torque(const Robot& robot, const State& s) { return regressor(RigidChain(robot), s) * link_parameters(robot); }

/// Many states, a row each.
struct States {
  MatrixXd q, qd, qdd;

  States(const RigidChain& chain, Index rows, std::mt19937_64* random)
      : q(random_vector(rows * chain.driven(), 3.0, random).reshaped(rows, chain.driven())),
        qd(random_vector(rows * chain.driven(), 2.0, random).reshaped(rows, chain.driven())),
        qdd(random_vector(rows * chain.driven(), 5.0, random).reshaped(rows, chain.driven())) {}
  State at(Index row) const { return {q.row(row), qd.row(row), qdd.row(row)}; }
};

/// Columns of every joint, those that it does not feel at zero.
std::vector<MatrixXd> tiles(const RigidChain& chain, const truing::kernel::RigidFunctions& kernel, const States& states,
                            Index begin, Index end) {
  const Index stride = RigidChain::padded(end - begin);
  std::vector<MatrixXd> out(static_cast<std::size_t>(chain.driven()),
                            MatrixXd::Zero(stride, kLinkParameters * chain.links()));
  std::vector<double*> blocks(static_cast<std::size_t>(chain.driven() * chain.links()), nullptr);
  for (Index k = 0; k < chain.driven(); ++k) {
    for (const Index link : chain.felt_links(k))
      blocks[static_cast<std::size_t>(k * chain.links() + link)] =
          out[static_cast<std::size_t>(k)].col(kLinkParameters * link).data();
  }
  chain.regressors(kernel, states.q, states.qd, states.qdd, begin, end, blocks.data(), stride);
  return out;
}

double relative(const VectorXd& found, const VectorXd& expected) {
  return (found - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

}  // namespace

TEST_CASE("torques of the regressor are those of the Newton-Euler recursion") {
  std::mt19937_64 random(11);
  for (const Robot& robot : robots()) {
    CAPTURE(robot.name);
    CAPTURE(static_cast<int>(robot.convention));
    for (int k = 0; k < 20; ++k) {
      const State s = random_state(robot, &random);
      CHECK(relative(torque(robot, s), newton_euler(robot, s.q, s.qd, s.qdd)) < 1e-12);
    }
  }
}

TEST_CASE("torques of the regressor follow from the energy alone") {
  std::mt19937_64 random(12);
  for (const Robot& robot : robots()) {
    CAPTURE(robot.name);
    CAPTURE(static_cast<int>(robot.convention));
    for (int k = 0; k < 3; ++k) {
      const State s = random_state(robot, &random);
      CHECK(relative(torque(robot, s), lagrange(robot, s.q, s.qd, s.qdd)) < 1e-6);
    }
  }
}

TEST_CASE("every column of the regressor is the torque of a parameter of one") {
  std::mt19937_64 random(13);
  const Robot robot = linked_arm(Convention::mdh, 5);
  const State s = random_state(robot, &random);
  const MatrixXd Y = regressor(RigidChain(robot), s);
  const VectorXd before = newton_euler(robot, s.q, s.qd, s.qdd);
  for (Index link = 0; link < Y.cols() / kLinkParameters; ++link) {
    for (Index k = 0; k < kLinkParameters; ++k) {
      CAPTURE(link);
      CAPTURE(k);
      Robot other = robot;
      Joint* joint = &other.joints[static_cast<std::size_t>(link)];
      set_link_parameters(link_parameters(*joint) + LinkParameters::Unit(k), joint);
      const VectorXd change = newton_euler(other, s.q, s.qd, s.qdd) - before;
      CHECK((change - Y.col(kLinkParameters * link + k)).cwiseAbs().maxCoeff() < 1e-11 * before.cwiseAbs().maxCoeff());
    }
  }
}

TEST_CASE("the regressor does not depend on the inertias, nor on where the base stands in the measurement frame") {
  std::mt19937_64 random(14);
  Robot robot = linked_arm(Convention::dh, 6);
  const State s = random_state(robot, &random);
  const MatrixXd Y = regressor(RigidChain(robot), s);
  robot.T_measurement_base = truing::frame_from_xyz_rpy({-3.0, 1.0, 8.0}, {1.0, 2.0, -0.5});
  robot.targets = {{"tool", truing::frame_from_xyz_rpy({0.1, 0.2, 0.3}, {0.1, 0.2, 0.3})}};
  for (Joint& joint : robot.joints) {
    joint.mass.reset();
    joint.inertia.reset();
  }
  CHECK(regressor(RigidChain(robot), s) == Y);
}

TEST_CASE("a base that is accelerated upwards is heavier") {
  std::mt19937_64 random(15);
  // A rail of steel under the whole arm, along the vertical, that weighs nothing.
  const Robot robot = arms::ur10();
  Robot lifted = robot;
  Joint lift = arms::joint("lift", 0, 0, 0, 0);
  lift.type = JointType::prismatic;
  lifted.joints.insert(lifted.joints.begin(), lift);
  Robot heavier = robot;
  heavier.gravity.z() -= 3.0;
  const State s = random_state(robot, &random);
  State up;
  up.q = (VectorXd(7) << 0.4, s.q).finished();
  up.qd = (VectorXd(7) << 1.7, s.qd).finished();  // a constant speed is not felt
  up.qdd = (VectorXd(7) << 3.0, s.qdd).finished();
  CHECK(relative(torque(lifted, up).tail(6), torque(heavier, s)) < 1e-13);
}

TEST_CASE("without gravity the power of the torques is the change of the kinetic energy") {
  std::mt19937_64 random(16);
  for (Robot robot : robots()) {
    robot.gravity.setZero();
    const State s = random_state(robot, &random);
    const auto kinetic = [&](double t) {
      return lagrangian(robot, s.q + t * s.qd + 0.5 * t * t * s.qdd, s.qd + t * s.qdd);
    };
    const VectorXd found = torque(robot, s);
    CHECK(std::abs(found.dot(s.qd) - derivative(kinetic, 3e-3)) < 1e-6 * found.norm() * s.qd.norm());
  }
}

TEST_CASE("a joint feels the links behind it alone") {
  std::mt19937_64 random(17);
  const Robot robot = arms::ur10();
  const MatrixXd Y = regressor(RigidChain(robot), random_state(robot, &random));
  for (Index joint = 0; joint < 6; ++joint) {
    CHECK(Y.row(joint).head(kLinkParameters * joint).isZero(0.0));
    CHECK(Y.row(joint).segment(kLinkParameters * joint, kLinkParameters).norm() > 0.1);
  }
}

TEST_CASE("tiles are the plain regressor's, on every copy of the kernel") {
  std::mt19937_64 random(18);
  for (const Robot& robot : robots()) {
    CAPTURE(robot.name);
    const RigidChain chain(robot);
    for (const Index rows : {1, 63, 64, 137}) {
      const States states(chain, rows, &random);
      for (const char* name : {"scalar", "sse2", "avx2", "avx512"}) {
        const truing::kernel::RigidFunctions* kernel = truing::kernel::rigid_functions(name);
        if (!kernel) continue;
        CAPTURE(name);
        const std::vector<MatrixXd> found = tiles(chain, *kernel, states, 0, rows);
        double worst = 0.0, largest = 0.0;
        for (Index row = 0; row < rows; ++row) {
          const MatrixXd Y = regressor(chain, states.at(row));
          largest = std::max(largest, Y.cwiseAbs().maxCoeff());
          for (Index k = 0; k < chain.driven(); ++k)
            worst = std::max(worst, (found[static_cast<std::size_t>(k)].row(row) - Y.row(k)).cwiseAbs().maxCoeff());
        }
        CHECK(worst < 1e-13 * largest);
      }
    }
  }
}

TEST_CASE("a row of a tile does not depend on the rows around it, to the bit") {
  std::mt19937_64 random(19);
  const RigidChain chain(linked_arm(Convention::urdf, 8));
  const States states(chain, 200, &random);
  const truing::kernel::RigidFunctions& kernel = truing::kernel::rigid_functions();
  const std::vector<MatrixXd> all = tiles(chain, kernel, states, 0, 200);
  const std::vector<std::pair<Index, Index>> parts = {{0, 1}, {1, 90}, {90, 103}, {103, 200}};
  for (const auto& part : parts) {
    const std::vector<MatrixXd> found = tiles(chain, kernel, states, part.first, part.second);
    for (std::size_t k = 0; k < found.size(); ++k)
      CHECK(found[k].topRows(part.second - part.first) == all[k].middleRows(part.first, part.second - part.first));
  }
}

TEST_CASE("torques and weights without the regressor are those by it, on every kind of robot") {
  std::mt19937_64 random(27);
  for (const Robot& robot : robots()) {
    CAPTURE(robot.name);
    const RigidChain chain(robot);
    const States states(chain, 75, &random);
    const VectorXd parameters = random_vector(kLinkParameters * chain.links(), 1.0, &random);
    const MatrixXd torques = chain.torques(states.q, states.qd, states.qdd, parameters);
    const MatrixXd weights = chain.weights(states.q, parameters);
    States resting = states;
    resting.qd.setZero();
    resting.qdd.setZero();
    for (Index row = 0; row < 75; ++row) {
      CHECK(relative(torques.row(row).transpose(), regressor(chain, states.at(row)) * parameters) < 1e-12);
      CHECK(relative(weights.row(row).transpose(), regressor(chain, resting.at(row)) * parameters) < 1e-12);
    }
  }
}

TEST_CASE("a column of the mass matrix is what an acceleration of one takes at rest, without gravity") {
  std::mt19937_64 random(28);
  for (Robot robot : robots()) {
    CAPTURE(robot.name);
    const States states(RigidChain(robot), 75, &random);
    const VectorXd parameters = link_parameters(robot);
    const std::vector<MatrixXd> found = mass_matrix_columns(robot, states.q, parameters);
    robot.gravity.setZero();
    const RigidChain chain(robot);
    for (Index row = 0; row < 75; ++row) {
      MatrixXd mass(chain.driven(), chain.driven());
      for (Index k = 0; k < chain.driven(); ++k) {
        const State one{states.q.row(row), VectorXd::Zero(chain.driven()), VectorXd::Unit(chain.driven(), k)};
        mass.col(k) = regressor(chain, one) * parameters;
        CHECK(relative(found[static_cast<std::size_t>(k)].row(row).transpose(), mass.col(k)) < 1e-11);
      }
    }
  }
}

TEST_CASE("torques change with a reading's motion as their differences do, on every kind of robot") {
  std::mt19937_64 random(29);
  const Index rows = 75;
  for (const Robot& robot : robots()) {
    CAPTURE(robot.name);
    const RigidChain chain(robot);
    const States states(chain, rows, &random), change(chain, rows, &random);
    const VectorXd parameters = random_vector(kLinkParameters * chain.links(), 1.0, &random);
    const RigidChain::Changes found =
        chain.torque_changes(states.q, states.qd, states.qdd, parameters, change.q, change.qd, change.qdd);
    const std::vector<MatrixXd> masses = chain.mass_matrices(states.q, parameters);
    REQUIRE(found.torques.size() == static_cast<std::size_t>(chain.driven()));
    const RigidChain::Changes alone =
        chain.torque_changes(states.q, states.qd, states.qdd, parameters, change.q, change.qd, change.qdd, false);
    CHECK(alone.torques == found.torques);
    CHECK(alone.masses.empty());
    for (Index k = 0; k < chain.driven(); ++k) {
      const auto torques = [&](double part) {
        States moved = states;
        moved.q.col(k) += part * change.q.col(k);
        moved.qd.col(k) += part * change.qd.col(k);
        moved.qdd.col(k) += part * change.qdd.col(k);
        return chain.torques(moved.q, moved.qd, moved.qdd, parameters);
      };
      const double h = 1e-3;  // Richardson: the error is of fourth order
      const MatrixXd expected =
          (8.0 * (torques(h) - torques(-h)) - (torques(2.0 * h) - torques(-2.0 * h))) / (12.0 * h);
      const auto at = static_cast<std::size_t>(k);
      CHECK((found.torques[at] - expected).cwiseAbs().maxCoeff() < 1e-8 * expected.cwiseAbs().maxCoeff());
      CHECK((found.masses[at] - masses[at]).cwiseAbs().maxCoeff() < 1e-12 * masses[at].cwiseAbs().maxCoeff());
    }
  }
}

TEST_CASE("beyond the angles that the kernel takes the plain regressor stands in for it") {
  const Robot robot = arms::ur10();
  const MatrixXd near = MatrixXd::Constant(1, 6, 0.3), rate = MatrixXd::Constant(1, 6, 0.7);
  MatrixXd far = near;
  far(0, 2) += 2.0 * truing::math::kPi * 1e6;
  CHECK(RigidChain(robot).is_near(near));
  CHECK_FALSE(RigidChain(robot).is_near(far));
  const MatrixXd expected = torque_regressor(robot, near, rate, rate), found = torque_regressor(robot, far, rate, rate);
  CHECK((found - expected).cwiseAbs().maxCoeff() < 1e-7);
  CHECK((rigid_torques(robot, far, rate, rate) - rigid_torques(robot, near, rate, rate)).cwiseAbs().maxCoeff() < 1e-6);
}

TEST_CASE("sines and cosines of the kernel are those of the library") {
  const VectorXd angles = VectorXd::LinSpaced(4000, -2e3, 3e3);
  for (const char* name : {"scalar", "sse2", "avx2", "avx512"}) {
    const truing::kernel::RigidFunctions* kernel = truing::kernel::rigid_functions(name);
    if (!kernel) continue;
    CAPTURE(name);
    VectorXd sine = angles, cosine(angles.size());
    kernel->sine_cosine(sine.data(), static_cast<int>(angles.size()), sine.data(), cosine.data());
    CHECK((sine.array() - angles.array().sin()).abs().maxCoeff() < 3e-16);
    CHECK((cosine.array() - angles.array().cos()).abs().maxCoeff() < 3e-16);
  }
}

TEST_CASE("set_link_parameters is the inverse of link_parameters") {
  const Robot robot = linked_arm(Convention::dh, 7);
  for (const Joint& joint : robot.joints) {
    Joint other;
    set_link_parameters(link_parameters(joint), &other);
    CHECK(*other.mass == doctest::Approx(*joint.mass));
    CHECK((other.center_of_mass - joint.center_of_mass).norm() < 1e-14);
    CHECK((*other.inertia - *joint.inertia).norm() < 1e-13);
    CHECK((link_parameters(other) - link_parameters(joint)).norm() < 1e-13);
  }
  // A rotor: inertia, and a mass that is counted elsewhere.
  Joint rotor;
  const LinkParameters turning = (LinkParameters() << 0, 0, 0, 0, 1, 2, 3, 0.1, 0.2, 0.3).finished();
  set_link_parameters(turning, &rotor);
  CHECK(link_parameters(rotor) == turning);
}

TEST_CASE("a first moment without a mass is refused: no link has it") {
  Joint joint;
  LinkParameters parameters = LinkParameters::Zero();
  parameters[2] = 0.5;
  CHECK_THROWS_WITH_AS(set_link_parameters(parameters, &joint), doctest::Contains("mass"), std::invalid_argument);
}

TEST_CASE("what is not known of a link counts as zero") {
  Joint joint;
  CHECK(link_parameters(joint).isZero(0.0));
  joint.mass = 2.0;
  joint.center_of_mass = {0.0, 0.0, 3.0};
  const LinkParameters expected = (LinkParameters() << 2, 0, 0, 6, 18, 18, 0, 0, 0, 0).finished();
  CHECK(link_parameters(joint) == expected);
}
