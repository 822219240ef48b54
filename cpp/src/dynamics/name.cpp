// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/name.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "dynamics/beside.hpp"
#include "dynamics/effects/families.hpp"
#include "dynamics/judge.hpp"
#include "dynamics/orders.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/remainder.hpp"
#include "estimation/confidence.hpp"
#include "math/batch.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kClassNats = 6.0;     ///< a rival within this many is in the class
constexpr double kClassR2 = 0.95;      ///< so is what can make the same torque
constexpr double kSameR2 = 0.5;        ///< what makes less of the torque is another matter
constexpr double kTempered = 0.5;      ///< no model is exact: half a nat counts for one
constexpr double kOtherLaws = 0.2;     ///< part of a joint's error that other laws than the catalogue's may well be
constexpr double kOwnR2 = 0.9;         ///< a free function that makes so much of a law's torque has the law's inputs
constexpr double kOwnPart = 0.5;       ///< of what a law removes: what it lacks itself removes less
constexpr double kUnknown = 0.5;       ///< so sure at least must be that there is what nobody knows
constexpr double kBlocksOfTime = 0.9;  ///< the most that folds of one recording are worth
constexpr double kMuchWorse = 1.5;     ///< a joint's error that is larger by this factor contradicts what was found
constexpr double kContradicted = 0.5;  ///< the most that names are worth which held-out recordings contradict

const TorqueGroup& group_of(const TorqueDesign& design, int g) { return design.groups[static_cast<std::size_t>(g)]; }

bool same_name(const TorqueGroup& a, const TorqueGroup& b) { return a.effect == b.effect && a.joints == b.joints; }

/// The choice less links, rotors and loads.
Choice without_masses(const TorqueDesign& design, const Choice& choice) {
  Choice out;
  for (std::size_t k = 0; k < choice.groups.size(); ++k) {
    if (group_of(design, choice.groups[k]).family == TorqueFamily::inertia) continue;
    out.groups.push_back(choice.groups[k]);
    out.scales.push_back(choice.scales[k]);
  }
  return out;
}

/// Everything about one chosen group.
class Naming {
 public:
  explicit Naming(const Account& account)
      : design_(*account.design),
        sums_(*account.sums),
        search_(*account.search),
        choice_(account.choice),
        state_(search_.state(choice_)),
        fit_(fit_of(sums_, state_.columns, state_.precision)),
        squares_(search_.squares_of_folds(choice_)) {}

  const Fit& fit() const { return fit_; }
  const Evidence::State& state() const { return state_; }

  /// Part of the error that a joint has without it which it removes on folds that were not fitted. All joints count
  /// alike in the sum of squares.
  double part_of_joint(std::size_t at) const {
    const VectorXd less = search_.squares_of_folds(Search::without(choice_, at));
    return std::max(0.0, (less - squares_).sum() / less.sum()) * search_.joints();
  }

  /// No law here is exact: what removes a small part may stand for something else.
  double not_another_law(std::size_t at) const {
    const double part = part_of_joint(at);
    return part * part / (part * part + kOtherLaws * kOtherLaws);
  }

  Posterior posterior(std::size_t at) const {
    const int g = choice_.groups[at];
    const TorqueGroup& mine = group_of(design_, g);
    const Choice rest = Search::without(choice_, at);
    const Evidence::State& less = search_.state(rest);
    // As gains are, so that rivals and the group itself are measured alike.
    const double loss = search_.evidence().gain(less, mine.columns, search_.cost(g)).score;
    const VectorXd theta = values_of(mine);
    std::set<std::pair<std::string, std::vector<std::string>>> seen;
    double in_class = 1.0, outside = std::exp(-kTempered * loss);
    std::vector<TorqueAlternative> confounded;
    std::vector<Evidence::Gain> gains = search_.gains(rest);
    std::sort(gains.begin(), gains.end(), [](const auto& a, const auto& b) { return a.score > b.score; });
    const auto explained_by = search_.evidence().explained(less, mine.columns, theta);
    for (const Evidence::Gain& gain : gains) {
      const TorqueGroup& other = group_of(design_, gain.group);
      if (other.effect.empty() || gain.rank == 0 || is_in(gain.group) || same_name(other, mine)) continue;
      if (!seen.insert({other.effect, other.joints}).second) continue;
      const double behind = loss - gain.score;
      const double weight = std::exp(-kTempered * std::max(behind, 0.0));
      const double r2 = explained_by(other.columns);
      if (r2 < kSameR2) continue;  // it explains something else
      if (behind < kClassNats || r2 > kClassR2) {
        confounded.push_back({other.effect, other.joints, weight});
        in_class += weight;
      } else if (behind < 25.0) {
        outside += weight;
      }
    }
    if (mine.family == TorqueFamily::inertia) add_one_scale(&in_class, &confounded);
    add_as_likely(mine, &in_class, &confounded);
    for (TorqueAlternative& alternative : confounded) alternative.probability *= 1.0 / (in_class + outside);
    return {in_class / (in_class + outside), std::move(confounded)};
  }

  /// Links, rotors and loads that are named beside each other may together be one factor of all drives' constants,
  /// which none of them looks like while the others stay.
  void add_one_scale(double* in_class, std::vector<TorqueAlternative>* confounded) const {
    const Evidence::State& less = search_.state(without_masses(design_, choice_));
    for (std::size_t g = 0; g < design_.groups.size(); ++g) {
      const TorqueGroup& other = design_.groups[g];
      const bool one_scale = other.joints.size() > 1 && is_alternative(other) && other.family == TorqueFamily::drive;
      const bool known = std::any_of(confounded->begin(), confounded->end(), [&](const TorqueAlternative& one) {
        return one.effect == other.effect && one.joints == other.joints;
      });
      if (!one_scale || known) continue;
      const int number = static_cast<int>(g);
      const double behind =
          state_.score - less.score - search_.evidence().gain(less, other.columns, search_.cost(number)).score;
      if (behind >= kClassNats) continue;
      const double weight = std::exp(-kTempered * std::max(behind, 0.0));
      confounded->push_back({other.effect, other.joints, weight});
      *in_class += weight;
    }
  }

