// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// What a table of a struct's fields is made of. The tables are made from the public headers (field_tables.py).
#pragma once

#include "convert/enums.hpp"

namespace truing::python {

/// A field of a struct; its name and meaning as the public header has them.
template <class Class, class Value, bool NoneIfNan = false>
struct Field {
  const char* name;
  Value Class::* member;
  const char* meaning;
};

template <class T, class Class, class Value>
constexpr Field<Class, Value> field(const char* name, Value Class::* member, const char* meaning) {
  return {name, member, meaning};
}

/// A number that is None in Python as long as it is not given.
template <class T, class Class>
constexpr Field<Class, double, true> none_if_nan(const char* name, double Class::* member, const char* meaning) {
  return {name, member, meaning};
}

/// `summary` says what a struct is; `all(use)` calls `use` with all of its fields.
template <class Struct>
struct Fields;

}  // namespace truing::python
