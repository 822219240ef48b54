// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/identify.hpp"
#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/own_effects.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "repr.hpp"

namespace truing::python {

namespace {

std::string repr(const BeforeAfter& b) {
  return "BeforeAfter(before=" + python::repr(b.before) + ", after=" + python::repr(b.after) + ")";
}

std::string repr(const Identification& r) {
  return formatted("Identification(%s, %d of %d parameters, train rms %.4g -> %.4g mm)",
                   r.solver.converged ? "converged" : "not converged", r.rank, r.columns, 1e3 * r.train.before.rms,
                   1e3 * r.train.after.rms);
}

std::string summary(const Identification& r) {
  std::string out =
      formatted("%s: %s after %d iterations (%s)\n%d of %d parameters fitted, noise %.4g mm\n", r.solver.name.c_str(),
                r.solver.converged ? "converged" : "did not converge", r.solver.iterations,
                r.solver.stopped_because.c_str(), r.rank, r.columns, 1e3 * r.noise_sigma);
  const auto line = [&out](const char* name, const BeforeAfter& e) {
    out += formatted("%-5s  rms %.4g -> %.4g mm, p95 %.4g -> %.4g mm, max %.4g -> %.4g mm, n = %zu\n", name,
                     1e3 * e.before.rms, 1e3 * e.after.rms, 1e3 * e.before.p95, 1e3 * e.after.p95, 1e3 * e.before.max,
                     1e3 * e.after.max, e.after.n);
  };
  line("train", r.train);
  if (r.test) line("test", *r.test);
  if (!r.rejected_rows.empty()) out += std::to_string(r.rejected_rows.size()) + " rows rejected as gross outliers\n";
  for (const Frozen& f : r.frozen) out += "frozen: " + f.parameter + " (" + f.why + ")\n";
  for (const std::string& w : r.warnings) out += "warning: " + w + "\n";
  return out;
}

Parameter parameter_of(const Identification& result, const std::string& name) {
  std::vector<std::string> names;
  for (const Parameter& parameter : result.parameters) {
    if (parameter.name == name) return parameter;
    names.push_back(parameter.name);
  }
  throw std::invalid_argument("there is no parameter '" + name + "'; there are: " + joined(names));
}

std::map<std::string, BeforeAfter> errors_of(const Identification& result) {
  std::map<std::string, BeforeAfter> by_set{{"train", result.train}};
  if (result.test) by_set["test"] = *result.test;
  return by_set;
}

void bind_results(py::module_& m) {
  auto both = define_result<BeforeAfter>(m, "BeforeAfter");
  both.def("__repr__", [](const BeforeAfter& b) { return repr(b); });

  auto cls = define_result<Identification>(m, "Identification");
  cls.def("parameter", &parameter_of, py::arg("name"),
          "The parameter of that name; raises InputError that lists the parameters there are.");
  cls.def_property_readonly(
      "errors", [](const Identification& r) { return mapping_of(errors_of(r)); },
      "Errors by set: 'train', and 'test' if rows were held out.");
  cls.def("summary", &summary, "A few lines for people.");
  cls.def("__repr__", [](const Identification& r) { return repr(r); });

  auto prediction = define_result<Prediction>(m, "Prediction");
  prediction.def("__repr__",
                 [](const Prediction& p) { return "Prediction(" + std::to_string(p.position.rows()) + " rows)"; });

  auto residual = define_result<Residuals>(m, "Residuals");
  residual.def("__repr__",
               [](const Residuals& r) { return "Residuals(" + std::to_string(r.position.rows()) + " rows)"; });
}

}  // namespace

void bind_identify(py::module_& m) {
  define_options<IdentifyOptions>(m, "IdentifyOptions");
  bind_results(m);
  const std::vector<OwnEffect> none;
  m.def(
      "identify",
      [](const Robot& given_robot, const Measurements& data, const std::optional<IdentifyOptions>& given,
         const std::vector<OwnEffect>& own) {
        IdentifyOptions options = given.value_or(IdentifyOptions{});
        options.own_effects = effects_from(own);
        const Robot robot = given_robot;  // other Python threads may change theirs once the GIL is released
        const py::gil_scoped_release unlocked;
        return identify(robot, data, options);
      },
      py::arg("robot"), py::arg("data"), py::arg("options") = py::none(), py::arg("own_effects") = none,
      R"(Finds the robot's parameters from measurements. Raises InputError on data or options that cannot be used.

A fit that did not converge returns with solver.converged == False.)");
  m.def(
      "lacks_directions",
      [](const Robot& robot, const Measurements& data, const std::vector<OwnEffect>& own) {
        return lacks_directions(robot, data, effects_from(own));
      },
      py::arg("robot"), py::arg("data"), py::arg("own_effects") = none,
      "True when an effect of the robot needs approach directions that the data lack.");
  m.def(
      "lacks_speeds",
      [](const Robot& robot, const Measurements& data, const std::vector<OwnEffect>& own) {
        return lacks_speeds(robot, data, effects_from(own));
      },
      py::arg("robot"), py::arg("data"), py::arg("own_effects") = none,
      "True when an effect of the robot needs joint speeds that the data lack, and that can be inferred.");
  m.def(
      "predict",
      [](const Robot& given, const Measurements& data, const std::vector<OwnEffect>& own, int threads) {
        const std::vector<Effect> effects = effects_from(own);
        const Robot robot = given;
        const py::gil_scoped_release unlocked;
        return predict(robot, data, effects, threads);
      },
      py::arg("robot"), py::arg("data"), py::arg("own_effects") = none, py::arg("threads") = 0,
      "What the robot predicts for the rows of `data`. Raises InputError on unknown effects or columns that "
      "they need.");
  m.def(
      "residuals",
      [](const Robot& given, const Measurements& data, const std::vector<OwnEffect>& own, int threads) {
        const std::vector<Effect> effects = effects_from(own);
        const Robot robot = given;
        const py::gil_scoped_release unlocked;
        return residuals(robot, data, effects, threads);
      },
      py::arg("robot"), py::arg("data"), py::arg("own_effects") = none, py::arg("threads") = 0,
      R"(Predicted minus measured, NaN where not measured. Raises InputError.

Rows of a fixed point are compared with the mean of that point's predictions.)");
}

}  // namespace truing::python
