// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/design.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "dynamics/payload.hpp"
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
  std::function<VectorXd(const Motion&)> value;
  bool times_direction = false;
};

constexpr int kKnots = 8;

/// Straight lines between evenly spaced knots: hat number k.
double hat(double x, int k, double low, double high) {
  const double width = (high - low) / (kKnots - 1);
  const double at = std::clamp(x, low, high);
  return std::max(0.0, 1.0 - std::abs((at - low) / width - k));
}

void add_free(const FreeInput& input, std::size_t joint, const Robot& robot, double prior, TorqueDesign* design) {
  if (!(input.high > input.low)) return;
  TorqueGroup group;
  group.joints = {robot.joints[robot.driven_joints()[joint]].name};
  group.joint = static_cast<int>(joint);
  group.inputs = {input.name};
  group.low = input.low;
  group.high = input.high;
  if (input.times_direction) group.inputs.push_back("direction");
  for (int k = 0; k < kKnots; ++k) {
    TorqueTerm term;
    term.parameter = "free." + group.joints.front() + "." + input.name + (input.times_direction ? ".direction" : "") +
                     "." + std::to_string(k);
    term.unit = "Nm";
    term.joints = {joint};
    term.needs_torque = input.needs_torque;
    term.prior = prior;
    term.basis = [input, k, joint](const Motion& m) -> MatrixXd {
      const VectorXd x = input.value(m);
      MatrixXd out(x.size(), 1);
      for (Index i = 0; i < x.size(); ++i) {
        const double side = input.times_direction ? std::tanh(m.qd(i, static_cast<Index>(joint)) / kSpeedAtRest) : 1.0;
        out(i, 0) = side * hat(x[i], k, input.low, input.high);
      }
      return out;
    };
    group.columns.push_back(static_cast<int>(design->terms.size()));
    design->terms.push_back(std::move(term));
  }
  design->groups.push_back(std::move(group));
}

std::vector<FreeInput> inputs_at(std::size_t joint, const MotionRange& range) {
  const auto j = static_cast<Index>(joint);
  std::vector<FreeInput> out;
  const auto angle = [j](const Motion& m) -> VectorXd { return m.q.col(j); };
  const auto load = [j](const Motion& m) -> VectorXd { return m.torque.col(j); };
  const double torque = 2.0 * range.torque[j];
  out.push_back({"angle", range.lower[j], range.upper[j], false, angle});
  out.push_back(
      {"speed", -range.speed[j], range.speed[j], false, [j](const Motion& m) -> VectorXd { return m.qd.col(j); }});
  out.push_back({"load", -torque, torque, true, load});
  out.push_back({"angle", range.lower[j], range.upper[j], false, angle, true});
  out.push_back({"load", -torque, torque, true, load, true});
  if (range.duration >= 30.0)
    out.push_back({"time", 0.0, range.duration, false, [](const Motion& m) -> VectorXd { return m.time; }});
  for (const auto& [name, bounds] : range.columns) {
    if (name == "enabled" || is_of_payload(name) || !(bounds.second > bounds.first)) continue;
    out.push_back({name, bounds.first, bounds.second, false,
                   [name = name](const Motion& m) -> VectorXd { return m.columns.at(name); }});
  }
  return out;
}

// --- normal equations ----------------------------------------------------------------------------

/// Columns of the design that a joint's torque has.
std::vector<std::vector<int>> columns_by_joint(const TorqueDesign& design, std::size_t joints) {
  std::vector<std::vector<int>> out(joints);
  for (std::size_t c = 0; c < design.terms.size(); ++c) {
    for (const std::size_t j : design.terms[c].joints) out[j].push_back(static_cast<int>(c));
  }
  return out;
}

