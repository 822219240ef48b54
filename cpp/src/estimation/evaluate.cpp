// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "estimation/evaluate.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <tuple>

#include "estimation/program.hpp"
#include "model/gravity.hpp"
#include "model/motion.hpp"
#include "truing/model/effect.hpp"

namespace truing::estimation {
namespace {

using kernel::Kind;
using kernel::kMaxComponents;
using kernel::kTilePoses;

constexpr int kSlots = 64;  // partial sums, whatever the number of threads: the bits do not depend on it
constexpr int kTilesPerReduce = 16;
constexpr int kTilesForThreads = 100;

int components_of(Kind kind) { return kind == Kind::distance ? 1 : kind == Kind::position ? 3 : 6; }

/// 64-byte aligned doubles.
class Buffer {
 public:
  explicit Buffer(std::size_t size = 0) : storage_(size + 8, 0.0) {
    const auto address = reinterpret_cast<std::uintptr_t>(storage_.data());
    begin_ = storage_.data() + ((64 - address % 64) % 64) / sizeof(double);
  }
  double* get() const { return begin_; }

 private:
  mutable std::vector<double> storage_;
  double* begin_;
};

}  // namespace

std::vector<Segment> make_segments(const Measurements& data, const std::vector<std::int32_t>& rows, bool as_positions) {
  std::map<std::tuple<int, int, int>, Segment> sorted;
  Segment* last = nullptr;  // most rows are like the row before
  for (const std::int32_t row : rows) {
    Segment key{Kind::position, data.target.empty() ? 0 : data.target[row], -1, {}};
    if (as_positions) {
    } else if (data.has_fixed_point(row)) {
      key.point = data.fixed_point[row];
    } else if (data.has_distance(row)) {
      key.kind = Kind::distance;
    } else if (data.has_position(row)) {
      if (data.has_orientation(row)) key.kind = Kind::pose;
    } else {
      continue;
    }
    if (!last || last->kind != key.kind || last->target != key.target || last->point != key.point) {
      last = &sorted.try_emplace({static_cast<int>(key.kind), key.target, key.point}, key).first->second;
    }
    last->rows.push_back(row);
  }
  std::vector<Segment> segments;
  for (auto& [key, segment] : sorted) segments.push_back(std::move(segment));
  return segments;
}

/// Motion of every joint from the readings. Joints of a passive chain may stand before or after their drivers: go by
/// what each reading moves.
static void set_joints(const Model& model, const Eigen::VectorXd& reading, Eigen::VectorXd* joints) {
  joints->setZero();
  for (std::size_t k = 0; k < model.robot.joints.size(); ++k) {
    const Coordinate& coordinate = model.coordinates[k];
    if (coordinate.reading < 0) continue;
    (*joints)[static_cast<Eigen::Index>(k)] = reading[coordinate.reading];
    for (std::size_t m = 0; m < model.robot.joints.size(); ++m) {
      if (m == k || !model.robot.joints[m].passive()) continue;
      const int own_site = model.coordinates[m].sites.front().first;
      for (const auto& [site, weight] : coordinate.sites) {
        if (site == own_site) (*joints)[static_cast<Eigen::Index>(m)] += weight * reading[coordinate.reading];
      }
    }
  }
}

std::vector<std::vector<double>> make_bases(const Model& model, const Measurements& data) {
  return make_bases(model, data, model.robot);
}

std::vector<std::vector<double>> make_bases(const Model& model, const Measurements& data, const Robot& weighed) {
  std::vector<std::vector<double>> bases(model.terms.size(), std::vector<double>(data.rows));
  if (model.terms.empty()) return bases;
  const bool gravity =
      std::any_of(model.terms.begin(), model.terms.end(), [](const Term& t) { return t.needs_gravity; });
  Inputs inputs;
  inputs.data = &data;
  Eigen::VectorXd reading(static_cast<Eigen::Index>(data.joints.size()));
  const Eigen::MatrixXd coupling = gravity ? coupling_matrix(model.robot) : Eigen::MatrixXd();
  inputs.gravity_torque = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.robot.joints.size()));
  inputs.joints = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.robot.joints.size()));
  for (std::size_t row = 0; row < data.rows; ++row) {
    inputs.row = row;
    for (std::size_t k = 0; k < data.joints.size(); ++k) reading[static_cast<Eigen::Index>(k)] = data.joints[k][row];
    set_joints(model, reading, &inputs.joints);
    if (gravity) {
      inputs.frames = forward_kinematics(weighed, reading, 0);
      const auto target = data.target.empty() ? 0 : static_cast<std::size_t>(data.target[row]);
      inputs.tip = inputs.frames[weighed.joints.size() - 1] * weighed.targets[target].T_last_target.translation();
      gravity_torques_at(weighed, coupling, inputs.frames, data.payload ? data.payload[row] : 0.0,
                         inputs.gravity_torque);
    }
    for (std::size_t t = 0; t < model.terms.size(); ++t) {
      const double value = model.terms[t].basis(inputs);
      if (!std::isfinite(value)) {
        throw std::invalid_argument("effect term " + model.terms[t].parameter + " is not finite at row " +
                                    std::to_string(row));
      }
      bases[t][row] = value;
    }
  }
  return bases;
}

