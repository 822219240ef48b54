// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <variant>

#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "tables/model/robot.hpp"
#include "truing/dynamics/effect_values.hpp"
#include "truing/model/effect_values.hpp"

namespace truing::python {

namespace {

using Drivers = std::vector<std::pair<std::string, double>>;

/// A sequence of pairs, or a mapping.
using Drives = std::variant<Drivers, py::typing::Dict<std::string, double>>;

Drivers drivers_from(const Drives& given) {
  if (const auto* pairs = std::get_if<Drivers>(&given)) return *pairs;
  Drivers out;
  for (const auto& [name, weight] : std::get<1>(given))
    out.emplace_back(name.cast<std::string>(), weight.cast<double>());
  return out;
}

std::string repr(const Joint& j) {
  std::string out = "Joint('" + j.name + "', " + word(j.type);
  const auto value = [&out](const char* name, double v, double usual) {
    if (v != usual) out += std::string(", ") + name + "=" + text(v);
  };
  value("theta", j.theta, 0.0);
  value("d", j.d, 0.0);
  value("a", j.a, 0.0);
  value("alpha", j.alpha, 0.0);
  value("beta", j.beta, 0.0);
  value("ratio", j.ratio, 1.0);
  value("offset", j.offset, 0.0);
  if (j.passive()) {
    out += ", driven_by={";
    for (std::size_t i = 0; i < j.driven_by.size(); ++i)
      out += (i == 0 ? "'" : ", '") + j.driven_by[i].first + "': " + text(j.driven_by[i].second);
    out += "}";
  }
  return out + ")";
}

std::string repr(const Robot& r) {
  std::vector<std::string> targets, effects;
  for (const Target& t : r.targets) targets.push_back(t.name);
  for (const AppliedEffect& e : r.effects) effects.push_back(e.effect);
  std::string out = "Robot('" + r.name + "', " + word(r.convention) + ", " + std::to_string(r.joints.size()) +
                    " joints (" + std::to_string(r.driven_count()) +
                    " driven), targets: " + (targets.empty() ? "none" : joined(targets));
  if (!effects.empty()) out += ", effects: " + joined(effects);
  if (r.anchor) out += ", with anchor";
  return out + ")";
}

void bind_joint(py::module_& m) {
  const Joint usual;
  py::class_<Joint> cls(m, "Joint",
                        R"(One joint and the link that belongs to it. Lengths in m, angles in rad, masses in kg.

A driven joint moves by `ratio * reading + offset`. A passive joint has no reading: it moves by the weighted sum of
the corrected motions of the joints in `driven_by`, a mapping or pairs of name and weight (a palletizer's J4:
{"J2": -1, "J3": -1}).)");
  cls.def(py::init([](std::string name, JointType type, double theta, double d, double a, double alpha, double beta,
                      const Eigen::Isometry3d& T_parent_joint, const Eigen::Vector3d& axis, double ratio, double offset,
                      const Drives& driven_by, double lower, double upper, std::optional<double> mass,
                      const Eigen::Vector3d& center_of_mass, const std::optional<Eigen::Matrix3d>& inertia,
                      double rotor_inertia, std::optional<double> torque_per_ampere, double speed_limit,
                      double torque_limit) {
            return Joint{std::move(name),
                         type,
                         theta,
                         d,
                         a,
                         alpha,
                         beta,
                         T_parent_joint,
                         axis,
                         ratio,
                         offset,
                         drivers_from(driven_by),
                         lower,
                         upper,
                         mass,
                         center_of_mass,
                         inertia,
                         rotor_inertia,
                         torque_per_ampere,
                         speed_limit,
                         torque_limit};
          }),
          py::arg("name"), py::kw_only(), py::arg("type") = usual.type, py::arg("theta") = usual.theta,
          py::arg("d") = usual.d, py::arg("a") = usual.a, py::arg("alpha") = usual.alpha, py::arg("beta") = usual.beta,
          py::arg("T_parent_joint") = usual.T_parent_joint, py::arg("axis") = array_from(usual.axis),
          py::arg("ratio") = usual.ratio, py::arg("offset") = usual.offset, py::arg("driven_by") = Drivers{},
          py::arg("lower") = usual.lower, py::arg("upper") = usual.upper, py::arg("mass") = usual.mass,
          py::arg("center_of_mass") = array_from(usual.center_of_mass), py::arg("inertia") = py::none(),
          py::arg("rotor_inertia") = usual.rotor_inertia, py::arg("torque_per_ampere") = py::none(),
          py::arg("speed_limit") = usual.speed_limit, py::arg("torque_limit") = usual.torque_limit);
  define_attributes(cls, {"driven_by"});
  cls.def_property(
      "driven_by", [](const Joint& j) { return tuple_of(j.driven_by); },
      [](Joint& j, const Drives& given) { j.driven_by = drivers_from(given); },
      "Pairs of driving joint and weight; empty: the joint has a reading. A mapping may be set.");
  cls.def_property_readonly("passive", &Joint::passive, "Whether other joints drive it.");
  cls.def("__repr__", [](const Joint& j) { return repr(j); });
  define_value(cls, {"name",
                     "type",
                     "theta",
                     "d",
                     "a",
                     "alpha",
                     "beta",
                     "T_parent_joint",
                     "axis",
                     "ratio",
                     "offset",
                     "driven_by",
                     "lower",
                     "upper",
                     "mass",
                     "center_of_mass",
                     "inertia",
                     "rotor_inertia",
                     "torque_per_ampere",
                     "speed_limit",
                     "torque_limit"});
}

void bind_target(py::module_& m) {
  py::class_<Target> cls(m, "Target", Fields<Target>::summary);
  cls.def(py::init([](std::string name, const Eigen::Isometry3d& T_last_target) {
            return Target{std::move(name), T_last_target};
          }),
          py::arg("name"), py::arg("T_last_target") = Target{}.T_last_target);
  define_attributes(cls);
  cls.def("__repr__", [](const Target& t) {
    return "Target('" + t.name + "', at " + text(Eigen::Vector3d(t.T_last_target.translation())) + " m)";
  });
  define_value(cls, {"name", "T_last_target"});
}

void bind_anchor(py::module_& m) {
  py::class_<Anchor> cls(m, "Anchor", R"(The far end of a draw-wire or ballbar: reading = distance + zero.

It does not change: set `robot.anchor = robot.anchor.replace(zero=0.01)`.)");
  cls.def(py::init([](const Eigen::Vector3d& point, double zero) { return Anchor{point, zero}; }),
          py::arg("point") = array_from(Anchor{}.point), py::arg("zero") = Anchor{}.zero);
  define_read_only_attributes(cls);
  cls.def("__repr__", [](const Anchor& a) { return "Anchor(at " + text(a.point) + " m, zero=" + text(a.zero) + ")"; });
  define_value(cls, {"point", "zero"});
}

void bind_applied_effect(py::module_& m) {
  py::class_<AppliedEffect> cls(m, "AppliedEffect",
                                R"(An effect with its fitted parameters, as `identify` found them.

It does not change; make another one.)");
  cls.def(py::init([](std::string effect, std::vector<std::string> joints, std::map<std::string, double> parameters) {
            return AppliedEffect{std::move(effect), std::move(joints), std::move(parameters)};
          }),
          py::arg("effect"), py::arg("joints"), py::arg("parameters"));
  define_read_only_attributes(cls);
  cls.def("__repr__", [](const AppliedEffect& e) {
    std::vector<std::string> values;
    for (const auto& [name, value] : e.parameters) values.push_back(name + "=" + text(value));
    return "AppliedEffect('" + e.effect + "', " + joined(values) + ")";
  });
  define_value(cls, {"effect", "joints", "parameters"});
}

/// A stack of 4x4 matrices.
py::array_t<double> frames_of(const Robot& robot, const Eigen::VectorXd& q, std::size_t target) {
  const std::vector<Eigen::Isometry3d> frames = forward_kinematics(robot, q, target);
  py::array_t<double> out({static_cast<py::ssize_t>(frames.size()), py::ssize_t{4}, py::ssize_t{4}});
  for (std::size_t i = 0; i < frames.size(); ++i) write_frame(frames[i], out.mutable_data() + 16 * i);
  return out;
}

void bind_robot_class(py::module_& m) {
  const Robot usual;
  py::class_<Robot> cls(m, "Robot",
                        R"(A robot model, nominal or calibrated. `truing.validate` says whether it can be used.

`robot.joints[1].a = 0.3` and `robot.joint("J2").a = 0.3` change the robot. The number of joints and targets is fixed:
`robot.replace(joints=...)` makes another robot.)");
  cls.def(py::init([](std::string name, std::vector<Joint> joints, std::vector<Target> targets, Convention convention,
                      const Eigen::Vector3d& gravity, const Eigen::Isometry3d& T_measurement_base,
                      std::vector<AppliedEffect> effects, std::optional<Anchor> anchor,
                      std::map<std::string, std::pair<double, double>> fitted_range,
                      std::vector<AppliedEffect> torque_effects) {
            return Robot{
                std::move(name),    convention,         gravity, T_measurement_base,      std::move(joints),
                std::move(targets), std::move(effects), anchor,  std::move(fitted_range), std::move(torque_effects)};
          }),
          py::arg("name"), py::kw_only(), py::arg("joints"),
          py::arg_v("targets", std::vector<Target>{Target{"tool"}}, "[Target('tool')]"),
          py::arg("convention") = usual.convention, py::arg("gravity") = array_from(usual.gravity),
          py::arg("T_measurement_base") = usual.T_measurement_base, py::arg("effects") = usual.effects,
          py::arg("anchor") = usual.anchor, py::arg("fitted_range") = usual.fitted_range,
          py::arg("torque_effects") = usual.torque_effects);
  define_attributes(cls, {"joints", "targets"});
  cls.def_property_readonly(
      "joints", [](const py::object& self) { return tuple_of_references(self.cast<Robot&>().joints, self); },
      "The joints in chain order; what is set on them changes the robot.");
  cls.def_property_readonly(
      "targets", [](const py::object& self) { return tuple_of_references(self.cast<Robot&>().targets, self); },
      "The targets, the tool first; what is set on them changes the robot.");
  cls.def_property_readonly("driven_count", &Robot::driven_count, "Number of joints that have a reading.");
  cls.def(
      "driven_joints", [](const Robot& r) { return tuple_of(r.driven_joints()); },
      "Index of each driven joint, in chain order.");
  cls.def("joint_index", &Robot::joint_index, py::arg("name"),
          "Index of the joint of that name; raises InputError that lists the joints there are.");
  cls.def(
      "joint", [](Robot& r, const std::string& name) -> Joint& { return r.joints[r.joint_index(name)]; },
      py::arg("name"), py::return_value_policy::reference_internal,
      "The joint of that name; what is set on it changes the robot. Raises InputError that lists the joints "
      "there are.");
  cls.def("__repr__", [](const Robot& r) { return repr(r); });
  define_value(cls, {"name", "joints", "targets", "convention", "gravity", "T_measurement_base", "effects", "anchor",
                     "fitted_range", "torque_effects"});
}

}  // namespace

void bind_robot(py::module_& m) {
  bind_joint(m);
  bind_target(m);
  bind_anchor(m);
  bind_applied_effect(m);
  bind_robot_class(m);

  m.def("validate_robot", py::overload_cast<const Robot&>(&validate), py::arg("robot"),
        R"(Raises InputError when the robot cannot be used.

The error names the joint and what is wrong: no joints, duplicate or empty names, unknown or circular `driven_by`,
values that are not finite, an axis that is not of unit length, lower > upper, an inertia that is not symmetric, a
negative rotor inertia, limits of speed or torque that are not above zero, torque_per_ampere of zero.)");
  m.def("unknown_effect_values", &unknown_effect_values, py::arg("robot"),
        "Of each of the robot's effects what is wrong with its values, in words: one that its law does not look at.");
  m.def("unknown_torque_values", &unknown_torque_values, py::arg("robot"), "The same of its effects on torques.");
  m.def("forward_kinematics", &frames_of, py::arg("robot"), py::arg("q"), py::arg("target") = 0,
        R"(Frames of the links and of a target in the measurement frame, effects left out.

q: shape=(driven joints,) [rad | m]. target: its index in `robot.targets`.
Returns shape=(joints + 1, 4, 4) [m]: the frame after every joint, then the target's. Raises InputError.)");
  m.def("rotation_from_rpy", &rotation_from_rpy, py::arg("rpy"),
        R"(Rotation of roll, pitch and yaw as in URDF: R = Rz(yaw) Ry(pitch) Rx(roll).

rpy: shape=(3,) [rad]. Returns shape=(3, 3).)");
  m.def("rpy_from_rotation", &rpy_from_rotation, py::arg("rotation"),
        R"(Roll, pitch and yaw of a rotation: shape=(3, 3) to shape=(3,) [rad]. At pitch = +-pi/2 roll is 0.)");
  m.def("frame_from_xyz_rpy", &frame_from_xyz_rpy, py::arg("xyz"), py::arg("rpy"),
        "Frame, shape=(4, 4), of a position, shape=(3,) [m], and roll, pitch, yaw, shape=(3,) [rad].");
}

}  // namespace truing::python
