// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// inputs -> site values -> one chain sweep -> residual and Jacobian tiles -> Gram. A tile is folded and forgotten.

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "kernel/kernel.hpp"
#include "math/gauss_newton.hpp"
#include "model/model.hpp"
#include "rooms.hpp"
#include "truing/model/measurement.hpp"

namespace truing::estimation {

/// Rows that share a residual's form: kind, target and fixed point.
struct Segment {
  kernel::Kind kind;
  int target;
  int point;  ///< index of the fixed point touched; -1: none
  std::vector<std::int32_t> rows;
};

/// Sorts rows into segments. Rows that measure nothing are left out, or (`as_positions`) taken as positions to be
/// predicted.
std::vector<Segment> make_segments(const Measurements& data, const std::vector<std::int32_t>& rows,
                                   bool as_positions = false);

/// Basis values of every term for every row: they depend on recorded inputs (and, for gravity, on the model's own
/// robot) only.
std::vector<std::vector<double>> make_bases(const Model& model, const Measurements& data);
/// The same where the weights are looked at on another robot: one of the same joints, whose links are elsewhere.
std::vector<std::vector<double>> make_bases(const Model& model, const Measurements& data, const Robot& weighed);

/// What is known of the free parameters beforehand: weight * (value - center)^2 is added to the cost.
struct Prior {
  Eigen::VectorXd center, weight;  ///< shape=(free parameters,); empty: nothing is known
};

/// How residual rows become unit-weight rows.
struct Weighing {
  double position_scale = 1.0;  ///< positions and distances [1/m], on top of 1 / sigma of the row if it has one
  double rotation_scale = 0.1;  ///< rotations [1/rad]
  kernel::RowLoss loss = kernel::RowLoss::none;
  double loss_scale = 1.0;  ///< on the length of a row's unit-weight residual
  bool row_weights = true;  ///< rows count by their own sigma and weight
  Prior prior{};
};

/// Of the free parameters; the cost is the sum of the loss of squared residuals, and of the prior.
struct NormalEquations : NormalSystem<> {
  double squares = 0.0;        ///< r^T W r, of the rows alone
  std::size_t components = 0;  ///< residual components that went in
  double rms() const;          ///< sqrt(cost / components)
};

/// The rows of one problem, ready to be evaluated again and again without allocating.
class Evaluator {
 public:
  /// `bases` as from make_bases; model, data and bases must outlive the evaluator.
  Evaluator(const Model& model, const Measurements& data, const std::vector<std::vector<double>>& bases,
            std::vector<Segment> segments, std::vector<int> free, int threads);
  ~Evaluator();
  Evaluator(Evaluator&&) noexcept;

  const std::vector<int>& free() const;
  std::size_t components() const;

  void normal_equations(const Eigen::VectorXd& values, const Weighing& weighing, NormalEquations* out) const;

  /// Length of every evaluated row's unit-weight residual; other rows of `norms` (size data.rows) are left alone.
  void residual_norms(const Eigen::VectorXd& values, const Weighing& weighing, std::vector<double>* norms) const;

  /// Called for every evaluated row, from several threads at once.
  using RowSink = std::function<void(std::size_t row, const double* numbers)>;

  /// Frame of the target: 12 numbers a row (p, then R column by column).
  void predict(const Eigen::VectorXd& values, const RowSink& sink) const;

  /// Residuals, unscaled: 3 position and 3 rotation numbers, zero where not measured; a distance error stands first.
  void residuals(const Eigen::VectorXd& values, const RowSink& sink) const;

  /// Every tile's Jacobian as the kernel leaves it: [column][component][kernel::kTilePoses], the residual as one more
  /// column.
  using TileSink = std::function<void(const double* jacobian, int columns, int components)>;
  void jacobian_tiles(const Eigen::VectorXd& values, const Weighing& weighing, const TileSink& sink) const;

  /// Of some rows of the data: scores J^T r, shape=(kTilePoses, free parameters), column by column, and the leverage
  /// trace(J A J^T) / components of each, A = root^T root; both hold `count` rows.
  using ScoreSink =
      std::function<void(const std::int32_t* rows, int count, const double* scores, const double* leverage)>;
  /// Calls `sink` for every tile, from several threads at once. root: shape=(any, free parameters).
  void scores(const Eigen::VectorXd& values, const Weighing& weighing, const Eigen::MatrixXd& root,
              const ScoreSink& sink) const;

  /// Residual (and, if not null, row-major Jacobian) of tile `tile`, weighted, for solvers that want rows. Returns
  /// components.
  int tile_count() const;
  int tile_rows(int tile) const;                     ///< poses in it
  int tile_components(int tile) const;               ///< residual components per pose
  const std::int32_t* tile_numbers(int tile) const;  ///< of its rows, in the data
  void tile(int tile, const Eigen::VectorXd& values, const Weighing& weighing, double* residual,
            double* jacobian) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace truing::estimation
