// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/linearise.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "estimation/evaluate.hpp"
#include "estimation/selection.hpp"
#include "math/statistics.hpp"

namespace truing::diagnosis {

Linearisation linearise(const Robot& frames, const Measurements& data, const std::vector<std::int32_t>& rows,
                        double rotation_length, int threads) {
  constexpr double kPrior = 1e-2;         // [rad | m]
  constexpr double kCauchyMedians = 1.5;  // scale of the loss
  constexpr int kRounds = 12;
  const Model model = make_model(frames, data);
  const std::vector<std::vector<double>> bases = make_bases(model, data);
  const std::vector<Segment> segments = make_segments(data, rows);
  const std::vector<int> free = select_free(model, content_of(model, segments), ParameterSelection());
  const Evaluator evaluator(model, data, bases, segments, free, threads);
  const Eigen::VectorXd start = initial_values(model);
  Eigen::VectorXd values = start;
  const auto p = static_cast<Eigen::Index>(free.size());
  // Base and targets are near where they belong already; without a prior, what the data cannot see of them would
  // wander.
  const Eigen::VectorXd precision = Eigen::VectorXd::Constant(p, 1.0 / (kPrior * kPrior));
  Weighing weighing;
  weighing.rotation_scale = rotation_length;
  std::vector<double> norms(data.rows, 0.0);
  const auto set_scale = [&] {
    evaluator.residual_norms(values, weighing, &norms);
    std::vector<double> lengths;
    for (const std::int32_t row : rows) lengths.push_back(norms[static_cast<std::size_t>(row)]);
    weighing.loss = kernel::RowLoss::cauchy;
    weighing.loss_scale = std::max(kCauchyMedians * median_of(std::move(lengths)), 1e-9);
  };
  NormalEquations normal;
  for (int round = 0; round < kRounds; ++round) {
    set_scale();
    const double sigma2 = std::pow(weighing.loss_scale / kCauchyMedians, 2.0) / 3.0;
    evaluator.normal_equations(values, weighing, &normal);
    Eigen::VectorXd away(p);
    for (Eigen::Index k = 0; k < p; ++k)
      away[k] = values[free[static_cast<std::size_t>(k)]] - start[free[static_cast<std::size_t>(k)]];
    Eigen::MatrixXd d = normal.gram / sigma2;
    for (Eigen::Index k = 0; k < p; ++k) d(k, k) += precision[k] + 1e-11 * d(k, k) + 1e-30;
    const Eigen::VectorXd step = -d.ldlt().solve(normal.gradient / sigma2 + precision.cwiseProduct(away));
    if (!step.allFinite()) break;
    for (Eigen::Index k = 0; k < p; ++k) values[free[static_cast<std::size_t>(k)]] += step[k];
    if (step.cwiseAbs().maxCoeff() < 1e-7) break;
  }
  Linearisation out;
  out.at = robot_with(model, values);
  for (const int k : free) {
    const ParameterInfo& info = model.parameters[static_cast<std::size_t>(k)];
    if (info.role == Role::geometry) out.shift[info.name] = values[k] - start[k];
  }
  return out;
}

}  // namespace truing::diagnosis
