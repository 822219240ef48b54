// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "identification/asked.hpp"
#include "identification/uncertainty.hpp"

namespace truing::identification {

// What to say about a fit.

/// Every parameter that was asked for, with its standard error if it was fitted.
void report_parameters(const Model& nominal_model, const Model& model, const Seen& seen, const Fit& found,
                       Identification* result);

/// Between which values the fitted rows have every input.
std::map<std::string, std::pair<double, double>> ranges_of(const Measurements& data,
                                                           const std::vector<std::int32_t>& rows);

/// Errors before and after, on the rows fitted and on those held out.
void report_errors(const Job& job, const Content& content, const std::vector<std::int32_t>& test,
                   const Eigen::VectorXd& before, const Fit& found, Identification* result);

/// What a user should know of the result. `spread`: of the measured positions [m].
std::vector<std::string> make_warnings(const Identification& result, std::size_t train_values, double spread);

}  // namespace truing::identification
