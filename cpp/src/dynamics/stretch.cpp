// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/stretch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/filter.hpp"
#include "dynamics/spline.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFinePerCutoff = 12.5;   ///< rows of a motion, per period of the cut-off
constexpr double kCoarsePerCutoff = 3.1;  ///< rows that the fit sees
constexpr double kFarApart = 0.012;       ///< [s] between rows: from here on differences say too little of a motion
constexpr double kBetween = 200.0;        ///< rows a second of the curve through such rows, at most
constexpr double kMostOfRate = 0.25;      ///< cut-off to recorded rows a second: rows show nothing above a half
constexpr Index kTileRows = 8192;         ///< of a motion, less what leads in
constexpr double kForgets = 0.06;         ///< [rad | m] travel after which no play operator knows what was before
constexpr double kMostLeadIn = 60.0;      ///< [s] of a joint that rests for longer, it is forgotten
constexpr double kRestWindow = 0.25;      ///< [s] on both sides
constexpr double kEdge = 1.0;             ///< periods of the cut-off: a turn so near to an end is seen from one side

/// Torques measured, or currents times the drives' constants: NaN throughout where there is neither.
MatrixXd measured_torque(const Recording& recording, Index begin, Index end,
                         const std::vector<double>& torque_per_ampere) {
  const Index n = end - begin, joints = recording.position.cols();
  MatrixXd out = MatrixXd::Constant(n, joints, std::numeric_limits<double>::quiet_NaN());
  if (recording.torque.cols() == joints) out = recording.torque.middleRows(begin, n);
  for (Index j = 0; j < joints && recording.current.cols() == joints; ++j) {
    if (std::isnan(out(0, j)))
      out.col(j) = recording.current.col(j).segment(begin, n) * torque_per_ampere[static_cast<std::size_t>(j)];
  }
  return out;
}

/// 1 where the joint was faster than rest at most `window` rows away, in every `stride`-th row.
MatrixXd moving_rows(const MatrixXd& qd, const VectorXd& at_rest, Index window, Index stride) {
  const Index rows = (qd.rows() - 1) / stride + 1;
  MatrixXd out = MatrixXd::Zero(rows, qd.cols());
  for (Index c = 0; c < qd.cols(); ++c) {
    Index last_fast = -window - 1;  // sweep forwards and backwards
    std::vector<bool> fast(static_cast<std::size_t>(qd.rows()));
    for (Index i = 0; i < qd.rows(); ++i) {
      if (std::abs(qd(i, c)) > at_rest[c]) last_fast = i;
      fast[static_cast<std::size_t>(i)] = i - last_fast <= window;
    }
    last_fast = qd.rows() + window + 1;
    for (Index i = qd.rows() - 1; i >= 0; --i) {
      if (std::abs(qd(i, c)) > at_rest[c]) last_fast = i;
      if (i % stride == 0)
        out(i / stride, c) = fast[static_cast<std::size_t>(i)] || last_fast - i <= window ? 1.0 : 0.0;
    }
  }
  return out;
}

Index rows_in(double seconds, double step) { return static_cast<Index>(std::ceil(seconds / step)); }

}  // namespace

void RowWindow::append(const MatrixXd& more) {
  MatrixXd all(rows_.rows() + more.rows(), more.cols());
  if (rows_.rows() > 0) all.topRows(rows_.rows()) = rows_;
  all.bottomRows(more.rows()) = more;
  rows_ = std::move(all);
}

void RowWindow::drop_before(Index first) {
  const Index gone = std::clamp<Index>(first - begin_, 0, rows_.rows());
  if (gone == 0) return;
  rows_ = rows_.bottomRows(rows_.rows() - gone).eval();
  begin_ += gone;
}