double NormalEquations::rms() const { return components ? std::sqrt(cost / static_cast<double>(components)) : 0.0; }

struct Evaluator::Impl {
  const Model& model;
  const Measurements& data;
  const std::vector<std::vector<double>>& bases;
  std::vector<Segment> segments;
  std::vector<int> free;
  int threads;
  const kernel::Functions& run;
  std::vector<Program> programs;
  struct TileRange {
    int segment;
    std::int32_t first;
    int count;
  };
  std::vector<TileRange> tiles;
  std::size_t components = 0;

  /// What one thread needs.
  struct Workspace {
    Buffer values, bases, coordinates, measured, position_weight, rotation_weight, slots, jacobian, squared_norm, tip,
        accumulator;
    std::vector<double> local;
    std::vector<std::vector<double>> constants, starts, fixed_vectors;  ///< per segment
    double anchor[4] = {0, 0, 0, 0};
    bool clean_accumulator = true;
  };
  std::vector<Workspace> workspaces;
  std::vector<std::vector<double>> slot_sums;  ///< [slot] (p + 1)^2 and the loss
  mutable std::mutex busy;                     ///< one evaluation at a time: the workspaces are shared

  Impl(const Model& m, const Measurements& d, const std::vector<std::vector<double>>& b, std::vector<Segment> s,
       std::vector<int> f, int t)
      : model(m), data(d), bases(b), segments(std::move(s)), free(std::move(f)), threads(t), run(kernel::functions()) {
    const Eigen::VectorXd values = initial_values(model);
    std::size_t most_columns = 0, most_dynamic = 0, most_bases = 0, most_slots = 0;
    for (std::size_t k = 0; k < segments.size(); ++k) {
      programs.push_back(compile(model, segments[k], free, values));
      const Program& c = programs.back();
      most_columns = std::max(most_columns, c.columns.size());
      most_dynamic = std::max(most_dynamic, c.dynamic.size());
      most_bases = std::max(most_bases, c.bases.size());
      most_slots = std::max(most_slots, static_cast<std::size_t>(c.slot_count));
      const auto rows = static_cast<std::int32_t>(segments[k].rows.size());
      for (std::int32_t first = 0; first < rows; first += kTilePoses) {
        tiles.push_back({static_cast<int>(k), first, std::min(kTilePoses, rows - first)});
      }
      components += static_cast<std::size_t>(rows) * static_cast<std::size_t>(components_of(segments[k].kind));
    }
    if (threads <= 0) threads = std::max(1u, std::thread::hardware_concurrency());
    if (static_cast<int>(tiles.size()) < kTilesForThreads) threads = 1;
    workspaces.resize(static_cast<std::size_t>(threads));
    const std::size_t gram_columns = most_columns + 1;
    for (Workspace& w : workspaces) {
      w.values = Buffer(most_dynamic * kTilePoses);
      w.bases = Buffer(most_bases * kTilePoses);
      w.coordinates = Buffer(model.coordinates.size() * kTilePoses);
      w.measured = Buffer(12 * kTilePoses);
      w.position_weight = Buffer(kTilePoses);
      w.rotation_weight = Buffer(kTilePoses);
      w.slots = Buffer(most_slots * 3 * kernel::kMostGroupPoses);
      w.jacobian = Buffer(gram_columns * kMaxComponents * kTilePoses);
      w.squared_norm = Buffer(kTilePoses);
      w.tip = Buffer(12 * kTilePoses);
      w.accumulator = Buffer(run.gram_size(static_cast<int>(gram_columns)));
      w.local.resize(gram_columns * gram_columns);
      for (const Program& c : programs) {
        w.constants.push_back(c.constants);
        w.starts.emplace_back(3 * c.start_slots.size());
        w.fixed_vectors.emplace_back(3 * c.fixed_slots.size());
      }
    }
    const std::size_t p = free.size() + 1;
    const std::size_t slots = std::min<std::size_t>(kSlots, (tiles.size() + kTilesPerReduce - 1) / kTilesPerReduce);
    slot_sums.assign(slots, std::vector<double>(p * p + 1));
  }

