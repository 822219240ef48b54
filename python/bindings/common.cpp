// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/options.hpp"
#include "convert/text.hpp"
#include "parts.hpp"
#include "repr.hpp"
#include "tables/common/error_statistics.hpp"
#include "tables/common/not_testable.hpp"
#include "tables/common/parameter.hpp"
#include "tables/common/solver_options.hpp"
#include "tables/common/uncertain_frame.hpp"

namespace truing::python {

std::string repr(const ErrorStatistics& e) {
  return "ErrorStatistics(rms=" + text(e.rms) + ", p95=" + text(e.p95) + ", max=" + text(e.max) +
         " m, n=" + std::to_string(e.n) + ")";
}

std::string at_joints(const std::string& effect, const std::vector<std::string>& joints) {
  return effect + (joints.empty() ? "" : " at " + joined(joints));
}

namespace {

std::string repr(const Parameter& p) {
  const std::string unit = p.unit.empty() || p.unit == "-" ? "" : " " + p.unit;
  return "Parameter('" + p.name + "', " + text(p.value) +
         (p.frozen ? unit + ", frozen" : formatted(" +- %.2g", p.sigma) + unit) + ", nominal " + text(p.nominal) + ")";
}

std::string repr(const SolverSummary& s) {
  return "SolverSummary('" + s.name + "', " + std::to_string(s.iterations) + " iterations, " +
         (s.converged ? "converged: " : "not converged: ") + s.stopped_because + ")";
}

}  // namespace

void bind_common(py::module_& m) {
  auto parameter = define_result<Parameter>(m, "Parameter");
  parameter.def("__repr__", [](const Parameter& p) { return repr(p); });

  auto frozen = define_result<Frozen>(m, "Frozen");
  frozen.def("__repr__", [](const Frozen& f) { return "Frozen('" + f.parameter + "', " + f.why + ")"; });

  auto errors = define_result<ErrorStatistics>(m, "ErrorStatistics");
  errors.def("__repr__", [](const ErrorStatistics& e) { return repr(e); });

  auto solver = define_result<SolverSummary>(m, "SolverSummary");
  solver.def("__repr__", [](const SolverSummary& s) { return repr(s); });

  auto not_testable = define_result<NotTestable>(m, "NotTestable");
  not_testable.def("__repr__", [](const NotTestable& n) {
    return "NotTestable(" + at_joints(n.effect, n.joints) + ": " + n.why + ")";
  });

  auto frame = define_result<UncertainFrame>(m, "UncertainFrame");
  frame.def_property_readonly(
      "sigma",
      [](const UncertainFrame& f) {
        return array_from(Eigen::Matrix<double, 6, 1>(f.covariance.diagonal().cwiseMax(0.0).cwiseSqrt()));
      },
      "shape=(6,): standard errors of x, y, z [m] and of the turns about x, y, z [rad].");
  frame.def("__repr__", [](const UncertainFrame& f) {
    return "UncertainFrame(at " + text(Eigen::Vector3d(f.T.translation())) + " m)";
  });
}

}  // namespace truing::python
