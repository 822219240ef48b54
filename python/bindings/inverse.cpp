// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <variant>

#include "casters.hpp"

namespace truing::python {

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Callback = std::optional<py::typing::Callable<py::object(std::size_t)>>;

std::optional<double> known(double value) { return std::isnan(value) ? std::nullopt : std::optional<double>(value); }

double or_nan(const std::optional<double>& value) { return value.value_or(std::numeric_limits<double>::quiet_NaN()); }

// ---- Joints, tasks and conditions out of Python

Joints joints_from(const Eigen::Ref<const Eigen::VectorXd>& values) {
  if (values.size() > kMaxDrivenJoints)
    throw std::invalid_argument("got " + std::to_string(values.size()) + " joint readings, at most " +
                                std::to_string(kMaxDrivenJoints) + " are possible");
  return values;
}

/// One set of readings, shape (driven,), or one per row, shape (n, driven).
std::vector<Joints> joint_rows(const ArrayLike& given, int driven, const std::string& name) {
  const Array array = Array::ensure(given);
  const py::ssize_t axis = array ? array.ndim() - 1 : -1;
  if (axis < 0 || axis > 1 || array.shape(axis) != driven) {
    PyErr_Clear();
    const std::string wanted = std::to_string(driven);
    std::string found;
    for (py::ssize_t k = 0; k <= axis; ++k) found += (k ? ", " : "") + std::to_string(array.shape(k));
    throw std::invalid_argument(name + " must have shape (" + wanted + ",) or (n, " + wanted + "): " + wanted +
                                " driven joints; found (" + found + ")");
  }
  std::vector<Joints> rows;
  const py::ssize_t count = axis == 0 ? 1 : array.shape(0);
  for (py::ssize_t k = 0; k < count; ++k)
    rows.push_back(joints_from(Eigen::Map<const Eigen::VectorXd>(array.data() + k * driven, driven)));
  return rows;
}

std::vector<Joints> seeds_from(const std::optional<ArrayLike>& given, const InverseSolver& solver) {
  return given ? joint_rows(*given, solver.driven_count(), "seeds") : std::vector<Joints>{solver.middle()};
}

Joints seed_from(const std::optional<Eigen::VectorXd>& given, const InverseSolver& solver) {
  return given ? joints_from(*given) : solver.middle();
}

using Tasks = std::variant<std::vector<Task>, FrameArray>;

/// Tasks as they are, or one like `like` for each frame.
std::vector<Task> tasks_from(const Tasks& given, const std::optional<Task>& like) {
  if (const auto* tasks = std::get_if<std::vector<Task>>(&given)) return *tasks;
  const std::vector<Eigen::Isometry3d> frames = frames_from(std::get<FrameArray>(given), "targets");
  std::vector<Task> tasks(frames.size(), like.value_or(Task{}));
  for (std::size_t k = 0; k < frames.size(); ++k) tasks[k].T_measurement_target = frames[k];
  return tasks;
}

using GivenConditions = std::optional<std::variant<Conditions, std::vector<Conditions>>>;

std::vector<Conditions> conditions_from(const GivenConditions& given) {
  if (!given) return {};
  if (const auto* one = std::get_if<Conditions>(&*given)) return {*one};
  return std::get<std::vector<Conditions>>(*given);
}

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

void require_one_or_each(std::size_t found, std::size_t count, const std::string& name) {
  if (found != 1 && found != count)
    throw std::invalid_argument("got " + std::to_string(found) + " " + name + " for " + std::to_string(count) +
                                ": give one, or one for each");
}

// ---- Results as arrays

struct Solutions {
  std::vector<Solution> items;
  py::ssize_t driven = 0;
};

struct Compensations {
  std::vector<Compensated> items;
  py::ssize_t driven = 0;
};

py::array_t<double> array_of(const Joints& joints) {
  return read_only(py::array_t<double>(joints.size(), joints.data()));
}

/// One number of each.
template <class Value, class Item, class Get>
py::array_t<Value> column(const std::vector<Item>& items, const Get& get) {
  py::array_t<Value> out(static_cast<py::ssize_t>(items.size()));
  for (std::size_t k = 0; k < items.size(); ++k) out.mutable_data()[k] = static_cast<Value>(get(items[k]));
  return out;
}

/// `width` numbers of each, as the rows of an array.
template <class Item, class Get>
py::array_t<double> block(const std::vector<Item>& items, py::ssize_t width, const Get& get) {
  py::array_t<double> out({static_cast<py::ssize_t>(items.size()), width});
  for (std::size_t k = 0; k < items.size(); ++k) {
    const auto values = get(items[k]);
    for (py::ssize_t j = 0; j < width; ++j) out.mutable_data()[static_cast<py::ssize_t>(k) * width + j] = values[j];
  }
  return out;
}

template <class Item>
const Item& at(const std::vector<Item>& items, py::ssize_t k) {
  const auto count = static_cast<py::ssize_t>(items.size());
  if (k < -count || k >= count) throw py::index_error();
  return items[static_cast<std::size_t>(k < 0 ? k + count : k)];
}

std::string repr(const Solution& s) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, "Solution('%s', %.3g mm, %.3g mrad)", word(s.reason), 1e3 * s.position_error,
                1e3 * s.rotation_error);
  return buffer;
}

