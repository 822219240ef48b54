// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/model/effect.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <locale>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "math/text.hpp"
#include "model/gravity.hpp"
#include "model/motion.hpp"
#include "rooms.hpp"

namespace truing {
using namespace model;

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

using Basis = std::function<double(const Inputs&)>;

// The data lack something: an error, whoever asked.
[[noreturn]] void refuse(const char* effect, const Joint& joint, const std::string& what) {
  throw std::invalid_argument(std::string(effect) + " at " + joint.name + " " + what);
}

// The joint is of the wrong kind: an error only if this very joint was asked for.
[[noreturn]] void unsuited(const char* effect, const Joint& joint, const std::string& what) {
  throw Unsuited(std::string(effect) + " at " + joint.name + " " + what);
}

bool is_revolute(const Joint& joint) { return joint.type == JointType::revolute; }
const char* motion_unit(const Joint& joint) { return is_revolute(joint) ? "rad" : "m"; }

void require_driven(const char* effect, const Joint& joint) {
  if (!joint.passive()) return;
  std::vector<std::string> drivers;
  for (const auto& driver : joint.driven_by) drivers.push_back(driver.first);
  unsuited(effect, joint, "needs a joint with a reading; " + joint.name + " is passive, driven by " + listed(drivers));
}

void require_revolute(const char* effect, const Joint& joint, const std::string& why) {
  if (!is_revolute(joint)) unsuited(effect, joint, "needs a revolute joint; " + joint.name + " is prismatic" + why);
}

void require_weight(const char* effect, const Robot& robot, const Joint& joint, const Measurements& data,
                    const std::string& or_else = "") {
  if (knows_mass(robot) || data.payload) return;
  refuse(effect, joint,
         "needs gravity torques: give the links' mass and com in the robot, or the column payload_kg" + or_else);
}

// Place of a driven joint among the driven ones: the number in its column names, less one.
std::size_t driven_number(const Robot& robot, std::size_t joint) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  return static_cast<std::size_t>(std::find(driven.begin(), driven.end(), joint) - driven.begin());
}

Term make_term(const std::string& parameter, const std::string& unit, const std::string& site, Basis basis,
               bool needs_gravity = false) {
  Term term;
  term.parameter = parameter;
  term.unit = unit;
  term.site = site;
  term.basis = std::move(basis);
  term.needs_gravity = needs_gravity;
  return term;
}

// A number taken from the data the first time, and from the robot ever after.
double remembered(const Robot& robot, const std::string& effect, const std::string& name,
                  const std::function<double()>& first) {
  for (const AppliedEffect& applied : robot.effects) {
    const auto found = applied.parameters.find(name);
    if (applied.effect == effect && found != applied.parameters.end()) return found->second;
  }
  return first();
}

// Mean of what is a number in the column; 0 if nothing is.
double mean_of(const Column& column, std::size_t rows) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    if (!std::isfinite(column[row])) continue;
    sum += column[row];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

// The effects that are parameters of the model itself: identify frees `ratio`, `offset` or the link's values.

std::vector<Term> gear_ratio(const Robot& robot, std::size_t joint, const Measurements&) {
  require_driven("gear_ratio", robot.joints.at(joint));  // a passive joint's ratio is not used
  return {};
}

std::vector<Term> joint_offset(const Robot& robot, std::size_t joint, const Measurements&) {
  (void)robot.joints.at(joint);  // any joint: a passive one has its own zero
  return {};
}

std::vector<Term> link_geometry(const Robot& robot, std::size_t joint, const Measurements&) {
  (void)robot.joints.at(joint);
  return {};
}

// The joint stands half the play further on in the direction that it came in: direction * play / 2.
std::vector<Term> backlash(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_driven("backlash", at);
  const std::size_t k = driven_number(robot, joint);
  if (k >= data.direction.size() || !data.direction[k]) {
    refuse("backlash", at, "needs the column dir" + std::to_string(k + 1) + " (approach direction -1, 0, 1)");
  }
  Term term;
  term.parameter = "backlash." + at.name;
  term.unit = motion_unit(at);
  term.site = at.name;
  term.basis = [k](const Inputs& in) { return 0.5 * in.data->direction[k][in.row]; };
  return {term};
}

// Eccentric or tilted gears and encoder discs: once and twice per turn of the joint.
std::vector<Term> harmonic(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  require_revolute("harmonic", at, " and has no turn to be periodic in");
  const auto index = static_cast<Eigen::Index>(joint);
  std::vector<Term> terms;
  for (const int order : {1, 2}) {
    Term cosine;
    cosine.parameter = "harmonic." + at.name + ".cos" + std::to_string(order);
    cosine.unit = "rad";
    cosine.site = at.name;
    cosine.basis = [index, order](const Inputs& in) { return std::cos(order * in.joints[index]); };
    Term sine = cosine;
    sine.parameter = "harmonic." + at.name + ".sin" + std::to_string(order);
    sine.basis = [index, order](const Inputs& in) { return std::sin(order * in.joints[index]); };
    terms.push_back(cosine);
    terms.push_back(sine);
  }
  return terms;
}

