// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/prepare.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/filter.hpp"
#include "dynamics/payload.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFinePerCutoff = 12.5;   ///< rows of a motion, per period of the cut-off
constexpr double kCoarsePerCutoff = 3.1;  ///< rows that the fit sees
constexpr Index kTileRows = 8192;         ///< of a motion, less what leads in
constexpr double kForgets = 0.06;         ///< [rad | m] travel after which no play operator knows what was before
constexpr double kMostLeadIn = 60.0;      ///< [s] of a joint that rests for longer, it is forgotten
constexpr double kRestWindow = 0.25;      ///< [s] on both sides
constexpr double kGap = 5.0;              ///< usual steps without a row: here the recording is cut

double usual_step(const VectorXd& time) {
  std::vector<double> steps;
  for (Index i = 1; i < time.size(); ++i) steps.push_back(time[i] - time[i - 1]);
  return median_of(std::move(steps));
}

/// First and one past the last row of every stretch without gaps.
std::vector<std::pair<Index, Index>> stretches_of(const VectorXd& time, double step) {
  std::vector<std::pair<Index, Index>> out;
  Index begin = 0;
  for (Index i = 1; i <= time.size(); ++i) {
    if (i < time.size() && time[i] - time[i - 1] <= kGap * step) continue;
    out.emplace_back(begin, i);
    begin = i;
  }
  return out;
}

/// Columns at even steps, by straight lines between the rows.
MatrixXd at_even_steps(const VectorXd& time, const MatrixXd& x, Index begin, Index end, double step) {
  if (x.cols() == 0) return {};
  const auto rows = static_cast<Index>(std::floor((time[end - 1] - time[begin]) / step + 1e-6)) + 1;
  MatrixXd out(rows, x.cols());
  Index k = begin;
  for (Index i = 0; i < rows; ++i) {
    const double t = time[begin] + static_cast<double>(i) * step;
    while (k + 2 < end && time[k + 1] < t) ++k;
    const double part = std::clamp((t - time[k]) / (time[k + 1] - time[k]), 0.0, 1.0);
    out.row(i) = (1.0 - part) * x.row(k) + part * x.row(k + 1);
  }
  return out;
}

/// 1 where the joint was faster than rest at any time close by.
MatrixXd moving_rows(const MatrixXd& qd, double step, Index stride) {
  const auto window = static_cast<Index>(std::ceil(kRestWindow / step));
  const Index rows = (qd.rows() - 1) / stride + 1;
  MatrixXd out = MatrixXd::Zero(rows, qd.cols());
  for (Index c = 0; c < qd.cols(); ++c) {
    Index last_fast = -window - 1;  // sweep forwards and backwards
    std::vector<bool> fast(static_cast<std::size_t>(qd.rows()));
    for (Index i = 0; i < qd.rows(); ++i) {
      if (std::abs(qd(i, c)) > kSpeedAtRest) last_fast = i;
      fast[static_cast<std::size_t>(i)] = i - last_fast <= window;
    }
    last_fast = qd.rows() + window + 1;
    for (Index i = qd.rows() - 1; i >= 0; --i) {
      if (std::abs(qd(i, c)) > kSpeedAtRest) last_fast = i;
      if (i % stride == 0)
        out(i / stride, c) = fast[static_cast<std::size_t>(i)] || last_fast - i <= window ? 1.0 : 0.0;
    }
  }
  return out;
}

/// A stretch at the fine rate, whole.
struct Stretch {
  Tile whole;  ///< without rigid torques
  MatrixXd measured;
};

MatrixXd every(const MatrixXd& x, Index stride) {
  const Index rows = x.rows() == 0 ? 0 : (x.rows() - 1) / stride + 1;
  MatrixXd out(rows, x.cols());
  for (Index i = 0; i < rows; ++i) out.row(i) = x.row(i * stride);
  return out;
}

