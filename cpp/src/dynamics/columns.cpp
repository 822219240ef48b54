// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/columns.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <utility>

#include "dynamics/regressor.hpp"
#include "kernel/kernel.hpp"
#include "math/batch.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Those of some columns of the design that a joint's torque has.
std::vector<std::vector<int>> columns_by_joint(const TorqueDesign& design, const std::vector<int>& columns,
                                               std::size_t joints) {
  std::vector<std::vector<int>> out(joints);
  for (const int c : columns) {
    for (const std::size_t j : design.terms[static_cast<std::size_t>(c)].joints) out[j].push_back(c);
  }
  return out;
}

std::vector<int> all_columns(const TorqueDesign& design) {
  std::vector<int> out(design.terms.size());
  std::iota(out.begin(), out.end(), 0);
  return out;
}

/// Columns of the rigid chain at every row of a motion, filtered: by joint, those of the links that it feels.
std::vector<MatrixXd> filtered_links(const RigidChain& chain, const Tile& tile) {
  thread_local VectorXd room;  // of a std::vector what was in it would be moved, and the rest cleared
  const Motion& motion = tile.motion;
  const Index rows = RigidChain::padded(motion.rows());
  std::vector<double*> blocks(static_cast<std::size_t>(chain.driven() * chain.links()), nullptr);
  std::vector<MatrixXd> out;
  std::size_t felt = 0;
  for (Index k = 0; k < chain.driven(); ++k) felt += chain.felt_links(k).size();
  room.resize(std::max(room.size(), static_cast<Index>(felt) * kLinkParameters * rows));
  double* next = room.data();
  for (Index k = 0; k < chain.driven(); ++k) {
    for (const Index link : chain.felt_links(k)) {
      blocks[static_cast<std::size_t>(k * chain.links() + link)] = next;
      next += kLinkParameters * rows;
    }
    out.emplace_back(tile.count, kLinkParameters * static_cast<Index>(chain.felt_links(k).size()));
  }
  if (motion.rows() > 0) chain.regressors(motion.q, motion.qd, motion.qdd, 0, motion.rows(), blocks.data(), rows);
  const double* column = room.data();
  for (MatrixXd& table : out) {
    for (Index c = 0; c < table.cols(); ++c, column += rows) tile.own_rows(column, table.col(c).data());
  }
  return out;
}

/// Where a joint's filtered columns have that of an inertial parameter.
Index place_of(const RigidChain& chain, std::size_t joint, int parameter) {
  const std::vector<Index>& felt = chain.felt_links(static_cast<Index>(joint));
  const auto at = std::lower_bound(felt.begin(), felt.end(), parameter / kLinkParameters) - felt.begin();
  return kLinkParameters * static_cast<Index>(at) + parameter % kLinkParameters;
}

/// Of columns that are kept: it is another when friction turns otherwise.
bool looks_at_direction(const TorqueTerm& term) {
  return term.needs_direction && !term.needs_torque && term.link_parameter < 0;
}

/// Order in which the columns of a table are summed: first those whose products with each other are known.
struct SumOrder {
  std::vector<Index> columns;  ///< the measured value last
  Index known = 0;
};

/// Normal equations of rows of a table, the measured value its last column. Known products are nought.
class TableSum {
 public:
  Gram of(const std::vector<double*>& table, const std::vector<Index>& rows, const SumOrder& order) {
    const auto columns = static_cast<int>(table.size());
    sums_.resize(std::max(sums_.size(), kernel::functions().gram_size(columns)), 0.0);
    places_.resize(static_cast<std::size_t>(columns));
    const std::vector<Index> rest = add_long_runs(table, rows, order);
    for (std::size_t done = 0; done < rest.size(); done += kTogether) {
      const Index some = std::min(kTogether, static_cast<Index>(rest.size() - done));
      copy(table, order, rest.data() + done, some);
      add(order, RigidChain::padded(some));
    }
    products_.setZero(columns, columns);
    kernel::functions().gram_reduce(sums_.data(), columns, static_cast<int>(order.known), products_.data());
    return in_place(order, static_cast<double>(rows.size()));
  }

