// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/common/error_statistics.hpp"
#include "truing/common/parameter.hpp"
#include "truing/common/solver_options.hpp"
#include "truing/model/effect.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/parameter_selection.hpp"
#include "truing/model/robot.hpp"

namespace truing {

enum class Solver {
  lm,     ///< Levenberg-Marquardt on streamed normal equations
  ceres,  ///< Ceres with the same residuals and Jacobians; takes bounds
};

enum class Loss {
  reject,  ///< Cauchy to find gross outliers, then plain least squares without them; they are listed
  none,    ///< plain least squares
  huber,   ///< Huber's loss
  cauchy,  ///< Cauchy's loss
  tukey,   ///< Tukey's loss
};

enum class FrameBy {
  parameters,  ///< the measurement frame is six more parameters
  svd,         ///< refitted by registration (Umeyama) after every step, as the palletizer method has it; positions only
};

/// How `identify` works.
struct IdentifyOptions : ParameterSelection, SolverOptions {
  std::vector<Effect> own_effects;         ///< effects outside the catalogue
  Solver solver = Solver::lm;              ///< what minimises
  Loss loss = Loss::reject;                ///< how gross outliers are treated
  FrameBy frame_by = FrameBy::parameters;  ///< how the measurement frame is found
  double rotation_length = 0.1;  ///< [m] a rotation error of 1 rad counts as this length, where rows give no sigma
  double test_share = 0.2;       ///< fraction of the pose groups held out when the data has no `set`
  std::uint64_t seed = 0;        ///< of the split
  double rank_tolerance = 1e-6;  ///< a unit column that the others explain up to this fraction is not observable
  /// What is known beforehand: standard deviation about the nominal value [its unit], by parameter or glob (of several
  /// that match, the smallest). A fit of many parameters to few poses stays near the nominal robot where the data say
  /// little. Not of base, targets and anchor.
  std::map<std::string, double> priors;
  /// Noise that priors are weighed against: standard deviation of a position component [m], of rows with a sigma of
  /// their own a factor to it. 0: what a fit without priors leaves.
  double prior_noise = 0.0;
  double reject_beyond = 6.0;  ///< loss `reject`: rows whose residual is longer than this many medians
  /// Where the rows know a link only to more than this [rad, m], it would run away: links are then fitted near the
  /// nominal robot, under a prior whose size the rows choose. Infinity: never. Not beside priors or bounds of one's
  /// own.
  double shrink_beyond = 0.05;
  /// Where the rows speak for links farther off than robots are, the fit to a few other poses may end at other values:
  /// standard errors are then what so many fits scatter by whose poses have weights drawn at random. 0: they are those
  /// about the one fit, as everywhere else.
  int resamples = 8;
  int threads = 0;  ///< 0: as many as the machine has

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// Errors before and after calibration.
struct BeforeAfter {
  ErrorStatistics before;  ///< nominal robot with base, targets (and anchor, fixed points) fitted
  ErrorStatistics after;   ///< calibrated robot
};

/// What `identify` found.
struct Identification {
  Robot robot;                        ///< calibrated; part of this result: copy it before changing it
  Robot before;                       ///< nominal, with base and targets fitted; part of this result
  std::vector<Parameter> parameters;  ///< every parameter asked for, frozen ones included
  /// shape=(rank, rank), of the fitted (not frozen) parameters in order of `parameters`, in their units.
  Eigen::MatrixXd covariance;
  /// shape=(rank,): standard errors about this one fit, of the fitted parameters in their units. Those of `parameters`
  /// and `covariance` are larger where they are what `resamples` fits scatter by.
  Eigen::VectorXd local_sigma;
  std::vector<Frozen> frozen;              ///< what the data cannot see
  BeforeAfter train;                       ///< errors of the training rows
  std::optional<BeforeAfter> test;         ///< errors of the held-out rows, if any
  std::vector<std::size_t> rejected_rows;  ///< training rows (counted from 0) left out as gross outliers
  std::vector<std::int8_t> set;            ///< shape=(n,): 0 train, 1 test, for every row
  std::vector<std::string> warnings;       ///< what to know before trusting it
  SolverSummary solver;                    ///< how the solver ended
  double noise_sigma = 0.0;                ///< [m] of one position component (or distance), from the training residuals
  double rotation_noise_sigma = 0.0;       ///< [rad] of one rotation component; NaN: none measured
  /// [rad, m] standard deviation about the nominal robot under which links were fitted; 0: freely. See shrink_beyond.
  double shrunk_to = 0.0;
  int rank = 0;     ///< number of parameters fitted
  int columns = 0;  ///< number of parameters asked for
};

/// Finds the robot's parameters from measurements.
///
/// Base, targets (anchor, fixed points) are found first; what the data cannot see is frozen at nominal and named; then
/// the Levenberg-Marquardt iteration of the palletizer method, or Ceres, runs on the training rows. Throws
/// std::invalid_argument on data or options that cannot be used (fewer rows than parameters, all poses equal, unknown
/// parameter names …). A fit that did not converge returns with solver.converged == false.
Identification identify(const Robot& nominal, const Measurements& data, const IdentifyOptions& options = {});

/// What the robot predicts for the rows of some data.
struct Prediction {
  /// shape=(n, 3) [m]: target in the measurement frame.
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> position;
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> orientation;  ///< shape=(n, 4): w x y z, w >= 0
  Eigen::VectorXd distance;                                               ///< shape=(n,) [m]; empty without an anchor
};

/// True when an effect of the robot needs approach directions that the data lack. Throws std::invalid_argument on
/// unknown effects.
bool lacks_directions(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects = {});
/// The same of joint speeds, which with_inferred_speeds gives of a robot that moved while it was measured.
bool lacks_speeds(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects = {});

/// Throws std::invalid_argument on unknown effects or columns that they need.
Prediction predict(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects = {},
                   int threads = 0);

/// Predicted minus measured; NaN where not measured.
struct Residuals {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> position;  ///< shape=(n, 3) [m]
  /// shape=(n, 3) [rad]: twice the vector part of the error quaternion.
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> rotation;
  Eigen::VectorXd distance;  ///< shape=(n,) [m]
};

/// Rows of a fixed point are compared with the mean of that point's predictions.
Residuals residuals(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects = {},
                    int threads = 0);

}  // namespace truing
