// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/design.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "dynamics/effects/families.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/turn.hpp"
#include "math/batch.hpp"
#include "math/statistics.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<std::string> joints_of(const TorqueForm& form, bool per_joint, const Robot& robot, std::size_t joint) {
  std::vector<std::string> out;
  if (!per_joint) return out;
  out.push_back(robot.joints[robot.driven_joints()[joint]].name);
  // A second joint stands in the parameter's name: "coupling.J5.J6.viscous".
  for (const std::size_t other : robot.driven_joints()) {
    const std::string& name = robot.joints[other].name;
    if (name != out.front() && form.front().parameter.find("." + name + ".") != std::string::npos) out.push_back(name);
  }
  return out;
}

void add_at(const TorqueEffect& effect, std::size_t joint, const Robot& robot, const MotionRange& range,
            TorqueDesign* design) {
  const std::vector<TorqueForm> forms = effect.forms(robot, joint, range);
  for (const TorqueForm& form : forms) {
    TorqueGroup group;
    group.effect = effect.name;
    group.joints = joints_of(form, effect.per_joint, robot, joint);
    group.joint = effect.per_joint && form.front().joints.size() == 1 ? static_cast<int>(joint) : -1;
    group.standard = effect.traits.standard;
    group.family = effect.traits.family;
    group.forms = static_cast<int>(forms.size());
    for (const TorqueTerm& term : form) {
      group.columns.push_back(static_cast<int>(design->terms.size()));
      design->terms.push_back(term);
    }
    design->groups.push_back(std::move(group));
  }
}

// --- free functions ------------------------------------------------------------------------------

/// An input of a free function, and how far it goes.
struct FreeInput {
  std::string name;
  double low, high;
  bool needs_torque;
  std::function<Eigen::Ref<const VectorXd>(const Motion&)> value;
  bool times_direction = false;
  bool narrow = false;  ///< what it drives may be narrow: a detent, a resonance, some seconds
  std::string same{};   ///< the same at all joints that have an input of this name
};

constexpr int kKnots = 8;
constexpr int kNarrowKnots = 3 * (kKnots - 1) + 1;  ///< the wide ones among them

/// Straight lines between evenly spaced knots: hat number k; beyond the ends it stays as it is there.
MatrixXd hat(const Eigen::Ref<const VectorXd>& x, int k, int knots, double low, double high) {
  const auto from_knot = (x.array() - low) * ((knots - 1) / (high - low)) - k;
  if (k == 0) return (1.0 - from_knot.max(0.0)).max(0.0);
  if (k == knots - 1) return (1.0 + from_knot.min(0.0)).max(0.0);
  return (1.0 - from_knot.abs()).max(0.0);
}

void add_free(const FreeInput& input, std::size_t joint, const Robot& robot, int knots, double prior,
              TorqueDesign* design) {
  if (!(input.high > input.low)) return;
  TorqueGroup group;
  group.joints = {robot.joints[robot.driven_joints()[joint]].name};
  group.joint = static_cast<int>(joint);
  group.inputs = {input.name};
  group.low = input.low;
  group.high = input.high;
  if (input.times_direction) group.inputs.push_back("direction");
  for (int k = 0; k < knots; ++k) {
    TorqueTerm term;
    term.parameter = "free." + group.joints.front() + "." + input.name + (input.times_direction ? ".direction" : "") +
                     "." + std::to_string(k) + "." + std::to_string(knots);
    term.unit = "Nm";
    term.joints = {joint};
    term.needs_torque = input.needs_torque;
    term.needs_rigid = false;
    term.needs_direction = input.times_direction;
    if (!input.same.empty()) term.column = input.same + "." + std::to_string(k) + "." + std::to_string(knots);
    term.prior = prior;
    term.basis = [input, k, knots, joint](const Motion& m) -> MatrixXd {
      MatrixXd out = hat(input.value(m), k, knots, input.low, input.high);
      if (input.times_direction) out.array() *= m.direction.col(static_cast<Index>(joint)).array();
      return out;
    };
    group.columns.push_back(static_cast<int>(design->terms.size()));
    design->terms.push_back(std::move(term));
  }
  design->groups.push_back(std::move(group));
}