// A linear spring: the joint gives way by compliance * torque, in the direction that the weight pulls. Where
// no mass is known, the payload's torque alone.
std::vector<Term> joint_compliance(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_weight("joint_compliance", robot, at, data, ", or ask for gravity_moment, which finds the moments itself");
  const auto index = static_cast<Eigen::Index>(joint);
  Term term;
  term.parameter = "joint_compliance." + at.name;
  term.unit = at.type == JointType::revolute ? "rad/Nm" : "m/N";
  term.site = at.name;
  term.basis = [index](const Inputs& in) { return in.gravity_torque[index]; };
  term.needs_gravity = true;
  return {term};
}

// Stiffness in three zones, as strain-wave gears have it (K1 < K2 < K3 below T1, up to T2 and beyond;
// Harmonic Drive, Engineering data, "torsional stiffness"): a compliance for each zone of |torque|. T1 and T2
// are not fitted: they part the data's |torque| in thirds, so that every zone is seen.
std::vector<Term> stiffness_zones(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_weight("stiffness_zones", robot, at, data);
  const auto index = static_cast<Eigen::Index>(joint);
  const std::string prefix = "stiffness_zones." + at.name;
  std::vector<double> sizes;  // of the torque, sorted; only when a knot is asked for the first time
  const auto quantile = [&](double share) {
    if (sizes.empty() && data.joints.size() == robot.driven_count()) {
      constexpr std::size_t kRows = 10000;  // enough for a third
      const std::size_t step = std::max<std::size_t>(1, data.rows / kRows);
      const Eigen::MatrixXd coupling = coupling_matrix(robot);
      Eigen::VectorXd reading(static_cast<Eigen::Index>(data.joints.size()));
      Eigen::VectorXd torque(static_cast<Eigen::Index>(robot.joints.size()));
      for (std::size_t row = 0; row < data.rows; row += step) {
        for (Eigen::Index k = 0; k < reading.size(); ++k) reading[k] = data.joints[static_cast<std::size_t>(k)][row];
        gravity_torques_at(robot, coupling, forward_kinematics(robot, reading, 0),
                           data.payload ? data.payload[row] : 0.0, torque);
        sizes.push_back(std::abs(torque[index]));
      }
      std::sort(sizes.begin(), sizes.end());
    }
    return sizes.empty() ? 0.0 : sizes[static_cast<std::size_t>(share * static_cast<double>(sizes.size()))];
  };
  const double first = remembered(robot, "stiffness_zones", prefix + ".T1", [&] { return quantile(1.0 / 3.0); });
  const double second = remembered(robot, "stiffness_zones", prefix + ".T2", [&] { return quantile(2.0 / 3.0); });
  const double edges[4] = {0.0, first, second, std::numeric_limits<double>::infinity()};
  std::vector<Term> terms;
  for (int zone = 0; zone < 3; ++zone) {
    const double from = edges[zone], to = edges[zone + 1];
    terms.push_back(make_term(
        prefix + ".c" + std::to_string(zone + 1), is_revolute(at) ? "rad/Nm" : "m/N", at.name,
        [index, from, to](const Inputs& in) {
          const double torque = in.gravity_torque[index];
          return std::copysign(std::clamp(std::abs(torque), from, to) - from, torque);
        },
        true));
    terms.back().constants = {{prefix + ".T1", first}, {prefix + ".T2", second}};
  }
  return terms;
}

