// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/prepare.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <condition_variable>
#include <iterator>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>

#include "dynamics/filter.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/regressor.hpp"
#include "dynamics/stretch.hpp"
#include "dynamics/tile_file.hpp"
#include "math/batch.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kGap = 5.0;           ///< usual steps without a row: here the recording is cut
constexpr Index kPieceRows = 1 << 16;  ///< of a recording that are looked at together

double usual_step(const VectorXd& time) {
  const Index rows = std::min<Index>(time.size(), kPieceRows);
  std::vector<double> steps;
  for (Index i = 1; i < rows; ++i) steps.push_back(time[i] - time[i - 1]);
  return median_of(std::move(steps));
}

/// Calls use(rows, begin, end) for the rows of a recording a piece at a time, until it returns false.
void for_each_piece(const Recording& recording, const std::function<bool(const Recording&, Index, Index)>& use) {
  if (!recording.read) {
    for (Index begin = 0; begin < recording.time.size(); begin += kPieceRows)
      if (!use(recording, begin, std::min<Index>(begin + kPieceRows, recording.time.size()))) return;
    return;
  }
  const NextRows next = recording.read();
  Recording rows;
  while (next(&rows))
    if (rows.time.size() > 0 && !use(rows, 0, rows.time.size())) return;
}

/// First and one past the last row of every run without gaps between two rows; `last`: [s] of the row before the first.
std::vector<std::pair<Index, Index>> runs_of(const VectorXd& time, Index begin, Index end, double last, double step) {
  std::vector<std::pair<Index, Index>> out;
  for (Index i = begin; i < end; ++i) {
    const bool gap = time[i] - (i == begin ? last : time[i - 1]) > kGap * step;
    if (gap || i == begin) out.emplace_back(i, i);
    out.back().second = i + 1;
  }
  return out;
}

/// Names of the further columns.
std::vector<std::string> column_names(const Recording& recording) {
  std::vector<std::string> out;
  for (const auto& [name, column] : recording.columns) out.push_back(name);
  return out;
}

}  // namespace

VectorXd means_of_rows(const double* column, Index steps, Index between) {
  VectorXd out = VectorXd::Zero((steps - 1) / between + 1);
  const Index half = between / 2;
  const double at_ends = between % 2 == 0 ? 0.5 : 1.0;  // an even number of steps ends half-way through two of them
  for (Index row = 0; row < out.size(); ++row) {
    const Index middle = row * between, reach = std::min({half, middle, steps - 1 - middle});
    double weights = 0.0;
    for (Index k = -reach; k <= reach; ++k) {
      const double weight = std::abs(k) == half ? at_ends : 1.0;
      weights += weight;
      out[row] += weight * column[middle + k];
    }
    out[row] /= weights;
  }
  return out;
}

MatrixXd Tile::own_rows(const MatrixXd& values) const {
  MatrixXd out(count, values.cols());
  for (Index c = 0; c < values.cols(); ++c) own_rows(values.col(c).data(), out.col(c).data());
  return out;
}

void Tile::own_rows(const double* column, double* out) const {
  if (between == 1) return filter_column(column, motion.rows(), weights, stride, first, count, out);
  const Index rows = (motion.rows() - 1) / between + 1;
  const VectorXd recorded =
      means ? means_of_rows(column, motion.rows(), between)
            : Eigen::Map<const VectorXd, 0, Eigen::InnerStride<>>(column, rows, Eigen::InnerStride<>(between));
  filter_column(recorded.data(), rows, weights, stride / between, first, count, out);
}

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

double cutoff_of(const std::vector<Recording>& recordings, double wanted) {
  double out = 0.0;
  for (const Recording& recording : recordings)
    out = std::max(out, Stretch::cutoff_of(wanted, usual_step(recording.time)));
  return out;
}

VectorXd speeds_at_rest(const Robot& robot) {
  VectorXd out(static_cast<Index>(robot.driven_count()));
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (std::size_t k = 0; k < driven.size(); ++k)
    out[static_cast<Index>(k)] = 0.01 * (robot.joints[driven[k]].type == JointType::revolute ? 1.0 : kDrum);
  return out;
}

