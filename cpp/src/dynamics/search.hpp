// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Which effects explain the torques: one after the other by evidence, and only those that predict folds they were not
// fitted to.

#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "dynamics/problem.hpp"
#include "estimation/evidence.hpp"
#include "rooms.hpp"
#include "truing/dynamics/diagnose.hpp"

namespace truing::dynamics {

struct SearchLimits {
  double threshold = 4.0;    ///< nats beyond the cost
  double least_gain = 0.01;  ///< of the joint's squared error on folds that were not fitted
  int most = 40;
  bool plausible_only = true;  ///< parameters within what machines have
  bool masses_given = false;   ///< the file's: what is the same as fitted ones may enter
};

/// Fits to all rows but those of one fold. The columns that are always in are eliminated once (Schur complement): then
/// a choice costs as much as its own columns do.
class FoldFit {
 public:
  /// `precision`: of the nuisance columns, the same in every choice.
  FoldFit(const Sums& sums, std::size_t fold, const std::vector<int>& nuisance, const Eigen::VectorXd& precision);

  /// Squared error on the fold.
  double squares(const Evidence::State& state);

 private:
  /// Of two columns beside the nuisance columns N, less what these take of them: their product on the others, and on
  /// the fold. NaN: nobody has asked for it.
  struct Pair {
    double others = std::numeric_limits<double>::quiet_NaN(), held = others;
  };
  /// One of these columns, x; of them only what was asked for is known.
  struct Column {
    int number = 0;
    Eigen::VectorXd held;     ///< N^T x on the fold
    Eigen::VectorXd half;     ///< L^-1 N^T x on the others
    Eigen::VectorXd follow;   ///< what the nuisance columns' values give way by, for a value of one
    Eigen::VectorXd left;     ///< N^T (x - N follow) on the fold
    double right = 0.0;       ///< with the torque, less what the nuisance columns take of both: on the others …
    double product = 0.0;     ///< … and on the fold
    std::vector<Pair> pairs;  ///< with every column that was asked for no later than this one, in that order
  };
  Column& column(int number);
  const Pair& pair(Column& one, Column& other);

  const Sums& sums_;
  const FoldGram& fold_;
  const std::vector<int>& nuisance_;
  Eigen::LLT<Eigen::MatrixXd> factor_;          ///< L L^T of the nuisance columns on the others
  Eigen::MatrixXd held_xx_;                     ///< their products on the fold
  Eigen::VectorXd half_y_, follow_y_, left_y_;  ///< as of a column, of the torque
  double left_yy_ = 0.0;                        ///< squared error of the nuisance columns alone
  std::vector<Column> columns_;                 ///< by number
  std::size_t asked_ = 0;                       ///< so many of them
};

/// Candidates over one set of sums.
class Search {
 public:
  /// `nuisance`: columns that are always in. Folds are fitted on so many threads (0: as many as the machine has).
  Search(const TorqueDesign& design, const Sums& sums, std::vector<int> nuisance, int threads = 1);

  /// Takes effects as long as they win; starts from `choice`.
  Choice run(Choice choice, const SearchLimits& limits, bool free_functions) const;

  /// Groups beyond the choice that win and predict folds by parameters that no machine has, the best first: of each the
  /// choice with it, the last group. They are never in an answer, but something that acts so is there.
  std::vector<Choice> refused(const Choice& choice, const SearchLimits& limits) const;

  enum class Ahead { state, squares };
  /// Looks at choices side by side: their states, and their squares on folds, are known when somebody asks for them. On
  /// one thread nothing is looked at before it is asked for; no number depends on it.
  void look_ahead(const std::vector<Choice>& choices, Ahead what) const;
  /// Before several threads ask for gains of this choice, and of parts of it. For states and squares they may ask as it
  /// is: for what nobody looked at before, one after the other.
  void share(const Choice& largest) const { evidence_.keep_rest(largest); }

