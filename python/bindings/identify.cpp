// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>

#include "casters.hpp"

namespace truing::python {

namespace {

template <class... Arguments>
std::string formatted(const char* format, Arguments... arguments) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, arguments...);
  return buffer;
}

std::string repr(const Parameter& p) {
  const std::string unit = p.unit.empty() || p.unit == "-" ? "" : " " + p.unit;
  return "Parameter('" + p.name + "', " + text(p.value) +
         (p.frozen ? unit + ", frozen" : formatted(" +- %.2g", p.sigma) + unit) + ", nominal " + text(p.nominal) + ")";
}

std::string repr(const ErrorStatistics& e) {
  return "ErrorStatistics(rms=" + text(e.rms) + ", p95=" + text(e.p95) + ", max=" + text(e.max) +
         " m, n=" + std::to_string(e.n) + ")";
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

void bind_options(py::module_& m) {
  const IdentifyOptions usual;
  py::class_<IdentifyOptions> cls(m, "IdentifyOptions", "How `identify` works; see the attributes.");
  cls.def(py::init([](std::vector<std::string> free, std::vector<std::string> hold, std::vector<EffectRequest> effects,
                      Solver solver, Loss loss, FrameBy frame_by, double rotation_length, double test_share,
                      std::uint64_t seed, int max_iterations, double initial_damping, double rms_fall, double gradient,
                      bool undamped, double rank_tolerance, double hayati_angle, double reject_beyond,
                      std::map<std::string, std::pair<double, double>> bounds, int threads) {
            IdentifyOptions o;
            o.free = std::move(free);
            o.hold = std::move(hold);
            o.effects = std::move(effects);
            o.solver = solver;
            o.loss = loss;
            o.frame_by = frame_by;
            o.rotation_length = rotation_length;
            o.test_share = test_share;
            o.seed = seed;
            o.max_iterations = max_iterations;
            o.initial_damping = initial_damping;
            o.rms_fall = rms_fall;
            o.gradient = gradient;
            o.undamped = undamped;
            o.rank_tolerance = rank_tolerance;
            o.hayati_angle = hayati_angle;
            o.reject_beyond = reject_beyond;
            o.bounds = std::move(bounds);
            o.threads = threads;
            return o;
          }),
          py::kw_only(), py::arg("free") = usual.free, py::arg("hold") = usual.hold, py::arg("effects") = usual.effects,
          py::arg("solver") = usual.solver, py::arg("loss") = usual.loss, py::arg("frame_by") = usual.frame_by,
          py::arg("rotation_length") = usual.rotation_length, py::arg("test_share") = usual.test_share,
          py::arg("seed") = usual.seed, py::arg("max_iterations") = usual.max_iterations,
          py::arg("initial_damping") = usual.initial_damping, py::arg("rms_fall") = usual.rms_fall,
          py::arg("gradient") = usual.gradient, py::arg("undamped") = usual.undamped,
          py::arg("rank_tolerance") = usual.rank_tolerance, py::arg("hayati_angle") = usual.hayati_angle,
          py::arg("reject_beyond") = usual.reject_beyond, py::arg("bounds") = usual.bounds,
          py::arg("threads") = usual.threads);
  cls.def_property(
      "free", [](const IdentifyOptions& o) { return tuple_of(o.free); },
      [](IdentifyOptions& o, std::vector<std::string> v) { o.free = std::move(v); },
      "Names and globs ('J2.*', '*.ratio'); empty: every geometric value, base and targets.");
  cls.def_property(
      "hold", [](const IdentifyOptions& o) { return tuple_of(o.hold); },
      [](IdentifyOptions& o, std::vector<std::string> v) { o.hold = std::move(v); },
      "Names and globs that stay at nominal whatever else is asked for.");
  cls.def_property(
      "effects", [](const IdentifyOptions& o) { return tuple_of(o.effects); },
      [](IdentifyOptions& o, std::vector<EffectRequest> v) { o.effects = std::move(v); }, "Effects to fit as well.");
  cls.def_readwrite("solver", &IdentifyOptions::solver, "'lm' (Levenberg-Marquardt) or 'ceres' (takes bounds).");
  cls.def_readwrite("loss", &IdentifyOptions::loss,
                    "'reject' (gross outliers are found, listed and left out), 'none', 'huber', 'cauchy' or 'tukey'.");
  cls.def_readwrite("frame_by", &IdentifyOptions::frame_by,
                    "The measurement frame: 'parameters' (six more), or 'svd' (registered after every step; "
                    "positions only).");
  cls.def_readwrite("rotation_length", &IdentifyOptions::rotation_length,
                    "[m] a rotation error of 1 rad counts as this length, where rows give no sigma.");
  cls.def_readwrite("test_share", &IdentifyOptions::test_share,
                    "Share of the pose groups held out when the data has no `set`.");
  cls.def_readwrite("seed", &IdentifyOptions::seed, "Of the split.");
  cls.def_readwrite("max_iterations", &IdentifyOptions::max_iterations, "The fit stops here at the latest.");
  cls.def_readwrite("initial_damping", &IdentifyOptions::initial_damping, "mu, on columns of unit norm.");
  cls.def_readwrite("rms_fall", &IdentifyOptions::rms_fall, "[m] stop when a step lowers the rms by no more.");
  cls.def_readwrite("gradient", &IdentifyOptions::gradient,
                    "Stop when the gradient of unit columns, relative to the residual's norm, is no more.");
  cls.def_readwrite("undamped", &IdentifyOptions::undamped, "mu = 0: plain least-squares iteration.");
  cls.def_readwrite("rank_tolerance", &IdentifyOptions::rank_tolerance,
                    "A unit column that the others explain but for this share is not observable.");
  cls.def_readwrite("hayati_angle", &IdentifyOptions::hayati_angle,
                    "[rad] neighbouring axes nearer to parallel get beta.");
  cls.def_readwrite("reject_beyond", &IdentifyOptions::reject_beyond,
                    "Loss 'reject': rows whose residual is longer than this many medians.");
  cls.def_property(
      "bounds", [](const IdentifyOptions& o) { return mapping_of(o.bounds); },
      [](IdentifyOptions& o, std::map<std::string, std::pair<double, double>> v) { o.bounds = std::move(v); },
      "(lowest, highest) by parameter; solver 'ceres' only.");
  cls.def_readwrite("threads", &IdentifyOptions::threads, "0: as many as the machine has.");
  cls.def("__repr__", [](const IdentifyOptions& o) {
    return std::string("IdentifyOptions(solver='") + word(o.solver) + "', loss='" + word(o.loss) +
           "', free: " + (o.free.empty() ? "default" : joined(o.free)) + ", " + std::to_string(o.effects.size()) +
           " effects)";
  });
  define_value(cls, {"free", "hold", "effects", "solver", "loss", "frame_by", "rotation_length", "test_share", "seed",
                     "max_iterations", "initial_damping", "rms_fall", "gradient", "undamped", "rank_tolerance",
                     "hayati_angle", "reject_beyond", "bounds", "threads"});
}

void bind_results(py::module_& m) {
  py::class_<Parameter> parameter(
      m, "Parameter",
      R"(One parameter of a result. Names: `J2.a`, `J3.ratio`, `tool.x`, `base.rz`, `backlash.J3` ...)");
  parameter.def_readonly("name", &Parameter::name, "Full name.");
  parameter.def_readonly("nominal", &Parameter::nominal, "Value before, in `unit`.");
  parameter.def_readonly("value", &Parameter::value, "Value found, in `unit`.");
  parameter.def_readonly("sigma", &Parameter::sigma, "Standard error, in `unit`; NaN when frozen.");
  parameter.def_readonly("unit", &Parameter::unit, "m, rad, -, rad/Nm ...");
  parameter.def_readonly("frozen", &Parameter::frozen, "Held at nominal, because the data cannot see it.");
  parameter.def("__repr__", [](const Parameter& p) { return repr(p); });

  py::class_<Frozen> frozen(m, "Frozen",
                            "A combination of parameters that the data cannot see: moving them together so "
                            "changes no measurement.");
  frozen.def_readonly("parameter", &Frozen::parameter, "The one held at nominal.");
  frozen.def_property_readonly(
      "combination", [](const Frozen& f) { return mapping_of(f.combination); },
      "Weight by parameter, 1 for `parameter`.");
  frozen.def_readonly("why", &Frozen::why, "Why it is frozen.");
  frozen.def("__repr__", [](const Frozen& f) { return "Frozen('" + f.parameter + "', " + f.why + ")"; });

  py::class_<ErrorStatistics> errors(m, "ErrorStatistics",
                                     "Length of the position (or distance) errors of a set of rows.");
  errors.def_readonly("rms", &ErrorStatistics::rms, "[m]");
  errors.def_readonly("mean", &ErrorStatistics::mean, "[m]");
  errors.def_readonly("median", &ErrorStatistics::median, "[m]");
  errors.def_readonly("p95", &ErrorStatistics::p95, "[m] 95th percentile.");
  errors.def_readonly("max", &ErrorStatistics::max, "[m]");
  errors.def_readonly("rotation_rms", &ErrorStatistics::rotation_rms, "[rad]; NaN: no orientation measured.");
  errors.def_readonly("n", &ErrorStatistics::n, "Number of rows.");
  errors.def("__repr__", [](const ErrorStatistics& e) { return repr(e); });

  py::class_<BeforeAfter> both(m, "BeforeAfter", "Errors before and after calibration.");
  both.def_readonly("before", &BeforeAfter::before, "Nominal robot with base, targets (anchor, fixed points) fitted.");
  both.def_readonly("after", &BeforeAfter::after, "Calibrated robot.");
  both.def("__repr__", [](const BeforeAfter& b) {
    return "BeforeAfter(before=" + repr(b.before) + ", after=" + repr(b.after) + ")";
  });

  py::class_<SolverSummary> solver(m, "SolverSummary", "How the solver ended.");
  solver.def_readonly("name", &SolverSummary::name, "'lm' or 'ceres'.");
  solver.def_readonly("iterations", &SolverSummary::iterations, "Steps made.");
  solver.def_readonly("converged", &SolverSummary::converged, "False: the result must not be used.");
  solver.def_readonly("stopped_because", &SolverSummary::stopped_because, "The reason, in words.");
  solver.def("__repr__", [](const SolverSummary& s) {
    return "SolverSummary('" + s.name + "', " + std::to_string(s.iterations) + " iterations, " +
           (s.converged ? "converged: " : "not converged: ") + s.stopped_because + ")";
  });

  py::class_<Identification> cls(m, "Identification", "What `identify` found.");
  cls.def_readonly("robot", &Identification::robot,
                   "Calibrated robot. Part of this result: copy() it before changing it.");
  cls.def_readonly("before", &Identification::before,
                   "Nominal robot with base and targets fitted. Part of this result.");
  cls.def_property_readonly(
      "parameters", [](const Identification& r) { return tuple_of(r.parameters); },
      "Every parameter asked for, frozen ones included.");
  cls.def(
      "parameter",
      [](const Identification& r, const std::string& name) {
        std::vector<std::string> names;
        for (const Parameter& p : r.parameters) {
          if (p.name == name) return p;
          names.push_back(p.name);
        }
        throw std::invalid_argument("there is no parameter '" + name + "'; there are: " + joined(names));
      },
      py::arg("name"), "The parameter of that name; raises InputError that lists the parameters there are.");
  cls.def_readonly(
      "covariance", &Identification::covariance,
      "shape=(rank, rank), of the fitted (not frozen) parameters in order of `parameters`, in their units.");
  cls.def_property_readonly(
      "frozen", [](const Identification& r) { return tuple_of(r.frozen); }, "What the data cannot see.");
  cls.def_readonly("train", &Identification::train, "Errors of the training rows [m].");
  cls.def_property_readonly(
      "test", [](const Identification& r) { return r.test; }, "Errors of the held-out rows [m], or None.");
  cls.def_property_readonly(
      "errors",
      [](const Identification& r) {
        std::map<std::string, BeforeAfter> by_set{{"train", r.train}};
        if (r.test) by_set["test"] = *r.test;
        return mapping_of(by_set);
      },
      "Errors [m] by set: 'train', and 'test' if rows were held out.");
  cls.def_property_readonly(
      "rejected_rows", [](const Identification& r) { return tuple_of(r.rejected_rows); },
      "Training rows (counted from 0) left out as gross outliers.");
  cls.def_property_readonly(
      "set",
      [](const Identification& r) {
        return py::array_t<std::int8_t>(static_cast<py::ssize_t>(r.set.size()), r.set.data());
      },
      "shape=(n,): 0 train, 1 test, for every row.");
  cls.def_property_readonly(
      "warnings", [](const Identification& r) { return tuple_of(r.warnings); }, "What to know before trusting it.");
  cls.def_readonly("solver", &Identification::solver, "How the solver ended.");
  cls.def_readonly("noise_sigma", &Identification::noise_sigma,
                   "[m] of one position component (or distance), from the training residuals.");
  cls.def_readonly("rotation_noise_sigma", &Identification::rotation_noise_sigma,
                   "[rad] of one rotation component; NaN: none measured.");
  cls.def_readonly("rank", &Identification::rank, "Number of parameters fitted.");
  cls.def_readonly("columns", &Identification::columns, "Number of parameters asked for.");
  cls.def("summary", &summary, "A few lines for people.");
  cls.def("__repr__", [](const Identification& r) {
    return formatted("Identification(%s, %d of %d parameters, train rms %.4g -> %.4g mm)",
                     r.solver.converged ? "converged" : "not converged", r.rank, r.columns, 1e3 * r.train.before.rms,
                     1e3 * r.train.after.rms);
  });

  py::class_<Prediction> prediction(m, "Prediction", "What the robot predicts for the rows of some data.");
  prediction.def_readonly("position", &Prediction::position, "shape=(n, 3) [m]: target in the measurement frame.");
  prediction.def_readonly("orientation", &Prediction::orientation, "shape=(n, 4): w x y z, w >= 0.");
  prediction.def_readonly("distance", &Prediction::distance, "shape=(n,) [m]; empty without an anchor.");
  prediction.def("__repr__",
                 [](const Prediction& p) { return "Prediction(" + std::to_string(p.position.rows()) + " rows)"; });

  py::class_<Residuals> residual(m, "Residuals", "Predicted minus measured; NaN where not measured.");
  residual.def_readonly("position", &Residuals::position, "shape=(n, 3) [m]");
  residual.def_readonly("rotation", &Residuals::rotation,
                        "shape=(n, 3) [rad]: twice the vector part of the error quaternion.");
  residual.def_readonly("distance", &Residuals::distance, "shape=(n,) [m]");
  residual.def("__repr__",
               [](const Residuals& r) { return "Residuals(" + std::to_string(r.position.rows()) + " rows)"; });
}

}  // namespace

