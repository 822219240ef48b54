// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Sequences as tuples, mappings as read-only mappings, and classes as values: `replace`, `copy`, pickling.
///
/// Whatever a property hands out as a copy cannot be written to: a change that would not reach the object raises
/// instead of being lost.
#pragma once

#include "convert/pybind.hpp"

namespace truing::python {

template <class T>
using TupleOf = py::typing::Tuple<T, py::ellipsis>;

/// A read-only mapping.
template <class Key, class Value>
class Mapping : public py::object {
  using py::object::object;
};

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

py::object mapping_proxy(const py::dict& dict);

/// A read-only mapping of copies.
template <class Key, class Value>
Mapping<Key, Value> mapping_of(const std::map<Key, Value>& map) {
  return py::reinterpret_steal<Mapping<Key, Value>>(mapping_proxy(py::cast(map)).release());
}

using Names = std::vector<const char*>;

/// The constructor keywords that would make this object again.
py::dict keywords_of(const py::object& self, const Names& fields);
/// What pickling calls to make this object again.
TupleOf<py::object> reduced(const py::object& self, const Names& fields);

/// `replace`, `copy` and pickling for a class whose constructor takes `fields` as keywords.
template <class Class>
void define_value(Class& cls, const Names& fields) {
  using T = typename Class::type;
  cls.def(
      "replace",
      [fields](const py::object& self, const py::KWArgs<py::object>& changes) {
        py::dict keywords = keywords_of(self, fields);
        for (const auto& [key, value] : changes) keywords[key] = value;
        return py::type::of(self)(**keywords).template cast<T>();
      },
      "A copy with the given attributes changed (the constructor's keywords; an unknown one raises TypeError).");
  cls.def("copy", [](const T& self) { return T(self); }, "An independent copy.");
  cls.def("__reduce__", [fields](const py::object& self) { return reduced(self, fields); });
}

}  // namespace truing::python

namespace pybind11::detail {

template <class Key, class Value>
struct handle_type_name<truing::python::Mapping<Key, Value>> {
  static constexpr auto name = const_name("types.MappingProxyType[") + make_caster<Key>::name + const_name(", ") +
                               make_caster<Value>::name + const_name("]");
};

}  // namespace pybind11::detail