// A spring under weights that nobody knows. The weight of all that hangs beyond a revolute joint turns it by
// a . sum_l (R_l H_l) x g, linear in the first moments H_l [kg m]: each link's own, and what hangs beyond it
// at its end (Atkeson, An and Hollerbach 1986; Khalil and Dombre 2002, ch. 9: those that can be told apart
// are the base parameters, the others are frozen by name). A prismatic joint beyond carries its mass along. A
// parameter is compliance * moment. A known payload comes on top by joint_compliance.
std::vector<Term> gravity_moment(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  require_revolute("gravity_moment", at, "");
  const auto shared = std::make_shared<const Robot>(robot);
  const Eigen::VectorXd carried = coupling_matrix(robot).col(static_cast<Eigen::Index>(joint));
  const Vector3d g = robot.T_measurement_base.linear() * robot.gravity;
  // Turning the coordinate turns it and its passive joints: the torques of all these, of a force at an arm
  // from the axis.
  const auto torque = [shared, carried, g](const Inputs& in, std::size_t link, const Vector3d& arm) {
    double sum = 0.0, size = 0.0;
    for (std::size_t m = 0; m <= link; ++m) {
      const double weight = carried[static_cast<Eigen::Index>(m)];
      if (weight == 0.0 || !is_revolute(shared->joints[m])) continue;
      sum += weight * joint_axis(*shared, in.frames, m).direction.dot(arm.cross(g));
      size += std::abs(weight) * arm.norm() * g.norm();
    }
    return without_rounding(sum, size);
  };
  const std::string prefix = "gravity_moment." + at.name + ".";
  std::vector<Term> terms;
  for (std::size_t link = joint; link < robot.joints.size(); ++link) {
    for (int axis = 0; axis < 3; ++axis) {
      terms.push_back(make_term(
          prefix + robot.joints[link].name + "." + "xyz"[axis], "rad kg/N", at.name,
          [torque, link, axis](const Inputs& in) { return torque(in, link, in.frames[link].linear().col(axis)); },
          true));
    }
    if (is_revolute(robot.joints[link])) continue;
    terms.push_back(make_term(
        prefix + robot.joints[link].name + ".mass", "rad kg/Nm", at.name,
        [shared, torque, link](const Inputs& in) {
          const Vector3d axis = joint_axis(*shared, in.frames, link).direction;
          return torque(in, link, in.joints[static_cast<Eigen::Index>(link)] * axis);
        },
        true));
  }
  return terms;
}

// The frame in which a link ends: where its joint's successor starts to turn, before it turns.
Isometry3d link_end(const Robot& robot, const std::vector<Isometry3d>& frames, std::size_t link) {
  if (robot.convention == Convention::dh) return frames[link];
  const Joint& next = robot.joints[link + 1];
  if (robot.convention == Convention::urdf)
    return frames[link] * Eigen::Translation3d(next.T_parent_joint.translation());
  return frames[link] * Eigen::AngleAxisd(next.alpha, Vector3d::UnitX()) * Eigen::Translation3d(next.a, 0.0, 0.0) *
         Eigen::AngleAxisd(next.beta, Vector3d::UnitY());
}

// Where it starts: at its own joint.
Vector3d link_start(const Robot& robot, const std::vector<Isometry3d>& frames, std::size_t link, double motion) {
  const Joint& joint = robot.joints[link];
  switch (robot.convention) {
    case Convention::dh:
      return (link == 0 ? robot.T_measurement_base : frames[link - 1]).translation();
    case Convention::mdh:
      return frames[link] * Vector3d(0.0, 0.0, -joint.d - (is_revolute(joint) ? 0.0 : motion));
    case Convention::urdf:
      break;
  }
  return frames[link].translation();
}

using Sites = std::array<std::string, 3>;

// Elementary rotations about where a link starts. Nothing turns there after the joint has: so it is the two
// angles before, and the joint's own.
Sites start_sites(const Robot& robot, std::size_t link) {
  const std::string& at = robot.joints[link].name;
  if (robot.convention == Convention::urdf) return {at + ".rx", at + ".ry", at + ".rz"};
  if (robot.convention == Convention::mdh) return {at + ".alpha", at + ".beta", at + ".theta"};
  if (link == 0) return {"base.rx", "base.ry", "base.rz"};
  return {robot.joints[link - 1].name + ".alpha", robot.joints[link - 1].name + ".beta", at + ".theta"};
}

// The axes that these turn about, in the measurement frame.
Eigen::Matrix3d start_axes(const Robot& robot, const std::vector<Isometry3d>& frames, std::size_t link) {
  if (robot.convention == Convention::dh && link == 0) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d before = (link == 0 ? robot.T_measurement_base : frames[link - 1]).linear();
  if (robot.convention != Convention::mdh) return before;
  return before * Eigen::AngleAxisd(robot.joints[link].alpha, Vector3d::UnitX()).toRotationMatrix();
}

// About where it ends, and about the axes of link_end: its last angles, and the next joint's before it turns.
Sites end_sites(const Robot& robot, std::size_t link) {
  const std::string &at = robot.joints[link].name, &next = robot.joints[link + 1].name;
  if (robot.convention == Convention::dh) return {at + ".alpha", at + ".beta", next + ".theta"};
  if (robot.convention == Convention::mdh) return {next + ".alpha", next + ".beta", next + ".theta"};
  return {next + ".rx", next + ".ry", next + ".rz"};
}