/// Filtered columns of every joint: shape=(count, columns of the joint) each.
std::vector<MatrixXd> filtered_columns(const Tile& tile, const TorqueDesign& design,
                                       const std::vector<std::vector<int>>& by_joint) {
  std::vector<MatrixXd> out;
  for (const std::vector<int>& columns : by_joint)
    out.emplace_back(tile.motion.rows(), static_cast<Index>(columns.size()));
  std::vector<Index> next(by_joint.size(), 0);
  for (const TorqueTerm& term : design.terms) {
    const MatrixXd values = term.basis(tile.motion);
    for (std::size_t k = 0; k < term.joints.size(); ++k) {
      const std::size_t j = term.joints[k];
      out[j].col(next[j]++) = values.col(static_cast<Index>(k));
    }
  }
  for (MatrixXd& columns : out) columns = tile.own_rows(columns);
  return out;
}

/// Sums of one recording.
class RecordingGrams {
 public:
  RecordingGrams(const TorqueDesign& design, const TorqueModel& subtracted, const TorqueModel& seen, const Folds& folds,
                 const std::vector<std::vector<int>>& by_joint)
      : design_(design), subtracted_(subtracted), seen_(seen), folds_(folds), by_joint_(by_joint) {
    for (const std::vector<int>& columns : by_joint_)
      sums_.emplace_back(static_cast<std::size_t>(folds.count), GramSum(static_cast<Index>(columns.size())));
  }

  void add(Tile* tile) {
    const MatrixXd predicted = tile->own_rows(subtracted_.torque(&tile->motion));
    seen_.torque(&tile->motion);
    const VectorXd time = tile->own_time();
    const std::vector<MatrixXd> columns = filtered_columns(*tile, design_, by_joint_);
    for (std::size_t j = 0; j < columns.size(); ++j) {
      const auto col = static_cast<Index>(j);
      for (Index i = 0; i < tile->count; ++i) {
        if (tile->moving(i, col) == 0.0 || std::isnan(tile->measured(i, col))) continue;
        const int fold = folds_.fold(tile->recording, time[i]);
        if (fold < 0) continue;
        GramSum& sum = sums_[j][static_cast<std::size_t>(fold)];
        double* row = sum.row();
        const Index p = columns[j].cols();
        for (Index c = 0; c < p; ++c) row[c * GramSum::stride()] = columns[j](i, c);
        row[p * GramSum::stride()] = tile->measured(i, col) - predicted(i, col);
        sum.push();
      }
    }
  }

  /// Adds to `all`.
  void finish(std::vector<JointGrams>* all) {
    for (std::size_t j = 0; j < sums_.size(); ++j) {
      for (std::size_t f = 0; f < sums_[j].size(); ++f) (*all)[j].folds[f].add(sums_[j][f].finish());
    }
  }

 private:
  const TorqueDesign& design_;
  const TorqueModel &subtracted_, &seen_;
  const Folds& folds_;
  const std::vector<std::vector<int>>& by_joint_;
  std::vector<std::vector<GramSum>> sums_;
};

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

void add_free_functions(const Robot& robot, const MotionRange& range, TorqueDesign* design) {
  for (std::size_t j = 0; j < robot.driven_count(); ++j) {
    const double prior = 0.3 * std::max(range.torque[static_cast<Index>(j)], 1e-3);
    for (const FreeInput& input : inputs_at(j, range)) add_free(input, j, robot, prior, design);
  }
}

int Folds::fold(std::size_t recording, double time) const {
  const int of = of_recording[recording];
  if (of < 0 || of_block.empty()) return of;
  const auto last = static_cast<int>(of_block.size()) - 1;
  return of_block[static_cast<std::size_t>(std::clamp(static_cast<int>(time / block_length), 0, last))];
}

std::vector<JointGrams> sum_grams(const Data& data, const TorqueDesign& design, const TorqueModel& subtracted,
                                  const TorqueModel& seen, const Folds& folds) {
  const RigidChain chain(data.robot);
  const auto by_joint = columns_by_joint(design, data.robot.driven_count());
  std::vector<JointGrams> out;
  for (const std::vector<int>& columns : by_joint)
    out.push_back({columns, std::vector<Gram>(static_cast<std::size_t>(folds.count))});
  // Recordings side by side, and added up in their order.
  std::vector<std::unique_ptr<RecordingGrams>> parts(data.recordings.size());
  for_each_recording(data, folds, [&](std::size_t r) {
    parts[r] = std::make_unique<RecordingGrams>(design, subtracted, seen, folds, by_joint);
    for_each_tile(data.recordings[r], r, data.robot, chain, data.prepare, [&](Tile& tile) { parts[r]->add(&tile); });
  });
  for (const auto& part : parts) {
    if (part) part->finish(&out);
  }
  return out;
}