 private:
  void add(const SumOrder& order, Index rows) {
    kernel::functions().gram_add_columns(places_.data(), static_cast<int>(places_.size()),
                                         static_cast<int>(order.known), static_cast<int>(rows), sums_.data());
  }

  /// Many rows that follow each other stay where they are. Returns the others.
  std::vector<Index> add_long_runs(const std::vector<double*>& table, const std::vector<Index>& rows,
                                   const SumOrder& order) {
    std::vector<Index> rest;
    find_runs(rows.data(), static_cast<Index>(rows.size()));
    for (const auto& [first, length] : runs_) {
      const Index whole = length < kLong ? 0 : length - length % kernel::kSampleMultiple;
      for (Index done = 0; done < whole; done += kTogether) {
        for (std::size_t c = 0; c < places_.size(); ++c) places_[c] = column(table, order, c) + first + done;
        add(order, std::min(kTogether, whole - done));
      }
      for (Index i = whole; i < length; ++i) rest.push_back(first + i);
    }
    return rest;
  }

  static const double* column(const std::vector<double*>& table, const SumOrder& order, std::size_t c) {
    return table[static_cast<std::size_t>(order.columns[c])];
  }

  /// Rows that follow each other are copied together.
  void copy(const std::vector<double*>& table, const SumOrder& order, const Index* rows, Index count) {
    rows_.resize(kTogether, std::max(rows_.cols(), static_cast<Index>(table.size())));
    find_runs(rows, count);
    for (std::size_t c = 0; c < places_.size(); ++c) {
      const double* const from = column(table, order, c);
      double* to = rows_.col(static_cast<Index>(c)).data();
      places_[c] = to;
      for (const auto& [first, length] : runs_) to = std::copy_n(from + first, length, to);
    }
    rows_.middleRows(count, RigidChain::padded(count) - count).setZero();
  }

  void find_runs(const Index* rows, Index count) {
    runs_.clear();
    for (Index i = 0; i < count; ++i) {
      if (i > 0 && rows[i] == rows[i - 1] + 1)
        ++runs_.back().second;
      else
        runs_.emplace_back(rows[i], 1);
    }
  }

  Gram in_place(const SumOrder& order, double count) const {
    const Index x = products_.cols() - 1;
    Gram out;
    out.xx.resize(x, x);
    for (Index b = 0; b < order.known; ++b) out.xx.col(order.columns[static_cast<std::size_t>(b)]).setZero();
    out.xy.resize(x);
    for (Index b = order.known; b < x; ++b) {
      const Index column = order.columns[static_cast<std::size_t>(b)];
      for (Index a = 0; a <= b; ++a) {
        const Index row = order.columns[static_cast<std::size_t>(a)];
        out.xx(row, column) = out.xx(column, row) = products_(a, b);
      }
    }
    for (Index a = 0; a < x; ++a) out.xy[order.columns[static_cast<std::size_t>(a)]] = products_(a, x);
    out.yy = products_(x, x);
    out.n = count;
    return out;
  }

  static constexpr Index kTogether = 256, kLong = 64;
  std::vector<const double*> places_;          ///< of the columns, in their order
  std::vector<std::pair<Index, Index>> runs_;  ///< first row, and how many
  MatrixXd rows_;
  std::vector<double> sums_;  ///< the kernel's own: nought between two calls
  MatrixXd products_;
};

/// Sums of one tile, by joint and fold.
using TileGrams = std::vector<std::vector<Gram>>;

bool is_of(Rows rows, const Tile& tile, Index row, Index joint) {
  switch (rows) {
    case Rows::fitted:
      return tile.moving(row, joint) != 0.0;
    case Rows::resting:
      return tile.moving(row, joint) == 0.0 && tile.inside(row, joint) != 0.0;
    case Rows::judged:
      return true;
  }
  return false;
}