void bind_solution(py::module_& m) {
  py::class_<Solution> cls(m, "Solution", "One answer of inverse kinematics.");
  cls.def_property_readonly(
      "joints", [](const Solution& s) { return array_of(s.joints); },
      "shape=(driven joints,) [rad | m]: readings; of a failure the nearest that was found, within limits.");
  cls.def_readonly("reason", &Solution::reason, R"(What came of it.

'reached'; 'retreated': the target was moved by `retreat`, and is reached there; 'collision': it could be reached, but a
`contact` is in the way; 'out_of_reach': it stays away by `miss` along `direction`, limits aside; 'limit': that of `joint` is in
the way, by `excess`; 'singular': the tip cannot move along `direction`.)");
  cls.def_property_readonly("reached", &Solution::reached, "Whether the task is met.");
  cls.def_readonly("position_error", &Solution::position_error, "[m] of the task, from a second forward computation.");
  cls.def_readonly("rotation_error", &Solution::rotation_error,
                   "[rad] of the task: what of the orientation is asked for.");
  cls.def_readonly("roll", &Solution::roll, "[rad] torch: the turn about the axis from the wanted frame.");
  cls.def_readonly("branch", &Solution::branch, "Which of the closed form's branches it came from; -1: by descent.");
  cls.def_readonly("iterations", &Solution::iterations, "Of all descents together.");
  cls.def_readonly("miss", &Solution::miss,
                   "Of a failure: [m], or [rad] when the position is reached and the orientation is not.");
  cls.def_property_readonly(
      "direction", [](const Solution& s) { return array_from(s.direction); },
      "Of a failure, shape=(3,): from the nearest to the wanted, in the measurement frame.");
  cls.def_readonly("joint", &Solution::joint,
                   "Driven joint whose limit stands in the way, after them passive ones with limits; -1: none.");
  cls.def_readonly("excess", &Solution::excess, "[rad | m] how far beyond its limit it would have to go.");
  cls.def_property_readonly(
      "contact",
      [](const Solution& s) {
        return s.contact[0] < 0 ? std::optional<std::pair<int, int>>() : std::make_pair(s.contact[0], s.contact[1]);
      },
      "With a scene the nearest pair: index of a capsule; of another one, or number of capsules + index of an "
      "obstacle.");
  cls.def_readonly("contact_distance", &Solution::contact_distance,
                   "[m] between their surfaces; negative: so deep. Infinite without a scene.");
  cls.def_readonly("retreat", &Solution::retreat, "[m] how far the target was moved along `Task.retreat`.");
  cls.def("__repr__", [](const Solution& s) { return repr(s); });

  py::class_<Solutions> all(m, "Solutions",
                            "Answers for many targets, in their order: a sequence of `Solution`, and their values as "
                            "arrays.");
  all.def_property_readonly(
      "joints",
      [](const Solutions& s) { return block(s.items, s.driven, [](const Solution& i) { return i.joints.data(); }); },
      "shape=(n, driven joints) [rad | m]; of a failure the nearest that was found, within limits.");
  all.def_property_readonly(
      "reached",
      [](const Solutions& s) { return column<bool>(s.items, [](const Solution& i) { return i.reached(); }); },
      "shape=(n,): whether the task is met.");
  all.def_property_readonly(
      "reasons",
      [](const Solutions& s) {
        std::vector<Reason> reasons;
        for (const Solution& i : s.items) reasons.push_back(i.reason);
        return tuple_of(reasons);
      },
      "Of each, as `Solution.reason`.");
  const auto number = [&all](const char* name, double Solution::* member, const char* doc) {
    all.def_property_readonly(
        name,
        [member](const Solutions& s) {
          return column<double>(s.items, [member](const Solution& i) { return i.*member; });
        },
        doc);
  };
  number("position_error", &Solution::position_error, "shape=(n,) [m]");
  number("rotation_error", &Solution::rotation_error, "shape=(n,) [rad]");
  number("roll", &Solution::roll, "shape=(n,) [rad]");
  number("miss", &Solution::miss, "shape=(n,) [m | rad]");
  number("excess", &Solution::excess, "shape=(n,) [rad | m]");
  number("contact_distance", &Solution::contact_distance, "shape=(n,) [m]");
  number("retreat", &Solution::retreat, "shape=(n,) [m]");
  const auto whole = [&all](const char* name, int Solution::* member, const char* doc) {
    all.def_property_readonly(
        name,
        [member](const Solutions& s) {
          return column<std::int32_t>(s.items, [member](const Solution& i) { return i.*member; });
        },
        doc);
  };
  whole("branch", &Solution::branch, "shape=(n,): -1: by descent.");
  whole("iterations", &Solution::iterations, "shape=(n,)");
  whole("joint", &Solution::joint, "shape=(n,): whose limit stands in the way; -1: none.");
  all.def_property_readonly(
      "direction",
      [](const Solutions& s) { return block(s.items, 3, [](const Solution& i) { return i.direction.data(); }); },
      "shape=(n, 3)");
  all.def("__len__", [](const Solutions& s) { return s.items.size(); });
  all.def("__getitem__", [](const Solutions& s, py::ssize_t k) { return at(s.items, k); }, py::arg("k"));
  all.def(
      "__iter__", [](const Solutions& s) { return py::make_iterator(s.items.begin(), s.items.end()); },
      py::keep_alive<0, 1>());
  all.def("__repr__", [](const Solutions& s) {
    std::size_t reached = 0;
    for (const Solution& i : s.items) reached += i.reached();
    return "Solutions(" + std::to_string(reached) + " of " + std::to_string(s.items.size()) + " reached)";
  });

  py::class_<Branches> branches(m, "Branches", "Answers that differ in configuration.");
  branches.def_property_readonly(
      "solutions",
      [](const Branches& b) {
        return tuple_of(std::vector<Solution>(b.solution.begin(), b.solution.begin() + b.count));
      },
      "Those within the joint limits.");
  branches.def_readonly("beyond_limits", &Branches::beyond_limits, "How many further ones are outside the limits.");
  branches.def("__len__", [](const Branches& b) { return b.count; });
  branches.def("__repr__", [](const Branches& b) {
    return "Branches(" + std::to_string(b.count) + ", and " + std::to_string(b.beyond_limits) + " beyond limits)";
  });
}