  /// The numbers of the programs that depend on the parameters.
  void set_values(const Eigen::VectorXd& values, Workspace* w) const {
    for (std::size_t k = 0; k < programs.size(); ++k) {
      for (const int parameter : programs[k].left_out) {
        if (values[parameter] != 0.0)
          throw std::logic_error("parameter " + model.parameters[parameter].name + " was compiled as zero and is not");
      }
      for (const ConstantSource& source : programs[k].sources) {
        const double value = source.parameter < 0 ? 0.0 : values[source.parameter];
        double* at = w->constants[k].data() + source.at;
        if (source.rotation) {
          at[0] = std::cos(value);
          at[1] = std::sin(value);
        } else {
          at[0] = value;
        }
      }
      sweep_prefix(programs[k], w->constants[k], &w->starts[k], &w->fixed_vectors[k]);
    }
    for (std::size_t i = 0; i < model.parameters.size(); ++i) {
      if (model.parameters[i].role == Role::anchor)
        w->anchor[model.parameters[i].axis] = values[static_cast<Eigen::Index>(i)];
    }
  }

  /// The rows of a tile.
  struct TileRows {
    const std::int32_t* rows;
    int count;
    bool side_by_side;  ///< rows are in increasing order: first and last are as far apart as their places
  };

  TileRows rows_of(const TileRange& range) const {
    const std::int32_t* rows = segments[range.segment].rows.data() + range.first;
    return {rows, range.count, rows[range.count - 1] - rows[0] == range.count - 1};
  }

  /// scale * column + offset, pose by pose into lanes; the last pose fills what is left over.
  static void fill(const TileRows& tile, Column column, double scale, double offset, double* out) {
    if (tile.side_by_side && column.stride == 1) {
      const double* in = column.data + tile.rows[0];
      if (scale == 1.0 && offset == 0.0) {
        std::copy(in, in + tile.count, out);
      } else {
        for (int i = 0; i < tile.count; ++i) out[i] = scale * in[i] + offset;
      }
    } else {
      for (int i = 0; i < tile.count; ++i) out[i] = scale * column[static_cast<std::size_t>(tile.rows[i])] + offset;
    }
    for (int i = tile.count; i < kTilePoses; ++i) out[i] = out[tile.count - 1];
  }

  /// Every coordinate's reading, its zero and gear ratio corrected, plus what effects do to it.
  void gather_coordinates(const TileRows& tile, const Eigen::VectorXd& values, Workspace* w) const {
    for (std::size_t k = 0; k < model.coordinates.size(); ++k) {
      const Coordinate& coordinate = model.coordinates[k];
      double* out = w->coordinates.get() + k * kTilePoses;
      const double offset = coordinate.offset < 0 ? 0.0 : values[coordinate.offset];
      if (coordinate.reading >= 0) {
        fill(tile, data.joints[coordinate.reading], values[coordinate.ratio], offset, out);
      } else {
        std::fill(out, out + kTilePoses, offset);
      }
      for (const int term : coordinate.terms) {
        const double theta = values[model.term_parameter[term]];
        if (theta == 0.0) continue;
        const std::vector<double>& basis = bases[term];
        for (int i = 0; i < tile.count; ++i) out[i] += theta * basis[tile.rows[i]];
      }
    }
  }