  /// What the values that were found may as well be by the effect's own word (TorqueTerm::may_as_well_be).
  void add_as_likely(const TorqueGroup& mine, double* in_class, std::vector<TorqueAlternative>* confounded) const {
    std::map<std::string, double> values;
    for (const int c : fit_.columns) values[design_.terms[static_cast<std::size_t>(c)].parameter] = value_of(c);
    for (const int c : mine.columns) {
      const TorqueTerm& term = design_.terms[static_cast<std::size_t>(c)];
      const std::string other = term.may_as_well_be ? term.may_as_well_be(values) : "";
      const bool known = std::any_of(confounded->begin(), confounded->end(), [&](const TorqueAlternative& one) {
        return one.effect == other && one.joints == mine.joints;
      });
      const bool there = std::any_of(design_.groups.begin(), design_.groups.end(), [&](const TorqueGroup& group) {
        return group.effect == other && group.joints == mine.joints;
      });
      if (!there || known) continue;
      confounded->push_back({other, mine.joints, 1.0});
      *in_class += 1.0;
    }
  }

  /// That it, or one of its class, is there: what decides whether it is named.
  double sure(std::size_t at, const Posterior& posterior) const { return posterior.probability * not_another_law(at); }

  /// It is surer than not. No posterior is above one, and it takes longer to find.
  bool is_likely(std::size_t at) const { return not_another_law(at) >= kNamed && sure(at, posterior(at)) >= kNamed; }

  /// The named effect of whose law the free function number `at` is what the law lacks; null: of none. It makes the
  /// torque of the law as well, and removes less beside it than a part of what the law removes.
  const TorqueGroup* law_of(std::size_t at) const {
    const TorqueGroup& function = group_of(design_, choice_.groups[at]);
    const Choice laws = Search::without(choice_, at);
    const double rest = search_.squares_of_folds(laws).sum();
    for (std::size_t k = 0; k < laws.groups.size(); ++k) {
      const TorqueGroup& law = group_of(design_, laws.groups[k]);
      if (law.effect.empty() || law.joint != function.joint) continue;
      const Choice neither = Search::without(laws, k);
      const Evidence::State& state = search_.state(neither);
      if (search_.evidence().explained(state, law.columns, values_of(law), function.columns) < kOwnR2) continue;
      const double of_law = search_.squares_of_folds(neither).sum() - rest;
      if (rest - squares_.sum() < kOwnPart * of_law) return &law;
    }
    return nullptr;
  }

  VectorXd values_of(const TorqueGroup& group) const {
    VectorXd out(static_cast<Index>(group.columns.size()));
    for (Index k = 0; k < out.size(); ++k) out[k] = value_of(group.columns[static_cast<std::size_t>(k)]);
    return out;
  }

  double value_of(int column) const {
    const auto at = std::find(fit_.columns.begin(), fit_.columns.end(), column);
    return at == fit_.columns.end() ? 0.0 : fit_.values[static_cast<Index>(at - fit_.columns.begin())];
  }

  /// In units of the joints' noise: rms of the group's torque over all rows.
  double weighted_rms(const TorqueGroup& group) const {
    const VectorXd theta = values_of(group);
    const Gram gram = sums_.all.of(group.columns);
    return std::sqrt(std::max(0.0, theta.dot(gram.xx * theta)) / std::max(1.0, sums_.all.n));
  }

 private:
  bool is_alternative(const TorqueGroup& group) const {
    return design_.terms[static_cast<std::size_t>(group.columns.front())].only_alternative;
  }

  bool is_in(int g) const { return std::find(choice_.groups.begin(), choice_.groups.end(), g) != choice_.groups.end(); }

  const TorqueDesign& design_;
  const Sums& sums_;
  const Search& search_;
  const Choice& choice_;
  Evidence::State state_;
  Fit fit_;
  VectorXd squares_;  ///< of folds that were not fitted
};

/// What is asked when these of a choice's groups are named: the choice, and without what their names are judged.
std::vector<Choice> asked_for(const TorqueDesign& design, const Choice& choice, const std::vector<std::size_t>& at) {
  std::vector<Choice> out{choice, without_masses(design, choice)};
  for (const std::size_t k : at) out.push_back(Search::without(choice, k));
  return out;
}

/// Posteriors of these of an account's chosen groups, side by side.
std::vector<Posterior> posteriors_of(const Account& account, const Naming& naming, const std::vector<std::size_t>& at) {
  const Search& search = *account.search;
  search.look_ahead(asked_for(*account.design, account.choice, at), Search::Ahead::squares);
  search.share(account.choice);
  std::vector<Posterior> out(at.size());
  const auto ask = [&](std::size_t k) { out[k] = naming.posterior(at[k]); };
  math::for_each_on_threads(out.size(), search.threads(), {}, ask, 1);
  return out;
}

/// Fractions of the standard model's squares that the groups of a choice remove.
class Shares {
 public:
  explicit Shares(const Account& account)
      : account_(account), squares_(folds_and_held_out(account.choice)), standard_(folds_and_held_out({})) {}