void for_each_recording(const Data& data, const Folds& folds, const std::function<void(std::size_t)>& work) {
  const auto one = [&](std::size_t r) {
    if (folds.of_recording[r] >= 0) work(r);
  };
  for_each_on_threads(data.recordings.size(), data.threads, {}, one, 1);
}

namespace {

/// Sums over the errors of one recording, joint by joint.
struct ErrorSums {
  static constexpr Index kLags = 80;
  explicit ErrorSums(std::size_t joints, int folds)
      : products(joints, VectorXd::Zero(kLags)),
        pairs(joints, VectorXd::Zero(kLags)),
        squares(joints, VectorXd::Zero(folds)),
        rows(joints, VectorXd::Zero(folds)) {}

  void add(const Tile& tile, const MatrixXd& errors, const Folds& folds) {
    const VectorXd time = tile.own_time();
    for (std::size_t j = 0; j < products.size(); ++j) {
      const auto col = static_cast<Index>(j);
      for (Index i = 0; i < tile.count; ++i) {
        const int fold = folds.fold(tile.recording, time[i]);
        const double e = errors(i, col);
        if (fold < 0 || tile.moving(i, col) == 0.0 || std::isnan(e)) continue;
        squares[j][fold] += e * e;
        rows[j][fold] += 1.0;
        for (Index lag = 0; lag < std::min(kLags, tile.count - i); ++lag) {
          if (tile.moving(i + lag, col) == 0.0) break;
          products[j][lag] += e * errors(i + lag, col);
          pairs[j][lag] += 1.0;
        }
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

std::vector<Noise> noise_of(const Data& data, const TorqueModel& model, const Folds& folds) {
  const std::size_t joints = data.robot.driven_count();
  const RigidChain chain(data.robot);
  std::vector<std::unique_ptr<ErrorSums>> parts(data.recordings.size());
  for_each_recording(data, folds, [&](std::size_t r) {
    parts[r] = std::make_unique<ErrorSums>(joints, folds.count);
    for_each_tile(data.recordings[r], r, data.robot, chain, data.prepare, [&](Tile& tile) {
      parts[r]->add(tile, tile.measured - tile.own_rows(model.torque(&tile.motion)), folds);
    });
  });
  ErrorSums all(joints, folds.count);
  for (const auto& part : parts) {
    if (part) all.add(*part);
  }
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

std::vector<Gram> weighted(const std::vector<JointGrams>& grams, const std::vector<Noise>& noise, std::size_t columns) {
  const auto p = static_cast<Index>(columns);
  std::vector<Gram> out;
  for (std::size_t f = 0; f < grams.front().folds.size(); ++f) {
    Gram sum{MatrixXd::Zero(p, p), VectorXd::Zero(p), 0.0, 0.0};
    for (std::size_t j = 0; j < grams.size(); ++j) {
      const Gram& gram = grams[j].folds[f];
      if (gram.xx.size() == 0) continue;
      const double usual = noise[j].weight_of_fold.size() > 0 ? noise[j].weight_of_fold[static_cast<Index>(f)] : 1.0;
      const double rows = usual / noise[j].design_effect, weight = rows / (noise[j].sigma * noise[j].sigma);
      const std::vector<int>& at = grams[j].columns;
      for (std::size_t a = 0; a < at.size(); ++a) {
        for (std::size_t b = 0; b < at.size(); ++b)
          sum.xx(at[b], at[a]) += weight * gram.xx(static_cast<Index>(b), static_cast<Index>(a));
        sum.xy[at[a]] += weight * gram.xy[static_cast<Index>(a)];
      }
      sum.yy += weight * gram.yy;
      sum.n += rows * gram.n;
    }
    out.push_back(std::move(sum));
  }
  return out;
}

}  // namespace truing::dynamics
