// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The largest causes in a line.

#include <algorithm>
#include <string>
#include <vector>

#include "diagnosis/diagnosis.hpp"
#include "math/text.hpp"
#include "model/effects/traits.hpp"

namespace truing::diagnosis {

constexpr std::size_t kCauses = 3;     ///< that a headline has room for
constexpr std::size_t kRoom = 98;      ///< letters of causes in two lines, of which the gap takes its part
constexpr std::size_t kQuestions = 5;  ///< that a sentence has room for
constexpr std::size_t kJoints = 3;     ///< of a cause, that are listed
constexpr double kContender = 0.25;    ///< of a cause's probability: an alternative that must be reckoned with

/// "transmission error (81 per turn)" of "transmission_error@81".
std::string plain(const std::string& effect) {
  const std::size_t at = effect.find('@');
  std::string out = effect.substr(0, at);
  std::replace(out.begin(), out.end(), '_', ' ');
  return at == std::string::npos ? out : out + " (" + effect.substr(at + 1) + " per turn)";
}

/// An effect with all joints that it was found at.
struct Cause {
  std::string effect;
  std::vector<std::string> joints;
  double share = 0.0;
  std::size_t count = 0;
  const FoundEffect* only = nullptr;  ///< where it is one finding
};

static std::vector<Cause> causes_of(const Diagnosis& d) {
  std::vector<Cause> out;
  for (const FoundEffect& effect : d.effects) {
    auto cause = std::find_if(out.begin(), out.end(), [&](const Cause& c) { return c.effect == effect.effect; });
    if (cause == out.end()) {
      out.push_back({effect.effect, {}, 0.0, 0, &effect});
      cause = out.end() - 1;
    } else {
      cause->only = nullptr;
    }
    cause->joints.insert(cause->joints.end(), effect.joints.begin(), effect.joints.end());
    cause->share += effect.share;
    cause->count += 1;
  }
  std::stable_sort(out.begin(), out.end(), [](const Cause& a, const Cause& b) { return a.share > b.share; });
  return out;
}

static std::string effect_at(const std::string& effect, const std::vector<std::string>& joints) {
  if (joints.empty()) return plain(effect);
  if (joints.size() > kJoints) {
    const bool of_links = model::traits_of(effect, {}).stands_for == StandsFor::link_geometry;
    return plain(effect) + (of_links ? " of " : " at ") + std::to_string(joints.size()) +
           (of_links ? " links" : " joints");
  }
  std::string text = plain(effect) + " at " + joints[0];
  for (std::size_t k = 1; k < joints.size(); ++k) text += (k + 1 < joints.size() ? ", " : " and ") + joints[k];
  return text;
}

static std::string in_words(const Cause& cause) {
  std::string text = effect_at(cause.effect, cause.joints);
  if (!cause.only || cause.only->confounded_with.empty()) return text;
  const Alternative& other = cause.only->confounded_with[0];
  if (other.probability > 0.0 && other.probability >= kContender * cause.only->probability)
    text += " (or " + (other.joints == cause.joints ? plain(other.effect) : effect_at(other.effect, other.joints)) +
            ": these data cannot tell)";
  return text;
}

bool may_be_of_machines(const Detectable& detectable) {
  const double plausible = model::traits_of(detectable.effect, {}).plausible;
  return !(plausible > 0.0 && detectable.size > plausible);
}

std::string answerable_questions(const Diagnosis& d) {
  std::vector<Cause> questions;
  double largest = 0.0;
  for (const Detectable& one : d.detectable) {
    if (!(one.size_at_tip < d.gap.rms) || !may_be_of_machines(one)) continue;
    auto question =
        std::find_if(questions.begin(), questions.end(), [&](const Cause& c) { return c.effect == one.effect; });
    if (question == questions.end()) question = questions.insert(question, Cause{one.effect, {}, 0.0, 0, nullptr});
    if (!one.joint.empty()) question->joints.push_back(one.joint);
    largest = std::max(largest, one.size_at_tip);
  }
  if (questions.empty()) return " Nor can these poses answer whether any single effect makes the gap.";
  std::stable_sort(questions.begin(), questions.end(),
                   [](const Cause& a, const Cause& b) { return a.joints.size() > b.joints.size(); });
  const std::size_t shown = std::min(questions.size(), kQuestions);
  std::string text;
  for (std::size_t k = 0; k < shown; ++k)
    text += (k == 0                      ? ""
             : k + 1 == questions.size() ? " or "
                                         : ", ") +
            effect_at(questions[k].effect, questions[k].joints);
  if (shown < questions.size()) text += " and " + std::to_string(questions.size() - shown) + " more";
  return " What these poses can answer is whether a single effect makes the gap: " + text + " would show from " +
         math::millimetres(largest) + " at the tip on.";
}

/// "link geometry of 6 links, joint compliance at J2 and J3, backlash at J6 and 2 smaller".
std::string largest_causes(const Diagnosis& d) {
  const std::vector<Cause> causes = causes_of(d);
  std::vector<std::string> shown;
  std::size_t letters = 0;
  for (const Cause& cause : causes) {
    const std::string words = in_words(cause);
    letters += words.size();
    if (!shown.empty() && (shown.size() == kCauses || letters > kRoom)) break;
    shown.push_back(words);
  }
  std::size_t smaller = 0;
  for (std::size_t k = shown.size(); k < causes.size(); ++k) smaller += causes[k].count;
  std::string text;
  for (std::size_t k = 0; k < shown.size(); ++k)
    text += (k == 0 ? "" : k + 1 == shown.size() && smaller == 0 ? " and " : ", ") + shown[k];
  return smaller == 0 ? text : text + " and " + std::to_string(smaller) + " smaller";
}

}  // namespace truing::diagnosis