Stretch::Stretch(VectorXd at_rest, std::vector<std::string> columns, double step, const PrepareOptions& options)
    : options_(options),
      at_rest_(std::move(at_rest)),
      joints_(at_rest_.size()),
      columns_(std::move(columns)),
      step_(step) {
  const auto every = [](double per_cutoff, double cutoff, double of) {
    return std::max<Index>(1, static_cast<Index>(1.0 / (per_cutoff * cutoff * of)));
  };
  cutoff_ = cutoff_of(options.cutoff, step);
  fine_ = every(kFinePerCutoff, options.cutoff, step);
  between_ = step < kFarApart ? 1 : static_cast<Index>(kBetween * step + 1e-6);
  fine_step_ = step * static_cast<double>(fine_) / static_cast<double>(between_);
  const double seen_step = step * static_cast<double>(fine_);
  coarse_ = fine_ * every(kCoarsePerCutoff, cutoff_, seen_step);
  stride_ = coarse_ / fine_ * between_;
  weights_ = low_pass(cutoff_, step);
  seen_weights_ = low_pass(cutoff_, seen_step);
  reach_ = seen_weights_.size() / 2 * between_;
}

double Stretch::cutoff_of(double wanted, double step) {
  return step < kFarApart ? wanted : std::min(wanted, kMostOfRate / step);
}

void Stretch::add(const Recording& rows, Index begin, Index end, double start) {
  if (!any_) {
    first_time_ = rows.time[begin];
    start_ = start;
    any_ = true;
  }
  MatrixXd more(end - begin, 2 * joints_ + static_cast<Index>(columns_.size()));
  more.leftCols(joints_) = rows.position.middleRows(begin, end - begin);
  more.middleCols(joints_, joints_) = measured_torque(rows, begin, end, options_.torque_per_ampere);
  for (std::size_t c = 0; c < columns_.size(); ++c)
    more.col(2 * joints_ + static_cast<Index>(c)) = rows.columns.at(columns_[c]).segment(begin, end - begin);
  raw_.append(more);
  times_.insert(times_.end(), rows.time.data() + begin, rows.time.data() + end);
}

bool Stretch::is_too_short() const {
  return raw_.end() < 2 || (!options_.short_stretches && times_.back() - first_time_ < 4.0 / cutoff_);
}

/// At even steps, by straight lines between the rows.
void Stretch::resample(bool ended) {
  const double last = times_.back();
  if (ended) even_rows_ = static_cast<Index>(std::floor((last - first_time_) / step_ + 1e-6)) + 1;
  const auto time_of = [&](Index i) { return first_time_ + static_cast<double>(i) * step_; };
  Index to = even_.end();
  while (ended ? to < even_rows_ : time_of(to) <= last) ++to;
  const MatrixXd& x = raw_.all();
  const auto rows = static_cast<Index>(times_.size());
  MatrixXd out(to - even_.end(), x.cols());
  Index k = 0;
  for (Index i = 0; i < out.rows(); ++i) {
    const double t = time_of(even_.end() + i);
    while (k + 2 < rows && times_[static_cast<std::size_t>(k + 1)] < t) ++k;
    const double before = times_[static_cast<std::size_t>(k)], after = times_[static_cast<std::size_t>(k + 1)];
    const double part = std::clamp((t - before) / (after - before), 0.0, 1.0);
    out.row(i) = (1.0 - part) * x.row(k) + part * x.row(k + 1);
  }
  even_.append(out);
  // The next step is after the last row: that one and the one before are all that it may need.
  const Index gone = rows - 2;
  raw_.drop_before(raw_.begin() + gone);
  times_.erase(times_.begin(), times_.begin() + gone);
}

// A joint that speeds up at an end does so beyond it: mirrored alone it would run on evenly.
Bends Stretch::bends_of(const RowWindow& positions, Index column, bool ended) const {
  const Index rows = positions.all().rows(), period = weights_.size() / 4 + 1;
  const Index seen = std::min(rows, std::max(kFewestForBend, period));
  const double* x = positions.all().col(column).data();
  Bends out;
  if (positions.begin() == 0) out.first = bend_of(x, 1, seen);
  if (ended) out.last = bend_of(x + rows - 1, -1, seen);
  return out;
}

