// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "support/arms.hpp"
#include "support/sanitized.hpp"

using namespace arms;
using truing::Identification;
using truing::Mistake;

namespace {

std::vector<Robot> some_arms() {
  if (kSanitized) return {ur10(), palletizer()};
  return {ur10(), palletizer(), rail_arm(), urdf_arm()};
}

/// An arm wrong by a millimetre and a milliradian, somewhere, and what a tracker sees of it.
std::unique_ptr<Table> measured(const Robot& nominal, std::size_t rows, unsigned seed, What what = What::position) {
  Robot truth = perturbed(nominal, 1e-3, 1e-3, seed);
  truth.T_measurement_base = somewhere();
  auto table = random_joints(truth, rows, seed + 1);
  measure(table.get(), truth, what, 5e-5, seed + 2);
  return table;
}

std::optional<Mistake> reviewed(const Robot& robot, const Measurements& data) {
  return truing::review(robot, data, truing::identify(robot, data));
}

void scale(Table* table, Column* column, double factor) {
  std::vector<double> values;
  for (std::size_t row = 0; row < table->data.rows; ++row) values.push_back(factor * (*column)[row]);
  *column = table->add(values);
}

/// The kind that must be said, and the words that must be in it. Gives all that is said.
std::string check_said(const Robot& robot, const Measurements& data, const std::string& kind,
                       const std::string& words) {
  const std::optional<Mistake> said = reviewed(robot, data);
  CAPTURE(robot.name);
  CAPTURE(kind);
  CAPTURE(words);
  REQUIRE(said);
  CHECK(said->kind == kind);
  INFO(said->text);
  CHECK(said->text.find(words) != std::string::npos);
  return said->text;
}

}  // namespace

const std::size_t kEvery = kSanitized ? 3 : 1;  ///< joint of an arm that is tried

TEST_CASE("a joint column with the wrong sign is found on every arm") {
  for (const Robot& robot : some_arms()) {
    for (std::size_t k = 0; k < robot.driven_count(); k += kEvery) {
      const auto table = measured(robot, 150, 100 + static_cast<unsigned>(k));
      scale(table.get(), &table->data.joints[k], -1.0);
      check_said(robot, table->data, "joint_sign", "sign of joint column " + std::to_string(k + 1));
    }
  }
}

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Every measured pose as `change` has it.
void change_poses(Table* table, const std::function<void(Vector3d*, Quaterniond*)>& change) {
  std::vector<std::vector<double>> columns(7, std::vector<double>(table->data.rows));
  for (std::size_t row = 0; row < table->data.rows; ++row) {
    Vector3d p(table->data.position[0][row], table->data.position[1][row], table->data.position[2][row]);
    Quaterniond q(table->data.orientation[0][row], table->data.orientation[1][row], table->data.orientation[2][row],
                  table->data.orientation[3][row]);
    change(&p, &q);
    const double values[] = {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
    for (std::size_t k = 0; k < 7; ++k) columns[k][row] = values[k];
  }
  for (std::size_t k = 0; k < 3; ++k) table->data.position[k] = table->add(columns[k]);
  for (std::size_t k = 0; k < 4; ++k) table->data.orientation[k] = table->add(columns[3 + k]);
}

}  // namespace

TEST_CASE("orientations that are scalar last, turned round or of inverse poses are found on every arm") {
  const auto scalar_last = [](Quaterniond q) { return Quaterniond(q.x(), q.y(), q.z(), q.w()); };
  for (const Robot& robot : some_arms()) {
    const auto said_of = [&](const std::string& kind, const std::string& words,
                             const std::function<void(Vector3d*, Quaterniond*)>& change) {
      const auto table = measured(robot, 100, 130, What::pose);
      change_poses(table.get(), change);
      check_said(robot, table->data, kind, words);
    };
    said_of("orientation_order", "qx qy qz qw (scalar last) leaves", [&](auto*, auto* q) { *q = scalar_last(*q); });
    said_of("orientation_inverse", "inverse of the orientations", [&](auto*, auto* q) { *q = q->conjugate(); });
    said_of("orientation_inverse", "(scalar last), and taking their inverse",
            [&](auto*, auto* q) { *q = scalar_last(q->conjugate()); });
    const auto invert = [](auto* p, auto* q) {
      *q = q->conjugate();
      *p = -(*q * *p);
    };
    said_of("pose_inverse", "taking the inverse of the measured poses", invert);
    said_of("pose_inverse", "(scalar last), and taking the inverse of the measured poses", [&](auto* p, auto* q) {
      invert(p, q);
      *q = scalar_last(*q);
    });
  }
}

TEST_CASE("a left-handed frame of the instrument is found on every arm") {
  for (const Robot& robot : some_arms()) {
    for (const What what : {What::position, What::pose}) {
      const auto table = measured(robot, 150, 140, what);
      if (what == What::position) {
        scale(table.get(), &table->data.position[2], -1.0);
      } else {
        change_poses(table.get(), [](Vector3d* p, Quaterniond* q) {
          p->z() = -p->z();
          *q = Quaterniond(q->w(), -q->x(), -q->y(), q->z());
        });
      }
      check_said(robot, table->data, "handedness", "left-handed frame");
    }
  }
}

