// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Nonlinear least squares of a few unknowns: minimise r^T W r, where a step d of the unknowns makes r + J d of the
// residuals. The unknowns stay with the problem, which may turn frames, wrap angles or clamp steps as it moves.
//
//   gauss_newton         takes every step; for problems that start near and whose weights change on the way
//   levenberg_marquardt  takes a step back that does not lower the cost
//   eliminate, recover   unknowns that only one block of rows sees, by their Schur complement
//
// Both report why they stopped as a value; text is made where somebody reads it.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "math/linear_algebra.hpp"

#include "rooms.hpp"

namespace truing::math {

/// Normal equations where a problem stands: gram * step = -gradient.
template <int N = Eigen::Dynamic>
struct NormalSystem {
  Eigen::Matrix<double, N, N> gram;      ///< J^T W J
  Eigen::Matrix<double, N, 1> gradient;  ///< J^T W r
  double cost = 0.0;                     ///< r^T W r
};

enum class StopReason {
  settled,          ///< the problem said so (gauss_newton)
  nothing_to_fit,   ///< no unknowns
  gradient,         ///< all but orthogonal to the residuals
  rounding,         ///< the predicted fall of the cost is lost in its rounding
  small_fall,       ///< the last step lowered the cost by no more than is worth going on for
  small_promise,    ///< the last step failed, and had promised no more than that
  iteration_limit,  ///< from here on: not converged
  singular,         ///< the normal equations have no solution
  no_descent,       ///< no step lowers the cost, however damped
};

inline bool converged(StopReason reason) { return reason < StopReason::iteration_limit; }

/// How an iteration ended.
struct Iterations {
  int steps = 0;  ///< tried
  StopReason reason = StopReason::iteration_limit;
};

// ---- Gauss-Newton ---------------------------------------------------------------------------------------------------

/// The plain step; not finite where the system has none.
struct CholeskyStep {
  template <int N>
  Eigen::Matrix<double, N, 1> operator()(const NormalSystem<N>& system) const {
    return -solve_symmetric<Eigen::Dynamic, 1>(system.gram, system.gradient);
  }
};

/// A problem has
///   NormalSystem<N> system();                              normal equations where it stands
///   void move(step);                                       goes there
///   bool settled(const NormalSystem<N>& system, step);     after the move: may weigh anew; true ends the iteration
/// `solve(system)` gives the step, not finite where there is none.
template <typename Problem, typename Solve = CholeskyStep>
Iterations gauss_newton(Problem* problem, int max_iterations, const Solve& solve = {}) {
  Iterations out;
  while (out.steps < max_iterations) {
    const auto system = problem->system();
    const auto step = solve(system);
    if (!step.allFinite()) return {out.steps, StopReason::singular};
    ++out.steps;
    problem->move(step);
    if (problem->settled(system, step)) return {out.steps, StopReason::settled};
  }
  return out;
}

// ---- Levenberg-Marquardt --------------------------------------------------------------------------------------------

struct LevenbergMarquardtOptions {
  int max_steps = std::numeric_limits<int>::max();           ///< tried
  int max_linearisations = std::numeric_limits<int>::max();  ///< steps taken
  int max_failures = std::numeric_limits<int>::max();        ///< in a row
  double damping = 1e-3;        ///< mu to begin with, on columns of unit length; 0: plain until a step fails
  double least_damping = 1e-6;  ///< mu is divided by ten after a step that lowers the cost, down to this
  double first_damping = 1e-3;  ///< multiplied by ten after one that does not, and at least this
  double most_damping = 1e12;   ///< not beyond
  bool undamped = false;        ///< mu = 0, and every step is taken
  double gradient = 0.0;        ///< done when |g| of unit columns is no more of the residuals' length
  /// Is a fall of the cost, from one value to another, so small that this was the last step? Empty: never.
  std::function<bool(double from, double to)> small_fall;
  /// The same of a fall that a step promised, and did not keep. Empty: never.
  std::function<bool(double from, double to)> small_promise;
};

/// A step of the damped system, its columns scaled to unit length first: metres and radians must not meet unscaled in
/// one mu I.
template <int N>
struct DampedStep {
  Eigen::Matrix<double, N, 1> delta;
  double predicted_fall = 0.0;   ///< of the cost
  double scaled_gradient = 0.0;  ///< largest entry, columns of unit length
};

template <int N>
DampedStep<N> damped_step(const NormalSystem<N>& system, double mu) {
  const Eigen::Matrix<double, N, 1> scale = unit_scale<N>(system.gram);
  Eigen::Matrix<double, N, N> h = scale.asDiagonal() * system.gram * scale.asDiagonal();
  const Eigen::Matrix<double, N, 1> g = scale.cwiseProduct(system.gradient);
  h.diagonal().array() += mu;
  const Eigen::Matrix<double, N, 1> step = -solve_definite<Eigen::Dynamic, 1>(h, g);
  DampedStep<N> out;
  out.delta = scale.cwiseProduct(step);
  out.predicted_fall = -step.dot(g) + mu * step.squaredNorm();  // |r|^2 - |r + J step|^2 for the damped step
  out.scaled_gradient = g.size() ? g.cwiseAbs().maxCoeff() : 0.0;
  return out;
}

/// H = J^T W J + mu I, d = -H^-1 J^T W r (Levenberg 1944, Marquardt 1963). A problem has
///   const NormalSystem<N>& system();   normal equations where it stands; asked for once after every step taken
///   double attempt(step);              cost where the step leads, which is kept in mind; not finite: it leads nowhere
///   void accept();                     goes there
///   void move(step);                   goes where a last step leads, without asking for the cost there
template <typename Problem>
Iterations levenberg_marquardt(Problem* problem, const LevenbergMarquardtOptions& options) {
  constexpr double kRounding = 1e-13;  // of the cost: a smaller predicted fall is lost in the sum's rounding
  constexpr double kPlain = 1e-6;      // least damping that makes a difference
  Iterations out;
  const auto stop = [&](StopReason reason) { return Iterations{out.steps, reason}; };
  double mu = options.undamped ? 0.0 : options.damping;
  for (int linearisation = 0; linearisation < options.max_linearisations; ++linearisation) {
    const auto& system = problem->system();
    if (system.gradient.size() == 0) return stop(StopReason::nothing_to_fit);
    const double cost = system.cost;
    for (int failures = 0;;) {
      if (out.steps >= options.max_steps) return stop(StopReason::iteration_limit);
      const auto step = damped_step(system, mu);
      if (!step.delta.allFinite()) {
        if (mu >= options.most_damping || options.undamped) return stop(StopReason::singular);
        mu = std::max(10.0 * mu, options.first_damping);
        continue;
      }
      if (step.scaled_gradient <= options.gradient * std::sqrt(cost)) return stop(StopReason::gradient);
      ++out.steps;
      if (step.predicted_fall <= kRounding * cost) {
        if (mu <= kPlain) problem->move(step.delta);  // as good as a plain step, too small for the cost to judge
        return stop(StopReason::rounding);
      }
      const double next = problem->attempt(step.delta);
      if (std::isfinite(next) && (next < cost || options.undamped)) {
        problem->accept();
        mu = options.undamped ? 0.0 : std::max(mu / 10.0, options.least_damping);
        if (options.small_fall && options.small_fall(cost, next)) return stop(StopReason::small_fall);
        break;
      }
      if (options.small_promise && options.small_promise(cost, std::max(0.0, cost - step.predicted_fall)))
        return stop(StopReason::small_promise);
      if (options.undamped || mu >= options.most_damping || ++failures >= options.max_failures)
        return stop(StopReason::no_descent);
      mu = std::max(10.0 * mu, options.first_damping);
    }
  }
  return out;
}

// ---- Schur complement -----------------------------------------------------------------------------------------------

/// Normal equations of one block of rows: N unknowns that all blocks share, L that are this block's own.
template <int N, int L>
struct BlockSystem {
  NormalSystem<N> shared{Eigen::Matrix<double, N, N>::Zero(), Eigen::Matrix<double, N, 1>::Zero(), 0.0};
  Eigen::Matrix<double, L, L> own = Eigen::Matrix<double, L, L>::Zero();
  Eigen::Matrix<double, L, N> cross = Eigen::Matrix<double, L, N>::Zero();  ///< own by shared
  Eigen::Matrix<double, L, 1> own_gradient = Eigen::Matrix<double, L, 1>::Zero();