// Moment about `axis` through `place` of the weight of all links beyond `link` and of the payload; the link's
// own weight is left out.
double moment_beyond(const Robot& robot, const Inputs& in, std::size_t link, const Vector3d& place,
                     const Vector3d& axis) {
  const double mass = in.data->payload ? in.data->payload[in.row] : 0.0;
  Vector3d first_moment = mass * (in.frames.back().translation() - place);
  double size = first_moment.norm();  // of what adds up
  for (std::size_t k = link + 1; k < robot.joints.size(); ++k) {
    const Joint& beyond = robot.joints[k];
    if (!beyond.mass) continue;
    const Vector3d part = *beyond.mass * (in.frames[k] * beyond.center_of_mass - place);
    first_moment += part;
    size += part.norm();
  }
  const Vector3d g = robot.T_measurement_base.linear() * robot.gravity;
  return without_rounding(axis.dot(first_moment.cross(g)), size * g.norm());
}

// A link bends about the two axes across it: a uniform beam under what hangs beyond its end (Euler and
// Bernoulli). The bending moment runs straight from Ms at the start to Me at the end; the end then is displaced
// and turned as by a turn about the start of c (2 Ms + Me) / 6 and one about the end of c (Ms + 2 Me) / 6, with
// c = L / EI (conjugate beam, Mohr 1868). A turn about the end alone would be the next joint's spring.
std::vector<Term> link_compliance(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  if (joint + 1 == robot.joints.size())
    unsuited("link_compliance", at, "needs a joint beyond the link; " + at.name + " is the last");
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(robot.driven_count()));
  const std::vector<Isometry3d> frames = forward_kinematics(robot, zero, 0);
  const Isometry3d end = link_end(robot, frames, joint);
  const Vector3d along = end.linear().transpose() * (end.translation() - link_start(robot, frames, joint, 0.0));
  if (along.norm() < 5e-3) unsuited("link_compliance", at, "needs a link with a length; this one has none");
  require_weight("link_compliance", robot, at, data);
  Eigen::Index lengthwise = 0;
  along.cwiseAbs().maxCoeff(&lengthwise);

  const auto shared = std::make_shared<const Robot>(robot);
  const auto moment_at_start = [shared, joint](const Inputs& in, const Vector3d& axis) {
    const double motion = in.joints[static_cast<Eigen::Index>(joint)];
    return moment_beyond(*shared, in, joint, link_start(*shared, in.frames, joint, motion), axis);
  };
  const auto moment_at_end = [shared, joint](const Inputs& in, const Vector3d& axis) {
    return moment_beyond(*shared, in, joint, link_end(*shared, in.frames, joint).translation(), axis);
  };
  const Sites about_start = start_sites(robot, joint), about_end = end_sites(robot, joint);
  std::vector<Term> terms;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (axis == lengthwise) continue;
    const std::string parameter = "link_compliance." + at.name + ".r" + "xyz"[axis];
    const auto across = [shared, joint, axis](const Inputs& in) -> Vector3d {
      return link_end(*shared, in.frames, joint).linear().col(axis);
    };
    const auto turn_at_end = [=](const Inputs& in) {
      return (moment_at_start(in, across(in)) + 2.0 * moment_at_end(in, across(in))) / 6.0;
    };
    terms.push_back(make_term(parameter, "rad/Nm", about_end[static_cast<std::size_t>(axis)], turn_at_end, true));
    for (Eigen::Index k = 0; k < 3; ++k) {
      const auto turn_at_start = [=](const Inputs& in) {
        const double part = start_axes(*shared, in.frames, joint).col(k).dot(across(in));
        return part * (2.0 * moment_at_start(in, across(in)) + moment_at_end(in, across(in))) / 6.0;
      };
      terms.push_back(make_term(parameter, "rad/Nm", about_start[static_cast<std::size_t>(k)], turn_at_start, true));
    }
  }
  return terms;
}

// Play taken up by the weight, whichever way the joint came: sign(torque) * play / 2.
std::vector<Term> gravity_backlash(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_weight("gravity_backlash", robot, at, data);
  const auto index = static_cast<Eigen::Index>(joint);
  const auto side = [index](const Inputs& in) {
    const double torque = in.gravity_torque[index];
    return torque > 0.0 ? 0.5 : torque < 0.0 ? -0.5 : 0.0;
  };
  return {make_term("gravity_backlash." + at.name, motion_unit(at), at.name, side, true)};
}

// Wind-up of the drive under the torque that the motor gives, friction included: torque / K (Slocum 1992,
// Precision machine design).
std::vector<Term> windup(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  require_driven("windup", at);
  const std::string name = "tau" + std::to_string(driven_number(robot, joint) + 1) + (is_revolute(at) ? "_Nm" : "_N");
  if (data.covariates.count(name) == 0) refuse("windup", at, "needs the column " + name + " (torque of the joint)");
  return {make_term("windup." + at.name, is_revolute(at) ? "rad/Nm" : "m/N", at.name,
                    [name](const Inputs& in) { return in.data->covariates.at(name)[in.row]; })};
}

