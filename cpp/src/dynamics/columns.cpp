// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/columns.hpp"

#include <algorithm>
#include <cmath>

#include "kernel/kernel.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Columns of the design that a joint's torque has.
std::vector<std::vector<int>> columns_by_joint(const TorqueDesign& design, std::size_t joints) {
  std::vector<std::vector<int>> out(joints);
  for (std::size_t c = 0; c < design.terms.size(); ++c) {
    for (const std::size_t j : design.terms[c].joints) out[j].push_back(static_cast<int>(c));
  }
  return out;
}

/// Columns of the rigid chain at every row of a motion, of the links that a joint feels; made in place of those of the
/// thread's last motion.
class LinkColumns {
 public:
  LinkColumns(const RigidChain& chain, const Motion& motion) : links_(static_cast<std::size_t>(chain.links())) {
    thread_local std::vector<double> room;
    const Index rows = RigidChain::padded(motion.rows());
    blocks_.assign(static_cast<std::size_t>(chain.driven()) * links_, nullptr);
    stride_ = rows;
    std::size_t felt = 0;
    for (Index k = 0; k < chain.driven(); ++k) felt += chain.felt_links(k).size();
    room.resize(felt * static_cast<std::size_t>(kLinkParameters * rows));
    double* next = room.data();
    for (Index k = 0; k < chain.driven(); ++k) {
      for (const Index link : chain.felt_links(k)) {
        blocks_[static_cast<std::size_t>(k) * links_ + static_cast<std::size_t>(link)] = next;
        next += kLinkParameters * rows;
      }
    }
    if (motion.rows() > 0) chain.regressors(motion.q, motion.qd, motion.qdd, 0, motion.rows(), blocks_.data(), stride_);
  }

  const double* column(std::size_t joint, int parameter) const {
    return blocks_[joint * links_ + static_cast<std::size_t>(parameter / kLinkParameters)] +
           stride_ * (parameter % kLinkParameters);
  }

 private:
  std::size_t links_;
  Index stride_ = 0;
  std::vector<double*> blocks_;
};

/// Normal equations of rows of a table, the measured value its last column.
class TableSum {
 public:
  explicit TableSum(Index columns)
      : rows_(kTogether, columns), sums_(kernel::functions().gram_size(static_cast<int>(columns)), 0.0) {}

  Gram of(const MatrixXd& table, const std::vector<Index>& rows) {
    const auto count = static_cast<Index>(rows.size());
    for (Index done = 0; done < count; done += kTogether) {
      const Index some = std::min(kTogether, count - done), all = RigidChain::padded(some);
      for (Index c = 0; c < table.cols(); ++c) {
        const double* const from = table.col(c).data();
        double* const to = rows_.col(c).data();
        for (Index i = 0; i < some; ++i) to[i] = from[rows[static_cast<std::size_t>(done + i)]];
      }
      rows_.middleRows(some, all - some).setZero();
      kernel::functions().gram_add(rows_.data(), kTogether, static_cast<int>(table.cols()), static_cast<int>(all),
                                   sums_.data());
    }
    const Index x = table.cols() - 1;
    MatrixXd sum = MatrixXd::Zero(x + 1, x + 1);
    kernel::functions().gram_reduce(sums_.data(), static_cast<int>(x + 1), sum.data());
    Gram out;
    out.xx = sum.topLeftCorner(x, x).selfadjointView<Eigen::Upper>();
    out.xy = sum.col(x).head(x);
    out.yy = sum(x, x);
    out.n = static_cast<double>(count);
    return out;
  }

 private:
  static constexpr Index kTogether = 256;
  MatrixXd rows_;
  std::vector<double> sums_;  ///< the kernel's own
};

/// Sums of one tile, by joint and fold.
using TileGrams = std::vector<std::vector<Gram>>;

/// The rows of a tile that are fitted, by fold: those of these folds in which the joint moves and its torque was
/// measured.
std::vector<std::vector<Index>> fitted_rows(const Tile& tile, Index joint, const Folds& folds) {
  std::vector<std::vector<Index>> out(static_cast<std::size_t>(folds.count));
  const VectorXd time = tile.own_time();
  for (Index i = 0; i < tile.count; ++i) {
    if (tile.moving(i, joint) == 0.0 || std::isnan(tile.measured(i, joint))) continue;
    const int fold = folds.fold(tile.recording, time[i]);
    if (fold >= 0) out[static_cast<std::size_t>(fold)].push_back(i);
  }
  return out;
}

TileGrams grams_of(DesignColumns::Tables* columns, const Tile& tile, const MatrixXd& predicted, const Folds& folds) {
  TileGrams out(columns->size(), std::vector<Gram>(static_cast<std::size_t>(folds.count)));
  for (std::size_t j = 0; j < columns->size(); ++j) {
    const auto joint = static_cast<Index>(j);
    MatrixXd& table = (*columns)[j];
    table.rightCols(1) = tile.measured.col(joint) - predicted.col(joint);
    TableSum sum(table.cols());
    const std::vector<std::vector<Index>> rows = fitted_rows(tile, joint, folds);
    for (std::size_t f = 0; f < rows.size(); ++f) {
      if (!rows[f].empty()) out[j][f] = sum.of(table, rows[f]);
    }
  }
  return out;
}

}  // namespace

