// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Frames are arrays of shape (4, 4) in Python, read-only where they are handed out.
#pragma once

#include "convert/pybind.hpp"

namespace truing::python {

/// Frames, shape (n, 4, 4).
class FrameArray : public py::object {
  PYBIND11_OBJECT_DEFAULT(FrameArray, py::object, [](PyObject* pointer) { return pointer != nullptr; })
};

/// The array with its writeable flag taken away: a change that would not reach the object raises.
py::array_t<double> read_only(py::array_t<double> array);

py::array_t<double> array_from(const Eigen::Vector3d& v);
py::array_t<double> array_from(const Eigen::Matrix<double, 6, 1>& v);
py::array_t<double> array_from(const std::vector<double>& values);
/// Shape (n, 4, 4).
py::array_t<double> array_from(const std::vector<Eigen::Isometry3d>& frames);

/// Copies a frame, row by row, to 16 doubles.
void write_frame(const Eigen::Isometry3d& frame, double* out);

/// A 4x4 matrix as a frame. What is off orthonormal by no more than rounding in a file (1e-6) becomes exactly
/// orthonormal; anything worse throws std::invalid_argument.
Eigen::Isometry3d frame_from(const py::array_t<double, py::array::c_style | py::array::forcecast>& matrix);

/// One frame per pose; an error names the pose and calls the array `name`.
std::vector<Eigen::Isometry3d> frames_from(const FrameArray& given, const std::string& name);

}  // namespace truing::python

namespace pybind11::detail {

template <>
struct handle_type_name<truing::python::FrameArray> {
  static constexpr auto name = const_name("typing.Annotated[numpy.typing.ArrayLike, numpy.float64, \"[n, 4, 4]\"]");
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
