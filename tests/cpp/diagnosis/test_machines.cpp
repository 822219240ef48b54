// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Laws that machines have, hidden in data in another form than the catalogue's: what the diagnosis calls them.

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "diagnosis/candidates.hpp"
#include "support/arms.hpp"
#include "support/four_bar.hpp"
#include "support/sanitized.hpp"

using namespace arms;
using truing::diagnose;
using truing::DiagnoseOptions;
using truing::Diagnosis;
using truing::Effect;
using truing::Inputs;
using truing::Term;
using truing::Verdict;

namespace machines {
namespace {

constexpr double kNoise = 3e-5;  // [m] of one coordinate

/// What happens while measuring, by row.
struct Conditions {
  bool directions = false;
  std::function<double(std::size_t)> temperature{}, payload{};
};

/// A joint that moves by `law`, which is in no catalogue; of a passive joint as well.
Effect hidden(const std::string& joint, const std::function<double(const Inputs&)>& law) {
  Effect effect;
  effect.name = "hidden " + joint;
  effect.terms = [joint, law, name = effect.name](const Robot&, std::size_t, const truing::Measurements&) {
    Term term;
    term.parameter = name + ".size";
    term.unit = "rad";
    term.site = joint;
    term.basis = law;
    term.needs_gravity = true;
    return std::vector<Term>{term};
  };
  effect.per_joint = false;
  return effect;
}

/// Random poses of `truth` with hidden effects of size 1, measured.
std::unique_ptr<Table> measured(Robot truth, const std::vector<Effect>& own, std::size_t rows, unsigned seed,
                                const Conditions& conditions = {}) {
  truth.T_measurement_base = somewhere();
  for (const Effect& effect : own) truth.effects.push_back({effect.name, {}, {{effect.name + ".size", 1.0}}});
  auto table = random_joints(truth, rows, seed);
  std::mt19937_64 random(seed + 1);
  for (std::size_t k = 0; conditions.directions && k < table->data.joints.size(); ++k) {
    std::vector<double> side(rows);
    for (double& one : side) one = random() & 1 ? 1.0 : -1.0;
    table->data.direction.push_back(table->add(side));
  }
  const auto by_row = [&](const std::function<double(std::size_t)>& f) {
    std::vector<double> values(rows);
    for (std::size_t row = 0; row < rows; ++row) values[row] = f(row);
    return table->add(values);
  };
  if (conditions.temperature) table->data.temperature = by_row(conditions.temperature);
  if (conditions.payload) table->data.payload = by_row(conditions.payload);
  const truing::Prediction predicted = truing::predict(truth, table->data, own, 1);
  std::normal_distribution<double> normal(0.0, kNoise);
  for (Eigen::Index k = 0; k < 3; ++k) {
    table->data.position[static_cast<std::size_t>(k)] =
        by_row([&](std::size_t row) { return predicted.position(static_cast<Eigen::Index>(row), k) + normal(random); });
  }
  return table;
}

std::string names(const Diagnosis& d) {
  std::string out;
  for (const truing::FoundEffect& e : d.effects) {
    out += e.effect;
    for (const std::string& joint : e.joints) out += " " + joint;
    out += " " + std::to_string(e.probability) + "; ";
  }
  for (const truing::UnknownEffect& u : d.unknown) {
    out += "unknown " + u.joint;
    for (const std::string& input : u.inputs) out += " " + input;
    out += "; ";
  }
  return out;
}

bool is_named(const Diagnosis& d, const std::string& effect, const std::vector<std::string>& joints) {
  return std::any_of(d.effects.begin(), d.effects.end(),
                     [&](const truing::FoundEffect& e) { return e.effect == effect && e.joints == joints; });
}

/// A palletizer whose cranks stay clear of their dead centres.
Robot linked() {
  Robot robot = palletizer();
  for (const int k : {1, 2}) {
    robot.joints[k].lower = -0.6;
    robot.joints[k].upper = 0.6;
  }
  return robot;
}

/// Elbow and wrist turn as far as a robot's do.
Robot arm() {
  Robot robot = ur10();
  for (Joint& j : robot.joints) {
    j.lower = -2.0;
    j.upper = 2.0;
  }
  return robot;
}

}  // namespace

TEST_CASE("diagnose names a parallelogram with unequal bars by its exact closure, wherever its base bar points") {
  const four_bar::Bars bars = {0.4, 0.2503, 0.4005, 0.25};
  for (const double phase : {1.1, 1.57, 2.0}) {
    const auto rods = hidden("J4", [bars, phase](const Inputs& in) {
      const double theta = phase + in.joints[1];
      return four_bar::rocker_angle(bars, theta) - theta;
    });
    const auto table = measured(linked(), {rods}, 160, 900);
    const Diagnosis d = diagnose(linked(), table->data);
    CAPTURE(phase);
    INFO(names(d));
    CHECK(is_named(d, "linkage", {"J4"}));
    CHECK(d.effects.size() == 1);
    CHECK(d.unknown.empty());
    CHECK(d.after.rms < 1.2 * d.noise_floor);
  }
}

TEST_CASE("diagnose takes two unequal parallelograms for what they are" * doctest::skip(kSanitized)) {
  const auto rods = hidden("J4", [](const Inputs& in) {
    const double lower = 1.3 + in.joints[1], upper = 1.8 + in.joints[1] + in.joints[2];
    return four_bar::rocker_angle({0.4, 0.25, 0.4004, 0.25}, lower) - lower +
           four_bar::rocker_angle({0.4, 0.2503, 0.4, 0.25}, upper) - upper;
  });
  const auto table = measured(linked(), {rods}, 200, 910);
  const Diagnosis d = diagnose(linked(), table->data);
  INFO(names(d));
  CHECK(is_named(d, "linkage", {"J4"}));
  CHECK(d.unknown.empty());
  CHECK(d.after.rms < 1.2 * d.noise_floor);
}

TEST_CASE("diagnose names the parallelogram that drives an elbow by its exact closure") {
  const four_bar::Bars bars = {0.9, 0.4006, 0.9004, 0.4};
  for (const auto& [half, phase] : {std::make_pair(0.7, 1.3), std::make_pair(1.0, 1.57), std::make_pair(0.9, 1.8)}) {
    Robot robot = arm();
    robot.joints[2].lower = -half;
    robot.joints[2].upper = half;
    const auto rods = hidden("J3", [bars, theta0 = phase](const Inputs& in) {
      const double theta = theta0 + in.joints[2];
      return four_bar::rocker_angle(bars, theta) - theta + 1e-3;  // set to zero elsewhere
    });
    const auto table = measured(robot, {rods}, 200, 905);
    const Diagnosis d = diagnose(robot, table->data);
    CAPTURE(phase);
    INFO(names(d));
    REQUIRE(d.effects.size() == 1);
    CHECK(is_named(d, "elbow_linkage", {"J3"}));
    CHECK(d.effects[0].identify_as == "elbow_linkage:J3,joint_offset:J3");
    CHECK(d.unknown.empty());
    CHECK(d.after.rms < 1.2 * d.noise_floor);
  }
}

TEST_CASE("an eccentric encoder at an elbow is not taken for rods alone") {
  Robot robot = arm();
  robot.joints[2].lower = -1.2;
  robot.joints[2].upper = 1.2;
  const auto encoder = hidden("J3", [](const Inputs& in) { return 4e-4 * std::cos(in.joints[2] + 0.9); });
  const auto table = measured(robot, {encoder}, 200, 906);
  const Diagnosis d = diagnose(robot, table->data);
  INFO(names(d));
  REQUIRE(d.effects.size() == 1);
  const std::vector<truing::Alternative>& same = d.effects[0].confounded_with;
  CHECK((is_named(d, "harmonic", {"J3"}) || std::any_of(same.begin(), same.end(), [](const truing::Alternative& a) {
           return a.effect == "harmonic" && a.joints == std::vector<std::string>{"J3"};
         })));
}

TEST_CASE("diagnose names bearings out of round, and the joint's axis") {
  // The axis leans about a line that turns twice as fast as the joint: oval, not along the catalogue's two directions.
  Effect oval = hidden("J3.alpha", [](const Inputs& in) { return 4e-4 * std::cos(2.0 * in.joints[2] + 0.7); });
  const Effect across = hidden("J3.beta", [](const Inputs& in) { return 3e-4 * std::sin(2.0 * in.joints[2] + 1.1); });
  const auto table = measured(arm(), {oval, across}, 200, 920);
  const Diagnosis d = diagnose(arm(), table->data);
  INFO(names(d));
  CHECK(is_named(d, "axis_wobble_twice", {"J3"}));
  CHECK(d.unknown.empty());
  CHECK(d.after.rms < 1.2 * d.noise_floor);
}

TEST_CASE("diagnose names the coupling of joints that are no wrist's, the moved joint and the mover") {
  for (const auto& [moved, mover] : {std::make_pair(3, 2), std::make_pair(2, 1), std::make_pair(1, 3)}) {
    const std::string at = "J" + std::to_string(moved + 1), by = "J" + std::to_string(mover + 1);
    const auto drag = hidden(at, [k = mover](const Inputs& in) { return 4e-4 * in.joints[k]; });
    const auto table = measured(arm(), {drag}, 160, 930);
    const Diagnosis d = diagnose(arm(), table->data);
    CAPTURE(at);
    INFO(names(d));
    CHECK(is_named(d, "neighbour_coupling", {at}));
    CHECK(d.effects.size() == 1);
    CHECK(d.unknown.empty());
    REQUIRE(!d.effects.empty());
    REQUIRE(d.effects[0].parameters.size() == 1);
    CHECK(d.effects[0].parameters[0].name == "neighbour_coupling." + at + "." + by);
    CHECK(d.effects[0].parameters[0].value == doctest::Approx(4e-4).scale(0).epsilon(0.1));
  }
}

TEST_CASE("diagnose calls a warm arm warm, not too long and then link by link") {
  const auto warm = [](std::size_t row) {  // 28 to 34 deg C, and the robot was right at 20
    return 31.0 - 3.0 * std::cos(0.03 * static_cast<double>(row));
  };
  // Every link grows by the same coefficient: the chain and its lengths, written as lengths of the true robot.
  std::vector<Effect> growth;
  for (const Joint& joint : arm().joints) {
    if (joint.a == 0.0 && joint.d == 0.0) continue;
    const bool along_x = joint.a != 0.0;
    growth.push_back(
        hidden(joint.name + (along_x ? ".a" : ".d"), [length = along_x ? joint.a : joint.d](const Inputs& in) {
          return 2.3e-5 * length * (in.data->temperature[in.row] - 20.0);
        }));
    if (along_x && joint.d != 0.0)
      growth.push_back(hidden(joint.name + ".d", [length = joint.d](const Inputs& in) {
        return 2.3e-5 * length * (in.data->temperature[in.row] - 20.0);
      }));
  }
  const auto table = measured(arm(), growth, 200, 940, {false, warm});
  const Diagnosis d = diagnose(arm(), table->data);
  INFO(names(d));
  REQUIRE(!d.effects.empty());
  CHECK(is_named(d, "thermal", {}));
  CHECK(d.effects.size() == 1);
  CHECK(d.unknown.empty());
  CHECK(d.after.rms < 1.2 * d.noise_floor);
  REQUIRE(!d.effects[0].parameters.empty());
  CHECK(d.effects[0].parameters[0].name == "thermal");
  CHECK(d.effects[0].parameters[0].value == doctest::Approx(2.3e-5).scale(0).epsilon(0.1));
}

TEST_CASE("diagnose names springs at two joints that harden a little as springs at two joints") {
  const auto spring = [](const std::string& joint, Eigen::Index k, double compliance, double largest) {
    return hidden(joint, [=](const Inputs& in) {
      const double torque = in.gravity_torque[k], part = std::min(1.0, std::abs(torque) / largest);
      return compliance * torque * (1.0 - 0.2 * part);
    });
  };
  const std::vector<Effect> springs = {spring("J2", 1, 1.2e-5, 60.0), spring("J3", 2, 2e-5, 20.0)};
  const auto heavy = [](std::size_t row) { return row % 2 ? 3.0 : 0.0; };
  const auto table = measured(arm(), springs, 160, 950, {false, {}, heavy});
  const Diagnosis d = diagnose(arm(), table->data);
  INFO(names(d));
  for (const char* joint : {"J2", "J3"})
    CHECK((is_named(d, "joint_compliance", {joint}) || is_named(d, "stiffness_zones", {joint})));
  for (const truing::FoundEffect& e : d.effects) CHECK(e.effect != "link_compliance");
}

TEST_CASE("diagnose names play that grows with the load") {
  const auto belt =
      hidden("J3", [](const Inputs& in) { return 1.5e-5 * in.data->direction[2][in.row] * in.gravity_torque[2]; });
  const auto heavy = [](std::size_t row) { return row % 2 ? 3.0 : 0.0; };
  const auto table = measured(arm(), {belt}, 160, 960, {true, {}, heavy});
  const Diagnosis d = diagnose(arm(), table->data);
  INFO(names(d));
  CHECK(is_named(d, "loaded_play", {"J3"}));
  CHECK(d.unknown.empty());
}

TEST_CASE("diagnose says of a belt without known weights that it gives way by direction and payload") {
  Robot light = arm();
  for (Joint& j : light.joints) j.mass.reset();
  const auto belt =
      hidden("J4", [](const Inputs& in) { return 4e-4 * in.data->direction[3][in.row] * in.data->payload[in.row]; });
  const auto heavy = [](std::size_t row) { return static_cast<double>(row % 3); };
  const auto table = measured(light, {belt}, 200, 970, {true, {}, heavy});
  const Diagnosis d = diagnose(light, table->data);
  INFO(names(d));
  const bool said = std::any_of(d.unknown.begin(), d.unknown.end(), [](const truing::UnknownEffect& u) {
    return u.joint == "J4" && std::count(u.inputs.begin(), u.inputs.end(), "dir4") == 1 &&
           std::count(u.inputs.begin(), u.inputs.end(), "payload") == 1;
  });
  CHECK(said);
}

TEST_CASE("diagnose says of a cable pack and of an end stop which joint they hold, and by which angles") {
  const auto pack = hidden("J4", [](const Inputs& in) {  // stiffens as the wrist winds it up
    const double wound = in.joints[3] + in.joints[4];
    return 2.5e-4 * wound * std::abs(wound);
  });
  const auto packed = measured(arm(), {pack}, 300, 980);
  const Diagnosis d = diagnose(arm(), packed->data);
  INFO(names(d));
  CHECK(std::any_of(d.unknown.begin(), d.unknown.end(), [](const truing::UnknownEffect& u) {
    return u.joint == "J4" && u.inputs == std::vector<std::string>{"q4", "q5"};
  }));
  const auto stop = hidden("J3", [](const Inputs& in) { return -3e-3 * std::max(0.0, in.joints[2] - 1.4); });
  const auto stopped = measured(arm(), {stop}, 200, 990);
  const Diagnosis at_stop = diagnose(arm(), stopped->data);
  INFO(names(at_stop));
  CHECK(std::any_of(at_stop.unknown.begin(), at_stop.unknown.end(), [](const truing::UnknownEffect& u) {
    return u.joint == "J3" && u.inputs == std::vector<std::string>{"q3"};
  }));
}

/// A joint that moves over time, in a shape that no candidate has: warm-up, and cooling after two thirds.
double warmed_up(double t) {
  const double until = 0.66, warm = 1.0 - std::exp(-std::min(t, until) / 0.2);
  return t < until ? warm : warm * std::exp(-(t - until) / 0.15);
}

/// Every length by the same fraction.
Effect all_lengths_grow(const std::function<double(const Inputs&)>& by) {
  Effect grown{"grown", "", {}, false};
  grown.terms = [by](const Robot& robot, std::size_t, const truing::Measurements&) {
    std::vector<Term> terms;
    for (const Joint& joint : robot.joints) {
      for (const auto& [value, length] : {std::make_pair("a", joint.a), std::make_pair("d", joint.d)}) {
        if (std::abs(length) < 1e-3) continue;
        Term term;
        term.parameter = "grown.size";
        term.unit = "-";
        term.site = joint.name + "." + value;
        term.basis = [by, metres = length](const Inputs& in) { return metres * by(in); };
        terms.push_back(term);
      }
    }
    return terms;
  };
  return grown;
}

TEST_CASE("without a temperature column warm links grow by name, and the frame does not drift") {
  const std::size_t rows = 240;
  const auto share = [rows](const Inputs& in) { return static_cast<double>(in.row) / rows; };
  // 0.3 permille at most, some 15 K of aluminium.
  const Effect grown = all_lengths_grow([share](const Inputs& in) { return 3e-4 * warmed_up(share(in)); });
  for (const bool timed : {true, false}) {
    auto table = measured(arm(), {grown}, rows, 1100);
    std::vector<double> time(rows);
    for (std::size_t row = 0; row < rows; ++row) time[row] = 20.0 * static_cast<double>(row);
    if (timed) table->data.time = table->add(time);
    const Diagnosis d = diagnose(arm(), table->data);
    CAPTURE(timed);
    INFO(names(d));
    CHECK(is_named(d, "thermal", {}));
    CHECK(!is_named(d, "drift", {}));
    CHECK(d.unknown.empty());
    CHECK(d.after.rms < 1.15 * std::sqrt(3.0) * kNoise);
    REQUIRE(!d.effects.empty());
    const auto largest = std::max_element(
        d.effects[0].parameters.begin(), d.effects[0].parameters.end(),
        [](const truing::Parameter& a, const truing::Parameter& b) { return std::abs(a.value) < std::abs(b.value); });
    REQUIRE(largest != d.effects[0].parameters.end());
    CHECK(largest->value == doctest::Approx(3e-4 * warmed_up(0.6)).epsilon(0.1));
  }
}

TEST_CASE("an offset that is found where the drawing has none does not grow, and what grows stays the same") {
  Robot bent = arm();
  for (Joint& joint : bent.joints) {
    if (joint.a == 0.0) joint.a = 3e-4;
    if (joint.d == 0.0) joint.d = -2e-4;
  }
  for (const Joint& joint : bent.joints) {
    const auto found = truing::diagnosis::lengths_of_link(bent, joint.name);
    CHECK(found == truing::diagnosis::lengths_of_link(arm(), joint.name));
  }
}

TEST_CASE("lengths that grow by more than any warmth makes are not called warm") {
  const std::size_t rows = 240;  // 1 % of aluminium is 430 K
  const Effect stretched = all_lengths_grow(
      [rows](const Inputs& in) { return 1e-2 * warmed_up(static_cast<double>(in.row) / static_cast<double>(rows)); });
  const Diagnosis d = diagnose(arm(), measured(arm(), {stretched}, rows, 1103)->data);
  INFO(names(d));
  CHECK(std::none_of(d.effects.begin(), d.effects.end(), [](const auto& e) { return e.effect == "thermal"; }));
  CHECK(d.after.rms <= d.gap.rms);
}

TEST_CASE("without a temperature column a zero that moves over time is unknown, and warmth may be its cause") {
  const std::size_t rows = 240;
  const auto zero_of = [rows](const std::string& joint) {
    return hidden(joint, [rows](const Inputs& in) { return 4e-4 * warmed_up(static_cast<double>(in.row) / rows); });
  };
  std::vector<double> time(rows);
  for (std::size_t row = 0; row < rows; ++row) time[row] = 20.0 * static_cast<double>(row);
  auto table = measured(arm(), {zero_of("J3")}, rows, 1110);
  table->data.time = table->add(time);
  const Diagnosis d = diagnose(arm(), table->data);
  INFO(names(d));
  CHECK(d.effects.empty());
  REQUIRE(d.unknown.size() == 1);
  CHECK(d.unknown[0].joint == "J3");
  CHECK(d.unknown[0].inputs == std::vector<std::string>{"time"});
  CHECK(d.unknown[0].looks_like.find("thermal zero") != std::string::npos);
  // The first joint's zero is the frame's turn about its axis: which of them moved, only a temperature could tell.
  auto first = measured(arm(), {zero_of("J1")}, rows, 1120);
  first->data.time = first->add(time);
  const Diagnosis of_first = diagnose(arm(), first->data);
  INFO(names(of_first));
  CHECK(of_first.effects.size() + of_first.unknown.size() == 1);
}

/// The frame moves and turns, `most` metres and radians in the end.
Effect wandering_frame(std::size_t rows, double most) {
  Effect wandering{"wandering", "", {}, false};
  wandering.terms = [rows, most](const Robot&, std::size_t, const truing::Measurements&) {
    std::vector<Term> terms;
    for (const char* site : {"base.x", "base.y", "base.rz"}) {
      Term term;
      term.parameter = "wandering.size";
      term.unit = "-";
      term.site = site;
      term.basis = [rows, most](const Inputs& in) { return most * warmed_up(static_cast<double>(in.row) / rows); };
      terms.push_back(term);
    }
    return terms;
  };
  return wandering;
}

TEST_CASE("a frame that drifts while no temperature is recorded is said to drift, the robot does not grow") {
  const std::size_t rows = 240;
  const auto table = measured(arm(), {wandering_frame(rows, 3e-4)}, rows, 1130);
  const Diagnosis d = diagnose(arm(), table->data);
  INFO(names(d));
  CHECK(is_named(d, "drift", {}));
  CHECK(d.effects.size() == 1);
  CHECK(d.unknown.empty());
}

TEST_CASE("a frame that drifts beside warm links is a cause of its own, and what warms late is none") {
  const std::size_t rows = 300;
  const auto at = [rows](std::size_t row) { return static_cast<double>(row) / static_cast<double>(rows); };
  const auto sensor = [at](std::size_t row) { return 20.0 + 12.0 * std::sin(3.1 * at(row)); };
  // Links grow by 23 um per metre and kelvin, of what the sensor says or of what was so a tenth of the time earlier.
  const auto grown_after = [&](double late) {
    return all_lengths_grow(
        [=](const Inputs& in) { return 2.3e-5 * 12.0 * std::sin(3.1 * std::max(0.0, at(in.row) - late)); });
  };
  for (const bool drifts : {true, false}) {
    std::vector<Effect> own = {grown_after(drifts ? 0.0 : 0.1)};
    if (drifts) own.push_back(wandering_frame(rows, 1e-4));
    auto table = measured(arm(), own, rows, 1150, {false, sensor, {}});
    std::vector<double> time(rows);
    for (std::size_t row = 0; row < rows; ++row) time[row] = 20.0 * static_cast<double>(row);
    table->data.time = table->add(time);
    const Diagnosis d = diagnose(arm(), table->data);
    CAPTURE(drifts);
    INFO(names(d));
    CHECK(is_named(d, "thermal", {}));
    CHECK(is_named(d, "drift", {}) == drifts);
  }
}

/// A gas spring between the pedestal and the upper arm: its force along the line between its ends, exactly.
double torque_of_balancer(double q) {
  const double below = 0.35, on_arm = 0.25, turned = q + 1.9;
  const double length = std::sqrt(below * below + on_arm * on_arm + 2.0 * below * on_arm * std::cos(turned));
  const double force = 900.0 + 2500.0 * (0.55 - length);
  return force * below * on_arm * std::sin(turned) / length;
}

TEST_CASE(
    "diagnose says of a gravity balancer which joint it turns, by that joint's angle, beside the joint's spring") {
  const auto balanced =
      hidden("J2", [](const Inputs& in) { return 6e-6 * (in.gravity_torque[1] + torque_of_balancer(in.joints[1])); });
  const auto heavy = [](std::size_t row) { return row % 2 ? 5.0 : 0.0; };
  const auto table = measured(arm(), {balanced}, 240, 1140, {false, {}, heavy});
  const Diagnosis d = diagnose(arm(), table->data);
  INFO(names(d));
  CHECK((is_named(d, "joint_compliance", {"J2"}) || is_named(d, "stiffness_zones", {"J2"})));
  const bool unknown = std::any_of(d.unknown.begin(), d.unknown.end(), [](const truing::UnknownEffect& u) {
    return u.joint == "J2" && u.inputs == std::vector<std::string>{"q2"};
  });
  CHECK((is_named(d, "harmonic", {"J2"}) || unknown));
  for (const truing::FoundEffect& e : d.effects) CHECK(e.joints == std::vector<std::string>{"J2"});
  for (const truing::UnknownEffect& u : d.unknown) CHECK(u.joint == "J2");
}

TEST_CASE("a law that makes most of the motion keeps its name, and what it leaves is unknown at its joint") {
  const auto is_unknown = [](const Diagnosis& d, const std::string& joint, const std::string& input) {
    return std::any_of(d.unknown.begin(), d.unknown.end(), [&](const truing::UnknownEffect& u) {
      return u.joint == joint && u.inputs == std::vector<std::string>{input};
    });
  };
  const auto eccentric = hidden("J4", [](const Inputs& in) {  // three lobes beside: 15 % of the square
    return 5e-4 * (std::cos(in.joints[3] + 0.4) + 0.42 * std::cos(3.0 * in.joints[3] + 1.0));
  });
  const auto turned = measured(arm(), {eccentric}, 300, 1200);
  const Diagnosis d = diagnose(arm(), turned->data);
  INFO(names(d));
  REQUIRE(d.effects.size() == 1);
  CHECK(is_named(d, "harmonic", {"J4"}));
  CHECK(d.effects[0].probability <= 0.9);
  CHECK(d.effects[0].grounds.at("unknown_found") == 1.0);
  CHECK(d.effects[0].grounds.at("law_in_question") == 1.0);
  CHECK(is_unknown(d, "J4", "q4"));
  // A joint whose sensor is ahead of its gear: half of it follows at once, half late.
  const std::size_t rows = 300;
  std::vector<double> now(rows), late(rows), time(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    time[row] = 20.0 * static_cast<double>(row);
    now[row] = 15.0 * warmed_up(static_cast<double>(row) / rows);
    late[row] = row == 0 ? now[0] : late[row - 1] + 0.013 * (now[row] - late[row - 1]);
  }
  const auto zero = hidden("J3", [&](const Inputs& in) { return 2e-5 * (now[in.row] + late[in.row]); });
  auto warm = measured(arm(), {zero}, rows, 1210, {false, [&](std::size_t row) { return 20.0 + now[row]; }});
  warm->data.time = warm->add(time);
  const Diagnosis lagging = diagnose(arm(), warm->data);
  INFO(names(lagging));
  REQUIRE(lagging.effects.size() == 1);
  CHECK(is_named(lagging, "thermal_zero", {"J3"}));
  CHECK(lagging.effects[0].probability > 0.9);
  CHECK(lagging.effects[0].grounds.at("unknown_found") == 0.0);
  for (const truing::UnknownEffect& u : lagging.unknown) CHECK(u.joint == "J3");
}

TEST_CASE("what a law leaves of its own joint's motion is no second cause, and is fitted with it") {
  // A bearing that is not round beside a tilt, by a seventh.
  const auto tilt = hidden("J3.alpha", [](const Inputs& in) {
    return 6e-4 * (std::cos(in.joints[2] + 0.3) + 0.15 * std::cos(2.0 * in.joints[2] + 1.0));
  });
  const auto turned = measured(arm(), {tilt}, 200, 1220);
  const Diagnosis d = diagnose(arm(), turned->data);
  INFO(names(d));
  REQUIRE(d.effects.size() == 1);
  CHECK(is_named(d, "axis_wobble", {"J3"}));
  CHECK(d.effects[0].identify_as == "axis_wobble:J3,axis_wobble_twice:J3");
  CHECK(d.effects[0].note.find("axis wobble twice") != std::string::npos);
  CHECK(d.effects[0].parameters.size() == 8);
  CHECK(d.after.rms < 1.2 * d.noise_floor);
  // A parallelogram that was set to zero where its error is not.
  const auto closed = hidden("J4", [](const Inputs& in) {
    const double theta = 1.57 + in.joints[1];
    return four_bar::rocker_angle({0.4, 0.2503, 0.4005, 0.25}, theta) - theta - 2e-3;
  });
  const auto linkage = measured(linked(), {closed}, 200, 1230);
  const Diagnosis bars = diagnose(linked(), linkage->data);
  INFO(names(bars));
  REQUIRE(bars.effects.size() == 1);
  CHECK(is_named(bars, "linkage", {"J4"}));
  CHECK(bars.effects[0].identify_as == "linkage:J4,joint_offset:J4");
  CHECK(bars.after.rms < 1.2 * bars.noise_floor);
}

/// The base leans by `lean` [rad] towards where the first joint points, about the base's origin.
Effect leaning_base(const std::function<double(const Inputs&)>& lean) {
  Effect effect;
  effect.name = "hidden lean";
  effect.per_joint = false;
  effect.terms = [lean](const Robot& robot, std::size_t, const truing::Measurements&) {
    const Eigen::Matrix3d base = robot.T_measurement_base.linear();
    std::vector<Term> terms;
    for (Eigen::Index k = 0; k < 3; ++k) {
      Term term;
      term.parameter = "hidden lean.size";
      term.unit = "rad";
      term.site = std::string("base.r") + "xyz"[k];
      term.basis = [=](const Inputs& in) {
        const double q = in.joints[0];
        return lean(in) * (base * Eigen::Vector3d(-std::sin(q), std::cos(q), 0.0))[k];
      };
      terms.push_back(term);
    }
    return terms;
  };
  return effect;
}

TEST_CASE(
    "a base that leans under its load is said to, and no next joint; a joint that gives way under it stays that") {
  const auto load = [](const Inputs& in) { return 3e-4 * in.data->payload[in.row]; };
  const Conditions carrying{false, {}, [](std::size_t row) { return static_cast<double>(row % 3); }};
  Robot light = arm();
  for (Joint& j : light.joints) j.mass.reset();
  const auto leant = measured(light, {leaning_base(load)}, 200, 1310, carrying);
  const Diagnosis d = diagnose(light, leant->data);
  INFO(names(d));
  REQUIRE(d.unknown.size() == 1);
  CHECK(d.unknown[0].joint == "base");
  CHECK(d.unknown[0].inputs == std::vector<std::string>{"q1", "payload"});
  CHECK(d.unknown[0].looks_like.find("; or ") == std::string::npos);
  CHECK(d.effects.empty());
  CHECK(d.after_unknown.rms < 1.1 * d.noise_floor);
  REQUIRE(d.robot_with_unknown);  // over the turn of the first joint, as tables
  CHECK(d.after_robot_with_unknown.rms < 1.1 * d.noise_floor);
  const auto given_way = measured(light, {hidden("J2", load)}, 200, 1320, carrying);
  const Diagnosis at_joint = diagnose(light, given_way->data);
  INFO(names(at_joint));
  REQUIRE(at_joint.unknown.size() == 1);
  CHECK(at_joint.unknown[0].joint == "J2");
  CHECK(at_joint.unknown[0].inputs == std::vector<std::string>{"payload"});
}

TEST_CASE("where the second axis runs through the base's origin, a lean and a turn of it are both said") {
  const auto load = [](const Inputs& in) { return 3e-4 * in.data->payload[in.row]; };
  const Conditions carrying{false, {}, [](std::size_t row) { return static_cast<double>(row % 3); }};
  Robot low = arm();
  low.joints[0].d = 0.0;
  for (Joint& j : low.joints) j.mass.reset();
  const auto table = measured(low, {leaning_base(load)}, 200, 1330, carrying);
  const Diagnosis d = diagnose(low, table->data);
  INFO(names(d));
  REQUIRE(d.unknown.size() == 1);
  const truing::UnknownEffect& u = d.unknown[0];
  INFO(u.looks_like);
  CHECK(u.joint == "J2");
  CHECK(u.looks_like.find("; or base as a function of q1 and payload: these poses do not tell which") !=
        std::string::npos);
  CHECK(d.sentence.find("or base as a function of q1 and payload") != std::string::npos);
}

TEST_CASE("a wave of the joint that carries another one along is a cause of its own beside the coupling") {
  const auto wave = hidden("J4", [](const Inputs& in) { return 4e-4 * std::sin(2.0 * in.joints[3]); });
  const auto carried = hidden("J3", [](const Inputs& in) { return 1.5e-3 * in.joints[3]; });
  const auto table = measured(arm(), {carried, wave}, 250, 1340);
  const Diagnosis d = diagnose(arm(), table->data);
  INFO(names(d));
  CHECK(is_named(d, "neighbour_coupling", {"J3"}));
  CHECK(is_named(d, "harmonic", {"J4"}));
}

TEST_CASE("diagnose finds none of the laws of machines in noise" * doctest::skip(kSanitized)) {
  const auto warm = [](std::size_t row) { return 26.0 - 4.0 * std::cos(0.03 * static_cast<double>(row)); };
  const auto heavy = [](std::size_t row) { return row % 2 ? 3.0 : 0.0; };
  for (unsigned seed = 1000; seed < 1100; seed += 10) {
    for (const Robot& robot : {arm(), linked()}) {
      const auto table = measured(robot, {}, 120, seed, {true, warm, heavy});
      const Diagnosis d = diagnose(robot, table->data);
      CAPTURE(seed);
      CAPTURE(robot.name);
      INFO(names(d));
      CHECK(d.verdict == Verdict::none);
    }
  }
}

}  // namespace machines