  /// Of these groups together, with its interval over folds and held-out rows. `at`: ascending numbers.
  Share of(const std::vector<std::size_t>& at) const {
    Choice rest = account_.choice;
    for (auto one = at.rbegin(); one != at.rend(); ++one) rest = Search::without(rest, *one);
    const VectorXd gain = folds_and_held_out(rest) - squares_;
    Share out;
    out.value = gain.sum() / standard_.sum();
    const auto n = static_cast<double>(gain.size());
    const double spread = std::sqrt((gain.array() - gain.mean()).square().sum() / std::max(1.0, n - 1.0) * n);
    out.low = out.value - 1.645 * spread / standard_.sum();
    out.high = out.value + 1.645 * spread / standard_.sum();
    return out;
  }

 private:
  VectorXd folds_and_held_out(const Choice& choice) const {
    const Evidence::State& state = account_.search->state(choice);
    const VectorXd& folds = account_.search->squares_of_folds(choice);
    const std::vector<FoldGram>& held_out = account_.held_out;
    VectorXd out(folds.size() + static_cast<Index>(held_out.size()));
    out.head(folds.size()) = folds;
    for (std::size_t f = 0; f < held_out.size(); ++f)
      out[folds.size() + static_cast<Index>(f)] = Search::squares_on(held_out[f], state);
    return out;
  }

  const Account& account_;
  VectorXd squares_, standard_;
};

/// `all`: how many joints have a reading.
std::string at_joints(const std::vector<std::string>& joints, std::size_t all) {
  if (joints.empty()) return "";
  if (joints.size() > 2 && joints.size() == all) return " at all joints";
  if (joints.size() == 2) return " at " + joints[0] + " from " + joints[1];
  return " at " + listed(joints);
}

std::string sentence_of(const FoundTorqueEffect& found, std::size_t joints) {
  std::string out = found.plain + at_joints(found.joints, joints);
  out[0] = static_cast<char>(std::toupper(out[0]));
  std::vector<std::string> sizes;
  for (const Parameter& p : found.parameters) {
    if (p.frozen || sizes.size() >= 4) continue;
    sizes.push_back(number(p.value, 3) + " +- " + number(p.sigma, 2) + " " + p.unit);
  }
  if (!sizes.empty() && found.parameters.size() <= 6) out += ": " + listed(sizes);
  return out;
}

/// The joints' noise in Nm of the group's joint; of several joints the mean.
double noise_at(const std::vector<Noise>& noise, int joint) {
  if (joint >= 0) return noise[static_cast<std::size_t>(joint)].sigma;
  double sum = 0.0;
  for (const Noise& one : noise) sum += one.sigma;
  return sum / static_cast<double>(noise.size());
}

/// What is usual, by effect: one entry for all joints.
std::vector<FoundTorqueEffect> standard_effects(const Problem& problem, const Account& account, const Naming& naming,
                                                const std::vector<Noise>& noise) {
  std::vector<FoundTorqueEffect> out;
  if (problem.fitted_before) return out;
  const TorqueDesign& design = *account.design;
  for (const TorqueGroup& group : design.groups) {
    if (!group.standard || (account.inertias_given && is_inertial(group))) continue;
    auto at = std::find_if(out.begin(), out.end(), [&](const auto& e) { return e.effect == group.effect; });
    if (at == out.end()) {
      FoundTorqueEffect found;
      found.effect = group.effect;
      found.standard = true;
      found.probability = 1.0;
      out.push_back(std::move(found));
      at = out.end() - 1;
    }
    at->joints.insert(at->joints.end(), group.joints.begin(), group.joints.end());
    const std::vector<Parameter> more = parameters_of(design, group.columns, naming.fit());
    at->parameters.insert(at->parameters.end(), more.begin(), more.end());
    at->rms = std::max(at->rms, naming.weighted_rms(group) * noise_at(noise, group.joint));
  }
  for (FoundTorqueEffect& found : out) {
    found.plain = find_torque_effect(found.effect).traits.plain;
    found.sentence = found.plain + " at " + listed(found.joints);
  }
  return out;
}

/// A group of a choice, by its number there, as it is said.
struct NamedGroup {
  FoundTorqueEffect found;
  std::size_t at;
};

constexpr std::size_t kOneCause = 3;  ///< joints with the same effect, and more than half of all: one cause

/// Whether the same at many joints has one cause: grease that is cold, rotors that the file lacks. Links differ one by
/// one, and so do couplings.
bool may_be_one_cause(const TorqueGroup& group) {
  return group.joint >= 0 && group.joints.size() == 1 && !is_inertial(group);
}

/// What could stand in the place of all: the same effect at each of their joints; else what could in that of one.
std::vector<TorqueAlternative> alternatives_of(const std::vector<const FoundTorqueEffect*>& members,
                                               const std::vector<std::string>& joints) {
  std::vector<TorqueAlternative> out;
  std::map<std::string, std::vector<double>> everywhere;  // by effect, at the joint of the member itself
  for (const FoundTorqueEffect* member : members) {
    for (const TorqueAlternative& one : member->confounded_with)
      if (one.joints == member->joints) everywhere[one.effect].push_back(one.probability);
  }
  for (const auto& [effect, each] : everywhere) {
    if (each.size() < members.size()) continue;
    out.push_back({effect, joints, *std::min_element(each.begin(), each.end())});
  }
  for (const FoundTorqueEffect* member : members) {
    for (const TorqueAlternative& one : member->confounded_with) {
      const bool said = std::any_of(out.begin(), out.end(), [&](const TorqueAlternative& other) {
        return other.effect == one.effect && (other.joints == one.joints || other.joints == joints);
      });
      if (!said) out.push_back(one);
    }
  }
  return out;
}

