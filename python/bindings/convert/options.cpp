// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/options.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <set>

#include "convert/text.hpp"

namespace truing::python {

namespace {

std::string name_of(const py::handle& cls) { return cls.attr("__name__").cast<std::string>(); }

/// The lines after the first moved in, empty ones left out.
std::string indented(const std::string& text) {
  std::string out;
  for (std::size_t k = 0; k < text.size(); ++k) {
    if (text[k] == '\n' && text[k + 1] == '\n') continue;
    out += text[k] == '\n' ? "\n    " : std::string(1, text[k]);
  }
  return out;
}

/// "name=value" of the fields that are not at their default.
struct Repr {
  std::vector<std::string> names;

  std::string operator()(const py::object& self) const {
    const py::object cls = py::type::of(self), usual = cls();
    std::vector<std::string> words;
    for (const std::string& name : names) {
      const std::string value = py::repr(self.attr(name.c_str())).cast<std::string>();
      if (value != py::repr(usual.attr(name.c_str())).cast<std::string>()) words.push_back(name + "=" + value);
    }
    return name_of(cls) + "(" + joined(words) + ")";
  }
};

/// The typed constructor, and what was wrong where it did not take what was given.
struct Constructor {
  py::object cls, typed;
  std::vector<std::string> names;

  void operator()(const py::object& self, const py::args& positional, const py::kwargs& given) const {
    try {
      typed(self, *positional, **given);
    } catch (const py::error_already_set& error) {
      if (!error.matches(PyExc_TypeError)) throw;
      explain(positional, given);
      throw;
    }
  }

  void explain(const py::args& positional, const py::kwargs& given) const {
    const std::string name = name_of(cls);
    if (!positional.empty()) throw py::type_error(name + " takes keywords alone: " + joined(names));
    const py::object made = cls();
    for (const auto& [key, value] : given) {
      const std::string keyword = py::str(key);
      if (std::find(names.begin(), names.end(), keyword) == names.end()) throw py::type_error(unknown(name, keyword));
      try {
        py::setattr(made, key, value);
      } catch (const py::error_already_set& error) {
        if (!error.matches(PyExc_TypeError)) throw;
        throw py::type_error(name + ": " + keyword + " cannot be " + py::repr(value).cast<std::string>());
      }
    }
  }

  std::string unknown(const std::string& name, const std::string& keyword) const {
    const auto close = py::module_::import("difflib").attr("get_close_matches")(keyword, names, 1);
    return name + " has no '" + keyword + "'; choose from " + joined(names) +
           (py::len(close) == 0 ? "" : ". Did you mean '" + close[py::int_(0)].cast<std::string>() + "'?");
  }
};

/// Puts the explanation around the typed constructor. Signature and docstring, which stubs are made from, stay. Not an
/// overload: of overloads pybind11 takes keyword-only arguments without conversion alone.
void define_constructor(const py::object& cls, const std::vector<std::string>& names) {
  const py::object typed = cls.attr("__init__");
  py::cpp_function function(Constructor{cls, typed, names}, py::name("explained"), py::is_method(cls));
  auto* method = reinterpret_cast<PyCFunctionObject*>(py::detail::get_function(function).ptr())->m_ml;
  std::free(const_cast<char*>(method->ml_doc));  // pybind11 frees what is put there when the function goes
  method->ml_doc = strdup(typed.attr("__doc__").cast<std::string>().c_str());
  cls.attr("__init__") = function;
}

}  // namespace

std::string docstring(const std::string& text, const std::vector<FieldText>& fields) {
  std::string out = text + "\n";
  for (const FieldText& field : fields)
    out += std::string("\n") + field.name + " = " + field.value + ": " + indented(field.meaning);
  return out;
}

const char* constructor_of(const py::object& value) {
  static std::set<std::string> kept;
  return kept.insert(name_of(py::type::of(value)) + "()").first->c_str();
}

std::string default_text(const py::object& value) {
  if (!py::isinstance<py::array>(value)) return py::repr(value).cast<std::string>();
  const auto array = py::array_t<double>::ensure(value);
  if (array.ndim() == 2) return "identity";
  return py::str(array.attr("tolist")()).cast<std::string>();
}

void define_names(py::object cls, const std::vector<FieldText>& fields) {
  std::vector<std::string> names;
  for (const FieldText& field : fields) names.emplace_back(field.name);
  define_constructor(cls, names);
  py::cpp_function repr(Repr{names}, py::name("__repr__"), py::is_method(cls));
  py::detail::add_class_method(cls, "__repr__", repr);
}

bool is_in(const Names& names, const char* name) {
  return std::any_of(names.begin(), names.end(), [name](const char* one) { return std::strcmp(one, name) == 0; });
}

}  // namespace truing::python
