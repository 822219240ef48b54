// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/own_effects.hpp"
#include "convert/columns.hpp"
#include "parts.hpp"

namespace truing::python {

namespace {

/// What Python's basis gives for the rows of a motion. Takes the GIL to ask it.
Eigen::MatrixXd evaluated(py::handle effect, const std::string& joint, const std::string& part, const Motion& motion) {
  const py::gil_scoped_acquire locked;
  const auto values = effect
                          .attr("evaluate")(py::cast(motion.robot, py::return_value_policy::reference),
                                            py::cast(&motion, py::return_value_policy::reference), joint, part)
                          .cast<Eigen::VectorXd>();
  return values;
}

/// `truing.dynamics.TorqueEffect` at a joint: a term for each part of its basis, none where it does not act.
std::vector<TorqueForm> forms_at(py::handle effect, const Robot& robot, std::size_t joint, const MotionRange& range,
                                 const std::shared_ptr<const void>& kept) {
  const py::gil_scoped_acquire locked;
  const std::string name = robot.joints[robot.driven_joints()[joint]].name;
  const auto parts = effect.attr("parts_at")(name).cast<std::vector<std::string>>();
  const auto size = effect.attr("size").cast<std::optional<double>>();
  TorqueForm form;
  for (const std::string& part : parts) {
    TorqueTerm term;
    term.parameter = effect.attr("name").cast<std::string>() + "." + name + (part.empty() ? "" : "." + part);
    term.unit = effect.attr("unit").cast<std::string>();
    term.joints = {joint};
    term.needs_torque = effect.attr("needs_torque").cast<bool>();
    term.needs_rigid = false;
    term.prior = size.value_or(std::max(range.torque[static_cast<Eigen::Index>(joint)], 1e-3));
    term.basis = [object = effect.ptr(), kept, name, part](const Motion& motion) {
      return evaluated(object, name, part, motion);
    };
    form.push_back(std::move(term));
  }
  return form.empty() ? std::vector<TorqueForm>{} : std::vector<TorqueForm>{form};
}

py::array_t<double> copied(const Eigen::MatrixXd& table) { return py::cast(table).cast<py::array_t<double>>(); }

}  // namespace

std::vector<TorqueEffect> torque_effects_evaluated_when_asked(const std::vector<py::object>& own) {
  std::vector<TorqueEffect> out;
  for (const py::object& effect : own) {
    TorqueEffect one;
    one.name = effect.attr("name").cast<std::string>();
    one.summary = effect.attr("summary").cast<std::string>();
    one.traits.plain = one.summary.empty() ? one.name : one.summary;
    one.forms = [object = effect.ptr(), kept = keep_alive({effect})](const Robot& robot, std::size_t joint,
                                                                     const MotionRange& range) {
      return forms_at(object, robot, joint, range, kept);
    };
    out.push_back(std::move(one));
  }
  return out;
}

void bind_own_torque_effects(py::module_& m) {
  py::class_<Motion> motion(
      m, "Motion", "A stretch of a recording, as the basis of an effect on torques sees it. Arrays are copies.");
  motion.def_property_readonly(
      "time", [](const Motion& o) { return o.time; }, "shape=(rows,) [s] from the start of the recording");
  motion.def_property_readonly("q", [](const Motion& o) { return copied(o.q); }, "shape=(rows, joints) [rad | m]");
  motion.def_property_readonly(
      "qd", [](const Motion& o) { return copied(o.qd); }, "shape=(rows, joints) [rad/s | m/s]");
  motion.def_property_readonly(
      "qdd", [](const Motion& o) { return copied(o.qdd); }, "shape=(rows, joints) [rad/s^2 | m/s^2]");
  motion.def_property_readonly(
      "direction", [](const Motion& o) { return copied(o.direction); },
      "shape=(rows, joints) -1 … 1: of the motion, as dry friction knows it");
  motion.def_property_readonly(
      "torque", [](const Motion& o) { return copied(o.torque); },
      "shape=(rows, joints) [Nm | N] that the model predicts in all, friction included");
  motion.def_property_readonly("step", [](const Motion& o) { return o.step; }, "[s] between rows");
  motion.def(
      "column",
      [](const Motion& o, const std::string& name) -> std::optional<Eigen::VectorXd> {
        const auto found = o.columns.find(name);
        return found == o.columns.end() ? std::nullopt : std::optional<Eigen::VectorXd>(found->second);
      },
      py::arg("name"), "shape=(rows,) A further column of the recording; None: it has none of this name.");
  motion.def("__len__", [](const Motion& o) { return o.rows(); });
}

}  // namespace truing::python
