// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/values.hpp"

namespace truing::python {

py::object mapping_proxy(const py::dict& dict) { return py::module_::import("types").attr("MappingProxyType")(dict); }

py::dict keywords_of(const py::object& self, const Names& fields) {
  const py::object proxy = py::module_::import("types").attr("MappingProxyType");
  py::dict keywords;
  for (const char* field : fields) {
    py::object value = self.attr(field);
    if (py::isinstance(value, proxy)) value = py::dict(value);  // a proxy cannot be pickled
    keywords[field] = value;
  }
  return keywords;
}

TupleOf<py::object> reduced(const py::object& self, const Names& fields) {
  const py::object partial = py::module_::import("functools").attr("partial");
  py::tuple made = py::make_tuple(partial(py::type::of(self), **keywords_of(self, fields)), py::tuple());
  return py::reinterpret_steal<TupleOf<py::object>>(made.release());
}

}  // namespace truing::python
