// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "casters.hpp"

namespace truing::python {
namespace {

/// None where the column was not asked for.
std::optional<py::array_t<double>> column(const Eigen::VectorXd& values) {
  if (values.size() == 0) return std::nullopt;
  return read_only(py::array_t<double>(values.size(), values.data()));
}

void bind_parts(py::module_& m) {
  py::class_<EffectSize> size(m, "EffectSize", "The smallest effect that a plan would see.");
  size.def_readonly("effect", &EffectSize::effect, "Its name.");
  size.def_readonly("joint", &EffectSize::joint, "Where; empty: it belongs to no joint.");
  size.def_readonly("parameter", &EffectSize::parameter, "The one of its parameters that shows best.");
  size.def_readonly("unit", &EffectSize::unit, "Of `size`.");
  size.def_readonly("size", &EffectSize::size, "In the parameter's unit, when base and tool are fitted.");
  size.def_readonly("size_at_tip", &EffectSize::size_at_tip, "Rms motion of the tip that this makes [m].");
  size.def_readonly("size_with_geometry", &EffectSize::size_with_geometry,
                    "When all geometry is fitted as well; NaN: geometry takes it all up.");
  size.def_readonly("size_with_geometry_at_tip", &EffectSize::size_with_geometry_at_tip, "Its motion of the tip [m].");
  size.def_readonly("standard_errors", &EffectSize::standard_errors,
                    "How many of the parameter's standard errors `size` is.");
  size.def("__repr__", [](const EffectSize& e) {
    return "EffectSize(" + e.parameter + " >= " + text(e.size) + " " + e.unit + ")";
  });

  py::class_<EffectPair> pair(m, "EffectPair", "Two effects, and how far the first is like what the other can do.");
  pair.def_readonly("effect", &EffectPair::effect, "The first.");
  pair.def_readonly("joint", &EffectPair::joint, "Where; empty: it belongs to no joint.");
  pair.def_readonly("other", &EffectPair::other, "The other.");
  pair.def_readonly("other_joint", &EffectPair::other_joint, "Where the other is.");
  pair.def_readonly("r2", &EffectPair::r2,
                    "Share of the first's motion of the tip, beyond base and tool, that the other explains.");
  pair.def_readonly("r2_after", &EffectPair::r2_after, "With the added poses; NaN: none were asked for.");
  pair.def_readonly("parameter", &EffectPair::parameter, "Of the first: what `size` is of.");
  pair.def_readonly("unit", &EffectPair::unit, "Of `size`.");
  pair.def_readonly("size", &EffectPair::size, "From which on the first is told from the other; NaN: never.");
  pair.def_readonly("size_after", &EffectPair::size_after, "With the added poses.");
  pair.def_readonly("separated_by", &EffectPair::separated_by, "What to measure to tell.");
  pair.def("__repr__", [](const EffectPair& p) {
    return "EffectPair(" + p.effect + " " + p.joint + ", " + p.other + " " + p.other_joint + ", r2=" + text(p.r2) + ")";
  });
}

void bind_options(py::module_& m) {
  using O = DistinguishOptions;
  const O usual;
  py::class_<O> cls(m, "DistinguishOptions", "How `distinguish` works; see the attributes.");
  cls.def(py::init([](std::vector<std::string> columns, std::vector<EffectRequest> separate, double payload,
                      double temperature_low, double temperature_high, double seconds_per_pose, bool orientation,
                      double position_sigma, double rotation_sigma, double alike, int add, int proposals,
                      double min_step, double min_step_prismatic, std::uint64_t seed) {
            return O{std::move(columns),
                     std::move(separate),
                     payload,
                     temperature_low,
                     temperature_high,
                     seconds_per_pose,
                     orientation,
                     position_sigma,
                     rotation_sigma,
                     alike,
                     add,
                     proposals,
                     min_step,
                     min_step_prismatic,
                     seed,
                     {}};
          }),
          py::kw_only(), py::arg("columns") = usual.columns, py::arg("separate") = usual.separate,
          py::arg("payload") = usual.payload, py::arg("temperature_low") = usual.temperature_low,
          py::arg("temperature_high") = usual.temperature_high, py::arg("seconds_per_pose") = usual.seconds_per_pose,
          py::arg("orientation") = usual.orientation, py::arg("position_sigma") = usual.position_sigma,
          py::arg("rotation_sigma") = usual.rotation_sigma, py::arg("alike") = usual.alike, py::arg("add") = usual.add,
          py::arg("proposals") = usual.proposals, py::arg("min_step") = usual.min_step,
          py::arg("min_step_prismatic") = usual.min_step_prismatic, py::arg("seed") = usual.seed);
  cls.def_property(
      "columns", [](const O& o) { return tuple_of(o.columns); },
      [](O& o, std::vector<std::string> v) { o.columns = std::move(v); }, "Of 'dir', 'payload', 'temp', 't'.");
  cls.def_property(
      "separate", [](const O& o) { return tuple_of(o.separate); },
      [](O& o, std::vector<EffectRequest> v) { o.separate = std::move(v); },
      "Effects to be told apart; empty: the whole catalogue is looked at, and no poses are added.");
  cls.def_readwrite("payload", &O::payload, "[kg] a pose is measured with this or with nothing.");
  cls.def_readwrite("temperature_low", &O::temperature_low, "[deg C] at the first and the last pose.");
  cls.def_readwrite("temperature_high", &O::temperature_high, "[deg C] halfway.");
  cls.def_readwrite("seconds_per_pose", &O::seconds_per_pose, "[s]");
  cls.def_readwrite("orientation", &O::orientation, "Full poses are measured, not only positions.");
  cls.def_readwrite("position_sigma", &O::position_sigma, "[m] of one component.");
  cls.def_readwrite("rotation_sigma", &O::rotation_sigma, "[rad]");
  cls.def_readwrite("alike", &O::alike, "An effect of which another explains a larger share is not told from it.");
  cls.def_readwrite("add", &O::add, "At most so many poses are added.");
  cls.def_readwrite("proposals", &O::proposals, "Poses that each of them is chosen from.");
  cls.def_readwrite("min_step", &O::min_step, "[rad] every revolute joint moves by more to an added pose.");
  cls.def_readwrite("min_step_prismatic", &O::min_step_prismatic, "[m] the same for prismatic joints.");
  cls.def_readwrite("seed", &O::seed, "Of directions, payloads and proposals.");
  cls.def("__repr__", [](const O& o) { return "DistinguishOptions(columns: " + joined(o.columns) + ")"; });
  define_value(
      cls, {"columns", "separate", "payload", "temperature_low", "temperature_high", "seconds_per_pose", "orientation",
            "position_sigma", "rotation_sigma", "alike", "add", "proposals", "min_step", "min_step_prismatic", "seed"});
}

}  // namespace

void bind_distinguish(py::module_& m) {
  bind_parts(m);
  bind_options(m);

  py::class_<Distinction> result(m, "Distinction", "What `distinguish` found.");
  result.def_property_readonly(
      "effects", [](const Distinction& d) { return tuple_of(d.effects); },
      "Smallest sizes, as of all poses, added ones included.");
  result.def_readonly("r2", &Distinction::r2,
                      "shape=(effects, effects): share of the row's effect that the column's explains.");
  result.def_property_readonly(
      "alike", [](const Distinction& d) { return tuple_of(d.alike); }, "Not told apart, most alike first.");
  result.def_property_readonly(
      "not_testable", [](const Distinction& d) { return tuple_of(d.not_testable); },
      "Effects that such data could not show.");
  result.def_property_readonly(
      "separated", [](const Distinction& d) { return tuple_of(d.separated); },
      "Every pair of those to be told apart, before and after poses were added.");
  result.def_readonly("added", &Distinction::added, "The last so many poses.");
  result.def_readonly("joints", &Distinction::joints,
                      "shape=(poses, driven joints) [rad | m]: the poses given, then those added.");
  result.def_property_readonly(
      "direction",
      [](const Distinction& d) -> std::optional<py::array_t<double>> {
        if (d.direction.size() == 0) return std::nullopt;
        return read_only(py::array_t<double>({d.direction.rows(), d.direction.cols()}, d.direction.data()));
      },
      "shape=(poses, driven joints): -1 or 1; None: not asked for.");
  result.def_property_readonly(
      "payload", [](const Distinction& d) { return column(d.payload); }, "shape=(poses,) [kg]");
  result.def_property_readonly(
      "temperature", [](const Distinction& d) { return column(d.temperature); }, "shape=(poses,) [deg C]");
  result.def_property_readonly("time", [](const Distinction& d) { return column(d.time); }, "shape=(poses,) [s]");
  result.def("__repr__", [](const Distinction& d) {
    return "Distinction(" + std::to_string(d.effects.size()) + " effects, " + std::to_string(d.alike.size()) +
           " pairs alike, " + std::to_string(d.added) + " poses added)";
  });

  m.def(
      "distinguish",
      [](const Robot& given_robot, const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>& joints,
         const std::optional<DistinguishOptions>& given, const std::vector<py::object>& own) {
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

}  // namespace truing::python