constexpr const char* kTransmission = "transmission_error";

std::vector<Term> transmission_error_at(const std::string& name, double order, const Robot& robot, std::size_t joint) {
  const Joint& at = robot.joints.at(joint);
  require_revolute(kTransmission, at, " and has no turn to be periodic in");
  const auto index = static_cast<Eigen::Index>(joint);
  return {make_term(name + "." + at.name + ".cos", "rad", at.name,
                    [index, order](const Inputs& in) { return std::cos(order * in.joints[index]); }),
          make_term(name + "." + at.name + ".sin", "rad", at.name,
                    [index, order](const Inputs& in) { return std::sin(order * in.joints[index]); })};
}

std::vector<Term> transmission_error_without_order(const Robot&, std::size_t, const Measurements&) {
  throw std::invalid_argument(
      "transmission_error needs the order of the mesh in its name, e.g. transmission_error@96 (per turn of "
      "the joint)");
}

// "transmission_error@96" -> its effect; nullptr when the name is of another form. Made once and kept:
// find_effect hands out references.
const Effect* transmission_error_of(const std::string& name) {
  const std::string prefix = std::string(kTransmission) + "@";
  if (name.compare(0, prefix.size(), prefix) != 0) return nullptr;
  const std::string text = name.substr(prefix.size());
  std::istringstream in(text);
  in.imbue(std::locale::classic());
  double order = 0.0;
  if (!(in >> order) || !in.eof()) {
    throw std::invalid_argument("effect '" + name + "': the order '" + text +
                                "' is not a number; expected e.g. transmission_error@96");
  }
  static std::mutex mutex;
  static std::map<std::string, Effect> made;
  Effect effect = transmission_error(order);
  effect.name = name;
  effect.terms = [name, order](const Robot& robot, std::size_t joint, const Measurements&) {
    return transmission_error_at(name, order, robot, joint);
  };
  const std::lock_guard<std::mutex> lock(mutex);
  return &made.emplace(name, std::move(effect)).first->second;
}

// Temperature above the mean of the data that the robot was identified with. The mean stays with the robot.
struct Warmth {
  std::map<std::string, double> constants;
  double reference = 0.0;
  double operator()(const Inputs& in) const { return in.data->temperature[in.row] - reference; }
};

Warmth warmth(const char* effect, const Robot& robot, const Joint& at, const Measurements& data) {
  if (!data.temperature) refuse(effect, at, "needs the column temp_C (temperature)");
  const std::string name = std::string(effect) + ".reference_C";
  Warmth out;
  out.reference = remembered(robot, effect, name, [&] { return mean_of(data.temperature, data.rows); });
  out.constants = {{name, out.reference}};
  return out;
}

// The link grows: every length by k * (T - T_ref) * length, one k for the link; steel 12e-6, aluminium 23e-6
// per kelvin. The reference is the mean temperature, where the identified lengths hold.
std::vector<Term> thermal(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  const Vector3d origin = at.T_parent_joint.translation();
  std::vector<std::pair<const char*, double>> lengths = {{"a", at.a}, {"d", at.d}};
  if (robot.convention == Convention::urdf) lengths = {{"x", origin.x()}, {"y", origin.y()}, {"z", origin.z()}};
  // [m]: an offset found where the drawing has none does not make it a beam.
  const auto is_zero = [](const auto& length) { return std::abs(length.second) < 1e-3; };
  lengths.erase(std::remove_if(lengths.begin(), lengths.end(), is_zero), lengths.end());
  if (lengths.empty()) unsuited("thermal", at, "needs a link with a length; this one has none");
  const Warmth warm = warmth("thermal", robot, at, data);
  std::vector<Term> terms;
  for (const auto& [value, length] : lengths) {
    terms.push_back(make_term(
        "thermal." + at.name, "1/K", at.name + "." + value,
        [warm, metres = length](const Inputs& in) { return warm(in) * metres; }, true));
    terms.back().constants = warm.constants;
  }
  return terms;
}

// The joint's zero moves with temperature: k * (T - T_ref), T_ref as for `thermal`.
std::vector<Term> thermal_zero(const Robot& robot, std::size_t joint, const Measurements& data) {
  const Joint& at = robot.joints.at(joint);
  const Warmth warm = warmth("thermal_zero", robot, at, data);
  Term term = make_term("thermal_zero." + at.name, std::string(motion_unit(at)) + "/K", at.name, warm);
  term.constants = warm.constants;
  return {term};
}

