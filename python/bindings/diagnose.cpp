// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/diagnose.hpp"
#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/own_effects.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "repr.hpp"

namespace truing::python {

namespace {

std::string repr(const Share& s) {
  return "Share(" + text(s.value) + ", " + text(s.low) + " ... " + text(s.high) + ")";
}

std::string repr(const Curve& c) {
  return "Curve('" + c.site + "' over '" + c.input + "', " + std::to_string(c.points.size()) + " points)";
}

std::string repr(const FoundEffect& e) {
  return "FoundEffect(" + at_joints(e.effect, e.joints) + ", probability " + text(e.probability) + ")";
}

std::string repr(const UnknownEffect& u) {
  const std::string what = u.looks_like.empty() ? "a function of " + joined(u.inputs) : u.looks_like;
  return "UnknownEffect(" + at_joints(what, u.joint.empty() ? std::vector<std::string>{} : std::vector{u.joint}) +
         ", probability " + text(u.probability) + ")";
}

std::string repr(const Diagnosis& d) {
  return std::string("Diagnosis('") + word(d.verdict) + "', " + std::to_string(d.effects.size()) +
         " effects, held-out rms " + millimetres(d.gap.rms, 4) + " -> " + millimetres(d.after.rms, 4) + ")";
}

std::string summary(const Diagnosis& d) {
  std::string out = d.sentence + "\nheld-out rms " + millimetres(d.gap.rms, 4) + " -> " + millimetres(d.after.rms, 4) +
                    ", noise " + millimetres(d.noise_floor, 4) + "\n";
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

/// The inferred directions, shape (n, driven joints); None where the data had them.
std::optional<py::array_t<double>> directions_of(const Diagnosis& d) {
  if (d.directions.empty()) return std::nullopt;
  const std::size_t rows = d.directions.front().size();
  py::array_t<double> out({rows, d.directions.size()});
  auto to = out.mutable_unchecked<2>();
  for (std::size_t j = 0; j < d.directions.size(); ++j)
    for (std::size_t i = 0; i < rows; ++i) to(i, j) = d.directions[j].at(i);
  return read_only(std::move(out));
}

void bind_findings(py::module_& m) {
  auto share = define_result<Share>(m, "Share");
  share.def("__repr__", [](const Share& s) { return repr(s); });

  auto fall = define_result<HeldOutFall>(m, "HeldOutFall");
  fall.def("__repr__", [](const HeldOutFall& f) {
    return "HeldOutFall(" + millimetres(f.mean) + " +- " + millimetres(f.sigma) + ", " + std::to_string(f.poses) +
           " poses)";
  });

  auto alternative = define_result<Alternative>(m, "Alternative");
  alternative.def("__repr__",
                  [](const Alternative& a) { return "Alternative(" + at_joints(a.effect, a.joints) + ")"; });

  auto curve = define_result<Curve>(m, "Curve");
  curve.def("__repr__", [](const Curve& c) { return repr(c); });

  auto found = define_result<FoundEffect>(m, "FoundEffect");
  found.def("__repr__", [](const FoundEffect& e) { return repr(e); });

  auto unknown = define_result<UnknownEffect>(m, "UnknownEffect");
  unknown.def("__repr__", [](const UnknownEffect& u) { return repr(u); });
}

void bind_limits(py::module_& m) {
  auto detectable = define_result<Detectable>(m, "Detectable");
  detectable.def("__repr__", [](const Detectable& d) {
    return "Detectable(" + d.parameter + " >= " + text(d.size) + " " + d.unit + ")";
  });

  auto candidate = define_result<Candidate>(m, "Candidate");
  candidate.def("__repr__", [](const Candidate& c) {
    return "Candidate(" + at_joints(c.effect, c.joints) + ", gain " + text(c.gain) + ")";
  });

  auto sanity = define_result<SanityFinding>(m, "SanityFinding");
  sanity.def("__repr__", [](const SanityFinding& s) { return "SanityFinding(" + s.kind + ": " + s.text + ")"; });

  auto next = define_result<NextPose>(m, "NextPose");
  next.def("__repr__", [](const NextPose& p) { return "NextPose(" + p.why + ")"; });
}

void bind_where(py::module_& m) {
  auto joint = define_result<WhereJoint>(m, "WhereJoint");
  joint.def("__repr__", [](const WhereJoint& w) { return "WhereJoint('" + w.joint + "', " + repr(w.share) + ")"; });

  auto input = define_result<WhereInput>(m, "WhereInput");
  input.def("__repr__", [](const WhereInput& w) {
    return "WhereInput('" + w.input + "', " + formatted("%.3g %%", 1e2 * w.share) + ")";
  });

  auto cell = define_result<WorkspaceCell>(m, "WorkspaceCell");
  cell.def("__repr__", [](const WorkspaceCell& c) {
    return "WorkspaceCell(rms=" + millimetres(c.rms, 4) + ", n=" + std::to_string(c.n) + ")";
  });
}

void bind_diagnosis(py::module_& m) {
  auto cls = define_result<Diagnosis>(m, "Diagnosis", {"directions"});
  cls.def_property_readonly("directions", &directions_of,
                            "shape=(n, driven joints): approach directions that were inferred from the order of the "
                            "rows; None: the data had them.");
  cls.def("summary", &summary, "A few lines for people.");
  cls.def("__repr__", [](const Diagnosis& d) { return repr(d); });
}

}  // namespace

void bind_diagnose(py::module_& m) {
  define_options<DiagnoseOptions>(m, "DiagnoseOptions");
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
