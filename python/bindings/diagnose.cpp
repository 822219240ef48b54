// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>

#include "casters.hpp"

namespace truing::python {

namespace {

/// "12.3 %", of a share.
std::string percent(double share) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3g %%", 1e2 * share);
  return buffer;
}

std::string millimetres(double metres) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.4g mm", 1e3 * metres);
  return buffer;
}

/// "backlash at J2, J3"
std::string at_joints(const std::string& effect, const std::vector<std::string>& joints) {
  return effect + (joints.empty() ? "" : " at " + joined(joints));
}

std::string repr(const Share& s) {
  return "Share(" + text(s.value) + ", " + text(s.low) + " ... " + text(s.high) + ")";
}

/// Rows of N numbers as an array of shape (n, N).
template <std::size_t N>
py::array_t<double> block_of(const std::vector<std::array<double, N>>& rows) {
  py::array_t<double> out({rows.size(), N});
  double* to = out.mutable_data();
  for (const std::array<double, N>& row : rows) to = std::copy(row.begin(), row.end(), to);
  return read_only(std::move(out));
}

py::array_t<double> array_from(const std::vector<double>& values) {
  return read_only(py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data()));
}

std::string summary(const Diagnosis& d) {
  std::string out = d.sentence + "\nheld-out rms " + millimetres(d.gap.rms) + " -> " + millimetres(d.after.rms) +
                    ", noise " + millimetres(d.noise_floor) + "\n";
  for (const FoundEffect& e : d.effects) {
    out += at_joints(e.effect, e.joints) + ": probability " + text(e.probability);
    for (const Alternative& a : e.confounded_with) out += ", or " + at_joints(a.effect, a.joints);
    out += "\n";
  }
  for (const UnknownEffect& u : d.unknown)
    out += "unknown, " + (u.joint.empty() ? "somewhere" : "at " + u.joint) +
           (u.inputs.empty() ? "" : ", over " + joined(u.inputs)) + ": " + u.looks_like + "\n";
  for (const SanityFinding& s : d.sanity) out += "look: " + s.text + "\n";
  for (const std::string& w : d.warnings) out += "warning: " + w + "\n";
  return out;
}

/// Properties of strings that are copied out as tuples.
template <class T>
void define_names(py::class_<T>& cls, const char* name, std::vector<std::string> T::* member, const char* doc) {
  cls.def_property_readonly(name, [member](const T& self) { return tuple_of(self.*member); }, doc);
}

void bind_options(py::module_& m) {
  const DiagnoseOptions usual;
  py::class_<DiagnoseOptions> cls(m, "DiagnoseOptions", "How `diagnose` works; see the attributes.");
  cls.def(
      py::init([](std::vector<std::string> leave_out, double false_alarm, int max_effects, double test_share,
                  std::size_t search_poses, int resamples, double rotation_length, std::uint64_t seed, int threads) {
        DiagnoseOptions o;
        o.leave_out = std::move(leave_out);
        o.false_alarm = false_alarm;
        o.max_effects = max_effects;
        o.test_share = test_share;
        o.search_poses = search_poses;
        o.resamples = resamples;
        o.rotation_length = rotation_length;
        o.seed = seed;
        o.threads = threads;
        return o;
      }),
      py::kw_only(), py::arg("leave_out") = usual.leave_out, py::arg("false_alarm") = usual.false_alarm,
      py::arg("max_effects") = usual.max_effects, py::arg("test_share") = usual.test_share,
      py::arg("search_poses") = usual.search_poses, py::arg("resamples") = usual.resamples,
      py::arg("rotation_length") = usual.rotation_length, py::arg("seed") = usual.seed,
      py::arg("threads") = usual.threads);
  cls.def_property(
      "leave_out", [](const DiagnoseOptions& o) { return tuple_of(o.leave_out); },
      [](DiagnoseOptions& o, std::vector<std::string> v) { o.leave_out = std::move(v); },
      "Effects that are not to be considered, by name.");
  cls.def_readwrite("false_alarm", &DiagnoseOptions::false_alarm,
                    "Chance that a robot without any gap is said to have one.");
  cls.def_readwrite("max_effects", &DiagnoseOptions::max_effects, "At most so many are named.");
  cls.def_readwrite("test_share", &DiagnoseOptions::test_share,
                    "Share of the pose groups held out when the data has no `set`.");
  cls.def_readwrite("search_poses", &DiagnoseOptions::search_poses,
                    "Of more pose groups, so many are searched; errors are those of all rows.");
  cls.def_readwrite("resamples", &DiagnoseOptions::resamples,
                    "Draws of folds of pose groups for the intervals, with what was chosen fitted again; at most 10 "
                    "more repeat the selection.");
  cls.def_readwrite("rotation_length", &DiagnoseOptions::rotation_length,
                    "[m] a rotation error of 1 rad counts as this length in reported errors.");
  cls.def_readwrite("seed", &DiagnoseOptions::seed, "Of the split and of every simulation.");
  cls.def_readwrite("threads", &DiagnoseOptions::threads, "0: as many as the machine has.");
  cls.def("__repr__", [](const DiagnoseOptions& o) {
    return "DiagnoseOptions(false_alarm=" + text(o.false_alarm) +
           (o.leave_out.empty() ? "" : ", without " + joined(o.leave_out)) + ", seed=" + std::to_string(o.seed) + ")";
  });
  define_value(cls, {"leave_out", "false_alarm", "max_effects", "test_share", "search_poses", "resamples",
                     "rotation_length", "seed", "threads"});
}

