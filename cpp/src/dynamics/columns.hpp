// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The columns of a design along recordings, filtered, and their normal equations.

#include <functional>
#include <vector>

#include "dynamics/design.hpp"
#include "rooms.hpp"

namespace truing::dynamics {

/// Rows at rest are not fitted: who asks for no others needs no columns of a joint that rests all through a tile.
enum class Resting { made, left_out };

/// Tables of columns, tile by tile. Where tiles are kept, so are columns that need no torque.
class DesignColumns {
 public:
  /// Filtered columns of a joint, and room for the torque behind them. What several have stands in one place. Moved,
  /// and never copied: the copy's columns would stand with the other one.
  struct Table {
    Eigen::MatrixXd own;           ///< shape=(rows, columns + 1); no rows where the joint rests and is left out
    std::vector<double*> columns;  ///< where each stands: here, beside another joint's or with the links'

    Table() = default;
    Table(Table&&) = default;
    Table& operator=(Table&&) = default;
    Eigen::Index rows() const { return own.rows(); }
    /// As a matrix, with so many columns to be filled behind them.
    Eigen::MatrixXd copied(Eigen::Index more) const;
  };
  struct Tables {
    std::vector<Table> joints;
    std::vector<Eigen::MatrixXd> links;  ///< where the tile does not keep them
  };

  /// Both must outlive it.
  DesignColumns(const Tiles& tiles, const TorqueDesign& design, Resting resting = Resting::made);
  /// Of some columns of the design alone, ascending numbers; they are not kept.
  DesignColumns(const Tiles& tiles, const TorqueDesign& design, std::vector<int> columns,
                Resting resting = Resting::made);

  const Tiles& tiles() const { return tiles_; }
  const TorqueDesign& design() const { return design_; }
  /// They are made once; else anew in every pass.
  bool are_kept() const { return !kept_.empty(); }
  /// Some of the columns ask for the torque of a model.
  bool any_needs_torque() const { return needs_torque_; }
  /// Numbers of the design's columns that a joint's torque has here, ascending.
  const std::vector<int>& of_joint(std::size_t joint) const { return by_joint_[joint]; }

  /// Calls use(tables) of a tile. Columns that need a torque are there if `with_torque`, by Motion::torque; where they
  /// are kept those that are `idle`, by column of the design, stay as they were.
  void use(Tile* tile, bool with_torque, const std::function<void(Tables&)>& use,
           const std::vector<bool>& idle = {}) const;
  /// Friction turns otherwise now: columns that look at the direction are made anew.
  void turned();

 private:
  void fill(Tile* tile, const std::function<bool(const TorqueTerm&, int column)>& wanted, Tables* tables) const;
  /// Without their columns.
  Tables empty_tables(const Tile& tile) const;
  /// The filtered columns of the links, kept with the tile where tiles are.
  std::vector<Eigen::MatrixXd>& links_of(Tile* tile, Tables* tables) const;

  const Tiles& tiles_;
  const TorqueDesign& design_;
  Resting resting_;
  RigidChain chain_;
  std::vector<int> columns_;  ///< ascending
  std::vector<std::vector<int>> by_joint_;
  bool needs_torque_ = false;
  mutable std::vector<Tables> kept_;  ///< by tile, where they are kept; empty: not yet made
  mutable std::vector<char> stale_;   ///< by tile: turned() since
};

/// Sums of the same columns over the same folds, from before the torque that is seen became another, or friction
/// turned otherwise (DesignColumns::turned): products of columns that ask for neither are as they were.
struct EarlierSums {
  std::vector<TorqueGrams> grams{};  ///< of the same rows; none: there are no such sums
  bool turned = false;
  /// By column of the design; empty: none. Nobody will choose them, so the torque that they saw will do.
  std::vector<bool> idle{};
};

/// Rows of a joint: those that are fitted, in which it moves; those beside them in which it rests, but for ends at
/// which it turns (Tile::inside); all that are judged.
enum class Rows { fitted, resting, judged };

/// Measured torque less that of `subtracted` against the design's columns, by kinds of rows, in one pass. Terms that
/// need a torque see that of `seen`.
std::vector<TorqueGrams> sum_grams(const DesignColumns& columns, const TorqueModel& subtracted, const TorqueModel& seen,
                                   const Folds& folds, const EarlierSums& earlier, const std::vector<Rows>& rows);
/// The same of one kind.
inline TorqueGrams sum_grams(const DesignColumns& columns, const TorqueModel& subtracted, const TorqueModel& seen,
                             const Folds& folds, const EarlierSums& earlier = {}, Rows rows = Rows::fitted) {
  return sum_grams(columns, subtracted, seen, folds, earlier, std::vector<Rows>{rows}).front();
}

/// What values, by column of the design, leave of the torques that were summed: rms of all of these rows by joint
/// [Nm | N].
std::vector<double> rms_of(const std::vector<TorqueGrams>& rows, const Eigen::VectorXd& values);

/// What the model and the columns times values leave; no column that has a value may need a torque.
std::vector<Noise> noise_of(const DesignColumns& columns, const TorqueModel& model, const Eigen::VectorXd& values,
                            const Folds& folds);

}  // namespace truing::dynamics