constexpr int kPlays = 6;  ///< stop operators, up to 1.5 standard deviations of the torque

/// Hysteresis of the load as a sum of stop operators (Prandtl 1928; Ishlinskii 1944): a frame, or a gear, that gives
/// way and stays. Its curve is the weight of every width.
/// The load is that of the links: a frame behind the gear does not feel its friction, which is most of the torque at a
/// wrist, and whose turn would look like a memory.
void add_memory(std::size_t joint, const Robot& robot, double torque, double prior, TorqueDesign* design) {
  TorqueGroup group;
  group.joints = {robot.joints[robot.driven_joints()[joint]].name};
  group.joint = static_cast<int>(joint);
  group.inputs = {"load", "its past"};
  const double width = 1.5 * torque / kPlays;
  if (!(width > 0.0)) return;
  for (int k = 1; k <= kPlays; ++k) {
    TorqueTerm term;
    term.parameter = "free." + group.joints.front() + ".load.past." + std::to_string(k);
    term.unit = "Nm";
    term.joints = {joint};
    term.needs_rigid = term.needs_direction = false;
    term.prior = prior;
    term.basis = [joint, x0 = k * width](const Motion& m) -> MatrixXd {
      return stop_operator(m.links.col(static_cast<Index>(joint)), x0);
    };
    group.columns.push_back(static_cast<int>(design->terms.size()));
    design->terms.push_back(std::move(term));
  }
  design->groups.push_back(std::move(group));
}

constexpr double kShortest = 5.0;  ///< [s] recordings in which time is an input

std::vector<FreeInput> inputs_at(std::size_t joint, const Robot& robot, const MotionRange& range) {
  const auto j = static_cast<Index>(joint);
  std::vector<FreeInput> out;
  const auto load = [j](const Motion& m) -> Eigen::Ref<const VectorXd> { return m.torque.col(j); };
  const double torque = 2.0 * range.torque[j];
  for (Index k = 0; k < range.lower.size(); ++k) {
    const std::string name = k == j ? "angle" : "angle " + driven_name(robot, static_cast<std::size_t>(k));
    for (const bool times_direction : {false, true})
      out.push_back({name, range.lower[k], range.upper[k], false,
                     [k](const Motion& m) -> Eigen::Ref<const VectorXd> { return m.q.col(k); }, times_direction, k == j,
                     times_direction ? "" : "angle " + std::to_string(k)});
  }
  out.push_back({"speed", -range.speed[j], range.speed[j], false,
                 [j](const Motion& m) -> Eigen::Ref<const VectorXd> { return m.qd.col(j); }, false, true});
  out.push_back({"load", -torque, torque, true, load});
  out.push_back({"load", -torque, torque, true, load, true});
  if (range.duration >= kShortest)
    out.push_back({"time", 0.0, range.duration, false,
                   [](const Motion& m) -> Eigen::Ref<const VectorXd> { return m.time; }, false, true, "time"});
  for (const auto& [name, bounds] : range.columns) {
    if (name == "enabled" || is_of_payload(name) || !(bounds.second > bounds.first)) continue;
    out.push_back({name, bounds.first, bounds.second, false,
                   [name = name](const Motion& m) -> Eigen::Ref<const VectorXd> { return m.columns.at(name); }, false,
                   false, "column " + name});
  }
  return out;
}

}  // namespace

void add_effect(const TorqueEffect& effect, int joint, const Robot& robot, const MotionRange& range,
                TorqueDesign* design) {
  if (!effect.per_joint) return add_at(effect, 0, robot, range, design);
  if (joint >= 0) return add_at(effect, static_cast<std::size_t>(joint), robot, range, design);
  for (std::size_t j = 0; j < robot.driven_count(); ++j) add_at(effect, j, robot, range, design);
}

