// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Which experiment tells two effects apart. What effects say of themselves, in words.

#include <algorithm>

#include "model/effects/traits.hpp"

namespace truing::model {
namespace {

bool is_needed(Experiment experiment, const Recorded& recorded) {
  if (experiment == Experiment::both_directions) return !recorded.direction;
  if (experiment == Experiment::orientations) return !recorded.orientation;
  return true;
}

/// Why one of them, at the same joint, is contained in the other; empty: it is not.
std::string why_contained(const EffectAt& small, const EffectAt& large) {
  if (small.joints != large.joints) return "";
  for (const ContainedIn& container : small.effect->traits.contained_in) {
    if (container.effect == large.effect->name && container.how != Containment::look_alike) return container.why;
  }
  return "";
}

/// The most telling experiment that either names for the other.
SeparatedBy most_telling(const Effect& a, const Effect& b, const Recorded& recorded) {
  SeparatedBy best;
  for (const auto& [mine, other] : {std::make_pair(&a, &b), std::make_pair(&b, &a)}) {
    for (const SeparatedBy& by : mine->traits.separated_by) {
      const bool meant = by.from.empty() || by.from == other->name;
      if (meant && by.experiment < best.experiment && is_needed(by.experiment, recorded)) best = by;
    }
  }
  return best;
}

std::string text_of(const SeparatedBy& by, const Recorded& recorded, const std::string& where_they_differ) {
  switch (by.experiment) {
    case Experiment::own_words:
      return by.words;
    case Experiment::both_directions:
      return "approach the same poses from both sides (column dir)";
    case Experiment::scale_bar:
      return "measure a scale bar of known length";
    case Experiment::warm_up_and_cool_down:
      return "measure during warm-up and cool-down, or touch a fixed nest again and again";
    case Experiment::more_temperatures:
      return "measure at more temperatures, and further apart";
    case Experiment::fixed_points_again:
      return "measure fixed points again and again";
    case Experiment::target_on_elbow:
      return "put a target on the elbow, or measure orientations";
    case Experiment::another_payload:
      return recorded.payload ? "repeat the same poses with another payload"
                              : "repeat the same poses with another payload (column payload)";
    case Experiment::full_range:
      return "use the joint's full range, both turns";
    case Experiment::orientations:
      return "measure orientations as well";
    case Experiment::where_they_differ:
      break;
  }
  return where_they_differ;
}

}  // namespace

bool is_contained(const EffectTraits& small, const std::string& large, Containment how) {
  return std::any_of(small.contained_in.begin(), small.contained_in.end(),
                     [&](const ContainedIn& in) { return in.effect == large && in.how == how; });
}

std::string separated_by(const EffectAt& a, const EffectAt& b, const Recorded& recorded,
                         const std::string& where_they_differ) {
  const SeparatedBy by = most_telling(*a.effect, *b.effect, recorded);
  for (const auto& [small, large] : {std::make_pair(&a, &b), std::make_pair(&b, &a)}) {
    const std::string why = why_contained(*small, *large);
    if (!why.empty() && by.experiment > Experiment::both_directions) return "no measurement; " + why;
  }
  return text_of(by, recorded, where_they_differ);
}

}  // namespace truing::model
