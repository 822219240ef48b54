// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "identification/shrink.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/evidence.hpp"
#include "math/constants.hpp"

namespace truing::identification {

std::vector<int> links_of(const Model& model, const std::vector<int>& fitted) {
  std::vector<int> out;
  for (std::size_t k = 0; k < fitted.size(); ++k) {
    const Role role = model.parameters[fitted[k]].role;
    if (role == Role::geometry || role == Role::offset || role == Role::ratio) out.push_back(static_cast<int>(k));
  }
  return out;
}

bool barely_seen(const std::vector<int>& links, const Eigen::MatrixXd& covariance, double beyond) {
  return std::any_of(links.begin(), links.end(), [&](int k) { return std::sqrt(covariance(k, k)) > beyond; });
}

/// Sums of the rows about the nominal links, where the columns are those of a fit.
static Gram sums_about_nominal(const Job& job, const Fit& found, const std::vector<int>& links) {
  const Evaluator evaluator(job.model, job.data, job.bases, make_segments(job.data, without(job.rows, found.rejected)),
                            found.fitted, job.options.threads);
  Weighing of_rows = found.weighing;
  of_rows.prior = {};
  NormalEquations here;
  evaluator.normal_equations(found.values, of_rows, &here);
  const Eigen::VectorXd nominal = initial_values(job.model);
  Eigen::VectorXd off = Eigen::VectorXd::Zero(here.gram.rows());
  for (const int k : links) {
    const int parameter = found.fitted[k];
    off[k] = found.values[parameter] - nominal[parameter];
  }
  // r at the nominal links is r - J off here: it is to be explained by -J times what the links are off.
  return {here.gram, here.gram * off - here.gradient,
          here.squares - 2.0 * off.dot(here.gradient) + off.dot(here.gram * off), static_cast<double>(here.components)};
}

double likeliest_error(const Job& job, const Fit& found, const std::vector<int>& links) {
  const Gram sums = sums_about_nominal(job, found, links);
  std::vector<int> others;
  for (int k = 0; k < sums.xx.rows(); ++k) {
    if (std::find(links.begin(), links.end(), k) == links.end()) others.push_back(k);
  }
  const auto likeliest_up_to = [&](double largest) {  // among its parts
    const std::vector<ColumnGroup> none;
    const Evidence evidence(sums, none, others, Eigen::VectorXd::Constant(sums.xx.rows(), largest));
    return largest * evidence.gain(evidence.evaluate({}), links, 0.0).scale;
  };
  constexpr double kLargest = 1.0;  // [rad, m]
  const double size = likeliest_up_to(kFarOff);
  return size < kFarOff ? size : likeliest_up_to(kLargest);
}

/// Whether a turn of the parameter turns everything it moves by whole turns.
static bool is_cyclic(const ParameterInfo& parameter) {
  if (parameter.unit != "rad") return false;
  return std::all_of(parameter.columns.begin(), parameter.columns.end(), [](const ColumnTerm& column) {
    return column.reading < 0 && column.term < 0 &&
           std::all_of(
               column.sites.begin(), column.sites.end(),
               [](const SiteWeight& site) { return site.second == std::round(site.second); });
  });
}

void unwind(const Model& model, const std::vector<int>& links, Fit* found) {
  const Eigen::VectorXd nominal = initial_values(model);
  for (const int k : links) {
    const int parameter = found->fitted[k];
    if (!is_cyclic(model.parameters[parameter])) continue;
    double& value = found->values[parameter];
    value -= math::kTwoPi * std::round((value - nominal[parameter]) / math::kTwoPi);
  }
}

}  // namespace truing::identification