TorqueDesign design_of(const Robot& robot, const MotionRange& range, const std::vector<TorqueEffect>& own,
                       const std::set<std::string>& leave_out, bool fits_masses) {
  TorqueDesign out;
  const auto try_at = [&](const TorqueEffect& effect, std::size_t joint) {
    const std::string name = robot.joints[robot.driven_joints()[joint]].name;
    const std::vector<std::string> where =
        effect.per_joint ? std::vector<std::string>{name} : std::vector<std::string>{};
    try {
      add_at(effect, joint, robot, range, &out);
    } catch (const MissingColumn& error) {
      out.not_testable.push_back({effect.name, where, error.what(), Untestable::column_missing});
    } catch (const Unsuited& error) {
      out.not_testable.push_back({effect.name, where, error.what(), Untestable::other});
    }
  };
  for (const auto* effects : {&torque_catalogue(), &own}) {
    for (const TorqueEffect& effect : *effects) {
      if (leave_out.count(effect.name) > 0) continue;
      if (fits_masses && effect.traits.scales_masses && !payload_varies(range)) {
        out.not_testable.push_back(
            {effect.name,
             {},
             "the same as all masses times a factor: needs a known payload (column payload_kg) that differs between "
             "recordings",
             Untestable::same_as_masses});
        continue;
      }
      const std::size_t times = effect.per_joint ? robot.driven_count() : 1;
      for (std::size_t j = 0; j < times; ++j) try_at(effect, j);
    }
  }
  return out;
}

namespace {

/// The constants of all drives off by one factor: what all masses together look like.
TorqueGroup common_constant(const std::string& effect, const Robot& robot, TorqueDesign* design) {
  TorqueGroup group;
  group.effect = effect;
  group.family = TorqueFamily::drive;
  TorqueTerm term;
  term.parameter = effect + ".all";
  term.unit = "-";
  term.prior = 0.2;
  term.needs_torque = true;
  term.needs_rigid = false;
  for (std::size_t j = 0; j < robot.driven_count(); ++j) {
    group.joints.push_back(driven_name(robot, j));
    term.joints.push_back(j);
  }
  term.basis = [](const Motion& m) -> MatrixXd { return m.torque; };
  group.columns = {static_cast<int>(design->terms.size())};
  design->terms.push_back(std::move(term));
  return group;
}

}  // namespace

void add_alternatives_of_masses(const Robot& robot, const MotionRange& range, const std::vector<TorqueEffect>& own,
                                TorqueDesign* design) {
  const std::size_t before = design->terms.size();
  for (const NotTestable& one : design->not_testable) {
    if (one.reason != Untestable::same_as_masses) continue;
    const std::size_t first = design->groups.size();
    add_effect(find_torque_effect(one.effect, own), -1, robot, range, design);
    if (robot.driven_count() < 2) continue;  // else one drive's constant is not the same as all masses
    for (std::size_t g = first; g < design->groups.size(); ++g) design->groups[g].of_given_masses = true;
    design->groups.push_back(common_constant(one.effect, robot, design));
  }
  for (std::size_t c = before; c < design->terms.size(); ++c) design->terms[c].only_alternative = true;
}

void add_free_functions(const Robot& robot, const MotionRange& range, TorqueDesign* design) {
  for (std::size_t j = 0; j < robot.driven_count(); ++j) {
    const double prior = 0.3 * std::max(range.torque[static_cast<Index>(j)], 1e-3);
    for (const FreeInput& input : inputs_at(j, robot, range)) {
      add_free(input, j, robot, kKnots, prior, design);
      if (input.narrow) add_free(input, j, robot, kNarrowKnots, prior, design);
    }
    add_memory(j, robot, range.torque[static_cast<Index>(j)], prior, design);
  }
}

int Folds::fold(std::size_t recording, double time) const {
  const int of = of_recording[recording];
  if (of < 0 || of_block.empty()) return of;
  const auto last = static_cast<int>(of_block.size()) - 1;
  return of_block[static_cast<std::size_t>(std::clamp(static_cast<int>(time / block_length), 0, last))];
}

void fill_rigid(Motion* motion) {
  motion->rigid = regressor_columns(RigidChain(*motion->robot), motion->q, motion->qd, motion->qdd);
}

namespace {

MatrixXd torque_along(const TorqueModel& model, Tile* tile) {
  if (model.needs_rigid()) fill_rigid(&tile->motion);
  set_direction(model.turns(), tile);
  MatrixXd out = model.torque_by_direction(&tile->motion, &tile->memory.known);
  clear_tables(&tile->motion);
  return out;
}

}  // namespace

