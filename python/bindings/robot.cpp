// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>
#include <variant>

#include <Eigen/SVD>

#include "casters.hpp"

namespace truing::python {

std::string text(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& w : words) out += (out.empty() ? "" : ", ") + w;
  return out;
}

Eigen::Isometry3d frame_from(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrix) {
  constexpr double accepted = 1e-6;  // [-] what six decimals in a file leave
  constexpr double rounding =
      1e-12;  // [-] below this the matrix is taken as it is, so that frames survive a round trip
  if (matrix.ndim() != 2 || matrix.shape(0) != 4 || matrix.shape(1) != 4) {
    std::string shape;
    for (py::ssize_t i = 0; i < matrix.ndim(); ++i) shape += (i == 0 ? "" : ", ") + std::to_string(matrix.shape(i));
    throw std::invalid_argument("a frame is a 4x4 matrix; found an array of shape (" + shape + ")");
  }
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> given(matrix.data());
  if (!given.allFinite()) throw std::invalid_argument("a frame must be finite; found NaN or infinity");
  if (given.row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    throw std::invalid_argument("a frame must be rigid; its last row must be 0 0 0 1");
  Eigen::Matrix3d rotation = given.topLeftCorner<3, 3>();
  const double off = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (off > accepted)
    throw std::invalid_argument("a frame must be rigid; its rotation is off orthonormal by " + text(off) +
                                " (at most 1e-6)");
  if (rotation.determinant() < 0)
    throw std::invalid_argument("a frame must be rigid; its rotation is left-handed (determinant -1)");
  if (off > rounding) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
    rotation = svd.matrixU() * svd.matrixV().transpose();
  }
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = rotation;
  frame.translation() = given.topRightCorner<3, 1>();
  return frame;
}

std::vector<Eigen::Isometry3d> frames_from(const FrameArray& given, const std::string& name) {
  using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
  const Array array = Array::ensure(given);
  if (!array || array.ndim() != 3 || array.shape(1) != 4 || array.shape(2) != 4) {
    PyErr_Clear();
    throw std::invalid_argument(name + " must have shape (n, 4, 4): one frame per pose");
  }
  std::vector<Eigen::Isometry3d> frames;
  frames.reserve(static_cast<std::size_t>(array.shape(0)));
  for (py::ssize_t i = 0; i < array.shape(0); ++i) {
    const Array matrix({4, 4}, array.data(i, 0, 0));
    try {
      frames.push_back(frame_from(matrix));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(name + ", pose " + std::to_string(i) + ": " + error.what());
    }
  }
  return frames;
}

py::array_t<double> array_from(const std::vector<Eigen::Isometry3d>& frames) {
  py::array_t<double> out({frames.size(), std::size_t{4}, std::size_t{4}});
  for (std::size_t i = 0; i < frames.size(); ++i)
    write_frame(frames[i], out.mutable_data(static_cast<py::ssize_t>(i), 0, 0));
  return read_only(std::move(out));
}

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

A driven joint moves by `ratio * reading + offset`. A passive joint has no reading: it moves by the weighted sum of the
corrected motions of the joints in `driven_by`, a mapping or pairs of name and weight (a palletizer's J4: {"J2": -1, "J3": -1}).)");
  cls.def(py::init([](std::string name, JointType type, double theta, double d, double a, double alpha, double beta,
                      const Eigen::Isometry3d& T_parent_joint, const Eigen::Vector3d& axis, double ratio, double offset,
                      const Drives& driven_by, double lower, double upper, std::optional<double> mass,
                      const Eigen::Vector3d& center_of_mass) {
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
                         center_of_mass};
          }),
          py::arg("name"), py::kw_only(), py::arg("type") = usual.type, py::arg("theta") = usual.theta,
          py::arg("d") = usual.d, py::arg("a") = usual.a, py::arg("alpha") = usual.alpha, py::arg("beta") = usual.beta,
          py::arg("T_parent_joint") = usual.T_parent_joint, py::arg("axis") = array_from(usual.axis),
          py::arg("ratio") = usual.ratio, py::arg("offset") = usual.offset, py::arg("driven_by") = Drivers{},
          py::arg("lower") = usual.lower, py::arg("upper") = usual.upper, py::arg("mass") = usual.mass,
          py::arg("center_of_mass") = array_from(usual.center_of_mass));
  cls.def_readwrite("name", &Joint::name, "Name, unique within the robot.");
  cls.def_readwrite("type", &Joint::type, "'revolute' or 'prismatic'.");
  cls.def_readwrite("theta", &Joint::theta, "[rad] the motion of a revolute joint adds to it.");
  cls.def_readwrite("d", &Joint::d, "[m] the motion of a prismatic joint adds to it.");
  cls.def_readwrite("a", &Joint::a, "[m] link length.");
  cls.def_readwrite("alpha", &Joint::alpha, "[rad] link twist.");
  cls.def_readwrite("beta", &Joint::beta, "[rad] Hayati's twist about y, for near-parallel neighbouring axes.");
  cls.def_readwrite("T_parent_joint", &Joint::T_parent_joint,
                    "shape=(4, 4) [m]: joint in its parent; convention 'urdf' only. Setting it to what is "
                    "not rigid raises InputError.");
  cls.def_property(
      "axis", [](const Joint& j) { return array_from(j.axis); }, [](Joint& j, const Eigen::Vector3d& v) { j.axis = v; },
      "shape=(3,) unit vector; convention 'urdf' only.");
  cls.def_readwrite("ratio", &Joint::ratio, "[-] gear-ratio correction.");
  cls.def_readwrite("offset", &Joint::offset, "[rad | m] joint zero.");
  cls.def_property(
      "driven_by", [](const Joint& j) { return tuple_of(j.driven_by); },
      [](Joint& j, const Drives& given) { j.driven_by = drivers_from(given); },
      "Pairs of driving joint and weight; empty: the joint has a reading. A mapping may be set.");
  cls.def_readwrite("lower", &Joint::lower, "[rad | m] lower limit, -inf if there is none.");
  cls.def_readwrite("upper", &Joint::upper, "[rad | m] upper limit, inf if there is none.");
  cls.def_readwrite("mass", &Joint::mass, "[kg] of the link that this joint moves; None: not known.");
  cls.def_property(
      "center_of_mass", [](const Joint& j) { return array_from(j.center_of_mass); },
      [](Joint& j, const Eigen::Vector3d& v) { j.center_of_mass = v; }, "shape=(3,) [m] in the frame after the link.");
  cls.def_property_readonly("passive", &Joint::passive, "Whether other joints drive it.");
  cls.def("__repr__", [](const Joint& j) { return repr(j); });
  define_value(cls, {"name", "type", "theta", "d", "a", "alpha", "beta", "T_parent_joint", "axis", "ratio", "offset",
                     "driven_by", "lower", "upper", "mass", "center_of_mass"});
}

