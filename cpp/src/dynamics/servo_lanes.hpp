// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Joints apart whose rotors are their links', side by side in the kernel's lanes: what it is to know is laid beside
// each other here, row by row of the recordings.

#include <algorithm>
#include <cmath>
#include <vector>

#include "dynamics/servo_chain.hpp"
#include "kernel/drive.hpp"
#include "kernel/rigid.hpp"
#include "truing/dynamics/servo.hpp"

namespace truing::dynamics {

/// All that joints apart are simulated from, and where what they do goes.
struct ServoTask {
  const ServoArm& arm;
  const std::vector<std::vector<ServoPath>>& paths;
  const std::vector<ServoRecording>& recordings;
  const std::vector<ServoWindow>& windows;
  const std::vector<ServoSet>& sets;
  const std::vector<Eigen::Index>& rows;  ///< of the output, at which each window begins
  ServoMotion* out;
};

/// A set over a window.
struct ServoPiece {
  std::size_t set = 0, window = 0;
};

constexpr double kServoFar = 1e3;  ///< [rad | m] a joint that is so far from zero has left

/// Some pieces of the same steps, through the windows side by side. What leaves stays where it is, all of its piece.
class ServoLanes {
 public:
  ServoLanes(const ServoTask& task, const std::vector<ServoPiece>& pieces) : task_(task) {
    for (const ServoPiece& piece : pieces) add(piece);
    const std::size_t multiple = kernel::kSampleMultiple, filled = (lanes_.size() + multiple - 1) / multiple * multiple;
    const double between = task.recordings[recording(pieces.front())].step / task.arm.step;
    tile_.steps = static_cast<int>(std::lround(between));
    tile_.step = task.arm.step;
    tile_.lanes = static_cast<int>(filled);
    table_ = Eigen::MatrixXd::Zero(static_cast<Index>(filled), kernel::drive_rows(tile_.steps));
    tile_.table = table_.data();
    begin();
  }

  void run() {
    for (Index k = 0; k < longest_; ++k) {
      for (std::size_t l = 0; l < lanes_.size(); ++l)
        if (k < lanes_[l].window->rows) enter(l, k);
      kernel::drive_functions().turn(tile_);
      for (std::size_t l = 0; l < lanes_.size(); ++l)
        if (k < lanes_[l].window->rows) leave(l, k);
      for (std::size_t l = 0; l < lanes_.size(); ++l)
        if (left_[lanes_[l].piece]) at(Row::moves, l) = 0.0;
    }
  }

 private:
  using Index = Eigen::Index;
  using Row = kernel::DriveRow;
  struct Lane {
    ServoDrive drive;
    ServoPiece from;
    std::size_t piece;
    const ServoWindow* window;
    const double *inertia, *bias, *cosine, *sine, *position;
    Index joint, last;
    bool steady;  ///< nothing but its command changes from row to row
  };

  std::size_t recording(const ServoPiece& piece) const {
    return static_cast<std::size_t>(task_.windows[piece.window].recording);
  }
  const ServoPath& path_of(const ServoPiece& piece) const {
    return task_.paths[static_cast<std::size_t>(std::max(0, task_.sets[piece.set].bodies))][recording(piece)];
  }
  double& at(Row row, std::size_t lane) { return table_(static_cast<Index>(lane), static_cast<Index>(row)); }

  void add(const ServoPiece& piece) {
    const ServoSet& set = task_.sets[piece.set];
    const ServoWindow& window = task_.windows[piece.window];
    const ServoRecording& r = task_.recordings[recording(piece)];
    const ServoPath& path = path_of(piece);
    const auto joints = static_cast<Index>(task_.arm.dof.size());
    const Index first = std::max(0, set.only), end = set.only < 0 ? joints : set.only + 1;
    const bool steady = r.gain.rows() == 1 && r.supply.rows() == 1 && r.enabled.rows() == 1 && r.warmth.rows() == 1;
    for (Index j = first; j < end; ++j) {
      const auto column = [&](const Eigen::MatrixXd& table) { return table.col(j).data() + window.first; };
      lanes_.push_back({ServoDrive(task_.arm, r, set, window.recording, j), piece, left_.size(), &window,
                        column(path.inertia), column(path.bias), column(path.cosine), column(path.sine),
                        column(r.position), j, r.position.rows() - 1 - window.first, steady});
    }
    left_.push_back(false);
    longest_ = std::max(longest_, window.rows);
  }

  void begin() {
    std::vector<std::size_t> firsts;
    for (std::size_t l = 0; l < lanes_.size(); ++l) {
      Lane& lane = lanes_[l];
      const ServoRecording& r = task_.recordings[recording(lane.from)];
      const ServoSet& set = task_.sets[lane.from.set];
      const Index row = lane.window->first;
      const double angle = r.position(row, lane.joint) - lane.drive.zero(), speed = r.speed(row, lane.joint);
      lane.drive.begin(row, angle, speed);
      const auto put = [&](Row which, double value) { at(which, l) = value; };
      tile_.laws |= lane.drive.laws();
      lane.drive.values(put);
      lane.drive.row_values(put);
      put(Row::weight, set.weight_scale);
      put(Row::turns, path_of(lane.from).turns[lane.joint]);
      put(Row::angle, angle);
      put(Row::speed, speed);
      put(Row::time, static_cast<double>(row) * r.step);
      put(Row::moves, 1.0);
      firsts.push_back(functions_.size());
      lane.drive.lend(&functions_);
    }
    firsts.resize(static_cast<std::size_t>(tile_.lanes) + 1, functions_.size());
    for (const std::size_t first : firsts) of_lanes_.push_back(functions_.data() + first);
    tile_.functions = of_lanes_.data();
  }

  /// What holds from a window's row to the next.
  void enter(std::size_t l, Index k) {
    Lane& lane = lanes_[l];
    const auto put = [&](Row which, double value) { at(which, l) = value; };
    if (!lane.steady) {
      lane.drive.enter(lane.window->first + k);
      lane.drive.row_values(put);
    }
    lane.drive.commands(lane.window->first + k, put);
    const Index next = std::min(k + 1, lane.last);
    const auto line = [&](Row here, Row more, const double* of) {
      put(here, of[k]);
      put(more, of[next] - of[k]);
    };
    line(Row::inertia, Row::inertia_more, lane.inertia);
    line(Row::bias, Row::bias_more, lane.bias);
    line(Row::cosine, Row::cosine_more, lane.cosine);
    line(Row::sine, Row::sine_more, lane.sine);
    line(Row::position, Row::position_more, lane.position);
  }

  void leave(std::size_t l, Index k) {
    const Lane& lane = lanes_[l];
    const double q = at(Row::angle, l) + at(Row::zero, l);
    if (!(std::abs(q) < kServoFar)) left_[lane.piece] = true;
    const Index row = task_.rows[lane.from.window] + k;
    task_.out->position[lane.from.set](row, lane.joint) =
        std::isfinite(q) ? std::clamp(q, -kServoFar, kServoFar) : kServoFar;
    if (!task_.out->torque.empty()) task_.out->torque[lane.from.set](row, lane.joint) = at(Row::torque, l);
  }

  const ServoTask& task_;
  std::vector<Lane> lanes_;
  std::vector<char> left_;  ///< of every piece
  Index longest_ = 0;
  Eigen::MatrixXd table_;
  std::vector<kernel::DriveFunction> functions_;
  std::vector<const kernel::DriveFunction*> of_lanes_;
  kernel::DriveTile tile_{};
};

}  // namespace truing::dynamics
