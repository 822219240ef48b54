// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What identification and diagnosis of torques share: which rows are fitted and which are held out, the groundwork, and
// fits from normal equations.

#include <functional>
#include <string>
#include <vector>

#include "dynamics/design.hpp"
#include "rooms.hpp"
#include "truing/dynamics/identify.hpp"

namespace truing::dynamics {

struct ProblemOptions {
  double cutoff = 8.0;  ///< [Hz]
  double test_share = 0.3;
  int threads = 0;
  std::vector<TorqueEffect> own_effects{};
};

/// Recordings to fit and recordings to judge on.
struct Problem {
  Problem(const Robot& robot, const std::vector<Recording>& recordings, const ProblemOptions& options);
  Problem(const Problem&) = delete;  // `tiles` refer to `robot`
  Problem& operator=(const Problem&) = delete;

  Robot robot;
  std::vector<std::string> warnings;
  Tiles tiles;
  MotionRange range;
  Folds train, test;
  bool single = false;  ///< folds are blocks of time
  std::vector<std::string> held_out;
  std::vector<TorqueEffect> own_effects;
  TorqueModel nominal;
  bool fitted_before = false;  ///< the robot carries what an earlier fit of torques found
};

/// A choice of columns fitted to all training folds.
struct Fit {
  std::vector<int> columns;
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;  ///< of unit noise, rows that count as one
  Eigen::VectorXd ridge;       ///< beside the priors, on the diagonal
};

/// Grams of all joints together, and the prior that columns have.
struct Sums {
  std::vector<FoldGram> folds;
  Gram all;                   ///< of the folds, with the priors on the diagonal
  Eigen::VectorXd precision;  ///< of the priors, by column; 0: flat
};

/// Without priors: all are flat.
Sums flat_sums_of(const TorqueGrams& grams, const std::vector<Noise>& noise, const TorqueDesign& design,
                  int threads = 1);
/// `with_prior`: by column, whether its term's prior holds.
Sums with_priors(Sums flat, const TorqueDesign& design, const std::vector<bool>& with_prior);
/// Both.
Sums sums_of(const TorqueGrams& grams, const std::vector<Noise>& noise, const TorqueDesign& design,
             const std::vector<bool>& with_prior, int threads = 1);

Fit fit_of(const Sums& sums, const std::vector<int>& columns, const Eigen::VectorXd& ridge = {});

/// Values alone of a fit of many columns with the priors of their terms, by column of the design; those that are not
/// `wanted` are nought. What belongs to one joint is eliminated there (Schur complement), and what several joints share
/// is left: so there may be thousands.
Eigen::VectorXd values_of(const TorqueGrams& grams, const std::vector<Noise>& noise, const TorqueDesign& design,
                          const std::vector<bool>& wanted, int threads);

/// The fit with inertial parameters that bodies can have, and the other values that go with them. `nominal`: the robot
/// that the inertial columns add to. Links whose nominal no body could have are said in `warnings`. `near`: that of the
/// same columns to nearly the same sums; it takes less time then.
Fit with_bodies(const Robot& nominal, const TorqueDesign& design, const Sums& sums, const Fit& fit,
                std::vector<std::string>* warnings, const Fit* near = nullptr);

/// By column of the design: the fit's values, others nought.
Eigen::VectorXd by_column(const TorqueDesign& design, const Fit& fit);

/// Terms with the values of a fit.
std::vector<ValuedTerm> valued(const TorqueDesign& design, const Fit& fit);

/// Groups of what is usual: inertial parameters, Coulomb, viscous, an offset. Their columns.
std::vector<int> standard_columns(const TorqueDesign& design);
/// The links' inertial parameters.
bool is_inertial(const TorqueGroup& group);
/// By column: whether it is one of these.
std::vector<bool> inertial_columns(const TorqueDesign& design);

/// The groundwork fitted to the problem's training rows: the model, and what noise it leaves.
struct Groundwork {
  TorqueDesign design;
  Sums sums;
  Fit fit;
  TorqueModel model;
  std::vector<Noise> noise;
};
/// How friction turns is chosen first (as choose_turns_again does), and, if it `may_fade`, how long it lasts at rest:
/// that is a law more, which nobody asks for who asks for Coulomb friction.
Groundwork groundwork_of(Problem* problem, bool may_fade = false);

/// Sets MotionRange::turns, and those of the nominal model, to what leaves the smallest errors at every joint on the
/// training rows, those at rest included: how friction is left at rest is part of how it turns. Friction that a model
/// turns more slowly than the joint does, or forgets at rest, would look like presliding and like Stribeck's curve;
/// what the groundwork lacks may look like another turn, so they are chosen again beside all terms of `design`. `seen`:
/// the model whose torque some terms need. True: others than before.
bool choose_turns_again(Problem* problem, const TorqueDesign& design, const TorqueModel& seen,
                        const std::vector<Noise>& noise, bool may_fade);
/// The robot with what a fit found: link inertias added to its links, effects to its torque effects.
Robot applied(const Robot& robot, const TorqueDesign& design, const std::vector<int>& groups, const Fit& fit,
              const MotionRange& range);

/// A robot's torques with the effects that it carries.
TorqueModel model_of(const Robot& robot, const Problem& problem);

/// Names, values and standard errors of some columns, constants among them.
std::vector<Parameter> parameters_of(const TorqueDesign& design, const std::vector<int>& columns, const Fit& fit);

/// Covariance of those of a fit's parameters that are not frozen.
Eigen::MatrixXd covariance_of(const TorqueDesign& design, const Fit& fit, const std::vector<Parameter>& parameters);

/// Errors of models on held-out and training rows, both sides low-passed, rows at rest included.
std::vector<TorqueErrors> errors_of(const Problem& problem,
                                    const std::vector<std::pair<std::string, TorqueModel>>& models);

/// Throws std::invalid_argument where recordings cannot be fitted: there are none, no torque, no link has a mass.
void require_usable(const Robot& robot, const std::vector<Recording>& recordings);

/// Torque per ampere of every joint: the robot's, or 1 (Nm/A) with a warning.
std::vector<double> drive_constants(const Robot& robot, const std::vector<Recording>& recordings,
                                    std::vector<std::string>* warnings);

}  // namespace truing::dynamics
