// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/judge.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "math/batch.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kBins = 5;

/// An input of a regime: its value in a row, and how far it goes.
struct RegimeInput {
  const char* name;
  double low, high;
  int bins;
  std::function<double(const Tile&, Index fine_row)> value;
};

std::vector<RegimeInput> inputs_of(const MotionRange& range, Index j) {
  std::vector<RegimeInput> out;
  out.push_back(
      {"speed", 0.0, range.speed[j], kBins, [j](const Tile& t, Index i) { return std::abs(t.motion.qd(i, j)); }});
  out.push_back(
      {"direction", -1.0, 1.0, 2, [j](const Tile& t, Index i) { return t.motion.qd(i, j) < 0.0 ? -0.5 : 0.5; }});
  out.push_back({"acceleration", 0.0, range.acceleration[j], kBins,
                 [j](const Tile& t, Index i) { return std::abs(t.motion.qdd(i, j)); }});
  out.push_back({"load", 0.0, 2.5 * range.torque[j], kBins,
                 [j](const Tile& t, Index i) { return std::abs(t.motion.torque(i, j)); }});
  out.push_back(
      {"angle", range.lower[j], range.upper[j], kBins, [j](const Tile& t, Index i) { return t.motion.q(i, j); }});
  out.push_back({"time", 0.0, range.duration, kBins, [](const Tile& t, Index i) { return t.motion.time[i]; }});
  const std::string own = "temp" + std::to_string(j + 1) + "_C";
  for (const std::string& name : {own, std::string("temp_C")}) {
    const auto at = range.columns.find(name);
    if (at == range.columns.end() || !(at->second.second > at->second.first)) continue;
    out.push_back({"temperature", at->second.first, at->second.second, kBins,
                   [name](const Tile& t, Index i) { return t.motion.columns.at(name)[i]; }});
    break;
  }
  return out;
}

struct Cell {
  double standard = 0.0, named = 0.0, n = 0.0;

  void add(const Cell& other) {
    standard += other.standard;
    named += other.named;
    n += other.n;
  }
};
using Cells = std::map<std::tuple<Index, std::size_t, int>, Cell>;  ///< by joint, input and bin

/// Of one tile's held-out rows.
Cells cells_of(const Problem& problem, const TorqueModel& standard, const TorqueModel& named,
               const std::vector<std::vector<RegimeInput>>& inputs, Tile* tile) {
  const MatrixXd after = own_torque(named, tile), before = own_torque(standard, tile);
  const VectorXd time = tile->own_time();
  Cells out;
  for (Index i = 0; i < tile->count; ++i) {
    if (problem.test.fold(tile->recording, time[i]) < 0) continue;
    const Index fine = (tile->first + i) * tile->stride;
    for (Index j = 0; j < before.cols(); ++j) {
      const double y = tile->measured(i, j);
      if (std::isnan(y)) continue;
      const std::vector<RegimeInput>& list = inputs[static_cast<std::size_t>(j)];
      for (std::size_t k = 0; k < list.size(); ++k) {
        const RegimeInput& in = list[k];
        const double part = (in.value(*tile, fine) - in.low) / std::max(in.high - in.low, 1e-300);
        const int bin = std::clamp(static_cast<int>(part * in.bins), 0, in.bins - 1);
        out[{j, k, bin}].add({std::pow(y - before(i, j), 2.0), std::pow(y - after(i, j), 2.0), 1.0});
      }
    }
  }
  return out;
}

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kBusy = 0.9;  ///< of the most moving rows that any stretch has: the first such is looked at

/// A stretch of held-out rows.
struct Moved {
  std::size_t recording = 0;
  double begin = kNever;  ///< [s]
  VectorXd rows;          ///< shape=(joints,) in how many a joint moves
};

/// Stretches of so many seconds, from the first motion of each held-out recording on.
std::vector<Moved> moving_rows(const Problem& problem, double seconds) {
  std::vector<const Tile*> lot(Tiles::kTogether);
  std::map<std::pair<std::size_t, Index>, Moved> stretches;
  std::map<std::size_t, double> begins;
  const auto count = [&](const Tile& tile) {
    const VectorXd time = tile.own_time();
    for (Index i = 0; i < tile.count; ++i) {
      if (problem.test.fold(tile.recording, time[i]) < 0) continue;
      if (!begins.count(tile.recording) && !(tile.moving.row(i).maxCoeff() > 0.0)) continue;
      const double begin = begins.try_emplace(tile.recording, time[i]).first->second;
      Moved& moved = stretches[{tile.recording, static_cast<Index>((time[i] - begin) / seconds)}];
      if (moved.rows.size() == 0) moved = {tile.recording, time[i], VectorXd::Zero(tile.moving.cols())};
      moved.rows += tile.moving.row(i).transpose();
    }
  };
  problem.tiles.for_each([&](std::size_t r) { return problem.test.of_recording[r] >= 0; },
                         [&](Tile& tile, std::size_t k) { lot[k] = &tile; }, [&](std::size_t k) { count(*lot[k]); });
  std::vector<Moved> out;
  for (auto& one : stretches) out.push_back(std::move(one.second));
  return out;
}

