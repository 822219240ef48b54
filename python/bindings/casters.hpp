// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// How truing's types cross into Python: enums as strings, frames as 4x4 arrays, sequences as tuples.
///
/// Whatever a property hands out as a copy cannot be written to (tuples, read-only arrays and mappings): a
/// change that would not reach the object raises instead of being lost.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/typing.h>
#include <Eigen/Geometry>

#include "truing/compensate.hpp"
#include "truing/diagnose.hpp"
#include "truing/handeye.hpp"
#include "truing/inverse.hpp"
#include "truing/tracking/streams.hpp"
#include "truing/truing.hpp"

namespace truing::python {

namespace py = pybind11;

/// Anything numpy can make an array of; read by hand, so that no copy is made where none is needed.
class ArrayLike : public py::object {
  PYBIND11_OBJECT_DEFAULT(ArrayLike, py::object, [](PyObject* pointer) { return pointer != nullptr; })
};

/// One label (or number) per row.
class Labels : public py::object {
  PYBIND11_OBJECT_DEFAULT(Labels, py::object, [](PyObject* pointer) { return pointer != nullptr; })
};

/// Frames, shape (n, 4, 4).
class FrameArray : public py::object {
  PYBIND11_OBJECT_DEFAULT(FrameArray, py::object, [](PyObject* pointer) { return pointer != nullptr; })
};

/// A read-only mapping.
template <class Key, class Value>
class Mapping : public py::object {
  using py::object::object;
};

// ---- Enums ----------------------------------------------------------------------------------------------------------

/// The words for an enum's values, in the order of the enum.
template <class Enum>
struct Words;

template <>
struct Words<Convention> {
  static constexpr const char* what = "convention";
  static constexpr std::array<const char*, 3> list{"dh", "mdh", "urdf"};
  static constexpr auto type = py::detail::const_name("typing.Literal['dh', 'mdh', 'urdf']");
};

template <>
struct Words<JointType> {
  static constexpr const char* what = "joint type";
  static constexpr std::array<const char*, 2> list{"revolute", "prismatic"};
  static constexpr auto type = py::detail::const_name("typing.Literal['revolute', 'prismatic']");
};

template <>
struct Words<Solver> {
  static constexpr const char* what = "solver";
  static constexpr std::array<const char*, 2> list{"lm", "ceres"};
  static constexpr auto type = py::detail::const_name("typing.Literal['lm', 'ceres']");
};

template <>
struct Words<Loss> {
  static constexpr const char* what = "loss";
  static constexpr std::array<const char*, 5> list{"reject", "none", "huber", "cauchy", "tukey"};
  static constexpr auto type = py::detail::const_name("typing.Literal['reject', 'none', 'huber', 'cauchy', 'tukey']");
};

template <>
struct Words<FrameBy> {
  static constexpr const char* what = "frame_by";
  static constexpr std::array<const char*, 2> list{"parameters", "svd"};
  static constexpr auto type = py::detail::const_name("typing.Literal['parameters', 'svd']");
};

template <>
struct Words<Observability> {
  static constexpr const char* what = "observability index";
  static constexpr std::array<const char*, 5> list{"d_optimal", "a_optimal", "e_optimal", "inverse_condition",
                                                   "noise_amplification"};
  static constexpr auto type = py::detail::const_name(
      "typing.Literal['d_optimal', 'a_optimal', 'e_optimal', 'inverse_condition', 'noise_amplification']");
};

template <>
struct Words<Verdict> {
  static constexpr const char* what = "verdict";
  static constexpr std::array<const char*, 4> list{"none", "effects", "unknown", "effects+unknown"};
  static constexpr auto type =
      py::detail::const_name("typing.Literal['none', 'effects', 'unknown', 'effects+unknown']");
};

template <>
struct Words<HandEyeSetup> {
  static constexpr const char* what = "set-up";
  static constexpr std::array<const char*, 2> list{"eye-in-hand", "eye-to-hand"};
  static constexpr auto type = py::detail::const_name("typing.Literal['eye-in-hand', 'eye-to-hand']");
};

template <>
struct Words<HandEyeMethod> {
  static constexpr const char* what = "method";
  static constexpr std::array<const char*, 2> list{"refined", "closed-form"};
  static constexpr auto type = py::detail::const_name("typing.Literal['refined', 'closed-form']");
};

template <>
struct Words<HandEyeStatus> {
  static constexpr const char* what = "status";
  static constexpr std::array<const char*, 4> list{"done", "not observable", "not closing", "not converged"};
  static constexpr auto type =
      py::detail::const_name("typing.Literal['done', 'not observable', 'not closing', 'not converged']");
};

template <>
struct Words<TaskKind> {
  static constexpr const char* what = "task";
  static constexpr std::array<const char*, 3> list{"pose", "torch", "point"};
  static constexpr auto type = py::detail::const_name("typing.Literal['pose', 'torch', 'point']");
};

template <>
struct Words<Choose> {
  static constexpr const char* what = "choice";
  static constexpr std::array<const char*, 4> list{"nearest", "limits_margin", "manipulability", "rail_travel"};
  static constexpr auto type =
      py::detail::const_name("typing.Literal['nearest', 'limits_margin', 'manipulability', 'rail_travel']");
};

template <>
struct Words<Reason> {
  static constexpr const char* what = "reason";
  static constexpr std::array<const char*, 6> list{"reached",      "retreated", "collision",
                                                   "out_of_reach", "limit",     "singular"};
  static constexpr auto type = py::detail::const_name(
      "typing.Literal['reached', 'retreated', 'collision', 'out_of_reach', 'limit', 'singular']");
};

template <>
struct Words<Shape> {
  static constexpr const char* what = "shape";
  static constexpr std::array<const char*, 3> list{"sphere", "capsule", "box"};
  static constexpr auto type = py::detail::const_name("typing.Literal['sphere', 'capsule', 'box']");
};

template <>
struct Words<ClosedFormKind> {
  static constexpr const char* what = "closed form";
  static constexpr std::array<const char*, 3> list{"none", "spherical_wrist", "three_parallel"};
  static constexpr auto type = py::detail::const_name("typing.Literal['none', 'spherical_wrist', 'three_parallel']");
};

template <class Enum>
const char* word(Enum value) {
  return Words<Enum>::list.at(static_cast<std::size_t>(value));
}

template <class Enum>
Enum enum_from_word(const std::string& text) {
  std::string choices;
  for (std::size_t i = 0; i < Words<Enum>::list.size(); ++i) {
    if (text == Words<Enum>::list[i]) return static_cast<Enum>(i);
    choices += std::string(i == 0 ? "'" : ", '") + Words<Enum>::list[i] + "'";
  }
  throw std::invalid_argument(std::string("unknown ") + Words<Enum>::what + " '" + text + "'; choose one of " +
                              choices);
}

// ---- Arrays ---------------------------------------------------------------------------------------------------------

/// The array with its writeable flag taken away.
inline py::array_t<double> read_only(py::array_t<double> array) {
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

inline py::array_t<double> array_from(const Eigen::Vector3d& v) { return read_only(py::array_t<double>(3, v.data())); }

/// Copies a frame, row by row, to 16 doubles.
inline void write_frame(const Eigen::Isometry3d& frame, double* out) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>{out} = frame.matrix();
}

/// A 4x4 matrix as a frame. What is off orthonormal by no more than rounding in a file (1e-6) becomes exactly
/// orthonormal; anything worse throws std::invalid_argument.
Eigen::Isometry3d frame_from(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrix);

/// One frame per pose; an error names the pose and calls the array `name`.
std::vector<Eigen::Isometry3d> frames_from(const FrameArray& given, const std::string& name);
py::array_t<double> array_from(const std::vector<Eigen::Isometry3d>& frames);

/// Samples from columns: t shape (n,), the others (n, 3) or (n, 4); without arrivals, arrived at once.
std::vector<ImuSample> imu_samples(const ArrayLike& t, const ArrayLike& gyro, const ArrayLike& accel,
                                   const std::optional<ArrayLike>& arrival);
std::vector<PoseSample> pose_samples(const ArrayLike& t, const ArrayLike& position,
                                     const std::optional<ArrayLike>& orientation,
                                     const std::optional<ArrayLike>& arrival);
std::vector<FrameSample> frame_samples(const ArrayLike& t, const FrameArray& T, const std::optional<ArrayLike>& arrival,
                                       const char* name);

// ---- Sequences and value semantics ----------------------------------------------------------------------------------

template <class T>
using TupleOf = py::typing::Tuple<T, py::ellipsis>;

/// A tuple of copies.
template <class T>
TupleOf<T> tuple_of(const std::vector<T>& items) {
  py::tuple out(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) out[i] = py::cast(items[i]);
  return py::reinterpret_steal<TupleOf<T>>(out.release());
}

/// A tuple of references into `owner`: attributes set on its items reach `owner`.
template <class T>
TupleOf<T> tuple_of_references(std::vector<T>& items, py::handle owner) {
  py::tuple out(items.size());
  for (std::size_t i = 0; i < items.size(); ++i)
    out[i] = py::cast(&items[i], py::return_value_policy::reference_internal, owner);
  return py::reinterpret_steal<TupleOf<T>>(out.release());
}

inline py::object mapping_proxy(const py::dict& dict) {
  return py::module_::import("types").attr("MappingProxyType")(dict);
}

/// A read-only mapping of copies.
template <class Key, class Value>
Mapping<Key, Value> mapping_of(const std::map<Key, Value>& map) {
  return py::reinterpret_steal<Mapping<Key, Value>>(mapping_proxy(py::cast(map)).release());
}

/// The constructor keywords that would make this object again.
inline py::dict keywords_of(const py::object& self, const std::vector<const char*>& fields) {
  const py::object proxy = py::module_::import("types").attr("MappingProxyType");
  py::dict keywords;
  for (const char* field : fields) {
    py::object value = self.attr(field);
    if (py::isinstance(value, proxy)) value = py::dict(value);  // a proxy cannot be pickled
    keywords[field] = value;
  }
  return keywords;
}

/// `replace`, `copy` and pickling for a class whose constructor takes `fields` as keywords.
template <class Class>
void define_value(Class& cls, const std::vector<const char*>& fields) {
  using T = typename Class::type;
  cls.def(
      "replace",
      [fields](const py::object& self, const py::KWArgs<py::object>& changes) {
        py::dict keywords = keywords_of(self, fields);
        for (const auto& [key, value] : changes) keywords[key] = value;
        return py::type::of(self)(**keywords).template cast<T>();
      },
      "A copy with the given attributes changed (the constructor's keywords; an unknown one raises "
      "TypeError).");
  cls.def("copy", [](const T& self) { return T(self); }, "An independent copy.");
  cls.def("__reduce__", [fields](const py::object& self) -> TupleOf<py::object> {
    const py::object partial = py::module_::import("functools").attr("partial");
    py::tuple reduced = py::make_tuple(partial(py::type::of(self), **keywords_of(self, fields)), py::tuple());
    return py::reinterpret_steal<TupleOf<py::object>>(reduced.release());
  });
}

/// A number as people write it.
std::string text(double value);
/// "a, b, c"
std::string joined(const std::vector<std::string>& words);

// ---- Parts of the module --------------------------------------------------------------------------------------------

void bind_robot(py::module_& m);
void bind_measurements(py::module_& m);
void bind_effect_traits(py::module_& m);
void bind_effects(py::module_& m);
void bind_identify(py::module_& m);
void bind_plan(py::module_& m);
void bind_diagnose(py::module_& m);
void bind_distinguish(py::module_& m);
void bind_handeye(py::module_& m);
void bind_inverse(py::module_& m);
void bind_track(py::module_& m);
void bind_track_calibrate(py::module_& m);

/// A double array of whatever strides, without a copy unless its type or memory layout calls for one.
py::array float_array(py::handle object, const std::string& name);
/// Memory of `array`, counted in doubles along its only axis.
Column column_of(const py::array& array);
/// Keeps Python objects alive from C++; may be dropped by any thread, holding the GIL or not.
std::shared_ptr<const void> keep_alive(std::vector<py::object> objects);

/// A user's effect: its values were computed in Python, one per row, before C++ runs.
struct OwnEffect {
  struct Part {
    std::string joint, parameter, unit, site;
    Column values;
    std::size_t rows = 0;
    std::shared_ptr<const void> owner;
  };
  std::string name, summary;
  std::vector<Part> parts;
  EffectTraits traits{};
};

std::vector<Effect> effects_from(const std::vector<OwnEffect>& own);
/// Effects whose basis Python evaluates whenever rows are asked for: `truing.Effect` objects. Takes the GIL to do so.
std::vector<Effect> effects_evaluated_when_asked(const std::vector<py::object>& own);

}  // namespace truing::python