void bind_findings(py::module_& m) {
  py::class_<Share> share(m, "Share", "A share and its 90 % interval.");
  share.def_readonly("value", &Share::value, "1: all of it.");
  share.def_readonly("low", &Share::low, "Lower end.");
  share.def_readonly("high", &Share::high, "Upper end.");
  share.def("__repr__", [](const Share& s) { return repr(s); });

  py::class_<Alternative> alternative(m, "Alternative", "An effect that would explain the data as well.");
  alternative.def_readonly("effect", &Alternative::effect, "Its name.");
  define_names(alternative, "joints", &Alternative::joints, "Where.");
  alternative.def_readonly("probability", &Alternative::probability, "Its part of the class's probability.");
  alternative.def_readonly("separated_by", &Alternative::separated_by, "What to measure to tell.");
  alternative.def("__repr__",
                  [](const Alternative& a) { return "Alternative(" + at_joints(a.effect, a.joints) + ")"; });

  py::class_<Curve> curve(m, "Curve",
                          "A fitted law, or a free function, drawn against its input: value at the site [rad | m].");
  curve.def_readonly("site", &Curve::site, "What moves: a joint's name, 'base.x' ...");
  curve.def_readonly("input", &Curve::input, "'q4', 'torque2', 'temp', 'time', 'dir3', 'payload', a covariate.");
  curve.def_readonly(
      "second_input", &Curve::second_input,
      "Of a function of two inputs: the other one, which is between `second_low` and `second_high`; or ''.");
  curve.def_readonly("second_low", &Curve::second_low, "Of the second input.");
  curve.def_readonly("second_high", &Curve::second_high, "Of the second input.");
  curve.def_readonly("input_unit", &Curve::input_unit, "Of the input.");
  curve.def_readonly("unit", &Curve::unit, "Of the value and its standard error: rad or m.");
  curve.def_property_readonly(
      "points", [](const Curve& c) { return block_of(c.points); }, "shape=(n, 3): input, value, standard error.");
  curve.def_property_readonly(
      "samples", [](const Curve& c) { return block_of(c.samples); },
      "shape=(n, 2): input and value, what single poses say; at most 600.");
  curve.def("__repr__", [](const Curve& c) {
    return "Curve('" + c.site + "' over '" + c.input + "', " + std::to_string(c.points.size()) + " points)";
  });

  py::class_<FoundEffect> found(m, "FoundEffect", "An effect that `diagnose` named.");
  found.def_readonly("effect", &FoundEffect::effect,
                     "Its name, as in `catalogue()`, or that of an effect of one's own.");
  define_names(found, "joints", &FoundEffect::joints, "Where.");
  found.def_readonly("probability", &FoundEffect::probability,
                     "Of the class: this effect or one of `confounded_with`.");
  found.def_property_readonly(
      "parameters", [](const FoundEffect& e) { return tuple_of(e.parameters); }, "Values and standard errors.");
  found.def_readonly("held_out_before", &FoundEffect::held_out_before,
                     "Held-out errors without this effect, all others in [m].");
  found.def_readonly("held_out_after", &FoundEffect::held_out_after, "Held-out errors with all named effects [m].");
  found.def_readonly("shrink", &FoundEffect::shrink, "Of the held-out rms: 1 - after / before.");
  found.def_readonly("share", &FoundEffect::share,
                     "Of the gap's mean square; those of all effects and unknowns add up to what was closed.");
  found.def_readonly("share_alone", &FoundEffect::share_alone,
                     "Of the gap's mean square, what it closes when it is the only one.");
  found.def_readonly("share_last", &FoundEffect::share_last, "What it closes when all others are in already.");
  found.def_property_readonly(
      "confounded_with", [](const FoundEffect& e) { return tuple_of(e.confounded_with); },
      "Effects that would explain these data as well.");
  found.def_readonly("identify_as", &FoundEffect::identify_as,
                     "What `identify(effects=...)` and `--effects` take for it: 'backlash:J3'; empty for a "
                     "frame that wanders.");
  found.def_readonly("note", &FoundEffect::note, "What else is to be known of it; may be empty.");
  found.def_property_readonly(
      "curves", [](const FoundEffect& e) { return tuple_of(e.curves); },
      "The law, drawn through what single poses say.");
  found.def("__repr__", [](const FoundEffect& e) {
    return "FoundEffect(" + at_joints(e.effect, e.joints) + ", probability " + text(e.probability) + ")";
  });

  py::class_<UnknownEffect> unknown(m, "UnknownEffect",
                                    "Something that no effect of the catalogue is: a joint that moves as a "
                                    "free function of recorded inputs.");
  unknown.def_readonly("joint", &UnknownEffect::joint,
                       "A joint's name, 'base', or '' when only 'somewhere' can be said.");
  define_names(unknown, "inputs", &UnknownEffect::inputs,
               "One or two; none: more is left than repeats show, and no function describes it.");
  unknown.def_readonly("probability", &UnknownEffect::probability, "That there is such a thing.");
  unknown.def_readonly("held_out_before", &UnknownEffect::held_out_before, "Held-out errors without it [m].");
  unknown.def_readonly("held_out_after", &UnknownEffect::held_out_after, "Held-out errors with it [m].");
  unknown.def_readonly("shrink", &UnknownEffect::shrink, "Of the held-out rms: 1 - after / before.");
  unknown.def_readonly("share", &UnknownEffect::share, "Of the gap's mean square, as that of an effect.");
  unknown.def_property_readonly(
      "curves", [](const UnknownEffect& u) { return tuple_of(u.curves); },
      "Along the first input; of two inputs, one for each of three ranges of the second.");
  unknown.def_readonly("looks_like", &UnknownEffect::looks_like, "In words: 'a step at q4 = 0.41 rad'.");
  unknown.def("__repr__", [](const UnknownEffect& u) {
    return "UnknownEffect(" +
           at_joints(u.looks_like.empty() ? "a function of " + joined(u.inputs) : u.looks_like,
                     u.joint.empty() ? std::vector<std::string>{} : std::vector{u.joint}) +
           ", probability " + text(u.probability) + ")";
  });
}

