// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "identification/resamples.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "math/batch.hpp"
#include "math/random.hpp"

namespace truing::identification {
namespace {

/// Weights of the rows, each pose's times a number drawn from an exponential distribution.
std::vector<double> drawn_weights(const Measurements& data, const std::vector<std::int32_t>& pose, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> of_pose(1 + static_cast<std::size_t>(*std::max_element(pose.begin(), pose.end())));
  std::generate(of_pose.begin(), of_pose.end(), [&] { return random.exponential(); });
  std::vector<double> out(data.rows);
  for (std::size_t row = 0; row < data.rows; ++row)
    out[row] = of_pose[static_cast<std::size_t>(pose[row])] * (data.weight ? data.weight[row] : 1.0);
  return out;
}

/// Values of the fitted parameters.
Eigen::VectorXd fitted_values(const Identification& found) {
  Eigen::VectorXd out(found.rank);
  Eigen::Index at = 0;
  for (const Parameter& parameter : found.parameters) {
    if (!parameter.frozen) out[at++] = parameter.value;
  }
  return out;
}

/// What the same fit to other weights has other values by; none where it cannot be made, or sees other parameters.
std::optional<Eigen::VectorXd> deviation(const Robot& nominal, Measurements data, const IdentifyOptions& options,
                                         const std::vector<double>& weights, const Identification& whole) {
  data.weight = {weights.data()};
  try {
    const Identification other = identify(nominal, data, options);
    const bool same =
        std::equal(other.parameters.begin(), other.parameters.end(), whole.parameters.begin(), whole.parameters.end(),
                   [](const Parameter& a, const Parameter& b) { return a.name == b.name && a.frozen == b.frozen; });
    const Eigen::VectorXd out = same ? fitted_values(other) - fitted_values(whole) : Eigen::VectorXd();
    if (same && out.allFinite()) return out;
  } catch (const std::invalid_argument&) {  // too little is left of some poses
  }
  return std::nullopt;
}

}  // namespace

int count_scatter(const Robot& nominal, const Measurements& data, const IdentifyOptions& options,
                  const std::vector<std::int32_t>& pose, Identification* result) {
  IdentifyOptions alone = options;
  alone.resamples = 0;
  alone.threads = 1;
  Measurements same_rows = data;
  same_rows.set = result->set;
  std::vector<std::optional<Eigen::VectorXd>> off(static_cast<std::size_t>(options.resamples));
  for_each_on_threads(
      off.size(), options.threads, {},
      [&](std::size_t k) {
        const std::vector<double> weights = drawn_weights(data, pose, options.seed + k);
        off[k] = deviation(nominal, same_rows, alone, weights, *result);
      },
      1);
  // The covariance about the fit counts as one more, so that the sum has full rank.
  Eigen::MatrixXd squares = result->covariance;
  int fits = 0;
  for (const auto& values : off) {
    if (!values) continue;
    squares += *values * values->transpose();
    ++fits;
  }
  if (fits == 0) return 0;
  result->covariance = squares / (fits + 1.0);
  Eigen::Index at = 0;
  for (Parameter& parameter : result->parameters) {
    if (parameter.frozen) continue;
    parameter.sigma = std::sqrt(result->covariance(at, at));
    ++at;
  }
  return fits;
}

}  // namespace truing::identification