/// Groups of one effect as one, by joint.
FoundTorqueEffect as_one(const TorqueDesign& design, const Choice& choice, const Shares& shares,
                         std::vector<NamedGroup> members) {
  const auto joint = [&](const NamedGroup& one) { return group_of(design, choice.groups[one.at]).joint; };
  std::sort(members.begin(), members.end(), [&](const auto& a, const auto& b) { return joint(a) < joint(b); });
  FoundTorqueEffect out;
  std::vector<std::size_t> at;
  std::vector<const FoundTorqueEffect*> each;
  for (const NamedGroup& one : members) {
    out.joints.push_back(one.found.joints.front());
    out.parameters.insert(out.parameters.end(), one.found.parameters.begin(), one.found.parameters.end());
    if (one.found.probability > out.probability) {
      out.probability = one.found.probability;
      out.grounds = one.found.grounds;
    }
    out.rms = std::max(out.rms, one.found.rms);
    if (out.plain.empty()) out.plain = one.found.plain;
    at.push_back(one.at);
    if (one.found.probability > 0.0) each.push_back(&one.found);
  }
  out.effect = members.front().found.effect;
  out.standard = members.front().found.standard;
  std::sort(at.begin(), at.end());
  out.share = shares.of(at);
  out.confounded_with = alternatives_of(each, out.joints);
  return out;
}

/// One effect of all joints at which groups of a choice are the same, in the place of its surest: as sure as this one.
/// `more`: those that are too small to be named alone; what is said beside the others leaves them.
std::vector<FoundTorqueEffect> together(const TorqueDesign& design, const Choice& choice, const Shares& shares,
                                        std::vector<NamedGroup> named, std::vector<NamedGroup>* more) {
  std::vector<FoundTorqueEffect> out;
  std::set<std::string> done;
  for (const NamedGroup& one : named) {
    const TorqueGroup& mine = group_of(design, choice.groups[one.at]);
    if (done.count(mine.effect) > 0 && may_be_one_cause(mine)) continue;
    const auto same = [&](const NamedGroup& other) {
      const TorqueGroup& group = group_of(design, choice.groups[other.at]);
      return may_be_one_cause(group) && group.effect == mine.effect;
    };
    std::vector<NamedGroup> members;
    std::copy_if(named.begin(), named.end(), std::back_inserter(members), same);
    std::set<std::string> possible;
    for (const TorqueGroup& group : design.groups)
      if (group.effect == mine.effect && may_be_one_cause(group)) possible.insert(group.joints.front());
    if (!may_be_one_cause(mine) || members.size() < kOneCause || 2 * members.size() <= possible.size()) {
      out.push_back(one.found);
      continue;
    }
    done.insert(mine.effect);
    std::copy_if(more->begin(), more->end(), std::back_inserter(members), same);
    more->erase(std::remove_if(more->begin(), more->end(), same), more->end());
    out.push_back(as_one(design, choice, shares, std::move(members)));
  }
  return out;
}

/// What speaks for a named effect, and against it. Weights: docs/method/exam.md, "The dynamic half".
std::vector<Ground> grounds_of(const Naming& naming, std::size_t at, const TorqueGroup& group,
                               const std::vector<UnknownTorque>& unknown) {
  constexpr double kLeast = 0.05, kMost = 2.0;  ///< of a joint's error
  const bool unknown_there = std::any_of(unknown.begin(), unknown.end(), [&](const UnknownTorque& u) {
    return std::find(group.joints.begin(), group.joints.end(), u.joint) != group.joints.end();
  });
  return {{"log_removed", std::log(std::clamp(naming.part_of_joint(at), kLeast, kMost) / kOtherLaws), 2.3},
          {"unknown_there", unknown_there ? 1.0 : 0.0, -2.0}};
}

std::vector<FoundTorqueEffect> found_effects(const Problem& problem, const Account& account, const Naming& naming,
                                             const std::vector<Noise>& noise, const std::vector<TorqueEffect>& own,
                                             const std::vector<UnknownTorque>& unknown,
                                             std::vector<std::string>* small) {
  std::vector<NamedGroup> named, too_small;
  const TorqueDesign& design = *account.design;
  const Choice& choice = account.choice;
  const Shares shares(account);
  for (std::size_t k = 0; k < choice.groups.size(); ++k) {
    const TorqueGroup& group = group_of(design, choice.groups[k]);
    FoundTorqueEffect found;
    found.effect = group.effect;
    found.joints = group.joints;
    found.standard = group.standard && !problem.fitted_before && !account.inertias_given;
    found.parameters = parameters_of(design, group.columns, naming.fit());
    found.share = shares.of({k});
    const Posterior& posterior = account.posteriors[k];
    found.confounded_with = posterior.confounded;
    if (naming.sure(k, posterior) < kNamed) {
      found.rms = naming.weighted_rms(group) * noise_at(noise, group.joint);
      too_small.push_back({std::move(found), k});
      continue;
    }
    const std::vector<Ground> grounds = grounds_of(naming, k, group, unknown);
    found.probability = confidence(posterior.probability, grounds);
    found.grounds = grounds_told(posterior.probability, grounds);
    if (problem.single) found.probability = std::min(found.probability, kBlocksOfTime);
    found.rms = naming.weighted_rms(group) * noise_at(noise, group.joint);
    found.plain = find_torque_effect(group.effect, own).traits.plain;
    named.push_back({std::move(found), k});
  }
  std::vector<FoundTorqueEffect> out = together(design, choice, shares, std::move(named), &too_small);
  for (FoundTorqueEffect& found : out) found.sentence = sentence_of(found, problem.robot.driven_count());
  for (const NamedGroup& one : too_small)
    small->push_back(one.found.effect + (one.found.joints.empty() ? "" : " at " + listed(one.found.joints)));
  // By share; but what nobody would have fitted anyway, and is likely, stands before what everybody does.
  const auto news = [&](const FoundTorqueEffect& e) {
    return e.probability >= 0.5 && !find_torque_effect(e.effect, own).traits.usual;
  };
  std::stable_sort(out.begin(), out.end(), [&](const auto& a, const auto& b) {
    return news(a) != news(b) ? news(a) : a.share.value > b.share.value;
  });
  return out;
}

