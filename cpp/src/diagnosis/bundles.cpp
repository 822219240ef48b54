// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Names that together stand for one function: laws of one joint's angle, a frame that wanders, or parts that give way
// under weight, which one function of what they depend on explains as well. Taken one by one each of them holds, for
// the others make up for what it lacks.

#include <algorithm>

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
  int joint = -1;         ///< where all of them act; -1: at no one joint
};

/// Laws of one joint's own angle, with what corrects them. A single one is held against functions where its confidence
/// is found.
Bundle laws_of_angle(const Work& work, const Choice& choice, std::size_t joint) {
  Bundle out;
  const int angle = input_named(work, input_name(Driver::angle, joint));
  if (angle < 0) return out;
  const std::string& name = work.given.frames.robot.joints[joint].name;
  for (const int g : choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    if (e.kind == Kind::law || e.kind == Kind::free) {
      if (e.site == name && e.inputs == std::vector<int>{angle}) out.groups.push_back(g);
      continue;
    }
    if (e.kind != Kind::catalogue || !has_law_at(work, e, name) || !follows_own_angle(effect_traits(work, e))) continue;
    out.groups.push_back(g);
    ++out.names;
  }
  if (out.names < 2) out.groups.clear();
  out.inputs = {angle};
  out.joint = static_cast<int>(joint);
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
  Bundle out;
  const int payload = input_named(work, "payload");
  if (payload < 0 || work.inputs[static_cast<std::size_t>(payload)].constant) return out;
  const auto is_torque = [&](int k) { return work.inputs[static_cast<std::size_t>(k)].name.rfind("torque", 0) == 0; };
  for (const int g : choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    const bool is_function = e.kind == Kind::law || e.kind == Kind::free;
    if (is_function ? std::any_of(e.inputs.begin(), e.inputs.end(), is_torque)
                    : effect_traits(work, e).driver == Driver::gravity_torque)
      out.groups.push_back(g);
    out.names += !is_function && effect_traits(work, e).driver == Driver::gravity_torque;
  }
  if (out.names < 2) out.groups.clear();
  out.inputs = {payload};
  return out;
}

constexpr int kAnyFrame = -1, kAnyWeight = -2;  ///< in place of a joint

/// Of a joint, of the frame, or of weights. No groups: there is nothing to question.
Bundle bundle_at(const Work& work, const Choice& choice, int joint) {
  if (joint == kAnyWeight) return laws_of_weight(work, choice);
  return joint == kAnyFrame ? wandering_frame(work, choice)
                            : laws_of_angle(work, choice, static_cast<std::size_t>(joint));
}

/// The best function in a bundle's place.
struct InItsPlace {
  double score = -1e300;            ///< of any
  const FreeGain* taken = nullptr;  ///< the best that may be taken: what goes with time alone is what a frame does, too
  bool as_shape = false;            ///< a plain shape is better than the function, whose knots are too few for it
};

InItsPlace best_in_its_place(const Work& work, const Evidence& evidence, const Evidence::State& rest,
                             const Bundle& bundle, const FreeScan& scan) {
  InItsPlace out;
  for (const FreeGain& found : scan.best) {
    out.score = std::max(out.score, found.gain.score);
    if (!out.taken && !is_of_time(work.inputs[static_cast<std::size_t>(found.what.inputs[0])])) out.taken = &found;
  }
  if (bundle.joint < 0) return out;
  const double shape = best_local_shape(work, evidence, rest, static_cast<std::size_t>(bundle.joint), bundle.inputs[0]);
  out.as_shape = shape > out.score;
  out.score = std::max(out.score, shape);
  return out;
}

bool is_at(const Robot& robot, const FreeGain& found, int joint) {
  return found.what.site == robot.joints[static_cast<std::size_t>(joint)].name;
}

/// The function in place of the bundle, with many knots where it is at the joint of the names. False: poses that it was
/// not fitted to are predicted worse.
bool put_in_its_place(Work* work, const Robot& robot, const Evidence::State& rest, const Bundle& bundle,
                      const InItsPlace& found, std::size_t tried, Decision* decision) {
  const double before = cross_validated(*work, decision->state.choice);
  const bool at_its_joint = bundle.joint >= 0 && (found.as_shape || is_at(robot, *found.taken, bundle.joint));
  if (at_its_joint)
    add_fine_function(work, robot, static_cast<std::size_t>(bundle.joint), bundle.inputs);
  else
    append_free(work, *found.taken, tried);
  extend_grams(work->design, work->noise.design_effect, &work->grams);
  const int group = static_cast<int>(work->design.candidates.groups.size()) - 1;
  const Evidence evidence = evidence_now(*work);
  const Evidence::Gain gain =
      evidence.gain(rest, work->design.candidates.groups[static_cast<std::size_t>(group)].columns, 0.0);
  Choice choice = rest.choice;
  choice.groups.push_back(group);
  choice.scales.push_back(gain.scale);
  if (cross_validated(*work, choice) > kPredictsAsWell * before) return false;
  decision->state = keep_what_predicts(*work, evidence.evaluate(choice));
  return true;
}

}  // namespace

void question_bundles(Work* work, const Robot& robot, Decision* decision) {
  for (int joint = kAnyWeight; joint < static_cast<int>(work->design.joint_column.size()); ++joint) {
    const Bundle bundle = bundle_at(*work, decision->state.choice, joint);
    if (bundle.groups.empty() || bundle.inputs.empty()) continue;
    const Evidence evidence = evidence_now(*work);
    const Evidence::State rest = evidence.evaluate(without_these(decision->state.choice, bundle.groups));
    const double by_names = decision->state.score - rest.score;
    FreeScanOptions options;
    options.flips = 0;
    options.only_of = bundle.inputs;
    const FreeScan scan =
        scan_free(work->design, evidence, rest, work->inputs, robot, work->noise.design_effect, options);
    const InItsPlace best = best_in_its_place(*work, evidence, rest, bundle, scan);
    const double by_function = best.as_shape ? best.score : best.taken ? best.taken->gain.score : -1e300;
    double margin = 0.0;
    if (bundle.joint < 0) margin = decision->search.threshold;  // frames wander more often
    if (bundle.names >= kMany) margin = -kInQuestion;
    const bool is_better = by_function > std::max(by_names + margin, decision->search.threshold + kForFunctions);
    if (is_better && put_in_its_place(work, robot, rest, bundle, best, scan.tried, decision)) continue;
    if (best.score > by_names - kInQuestion) decision->in_question.insert(bundle.groups.begin(), bundle.groups.end());
  }
}

}  // namespace truing::diagnosis
