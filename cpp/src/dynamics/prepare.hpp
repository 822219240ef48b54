// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Recordings as the fit sees them: evenly sampled, filtered without phase, cut at gaps, in tiles.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "dynamics/torque_model.hpp"
#include "rooms.hpp"
#include "truing/dynamics/effect.hpp"
#include "truing/dynamics/recording.hpp"

namespace truing::dynamics {

/// What a joint that slides moves by, where one that turns moves by a radian [m]: as on a drum of this radius.
constexpr double kDrum = 0.1;

/// A joint that has a reading and stays slower is at rest: shape=(joints,) 0.01 rad/s, or of one that slides 1 mm/s.
Eigen::VectorXd speeds_at_rest(const Robot& robot);

/// What was made of a tile and may be asked for again: it depends on nothing but what it is kept under.
struct TileMemory {
  /// By joint, speed, travel and fading of a turn: directions at every row of the motion.
  std::map<std::tuple<Eigen::Index, double, double, double>, Eigen::VectorXd> directions;
  std::vector<FrictionTurn> turns;  ///< those of Motion::direction as it is
  /// Filtered columns of the inertial parameters, in the tile's own rows: by joint, those of the links that it feels.
  std::vector<Eigen::MatrixXd> links;
  KnownTorque known;        ///< at every row of the motion
  std::uint64_t model = 0;  ///< TorqueModel::number() of `torque`
  Eigen::MatrixXd torque;   ///< in the tile's own rows
};

/// A stretch of a recording. Basis functions see every row of `motion`; the fit sees every `stride`-th row of what they
/// give, filtered as the measured torques were.
struct Tile {
  std::size_t recording = 0;
  std::size_t number = 0;  ///< among tiles that are kept
  /// As fine as the basis functions need it; Motion::torque and Motion::rigid are for the caller to fill.
  Motion motion;
  Eigen::VectorXd weights;  ///< of the filter
  Eigen::Index stride = 1;
  /// Torques were recorded at every so many rows of `motion`: the filter sees these alone.
  Eigen::Index between = 1;
  bool means = false;        ///< Recording::torque_is_mean
  Eigen::Index first = 0;    ///< of the filtered rows those before it only lead in
  Eigen::Index count = 0;    ///< of filtered rows that are this tile's own
  Eigen::MatrixXd measured;  ///< shape=(count, joints) [Nm | N] filtered; NaN: not measured
  /// shape=(count, joints): 1 where the joint moves; 0 where it has been at rest a while, and where not `inside`.
  Eigen::MatrixXd moving;
  /// shape=(count, joints): 0 at ends of the stretch at which the joint turns: there the filter averages friction that
  /// nobody recorded.
  Eigen::MatrixXd inside;
  TileMemory memory;

  /// The tile's own rows of basis values given at every row of the motion.
  Eigen::MatrixXd own_rows(const Eigen::MatrixXd& values) const;
  /// The same of one column, into `count` numbers.
  void own_rows(const double* column, double* out) const;
  /// Time of the tile's own rows [s].
  Eigen::VectorXd own_time() const;
};

/// A column of so many steps, `between` of which are a row's time: the mean over the time of each row, which is in its
/// middle; at the ends over the part of it that is there on both sides.
Eigen::VectorXd means_of_rows(const double* column, Eigen::Index steps, Eigen::Index between);

struct PrepareOptions {
  double cutoff = 8.0;                    ///< [Hz]
  std::vector<double> torque_per_ampere;  ///< [Nm/A | N/A] of joints measured by current
  bool short_stretches = false;           ///< those between gaps that are shorter than the filter, too
  bool one_pass = false;                  ///< nobody asks for the tiles twice: they are not written to disk
};

/// [Hz] the wanted cut-off, or what the recordings show whose rows are the nearest.
double cutoff_of(const std::vector<Recording>& recordings, double wanted);

/// Calls `use` with each tile of a recording, in order of time, as long as it returns true. Of a recording that is read
/// no more is in memory than a tile and what leads in to it. Throws std::invalid_argument: too short to be filtered.
void for_each_tile(const Recording& recording, std::size_t number, const Robot& robot, const PrepareOptions& options,
                   const std::function<bool(Tile&)>& use);

class TileFile;

/// The tiles of recordings: kept, where they are few, and else on disk, so that memory does not grow with the rows.
/// Where the disk has no room for them they are made anew in every pass.
class Tiles {
 public:
  /// Both must outlive it. Throws as for_each_tile.
  Tiles(const std::vector<Recording>& recordings, const Robot& robot, PrepareOptions options, int threads);
  ~Tiles();

  using Work = std::function<void(Tile&, std::size_t k)>;
  using Done = std::function<void(std::size_t k)>;
  /// So many tiles are worked on side by side.
  static constexpr std::size_t kTogether = 8;
  /// Calls work(tile, k) for the tiles of the wanted recordings, several at a time on several threads, k below
  /// kTogether, and done(k) for one after the other in their order: sums that are added up there do not depend on the
  /// number of threads.
  void for_each(const std::function<bool(std::size_t recording)>& wanted, const Work& work, const Done& done) const;

  const std::vector<Recording>& recordings() const { return recordings_; }
  /// Rows that the fit sees of all tiles together, where these are kept; -1: they are made anew.
  Eigen::Index kept_rows() const;
  bool are_kept() const { return kept_; }
  std::size_t kept_tiles() const { return tiles_.size(); }
  const Robot& robot() const { return robot_; }
  const PrepareOptions& options() const { return options_; }
  int threads() const { return threads_; }

 private:
  void keep();
  void write();
  /// `tile`: the one of this number, in slot k.
  void in_order(std::size_t count, const std::function<Tile&(std::size_t number, std::size_t k)>& tile,
                const Work& work, const Done& done) const;

  const std::vector<Recording>& recordings_;
  const Robot& robot_;
  PrepareOptions options_;
  int threads_ = 0;
  bool kept_ = false;
  mutable std::vector<Tile> tiles_;
  std::unique_ptr<TileFile> file_;  ///< null: tiles are kept, or made anew
};

/// What the recordings hold together.
MotionRange range_of(const Tiles& tiles);

}  // namespace truing::dynamics
