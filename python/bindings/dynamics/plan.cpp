// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/dynamics/plan.hpp"
#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/own_effects.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "repr.hpp"

namespace truing::python {

namespace {

std::string plan_summary(const TorquePlan& p) {
  std::string out = std::to_string(p.time.size()) + " rows, " + std::to_string(p.runs.size()) + " recordings to make\n";
  for (const TorqueEffectSize& e : p.planned.effects) {
    out += at_joints(e.effect, e.joints) + ": seen from " + text(e.size) + " " + e.unit + " on";
    out += std::isnan(e.size_apart) ? ", never told from " : ", told from " + text(e.size_apart) + " on from ";
    out += at_joints(e.closest, e.closest_joints) + "\n";
  }
  for (const NotTestable& n : p.planned.not_testable) out += at_joints(n.effect, n.joints) + ": " + n.why + "\n";
  for (const std::string& w : p.warnings) out += "warning: " + w + "\n";
  return out;
}

void bind_parts(py::module_& m) {
  auto size = define_result<TorqueEffectSize>(m, "TorqueEffectSize");
  size.def("__repr__", [](const TorqueEffectSize& e) {
    return "TorqueEffectSize(" + e.parameter + " >= " + text(e.size) + " " + e.unit + ")";
  });
  auto pair = define_result<TorqueEffectPair>(m, "TorqueEffectPair");
  pair.def("__repr__", [](const TorqueEffectPair& p) {
    return "TorqueEffectPair(" + at_joints(p.effect, p.joints) + ", " + at_joints(p.other, p.other_joints) +
           ", r2=" + text(p.r2) + ")";
  });
  auto outlook = define_result<TorqueOutlook>(m, "TorqueOutlook");
  outlook.def("__repr__", [](const TorqueOutlook& o) {
    return "TorqueOutlook(" + std::to_string(o.effects.size()) + " effects, " + std::to_string(o.alike.size()) +
           " pairs alike)";
  });
  auto run = define_result<TorqueRun>(m, "TorqueRun");
  run.def("__repr__", [](const TorqueRun& r) { return "TorqueRun(payload=" + text(r.payload) + ")"; });
}

}  // namespace

void bind_torque_plan(py::module_& m) {
  define_options<TorquePlanOptions>(m, "TorquePlanOptions");
  bind_parts(m);
  auto plan = define_result<TorquePlan>(m, "TorquePlan");
  plan.def("summary", &plan_summary, "A few lines for people.");
  plan.def("__repr__", [](const TorquePlan& p) {
    return "TorquePlan(" + std::to_string(p.time.size()) + " rows, " + std::to_string(p.planned.effects.size()) +
           " effects)";
  });
  m.def(
      "dynamics_plan",
      [](const Robot& given_robot, const std::optional<TorquePlanOptions>& given,
         const std::vector<Recording>& recordings, const std::vector<py::object>& own) {
        TorquePlanOptions options = given.value_or(TorquePlanOptions{});
        options.own_effects = torque_effects_evaluated_when_asked(own);
        const Robot robot = given_robot;
        const py::gil_scoped_release unlocked;
        return dynamics::plan(robot, options, recordings);
      },
      py::arg("robot"), py::arg("options") = py::none(), py::arg("recordings") = std::vector<Recording>{},
      py::arg("own_effects") = std::vector<py::object>{},
      R"(A motion that tells effects on torques apart, within the joints' limits, and what it could show.

recordings: looked at as well, for what they can show. Raises InputError: options, names or recordings that cannot be
used, a robot without masses, a joint without room to move.)");
}

}  // namespace truing::python
