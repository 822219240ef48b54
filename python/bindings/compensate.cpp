// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "convert/options.hpp"
#include "convert/tasks.hpp"
#include "parts.hpp"
#include "tables/compensate.hpp"

namespace truing::python {

namespace {

using CompensatorClass = py::class_<Compensator>;

struct Compensations {
  std::vector<Compensated> items;
  py::ssize_t driven = 0;
};

Solutions solutions_of(const Compensations& all) {
  Solutions out;
  out.driven = all.driven;
  for (const Compensated& one : all.items) out.items.push_back(one.solution);
  return out;
}

void bind_compensated(py::module_& m) {
  auto cls = define_result<Compensated>(m, "Compensated", {"position_before", "rotation_before"});
  cls.def_property_readonly(
      "position_before", [](const Compensated& c) { return ExchangeOfNaN::shown(c.position_before); },
      "[m] how far off the real robot would be if the wanted pose were commanded; None: the nominal robot "
      "cannot reach it.");
  cls.def_property_readonly(
      "rotation_before", [](const Compensated& c) { return ExchangeOfNaN::shown(c.rotation_before); },
      "[rad] likewise.");
  cls.def("__repr__", [](const Compensated& c) { return "Compensated(" + repr(c.solution) + ")"; });
}

void bind_compensations(py::module_& m) {
  py::class_<Compensations> all(m, "Compensations",
                                "Of many targets, in their order: a sequence of `Compensated`, and values as arrays.");
  all.def_property_readonly("solutions", &solutions_of, "Joints to command, as `Solutions`.");
  all.def_property_readonly(
      "T_command",
      [](const Compensations& c) { return frame_column(c.items, [](const Compensated& i) { return i.T_command; }); },
      "shape=(n, 4, 4) [m]: poses to command.");
  define_column(all, "other_configuration", &Compensated::other_configuration,
                "shape=(n,): a controller that is given T_command may choose other joints.");
  define_column(all, "position_before", &Compensated::position_before,
                "shape=(n,) [m]; NaN: the nominal robot cannot reach it.");
  define_column(all, "rotation_before", &Compensated::rotation_before, "shape=(n,) [rad]; NaN likewise.");
  all.def_property_readonly(
      "sigma",
      [](const Compensations& c) { return columns(c.items, 6, [](const Compensated& i) { return i.sigma.data(); }); },
      "shape=(n, 6) [m], [rad]; NaN: no uncertainty was given.");
  define_sequence(all);
  all.def("__repr__", [](const Compensations& c) { return "Compensations(" + std::to_string(c.items.size()) + ")"; });
}

void set_uncertainty(Compensator& c, const std::vector<std::string>& names, const std::vector<double>& values,
                     const Eigen::MatrixXd& covariance) {
  if (names.size() != values.size())
    throw std::invalid_argument("got " + std::to_string(names.size()) + " names, but " + std::to_string(values.size()) +
                                " values");
  std::vector<Parameter> parameters(names.size());
  for (std::size_t k = 0; k < names.size(); ++k) {
    parameters[k].name = names[k];
    parameters[k].value = values[k];
  }
  c.set_uncertainty(parameters, covariance);
}

void bind_making(CompensatorClass& cls) {
  cls.def(py::init([](const Robot& nominal, const Robot& calibrated, const std::optional<CompensateOptions>& options,
                      const std::optional<Conditions>& conditions, std::size_t target) {
            return std::make_unique<Compensator>(nominal, calibrated, options.value_or(CompensateOptions{}),
                                                 conditions.value_or(Conditions{}), target);
          }),
          py::arg("nominal"), py::arg("calibrated"), py::arg("options") = py::none(),
          py::arg("conditions") = py::none(), py::kw_only(), py::arg("target") = 0);
  cls.def("set_uncertainty", &set_uncertainty, py::arg("names"), py::arg("values"), py::arg("covariance"),
          R"(What `identify` found of its parameters: names and values of the fitted ones,
and their covariance, shape=(n, n).

Raises InputError on a parameter that the calibrated robot does not have, or a covariance of another size.)");
  cls.def_property_readonly("nominal", &Compensator::nominal, py::return_value_policy::reference_internal,
                            "The solver of the nominal robot.");
  cls.def_property_readonly("calibrated", &Compensator::calibrated, py::return_value_policy::reference_internal,
                            "The solver of the calibrated robot.");
}

/// One target.
void bind_one(CompensatorClass& cls) {
  cls.def(
      "pose",
      [](const Compensator& c, const Task& given, const std::optional<Eigen::VectorXd>& seed,
         const std::optional<Conditions>& conditions) {
        const Task task = given;
        const Joints from = seed_from(seed, c.nominal());
        const py::gil_scoped_release unlocked;
        return c.pose(task, from, conditions ? &*conditions : nullptr);
      },
      py::arg("task"), py::arg("seed") = py::none(), py::arg("conditions") = py::none(),
      R"(A pose of a program. Raises InputError.

seed: shape=(driven joints,) [rad | m], where the robot comes from; it decides the configuration.)");
  cls.def(
      "joints",
      [](const Compensator& c, const Eigen::VectorXd& program, const std::optional<Eigen::VectorXd>& seed,
         const std::optional<Conditions>& conditions, const std::optional<Task>& like) {
        const Joints wanted = joints_from(program);
        const Joints from = seed ? joints_from(*seed) : wanted;
        const Task task = like.value_or(Task{});
        const py::gil_scoped_release unlocked;
        return c.joints(wanted, from, conditions ? &*conditions : nullptr, task);
      },
      py::arg("program"), py::arg("seed") = py::none(), py::arg("conditions") = py::none(), py::kw_only(),
      py::arg("like") = py::none(),
      R"(A joint position of a program, shape=(driven joints,) [rad | m]: the nominal robot's pose there is the target.

seed: where the robot comes from; None: it stands there already. like: what of that pose is asked for; None: all of
it. Raises InputError.)");
}

/// Many targets.
void bind_batches(CompensatorClass& cls) {
  cls.def(
      "pose_batch",
      [](const Compensator& c, const Tasks& targets, const std::optional<ArrayLike>& given_seeds,
         const GivenConditions& given, const std::optional<Task>& like, int threads, const Callback& callback) {
        const std::vector<Task> tasks = tasks_from(targets, like);
        const std::vector<Joints> seeds = seeds_from(given_seeds, c.nominal());
        const std::vector<Conditions> conditions = conditions_from(given);
        require_one_or_each(seeds.size(), tasks.size(), "seeds");
        if (!conditions.empty()) require_one_or_each(conditions.size(), tasks.size(), "conditions");
        return Compensations{with_progress(callback,
                                           [&](const auto& progress) {
                                             return c.pose_batch(tasks, seeds, conditions, threads, progress);
                                           }),
                             c.nominal().driven_count()};
      },
      py::arg("targets"), py::arg("seeds") = py::none(), py::arg("conditions") = py::none(), py::kw_only(),
      py::arg("like") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
      "One result per target; arguments as of `InverseSolver.solve_batch`. Raises InputError.");
  cls.def(
      "joints_batch",
      [](const Compensator& c, const ArrayLike& given_program, const GivenConditions& given,
         const std::optional<Task>& like, int threads, const Callback& callback) {
        const Task task = like.value_or(Task{});
        const std::vector<Joints> program = joint_rows(given_program, c.nominal().driven_count(), "program");
        const std::vector<Conditions> conditions = conditions_from(given);
        if (!conditions.empty()) require_one_or_each(conditions.size(), program.size(), "conditions");
        return Compensations{with_progress(callback,
                                           [&](const auto& progress) {
                                             return c.joints_batch(program, conditions, threads, progress, task);
                                           }),
                             c.nominal().driven_count()};
      },
      py::arg("program"), py::arg("conditions") = py::none(), py::kw_only(), py::arg("like") = py::none(),
      py::arg("threads") = 0, py::arg("progress") = py::none(),
      R"(One result per row of a program of joint positions, shape=(n, driven joints) [rad | m].

The robot comes from the row before; to the first it does not move. like: what of the nominal robot's poses is asked
for; None: all of them. Raises InputError.)");
}

}  // namespace

void bind_compensate(py::module_& m) {
  define_options<CompensateOptions>(m, "CompensateOptions");
  bind_compensated(m);
  bind_compensations(m);

  CompensatorClass cls(
      m, "Compensator",
      R"(Computes what to command so that the real robot, which `calibrated` describes, goes where it is wanted.

Built once from both robots, then any number of threads may use it. conditions, target: as of `InverseSolver`.
Raises InputError when the robots have different joints, or as InverseSolver does.)");
  bind_making(cls);
  bind_one(cls);
  bind_batches(cls);
  cls.def("__repr__", [](const Compensator& c) {
    return "Compensator('" + c.nominal().robot().name + "' -> '" + c.calibrated().robot().name + "')";
  });
}

}  // namespace truing::python
