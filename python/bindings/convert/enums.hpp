// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Enums are words in Python. The words are made from the public headers (field_tables.py).
#pragma once

#include "convert/pybind.hpp"

namespace truing::python {

/// `what` an enum is called, the words for its values in its order (`list`), and its `type` in Python.
template <class Enum>
struct Words;

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

}  // namespace truing::python

namespace pybind11::detail {

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

}  // namespace pybind11::detail
