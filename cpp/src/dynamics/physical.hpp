// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Inertial parameters that a body can have: with positive definite pseudo-inertia (Wensing, Kim and Slotine 2018,
// Linear matrix inequalities for physically consistent inertial parameter identification). Least squares alone often
// gives links that no simulator can run.

#include <string>
#include <vector>

#include <Eigen/Core>

#include "math/gauss_newton.hpp"
#include "rooms.hpp"
#include "truing/dynamics/regressor.hpp"

namespace truing::dynamics {

/// Sum of m [r; 1] [r; 1]^T over the points of a body: [Sigma h; h^T m] with Sigma = tr(I) / 2 - I. Some distribution
/// of mass has the parameters exactly if this is positive definite.
Eigen::Matrix4d pseudo_inertia(const LinkParameters& parameters);
LinkParameters parameters_of(const Eigen::Matrix4d& pseudo_inertia);

struct PhysicalOptions {
  double spread = 0.5;         ///< [-] relative change of a link's inertia that the nominal may well be wrong by
  double least_mass = 0.01;    ///< [kg] nominal links are given at least this
  double least_radius = 0.01;  ///< [m] and at least this radius of gyration in every direction
  int max_steps = 500;         ///< of Newton's method
};

/// A nominal link that no body could have, and what it was made.
struct LiftedLink {
  std::string joint;
  LinkParameters from, to;
};

struct PhysicalInertias {
  Eigen::VectorXd parameters;           ///< shape=(10 * joints,) as of `link_parameters`
  Robot robot;                          ///< nominal with these
  double increase = 0.0;                ///< of the sum of squares, over that of unconstrained least squares
  Eigen::VectorXd smallest_eigenvalue;  ///< of each link's pseudo-inertia, positive
  /// Of each link from its (lifted) nominal: length of the logarithms of the eigenvalues of P_nominal^-1 P, whatever
  /// the units and frames: .1 is about 10 % in one direction.
  Eigen::VectorXd distance;
  std::vector<LiftedLink> lifted;
  int steps = 0;
  StopReason reason = StopReason::iteration_limit;
};

/// What is minimised, in x: P = L (1 + X) L^T with L L^T the nominal pseudo-inertia and X symmetric (its ten numbers x,
/// those off the diagonal times sqrt 2). Half the sum of squares, and `weight` times the Bregman divergence of -log
/// det, tr X - log det (1 + X), which for small x is |x|^2 / 2 and beyond any bound at the border: convex in x as a
/// whole, so that there is one minimum.
class PhysicalObjective {
 public:
  /// `nominal`: positive definite. Directions that `information` sees less than 1e-12 as well as its best are taken for
  /// unseen.
  PhysicalObjective(const Eigen::VectorXd& nominal, const Eigen::MatrixXd& information,
                    const Eigen::VectorXd& gradient);

  /// Derivatives at x, in coordinates y in which the body there is the unit matrix: x + to_x(y). So the curvature of
  /// the divergence is the unit matrix however near to the border.
  struct Local {
    std::vector<Eigen::Matrix<double, 10, 10>> blocks;  ///< of each link: x = this * y
    /// The gradient is rows^T residuals, the second derivative rows^T rows: as rows, since where a body grew far beyond
    /// its nominal a Gram would have no digits left for what the data do not see.
    Eigen::MatrixXd rows;
    Eigen::VectorXd residuals;

    Eigen::VectorXd to_x(const Eigen::VectorXd& y) const;
  };
  Local local(const Eigen::VectorXd& x, double weight) const;
  /// From x on along a step: f(t) - f(0) = slope t + curvature t^2 / 2 - weight sum log(1 + t relative).
  struct Line {
    double slope = 0.0, curvature = 0.0, weight = 0.0;
    Eigen::VectorXd relative;  ///< change of the eigenvalues of every link's 1 + X, over themselves

    double change(double t) const;
    double slope_at(double t) const;
    /// Where it is lowest.
    double lowest() const;
  };
  Line along(const Eigen::VectorXd& x, const Eigen::VectorXd& step, double weight) const;

  Eigen::VectorXd parameters(const Eigen::VectorXd& x) const;
  /// Where `parameters` are these.
  Eigen::VectorXd x_of(const Eigen::VectorXd& parameters) const;
  double increase(const Eigen::VectorXd& x) const;  ///< of the sum of squares over its smallest
  /// Least squares, with eigenvalues that no body has raised to a little above nought.
  Eigen::VectorXd nearest_body() const;
  /// Positive definite beyond doubt of rounding.
  bool is_body(const Eigen::VectorXd& x) const;
  /// Slope of the sum of squares there, in y.
  double pull(const Eigen::VectorXd& x) const;
  Eigen::Index size() const { return fit_.size(); }

 private:
  Eigen::VectorXd nominal_;
  std::vector<Eigen::Matrix<double, 10, 10>> to_parameters_;  ///< of each link: change of parameters = this * x
  Eigen::MatrixXd root_;                                      ///< root_^T root_ is the information in x
  Eigen::VectorXd fit_;                                       ///< x of the shortest unconstrained least squares
};

/// The inertial parameters that a body can have which fit best: minimum of pi^T H pi / 2 - g^T pi plus a prior that
/// keeps near the nominal what the data cannot see (Lee, Wensing and Park 2020, Geometric robot dynamic identification:
/// a convex programming approach). By Newton's method along the central path (Boyd and Vandenberghe 2004, 11.3), which
/// cannot be caught in a minimum that is not the lowest: 5 to 20 steps where some body explains the data. Where none
/// comes near, max_steps may end it, and `reason` says so; what is returned is a body even then. `information`: H,
/// shape=(10 * joints, 10 * joints), Gram of the regressor over the noise's variance; `gradient`: g, shape=(10 *
/// joints,), regressor times torque over it; `near`: shape=(10 * joints,), what was found of nearly the same data, from
/// which it takes fewer steps, at the path's end; what no body has is not used; empty: nothing was. Throws
/// std::invalid_argument: another shape, values that are not finite, H not symmetric or with negative eigenvalues,
/// options that are not positive.
PhysicalInertias physical_inertias(const Robot& nominal, const Eigen::MatrixXd& information,
                                   const Eigen::VectorXd& gradient, const PhysicalOptions& options = {},
                                   const Eigen::VectorXd& near = {});

}  // namespace truing::dynamics
