// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Classes made of a table of fields: options with a keyword constructor, and results that are read.
///
/// An option is stated once, in its public header. Constructor, attributes, docstrings, `replace`, pickling and the
/// typed stub all come from the table that is made of it.
#pragma once

#include <limits>
#include <tuple>
#include <type_traits>

#include "convert/columns.hpp"
#include "convert/frames.hpp"
#include "convert/tables.hpp"
#include "convert/values.hpp"

namespace truing::python {

/// Whether V is a class of the module; an attribute of such a type is a reference.
template <class V>
constexpr bool is_bound_class = std::is_base_of_v<py::detail::type_caster_generic, py::detail::make_caster<V>>;

/// How a field of type V crosses: Python gives `In`, which becomes a value (`taken`) and is made of one (`given`);
/// Python gets what `shown` makes.
template <class V>
struct Exchange {
  using In = V;
  static V shown(const V& value) { return value; }
  static In given(const V& value) { return value; }
  static V taken(In value) { return value; }
};

template <class V>
struct Exchange<std::vector<V>> {
  using In = std::vector<V>;
  static TupleOf<V> shown(const In& value) { return tuple_of(value); }
  static const In& given(const In& value) { return value; }
  static In taken(In value) { return value; }
};

template <class Key, class V>
struct Exchange<std::map<Key, V>> {
  using In = std::map<Key, V>;
  static Mapping<Key, V> shown(const In& value) { return mapping_of(value); }
  static const In& given(const In& value) { return value; }
  static In taken(In value) { return value; }
};

template <>
struct Exchange<Eigen::Vector3d> {
  using In = Eigen::Vector3d;
  static py::array_t<double> shown(const In& value) { return array_from(value); }
  static In given(const In& value) { return value; }
  static In taken(In value) { return value; }
};

struct ExchangeOfNaN {
  using In = std::optional<double>;
  static In shown(double value) { return value == value ? In(value) : std::nullopt; }
  static In given(double value) { return shown(value); }
  static double taken(In value) { return value.value_or(std::numeric_limits<double>::quiet_NaN()); }
};

template <class V, bool NoneIfNan>
using ExchangeOf = std::conditional_t<NoneIfNan, ExchangeOfNaN, Exchange<V>>;

/// What Python gets of a field that it cannot set: as of Exchange, but rows of numbers, flags and frames as arrays.
template <class V>
struct ReadOnly {
  static auto shown(const V& value) { return Exchange<V>::shown(value); }
};

template <>
struct ReadOnly<std::vector<double>> {
  static py::array_t<double> shown(const std::vector<double>& value) { return array_from(value); }
};

template <>
struct ReadOnly<std::vector<std::int8_t>> {
  static py::array_t<std::int8_t> shown(const std::vector<std::int8_t>& value) { return array_from(value); }
};

template <std::size_t N>
struct ReadOnly<std::array<double, N>> {
  static py::array_t<double> shown(const std::array<double, N>& value) {
    return read_only(py::array_t<double>(N, value.data()));
  }
};

template <std::size_t N>
struct ReadOnly<std::vector<std::array<double, N>>> {
  static py::array_t<double> shown(const std::vector<std::array<double, N>>& value) { return array_from(value); }
};

template <>
struct ReadOnly<std::vector<Eigen::Isometry3d>> {
  static py::array_t<double> shown(const std::vector<Eigen::Isometry3d>& value) { return array_from(value); }
};

/// A row of a table as docstrings have it.
struct FieldText {
  const char* name;
  std::string value;  ///< as Python writes it
  const char* meaning;
};

/// `text`, then each field: "name = default: meaning".
std::string docstring(const std::string& text, const std::vector<FieldText>& fields);
/// "Scene()", of the class of `value`; kept for good.
const char* constructor_of(const py::object& value);
/// As a docstring has it; "identity" for a frame.
std::string default_text(const py::object& value);
/// Makes the constructor say which keyword is wrong, and __repr__ name the fields that are not at their default.
void define_names(py::object cls, const std::vector<FieldText>& fields);

template <class V, bool NoneIfNan>
py::object default_of(const V& value) {
  return py::cast(ExchangeOf<V, NoneIfNan>::given(value));
}

template <class V, bool NoneIfNan>
FieldText text_of(const char* name, const V& value, const char* meaning) {
  const py::object object = default_of<V, NoneIfNan>(value);
  return {name, is_bound_class<V> ? constructor_of(object) : default_text(object), meaning};
}

/// The keyword of a field.
template <class V, bool NoneIfNan>
py::arg_v keyword(const char* name, const V& value) {
  py::object object = default_of<V, NoneIfNan>(value);
  return py::arg_v(name, object, is_bound_class<V> ? constructor_of(object) : nullptr);
}

template <class T, class Class, class V, bool NoneIfNan>
void define_attribute(py::class_<T>& cls, const Field<Class, V, NoneIfNan>& field) {
  static_assert(!std::is_enum_v<V> || !is_bound_class<V>, "include the table of the enum's header");
  if constexpr (is_bound_class<V>) {
    cls.def_readwrite(field.name, field.member, field.meaning);
  } else {
    using Way = ExchangeOf<V, NoneIfNan>;
    cls.def_property(
        field.name, [member = field.member](const T& self) { return Way::shown(self.*member); },
        [member = field.member](T& self, typename Way::In value) { self.*member = Way::taken(std::move(value)); },
        field.meaning);
  }
}

template <class T, class Class, class V, bool NoneIfNan>
void define_read_only(py::class_<T>& cls, const Field<Class, V, NoneIfNan>& field) {
  static_assert(!std::is_enum_v<V> || !is_bound_class<V>, "include the table of the enum's header");
  if constexpr (is_bound_class<V> || py::detail::is_eigen_dense_plain<V>::value) {
    cls.def_readonly(field.name, field.member, field.meaning);
  } else {
    cls.def_property_readonly(
        field.name, [member = field.member](const T& self) { return ReadOnly<V>::shown(self.*member); }, field.meaning);
  }
}

template <class T, class... Class, class... V, bool... NoneIfNan>
py::class_<T> define_fields(py::module_& m, const char* name, const Field<Class, V, NoneIfNan>&... field) {
  const T usual{};
  const std::vector<FieldText> texts{text_of<V, NoneIfNan>(field.name, usual.*field.member, field.meaning)...};
  py::class_<T> cls(m, name, docstring(Fields<T>::summary, texts).c_str());
  cls.def(py::init([field...](typename ExchangeOf<V, NoneIfNan>::In... value) {
            T made{};
            ((made.*field.member = ExchangeOf<V, NoneIfNan>::taken(std::move(value))), ...);
            return made;
          }),
          py::kw_only(), keyword<V, NoneIfNan>(field.name, usual.*field.member)...);
  (define_attribute(cls, field), ...);
  define_names(cls, texts);
  define_value(cls, Names{field.name...});
  return cls;
}

/// A class of options: every field is a keyword with a default, and an attribute.
template <class T>
py::class_<T> define_options(py::module_& m, const char* name) {
  return Fields<T>::all([&](const auto&... field) { return define_fields<T>(m, name, field...); });
}

bool is_in(const Names& names, const char* name);

/// Attributes of a class with a constructor of its own. `but`: fields that are bound by hand.
template <class T>
void define_attributes(py::class_<T>& cls, const Names& but = {}) {
  Fields<T>::all(
      [&](const auto&... field) { ((is_in(but, field.name) ? void() : define_attribute(cls, field)), ...); });
}

template <class T>
void define_read_only_attributes(py::class_<T>& cls, const Names& but = {}) {
  Fields<T>::all(
      [&](const auto&... field) { ((is_in(but, field.name) ? void() : define_read_only(cls, field)), ...); });
}

/// A class that functions return. `but`: fields that are bound by hand, or not at all.
template <class T>
py::class_<T> define_result(py::module_& m, const char* name, const Names& but = {}) {
  py::class_<T> cls(m, name, Fields<T>::summary);
  define_read_only_attributes(cls, but);
  return cls;
}

template <class Options, class Result, class... Fixed, class... Extra, class... Class, class... V, bool... NoneIfNan>
void define_function_of_fields(py::module_& m, const char* name, Result (*function)(const Options&, Fixed...),
                               const char* text, const std::tuple<Extra...>& fixed,
                               const Field<Class, V, NoneIfNan>&... field) {
  const Options usual{};
  const std::string doc = docstring(text, {text_of<V, NoneIfNan>(field.name, usual.*field.member, field.meaning)...});
  std::apply(
      [&](const auto&... argument) {
        m.def(
            name,
            [function, field...](Fixed... given, typename ExchangeOf<V, NoneIfNan>::In... value) {
              Options options{};
              ((options.*field.member = ExchangeOf<V, NoneIfNan>::taken(std::move(value))), ...);
              return function(options, given...);
            },
            argument..., py::kw_only(), keyword<V, NoneIfNan>(field.name, usual.*field.member)..., doc.c_str());
      },
      fixed);
}

/// A function whose options are keywords of its own; `fixed` are the arguments before them.
template <class Options, class Result, class... Fixed, class... Extra>
void define_function(py::module_& m, const char* name, Result (*function)(const Options&, Fixed...), const char* text,
                     const Extra&... fixed) {
  Fields<Options>::all([&](const auto&... field) {
    define_function_of_fields(m, name, function, text, std::make_tuple(fixed...), field...);
  });
}

}  // namespace truing::python
