// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The laws that every effect of the catalogue keeps, on every robot that it applies to.

#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "estimation/evaluate.hpp"
#include "model/effects/tables.hpp"
#include "support/arms.hpp"
#include "support/contains.hpp"

using namespace arms;
using namespace truing::estimation;
using truing::EffectRequest;

namespace {

const std::set<std::string> kModelParameters = {"gear_ratio", "joint_offset", "link_geometry", "base_frame",
                                                "tool_frame"};

/// Names to ask for: those of the catalogue, with an order where there must be one.
std::vector<std::string> names_to_ask() {
  std::vector<std::string> names;
  for (const truing::Effect& effect : truing::catalogue())
    names.push_back(effect.name == "transmission_error" ? "transmission_error@24" : effect.name);
  return names;
}

std::vector<std::string> names_with_terms() {
  std::vector<std::string> names = names_to_ask();
  names.erase(std::remove_if(names.begin(), names.end(),
                             [](const std::string& name) { return kModelParameters.count(name) > 0; }),
              names.end());
  return names;
}

std::vector<Robot> robots() {
  std::vector<Robot> all = {ur10(), palletizer(), rail_arm(), urdf_arm()};
  for (Robot& robot : all) {
    robot.T_measurement_base = somewhere();
    for (Joint& j : robot.joints) {
      if (j.mass) continue;
      j.mass = 4.0;
      j.center_of_mass = {0.05, -0.1, 0.08};
    }
  }
  return all;
}

/// Joints, and every input that an effect may look at.
std::unique_ptr<Table> full_table(const Robot& robot, std::size_t rows, unsigned seed) {
  auto table = random_joints(robot, rows, seed);
  std::mt19937_64 random(seed + 1);
  const auto column = [&](double low, double high) {
    std::vector<double> values(rows);
    for (double& v : values) v = low + (high - low) * (static_cast<double>(random() >> 11) * 0x1.0p-53);
    return values;
  };
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (std::size_t k = 0; k < driven.size(); ++k) {
    std::vector<double> direction = column(-1.0, 1.0);
    for (double& v : direction) v = v < 0.0 ? -1.0 : 1.0;
    table->data.direction.push_back(table->add(direction));
    table->data.joint_speed.push_back(table->add(column(-1.0, 1.0)));
    const bool turns = robot.joints[driven[k]].type == JointType::revolute;
    table->data.covariates["tau" + std::to_string(k + 1) + (turns ? "_Nm" : "_N")] = table->add(column(-50.0, 50.0));
  }
  table->data.payload = table->add(column(0.0, 5.0));
  table->data.temperature = table->add(column(18.0, 35.0));
  table->data.time = table->add(column(1.7e9, 1.7e9 + 3600.0));
  return table;
}

/// Tables have the knots that the robot carries.
Robot with_knots_of(const std::string& name, Robot robot) {
  if (name != "lookup_table") return robot;
  const std::vector<std::string> over = {"q1", "torque2"};
  truing::model::add_table({robot.joints[1].name, over, {{-1.0, 1.0}, {-9.0, 0.0, 9.0}}, {0, 0, 0, 0, 0, 0}}, &robot);
  truing::model::add_table({"base.rz", {"dir1"}, {{-1.0, 1.0}}, {0, 0}}, &robot);
  return robot;
}

bool applies(const std::string& name, const Robot& robot, const Measurements& data) {
  try {
    truing::effect_terms({{name, {}}}, robot, data);
  } catch (const truing::Unsuited&) {
    return false;
  }
  return true;
}

template <typename Law>
void for_every_effect_and_robot(const Law& law) {
  for (const std::string& name : names_with_terms()) {
    int robots_met = 0;
    for (const Robot& plain : robots()) {
      const Robot robot = with_knots_of(name, plain);
      CAPTURE(name);
      CAPTURE(robot.name);
      const auto table = full_table(robot, 70, 5);
      if (!applies(name, robot, table->data)) continue;
      ++robots_met;
      law(name, robot, table.get());
    }
    CAPTURE(name);
    CHECK(robots_met > 0);
  }
}

/// How much the parameter must be to move its site by about `size` [rad | m].
double value_that_moves(const Model& model, const std::vector<std::vector<double>>& bases, const std::string& parameter,
                        double size) {
  double most = 0.0;
  for (const ColumnTerm& column : model.parameters[model.parameter_index(parameter)].columns) {
    for (const double v : bases[column.term]) most = std::max(most, std::abs(v));
  }
  return most > 0.0 ? size / most : size;
}

std::vector<int> effect_parameters(const Model& model) {
  std::vector<int> found;
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    if (model.parameters[k].role == Role::effect) found.push_back(static_cast<int>(k));
  }
  return found;
}