  /// Values of the sites that differ from pose to pose: v = v0 + C (K q + o).
  static void gather_sites(const Program& program, const Eigen::VectorXd& values, Workspace* w) {
    for (std::size_t s = 0; s < program.dynamic.size(); ++s) {
      double* out = w->values.get() + s * kTilePoses;
      const double constant = program.dynamic[s].parameter < 0 ? 0.0 : values[program.dynamic[s].parameter];
      for (const auto& [coordinate, weight] : program.dynamic[s].moved_by) {
        const double* in = w->coordinates.get() + coordinate * kTilePoses;
        if (&weight == &program.dynamic[s].moved_by.front().second) {
          for (int i = 0; i < kTilePoses; ++i) out[i] = constant + weight * in[i];
        } else {
          for (int i = 0; i < kTilePoses; ++i) out[i] += weight * in[i];
        }
      }
    }
  }

  void gather_bases(const TileRows& tile, const Program& program, Workspace* w) const {
    for (std::size_t b = 0; b < program.bases.size(); ++b) {
      const auto [reading, term] = program.bases[b];
      fill(tile, reading >= 0 ? data.joints[reading] : Column{bases[term].data(), 1}, 1.0, 0.0,
           w->bases.get() + b * kTilePoses);
    }
  }

  void gather_orientations(const TileRows& tile, double* out) const {
    for (int i = 0; i < kTilePoses; ++i) {
      const auto row = static_cast<std::size_t>(tile.rows[std::min(i, tile.count - 1)]);
      const Eigen::Quaterniond q(data.orientation[0][row], data.orientation[1][row], data.orientation[2][row],
                                 data.orientation[3][row]);
      const Eigen::Matrix3d R = q.normalized().toRotationMatrix();
      for (int k = 0; k < 9; ++k) out[k * kTilePoses + i] = R(k % 3, k / 3);
    }
  }

  void gather_measurements(const TileRows& tile, const Segment& segment, const Eigen::VectorXd& values,
                           double* measured) const {
    if (segment.point >= 0) {
      for (int k = 0; k < 3; ++k) {
        std::fill(measured + k * kTilePoses, measured + (k + 1) * kTilePoses,
                  values[point_parameter(segment.point, k)]);
      }
    } else if (segment.kind == Kind::distance) {
      fill(tile, data.distance, 1.0, 0.0, measured);
    } else {
      for (int k = 0; k < 3; ++k) fill(tile, data.position[k], 1.0, 0.0, measured + k * kTilePoses);
      if (segment.kind == Kind::pose) gather_orientations(tile, measured + 3 * kTilePoses);
    }
  }

  /// Inputs and measurements of a tile.
  void gather(const TileRange& range, const Eigen::VectorXd& values, bool with_measurements, Workspace* w) const {
    const Program& program = programs[range.segment];
    const TileRows tile = rows_of(range);
    gather_coordinates(tile, values, w);
    gather_sites(program, values, w);
    gather_bases(tile, program, w);
    if (with_measurements)
      gather_measurements(tile, segments[range.segment], values, w->measured.get());
    else
      std::fill(w->measured.get(), w->measured.get() + 12 * kTilePoses, 0.0);
  }

  /// Square roots of the rows' own weights; false: all one and the tile is full.
  bool gather_weights(const TileRange& range, double rotation_scale, Workspace* w) const {
    if (range.count == kTilePoses && !data.position_sigma && !data.weight) return false;
    const std::int32_t* rows = segments[range.segment].rows.data() + range.first;
    for (int i = 0; i < kTilePoses; ++i) {
      double position = 0.0, rotation = 0.0;
      if (i < range.count) {
        const auto row = static_cast<std::size_t>(rows[i]);
        const double root = data.weight ? std::sqrt(data.weight[row]) : 1.0;
        position = rotation = data.position_sigma ? root / data.position_sigma[row] : root;
        if (data.rotation_sigma && rotation_scale > 0.0) rotation = root / (data.rotation_sigma[row] * rotation_scale);
      }
      w->position_weight.get()[i] = position;
      w->rotation_weight.get()[i] = rotation;
    }
    return true;
  }