void bind_parts(py::module_& m) {
  py::class_<Target> target(m, "Target", "A measured point (and orientation) on the last link.");
  target.def(py::init([](std::string name, const Eigen::Isometry3d& T_last_target) {
               return Target{std::move(name), T_last_target};
             }),
             py::arg("name"), py::arg("T_last_target") = Target{}.T_last_target);
  target.def_readwrite("name", &Target::name, "Name, unique within the robot.");
  target.def_readwrite("T_last_target", &Target::T_last_target,
                       "shape=(4, 4) [m]: target in the frame after the last link. Setting it to what is not "
                       "rigid raises InputError.");
  target.def("__repr__", [](const Target& t) {
    const Eigen::Vector3d p = t.T_last_target.translation();
    return "Target('" + t.name + "', at " + text(p.x()) + " " + text(p.y()) + " " + text(p.z()) + " m)";
  });
  define_value(target, {"name", "T_last_target"});

  py::class_<Anchor> anchor(m, "Anchor", R"(The far end of a draw-wire or ballbar: reading = distance + zero.

It does not change: set `robot.anchor = robot.anchor.replace(zero=0.01)`.)");
  anchor.def(py::init([](const Eigen::Vector3d& point, double zero) { return Anchor{point, zero}; }),
             py::arg("point") = array_from(Anchor{}.point), py::arg("zero") = Anchor{}.zero);
  anchor.def_property_readonly(
      "point", [](const Anchor& a) { return array_from(a.point); }, "shape=(3,) [m] in the measurement frame.");
  anchor.def_readonly("zero", &Anchor::zero, "[m] the length that the instrument leaves out.");
  anchor.def("__repr__", [](const Anchor& a) {
    return "Anchor(at " + text(a.point.x()) + " " + text(a.point.y()) + " " + text(a.point.z()) +
           " m, zero=" + text(a.zero) + ")";
  });
  define_value(anchor, {"point", "zero"});

  py::class_<AppliedEffect> applied(m, "AppliedEffect",
                                    R"(An effect with its fitted parameters, as `identify` found them.

It does not change; make another one.)");
  applied.def(
      py::init([](std::string effect, std::vector<std::string> joints, std::map<std::string, double> parameters) {
        return AppliedEffect{std::move(effect), std::move(joints), std::move(parameters)};
      }),
      py::arg("effect"), py::arg("joints"), py::arg("parameters"));
  applied.def_readonly("effect", &AppliedEffect::effect, "Name, as in `catalogue()`.");
  applied.def_property_readonly(
      "joints", [](const AppliedEffect& e) { return tuple_of(e.joints); }, "Names of the joints it acts on.");
  applied.def_property_readonly(
      "parameters", [](const AppliedEffect& e) { return mapping_of(e.parameters); },
      "Value by full name, e.g. {'backlash.J3': 2e-4}.");
  applied.def("__repr__", [](const AppliedEffect& e) {
    std::vector<std::string> values;
    for (const auto& [name, value] : e.parameters) values.push_back(name + "=" + text(value));
    return "AppliedEffect('" + e.effect + "', " + joined(values) + ")";
  });
  define_value(applied, {"effect", "joints", "parameters"});
}

