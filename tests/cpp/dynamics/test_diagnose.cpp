// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>

#include <doctest/doctest.h>

#include "dynamics/judge.hpp"
#include "dynamics/turn.hpp"
#include "support/sanitized.hpp"
#include "support/swung_arm.hpp"
#include "truing/dynamics.hpp"

using namespace truing;
using swung::level_arm;
using swung::measured;
using swung::swing;
using swung::with_friction;

namespace {

std::vector<Recording> recorded(const Robot& truth, const std::vector<TorqueEffect>& own = {}) {
  std::vector<Recording> out;
  for (int k = 0; k < 5; ++k) {
    out.push_back(measured(truth, swing(k, kSanitized ? 8.0 : 20.0), static_cast<std::uint64_t>(k), own));
    out.back().test = k > 2;
  }
  return out;
}

/// Recordings of an arm at whose first joint a law of no catalogue acts as well.
std::vector<Recording> recorded_with(const std::string& name, std::function<Eigen::MatrixXd(const Motion&)> basis) {
  const TorqueEffect own{name, name, [=](const Robot&, std::size_t joint, const MotionRange&) {
                           TorqueTerm term;
                           term.parameter = name + ".J1";
                           term.unit = "Nm";
                           term.joints = {joint};
                           term.needs_torque = true;
                           term.basis = basis;
                           return std::vector<TorqueForm>{{term}};
                         }};
  Robot truth = with_friction(level_arm());
  truth.torque_effects.push_back({name, {"J1"}, {{name + ".J1", 1.0}}});
  return recorded(truth, {own});
}

double deviation(const Eigen::VectorXd& x) {
  return std::sqrt((x.array() - x.mean()).square().sum() / static_cast<double>(x.size()));
}

const std::vector<TorqueError>& held_out(const TorqueDiagnosis& d, const std::string& model) {
  return std::find_if(d.errors.begin(), d.errors.end(), [&](const auto& e) { return e.model == model; })->held_out;
}

/// The first row from `begin` on at which a position turns round.
Eigen::Index turning_row(const Eigen::VectorXd& q, Eigen::Index begin) {
  Eigen::Index row = begin + 1;
  while (row + 2 < q.size() && (q[row] - q[row - 1]) * (q[row + 1] - q[row]) > 0.0) ++row;
  return row;
}

const FoundTorqueEffect* found(const TorqueDiagnosis& d, const std::string& effect) {
  const auto at = std::find_if(d.effects.begin(), d.effects.end(), [&](const auto& e) { return e.effect == effect; });
  return at == d.effects.end() ? nullptr : &*at;
}

}  // namespace

TEST_CASE("a spring that nobody put into the model is named with its stiffness") {
  Robot truth = with_friction(level_arm());
  truth.torque_effects.push_back({"spring", {"J2"}, {{"spring.J2", 4.0}}});
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recorded(truth));
  REQUIRE(!d.effects.empty());
  CHECK(d.effects.front().effect == "spring");
  CHECK(d.effects.front().joints == std::vector<std::string>{"J2"});
  CHECK(std::abs(d.effects.front().parameters.front().value - 4.0) < 0.4);
  CHECK(d.effects.front().probability > 0.9);
}

TEST_CASE("a load at the flange is named with its mass, and with the link that looks the same") {
  Robot truth = with_friction(level_arm());
  truth.joints[1].mass = 3.0 + 1.0;  // of a load at the last frame's origin
  truth.joints[1].center_of_mass = {-0.15, 0.0, 0.0};
  truth.joints[1].inertia = Eigen::Vector3d(0.004, 0.07, 0.07).asDiagonal();  // 3 kg at -0.2, 1 kg at 0
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recorded(truth));
  REQUIRE(!d.effects.empty());
  const FoundTorqueEffect& first = d.effects.front();
  CHECK(!first.standard);
  CHECK(first.probability > 0.9);
  std::vector<std::string> members{first.effect};
  for (const TorqueAlternative& other : first.confounded_with) members.push_back(other.effect);
  for (const char* member : {"payload", "link_inertia"})
    CHECK_MESSAGE(std::find(members.begin(), members.end(), member) != members.end(), member);
  CHECK(std::any_of(d.classes.begin(), d.classes.end(), [](const TorqueClass& c) {
    return std::find(c.effects.begin(), c.effects.end(), "motor_constant") != c.effects.end();
  }));
}

