// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/own_effects.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "repr.hpp"
#include "tables/dynamics/diagnose.hpp"
#include "tables/dynamics/sums.hpp"

namespace truing::python {

namespace {

std::string repr(const FoundTorqueEffect& e) {
  return "FoundTorqueEffect(" + at_joints(e.effect, e.joints) + ", probability " + text(e.probability) + ")";
}

std::string errors_line(const TorqueErrors& errors) {
  std::string out = errors.model + ":";
  for (const TorqueError& e : errors.held_out) out += formatted(" %.1f", e.percent);
  return out + " %\n";
}

std::string order_line(const TorqueOrder& o) {
  return formatted("left: %g waves a turn of %s%s, %.3g Nm, %.1f %% of what is left while it moves\n", o.order,
                   o.joint.c_str(), o.with_direction ? ", with the direction" : "", o.amplitude, 100.0 * o.share);
}

std::string summary(const TorqueDiagnosis& d) {
  std::string out = d.sentence + "\nheld-out torque, rms error in % of its standard deviation\n";
  for (const TorqueErrors& errors : d.errors) out += errors_line(errors);
  for (const FoundTorqueEffect& e : d.effects) {
    out += at_joints(e.effect, e.joints) + (e.standard ? " (standard)" : "") + ": probability " + text(e.probability) +
           formatted(", removes %.1f %%", 100.0 * e.share.value);
    for (const TorqueAlternative& a : e.confounded_with) out += ", or " + at_joints(a.effect, a.joints);
    out += "\n";
  }
  for (const UnknownTorque& u : d.unknown) out += "unknown, at " + u.joint + ", over " + joined(u.inputs) + "\n";
  for (const TorqueOrder& o : d.orders) out += order_line(o);
  for (const std::string& w : d.warnings) out += "warning: " + w + "\n";
  return out;
}

void bind_fit(py::module_& m) {
  auto error = define_result<TorqueError>(m, "TorqueError");
  error.def("__repr__",
            [](const TorqueError& e) { return formatted("TorqueError(%s, %.3g %%)", e.joint.c_str(), e.percent); });
  auto errors = define_result<TorqueErrors>(m, "TorqueErrors");
  errors.def("__repr__", [](const TorqueErrors& e) { return "TorqueErrors(" + e.model + ")"; });
  auto fit = define_result<TorqueFit>(m, "TorqueFit");
  fit.def("__repr__",
          [](const TorqueFit& f) { return "TorqueFit(" + std::to_string(f.parameters.size()) + " parameters)"; });
  auto prediction = define_result<TorquePrediction>(m, "TorquePrediction");
  prediction.def("__repr__", [](const TorquePrediction& p) {
    return "TorquePrediction(" + std::to_string(p.torque.rows()) + " rows)";
  });
}

void bind_found(py::module_& m) {
  auto alternative = define_result<TorqueAlternative>(m, "TorqueAlternative");
  alternative.def("__repr__", [](const TorqueAlternative& a) {
    return "TorqueAlternative(" + at_joints(a.effect, a.joints) + ")";
  });
  auto found = define_result<FoundTorqueEffect>(m, "FoundTorqueEffect");
  found.def("__repr__", [](const FoundTorqueEffect& e) { return repr(e); });
  auto unknown = define_result<UnknownTorque>(m, "UnknownTorque");
  unknown.def("__repr__", [](const UnknownTorque& u) {
    return "UnknownTorque(" + at_joints(joined(u.inputs), {u.joint}) + ", probability " + text(u.probability) + ")";
  });
  auto regime = define_result<TorqueRegime>(m, "TorqueRegime");
  regime.def("__repr__", [](const TorqueRegime& r) { return "TorqueRegime(" + r.joint + ", " + r.input + ")"; });
  auto order = define_result<TorqueOrder>(m, "TorqueOrder");
  order.def("__repr__", [](const TorqueOrder& o) {
    return formatted("TorqueOrder(%s, %g waves a turn, %.3g Nm)", o.joint.c_str(), o.order, o.amplitude);
  });
  auto one_class = define_result<TorqueClass>(m, "TorqueClass");
  one_class.def("__repr__", [](const TorqueClass& c) { return "TorqueClass(" + c.sentence + ")"; });
  auto trace = define_result<TorqueTrace>(m, "TorqueTrace");
  trace.def("__repr__", [](const TorqueTrace& t) { return "TorqueTrace(" + t.recording + ", " + t.joint + ")"; });
  auto diagnosis = define_result<TorqueDiagnosis>(m, "TorqueDiagnosis");
  diagnosis.def("summary", &summary, "A few lines for people.");
  diagnosis.def("__repr__", [](const TorqueDiagnosis& d) {
    return std::string("TorqueDiagnosis('") + word(d.verdict) + "', " + std::to_string(d.effects.size()) + " effects)";
  });
}

void bind_torque_sums(py::module_& m) {
  define_options<TorqueSumOptions>(m, "TorqueSumOptions");
  auto columns = define_result<TorqueColumns>(m, "TorqueColumns");
  columns.def("__repr__",
              [](const TorqueColumns& c) { return formatted("TorqueColumns(%zu parameters)", c.names.size()); });
  auto block = define_result<TorqueBlock>(m, "TorqueBlock");
  block.def("__repr__", [](const TorqueBlock& b) { return formatted("TorqueBlock(%.0f rows)", b.rows); });
  m.def(
      "torque_columns", [](const Robot& robot) { return dynamics::torque_columns(robot); }, py::arg("robot"),
      R"(The parameters that torques are summed for: inertial ones of the links, and of every joint armature, Coulomb and
viscous friction and an offset.

Raises InputError: a robot that cannot be used, no link has a mass.)");
  m.def(
      "sum_torques",
      [](const Robot& given_robot, const Recording& recording, const std::optional<TorqueSumOptions>& given) {
        const TorqueSumOptions options = given.value_or(TorqueSumOptions{});
        const Robot robot = given_robot;
        const py::gil_scoped_release unlocked;
        return dynamics::sum_torques(robot, recording, options);
      },
      py::arg("robot"), py::arg("recording"), py::arg("options") = py::none(),
      R"(Normal equations of a recording's torques: block after block of time, and in each joint after joint.

Of a recording that is read in pieces no more than a stretch is in memory. A known payload is part of the nominal
torque. The same bits for any number of threads. Raises InputError on a recording or options that cannot be used.)");
  m.def(
      "torques_of_bodies",
      [](const Robot& given_robot, const Eigen::MatrixXd& gram, const Eigen::VectorXd& right) {
        const Robot robot = given_robot;
        const py::gil_scoped_release unlocked;
        return dynamics::torques_of_bodies(robot, gram, right);
      },
      py::arg("robot"), py::arg("gram"), py::arg("right"),
      R"(Values of all parameters with inertias that bodies can have, nearest to the solution of gram values = right.

gram: shape=(p, p), right: shape=(p,), of the parameters of `torque_columns`; the sum of squares is in units of the
noise. Raises InputError on other shapes.)");
  m.def(
      "robot_with_torques",
      [](const Robot& robot, const Eigen::VectorXd& values) { return dynamics::robot_with_torques(robot, values); },
      py::arg("robot"), py::arg("values"),
      R"(The robot with these values of all parameters of `torque_columns`, shape=(p,), added to what it has.

Raises InputError on another shape.)");
}

}  // namespace

/// Name, summary and what the documents say of every effect on torques.
std::vector<std::map<std::string, std::string>> torque_effects() {
  std::vector<std::map<std::string, std::string>> out;
  for (const TorqueEffect& effect : torque_catalogue()) {
    const TorqueTraits& traits = effect.traits;
    out.push_back({{"name", effect.name},
                   {"summary", effect.summary},
                   {"law", traits.documentation.law},
                   {"parameters", traits.documentation.parameters},
                   {"needs", traits.documentation.needs},
                   {"family", word(traits.family)},
                   {"plain", traits.plain}});
  }
  return out;
}

void bind_torque(py::module_& m) {
  m.def("torque_effects", &torque_effects, "What every effect on torques is, in words, by the catalogue's order.");
  define_options<TorqueOptions>(m, "TorqueOptions");
  define_options<TorqueDiagnoseOptions>(m, "TorqueDiagnoseOptions");
  bind_fit(m);
  bind_found(m);
  bind_torque_sums(m);
  m.def(
      "dynamics_identify",
      [](const Robot& given_robot, const std::vector<Recording>& recordings, const std::optional<TorqueOptions>& given,
         const std::vector<py::object>& own) {
        TorqueOptions options = given.value_or(TorqueOptions{});
        options.own_effects = torque_effects_evaluated_when_asked(own);
        const Robot robot = given_robot;
        const py::gil_scoped_release unlocked;
        return dynamics::identify(robot, recordings, options);
      },
      py::arg("robot"), py::arg("recordings"), py::arg("options") = py::none(),
      py::arg("own_effects") = std::vector<py::object>{},
      R"(Finds inertial parameters and the effects asked for from recordings with torques or currents.

Raises InputError on recordings or options that cannot be used.)");
  m.def(
      "dynamics_diagnose",
      [](const Robot& given_robot, const std::vector<Recording>& recordings,
         const std::optional<TorqueDiagnoseOptions>& given, const std::vector<py::object>& own) {
        TorqueDiagnoseOptions options = given.value_or(TorqueDiagnoseOptions{});
        options.own_effects = torque_effects_evaluated_when_asked(own);
        const Robot robot = given_robot;
        const py::gil_scoped_release unlocked;
        return dynamics::diagnose(robot, recordings, options);
      },
      py::arg("robot"), py::arg("recordings"), py::arg("options") = py::none(),
      py::arg("own_effects") = std::vector<py::object>{},
      R"(Which effects stand between a robot's model and the torques that it was recorded with.

Raises InputError on recordings or options that cannot be used.)");
  m.def(
      "dynamics_predict",
      [](const Robot& given_robot, const Recording& recording, std::optional<double> cutoff,
         const std::vector<py::object>& own) {
        const Robot robot = given_robot;
        const std::vector<TorqueEffect> effects = torque_effects_evaluated_when_asked(own);
        const py::gil_scoped_release unlocked;
        return dynamics::predict(robot, recording, cutoff, effects);
      },
      py::arg("robot"), py::arg("recording"), py::arg("cutoff") = py::none(),
      py::arg("own_effects") = std::vector<py::object>{},
      R"(Torques of every row of a recording: links, rotors, and the effects that the robot carries. cutoff: [Hz];
None: the highest frequency that the robot's effects were fitted on, or what is usual.

Raises InputError on a recording that cannot be used.)");
}

}  // namespace truing::python
