// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The rows that a diagnosis of torques sees, for other methods to be fitted to: same folds, same derivatives, same
// filter, same columns. bench/dynamics_peers.py runs it.
//
//     bench_dynamics_rows FOLDER
//
// FOLDER/task.txt: low-pass [Hz]; part of the time held out; number of recordings; for each its name, 1 if it is marked
// as test, and its number of rows. FOLDER/robot.urdf; FOLDER/NUMBER.in: doubles, a row: time, positions, torques.
// Written are FOLDER/rows.out: doubles, a row: recording, fold of training (-1: none), fold held out (-1: none), time,
// then of every joint q, qd, qdd, the torque measured, that of the nominal model, 1 where it moves; FOLDER/JOINT.out:
// doubles, a row: its columns; and on stdout a line a column: joint, whether standard practice has it, effect, number
// of its form, parameter. The first joint is 0.

#include <cstdint>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynamics/columns.hpp"
#include "dynamics/problem.hpp"
#include "truing/truing.hpp"

namespace {

using namespace truing;
using namespace truing::dynamics;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct Given {
  double cutoff = 0.0, test_share = 0.0;
  Robot robot;
  std::vector<Recording> recordings;
};

Robot robot_in(const std::string& folder) {
  std::ifstream file(folder + "/robot.urdf");
  std::stringstream text;
  text << file.rdbuf();
  return robot_from_urdf(text.str(), "", last_moving_link(text.str()));
}

Recording recording_in(const std::string& path, Index rows, Index joints) {
  RowMajor table(rows, 1 + 2 * joints);
  std::ifstream file(path, std::ios::binary);
  const auto bytes = static_cast<std::streamsize>(sizeof(double)) * table.size();
  if (!file.read(reinterpret_cast<char*>(table.data()), bytes)) throw std::runtime_error(path + " is too short");
  Recording out;
  out.time = table.col(0);
  out.position = table.middleCols(1, joints);
  out.torque = table.rightCols(joints);
  return out;
}

Given read_given(const std::string& folder) {
  Given out;
  out.robot = robot_in(folder);
  std::ifstream file(folder + "/task.txt");
  int recordings = 0;
  file >> out.cutoff >> out.test_share >> recordings;
  for (int k = 0; k < recordings; ++k) {
    std::string name;
    bool test = false;
    Index rows = 0;
    if (!(file >> name >> test >> rows)) throw std::runtime_error(folder + "/task.txt is too short");
    const auto joints = static_cast<Index>(out.robot.driven_count());
    Recording recording = recording_in(folder + "/" + std::to_string(k) + ".in", rows, joints);
    recording.name = name;
    recording.test = test;
    out.recordings.push_back(std::move(recording));
  }
  return out;
}

void write_table(const RowMajor& table, std::ofstream* out) {
  out->write(reinterpret_cast<const char*>(table.data()), static_cast<std::streamsize>(sizeof(double)) * table.size());
}

/// Of one tile, before it is its turn to be written.
struct TileRows {
  RowMajor rows;
  std::vector<RowMajor> columns;  ///< by joint
};

TileRows rows_of(const Problem& problem, const DesignColumns& columns, const TorqueModel& seen, Tile* tile) {
  const auto joints = static_cast<Index>(problem.robot.driven_count());
  const MatrixXd nominal = own_torque(problem.nominal, tile);
  set_torque(seen, tile);  // what columns that need the torque see
  TileRows out;
  columns.use(tile, true, [&](const DesignColumns::Tables& tables) {
    for (const DesignColumns::Table& table : tables.joints) out.columns.push_back(table.copied(0));
  });
  const VectorXd time = tile->own_time();
  out.rows.resize(tile->count, 4 + 6 * joints);
  for (Index i = 0; i < tile->count; ++i) {
    const Index fine = (tile->first + i) * tile->stride;
    out.rows.row(i) << static_cast<double>(tile->recording), problem.train.fold(tile->recording, time[i]),
        problem.test.fold(tile->recording, time[i]), time[i], tile->motion.q.row(fine), tile->motion.qd.row(fine),
        tile->motion.qdd.row(fine), tile->measured.row(i), nominal.row(i), tile->moving.row(i);
  }
  return out;
}

void write_rows(const std::string& folder, const Problem& problem, const TorqueDesign& design,
                const TorqueModel& seen) {
  std::ofstream rows(folder + "/rows.out", std::ios::binary);
  std::vector<std::ofstream> files;
  for (std::size_t j = 0; j < problem.robot.driven_count(); ++j)
    files.emplace_back(folder + "/" + std::to_string(j) + ".out", std::ios::binary);
  const DesignColumns columns(problem.tiles, design);
  std::vector<TileRows> lot(Tiles::kTogether);
  problem.tiles.for_each([](std::size_t) { return true; },
                         [&](Tile& tile, std::size_t k) { lot[k] = rows_of(problem, columns, seen, &tile); },
                         [&](std::size_t k) {
                           write_table(lot[k].rows, &rows);
                           for (std::size_t j = 0; j < files.size(); ++j) write_table(lot[k].columns[j], &files[j]);
                         });
}

void print_columns(const TorqueDesign& design) {
  std::vector<int> group_of(design.terms.size(), 0);
  for (std::size_t g = 0; g < design.groups.size(); ++g)
    for (const int c : design.groups[g].columns) group_of[static_cast<std::size_t>(c)] = static_cast<int>(g);
  for (std::size_t c = 0; c < design.terms.size(); ++c) {
    const TorqueGroup& group = design.groups[static_cast<std::size_t>(group_of[c])];
    for (const std::size_t joint : design.terms[c].joints)
      std::cout << joint << ' ' << group.standard << ' ' << group.effect << ' ' << group_of[c] << ' '
                << design.terms[c].parameter << '\n';
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::cerr << "usage: bench_dynamics_rows FOLDER\n", 2;
  const std::string folder = argv[1];
  const Given given = read_given(folder);
  Problem problem(given.robot, given.recordings, {given.cutoff, given.test_share});
  const Groundwork groundwork = groundwork_of(&problem, true);
  const TorqueDesign design = design_of(problem.robot, problem.range, {}, {}, true);
  write_rows(folder, problem, design, groundwork.model);
  print_columns(design);
}