void bind_limits(py::module_& m) {
  py::class_<NotTestable> not_testable(m, "NotTestable", "An effect that these data could not show.");
  not_testable.def_readonly("effect", &NotTestable::effect, "Its name.");
  define_names(not_testable, "joints", &NotTestable::joints, "Where; empty: at any joint.");
  not_testable.def_readonly("why", &NotTestable::why, "'no column temp_C', 'J1 does not move' ...");
  not_testable.def("__repr__", [](const NotTestable& n) {
    return "NotTestable(" + at_joints(n.effect, n.joints) + ": " + n.why + ")";
  });

  py::class_<Detectable> detectable(m, "Detectable", "The smallest effect that would have been found.");
  detectable.def_readonly("effect", &Detectable::effect, "Its name.");
  detectable.def_readonly("joint", &Detectable::joint, "Where.");
  detectable.def_readonly("parameter", &Detectable::parameter, "Of which parameter `size` is.");
  detectable.def_readonly("unit", &Detectable::unit, "Of `size`.");
  detectable.def_readonly("size", &Detectable::size, "In the parameter's unit.");
  detectable.def_readonly("size_at_tip", &Detectable::size_at_tip, "Rms at the tip [m].");
  detectable.def("__repr__", [](const Detectable& d) {
    return "Detectable(" + d.parameter + " >= " + text(d.size) + " " + d.unit + ")";
  });

  py::class_<Candidate> candidate(m, "Candidate",
                                  "One candidate before any choice: what methods without a search would go by.");
  candidate.def_readonly("effect", &Candidate::effect, "Its name.");
  define_names(candidate, "joints", &Candidate::joints, "Where.");
  candidate.def_readonly("columns", &Candidate::columns, "Parameters that the data can see.");
  candidate.def_readonly("gain", &Candidate::gain,
                         "Fall of the sum of squares when it is added alone, in units of the noise.");
  candidate.def_readonly("evidence", &Candidate::evidence, "Log Bayes factor against frames only.");
  candidate.def_readonly("held_out_gain", &Candidate::held_out_gain,
                         "Cross-validated fall of the mean square, as a share of the gap.");
  candidate.def_readonly("largest_z", &Candidate::largest_z,
                         "Largest |estimate / standard error| when everything is fitted together.");
  candidate.def("__repr__", [](const Candidate& c) {
    return "Candidate(" + at_joints(c.effect, c.joints) + ", gain " + text(c.gain) + ")";
  });

  py::class_<SanityFinding> sanity(m, "SanityFinding", "What looks wrong with the data themselves.");
  sanity.def_readonly("kind", &SanityFinding::kind,
                      "joint_record, joint_order, joint_sign, joint_unit, duplicates, direction, lag, moved_target, "
                      "constant or outliers.");
  sanity.def_readonly("text", &SanityFinding::text, "A sentence with what to do.");
  sanity.def_property_readonly(
      "rows", [](const SanityFinding& s) { return tuple_of(s.rows); },
      "Rows (counted from 0) that it is about, if few.");
  sanity.def("__repr__", [](const SanityFinding& s) { return "SanityFinding(" + s.kind + ": " + s.text + ")"; });

  py::class_<NextPose> next(m, "NextPose", "A pose worth measuring next.");
  next.def_property_readonly(
      "joints", [](const NextPose& p) { return array_from(p.joints); }, "shape=(driven joints,) [rad | m]");
  next.def_property_readonly(
      "direction", [](const NextPose& p) { return tuple_of(p.direction); },
      "Approach direction of every driven joint; empty: any.");
  next.def_readonly("payload", &NextPose::payload, "[kg]; NaN: any.");
  next.def_readonly("why", &NextPose::why, "What it tells.");
  next.def("__repr__", [](const NextPose& p) { return "NextPose(" + p.why + ")"; });
}