std::vector<int> folds_of(const Tile& tile, const Folds& folds) {
  std::vector<int> out;
  for (const double time : tile.own_time()) out.push_back(folds.fold(tile.recording, time));
  return out;
}

/// Such rows of a tile, by fold: of these folds, and the torque was measured. `fold`: of every row.
std::vector<std::vector<Index>> rows_of(const Tile& tile, Index joint, const std::vector<int>& fold, int folds,
                                        Rows rows) {
  std::vector<std::vector<Index>> out(static_cast<std::size_t>(folds));
  for (Index i = 0; i < tile.count; ++i) {
    const int of = fold[static_cast<std::size_t>(i)];
    if (of >= 0 && is_of(rows, tile, i, joint) && !std::isnan(tile.measured(i, joint)))
      out[static_cast<std::size_t>(of)].push_back(i);
  }
  return out;
}

TileGrams grams_of(DesignColumns::Tables* columns, const Tile& tile, const MatrixXd& predicted, const Folds& folds,
                   const std::vector<SumOrder>& orders, Rows which) {
  thread_local TableSum sum;  // its room is large, and clearing pages takes long
  TileGrams out(columns->joints.size(), std::vector<Gram>(static_cast<std::size_t>(folds.count)));
  const std::vector<int> fold = folds_of(tile, folds);
  for (std::size_t j = 0; j < columns->joints.size(); ++j) {
    const auto joint = static_cast<Index>(j);
    DesignColumns::Table& table = columns->joints[j];
    if (table.rows() == 0) continue;
    table.own.rightCols(1) = tile.measured.col(joint) - predicted.col(joint);
    const std::vector<std::vector<Index>> rows = rows_of(tile, joint, fold, folds.count, which);
    for (std::size_t f = 0; f < rows.size(); ++f) {
      if (!rows[f].empty()) out[j][f] = sum.of(table.columns, rows[f], orders[j]);
    }
  }
  return out;
}

}  // namespace

DesignColumns::DesignColumns(const Tiles& tiles, const TorqueDesign& design, Resting resting)
    : DesignColumns(tiles, design, all_columns(design), resting) {
  constexpr double kMostKept = 400.0 * 1024 * 1024;  ///< [bytes]
  double numbers = 0.0;
  for (const std::vector<int>& mine : by_joint_) numbers += static_cast<double>(mine.size() + 1);
  const Index rows = tiles.kept_rows();
  if (rows >= 0 && sizeof(double) * numbers * static_cast<double>(rows) < kMostKept) kept_.resize(tiles.kept_tiles());
  stale_.resize(kept_.size(), 0);
}

DesignColumns::DesignColumns(const Tiles& tiles, const TorqueDesign& design, std::vector<int> columns, Resting resting)
    : tiles_(tiles),
      design_(design),
      resting_(resting),
      chain_(tiles.robot()),
      columns_(std::move(columns)),
      by_joint_(columns_by_joint(design, columns_, tiles.robot().driven_count())) {
  for (const int c : columns_) {
    const TorqueTerm& term = design.terms[static_cast<std::size_t>(c)];
    needs_torque_ = needs_torque_ || term.needs_torque;
  }
}

MatrixXd DesignColumns::Table::copied(Index more) const {
  MatrixXd out(rows(), own.cols() - 1 + more);
  for (Index c = 0; c + 1 < own.cols() && rows() > 0; ++c)
    std::copy_n(columns[static_cast<std::size_t>(c)], rows(), out.col(c).data());
  return out;
}

DesignColumns::Tables DesignColumns::empty_tables(const Tile& tile) const {
  Tables out{std::vector<Table>(by_joint_.size()), {}};
  for (std::size_t j = 0; j < by_joint_.size(); ++j) {
    const bool wanted = resting_ == Resting::made || tile.moving.col(static_cast<Index>(j)).any();
    Table& table = out.joints[j];
    table.own.resize(wanted ? tile.count : 0, static_cast<Index>(by_joint_[j].size()) + 1);
    for (Index c = 0; c < table.own.cols(); ++c) table.columns.push_back(table.own.col(c).data());
  }
  return out;
}