  void evaluate_tile(const TileRange& range, const Eigen::VectorXd& values, const Weighing& weighing,
                     bool with_jacobian, bool with_measurements, Workspace* w) const {
    const Segment& segment = segments[range.segment];
    const Program& program = programs[range.segment];
    gather(range, values, with_measurements, w);
    const bool weights = weighing.row_weights && gather_weights(range, weighing.rotation_scale, w);
    kernel::Program p{};
    p.kind = segment.kind;
    p.steps = program.steps.data();
    p.step_count = static_cast<int>(program.steps.size());
    p.constants = w->constants[range.segment].data();
    p.start_slots = program.start_slots.data();
    p.start_vectors = w->starts[range.segment].data();
    p.start_count = static_cast<int>(program.start_slots.size());
    p.fixed_slots = program.fixed_slots.data();
    p.fixed_vectors = w->fixed_vectors[range.segment].data();
    p.fixed_count = static_cast<int>(program.fixed_slots.size());
    std::copy(program.tip_slots, program.tip_slots + 4, p.tip_slots);
    p.parts = program.parts.data();
    p.columns = program.columns.data();
    p.column_count = with_jacobian ? static_cast<int>(program.columns.size()) : 0;
    std::copy(w->anchor, w->anchor + 4, p.anchor);
    p.position_scale = weighing.position_scale;
    p.rotation_scale = weighing.rotation_scale;
    if (segment.kind != Kind::pose) p.rotation_scale = 1.0;
    p.loss = weighing.loss;
    p.loss_scale = weighing.loss_scale;
    kernel::Tile t{};
    t.values = w->values.get();
    t.bases = w->bases.get();
    t.measured = w->measured.get();
    t.position_weight = weights ? w->position_weight.get() : nullptr;
    t.rotation_weight = weights ? w->rotation_weight.get() : nullptr;
    t.slots = w->slots.get();
    t.jacobian = w->jacobian.get();
    t.residual = w->jacobian.get() + p.column_count * components_of(segment.kind) * kTilePoses;
    t.squared_norm = w->squared_norm.get();
    t.tip = with_measurements ? nullptr : w->tip.get();
    run.evaluate(p, t);
  }

  int point_parameter(int point, int axis) const { return first_point_parameter + 3 * point + axis; }
  int first_point_parameter = -1;

  /// Calls work(slot, workspace) for every slot, on as many threads as there are workspaces.
  template <typename Work>
  void for_slots(const Eigen::VectorXd& values, const Work& work) {
    const int slots = static_cast<int>(slot_sums.size());
    std::atomic<int> next{0};
    std::exception_ptr failure;
    std::mutex failure_mutex;
    const auto loop = [&](Workspace* w) {
      try {
        set_values(values, w);
        for (int slot = next++; slot < slots; slot = next++) work(slot, w);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(failure_mutex);
        failure = std::current_exception();
      }
    };
    std::vector<std::thread> helpers;
    for (std::size_t k = 1; k < workspaces.size(); ++k) helpers.emplace_back(loop, &workspaces[k]);
    loop(&workspaces[0]);
    for (std::thread& helper : helpers) helper.join();
    if (failure) std::rethrow_exception(failure);
  }

  std::pair<std::size_t, std::size_t> tiles_of(int slot) const {
    const std::size_t slots = slot_sums.size(), n = tiles.size();
    const auto s = static_cast<std::size_t>(slot);
    return {s * n / slots, (s + 1) * n / slots};
  }

  double loss_of(const Weighing& weighing, double s2) const {
    const double c2 = weighing.loss_scale * weighing.loss_scale;
    switch (weighing.loss) {
      case kernel::RowLoss::none:
        break;
      case kernel::RowLoss::huber:
        return s2 <= c2 ? s2 : 2.0 * weighing.loss_scale * std::sqrt(s2) - c2;
      case kernel::RowLoss::cauchy:
        return c2 * std::log1p(s2 / c2);
      case kernel::RowLoss::tukey: {
        const double v = s2 < c2 ? 1.0 - s2 / c2 : 0.0;
        return c2 / 3.0 * (1.0 - v * v * v);
      }
    }
    return s2;
  }

  /// Adds the accumulator to the slot's sums, local columns to global parameters.
  void flush(int segment, std::vector<double>* sums, Workspace* w) const {
    const std::vector<int>& map = programs[segment].column_free;
    const int local = static_cast<int>(map.size()) + 1;
    const int p = static_cast<int>(free.size()) + 1;
    std::fill(w->local.begin(), w->local.begin() + local * local, 0.0);
    run.gram_reduce(w->accumulator.get(), local, 0, w->local.data());
    for (int j = 0; j < local; ++j) {
      const int gj = j + 1 < local ? map[j] : p - 1;
      for (int i = 0; i <= j; ++i) {
        const int gi = i + 1 < local ? map[i] : p - 1;
        // Columns of one parameter add up: (a + b)^T (a + b) has a^T b twice.
        const double twice = gi == gj && i != j ? 2.0 : 1.0;
        (*sums)[static_cast<std::size_t>(gj) * p + gi] += twice * w->local[static_cast<std::size_t>(j) * local + i];
      }
    }
  }