// The base wanders in the measurement frame: each of its six coordinates by rate * (t - t_ref), t_ref the
// mean time. No order of rows stands for a missing time.
std::vector<Term> drift(const Robot& robot, std::size_t, const Measurements& data) {
  if (!data.time) throw std::invalid_argument("drift needs the column t_s (time)");
  const double reference =
      remembered(robot, "drift", "drift.reference_s", [&] { return mean_of(data.time, data.rows); });
  std::vector<Term> terms;
  for (const char* coordinate : {"x", "y", "z", "rx", "ry", "rz"}) {
    const std::string site = std::string("base.") + coordinate;
    terms.push_back(make_term("drift." + site, coordinate[0] == 'r' ? "rad/s" : "m/s", site,
                              [reference](const Inputs& in) { return in.data->time[in.row] - reference; }));
    terms.back().constants = {{"drift.reference_s", reference}};
  }
  return terms;
}

// Concentric shafts of a wrist: turning one joint turns the next ones a little. dq5 = c q4, dq6 = c' q4 + c"
// q5, for the last three joints, each ratio on its own.
std::vector<Term> joint_coupling(const Robot& robot, std::size_t, const Measurements&) {
  const std::size_t n = robot.joints.size();
  const auto is_wrist = [](const Joint& joint) { return is_revolute(joint) && !joint.passive(); };
  if (n < 3 || !std::all_of(robot.joints.end() - 3, robot.joints.end(), is_wrist)) {
    throw Unsuited("joint_coupling needs a wrist: the last three joints revolute and with readings");
  }
  std::vector<Term> terms;
  for (const auto& [moved, mover] :
       {std::make_pair(n - 2, n - 3), std::make_pair(n - 1, n - 3), std::make_pair(n - 1, n - 2)}) {
    const std::string site = robot.joints[moved].name;
    terms.push_back(
        make_term("joint_coupling." + site + "." + robot.joints[mover].name, "-", site,
                  [index = static_cast<Eigen::Index>(mover)](const Inputs& in) { return in.joints[index]; }));
  }
  return terms;
}

// Four-bar linkages whose opposite bars are not quite equal: to first order the passive joint errs by a cos u + b sin
// u, u an angle between two bars: the difference of its first and last driver (q3 - q2 of a palletizer), or, where one
// bar is fixed to the base or the wrist, the first driver's angle or their sum.
std::vector<Term> linkage(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  if (!at.passive()) unsuited("linkage", at, "needs a passive joint; " + at.name + " has a reading of its own");
  std::vector<Eigen::Index> drivers;
  for (const auto& driver : at.driven_by) drivers.push_back(static_cast<Eigen::Index>(robot.joint_index(driver.first)));
  const auto [first, last] = std::minmax_element(drivers.begin(), drivers.end());
  std::vector<std::tuple<std::string, double, double>> angles = {
      {"", -1.0, 1.0}, {"_first", 1.0, 0.0}, {"_sum", 1.0, 1.0}};
  if (*first == *last) angles = {{"", 0.0, 1.0}};
  std::vector<Term> terms;
  for (const auto& [suffix, of_first, of_last] : angles) {
    const auto angle = [a = *first, b = *last, of_first = of_first, of_last = of_last](const Inputs& in) {
      return of_first * in.joints[a] + of_last * in.joints[b];
    };
    terms.push_back(make_term("linkage." + at.name + ".cos" + suffix, motion_unit(at), at.name,
                              [angle](const Inputs& in) { return std::cos(angle(in)); }));
    terms.push_back(make_term("linkage." + at.name + ".sin" + suffix, motion_unit(at), at.name,
                              [angle](const Inputs& in) { return std::sin(angle(in)); }));
  }
  return terms;
}

// Bearing run-out: the axis tilts about the two directions across it, once per turn. DH turns before its
// link, so what tilts the axis is the link before (alpha, beta), or the base; modified DH has alpha and beta
// before the joint; URDF the origin's rotations.
std::vector<Term> axis_wobble(const Robot& robot, std::size_t joint, const Measurements&) {
  const Joint& at = robot.joints.at(joint);
  require_revolute("axis_wobble", at, " and does not turn");
  // Elementary rotations there are, and what each of the two tilts is in these.
  std::vector<std::string> sites;
  Eigen::Matrix<double, 3, 2> tilts = Eigen::Matrix<double, 3, 2>::Identity();
  const auto about_any_axis = [&](const std::string& frame, const Eigen::Matrix3d& rotation, const Vector3d& axis) {
    sites = {frame + ".rx", frame + ".ry", frame + ".rz"};
    const Eigen::Matrix3d from_z = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis).toRotationMatrix();
    tilts = (rotation * from_z).leftCols<2>();
  };
  switch (robot.convention) {
    case Convention::mdh:
      sites = {at.name + ".alpha", at.name + ".beta"};
      break;
    case Convention::urdf:
      about_any_axis(at.name, at.T_parent_joint.linear(), at.axis);
      break;
    case Convention::dh:
      if (joint == 0)
        about_any_axis("base", robot.T_measurement_base.linear(), Vector3d::UnitZ());
      else
        sites = {robot.joints[joint - 1].name + ".alpha", robot.joints[joint - 1].name + ".beta"};
      break;
  }
  const auto index = static_cast<Eigen::Index>(joint);
  std::vector<Term> terms;
  for (int tilt = 0; tilt < 2; ++tilt) {
    for (const bool cosine : {true, false}) {
      const std::string parameter = "axis_wobble." + at.name + (cosine ? ".cos_" : ".sin_") + "xy"[tilt];
      for (std::size_t k = 0; k < sites.size(); ++k) {
        const double share = tilts(static_cast<Eigen::Index>(k), tilt);
        if (share == 0.0 && sites.size() < 3) continue;  // of three, none stays zero when the frame turns
        terms.push_back(make_term(
            parameter, "rad", sites[k],
            [index, cosine, share](const Inputs& in) {
              return share * (cosine ? std::cos(in.joints[index]) : std::sin(in.joints[index]));
            },
            sites.size() == 3));  // the shares come from the robot's frames
      }
    }
  }
  return terms;
}

