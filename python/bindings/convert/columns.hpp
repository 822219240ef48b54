// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Columns of numbers: arrays of any strides on the way in, arrays of one number (or row) per item on the way out.
#pragma once

#include <memory>

#include "convert/frames.hpp"
#include "convert/values.hpp"
#include "truing/model/measurement.hpp"

namespace truing::python {

/// Rows of doubles, one after the other.
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Anything numpy can make an array of; read by hand, so that no copy is made where none is needed.
class ArrayLike : public py::object {
  PYBIND11_OBJECT_DEFAULT(ArrayLike, py::object, [](PyObject* pointer) { return pointer != nullptr; })
};

/// One label (or number) per row.
class Labels : public py::object {
  PYBIND11_OBJECT_DEFAULT(Labels, py::object, [](PyObject* pointer) { return pointer != nullptr; })
};

// ---- In -------------------------------------------------------------------------------------------------------------

/// A double array of whatever strides, without a copy unless its type or memory layout calls for one.
py::array float_array(py::handle object, const std::string& name);
/// Memory of `array`, counted in doubles along its only axis.
Column column_of(const py::array& array);
/// Keeps Python objects alive from C++; may be dropped by any thread, holding the GIL or not.
std::shared_ptr<const void> keep_alive(std::vector<py::object> objects);

/// Shape (n,).
Array vector_from(const ArrayLike& given, const std::string& name);
/// Shape (rows, columns): a row for each entry of `t`.
Array rows_from(const ArrayLike& given, py::ssize_t rows, py::ssize_t columns, const std::string& name);
/// Shape (n, any); `shape` says in the error what was expected.
RowMajor matrix_from(const ArrayLike& given, const std::string& name, const std::string& shape);

// ---- Out ------------------------------------------------------------------------------------------------------------

/// One number of each item.
template <class Value = double, class Items, class Get>
py::array_t<Value> column(const Items& items, Get get) {
  py::array_t<Value> out(static_cast<py::ssize_t>(items.size()));
  Value* to = out.mutable_data();
  for (const auto& item : items) *to++ = static_cast<Value>(get(item));
  return out;
}

/// `width` numbers of each item, as the rows of an array.
template <class Items, class Get>
py::array_t<double> columns(const Items& items, py::ssize_t width, Get get) {
  py::array_t<double> out({static_cast<py::ssize_t>(items.size()), width});
  double* to = out.mutable_data();
  for (const auto& item : items) {
    const auto& row = get(item);
    for (py::ssize_t k = 0; k < width; ++k) *to++ = row[static_cast<std::size_t>(k)];
  }
  return out;
}

/// A frame of each item, shape (n, 4, 4).
template <class Items, class Get>
py::array_t<double> frame_column(const Items& items, Get get) {
  std::vector<Eigen::Isometry3d> frames;
  frames.reserve(items.size());
  for (const auto& item : items) frames.push_back(get(item));
  return array_from(frames);
}

/// A tuple of one value of each item.
template <class Items, class Get>
auto tuple_column(const Items& items, Get get) {
  std::vector<std::decay_t<decltype(get(items.front()))>> out;
  out.reserve(items.size());
  for (const auto& item : items) out.push_back(get(item));
  return tuple_of(out);
}

/// 0 train, 1 test.
py::array_t<std::int8_t> array_from(const std::vector<std::int8_t>& set);
/// Rows of N numbers, shape (n, N).
template <std::size_t N>
py::array_t<double> array_from(const std::vector<std::array<double, N>>& rows) {
  return read_only(columns(rows, N, [](const std::array<double, N>& row) -> const auto& { return row; }));
}

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

}  // namespace pybind11::detail
