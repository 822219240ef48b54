// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include <memory>
#include <string>

#include <ceres/ceres.h>

#include "estimation/solvers.hpp"

namespace truing::estimation {
namespace {

/// One tile of rows as a cost function of all free parameters.
class TileCost : public ceres::CostFunction {
 public:
  TileCost(const Evaluator& problem, int tile, const Weighing& weighing, const Eigen::VectorXd& start)
      : problem_(problem), tile_(tile), weighing_(weighing), start_(start) {
    set_num_residuals(problem.tile_rows(tile) * problem.tile_components(tile));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(problem.free().size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    Eigen::VectorXd values = start_;
    for (std::size_t k = 0; k < problem_.free().size(); ++k) values[problem_.free()[k]] = parameters[0][k];
    problem_.tile(tile_, values, weighing_, residuals, jacobians ? jacobians[0] : nullptr);
    return true;
  }

 private:
  const Evaluator& problem_;
  int tile_;
  Weighing weighing_;
  const Eigen::VectorXd& start_;
};

/// The same for one pose of a tile, since a robust loss acts on a pose.
class PoseCost : public ceres::CostFunction {
 public:
  PoseCost(const Evaluator& problem, int tile, int pose, const Weighing& weighing, const Eigen::VectorXd& start)
      : tile_(problem, tile, weighing, start),
        pose_(pose),
        components_(problem.tile_components(tile)),
        rows_(problem.tile_rows(tile) * components_),
        columns_(static_cast<int>(problem.free().size())) {
    set_num_residuals(components_);
    mutable_parameter_block_sizes()->push_back(columns_);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    std::vector<double> r(static_cast<std::size_t>(rows_));
    std::vector<double> j(jacobians ? static_cast<std::size_t>(rows_) * columns_ : 0);
    double* const block[1] = {j.data()};
    tile_.Evaluate(parameters, r.data(), jacobians ? const_cast<double**>(block) : nullptr);
    std::copy_n(r.begin() + pose_ * components_, components_, residuals);
    if (jacobians && jacobians[0])
      std::copy_n(j.begin() + static_cast<std::ptrdiff_t>(pose_) * components_ * columns_, components_ * columns_,
                  jacobians[0]);
    return true;
  }

 private:
  TileCost tile_;
  int pose_, components_, rows_, columns_;
};

/// What is known of the parameters beforehand.
class PriorCost : public ceres::CostFunction {
 public:
  explicit PriorCost(const Prior& prior) : center_(prior.center), root_(prior.weight.cwiseSqrt()) {
    set_num_residuals(static_cast<int>(root_.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(root_.size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index n = root_.size();
    Eigen::Map<Eigen::VectorXd>(residuals, n) =
        root_.cwiseProduct(Eigen::Map<const Eigen::VectorXd>(parameters[0], n) - center_);
    if (jacobians && jacobians[0]) Eigen::Map<Eigen::MatrixXd>(jacobians[0], n, n) = root_.asDiagonal();
    return true;
  }

 private:
  Eigen::VectorXd center_, root_;
};

std::unique_ptr<ceres::LossFunction> make_loss(const Weighing& weighing) {
  switch (weighing.loss) {
    case kernel::RowLoss::none:
      break;
    case kernel::RowLoss::huber:
      return std::make_unique<ceres::HuberLoss>(weighing.loss_scale);
    case kernel::RowLoss::cauchy:
      return std::make_unique<ceres::CauchyLoss>(weighing.loss_scale);
    case kernel::RowLoss::tukey:
      return std::make_unique<ceres::TukeyLoss>(weighing.loss_scale);
  }
  return nullptr;
}

}  // namespace

SolverSummary solve_with_ceres(const Evaluator& evaluator, const Model& model, const Weighing& weighing,
                               const SolverOptions& options, Eigen::VectorXd* values) {
  SolverSummary summary;
  summary.name = "ceres";
  if (evaluator.free().empty()) {
    summary.converged = true;
    summary.stopped_because = "nothing to fit";
    return summary;
  }
  const Eigen::VectorXd start = *values;
  std::vector<double> x;
  for (const int parameter : evaluator.free()) x.push_back(start[parameter]);

  const std::unique_ptr<ceres::LossFunction> loss = make_loss(weighing);
  Weighing plain = weighing;  // Ceres applies the loss
  plain.loss = kernel::RowLoss::none;
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
    if (!loss) {
      problem.AddResidualBlock(new TileCost(evaluator, tile, plain, start), nullptr, x.data());
      continue;
    }
    for (int pose = 0; pose < evaluator.tile_rows(tile); ++pose) {
      problem.AddResidualBlock(new PoseCost(evaluator, tile, pose, plain, start), loss.get(), x.data());
    }
  }
  if (weighing.prior.weight.size() > 0) problem.AddResidualBlock(new PriorCost(weighing.prior), nullptr, x.data());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const auto bound = options.bounds.find(model.parameters[evaluator.free()[k]].name);
    if (bound == options.bounds.end()) continue;
    x[k] = std::min(std::max(x[k], bound->second.first), bound->second.second);
    problem.SetParameterLowerBound(x.data(), static_cast<int>(k), bound->second.first);
    problem.SetParameterUpperBound(x.data(), static_cast<int>(k), bound->second.second);
  }

  ceres::Solver::Options solver;
  solver.linear_solver_type = evaluator.components() > 60000 ? ceres::DENSE_NORMAL_CHOLESKY : ceres::DENSE_QR;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-15;
  solver.gradient_tolerance = 1e-20;
  solver.parameter_tolerance = 1e-14;
  solver.initial_trust_region_radius = 1.0 / options.initial_damping;
  solver.max_trust_region_radius = 1e30;
  solver.num_threads = 1;  // the evaluator's workspace is shared
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary found;
  ceres::Solve(solver, &problem, &found);

  for (std::size_t k = 0; k < x.size(); ++k) (*values)[evaluator.free()[k]] = x[k];
  summary.iterations = static_cast<int>(found.iterations.size()) - 1;
  summary.converged = found.termination_type == ceres::CONVERGENCE;
  summary.stopped_because = found.message;
  return summary;
}

}  // namespace truing::estimation
