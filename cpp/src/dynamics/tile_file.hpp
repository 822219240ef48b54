// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Tiles on disk: of recordings that are longer than memory they are made once, and read again in every pass.

#include <cstdio>
#include <memory>
#include <mutex>
#include <vector>

#include "dynamics/prepare.hpp"
#include "rooms.hpp"

namespace truing::dynamics {

/// A temporary file, which goes with its last user; it needs some 45 bytes for a row at 500 Hz of six joints. It stands
/// in the folder that TMPDIR names, else in /var/tmp, which is on a disk where /tmp is memory, else where the system
/// has temporary files.
class TileFile {
 public:
  TileFile();

  /// False: the disk has no room for it, or no file can be made.
  bool add(const Tile& tile);

  std::size_t size() const { return places_.size(); }
  /// Of which recording a tile is.
  std::size_t recording(std::size_t number) const { return places_[number].recording; }
  /// Several threads may read at a time. Throws std::runtime_error: the file cannot be read any more.
  Tile read(std::size_t number, const Robot& robot) const;

 private:
  /// Where a tile's numbers stand in the file.
  struct Place {
    std::size_t recording = 0;
    std::size_t begin = 0, numbers = 0;
    double step = 0.0;
    Eigen::Index rows = 0, joints = 0, stride = 0, between = 1, first = 0, count = 0, weights = 0;
    bool means = false;
    std::vector<std::string> columns;
  };

  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  std::vector<Place> places_;
  std::size_t end_ = 0;  ///< numbers written so far
  mutable std::mutex mutex_;
};

}  // namespace truing::dynamics
