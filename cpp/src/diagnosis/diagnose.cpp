// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Where the gap lies, which effect causes it, how far it shrinks. The procedure is that of docs/method/diagnose.md,
// section by section.

#include "truing/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/gravity.hpp"
#include "diagnosis/sanity.hpp"
#include "diagnosis/where.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"
#include "model/effects/traits.hpp"
#include "rooms.hpp"

namespace truing {
using namespace diagnosis;

namespace diagnosis {
namespace {

using Kind = Explanation::Kind;
constexpr double kCorrectionShare = 0.05;  ///< of the gap, from which on a law's correction is something unknown
constexpr double kManyOutliers = 0.05;     ///< of the rows, from which on they are no exceptions
constexpr double kSmallGain = 0.02;        ///< of the error, that is not worth a line if it may be none
constexpr double kLikely = 0.55;           ///< a name's class is taken back where its posterior is less

void refuse_what_cannot_be_used(const Robot& robot, const Measurements& data, const DiagnoseOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("diagnose: " + error);
  validate(robot);
  validate(data, robot);
  bool measured = false;
  for (std::size_t row = 0; row < data.rows && !measured; ++row)
    measured = !data.has_fixed_point(row) && (data.has_position(row) || data.has_distance(row));
  if (!measured)
    throw std::invalid_argument(
        "diagnose needs measured positions, poses or distances: touched fixed points alone show no scale, and are for "
        "identify");
  for (const std::string& name : options.leave_out) find_effect(name, options.own_effects);
  for (const std::string& name : options.also) find_effect(name, options.own_effects);
}

/// Base and targets (and anchor) are always unknown.
Identification fit_frames(const Robot& robot, const Measurements& data, const DiagnoseOptions& options) {
  IdentifyOptions frames_only;
  frames_only.test_share = options.test_share;
  frames_only.seed = options.seed;
  frames_only.threads = options.threads;
  frames_only.rotation_length = options.rotation_length;
  frames_only.own_effects = options.own_effects;
  frames_only.free = targets_of(robot);
  Identification frames = identify(robot, data, frames_only);
  if (!frames.test) throw std::invalid_argument("diagnose needs held-out poses: no row is in the set 'test'");
  return frames;
}

/// Section 1: base and targets fitted, and what was held out for it.
Registered register_data(const Robot& robot, const Checked& checked, const DiagnoseOptions& options) {
  Registered out;
  out.options = options;
  out.data = checked.data;
  out.inferred_direction = checked.inferred_direction;
  out.mistaken = std::any_of(checked.findings.begin(), checked.findings.end(),
                             [](const SanityFinding& finding) { return finding.mistake; });
  out.cluster = pose_groups(out.data);
  out.frames = fit_frames(robot, out.data, options);
  out.set = out.frames.set;
  const Repeats repeats = noise_of_repeats(out.data);
  if (repeats.enough()) {
    const Residuals left = residuals(out.frames.robot, out.data, options.own_effects, options.threads);
    out.beyond_repeats = lack_of_fit(out.data, lengths_of(left, out.data.rows), out.set, repeats);
  }
  return out;
}

/// `rows` of the whole, as a diagnosis of their own. Own effects keep looking into the whole, which must outlive this.
Registered part_of(const Registered& whole, const std::vector<std::int32_t>& rows) {
  if (rows.size() == whole.data.rows) return whole;
  Registered part = whole;
  part.data = subset_of(whole.data, rows);
  part.options.own_effects = mapped(whole.options.own_effects, whole.data, rows);
  part.cluster.clear();
  part.set.clear();
  for (const std::int32_t row : rows) {
    part.cluster.push_back(whole.cluster[static_cast<std::size_t>(row)]);
    part.set.push_back(whole.set[static_cast<std::size_t>(row)]);
  }
  return part;
}

/// Sections 1 and 2: linearised once, `there` or where the geometry is about right; weighed; Gram matrices by fold.
Work prepare(Registered given, const std::optional<Linearisation>& there = {}) {
  Work work;
  work.given = std::move(given);
  const DiagnoseOptions& options = work.given.options;
  const Measurements& data = work.given.data;
  const Robot& robot = work.given.frames.robot;
  std::vector<std::int32_t> every_row(data.rows), train_rows;
  std::iota(every_row.begin(), every_row.end(), 0);
  for (const std::int32_t row : every_row) {
    if (!work.given.set[static_cast<std::size_t>(row)]) train_rows.push_back(row);
  }
  work.linear = there ? *there : linearise(robot, data, train_rows, options.rotation_length, options.threads);
  work.inputs = make_inputs(links_as_drawn(work.linear.at, robot), data);
  work.design = make_design({robot, work.linear.at, work.linear.shift, data, work.inputs, every_row, work.given.set,
                             work.given.cluster, options, work.given.inferred_direction});
  work.samplings = samplings(work.design, work.inputs, robot);
  say_what_angles_cannot_show(work.samplings, robot, &work.design.candidates.not_testable);
  Weighted weighted = weigh(work.design, data, options.threads);
  work.design.weight = std::move(weighted.weight);
  work.noise = std::move(weighted.noise);
  work.grams = make_grams(work.design, work.noise.design_effect, options.threads);
  size_angles_of_links(&work);
  return work;
}

/// Which way is down: as the robot's file has it, or as springs show.
enum class Down { as_written, as_springs_show };

/// The same; where springs show another gravity than the robot's file has, with that one.
Work prepare_under_gravity(Down which, Registered* whole, const std::vector<std::int32_t>& rows, Robot* robot,
                           Diagnosis* out) {
  Work work = prepare(part_of(*whole, rows));
  if (whole->mistaken || which == Down::as_written) return work;
  const std::optional<Eigen::Vector3d> down = other_gravity(work);
  if (!down) return work;
  robot->gravity = whole->frames.robot.gravity = *down;
  out->sanity.push_back(gravity_finding(*down));
  return prepare(part_of(*whole, rows));
}

/// A motion that depends on the weight that hangs on a joint. What an effect of one's own depends on, nobody knows.
bool follows_weight(const EffectTraits& traits) {
  return traits.driver == Driver::gravity_torque || traits.driver == Driver::motor_torque ||
         (traits.driver == Driver::several && traits.moves == Moves::joint);
}

bool follows_weight(const Work& work, int group) {
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(group)];
  return (e.kind == Kind::catalogue && follows_weight(effect_traits(work, e))) ||
         std::any_of(e.inputs.begin(), e.inputs.end(),
                     [&](int input) { return is_torque(work.inputs[static_cast<std::size_t>(input)]); });
}

/// Something depends on weight: what was found, what these data do not tell from it, or what the robot has from before.
bool does_weight_matter(const Work& work, const Robot& robot, const Decision& decision,
                        const std::map<int, Sureness>& names) {
  std::vector<int> groups = decision.state.choice.groups;
  for (const auto& [name, sure] : names) {
    for (const Rival& rival : sure.rivals) {
      if (rival.in_class) groups.push_back(rival.group);
    }
  }
  return std::any_of(groups.begin(), groups.end(), [&](int group) { return follows_weight(work, group); }) ||
         std::any_of(robot.effects.begin(), robot.effects.end(), [&](const AppliedEffect& effect) {
           return follows_weight(model::traits_of(effect.effect, work.given.options.own_effects));
         });
}

/// Sections 3 to 6; again where a target turns out to be elsewhere than where the columns were taken.
Decision decide_there(const Registered& whole, const std::vector<std::int32_t>& rows, const Robot& robot, Work* work) {
  constexpr int kRounds = 6;
  Decision out = decide(work, robot);
  for (int round = 0; round < kRounds; ++round) {
    const std::optional<Linearisation> next = where_it_leads(*work, out.state);
    if (!next) break;
    *work = prepare(part_of(whole, rows), next);
    out = decide(work, robot);
  }
  return out;
}

void say_what_is_not_testable(const Work& work, Diagnosis* out) {
  for (const NotTestable& n : work.design.candidates.not_testable) {
    const bool twice = std::any_of(out->not_testable.begin(), out->not_testable.end(), [&](const NotTestable& other) {
      return other.effect == n.effect && other.joints == n.joints;
    });
    if (!twice) out->not_testable.push_back(n);
  }
  if (work.given.inferred_direction) {
    out->not_testable.push_back(
        {effect_that([](const EffectTraits& traits) { return traits.driver == Driver::direction; }).name,
         {},
         "no columns dir1 …: only a direction inferred from the order of the rows could be tried",
         Untestable::column_missing});
  }
}

std::size_t rows_that_count(const Measurements& data) {
  std::size_t out = 0;
  for (std::size_t row = 0; row < data.rows; ++row) out += !data.weight || data.weight[row] != 0.0;
  return out;
}

void say_outliers(const Work& work, const std::vector<std::int32_t>& rows, Diagnosis* out) {
  std::set<std::size_t> outliers;
  for (const std::int32_t row : work.noise.outliers)
    outliers.insert(static_cast<std::size_t>(rows[static_cast<std::size_t>(row)]));
  out->outliers.assign(outliers.begin(), outliers.end());
  if (outliers.empty()) return;
  const std::size_t count = outliers.size(), of = std::max<std::size_t>(1, rows.size());
  const bool many = static_cast<double>(count) >= kManyOutliers * static_cast<double>(of);
  const std::string fraction = number(100.0 * static_cast<double>(count) / static_cast<double>(of), 2) + " %";
  std::string text = std::to_string(count) + (count == 1 ? " row of " : " rows of ") + std::to_string(of);
  text += many ? " (" + fraction +
                     ") stand so far out that they count for little: what was found is said of the others. "
                     "Either these rows are wrong, or something happens in them that nothing found describes."
               : " stand so far out that they count for little, and held-out errors are those of the others.";
  out->sanity.push_back({"outliers", text, count <= 50 ? out->outliers : std::vector<std::size_t>{}});
}

/// Takes back, one at a time, names in whose place others may as well stand. By group: how sure those are that stay.
std::map<int, Sureness> keep_what_is_likely(const Work& work, const Evidence& evidence, Decision* decision) {
  for (;;) {
    std::map<int, Sureness> out;
    double least = kLikely;
    int gone = -1;
    for (std::size_t at = 0; at < decision->state.choice.groups.size(); ++at) {
      const int g = decision->state.choice.groups[at];
      if (!is_named(work.design.candidates.named[static_cast<std::size_t>(g)])) continue;
      out[g] = how_sure(work, evidence, decision->state, at);
      if (out[g].posterior >= least || links_predict(work, decision->state.choice, at)) continue;
      least = out[g].posterior;
      gone = g;
    }
    if (gone < 0) return out;
    const std::vector<int>& chosen = decision->state.choice.groups;
    const auto at = std::find(chosen.begin(), chosen.end(), gone) - chosen.begin();
    decision->state =
        evidence.evaluate(without(decision->state.choice, work.design.candidates.groups, static_cast<std::size_t>(at)));
    for (auto& [correction, corrected] : decision->corrects) corrected = corrected == gone ? -1 : corrected;
  }
}

/// Takes back, one at a time, small gains that poses which the fit did not see do not confirm: their interval holds
/// none. True: something was.
bool keep_what_is_confirmed(const Work& work, const Evidence& evidence, Decision* decision) {
  const DiagnoseOptions& options = work.given.options;
  bool any = false;
  for (;;) {
    const Choice& choice = decision->state.choice;
    const UnseenErrors with = unseen_errors(work, choice);
    double least = 1e300;
    Choice better;
    for (std::size_t at = 0; at < choice.groups.size(); ++at) {
      if (links_predict(work, choice, at)) continue;
      const Choice less = without(choice, work.design.candidates.groups, at);
      const Share gain = shrinkage(unseen_errors(work, less), with, options.resamples, options.seed + 7);
      if (gain.low > 0.0 || gain.value >= least) continue;
      least = gain.value;
      better = less;
    }
    if (least > kSmallGain) return any;
    any = true;
    for (auto& [correction, corrected] : decision->corrects) {
      if (std::find(better.groups.begin(), better.groups.end(), corrected) == better.groups.end()) corrected = -1;
    }
    decision->state = evidence.evaluate(better);
  }
}

/// What a robot file can hold.
bool is_in_catalogue(const Explanation& e) { return e.kind == Kind::catalogue || e.kind == Kind::all_geometry; }

bool corrects_a_law(const Decision& decision, int group) {
  const auto found = decision.corrects.find(group);
  return found != decision.corrects.end() && found->second >= 0;
}

/// Drifts, corrections and free functions are functions of inputs.
bool has_functions(const Work& work, const Decision& decision) {
  const std::vector<int>& chosen = decision.state.choice.groups;
  return std::any_of(chosen.begin(), chosen.end(), [&](int g) {
    return !is_in_catalogue(work.design.candidates.named[static_cast<std::size_t>(g)]);
  });
}

/// Rows that are held out and count: without a few that stand far out of every fit, which are said.
std::vector<std::int8_t> judged_rows(const Registered& whole, const Diagnosis& so_far) {
  std::vector<std::int8_t> out = whole.set;
  if (static_cast<double>(so_far.outliers.size()) >= kManyOutliers * static_cast<double>(out.size())) return out;
  for (const std::size_t row : so_far.outliers) out[row] = 0;
  return out;
}

/// The decision fitted without linearisation to all rows: what a robot file can hold, what has a name, everything.
struct Fitted {
  Refit by_catalogue, by_named, by_all;
  Residuals after_all;
  HeldOutFall by_robot;  ///< by `by_catalogue` alone
  double part = 1.0;     ///< of what was found in `by_catalogue`; the rest is all links alone
};

Fitted fit_exactly(const Registered& whole, const Work& work, const std::vector<InputColumn>& inputs,
                   const Robot& robot, const Decision& decision, const Resampled& resampled, Diagnosis* out) {
  const std::vector<int>& every_group = decision.state.choice.groups;
  std::vector<int> named_groups, catalogue_groups, tabled_groups;
  for (const int g : every_group) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    if (is_named(e) || corrects_a_law(decision, g)) named_groups.push_back(g);
    if (is_in_catalogue(e)) catalogue_groups.push_back(g);
    if (is_in_catalogue(e) || fits_in_tables(e, inputs)) tabled_groups.push_back(g);
  }
  const auto refitted = [&](const std::vector<int>& groups) {
    return refit(whole, work, inputs, robot, decision.state, groups);
  };
  Fitted fitted;
  const Refit by_names = refitted(catalogue_groups);
  fitted.by_catalogue = by_names;
  // That noise alone might score as high does not say, of few poses, that links are right.
  const bool links_alone = every_group.empty() && !whole.mistaken && links_predict_alone(work);
  if (!every_group.empty() || links_alone || whole.beyond_repeats > kLackOfFit)
    fitted.part = average_with_links(whole, work, robot, only_these(decision.state.choice, catalogue_groups),
                                     &fitted.by_catalogue.found);
  fitted.by_named = named_groups.size() > catalogue_groups.size() ? refitted(named_groups)
                    : named_groups.empty()                        ? by_names
                                                                  : fitted.by_catalogue;
  fitted.by_all = every_group.size() > named_groups.size() ? refitted(every_group) : fitted.by_named;