void for_each_tile(const Recording& recording, std::size_t number, const Robot& robot, const PrepareOptions& options,
                   const std::function<bool(Tile&)>& use) {
  const RigidChain chain(robot);
  const VectorXd links = link_parameters(robot);
  const double step = usual_step(recording.time);
  const std::vector<std::string> columns = column_names(recording);
  bool any = false, more = true;
  const auto complete = [&](Tile& tile) {
    any = true;
    tile.recording = number;
    tile.means = recording.torque_is_mean;
    tile.motion.robot = &robot;
    tile.motion.links = chain.torques(tile.motion.q, tile.motion.qd, tile.motion.qdd, links);
    return more = use(tile);
  };
  std::unique_ptr<Stretch> stretch;
  const auto finish = [&] {
    if (stretch && !stretch->is_too_short()) stretch->take(true, complete);
    stretch.reset();
  };
  double last = recording.time[0];
  for_each_piece(recording, [&](const Recording& rows, Index begin, Index end) {
    for (const auto& [from, to] : runs_of(rows.time, begin, end, last, step)) {
      if (rows.time[from] - last > kGap * step) finish();
      if (!more) return false;
      if (!stretch) stretch = std::make_unique<Stretch>(speeds_at_rest(robot), columns, step, options);
      stretch->add(rows, from, to, recording.time[0]);
      last = rows.time[to - 1];
    }
    return stretch->take(false, complete);
  });
  if (more) finish();
  if (!any) {
    throw std::invalid_argument("recording '" + recording.name + "': no stretch without gaps is longer than " +
                                math::number(4.0 / Stretch::cutoff_of(options.cutoff, step), 3) +
                                " s, which the low-pass needs: record longer, or give a higher cut-off");
  }
}

namespace {

/// What all rows take in memory, columns and tiles together [bytes]; infinity where a recording is longer than memory.
double size_in_memory(const std::vector<Recording>& recordings) {
  double numbers = 0.0;
  for (const Recording& recording : recordings) {
    if (recording.read) return std::numeric_limits<double>::infinity();
    const double each =
        5.0 * static_cast<double>(recording.position.cols() + 1) + static_cast<double>(recording.columns.size());
    numbers += each * static_cast<double>(recording.rows());
  }
  return sizeof(double) * numbers;
}

}  // namespace

Tiles::Tiles(const std::vector<Recording>& recordings, const Robot& robot, PrepareOptions options, int threads)
    : recordings_(recordings), robot_(robot), options_(std::move(options)), threads_(threads) {
  constexpr double kMostKept = 100.0 * 1024 * 1024;  ///< [bytes]
  kept_ = size_in_memory(recordings) < kMostKept;
  if (kept_)
    keep();
  else if (!options_.one_pass)
    write();
}

Tiles::~Tiles() = default;

void Tiles::keep() {
  std::vector<std::vector<Tile>> parts(recordings_.size());
  math::for_each_on_threads(
      recordings_.size(), threads_, {},
      [&](std::size_t r) {
        for_each_tile(recordings_[r], r, robot_, options_, [&](Tile& tile) {
          parts[r].push_back(std::move(tile));
          return true;
        });
      },
      1);
  // Long recordings first: at the end of a pass nobody waits long for the last one.
  const auto rows = [](const std::vector<Tile>& part) {
    return std::accumulate(part.begin(), part.end(), Index{0},
                           [](Index sum, const Tile& tile) { return sum + tile.motion.rows(); });
  };
  std::stable_sort(parts.begin(), parts.end(), [&](const auto& a, const auto& b) { return rows(a) > rows(b); });
  for (std::vector<Tile>& part : parts) std::move(part.begin(), part.end(), std::back_inserter(tiles_));
  for (std::size_t k = 0; k < tiles_.size(); ++k) tiles_[k].number = k;
}

void Tiles::write() {
  file_ = std::make_unique<TileFile>();
  bool good = true;
  for (std::size_t r = 0; r < recordings_.size() && good; ++r)
    for_each_tile(recordings_[r], r, robot_, options_, [&](Tile& tile) { return good = file_->add(tile); });
  if (!good) file_.reset();
}