DesignColumns::DesignColumns(const Tiles& tiles, const TorqueDesign& design)
    : tiles_(tiles),
      design_(design),
      chain_(tiles.robot()),
      by_joint_(columns_by_joint(design, tiles.robot().driven_count())) {
  constexpr double kMostKept = 400.0 * 1024 * 1024;  ///< [bytes]
  double numbers = 0.0;
  for (const std::vector<int>& columns : by_joint_) numbers += static_cast<double>(columns.size() + 1);
  const Index rows = tiles.kept_rows();
  if (rows >= 0 && sizeof(double) * numbers * static_cast<double>(rows) < kMostKept) kept_.resize(tiles.kept_tiles());
  for (const TorqueTerm& term : design.terms)
    needs_rigid_ = needs_rigid_ || (term.link_parameter < 0 && term.needs_rigid);
}

void DesignColumns::fill(Tile* tile, bool that_need_torque, Tables* tables) const {
  if (needs_rigid_) fill_rigid(&tile->motion);
  const bool any_link = !that_need_torque && std::any_of(design_.terms.begin(), design_.terms.end(),
                                                         [](const TorqueTerm& t) { return t.link_parameter >= 0; });
  const LinkColumns links(chain_, any_link ? tile->motion : Motion{});
  std::vector<Index> next(by_joint_.size(), 0);
  for (const TorqueTerm& term : design_.terms) {
    const bool of_link = term.link_parameter >= 0, wanted = term.needs_torque == that_need_torque;
    const MatrixXd values = of_link || !wanted ? MatrixXd() : term.basis(tile->motion);
    for (std::size_t k = 0; k < term.joints.size(); ++k) {
      const std::size_t j = term.joints[k];
      double* const out = (*tables)[j].col(next[j]++).data();
      if (!wanted) continue;
      tile->own_rows(of_link ? links.column(j, term.link_parameter) : values.col(static_cast<Index>(k)).data(), out);
    }
  }
  tile->motion.rigid.clear();  // large, and soon made again
}

void DesignColumns::use(Tile* tile, bool with_torque, const std::function<void(Tables&)>& use) const {
  Tables made;
  Tables& tables = kept_.empty() ? made : kept_[tile->number];
  if (tables.empty()) {
    for (const std::vector<int>& columns : by_joint_)
      tables.emplace_back(tile->count, static_cast<Index>(columns.size()) + 1);
    fill(tile, false, &tables);
  }
  if (with_torque) fill(tile, true, &tables);
  use(tables);
}

TorqueGrams sum_grams(const DesignColumns& columns, const TorqueModel& subtracted, const TorqueModel& seen,
                      const Folds& folds) {
  auto out = std::make_shared<std::vector<JointGrams>>();
  for (std::size_t j = 0; j < columns.tiles().robot().driven_count(); ++j)
    out->push_back({columns.of_joint(j), std::vector<Gram>(static_cast<std::size_t>(folds.count))});
  std::vector<TileGrams> lot(Tiles::kTogether);
  const auto work = [&](Tile& tile, std::size_t k) {
    const MatrixXd predicted = own_torque(subtracted, &tile);
    set_torque(seen, &tile);
    columns.use(&tile, true,
                [&](DesignColumns::Tables& tables) { lot[k] = grams_of(&tables, tile, predicted, folds); });
  };
  const auto add = [&](std::size_t k) {
    for (std::size_t j = 0; j < out->size(); ++j) {
      for (std::size_t f = 0; f < lot[k][j].size(); ++f) {
        if (lot[k][j][f].xx.size() > 0) (*out)[j].folds[f].add(lot[k][j][f]);
      }
    }
    lot[k].clear();
  };
  columns.tiles().for_each([&](std::size_t r) { return folds.of_recording[r] >= 0; }, work, add);
  return out;
}

std::vector<Noise> noise_of(const DesignColumns& columns, const TorqueModel& model, const std::vector<int>& which,
                            const VectorXd& values, const Folds& folds) {
  VectorXd by_column = VectorXd::Zero(static_cast<Index>(columns.design().terms.size()));
  for (std::size_t k = 0; k < which.size(); ++k) by_column[which[k]] = values[static_cast<Index>(k)];
  return noise_of(
      columns.tiles(),
      [&](Tile& tile) -> MatrixXd {
        MatrixXd errors = tile.measured - own_torque(model, &tile);
        columns.use(&tile, false, [&](const DesignColumns::Tables& tables) {
          for (std::size_t j = 0; j < tables.size(); ++j) {
            const std::vector<int>& of = columns.of_joint(j);
            for (std::size_t c = 0; c < of.size(); ++c) {
              const double value = by_column[of[c]];
              if (value != 0.0) errors.col(static_cast<Index>(j)) -= value * tables[j].col(static_cast<Index>(c));
            }
          }
        });
        return errors;
      },
      folds);
}

}  // namespace truing::dynamics