  const Evidence& evidence() const { return evidence_; }
  int threads() const { return threads_; }
  double joints() const { return static_cast<double>(joints_); }
  double cost(int group) const { return groups_[static_cast<std::size_t>(group)].cost; }
  const Evidence::State& state(const Choice& choice) const { return look(choice).state; }
  /// What every group would add to it.
  const std::vector<Evidence::Gain>& gains(const Choice& choice, int threads = 1) const;
  /// By column of the design: flights through a play that win nothing, neither beside the choice nor beside what is
  /// always in. They are most of the columns that need a torque, and hardly change with it.
  std::vector<bool> idle_flights(const Choice& choice) const;

  /// Squared error of every fold, by the fit to the others.
  const Eigen::VectorXd& squares_of_folds(const Choice& choice) const;
  /// Squared error on other rows, by the fit to all folds.
  static double squares_on(const FoldGram& other, const Evidence::State& state);

  /// Squared errors of folds that were not fitted fall by more than a part of them, over all folds and over those that
  /// are left without the quarter that gains most, or a single fold could decide.
  static bool gains_on_folds(const Eigen::VectorXd& before, const Eigen::VectorXd& after, double least_part);

  /// The choice less its group number `at`.
  static Choice without(const Choice& choice, std::size_t at);

 private:
  /// A choice that was looked at: naming asks again for what the search has seen.
  struct Look {
    Evidence::State state;
    std::once_flag gains_asked;
    std::vector<Evidence::Gain> gains;
    Eigen::VectorXd squares;  ///< empty: not yet asked for
  };
  Look& look(const Choice& choice) const;
  void fill_squares(const std::vector<Look*>& looks, int threads) const;

  /// The choice with one more group that wins, the best first.
  std::vector<Choice> winning(const Choice& choice, const SearchLimits& limits, bool free_functions) const;
  /// The choice with the best group that predicts folds; none: no group does.
  std::optional<Choice> grown(const Choice& choice, const SearchLimits& limits, bool free_functions) const;
  bool may_enter(const Choice& choice, int group, const SearchLimits& limits, bool free_functions) const;
  /// Forms of the effect of group number `at` in its place that explain anything, the best first.
  std::vector<Evidence::Gain> forms_of(const Choice& choice, std::size_t at) const;
  Choice in_best_form(const Choice& choice, std::size_t at, const SearchLimits& limits) const;
  Choice better_forms(Choice choice, const SearchLimits& limits) const;
  /// Of effects or, where these were searched for, of free functions.
  Choice less_what_is_idle(Choice choice, const SearchLimits& limits, bool free_functions) const;
  /// Parameters of the group within what machines have; what is beyond stands for something else.
  bool is_plausible(const Evidence::State& state, int group) const;
  bool predicts(const Eigen::VectorXd& before, const Eigen::VectorXd& after, const SearchLimits& limits) const;

  const TorqueDesign& design_;
  const Sums& sums_;
  std::vector<ColumnGroup> groups_;
  Evidence evidence_;
  int threads_;
  std::vector<std::unique_ptr<FoldFit>> folds_;
  mutable std::map<std::pair<std::vector<int>, std::vector<double>>, Look> looks_;  ///< by groups and scales
  mutable std::mutex asking_;                                                       ///< of a new look
  std::size_t joints_ = 1;
};

/// Of a chosen group: how likely it is that it, or another of its class, is there, and the others.
struct Posterior {
  double probability = 0.0;
  std::vector<TorqueAlternative> confounded{};
};

/// A search with all that it stands on, and what it chose.
struct Account {
  std::shared_ptr<const TorqueDesign> design;
  std::shared_ptr<const Sums> sums;
  std::shared_ptr<const Search> search;
  Choice choice{};
  std::vector<Posterior> posteriors{};  ///< of what was chosen, where it was asked for (leave_out_what_hides)
  Choice small{};                       ///< fitted beside what was chosen, and too small to be named
  bool inertias_given = false;          ///< links' inertias are the file's, but for those that were chosen
  std::vector<FoldGram> held_out = {};  ///< recordings that nothing was fitted to: of what was chosen alone
  /// Of given inertias, the same beside inertias that are all free, where folds gain by them: it names nothing, and is
  /// what is handed over.
  std::shared_ptr<const Account> freed = {};
};
Account account_of(std::shared_ptr<const TorqueDesign> design, Sums sums, std::vector<int> nuisance, int threads);

}  // namespace truing::dynamics