Stretch stretch_of(const Recording& recording, const MatrixXd& torque, Index begin, Index end, double step,
                   const PrepareOptions& options) {
  Stretch out;
  const VectorXd weights = low_pass(options.cutoff, step);
  const auto fine = std::max<Index>(1, static_cast<Index>(1.0 / (kFinePerCutoff * options.cutoff * step)));
  const double fine_step = step * static_cast<double>(fine);
  const MatrixXd q = filtered(at_even_steps(recording.time, recording.position, begin, end, step), weights);
  const MatrixXd qd = rate_of(q, step);
  Motion& motion = out.whole.motion;
  motion.step = fine_step;
  motion.q = every(q, fine);
  motion.qd = every(qd, fine);
  motion.qdd = every(rate_of(qd, step), fine);
  motion.time.resize(motion.q.rows());
  for (Index i = 0; i < motion.time.size(); ++i)
    motion.time[i] = recording.time[begin] - recording.time[0] + static_cast<double>(i) * fine_step;
  for (const auto& [name, column] : recording.columns)
    motion.columns[name] = every(at_even_steps(recording.time, column, begin, end, step), fine);
  out.whole.weights = low_pass(options.cutoff, fine_step);
  out.whole.stride = std::max<Index>(1, static_cast<Index>(1.0 / (kCoarsePerCutoff * options.cutoff * fine_step)));
  out.measured = filtered(at_even_steps(recording.time, torque, begin, end, step), weights, fine * out.whole.stride);
  out.whole.moving = moving_rows(motion.qd, fine_step, out.whole.stride);
  return out;
}

VectorXd rows_of(const VectorXd& x, Index begin, Index count) { return x.segment(begin, count); }

/// The row before `begin` from which on every joint has travelled so far that play operators forget what was before.
Index row_that_forgets(const Motion& motion, Index begin) {
  const Index earliest = std::max<Index>(0, begin - static_cast<Index>(kMostLeadIn / motion.step));
  VectorXd low = motion.q.row(begin), high = low;
  Index row = begin;
  while (row > earliest && (high - low).minCoeff() < kForgets) {
    --row;
    low = low.cwiseMin(motion.q.row(row).transpose());
    high = high.cwiseMax(motion.q.row(row).transpose());
  }
  return row;
}

/// Coarse rows [from, to) of a stretch, with the rows before and after that filter and play operators reach.
Tile tile_of(const Stretch& stretch, Index from, Index to) {
  const Tile& whole = stretch.whole;
  const Index stride = whole.stride, half = whole.weights.size() / 2;
  const Index reached = std::max<Index>(0, from * stride - half);
  const Index coarse_begin = row_that_forgets(whole.motion, reached) / stride;
  const Index begin = coarse_begin * stride;
  const Index end = std::min(whole.motion.rows(), (to - 1) * stride + half + 1);
  Tile out;
  out.weights = whole.weights;
  out.stride = stride;
  out.first = from - coarse_begin;
  out.count = to - from;
  out.motion.step = whole.motion.step;
  out.motion.time = rows_of(whole.motion.time, begin, end - begin);
  out.motion.q = whole.motion.q.middleRows(begin, end - begin);
  out.motion.qd = whole.motion.qd.middleRows(begin, end - begin);
  out.motion.qdd = whole.motion.qdd.middleRows(begin, end - begin);
  for (const auto& [name, column] : whole.motion.columns)
    out.motion.columns[name] = rows_of(column, begin, end - begin);
  out.measured = stretch.measured.middleRows(from, to - from);
  out.moving = whole.moving.middleRows(from, to - from);
  return out;
}

}  // namespace

MatrixXd Tile::filtered_rows(const MatrixXd& values) const { return filtered(values, weights, stride); }

VectorXd Tile::own_time() const {
  VectorXd out(count);
  for (Index i = 0; i < count; ++i) out[i] = motion.time[(first + i) * stride];
  return out;
}

MatrixXd measured_torque(const Recording& recording, const std::vector<double>& torque_per_ampere) {
  const Index n = recording.position.rows(), joints = recording.position.cols();
  MatrixXd out = MatrixXd::Constant(n, joints, std::numeric_limits<double>::quiet_NaN());
  if (recording.torque.cols() == joints) out = recording.torque;
  for (Index j = 0; j < joints && recording.current.cols() == joints; ++j) {
    if (std::isnan(out(0, j))) out.col(j) = recording.current.col(j) * torque_per_ampere[static_cast<std::size_t>(j)];
  }
  return out;
}