TEST_CASE("an effect of one's own is named like the catalogue's") {
  const TorqueEffect cable{"cable", "a cable that pulls", [](const Robot&, std::size_t joint, const MotionRange&) {
                             TorqueTerm term;
                             term.parameter = joint == 0 ? "cable.J1" : "cable.J2";
                             term.unit = "Nm";
                             term.joints = {joint};
                             term.basis = [joint](const Motion& m) -> Eigen::MatrixXd {
                               return m.q.col(static_cast<Eigen::Index>(joint)).array().square().cube();
                             };
                             return std::vector<TorqueForm>{{term}};
                           }};
  Robot truth = with_friction(level_arm());
  truth.torque_effects.push_back({"cable", {"J1"}, {{"cable.J1", 5.0}}});
  TorqueDiagnoseOptions options;
  options.own_effects = {cable};
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recorded(truth, {cable}), options);
  const FoundTorqueEffect* named = found(d, "cable");
  REQUIRE(named != nullptr);
  CHECK(named->joints == std::vector<std::string>{"J1"});
  CHECK(std::abs(named->parameters.front().value - 5.0) < 0.5);
}

TEST_CASE("friction alone is standard practice, and no gap beyond it is named") {
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recorded(with_friction(level_arm())));
  CHECK(d.verdict == Verdict::none);
  for (const FoundTorqueEffect& effect : d.effects) CHECK(effect.standard);
}

TEST_CASE("drives' constants are not searched for beside masses that are fitted") {
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recorded(with_friction(level_arm())));
  CHECK(std::any_of(d.not_testable.begin(), d.not_testable.end(),
                    [](const NotTestable& n) { return n.reason == Untestable::same_as_masses; }));
}

TEST_CASE("one drive's constant is named beside the file's masses, with the links that it may be as well") {
  Robot truth = with_friction(level_arm());
  truth.torque_effects.push_back({"motor_constant", {"J2"}, {{"motor_constant.J2", 0.15}}});
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recorded(truth));
  const FoundTorqueEffect* constant = found(d, "motor_constant");
  REQUIRE(constant != nullptr);
  CHECK(&d.effects.front() == constant);
  CHECK(constant->joints == std::vector<std::string>{"J2"});
  CHECK(std::abs(constant->parameters.front().value - 0.15) < 0.02);
  CHECK(std::any_of(d.classes.begin(), d.classes.end(),
                    [](const TorqueClass& c) { return c.sentence.find("share one scale") != std::string::npos; }));
}

TEST_CASE("what may be one factor of all drives is said so, and no link alone is sure") {
  std::vector<Recording> all = recorded(with_friction(level_arm()));
  for (Recording& one : all) one.torque *= 1.2;
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), all);
  int named = 0;
  for (const FoundTorqueEffect& e : d.effects) {
    if (e.effect != "link_inertia" && e.effect != "payload") continue;
    ++named;
    CHECK(std::any_of(e.confounded_with.begin(), e.confounded_with.end(), [](const TorqueAlternative& a) {
      return a.effect == "motor_constant" && a.joints == std::vector<std::string>{"J1", "J2"};
    }));
  }
  CHECK(named > 0);
}

TEST_CASE("a function that helps the recordings it was fitted to, and no other, is not said") {
  const auto twisted = [](bool held_out_too) {
    std::vector<Recording> all = recorded(with_friction(level_arm()));
    for (Recording& one : all)
      if (held_out_too || !one.test)
        one.torque.col(0).array() += 3.0 * (2.0 * one.position.col(1).array()).sin().cube();
    return dynamics::diagnose(level_arm(), all).unknown;
  };
  CHECK(!twisted(true).empty());
  CHECK(twisted(false).empty());
}

