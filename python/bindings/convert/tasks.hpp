// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// What inverse kinematics is asked for, and its many answers: tasks, seeds, conditions, progress, sequences of
/// results.
#pragma once

#include <exception>
#include <functional>
#include <variant>

#include "convert/columns.hpp"
#include "truing/inverse.hpp"

namespace truing::python {

// ---- In -------------------------------------------------------------------------------------------------------------

using Tasks = std::variant<std::vector<Task>, FrameArray>;
using GivenConditions = std::optional<std::variant<Conditions, std::vector<Conditions>>>;
using Callback = std::optional<py::typing::Callable<py::object(std::size_t)>>;

Joints joints_from(const Eigen::Ref<const Eigen::VectorXd>& values);
/// One set of readings, shape (driven,), or one per row, shape (n, driven).
std::vector<Joints> joint_rows(const ArrayLike& given, int driven, const std::string& name);
/// As given, or the middle of every joint's range.
std::vector<Joints> seeds_from(const std::optional<ArrayLike>& given, const InverseSolver& solver);
Joints seed_from(const std::optional<Eigen::VectorXd>& given, const InverseSolver& solver);
/// Tasks as they are, or one like `like` for each frame.
std::vector<Task> tasks_from(const Tasks& given, const std::optional<Task>& like);
std::vector<Conditions> conditions_from(const GivenConditions& given);
void require_one_or_each(std::size_t found, std::size_t count, const std::string& name);

/// Runs `work(progress)` without the interpreter lock. Now and then it is taken for `callback` (done) and for Ctrl-C;
/// what they raise stops the work and is raised here.
template <class Work>
auto with_progress(const Callback& callback, const Work& work) {
  std::exception_ptr raised;
  const std::function<bool(std::size_t)> progress = [&](std::size_t done) {
    const py::gil_scoped_acquire locked;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (callback) (*callback)(done);
    } catch (const py::error_already_set&) {
      raised = std::current_exception();
    }
    return !raised;
  };
  auto result = [&] {
    const py::gil_scoped_release unlocked;
    return work(progress);
  }();
  if (raised) std::rethrow_exception(raised);
  return result;
}

// ---- Out ------------------------------------------------------------------------------------------------------------

struct Solutions {
  std::vector<Solution> items;
  py::ssize_t driven = 0;
};

std::string repr(const Solution& solution);
py::array_t<double> array_of(const Joints& joints);

template <class Item>
const Item& at(const std::vector<Item>& items, py::ssize_t k) {
  const auto count = static_cast<py::ssize_t>(items.size());
  if (k < -count || k >= count) throw py::index_error();
  return items[static_cast<std::size_t>(k < 0 ? k + count : k)];
}

/// Length, index and iteration of a class with `items`.
template <class T>
void define_sequence(py::class_<T>& cls) {
  cls.def("__len__", [](const T& all) { return all.items.size(); });
  cls.def("__getitem__", [](const T& all, py::ssize_t k) { return at(all.items, k); }, py::arg("k"));
  cls.def(
      "__iter__", [](const T& all) { return py::make_iterator(all.items.begin(), all.items.end()); },
      py::keep_alive<0, 1>());
}

/// An attribute that has one number of each item.
template <class T, class Item, class Value>
void define_column(py::class_<T>& cls, const char* name, Value Item::* member, const char* doc) {
  using Number = std::conditional_t<std::is_same_v<Value, int>, std::int32_t, Value>;
  cls.def_property_readonly(
      name, [member](const T& all) { return column<Number>(all.items, [member](const Item& i) { return i.*member; }); },
      doc);
}

}  // namespace truing::python
