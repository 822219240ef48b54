// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/plan.hpp"
#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/own_effects.hpp"
#include "convert/text.hpp"
#include "parts.hpp"

namespace truing::python {

namespace {

std::string repr(const PlanResult& r) {
  return "PlanResult(" + std::to_string(r.joints.rows()) + " poses, index " + text(r.index_start) + " -> " +
         text(r.index_end) + ")";
}

std::string repr(const Distinction& d) {
  return "Distinction(" + std::to_string(d.effects.size()) + " effects, " + std::to_string(d.alike.size()) +
         " pairs alike, " + std::to_string(d.added) + " poses added)";
}

/// None where the column was not asked for.
std::optional<py::array_t<double>> column_or_none(const Eigen::VectorXd& values) {
  if (values.size() == 0) return std::nullopt;
  return read_only(py::array_t<double>(values.size(), values.data()));
}

void bind_planning(py::module_& m) {
  define_options<PlanOptions>(m, "PlanOptions");
  auto result = define_result<PlanResult>(m, "PlanResult");
  result.def("__repr__", [](const PlanResult& r) { return repr(r); });
  m.def(
      "plan",
      [](const Robot& given_robot, const std::optional<PlanOptions>& given) {
        const PlanOptions options = given.value_or(PlanOptions{});
        const Robot robot = given_robot;  // other Python threads may change theirs once the GIL is released
        const py::gil_scoped_release unlocked;
        return plan(robot, options);
      },
      py::arg("robot"), py::arg("options") = py::none(),
      R"(Measurement poses by exchange on an observability index.

Revolute joints without limits use -pi ... pi. Raises InputError: fewer poses than the parameters need, a joint
whose range is too small for `min_step`.)");
}

void bind_distinction(py::module_& m) {
  auto cls = define_result<Distinction>(m, "Distinction", {"direction", "payload", "temperature", "time"});
  cls.def_property_readonly(
      "direction",
      [](const Distinction& d) -> std::optional<py::array_t<double>> {
        if (d.direction.size() == 0) return std::nullopt;
        return read_only(py::array_t<double>({d.direction.rows(), d.direction.cols()}, d.direction.data()));
      },
      "shape=(poses, driven joints): approach direction, -1 or 1; None unless asked for.");
  const auto column = [&cls](const char* name, Eigen::VectorXd Distinction::* member, const char* doc) {
    cls.def_property_readonly(name, [member](const Distinction& d) { return column_or_none(d.*member); }, doc);
  };
  column("payload", &Distinction::payload, "shape=(poses,) [kg]; None unless asked for.");
  column("temperature", &Distinction::temperature, "shape=(poses,) [deg C]; None unless asked for.");
  column("time", &Distinction::time, "shape=(poses,) [s]; None unless asked for.");
  cls.def("__repr__", [](const Distinction& d) { return repr(d); });
}

void bind_distinguishing(py::module_& m) {
  define_options<DistinguishOptions>(m, "DistinguishOptions");
  auto size = define_result<EffectSize>(m, "EffectSize");
  size.def("__repr__", [](const EffectSize& e) {
    return "EffectSize(" + e.parameter + " >= " + text(e.size) + " " + e.unit + ")";
  });
  auto pair = define_result<EffectPair>(m, "EffectPair");
  pair.def("__repr__", [](const EffectPair& p) {
    return "EffectPair(" + p.effect + " " + p.joint + ", " + p.other + " " + p.other_joint + ", r2=" + text(p.r2) + ")";
  });
  bind_distinction(m);
  m.def(
      "distinguish",
      [](const Robot& given_robot, const RowMajor& joints, const std::optional<DistinguishOptions>& given,
         const std::vector<py::object>& own) {
        DistinguishOptions options = given.value_or(DistinguishOptions{});
        options.own_effects = effects_evaluated_when_asked(own);
        const Robot robot = given_robot;
        const py::gil_scoped_release unlocked;
        return distinguish(robot, joints, options);
      },
      py::arg("robot"), py::arg("joints"), py::arg("options") = py::none(),
      py::arg("own_effects") = std::vector<py::object>{},
      R"(Before any data: which effects a plan can tell apart, how small it would still see them, and the poses to add.

Raises InputError: unknown effects, joints or columns.)");
}

}  // namespace

void bind_plan(py::module_& m) {
  bind_planning(m);
  bind_distinguishing(m);
}

}  // namespace truing::python
