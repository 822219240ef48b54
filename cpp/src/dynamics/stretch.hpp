// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A stretch of a recording without gaps: rows go in as they come, tiles come out, and of the rows no more is kept than
// what later tiles reach back to.

#include <functional>
#include <vector>

#include "dynamics/filter.hpp"
#include "dynamics/prepare.hpp"
#include "rooms.hpp"

namespace truing::dynamics {

/// Rows of a table that grows at its end and is forgotten at its beginning; they keep their numbers.
class RowWindow {
 public:
  Eigen::Index begin() const { return begin_; }
  Eigen::Index end() const { return begin_ + rows_.rows(); }
  /// Rows from `first` on.
  Eigen::Ref<const Eigen::MatrixXd> rows(Eigen::Index first, Eigen::Index count) const {
    return rows_.middleRows(first - begin_, count);
  }
  const Eigen::MatrixXd& all() const { return rows_; }
  void append(const Eigen::MatrixXd& more);
  /// Forgets rows before this one, but never those after the last.
  void drop_before(Eigen::Index first);

 private:
  Eigen::MatrixXd rows_;
  Eigen::Index begin_ = 0;
};

/// Makes the tiles of one stretch. A tile's bits do not depend on how many rows came at a time.
class Stretch {
 public:
  using Use = std::function<bool(Tile&)>;

  /// at_rest: `speeds_at_rest`, of every joint; columns: names of the further ones; step: [s] between rows.
  Stretch(Eigen::VectorXd at_rest, std::vector<std::string> columns, double step, const PrepareOptions& options);

  /// Rows begin to end of a recording that began at `start` [s].
  void add(const Recording& rows, Eigen::Index begin, Eigen::Index end, double start);
  /// Calls `use` with the tiles that are complete; `ended`: no rows come any more, and these are all. False as soon as
  /// `use` returned it.
  bool take(bool ended, const Use& use);
  /// Too short to be filtered; known when it has ended.
  bool is_too_short() const;
  /// [Hz] the wanted one, or what rows show that are far apart.
  static double cutoff_of(double wanted, double step);

 private:
  void resample(bool ended);
  Bends bends_of(const RowWindow& positions, Eigen::Index column, bool ended) const;
  void filter(bool ended);
  void add_motion(bool ended);
  void add_motion_between(bool ended);
  void forget();
  bool is_complete(Eigen::Index to, bool ended) const;
  Eigen::Index row_that_forgets(Eigen::Index row) const;
  Tile tile(Eigen::Index from, Eigen::Index to) const;

  const PrepareOptions& options_;
  Eigen::VectorXd at_rest_;  ///< [rad/s | m/s]
  Eigen::Index joints_;
  std::vector<std::string> columns_;
  double step_, fine_step_;
  double cutoff_;                           ///< [Hz]
  Eigen::Index fine_, between_;             ///< steps in a row of the motion, or rows of it in a step
  Eigen::Index coarse_, stride_;            ///< steps, and rows of the motion, in a row that the fit sees
  Eigen::VectorXd weights_, seen_weights_;  ///< of every step, and of rows of the motion as they were recorded
  Eigen::Index reach_;                      ///< rows of the motion on both sides that the filter sees
  double first_time_ = 0.0;                 ///< [s] of the first row
  double start_ = 0.0;                      ///< [s] where its recording begins
  bool any_ = false;

  Eigen::Index even_rows_ = -1;  ///< of the whole stretch, known when it has ended
  std::vector<double> times_;    ///< [s] of the rows in raw_
  RowWindow raw_;                ///< positions, torques, further columns: as recorded …
  RowWindow even_;               ///< … at even steps …
  RowWindow smooth_;             ///< … positions filtered …
  RowWindow measured_;           ///< … torques filtered, as the fit sees them
  RowWindow motion_;             ///< positions, speeds, accelerations, further columns, at fine steps
  Eigen::Index next_ = 0;        ///< row of the next tile that the fit sees
};

}  // namespace truing::dynamics