void bind_where(py::module_& m) {
  py::class_<WhereJoint> joint(m, "WhereJoint", "How much of the closable gap sits at a joint.");
  joint.def_readonly("joint", &WhereJoint::joint, "Its name.");
  joint.def_readonly("share", &WhereJoint::share,
                     "Of the closable gap, what a free function of the inputs at this joint explains.");
  joint.def("__repr__", [](const WhereJoint& w) { return "WhereJoint('" + w.joint + "', " + repr(w.share) + ")"; });

  py::class_<WhereInput> input(m, "WhereInput", "How much of the gap goes with an input.");
  input.def_readonly("input", &WhereInput::input, "Its name.");
  input.def_readonly("share", &WhereInput::share, "Of the closable gap.");
  input.def("__repr__", [](const WhereInput& w) { return "WhereInput('" + w.input + "', " + percent(w.share) + ")"; });

  py::class_<WorkspaceCell> cell(m, "WorkspaceCell", "The error in one part of the workspace.");
  cell.def_property_readonly(
      "center", [](const WorkspaceCell& c) { return read_only(py::array_t<double>(3, c.center.data())); },
      "shape=(3,) [m] in the base frame.");
  cell.def_readonly("rms", &WorkspaceCell::rms, "Of the gap [m].");
  cell.def_readonly("n", &WorkspaceCell::n, "Number of rows.");
  cell.def("__repr__", [](const WorkspaceCell& c) {
    return "WorkspaceCell(rms=" + millimetres(c.rms) + ", n=" + std::to_string(c.n) + ")";
  });
}

