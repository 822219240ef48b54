// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <string>

#include <doctest/doctest.h>

#include "support/contains.hpp"
#include "truing/model/urdf.hpp"

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using truing::Convention;
using truing::JointType;
using truing::Robot;

/// Fixed joints before, between and after the moving ones; negative and oblique axes; a mimic; a side branch;
/// a finger.
const char* const arm = R"(<?xml version="1.0"?>
<!-- drawn by hand -->
<robot name="arm">
  <link name="world"/>
  <link name="base"><inertial><mass value="50"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="shoulder">
    <inertial><origin xyz="0.1 0 0" rpy="1 0 0"/><mass value="4"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><geometry>
      <mesh filename="package://arm/shoulder &amp; cover.stl" scale="0.001 0.001 0.001"/>
    </geometry></visual>
  </link>
  <link name="motor">
    <inertial><origin xyz="0 0 0.2"/><mass value="2"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  </link>
  <link name="bracket"/>
  <link name="rail"/>
  <link name="elbow"/>
  <link name="wrist"/>
  <link name="flange"/>
  <link name="tcp"/>
  <link name="finger"><inertial><mass value="9"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="stand" type="fixed">
    <origin xyz="1 0 0.5" rpy="0 0 0.3"/><parent link="world"/><child link="base"/>
  </joint>
  <joint name="a" type="revolute">
    <origin xyz="0 0 0.4" rpy="0.1 -0.2 0.3"/><parent link="base"/><child link="shoulder"/>
    <axis xyz="0 -1 0"/><limit lower="-2.5" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="bolt" type="fixed">
    <origin xyz="0.3 0 0" rpy="1.5707963267948966 0 0"/><parent link="shoulder"/><child link="motor"/>
  </joint>
  <joint name="weld" type="fixed">
    <origin xyz="0.2 0.1 0" rpy="0 0.5 0"/><parent link="shoulder"/><child link="bracket"/>
  </joint>
  <joint name="s" type="prismatic">
    <!-- the rail -->
    <origin xyz="0 0 0.1" rpy="0 0 0.7"/><parent link="bracket"/><child link="rail"/>
    <axis xyz="1 2 2"/><limit lower="0" upper="0.6" effort="1" velocity="1"/>
  </joint>
  <joint name="b" type="continuous">
    <parent link="rail"/><child link="elbow"/>
    <axis xyz="-0.3 0.5 -0.8"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
  <joint name="c" type="revolute">
    <origin xyz="0.5 0 0"/><parent link="elbow"/><child link="wrist"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/><mimic joint="a" multiplier="-1.5" offset="0.2"/>
  </joint>
  <joint name="plate" type="fixed">
    <origin xyz="0 0 0.05" rpy="0 1.5707963267948966 0"/><parent link="wrist"/><child link="flange"/>
  </joint>
  <joint name="rod" type="fixed">
    <origin xyz="0 0.02 0.1" rpy="0.4 0 0"/><parent link="flange"/><child link="tcp"/>
  </joint>
  <joint name="grip" type="prismatic">
    <parent link="flange"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>
)";

/// Rotation about any axis, by Rodrigues' formula.
Isometry3d turn(const Vector3d& axis, double angle) {
  const Vector3d a = axis / axis.norm();
  Matrix3d K;
  K << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  Isometry3d T = Isometry3d::Identity();
  T.linear() = Matrix3d::Identity() + std::sin(angle) * K + (1.0 - std::cos(angle)) * K * K;
  return T;
}

Isometry3d origin(double x, double y, double z, double roll = 0.0, double pitch = 0.0, double yaw = 0.0) {
  Isometry3d T = turn(Vector3d::UnitZ(), yaw) * turn(Vector3d::UnitY(), pitch) * turn(Vector3d::UnitX(), roll);
  T.translation() = Vector3d(x, y, z);
  return T;
}

