// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/turn.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/laws.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A speed, and the integral of tanh(v / width) up to it, over the width.
struct Reached {
  double speed, integral;
};

/// Mean of tanh(v / width) while v goes evenly from a to b.
double mean_tanh(const Reached& a, const Reached& b, double width) {
  if (std::abs(b.speed - a.speed) < 1e-3 * width) return std::tanh(0.5 * (a.speed + b.speed) / width);
  return width / (b.speed - a.speed) * (b.integral - a.integral);
}

}  // namespace

VectorXd direction_by_speed(const Eigen::Ref<const VectorXd>& qd, double width) {
  const Index rows = qd.size();
  VectorXd out(rows);
  if (rows == 0) return out;
  VectorXd between(rows);  // half-way to the next row
  between << 0.5 * (qd.head(rows - 1) + qd.tail(rows - 1)), qd[rows - 1];
  const Eigen::ArrayXd there = logs_of_two_cosh(qd / width), on_the_way = logs_of_two_cosh(between / width);
  Reached before{qd[0], there[0]};
  for (Index i = 0; i < rows; ++i) {
    const Reached at{qd[i], there[i]}, after{between[i], on_the_way[i]};
    out[i] = 0.5 * (mean_tanh(before, at, width) + mean_tanh(at, after, width));
    before = after;
  }
  return out;
}

// Over half a row z runs on to its bound, and stays there for the rest.
VectorXd stop_operator(const Eigen::Ref<const VectorXd>& q, double x0, double kept) {
  VectorXd out = VectorXd::Zero(q.size());
  double z = 0.0;
  const double kept_of_half = std::sqrt(kept);
  const auto half_row = [&](double move) {  // its mean
    z *= kept_of_half;
    const double bound = std::copysign(1.0, move), way = std::abs(move), room = std::abs(bound - z);
    const double begin = z;
    if (way <= room) {
      z += move;
      return 0.5 * (begin + z);
    }
    z = bound;
    if (room == 0.0) return bound;
    const double part = room / way;
    return part * 0.5 * (begin + bound) + (1.0 - part) * bound;
  };
  const double per_row = 0.5 / x0;
  for (Index i = 1; i < q.size(); ++i) {
    const double move = per_row * (q[i] - q[i - 1]);
    const bool stays = kept == 1.0 && z == std::copysign(1.0, move);  // at its bound, as in most rows
    out[i - 1] += 0.5 * (stays ? z : half_row(move));
    out[i] += 0.5 * (stays ? z : half_row(move));
  }
  if (q.size() > 1) {  // whose rows have only half of their time
    out[0] *= 2.0;
    out[q.size() - 1] *= 2.0;
  }
  return out;
}

VectorXd direction_of(const Motion& motion, Index joint, const FrictionTurn& turn) {
  if (turn.travel == 0.0) return direction_by_speed(motion.qd.col(joint), turn.speed);
  const double kept = turn.fade > 0.0 ? std::exp(-motion.step / turn.fade) : 1.0;
  return stop_operator(motion.q.col(joint), turn.travel, kept);
}

bool same(const std::vector<FrictionTurn>& a, const std::vector<FrictionTurn>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const FrictionTurn& one, const FrictionTurn& other) {
    return one.speed == other.speed && one.travel == other.travel && one.fade == other.fade;
  });
}

MatrixXd directions_of(const Motion& motion, const std::vector<FrictionTurn>& turns) {
  MatrixXd out(motion.q.rows(), motion.q.cols());
  for (Index j = 0; j < out.cols(); ++j) out.col(j) = direction_of(motion, j, turns[static_cast<std::size_t>(j)]);
  return out;
}

}  // namespace truing::dynamics