void bind_identify(py::module_& m) {
  bind_options(m);
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

void bind_plan(py::module_& m) {
  const PlanOptions usual;
  py::class_<PlanOptions> cls(m, "PlanOptions", "How `plan` works; see the attributes.");
  cls.def(py::init([](int poses, double min_step, double min_step_prismatic, Observability index, bool orientation,
                      double position_sigma, double rotation_sigma, int sweeps, int proposals, std::uint64_t seed,
                      std::vector<std::string> free, std::vector<EffectRequest> effects) {
            return PlanOptions{poses,       min_step,       min_step_prismatic, index,
                               orientation, position_sigma, rotation_sigma,     sweeps,
                               proposals,   seed,           std::move(free),    std::move(effects)};
          }),
          py::kw_only(), py::arg("poses") = usual.poses, py::arg("min_step") = usual.min_step,
          py::arg("min_step_prismatic") = usual.min_step_prismatic, py::arg("index") = usual.index,
          py::arg("orientation") = usual.orientation, py::arg("position_sigma") = usual.position_sigma,
          py::arg("rotation_sigma") = usual.rotation_sigma, py::arg("sweeps") = usual.sweeps,
          py::arg("proposals") = usual.proposals, py::arg("seed") = usual.seed, py::arg("free") = usual.free,
          py::arg("effects") = usual.effects);
  cls.def_readwrite("poses", &PlanOptions::poses, "Number of poses.");
  cls.def_readwrite("min_step", &PlanOptions::min_step, "[rad] every revolute joint moves by more between neighbours.");
  cls.def_readwrite("min_step_prismatic", &PlanOptions::min_step_prismatic, "[m] the same for prismatic joints.");
  cls.def_readwrite("index", &PlanOptions::index, R"(What the plan makes large.

'd_optimal' (determinant; O1 of Borm and Menq 1989), 'a_optimal' (minus the sum of variances), 'e_optimal' (smallest
singular value; O3 of Nahvi et al. 1994), 'inverse_condition' (O2 of Driels and Pathre 1990) or 'noise_amplification'
(O4 of Nahvi and Hollerbach 1996).)");
  cls.def_readwrite("orientation", &PlanOptions::orientation, "Full poses are measured, not only positions.");
  cls.def_readwrite("position_sigma", &PlanOptions::position_sigma,
                    "[m] of one component, for the standard errors promised.");
  cls.def_readwrite("rotation_sigma", &PlanOptions::rotation_sigma, "[rad]");
  cls.def_readwrite("sweeps", &PlanOptions::sweeps, "Passes of exchange over all poses.");
  cls.def_readwrite("proposals", &PlanOptions::proposals, "Candidates tried for a pose in a pass.");
  cls.def_readwrite("seed", &PlanOptions::seed, "Of the random start and the candidates.");
  cls.def_property(
      "free", [](const PlanOptions& o) { return tuple_of(o.free); },
      [](PlanOptions& o, std::vector<std::string> v) { o.free = std::move(v); }, "As in `identify`.");
  cls.def_property(
      "effects", [](const PlanOptions& o) { return tuple_of(o.effects); },
      [](PlanOptions& o, std::vector<EffectRequest> v) { o.effects = std::move(v); },
      "Effects that shall be seen as well.");
  cls.def("__repr__", [](const PlanOptions& o) {
    return "PlanOptions(" + std::to_string(o.poses) + " poses, '" + word(o.index) + "')";
  });
  define_value(cls, {"poses", "min_step", "min_step_prismatic", "index", "orientation", "position_sigma",
                     "rotation_sigma", "sweeps", "proposals", "seed", "free", "effects"});

  py::class_<PlanResult> result(m, "PlanResult", "What `plan` found.");
  result.def_readonly("joints", &PlanResult::joints, "shape=(poses, driven joints) [rad | m]");
  result.def_property_readonly(
      "parameters", [](const PlanResult& r) { return tuple_of(r.parameters); },
      "sigma: the standard error that this plan promises.");
  result.def_property_readonly(
      "frozen", [](const PlanResult& r) { return tuple_of(r.frozen); }, "What no plan of this kind could see.");
  result.def_readonly("index_start", &PlanResult::index_start,
                      "Index of the random plan that the exchange began with.");
  result.def_readonly("index_end", &PlanResult::index_end, "Index of this plan.");
  result.def_readonly("exchanges", &PlanResult::exchanges, "Poses exchanged.");
  result.def("__repr__", [](const PlanResult& r) {
    return "PlanResult(" + std::to_string(r.joints.rows()) + " poses, index " + text(r.index_start) + " -> " +
           text(r.index_end) + ")";
  });

  m.def(
      "plan",
      [](const Robot& given_robot, const std::optional<PlanOptions>& given) {
        const PlanOptions options = given.value_or(PlanOptions{});
        const Robot robot = given_robot;
        const py::gil_scoped_release unlocked;
        return plan(robot, options);
      },
      py::arg("robot"), py::arg("options") = py::none(),
      R"(Measurement poses by exchange on an observability index.

Revolute joints without limits use -pi ... pi. Raises InputError: fewer poses than the parameters need, a joint whose range is too
small for `min_step`.)");
}

}  // namespace truing::python