void Stretch::filter(bool ended) {
  const Index half = weights_.size() / 2;
  const Index reached = ended ? even_.end() : std::max<Index>(0, even_.end() - half);
  const Index rows = even_.all().rows();
  const auto filtered_to = [&](RowWindow* out, Index first_column, Index stride, bool are_positions) {
    const Index first = out->end(), end = std::max(first, (reached + stride - 1) / stride);
    MatrixXd more(end - first, joints_);
    for (Index j = 0; j < joints_ && end > first; ++j) {
      const double* x = even_.all().col(first_column + j).data();
      filter_column(x, rows, weights_, stride, first - even_.begin() / stride, end - first, more.col(j).data(),
                    are_positions ? bends_of(even_, first_column + j, ended) : Bends{});
    }
    out->append(more);
  };
  filtered_to(&smooth_, 0, 1, true);
  filtered_to(&measured_, joints_, coarse_, false);
}

void Stretch::add_motion(bool ended) {
  if (between_ > 1) return add_motion_between(ended);
  constexpr Index kReach = 2;  // of the second derivative
  const Index first = motion_.end(), known = ended ? smooth_.end() : std::max<Index>(0, smooth_.end() - kReach);
  const Index end = std::max(first, (known + fine_ - 1) / fine_);
  if (end == first) return;
  const Index low = std::max<Index>(0, first * fine_ - kReach);
  const MatrixXd q = smooth_.rows(low, smooth_.end() - low), qd = rate_of(q, step_), qdd = rate_of(qd, step_);
  const auto further = static_cast<Index>(columns_.size());
  MatrixXd more(end - first, 3 * joints_ + further);
  for (Index i = first; i < end; ++i) {
    const Index at = i * fine_ - low;
    more.row(i - first).head(3 * joints_) << q.row(at), qd.row(at), qdd.row(at);
    more.row(i - first).tail(further) = even_.rows(i * fine_, 1).row(0).tail(further);
  }
  motion_.append(more);
}

// Rows that are far apart say less of speed and acceleration than the smooth curve through them does.
void Stretch::add_motion_between(bool ended) {
  const Index known = ended ? smooth_.end() : std::max<Index>(0, smooth_.end() - SplineBetween::kReach);
  const Index first = motion_.end() / between_;  // whole steps between two rows, but for the last row
  const Index steps = std::max<Index>(0, known - 1 - first);
  if (motion_.end() > first * between_ || (steps == 0 && !(ended && known > first))) return;
  const Index end = steps * between_ + (ended ? 1 : 0);
  const auto further = static_cast<Index>(columns_.size());
  MatrixXd more(end, 3 * joints_ + further);
  const MatrixXd& q = smooth_.all();
  std::vector<Bends> bends;
  for (Index j = 0; j < joints_; ++j) bends.push_back(bends_of(smooth_, j, ended));
  for (Index part = 0; part < between_; ++part) {
    const SplineBetween spline(static_cast<double>(part) / static_cast<double>(between_), step_);
    const Index count = (end - part + between_ - 1) / between_;
    for (Index j = 0; j < joints_; ++j) {
      const MatrixXd values = spline.at(q.col(j), first - smooth_.begin(), count, bends[static_cast<std::size_t>(j)]);
      for (Index d = 0; d < 3; ++d)
        for (Index i = 0; i < count; ++i) more(i * between_ + part, d * joints_ + j) = values(i, d);
    }
  }
  for (Index i = 0; i < end; ++i) {
    const Index row = first + i / between_, after = std::min(row + 1, even_.end() - 1);
    const double part = static_cast<double>(i % between_) / static_cast<double>(between_);
    more.row(i).tail(further) =
        (1.0 - part) * even_.rows(row, 1).row(0).tail(further) + part * even_.rows(after, 1).row(0).tail(further);
  }
  motion_.append(more);
}

void Stretch::forget() {
  const Index half = weights_.size() / 2, done = motion_.end() / between_ * fine_;  // rows that the motion has
  const Index needed = std::min({smooth_.end() - half, measured_.end() * coarse_ - half, done}) / coarse_ * coarse_;
  even_.drop_before(needed);
  smooth_.drop_before(done - std::max<Index>(2, between_ > 1 ? SplineBetween::kReach : 0));
  const Index reach = reach_ + rows_in(kMostLeadIn + kRestWindow, fine_step_) + 2 * stride_;
  motion_.drop_before(next_ * stride_ - reach);
  measured_.drop_before(next_);
}

