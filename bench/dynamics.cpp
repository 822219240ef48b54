// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Times the torque regressor of a six-joint arm, and its normal equations with 70 further columns a joint, and prints
// one JSON object a line: {"name", "value", "unit"}. With the name of a file as argument it writes states and torques
// there, which bench/dynamics.py gives to the peers.

#include <algorithm>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "common.hpp"
#include "dynamics/joint_grams.hpp"
#include "dynamics/regressor.hpp"
#include "kernel/kernel.hpp"
#include "truing/truing.hpp"

namespace {

using namespace truing;
using namespace truing::bench;
using namespace truing::dynamics;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr Index kJoints = 6, kEffects = 70;

Robot with_masses(Robot robot) {
  double mass = 8.0, across = 0.0;
  for (Joint& joint : robot.joints) {
    joint.mass = mass;
    joint.center_of_mass = {0.1, across, -0.05};
    joint.inertia = Eigen::Vector3d(0.04, 0.05, 0.06).asDiagonal();
    mass -= 1.0;
    across += 0.02;
  }
  return robot;
}

MatrixXd random_table(Index rows, Index columns, double reach, std::mt19937_64* random) {
  std::uniform_real_distribution<double> uniform(-reach, reach);
  return MatrixXd::NullaryExpr(rows, columns, [&] { return uniform(*random); });
}

struct Tables {
  MatrixXd q, qd, qdd, effects, torque;

  Tables(Index rows, std::mt19937_64* random)
      : q(random_table(rows, kJoints, M_PI, random)),
        qd(random_table(rows, kJoints, 2.0, random)),
        qdd(random_table(rows, kJoints, 5.0, random)),
        effects(random_table(rows, kEffects, 1.0, random)),
        torque(random_table(rows, kJoints, 50.0, random)) {}
};

/// Every row, over and over in the same buffers, as the normal equations take them.
void time_regressor(const RigidChain& chain, const Tables& t) {
  constexpr Index kTile = 256;
  std::vector<MatrixXd> out(kJoints, MatrixXd::Zero(kTile, kLinkParameters * kJoints));
  std::vector<double*> blocks(kJoints * kJoints, nullptr);
  for (Index k = 0; k < kJoints; ++k) {
    for (const Index link : chain.felt_links(k))
      blocks[static_cast<std::size_t>(k * kJoints + link)] =
          out[static_cast<std::size_t>(k)].col(kLinkParameters * link).data();
  }
  const double rows = static_cast<double>(t.q.rows());
  for (const char* name : {"scalar", "sse2", "avx2", "avx512"}) {
    const kernel::RigidFunctions* copy = kernel::rigid_functions(name);
    if (!copy) continue;
    report(std::string("regressor_") + name,
           rows / best_seconds(7,
                               [&] {
                                 for (Index first = 0; first < t.q.rows(); first += kTile)
                                   chain.regressors(*copy, t.q, t.qd, t.qdd, first, std::min(first + kTile, t.q.rows()),
                                                    blocks.data(), kTile);
                               }),
           "samples/s");
  }
  const Index few = std::min<Index>(t.q.rows(), 20000);
  const MatrixXd q = t.q.transpose(), qd = t.qd.transpose(), qdd = t.qdd.transpose();
  MatrixXd Y(kJoints, kLinkParameters * kJoints);
  report("regressor_plain",
         static_cast<double>(few) / best_seconds(5,
                                                 [&] {
                                                   for (Index i = 0; i < few; ++i)
                                                     chain.regressor(q.col(i).data(), qd.col(i).data(),
                                                                     qdd.col(i).data(), Y);
                                                 }),
         "samples/s");
}

void time_grams(const RigidChain& chain, const Tables& t) {
  const double rows = static_cast<double>(t.q.rows());
  for (const Index effects : {Index{0}, kEffects}) {
    const std::vector<Index> further(kJoints, effects);
    for (const int threads : {1, 2}) {
      const double time = best_seconds(40, [&] {
        joint_grams(
            chain, t.q, t.qd, t.qdd, further,
            [&](Index k, Index begin, JointRows tile) {
              tile.middleCols(tile.cols() - 1 - effects, effects) = t.effects.block(begin, 0, tile.rows(), effects);
              tile.col(tile.cols() - 1) = t.torque.col(k).segment(begin, tile.rows());
            },
            threads);
      });
      report("grams_" + std::to_string(effects) + "_threads_" + std::to_string(threads), rows / time, "samples/s");
    }
  }
}

/// What the processor can do of the Gram alone: the same products on tiles that stay where they are.
void time_limit(Index rows) {
  constexpr Index kTile = 256;
  std::vector<MatrixXd> tiles;
  std::vector<std::vector<double>> sums;
  double products = 0.0;
  for (Index k = 0; k < kJoints; ++k) {
    const Index columns = kLinkParameters * (kJoints - k) + kEffects + 1;
    tiles.push_back(MatrixXd::Random(kTile, columns));
    sums.emplace_back(kernel::functions().gram_size(static_cast<int>(columns)), 0.0);
    products += 0.5 * static_cast<double>(columns * (columns + 1));
  }
  const double time = best_seconds(40, [&] {
    for (Index first = 0; first < rows; first += kTile) {
      for (std::size_t k = 0; k < tiles.size(); ++k)
        kernel::functions().gram_add(tiles[k].data(), kTile, static_cast<int>(tiles[k].cols()), 0, kTile,
                                     sums[k].data());
    }
  });
  report("gram_only", static_cast<double>(rows) / time, "samples/s");
  report("gram_only_rate", 2e-9 * products * static_cast<double>(rows) / time, "GFLOP/s");
}

/// Columns of the robot's own torques beside the states, as text that NumPy reads.
void write_states(const char* path, const Robot& robot, const Tables& t) {
  std::ofstream out(path);
  out.precision(17);
  const Index few = std::min<Index>(t.q.rows(), 2000);
  const MatrixXd Y = torque_regressor(robot, t.q.topRows(few), t.qd.topRows(few), t.qdd.topRows(few));
  const Eigen::VectorXd torque = Y * link_parameters(robot);
  for (Index i = 0; i < few; ++i) {
    for (const MatrixXd* table : {&t.q, &t.qd, &t.qdd}) out << table->row(i) << ' ';
    out << torque.segment(i * kJoints, kJoints).transpose() << '\n';
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::mt19937_64 random(1);
  const Robot robot = with_masses(ur10());
  const RigidChain chain(robot);
  const Tables tables(16384, &random);
  report("kernel", kernel::functions().name);
  time_regressor(chain, tables);
  time_grams(chain, tables);
  time_limit(tables.q.rows());
  if (argc > 1) write_states(argv[1], robot, tables);
}
