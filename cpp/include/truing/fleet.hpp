// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What fits of very many rows, or of many robots, are made of: normal equations of some rows at given parameters.
// Normal equations of other rows are added to them; which parameters the sum can see, and which groups of columns it
// speaks for, is then decided without any row. `identify` and `diagnose` do the same with all rows in memory.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/model/effect.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/parameter_selection.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// A parameter that some rows may determine, and where a fit of it starts.
struct FreeParameter {
  std::string name;    ///< full name, as in a result: J2.a, base.rz, backlash.J3
  std::string unit;    ///< m, rad, - …
  std::string role;    ///< base, geometry, offset, ratio, target, anchor or effect
  double value = 0.0;  ///< of the robot as given, in `unit`; frames turn from where they stand, so rx ry rz are 0
};

/// The parameters that `identify` would fit to these rows, before anything is known of what the rows can see. Throws
/// std::invalid_argument on rows that touch fixed points, and on names or effects that are not known.
std::vector<FreeParameter> free_parameters(const Robot& robot, const Measurements& data,
                                           const ParameterSelection& selection = {});

/// The robot with these parameters at these values, which count from `robot` as those of `free_parameters` do.
Robot robot_at(const Robot& robot, const Measurements& data, const std::vector<std::string>& names,
               const Eigen::VectorXd& values, const std::vector<EffectRequest>& effects = {});

/// How rows are summed.
struct SumOptions {
  std::vector<EffectRequest> effects;  ///< effects that the names may belong to
  double rotation_length = 0.1;  ///< [m] a rotation error of 1 rad counts as this length, where rows give no sigma
  bool scores = false;           ///< sum the scores of poses as well: a second, slower pass
  int threads = 1;               ///< 0: as many as the machine has
};

/// Normal equations of rows, and the errors of each.
struct RowSums {
  std::vector<std::string> units;  ///< of the parameters
  Eigen::MatrixXd gram;            ///< shape=(p, p): J^T W J
  Eigen::VectorXd gradient;        ///< shape=(p,): J^T W r, r predicted minus measured
  double squares = 0.0;            ///< r^T W r
  std::size_t values = 0;          ///< measured numbers that went in
  Eigen::MatrixXd scores;  ///< shape=(p, p): sum over poses of g g^T, g = J^T W r of the pose's rows; empty: not asked
  std::vector<double> position_error;  ///< shape=(n,) [m] length of every row's position or distance error
  std::vector<double> rotation_error;  ///< shape=(n,) [rad] of its rotation error, NaN: not measured; empty: none is
};

/// Sums the rows that count at these values of these parameters. `counts`: 1 for rows that go in, 0 for rows of which
/// only the errors are told; empty: all go in. The same bits for any number of threads.
///
/// Throws std::invalid_argument on data that cannot be used and on names that the model does not have.
RowSums sum_rows(const Robot& robot, const Measurements& data, const std::vector<std::string>& names,
                 const Eigen::VectorXd& values, const std::vector<std::int8_t>& counts = {},
                 const SumOptions& options = {});

/// Which columns of a Gram matrix it can see.
struct SeenColumns {
  std::vector<int> kept;    ///< columns to fit, in increasing order
  std::vector<int> frozen;  ///< columns that those kept explain
  /// shape=(kept, frozen): a frozen column is the kept ones times this.
  Eigen::MatrixXd combination;
};

/// As `identify` decides it: of two columns that cannot be told apart the one of lower `priority` stays, or the first.
/// `tolerance`: a unit column that the others explain up to this fraction is not seen.
SeenColumns seen_columns(const Eigen::MatrixXd& gram, const std::vector<int>& priority, double tolerance = 1e-6);

/// Which groups of columns explain y, from normal equations of y = X theta + noise alone.
struct GroupChoice {
  std::vector<int> groups;   ///< indices of those chosen
  std::vector<double> nats;  ///< for each of these: log Bayes factor against the choice without it, less its cost
  std::vector<std::vector<int>> rivals;  ///< for each of these: groups that would lose less than 3 nats in its place
  Eigen::VectorXd solution;              ///< shape=(p,): theta, 0 for columns that are not chosen
  double sigma = 0.0;                    ///< of the noise of one value, in its unit
};

/// The search of `diagnose` by Bayesian evidence: forward with a beam, then backward and swaps.
///
/// gram: shape=(p, p) X^T X; right: shape=(p,) X^T y; squares: y^T y; values: how many; prior: shape=(p,), the size
/// that each parameter may have; cost: nats for having looked at as many groups; threshold: nats that a group must win
/// beyond that. Throws std::invalid_argument on shapes that do not fit.
GroupChoice choose_groups(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right, double squares, double values,
                          const std::vector<std::vector<int>>& groups, const Eigen::VectorXd& prior, double cost,
                          double threshold = 4.0);

}  // namespace truing
