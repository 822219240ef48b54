// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "model/row_slip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "math/constants.hpp"
#include "math/statistics.hpp"
#include "model/readings.hpp"

namespace truing::model {
namespace {

constexpr int kMost = 3;  ///< rows apart
constexpr std::size_t kFewestRows = 24;
constexpr int kVotes = 8;             ///< poses that must speak for it, on either side
constexpr double kAgreed = 0.9;       ///< of those that can tell
constexpr double kTells = 2.0;        ///< a row tells which it is where one error is so many times the other
constexpr double kPlain = 4.0;        ///< so many times more is left by the wrong one of both
constexpr double kAlike = 3.0;        ///< what is left on both sides differs by less
constexpr double kHardlyFits = 0.02;  ///< of the measured range: more left, and the robot is not this one

/// Errors of every row with what was measured some rows further down.
class Errors {
 public:
  Errors(Robot robot, const Measurements& data, const FramesFit& frames)
      : robot_(std::move(robot)), data_(data), frames_(frames) {}

  /// NaN: there is no such row, or nothing was measured there.
  double operator()(int shift, std::size_t row) {
    const auto measured = static_cast<std::ptrdiff_t>(row) + shift;
    if (measured < 0 || measured >= static_cast<std::ptrdiff_t>(data_.rows)) return kNaN;
    std::vector<double>& errors = errors_[static_cast<std::size_t>(shift + kMost)];
    if (errors.empty()) errors = frames_.errors(robot_, shift == 0 ? data_ : with_rows_shifted(data_, shift));
    return errors[row];
  }

 private:
  Robot robot_;
  const Measurements& data_;
  const FramesFit& frames_;
  std::array<std::vector<double>, 2 * kMost + 1> errors_;
};

/// Which of two pairings a row speaks for: 1 in step, -1 shifted, 0 it cannot tell.
int vote(double in_step, double shifted) {
  if (!std::isfinite(in_step) || !std::isfinite(shifted)) return 0;
  return kTells * in_step < shifted ? 1 : kTells * shifted < in_step ? -1 : 0;
}

/// What the rows on one side of a slip say. Repeats of a pose, one after the other, have one vote.
struct Side {
  int votes_for = 0, votes_against = 0;
  std::vector<double> right, wrong;  ///< errors by the pairing that this side is to have, and by the other; of voters
  std::vector<double> all;           ///< errors by the right pairing, of all rows

  bool is_clear() const {
    return votes_for >= kVotes && votes_for >= kAgreed * (votes_for + votes_against) &&
           median_of(wrong) > kPlain * median_of(right);
  }
};

Side side_of(Errors& errors, const std::vector<std::int32_t>& pose, std::size_t first, std::size_t last, int shift,
             int wanted) {
  Side out;
  std::int32_t last_pose = -1;
  for (std::size_t row = first; row < last; ++row) {
    const double in_step = errors(0, row), shifted = errors(shift, row);
    const double right = wanted > 0 ? in_step : shifted;
    if (std::isfinite(right)) out.all.push_back(right);
    const int says = vote(in_step, shifted);
    if (says == 0) continue;
    out.right.push_back(right);
    out.wrong.push_back(wanted > 0 ? shifted : in_step);
    if (pose[row] != last_pose) ++(says == wanted ? out.votes_for : out.votes_against);
    last_pose = pose[row];
  }
  return out;
}

/// The row from which on most rows are on the right side, of a slip by `shift`.
std::size_t best_row(Errors& errors, std::size_t rows, int shift) {
  int sum = 0, best = 0;
  std::size_t from = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    sum += vote(errors(0, row), errors(shift, row));
    if (sum <= best) continue;
    best = sum;
    from = row + 1;
  }
  return from;
}

std::optional<RowSlip> slip_by(Errors& errors, const std::vector<std::int32_t>& pose, double range, int shift) {
  const std::size_t rows = pose.size();
  RowSlip slip;
  slip.shift = shift;
  slip.from = best_row(errors, rows, shift);
  if (slip.from == 0 || slip.from >= rows) return std::nullopt;
  const Side before = side_of(errors, pose, 0, slip.from, shift, 1),
             after = side_of(errors, pose, slip.from, rows, shift, -1);
  if (!before.is_clear() || !after.is_clear()) return std::nullopt;
  const double first = median_of(before.all), second = median_of(after.all);
  if (std::max(first, second) > kHardlyFits * range || std::max(first, second) > kAlike * std::min(first, second))
    return std::nullopt;
  slip.before = median_of(after.wrong);
  slip.after = median_of(after.right);
  return slip;
}

/// Rows `first` to `last` alone, a few hundred of them.
Measurements only(const Measurements& data, std::size_t first, std::size_t last, std::vector<double>* weights) {
  constexpr std::size_t kEnough = 400;
  weights->assign(data.rows, 0.0);
  const std::size_t step = (last - first) / kEnough + 1;
  for (std::size_t row = first; row < last; row += step) (*weights)[row] = data.weight ? data.weight[row] : 1.0;
  Measurements out = data;
  out.weight = {weights->data(), 1};
  return out;
}

/// Search for one slip, by base and targets fitted to rows that are in step in themselves.
class SlipSearch {
 public:
  SlipSearch(const Measurements& data, const FramesFit& frames)
      : data_(data), frames_(frames), pose_(pose_groups(data)), range_(measured_range(data, every_row(data.rows))) {}