  const auto left_by = [&](const Robot& of, const std::vector<Effect>& own) {
    return residuals(of, whole.data, own, whole.options.threads);
  };
  const auto lengths = [&](const Residuals& of) { return lengths_of(of, whole.data.rows); };
  const std::vector<std::int8_t> counted = judged_rows(whole, *out);
  const auto judged = [&](const std::vector<double>& errors) { return error_statistics(held_out(errors, counted)); };
  out->robot = fitted.by_catalogue.found.robot;
  out->residuals_before = left_by(whole.frames.robot, whole.options.own_effects);
  out->residuals_after = left_by(fitted.by_named.found.robot, fitted.by_named.own);
  fitted.after_all = left_by(fitted.by_all.found.robot, fitted.by_all.own);
  out->error_before = lengths(out->residuals_before);
  out->error_after = lengths(out->residuals_after);
  out->gap = judged(out->error_before);
  out->after = judged(out->error_after);
  out->after_unknown = judged(lengths(fitted.after_all));
  const auto fall_to = [&](const std::vector<double>& errors) {
    return fall_of(out->error_before, errors, whole.set, whole.cluster);
  };
  if (!every_group.empty())
    out->held_out_fall = fall_to(named_groups.empty() ? lengths(fitted.after_all) : out->error_after);
  const std::vector<double> by_robot = lengths(left_by(out->robot, whole.options.own_effects));
  if (tabled_groups.size() > catalogue_groups.size()) {
    const Refit& by_tables = tabled_groups.size() == every_group.size() ? fitted.by_all : refitted(tabled_groups);
    Robot tabled = with_tables(work, inputs, decision.state, tabled_groups, by_tables);
    const std::vector<double> errors = lengths(left_by(tabled, whole.options.own_effects));
    if (fall_of(by_robot, errors, whole.set, whole.cluster).probability > kConfirmed) {
      out->robot_with_unknown = std::move(tabled);
      out->after_robot_with_unknown = judged(errors);
    }
  }
  if (catalogue_groups.empty() && fitted.part == 1.0) return fitted;
  fitted.by_robot = fall_to(by_robot);
  out->shrink =
      percentile_interval(resampled.shrink, out->gap.rms > 0.0 ? 1.0 - judged(by_robot).rms / out->gap.rms : 0.0);
  return fitted;
}

/// What is in the robot file beside what was named.
void say_what_was_averaged(double part, Diagnosis* out) {
  if (part > 0.995) return;
  const auto percent = [](double of) { return number(std::round(100.0 * of), 3) + " %"; };
  out->warnings.push_back(
      out->effects.empty() ? "these poses are few: though no cause is named, the robot file has " +
                                 percent(1.0 - part) + " of all wrong links; training poses are predicted best so"
                           : "these poses are few: the robot file, and the values of what is named, are an average, " +
                                 percent(part) + " of what was found and " + percent(1.0 - part) +
                                 " of wrong links alone; training poses are predicted best so");
}

/// Noise from repeats where there are enough, else what the chosen model leaves; and how much of the gap beyond it is
/// closed.
void judge_noise(const Repeats& repeats, const Work& work, const Decision& decision, Diagnosis* out) {
  const double components = work.given.data.distance ? 1.0 : 3.0;
  out->noise_from_repeats = repeats.enough();
  out->noise_floor =
      std::sqrt(components) * (out->noise_from_repeats ? repeats.sigma : noise_of_positions(work, decision.state));
  if (work.given.mistaken && !out->noise_from_repeats) out->noise_floor = 0.0;  // nothing was fitted that could tell
  const double gap2 = std::pow(out->gap.rms, 2.0), floor2 = std::pow(out->noise_floor, 2.0),
               after2 = std::pow(out->after.rms, 2.0);
  out->closable = gap2 > floor2 ? std::clamp((gap2 - after2) / (gap2 - floor2), 0.0, 1.0) : 0.0;
}

/// A drift made of several terms is one effect, and a joint's functions of one input are one unknown.
void merge_the_same(Diagnosis* out) {
  for (std::size_t k = 0; k < out->effects.size(); ++k) {
    for (std::size_t m = out->effects.size(); m-- > k + 1;) {
      FoundEffect &first = out->effects[k], &second = out->effects[m];
      if (first.effect != second.effect || first.joints != second.joints) continue;
      first.probability = std::max(first.probability, second.probability);
      first.share_alone = std::max(first.share_alone, second.share_alone);
      first.share_last += second.share_last;
      first.share += second.share;
      first.parameters.insert(first.parameters.end(), second.parameters.begin(), second.parameters.end());
      if (first.curves.empty()) first.curves = second.curves;
      out->effects.erase(out->effects.begin() + static_cast<std::ptrdiff_t>(m));
    }
  }
  for (std::size_t k = 0; k < out->unknown.size(); ++k) {
    for (std::size_t m = out->unknown.size(); m-- > k + 1;) {
      if (out->unknown[k].joint != out->unknown[m].joint || out->unknown[k].inputs != out->unknown[m].inputs) continue;
      out->unknown[k].share += out->unknown[m].share;
      out->unknown.erase(out->unknown.begin() + static_cast<std::ptrdiff_t>(m));
    }
  }
}

/// Shares that add up to what all together close in the exact fit. One below zero, by the held-out poses' noise, is
/// none.
void share_the_gap(Diagnosis* out) {
  const double closed =
      std::max(0.0, 1.0 - std::pow(out->gap.rms > 0.0 ? out->after_unknown.rms / out->gap.rms : 1.0, 2.0));
  double total = 0.0;
  for (FoundEffect& effect : out->effects) total += effect.share = std::max(0.0, effect.share);
  for (UnknownEffect& unknown : out->unknown) total += unknown.share = std::max(0.0, unknown.share);
  const double factor = total > 0.0 ? closed / total : 0.0;
  for (FoundEffect& effect : out->effects) effect.share *= factor;
  for (UnknownEffect& unknown : out->unknown) unknown.share *= factor;
  std::stable_sort(out->effects.begin(), out->effects.end(),
                   [](const FoundEffect& a, const FoundEffect& b) { return a.share > b.share; });
  std::stable_sort(out->unknown.begin(), out->unknown.end(), [](const UnknownEffect& a, const UnknownEffect& b) {
    return a.probability != b.probability ? a.probability > b.probability : a.share > b.share;
  });
}

void describe_all(const Work& work, const Evidence& evidence, const Decision& decision, const Resampled& resampled,
                  const std::map<int, Sureness>& names, const Identification& refitted, Diagnosis* out) {
  const std::vector<int>& chosen = decision.state.choice.groups;
  const std::vector<double> shares = order_averaged_shares(work, evidence, decision.state);
  std::map<int, double> by_corrections;  // of the effects whose law is corrected
  for (std::size_t at = 0; at < chosen.size(); ++at) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(chosen[at])];
    if (is_named(e) && corrects_a_law(decision, chosen[at]))
      by_corrections[decision.corrects.at(chosen[at])] += shares[at];
    if (e.kind != Kind::free && e.kind != Kind::law) continue;
    UnknownEffect unknown = describe_unknown(work, evidence, decision, at);
    // A small correction of a law is a remark; a large one is something that nobody has named.
    if (corrects_a_law(decision, chosen[at]) && unknown.share <= kCorrectionShare) {
      by_corrections[decision.corrects.at(chosen[at])] += shares[at];
      continue;
    }
    unknown.share = shares[at];
    out->unknown.push_back(std::move(unknown));
  }
  for (std::size_t at = 0; at < chosen.size(); ++at) {
    const auto named = names.find(chosen[at]);
    if (named == names.end()) continue;
    const Explanation& name = work.design.candidates.named[static_cast<std::size_t>(chosen[at])];
    const bool unknown =
        !decision.too_large.empty() || std::any_of(out->unknown.begin(), out->unknown.end(),
                                                   [&](const UnknownEffect& u) { return !is_left_by(work, name, u); });
    out->effects.push_back(describe(work, evidence, decision, at, named->second, resampled, unknown, refitted));
    out->effects.back().share = shares[at] + by_corrections[chosen[at]];
  }
}

