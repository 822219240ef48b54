// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What is in no catalogue: a joint (or the base) that moves as a function of one or two recorded inputs.

#include <cstdint>
#include <vector>

#include "diagnosis/design.hpp"
#include "estimation/evidence.hpp"
#include "rooms.hpp"

namespace truing::diagnosis {

/// Some training values, of whole folds.
struct SomeRows {
  std::vector<Eigen::Index> at;  ///< rows of the design, of weight above zero
  std::size_t of = 0;            ///< training values in all
};

/// Of more than `most` values, whole folds are left out.
SomeRows some_training_rows(const Design& design, std::size_t most);

/// The rows that are looked at, weighted, and what a state leaves of them. Of any values v on them it leaves
/// v - span span^T v: span = C L^-T of its weighted columns C, with L L^T = C^T C and its prior.
struct Left {
  std::vector<Eigen::Index> at;  ///< rows of the design
  Eigen::MatrixXd span;          ///< shape (rows, columns of the state)
  Eigen::VectorXd residual;      ///< of the measured values, weighted
  double share = 1.0;            ///< of the training rows
};

/// Of more than `most` training values, whole folds are left out.
Left what_is_left(const Design& design, const Evidence::State& state, std::size_t most);

/// The state as it stands on the rows that are looked at: as if all rows were seen, and each counted for as much as it
/// does (`times`).
Evidence::State seen_on(const Left& left, const Evidence& evidence, const Evidence::State& state, double times);

/// One free function tried.
struct FreeGain {
  Explanation what;
  std::vector<int> site_columns;
  Evidence::Gain gain;
};

struct FreeScan {
  std::vector<FreeGain> best;  ///< by score, best first; at most 200
  std::size_t tried = 0;       ///< functions in all
  double p = 1.0;              ///< chance of a score as high when the signs of whole poses are random
};

struct FreeScanOptions {
  int flips = 99;
  std::uint64_t seed = 0;
  std::size_t most_values = 20000;  ///< measured values looked at: of more, whole folds are left out
  std::vector<int> only_of{};       ///< inputs: functions of one of them alone are tried; empty: everything is
  int threads = 1;                  ///< 0: as many as the machine has; nothing depends on it
};

/// Scores free functions on what `state` leaves of the training rows. `design_effect`: values that count as one.
FreeScan scan_free(const Design& design, const Evidence& evidence, const Evidence::State& state,
                   const std::vector<InputColumn>& inputs, const Robot& robot, double design_effect,
                   const FreeScanOptions& options);

/// "a step at q4 = 0.41 rad", "linear in temp", … from points (input, value, standard error).
std::string shape_of(const Curve& curve);

/// Of what a free curve explains of the single poses' values, the part that a step, a corner or a bump explains. Of a
/// few points: none.
double share_of_local_shape(const Curve& curve);

}  // namespace truing::diagnosis