std::vector<MatrixXd>& DesignColumns::links_of(Tile* tile, Tables* tables) const {
  std::vector<MatrixXd>& place = tiles_.are_kept() ? tile->memory.links : tables->links;
  if (place.empty()) place = filtered_links(chain_, *tile);
  return place;
}

void DesignColumns::fill(Tile* tile, const std::function<bool(const TorqueTerm&, int)>& wanted, Tables* tables) const {
  const auto is_made = [&](const TorqueTerm& term, int column) {
    return wanted(term, column) && std::any_of(term.joints.begin(), term.joints.end(),
                                               [&](std::size_t j) { return tables->joints[j].rows() > 0; });
  };
  const auto any = [&](bool TorqueTerm::* needs) {
    return std::any_of(columns_.begin(), columns_.end(), [&](int c) {
      const TorqueTerm& term = design_.terms[static_cast<std::size_t>(c)];
      return term.link_parameter < 0 && term.*needs && is_made(term, c);
    });
  };
  if (any(&TorqueTerm::needs_rigid)) fill_rigid(&tile->motion);
  if (any(&TorqueTerm::needs_yielding))
    fill_yielding(&tile->motion, any(&TorqueTerm::needs_inertia));
  else if (any(&TorqueTerm::needs_inertia))
    fill_inertia(&tile->motion);
  std::vector<std::size_t> next(by_joint_.size(), 0);
  std::map<std::string, double*> made_already;  // by TorqueTerm::column
  for (const int c : columns_) {
    const TorqueTerm& term = design_.terms[static_cast<std::size_t>(c)];
    const bool of_link = term.link_parameter >= 0, now = is_made(term, c);
    const auto same = term.column.empty() ? made_already.end() : made_already.find(term.column);
    const bool is_there = of_link || same != made_already.end();
    const MatrixXd values = is_there || !now ? MatrixXd() : term.basis(tile->motion);
    for (std::size_t k = 0; k < term.joints.size(); ++k) {
      const std::size_t j = term.joints[k];
      const std::size_t place = next[j]++;
      Table& table = tables->joints[j];
      if (!now || table.rows() == 0) continue;
      double*& out = table.columns[place];
      if (is_there) {
        out = of_link ? links_of(tile, tables)[j].col(place_of(chain_, j, term.link_parameter)).data() : same->second;
        continue;
      }
      if (!term.column.empty()) made_already.try_emplace(term.column, out);
      if (values.rows() == 0)
        std::fill_n(out, table.rows(), 0.0);
      else
        tile->own_rows(values.col(static_cast<Index>(k)).data(), out);
    }
  }
  clear_tables(&tile->motion);
}

void DesignColumns::use(Tile* tile, bool with_torque, const std::function<void(Tables&)>& use,
                        const std::vector<bool>& idle) const {
  Tables made;
  Tables& tables = kept_.empty() ? made : kept_[tile->number];
  const bool fresh = tables.joints.empty();
  if (fresh) {
    tables = empty_tables(*tile);
    fill(tile, [](const TorqueTerm& term, int) { return !term.needs_torque; }, &tables);
  } else if (stale_[tile->number] != 0) {
    fill(tile, [](const TorqueTerm& term, int) { return looks_at_direction(term); }, &tables);
  }
  if (!kept_.empty()) stale_[tile->number] = 0;
  const auto stays = [&](int c) { return !fresh && !idle.empty() && idle[static_cast<std::size_t>(c)]; };
  if (with_torque && needs_torque_)
    fill(tile, [&](const TorqueTerm& term, int c) { return term.needs_torque && !stays(c); }, &tables);
  use(tables);
}