/// Errors without each cause come from the linearised search: by their ratio they are brought to the exact fit's error,
/// which the sentence states.
void scale_to_exact(Diagnosis* out) {
  const auto scale = [&](auto* found) {
    const double searched = found->held_out_after.rms;
    if (!(searched > 0.0)) return;
    const double factor = out->after_unknown.rms / searched;
    for (ErrorStatistics* one : {&found->held_out_before, &found->held_out_after}) {
      for (double* value : {&one->rms, &one->mean, &one->median, &one->p95, &one->max}) *value *= factor;
    }
  };
  for (FoundEffect& effect : out->effects) scale(&effect);
  for (UnknownEffect& unknown : out->unknown) scale(&unknown);
}

/// A gap that nothing has a shape for, as far as repeats can tell it from noise.
void question_noise(double beyond_repeats, Diagnosis* out) {
  if (!out->effects.empty() || !out->unknown.empty()) return;
  if (beyond_repeats > kLackOfFit) out->unknown.push_back(describe_lack_of_fit(*out, beyond_repeats));
}

/// Held-out errors rise to a multiple of their squares that few poses, however they scatter, do not have where other
/// poses' errors fall.
bool is_far_worse(double before, double after) {
  constexpr double kTimes = 2.5;
  return after * after > kTimes * before * before;
}

