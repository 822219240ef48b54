// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The palletizer method's iteration: H = J^T J + mu I, g = J^T l, eta <- eta + H^-1 g; mu / 10 after a step that lowers
// the rms, mu * 10 after one that does not (and that step is taken back). Columns are scaled to unit length first:
// metres and radians must not meet unscaled in one mu I. With mu = 0 it is the least-squares iteration of the
// differential error model, dxi = (Psi^T Psi)^-1 Psi^T dP.

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "estimation/solvers.hpp"
#include "math/gauss_newton.hpp"

namespace truing::estimation {
namespace {

/// Where the fit stands, and where the step that is tried would lead.
class Fit {
 public:
  Fit(const Evaluator& problem, const Weighing& weighing, const Refit& refit, Eigen::VectorXd* values)
      : problem_(problem), weighing_(weighing), refit_(refit), values_(*values) {
    problem_.normal_equations(values_, weighing_, &now_);
  }

  const NormalEquations& system() const { return now_; }

  double attempt(const Eigen::VectorXd& step) {
    trial_ = moved(step);
    problem_.normal_equations(trial_, weighing_, &next_);
    return next_.cost;
  }

  void accept() {
    values_ = trial_;
    std::swap(now_, next_);
  }

  void move(const Eigen::VectorXd& step) { values_ = moved(step); }

  /// Of residuals with this cost.
  double rms(double cost) const { return std::sqrt(cost / static_cast<double>(now_.components)); }

 private:
  Eigen::VectorXd moved(const Eigen::VectorXd& step) const {
    Eigen::VectorXd out = values_;
    for (std::size_t k = 0; k < problem_.free().size(); ++k)
      out[problem_.free()[k]] += step[static_cast<Eigen::Index>(k)];
    if (refit_) refit_(&out);
    return out;
  }

  const Evaluator& problem_;
  const Weighing& weighing_;
  const Refit& refit_;
  Eigen::VectorXd& values_;
  Eigen::VectorXd trial_;
  NormalEquations now_, next_;
};

const char* text_of(StopReason reason) {
  switch (reason) {
    case StopReason::settled:
      break;
    case StopReason::nothing_to_fit:
      return "nothing to fit";
    case StopReason::gradient:
      return "gradient below its bound";
    case StopReason::rounding:
      return "predicted fall of the cost below rounding";
    case StopReason::small_fall:
      return "fall of the rms below its bound";
    case StopReason::small_promise:
      return "predicted fall of the rms below its bound";
    case StopReason::iteration_limit:
      return "iteration limit";
    case StopReason::singular:
      return "the normal equations are singular";
    case StopReason::no_descent:
      return "no step lowers the rms";
  }
  return "settled";
}

}  // namespace

SolverSummary levenberg_marquardt(const Evaluator& problem, const Weighing& weighing, const SolverOptions& options,
                                  const Refit& refit, Eigen::VectorXd* values) {
  Fit fit(problem, weighing, refit, values);
  LevenbergMarquardtOptions rules;
  rules.max_steps = options.max_iterations;
  rules.damping = options.initial_damping;
  rules.least_damping = rules.first_damping = 1e-15;
  rules.undamped = options.undamped;
  rules.gradient = options.gradient;
  rules.small_fall = [&](double from, double to) {
    const double fall = fit.rms(from) - fit.rms(to);
    return fall >= 0.0 && fall <= options.rms_fall;
  };
  rules.small_promise = [&](double from, double to) { return fit.rms(from) - fit.rms(to) <= options.rms_fall; };
  const Iterations iterations = math::levenberg_marquardt(&fit, rules);
  return {"lm", iterations.steps, converged(iterations.reason), text_of(iterations.reason)};
}

}  // namespace truing::estimation