double frame_difference(const Isometry3d& a, const Isometry3d& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

VectorXd readings(double a, double s, double b) { return (VectorXd(3) << a, s, b).finished(); }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

std::string complaint(const std::string& text, const std::string& base = "", const std::string& tip = "") {
  try {
    truing::robot_from_urdf(text, base, tip);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

/// Every frame, zero and the tool off by some: what a calibration finds.
Robot disturbed(Robot robot) {
  std::mt19937 random(3);
  std::normal_distribution<double> small(0.0, 0.02);
  const auto vector = [&] { return Vector3d(small(random), small(random), small(random)); };
  for (truing::Joint& joint : robot.joints) {
    joint.T_parent_joint = joint.T_parent_joint * truing::frame_from_xyz_rpy(vector(), vector());
    joint.offset += small(random);
  }
  robot.targets[0].T_last_target = robot.targets[0].T_last_target * truing::frame_from_xyz_rpy(vector(), vector());
  return robot;
}

double worst_difference(const Robot& a, const Robot& b) {
  double worst = 0.0;
  for (const VectorXd& q : {readings(0, 0, 0), readings(1.2, 0.3, -0.8), readings(-2, 0.6, 3)}) {
    const auto of_a = truing::forward_kinematics(a, q), of_b = truing::forward_kinematics(b, q);
    for (std::size_t i = 0; i < of_a.size(); ++i) worst = std::max(worst, frame_difference(of_a[i], of_b[i]));
  }
  return worst;
}

}  // namespace

TEST_CASE("a URDF chain is the product of its origins and motions, about any axis") {
  const Robot robot = truing::robot_from_urdf(arm, "", "tcp");
  CHECK(robot.convention == Convention::urdf);
  CHECK(robot.name == "arm");
  REQUIRE(robot.joints.size() == 4);
  CHECK(robot.driven_count() == 3);
  for (const VectorXd& q : {readings(0, 0, 0), readings(0.7, 0.3, -1.1), readings(-2.0, 0.1, 2.5)}) {
    const auto frames = truing::forward_kinematics(robot, q);
    Isometry3d T = origin(1, 0, 0.5, 0, 0, 0.3) * origin(0, 0, 0.4, 0.1, -0.2, 0.3) * turn(Vector3d(0, -1, 0), q[0]);
    CHECK(frame_difference(frames[0], T) < 1e-14);
    T = T * origin(0.2, 0.1, 0, 0, 0.5, 0) * origin(0, 0, 0.1, 0, 0, 0.7) *
        Isometry3d(Eigen::Translation3d(q[1] / 3.0, 2.0 * q[1] / 3.0, 2.0 * q[1] / 3.0));
    CHECK(frame_difference(frames[1], T) < 1e-14);
    T = T * turn(Vector3d(-0.3, 0.5, -0.8), q[2]);
    CHECK(frame_difference(frames[2], T) < 1e-14);
    T = T * origin(0.5, 0, 0) * turn(Vector3d(1, 0, 0), -1.5 * q[0] + 0.2);  // the axis is x when none is given
    CHECK(frame_difference(frames[3], T) < 1e-14);
    T = T * origin(0, 0, 0.05, 0, 2 * std::atan(1.0), 0) * origin(0, 0.02, 0.1, 0.4, 0, 0);
    CHECK(frame_difference(frames[4], T) < 1e-14);
  }
}

TEST_CASE("the base may stand beside the chain") {
  const std::string text = replaced(arm, "<link name=\"bracket\"/>",
                                    "<link name=\"bracket\"/><link name=\"controller\"/>"
                                    "<joint name=\"counts\" type=\"fixed\"><parent link=\"base\"/>"
                                    "<child link=\"controller\"/><origin xyz=\"0 0.1 0.33\" rpy=\"0.2 0 3\"/></joint>");
  const Robot robot = truing::robot_from_urdf(text, "base", "tcp");
  const Robot beside = truing::robot_from_urdf(text, "controller", "tcp");
  const Isometry3d T_base_controller = origin(0, 0.1, 0.33, 0.2, 0, 3);
  const VectorXd q = readings(0.7, 0.3, -1.1);
  const auto frames = truing::forward_kinematics(robot, q), others = truing::forward_kinematics(beside, q);
  for (std::size_t i = 0; i < frames.size(); ++i)
    CHECK(frame_difference(frames[i], T_base_controller * others[i]) < 1e-14);
  const Robot found = disturbed(beside);
  const std::string written = truing::urdf_with_calibration(text, found, "controller", "tcp");
  CHECK(worst_difference(truing::robot_from_urdf(written, "controller", "truing_tool"), found) < 1e-14);
}

TEST_CASE("limits, types and couplings come over") {
  const Robot robot = truing::robot_from_urdf(arm, "base", "flange");
  REQUIRE(robot.joints.size() == 4);
  CHECK(robot.joints[0].lower == -2.5);
  CHECK(robot.joints[0].upper == 2.0);
  CHECK(robot.joints[1].type == JointType::prismatic);
  CHECK(robot.joints[1].upper == 0.6);
  CHECK(std::isinf(robot.joints[2].upper));  // continuous, whatever its <limit> says
  CHECK(robot.joints[1].axis.isApprox(Vector3d(1, 2, 2) / 3.0));
  CHECK(robot.joints[3].driven_by == std::vector<std::pair<std::string, double>>{{"a", -1.5}});
  CHECK(robot.joints[3].offset == 0.2);
}

TEST_CASE("masses that a moving link carries are merged, what moves on a branch as it stands at zero") {
  const Robot robot = truing::robot_from_urdf(arm, "", "tcp");
  REQUIRE(robot.joints[0].mass);
  CHECK(*robot.joints[0].mass == doctest::Approx(6.0));
  // shoulder: 4 kg at (0.1, 0, 0); motor: 2 kg at (0.3, 0, 0) + Rx(90 deg) (0, 0, 0.2)
  const Vector3d expected = (4.0 * Vector3d(0.1, 0, 0) + 2.0 * Vector3d(0.3, -0.2, 0)) / 6.0;
  CHECK((robot.joints[0].center_of_mass - expected).norm() < 1e-15);
  CHECK(!robot.joints[1].mass);
  REQUIRE(robot.joints[3].mass);
  CHECK(*robot.joints[3].mass == 9.0);  // of the finger
  CHECK(truing::links_off_chain(arm, "", "tcp") == std::vector<std::string>{"finger"});
  CHECK(truing::links_off_chain(arm, "", "finger").empty());
}

namespace {

/// Two links, the second fixed to the first; `joint` goes into the moving joint, `last` behind it.
std::string two_links(const std::string& first, const std::string& second, const std::string& joint = "",
                      const std::string& last = "") {
  return R"(<robot name="r"><link name="l0"/><link name="l1">)" + first + R"(</link><link name="l2">)" + second +
         R"(</link><joint name="j" type="revolute"><parent link="l0"/><child link="l1"/><axis xyz="0 0 1"/>)" + joint +
         R"(</joint><joint name="f" type="fixed"><parent link="l1"/><child link="l2"/>
         <origin xyz="-2 0 0" rpy="1.5707963267948966 0 0"/></joint>)" +
         last + "</robot>";
}

std::string inertial(const std::string& origin, const std::string& mass, const std::string& xx, const std::string& yy,
                     const std::string& zz) {
  return "<inertial>" + origin + "<mass value=\"" + mass + "\"/><inertia ixx=\"" + xx + "\" iyy=\"" + yy + "\" izz=\"" +
         zz + "\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
}

const char* const no_limits = R"(<limit lower="-1" upper="1" effort="0" velocity="0"/>)";

}  // namespace

TEST_CASE("inertias of links fixed to each other are turned and merged about the common centre of mass") {
  const std::string point = inertial("", "1", "0", "0", "0");
  const Robot dumbbell = truing::robot_from_urdf(two_links(point, point, no_limits));
  REQUIRE(dumbbell.joints[0].inertia);
  CHECK((dumbbell.joints[0].center_of_mass - Vector3d(-1, 0, 0)).norm() < 1e-15);
  CHECK((*dumbbell.joints[0].inertia - Matrix3d(Vector3d(0, 2, 2).asDiagonal())).norm() < 1e-15);

  // A quarter turn about z trades x for y, that of the fixed joint about x then y for z.
  const std::string turned = inertial(R"(<origin xyz="0 0 0" rpy="0 0 1.5707963267948966"/>)", "0", "1", "2", "3");
  const Robot one = truing::robot_from_urdf(two_links(turned, "", no_limits));
  CHECK((*one.joints[0].inertia - Matrix3d(Vector3d(2, 1, 3).asDiagonal())).norm() < 1e-15);
  const Robot other = truing::robot_from_urdf(two_links("", turned, no_limits));
  CHECK((*other.joints[0].inertia - Matrix3d(Vector3d(2, 3, 1).asDiagonal())).norm() < 1e-15);
  CHECK(*other.joints[0].inertia == other.joints[0].inertia->transpose());
}

TEST_CASE("a link without inertial has no mass and no inertia") {
  const Robot robot = truing::robot_from_urdf(two_links("", "", no_limits));
  CHECK(!robot.joints[0].mass);
  CHECK(!robot.joints[0].inertia);
}

TEST_CASE("limits of speed and torque come over, zero, less and what no machine has is none") {
  const Robot stated =
      truing::robot_from_urdf(two_links("", "", R"(<limit lower="-1" upper="1" effort="330" velocity="3.14"/>)"));
  CHECK(stated.joints[0].speed_limit == 3.14);
  CHECK(stated.joints[0].torque_limit == 330.0);
  for (const char* none : {"0", "-1", "1e10"}) {
    const std::string limit = std::string("<limit lower=\"-1\" upper=\"1\" effort=\"") + none + "\" velocity=\"" + none;
    const Robot robot = truing::robot_from_urdf(two_links("", "", limit + "\"/>"));
    CHECK(std::isinf(robot.joints[0].speed_limit));
    CHECK(std::isinf(robot.joints[0].torque_limit));
  }
}

TEST_CASE("stated friction and damping become torque effects, zeros none") {
  const auto effects = [](const std::string& joint, const std::string& last = "") {
    std::map<std::string, double> out;
    for (const truing::AppliedEffect& e :
         truing::robot_from_urdf(two_links("", "", no_limits + joint, last), "", "").torque_effects) {
      REQUIRE(e.parameters.size() == 1);
      CHECK(e.joints == std::vector<std::string>{"j"});
      CHECK(e.parameters.begin()->first == e.effect + ".j");
      out[e.effect] = e.parameters.begin()->second;
    }
    return out;
  };
  using Found = std::map<std::string, double>;
  CHECK(effects("") == Found{});
  CHECK(effects(R"(<dynamics damping="0" friction="0.0"/>)") == Found{});
  CHECK(effects(R"(<dynamics damping="0.5"/>)") == Found{{"viscous", 0.5}});
  CHECK(effects(R"(<dynamics friction="2" damping="0.5"/>)") == Found{{"coulomb", 2.0}, {"viscous", 0.5}});
  // A joint that mimics at -3 times: its drive is the other's.
  const std::string mimic = R"(<link name="l3"/><joint name="m" type="revolute"><parent link="l2"/><child link="l3"/>
      <limit lower="-1" upper="1" effort="0" velocity="0"/><dynamics friction="1" damping="0.1"/>
      <mimic joint="j" multiplier="-3"/></joint>)";
  const Found found = effects(R"(<dynamics friction="2" damping="0.5"/>)", mimic);
  CHECK(found.at("coulomb") == 5.0);
  CHECK(std::abs(found.at("viscous") - 1.4) < 1e-15);
}

