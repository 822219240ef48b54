// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Orders of gears in the search: as candidates beside all others, one order at all of its joints together.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "diagnosis/diagnosis.hpp"
#include "math/text.hpp"
#include "model/effects/traits.hpp"

namespace truing::diagnosis {
namespace {

constexpr double kFirstNats = 5.0;          // beyond the threshold, that the first order of a robot must win
constexpr int kMostOrders = 12;             // taken or tried in one go
constexpr std::size_t kMostPassedOver = 6;  // in one go: then what is left is no order
constexpr std::size_t kColumnsOfOthers = 12;

const Effect& family() {
  return effect_that([](const EffectTraits& traits) { return traits.search == Search::by_order; });
}

std::vector<std::string> names_of(const Robot& robot, const std::vector<std::size_t>& joints) {
  std::vector<std::string> out;
  for (const std::size_t joint : joints) out.push_back(robot.joints[joint].name);
  return out;
}

std::string note_of(const OrderAt& order) {
  std::string text =
      "the order " + number(order.order) + " per turn was found by trying " + std::to_string(order.tried);
  if (order.high > order.low)
    text += "; " + number(order.low) + " to " + number(order.high) + " per turn fit about as well";
  return text;
}

Explanation explanation_of(const OrderAt& order, const Robot& robot, const Measurements& data) {
  const Effect effect = transmission_error(order.order);
  Explanation e;
  e.effect = effect.name;
  e.joints = names_of(robot, order.joints);
  e.requests = {{e.effect, e.joints}};
  for (const std::size_t joint : order.joints) {
    for (const Term& term : effect.terms(robot, joint, data)) e.parameters.push_back(term.parameter);
  }
  if (order.joints.size() == 1) e.driver = input_name(effect.traits.driver, order.joints[0]);
  e.period = kTwoPi / order.order;
  return e;
}

Design::Rows columns_of(const Work& work, const OrderAt& order) {
  const Design& design = work.design;
  Design::Rows out(design.x.rows(), static_cast<Eigen::Index>(2 * order.joints.size()));
  Eigen::Index at = 0;
  for (const std::size_t joint : order.joints) {
    const int motion = input_named(work, input_name(Driver::angle, joint));
    const std::vector<double>& angle = work.inputs[static_cast<std::size_t>(motion)].values;
    for (Eigen::Index i = 0; i < out.rows(); ++i) {
      const double q = angle[static_cast<std::size_t>(design.row[static_cast<std::size_t>(i)])];
      const double d = design.x(i, design.joint_column[joint][0]);
      out(i, at) = d * std::cos(order.order * q);
      out(i, at + 1) = d * std::sin(order.order * q);
    }
    at += 2;
  }
  return out;
}

/// The orders that stand for an order where a joint's angles repeat: |order + n repeats|.
std::string stand_for_each_other(double order, double repeats) {
  std::set<double> all;
  for (int n = -40; n <= 40; ++n) {
    const double other = std::abs(order + n * repeats);
    if (other >= kLowestOrder && other <= kHighestOrder) all.insert(std::round(10.0 * other) / 10.0);
  }
  std::vector<std::string> some;
  for (const double other : all) {
    if (some.size() < 6) some.push_back(number(other, 4));
  }
  return listed(some) + (all.size() > some.size() ? " …" : "");
}

std::string why_not_told_apart(double repeats, const std::vector<std::string>& joints) {
  constexpr double kExample = 100.0;
  return listed(joints) + " stood at angles " + number(360.0 / repeats, 3) + " deg apart: orders that differ by " +
         number(repeats, 4) + " per turn, or add up to it, make the same motion (" +
         stand_for_each_other(kExample, repeats) + "); measure at angles on no grid";
}

/// Chance that one of the gears' ratios explains half of a function of so many angles that no gear makes: six values of
/// waves at the ratio, half and twice explain a fraction s of `angles` - 1 independent ones with the density of Beta(3,
/// (angles - 7) / 2).
double chance_of_half(std::size_t angles) {
  constexpr double kRatios = 161.0 - 30.0 + 1.0;
  if (angles <= 8) return 1.0;
  const double b = 0.5 * (static_cast<double>(angles) - 7.0);
  return std::min(1.0, kRatios * std::pow(0.5, b) * (1.0 + 0.5 * b + 0.125 * b * (b + 1.0)));
}

}  // namespace

void say_where_any_function_looks_like_a_gear(const Work& work, const Robot& robot, Diagnosis* out) {
  for (const UnknownEffect& unknown : out->unknown) {
    for (const Sampling& sampling : work.samplings) {
      if (robot.joints[sampling.joint].name != unknown.joint || sampling.repeats > 0.0) continue;
      const std::vector<std::string> own_angle = {input_name(Driver::angle, sampling.joint)};
      if (unknown.inputs != own_angle || sampling.angles <= kFewAngles || chance_of_half(sampling.angles) < 1.0)
        continue;
      out->not_testable.push_back({family().name,
                                   {unknown.joint},
                                   unknown.joint + " stood at " + std::to_string(sampling.angles) +
                                       " angles only and errs as a function of them: at so few some gear ratio "
                                       "explains half of whatever a joint does; measure where angles do not repeat",
                                   Untestable::other});
    }
  }
}

void say_what_angles_cannot_show(const std::vector<Sampling>& samplings, const Robot& robot,
                                 std::vector<NotTestable>* out) {
  std::vector<std::size_t> short_ones;
  std::map<double, std::vector<std::size_t>> on_grids;  // by what their orders repeat by
  double lowest = 0.0;
  for (const Sampling& sampling : samplings) {
    const std::string& joint = robot.joints[sampling.joint].name;
    if (sampling.angles <= kFewAngles) {
      out->push_back({family().name,
                      {joint},
                      joint + " stood at " + std::to_string(sampling.angles) +
                          " angles only: any order makes the same motion as any other",
                      Untestable::other});
    } else if (sampling.travel > kMostTravel) {
      out->push_back({family().name,
                      {joint},
                      joint + " moved over " + number(sampling.travel / kTwoPi, 3) +
                          " turns: orders are looked for over " + number(kMostTravel / kTwoPi, 2) +
                          " at most; are its angles in the right unit?",
                      Untestable::other});
    } else if (sampling.repeats > 0.0) {
      on_grids[std::round(10.0 * sampling.repeats) / 10.0].push_back(sampling.joint);
    } else if (sampling.lowest > kLowestOrder) {
      short_ones.push_back(sampling.joint);
      lowest = std::max(lowest, sampling.lowest);
    }
  }
  for (const auto& [repeats, joints] : on_grids) {
    const std::vector<std::string> names = names_of(robot, joints);
    out->push_back({family().name, names, why_not_told_apart(repeats, names), Untestable::other});
  }
  if (short_ones.empty()) return;
  const std::vector<std::string> names = names_of(robot, short_ones);
  out->push_back({family().name, names,
                  listed(names) + (names.size() == 1 ? " turns" : " turn") +
                      " too little for two whole waves of orders below " + number(std::ceil(lowest)) + " per turn",
                  Untestable::other});
}

Gears::Gears(Work* work, const Robot& robot)
    : work_(work), robot_(robot), wanted_(!is_left_out(work->given.options, family().name)) {}

OrderAt Gears::best(const Evidence& evidence, const Evidence::State& state) {
  if (!wanted_) return {};
  keep_what_is_in(state);
  return OrderScan(work_->design, evidence, state, work_->inputs, work_->samplings, work_->noise.design_effect,
                   work_->given.options.threads)
      .best(known_, passed_over_);
}

/// What the search has dropped since is known no more.
void Gears::keep_what_is_in(const Evidence::State& state) {
  for (std::size_t k = known_.size(); k-- > 0;) {
    if (std::find(state.choice.groups.begin(), state.choice.groups.end(), groups_[k]) != state.choice.groups.end())
      continue;
    known_.erase(known_.begin() + static_cast<std::ptrdiff_t>(k));
    groups_.erase(groups_.begin() + static_cast<std::ptrdiff_t>(k));
  }
}

bool Gears::wins(const OrderAt& order, const SearchOptions& search) const {
  return !order.joints.empty() && order.score > search.threshold + (known_.empty() ? kFirstNats : 0.0);
}

/// The order and others that stand for it, as candidates; the place of its group.
int Gears::append_candidates(const OrderAt& order) {
  auto& candidates = work_->design.candidates;
  const auto add = [&](const OrderAt& one, const std::string& note) {
    Explanation e = explanation_of(one, robot_, work_->given.data);
    e.note = note;
    append(work_, std::move(e), columns_of(*work_, one), std::max(0.0, order.nats - order.score));
  };
  add(order, note_of(order));
  const int group = static_cast<int>(candidates.groups.size()) - 1;
  std::size_t columns = 0;
  for (const double other : order.stands_for) {
    columns += 2 * order.joints.size();
    if (columns > kColumnsOfOthers) break;
    OrderAt one = order;
    one.order = other;
    add(one, "");
    candidates.groups.back().shadow = true;
  }
  extend_grams(work_->design, work_->noise.design_effect, &work_->grams);
  return group;
}

/// Columns of a candidate that is none any more leave their names to others.
void Gears::rename(std::size_t group, const std::string& suffix) {
  const std::vector<int>& columns = work_->design.candidates.groups[group].columns;
  for (std::size_t k = 0; k < columns.size(); ++k)
    work_->design.column_names[static_cast<std::size_t>(columns[k])] =
        work_->design.candidates.named[group].parameters[k] + suffix;
}

/// From `first` on these candidates are none.
void Gears::withdraw(std::size_t first, std::size_t last) {
  for (std::size_t g = first; g < last; ++g) {
    rename(g, "-");
    work_->design.candidates.groups[g].columns.clear();
  }
}

/// A group and the orders that stand for it, which follow it.
void Gears::withdraw_with_others(std::size_t group) { withdraw(group, group + 1 + others_behind(group)); }

std::size_t Gears::others_behind(std::size_t group) const {
  const auto& candidates = work_->design.candidates;
  std::size_t count = 0;
  for (std::size_t g = group + 1; g < candidates.groups.size(); ++g, ++count) {
    if (!candidates.groups[g].shadow || !(candidates.named[g].period > 0.0)) break;
  }
  return count;
}

bool Gears::take_one(OrderAt order, Decision* decision) {
  auto& groups = work_->design.candidates.groups;
  const std::size_t before = groups.size();
  // The same order at further joints is one effect with what is in already.
  Choice rest = decision->state.choice;
  std::size_t same = 0;
  while (same < known_.size() && std::abs(known_[same].order - order.order) > 1e-9) ++same;
  if (same < known_.size()) {
    order.joints.insert(order.joints.end(), known_[same].joints.begin(), known_[same].joints.end());
    std::sort(order.joints.begin(), order.joints.end());
    const auto at = std::find(rest.groups.begin(), rest.groups.end(), groups_[same]) - rest.groups.begin();
    rest = without(rest, groups, static_cast<std::size_t>(at));
    order.nats += known_[same].nats;
    order.score += known_[same].score;
    rename(static_cast<std::size_t>(groups_[same]), "-");
  }
  // What the search has dropped, or what stood for another order, may come again, at another price.
  const Explanation wanted = explanation_of(order, robot_, work_->given.data);
  for (std::size_t g = 0; g < before; ++g) {
    const bool is_in = std::find(decision->state.choice.groups.begin(), decision->state.choice.groups.end(),
                                 static_cast<int>(g)) != decision->state.choice.groups.end();
    const Explanation& e = work_->design.candidates.named[g];
    const bool may_go = !groups[g].shadow || same_name(e, wanted);
    if (e.period > 0.0 && may_go && !is_in && !groups[g].columns.empty()) withdraw(g, g + 1);
  }
  const int group = append_candidates(order);
  const Evidence evidence = evidence_now(*work_);
  const ColumnGroup& mine = groups[static_cast<std::size_t>(group)];
  rest.groups.push_back(group);
  rest.scales.push_back(
      evidence.gain(evidence.evaluate(without(rest, groups, rest.groups.size() - 1)), mine.columns, 0.0).scale);
  const Evidence::State next = keep_what_predicts(*work_, evidence.improve(evidence.evaluate(rest), decision->search));
  const bool is_in = std::find(next.choice.groups.begin(), next.choice.groups.end(), group) != next.choice.groups.end();
  if (!is_in || !(next.score > decision->state.score + decision->search.threshold)) {
    withdraw(before, groups.size());
    if (same < known_.size()) rename(static_cast<std::size_t>(groups_[same]), "");
    return false;
  }
  decision->state = next;
  if (same < known_.size()) {
    withdraw_with_others(static_cast<std::size_t>(groups_[same]));
    known_[same] = order;
    groups_[same] = group;
  } else {
    known_.push_back(order);
    groups_.push_back(group);
  }
  keep_what_is_in(decision->state);
  return true;
}

bool Gears::take(OrderAt first, Decision* decision) {
  bool any = false;
  for (int k = 0; k < kMostOrders && wins(first, decision->search); ++k) {
    const bool room = static_cast<int>(decision->state.choice.groups.size()) < decision->search.most_groups;
    if (room && take_one(first, decision)) {
      any = true;
    } else {
      passed_over_.push_back(first);
      if (!room || passed_over_.size() > kMostPassedOver) break;
    }
    first = best(evidence_now(*work_), decision->state);
  }
  if (!any) return false;
  search_again(decision);
  choose_orders_again(decision);
  leave_out_joints(decision);
  return true;
}

/// An order was chosen when others of the same gears were not known yet, and its neighbours may fit as well.
void Gears::choose_orders_again(Decision* decision) {
  auto& groups = work_->design.candidates.groups;
  for (std::size_t k = 0; k < known_.size(); ++k) {
    if (!(known_[k].high > known_[k].low)) continue;
    const Evidence evidence = evidence_now(*work_);
    Choice rest = decision->state.choice;
    const auto at = std::find(rest.groups.begin(), rest.groups.end(), groups_[k]) - rest.groups.begin();
    const double scale = rest.scales[static_cast<std::size_t>(at)];
    rest = without(rest, groups, static_cast<std::size_t>(at));
    std::vector<OrderAt> others = known_;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    const OrderScan scan(work_->design, evidence, evidence.evaluate(rest), work_->inputs, work_->samplings,
                         work_->noise.design_effect, work_->given.options.threads);
    const OrderAt other = scan.again(known_[k], others);
    if (std::abs(other.order - known_[k].order) < 1e-9) continue;
    const std::size_t before = groups.size();
    const int group = append_candidates(other);
    rest.groups.push_back(group);
    rest.scales.push_back(scale);
    const Evidence::State now = evidence_now(*work_).evaluate(rest);
    // The scan has weighed it against the old one by what is known now; what remains is that it fits.
    if (now.evidence < decision->state.evidence - kAsWell) {
      withdraw(before, groups.size());
      continue;
    }
    withdraw_with_others(static_cast<std::size_t>(groups_[k]));
    decision->state = now;
    known_[k] = other;
    groups_[k] = group;
  }
}

/// Joints that came with an order when less was known, and do not help it any more.
void Gears::leave_out_joints(Decision* decision) {
  for (std::size_t k = 0; k < known_.size(); ++k) {
    while (known_[k].joints.size() > 1 && leave_out_joint(k, decision)) {
    }
  }
}

/// The joint that helps least, if it helps less than another effect would have to. False: all help.
bool Gears::leave_out_joint(std::size_t known, Decision* decision) {
  auto& candidates = work_->design.candidates;
  const auto group = static_cast<std::size_t>(groups_[known]);
  const std::vector<int> columns = candidates.groups[group].columns;
  double least = decision->search.threshold;
  std::size_t worst = columns.size();
  for (std::size_t j = 0; j < known_[known].joints.size(); ++j) {
    std::vector<int> fewer = columns;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(2 * j),
                fewer.begin() + static_cast<std::ptrdiff_t>(2 * j + 2));
    candidates.groups[group].columns = fewer;
    const double loss = decision->state.evidence - evidence_now(*work_).evaluate(decision->state.choice).evidence;
    if (loss >= least) continue;
    least = loss;
    worst = j;
  }
  candidates.groups[group].columns = columns;
  if (worst == columns.size()) return false;
  known_[known].joints.erase(known_[known].joints.begin() + static_cast<std::ptrdiff_t>(worst));
  for (std::size_t g = group; g <= group + others_behind(group); ++g) {
    if (candidates.groups[g].columns.empty()) continue;  // withdrawn
    Explanation& e = candidates.named[g];
    for (std::size_t c = 2 * worst; c < 2 * worst + 2; ++c)
      work_->design.column_names[static_cast<std::size_t>(candidates.groups[g].columns[c])] += "-";
    const auto drop = [&](auto* list) {
      list->erase(list->begin() + static_cast<std::ptrdiff_t>(2 * worst),
                  list->begin() + static_cast<std::ptrdiff_t>(2 * worst + 2));
    };
    drop(&candidates.groups[g].columns);
    drop(&e.parameters);
    e.joints.erase(e.joints.begin() + static_cast<std::ptrdiff_t>(worst));
    e.requests = {{e.effect, e.joints}};
    if (e.joints.size() == 1) e.driver = input_name(Driver::angle, known_[known].joints[0]);
  }
  decision->state = evidence_now(*work_).evaluate(decision->state.choice);
  return true;
}

/// What was named before the orders were known may have stood for them.
void Gears::search_again(Decision* decision) {
  const auto& named = work_->design.candidates.named;
  Choice start;
  for (std::size_t k = 0; k < decision->state.choice.groups.size(); ++k) {
    const int g = decision->state.choice.groups[k];
    const bool stays = named[static_cast<std::size_t>(g)].kind == Explanation::Kind::all_geometry ||
                       std::find(groups_.begin(), groups_.end(), g) != groups_.end();
    if (!stays) continue;
    start.groups.push_back(g);
    start.scales.push_back(decision->state.choice.scales[k]);
  }
  const Evidence evidence = evidence_now(*work_);
  for (const Choice& from : {decision->state.choice, start}) {
    const Evidence::State other = keep_what_predicts(*work_, evidence.search(decision->search, from));
    if (other.score > decision->state.score) decision->state = other;
  }
  keep_what_is_in(decision->state);
}

}  // namespace truing::diagnosis
