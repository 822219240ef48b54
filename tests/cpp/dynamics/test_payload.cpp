// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <doctest/doctest.h>

#include "support/sanitized.hpp"
#include "support/swung_arm.hpp"
#include "truing/dynamics.hpp"

using namespace truing;
using swung::swing;

namespace {

/// With a tool beside the last frame.
Robot lever() {
  Robot out = swung::level_arm();
  out.targets.front()
      .T_last_target.translate(Eigen::Vector3d(0.05, -0.02, 0.1))
      .rotate(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()));
  return out;
}

/// As a robot whose last link has grown by the payload, at this place in the tool's frame.
Robot loaded(const Robot& robot, double mass, const Eigen::Vector3d& place) {
  Robot out = robot;
  Joint point;
  point.mass = mass;
  point.center_of_mass = robot.targets.front().T_last_target * place;
  point.inertia = Eigen::Matrix3d::Zero();
  dynamics::LinkParameters sum = dynamics::link_parameters(out.joints.back());
  sum += dynamics::link_parameters(point);
  dynamics::set_link_parameters(sum, &out.joints.back());
  return out;
}

void put_on(double mass, Recording* recording) {
  recording->columns["payload_kg"] = Eigen::VectorXd::Constant(recording->time.size(), mass);
}

/// Heavier links than in the file, friction, and drives that give another torque per ampere.
Robot hidden() {
  Robot out = swung::with_friction(lever());
  out.joints[0].mass = 3.6;
  out.joints[1].mass = 2.5;
  out.torque_effects.push_back({"motor_constant", {"J1"}, {{"motor_constant.J1", 0.15}}});
  out.torque_effects.push_back({"motor_constant", {"J2"}, {{"motor_constant.J2", -0.12}}});
  return out;
}

std::vector<Recording> recorded(const Robot& truth, const std::vector<double>& payloads) {
  std::vector<Recording> out;
  for (std::size_t k = 0; k < payloads.size(); ++k) {
    Recording one = swing(static_cast<int>(k), kSanitized ? 8.0 : 20.0);
    put_on(payloads[k], &one);
    out.push_back(swung::measured(truth, one, k));
    out.back().test = k + 1 == payloads.size();
  }
  return out;
}

double value_of(const std::vector<Parameter>& parameters, const std::string& name) {
  const auto at = std::find_if(parameters.begin(), parameters.end(), [&](const auto& p) { return p.name == name; });
  REQUIRE(at != parameters.end());
  return at->value;
}

/// What gravity pulls at: m a + m x of the last link about its joint [kg m].
double moment_about_joint(const Robot& robot) {
  const dynamics::LinkParameters links = dynamics::link_parameters(robot.joints[1]);
  return links[0] * robot.joints[1].a + links[1];
}

}  // namespace

TEST_CASE("a payload that is stated weighs as much as a last link that has grown by it") {
  Recording bare = swing(0, 8.0), carrying = bare;
  const Eigen::Vector3d place(0.03, 0.0, 0.08);
  put_on(2.0, &carrying);
  carrying.columns["payload_x_m"] = Eigen::VectorXd::Constant(bare.time.size(), place.x());
  carrying.columns["payload_z_m"] = Eigen::VectorXd::Constant(bare.time.size(), place.z());
  const Eigen::MatrixXd stated = dynamics::predict(lever(), carrying).torque;
  const Eigen::MatrixXd grown = dynamics::predict(loaded(lever(), 2.0, place), bare).torque;
  CHECK((stated - grown).cwiseAbs().maxCoeff() < 1e-9);
  CHECK((stated - dynamics::predict(lever(), bare).torque).cwiseAbs().maxCoeff() > 1.0);
}

TEST_CASE("known payloads tell masses from the drives' constants, to 3 %") {
  const Robot truth = hidden();
  TorqueOptions options;
  options.effects = {{"coulomb", {}}, {"viscous", {}}, {"motor_constant", {}}};
  const TorqueFit fit = dynamics::identify(lever(), recorded(truth, {0.0, 4.0, 0.0, 4.0, 2.0}), options);
  CHECK(1.0 + value_of(fit.parameters, "motor_constant.J1") == doctest::Approx(1.15).epsilon(0.03));
  CHECK(1.0 + value_of(fit.parameters, "motor_constant.J2") == doctest::Approx(0.88).epsilon(0.03));
  CHECK(moment_about_joint(fit.robot) == doctest::Approx(moment_about_joint(truth)).epsilon(0.03));
}