// Eight seconds, as under sanitizers, do not show what the law lacks.
TEST_CASE("what the law of a named effect lacks is said of that law, and is nothing unknown" *
          doctest::skip(kSanitized)) {
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recorded_with("hardening", [](const Motion& m) {
                                                 const Eigen::ArrayXd q = m.q.col(0).array();
                                                 return Eigen::MatrixXd(6.0 * (q + 3.0 * q.cube()));
                                               }));
  REQUIRE(found(d, "spring") != nullptr);
  CHECK(found(d, "spring")->joints == std::vector<std::string>{"J1"});
  CHECK(d.unknown.empty());
  CHECK(std::any_of(d.warnings.begin(), d.warnings.end(), [](const std::string& text) {
    return text == "spring at J1 has not quite the law that was fitted: what is left goes with angle";
  }));
}

TEST_CASE("a detent that is narrower than a wide function is unknown over the joint's angle") {
  const TorqueDiagnosis d =
      dynamics::diagnose(level_arm(), recorded_with("detent", [](const Motion& m) -> Eigen::MatrixXd {
                           const Eigen::ArrayXd x = (m.q.col(0).array() - 0.2) / 0.07;
                           return x * (-0.5 * x.square()).exp();
                         }));
  REQUIRE(!d.unknown.empty());
  CHECK(d.unknown.front().joint == "J1");
  CHECK(d.unknown.front().inputs == std::vector<std::string>{"angle"});
  const std::vector<TorqueError>&named = held_out(d, "named"), &whole = held_out(d, "with_unknown");
  CHECK(whole[0].rms < 0.9 * named[0].rms);
  CHECK(whole[1].rms == named[1].rms);  // no function is there
}

// Fitted to rows in which J1 moves, it is wrong at most of those at which it rests.
TEST_CASE("a function that makes a resting joint worse is not in the errors with the unknown") {
  std::vector<Recording> all;
  for (int k = 0; k < 5; ++k) {
    Recording one = swing(k, kSanitized ? 12.0 : 24.0);
    const Eigen::Index rest = turning_row(one.position.col(0), one.time.size() / 3);
    one.position.col(0).tail(one.time.size() - rest).setConstant(one.position(rest, 0));
    one = measured(with_friction(level_arm()), one, static_cast<std::uint64_t>(k));
    one.torque.col(0).head(rest).array() += 3.0 * (2.0 * one.position.col(1).head(rest).array()).sin().cube();
    one.test = k > 2;
    all.push_back(one);
  }
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), all);
  REQUIRE(!d.unknown.empty());
  CHECK(d.unknown.front().joint == "J1");
  CHECK(held_out(d, "with_unknown")[0].rms <= held_out(d, "named")[0].rms);
}

TEST_CASE("what gives way under load and stays is unknown over the load and its past") {
  const TorqueDiagnosis d =
      dynamics::diagnose(level_arm(), recorded_with("play", [](const Motion& m) -> Eigen::MatrixXd {
                           const double width = 0.6 * deviation(m.torque.col(0));
                           return dynamics::stop_operator(m.torque.col(0), width);
                         }));
  REQUIRE(!d.unknown.empty());
  CHECK(d.unknown.front().joint == "J1");
  CHECK(d.unknown.front().inputs == std::vector<std::string>{"load", "its past"});
  CHECK(d.unknown.front().curve.empty());  // what is remembered has no one torque for a load
}

TEST_CASE("where nothing is hidden there is no remainder") {
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recorded(with_friction(level_arm())));
  CHECK(d.remainders.empty());
  CHECK(d.orders.empty());
  const std::vector<TorqueError>&named = held_out(d, "named"), &whole = held_out(d, "with_unknown");
  for (std::size_t j = 0; j < named.size(); ++j) CHECK(whole[j].rms == named[j].rms);
}

TEST_CASE("what cannot be used is refused in words") {
  std::vector<Recording> recordings = recorded(with_friction(level_arm()));
  TorqueDiagnoseOptions options;
  options.cutoff = 0.0;
  CHECK_THROWS_WITH_AS(dynamics::diagnose(level_arm(), recordings, options), "cutoff must be above 0 Hz",
                       std::invalid_argument);
  CHECK_THROWS_WITH_AS(dynamics::diagnose(level_arm(), {}), "there are no recordings", std::invalid_argument);
  Robot massless = level_arm();
  for (Joint& joint : massless.joints) joint.mass.reset();
  CHECK_THROWS_AS(dynamics::diagnose(massless, recordings), std::invalid_argument);
  recordings.front().torque.resize(0, 0);
  CHECK_THROWS_AS(dynamics::diagnose(level_arm(), recordings), std::invalid_argument);
}