bool Stretch::is_complete(Index to, bool ended) const {
  if (ended) return true;
  const Index reach = std::max(reach_, rows_in(kRestWindow, fine_step_));
  return measured_.end() >= to && motion_.end() > (to - 1) * stride_ + reach;
}

bool Stretch::take(bool ended, const Use& use) {
  if (times_.size() < 2 && even_.end() == 0) return true;
  resample(ended);
  filter(ended);
  add_motion(ended);
  const Index each = std::max<Index>(1, kTileRows / stride_);
  while (ended ? next_ < measured_.end() : is_complete(next_ + each, ended)) {
    Tile one = tile(next_, ended ? std::min(measured_.end(), next_ + each) : next_ + each);
    next_ += one.count;
    if (!use(one)) return false;
  }
  forget();
  return true;
}

/// The row before this one from which on every joint has travelled so far that play operators forget what was before.
Index Stretch::row_that_forgets(Index row) const {
  const Index earliest = std::max<Index>(0, row - static_cast<Index>(kMostLeadIn / fine_step_));
  VectorXd low = motion_.rows(row, 1).row(0).head(joints_), high = low;
  while (row > earliest && (high - low).minCoeff() < kForgets) {
    --row;
    const VectorXd q = motion_.rows(row, 1).row(0).head(joints_);
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  return row;
}

/// Rows [from, to) that the fit sees, with the rows before and after that filter and play operators reach.
Tile Stretch::tile(Index from, Index to) const {
  const Index coarse_begin = row_that_forgets(std::max<Index>(0, from * stride_ - reach_)) / stride_;
  const Index begin = coarse_begin * stride_, end = std::min(motion_.end(), (to - 1) * stride_ + reach_ + 1);
  Tile out;
  out.weights = seen_weights_;
  out.stride = stride_;
  out.between = between_;
  out.first = from - coarse_begin;
  out.count = to - from;
  const MatrixXd rows = motion_.rows(begin, end - begin);
  Motion& motion = out.motion;
  motion.step = fine_step_;
  motion.time.resize(rows.rows());
  for (Index i = 0; i < rows.rows(); ++i)
    motion.time[i] = first_time_ - start_ + static_cast<double>(begin + i) * fine_step_;
  motion.q = rows.leftCols(joints_);
  motion.qd = rows.middleCols(joints_, joints_);
  motion.qdd = rows.middleCols(2 * joints_, joints_);
  for (std::size_t c = 0; c < columns_.size(); ++c)
    motion.columns[columns_[c]] = rows.col(3 * joints_ + static_cast<Index>(c));
  out.measured = measured_.rows(from, to - from);

  const Index window = rows_in(kRestWindow, fine_step_);
  const Index seen = std::max<Index>(0, from - (window + stride_ - 1) / stride_);
  const Index seen_end = std::min(motion_.end(), (to - 1) * stride_ + window + 1);
  const MatrixXd qd = motion_.rows(seen * stride_, seen_end - seen * stride_).middleCols(joints_, joints_);
  out.moving = moving_rows(qd, at_rest_, window, stride_).middleRows(from - seen, to - from);
  out.inside = MatrixXd::Ones(to - from, joints_);
  // A tile that is not the last one ends further from the end of what was read than this.
  const Index edge = std::min(rows_in(kEdge / cutoff_, fine_step_), motion_.end());
  for (const Index at : {Index{0}, motion_.end() - edge}) {
    const Index first = std::max(from, (at + stride_ - 1) / stride_);
    const Index near = std::min(to, (at + edge - 1) / stride_ + 1) - first;
    if (near <= 0) continue;
    const MatrixXd qd_there = motion_.rows(at, edge).middleCols(joints_, joints_);
    for (Index j = 0; j < joints_; ++j) {
      const double least = qd_there.col(j).minCoeff(), most = qd_there.col(j).maxCoeff();
      if (least * most > 0.0 || std::max(-least, most) <= at_rest_[j]) continue;  // it runs on, or rests
      out.inside.col(j).segment(first - from, near).setZero();
      out.moving.col(j).segment(first - from, near).setZero();
    }
  }
  return out;
}

}  // namespace truing::dynamics
