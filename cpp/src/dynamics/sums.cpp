// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/sums.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dynamics/columns.hpp"
#include "dynamics/effects/families.hpp"
#include "dynamics/problem.hpp"

namespace truing {
using namespace dynamics;

bool TorqueSumOptions::is_valid(std::string* error) const {
  if (!(cutoff > 0.0) || !std::isfinite(cutoff)) return *error = "cutoff must be above 0 Hz", false;
  if (!(shortest > 0.0) || !std::isfinite(shortest)) return *error = "shortest must be above 0 s", false;
  if (most_blocks < 1) return *error = "most_blocks must be 1 or more", false;
  if (threads < 0) return *error = "threads must be 0 or more", false;
  return true;
}

namespace dynamics {
namespace {

/// What forms of effects are made with where no recording has been looked at: sizes of one, so that the columns depend
/// on the robot alone.
MotionRange range_of_no_recording(const Robot& robot) {
  const auto joints = static_cast<Eigen::Index>(robot.driven_count());
  MotionRange out;
  out.upper = out.speed = out.acceleration = out.torque = Eigen::VectorXd::Ones(joints);
  out.lower = -out.upper;
  out.turns = turns_of(robot);
  return out;
}

/// What is usual, at every joint.
TorqueDesign usual_design(const Robot& robot, const MotionRange& range) {
  TorqueDesign design;
  for (const TorqueEffect& effect : torque_catalogue()) {
    if (effect.traits.usual || effect.traits.standard) add_effect(effect, -1, robot, range, &design);
  }
  return design;
}

void require_masses(const Robot& robot) {
  validate(robot);
  const bool any = std::any_of(robot.joints.begin(), robot.joints.end(),
                               [](const Joint& joint) { return joint.mass.value_or(0.0) > 0.0; });
  if (!any) {
    throw std::invalid_argument(
        "no link of the robot has a mass: torques need mass, centre of mass and inertia of the links (URDF: "
        "<inertial>; robot.yaml: mass, com, inertia)");
  }
}

/// Blocks of equal time as folds.
Folds blocks_of_time(const Recording& recording, const TorqueSumOptions& options) {
  const double end = recording.read ? recording.end : recording.time[recording.time.size() - 1];
  const double length = end - recording.time[0];
  Folds out;
  out.of_recording = {0};
  out.count = std::clamp(static_cast<int>(length / options.shortest), 1, options.most_blocks);
  out.block_length = length / out.count * (1.0 + 1e-9);
  for (int b = 0; b < out.count; ++b) out.of_block.push_back(b);
  return out;
}

/// Rows of one joint, X and the measured torque behind it, added to a block.
void add_to_block(const Eigen::MatrixXd& rows, TorqueBlock* block) {
  const Eigen::Index x = rows.cols() - 1;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(x + 1, x + 1);
  sum.selfadjointView<Eigen::Upper>().rankUpdate(rows.transpose());
  if (block->gram.size() == 0) {
    block->gram = Eigen::MatrixXd::Zero(x, x);
    block->right = Eigen::VectorXd::Zero(x);
  }
  block->gram += Eigen::MatrixXd(sum.topLeftCorner(x, x).selfadjointView<Eigen::Upper>());
  block->right += sum.col(x).head(x);
  block->squares += sum(x, x);
  block->rows += static_cast<double>(rows.rows());
}

/// A tile's part of the blocks: of joint j in block b number b * joints + j.
std::vector<TorqueBlock> blocks_of_tile(const DesignColumns::Tables& tables, const Tile& tile,
                                        const Eigen::MatrixXd& nominal, const Folds& folds) {
  std::vector<TorqueBlock> out(tables.joints.size() * static_cast<std::size_t>(folds.count));
  const Eigen::VectorXd time = tile.own_time();
  for (std::size_t j = 0; j < tables.joints.size(); ++j) {
    const auto joint = static_cast<Eigen::Index>(j);
    Eigen::MatrixXd all = tables.joints[j].copied(2);
    all.col(all.cols() - 2) = nominal.col(joint);
    all.col(all.cols() - 1) = tile.measured.col(joint) - nominal.col(joint);
    std::vector<std::vector<Eigen::Index>> rows(static_cast<std::size_t>(folds.count));
    for (Eigen::Index i = 0; i < tile.count; ++i) {
      if (tile.moving(i, joint) == 0.0 || std::isnan(tile.measured(i, joint))) continue;
      rows[static_cast<std::size_t>(folds.fold(0, time[i]))].push_back(i);
    }
    for (std::size_t b = 0; b < rows.size(); ++b) {
      if (!rows[b].empty()) add_to_block(all(rows[b], Eigen::all), &out[b * tables.joints.size() + j]);
    }
  }
  return out;
}

void add_blocks(const std::vector<TorqueBlock>& more, std::vector<TorqueBlock>* sums) {
  for (std::size_t k = 0; k < more.size(); ++k) {
    if (more[k].rows == 0.0) continue;
    TorqueBlock& to = (*sums)[k];
    if (to.rows == 0.0) {
      to = more[k];
      continue;
    }
    to.gram += more[k].gram;
    to.right += more[k].right;
    to.squares += more[k].squares;
    to.rows += more[k].rows;
  }
}

/// All columns of a design with these values.
Fit all_columns_at(const TorqueDesign& design, const Eigen::VectorXd& values) {
  Fit out;
  for (std::size_t c = 0; c < design.terms.size(); ++c) out.columns.push_back(static_cast<int>(c));
  out.values = values;
  out.ridge = Eigen::VectorXd::Zero(values.size());
  out.covariance = Eigen::MatrixXd::Zero(values.size(), values.size());
  return out;
}

void require_size(const TorqueDesign& design, Eigen::Index found) {
  if (found != static_cast<Eigen::Index>(design.terms.size())) {
    throw std::invalid_argument("found " + std::to_string(found) + " values, expected one for each of the " +
                                std::to_string(design.terms.size()) + " parameters");
  }
}

}  // namespace

TorqueColumns torque_columns(const Robot& robot) {
  require_masses(robot);
  const TorqueDesign design = usual_design(robot, range_of_no_recording(robot));
  TorqueColumns out;
  out.of_joint.resize(robot.driven_count());
  for (std::size_t c = 0; c < design.terms.size(); ++c) {
    out.names.push_back(design.terms[c].parameter);
    out.units.push_back(design.terms[c].unit);
    out.prior.push_back(design.terms[c].prior);
    for (const std::size_t j : design.terms[c].joints) out.of_joint[j].push_back(static_cast<int>(c));
  }
  for (const std::size_t j : robot.driven_joints()) out.joints.push_back(robot.joints[j].name);
  return out;
}

std::vector<TorqueBlock> sum_torques(const Robot& robot, const Recording& recording, const TorqueSumOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument(error);
  require_masses(robot);
  const std::vector<Recording> recordings{recording};
  require_usable(robot, recordings);
  PrepareOptions prepare;
  std::vector<std::string> unsaid;
  prepare.torque_per_ampere = drive_constants(robot, recordings, &unsaid);
  prepare.cutoff = options.cutoff;
  prepare.one_pass = true;
  const Tiles tiles(recordings, robot, prepare, options.threads);
  const MotionRange range = range_of_no_recording(robot);
  const TorqueDesign design = usual_design(robot, range);
  const TorqueModel nominal(robot, valued_terms(robot, range, {}));
  const DesignColumns columns(tiles, design);
  const Folds folds = blocks_of_time(recording, options);

  std::vector<TorqueBlock> out(robot.driven_count() * static_cast<std::size_t>(folds.count));
  std::vector<std::vector<TorqueBlock>> lot(Tiles::kTogether);
  const auto work = [&](Tile& tile, std::size_t k) {
    const Eigen::MatrixXd predicted = own_torque(nominal, &tile);
    columns.use(&tile, false,
                [&](DesignColumns::Tables& tables) { lot[k] = blocks_of_tile(tables, tile, predicted, folds); });
  };
  tiles.for_each([](std::size_t) { return true; }, work, [&](std::size_t k) { add_blocks(lot[k], &out); });
  return out;
}

Eigen::VectorXd torques_of_bodies(const Robot& robot, const Eigen::MatrixXd& gram, const Eigen::VectorXd& right) {
  require_masses(robot);
  const TorqueDesign design = usual_design(robot, range_of_no_recording(robot));
  require_size(design, right.size());
  if (gram.rows() != right.size() || gram.cols() != right.size())
    throw std::invalid_argument("the Gram matrix and the right side have different sizes");
  Sums sums;
  sums.all.xx = gram;
  sums.all.xy = right;
  sums.precision = Eigen::VectorXd::Zero(right.size());
  std::vector<std::string> unsaid;
  const Fit free = fit_of(sums, all_columns_at(design, right).columns);
  return with_bodies(robot, design, sums, free, &unsaid).values;
}

Robot robot_with_torques(const Robot& robot, const Eigen::VectorXd& values) {
  require_masses(robot);
  const MotionRange range = range_of_no_recording(robot);
  const TorqueDesign design = usual_design(robot, range);
  require_size(design, values.size());
  std::vector<int> groups;
  for (std::size_t g = 0; g < design.groups.size(); ++g) groups.push_back(static_cast<int>(g));
  Robot out = applied(robot, design, groups, all_columns_at(design, values), range);
  out.fitted_range = robot.fitted_range;
  return out;
}

}  // namespace dynamics
}  // namespace truing