TEST_CASE("recordings are parted so that some are fitted and some are held out") {
  std::vector<Recording> recordings = recorded(with_friction(level_arm()));
  for (Recording& one : recordings) one.test = true;
  CHECK_THROWS_WITH_AS(dynamics::diagnose(level_arm(), recordings),
                       "all recordings are marked as test (column set): none is left to be fitted",
                       std::invalid_argument);
  for (Recording& one : recordings) one.test = false;
  const TorqueFit five = dynamics::identify(level_arm(), recordings);
  CHECK(five.held_out.size() == 2);
  recordings.resize(3);
  const TorqueFit three = dynamics::identify(level_arm(), recordings);
  CHECK(three.held_out == std::vector<std::string>{"blocks of time"});
  for (const TorqueFit* fit : {&five, &three}) {
    for (const TorqueErrors& errors : fit->errors) CHECK(errors.held_out.front().n > 0.0);
  }
}

TEST_CASE("recordings in which nothing moves are refused") {
  std::vector<Recording> recordings = recorded(with_friction(level_arm()));
  for (Recording& one : recordings) one.position.setConstant(0.3);
  CHECK_THROWS_AS(dynamics::diagnose(level_arm(), recordings), std::invalid_argument);
}

TEST_CASE("what does not hold on held-out recordings is said first, and is not in the robot") {
  Robot one = with_friction(level_arm()), other = with_friction(level_arm());
  one.torque_effects.push_back({"spring", {"J2"}, {{"spring.J2", 4.0}}});
  other.torque_effects.push_back({"spring", {"J2"}, {{"spring.J2", -4.0}}});
  std::vector<Recording> recordings = recorded(one);
  const std::vector<Recording> others = recorded(other);
  for (std::size_t k = 0; k < recordings.size(); ++k) {
    if (recordings[k].test) recordings[k] = others[k];
  }
  const TorqueDiagnosis d = dynamics::diagnose(level_arm(), recordings);
  REQUIRE(found(d, "spring") != nullptr);
  CHECK(d.verdict == Verdict::does_not_hold);
  CHECK(std::none_of(d.robot.torque_effects.begin(), d.robot.torque_effects.end(),
                     [](const AppliedEffect& e) { return e.effect == "spring"; }));
  CHECK(std::any_of(d.robot.torque_effects.begin(), d.robot.torque_effects.end(),
                    [](const AppliedEffect& e) { return e.effect == "coulomb"; }));
}

TEST_CASE("joints at which standard practice predicts better are said with both errors") {
  const auto errors = [](double first, double second) {
    TorqueErrors out;
    out.held_out = {{"J1", 1.0, first, 100.0}, {"J2", 1.0, second, 100.0}};
    return out;
  };
  CHECK(dynamics::worse_joints(errors(5.0, 24.3), errors(3.0, 31.4)) ==
        std::vector<std::string>{"J2 (31.4 % in place of 24.3 %)"});
  CHECK(dynamics::worse_joints(errors(5.0, 24.3), errors(5.1, 24.0)).empty());  // rounding is not worse
}

TEST_CASE("the covariance is that of the parameters, whose standard errors are on its diagonal") {
  const auto agree = [](const std::vector<Parameter>& parameters, const Eigen::MatrixXd& covariance) {
    Eigen::Index k = 0;
    for (const Parameter& parameter : parameters) {
      if (parameter.frozen) continue;
      CHECK(std::sqrt(covariance(k, k)) == doctest::Approx(parameter.sigma).epsilon(1e-12));
      ++k;
    }
    CHECK(covariance.rows() == k);
    CHECK(covariance.isApprox(covariance.transpose(), 1e-9));
    CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(covariance).eigenvalues().minCoeff() > 0.0);
  };
  const auto recordings = recorded(with_friction(level_arm()));
  const TorqueFit fit = dynamics::identify(level_arm(), recordings);
  agree(fit.parameters, fit.covariance);
  const TorqueDiagnosis found = dynamics::diagnose(level_arm(), recordings);
  std::vector<Parameter> all;
  for (const FoundTorqueEffect& e : found.effects) all.insert(all.end(), e.parameters.begin(), e.parameters.end());
  agree(all, found.covariance);
}