  /// Adds rows with derivatives J by the shared and K by the own unknowns, residuals r, weights w.
  template <int Rows>
  void add(const Eigen::Matrix<double, Rows, N>& J, const Eigen::Matrix<double, Rows, L>& K,
           const Eigen::Matrix<double, Rows, 1>& r, const Eigen::Matrix<double, Rows, 1>& w) {
    const auto WJ = (w.asDiagonal() * J).eval();
    const auto WK = (w.asDiagonal() * K).eval();
    shared.gram.noalias() += J.transpose() * WJ;
    shared.gradient.noalias() += WJ.transpose() * r;
    shared.cost += r.dot(w.cwiseProduct(r));
    own.noalias() += K.transpose() * WK;
    cross.noalias() += K.transpose() * WJ;
    own_gradient.noalias() += WK.transpose() * r;
  }
};

/// What the block says of the shared unknowns when its own are free: the Schur complement of `own`. The cost stays that
/// of where the problem stands.
template <int N, int L>
NormalSystem<N> eliminate(const BlockSystem<N, L>& block) {
  const auto factor = block.own.ldlt();
  NormalSystem<N> out = block.shared;
  out.gram -= block.cross.transpose() * factor.solve(block.cross);
  out.gradient -= block.cross.transpose() * factor.solve(block.own_gradient);
  return out;
}

/// The step of the block's own unknowns that belongs to a step of the shared ones.
template <int N, int L>
Eigen::Matrix<double, L, 1> recover(const BlockSystem<N, L>& block, const Eigen::Matrix<double, N, 1>& step) {
  return -block.own.ldlt().solve(block.own_gradient + block.cross * step);
}

}  // namespace truing::math