TEST_CASE("one payload everywhere leaves masses and drives' constants one scale, and that is said") {
  TorqueOptions options;
  options.effects = {{"coulomb", {}}, {"viscous", {}}, {"motor_constant", {}}};
  const TorqueFit fit = dynamics::identify(lever(), recorded(hidden(), {4.0, 4.0, 4.0, 4.0}), options);
  CHECK(std::any_of(fit.warnings.begin(), fit.warnings.end(),
                    [](const std::string& w) { return w.find("share one scale") != std::string::npos; }));
}

TEST_CASE("a diagnosis names the drives' constants where known payloads differ, and only there") {
  const auto has_scale = [](const TorqueDiagnosis& d) {
    return std::any_of(d.not_testable.begin(), d.not_testable.end(),
                       [](const NotTestable& n) { return n.reason == Untestable::same_as_masses; });
  };
  const TorqueDiagnosis d = dynamics::diagnose(lever(), recorded(hidden(), {0.0, 4.0, 2.0, 0.0, 4.0, 3.0, 2.0}));
  CHECK(!has_scale(d));
  for (const auto& hidden_one : {std::pair{std::string("J1"), 1.15}, std::pair{std::string("J2"), 0.88}}) {
    const std::string& joint = hidden_one.first;
    const double constant = hidden_one.second;
    const auto at = std::find_if(d.effects.begin(), d.effects.end(), [&](const FoundTorqueEffect& e) {
      return e.effect == "motor_constant" && e.joints.front() == joint;
    });
    REQUIRE(at != d.effects.end());
    CHECK(1.0 + at->parameters.front().value == doctest::Approx(constant).epsilon(0.03));
  }
  CHECK(std::none_of(d.classes.begin(), d.classes.end(),
                     [](const TorqueClass& c) { return c.sentence.find("share one scale") != std::string::npos; }));
  CHECK(has_scale(dynamics::diagnose(lever(), recorded(hidden(), {4.0, 4.0, 4.0, 4.0, 4.0}))));
}

TEST_CASE("a known payload whose centre is elsewhere than stated is found there") {
  const Eigen::Vector3d place(0.04, 0.06, 0.0);  // across the axes, which are parallel to z of the last frame
  std::vector<Recording> recordings = recorded(hidden(), {0.0, 3.0, 0.0, 3.0, 3.0});
  Robot truth = hidden();
  for (Recording& one : recordings) {
    const double mass = one.columns.at("payload_kg")[0];
    Recording bare = one;
    bare.columns.clear();
    one.torque += dynamics::predict(loaded(truth, mass, place), bare, 30.0).torque -
                  dynamics::predict(loaded(truth, mass, Eigen::Vector3d::Zero()), bare, 30.0).torque;
  }
  TorqueOptions options;
  options.effects = {{"coulomb", {}}, {"viscous", {}}, {"motor_constant", {}}, {"payload_place", {}}};
  const TorqueFit fit = dynamics::identify(lever(), recordings, options);
  // Where the axes are parallel what lies along them does not show: compared is what does.
  const Eigen::Matrix3d to_last = lever().targets.front().T_last_target.linear();
  const Eigen::Vector3d found = to_last * Eigen::Vector3d(value_of(fit.parameters, "payload_place.x"),
                                                          value_of(fit.parameters, "payload_place.y"),
                                                          value_of(fit.parameters, "payload_place.z"));
  CHECK((found - to_last * place).head<2>().norm() < 0.01);
}

TEST_CASE("a payload that only some recordings state is none in the others, and that is said") {
  std::vector<Recording> recordings = recorded(hidden(), {0.0, 4.0, 0.0, 4.0, 2.0});
  recordings[2].columns.clear();
  const TorqueFit fit = dynamics::identify(lever(), recordings);
  CHECK(std::find(fit.warnings.begin(), fit.warnings.end(),
                  "no payload_kg in motion2: taken to be without a payload") != fit.warnings.end());
  CHECK_NOTHROW(dynamics::diagnose(lever(), recordings));
}
