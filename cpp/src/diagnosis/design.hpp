// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The columns of all candidates: one dense row per measured value, for the rows that are searched.

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "diagnosis/candidates.hpp"
#include "estimation/evidence.hpp"
#include "model/effects/tables.hpp"
#include "rooms.hpp"

namespace truing::diagnosis {

/// How far off an angle [rad], or a length [m], may well be. Ten times less and less again is tried as well.
constexpr double kLargest = 1e-2;

/// One dense row per measured value.
struct Design {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Rows x;
  Eigen::VectorXd y;                   ///< measured minus predicted by the nominal robot, linearised at `at`
  Eigen::VectorXd weight;              ///< square root of each value's weight: 1 / sigma of its kind, robust
  std::vector<std::int32_t> row;       ///< of the data
  std::vector<std::int8_t> component;  ///< 0..2 position, 3..5 rotation, 6 distance
  std::vector<std::int32_t> fold;      ///< training folds 0 … folds-1, test folds from `folds` on
  std::vector<std::int32_t> cluster;   ///< pose group
  int folds = 0, test_folds = 0;
  std::vector<std::string> column_names;
  std::vector<std::string> column_units;
  Eigen::VectorXd prior;  ///< size that a column's parameter may have
  std::vector<int> nuisance;
  std::vector<std::vector<int>> joint_column;  ///< per joint: the column of its motion (offset); empty: none
  std::vector<int> base_columns;               ///< of the six frame coordinates
  std::vector<int> turning_base_columns;       ///< of the same along axes that turn with the arm; empty: none
  TurningBase turning_base;
  Candidates candidates;

  int column(const std::string& name) const;
  Gram gram_of_fold(int fold, GramSum* sum) const;
};

Design make_design(const DesignTask& task);

/// Columns of hats of inputs at a joint (or at the six coordinates of the base), from the design's own columns.
Design::Rows free_columns(const Design& design, const std::vector<int>& site_columns,
                          const std::vector<InputColumn>& inputs, const std::vector<int>& which,
                          const std::vector<std::vector<double>>& knots);

/// The same as an effect that `identify` can fit: the shape as found under its prior (`coefficients`, one a column),
/// times one parameter. Its basis is looked up by row of `inputs`.
Effect free_effect(const Explanation& candidate, const Eigen::VectorXd& coefficients,
                   const std::vector<InputColumn>& inputs);

/// Whether a robot can carry the function: of inputs that every row has that it is asked about.
bool fits_in_tables(const Explanation& candidate, const std::vector<InputColumn>& inputs);

/// The effect's functions at its sites as a robot carries them.
std::vector<LookupTable> tables_of(const Explanation& candidate, const Eigen::VectorXd& coefficients,
                                   const std::vector<InputColumn>& inputs, const Robot& robot);

}  // namespace truing::diagnosis
