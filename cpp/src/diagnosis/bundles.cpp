// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Names that together stand for one function: laws of one angle, or of several at one joint, a frame that wanders, or
// parts that give way under weight, which one function of what they depend on explains as well. Taken one by one each
// of them holds, for the others make up for what it lacks.

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/free_search.hpp"
#include "model/effects/traits.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;

namespace {

constexpr double kInQuestion = 3.0;       ///< nats by which the names are better, from which on they are in no question
constexpr std::size_t kMany = 3;          ///< names at one joint: all of them at once are no likelier than a function
constexpr double kForFunctions = 4.0;     ///< nats beyond the threshold, that a free function must win
constexpr double kPredictsAsWell = 1.06;  ///< times the sum of squares of unseen folds, that the function may leave

/// Chosen groups that depend on the same inputs.
struct Bundle {
  std::vector<int> groups;
  std::vector<int> inputs;
  std::size_t names = 0;  ///< of `groups`, without what corrects them
  int joint = -1;         ///< whose angle it is, or where all of them act; -1: no one joint's
  bool of_two = false;    ///< in their place functions of one or two of the inputs are tried, at this joint only
};

bool is_load(const Work& work, int input) { return is_torque(work.inputs[static_cast<std::size_t>(input)]); }

bool are_among(const std::vector<int>& some, const std::vector<int>& all) {
  return std::all_of(some.begin(), some.end(),
                     [&](int one) { return std::find(all.begin(), all.end(), one) != all.end(); });
}

/// A law that depends on this angle alone.
bool is_of_angle(const Work& work, const Explanation& e, int angle) {
  const std::vector<MovedBy> motions = motions_of_law(work, e);
  return !motions.empty() &&
         std::all_of(motions.begin(), motions.end(), [&](const MovedBy& motion) { return motion.angle == angle; });
}

/// The joints that chosen laws of an angle move: its own, and those that it carries along.
std::set<std::string> moved_with(const Work& work, const Choice& choice, int angle) {
  std::set<std::string> out;
  for (const int g : choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    if (is_of_angle(work, e, angle)) out.insert(e.joints[0]);
  }
  return out;
}

using Holds = std::function<bool(const Explanation&)>;

/// Chosen names, and the functions that correct them or stand beside them. A single name is held against functions
/// where its confidence is found.
Bundle bundle_of(const Work& work, const Choice& choice, const Holds& is_name, const Holds& is_function) {
  Bundle out;
  for (const int g : choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    const bool function = e.kind == Kind::law || e.kind == Kind::free, name = e.kind == Kind::catalogue && is_name(e);
    if (name || (function && is_function(e))) out.groups.push_back(g);
    out.names += name;
  }
  if (out.names < 2) out.groups.clear();
  return out;
}

/// Laws of one joint's angle: its own, and those of joints that it carries along, with their zeros.
Bundle laws_of_angle(const Work& work, const Choice& choice, std::size_t joint) {
  const int angle = input_named(work, input_name(Driver::angle, joint));
  if (angle < 0) return {};
  const std::set<std::string> moved = moved_with(work, choice, angle);
  const auto is_zero = [&](const Explanation& e) {
    return effect_traits(work, e).driver == Driver::constant &&
           std::any_of(moved.begin(), moved.end(), [&](const std::string& at) { return has_law_at(work, e, at); });
  };
  Bundle out = bundle_of(
      work, choice, [&](const Explanation& e) { return is_zero(e) || is_of_angle(work, e, angle); },
      [&](const Explanation& e) { return moved.count(e.site) > 0 && e.inputs == std::vector<int>{angle}; });
  out.inputs = {angle};
  out.joint = static_cast<int>(joint);
  return out;
}

std::vector<int> angle_inputs(const Work& work) {
  std::vector<int> out;
  for (std::size_t k = 0; k < work.given.frames.robot.joints.size(); ++k) {
    const int angle = input_named(work, input_name(Driver::angle, k));
    if (angle >= 0) out.push_back(angle);
  }
  return out;
}

/// Laws at one joint of where the arm stands: of its load, and of joints that carry it along, too.
Bundle laws_at_joint(const Work& work, const Choice& choice, std::size_t joint) {
  const std::string& site = work.given.frames.robot.joints[joint].name;
  const std::vector<int> angles = angle_inputs(work);
  const auto is_law = [&](const Explanation& e) {
    const EffectTraits& traits = effect_traits(work, e);
    return has_law_at(work, e, site) && (follows_configuration(traits) || traits.driver == Driver::other_angles);
  };
  const auto is_function = [&](const Explanation& e) {
    return e.site == site && (are_among(e.inputs, angles) || (e.inputs.size() == 1 && is_load(work, e.inputs[0])));
  };
  Bundle out = bundle_of(work, choice, is_law, is_function);
  out.inputs = angles;
  out.joint = static_cast<int>(joint);
  out.of_two = true;
  return out;
}

bool is_of_time(const InputColumn& input) { return input.name == "order" || input.name == input_name(Driver::time, 0); }

/// A frame that wanders, and what was recorded as time went on: temperature, payload, covariates.
Bundle wandering_frame(const Work& work, const Choice& choice) {
  Bundle out;
  for (const int g : choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    if (e.kind == Kind::drift && !frame_coordinates(e.site).empty()) out.groups.push_back(g);
  }
  for (std::size_t k = 0; k < work.inputs.size(); ++k) {
    if (work.inputs[k].joint < 0 && !work.inputs[k].constant) out.inputs.push_back(static_cast<int>(k));
  }
  return out;
}

/// Joints and links that give way under their weights, with what corrects them: together they make much of what one
/// place does under the payload.
Bundle laws_of_weight(const Work& work, const Choice& choice) {
  const int payload = input_named(work, "payload");
  if (payload < 0 || work.inputs[static_cast<std::size_t>(payload)].constant) return {};
  const auto of_load = [&](int k) { return is_load(work, k); };
  Bundle out = bundle_of(
      work, choice, [&](const Explanation& e) { return effect_traits(work, e).driver == Driver::gravity_torque; },
      [&](const Explanation& e) { return std::any_of(e.inputs.begin(), e.inputs.end(), of_load); });
  out.inputs = {payload};
  return out;
}

/// No groups: there is nothing to question.
using BundleOf = std::function<Bundle(const Choice&)>;

/// Of the weights, the frame and every joint.
std::vector<BundleOf> bundles_of(const Work& work) {
  std::vector<BundleOf> out = {[&work](const Choice& choice) { return laws_of_weight(work, choice); },
                               [&work](const Choice& choice) { return wandering_frame(work, choice); }};
  const std::size_t joints = work.design.joint_column.size();
  for (std::size_t k = 0; k < joints; ++k)
    out.emplace_back([&work, k](const Choice& choice) { return laws_of_angle(work, choice, k); });
  for (std::size_t k = 0; k < joints; ++k)
    out.emplace_back([&work, k](const Choice& choice) { return laws_at_joint(work, choice, k); });
  return out;
}

/// The best function in a bundle's place.
struct InItsPlace {
  double score = -1e300;            ///< of any
  const FreeGain* taken = nullptr;  ///< the best that may be taken: what goes with time alone is what a frame does, too
  bool as_shape = false;            ///< a plain shape, waves or more knots than the function has are better
};

bool is_at(const Robot& robot, const FreeGain& found, int joint) {
  return found.what.site == robot.joints[static_cast<std::size_t>(joint)].name;
}

/// What a plain shape at the joint wins in place of laws of its angle; and, where these leave something that goes with
/// it, what waves and more knots than a function that is scanned has do. Two laws that are both there leave nothing.
double best_at_joint(const Work& work, const Evidence& evidence, const Evidence::State& now,
                     const Evidence::State& rest, const Bundle& bundle, std::size_t tried, double threshold) {
  const auto joint = static_cast<std::size_t>(bundle.joint);
  const int angle = bundle.inputs[0];
  const double shape = best_local_shape(work, evidence, rest, joint, angle);
  if (best_function(work, evidence, now, joint, angle) < threshold) return shape;
  const double cost = std::log(static_cast<double>(std::max<std::size_t>(1, tried)));
  return std::max(shape, best_function(work, evidence, rest, joint, angle) - cost);
}

InItsPlace best_in_its_place(const Work& work, const Evidence& evidence, const Evidence::State& now,
                             const Evidence::State& rest, const Bundle& bundle, const FreeScan& scan,
                             double threshold) {
  InItsPlace out;
  for (const FreeGain& found : scan.best) {
    const bool is_tried = !bundle.of_two || (is_at(work.given.frames.robot, found, bundle.joint) &&
                                             are_among(found.what.inputs, bundle.inputs));
    if (!is_tried) continue;
    out.score = std::max(out.score, found.gain.score);
    if (!out.taken && !is_of_time(work.inputs[static_cast<std::size_t>(found.what.inputs[0])])) out.taken = &found;
  }
  if (bundle.joint < 0 || bundle.of_two) return out;
  const double at_joint = best_at_joint(work, evidence, now, rest, bundle, scan.tried, threshold);
  out.as_shape = at_joint > out.score;
  out.score = std::max(out.score, at_joint);
  return out;
}

/// The function in place of the bundle, with many knots where it is at the joint of the names. False: poses that it was
/// not fitted to are predicted worse.
bool put_in_its_place(Work* work, const Robot& robot, const Evidence::State& rest, const Bundle& bundle,
                      const InItsPlace& found, std::size_t tried, Decision* decision) {
  const double before = cross_validated(*work, decision->state.choice);
  const bool at_its_joint =
      bundle.joint >= 0 && !bundle.of_two && (found.as_shape || is_at(robot, *found.taken, bundle.joint));
  if (at_its_joint)
    add_fine_function(work, robot, static_cast<std::size_t>(bundle.joint), bundle.inputs);
  else
    append_free(work, *found.taken, tried);
  extend_grams(work->design, work->noise.design_effect, &work->grams);
  const int group = static_cast<int>(work->design.candidates.groups.size()) - 1;
  const Evidence evidence = evidence_now(*work);
  const Evidence::Gain gain =
      evidence.gain(rest, work->design.candidates.groups[static_cast<std::size_t>(group)].columns, 0.0);
  const Choice choice = with_one_more(rest.choice, group, gain.scale);
  if (cross_validated(*work, choice) > kPredictsAsWell * before) return false;
  decision->state = keep_what_predicts(*work, evidence.evaluate(choice));
  return true;
}

}  // namespace

