// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/tile_file.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>

#if __has_include(<unistd.h>)
#include <unistd.h>
#define TRUING_POSIX 1
#else
#define TRUING_POSIX 0
#endif

namespace truing::dynamics {
namespace {

using Eigen::Index;

/// Calls use(data, count) for every table of a tile, in the order in which they stand in the file.
template <typename TileOrConst, typename Use>
void for_each_table(TileOrConst& tile, const Use& use) {
  const auto whole = [&](auto& table) { use(table.data(), static_cast<std::size_t>(table.size())); };
  whole(tile.weights);
  whole(tile.motion.time);
  whole(tile.motion.q);
  whole(tile.motion.qd);
  whole(tile.motion.qdd);
  whole(tile.motion.links);
  for (auto& column : tile.motion.columns) whole(column.second);
  whole(tile.measured);
  whole(tile.moving);
  whole(tile.inside);
}

/// Open, and without a name any more; null: not in this folder.
std::FILE* temporary_file_in([[maybe_unused]] std::string folder) {
#if TRUING_POSIX
  folder += "/truing_XXXXXX";
  const int opened = mkstemp(folder.data());
  if (opened < 0) return nullptr;
  unlink(folder.c_str());
  return fdopen(opened, "w+b");
#else
  return nullptr;
#endif
}

std::FILE* temporary_file() {
  const char* const asked_for = std::getenv("TMPDIR");
  if (asked_for != nullptr && *asked_for != '\0') {
    if (std::FILE* const file = temporary_file_in(asked_for)) return file;
  }
  std::FILE* const file = temporary_file_in("/var/tmp");
  return file != nullptr ? file : std::tmpfile();
}

}  // namespace

TileFile::TileFile() : file_(temporary_file(), &std::fclose) {}

bool TileFile::add(const Tile& tile) {
  const Motion& motion = tile.motion;
  Place place;
  place.recording = tile.recording;
  place.begin = end_;
  place.step = motion.step;
  place.rows = motion.rows();
  place.joints = motion.q.cols();
  place.stride = tile.stride;
  place.between = tile.between;
  place.means = tile.means;
  place.first = tile.first;
  place.count = tile.count;
  place.weights = tile.weights.size();
  for (const auto& [name, column] : motion.columns) place.columns.push_back(name);
  bool good = file_ != nullptr;
  for_each_table(tile, [&](const double* data, std::size_t count) {
    good = good && std::fwrite(data, sizeof(double), count, file_.get()) == count;
    place.numbers += count;
  });
  good = good && std::fflush(file_.get()) == 0;  // a full disk is seen here
  end_ += place.numbers;
  if (good) places_.push_back(std::move(place));
  return good;
}

Tile TileFile::read(std::size_t number, const Robot& robot) const {
  const Place& place = places_[number];
  std::vector<double> numbers(place.numbers);
  {
    const std::lock_guard<std::mutex> one_at_a_time(mutex_);
    std::fseek(file_.get(), static_cast<long>(place.begin * sizeof(double)), SEEK_SET);
    if (std::fread(numbers.data(), sizeof(double), numbers.size(), file_.get()) != numbers.size())
      throw std::runtime_error("the temporary file of a long recording cannot be read any more");
  }
  Tile out;
  out.recording = place.recording;
  out.number = number;
  out.stride = place.stride;
  out.between = place.between;
  out.means = place.means;
  out.first = place.first;
  out.count = place.count;
  out.weights.resize(place.weights);
  out.measured.resize(place.count, place.joints);
  out.moving.resize(place.count, place.joints);
  out.inside.resize(place.count, place.joints);
  Motion& motion = out.motion;
  motion.robot = &robot;
  motion.step = place.step;
  motion.time.resize(place.rows);
  for (Eigen::MatrixXd* table : {&motion.q, &motion.qd, &motion.qdd, &motion.links})
    table->resize(place.rows, place.joints);
  for (const std::string& name : place.columns) motion.columns[name].resize(place.rows);
  const double* next = numbers.data();
  for_each_table(out, [&](double* data, std::size_t count) {
    std::copy_n(next, count, data);
    next += count;
  });
  return out;
}

}  // namespace truing::dynamics