Index Tiles::kept_rows() const {
  Index rows = 0;
  for (const Tile& tile : tiles_) rows += tile.count;
  return kept_ ? rows : -1;
}

void Tiles::for_each(const std::function<bool(std::size_t)>& wanted, const Work& work, const Done& done) const {
  if (kept_) {
    std::vector<Tile*> all;
    for (Tile& tile : tiles_)
      if (wanted(tile.recording)) all.push_back(&tile);
    return in_order(all.size(), [&](std::size_t number, std::size_t) -> Tile& { return *all[number]; }, work, done);
  }
  std::vector<Tile> made(kTogether);
  if (file_) {
    std::vector<std::size_t> all;
    for (std::size_t k = 0; k < file_->size(); ++k)
      if (wanted(file_->recording(k))) all.push_back(k);
    const auto read = [&](std::size_t number, std::size_t k) -> Tile& {
      return made[k] = file_->read(all[number], robot_);
    };
    return in_order(all.size(), read, work, [&](std::size_t k) {
      done(k);
      made[k] = Tile();
    });
  }
  std::size_t count = 0;
  const auto run = [&] {
    in_order(count, [&](std::size_t, std::size_t k) -> Tile& { return made[k]; }, work, done);
    count = 0;
  };
  for (std::size_t r = 0; r < recordings_.size(); ++r) {
    if (!wanted(r)) continue;
    for_each_tile(recordings_[r], r, robot_, options_, [&](Tile& tile) {
      made[count++] = std::move(tile);
      if (count == kTogether) run();
      return true;
    });
  }
  run();
}

// A slot is taken again as soon as what was in it has been added: nobody waits for the slowest of a lot.
void Tiles::in_order(std::size_t count, const std::function<Tile&(std::size_t, std::size_t)>& tile, const Work& work,
                     const Done& done) const {
  std::mutex mutex;
  std::condition_variable free_slot;
  std::array<bool, kTogether> worked_on{};
  std::size_t added = 0;  // so many of the first tiles
  bool failed = false;
  const auto add_in_order = [&](std::size_t number) {
    worked_on[number % kTogether] = true;
    for (; added < count && worked_on[added % kTogether]; ++added) {
      worked_on[added % kTogether] = false;
      done(added % kTogether);
    }
  };
  const auto run = [&](std::size_t number) {
    {
      std::unique_lock<std::mutex> lock(mutex);
      free_slot.wait(lock, [&] { return failed || number < added + kTogether; });
      if (failed) return;
    }
    try {
      work(tile(number, number % kTogether), number % kTogether);
      const std::lock_guard<std::mutex> lock(mutex);
      add_in_order(number);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      failed = true;
      free_slot.notify_all();
      throw;
    }
    free_slot.notify_all();
  };
  math::for_each_on_threads(count, threads_, {}, run, 1);
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

MotionRange range_of(const Tiles& tiles) {
  const auto joints = static_cast<Index>(tiles.robot().driven_count());
  constexpr double inf = std::numeric_limits<double>::infinity();
  MotionRange out;
  out.lower = VectorXd::Constant(joints, inf);
  out.upper = VectorXd::Constant(joints, -inf);
  out.speed = out.acceleration = out.torque = VectorXd::Zero(joints);
  out.turns.resize(static_cast<std::size_t>(joints));
  std::vector<TorqueSums> sums(static_cast<std::size_t>(joints));
  std::vector<const Tile*> lot(Tiles::kTogether);
  tiles.for_each([](std::size_t) { return true; }, [&](Tile& tile, std::size_t k) { lot[k] = &tile; },
                 [&](std::size_t k) { widen(*lot[k], &out, &sums); });
  keep_common_columns(tiles.recordings(), &out);
  for (std::size_t j = 0; j < sums.size(); ++j) out.torque[static_cast<Index>(j)] = sums[j].standard_deviation();
  return out;
}

}  // namespace truing::dynamics