// The instrument's metre: x -> (1 + s) x. Stretching about the base's origin differs from stretching about
// the instrument's by a shift of the base, which is fitted anyway; and what it adds at the tip does not
// depend on where the base stands: the way from base to tip, in the last link's frame, where the targets'
// coordinates are.
std::vector<Term> scale(const Robot& robot, std::size_t, const Measurements&) {
  std::vector<std::string> targets;
  for (const Target& target : robot.targets) targets.push_back(target.name);
  if (targets.empty()) targets.push_back("tool");
  const std::size_t last = robot.joints.size() - 1;
  const Vector3d base = robot.T_measurement_base.translation();
  std::vector<Term> terms;
  for (const std::string& target : targets) {
    for (int axis = 0; axis < 3; ++axis) {
      terms.push_back(make_term(
          "scale", "-", target + "." + "xyz"[axis],
          [last, base, axis](const Inputs& in) { return in.frames[last].linear().col(axis).dot(in.tip - base); },
          true));
    }
  }
  return terms;
}

// Joints and measurement are stamped by clocks that differ by dt: every joint is read dt * speed too far
// back.
std::vector<Term> time_offset(const Robot& robot, std::size_t, const Measurements& data) {
  std::vector<Term> terms;
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (std::size_t k = 0; k < driven.size(); ++k) {
    const Joint& at = robot.joints[driven[k]];
    if (k >= data.joint_speed.size() || !data.joint_speed[k]) {
      throw std::invalid_argument("time_offset needs the column qd" + std::to_string(k + 1) + "_" + motion_unit(at) +
                                  "_s (speed of joint " + at.name + ")");
    }
    terms.push_back(
        make_term("time_offset", "s", at.name, [k](const Inputs& in) { return in.data->joint_speed[k][in.row]; }));
  }
  return terms;
}

// Parameters of the model, as the first three: identify frees base and targets.
std::vector<Term> no_terms(const Robot&, std::size_t, const Measurements&) { return {}; }

constexpr std::size_t kRobot = std::numeric_limits<std::size_t>::max();  // in place of a joint: the robot as a whole

// Terms of one effect at one joint, or of the robot as a whole.
std::vector<Term> terms_at(const Effect& effect, const Robot& robot, std::size_t joint, const Measurements& data) {
  std::vector<Term> terms = effect.terms(robot, joint == kRobot ? 0 : joint, data);
  for (Term& term : terms) {
    if (term.parameter.empty() || !term.basis) {
      throw std::invalid_argument("effect '" + effect.name + "' gives a term without parameter name or basis");
    }
    term.joint = joint == kRobot ? "" : robot.joints[joint].name;
  }
  return terms;
}

using Place = std::pair<std::size_t, std::vector<Term>>;

// What a request without joints means: the driven joints, less those that the effect has no meaning for; if
// there is none left, the passive ones.
std::vector<Place> suitable_places(const Effect& effect, const Robot& robot, const Measurements& data) {
  std::vector<Place> places;
  std::string first_complaint;
  for (const bool passive : {false, true}) {
    for (std::size_t joint = 0; joint < robot.joints.size(); ++joint) {
      if (robot.joints[joint].passive() != passive) continue;
      try {
        places.emplace_back(joint, terms_at(effect, robot, joint, data));
      } catch (const Unsuited& why) {
        if (first_complaint.empty()) first_complaint = why.what();
      }
    }
    if (!places.empty()) return places;
  }
  throw Unsuited(effect.name + " suits no joint of this robot: " + first_complaint);
}

