// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include "identification/fit.hpp"

namespace truing::identification {

// What the rows hardly see of a robot's links runs away in a fit: to whole turns and to metres. All links are then
// thought to be off by about as much as each other, and the rows say by how much (empirical Bayes: MacKay, Bayesian
// interpolation, Neural Computation 4 (1992) 415).

/// Of the fitted parameters those of links, joint zeros and gear ratios, by their place among the fitted ones.
std::vector<int> links_of(const Model& model, const std::vector<int>& fitted);

/// Whether the rows know one of these links only to more than `beyond` [rad, m].
bool barely_seen(const std::vector<int>& links, const Eigen::MatrixXd& covariance, double beyond);

constexpr double kFarOff = 0.1;  ///< [rad, m] farther off than links of robots are

/// Standard deviation of the links about the nominal robot [rad, m] that the rows speak for, where a fit stands: from
/// 0.1 mrad, mm to a rad, m.
double likeliest_error(const Job& job, const Fit& found, const std::vector<int>& links);

/// Takes whole turns off the links' angles: the robot is the same, described nearer to the nominal one.
void unwind(const Model& model, const std::vector<int>& links, Fit* found);

}  // namespace truing::identification