/// By joint, the first stretch in which it moves in nearly as many rows as in any.
std::vector<Moved> busiest(const std::vector<Moved>& stretches) {
  if (stretches.empty()) return {};
  VectorXd most = stretches.front().rows;
  for (const Moved& one : stretches) most = most.cwiseMax(one.rows);
  std::vector<Moved> out;
  for (Index j = 0; j < most.size(); ++j)
    out.push_back(*std::find_if(stretches.begin(), stretches.end(),
                                [&](const Moved& one) { return one.rows[j] >= kBusy * most[j]; }));
  return out;
}

}  // namespace

std::vector<TorqueRegime> regimes_of(const Problem& problem, const TorqueModel& standard, const TorqueModel& named) {
  const auto joints = static_cast<Index>(problem.robot.driven_count());
  std::vector<std::vector<RegimeInput>> inputs;
  for (Index j = 0; j < joints; ++j) inputs.push_back(inputs_of(problem.range, j));
  std::vector<Cells> lot(Tiles::kTogether);
  Cells cells;
  problem.tiles.for_each([&](std::size_t r) { return problem.test.of_recording[r] >= 0; },
                         [&](Tile& tile, std::size_t k) { lot[k] = cells_of(problem, standard, named, inputs, &tile); },
                         [&](std::size_t k) {
                           for (const auto& [key, cell] : lot[k]) cells[key].add(cell);
                         });
  const std::vector<std::size_t> driven = problem.robot.driven_joints();
  std::vector<TorqueRegime> out;
  for (const auto& [key, cell] : cells) {
    const auto& [j, k, bin] = key;
    const RegimeInput& in = inputs[static_cast<std::size_t>(j)][k];
    const double width = (in.high - in.low) / in.bins;
    out.push_back({problem.robot.joints[driven[static_cast<std::size_t>(j)]].name, in.name, in.low + bin * width,
                   in.low + (bin + 1) * width, std::sqrt(cell.standard / cell.n), std::sqrt(cell.named / cell.n),
                   cell.n});
  }
  return out;
}

std::vector<TorqueTrace> traces_of(const Problem& problem, const TorqueModel& standard, const TorqueModel& named,
                                   double seconds) {
  const std::vector<Moved> chosen = busiest(moving_rows(problem, seconds));
  const std::vector<std::size_t> driven = problem.robot.driven_joints();
  std::vector<TorqueTrace> out(chosen.size());
  std::map<std::size_t, std::pair<double, double>> looked_at;  // by recording, its first and last time
  for (std::size_t j = 0; j < chosen.size(); ++j) {
    const Moved& one = chosen[j];
    out[j].recording = problem.tiles.recordings()[one.recording].name;
    out[j].joint = problem.robot.joints[driven[j]].name;
    auto& [first, last] = looked_at.try_emplace(one.recording, kNever, -kNever).first->second;
    first = std::min(first, one.begin);
    last = std::max(last, one.begin + seconds);
  }
  const std::vector<std::pair<std::size_t, std::pair<double, double>>> recordings(looked_at.begin(), looked_at.end());
  const auto look = [&](std::size_t at) {
    const std::size_t r = recordings[at].first;
    const auto draw = [&](Tile& tile) {
      const VectorXd time = tile.own_time();
      const MatrixXd nominal = own_torque(problem.nominal, &tile);
      const MatrixXd before = own_torque(standard, &tile);
      const MatrixXd after = own_torque(named, &tile);
      for (Index i = 0; i < tile.count; ++i) {
        if (problem.test.fold(r, time[i]) < 0) continue;
        for (std::size_t k = 0; k < chosen.size(); ++k) {
          const Moved& one = chosen[k];
          if (one.recording != r || time[i] < one.begin || time[i] > one.begin + seconds) continue;
          const auto j = static_cast<Index>(k);
          out[k].time.push_back(time[i]);
          out[k].measured.push_back(tile.measured(i, j));
          out[k].nominal.push_back(nominal(i, j));
          out[k].standard.push_back(before(i, j));
          out[k].named.push_back(after(i, j));
        }
      }
    };
    const double first = recordings[at].second.first, last = recordings[at].second.second;
    for_each_tile(problem.tiles.recordings()[r], r, problem.robot, problem.tiles.options(), [&](Tile& tile) {
      const VectorXd time = tile.own_time();
      if (time[time.size() - 1] >= first && time[0] <= last) draw(tile);
      return time[0] <= last;
    });
  };
  math::for_each_on_threads(recordings.size(), problem.tiles.threads(), {}, look, 1);
  return out;
}

std::vector<std::string> worse_joints(const TorqueErrors& standard, const TorqueErrors& named) {
  std::vector<std::string> out;
  for (std::size_t j = 0; j < named.held_out.size(); ++j) {
    const double before = standard.held_out[j].percent, after = named.held_out[j].percent;
    if (after > kWorse * before)
      out.push_back(named.held_out[j].joint + " (" + math::number(after, 3) + " % in place of " +
                    math::number(before, 3) + " %)");
  }
  return out;
}

}  // namespace truing::dynamics
