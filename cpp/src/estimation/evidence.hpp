// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which groups of columns explain the data: Gaussian evidence from the Gram matrix alone, and a search over subsets.
// (MacKay 1992, Bayesian interpolation; the noise is integrated out, each group's prior scale is chosen from a short
// list.)

#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "rooms.hpp"

namespace truing::estimation {

/// Normal equations of unit-weight rows: X^T X, X^T y, y^T y, and how many values went in.
struct Gram {
  Eigen::MatrixXd xx;
  Eigen::VectorXd xy;
  double yy = 0.0;
  double n = 0.0;

  void add(const Gram& other, double times = 1.0);
  void scale(double times);
  Gram of(const std::vector<int>& columns) const;
};

/// Cholesky, with ever more added to the diagonal where rounding has made the matrix indefinite.
Eigen::LLT<Eigen::MatrixXd> factorised(Eigen::MatrixXd d);

/// The upper triangle of A^-1, for A = L L^T.
Eigen::MatrixXd upper_inverse(const Eigen::LLT<Eigen::MatrixXd>& factor, int threads = 1);
/// Its diagonal alone, which is quicker.
Eigen::VectorXd diagonal_of_inverse(const Eigen::LLT<Eigen::MatrixXd>& factor, int threads = 1);
/// Trace of the product of two symmetric matrices, of one of which only the upper triangle is given.
double trace_of_product(const Eigen::MatrixXd& upper, const Eigen::MatrixXd& whole);

/// Sums weighted rows to a Gram, on the kernel that the processor is best at.
class GramSum {
 public:
  explicit GramSum(Eigen::Index columns);
  /// Room for one row: write its values, the measured one last, then push().
  double* row() { return rows_.data() + filled_ * rows_.cols(); }
  void push();
  /// The Gram of the rows since the last one.
  Gram finish();

 private:
  static constexpr Eigen::Index kLength = 256;
  void fold_in();

  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Index columns_;
  Eigen::Index filled_ = 0;
  double n_ = 0.0;
  Rows rows_;  ///< shape (kLength, columns + 1 and what the kernel needs more)
  Rows sums_;  ///< upper triangle of the products of these columns, once something was folded in
};

/// Columns that come and go together, as the search sees them.
struct ColumnGroup {
  std::vector<int> columns;
  double cost = 0.0;         ///< nats: log of how many groups of its kind there are, and of what was scanned to find it
  int law_at = -1;           ///< number of "law of a driver at a joint", the same for all groups that are one; -1: none
  int corrects_law_at = -1;  ///< of a law's correction: may only enter beside a law of this number; -1: free to enter
  bool shadow = false;       ///< never enters; only an alternative
};

struct SearchOptions {
  double threshold = 4.0;      ///< nats that a group must win beyond its cost
  double least_share = 0.015;  ///< of what is unexplained, that a group must explain
  double law_share =
      0.75;  ///< a law's correction goes before a second effect if it wins at least this part of what that one would
  int beam = 3;
  int most_groups = 12;
  int threads = 1;  ///< 0: as many as the machine has; nothing depends on it
};

/// A set of groups with the scale of each one's prior.
struct Choice {
  std::vector<int> groups;
  std::vector<double> scales;
};
Choice with_one_more(Choice choice, int group, double scale);

/// What becomes of the columns that are always in.
enum class Nuisance {
  in_factor,   ///< State::factor is of them and of the others
  eliminated,  ///< once (Schur complement): State::factor is of the others alone, and a choice costs what its own
               ///< columns do
};

/// One Gram, its groups, and everything that the search asks of them.
class Evidence {
 public:
  /// `nuisance`: columns that are always in, with a flat prior. `prior[k]`: the size that column k's parameter may
  /// have. `gram` and `groups` must outlive it.
  /// With Nuisance::eliminated rows of what is left of the Gram are kept where gains are asked for: see keep_rest().
  Evidence(const Gram& gram, const std::vector<ColumnGroup>& groups, std::vector<int> nuisance,
           const Eigen::VectorXd& prior, Nuisance treated = Nuisance::in_factor);
  Evidence(const Gram&&, const std::vector<ColumnGroup>&, std::vector<int>, const Eigen::VectorXd&,
           Nuisance = Nuisance::in_factor) = delete;

  /// A choice evaluated.
  struct State {
    Choice choice;
    std::vector<int> columns;   ///< nuisance, then the groups'
    Eigen::VectorXd precision;  ///< prior precision of each column, times the noise variance it has to be multiplied by
    Eigen::LLT<Eigen::MatrixXd> factor;  ///< of X^T X + sigma^2 P; see Nuisance
    Eigen::VectorXd solution;
    double rss = 0.0;  ///< penalised
    double sigma2 = 0.0;
    double evidence = 0.0;  ///< log, but for a constant of the Gram
    double score = 0.0;     ///< evidence less the groups' costs
  };

  State evaluate(const Choice& choice) const;
  /// The same with the variance of noise given, against which priors count: `score` is comparable with that of choices
  /// which leave as much. What a group is to take the place of is evaluated so: at the noise that is left without
  /// either, priors would hold the other groups back from making room for it.
  State evaluate_at(double sigma2, const Choice& choice) const;

