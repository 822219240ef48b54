// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/columns.hpp"

#include <limits>

namespace truing::python {

py::array float_array(py::handle object, const std::string& name) {
  py::object given = py::reinterpret_borrow<py::object>(object);
  // numpy drops the mask of a masked array without a word when it makes a plain array of it.
  if (py::isinstance(given, py::module_::import("numpy").attr("ma").attr("MaskedArray")))
    given = given.attr("astype")("f8").attr("filled")(std::numeric_limits<double>::quiet_NaN());
  auto array = py::array::ensure(given);
  if (!array)
    throw std::invalid_argument(name + " cannot be made an array of numbers; are its rows of different lengths?");
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u')
    throw std::invalid_argument(name + " holds " + py::str(array.dtype()).cast<std::string>() +
                                " values, not numbers (write NaN where something is missing)");
  bool as_it_is = py::isinstance<py::array_t<double>>(array) &&
                  reinterpret_cast<std::uintptr_t>(array.data()) % sizeof(double) == 0;
  for (py::ssize_t axis = 0; axis < array.ndim(); ++axis)
    as_it_is = as_it_is && array.strides(axis) % static_cast<py::ssize_t>(sizeof(double)) == 0;
  return as_it_is ? array : py::array(array.attr("astype")("=f8"));
}

Column column_of(const py::array& array) {
  const py::ssize_t stride = array.ndim() == 0 ? 0 : array.strides(0);
  return {static_cast<const double*>(array.data()), stride / static_cast<py::ssize_t>(sizeof(double))};
}

std::shared_ptr<const void> keep_alive(std::vector<py::object> objects) {
  return {new std::vector<py::object>(std::move(objects)), [](const std::vector<py::object>* kept) {
            if (!Py_IsInitialized()) return;  // Python is gone, and its objects with it
            const py::gil_scoped_acquire gil;
            delete kept;
          }};
}

Array vector_from(const ArrayLike& given, const std::string& name) {
  Array array = Array::ensure(given);
  if (!array || array.ndim() != 1) {
    PyErr_Clear();
    throw std::invalid_argument(name + " must have shape (n,)");
  }
  return array;
}

Array rows_from(const ArrayLike& given, py::ssize_t rows, py::ssize_t columns, const std::string& name) {
  Array array = Array::ensure(given);
  if (!array || array.ndim() != 2 || array.shape(0) != rows || array.shape(1) != columns) {
    PyErr_Clear();
    throw std::invalid_argument(name + " must have shape (" + std::to_string(rows) + ", " + std::to_string(columns) +
                                "): a row for each entry of t");
  }
  return array;
}

RowMajor matrix_from(const ArrayLike& given, const std::string& name, const std::string& shape) {
  const Array array = Array::ensure(given);
  if (!array || array.ndim() != 2) {
    PyErr_Clear();
    throw std::invalid_argument(name + " must have shape " + shape);
  }
  return Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1));
}

py::array_t<std::int8_t> array_from(const std::vector<std::int8_t>& set) {
  return py::array_t<std::int8_t>(static_cast<py::ssize_t>(set.size()), set.data());
}

}  // namespace truing::python