std::string words_of_rest(const TorqueGroup& law, const UnknownTorque& rest) {
  return law.effect + (law.joints.empty() ? "" : " at " + listed(law.joints)) +
         " has not quite the law that was fitted: what is left goes with " + listed(rest.inputs);
}

/// `rest_of_laws`: what the laws of named effects lack is nothing unknown, and is said in words.
std::vector<UnknownTorque> unknown_of(const Account& account, const Naming& naming, const std::vector<Noise>& noise,
                                      bool single, std::vector<std::string>* rest_of_laws) {
  const TorqueDesign& design = *account.design;
  const Choice& choice = account.choice;
  const Shares shares(account);
  std::vector<std::size_t> functions;
  for (std::size_t k = 0; k < choice.groups.size(); ++k) {
    if (group_of(design, choice.groups[k]).effect.empty()) functions.push_back(k);
  }
  const std::vector<Posterior> posteriors = posteriors_of(account, naming, functions);
  std::vector<UnknownTorque> out;
  for (std::size_t f = 0; f < functions.size(); ++f) {
    const std::size_t k = functions[f];
    const TorqueGroup& group = group_of(design, choice.groups[k]);
    UnknownTorque unknown;
    unknown.joint = group.joints.front();
    unknown.inputs = group.inputs;
    unknown.share = shares.of({k});
    unknown.probability = naming.sure(k, posteriors[f]);
    if (unknown.probability < kUnknown) continue;
    if (const TorqueGroup* law = naming.law_of(k)) {
      rest_of_laws->push_back(words_of_rest(*law, unknown));
      continue;
    }
    if (single) unknown.probability = std::min(unknown.probability, kBlocksOfTime);
    unknown.rms = naming.weighted_rms(group) * noise_at(noise, group.joint);
    const std::vector<Parameter> knots = parameters_of(design, group.columns, naming.fit());
    const double width = (group.high - group.low) / std::max(1.0, static_cast<double>(knots.size()) - 1.0);
    for (std::size_t i = 0; width > 0.0 && i < knots.size(); ++i)
      unknown.curve.push_back({group.low + width * static_cast<double>(i), knots[i].value, knots[i].sigma});
    out.push_back(std::move(unknown));
  }
  return out;
}

/// Geometric mean over the joints of errors in parts of their torques' standard deviations: what is a tenth better at a
/// joint counts alike at all of them, and no joint that hardly has a torque decides for the others.
double mean_percent(const TorqueErrors& errors) {
  constexpr double kExact = 1e-9;  // [%]
  double logs = 0.0, n = 0.0;
  for (const TorqueError& e : errors.held_out) {
    if (!(e.n > 0.0)) continue;
    logs += std::log(std::max(e.percent, kExact));
    n += 1.0;
  }
  return std::exp(logs / std::max(n, 1.0));
}

/// " (or …: these recordings cannot tell)" of a cause at one joint, where another is not much less likely.
std::string or_else(const FoundTorqueEffect& found, std::size_t joints) {
  constexpr double kContender = 0.25;  // of the cause's probability
  const auto less = [](const TorqueAlternative& a, const TorqueAlternative& b) {
    return a.probability < b.probability;
  };
  const auto other = std::max_element(found.confounded_with.begin(), found.confounded_with.end(), less);
  if (found.joints.size() > 1 || other == found.confounded_with.end() ||
      other->probability < kContender * found.probability)
    return "";
  std::string name = other->effect;
  std::replace(name.begin(), name.end(), '_', ' ');
  const std::string where = other->joints == found.joints ? "" : at_joints(other->joints, joints);
  return " (or " + name + where + ": these recordings cannot tell)";
}

/// What was found, in plain words; and how many more.
std::string causes_of(const std::vector<FoundTorqueEffect>& effects, std::size_t joints) {
  std::string text;
  std::size_t named = 0, more = 0;
  for (const FoundTorqueEffect& e : effects) {
    if (e.standard) continue;
    if (++named > 3) {
      ++more;
      continue;
    }
    text += (text.empty() ? "" : "; ") + e.plain + at_joints(e.joints, joints) + or_else(e, joints);
  }
  return more > 0 ? text + "; and " + std::to_string(more) + " more" : text;
}

/// What stands beside what was named, in words.
std::string words_of_usual(const Problem& problem, const Account& account) {
  if (problem.fitted_before) return "the robot's model";
  if (account.inertias_given) return "the file's model with friction and an offset";
  return "standard practice (inertias, Coulomb and viscous friction, an offset)";
}

std::string verdict_sentence(const TorqueDiagnosis& d, const std::string& usual, std::size_t joints) {
  const auto percent = [](double value) { return number(value, 2) + " %"; };
  if (d.verdict == Verdict::does_not_hold) return "What was found does not hold on recordings it never saw.";
  const std::string causes = causes_of(d.effects, joints);
  if (!causes.empty()) {
    return "The error of held-out torques falls from " + percent(d.without_names) + ", which " + usual +
           " leaves, to " + percent(mean_percent(d.errors[2])) + " of their standard deviation: " + causes + ".";
  }
  return d.unknown.empty() ? "No gap beyond noise is left by " + usual + "."
                           : "What " + usual + " leaves goes with inputs that no known effect explains.";
}