TEST_CASE("exchanged joint columns are found on every arm") {
  for (const Robot& robot : some_arms()) {
    for (std::size_t k = 0; k + 1 < robot.driven_count(); k += kEvery) {
      if (robot.joints[k].type == JointType::prismatic) continue;
      const auto table = measured(robot, 150, 200 + static_cast<unsigned>(k));
      std::swap(table->data.joints[k], table->data.joints[k + 1]);
      check_said(robot, table->data, "joint_order",
                 "joint columns " + std::to_string(k + 1) + " and " + std::to_string(k + 2));
    }
  }
}

TEST_CASE("angles and lengths in another unit are found") {
  for (const Robot& robot : some_arms()) {
    const auto joints = measured(robot, 150, 300);
    for (std::size_t k = 0; k < joints->data.joints.size(); ++k) {
      if (robot.joints[robot.driven_joints()[k]].type == JointType::revolute)
        scale(joints.get(), &joints->data.joints[k], 180.0 / M_PI);
    }
    check_said(robot, joints->data, "joint_unit", "deg instead of rad");
    const auto lengths = measured(robot, 150, 301);
    for (Column& column : lengths->data.position) scale(lengths.get(), &column, 1e3);
    check_said(robot, lengths->data, "length_unit", "mm instead of m");
    if (robot.convention == Convention::urdf) continue;
    Robot links = robot;
    for (Joint& j : links.joints) {
      j.theta *= 180.0 / M_PI;
      j.alpha *= 180.0 / M_PI;
    }
    check_said(links, measured(robot, 150, 302)->data, "link_unit", "deg instead of rad");
  }
}

TEST_CASE("measurements that are a row off their joints are found on every arm") {
  for (const Robot& robot : some_arms()) {
    const auto table = measured(robot, 150, 140);
    for (Column& column : table->data.position) {
      std::vector<double> late;
      for (std::size_t row = 0; row < 150; ++row) late.push_back(column[row == 0 ? 0 : row - 1]);
      column = table->add(late);
    }
    check_said(robot, table->data, "row_shift", "1 row further down");
  }
}

/// From a row on the instrument stands `move` [m] and twice as many radians elsewhere.
static void move_instrument(Table* table, std::size_t from, double move) {
  const double c = std::cos(2.0 * move), s = std::sin(2.0 * move);
  std::vector<double> x(table->data.rows), y(table->data.rows);
  for (std::size_t row = 0; row < x.size(); ++row) {
    x[row] = table->data.position[0][row];
    y[row] = table->data.position[1][row];
    if (row < from) continue;
    x[row] = c * x[row] - s * y[row] + move;
    y[row] = s * table->data.position[0][row] + c * y[row];
  }
  table->data.position[0] = table->add(x);
  table->data.position[1] = table->add(y);
}

TEST_CASE("an instrument that was moved in the middle is found on every arm") {
  for (const Robot& robot : some_arms()) {
    for (const double move : {1e-3, 0.3}) {
      const auto table = measured(robot, 150, 142);
      move_instrument(table.get(), 90, move);
      CAPTURE(move);
      check_said(robot, table->data, "frame_change", "from row 91 on everything was measured from another place");
    }
    const std::optional<Mistake> said = reviewed(robot, measured(robot, 150, 142)->data);
    CHECK((!said || said->kind != "frame_change"));
  }
  Robot truth = ur10();
  truth.anchor = truing::Anchor{{1.2, -0.8, 0.1}, 0.25};
  const auto wire = random_joints(truth, 150, 144);  // distances have no frame, and the nominal robot no anchor
  measure(wire.get(), truth, What::distance, 5e-5, 145);
  CHECK_FALSE(reviewed(ur10(), wire->data));
  const auto many = measured(some_arms().front(), 9000, 143);
  move_instrument(many.get(), 6124, 1e-3);
  check_said(some_arms().front(), many->data, "frame_change", "from row 6125 on");
}

TEST_CASE("clocks that differ are found of every arm that moves while it is measured") {
  const std::size_t rows = 600;
  for (const Robot& robot : some_arms()) {
    for (const double late : {-0.003, 0.035, 0.0}) {
      if (kSanitized && late > 0.0) continue;
      Robot truth = perturbed(robot, 1e-3, 1e-3, 146);
      truth.T_measurement_base = somewhere();
      Table table(rows), then(rows);
      std::vector<double> time;
      for (std::size_t row = 0; row < rows; ++row) time.push_back(0.02 * static_cast<double>(row));
      for (std::size_t k = 0; k < robot.driven_count(); ++k) {
        const auto n = static_cast<double>(k);
        std::vector<double> read, seen;
        for (const double t : time) {
          const auto joint = [n](double at) { return 0.5 * std::sin((1.9 + 0.3 * n) * at + n) + 0.2 * std::cos(at); };
          read.push_back(joint(t));
          seen.push_back(joint(t - late));
        }
        table.data.joints.push_back(table.add(read));
        then.data.joints.push_back(then.add(seen));
      }
      measure(&then, truth, What::position, 5e-5, 147);
      table.data.position = then.data.position;
      table.data.time = table.add(time);
      CAPTURE(late);
      if (late == 0.0) {
        const std::optional<Mistake> said = reviewed(robot, table.data);
        CHECK((!said || said->kind != "lag"));
      } else {
        const std::string text = check_said(robot, table.data, "lag", late > 0.0 ? " ms earlier" : " ms later");
        const double found = std::stod(text.substr(text.find("were ") + 5));
        CHECK(found == doctest::Approx(1e3 * std::abs(late)).epsilon(0.02));
        if (std::abs(late) > 0.01) continue;
        truing::IdentifyOptions options;  // who asks for the effect has found it
        options.effects = {{"time_offset", {}}};
        const Measurements with_speeds = truing::with_inferred_speeds(table.data);
        const Identification fit = truing::identify(robot, with_speeds, options);
        const std::optional<Mistake> about = truing::review(robot, with_speeds, fit, options);
        CHECK((!about || about->kind != "lag"));
      }
    }
  }
}

