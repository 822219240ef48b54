// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Of few poses: the robot found, averaged with wrong links alone.

#include <algorithm>
#include <cmath>

#include "diagnosis/diagnosis.hpp"
#include "model/model.hpp"

namespace truing::diagnosis {
namespace {

/// From one frame (0) to another (1).
Eigen::Isometry3d frame_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to, double part) {
  Eigen::Isometry3d out;
  out.translation() = (1.0 - part) * from.translation() + part * to.translation();
  out.linear() =
      Eigen::Quaterniond(from.linear()).slerp(part, Eigen::Quaterniond(to.linear())).normalized().toRotationMatrix();
  return out;
}

/// From one robot (0) to another (1), that may have effects which the first has not: every value moves on a straight
/// line, as its motion of the tip does where errors are small.
Robot robot_between(const Robot& from, const Robot& to, const Registered& given, double part) {
  const auto model_of = [&](const Robot& robot) {
    return model::make_model(robot, given.data, {}, given.options.own_effects);
  };
  const model::Model start = model_of(from), end = model_of(to);
  const Eigen::VectorXd at_start = model::initial_values(start), at_end = model::initial_values(end);
  Eigen::VectorXd values = part * at_end;
  for (std::size_t k = 0; k < end.parameters.size(); ++k) {
    const int same = start.parameter_index(end.parameters[k].name);
    if (same >= 0) values[static_cast<Eigen::Index>(k)] += (1.0 - part) * at_start[same];
  }
  Robot out = model::robot_with(end, values);
  out.T_measurement_base = frame_between(from.T_measurement_base, to.T_measurement_base, part);
  for (std::size_t k = 0; k < out.targets.size(); ++k)
    out.targets[k].T_last_target = frame_between(from.targets[k].T_last_target, to.targets[k].T_last_target, part);
  for (std::size_t k = 0; k < out.joints.size() && out.convention == Convention::urdf; ++k)
    out.joints[k].T_parent_joint = frame_between(from.joints[k].T_parent_joint, to.joints[k].T_parent_joint, part);
  return out;
}

const Parameter* parameter_named(const std::string& name, const std::vector<Parameter>& parameters) {
  const auto at =
      std::find_if(parameters.begin(), parameters.end(), [&](const Parameter& p) { return p.name == name; });
  return at == parameters.end() ? nullptr : &*at;
}

double value_of(const std::string& name, const std::vector<Parameter>& parameters, double otherwise) {
  const Parameter* found = parameter_named(name, parameters);
  return found ? found->value : otherwise;
}

/// What few poses hardly show is a valley that is straight only where values are small: half way between two of its
/// points lies beside its floor. So the average is fitted once more, base and targets freely, values of links within a
/// tenth of what lies between the two fits.
Identification back_to_the_floor(const Registered& whole, const Robot& average, const RefitTask& of_links,
                                 const Identification& links, const Identification& found) {
  constexpr double kWithin = 0.1;
  constexpr double kHeld = 1e-9;
  Measurements data = whole.data;
  data.set = whole.set;
  IdentifyOptions options = of_links.options;
  for (auto& [name, size] : options.priors) {
    const Parameter* p = parameter_named(name, links.parameters);
    if (p) size = std::max(kWithin * std::abs(p->value - value_of(name, found.parameters, p->nominal)), kHeld);
  }
  return identify(average, data, options);
}

}  // namespace

/// The size of links' errors that the training poses speak for, as a part of the widest prior.
static double likeliest_scale(const Work& work, int links) {
  const Evidence evidence = evidence_now(work);
  const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(links)].columns;
  return evidence.gain(evidence.evaluate({}), columns, 0.0).scale;
}

/// Fewer than fifteen values for each parameter of the links: half as many again as where the search believes links
/// before names. Names that it believes may still owe something to chance, and folds tell how much.
static bool is_worth_averaging(const Work& work, int links) {
  constexpr double kManyValues = 15.0;
  return values_for_each(work, links) <= kManyValues;
}

/// Links' columns that training poses see: beside the prior that they speak for, less than half of its variance is
/// left.
static std::vector<bool> are_seen(const Work& work, const Choice& links, const std::vector<int>& columns) {
  constexpr double kLeft = 0.5;
  const Evidence evidence = evidence_now(work);
  const Evidence::State state = evidence.evaluate(links);
  std::vector<bool> out;
  for (const int column : columns) {
    const auto at = std::find(state.columns.begin(), state.columns.end(), column) - state.columns.begin();
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(static_cast<Eigen::Index>(state.columns.size()), at);
    out.push_back(state.precision[at] * state.factor.solve(unit)[at] < kLeft);
  }
  return out;
}