TEST_CASE("without names the only root and the only leaf are taken") {
  CHECK(contains(complaint(arm), "below 'world' the URDF has 3 ends, finger, motor, tcp"));
  const Robot robot = truing::robot_from_urdf(
      R"(<robot name="r"><link name="l0"/><link name="l1"/><joint name="j" type="continuous">
         <parent link="l0"/><child link="l1"/></joint></robot>)");
  CHECK(robot.joints.size() == 1);
  CHECK(robot.targets.size() == 1);
}

TEST_CASE("the last moving link is found whatever is fixed to it, unless several chains move") {
  const auto refused = [](const std::string& text, const std::string& base) -> std::string {
    try {
      return truing::last_moving_link(text, base);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
  };
  const std::string three_ends = two_links("", "", no_limits, R"(<link name="l3"/><link name="stand"/>
      <joint name="g" type="fixed"><parent link="l1"/><child link="l3"/></joint>
      <joint name="h" type="fixed"><parent link="l0"/><child link="stand"/></joint>)");
  CHECK(contains(complaint(three_ends), "has 3 ends"));
  CHECK(truing::last_moving_link(three_ends) == "l1");
  CHECK(truing::robot_from_urdf(three_ends, "", "l1").joints.size() == 1);
  CHECK(refused(arm, "") == "finger");
  const std::string two_chains = replaced(three_ends, R"(name="h" type="fixed")", R"(name="h" type="continuous")");
  CHECK(refused(two_chains, "") ==
        "name the tip link (--tip-link, tip_link=): below 'l0' 2 chains move, that end at l1, stand");
  const std::string gripper = two_links("", "", no_limits, R"(<link name="left"/><link name="right"/>
      <joint name="g" type="continuous"><parent link="l2"/><child link="left"/></joint>
      <joint name="h" type="continuous"><parent link="l2"/><child link="right"/></joint>)");
  CHECK(contains(refused(gripper, ""), "they part at 'l2', the tip of an arm whose gripper is the rest"));
  CHECK(refused(three_ends, "l1") == "nothing moves below base link 'l1'");
  CHECK(contains(refused(three_ends, "l9"), "base link 'l9' does not exist"));
}

TEST_CASE("a URDF that cannot be used is refused with what is wrong") {
  CHECK(contains(complaint("hello"), "not a URDF"));
  CHECK(contains(complaint(""), "not a URDF"));
  CHECK(contains(complaint("<robot/>"), "not a URDF"));
  CHECK(contains(complaint(replaced(arm, "<child link=\"motor\"/>", "<child link=\"mottor\"/>"), "", "tcp"), "mottor"));
  CHECK(contains(complaint(arm, "bas", "tcp"), "base link 'bas' does not exist; the links are base, bracket, elbow"));
  CHECK(contains(complaint(arm, "base", "tool"), "tip link 'tool' does not exist"));
  CHECK(contains(complaint(arm, "elbow", "motor"), "tip link 'motor' is not below base link 'elbow'"));
  CHECK(contains(complaint(arm, "wrist", "tcp"), "nothing moves between"));
  CHECK(contains(complaint(replaced(arm, "0 -1 0", "0 0 0"), "", "tcp"), "joint 'a' has a zero axis"));
  CHECK(contains(complaint(replaced(arm, "continuous", "floating"), "", "tcp"), "joint 'b' is floating"));
  CHECK(contains(complaint(replaced(arm, "continuous", "planar"), "", "tcp"), "joint 'b' is planar"));
  CHECK(contains(complaint(arm, "shoulder", "tcp"), "joint 'c' mimics 'a'"));
  CHECK(contains(complaint(replaced(arm, "lower=\"-2.5\"", "lower=\"2.5\""), "", "tcp"), "joint 'a': lower limit"));
}

TEST_CASE("an uncalibrated robot gives the URDF back as it was") {
  const Robot robot = truing::robot_from_urdf(arm, "", "tcp");
  const std::string text = truing::urdf_with_calibration(arm, robot, "", "tcp");
  CHECK(contains(text, "<origin xyz=\"0 0 0.4\" rpy=\"0.1 -0.2 0.3\"/>"));
  CHECK(!contains(text, "truing_tool"));
  CHECK(worst_difference(truing::robot_from_urdf(text, "", "tcp"), robot) < 1e-15);
}

TEST_CASE("a calibrated robot survives the way through URDF, zeros and tool included") {
  const Robot found = disturbed(truing::robot_from_urdf(arm, "", "tcp"));
  const std::string text = truing::urdf_with_calibration(arm, found, "", "tcp");
  const Robot back = truing::robot_from_urdf(text, "", "truing_tool");
  for (const VectorXd& q : {readings(0, 0, 0), readings(1.2, 0.3, -0.8), readings(-2, 0.6, 3)}) {
    const auto expected = truing::forward_kinematics(found, q), got = truing::forward_kinematics(back, q);
    for (std::size_t i = 0; i < expected.size(); ++i) CHECK(frame_difference(expected[i], got[i]) < 1e-14);
  }
  CHECK(back.joints[0].offset == 0.0);  // it is in the origin
  CHECK(contains(text, "fixed to wrist"));
}

TEST_CASE("a second calibration of the written URDF moves the same tool link") {
  const Robot once = disturbed(truing::robot_from_urdf(arm, "", "tcp"));
  const std::string first = truing::urdf_with_calibration(arm, once, "", "tcp");
  const Robot twice = disturbed(truing::robot_from_urdf(first, "", "truing_tool"));
  const std::string second = truing::urdf_with_calibration(first, twice, "", "truing_tool");
  CHECK(worst_difference(truing::robot_from_urdf(second, "", "truing_tool"), twice) < 1e-14);
  const auto link = second.find("<link name=\"truing_tool\"");
  REQUIRE(link != std::string::npos);
  CHECK(second.find("<link name=\"truing_tool\"", link + 1) == std::string::npos);
}

TEST_CASE("what the URDF holds besides the chain survives") {
  const std::string text =
      truing::urdf_with_calibration(arm, disturbed(truing::robot_from_urdf(arm, "", "tcp")), "", "tcp");
  CHECK(text.rfind("<?xml", 0) == 0);
  for (const char* part : {"<!-- drawn by hand -->", "<!-- the rail -->", "package://arm/shoulder &amp; cover.stl",
                           "<origin xyz=\"1 0 0.5\" rpy=\"0 0 0.3\"/>", "<mimic joint=\"a\" multiplier=\"-1.5\"",
                           "name=\"finger\"", "lower=\"-2.5\""}) {
    CAPTURE(part);
    CHECK(contains(text, part));
  }
}

TEST_CASE("what URDF cannot hold is named in a comment that stays a comment") {
  Robot found = truing::robot_from_urdf(arm, "", "tcp");
  found.joints[2].ratio = 1.00125;
  found.T_measurement_base.translation() = Vector3d(0.125, -1.0, 2.0);
  found.effects = {{"backlash", {"b"}, {{"backlash.b--", -2e-4}}}};
  found.targets.push_back({"smr--->2", Isometry3d::Identity()});
  const std::string text = truing::urdf_with_calibration(arm, found, "", "tcp");
  CHECK(contains(text, "gear ratio of b: 1.00125"));
  CHECK(contains(text, "xyz 0.125 -1 2 m"));
  CHECK(contains(text, "effect backlash: backlash.b"));
  const auto begin = text.find("<!--") + 4, end = text.find("-->");
  CHECK(!contains(text.substr(begin, end - begin), "--"));
  CHECK(worst_difference(truing::robot_from_urdf(text, "", "tcp"), truing::robot_from_urdf(arm, "", "tcp")) < 1e-15);
}

TEST_CASE("a calibrated robot of another chain is refused") {
  Robot other = truing::robot_from_urdf(arm, "", "tcp");
  other.joints[1].name = "t";
  CHECK_THROWS_AS(truing::urdf_with_calibration(arm, other, "", "tcp"), std::invalid_argument);
  other = truing::robot_from_urdf(arm, "", "tcp");
  other.convention = Convention::dh;
  CHECK_THROWS_AS(truing::urdf_with_calibration(arm, other, "", "tcp"), std::invalid_argument);
}
