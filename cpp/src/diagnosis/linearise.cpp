// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/linearise.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/evaluate.hpp"
#include "estimation/selection.hpp"
#include "math/gauss_newton.hpp"
#include "math/statistics.hpp"

namespace truing::diagnosis {
namespace {

constexpr double kPrior = 1e-2;         // [rad | m]
constexpr double kCauchyMedians = 1.5;  // scale of the loss
constexpr double kStep = 1e-7;          // the fit stands when no parameter moves more [rad | m]
constexpr int kRounds = 12;

/// Everything of the model that the rows show, under a prior, with Cauchy weights at a scale of the residuals' own.
/// Base and targets are near where they belong already; without a prior, what the data cannot see of them would wander.
class RobustFit {
 public:
  RobustFit(const Evaluator& evaluator, const std::vector<std::int32_t>& rows, std::size_t all_rows,
            double rotation_length, const Eigen::VectorXd& start)
      : evaluator_(evaluator), rows_(rows), norms_(all_rows, 0.0), start_(start), values_(start) {
    weighing_.rotation_scale = rotation_length;
  }

  NormalSystem<> system() {
    set_scale();
    const double sigma2 = std::pow(weighing_.loss_scale / kCauchyMedians, 2.0) / 3.0;
    evaluator_.normal_equations(values_, weighing_, &normal_);
    const std::vector<int>& free = evaluator_.free();
    const auto p = static_cast<Eigen::Index>(free.size());
    const Eigen::VectorXd precision = Eigen::VectorXd::Constant(p, 1.0 / (kPrior * kPrior));
    Eigen::VectorXd away(p);
    for (Eigen::Index k = 0; k < p; ++k)
      away[k] = values_[free[static_cast<std::size_t>(k)]] - start_[free[static_cast<std::size_t>(k)]];
    NormalSystem<> out;
    out.gram = normal_.gram / sigma2;
    for (Eigen::Index k = 0; k < p; ++k) out.gram(k, k) += precision[k] + 1e-11 * out.gram(k, k) + 1e-30;
    out.gradient = normal_.gradient / sigma2 + precision.cwiseProduct(away);
    return out;
  }

  void move(const Eigen::VectorXd& step) {
    const std::vector<int>& free = evaluator_.free();
    for (std::size_t k = 0; k < free.size(); ++k) values_[free[k]] += step[static_cast<Eigen::Index>(k)];
  }

  bool settled(const NormalSystem<>&, const Eigen::VectorXd& step) const { return step.cwiseAbs().maxCoeff() < kStep; }

  const Eigen::VectorXd& values() const { return values_; }

 private:
  void set_scale() {
    evaluator_.residual_norms(values_, weighing_, &norms_);
    std::vector<double> lengths;
    for (const std::int32_t row : rows_) lengths.push_back(norms_[static_cast<std::size_t>(row)]);
    weighing_.loss = kernel::RowLoss::cauchy;
    weighing_.loss_scale = std::max(kCauchyMedians * median_of(std::move(lengths)), 1e-9);
  }

  const Evaluator& evaluator_;
  const std::vector<std::int32_t>& rows_;
  std::vector<double> norms_;
  const Eigen::VectorXd start_;
  Eigen::VectorXd values_;
  Weighing weighing_;
  NormalEquations normal_;
};

}  // namespace

Linearisation linearise(const Robot& frames, const Measurements& data, const std::vector<std::int32_t>& rows,
                        double rotation_length, int threads) {
  const Model model = make_model(frames, data);
  const std::vector<std::vector<double>> bases = make_bases(model, data);
  const std::vector<Segment> segments = make_segments(data, rows);
  const std::vector<int> free = select_free(model, content_of(model, segments), ParameterSelection());
  const Evaluator evaluator(model, data, bases, segments, free, threads);
  const Eigen::VectorXd start = initial_values(model);
  RobustFit fit(evaluator, rows, data.rows, rotation_length, start);
  gauss_newton(&fit, kRounds);
  const Eigen::VectorXd& values = fit.values();
  Linearisation out;
  out.at = robot_with(model, values);
  for (const int k : free) {
    const ParameterInfo& info = model.parameters[static_cast<std::size_t>(k)];
    if (info.role == Role::geometry) out.shift[info.name] = values[k] - start[k];
  }
  return out;
}

Robot links_as_drawn(Robot at, const Robot& nominal) {
  for (std::size_t k = 0; k < at.joints.size(); ++k) {
    Joint& joint = at.joints[k];
    const Joint& drawn = nominal.joints[k];
    joint.d = drawn.d;
    joint.a = drawn.a;
    joint.alpha = drawn.alpha;
    joint.beta = drawn.beta;
    joint.T_parent_joint = drawn.T_parent_joint;
  }
  return at;
}

}  // namespace truing::diagnosis