namespace pybind11::detail {

template <>
struct handle_type_name<truing::python::ArrayLike> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike");
};

template <>
struct handle_type_name<truing::python::Labels> {
  static constexpr auto name = const_name("numpy.typing.ArrayLike | collections.abc.Sequence[str | None]");
};

template <>
struct handle_type_name<truing::python::FrameArray> {
  static constexpr auto name = const_name("typing.Annotated[numpy.typing.ArrayLike, numpy.float64, \"[n, 4, 4]\"]");
};

template <class Key, class Value>
struct handle_type_name<truing::python::Mapping<Key, Value>> {
  static constexpr auto name = const_name("types.MappingProxyType[") + make_caster<Key>::name + const_name(", ") +
                               make_caster<Value>::name + const_name("]");
};

template <class Enum>
struct word_caster {
  PYBIND11_TYPE_CASTER(Enum, truing::python::Words<Enum>::type);

  bool load(handle source, bool) {
    if (!isinstance<str>(source)) return false;
    value = truing::python::enum_from_word<Enum>(source.cast<std::string>());
    return true;
  }
  static handle cast(Enum source, return_value_policy, handle) { return str(truing::python::word(source)).release(); }
};

template <>
struct type_caster<truing::Convention> : word_caster<truing::Convention> {};
template <>
struct type_caster<truing::JointType> : word_caster<truing::JointType> {};
template <>
struct type_caster<truing::Solver> : word_caster<truing::Solver> {};
template <>
struct type_caster<truing::Loss> : word_caster<truing::Loss> {};
template <>
struct type_caster<truing::FrameBy> : word_caster<truing::FrameBy> {};
template <>
struct type_caster<truing::Observability> : word_caster<truing::Observability> {};
template <>
struct type_caster<truing::Verdict> : word_caster<truing::Verdict> {};
template <>
struct type_caster<truing::HandEyeSetup> : word_caster<truing::HandEyeSetup> {};
template <>
struct type_caster<truing::HandEyeMethod> : word_caster<truing::HandEyeMethod> {};
template <>
struct type_caster<truing::HandEyeStatus> : word_caster<truing::HandEyeStatus> {};
template <>
struct type_caster<truing::TaskKind> : word_caster<truing::TaskKind> {};
template <>
struct type_caster<truing::Choose> : word_caster<truing::Choose> {};
template <>
struct type_caster<truing::Reason> : word_caster<truing::Reason> {};
template <>
struct type_caster<truing::Shape> : word_caster<truing::Shape> {};
template <>
struct type_caster<truing::ClosedFormKind> : word_caster<truing::ClosedFormKind> {};