/// A stack of 4x4 matrices.
py::array_t<double> frames_of(const Robot& robot, const Eigen::VectorXd& q, std::size_t target) {
  const std::vector<Eigen::Isometry3d> frames = forward_kinematics(robot, q, target);
  py::array_t<double> out({static_cast<py::ssize_t>(frames.size()), py::ssize_t{4}, py::ssize_t{4}});
  for (std::size_t i = 0; i < frames.size(); ++i) write_frame(frames[i], out.mutable_data() + 16 * i);
  return out;
}

}  // namespace

void bind_robot(py::module_& m) {
  bind_joint(m);
  bind_parts(m);

  const Robot usual;
  py::class_<Robot> cls(m, "Robot",
                        R"(A robot model, nominal or calibrated. `truing.validate` says whether it can be used.

`robot.joints[1].a = 0.3` and `robot.joint("J2").a = 0.3` change the robot. The number of joints and targets is fixed:
`robot.replace(joints=...)` makes another robot.)");
  cls.def(py::init([](std::string name, std::vector<Joint> joints, std::vector<Target> targets, Convention convention,
                      const Eigen::Vector3d& gravity, const Eigen::Isometry3d& T_measurement_base,
                      std::vector<AppliedEffect> effects, std::optional<Anchor> anchor) {
            return Robot{std::move(name),    convention,         gravity, T_measurement_base, std::move(joints),
                         std::move(targets), std::move(effects), anchor};
          }),
          py::arg("name"), py::kw_only(), py::arg("joints"),
          py::arg_v("targets", std::vector<Target>{Target{"tool"}}, "[Target('tool')]"),
          py::arg("convention") = usual.convention, py::arg("gravity") = array_from(usual.gravity),
          py::arg("T_measurement_base") = usual.T_measurement_base, py::arg("effects") = usual.effects,
          py::arg("anchor") = usual.anchor);
  cls.def_readwrite("name", &Robot::name, "Name of the model.");
  cls.def_readwrite("convention", &Robot::convention, R"(How the links are read: 'dh', 'mdh' or 'urdf'.

dh: Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta). mdh: Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d). urdf: T_parent_joint, then the
motion about or along `axis`.)");
  cls.def_property(
      "gravity", [](const Robot& r) { return array_from(r.gravity); },
      [](Robot& r, const Eigen::Vector3d& v) { r.gravity = v; }, "shape=(3,) [m/s^2] in the base frame.");
  cls.def_readwrite(
      "T_measurement_base", &Robot::T_measurement_base,
      "shape=(4, 4) [m]: base in the measurement frame. Setting it to what is not rigid raises InputError.");
  cls.def_property_readonly(
      "joints", [](const py::object& self) { return tuple_of_references(self.cast<Robot&>().joints, self); },
      "The joints in chain order; what is set on them changes the robot.");
  cls.def_property_readonly(
      "targets", [](const py::object& self) { return tuple_of_references(self.cast<Robot&>().targets, self); },
      "The targets, the tool first; what is set on them changes the robot.");
  cls.def_property(
      "effects", [](const Robot& r) { return tuple_of(r.effects); },
      [](Robot& r, std::vector<AppliedEffect> effects) { r.effects = std::move(effects); },
      "Effects with their fitted parameters.");
  cls.def_property(
      "anchor", [](const Robot& r) { return r.anchor; },
      [](Robot& r, std::optional<Anchor> anchor) { r.anchor = anchor; },
      "The far end of a draw-wire or ballbar, or None.");
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
  define_value(cls, {"name", "joints", "targets", "convention", "gravity", "T_measurement_base", "effects", "anchor"});

  m.def("validate_robot", py::overload_cast<const Robot&>(&validate), py::arg("robot"),
        R"(Raises InputError when the robot cannot be used.

The error names the joint and what is wrong: no joints, duplicate or empty names, unknown or circular `driven_by`, values that
are not finite, an axis that is not of unit length, lower > upper.)");
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
  m.def("robot_from_urdf", &robot_from_urdf, py::arg("urdf_text"), py::arg("base_link") = "", py::arg("tip_link") = "",
        R"(The chain from `base_link` to `tip_link` of a URDF text, as a robot of convention 'urdf'.

Fixed joints are folded into the next moving joint, the last ones into the tool; link masses are merged the same way;
`mimic` becomes `driven_by`. Empty link names: the only root, the only leaf.
Raises InputError: not a URDF, unknown base or tip (lists the links there are), tip not below base, planar or floating joint.)");
  m.def("urdf_with_calibration", &urdf_with_calibration, py::arg("urdf_text"), py::arg("calibrated"),
        py::arg("base_link") = "", py::arg("tip_link") = "",
        R"(The URDF text with the joint origins of the chain replaced by those of `calibrated`.

What URDF cannot hold (gear ratios, base frame, effects) is named in a comment at the top. Raises InputError.)");
}

}  // namespace truing::python