void for_each_tile(const Recording& recording, std::size_t number, const Robot& robot, const RigidChain& chain,
                   const PrepareOptions& options, const std::function<void(Tile&)>& use) {
  const double step = usual_step(recording.time);
  const MatrixXd torque = measured_torque(recording, options.torque_per_ampere);
  bool any = false;
  for (const auto& [begin, end] : stretches_of(recording.time, step)) {
    const double length = recording.time[end - 1] - recording.time[begin];
    if (end - begin < 2 || (!options.short_stretches && length < 4.0 / options.cutoff)) continue;
    any = true;
    const Stretch stretch = stretch_of(recording, torque, begin, end, step, options);
    const Index coarse = stretch.measured.rows();
    const Index each = std::max<Index>(1, kTileRows / stretch.whole.stride);
    for (Index from = 0; from < coarse; from += each) {
      Tile tile = tile_of(stretch, from, std::min(coarse, from + each));
      tile.recording = number;
      tile.motion.robot = &robot;
      tile.motion.rigid = regressor_columns(chain, tile.motion.q, tile.motion.qd, tile.motion.qdd);
      use(tile);
    }
  }
  if (!any) {
    throw std::invalid_argument("recording '" + recording.name + "': no stretch without gaps is longer than " +
                                math::number(4.0 / options.cutoff, 3) +
                                " s, which the low-pass needs: record longer, or give a higher cut-off");
  }
}

namespace {

/// Sums of a torque, over rows where it was measured.
struct TorqueSums {
  double n = 0.0, sum = 0.0, squares = 0.0;
  double standard_deviation() const {
    return n > 0.0 ? std::sqrt(std::max(0.0, squares / n - std::pow(sum / n, 2.0))) : 0.0;
  }
};

void widen(const Tile& tile, MotionRange* range, std::vector<TorqueSums>* sums) {
  const Motion& m = tile.motion;
  const Index first = tile.first * tile.stride;
  const Index rows = std::min(m.rows(), (tile.first + tile.count) * tile.stride) - first;
  range->lower = range->lower.cwiseMin(m.q.middleRows(first, rows).colwise().minCoeff().transpose());
  range->upper = range->upper.cwiseMax(m.q.middleRows(first, rows).colwise().maxCoeff().transpose());
  range->speed = range->speed.cwiseMax(m.qd.middleRows(first, rows).cwiseAbs().colwise().maxCoeff().transpose());
  range->acceleration =
      range->acceleration.cwiseMax(m.qdd.middleRows(first, rows).cwiseAbs().colwise().maxCoeff().transpose());
  range->duration = std::max(range->duration, m.time[first + rows - 1]);
  for (const auto& [name, column] : m.columns) {
    const auto own = column.segment(first, rows);
    auto [at, fresh] = range->columns.try_emplace(name, own.minCoeff(), own.maxCoeff());
    if (!fresh) at->second = {std::min(at->second.first, own.minCoeff()), std::max(at->second.second, own.maxCoeff())};
  }
  for (std::size_t j = 0; j < sums->size(); ++j) {
    for (Index i = 0; i < tile.count; ++i) {
      const double torque = tile.measured(i, static_cast<Index>(j));
      if (std::isnan(torque)) continue;
      (*sums)[j].n += 1.0;
      (*sums)[j].sum += torque;
      (*sums)[j].squares += torque * torque;
    }
  }
}

/// Columns that not all recordings have cannot be asked for; a payload that is not stated is none.
void keep_common_columns(const std::vector<Recording>& recordings, MotionRange* range) {
  for (auto at = range->columns.begin(); at != range->columns.end();) {
    const bool everywhere = std::all_of(recordings.begin(), recordings.end(),
                                        [&](const Recording& r) { return r.columns.count(at->first) > 0; });
    if (everywhere || at->first == kPayload) {
      if (!everywhere) at->second.first = std::min(at->second.first, 0.0);
      ++at;
    } else {
      at = range->columns.erase(at);
    }
  }
}

}  // namespace

MotionRange range_of(const std::vector<Recording>& recordings, const Robot& robot, const RigidChain& chain,
                     const PrepareOptions& options) {
  const auto joints = static_cast<Index>(robot.driven_count());
  constexpr double inf = std::numeric_limits<double>::infinity();
  MotionRange out;
  out.lower = VectorXd::Constant(joints, inf);
  out.upper = VectorXd::Constant(joints, -inf);
  out.speed = out.acceleration = out.torque = VectorXd::Zero(joints);
  std::vector<TorqueSums> sums(static_cast<std::size_t>(joints));
  for (std::size_t r = 0; r < recordings.size(); ++r)
    for_each_tile(recordings[r], r, robot, chain, options, [&](Tile& tile) { widen(tile, &out, &sums); });
  keep_common_columns(recordings, &out);
  for (std::size_t j = 0; j < sums.size(); ++j) out.torque[static_cast<Index>(j)] = sums[j].standard_deviation();
  return out;
}

}  // namespace truing::dynamics