void question_bundles(Work* work, const Robot& robot, Decision* decision) {
  const double threshold = decision->search.threshold;
  for (const BundleOf& find : bundles_of(*work)) {
    const Bundle bundle = find(decision->state.choice);
    if (bundle.groups.empty() || bundle.inputs.empty()) continue;
    const Evidence evidence = evidence_now(*work);
    const Evidence::State rest = evidence.evaluate(without_these(decision->state.choice, bundle.groups));
    const double by_names = decision->state.score - rest.score;
    FreeScanOptions options;
    options.threads = work->given.options.threads;
    options.flips = 0;
    if (!bundle.of_two) options.only_of = bundle.inputs;
    const FreeScan scan =
        scan_free(work->design, evidence, rest, work->inputs, robot, work->noise.design_effect, options);
    const InItsPlace best = best_in_its_place(*work, evidence, decision->state, rest, bundle, scan, threshold);
    const double by_function = best.as_shape ? best.score : best.taken ? best.taken->gain.score : -1e300;
    double margin = 0.0;
    if (bundle.joint < 0) margin = threshold;  // frames wander more often
    if (bundle.names >= kMany) margin = -kInQuestion;
    if (bundle.of_two) margin = threshold;  // a spring beside a coupling is likelier than a function of two angles
    const bool is_better = by_function > std::max(by_names + margin, threshold + kForFunctions);
    if (is_better && put_in_its_place(work, robot, rest, bundle, best, scan.tried, decision)) continue;
    if (best.score > by_names - kInQuestion) decision->in_question.insert(bundle.groups.begin(), bundle.groups.end());
  }
}

}  // namespace truing::diagnosis
