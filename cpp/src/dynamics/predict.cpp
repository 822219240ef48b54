// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Torques of every row of a recording.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "dynamics/problem.hpp"
#include "truing/dynamics/identify.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Predicted torques at the times of the motion's rows, in order of time.
struct Predicted {
  std::vector<double> time;
  std::vector<VectorXd> torque;

  /// The tile's own rows of torques at every row of its motion; where means were recorded, those of recorded rows.
  void add(const Tile& tile, const MatrixXd& torques) {
    const Index every = tile.means ? tile.between : 1;
    const Index begin = tile.first * tile.stride;
    const Index end = std::min(torques.rows(), (tile.first + tile.count) * tile.stride);
    std::vector<VectorXd> columns;
    for (Index j = 0; j < torques.cols(); ++j)
      columns.push_back(means_of_rows(torques.col(j).data(), torques.rows(), every));
    for (Index i = begin; i < end; i += every) {
      time.push_back(tile.motion.time[i]);
      torque.emplace_back(torques.cols());
      for (std::size_t j = 0; j < columns.size(); ++j) torque.back()[static_cast<Index>(j)] = columns[j][i / every];
    }
  }

  /// Between the rows by straight lines.
  VectorXd at(double t) const {
    const auto next = std::lower_bound(time.begin(), time.end(), t);
    if (next == time.begin()) return torque.front();
    if (next == time.end()) return torque.back();
    const auto k = static_cast<std::size_t>(next - time.begin());
    const double part = (t - time[k - 1]) / (time[k] - time[k - 1]);
    return (1.0 - part) * torque[k - 1] + part * torque[k];
  }
};

/// The highest frequency that the robot's effects were fitted on, or what is usual [Hz].
double fitted_cutoff(const Robot& robot) {
  const auto fitted = robot.fitted_range.find("frequency");
  return fitted == robot.fitted_range.end() ? kUsualCutoff : fitted->second.second;
}

}  // namespace

TorquePrediction predict(const Robot& robot, const Recording& recording, std::optional<double> given,
                         const std::vector<TorqueEffect>& own_effects) {
  validate(robot);
  const double cutoff = given ? *given : fitted_cutoff(robot);
  if (!(cutoff > 0.0) || !std::isfinite(cutoff)) throw std::invalid_argument("cutoff must be above 0 Hz");
  validate(recording, robot);
  if (recording.read)
    throw std::invalid_argument("recording '" + recording.name +
                                "' is longer than memory, and so would be its torques: predict parts of it");
  const std::vector<Recording> recordings{recording};
  std::vector<std::string> warnings;
  PrepareOptions options;
  options.cutoff = cutoff;
  options.torque_per_ampere = drive_constants(robot, recordings, &warnings);
  options.short_stretches = true;  // every row has a prediction
  options.one_pass = true;
  const MotionRange range = range_of(Tiles(recordings, robot, options, 1));
  const TorqueModel model(robot, valued_terms(robot, range, own_effects));
  const RigidChain chain(robot);
  Predicted predicted;
  for_each_tile(recording, 0, robot, options, [&](Tile& tile) {
    if (model.needs_rigid())
      tile.motion.rigid = regressor_columns(chain, tile.motion.q, tile.motion.qd, tile.motion.qdd);
    predicted.add(tile, model.torque(&tile.motion));
    return true;
  });
  TorquePrediction out;
  out.cutoff = cutoff_of(recordings, cutoff);  // rows that are far apart show less
  out.time = recording.time;
  out.torque.resize(recording.time.size(), static_cast<Index>(robot.driven_count()));
  out.current = MatrixXd::Constant(out.torque.rows(), out.torque.cols(), std::numeric_limits<double>::quiet_NaN());
  for (Index i = 0; i < out.time.size(); ++i) out.torque.row(i) = predicted.at(out.time[i] - out.time[0]);
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (std::size_t k = 0; k < driven.size(); ++k) {
    const auto& gain = robot.joints[driven[k]].torque_per_ampere;
    const auto j = static_cast<Index>(k);
    if (gain) out.current.col(j) = out.torque.col(j) / *gain;
  }
  return out;
}

}  // namespace truing::dynamics
