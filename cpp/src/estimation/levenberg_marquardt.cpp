// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The palletizer method's iteration: H = J^T J + mu I, g = J^T l, eta <- eta + H^-1 g; mu / 10 after a step that lowers
// the rms, mu * 10 after one that does not (and that step is taken back). Columns are scaled to unit length first:
// metres and radians must not meet unscaled in one mu I. With mu = 0 it is the least-squares iteration of the
// differential error model, dxi = (Psi^T Psi)^-1 Psi^T dP.

#include <algorithm>
#include <cmath>
#include <string>

#include <Eigen/Cholesky>

#include "estimation/solvers.hpp"

namespace truing::estimation {
namespace {

constexpr double kLeastDamping = 1e-15;
constexpr double kMostDamping = 1e12;
constexpr double kRounding =
    1e-13;  // a smaller predicted fall of the cost, relative to it, is lost in the sum's rounding

struct Step {
  Eigen::VectorXd delta;
  double predicted_fall = 0.0;   ///< of the cost r^T r
  double scaled_gradient = 0.0;  ///< largest entry, columns of unit length
};

Step solve_step(const NormalEquations& normal, double mu) {
  Eigen::VectorXd scale = normal.gram.diagonal();
  for (double& s : scale) s = s > 0.0 ? 1.0 / std::sqrt(s) : 1.0;
  Eigen::MatrixXd h = scale.asDiagonal() * normal.gram * scale.asDiagonal();
  const Eigen::VectorXd g = scale.cwiseProduct(normal.gradient);
  h.diagonal().array() += mu;
  const Eigen::VectorXd step = -h.llt().solve(g);
  Step out;
  out.delta = scale.cwiseProduct(step);
  out.predicted_fall = -step.dot(g) + mu * step.squaredNorm();  // |r|^2 - |r + J step|^2 for the damped step
  out.scaled_gradient = g.size() ? g.cwiseAbs().maxCoeff() : 0.0;
  return out;
}

Eigen::VectorXd moved(const Eigen::VectorXd& values, const std::vector<int>& free, const Eigen::VectorXd& delta) {
  Eigen::VectorXd out = values;
  for (std::size_t k = 0; k < free.size(); ++k) out[free[k]] += delta[static_cast<Eigen::Index>(k)];
  return out;
}

}  // namespace

SolverSummary levenberg_marquardt(const Evaluator& problem, const Weighing& weighing, const SolverOptions& options,
                                  const Refit& refit, Eigen::VectorXd* values) {
  SolverSummary summary;
  summary.name = "lm";
  NormalEquations now, next;
  problem.normal_equations(*values, weighing, &now);
  double mu = options.undamped ? 0.0 : options.initial_damping;
  const auto stop = [&](const std::string& why, bool converged) {
    summary.stopped_because = why;
    summary.converged = converged;
    return summary;
  };
  if (problem.free().empty()) return stop("nothing to fit", true);

  while (summary.iterations < options.max_iterations) {
    const Step step = solve_step(now, mu);
    if (!step.delta.allFinite()) {
      if (mu >= kMostDamping || options.undamped) return stop("the normal equations are singular", false);
      mu = std::max(10.0 * mu, kLeastDamping);
      continue;
    }
    if (step.scaled_gradient <= options.gradient * std::sqrt(now.cost)) return stop("gradient below its bound", true);
    ++summary.iterations;
    const bool within_rounding = step.predicted_fall <= kRounding * now.cost;
    Eigen::VectorXd trial = moved(*values, problem.free(), step.delta);
    if (refit) refit(&trial);
    if (within_rounding) {
      if (mu <= 1e-6) *values = trial;  // as good as a Gauss-Newton step, too small for the cost to judge
      return stop("predicted fall of the cost below rounding", true);
    }
    problem.normal_equations(trial, weighing, &next);
    if (std::isfinite(next.cost) && (next.cost < now.cost || options.undamped)) {
      const double fall = now.rms() - next.rms();
      *values = trial;
      std::swap(now, next);
      mu = options.undamped ? 0.0 : std::max(mu / 10.0, kLeastDamping);
      if (fall >= 0.0 && fall <= options.rms_fall) return stop("fall of the rms below its bound", true);
    } else {
      // The step was taken back; nothing is lost when it promised no more than the bound.
      const double promised =
          now.rms() - std::sqrt(std::max(0.0, now.cost - step.predicted_fall) / static_cast<double>(now.components));
      if (promised <= options.rms_fall) return stop("predicted fall of the rms below its bound", true);
      if (options.undamped || mu >= kMostDamping) return stop("no step lowers the rms", false);
      mu *= 10.0;
    }
  }
  return stop("iteration limit", false);
}

}  // namespace truing::estimation
