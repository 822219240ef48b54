// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <memory>

#include "convert/options.hpp"
#include "convert/tasks.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "tables/inverse.hpp"

namespace pybind11::detail {

/// A window is a pair (lower, upper).
template <>
struct type_caster<truing::Window> {
  PYBIND11_TYPE_CASTER(truing::Window, const_name("tuple[float, float]"));

  bool load(handle source, bool convert) {
    make_caster<std::pair<double, double>> ends;
    if (!ends.load(source, convert)) return false;
    const auto [lower, upper] = cast_op<std::pair<double, double>>(ends);
    value = {lower, upper};
    return true;
  }
  static handle cast(const truing::Window& source, return_value_policy, handle) {
    return make_tuple(source.lower, source.upper).release();
  }
};

}  // namespace pybind11::detail

namespace truing::python {

namespace {

using SolverClass = py::class_<InverseSolver>;

// ---- What is asked for

void bind_task(py::module_& m) {
  const Task usual;
  py::class_<Task> cls(m, "Task", R"(What is wanted of one target; `replace(...)` makes another one.

The wanted pose's own axes say what the angles mean: with the default axes z is the torch, x the direction of
travel.)");
  cls.def(py::init([](const Eigen::Isometry3d& T, TaskKind kind, const Eigen::Vector3d& axis,
                      const Eigen::Vector3d& travel, const Window& roll, const std::optional<double>& preferred_roll,
                      const Window& lead, const Window& work, const Eigen::Vector3d& retreat, double longest_retreat) {
            Task t;
            t.T_measurement_target = T;
            t.kind = kind;
            t.axis = axis;
            t.travel = travel;
            t.roll = roll;
            t.preferred_roll = preferred_roll.value_or(std::numeric_limits<double>::quiet_NaN());
            t.lead = lead;
            t.work = work;
            t.retreat = retreat;
            t.longest_retreat = longest_retreat;
            return t;
          }),
          py::arg("T_measurement_target"), py::kw_only(), py::arg("kind") = usual.kind,
          py::arg("axis") = array_from(usual.axis), py::arg("travel") = array_from(usual.travel),
          py::arg_v("roll", usual.roll, "(-math.inf, math.inf)"), py::arg("preferred_roll") = py::none(),
          py::arg("lead") = usual.lead, py::arg("work") = usual.work, py::arg("retreat") = array_from(usual.retreat),
          py::arg("longest_retreat") = usual.longest_retreat);
  define_read_only_attributes(cls, {"preferred_roll"});
  cls.def_property_readonly(
      "preferred_roll", [](const Task& t) { return ExchangeOfNaN::shown(t.preferred_roll); },
      "[rad] the roll is as near to it as can be; None: any.");
  cls.def("__repr__", [](const Task& t) {
    return std::string("Task(") + word(t.kind) + " at " + text(Eigen::Vector3d(t.T_measurement_target.translation())) +
           " m)";
  });
  define_value(cls, {"T_measurement_target", "kind", "axis", "travel", "roll", "preferred_roll", "lead", "work",
                     "retreat", "longest_retreat"});
}

// ---- Solutions

void bind_solution(py::module_& m) {
  auto cls = define_result<Solution>(m, "Solution", {"joints", "contact"});
  cls.def_property_readonly(
      "joints", [](const Solution& s) { return array_of(s.joints); },
      "shape=(driven joints,) [rad | m]: readings; of a failure the nearest that was found, within limits.");
  cls.def_property_readonly("reached", &Solution::reached, "Whether the task is met.");
  cls.def_property_readonly(
      "contact",
      [](const Solution& s) {
        return s.contact[0] < 0 ? std::optional<std::pair<int, int>>() : std::make_pair(s.contact[0], s.contact[1]);
      },
      "With a scene the nearest pair: index of a capsule; of another one, or number of capsules + index of an "
      "obstacle.");
  cls.def("__repr__", [](const Solution& s) { return repr(s); });
}

std::string text_of(const Solutions& all) {
  std::size_t reached = 0;
  for (const Solution& solution : all.items) reached += solution.reached();
  return "Solutions(" + std::to_string(reached) + " of " + std::to_string(all.items.size()) + " reached)";
}

void bind_solutions(py::module_& m) {
  py::class_<Solutions> all(m, "Solutions",
                            "Solutions for many targets, in their order: a sequence of `Solution`, and their values "
                            "as arrays.");
  all.def_property_readonly(
      "joints",
      [](const Solutions& s) { return columns(s.items, s.driven, [](const Solution& i) { return i.joints.data(); }); },
      "shape=(n, driven joints) [rad | m]; of a failure the nearest that was found, within limits.");
  all.def_property_readonly(
      "reached",
      [](const Solutions& s) { return column<bool>(s.items, [](const Solution& i) { return i.reached(); }); },
      "shape=(n,): whether the task is met.");
  all.def_property_readonly(
      "reasons", [](const Solutions& s) { return tuple_column(s.items, [](const Solution& i) { return i.reason; }); },
      "Of each, as `Solution.reason`.");
  define_column(all, "position_error", &Solution::position_error, "shape=(n,) [m]");
  define_column(all, "rotation_error", &Solution::rotation_error, "shape=(n,) [rad]");
  define_column(all, "roll", &Solution::roll, "shape=(n,) [rad]");
  define_column(all, "miss", &Solution::miss, "shape=(n,) [m | rad]");
  define_column(all, "excess", &Solution::excess, "shape=(n,) [rad | m]");
  define_column(all, "contact_distance", &Solution::contact_distance, "shape=(n,) [m]");
  define_column(all, "retreat", &Solution::retreat, "shape=(n,) [m]");
  define_column(all, "branch", &Solution::branch, "shape=(n,): -1: by descent.");
  define_column(all, "iterations", &Solution::iterations, "shape=(n,)");
  define_column(all, "joint", &Solution::joint, "shape=(n,): whose limit is in the way; -1: none.");
  all.def_property_readonly(
      "direction",
      [](const Solutions& s) { return columns(s.items, 3, [](const Solution& i) { return i.direction.data(); }); },
      "shape=(n, 3)");
  define_sequence(all);
  all.def("__repr__", [](const Solutions& s) { return text_of(s); });
}

void bind_branches(py::module_& m) {
  py::class_<Branches> cls(m, "Branches", Fields<Branches>::summary);
  cls.def_property_readonly(
      "solutions",
      [](const Branches& b) {
        return tuple_of(std::vector<Solution>(b.solution.begin(), b.solution.begin() + b.count));
      },
      "Those within the joint limits.");
  cls.def_readonly("beyond_limits", &Branches::beyond_limits, "How many further ones are outside the limits.");
  cls.def("__len__", [](const Branches& b) { return b.count; });
  cls.def("__repr__", [](const Branches& b) {
    return "Branches(" + std::to_string(b.count) + ", and " + std::to_string(b.beyond_limits) + " beyond limits)";
  });
}

// ---- Solver

struct FoundPath {
  Solutions solutions;
  std::vector<PathGap> gaps;
  double longest_turn, longest_slide;
};

void bind_path(py::module_& m) {
  define_options<PathOptions>(m, "PathOptions");

  auto gap = define_result<PathGap>(m, "PathGap");
  gap.def("__repr__", [](const PathGap& g) { return "PathGap(after " + std::to_string(g.start) + ")"; });

  py::class_<FoundPath> path(m, "JointPath", "Joints along a chain of targets.");
  path.def_readonly("solutions", &FoundPath::solutions, "One per target.");
  path.def_property_readonly(
      "gaps", [](const FoundPath& p) { return tuple_of(p.gaps); }, "Empty: every step is within the bounds.");
  path.def_readonly("longest_turn", &FoundPath::longest_turn,
                    "[rad] the longest step of a revolute joint that is no gap.");
  path.def_readonly("longest_slide", &FoundPath::longest_slide, "[m] the same of a prismatic joint.");
  path.def_property_readonly("continuous", [](const FoundPath& p) { return p.gaps.empty(); }, "No gaps.");
  path.def("__repr__", [](const FoundPath& p) {
    return "JointPath(" + std::to_string(p.solutions.items.size()) + " targets, " + std::to_string(p.gaps.size()) +
           " gaps)";
  });
}

void bind_solver_attributes(SolverClass& cls) {
  cls.def(py::init([](const Robot& robot, const std::optional<InverseOptions>& options,
                      const std::optional<Conditions>& conditions, std::size_t target) {
            return std::make_unique<InverseSolver>(robot, options.value_or(InverseOptions{}),
                                                   conditions.value_or(Conditions{}), target);
          }),
          py::arg("robot"), py::arg("options") = py::none(), py::arg("conditions") = py::none(), py::kw_only(),
          py::arg("target") = 0);
  cls.def_property_readonly("robot", [](const InverseSolver& s) { return Robot(s.robot()); }, "A copy of the robot.");
  cls.def_property_readonly(
      "options", [](const InverseSolver& s) { return InverseOptions(s.options()); }, "A copy of the options.");
  cls.def_property_readonly("driven_count", &InverseSolver::driven_count, "Number of joints that have a reading.");
  cls.def_property_readonly("closed_form", &InverseSolver::closed_form,
                            "Which closed form the geometry has, once axes that nearly meet are taken to meet.");
  cls.def(
      "middle", [](const InverseSolver& s) { return array_of(s.middle()); },
      "shape=(driven joints,) [rad | m]: the middle of every joint's range, or 0.");
  cls.def(
      "forward",
      [](const InverseSolver& s, const Eigen::VectorXd& joints, const std::optional<Conditions>& conditions) {
        return s.forward(joints_from(joints), conditions ? &*conditions : nullptr);
      },
      py::arg("joints"), py::arg("conditions") = py::none(),
      R"(Where the target is, shape=(4, 4) [m], effects included: what `predict` says. Raises InputError.)");
}

/// One target.
void bind_solve(SolverClass& cls) {
  cls.def(
      "solve",
      [](const InverseSolver& s, const Task& given, const std::optional<Eigen::VectorXd>& seed,
         const std::optional<Conditions>& conditions) {
        const Task task = given;
        const Joints from = seed_from(seed, s);
        const py::gil_scoped_release unlocked;
        return s.solve(task, from, conditions ? &*conditions : nullptr);
      },
      py::arg("task"), py::arg("seed") = py::none(), py::arg("conditions") = py::none(),
      R"(One solution. What cannot be reached is told in the result.

seed: shape=(driven joints,) [rad | m]. Raises InputError on a seed of the wrong size and on values that are not
finite.)");
  cls.def(
      "branches",
      [](const InverseSolver& s, const Task& given, const std::optional<Eigen::VectorXd>& seed,
         const std::optional<Conditions>& conditions) {
        const Task task = given;
        const Joints from = seed_from(seed, s);
        Branches found;
        const py::gil_scoped_release unlocked;
        s.branches(task, from, &found, conditions ? &*conditions : nullptr);
        return found;
      },
      py::arg("task"), py::arg("seed") = py::none(), py::arg("conditions") = py::none(),
      R"(Every solution for a full pose; prismatic joints before the arm stay at the seed's.

Without a closed form what descents from many seeds found, not known to be all. Raises InputError.)");
  cls.def(
      "follow",
      [](const InverseSolver& s, const Task& given, const Eigen::VectorXd& previous,
         const std::optional<Conditions>& conditions) {
        const Task task = given;
        const Joints from = joints_from(previous);
        const py::gil_scoped_release unlocked;
        return s.follow(task, from, conditions ? &*conditions : nullptr);
      },
      py::arg("task"), py::arg("previous"), py::arg("conditions") = py::none(),
      R"(The next of a chain of poses that lie close together: Newton from `previous`, shape=(driven joints,) [rad | m].

It stays on its branch; where it cannot, the reason says why, and nothing else is tried. Raises InputError.)");
}

/// Many targets.
void bind_batches(SolverClass& cls) {
  cls.def(
      "solve_batch",
      [](const InverseSolver& s, const Tasks& targets, const std::optional<ArrayLike>& given_seeds,
         const GivenConditions& given, const std::optional<Task>& like, int threads, const Callback& callback) {
        const std::vector<Task> tasks = tasks_from(targets, like);
        const std::vector<Joints> seeds = seeds_from(given_seeds, s);
        const std::vector<Conditions> conditions = conditions_from(given);
        return Solutions{with_progress(callback,
                                       [&](const auto& progress) {
                                         return s.solve_batch(tasks, seeds, conditions, threads, progress);
                                       }),
                         s.driven_count()};
      },
      py::arg("targets"), py::arg("seeds") = py::none(), py::arg("conditions") = py::none(), py::kw_only(),
      py::arg("like") = py::none(), py::arg("threads") = 0, py::arg("progress") = py::none(),
      R"(One solution per target, the same for any number of threads (0: as many as the machine has).

targets: tasks, or shape=(n, 4, 4) [m] poses, each a task like `like` (None: a full pose).
seeds: shape=(driven joints,) or (n, driven joints) [rad | m]. conditions: one, or one per target.
progress: called with targets done, now and then; what it raises stops the work. Raises InputError.)");
  cls.def(
      "path",
      [](const InverseSolver& s, const Tasks& targets, const std::optional<Eigen::VectorXd>& seed,
         const std::optional<PathOptions>& given, const std::optional<Conditions>& conditions,
         const std::optional<Task>& like, const Callback& callback) {
        const std::vector<Task> tasks = tasks_from(targets, like);
        const Joints from = seed_from(seed, s);
        const PathOptions options = given.value_or(PathOptions{});
        Path path = with_progress(callback, [&](const auto& progress) {
          return s.path(tasks, from, options, conditions ? &*conditions : nullptr, progress);
        });
        return FoundPath{
            {std::move(path.solutions), s.driven_count()}, std::move(path.gaps), path.longest_turn, path.longest_slide};
      },
      py::arg("targets"), py::arg("seed") = py::none(), py::arg("options") = py::none(),
      py::arg("conditions") = py::none(), py::kw_only(), py::arg("like") = py::none(), py::arg("progress") = py::none(),
      R"(A path through the targets in steps as short as can be; where none keeps within the bounds, the gap is told.

targets, like, progress: as in `solve_batch`. seed: where the robot comes from. Raises InputError.)");
}

}  // namespace

void bind_inverse(py::module_& m) {
  bind_task(m);
  define_options<Conditions>(m, "Conditions");
  define_options<InverseOptions>(m, "InverseOptions");
  bind_solution(m);
  bind_solutions(m);
  bind_branches(m);
  bind_path(m);

  SolverClass cls(m, "InverseSolver",
                  R"(A robot made ready for inverse kinematics, nominal or calibrated, effects included.

Built once it does not change, and any number of threads may use it. Where a seed is asked for, None is the middle of
every joint's range.
conditions: those of every solve that names no others; they also say which inputs there are. target: its index in
`robot.targets`. Raises InputError when robot, target or options cannot be used, or effects lack an input.)");
  bind_solver_attributes(cls);
  bind_solve(cls);
  bind_batches(cls);
  cls.def("describe", &InverseSolver::describe, py::arg("solution"),
          "In a sentence: 'J4 would have to go 0.12 rad beyond its limit'.");
  cls.def("__repr__", [](const InverseSolver& s) {
    return "InverseSolver('" + s.robot().name + "', " + std::to_string(s.driven_count()) + " joints, closed form " +
           word(s.closed_form()) + ")";
  });
}

}  // namespace truing::python