/// Worse than `before`, or clearly worse than standard practice (errors[1]), on recordings that were not fitted: it
/// does not hold. Standard practice may have inertias that are free where names have few: then it is as good as what is
/// true. Nor does it where a single joint is much worse.
bool holds(const TorqueErrors& named, const TorqueErrors& before, const TorqueErrors& standard) {
  if (mean_percent(named) > std::min(mean_percent(before), kWorse * mean_percent(standard))) return false;
  for (std::size_t j = 0; j < named.held_out.size(); ++j) {
    const double least = std::min(before.held_out[j].percent, standard.held_out[j].percent);
    if (named.held_out[j].percent > kMuchWorse * least) return false;
  }
  return true;
}

Verdict verdict_of(const TorqueDiagnosis& d, const TorqueErrors& before, bool any) {
  if (any && !holds(d.errors[2], before, d.errors[1])) return Verdict::does_not_hold;
  if (any) return d.unknown.empty() ? Verdict::effects : Verdict::effects_and_unknown;
  return d.unknown.empty() ? Verdict::none : Verdict::unknown;
}

/// Inherent: what is weighed by its torque is known as well as the drives' constants are.
void add_scale_of_masses(const std::vector<FoundTorqueEffect>& effects, const std::vector<TorqueEffect>& own,
                         std::vector<TorqueClass>* out) {
  TorqueClass one;
  for (const FoundTorqueEffect& found : effects) {
    if (!found.standard && find_torque_effect(found.effect, own).traits.family == TorqueFamily::inertia)
      one.effects.push_back(found.effect);
  }
  const bool constant = std::any_of(effects.begin(), effects.end(), [&](const FoundTorqueEffect& found) {
    return find_torque_effect(found.effect, own).traits.scales_masses;
  });
  if (one.effects.empty() && !constant) return;
  for (const TorqueEffect& effect : torque_catalogue()) {
    if (effect.traits.scales_masses) one.effects.push_back(effect.name);
  }
  one.sentence =
      "Masses and the drives' constants share one scale: with constants that are 10 % larger, all masses and inertias "
      "are 10 % larger. A payload of known mass tells.";
  out->push_back(std::move(one));
}

std::vector<TorqueClass> classes_of(const std::vector<FoundTorqueEffect>& effects, const std::vector<TorqueEffect>& own,
                                    bool scale_is_known) {
  std::vector<TorqueClass> out;
  if (!scale_is_known) add_scale_of_masses(effects, own, &out);
  const auto name = [](const std::string& effect, const std::vector<std::string>& joints) {
    std::string text = effect;
    for (std::size_t k = 0; k < joints.size(); ++k) text += (k == 0 ? ":" : "+") + joints[k];
    return text;
  };
  for (const FoundTorqueEffect& found : effects) {
    if (found.confounded_with.empty()) continue;
    TorqueClass one;
    one.effects.push_back(name(found.effect, found.joints));
    for (const TorqueAlternative& other : found.confounded_with)
      one.effects.push_back(name(other.effect, other.joints));
    one.sentence = "These recordings cannot tell apart: " + listed(one.effects);
    out.push_back(std::move(one));
  }
  return out;
}

/// An account's fit as it is handed over: of bodies that there can be.
Fit bodies_of(const Problem& problem, const Account& account, const Naming& naming,
              std::vector<std::string>* warnings) {
  if (problem.fitted_before) return naming.fit();
  return with_bodies(problem.robot, *account.design, *account.sums, naming.fit(), warnings);
}

/// The robot with its groundwork, where it had none, and with further groups. `inertias_given`: the groundwork has no
/// inertias.
Robot with_groundwork(const Problem& problem, const TorqueDesign& design, const Fit& fit, std::vector<int> groups,
                      bool inertias_given) {
  for (std::size_t g = 0; g < design.groups.size() && !problem.fitted_before; ++g) {
    const TorqueGroup& group = design.groups[g];
    if (group.standard && !(inertias_given && is_inertial(group))) groups.push_back(static_cast<int>(g));
  }
  std::sort(groups.begin(), groups.end());
  return applied(problem.robot, design, groups, fit, problem.range);
}

/// Groups of a choice that are effects.
std::vector<int> effects_in(const Choice& choice, const TorqueDesign& design) {
  std::vector<int> out;
  std::copy_if(choice.groups.begin(), choice.groups.end(), std::back_inserter(out),
               [&](int g) { return !group_of(design, g).effect.empty(); });
  return out;
}

/// The robot and the free functions, as a model.
TorqueModel with_free_functions(const Problem& problem, const Robot& robot, const TorqueDesign& design,
                                const Fit& fit) {
  std::vector<ValuedTerm> functions;
  for (const TorqueGroup& group : design.groups) {
    if (!group.effect.empty()) continue;
    for (std::size_t k = 0; k < fit.columns.size(); ++k) {
      if (std::find(group.columns.begin(), group.columns.end(), fit.columns[k]) != group.columns.end())
        functions.push_back(
            {design.terms[static_cast<std::size_t>(fit.columns[k])], fit.values[static_cast<Index>(k)]});
    }
  }
  return model_of(robot, problem).with(functions);
}

/// The robot of an account with this fit.
Robot robot_of(const Problem& problem, const Account& account, const Fit& fit) {
  return with_groundwork(problem, *account.design, fit, effects_in(account.choice, *account.design),
                         account.inertias_given);
}

std::vector<Parameter> parameters_in(const std::vector<FoundTorqueEffect>& effects) {
  std::vector<Parameter> out;
  for (const FoundTorqueEffect& effect : effects)
    out.insert(out.end(), effect.parameters.begin(), effect.parameters.end());
  return out;
}

/// The model without anything that was named.
TorqueModel without_names(const Problem& problem, const Account& account) {
  const Evidence::State state = account.search->state({});
  const Fit fit = fit_of(*account.sums, state.columns, state.precision);
  return problem.nominal.with(valued(*account.design, fit));
}