  struct Scores {
    explicit Scores(std::size_t parameters)
        : score(parameters * kTilePoses), leverage(kTilePoses), squared(kMaxComponents * kTilePoses) {}
    Buffer score, leverage, squared;
  };

  /// J^T r of every pose of a tile.
  void add_scores(const TileRange& range, const double* jacobian, Scores* out) const {
    const std::vector<int>& map = programs[range.segment].column_free;
    const std::size_t length = static_cast<std::size_t>(components_of(segments[range.segment].kind)) * kTilePoses;
    const double* const residual = jacobian + map.size() * length;
    std::fill(out->score.get(), out->score.get() + free.size() * kTilePoses, 0.0);
    for (std::size_t k = 0; k < map.size(); ++k) {
      double* const score = out->score.get() + static_cast<std::size_t>(map[k]) * kTilePoses;
      const double* const column = jacobian + k * length;
      for (std::size_t c = 0; c < length; c += kTilePoses) {
        for (std::size_t i = 0; i < kTilePoses; ++i) score[i] += column[c + i] * residual[c + i];
      }
    }
  }

  /// trace(J root^T root J^T) / components of every pose of a tile.
  void add_leverages(const TileRange& range, const double* jacobian, const Eigen::MatrixXd& root, Scores* out) const {
    const std::vector<int>& map = programs[range.segment].column_free;
    const int values = components_of(segments[range.segment].kind), length = values * kTilePoses;
    std::fill(out->leverage.get(), out->leverage.get() + kTilePoses, 0.0);
    std::fill(out->squared.get(), out->squared.get() + length, 0.0);
    std::vector<double> row(map.size());
    for (Eigen::Index m = 0; m < root.rows(); ++m) {
      for (std::size_t k = 0; k < map.size(); ++k) row[k] = root(m, map[k]);
      run.add_squared(jacobian, length, row.data(), static_cast<int>(map.size()), length, out->squared.get());
    }
    for (int i = 0; i < length; ++i) out->leverage.get()[i % kTilePoses] += out->squared.get()[i] / values;
  }

  void sum_slot(int slot, const Eigen::VectorXd& values, const Weighing& weighing, Workspace* w) {
    std::vector<double>& sums = slot_sums[slot];
    std::fill(sums.begin(), sums.end(), 0.0);
    const auto [begin, end] = tiles_of(slot);
    int pending = 0;
    for (std::size_t k = begin; k < end; ++k) {
      const TileRange& range = tiles[k];
      evaluate_tile(range, values, weighing, true, true, w);
      const int rows_per_pose = components_of(segments[range.segment].kind);
      const int columns = static_cast<int>(programs[range.segment].columns.size()) + 1;
      run.gram_add(w->jacobian.get(), rows_per_pose * kTilePoses, columns, 0, rows_per_pose * kTilePoses,
                   w->accumulator.get());
      if (weighing.loss != kernel::RowLoss::none) {
        for (int i = 0; i < range.count; ++i) sums.back() += loss_of(weighing, w->squared_norm.get()[i]);
      }
      const bool last = k + 1 == end || tiles[k + 1].segment != range.segment;
      if (++pending == kTilesPerReduce || last) {
        flush(range.segment, &sums, w);
        pending = 0;
      }
    }
  }
};

Evaluator::Evaluator(const Model& model, const Measurements& data, const std::vector<std::vector<double>>& bases,
                     std::vector<Segment> segments, std::vector<int> free, int threads)
    : impl_(std::make_unique<Impl>(model, data, bases, std::move(segments), std::move(free), threads)) {
  for (std::size_t i = 0; i < model.parameters.size() && impl_->first_point_parameter < 0; ++i) {
    if (model.parameters[i].role == Role::point) impl_->first_point_parameter = static_cast<int>(i);
  }
}

Evaluator::~Evaluator() = default;
Evaluator::Evaluator(Evaluator&&) noexcept = default;