// ---- What is asked for

void bind_task(py::module_& m) {
  const Task usual;
  py::class_<Task> cls(m, "Task", R"(What is wanted of one target. `replace(...)` makes another one.

T_measurement_target: shape=(4, 4) [m] the wanted pose. Its own axes say what the angles mean.
kind: 'pose' (position and orientation), 'torch' (position and the direction of `axis`; roll about it is free) or 'point'.
axis: shape=(3,) the tool's axis in the target's frame, unit vector. travel: shape=(3,) the direction that lead is measured in.
roll: (lower, upper) [rad] of a torch, the turn about `axis` that takes the wanted frame to the reached one.
preferred_roll: [rad] as near to it as can be; None: any.
lead, work: (lower, upper) [rad] how far the axis may lean towards `travel` and towards axis x travel.
retreat: shape=(3,) unit vector in the wanted frame: where every way to it collides, the target is moved along it by the least that
frees it, and by no more than longest_retreat [m]; 0: not at all.)");
  cls.def(py::init([](const Eigen::Isometry3d& T, TaskKind kind, const Eigen::Vector3d& axis,
                      const Eigen::Vector3d& travel, const Window& roll, const std::optional<double>& preferred_roll,
                      const Window& lead, const Window& work, const Eigen::Vector3d& retreat, double longest_retreat) {
            Task t;
            t.T_measurement_target = T;
            t.kind = kind;
            t.axis = axis;
            t.travel = travel;
            t.roll = roll;
            t.preferred_roll = or_nan(preferred_roll);
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
  cls.def_readonly("T_measurement_target", &Task::T_measurement_target, "shape=(4, 4) [m]");
  cls.def_readonly("kind", &Task::kind, "'pose', 'torch' or 'point'.");
  cls.def_property_readonly("axis", [](const Task& t) { return array_from(t.axis); }, "shape=(3,)");
  cls.def_property_readonly("travel", [](const Task& t) { return array_from(t.travel); }, "shape=(3,)");
  cls.def_readonly("roll", &Task::roll, "(lower, upper) [rad]");
  cls.def_property_readonly("preferred_roll", [](const Task& t) { return known(t.preferred_roll); }, "[rad] or None.");
  cls.def_readonly("lead", &Task::lead, "(lower, upper) [rad]");
  cls.def_readonly("work", &Task::work, "(lower, upper) [rad]");
  cls.def_property_readonly("retreat", [](const Task& t) { return array_from(t.retreat); }, "shape=(3,)");
  cls.def_readonly("longest_retreat", &Task::longest_retreat, "[m]");
  cls.def("__repr__", [](const Task& t) {
    const Eigen::Vector3d p = t.T_measurement_target.translation();
    return std::string("Task(") + word(t.kind) + " at " + text(p.x()) + " " + text(p.y()) + " " + text(p.z()) + " m)";
  });
  define_value(cls, {"T_measurement_target", "kind", "axis", "travel", "roll", "preferred_roll", "lead", "work",
                     "retreat", "longest_retreat"});

  py::class_<Conditions> conditions(
      m, "Conditions",
      R"(What acts on the robot besides its joints; only what its effects ask for is looked at.

direction: approach direction of every driven joint, -1, 0 or 1; empty: the way from the seed to the answer.
payload: [kg] at the tool. temperature: [deg C]. time: [s]. joint_speed: of every driven joint [rad/s | m/s].
covariates: what else the effects look at, by column name.)");
  conditions.def(
      py::init([](std::vector<int> direction, double payload, const std::optional<double>& temperature,
                  const std::optional<double>& time, std::vector<double> joint_speed,
                  std::map<std::string, double> covariates) {
        return Conditions{std::move(direction), payload, or_nan(temperature), or_nan(time), std::move(joint_speed),
                          std::move(covariates)};
      }),
      py::kw_only(), py::arg("direction") = std::vector<int>{}, py::arg("payload") = 0.0,
      py::arg("temperature") = py::none(), py::arg("time") = py::none(), py::arg("joint_speed") = std::vector<double>{},
      py::arg("covariates") = std::map<std::string, double>{});
  conditions.def_property_readonly(
      "direction", [](const Conditions& c) { return tuple_of(c.direction); }, "-1, 0 or 1 each.");
  conditions.def_readonly("payload", &Conditions::payload, "[kg]");
  conditions.def_property_readonly(
      "temperature", [](const Conditions& c) { return known(c.temperature); }, "[deg C] or None.");
  conditions.def_property_readonly("time", [](const Conditions& c) { return known(c.time); }, "[s] or None.");
  conditions.def_property_readonly(
      "joint_speed", [](const Conditions& c) { return tuple_of(c.joint_speed); }, "[rad/s | m/s]");
  conditions.def_property_readonly(
      "covariates", [](const Conditions& c) { return mapping_of(c.covariates); }, "By column name.");
  conditions.def("__repr__", [](const Conditions& c) { return "Conditions(payload " + text(c.payload) + " kg)"; });
  define_value(conditions, {"direction", "payload", "temperature", "time", "joint_speed", "covariates"});
}

// ---- Scene

using NamePairs = std::vector<std::pair<std::string, std::string>>;

void bind_scene(py::module_& m) {
  const Obstacle usual;
  py::class_<Obstacle> obstacle(m, "Obstacle", R"(Something that stands still.

shape: 'sphere' (radius about the frame's origin), 'capsule' (radius about the segment from the origin to (0, 0, size[2])) or 'box'
(`size` along the frame's axes, its centre at the origin).
T_measurement_shape: shape=(4, 4) [m]. size: shape=(3,) [m] whole lengths. radius: [m].)");
  obstacle.def(py::init([](std::string name, Shape shape, const Eigen::Isometry3d& T, const Eigen::Vector3d& size,
                           double radius) { return Obstacle{std::move(name), shape, T, size, radius}; }),
               py::arg("name"), py::kw_only(), py::arg("shape") = usual.shape,
               py::arg("T_measurement_shape") = usual.T_measurement_shape, py::arg("size") = array_from(usual.size),
               py::arg("radius") = usual.radius);
  obstacle.def_readonly("name", &Obstacle::name, "As answers call it.");
  obstacle.def_readonly("shape", &Obstacle::shape, "'sphere', 'capsule' or 'box'.");
  obstacle.def_readonly("T_measurement_shape", &Obstacle::T_measurement_shape, "shape=(4, 4) [m]");
  obstacle.def_property_readonly("size", [](const Obstacle& o) { return array_from(o.size); }, "shape=(3,) [m]");
  obstacle.def_readonly("radius", &Obstacle::radius, "[m]");
  obstacle.def("__repr__",
               [](const Obstacle& o) { return "Obstacle('" + o.name + "', " + std::string(word(o.shape)) + ")"; });
  define_value(obstacle, {"name", "shape", "T_measurement_shape", "size", "radius"});

  py::class_<LinkCapsule> capsule(m, "LinkCapsule", R"(Part of a link: `radius` about the segment between two points.

link: the joint whose link carries it, in the frame after it; 'base': the base frame; 'tool': the target's frame.
start, end: shape=(3,) [m]. radius: [m].)");
  capsule.def(py::init([](std::string name, std::string link, const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                          double radius) { return LinkCapsule{std::move(name), std::move(link), start, end, radius}; }),
              py::arg("name"), py::kw_only(), py::arg("link"), py::arg("start"), py::arg("end"), py::arg("radius"));
  capsule.def_readonly("name", &LinkCapsule::name, "As answers call it.");
  capsule.def_readonly("link", &LinkCapsule::link, "Name of a joint, 'base' or 'tool'.");
  capsule.def_property_readonly("start", [](const LinkCapsule& c) { return array_from(c.from); }, "shape=(3,) [m]");
  capsule.def_property_readonly("end", [](const LinkCapsule& c) { return array_from(c.to); }, "shape=(3,) [m]");
  capsule.def_readonly("radius", &LinkCapsule::radius, "[m]");
  capsule.def("__repr__", [](const LinkCapsule& c) { return "LinkCapsule('" + c.name + "' on '" + c.link + "')"; });
  define_value(capsule, {"name", "link", "start", "end", "radius"});

  py::class_<Scene> scene(m, "Scene", R"(What the robot must not touch, and what of it must not.

clearance: [m] what comes nearer than this is a collision.
ignored: pairs of names that are not looked at. Capsules of one link and of neighbouring links never are, nor is the base's with
what stands still.)");
  scene.def(py::init([](std::vector<Obstacle> obstacles, std::vector<LinkCapsule> capsules, double clearance,
                        NamePairs ignored) {
              return Scene{std::move(obstacles), std::move(capsules), clearance, std::move(ignored)};
            }),
            py::kw_only(), py::arg("obstacles") = std::vector<Obstacle>{},
            py::arg("capsules") = std::vector<LinkCapsule>{}, py::arg("clearance") = 0.0,
            py::arg("ignored") = NamePairs{});
  scene.def_property_readonly("obstacles", [](const Scene& s) { return tuple_of(s.obstacles); }, "What stands still.");
  scene.def_property_readonly(
      "capsules", [](const Scene& s) { return tuple_of(s.capsules); }, "What of the robot must not touch.");
  scene.def_readonly("clearance", &Scene::clearance, "[m]");
  scene.def_property_readonly("ignored", [](const Scene& s) { return tuple_of(s.ignored); }, "Pairs of names.");
  scene.def("__repr__", [](const Scene& s) {
    return "Scene(" + std::to_string(s.obstacles.size()) + " obstacles, " + std::to_string(s.capsules.size()) +
           " capsules)";
  });
  define_value(scene, {"obstacles", "capsules", "clearance", "ignored"});

  py::class_<Contact> contact(m, "Contact", "The pair that collides most deeply, or comes nearest.");
  contact.def_readonly("first", &Contact::first, "A capsule.");
  contact.def_readonly("second", &Contact::second, "A capsule or an obstacle.");
  contact.def_readonly("distance", &Contact::distance,
                       "[m] between their surfaces; negative: how deep they are in each other.");
  contact.def("__repr__", [](const Contact& c) {
    return "Contact('" + c.first + "', '" + c.second + "', " + text(1e3 * c.distance) + " mm)";
  });

  m.def("validate_scene", py::overload_cast<const Scene&, const Robot&>(&validate), py::arg("scene"), py::arg("robot"),
        "Raises InputError on unknown links, empty or equal names, sizes that are not positive, frames that are not "
        "rigid.");
  m.def("nearest_contact", &nearest_contact, py::arg("scene"), py::arg("robot"), py::arg("joints"),
        py::arg("target") = 0,
        R"(The nearest pair at these readings, effects left out; without names when there is none to look at.

joints: shape=(driven joints,) [rad | m]. target: its index in `robot.targets`. Raises InputError.)");
}

// ---- Options

void bind_options(py::module_& m) {
  const InverseOptions usual;
  py::class_<InverseOptions> cls(m, "InverseOptions", "How `InverseSolver` works; see the attributes.");
  cls.def(py::init([](double position_tolerance, double rotation_tolerance, Choose choose, int max_iterations,
                      int max_restarts, double wrist_tolerance, double parallel_tolerance, Scene scene) {
            return InverseOptions{position_tolerance, rotation_tolerance, choose,          max_iterations, max_restarts,
                                  wrist_tolerance,    parallel_tolerance, std::move(scene)};
          }),
          py::kw_only(), py::arg("position_tolerance") = usual.position_tolerance,
          py::arg("rotation_tolerance") = usual.rotation_tolerance, py::arg("choose") = usual.choose,
          py::arg("max_iterations") = usual.max_iterations, py::arg("max_restarts") = usual.max_restarts,
          py::arg("wrist_tolerance") = usual.wrist_tolerance, py::arg("parallel_tolerance") = usual.parallel_tolerance,
          py::arg_v("scene", usual.scene, "Scene()"));
  cls.def_readwrite("position_tolerance", &InverseOptions::position_tolerance,
                    "[m] a solution misses the task by no more.");
  cls.def_readwrite("rotation_tolerance", &InverseOptions::rotation_tolerance, "[rad]");
  cls.def_readwrite("choose", &InverseOptions::choose, R"(Which of several answers.

'nearest' to the seed; 'limits_margin': furthest from the joint limits; 'manipulability': furthest from singular; 'rail_travel':
least way of the prismatic joints from the seed, then nearest.)");
  cls.def_readwrite("max_iterations", &InverseOptions::max_iterations, "Of one descent.");
  cls.def_readwrite("max_restarts", &InverseOptions::max_restarts,
                    "Descents from other seeds before a target is given up.");
  cls.def_readwrite("wrist_tolerance", &InverseOptions::wrist_tolerance,
                    "[m] axes that miss each other by no more are taken to meet, for the seeds alone.");
  cls.def_readwrite("parallel_tolerance", &InverseOptions::parallel_tolerance,
                    "[rad] axes nearer to parallel than this are taken to be, for the seeds alone.");
  cls.def_property(
      "scene", [](const InverseOptions& o) { return Scene(o.scene); },
      [](InverseOptions& o, const Scene& scene) { o.scene = scene; }, "What the robot must not touch.");
  cls.def("__repr__", [](const InverseOptions& o) { return std::string("InverseOptions('") + word(o.choose) + "')"; });
  define_value(cls, {"position_tolerance", "rotation_tolerance", "choose", "max_iterations", "max_restarts",
                     "wrist_tolerance", "parallel_tolerance", "scene"});

  const PathOptions steps;
  py::class_<PathOptions> path(m, "PathOptions", "How `InverseSolver.path` works; see the attributes.");
  path.def(py::init([](double longest_turn, double longest_slide, int rolls, int rail_places, int smoothing) {
             return PathOptions{longest_turn, longest_slide, rolls, rail_places, smoothing};
           }),
           py::kw_only(), py::arg("longest_turn") = steps.longest_turn, py::arg("longest_slide") = steps.longest_slide,
           py::arg("rolls") = steps.rolls, py::arg("rail_places") = steps.rail_places,
           py::arg("smoothing") = steps.smoothing);
  path.def_readwrite("longest_turn", &PathOptions::longest_turn,
                     "[rad] of a turning joint between neighbouring targets; more is a gap.");
  path.def_readwrite("longest_slide", &PathOptions::longest_slide, "[m] of a sliding joint.");
  path.def_readwrite("rolls", &PathOptions::rolls, "Samples of a torch's roll, where it is free.");
  path.def_readwrite("rail_places", &PathOptions::rail_places,
                     "Samples of each rail before the arm, over what it can be reached from.");
  path.def_readwrite("smoothing", &PathOptions::smoothing,
                     "Rounds that even the path out where the task leaves something free.");
  path.def("__repr__", [](const PathOptions& o) { return "PathOptions(" + text(o.longest_turn) + " rad)"; });
  define_value(path, {"longest_turn", "longest_slide", "rolls", "rail_places", "smoothing"});

  const CompensateOptions none;
  py::class_<CompensateOptions> compensate(m, "CompensateOptions", "How `Compensator` works; see the attributes.");
  compensate.def(
      py::init([](const InverseOptions& inverse, bool in_base) { return CompensateOptions{inverse, in_base}; }),
      py::kw_only(), py::arg_v("inverse", none.inverse, "InverseOptions()"), py::arg("in_base") = none.in_base);
  compensate.def_readwrite("inverse", &CompensateOptions::inverse, "Of both solvers.");
  compensate.def_readwrite("in_base", &CompensateOptions::in_base,
                           "Wanted poses and commands are in each robot's own base frame, as programs have them; "
                           "else in the measurement frame.");
  compensate.def("__repr__", [](const CompensateOptions& o) {
    return std::string("CompensateOptions(in_base=") + (o.in_base ? "True" : "False") + ")";
  });
  define_value(compensate, {"inverse", "in_base"});
}

// ---- Solver

struct FoundPath {
  Solutions solutions;
  std::vector<PathGap> gaps;
  double longest_turn, longest_slide;
};

void bind_path(py::module_& m) {
  py::class_<PathGap> gap(m, "PathGap", "Two neighbouring targets that the joints do not pass between.");
  gap.def_readonly("start", &PathGap::from, "Index of the target before it; the next is start + 1.");
  gap.def_readonly("joint", &PathGap::joint, "Whose step is too long; -1: one of the two is not reached.");
  gap.def_readonly("step", &PathGap::step, "[rad | m]");
  gap.def("__repr__", [](const PathGap& g) { return "PathGap(after " + std::to_string(g.from) + ")"; });

  py::class_<FoundPath> path(m, "JointPath", "Joints along a chain of targets.");
  path.def_readonly("solutions", &FoundPath::solutions, "One per target.");
  path.def_property_readonly(
      "gaps", [](const FoundPath& p) { return tuple_of(p.gaps); }, "Empty: every step is within the bounds.");
  path.def_readonly("longest_turn", &FoundPath::longest_turn,
                    "[rad] the longest step of a turning joint that is no gap.");
  path.def_readonly("longest_slide", &FoundPath::longest_slide, "[m] of a sliding joint.");
  path.def_property_readonly("continuous", [](const FoundPath& p) { return p.gaps.empty(); }, "No gaps.");
  path.def("__repr__", [](const FoundPath& p) {
    return "JointPath(" + std::to_string(p.solutions.items.size()) + " targets, " + std::to_string(p.gaps.size()) +
           " gaps)";
  });
}

void bind_solver(py::module_& m) {
  py::class_<InverseSolver> cls(m, "InverseSolver",
                                R"(A robot made ready for inverse kinematics, nominal or calibrated, effects included.

Built once it does not change, and any number of threads may use it. Where a seed is asked for, None is the middle of every
joint's range.
conditions: those of every solve that names no others; they also say which inputs there are. target: its index in
`robot.targets`. Raises InputError when robot, target or options cannot be used, or effects lack an input.)");
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
      R"(One answer. What cannot be reached is told in the result.

seed: shape=(driven joints,) [rad | m]. Raises InputError on a seed of the wrong size and on values that are not finite.)");
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
      R"(Every answer for a full pose; prismatic joints before the arm stay at the seed's.

Without a closed form what descents from many seeds found, not known to be all. Raises InputError.)");
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
      R"(One answer per target, the same for any number of threads (0: as many as the machine has).

targets: tasks, or shape=(n, 4, 4) [m] poses, each a task like `like` (None: a full pose).
seeds: shape=(driven joints,) or (n, driven joints) [rad | m]. conditions: one, or one per target.
progress: called with targets done, now and then; what it raises stops the work. Raises InputError.)");
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
  cls.def("describe", &InverseSolver::describe, py::arg("solution"),
          "In a sentence: 'J4 would have to go 0.12 rad beyond its limit'.");
  cls.def("__repr__", [](const InverseSolver& s) {
    return "InverseSolver('" + s.robot().name + "', " + std::to_string(s.driven_count()) + " joints, closed form " +
           word(s.closed_form()) + ")";
  });
}

// ---- Compensation

void bind_compensate(py::module_& m) {
  py::class_<Compensated> cls(m, "Compensated", "What to tell a controller that believes in the nominal robot.");
  cls.def_readonly("solution", &Compensated::solution,
                   "Of the calibrated robot: joints to command, and whether the target is reached with them.");
  cls.def_readonly("T_command", &Compensated::T_command,
                   "shape=(4, 4) [m]: pose to command; the nominal robot takes these joints for it.");
  cls.def_readonly(
      "other_configuration", &Compensated::other_configuration,
      "The joints are more than half a radian from those that the nominal robot would take: a controller that is "
      "given T_command may choose others.");
  cls.def_property_readonly(
      "position_before", [](const Compensated& c) { return known(c.position_before); },
      "[m] how far off the real robot would be if the wanted pose were commanded; None: the nominal robot "
      "cannot reach it.");
  cls.def_property_readonly(
      "rotation_before", [](const Compensated& c) { return known(c.rotation_before); }, "[rad] likewise.");
  cls.def_property_readonly(
      "sigma", [](const Compensated& c) { return read_only(py::array_t<double>(6, c.sigma.data())); },
      "shape=(6,): standard error of where the target will be, position [m] and rotation [rad] along the measurement "
      "frame's axes; NaN: no uncertainty was given.");
  cls.def("__repr__", [](const Compensated& c) { return "Compensated(" + repr(c.solution) + ")"; });

  py::class_<Compensations> all(m, "Compensations",
                                "Of many targets, in their order: a sequence of `Compensated`, and values as arrays.");
  all.def_property_readonly(
      "solutions",
      [](const Compensations& c) {
        Solutions out;
        out.driven = c.driven;
        for (const Compensated& i : c.items) out.items.push_back(i.solution);
        return out;
      },
      "Joints to command, as `Solutions`.");
  all.def_property_readonly(
      "T_command",
      [](const Compensations& c) {
        std::vector<Eigen::Isometry3d> frames;
        for (const Compensated& i : c.items) frames.push_back(i.T_command);
        return array_from(frames);
      },
      "shape=(n, 4, 4) [m]: poses to command.");
  all.def_property_readonly(
      "other_configuration",
      [](const Compensations& c) {
        return column<bool>(c.items, [](const Compensated& i) { return i.other_configuration; });
      },
      "shape=(n,): a controller that is given T_command may choose other joints.");
  all.def_property_readonly(
      "position_before",
      [](const Compensations& c) {
        return column<double>(c.items, [](const Compensated& i) { return i.position_before; });
      },
      "shape=(n,) [m]; NaN: the nominal robot cannot reach it.");
  all.def_property_readonly(
      "rotation_before",
      [](const Compensations& c) {
        return column<double>(c.items, [](const Compensated& i) { return i.rotation_before; });
      },
      "shape=(n,) [rad]; NaN likewise.");
  all.def_property_readonly(
      "sigma",
      [](const Compensations& c) { return block(c.items, 6, [](const Compensated& i) { return i.sigma.data(); }); },
      "shape=(n, 6) [m], [rad]; NaN: no uncertainty was given.");
  all.def("__len__", [](const Compensations& c) { return c.items.size(); });
  all.def("__getitem__", [](const Compensations& c, py::ssize_t k) { return at(c.items, k); }, py::arg("k"));
  all.def(
      "__iter__", [](const Compensations& c) { return py::make_iterator(c.items.begin(), c.items.end()); },
      py::keep_alive<0, 1>());
  all.def("__repr__", [](const Compensations& c) { return "Compensations(" + std::to_string(c.items.size()) + ")"; });

  py::class_<Compensator> maker(
      m, "Compensator",
      R"(Says what to command so that the real robot, which `calibrated` describes, goes where it is wanted.

Built once from both robots, then any number of threads may use it. conditions, target: as of `InverseSolver`.
Raises InputError when the robots have different joints, or as InverseSolver does.)");
  maker.def(py::init([](const Robot& nominal, const Robot& calibrated, const std::optional<CompensateOptions>& options,
                        const std::optional<Conditions>& conditions, std::size_t target) {
              return std::make_unique<Compensator>(nominal, calibrated, options.value_or(CompensateOptions{}),
                                                   conditions.value_or(Conditions{}), target);
            }),
            py::arg("nominal"), py::arg("calibrated"), py::arg("options") = py::none(),
            py::arg("conditions") = py::none(), py::kw_only(), py::arg("target") = 0);
  maker.def(
      "set_uncertainty",
      [](Compensator& c, const std::vector<std::string>& names, const std::vector<double>& values,
         const Eigen::MatrixXd& covariance) {
        if (names.size() != values.size())
          throw std::invalid_argument("got " + std::to_string(names.size()) + " names, but " +
                                      std::to_string(values.size()) + " values");
        std::vector<Parameter> parameters(names.size());
        for (std::size_t k = 0; k < names.size(); ++k) {
          parameters[k].name = names[k];
          parameters[k].value = values[k];
        }
        c.set_uncertainty(parameters, covariance);
      },
      py::arg("names"), py::arg("values"), py::arg("covariance"),
      R"(What `identify` says of its parameters: names and values of the fitted ones, and their covariance, shape=(n, n).

Raises InputError on a parameter that the calibrated robot does not have, or a covariance of another size.)");
  maker.def_property_readonly("nominal", &Compensator::nominal, py::return_value_policy::reference_internal,
                              "The solver of the nominal robot.");
  maker.def_property_readonly("calibrated", &Compensator::calibrated, py::return_value_policy::reference_internal,
                              "The solver of the calibrated robot.");
  maker.def(
      "pose",
      [](const Compensator& c, const Task& given, const std::optional<Eigen::VectorXd>& seed,
         const std::optional<Conditions>& conditions) {
        const Task task = given;
        const Joints from = seed_from(seed, c.nominal());
        const py::gil_scoped_release unlocked;
        return c.pose(task, from, conditions ? &*conditions : nullptr);
      },
      py::arg("task"), py::arg("seed") = py::none(), py::arg("conditions") = py::none(),
      R"(A pose of a program. seed: shape=(driven joints,) [rad | m], where the robot comes from; it decides the configuration.

Raises InputError.)");
  maker.def(
      "joints",
      [](const Compensator& c, const Eigen::VectorXd& program, const std::optional<Eigen::VectorXd>& seed,
         const std::optional<Conditions>& conditions) {
        const Joints wanted = joints_from(program);
        const Joints from = seed ? joints_from(*seed) : wanted;
        const py::gil_scoped_release unlocked;
        return c.joints(wanted, from, conditions ? &*conditions : nullptr);
      },
      py::arg("program"), py::arg("seed") = py::none(), py::arg("conditions") = py::none(),
      R"(A joint position of a program, shape=(driven joints,) [rad | m]: the nominal robot's pose there is what is wanted.

seed: where the robot comes from; None: it stands there already. Raises InputError.)");
  maker.def(
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
  maker.def(
      "joints_batch",
      [](const Compensator& c, const ArrayLike& given_program, const GivenConditions& given, int threads,
         const Callback& callback) {
        const std::vector<Joints> program = joint_rows(given_program, c.nominal().driven_count(), "program");
        const std::vector<Conditions> conditions = conditions_from(given);
        if (!conditions.empty()) require_one_or_each(conditions.size(), program.size(), "conditions");
        return Compensations{
            with_progress(callback,
                          [&](const auto& progress) { return c.joints_batch(program, conditions, threads, progress); }),
            c.nominal().driven_count()};
      },
      py::arg("program"), py::arg("conditions") = py::none(), py::kw_only(), py::arg("threads") = 0,
      py::arg("progress") = py::none(),
      R"(One result per row of a program of joint positions, shape=(n, driven joints) [rad | m].

The robot comes from the row before; to the first it does not move. Raises InputError.)");
  maker.def("__repr__", [](const Compensator& c) {
    return "Compensator('" + c.nominal().robot().name + "' -> '" + c.calibrated().robot().name + "')";
  });
}

}  // namespace

void bind_inverse(py::module_& m) {
  bind_scene(m);
  bind_task(m);
  bind_options(m);
  bind_solution(m);
  bind_path(m);
  bind_solver(m);
  bind_compensate(m);
}

}  // namespace truing::python