void DesignColumns::turned() { std::fill(stale_.begin(), stale_.end(), 1); }

namespace {

/// Columns of a joint that are as they were, then the others.
SumOrder order_of(const TorqueDesign& design, const std::vector<int>& columns, const EarlierSums& earlier, bool kept) {
  SumOrder out;
  std::vector<Index> others;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const TorqueTerm& term = design.terms[static_cast<std::size_t>(columns[k])];
    const bool stays = kept && !earlier.idle.empty() && earlier.idle[static_cast<std::size_t>(columns[k])];
    const bool known =
        !earlier.grams.empty() && (!term.needs_torque || stays) && !(earlier.turned && looks_at_direction(term));
    (known ? out.columns : others).push_back(static_cast<Index>(k));
  }
  out.known = static_cast<Index>(out.columns.size());
  others.push_back(static_cast<Index>(columns.size()));
  out.columns.insert(out.columns.end(), others.begin(), others.end());
  return out;
}

/// Most products are the earlier ones: those of the other columns take their places among these.
void add_known(const std::vector<Gram>& earlier, const SumOrder& order, std::vector<Gram>* folds) {
  const std::vector<Index> others(order.columns.begin() + order.known, order.columns.end() - 1);
  for (std::size_t f = 0; f < folds->size(); ++f) {
    MatrixXd& sum = (*folds)[f].xx;
    if (sum.size() == 0) continue;
    MatrixXd all = earlier[f].xx;
    for (const Index column : others) {
      all.col(column) = sum.col(column);
      all.row(column) = sum.col(column).transpose();
    }
    sum = std::move(all);
  }
}

/// Of no rows yet.
std::vector<JointGrams> no_sums(const DesignColumns& columns, const Folds& folds) {
  std::vector<JointGrams> out;
  for (std::size_t j = 0; j < columns.tiles().robot().driven_count(); ++j)
    out.emplace_back(columns.of_joint(j), columns.design().terms.size(), folds.count);
  return out;
}

/// What the tile held is gone.
void add_tile(TileGrams* tile, std::vector<JointGrams>* sums) {
  for (std::size_t j = 0; j < sums->size(); ++j) {
    for (std::size_t f = 0; f < (*tile)[j].size(); ++f) {
      Gram &sum = (*sums)[j].folds[f], &more = (*tile)[j][f];
      if (sum.xx.size() == 0)
        sum = std::move(more);
      else if (more.xx.size() > 0)
        sum.add(more);
    }
  }
  tile->clear();
}

}  // namespace

std::vector<TorqueGrams> sum_grams(const DesignColumns& columns, const TorqueModel& subtracted, const TorqueModel& seen,
                                   const Folds& folds, const EarlierSums& earlier, const std::vector<Rows>& rows) {
  std::vector<std::vector<JointGrams>> sums(rows.size(), no_sums(columns, folds));
  std::vector<SumOrder> orders;
  for (std::size_t j = 0; j < sums.front().size(); ++j)
    orders.push_back(order_of(columns.design(), columns.of_joint(j), earlier, columns.are_kept()));
  std::vector<std::vector<TileGrams>> lot(Tiles::kTogether, std::vector<TileGrams>(rows.size()));
  const auto work = [&](Tile& tile, std::size_t k) {
    const MatrixXd predicted = kept_torque(subtracted, &tile);
    if (columns.any_needs_torque())
      set_torque(seen, &tile);
    else
      set_direction(seen.turns(), &tile);
    const auto sum = [&](DesignColumns::Tables& tables) {
      for (std::size_t r = 0; r < rows.size(); ++r)
        lot[k][r] = grams_of(&tables, tile, predicted, folds, orders, rows[r]);
    };
    columns.use(&tile, true, sum, earlier.idle);
  };
  const auto add = [&](std::size_t k) {
    for (std::size_t r = 0; r < rows.size(); ++r) add_tile(&lot[k][r], &sums[r]);
  };
  columns.tiles().for_each([&](std::size_t r) { return folds.of_recording[r] >= 0; }, work, add);
  std::vector<TorqueGrams> out;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto complete = [&](std::size_t j) { add_known((*earlier.grams[r])[j].folds, orders[j], &sums[r][j].folds); };
    if (!earlier.grams.empty()) math::for_each_on_threads(orders.size(), columns.tiles().threads(), {}, complete, 1);
    out.push_back(std::make_shared<const std::vector<JointGrams>>(std::move(sums[r])));
  }
  return out;
}