const std::vector<int>& Evaluator::free() const { return impl_->free; }
std::size_t Evaluator::components() const { return impl_->components; }

static void add_prior(const Prior& prior, const std::vector<int>& free, const Eigen::VectorXd& values,
                      NormalEquations* out) {
  for (Eigen::Index k = 0; k < prior.weight.size(); ++k) {
    const double away = values[free[static_cast<std::size_t>(k)]] - prior.center[k];
    out->gram(k, k) += prior.weight[k];
    out->gradient[k] += prior.weight[k] * away;
    out->cost += prior.weight[k] * away * away;
  }
}

void Evaluator::normal_equations(const Eigen::VectorXd& values, const Weighing& weighing, NormalEquations* out) const {
  const std::lock_guard<std::mutex> lock(impl_->busy);
  Impl& impl = *impl_;
  impl.for_slots(values, [&](int slot, Impl::Workspace* w) { impl.sum_slot(slot, values, weighing, w); });
  const auto p = static_cast<Eigen::Index>(impl.free.size());
  const Eigen::Index size = p + 1;
  // Slot by slot in fixed order: the same bits on one and on two threads.
  for (std::size_t k = 1; k < impl.slot_sums.size(); ++k) {
    for (std::size_t i = 0; i < impl.slot_sums[0].size(); ++i) impl.slot_sums[0][i] += impl.slot_sums[k][i];
  }
  out->gram.setZero(p, p);
  out->gradient.setZero(p);
  out->components = impl.components;
  out->cost = out->squares = 0.0;
  if (impl.slot_sums.empty()) return;
  const std::vector<double>& sums = impl.slot_sums[0];
  for (Eigen::Index j = 0; j < p; ++j) {
    for (Eigen::Index i = 0; i < p; ++i) {
      // A block of columns is in the order of free parameters, so the upper triangle of the sums is the upper triangle
      // here.
      out->gram(i, j) =
          i <= j ? sums[static_cast<std::size_t>(j * size + i)] : sums[static_cast<std::size_t>(i * size + j)];
    }
    out->gradient[j] = sums[static_cast<std::size_t>(p * size + j)];
  }
  out->squares = sums[static_cast<std::size_t>(p * size + p)];
  out->cost = weighing.loss == kernel::RowLoss::none ? out->squares : sums.back();
  add_prior(weighing.prior, impl.free, values, out);
}

void Evaluator::residual_norms(const Eigen::VectorXd& values, const Weighing& weighing,
                               std::vector<double>* norms) const {
  const std::lock_guard<std::mutex> lock(impl_->busy);
  Impl& impl = *impl_;
  impl.for_slots(values, [&](int slot, Impl::Workspace* w) {
    const auto [begin, end] = impl.tiles_of(slot);
    for (std::size_t k = begin; k < end; ++k) {
      const Impl::TileRange& range = impl.tiles[k];
      impl.evaluate_tile(range, values, weighing, false, true, w);
      for (int i = 0; i < range.count; ++i) {
        (*norms)[impl.segments[range.segment].rows[range.first + i]] = std::sqrt(w->squared_norm.get()[i]);
      }
    }
  });
}

void Evaluator::predict(const Eigen::VectorXd& values, const RowSink& sink) const {
  const std::lock_guard<std::mutex> lock(impl_->busy);
  Impl& impl = *impl_;
  impl.for_slots(values, [&](int slot, Impl::Workspace* w) {
    const auto [begin, end] = impl.tiles_of(slot);
    for (std::size_t k = begin; k < end; ++k) {
      const Impl::TileRange& range = impl.tiles[k];
      impl.evaluate_tile(range, values, Weighing{}, false, false, w);
      for (int i = 0; i < range.count; ++i) {
        double out[12];
        for (int c = 0; c < 12; ++c) out[c] = w->tip.get()[c * kTilePoses + i];
        sink(static_cast<std::size_t>(impl.segments[range.segment].rows[range.first + i]), out);
      }
    }
  });
}