void set_direction(const std::vector<FrictionTurn>& turns, Tile* tile) {
  Motion& motion = tile->motion;
  if (same(tile->memory.turns, turns)) return;
  tile->memory.turns = turns;
  motion.direction.resize(motion.q.rows(), motion.q.cols());
  for (Index j = 0; j < motion.q.cols(); ++j) {
    const FrictionTurn& turn = turns[static_cast<std::size_t>(j)];
    const auto [at, fresh] = tile->memory.directions.try_emplace({j, turn.speed, turn.travel, turn.fade});
    if (fresh) at->second = direction_of(motion, j, turn);
    motion.direction.col(j) = at->second;
  }
}

const MatrixXd& kept_torque(const TorqueModel& model, Tile* tile) {
  if (tile->memory.model != model.number()) {
    tile->memory.torque = own_torque(model, tile);
    tile->memory.model = model.number();
  }
  return tile->memory.torque;
}

MatrixXd own_torque(const TorqueModel& model, Tile* tile) { return tile->own_rows(torque_along(model, tile)); }

void set_torque(const TorqueModel& model, Tile* tile) { torque_along(model, tile); }

namespace {

/// Sums over errors, joint by joint.
struct ErrorSums {
  static constexpr Index kLags = 80;
  ErrorSums() = default;
  ErrorSums(std::size_t joints, int folds)
      : products(joints, VectorXd::Zero(kLags)),
        pairs(joints, VectorXd::Zero(kLags)),
        squares(joints, VectorXd::Zero(folds)),
        rows(joints, VectorXd::Zero(folds)) {}

  void add(const Tile& tile, const MatrixXd& errors, const Folds& folds) {
    const VectorXd time = tile.own_time();
    std::vector<int> fold(static_cast<std::size_t>(tile.count));
    for (Index i = 0; i < tile.count; ++i) fold[static_cast<std::size_t>(i)] = folds.fold(tile.recording, time[i]);
    for (std::size_t j = 0; j < products.size(); ++j) {
      const auto col = static_cast<Index>(j);
      for (Index i = 0; i < tile.count;) {
        if (tile.moving(i, col) == 0.0 || std::isnan(errors(i, col))) {
          ++i;
          continue;
        }
        Index end = i;
        while (end < tile.count && tile.moving(end, col) != 0.0) ++end;
        while (i < end) i = add_run(j, errors.col(col), fold, i, end);
      }
    }
  }
  void add(const ErrorSums& other) {
    for (std::size_t j = 0; j < products.size(); ++j) {
      products[j] += other.products[j];
      pairs[j] += other.pairs[j];
      squares[j] += other.squares[j];
      rows[j] += other.rows[j];
    }
  }

  std::vector<VectorXd> products, pairs;  ///< by lag
  std::vector<VectorXd> squares, rows;    ///< by fold

 private:
  /// Rows from `begin` on that are of one fold, of a joint that moves up to `end`; returns the first of another fold.
  Index add_run(std::size_t j, const Eigen::Ref<const VectorXd>& errors, const std::vector<int>& fold, Index begin,
                Index end) {
    const int of = fold[static_cast<std::size_t>(begin)];
    Index next = begin;
    while (next < end && fold[static_cast<std::size_t>(next)] == of) ++next;
    if (of < 0) return next;
    squares[j][of] += errors.segment(begin, next - begin).squaredNorm();
    rows[j][of] += static_cast<double>(next - begin);
    for (Index lag = 0; lag < std::min(kLags, end - begin); ++lag) {
      const Index count = std::min(next, end - lag) - begin;
      products[j][lag] += errors.segment(begin, count).dot(errors.segment(begin + lag, count));
      pairs[j][lag] += static_cast<double>(count);
    }
    return next;
  }
};

/// A fold whose errors are far beyond those of the others (more than twice the median) counts for less.
VectorXd weights_of_folds(const VectorXd& squares, const VectorXd& rows) {
  constexpr double kUsual = 2.0;
  std::vector<double> sizes;
  for (Index f = 0; f < rows.size(); ++f) {
    if (rows[f] > 0.0) sizes.push_back(std::sqrt(squares[f] / rows[f]));
  }
  const double usual = kUsual * median_of(sizes);
  VectorXd out = VectorXd::Ones(rows.size());
  for (Index f = 0; f < rows.size(); ++f) {
    const double size = rows[f] > 0.0 ? std::sqrt(squares[f] / rows[f]) : 0.0;
    if (size > usual) out[f] = std::pow(usual / size, 2.0);
  }
  return out;
}

}  // namespace

