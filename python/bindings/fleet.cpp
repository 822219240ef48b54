// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/fleet.hpp"
#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "repr.hpp"

namespace truing::python {

namespace {

using Requests = std::vector<EffectRequest>;
using Counts = py::array_t<bool, py::array::c_style | py::array::forcecast>;

std::vector<std::int8_t> counts_from(const std::optional<Counts>& counts) {
  if (!counts) return {};
  return {counts->data(), counts->data() + counts->size()};
}

void bind_sums(py::module_& m) {
  auto parameter = define_result<FreeParameter>(m, "FreeParameter");
  parameter.def("__repr__", [](const FreeParameter& p) {
    return formatted("FreeParameter('%s', %s, %.6g %s)", p.name.c_str(), p.role.c_str(), p.value, p.unit.c_str());
  });
  define_result<RowSums>(m, "RowSums").def("__repr__", [](const RowSums& sums) {
    return formatted("RowSums(%zu values, %d parameters)", sums.values, static_cast<int>(sums.gradient.size()));
  });
  m.def(
      "free_parameters",
      [](const Robot& given, const Measurements& data, const std::vector<std::string>& free,
         const std::vector<std::string>& hold, const Requests& effects) {
        ParameterSelection selection;
        selection.free = free;
        selection.hold = hold;
        selection.effects = effects;
        const Robot robot = given;  // other Python threads may change theirs once the GIL is released
        std::vector<FreeParameter> found;
        {
          const py::gil_scoped_release unlocked;
          found = free_parameters(robot, data, selection);
        }
        return found;
      },
      py::arg("robot"), py::arg("data"), py::kw_only(), py::arg("free") = std::vector<std::string>{},
      py::arg("hold") = std::vector<std::string>{}, py::arg("effects") = Requests{},
      R"(The parameters that `identify` would fit to these rows, before anything is known of what the rows can see.

Raises InputError on rows that touch fixed points, and on names or effects that are not known.)");
  m.def(
      "robot_at",
      [](const Robot& given, const Measurements& data, const std::vector<std::string>& names,
         const Eigen::VectorXd& values, const Requests& effects) {
        const Robot robot = given;
        const py::gil_scoped_release unlocked;
        return robot_at(robot, data, names, values, effects);
      },
      py::arg("robot"), py::arg("data"), py::arg("names"), py::arg("values"), py::arg("effects") = Requests{},
      "The robot with these parameters at these values, which count from `robot` as those of `free_parameters` do. "
      "Raises InputError on names that the model does not have.");
  m.def(
      "sum_rows",
      [](const Robot& given, const Measurements& data, const std::vector<std::string>& names,
         const Eigen::VectorXd& values, const std::optional<Counts>& counts, const Requests& effects,
         double rotation_length, bool scores, int threads) {
        const SumOptions options{effects, rotation_length, scores, threads};
        const std::vector<std::int8_t> counted = counts_from(counts);
        const Robot robot = given;
        const py::gil_scoped_release unlocked;
        return sum_rows(robot, data, names, values, counted, options);
      },
      py::arg("robot"), py::arg("data"), py::arg("names"), py::arg("values"), py::arg("counts") = py::none(),
      py::kw_only(), py::arg("effects") = Requests{}, py::arg("rotation_length") = SumOptions{}.rotation_length,
      py::arg("scores") = false, py::arg("threads") = 1,
      R"(Normal equations of the rows that count at these values of these parameters, and the errors of every row.

counts: shape=(n,), False for rows of which only the errors are told. rotation_length: [m] a rotation error of 1 rad
counts as this length, where rows give no sigma. The same bits for any number of threads. Raises InputError.)");
}

void bind_choice(py::module_& m) {
  define_result<SeenColumns>(m, "SeenColumns");
  define_result<GroupChoice>(m, "GroupChoice");
  m.def(
      "seen_columns", &seen_columns, py::arg("gram"), py::arg("priority"), py::arg("tolerance") = 1e-6,
      "Which columns of a Gram matrix, shape=(p, p), it can see, as `identify` decides it: of two that cannot be told "
      "apart the one of lower `priority` stays, or the first.");
  m.def("choose_groups", &choose_groups, py::arg("gram"), py::arg("right"), py::arg("squares"), py::arg("values"),
        py::arg("groups"), py::arg("prior"), py::arg("cost"), py::arg("threshold") = 4.0,
        py::call_guard<py::gil_scoped_release>(),
        R"(Which groups of columns explain y, from the normal equations of y = X theta + noise alone.

gram: shape=(p, p) X^T X. right: shape=(p,) X^T y. squares: y^T y. values: how many. groups: column numbers of each.
prior: shape=(p,), the size that each parameter may have. cost: nats for having looked at as many groups. threshold: nats
that a group must win beyond that. Raises InputError on shapes that do not fit.)");
}

}  // namespace

void bind_fleet(py::module_& m) {
  bind_sums(m);
  bind_choice(m);
}

}  // namespace truing::python