/// A window is a pair (lower, upper).
template <>
struct type_caster<truing::Window> {
  PYBIND11_TYPE_CASTER(truing::Window, const_name("tuple[float, float]"));

  bool load(handle source, bool convert) {
    make_caster<std::pair<double, double>> ends;
    if (!ends.load(source, convert)) return false;
    const auto [lower, upper] = cast_op<std::pair<double, double>>(ends);
    value = {lower, upper};
    return true;
  }
  static handle cast(const truing::Window& source, return_value_policy, handle) {
    return make_tuple(source.lower, source.upper).release();
  }
};

template <>
struct type_caster<Eigen::Isometry3d> {
  PYBIND11_TYPE_CASTER(Eigen::Isometry3d, io_name("typing.Annotated[numpy.typing.ArrayLike, numpy.float64, \"[4, 4]\"]",
                                                  "typing.Annotated[numpy.typing.NDArray[numpy.float64], \"[4, 4]\"]"));

  bool load(handle source, bool) {
    const auto matrix = array_t<double, array::c_style | array::forcecast>::ensure(source);
    if (!matrix) return false;
    value = truing::python::frame_from(matrix);
    return true;
  }
  static handle cast(const Eigen::Isometry3d& source, return_value_policy, handle) {
    array_t<double> out({4, 4});
    truing::python::write_frame(source, out.mutable_data());
    return truing::python::read_only(std::move(out)).release();
  }
};

}  // namespace pybind11::detail
