// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rows of one pose share what the model leaves there: they count as one observation when standard errors are made.

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "estimation/evaluate.hpp"
#include "model/model.hpp"
#include "rooms.hpp"
#include "truing/model/measurement.hpp"

namespace truing::estimation {

/// The rows of a fit, as an Evaluator takes them.
struct FittedRows {
  const Model& model;
  const Measurements& data;
  const std::vector<std::vector<double>>& bases;
  const std::vector<int>& free;
  const std::vector<std::int32_t>& rows;
  int threads = 1;  ///< 0: all cores
};

/// Number of clusters (`cluster[row]`, for every row of the data) that these rows are of.
std::size_t clusters_in(const std::vector<std::int32_t>& rows, const std::vector<std::int32_t>& cluster);

/// sum over clusters c of g_c g_c^T / (1 - h_c), with the score g_c = J_c^T W_c r_c and the leverage h_c of the mean of
/// c's rows: the middle of the sandwich H^-1 M H^-1 (Liang and Zeger 1986, (3); the factor is that of HC2, MacKinnon
/// and White 1985, on clusters). `inverse` is H^-1.
Eigen::MatrixXd clustered_scores(const FittedRows& fitted, const Eigen::VectorXd& values, const Weighing& weighing,
                                 const Eigen::MatrixXd& inverse, const std::vector<std::int32_t>& cluster);

/// The same of few clusters, of which some decide much of the fit: sum over c of g_c g_c^T with g_c = J_c^T (I -
/// H_c)^-1/2 r_c and the whole leverage H_c = J_c H^-1 J_c^T of c's values, unit-weight J and r (CR2: Bell and
/// McCaffrey, Survey Methodology 28 (2002) 169). Where noise is the same everywhere its mean is the noise's. It needs J
/// in memory.
Eigen::MatrixXd few_clusters_scores(const FittedRows& fitted, const Eigen::VectorXd& values, const Weighing& weighing,
                                    const Eigen::MatrixXd& inverse, const std::vector<std::int32_t>& cluster);

}  // namespace truing::estimation