TEST_CASE("a measurement that is missing in the middle is found on every arm") {
  for (const Robot& robot : some_arms()) {
    const auto table = measured(robot, 150, 141);
    for (Column& column : table->data.position) {
      std::vector<double> without;
      for (std::size_t row = 0; row < 150; ++row) without.push_back(column[row < 90 || row == 149 ? row : row + 1]);
      column = table->add(without);
    }
    check_said(robot, table->data, "row_shift", "from row 9");
    check_said(robot, table->data, "row_shift", "1 row further up");
  }
}

TEST_CASE("links by the other convention are found") {
  for (const Robot& robot : some_arms()) {
    if (robot.convention == Convention::urdf) continue;
    Robot other = robot;
    const bool modified = robot.convention == Convention::mdh;
    other.convention = modified ? Convention::dh : Convention::mdh;
    check_said(other, measured(robot, 150, 310)->data, "convention", modified ? "mdh" : "dh");
  }
}

TEST_CASE("a link that is another one's is said, and that no usual mistake explains it") {
  Robot wrong = ur10();
  wrong.joints[2].a -= 0.05;
  const auto table = measured(ur10(), 150, 320);
  const std::optional<Mistake> said = reviewed(wrong, table->data);
  REQUIRE(said);
  CHECK(said->kind == "unexplained");
  REQUIRE(!said->changes.empty());
  CHECK(said->changes[0].name == "J3.a");
  CHECK(said->text.find("J3.a by ") != std::string::npos);
}

TEST_CASE("no mistake is said of arms that are as workshops make them") {
  for (const Robot& robot : some_arms()) {
    for (unsigned seed = 400; seed < (kSanitized ? 402u : 420u); ++seed) {
      for (const What what : {What::position, What::pose}) {
        const auto table = measured(robot, 40 + 10 * (seed % 7), seed, what);
        const std::optional<Mistake> said = reviewed(robot, table->data);
        CAPTURE(robot.name);
        CAPTURE(seed);
        INFO((said ? said->text : ""));
        CHECK(!said);
      }
    }
  }
}

TEST_CASE("a spike far away does not make what is left look small") {
  // Base and tool alone are fitted, so that nothing of the links changes: the error that is left must say it.
  const Robot robot = ur10();
  const auto table = measured(robot, 150, 330);
  scale(table.get(), &table->data.joints[4], -1.0);
  std::vector<double> x;
  for (std::size_t row = 0; row < table->data.rows; ++row) x.push_back(table->data.position[0][row]);
  x[40] += 9e5;
  table->data.position[0] = table->add(x);
  truing::IdentifyOptions options;
  options.free = {"base.*", "tool.*"};
  const Identification found = truing::identify(robot, table->data, options);
  REQUIRE(found.rejected_rows == std::vector<std::size_t>{40});
  const std::optional<Mistake> said = truing::review(robot, table->data, found, options);
  REQUIRE(said);
  CHECK(said->kind == "joint_sign");
}

TEST_CASE("the zero of a joint may be anywhere") {
  const auto table = measured(ur10(), 150, 500);
  Robot turned = ur10();
  turned.joints[3].theta += 0.5;
  CHECK(!reviewed(turned, table->data));
}

TEST_CASE("noise comes from repeats of a pose, not from what the model leaves") {
  const auto poses = random_joints(ur10(), 40, 600);
  Table table(120);
  for (const Column& column : poses->data.joints) {
    std::vector<double> values;
    for (std::size_t row = 0; row < 120; ++row) values.push_back(column[row / 3]);
    table.data.joints.push_back(table.add(values));
  }
  measure(&table, ur10(), What::position, 2e-6, 601);
  CHECK(truing::noise_from_repeats(table.data).value_or(0.0) == doctest::Approx(2e-6).scale(0).epsilon(0.15));
  measure(&table, ur10(), What::position, 0.0, 602);  // copies are no repeats
  CHECK(!truing::noise_from_repeats(table.data));
  CHECK(!truing::noise_from_repeats(measured(ur10(), 100, 603)->data));
}
