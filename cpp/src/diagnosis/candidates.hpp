// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What may explain a gap: every effect at every joint, geometry, drifting frames, corrections of laws, free functions.
// And their columns: one dense row per measured value, for the rows that are searched.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "estimation/evidence.hpp"
#include "model/model.hpp"
#include "rooms.hpp"
#include "truing/diagnose.hpp"

namespace truing::diagnosis {

/// How far off an angle [rad], or a length [m], may well be. Ten times less and less again is tried as well.
constexpr double kLargest = 1e-2;

/// A recorded (or derived) input, for every row.
struct InputColumn {
  std::string name;  ///< q2, dir3, torque2, payload, temp, time, order, or a covariate's
  std::string unit;
  int joint = -1;  ///< index in Robot::joints that it belongs to
  bool constant = false;
  std::vector<double> values;
};

std::vector<InputColumn> make_inputs(const Robot& robot, const Measurements& data);

/// Where the free function's hat-shaped basis functions peak along one input; flat beyond the first and the last.
std::vector<double> knots_of(const InputColumn& input, const std::vector<std::int32_t>& rows, int most);

/// Values of the hats at `x`: at most two are not zero.
void hats_at(const std::vector<double>& knots, double x, double* out);

/// One candidate, as the user reads it and as `identify` is asked for it.
struct Explanation {
  enum class Kind { catalogue, all_geometry, drift, law, free };
  Kind kind = Kind::catalogue;
  std::string effect;
  std::vector<std::string> joints;
  std::vector<std::string> parameters;  ///< names of its columns
  std::vector<std::string> model_free;  ///< parameters of the model to free
  std::vector<EffectRequest> requests;  ///< effects to ask for
  std::string note;
  std::string driver;  ///< the input that its law is a function of, if one
  // kind drift, law, free: hats of inputs at a site
  std::string site;
  std::vector<int> inputs;  ///< indices of make_inputs
  std::vector<std::vector<double>> knots;
  int law_form = 0;  ///< law: 0 hats of the input; 1 hats times the direction; 2 lengths times (T^2, hats of time)
};

struct Candidates {
  std::vector<Explanation> named;  ///< parallel to `groups`
  std::vector<ColumnGroup> groups;
  std::vector<NotTestable> not_testable;
};

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
  Candidates candidates;

  int column(const std::string& name) const;
  Gram gram_of_fold(int fold) const;
};

/// What the design is made from.
struct DesignTask {
  const Robot& nominal;                 ///< as given, base and targets found: what an effect must suit
  const Robot& at;                      ///< linearised here
  std::map<std::string, double> shift;  ///< parameters of the geometry: value at `at` minus nominal
  const Measurements& data;
  const std::vector<InputColumn>& inputs;
  std::vector<std::int32_t> rows;  ///< of the search, training and test
  const std::vector<std::int8_t>& set;
  const std::vector<std::int32_t>& cluster;  ///< pose group of every row
  const DiagnoseOptions& options;
  bool inferred_direction = false;
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

}  // namespace truing::diagnosis