std::vector<Place> requested_places(const EffectRequest& request, const Effect& effect, const Robot& robot,
                                    const Measurements& data) {
  if (!effect.per_joint) {
    if (!request.joints.empty()) {
      throw std::invalid_argument(effect.name + " belongs to the robot as a whole: ask for it without joints, not at " +
                                  listed(request.joints));
    }
    return {{kRobot, terms_at(effect, robot, kRobot, data)}};
  }
  if (request.joints.empty()) return suitable_places(effect, robot, data);
  std::vector<Place> places;
  for (const std::string& name : request.joints) {
    const std::size_t joint = robot.joint_index(name);
    places.emplace_back(joint, terms_at(effect, robot, joint, data));
  }
  return places;
}

}  // namespace

Effect transmission_error(double order) {
  if (!(std::isfinite(order) && order > 0.0)) {
    throw std::invalid_argument("transmission_error: order is " + number(order) +
                                " per turn, expected a positive number");
  }
  const std::string name = std::string(kTransmission) + "@" + exact_number(order);
  return {name, "error that repeats with the gear's teeth, order times per turn",
          [name, order](const Robot& robot, std::size_t joint, const Measurements&) {
            return transmission_error_at(name, order, robot, joint);
          }};
}

const std::vector<Effect>& catalogue() {
  static const std::vector<Effect> effects = {
      {"gear_ratio", "the joint turns by ratio * reading: wrong gear ratio or encoder scale", gear_ratio},
      {"joint_offset", "the joint's zero is elsewhere", joint_offset},
      {"link_geometry", "lengths and angles of the link differ from the drawing", link_geometry},
      {"base_frame", "the robot stands elsewhere in the measurement frame", no_terms, false},
      {"tool_frame", "the targets sit elsewhere on the last link", no_terms, false},
      {"joint_compliance", "the joint gives way under the weight that it carries", joint_compliance},
      {"stiffness_zones", "the joint gives way, and more or less so as torque grows: strain-wave gears",
       stiffness_zones},
      {"gravity_moment", "the joint gives way under weights that are not known", gravity_moment},
      {"link_compliance", "the link bends under the weight that hangs beyond it", link_compliance},
      {"harmonic", "error once and twice per turn: eccentric gear or encoder disc", harmonic},
      {"transmission_error", "error that repeats with the gear's teeth; name the order: transmission_error@96",
       transmission_error_without_order},
      {"backlash", "the joint's play, seen when poses are approached from both sides", backlash},
      {"gravity_backlash", "the joint's play, taken up by the weight", gravity_backlash},
      {"windup", "the drive twists under the torque of the motor", windup},
      {"thermal", "the link grows with temperature", thermal},
      {"thermal_zero", "the joint's zero moves with temperature", thermal_zero},
      {"drift", "the base wanders in the measurement frame as time goes on", drift, false},
      {"joint_coupling", "wrist joints turn each other", joint_coupling, false},
      {"linkage", "bars of a parallelogram are not equal: error of the passive joint", linkage},
      {"axis_wobble", "the joint's axis tilts as it turns", axis_wobble},
      {"scale", "the instrument's metre is too long or too short", scale, false},
      {"time_offset", "joints and measurement are stamped by clocks that differ", time_offset, false},
  };
  return effects;
}

const Effect& find_effect(const std::string& name, const std::vector<Effect>& own) {
  std::vector<std::string> names;
  const Effect* found = nullptr;
  for (const std::vector<Effect>* effects : {&catalogue(), &own}) {
    for (const Effect& effect : *effects) {
      if (effect.name == name && found != nullptr) {
        throw std::invalid_argument("effect '" + name + "' exists twice: give your own effect another name");
      }
      if (effect.name == name) found = &effect;
      names.push_back(effect.name);
    }
  }
  if (found == nullptr) found = transmission_error_of(name);
  if (found == nullptr) throw std::invalid_argument("effect '" + name + "' does not exist; there are " + listed(names));
  return *found;
}

std::vector<Term> effect_terms(const std::vector<EffectRequest>& requests, const Robot& robot, const Measurements& data,
                               const std::vector<Effect>& own) {
  std::vector<Term> all;
  std::set<std::pair<std::string, std::size_t>> seen;
  for (const EffectRequest& request : requests) {
    const Effect& effect = find_effect(request.effect, own);
    if (!effect.terms) throw std::invalid_argument("effect '" + effect.name + "' has no function that gives its terms");
    for (Place& place : requested_places(request, effect, robot, data)) {
      // Twice the same columns would make both parameters invisible.
      if (!seen.insert({effect.name, place.first}).second) {
        throw std::invalid_argument(effect.name +
                                    (place.first == kRobot ? "" : " at " + robot.joints[place.first].name) +
                                    " is asked for twice");
      }
      std::move(place.second.begin(), place.second.end(), std::back_inserter(all));
    }
  }
  return all;
}

}  // namespace truing