/// The robot with these effects, every parameter such that it moves its sites by about `size`, signs alternating.
Robot with_effects(const Robot& robot, const Measurements& data, const std::vector<EffectRequest>& requests,
                   double size) {
  const Model model = make_model(robot, data, requests);
  const auto bases = make_bases(model, data);
  Eigen::VectorXd values = initial_values(model);
  for (const int k : effect_parameters(model))
    values[k] = (k % 2 ? 1.0 : -1.0) * value_that_moves(model, bases, model.parameters[k].name, size);
  return robot_with(model, values);
}

std::string complaint(const EffectRequest& request, const Robot& robot, const Measurements& data) {
  try {
    truing::effect_terms({request}, robot, data);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("law: every parameter has a unit, a name that starts with its effect's, and a site that exists") {
  for_every_effect_and_robot([](const std::string& name, const Robot& robot, Table* table) {
    const Model model = make_model(robot, table->data, {{name, {}}});
    const std::vector<int> parameters = effect_parameters(model);
    CHECK(!parameters.empty());
    for (const int k : parameters) {
      const ParameterInfo& info = model.parameters[k];
      INFO(info.name);
      CHECK(!info.unit.empty());
      CHECK((info.name == name || info.name.compare(0, name.size() + 1, name + ".") == 0));
      for (const ColumnTerm& column : info.columns) CHECK(!column.sites.empty());
    }
  });
}

TEST_CASE("law: the Jacobian agrees with central differences") {
  for_every_effect_and_robot([](const std::string& name, const Robot& robot, Table* table) {
    measure(table, perturbed(robot, 1e-3, 1e-3, 6), What::pose, 0.0, 7);
    const Robot start = with_effects(robot, table->data, {{name, {}}}, 1e-3);
    const Model model = make_model(start, table->data);
    const auto bases = make_bases(model, table->data);
    std::vector<std::int32_t> rows(table->data.rows);
    std::iota(rows.begin(), rows.end(), 0);
    const std::vector<int> free = effect_parameters(model);
    const Evaluator evaluator(model, table->data, bases, make_segments(table->data, rows), free, 1);
    const Eigen::VectorXd values = initial_values(model);
    Weighing weighing;
    const auto p = static_cast<Eigen::Index>(free.size());
    for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
      const Eigen::Index n = evaluator.tile_rows(tile) * evaluator.tile_components(tile);
      Eigen::VectorXd r(n), plus(n), minus(n);
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> j(n, p);
      evaluator.tile(tile, values, weighing, r.data(), j.data());
      for (Eigen::Index k = 0; k < p; ++k) {
        const ParameterInfo& info = model.parameters[free[static_cast<std::size_t>(k)]];
        const double step = value_that_moves(model, bases, info.name, 1e-5);
        Eigen::VectorXd moved = values;
        moved[free[static_cast<std::size_t>(k)]] += step;
        evaluator.tile(tile, moved, weighing, plus.data(), nullptr);
        moved[free[static_cast<std::size_t>(k)]] -= 2.0 * step;
        evaluator.tile(tile, moved, weighing, minus.data(), nullptr);
        const Eigen::VectorXd difference = (plus - minus) / 2e-5;  // per unit of what the site moves
        INFO(info.name);
        CHECK((difference - j.col(k) * (step / 1e-5)).cwiseAbs().maxCoeff() <
              5e-9 * std::max(1.0, difference.cwiseAbs().maxCoeff()));
      }
    }
  });
}

TEST_CASE("law: a parameter of zero changes nothing") {
  for_every_effect_and_robot([](const std::string& name, const Robot& robot, Table* table) {
    Robot zero = with_effects(robot, table->data, {{name, {}}}, 1e-3);
    REQUIRE(zero.effects.size() == 1);
    const std::vector<truing::Term> terms = truing::effect_terms({{name, {}}}, robot, table->data);
    bool at_joints = true;  // elsewhere a number that was folded away before is now computed in the kernel, and may
                            // round the other way
    for (const truing::Term& term : terms) {
      zero.effects[0].parameters[term.parameter] = 0.0;
      at_joints = at_joints && !contains(term.site, ".");
    }
    const truing::Prediction with = truing::predict(zero, table->data), without = truing::predict(robot, table->data);
    if (at_joints) {
      CHECK(with.position == without.position);
      CHECK(with.orientation == without.orientation);
    } else {
      CHECK((with.position - without.position).cwiseAbs().maxCoeff() < 4e-15);
      CHECK((with.orientation - without.orientation).cwiseAbs().maxCoeff() < 4e-15);
    }
  });
}

TEST_CASE("law: two effects together are their sum, to second order") {
  const double size = 1e-4;
  const std::vector<std::string> names = names_with_terms();
  for (const Robot& robot : robots()) {
    CAPTURE(robot.name);
    const auto table = full_table(robot, 30, 15);
    const truing::Prediction none = truing::predict(robot, table->data);
    for (std::size_t k = 0; k < names.size(); ++k) {
      const std::string &one = names[k], &other = names[(k + 1) % names.size()];
      CAPTURE(one);
      CAPTURE(other);
      if (!applies(one, robot, table->data) || !applies(other, robot, table->data)) continue;
      Robot a = with_effects(robot, table->data, {{one, {}}}, size),
            b = with_effects(robot, table->data, {{other, {}}}, size), both = a;
      both.effects.push_back(b.effects[0]);
      const auto moved = [&](const Robot& r) -> Eigen::MatrixXd {
        return truing::predict(r, table->data).position - none.position;
      };
      const Eigen::MatrixXd da = moved(a), db = moved(b), dboth = moved(both);
      CHECK(da.cwiseAbs().maxCoeff() > 0.0);
      // Up to 60 terms of 1e-4 at arms of a few metres.
      CHECK((dboth - da - db).cwiseAbs().maxCoeff() <
            10.0 * (da.cwiseAbs().maxCoeff() * db.cwiseAbs().maxCoeff() + size * size));
      CHECK((dboth - da - db).cwiseAbs().maxCoeff() < 0.05 * (da.cwiseAbs().maxCoeff() + db.cwiseAbs().maxCoeff()));
    }
  }
}

TEST_CASE(
    "law: identified from what it makes, an effect predicts just that, from the robot alone, also on a part of the "
    "rows") {
  for (const std::string& name : names_with_terms()) {
    for (const Robot& robot : robots()) {
      CAPTURE(name);
      CAPTURE(robot.name);
      auto table = full_table(robot, 120, 25);
      if (!applies(name, robot, table->data)) continue;
      const Robot truth = with_effects(robot, table->data, {{name, {}}}, 2e-4);
      measure(table.get(), truth, What::pose, 0.0, 26);
      truing::IdentifyOptions options;
      options.free = {"tool.*"};
      options.effects = {{name, {}}};
      options.loss = truing::Loss::none;
      options.test_share = 0.0;
      const truing::Identification found = truing::identify(robot, table->data, options);
      REQUIRE(found.robot.effects.size() == 1);
      CHECK(found.robot.effects[0].effect == name);
      CHECK(found.train.after.rms < 1e-7);
      CHECK(found.train.before.rms > 100.0 * found.train.after.rms);

      const truing::Prediction whole = truing::predict(found.robot, table->data);
      const truing::Prediction expected = truing::predict(truth, table->data);
      CHECK((whole.position - expected.position).cwiseAbs().maxCoeff() < 2e-6);
      // Nothing that the basis took from the data is taken anew: the last rows alone are predicted as among the others.
      Measurements part = table->data;
      const std::size_t skip = 100;
      const auto cut = [&](Column* column) {
        if (*column) column->data += static_cast<std::ptrdiff_t>(skip) * column->stride;
      };
      part.rows -= skip;
      for (auto* columns : {&part.joints, &part.direction, &part.joint_speed}) {
        for (Column& column : *columns) cut(&column);
      }
      for (Column* column : {&part.payload, &part.temperature, &part.time}) cut(column);
      for (auto& covariate : part.covariates) cut(&covariate.second);
      part.position = {};
      part.orientation = {};
      const truing::Prediction last = truing::predict(found.robot, part);
      CHECK((last.position - whole.position.bottomRows(static_cast<Eigen::Index>(part.rows))).cwiseAbs().maxCoeff() <
            1e-14);
    }
  }
}

TEST_CASE("law: what is missing is named") {
  const Robot robot = ur10();
  auto table = full_table(robot, 20, 35);
  Measurements bare;
  bare.rows = table->data.rows;
  bare.joints = table->data.joints;
  const std::map<std::string, std::string> wanted{{"backlash", "dir1"},  {"windup", "tau1_Nm"},
                                                  {"thermal", "temp_C"}, {"thermal_zero", "temp_C"},
                                                  {"drift", "t_s"},      {"time_offset", "qd1_rad_s"}};
  for (const auto& one : wanted) {
    const std::string &name = one.first, &column = one.second;
    CAPTURE(name);
    CHECK(contains(complaint({name, {}}, robot, bare), column));
    CHECK(complaint({name, {}}, robot, table->data) == "");
  }
  Robot weightless = robot;
  for (Joint& j : weightless.joints) j.mass.reset();
  for (const char* name : {"joint_compliance", "stiffness_zones", "link_compliance", "gravity_backlash"}) {
    CAPTURE(name);
    CHECK(contains(complaint({name, {}}, weightless, bare), "payload_kg"));
    CHECK(complaint({name, {}}, robot, bare) == "");
    CHECK(complaint({name, {}}, weightless, table->data) == "");
  }
  CHECK(complaint({"gravity_moment", {}}, weightless, bare) == "");
  CHECK(contains(complaint({"transmission_error", {}}, robot, bare), "transmission_error@96"));
  CHECK(contains(complaint({"transmission_error@x", {}}, robot, bare), "not a number"));
  CHECK(contains(complaint({"transmission_error@-3", {}}, robot, bare), "positive"));
}

TEST_CASE("law: joints are named only where they mean something, and those that do not suit are skipped") {
  const Robot robot = palletizer();
  const auto table = full_table(robot, 20, 45);
  for (const truing::Effect& effect : truing::catalogue()) {
    if (effect.per_joint) continue;
    CAPTURE(effect.name);
    CHECK(contains(complaint({effect.name, {"J2"}}, robot, table->data), "as a whole"));
  }
  CHECK(contains(complaint({"linkage", {"J2"}}, robot, table->data), "needs a passive joint"));
  CHECK(contains(complaint({"linkage", {}}, ur10(), table->data), "suits no joint"));
  CHECK(contains(complaint({"joint_coupling", {}}, robot, table->data), "wrist"));
  const auto terms = truing::effect_terms({{"linkage", {}}}, robot, table->data);
  REQUIRE(terms.size() >= 2);
  for (const truing::Term& term : terms) CHECK(term.site == "J4");
  CHECK(contains(complaint({"link_compliance", {"J5"}}, robot, table->data), "is the last"));
  std::set<std::string> joints;
  for (const truing::Term& term : truing::effect_terms({{"link_compliance", {}}}, robot, table->data))
    joints.insert(term.joint);
  CHECK(joints == std::set<std::string>{"J1", "J2", "J3"});
  const Robot rail = rail_arm();
  for (const char* name : {"harmonic", "axis_wobble", "transmission_error@24"}) {
    CHECK(complaint({name, {}}, rail, table->data) == "");
    CHECK(contains(complaint({name, {"rail"}}, rail, table->data), "rail is prismatic"));
  }
}

TEST_CASE("springs under unknown weights do what a spring under the known ones does") {
  for (Robot robot : {ur10(), palletizer()}) {
    CAPTURE(robot.name);
    robot.T_measurement_base = somewhere();
    auto table = random_joints(robot, 120, 55);
    Robot truth = robot;
    truth.effects = {{"joint_compliance", {"J2"}, {{"joint_compliance.J2", 2e-6}}}};
    measure(table.get(), truth, What::position, 0.0, 56);
    for (Joint& j : robot.joints) j.mass.reset();
    truing::IdentifyOptions options;
    options.free = {"tool.?"};
    options.effects = {{"gravity_moment", {"J2"}}};
    options.loss = truing::Loss::none;
    const truing::Identification found = truing::identify(robot, table->data, options);
    CHECK(found.train.before.rms > 1e-5);
    CHECK(found.train.after.rms < 1e-10);
    CHECK(found.test->after.rms < 1e-10);
  }
}

TEST_CASE("the weight on a vertical axis is none, not the rounding that is left of it") {
  Robot robot = ur10();
  robot.T_measurement_base = somewhere();
  const auto table = random_joints(robot, 50, 95);
  for (const char* name : {"joint_compliance", "gravity_backlash", "stiffness_zones", "gravity_moment"}) {
    CAPTURE(name);
    const Model model = make_model(robot, table->data, {{name, {"J1"}}});
    for (const std::vector<double>& basis : make_bases(model, table->data)) {
      for (const double v : basis) CHECK(v == 0.0);
    }
  }
}

TEST_CASE("three zones of equal compliance are one spring") {
  Robot one = ur10(), three = one;
  const auto table = random_joints(one, 200, 65);
  one.effects = {{"joint_compliance", {"J2"}, {{"joint_compliance.J2", 2e-6}}}};
  three.effects = {
      {"stiffness_zones",
       {"J2"},
       {{"stiffness_zones.J2.c1", 2e-6}, {"stiffness_zones.J2.c2", 2e-6}, {"stiffness_zones.J2.c3", 2e-6}}}};
  CHECK((truing::predict(one, table->data).position - truing::predict(three, table->data).position)
            .cwiseAbs()
            .maxCoeff() < 1e-14);
}

TEST_CASE("a scale stretches every target about the base, wherever the base stands") {
  Robot robot = ur10(), stretched = robot;
  robot.T_measurement_base = stretched.T_measurement_base = somewhere();
  robot.targets.push_back({"smr2", truing::frame_from_xyz_rpy({0.2, 0.1, -0.3}, {0.4, 0.5, 0.6})});
  stretched.targets = robot.targets;
  auto table = random_joints(robot, 40, 75);
  for (std::int32_t row = 0; row < 40; ++row) table->data.target.push_back(row % 2);
  stretched.effects = {{"scale", {}, {{"scale", 1e-3}}}};
  const truing::Prediction p = truing::predict(robot, table->data), s = truing::predict(stretched, table->data);
  const Eigen::RowVector3d base = somewhere().translation().transpose();
  CHECK(((s.position.rowwise() - base) - 1.001 * (p.position.rowwise() - base)).cwiseAbs().maxCoeff() < 1e-14);
  CHECK((s.orientation - p.orientation).cwiseAbs().maxCoeff() < 1e-15);
}

namespace {

/// By how much the tip moves when the effects are there, row by row.
Eigen::MatrixXd displacement(Robot robot, const Measurements& data, const truing::AppliedEffect& effect) {
  const Eigen::MatrixXd before = truing::predict(robot, data).position;
  robot.effects = {effect};
  return truing::predict(robot, data).position - before;
}

}  // namespace

TEST_CASE("a link bends as a finely cut beam does, under what hangs beyond its end") {
  // In a plane, gravity in it: a beam of 2 m, a stiff link of 0.5 m and a load.
  Robot robot;
  robot.convention = Convention::dh;
  robot.joints = {joint("J1", 0, 0, 2.0, 0), joint("J2", 0, 0, 0.5, 0)};
  robot.gravity = {0.0, -10.0, 0.0};
  const double load = 3.0, compliance = 1e-7;
  Table table(4);
  const std::vector<double> first = {0.0, 0.4, -0.9, 1.2}, second = {M_PI / 2, -0.3, 2.0, 0.7};
  table.data.joints = {table.add(first), table.add(second)};
  table.data.payload = table.add(std::vector<double>(4, load));
  const Eigen::MatrixXd by_law =
      displacement(robot, table.data, {"link_compliance", {"J1"}, {{"link_compliance.J1.rz", compliance}}});
  for (std::size_t row = 0; row < 4; ++row) {
    const double q1 = first[row], q12 = first[row] + second[row];
    const Eigen::Vector2d tip =
        2.0 * Eigen::Vector2d(std::cos(q1), std::sin(q1)) + 0.5 * Eigen::Vector2d(std::cos(q12), std::sin(q12));
    constexpr int kPieces = 2000;
    Eigen::Vector2d moved(0.0, 0.0);
    for (int k = 0; k < kPieces; ++k) {  // each piece turns all that is beyond it
      const Eigen::Vector2d arm = tip - 2.0 * (k + 0.5) / kPieces * Eigen::Vector2d(std::cos(q1), std::sin(q1));
      const double turn = compliance / kPieces * -10.0 * load * arm.x();
      moved += turn * Eigen::Vector2d(-arm.y(), arm.x());
    }
    const Eigen::Vector2d law = by_law.row(static_cast<Eigen::Index>(row)).head<2>();
    CHECK((law - moved).norm() < 1e-4 * moved.norm());
  }
}

TEST_CASE("a link bends about both of its ends, in every convention") {
  for (const Robot& robot : robots()) {
    CAPTURE(robot.name);
    const auto table = full_table(robot, 6, 47);
    const Eigen::Vector3d g = robot.T_measurement_base.linear() * robot.gravity;
    for (std::size_t link = 0; link + 1 < robot.joints.size(); ++link) {
      const std::string& name = robot.joints[link].name;
      CAPTURE(name);
      if (complaint({"link_compliance", {name}}, robot, table->data) != "") continue;  // has no length
      std::set<std::string> parameters;
      for (const truing::Term& term : truing::effect_terms({{"link_compliance", {name}}}, robot, table->data))
        parameters.insert(term.parameter);
      REQUIRE(parameters.size() == 2);
      for (const std::string& parameter : parameters) {
        CAPTURE(parameter);
        const double compliance = 1e-9;
        const Eigen::MatrixXd by_law =
            displacement(robot, table->data, {"link_compliance", {name}, {{parameter, compliance}}});
        for (std::size_t row = 0; row < 6; ++row) {
          Eigen::VectorXd reading(static_cast<Eigen::Index>(robot.driven_count()));
          for (Eigen::Index k = 0; k < reading.size(); ++k)
            reading[k] = table->data.joints[static_cast<std::size_t>(k)][row];
          const std::vector<Eigen::Isometry3d> frames = truing::forward_kinematics(robot, reading, 0);
          const Joint &at = robot.joints[link], &next = robot.joints[link + 1];
          Eigen::Isometry3d end = frames[link];
          Eigen::Vector3d start = (link == 0 ? robot.T_measurement_base : frames[link - 1]).translation();
          if (robot.convention == Convention::mdh) {
            end =
                end * Eigen::AngleAxisd(next.alpha, Eigen::Vector3d::UnitX()) * Eigen::Translation3d(next.a, 0.0, 0.0);
            start = frames[link] * Eigen::Vector3d(0.0, 0.0, -at.d);
          } else if (robot.convention == Convention::urdf) {
            end = end * Eigen::Translation3d(next.T_parent_joint.translation());
            start = frames[link].translation();
          }
          const Eigen::Vector3d across = end.linear().col(parameter.back() - 'x'), tip = frames.back().translation();
          const auto moment = [&](const Eigen::Vector3d& place) {
            Eigen::Vector3d sum = table->data.payload[row] * (tip - place).cross(g);
            for (std::size_t k = link + 1; k < robot.joints.size(); ++k)
              sum += *robot.joints[k].mass * (frames[k] * robot.joints[k].center_of_mass - place).cross(g);
            return across.dot(sum);
          };
          const double of_start = moment(start), of_end = moment(end.translation());
          const Eigen::Vector3d moved = compliance / 6.0 *
                                        ((2.0 * of_start + of_end) * across.cross(tip - start) +
                                         (of_start + 2.0 * of_end) * across.cross(tip - end.translation()));
          CHECK((by_law.row(static_cast<Eigen::Index>(row)).transpose() - moved).norm() < 1e-3 * moved.norm() + 1e-12);
        }
      }
    }
  }
}

TEST_CASE("base_frame and tool_frame free the model's own parameters") {
  const Robot robot = ur10();
  auto table = random_joints(robot, 60, 85);
  Robot truth = robot;
  truth.T_measurement_base = somewhere();
  truth.targets[0].T_last_target.translation().x() += 0.01;
  measure(table.get(), truth, What::position, 0.0, 86);
  truing::IdentifyOptions options;
  options.free = {"J3.a"};
  options.effects = {{"base_frame", {}}, {"tool_frame", {}}};
  const truing::Identification found = truing::identify(robot, table->data, options);
  CHECK(
      found.robot.targets[0].T_last_target.translation().isApprox(truth.targets[0].T_last_target.translation(), 1e-9));
  CHECK(found.robot.effects.empty());
  CHECK(found.train.after.rms < 1e-10);
}

TEST_CASE("a transmission error is the same by helper and by name") {
  for (const double order : {96.0, 0.5, 161.1}) {
    const truing::Effect made = truing::transmission_error(order);
    const truing::Effect& found = truing::find_effect(made.name);
    CHECK(found.name == made.name);
    truing::Inputs in;
    in.joints = Eigen::VectorXd::Constant(6, 0.3);
    CHECK(made.terms(ur10(), 1, {})[0].basis(in) == std::cos(order * 0.3));
    CHECK(found.terms(ur10(), 1, {})[1].basis(in) == std::sin(order * 0.3));
    CHECK(found.terms(ur10(), 1, {})[0].parameter == made.name + ".J2.cos");
  }
  CHECK_THROWS_AS(truing::transmission_error(0.0), std::invalid_argument);
}