  /// Before several threads ask side by side for gains of this choice, and of parts of it. No number depends on it.
  void keep_rest(const Choice& choice) const;

  /// What adding a group would win.
  struct Gain {
    int group = -1;
    double scale = 1.0;
    double evidence = -1e300;  ///< log Bayes factor
    double score = -1e300;     ///< less its cost
    double share = 0.0;        ///< of the unexplained sum of squares
    double squares = 0.0;      ///< fall of the sum of squares, plain least squares
    int rank = 0;              ///< columns that the data can see
  };
  /// Only groups of fewer columns than `fewer` are looked at: the others win nothing.
  std::vector<Gain> gains(const State& state, int threads = 1,
                          std::size_t fewer = std::numeric_limits<std::size_t>::max()) const;

  /// The same for columns outside the Gram: theirs (X^T X, X^T y) after projection on the state, and their priors.
  Gain gain_of(const State& state, const Eigen::MatrixXd& a, const Eigen::VectorXd& b, const Eigen::VectorXd& prior,
               double cost) const;

  /// What adding columns of the Gram would win.
  Gain gain(const State& state, const std::vector<int>& columns, double cost) const;

  /// The group is no shadow, is not in yet, and what it corrects is.
  bool may_enter(const State& state, int group) const;

  /// What is left of a column's square beyond the state's columns.
  double visible(const State& state, int column) const;

  /// Share of what columns `what` times `theta` do, beyond the state's own columns, that columns `by` can do as well.
  double explained(const State& state, const std::vector<int>& what, const Eigen::VectorXd& theta,
                   const std::vector<int>& by) const;
  /// The same of one `by` after the other: what is of `what` alone is found once. It lives no longer than the state.
  std::function<double(const std::vector<int>& by)> explained(const State& state, const std::vector<int>& what,
                                                              const Eigen::VectorXd& theta) const;

  /// Forward with a beam, then backward and swap until nothing helps.
  State search(const SearchOptions& options, const Choice& start = {}) const;
  State improve(State state, const SearchOptions& options) const;

  /// Noise-only data: the largest score of any single group, `count` times.
  std::vector<double> null_scores(const State& state, int count, std::uint64_t seed, int threads) const;

  const Gram& gram() const { return gram_; }
  const std::vector<ColumnGroup>& groups() const { return groups_; }
  const std::vector<int>& nuisance() const { return nuisance_; }
  const Eigen::VectorXd& prior() const { return prior_; }
  double degrees_of_freedom() const { return degrees_of_freedom_; }

 private:
  /// `sigma2` of priors, for so many rounds as its most probable value takes to settle.
  State evaluate(const Choice& choice, double sigma2, int rounds) const;
  struct Projected;
  Projected project(const State& state, int threads = 1) const;
  /// Of the columns that State::factor is of.
  std::vector<int> factored(const State& state) const;
  /// What the eliminated columns leave of X^T X, of X^T y and of y^T y.
  Eigen::MatrixXd rest(const std::vector<int>& rows, const std::vector<int>& columns) const;
  Eigen::VectorXd rest(const std::vector<int>& columns) const;
  const Eigen::VectorXd& rest_row(int column) const;  ///< kept
  /// L^-1 of the products of State::factor's columns with some others.
  Eigen::MatrixXd projected_on(const State& state, const std::vector<int>& columns) const;
  /// No group: none may enter.
  Gain best_of(const State& state, const std::vector<Gain>& gains, int but) const;
  /// What the search would add, of fewer columns than this: worth its place by itself, and no law's correction. No
  /// group: nothing.
  Gain addition_to(const State& state, const SearchOptions& options, std::size_t fewer) const;
  /// A flexible group may have taken the place of a plainer one and of another beside it: the best two in its place
  /// that have fewer columns together, if they win, by the threshold, more than the best one beside it would. Else the
  /// state.
  State two_in_place(const State& state, const State& less, int gone, const std::vector<Gain>& gains,
                     const SearchOptions& options) const;

  const Gram& gram_;
  const std::vector<ColumnGroup>& groups_;
  std::vector<int> nuisance_;
  Eigen::VectorXd prior_;
  double degrees_of_freedom_ = 0.0;  ///< values less nuisance columns
  std::size_t eliminated_ = 0;       ///< leading columns of a state that its factor is not of
  Eigen::LLT<Eigen::MatrixXd> always_;
  Eigen::MatrixXd always_half_;              ///< L^-1 N^T X of the eliminated columns N
  Eigen::VectorXd always_half_y_, rest_xy_;  ///< L^-1 N^T y, and what is left of X^T y
  double rest_yy_ = 0.0;
  mutable std::vector<Eigen::VectorXd> rest_rows_;  ///< by column; empty: not yet asked for
  std::vector<Eigen::MatrixXd> rest_of_groups_;     ///< each with itself
};

/// Nats that a group of so many columns has to win from so many values before the search takes it: the threshold, what
/// having looked at all of them costs, and what its flexibility does (as the evidence of many values has it: half a log
/// of their number a column).
double detection_nats(double threshold, double cost, std::size_t columns, double values);

/// Sum of squares on `held_out` of the ridge fit `state` made on other rows (same columns).
double held_out_squares(const Gram& held_out, const std::vector<int>& columns, const Eigen::VectorXd& solution);

}  // namespace truing::estimation