/// Links that training poses see, and those that they do not, as two groups more; numbers of them.
struct PartedLinks {
  Work work;
  double likeliest = 1.0;
  int seen = -1, unseen = -1;
};

static PartedLinks with_links_parted(const Work& work, int links) {
  PartedLinks out{work, likeliest_scale(work, links)};
  Candidates& candidates = out.work.design.candidates;
  const ColumnGroup all = candidates.groups[static_cast<std::size_t>(links)];
  const Explanation what = candidates.named[static_cast<std::size_t>(links)];
  const std::vector<bool> seen = are_seen(work, {{links}, {out.likeliest}}, all.columns);
  const auto add = [&](bool those) {
    ColumnGroup part = all;
    part.columns.clear();
    for (std::size_t k = 0; k < seen.size(); ++k) {
      if (seen[k] == those) part.columns.push_back(all.columns[k]);
    }
    candidates.groups.push_back(std::move(part));
    candidates.named.push_back(what);
    return static_cast<int>(candidates.groups.size()) - 1;
  };
  out.seen = add(true);
  out.unseen = add(false);
  return out;
}

constexpr double kBetterOnFolds = 1.05;  ///< sums of squares

/// All links under the prior that these poses speak for; and as far off as robots get, those that they see, or all
/// where folds are predicted better so.
static std::vector<Choice> links_alone(const PartedLinks& parted, int links) {
  std::vector<Choice> out = {{{links}, {parted.likeliest}}};
  if (parted.likeliest == 1.0) return out;
  const Choice all = {{links}, {1.0}}, seen = {{parted.seen, parted.unseen}, {1.0, parted.likeliest}};
  const auto squares = [&](const Choice& choice) { return squares_of_folds(parted.work, choice); };
  out.push_back(predicts_better(squares(all), squares(seen), kBetterOnFolds) ? all : seen);
  return out;
}

bool links_predict_alone(const Work& work) {
  const int links = all_links(work);
  if (links < 0 || !is_worth_averaging(work, links)) return false;
  const PartedLinks parted = with_links_parted(work, links);
  const Eigen::VectorXd of_frames = squares_of_folds(work, {});
  const std::vector<Choice> all = links_alone(parted, links);
  return std::any_of(all.begin(), all.end(), [&](const Choice& alone) {
    return predicts_better(squares_of_folds(parted.work, alone), of_frames, kBetterOnFolds);
  });
}

/// Some part of a fit, and the rest of links alone.
static void mix_in(const Registered& whole, const Work& work, const Robot& robot, const Choice& links, double part,
                   Identification* found) {
  Measurements data = whole.data;
  data.set = whole.set;
  const RefitTask task = refit_task(work, work.inputs, robot, evidence_now(work).evaluate(links), links.groups);
  const Identification other = identify(task.start, data, task.options);
  const Identification settled =
      back_to_the_floor(whole, robot_between(other.robot, found->robot, whole, part), task, other, *found);
  found->robot = settled.robot;
  for (Parameter& p : found->parameters) {
    p.value = part * p.value + (1.0 - part) * value_of(p.name, other.parameters, p.nominal);
    if (const Parameter* moved = parameter_named(p.name, settled.parameters)) p.value += moved->value - moved->nominal;
  }
}

double average_with_links(const Registered& whole, const Work& work, const Robot& robot, const Choice& choice,
                          Identification* found) {
  const int links = all_links(work);
  if (links < 0 || !is_worth_averaging(work, links)) return 1.0;
  // Links that no search found, beside nothing that a robot file can hold, count for half at most.
  const double least = choice.groups.empty() ? 0.5 : 0.0;
  const PartedLinks parted = with_links_parted(work, links);
  Average average = {{choice}, {1.0}};
  for (const Choice& alone : links_alone(parted, links)) {
    const double part = std::max(stacked_part(parted.work, average, alone), least / average.parts[0]);
    if (part >= 1.0) continue;
    mix_in(whole, parted.work, robot, alone, part, found);
    for (double& of : average.parts) of *= part;
    average.of.push_back(alone);
    average.parts.push_back(1.0 - part);
  }
  return average.parts[0];
}

}  // namespace truing::diagnosis