std::vector<Noise> noise_of(const Tiles& tiles, const TorqueModel& model, const Folds& folds) {
  return noise_of(tiles, [&](Tile& tile) -> MatrixXd { return tile.measured - own_torque(model, &tile); }, folds);
}

std::vector<Noise> noise_of(const Tiles& tiles, const std::function<MatrixXd(Tile&)>& errors, const Folds& folds) {
  const std::size_t joints = tiles.robot().driven_count();
  std::vector<ErrorSums> lot(Tiles::kTogether);
  ErrorSums all(joints, folds.count);
  tiles.for_each([&](std::size_t r) { return folds.of_recording[r] >= 0; },
                 [&](Tile& tile, std::size_t k) {
                   lot[k] = ErrorSums(joints, folds.count);
                   lot[k].add(tile, errors(tile), folds);
                 },
                 [&](std::size_t k) { all.add(lot[k]); });
  std::vector<Noise> out(joints);
  for (std::size_t j = 0; j < joints; ++j) {
    out[j].weight_of_fold = weights_of_folds(all.squares[j], all.rows[j]);
    out[j].rows = all.rows[j].sum();
    if (!(all.products[j][0] > 0.0)) continue;
    const double weight = out[j].weight_of_fold.dot(all.rows[j]);
    out[j].sigma = std::sqrt(out[j].weight_of_fold.dot(all.squares[j]) / weight);
    const double variance = all.products[j][0] / all.pairs[j][0];
    for (Index lag = 1; lag < ErrorSums::kLags && all.pairs[j][lag] > 0.0; ++lag) {
      const double correlation = all.products[j][lag] / all.pairs[j][lag] / variance;
      if (correlation < 0.05) break;  // initial positive sequence (Geyer 1992)
      out[j].design_effect += 2.0 * correlation;
    }
  }
  return out;
}

TorqueDesign part_of(const TorqueDesign& whole, const std::vector<int>& groups) {
  TorqueDesign out;
  for (const int g : groups) {
    TorqueGroup group = whole.groups[static_cast<std::size_t>(g)];
    for (int& column : group.columns) {
      out.terms.push_back(whole.terms[static_cast<std::size_t>(column)]);
      column = static_cast<int>(out.terms.size()) - 1;
    }
    out.groups.push_back(std::move(group));
  }
  return out;
}

namespace {

double rows_counted(const Noise& noise, std::size_t fold) {
  const double usual = noise.weight_of_fold.size() > 0 ? noise.weight_of_fold[static_cast<Index>(fold)] : 1.0;
  return usual / noise.design_effect;
}

Index place_of(const JointGrams& grams, int column) { return grams.places[static_cast<std::size_t>(column)]; }

}  // namespace

JointGrams::JointGrams(std::vector<int> of_joint, std::size_t of_design, int count)
    : columns(std::move(of_joint)), places(of_design, -1), folds(static_cast<std::size_t>(count)) {
  for (std::size_t k = 0; k < columns.size(); ++k) places[static_cast<std::size_t>(columns[k])] = static_cast<Index>(k);
}

FoldGram::FoldGram(TorqueGrams grams, std::size_t fold, const std::vector<Noise>& noise)
    : grams_(std::move(grams)), fold_(fold) {
  for (std::size_t j = 0; j < grams_->size(); ++j) {
    const Gram& gram = (*grams_)[j].folds[fold];
    const double rows = rows_counted(noise[j], fold);
    weights_.push_back(rows / (noise[j].sigma * noise[j].sigma));
    design_effects_.push_back(noise[j].design_effect);
    yy_ += weights_[j] * gram.yy;
    n_ += rows * gram.n;
  }
}