/// Whether without number `at` another one is likely that is not so beside it.
bool hides_another(const Account& account, const std::vector<double>& sure, std::size_t at) {
  Account less = account;
  less.choice = Search::without(account.choice, at);
  const Naming then(less);
  for (std::size_t k = 0; k < less.choice.groups.size(); ++k) {
    if (sure[k < at ? k : k + 1] < kNamed && then.is_likely(k)) return true;
  }
  return false;
}

/// The first of the unlikely ones that hides another. `sure`: how sure each of the choice is.
std::optional<std::size_t> first_that_hides(const Account& account, const std::vector<double>& sure,
                                            const std::vector<std::size_t>& unlikely) {
  if (unlikely.size() < 2) return {};
  std::vector<Choice> asked;
  for (const std::size_t at : unlikely) {
    std::vector<std::size_t> others;
    for (const std::size_t k : unlikely)
      if (k != at) others.push_back(k < at ? k : k - 1);
    for (Choice& one : asked_for(*account.design, Search::without(account.choice, at), others))
      asked.push_back(std::move(one));
  }
  account.search->look_ahead(asked, Search::Ahead::squares);
  std::atomic<std::size_t> first{unlikely.size()};
  const auto ask = [&](std::size_t k) {
    if (k > first || !hides_another(account, sure, unlikely[k])) return;
    for (std::size_t known = first; k < known && !first.compare_exchange_weak(known, k);) {
    }
  };
  math::for_each_on_threads(unlikely.size(), account.search->threads(), {}, ask, 1);
  if (first == unlikely.size()) return {};
  return unlikely[first];
}

}  // namespace

void leave_out_what_hides(Account* account) {
  for (;;) {
    const Naming naming(*account);
    std::vector<std::size_t> all(account->choice.groups.size()), unlikely;
    std::iota(all.begin(), all.end(), 0);
    account->posteriors = posteriors_of(*account, naming, all);
    std::vector<double> sure;
    for (const std::size_t k : all) {
      sure.push_back(naming.sure(k, account->posteriors[k]));
      if (sure[k] < kNamed) unlikely.push_back(k);
    }
    std::sort(unlikely.begin(), unlikely.end(), [&](std::size_t a, std::size_t b) { return sure[a] < sure[b]; });
    const std::optional<std::size_t> at = first_that_hides(*account, sure, unlikely);
    if (!at) return;
    account->choice = Search::without(account->choice, *at);
  }
}

namespace {

/// Squares on held-out recordings.
double held_out_squares(const Account& account, const Choice& choice) {
  const Evidence::State& state = account.search->state(choice);
  double out = 0.0;
  for (const FoldGram& fold : account.held_out) out += Search::squares_on(fold, state);
  return out;
}

/// Whether held-out recordings hold anything of a group: a joint may rest in them.
bool is_in_held_out(const Account& account, const TorqueGroup& group) {
  return std::any_of(account.held_out.begin(), account.held_out.end(),
                     [&](const FoldGram& fold) { return fold.of(group.columns).xx.trace() > 0.0; });
}

}  // namespace

// The worst one first: of two that do the same neither gains while the other is in.
Choice without_functions_that_fail(Account account, double least_gain) {
  const double least = least_gain / static_cast<double>(account.search->joints());  // as folds are asked
  for (;;) {
    const double all = held_out_squares(account, account.choice);
    std::size_t worst = account.choice.groups.size();
    double worst_part = least;
    for (std::size_t k = 0; k < account.choice.groups.size(); ++k) {
      const TorqueGroup& group = group_of(*account.design, account.choice.groups[k]);
      if (!group.effect.empty() || !is_in_held_out(account, group)) continue;
      const double less = held_out_squares(account, Search::without(account.choice, k));
      const double part = (less - all) / std::max(less, 1e-300);
      if (part > worst_part) continue;
      worst = k;
      worst_part = part;
    }
    if (worst == account.choice.groups.size()) return account.choice;
    account.choice = Search::without(account.choice, worst);
  }
}

std::pair<Choice, Choice> likely_and_small(const Account& account, const Choice& same) {
  const Naming naming(account);
  Choice likely, small;
  for (std::size_t k = 0; k < same.groups.size(); ++k) {
    Choice& to = naming.sure(k, account.posteriors[k]) >= kNamed ? likely : small;
    to.groups.push_back(same.groups[k]);
    to.scales.push_back(same.scales[k]);
  }
  return {likely, small};
}