  std::optional<RowSlip> run() {
    const std::size_t third = data_.rows / 3;
    Errors by_first = fitted_to(data_, 0, third);
    if (is_in_step(&by_first, third)) return std::nullopt;
    for (const int shift : kShifts) {
      if (const auto slip = slip_by(by_first, pose_, range_, shift)) return slip;
    }
    for (const int shift : kShifts) {
      // Rows at the end have no partner that many rows down: they stay out of the fit.
      const std::size_t last = data_.rows - static_cast<std::size_t>(std::max(0, shift));
      Errors by_last = fitted_to(with_rows_shifted(data_, shift), last - third, last);
      if (const auto slip = slip_by(by_last, pose_, range_, shift)) return slip;
    }
    return std::nullopt;
  }

 private:
  static constexpr int kShifts[] = {1, -1, 2, -2, 3, -3};

  static std::vector<std::int32_t> every_row(std::size_t rows) {
    std::vector<std::int32_t> out(rows);
    std::iota(out.begin(), out.end(), 0);
    return out;
  }

  Errors fitted_to(const Measurements& data, std::size_t first, std::size_t last) const {
    std::vector<double> weights;
    return {frames_.fit(only(data, first, last, &weights)), data_, frames_};
  }

  /// Too few rows are far off to make a side of a slip.
  bool is_in_step(Errors* errors, std::size_t fitted) const {
    std::vector<double> inside;
    for (std::size_t row = 0; row < fitted; ++row) {
      if (std::isfinite((*errors)(0, row))) inside.push_back((*errors)(0, row));
    }
    const double usual = median_of(inside);
    int far_off = 0;
    for (std::size_t row = 0; row < data_.rows; ++row) far_off += (*errors)(0, row) > kPlain * usual ? 1 : 0;
    return usual < kHardlyFits * range_ && far_off < kVotes;
  }

  const Measurements& data_;
  const FramesFit& frames_;
  std::vector<std::int32_t> pose_;
  double range_;
};

}  // namespace

std::optional<RowSlip> find_row_slip(const Measurements& data, const FramesFit& frames) {
  if (data.rows < kFewestRows || !(data.position[0] || data.distance)) return std::nullopt;
  try {
    return SlipSearch(data, frames).run();
  } catch (const std::invalid_argument&) {
    return std::nullopt;  // a third of the rows cannot be fitted
  }
}

std::pair<std::size_t, std::size_t> rows_in_doubt(const Measurements& data, const RowSlip& slip) {
  const auto by = static_cast<std::size_t>(std::abs(slip.shift));
  return {slip.from - std::min(slip.from, by), std::min(slip.from + by, data.rows)};
}

Measurements with_slip_undone(const Measurements& data, const RowSlip& slip) {
  const auto [doubtful, sure] = rows_in_doubt(data, slip);
  std::vector<std::size_t> joints_of(data.rows), measured_of(data.rows);
  auto weights = std::make_shared<std::vector<double>>(data.rows, 0.0);
  for (std::size_t row = 0; row < data.rows; ++row) {
    const std::ptrdiff_t measured = static_cast<std::ptrdiff_t>(row) + (row < slip.from ? 0 : slip.shift);
    const bool paired = (row < doubtful || row >= sure) && measured < static_cast<std::ptrdiff_t>(data.rows);
    // A row in doubt is the row before it once more, which is in step, and does not count.
    const std::size_t like = row < sure ? doubtful - 1 : row - static_cast<std::size_t>(std::abs(slip.shift));
    joints_of[row] = paired ? row : joints_of[like];
    measured_of[row] = paired ? static_cast<std::size_t>(measured) : measured_of[like];
    if (paired) (*weights)[row] = data.weight ? data.weight[row] : 1.0;
  }
  Measurements out = with_rows_paired(data, joints_of, measured_of);
  out.weight = {weights->data(), 1};
  out.owner = std::make_shared<std::pair<std::shared_ptr<const void>, std::shared_ptr<std::vector<double>>>>(out.owner,
                                                                                                             weights);
  return out;
}

std::string text_of(const RowSlip& slip) {
  const int by = std::abs(slip.shift);
  return "from row " + std::to_string(slip.from + 1) + " on, what was measured " + std::to_string(by) +
         (by == 1 ? " row " : " rows ") + (slip.shift > 0 ? "further down" : "further up") +
         " belongs to a row's joints, and before it the row's own: " +
         (slip.shift > 0 ? "joints are missing there, or something was measured twice"
                         : "a measurement is missing there, or joints were written twice");
}

}  // namespace truing::model