VectorXd FoldGram::products(const std::vector<int>& columns, int with) const {
  VectorXd out = VectorXd::Zero(static_cast<Index>(columns.size()));
  for (std::size_t j = 0; j < grams_->size(); ++j) {
    const Gram& gram = (*grams_)[j].folds[fold_];
    const Index at = place_of((*grams_)[j], with);
    if (gram.xx.size() == 0 || at < 0) continue;
    for (Index k = 0; k < out.size(); ++k) {
      const Index row = place_of((*grams_)[j], columns[static_cast<std::size_t>(k)]);
      if (row >= 0) out[k] += weights_[j] * gram.xx(row, at);
    }
  }
  return out;
}

double FoldGram::product(int one, int other) const {
  double out = 0.0;
  for (std::size_t j = 0; j < grams_->size(); ++j) {
    const Gram& gram = (*grams_)[j].folds[fold_];
    const Index row = place_of((*grams_)[j], one), at = place_of((*grams_)[j], other);
    if (gram.xx.size() > 0 && row >= 0 && at >= 0) out += weights_[j] * gram.xx(row, at);
  }
  return out;
}

double FoldGram::product(int column) const {
  double out = 0.0;
  for (std::size_t j = 0; j < grams_->size(); ++j) {
    const Gram& gram = (*grams_)[j].folds[fold_];
    const Index at = place_of((*grams_)[j], column);
    if (gram.xx.size() > 0 && at >= 0) out += weights_[j] * gram.xy[at];
  }
  return out;
}

Gram FoldGram::of(const std::vector<int>& columns) const {
  const auto p = static_cast<Index>(columns.size());
  Gram out{MatrixXd::Zero(p, p), VectorXd::Zero(p), yy_, n_};
  std::vector<std::pair<Index, Index>> at;  // which of the columns, and where it stands in the joint's
  for (std::size_t j = 0; j < grams_->size(); ++j) {
    const Gram& gram = (*grams_)[j].folds[fold_];
    if (gram.xx.size() == 0) continue;
    at.clear();
    for (Index k = 0; k < p; ++k) {
      const Index place = place_of((*grams_)[j], columns[static_cast<std::size_t>(k)]);
      if (place >= 0) at.emplace_back(k, place);
    }
    for (const auto& [a, from] : at) {
      const double* const column = gram.xx.col(from).data();
      double* const to = out.xx.col(a).data();
      for (const auto& [b, row] : at) to[b] += weights_[j] * column[row];
      out.xy[a] += weights_[j] * gram.xy[from];
    }
  }
  return out;
}

Gram sum_of_folds(const JointGrams& grams, const Noise& noise) {
  Gram out;
  for (std::size_t f = 0; f < grams.folds.size(); ++f) {
    const Gram& gram = grams.folds[f];
    if (gram.xx.size() == 0) continue;
    const double rows = rows_counted(noise, f), n = out.n;
    out.add(gram, rows / (noise.sigma * noise.sigma));
    out.n = n + rows * gram.n;
  }
  return out;
}

Gram sum_of_folds(const std::vector<JointGrams>& grams, const std::vector<Noise>& noise, std::size_t columns,
                  int threads) {
  const auto p = static_cast<Index>(columns);
  std::vector<Gram> joints(grams.size());
  math::for_each_on_threads(
      grams.size(), threads, {}, [&](std::size_t j) { joints[j] = sum_of_folds(grams[j], noise[j]); }, 1);
  Gram out{MatrixXd::Zero(p, p), VectorXd::Zero(p), 0.0, 0.0};
  for (std::size_t j = 0; j < grams.size(); ++j) {
    const Gram& sum = joints[j];
    out.n += sum.n;
    if (sum.xx.size() == 0) continue;
    const std::vector<int>& at = grams[j].columns;
    for (std::size_t a = 0; a < at.size(); ++a) {
      const double* const column = sum.xx.col(static_cast<Index>(a)).data();
      double* const to = out.xx.col(at[a]).data();
      for (std::size_t b = 0; b < at.size(); ++b) to[at[b]] += column[b];
      out.xy[at[a]] += sum.xy[static_cast<Index>(a)];
    }
    out.yy += sum.yy;
  }
  return out;
}

}  // namespace truing::dynamics