namespace {

/// A model with something that has no name, and the joints at which it helps.
struct Beyond {
  std::vector<std::size_t> joints;
  std::optional<TorqueModel> model{};  ///< none: nowhere
};

/// Free functions that help, and all that was fitted with these. `model`: the named robot's, over whose torque
/// functions of the load were fitted.
Beyond functions_beyond(const Problem& problem, Account functions, const TorqueModel& model, double least_gain) {
  functions.choice = with_functions_that_help(problem, functions, model, least_gain);
  std::set<std::size_t> joints;
  for (const int g : functions.choice.groups) {
    const TorqueGroup& group = group_of(*functions.design, g);
    if (group.effect.empty()) joints.insert(static_cast<std::size_t>(group.joint));
  }
  if (joints.empty()) return {};
  const Naming naming(functions);
  std::vector<std::string> said_already;
  const Robot robot = robot_of(problem, functions, bodies_of(problem, functions, naming, &said_already));
  return {{joints.begin(), joints.end()},
          with_free_functions(problem, robot, *functions.design, naming.fit()).seeing(model)};
}

/// A remainder at other joints at which it helps. `handed_over`: the account's fit.
Beyond remainders_beyond(const Problem& problem, const Account& account, const Fit& handed_over,
                         const TorqueModel& model, const std::vector<std::size_t>& but) {
  // So many columns bend to anything, and blocks of a single recording have more in common than recordings.
  const double least_gain = problem.single ? 0.1 : 0.05;
  Beyond out;
  std::vector<ValuedTerm> terms;
  for (const Remainder& one : remainders_beside(account, handed_over, least_gain)) {
    if (std::find(but.begin(), but.end(), one.joint) != but.end()) continue;
    out.joints.push_back(one.joint);
    terms.insert(terms.end(), one.terms.begin(), one.terms.end());
  }
  if (!out.joints.empty()) out.model = model.with(terms).seeing(model);
  return out;
}

/// Joints take their errors with another model.
void take_errors(const TorqueErrors& with, const std::vector<std::size_t>& joints, TorqueErrors* out) {
  for (const std::size_t j : joints) {
    out->held_out[j] = with.held_out[j];
    out->in_motion[j] = with.in_motion[j];
    out->train[j] = with.train[j];
  }
}

/// Errors of the nominal robot, of standard practice, of the named robot, and of this with what has no name at joints
/// where that helps. Returns those without names: of `unnamed`; null: of standard practice.
TorqueErrors say_errors(const Problem& problem, const TorqueModel& standard, const TorqueModel& named,
                        const std::vector<Beyond>& unknown, const TorqueModel* unnamed,
                        std::vector<TorqueErrors>* out) {
  std::vector<std::pair<std::string, TorqueModel>> models{
      {"nominal", problem.nominal}, {"standard", standard}, {"named", named}};
  const std::size_t said = models.size();
  if (unnamed) models.emplace_back("without_names", *unnamed);
  for (const Beyond& one : unknown)
    if (one.model) models.emplace_back("with_unknown", *one.model);
  const std::vector<TorqueErrors> errors = errors_of(problem, models);
  *out = {errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(said)};
  out->push_back(out->back());
  out->back().model = "with_unknown";
  std::size_t next = unnamed ? said + 1 : said;
  for (const Beyond& one : unknown)
    if (one.model) take_errors(errors[next++], one.joints, &out->back());
  return unnamed ? errors[said] : errors[1];
}

}  // namespace

TorqueDiagnosis named(const Problem& problem, const Groundwork& groundwork, const Account& account,
                      const std::vector<Noise>& noise, const Account& functions,
                      const std::vector<Noise>& noise_of_functions, double least_gain) {
  const std::vector<TorqueEffect>& own = problem.own_effects;
  const Naming naming(account), all(functions);
  TorqueDiagnosis out;
  out.warnings = problem.warnings;
  std::vector<std::string> small;
  out.unknown = unknown_of(functions, all, noise_of_functions, problem.single, &out.warnings);
  out.effects = found_effects(problem, account, naming, noise, own, out.unknown, &small);
  if (!small.empty()) {
    out.warnings.push_back("fitted, and too small to be named, as something else may look so: " + listed(small));
  }
  const bool any = !out.effects.empty();
  for (FoundTorqueEffect& standard : standard_effects(problem, account, naming, noise))
    out.effects.push_back(std::move(standard));
  out.covariance = covariance_of(*account.design, naming.fit(), parameters_in(out.effects));
  // Errors are those of the robot that is handed over.
  const Account& handed_over = account.freed ? *account.freed : account;
  const Fit fit = bodies_of(problem, handed_over, Naming(handed_over), &out.warnings);
  out.robot = robot_of(problem, handed_over, fit);
  const TorqueModel model = model_of(out.robot, problem);
  const Beyond by_functions = functions_beyond(problem, functions, model, least_gain);
  const Beyond by_remainders = remainders_beyond(problem, handed_over, fit, model, by_functions.joints);
  for (const std::size_t j : by_remainders.joints) out.remainders.push_back(driven_name(problem.robot, j));
  std::optional<TorqueModel> unnamed;
  if (account.inertias_given) unnamed = without_names(problem, account);
  const TorqueErrors before = say_errors(problem, groundwork.model, model, {by_functions, by_remainders},
                                         unnamed ? &*unnamed : nullptr, &out.errors);
  out.without_names = mean_percent(before);
  out.verdict = verdict_of(out, before, any);
  out.sentence = verdict_sentence(out, words_of_usual(problem, account), problem.robot.driven_count());
  const std::vector<std::string> worse = worse_joints(out.errors[1], out.errors[2]);
  if (!problem.fitted_before && !worse.empty())
    out.warnings.push_back(
        "on held-out recordings standard practice, with inertias that are all free, is better than "
        "what was found at " +
        listed(worse));
  if (account.freed && out.verdict != Verdict::does_not_hold)
    out.warnings.push_back(
        "the robot that is handed over has the inertias of all links fitted beside what is named: the named links "
        "alone explain the torques with masses that no body has, and folds gain by it");
  if (out.verdict == Verdict::does_not_hold) {
    for (FoundTorqueEffect& e : out.effects)
      if (!e.standard) e.probability = std::min(e.probability, kContradicted);
    for (UnknownTorque& u : out.unknown) u.probability = std::min(u.probability, kContradicted);
    std::vector<std::string> said_already;
    const Fit bodies = problem.fitted_before ? groundwork.fit
                                             : with_bodies(problem.robot, groundwork.design, groundwork.sums,
                                                           groundwork.fit, &said_already);
    out.robot = with_groundwork(problem, groundwork.design, bodies, {}, false);
  }
  out.where = regimes_of(problem, groundwork.model, model);
  out.orders = orders_left(problem, model);
  out.classes = classes_of(out.effects, own, payload_varies(problem.range));
  out.not_testable = account.design->not_testable;
  out.traces = traces_of(problem, groundwork.model, model);
  out.cutoff = problem.tiles.options().cutoff;
  for (const Noise& one : noise) out.design_effect.push_back(one.design_effect);
  out.held_out = problem.held_out;
  return out;
}

}  // namespace truing::dynamics