std::vector<double> rms_of(const std::vector<TorqueGrams>& rows, const VectorXd& values) {
  constexpr double kExact = 1e-12;  // of the measured squares: less is rounding
  std::vector<double> out;
  for (std::size_t j = 0; j < rows.front()->size(); ++j) {
    const VectorXd own = values((*rows.front())[j].columns);
    double squares = 0.0, all = 0.0, n = 0.0;
    for (const TorqueGrams& grams : rows) {
      for (const Gram& gram : (*grams)[j].folds) {
        if (gram.xx.size() == 0) continue;
        squares += gram.yy - 2.0 * own.dot(gram.xy) + own.dot(gram.xx * own);
        all += gram.yy;
        n += gram.n;
      }
    }
    out.push_back(n < 2.0 ? 0.0 : std::sqrt(std::max(squares, kExact * all) / n));
  }
  return out;
}

namespace {

/// What the model and the columns times values leave, in the tile's own rows: shape=(count, joints). Where columns are
/// not kept, to make every one of them would take longer than to filter what they are together.
class ErrorsOf {
 public:
  ErrorsOf(const DesignColumns& columns, const TorqueModel& model, const VectorXd& values)
      : columns_(columns), model_(model), values_(values) {
    if (columns.are_kept()) return;
    std::vector<ValuedTerm> terms;
    for (std::size_t c = 0; c < columns.design().terms.size(); ++c) {
      const double value = values[static_cast<Index>(c)];
      if (value != 0.0) terms.push_back({columns.design().terms[c], value});
    }
    fitted_ = std::make_unique<TorqueModel>(model.with(terms));
    if (columns.any_needs_torque() || !model.robot().torque_effects.empty())
      fitted_ = std::make_unique<TorqueModel>(fitted_->seeing(model));
  }

  MatrixXd operator()(Tile* tile) const {
    if (fitted_) return tile->measured - own_torque(*fitted_, tile);
    set_direction(model_.turns(), tile);
    MatrixXd errors = tile->measured - kept_torque(model_, tile);
    columns_.use(tile, false, [&](const DesignColumns::Tables& tables) {
      for (std::size_t j = 0; j < tables.joints.size(); ++j) {
        const DesignColumns::Table& table = tables.joints[j];
        if (table.rows() == 0) continue;
        const std::vector<int>& of = columns_.of_joint(j);
        std::vector<const double*> places;
        std::vector<double> factors;
        for (std::size_t c = 0; c < of.size(); ++c) {
          if (values_[of[c]] == 0.0) continue;
          places.push_back(table.columns[c]);
          factors.push_back(-values_[of[c]]);
        }
        kernel::functions().add_columns(places.data(), factors.data(), static_cast<int>(places.size()),
                                        static_cast<int>(table.rows()), errors.col(static_cast<Index>(j)).data());
      }
    });
    return errors;
  }

 private:
  const DesignColumns& columns_;
  const TorqueModel& model_;
  const VectorXd& values_;
  std::unique_ptr<TorqueModel> fitted_;  ///< null: by the columns
};

}  // namespace

std::vector<Noise> noise_of(const DesignColumns& columns, const TorqueModel& model, const VectorXd& values,
                            const Folds& folds) {
  const ErrorsOf errors_of(columns, model, values);
  return noise_of(columns.tiles(), [&](Tile& tile) { return errors_of(&tile); }, folds);
}

}  // namespace truing::dynamics
