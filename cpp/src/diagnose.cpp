// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Where the gap lies, which effect causes it, how far it shrinks. The procedure is that of docs/diagnose.md, section by section.

#include "truing/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>

#include "diagnosis.hpp"
#include "sanity.hpp"
#include "statistics.hpp"
#include "where.hpp"

namespace truing {

bool DiagnoseOptions::is_valid(std::string* error) const {
  const auto fail = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(false_alarm > 0.0 && false_alarm < 0.5)) return fail("false_alarm must be in (0, 0.5)");
  if (max_effects < 1) return fail("max_effects must be at least 1");
  if (!(test_share > 0.0 && test_share < 0.9)) return fail("test_share must be in (0, 0.9)");
  if (search_poses < 50) return fail("search_poses must be at least 50");
  if (resamples < 0) return fail("resamples must not be negative");
  if (!(rotation_length > 0.0)) return fail("rotation_length must be positive [m]");
  return true;
}

Diagnosis diagnose(const Robot& robot, const Measurements& given, const DiagnoseOptions& options) {
  using namespace detail;
  using Kind = Explanation::Kind;
  constexpr double kCorrectionShare = 0.05;  // of the gap, from which on a law's correction is something unknown
  constexpr double kLackOfFit = 4.0;         // standard errors beyond repeats, from which on what is left is no noise
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("diagnose: " + error);
  validate(robot);
  validate(given, robot);
  bool measured = false;
  for (std::size_t row = 0; row < given.rows && !measured; ++row) measured = !given.has_fixed_point(row) && (given.has_position(row) || given.has_distance(row));
  if (!measured) throw std::invalid_argument("diagnose needs measured positions, poses or distances: touched fixed points alone show no scale, and are for identify");
  for (const std::string& name : options.leave_out) find_effect(name, options.own_effects);

  // 0. Sanity, before statistics.
  Checked checked = check(robot, given, options);
  Diagnosis result;
  result.seed = options.seed;
  result.sanity = checked.findings;
  result.joint_record = checked.joint_record;
  const Measurements& data = checked.data;

  // 1. Register: base and targets are always unknown.
  IdentifyOptions frames_only;
  frames_only.test_share = options.test_share;
  frames_only.seed = options.seed;
  frames_only.threads = options.threads;
  frames_only.rotation_length = options.rotation_length;
  frames_only.own_effects = options.own_effects;
  for (const Target& target : robot.targets) frames_only.free.push_back(target.name + ".*");
  if (frames_only.free.empty()) frames_only.free = {"tool.*"};
  Identification frames = identify(robot, data, frames_only);
  if (!frames.test) throw std::invalid_argument("diagnose needs held-out poses: no row is in the set 'test'");
  result.set = frames.set;
  result.robot_before = frames.robot;

  // The rows that are searched: all, or evenly some of very many.
  const std::vector<std::int32_t> all_clusters = pose_groups(data);
  const std::vector<std::int32_t> rows = thinned_rows(data, all_clusters, options.search_poses);
  const bool thinned = rows.size() < data.rows;
  if (thinned) result.warnings.push_back("searched on " + std::to_string(rows.size()) + " of " + std::to_string(data.rows) + " rows; fitted and judged on all");
  DiagnoseOptions search_options_ = options;
  Work work{search_options_, data, all_clusters, {}, frames, {}, {}, 1.0, {}, 0.0, {}, {}, {}, {}, checked.inferred_direction};
  std::vector<std::int8_t> set = frames.set;
  if (thinned) {
    work.data = subset_of(data, rows);
    search_options_.own_effects = mapped(options.own_effects, data, rows);
    work.cluster.clear();
    set.clear();
    for (const std::int32_t row : rows) {
      work.cluster.push_back(all_clusters[static_cast<std::size_t>(row)]);
      set.push_back(frames.set[static_cast<std::size_t>(row)]);
    }
  }
  std::vector<std::int32_t> train_rows, searched(work.data.rows);
  std::iota(searched.begin(), searched.end(), 0);
  for (const std::int32_t row : searched) {
    if (!set[static_cast<std::size_t>(row)]) train_rows.push_back(row);
  }

  // 2. Linearise once, where the geometry is about right; weigh; Gram matrices by fold.
  work.linear = linearise(frames.robot, work.data, train_rows, options.rotation_length, options.threads);
  work.inputs = make_inputs(work.linear.at, work.data);
  work.design = make_design({frames.robot, work.linear.at, work.linear.shift, work.data, work.inputs, searched, set, work.cluster, search_options_, checked.inferred_direction});
  for (const NotTestable& n : work.design.candidates.not_testable) {
    const bool twice = std::any_of(result.not_testable.begin(), result.not_testable.end(), [&](const NotTestable& other) { return other.effect == n.effect && other.joints == n.joints; });
    if (!twice) result.not_testable.push_back(n);
  }
  weigh(&work);
  make_grams(&work);

  for (const std::int32_t row : work.outliers) result.outliers.push_back(static_cast<std::size_t>(thinned ? rows[static_cast<std::size_t>(row)] : row));
  std::sort(result.outliers.begin(), result.outliers.end());
  result.outliers.erase(std::unique(result.outliers.begin(), result.outliers.end()), result.outliers.end());
  if (!result.outliers.empty()) {
    result.sanity.push_back({"outliers", std::to_string(result.outliers.size()) + " rows stand so far out that they count for little: look at them first if they are many.",
                             result.outliers.size() <= 50 ? result.outliers : std::vector<std::size_t>{}});
  }

  // 3. to 6. What explains it.
  Decision decision = decide(&work, robot);
  const Evidence evidence(work.train, work.design.candidates.groups, work.design.nuisance, work.design.prior);
  const Resampled resampled = resample(work, decision);
  result.p_gap = decision.p_gap;
  result.remaining_structure_p = decision.p_left;

  // A name is given to what is more likely right than wrong.
  std::map<int, std::pair<Sureness, double>> sureness;
  for (bool dropped = true; dropped;) {
    dropped = false;
    sureness.clear();
    for (std::size_t at = 0; at < decision.state.choice.groups.size(); ++at) {
      const int g = decision.state.choice.groups[at];
      if (!is_named(work.design.candidates.named[static_cast<std::size_t>(g)])) continue;
      const Sureness sure = how_sure(work, evidence, decision.state, at);
      sureness[g] = {sure, calibrated(sure.raw, came_back(work, resampled, sure, g), sure.removal_loss)};
    }
    const auto least = std::min_element(sureness.begin(), sureness.end(), [](const auto& a, const auto& b) { return a.second.second < b.second.second; });
    if (least == sureness.end() || least->second.second >= 0.5) break;
    const auto at = std::find(decision.state.choice.groups.begin(), decision.state.choice.groups.end(), least->first) - decision.state.choice.groups.begin();
    decision.state = evidence.evaluate(without(decision.state.choice, work.design.candidates.groups, static_cast<std::size_t>(at)));
    for (auto& [correction, corrected] : decision.corrects) corrected = corrected == least->first ? -1 : corrected;
    dropped = true;
  }

  // 7. How far: the exact refit, on all rows.
  std::vector<int> named_groups, catalogue_groups, every_group = decision.state.choice.groups;
  for (const int g : every_group) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    const auto corrects = decision.corrects.find(g);
    if (e.kind != Kind::free || (corrects != decision.corrects.end() && corrects->second >= 0)) named_groups.push_back(g);
    if (e.kind == Kind::catalogue || e.kind == Kind::all_geometry) catalogue_groups.push_back(g);
  }
  Work whole{options, data, all_clusters, {}, frames, {}, {}, 1.0, {}, 0.0, {}, {}, {}, {}, checked.inferred_direction};
  whole.design.candidates = work.design.candidates;
  whole.design.column_names = work.design.column_names;
  whole.design.prior = work.design.prior;
  const bool needs_inputs = catalogue_groups.size() < every_group.size();
  if (needs_inputs) whole.inputs = thinned ? make_inputs(work.linear.at, data) : work.inputs;
  const Refit by_catalogue = refit(whole, robot, decision.state, catalogue_groups);
  const Refit by_named = named_groups.size() > catalogue_groups.size() ? refit(whole, robot, decision.state, named_groups) : by_catalogue;
  const Refit by_all = every_group.size() > named_groups.size() ? refit(whole, robot, decision.state, every_group) : by_named;
  result.robot = by_catalogue.found.robot;
  result.residuals_before = residuals(frames.robot, data, options.own_effects, options.threads);
  result.residuals_after = residuals(by_named.found.robot, data, by_named.own, options.threads);
  const Residuals after_all = residuals(by_all.found.robot, data, by_all.own, options.threads);
  result.error_before = lengths_of(result.residuals_before, data.rows);
  result.error_after = lengths_of(result.residuals_after, data.rows);
  result.gap = error_statistics(held_out(result.error_before, result.set));
  result.after = error_statistics(held_out(result.error_after, result.set));
  result.after_unknown = error_statistics(held_out(lengths_of(after_all, data.rows), result.set));
  const double by_robot = error_statistics(held_out(lengths_of(residuals(result.robot, data, options.own_effects, options.threads), data.rows), result.set)).rms;
  if (!catalogue_groups.empty()) result.shrink = percentile_interval(resampled.shrink, result.gap.rms > 0.0 ? 1.0 - by_robot / result.gap.rms : 0.0);

  // Noise: from repeats, else what the chosen model leaves.
  double freedom = 0.0;
  const double repeats = repeat_sigma(data, &freedom);
  const double components = data.distance ? 1.0 : 3.0;
  result.noise_from_repeats = freedom >= 20.0;
  result.noise_floor = std::sqrt(components) * (result.noise_from_repeats ? repeats : work.position_sigma * std::sqrt(decision.state.sigma2));
  const double gap2 = std::pow(result.gap.rms, 2.0), floor2 = std::pow(result.noise_floor, 2.0), after2 = std::pow(result.after.rms, 2.0);
  result.closable = gap2 > floor2 ? std::clamp((gap2 - after2) / (gap2 - floor2), 0.0, 1.0) : 0.0;

  for (std::size_t at = 0; at < every_group.size(); ++at) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(every_group[at])];
    const auto corrects = decision.corrects.find(every_group[at]);
    const bool correction = corrects != decision.corrects.end() && corrects->second >= 0;
    if (e.kind == Kind::free || e.kind == Kind::law) {
      UnknownEffect unknown = describe_unknown(work, evidence, decision, at, resampled);
      // A small correction of a law is a remark; a large one is something that nobody has named.
      if (!correction || unknown.share > kCorrectionShare) result.unknown.push_back(std::move(unknown));
    } else {
      const auto& [sure, probability] = sureness[every_group[at]];
      result.effects.push_back(describe(work, evidence, decision, at, sure, probability, by_all.found, resampled));
    }
  }
  // A drift made of several terms is one effect.
  for (std::size_t k = 0; k < result.effects.size(); ++k) {
    for (std::size_t m = result.effects.size(); m-- > k + 1;) {
      FoundEffect &first = result.effects[k], &second = result.effects[m];
      if (first.effect != second.effect || first.joints != second.joints) continue;
      first.probability = std::max(first.probability, second.probability);
      first.share_alone = std::max(first.share_alone, second.share_alone);
      first.share_last += second.share_last;
      first.parameters.insert(first.parameters.end(), second.parameters.begin(), second.parameters.end());
      if (first.curves.empty()) first.curves = second.curves;
      result.effects.erase(result.effects.begin() + static_cast<std::ptrdiff_t>(m));
    }
  }
  for (std::size_t k = 0; k < result.unknown.size(); ++k) {
    for (std::size_t m = result.unknown.size(); m-- > k + 1;) {
      if (result.unknown[k].joint != result.unknown[m].joint || result.unknown[k].inputs != result.unknown[m].inputs) continue;
      result.unknown[k].share += result.unknown[m].share;
      result.unknown.erase(result.unknown.begin() + static_cast<std::ptrdiff_t>(m));
    }
  }
  // A gap that nothing so far has a shape for, as far as repeats can tell it from noise.
  if (result.effects.empty() && result.unknown.empty() && result.noise_from_repeats) {
    const double excess = lack_of_fit(data, result.error_before, result.set, repeats, freedom);
    if (excess > kLackOfFit) result.unknown.push_back(describe_lack_of_fit(result, excess));
  }
  // Shares that add up: between alone and last, scaled to what all together close.
  const double closed = std::max(0.0, 1.0 - std::pow(result.gap.rms > 0.0 ? result.after_unknown.rms / result.gap.rms : 1.0, 2.0));
  double total = 0.0;
  for (const FoundEffect& effect : result.effects) total += 0.5 * (effect.share_alone + effect.share_last);
  for (const UnknownEffect& unknown : result.unknown) total += unknown.share;
  for (FoundEffect& effect : result.effects) effect.share = total > 0.0 ? closed * 0.5 * (effect.share_alone + effect.share_last) / total : 0.0;
  for (UnknownEffect& unknown : result.unknown) unknown.share = total > 0.0 ? closed * unknown.share / total : 0.0;
  std::stable_sort(result.effects.begin(), result.effects.end(), [](const FoundEffect& a, const FoundEffect& b) { return a.share > b.share; });
  std::stable_sort(result.unknown.begin(), result.unknown.end(), [](const UnknownEffect& a, const UnknownEffect& b) { return a.probability > b.probability; });

  result.verdict = result.effects.empty() ? (result.unknown.empty() ? Verdict::none : Verdict::unknown)
                                          : (result.unknown.empty() ? Verdict::effects : Verdict::effects_and_unknown);
  result.candidates = list_candidates(work, evidence, decision.first);
  result.detectable = smallest_sizes(work, evidence, decision);
  share_out(work.design, work.inputs, robot, work.deff, options.seed + 17, &result);
  map_workspace(frames.robot, data, result.residuals_before, &result);
  result.neighbour_share = neighbour_share(data, result.set, after_all, &result.neighbour_p95);
  if (checked.inferred_direction) {
    result.not_testable.push_back({"backlash", {}, "no columns dir1 …: only a direction inferred from the order of the rows could be tried"});
    for (const Column& column : data.direction) {
      result.directions.emplace_back();
      for (std::size_t row = 0; row < data.rows; ++row) result.directions.back().push_back(column[row]);
    }
  }
  add_next_poses(work, data, options, decision, &result);
  result.sentence = sentence_of(result);
  return result;
}

}  // namespace truing
