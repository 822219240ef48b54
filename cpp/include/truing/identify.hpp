// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "truing/effect.hpp"
#include "truing/measurement.hpp"
#include "truing/robot.hpp"

namespace truing {

enum class Solver {
  lm,     ///< truing's own Levenberg-Marquardt on streamed normal equations
  ceres,  ///< Ceres with the same residuals and Jacobians; takes bounds
};

enum class Loss {
  reject,  ///< Cauchy to find gross outliers, then plain least squares without them (they are listed); the default
  none,
  huber,
  cauchy,
  tukey,
};

enum class FrameBy {
  parameters,  ///< the measurement frame is six more parameters
  svd,         ///< refitted by registration (Umeyama) after every step, as the palletizer method has it; positions only
};

struct IdentifyOptions {
  /// Names and globs ("J2.*", "*.ratio"); empty: every geometric value and the targets. What belongs to the instrument
  /// (base frame, anchor, fixed points) is always found unless it is in `hold`.
  std::vector<std::string> free;
  std::vector<std::string> hold;       ///< names and globs that stay at nominal whatever else is asked for
  std::vector<EffectRequest> effects;  ///< effects to fit as well
  std::vector<Effect> own_effects;     ///< effects outside the catalogue
  Solver solver = Solver::lm;
  Loss loss = Loss::reject;
  FrameBy frame_by = FrameBy::parameters;
  double rotation_length = 0.1;   ///< [m]: a rotation error of 1 rad counts as this length, where rows give no sigma
  double test_share = 0.2;        ///< of the pose groups, held out when `set` is absent
  std::uint64_t seed = 0;         ///< of the split
  int max_iterations = 5000;      ///< long valleys take thousands of short steps; well-seen robots stop after 3 to 5
  double initial_damping = 1e-9;  ///< mu, on columns of unit norm
  double rms_fall = 1e-12;  ///< [m] stop when an accepted step lowers the rms by no more (the method's own: 1e-3 mm)
  double gradient = 1e-14;  ///< stop when |g| of unit columns, relative to the residual's norm, is no more
  bool undamped = false;    ///< mu = 0: the least-squares iteration of the differential error model
  double rank_tolerance = 1e-6;  ///< a unit column that the others explain but for this share is not observable
  double hayati_angle = 0.08726646259971647;  ///< [rad] neighbouring axes nearer to parallel get beta (5 deg)
  double reject_beyond = 6.0;                 ///< Loss::reject: rows whose residual is longer than this many medians
  std::map<std::string, std::pair<double, double>> bounds;  ///< by parameter; Solver::ceres only
  int threads = 0;                                          ///< 0: as many as the machine has

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// One parameter of the result. Names: `J2.a`, `J3.ratio`, `tool.x`, `base.rz`, `backlash.J3`, `anchor.zero` …
/// Orientation corrections rx ry rz are rotation vectors from the nominal to the found orientation, about the parent's
/// axes.
struct Parameter {
  std::string name;
  double nominal = 0.0;
  double value = 0.0;
  double sigma = 0.0;  ///< standard error; NaN when frozen
  std::string unit;    ///< m, rad, -, rad/Nm …
  bool frozen = false;
};

/// A combination of parameters that the data cannot see: moving them together so changes no measurement.
struct Frozen {
  std::string parameter;                      ///< the one held at nominal
  std::map<std::string, double> combination;  ///< weights, 1 for `parameter`
  std::string why;
};

/// Length of the position (or distance) errors of a set of rows.
struct ErrorStatistics {
  double rms = 0.0, mean = 0.0, median = 0.0, p95 = 0.0, max = 0.0;  ///< [m]
  double rotation_rms = 0.0;                                         ///< [rad]; NaN: no orientation measured
  std::size_t n = 0;
};

struct BeforeAfter {
  ErrorStatistics before;  ///< nominal robot with base, targets (and anchor, fixed points) fitted
  ErrorStatistics after;
};

struct SolverSummary {
  std::string name;
  int iterations = 0;
  bool converged = false;
  std::string stopped_because;
};

struct Identification {
  Robot robot;                        ///< calibrated
  Robot before;                       ///< nominal with base and targets fitted
  std::vector<Parameter> parameters;  ///< every parameter asked for, frozen ones included
  Eigen::MatrixXd covariance;         ///< of the fitted (not frozen) ones, in order of `parameters`
  std::vector<Frozen> frozen;
  BeforeAfter train;
  std::optional<BeforeAfter> test;
  std::vector<std::size_t> rejected_rows;  ///< training rows left out as gross outliers
  std::vector<std::int8_t> set;            ///< 0 train, 1 test, for every row
  std::vector<std::string> warnings;
  SolverSummary solver;
  double noise_sigma = 0.0;           ///< of one position component (or distance), from the training residuals [m]
  double rotation_noise_sigma = 0.0;  ///< of one rotation component [rad]; NaN: none measured
  int rank = 0;                       ///< fitted parameters
  int columns = 0;                    ///< parameters asked for
};

/// Finds the robot's parameters from measurements.
///
/// Base, targets (anchor, fixed points) are found first; what the data cannot see is frozen at nominal and named; then
/// the Levenberg-Marquardt iteration of the palletizer method, or Ceres, runs on the training rows. Throws
/// std::invalid_argument on data or options that cannot be used (fewer rows than parameters, all poses equal, unknown
/// parameter names …). A fit that did not converge returns with solver.converged == false.
Identification identify(const Robot& nominal, const Measurements& data, const IdentifyOptions& options = {});

/// What the robot predicts for the rows of `data`; row-major.
struct Prediction {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> position;     ///< target in the measurement frame [m]
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> orientation;  ///< w x y z, w >= 0
  Eigen::VectorXd distance;                                               ///< [m]; empty without an anchor
};

/// Throws std::invalid_argument on unknown effects or columns that they need.
Prediction predict(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects = {},
                   int threads = 0);

/// Predicted minus measured, row-major, NaN where not measured. [m], [rad] (twice the vector part of the error
/// quaternion)
struct Residuals {
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> position;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> rotation;
  Eigen::VectorXd distance;
};

/// Rows of a fixed point are compared with the mean of that point's predictions.
Residuals residuals(const Robot& robot, const Measurements& data, const std::vector<Effect>& own_effects = {},
                    int threads = 0);

}  // namespace truing