void bind_diagnosis(py::module_& m) {
  py::class_<Diagnosis> cls(m, "Diagnosis", "What `diagnose` found.");
  cls.def_readonly("verdict", &Diagnosis::verdict,
                   "'none' (no gap beyond noise), 'effects' (named, and nothing is left), 'unknown' (a gap that no "
                   "effect of the catalogue explains) or 'effects+unknown' (named, and something is left).");
  cls.def_readonly("sentence", &Diagnosis::sentence, "The verdict in words.");
  cls.def_readonly("gap", &Diagnosis::gap, "Held-out errors with base, targets (and anchor) fitted only [m].");
  cls.def_readonly("noise_floor", &Diagnosis::noise_floor, "[m] rms length of a row's error that is noise.");
  cls.def_readonly("noise_from_repeats", &Diagnosis::noise_from_repeats,
                   "The noise is that of repeated poses, not of what a flexible fit leaves.");
  cls.def_readonly("shrink", &Diagnosis::shrink, "Of the held-out rms, by `robot`: 1 - its error / gap.");
  cls.def_readonly("closable", &Diagnosis::closable,
                   "Share of the gap's mean square above the noise floor that the named effects close.");
  cls.def_readonly("p_gap", &Diagnosis::p_gap, "Chance of a gain as large under noise alone.");
  cls.def_readonly("after", &Diagnosis::after,
                   "Held-out errors with all named effects, corrections of their laws and drifts included [m].");
  cls.def_readonly("after_unknown", &Diagnosis::after_unknown,
                   "Held-out errors with the unknown functions as well [m].");
  cls.def_readonly("remaining_structure_p", &Diagnosis::remaining_structure_p,
                   "Permutation test of the free functions on what is left.");
  cls.def_property_readonly(
      "effects", [](const Diagnosis& d) { return tuple_of(d.effects); },
      "By how much of the gap each explains, most first.");
  cls.def_property_readonly(
      "unknown", [](const Diagnosis& d) { return tuple_of(d.unknown); }, "What no effect of the catalogue is.");
  cls.def_property_readonly(
      "not_testable", [](const Diagnosis& d) { return tuple_of(d.not_testable); }, "What these data could not show.");
  cls.def_property_readonly(
      "detectable", [](const Diagnosis& d) { return tuple_of(d.detectable); },
      "The smallest effects that would have been found; of each, its easiest joint first.");
  cls.def_property_readonly(
      "candidates", [](const Diagnosis& d) { return tuple_of(d.candidates); }, "Every candidate, before any choice.");
  cls.def_property_readonly(
      "sanity", [](const Diagnosis& d) { return tuple_of(d.sanity); }, "What looks wrong with the data themselves.");
  cls.def_property_readonly(
      "where_joints", [](const Diagnosis& d) { return tuple_of(d.where_joints); }, "The gap by joint.");
  cls.def_property_readonly(
      "where_inputs", [](const Diagnosis& d) { return tuple_of(d.where_inputs); }, "The gap by input.");
  cls.def_property_readonly(
      "workspace", [](const Diagnosis& d) { return tuple_of(d.workspace); }, "The gap by part of the workspace.");
  cls.def_readonly("direction", &Diagnosis::direction,
                   "shape=(3, 3): principal axes of the residual in the base frame, as columns.");
  cls.def_readonly("direction_rms", &Diagnosis::direction_rms, "shape=(3,) [m]: along them.");
  cls.def_property_readonly(
      "next_poses", [](const Diagnosis& d) { return tuple_of(d.next_poses); }, "Poses worth measuring next.");
  cls.def_property_readonly(
      "set",
      [](const Diagnosis& d) { return py::array_t<std::int8_t>(static_cast<py::ssize_t>(d.set.size()), d.set.data()); },
      "shape=(n,): 0 train, 1 test, for every row.");
  cls.def_property_readonly(
      "error_before", [](const Diagnosis& d) { return array_from(d.error_before); },
      "shape=(n,) [m]: with base and targets fitted only.");
  cls.def_property_readonly(
      "error_after", [](const Diagnosis& d) { return array_from(d.error_after); },
      "shape=(n,) [m]: with all named effects, as `after`.");
  cls.def_readonly("residuals_before", &Diagnosis::residuals_before,
                   "Predicted minus measured, of every row, as `gap`.");
  cls.def_readonly("residuals_after", &Diagnosis::residuals_after,
                   "Predicted minus measured, of every row, as `after`.");
  cls.def_property_readonly(
      "directions",
      [](const Diagnosis& d) -> std::optional<py::array_t<double>> {
        if (d.directions.empty()) return std::nullopt;
        const std::size_t rows = d.directions.front().size();
        py::array_t<double> out({rows, d.directions.size()});
        auto to = out.mutable_unchecked<2>();
        for (std::size_t j = 0; j < d.directions.size(); ++j)
          for (std::size_t i = 0; i < rows; ++i) to(i, j) = d.directions[j].at(i);
        return read_only(std::move(out));
      },
      "shape=(n, driven joints): approach directions that were inferred from the order of the rows; None: "
      "the data had them.");
  cls.def_property_readonly(
      "outliers", [](const Diagnosis& d) { return tuple_of(d.outliers); },
      "Rows (counted from 0) that counted for little.");
  cls.def_readonly("neighbour_p95", &Diagnosis::neighbour_p95,
                   "[m] 95th percentile of the errors of a nearest-neighbour predictor; NaN: too few rows.");
  cls.def_readonly("neighbour_share", &Diagnosis::neighbour_share,
                   "Of the remaining mean square, what a nearest-neighbour predictor still explains.");
  cls.def_readonly("robot_before", &Diagnosis::robot_before,
                   "Nominal robot with base and targets fitted. Part of this result: copy() it before changing it.");
  cls.def_readonly("robot", &Diagnosis::robot,
                   "Robot with the effects that were named; free functions are left out. Part of this result.");
  cls.def_readonly("joint_record", &Diagnosis::joint_record,
                   "'q' or 'qr': the record that explains the measurements better.");
  cls.def_property_readonly(
      "warnings", [](const Diagnosis& d) { return tuple_of(d.warnings); }, "What to know before trusting it.");
  cls.def_readonly("seed", &Diagnosis::seed, "Of the split and of every simulation.");
  cls.def("summary", &summary, "A few lines for people.");
  cls.def("__repr__", [](const Diagnosis& d) {
    return std::string("Diagnosis('") + word(d.verdict) + "', " + std::to_string(d.effects.size()) +
           " effects, held-out rms " + millimetres(d.gap.rms) + " -> " + millimetres(d.after.rms) + ")";
  });
}

}  // namespace

void bind_diagnose(py::module_& m) {
  bind_options(m);
  bind_findings(m);
  bind_limits(m);
  bind_where(m);
  bind_diagnosis(m);
  m.def(
      "diagnose",
      [](const Robot& given_robot, const Measurements& data, const std::optional<DiagnoseOptions>& given,
         const std::vector<OwnEffect>& own) {
        DiagnoseOptions options = given.value_or(DiagnoseOptions{});
        options.own_effects = effects_from(own);
        const Robot robot = given_robot;  // other Python threads may change theirs once the GIL is released
        const py::gil_scoped_release unlocked;
        return diagnose(robot, data, options);
      },
      py::arg("robot"), py::arg("data"), py::arg("options") = py::none(),
      py::arg("own_effects") = std::vector<OwnEffect>{},
      R"(Where the gap between robot and model lies, which effect causes it, and how far it shrinks.

Raises InputError on data or options that cannot be used.)");
}

}  // namespace truing::python