Verdict verdict_of(const Diagnosis& d) {
  if (d.held_out_fall.probability < kContradicted || is_far_worse(d.gap.rms, d.after.rms))
    return Verdict::does_not_hold;
  if (d.effects.empty()) return d.unknown.empty() ? Verdict::none : Verdict::unknown;
  return d.unknown.empty() ? Verdict::effects : Verdict::effects_and_unknown;
}

/// What is in the robot file: what was found, or frames alone, for no robot is worse than nothing.
void decide_on_robot(const Robot& frames_alone, const Fitted& fitted, Diagnosis* out) {
  const bool worse = fitted.by_robot.probability < kContradicted || is_far_worse(1.0, 1.0 - out->shrink.value);
  if (out->verdict != Verdict::does_not_hold && !worse) {
    say_what_was_averaged(fitted.part, out);
    return;
  }
  out->robot = frames_alone;
  out->robot_with_unknown.reset();
  out->shrink = {};
}

std::vector<std::vector<double>> copied(const std::vector<Column>& columns, std::size_t rows) {
  std::vector<std::vector<double>> out;
  for (const Column& column : columns) {
    out.emplace_back();
    for (std::size_t row = 0; row < rows; ++row) out.back().push_back(column[row]);
  }
  return out;
}

/// All sections. None: springs seemed to show another gravity, and nothing that was found under it depends on it.
std::optional<Diagnosis> diagnosed(const Robot& as_written, const Measurements& given, const DiagnoseOptions& options,
                                   Down which) {
  Robot robot = as_written;
  Diagnosis result;
  result.seed = options.seed;

  // 0. Sanity, before statistics.
  const Checked checked = check(robot, given, options);
  result.sanity = checked.findings;
  result.joint_record = checked.joint_record;

  // 1. Registration: the gap.
  Registered whole = register_data(robot, checked, options);
  result.set = whole.set;
  if (checked.inferred_direction) result.directions = copied(whole.data.direction, whole.data.rows);

  // 1. and 2. Columns, noise and weights, of all rows or, of very many, evenly some.
  const std::vector<std::int32_t> rows = thinned_rows(whole.data, whole.cluster, options.search_poses);
  const bool thinned = rows.size() < whole.data.rows;
  if (rows.size() < rows_that_count(whole.data))
    result.warnings.push_back("searched on " + std::to_string(rows.size()) + " of " + std::to_string(whole.data.rows) +
                              " rows; fitted and judged on all");
  Work work = prepare_under_gravity(which, &whole, rows, &robot, &result);
  result.robot_before = whole.frames.robot;

  // 3. to 6. What explains it, and 7. how sure that is.
  Decision decision = decide_there(whole, rows, robot, &work);
  say_what_is_not_testable(work, &result);
  say_outliers(work, rows, &result);
  const Evidence evidence = evidence_now(work);
  keep_what_is_confirmed(work, evidence, &decision);
  const Resampled resampled = resample(work, decision);
  std::map<int, Sureness> names = keep_what_is_likely(work, evidence, &decision);
  while (keep_what_is_confirmed(work, evidence, &decision))  // without what was not likely
    names = keep_what_is_likely(work, evidence, &decision);
  for (const auto& [departure, law] : departures_from_laws(work, evidence, decision)) {
    decision.corrects[departure] = law;
    names.erase(departure);
  }
  const bool turned = robot.gravity != as_written.gravity;
  if (turned && !does_weight_matter(work, robot, decision, names)) return std::nullopt;
  result.p_gap = decision.p_gap;
  result.remaining_structure_p = decision.p_left;

  // 8. How far: the exact refit, on all rows.
  std::vector<InputColumn> of_all_rows;
  if (thinned && has_functions(work, decision))
    of_all_rows = make_inputs(links_as_drawn(work.linear.at, whole.frames.robot), whole.data);
  const std::vector<InputColumn>& inputs = thinned ? of_all_rows : work.inputs;
  const Fitted fitted = fit_exactly(whole, work, inputs, robot, decision, resampled, &result);
  judge_noise(noise_of_repeats(whole.data), work, decision, &result);
  describe_all(work, evidence, decision, resampled, names, fitted.by_catalogue.found, &result);
  describe_what_is_too_large(work, evidence, decision, &result);
  say_what_is_negative(&result);
  scale_to_exact(&result);
  merge_the_same(&result);
  say_where_any_function_looks_like_a_gear(work, robot, &result);
  question_noise(whole.beyond_repeats, &result);
  for (const SanityFinding& finding : checked.findings) {
    if (finding.mistake) result.unknown = {describe_mistake(result, finding)};
  }
  share_the_gap(&result);
  result.verdict = verdict_of(result);
  decide_on_robot(whole.frames.robot, fitted, &result);
  result.candidates = list_candidates(work, evidence, decision.first);
  result.detectable = smallest_sizes(work, evidence, decision);
  share_out(work.design, work.inputs, robot, work.noise.design_effect, options.seed + 17, options.threads, &result);
  map_workspace(whole.frames.robot, whole.data, result.residuals_before, &result);
  result.neighbour_share = neighbour_share(whole.data, result.set, fitted.after_all, &result.neighbour_p95);

  result.explained = explained_by(result, too_few_poses(result));

  // 9. What next.
  add_next_poses(work, whole.data, options, decision, &result);
  result.sentence = sentence_of(result);
  return result;
}

}  // namespace
}  // namespace diagnosis

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
  refuse_what_cannot_be_used(robot, given, options);
  std::optional<Diagnosis> out = diagnosed(robot, given, options, Down::as_springs_show);
  return out ? std::move(*out) : *diagnosed(robot, given, options, Down::as_written);
}

}  // namespace truing
