// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/turn.hpp"

#include <algorithm>
#include <cmath>

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Mean of tanh(v / width) while v goes evenly from a to b.
double mean_tanh(double a, double b, double width) {
  if (std::abs(b - a) < 1e-3 * width) return std::tanh(0.5 * (a + b) / width);
  const auto log_cosh = [](double x) { return std::abs(x) + std::log1p(std::exp(-2.0 * std::abs(x))); };
  return width / (b - a) * (log_cosh(b / width) - log_cosh(a / width));
}

}  // namespace

VectorXd direction_by_speed(const Eigen::Ref<const VectorXd>& qd, double width) {
  VectorXd out(qd.size());
  for (Index i = 0; i < qd.size(); ++i) {
    const double before = 0.5 * (qd[i] + qd[std::max<Index>(i - 1, 0)]);
    const double after = 0.5 * (qd[i] + qd[std::min(i + 1, qd.size() - 1)]);
    out[i] = 0.5 * (mean_tanh(before, qd[i], width) + mean_tanh(qd[i], after, width));
  }
  return out;
}

// Over half a row z runs on to its bound, and stays there for the rest.
VectorXd stop_operator(const Eigen::Ref<const VectorXd>& q, double x0) {
  VectorXd out = VectorXd::Zero(q.size());
  double z = 0.0;
  const auto half_row = [&](double move) {  // its mean
    const double bound = std::copysign(1.0, move), way = std::abs(move) / x0, room = std::abs(bound - z);
    const double begin = z;
    z = way < room ? z + move / x0 : bound;
    const double part = way > room ? room / way : 1.0;
    return part * 0.5 * (begin + z) + (1.0 - part) * bound;
  };
  for (Index i = 1; i < q.size(); ++i) {
    const double move = 0.5 * (q[i] - q[i - 1]);
    out[i - 1] += 0.5 * half_row(move);
    out[i] += 0.5 * half_row(move);
  }
  if (q.size() > 1) {  // whose rows have only half of their time
    out[0] *= 2.0;
    out[q.size() - 1] *= 2.0;
  }
  return out;
}

MatrixXd directions_of(const Motion& motion, const std::vector<FrictionTurn>& turns) {
  MatrixXd out(motion.q.rows(), motion.q.cols());
  for (Index j = 0; j < out.cols(); ++j) {
    const FrictionTurn& turn = turns[static_cast<std::size_t>(j)];
    out.col(j) = turn.travel > 0.0 ? stop_operator(motion.q.col(j), turn.travel)
                                   : direction_by_speed(motion.qd.col(j), turn.speed);
  }
  return out;
}

}  // namespace truing::dynamics