void Evaluator::residuals(const Eigen::VectorXd& values, const RowSink& sink) const {
  const std::lock_guard<std::mutex> lock(impl_->busy);
  Impl& impl = *impl_;
  Weighing plain;
  plain.rotation_scale = 1.0;
  plain.row_weights = false;
  impl.for_slots(values, [&](int slot, Impl::Workspace* w) {
    const auto [begin, end] = impl.tiles_of(slot);
    for (std::size_t k = begin; k < end; ++k) {
      const Impl::TileRange& range = impl.tiles[k];
      impl.evaluate_tile(range, values, plain, false, true, w);
      const int components = components_of(impl.segments[range.segment].kind);
      for (int i = 0; i < range.count; ++i) {
        double out[6] = {0, 0, 0, 0, 0, 0};
        for (int c = 0; c < components; ++c) out[c] = w->jacobian.get()[c * kTilePoses + i];
        sink(static_cast<std::size_t>(impl.segments[range.segment].rows[range.first + i]), out);
      }
    }
  });
}

void Evaluator::jacobian_tiles(const Eigen::VectorXd& values, const Weighing& weighing, const TileSink& sink) const {
  const std::lock_guard<std::mutex> lock(impl_->busy);
  Impl& impl = *impl_;
  impl.for_slots(values, [&](int slot, Impl::Workspace* w) {
    const auto [begin, end] = impl.tiles_of(slot);
    for (std::size_t k = begin; k < end; ++k) {
      impl.evaluate_tile(impl.tiles[k], values, weighing, true, true, w);
      const int segment = impl.tiles[k].segment;
      sink(w->jacobian.get(), static_cast<int>(impl.programs[segment].columns.size()),
           components_of(impl.segments[segment].kind));
    }
  });
}

void Evaluator::scores(const Eigen::VectorXd& values, const Weighing& weighing, const Eigen::MatrixXd& root,
                       const ScoreSink& sink) const {
  const std::lock_guard<std::mutex> lock(impl_->busy);
  Impl& impl = *impl_;
  impl.for_slots(values, [&](int slot, Impl::Workspace* w) {
    Impl::Scores scores(impl.free.size());
    const auto [begin, end] = impl.tiles_of(slot);
    for (std::size_t k = begin; k < end; ++k) {
      const Impl::TileRange& range = impl.tiles[k];
      impl.evaluate_tile(range, values, weighing, true, true, w);
      impl.add_scores(range, w->jacobian.get(), &scores);
      impl.add_leverages(range, w->jacobian.get(), root, &scores);
      sink(impl.segments[range.segment].rows.data() + range.first, range.count, scores.score.get(),
           scores.leverage.get());
    }
  });
}

int Evaluator::tile_count() const { return static_cast<int>(impl_->tiles.size()); }
int Evaluator::tile_rows(int tile) const { return impl_->tiles[tile].count; }
int Evaluator::tile_components(int tile) const {
  return components_of(impl_->segments[impl_->tiles[tile].segment].kind);
}
const std::int32_t* Evaluator::tile_numbers(int tile) const {
  const Impl::TileRange& range = impl_->tiles[tile];
  return impl_->segments[range.segment].rows.data() + range.first;
}

void Evaluator::tile(int tile, const Eigen::VectorXd& values, const Weighing& weighing, double* residual,
                     double* jacobian) const {
  const std::lock_guard<std::mutex> lock(impl_->busy);
  Impl& impl = *impl_;
  const Impl::TileRange& range = impl.tiles[tile];
  Impl::Workspace* w = &impl.workspaces[0];
  impl.set_values(values, w);
  impl.evaluate_tile(range, values, weighing, true, true, w);
  const int components = tile_components(tile);
  const std::vector<int>& map = impl.programs[range.segment].column_free;
  const auto p = static_cast<std::ptrdiff_t>(impl.free.size());
  if (jacobian) std::fill(jacobian, jacobian + p * components * range.count, 0.0);
  for (int i = 0; i < range.count; ++i) {
    for (int c = 0; c < components; ++c) {
      const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(i) * components + c;
      const std::ptrdiff_t at = c * kTilePoses + i;
      const std::ptrdiff_t column_size = static_cast<std::ptrdiff_t>(components) * kTilePoses;
      residual[row] = w->jacobian.get()[static_cast<std::ptrdiff_t>(map.size()) * column_size + at];
      if (!jacobian) continue;
      for (std::size_t k = 0; k < map.size(); ++k) {
        jacobian[row * p + map[k]] += w->jacobian.get()[static_cast<std::ptrdiff_t>(k) * column_size + at];
      }
    }
  }
}

}  // namespace truing::estimation
