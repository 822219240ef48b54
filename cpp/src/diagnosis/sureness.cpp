// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// How sure a name is: what could stand in its place, and whether other poses would have brought it.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/free_search.hpp"
#include "math/batch.hpp"
#include "math/random.hpp"
#include "model/effects/traits.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;
constexpr double kClassR2 = 0.98;
constexpr double kClassNats = 3.0;
constexpr double kSome = 2.0;  ///< nats that a function wins beside a law that leaves some of it

bool same_name(const Explanation& a, const Explanation& b) { return a.effect == b.effect && a.joints == b.joints; }

/// All links contain each link, a link the joint's zero: a name for more of the same.
bool contains(const Explanation& large, const Explanation& small) {
  const bool same_effect = large.effect == small.effect;
  const bool is_part = is_contained(model::traits_of(small.effect, {}), large.effect, Containment::part);
  if (!same_effect && !is_part) return false;
  return large.joints.size() > small.joints.size() || (is_part && large.joints == small.joints);
}

/// What all links together could do as well, though it is no geometry.
static bool looks_like_geometry(const Work& work, const Explanation& e) {
  const std::string& links = effect_that_stands_for(StandsFor::link_geometry).name;
  return is_contained(model::traits_of(e.effect, work.given.options.own_effects), links, Containment::look_alike);
}

/// Fitted values of a chosen group's columns.
static Eigen::VectorXd solution_of(const Evidence::State& state, const ColumnGroup& group) {
  Eigen::VectorXd theta(static_cast<Eigen::Index>(group.columns.size()));
  for (Eigen::Index k = 0; k < theta.size(); ++k) {
    const int column = group.columns[static_cast<std::size_t>(k)];
    const auto found = std::find(state.columns.begin(), state.columns.end(), column) - state.columns.begin();
    theta[k] = state.solution[static_cast<Eigen::Index>(found)];
  }
  return theta;
}

/// The choice without one of its groups, and what may stand in that one's place.
class Contest {
 public:
  Contest(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t at)
      : groups_(work.design.candidates.groups),
        named_(work.design.candidates.named),
        evidence_(evidence),
        group_(state.choice.groups[at]),
        less_(evidence.evaluate(without(state.choice, groups_, at))),
        making_room_(evidence.evaluate_at(state.sigma2, less_.choice)),
        theta_(solution_of(state, mine())),
        loss_(state.score - less_.score),
        loss_making_room_(state.score - making_room_.score),
        gained_(less_.rss - state.rss),
        like_geometry_(looks_like_geometry(work, name())) {}

  double removal_loss() const { return loss_; }
  const Evidence::State& less() const { return less_; }
  std::vector<Evidence::Gain> gains() const { return evidence_.gains(less_); }
  std::vector<Evidence::Gain> gains_making_room() const { return evidence_.gains(making_room_); }

  bool is_rival(int group) const {
    const Explanation& e = named_[static_cast<std::size_t>(group)];
    const ColumnGroup& columns = groups_[static_cast<std::size_t>(group)];
    const std::vector<int>& in = less_.choice.groups;
    // What is a free function of time contains all that changes slowly: it is compared with its like alone.
    const bool comparable = is_over_time(e) ? is_over_time(name()) : e.kind != Kind::free;
    return group != group_ && columns.corrects_law_at < 0 && !columns.columns.empty() && comparable &&
           !same_name(e, name()) && !contains(e, name()) && std::find(in.begin(), in.end(), group) == in.end();
  }

  /// `room`: the same group's, where others make room. It may ask for less of them, or for more: the better one counts.
  Rival rival(const Evidence::Gain& gain, const Evidence::Gain& room) const {
    Rival out;
    out.group = gain.group;
    out.loss = std::min(loss_ - gain.score, loss_making_room_ - room.score);
    const bool any_geometry = named_[static_cast<std::size_t>(gain.group)].kind == Kind::all_geometry;
    if (gain.squares > 0.5 * gained_ || (any_geometry && like_geometry_)) out.r2 = explained(gain);
    // What can make the same motion is named with it, even where the last per cents speak for one of them: no law is
    // that exact.
    const bool comparable = any_geometry ? like_geometry_ : gain.rank <= 8 || is_over_time(name());
    out.in_class = out.loss < kClassNats || (out.r2 > kClassR2 && comparable);
    return out;
  }

 private:
  const ColumnGroup& mine() const { return groups_[static_cast<std::size_t>(group_)]; }
  const Explanation& name() const { return named_[static_cast<std::size_t>(group_)]; }

  double explained(const Evidence::Gain& gain) const {
    const ColumnGroup& other = groups_[static_cast<std::size_t>(gain.group)];
    const double r2 = evidence_.explained(less_, mine().columns, theta_, other.columns);
    // Or the other way round: a plainer one that this one contains, and that closes nearly as much.
    if (other.columns.size() != 1 || !(gain.squares > 0.8 * gained_)) return r2;
    return std::max(r2, evidence_.explained(less_, other.columns, Eigen::VectorXd::Ones(1), mine().columns));
  }

  const std::vector<ColumnGroup>& groups_;
  const std::vector<Explanation>& named_;
  const Evidence& evidence_;
  int group_;
  Evidence::State less_;
  Evidence::State making_room_;  ///< the same, where others do what they do beside whatever takes the group's place
  Eigen::VectorXd theta_;
  double loss_;              ///< of score, without the group [nats]
  double loss_making_room_;  ///< the same of `making_room_`, which a rival is to win back
  double gained_;            ///< fall of the sum of squares with it
  bool like_geometry_;
};

/// A smooth law against a step, a corner or a bump of its input: in its place or beside it.
static bool is_shape_as_good(const Work& work, const Evidence& evidence, const Evidence::State& state,
                             const Contest& contest, int group) {
  const Explanation& name = work.design.candidates.named[static_cast<std::size_t>(group)];
  if (name.kind != Kind::catalogue || name.joints.size() != 1 || name.period > 0.0) return false;
  const std::size_t joint = work.given.frames.robot.joint_index(name.joints[0]);
  const bool of_angle = name.driver.empty() && follows_own_angle(effect_traits(work, name));
  const int input = input_named(work, of_angle ? input_name(Driver::angle, joint) : name.driver);
  if (input < 0) return false;
  const double cost = work.design.candidates.groups[static_cast<std::size_t>(group)].cost;
  return best_local_shape(work, evidence, state, joint, input) > 0.0 ||
         best_local_shape(work, evidence, contest.less(), joint, input) > contest.removal_loss() + cost - kClassNats;
}

/// A law against any function of its input at the joint, with knots. Where the law is right, the function pays for its
/// many columns and finds nothing beside it.
static bool is_law_in_question(const Work& work, const Evidence& evidence, const Evidence::State& state,
                               const Contest& contest, int group) {
  const auto& groups = work.design.candidates.groups;
  const ColumnGroup& law = groups[static_cast<std::size_t>(group)];
  const Explanation& name = work.design.candidates.named[static_cast<std::size_t>(group)];
  const std::vector<int>& in = state.choice.groups;
  for (std::size_t g = 0; g < groups.size() && law.law_at >= 0; ++g) {
    const Explanation& other = work.design.candidates.named[g];
    const bool is_in = std::find(in.begin(), in.end(), static_cast<int>(g)) != in.end();
    const bool is_free = other.kind == Kind::free && std::vector<std::string>{other.site} == name.joints &&
                         other.inputs.size() == 1 &&
                         work.inputs[static_cast<std::size_t>(other.inputs[0])].name == name.driver;
    const bool is_function = groups[g].corrects_law_at == law.law_at && !groups[g].columns.empty();
    if (is_in && (is_free || is_function)) return true;
    if (is_in || !is_function) continue;
    const double beside = evidence.gain(state, groups[g].columns, groups[g].cost).score;
    const double in_its_place = evidence.gain(contest.less(), groups[g].columns, 0.0).score;
    if (beside > 0.0 || in_its_place > contest.removal_loss() + law.cost - kClassNats) return true;
  }
  return false;
}

std::vector<MovedBy> motions_of_law(const Work& work, const Explanation& name) {
  std::vector<MovedBy> out;
  const EffectTraits& traits = effect_traits(work, name);
  if (name.kind != Kind::catalogue || name.period > 0.0 || traits.stands_for == StandsFor::link_geometry) return out;
  const std::vector<Joint>& joints = work.given.frames.robot.joints;
  const auto add = [&](std::size_t joint, std::size_t mover) {
    const int angle = input_named(work, input_name(Driver::angle, mover));
    if (angle >= 0) out.push_back({joint, angle});
  };
  for (std::size_t joint = 0; joint < joints.size(); ++joint) {
    if (follows_own_angle(traits) && name.joints == std::vector<std::string>{joints[joint].name}) add(joint, joint);
    for (std::size_t mover = 0; mover < joints.size() && traits.driver == Driver::other_angles; ++mover) {
      const std::string ratio = name.effect + "." + joints[joint].name + "." + joints[mover].name;
      if (std::find(name.parameters.begin(), name.parameters.end(), ratio) != name.parameters.end()) add(joint, mover);
    }
  }
  return out;
}

/// Another joint that moves as a function of the angle which a law of a joint's own follows: where that does better in
/// the law's place, and the law leaves some of it, the name may be the other joint's.
static bool is_law_of_another(const Work& work, const Evidence& evidence, const Evidence::State& state,
                              const Contest& contest, const MovedBy& motion, double by_law) {
  for (std::size_t joint = 0; joint < work.given.frames.robot.joints.size(); ++joint) {
    if (joint != motion.joint && best_function(work, evidence, state, joint, motion.angle) > kSome &&
        best_function(work, evidence, contest.less(), joint, motion.angle) > by_law + kClassNats)
      return true;
  }
  return false;
}

/// A function of the angle that a law moves a joint with wins much beside it: where this is too little to be found by
/// itself, the name may be of a part of it. So may a law of the joint's own angle that leaves some, and in whose place
/// a step, a corner or a bump does better: of two laws that are both there, each of which makes up for what the other
/// one lacks, nothing is left.
static bool is_law_part(const Work& work, const Evidence& evidence, const Evidence::State& state,
                        const Contest& contest, int group) {
  constexpr double kMuch = 0.125;  ///< of what both win; the function has paid for its knots
  const Explanation& name = work.design.candidates.named[static_cast<std::size_t>(group)];
  const EffectTraits& traits = effect_traits(work, name);
  const double by_law = contest.removal_loss() + work.design.candidates.groups[static_cast<std::size_t>(group)].cost;
  const std::vector<MovedBy> motions = motions_of_law(work, name);
  return std::any_of(motions.begin(), motions.end(), [&](const MovedBy& motion) {
    const double beside = best_function(work, evidence, state, motion.joint, motion.angle);
    if (beside > kMuch * (by_law + beside)) return true;
    if (!follows_own_angle(traits)) return false;
    const bool shape_is_better = beside > kSome && best_local_shape(work, evidence, contest.less(), motion.joint,
                                                                    motion.angle) > by_law + kClassNats;
    return shape_is_better ||
           (traits.driver != Driver::constant && is_law_of_another(work, evidence, state, contest, motion, by_law));
  });
}

Sureness how_sure(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t at) {
  constexpr double kTempered = 0.5;  // no model is exact: half a nat counts for one
  const Contest contest(work, evidence, state, at);
  Sureness out;
  out.removal_loss = contest.removal_loss();
  const int group = state.choice.groups[at];
  out.law_in_question = is_law_in_question(work, evidence, state, contest, group) ||
                        is_shape_as_good(work, evidence, state, contest, group);
  out.law_is_part = is_law_part(work, evidence, state, contest, group);
  double all = 1.0 + std::exp(-kTempered * std::max(0.0, out.removal_loss)), of_class = 1.0;
  const std::vector<Evidence::Gain> gains = contest.gains(), making_room = contest.gains_making_room();
  for (std::size_t g = 0; g < gains.size(); ++g) {
    const Evidence::Gain& gain = gains[g];
    if (!contest.is_rival(gain.group)) continue;
    const Rival rival = contest.rival(gain, making_room[g]);
    const bool shadow = work.design.candidates.groups[static_cast<std::size_t>(gain.group)].shadow;
    const double weight = shadow ? 0.0 : std::exp(-kTempered * std::max(0.0, rival.loss));
    all += weight;
    if (rival.in_class) of_class += weight;
    if (rival.in_class || weight > 1e-3) out.rivals.push_back(rival);
  }
  out.posterior = of_class / all;
  std::sort(out.rivals.begin(), out.rivals.end(),
            [](const Rival& a, const Rival& b) { return a.in_class != b.in_class ? a.in_class : a.loss < b.loss; });
  return out;
}

/// A function of what the name's law depends on moves the same joint beside it: the law is not quite right.
static bool is_function_beside(const Work& work, const Decision& decision, const Explanation& name) {
  constexpr double kNats = 2.0;
  if (name.kind != Kind::catalogue || name.joints.size() != 1 || name.period > 0.0) return false;
  const EffectTraits& traits = effect_traits(work, name);
  const std::string own_angle = input_name(Driver::angle, work.given.frames.robot.joint_index(name.joints[0]));
  return std::any_of(decision.beside.begin(), decision.beside.end(), [&](const FunctionBeside& f) {
    const auto concerns = [&](int k) {
      const InputColumn& input = work.inputs[static_cast<std::size_t>(k)];
      const bool is_angle =
          input.joint >= 0 && input.name == input_name(Driver::angle, static_cast<std::size_t>(input.joint));
      // A zero that is wrong may be a part of any function of the angles.
      return traits.driver == Driver::other_angles ? is_angle && input.name != own_angle
             : traits.driver == Driver::constant   ? is_angle
                                                   : input.name == name.driver;
    };
    return f.joint == name.joints[0] && f.evidence > kNats && std::any_of(f.inputs.begin(), f.inputs.end(), concerns);
  });
}

/// A cause with a law of its own; of many links' values, of orders of gears and of functions there is none.
static bool is_law(const Work& work, const Explanation& e) {
  const EffectTraits& traits = effect_traits(work, e);
  return is_named(e) && traits.stands_for != StandsFor::link_geometry && traits.search != Search::by_order;
}

/// What a law of the temperature leaves where nothing is as warm as the sensor says: its motion, as any function of
/// time, of a link that it names or of all of them alike. Log Bayes factor beside `rest`, at most.
static double as_lagging_warmth(const Work& work, const Evidence& evidence, const Evidence::State& rest,
                                const Explanation& law, const std::vector<int>& time) {
  const auto& groups = work.design.candidates.groups;
  double best = -1e300;
  std::vector<int> of_all_links;  // a function of every link's own
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Explanation& e = work.design.candidates.named[g];
    const bool is_of_law =
        e.kind == Kind::law && e.effect == law.effect && (law.joints.empty() || e.joints == law.joints);
    if (!is_of_law || groups[g].columns.empty()) continue;
    best = std::max(best, evidence.gain(rest, groups[g].columns, 0.0).evidence);
    if (!e.joints.empty()) of_all_links.insert(of_all_links.end(), groups[g].columns.begin(), groups[g].columns.end());
  }
  if (law.joints.empty() && !of_all_links.empty())
    best = std::max(best, evidence.gain(rest, of_all_links, 0.0).evidence);
  if (time.empty()) return best;
  FreeScanOptions of_time;
  of_time.threads = work.given.options.threads;
  of_time.flips = 0;
  of_time.only_of = time;
  const Robot& robot = work.given.frames.robot;
  for (const FreeGain& found :
       scan_free(work.design, evidence, rest, work.inputs, robot, work.noise.design_effect, of_time).best) {
    const bool is_of_law =
        law.joints.empty() || std::find(law.joints.begin(), law.joints.end(), found.what.site) != law.joints.end();
    if (is_of_law) best = std::max(best, found.gain.evidence);
  }
  return best;
}

/// Do these names make a motion that lagging warmth of the parts that a law of the temperature names does not make?
static bool stand_by_themselves(const Work& work, const Evidence& evidence, const Decision& decision,
                                const std::vector<int>& names, const Explanation& law) {
  const Evidence::State rest = evidence.evaluate(without_these(decision.state.choice, names));
  std::vector<int> time;
  for (const int g : names) {
    const Explanation& name = work.design.candidates.named[static_cast<std::size_t>(g)];
    time.insert(time.end(), name.inputs.begin(), name.inputs.end());
    const int recorded = input_named(work, "time");
    const bool is_rate = name.inputs.empty() && effect_traits(work, name).driver == Driver::time;
    if (is_rate && recorded >= 0) time.push_back(recorded);
  }
  const double by_names = evidence.gain(rest, columns_of_groups(work, names), 0.0).evidence;
  return by_names > as_lagging_warmth(work, evidence, rest, law, time) + decision.search.threshold;
}

/// What lagging warmth looks like: its base wanders; where all lengths grow, the metre is wrong.
static bool may_be_warmth(const Work& work, const Explanation& small, const Explanation& large) {
  const EffectTraits &one = effect_traits(work, small), &other = effect_traits(work, large);
  if (other.driver != Driver::temperature || one.driver == Driver::temperature) return false;
  return one.driver == Driver::time || (looks_like_geometry(work, small) && looks_like_geometry(work, large));
}

/// Laws are seldom exact, and what one leaves looks like another one: the joint was not set to zero where the law says;
/// where both move the same thing by the joint's own angle, little is left. A tilting axis leaves no turn about it.
static bool is_departure(const Work& work, const Explanation& small, const Explanation& large, double ratio) {
  constexpr double kLittle = 0.3;  ///< of the larger law's motion of the tip
  const EffectTraits &one = effect_traits(work, small), &other = effect_traits(work, large);
  if (same_name(small, large) || small.joints != large.joints) return false;
  if (one.driver == Driver::constant && one.moves == other.moves) return true;
  return follows_own_angle(one) && follows_own_angle(other) && one.moves == other.moves && ratio < kLittle;
}

/// Of the names that may be what a law of the temperature leaves: those that are. They are asked together first, for
/// each makes up for what the others lack.
static std::vector<int> left_by_warmth(const Work& work, const Evidence& evidence, const Decision& decision,
                                       const std::vector<int>& names, const Explanation& law) {
  if (names.empty() || !stand_by_themselves(work, evidence, decision, names, law)) return names;
  std::vector<int> out;
  for (const int g : names) {
    if (!stand_by_themselves(work, evidence, decision, {g}, law)) out.push_back(g);
  }
  return out;
}

/// A joint that another one carries along, by a law that is not the simple one: what that leaves goes with the other
/// joint's angle, and looks like a law of that one's own. Held against any such motion of the joint that is carried.
static bool is_left_by_coupling(const Work& work, const Evidence& evidence, const Decision& decision, int group,
                                const Explanation& small, const Explanation& law) {
  if (!follows_own_angle(effect_traits(work, small)) || small.joints.size() != 1 || small.joints == law.joints)
    return false;
  const int angle = input_named(work, input_name(Driver::angle, work.given.frames.robot.joint_index(small.joints[0])));
  const std::vector<MovedBy> motions = motions_of_law(work, law);
  const auto is_by_it = [&](const MovedBy& motion) { return motion.angle == angle; };
  if (std::none_of(motions.begin(), motions.end(), is_by_it)) return false;
  const Evidence::State rest = evidence.evaluate(without_these(decision.state.choice, {group}));
  const double by_name = evidence.gain(rest, columns_of_groups(work, {group}), 0.0).evidence;
  return std::any_of(motions.begin(), motions.end(), [&](const MovedBy& motion) {
    return is_by_it(motion) &&
           by_name < best_function(work, evidence, rest, motion.joint, motion.angle) + decision.search.threshold;
  });
}

/// [rad | m] by which a law moves its joint, for every row.
static InputColumn motion_by(const Work& work, const Evidence::State& state, int law, std::size_t joint) {
  const ColumnGroup& group = work.design.candidates.groups[static_cast<std::size_t>(law)];
  const Eigen::VectorXd theta = solution_of(state, group);
  const int unit = work.design.joint_column[joint][0];
  InputColumn out{"", "", static_cast<int>(joint), false, std::vector<double>(work.inputs.front().values.size(), 0.0)};
  std::vector<double> squares(out.values.size(), 0.0);
  for (Eigen::Index i = 0; i < work.design.x.rows(); ++i) {
    const auto row = static_cast<std::size_t>(work.design.row[static_cast<std::size_t>(i)]);
    const double per_unit = work.design.x(i, unit);
    for (Eigen::Index k = 0; k < theta.size(); ++k)
      out.values[row] += per_unit * theta[k] * work.design.x(i, group.columns[static_cast<std::size_t>(k)]);
    squares[row] += per_unit * per_unit;
  }
  for (std::size_t row = 0; row < squares.size(); ++row) out.values[row] /= std::max(squares[row], 1e-300);
  return out;
}

/// A joint that gives way to its load by a law that is not the simple one: what that leaves goes with the load, and
/// looks like a law of the joint's angle. Held against any function of what the law makes of the load.
static bool is_left_by_load(const Work& work, const Evidence& evidence, const Decision& decision, int group, int law) {
  const Explanation& small = work.design.candidates.named[static_cast<std::size_t>(group)];
  const Explanation& large = work.design.candidates.named[static_cast<std::size_t>(law)];
  const EffectTraits &one = effect_traits(work, small), &other = effect_traits(work, large);
  const bool by_angle = one.moves == Moves::joint && follows_own_angle(one);
  const bool by_load = other.moves == Moves::joint && other.driver == Driver::gravity_torque;
  if (!by_angle || !by_load || large.joints.size() != 1 || small.joints != large.joints) return false;
  const std::size_t joint = work.given.frames.robot.joint_index(large.joints[0]);
  const Evidence::State rest = evidence.evaluate(without_these(decision.state.choice, {group}));
  const double by_name = evidence.gain(rest, columns_of_groups(work, {group}), 0.0).evidence;
  return by_name <
         best_function_of(motion_by(work, rest, law, joint), work, evidence, rest, joint) + decision.search.threshold;
}

std::map<int, int> departures_from_laws(const Work& work, const Evidence& evidence, const Decision& decision) {
  const auto named = [&](int g) -> const Explanation& {
    return work.design.candidates.named[static_cast<std::size_t>(g)];
  };
  std::vector<std::pair<double, int>> laws;  // the largest first
  for (const int g : decision.state.choice.groups) {
    if (is_law(work, named(g))) laws.emplace_back(size_at_tip(work, decision.state, columns_of_groups(work, {g})), g);
  }
  std::sort(laws.rbegin(), laws.rend());
  std::map<int, int> out;
  for (std::size_t large = 0; large < laws.size(); ++large) {
    const auto [size, group] = laws[large];
    std::vector<int> warmth;
    for (std::size_t small = large + 1; small < laws.size(); ++small) {
      const auto [less_size, less] = laws[small];
      if (out.count(group) || out.count(less) || !(less_size < size)) continue;
      if (is_departure(work, named(less), named(group), less_size / size) ||
          is_left_by_coupling(work, evidence, decision, less, named(less), named(group)) ||
          is_left_by_load(work, evidence, decision, less, group))
        out[less] = group;
      if (may_be_warmth(work, named(less), named(group))) warmth.push_back(less);
    }
    for (const int g : left_by_warmth(work, evidence, decision, warmth, named(group))) out[g] = group;
    // What comes late may be more than what comes at once.
    for (std::size_t small = large + 1; small < laws.size() && out.count(group) == 0; ++small) {
      const int less = laws[small].second;
      const bool of_time = effect_traits(work, named(group)).driver == Driver::time && out.count(less) == 0;
      if (of_time && may_be_warmth(work, named(group), named(less)) &&
          !stand_by_themselves(work, evidence, decision, {group}, named(less)))
        out[group] = less;
    }
  }
  return out;
}

/// A bootstrap draw of the folds.
static Gram drawn(const std::vector<Gram>& folds, Random* random) {
  std::vector<double> times(folds.size(), 0.0);
  for (std::size_t k = 0; k < folds.size(); ++k) times[random->below(folds.size())] += 1.0;
  Gram sum;
  for (std::size_t k = 0; k < folds.size(); ++k) {
    if (times[k] > 0.0) sum.add(folds[k], times[k]);
  }
  return sum;
}

static std::vector<Gram> of_columns(const std::vector<Gram>& folds, const std::vector<int>& columns) {
  std::vector<Gram> out;
  for (const Gram& fold : folds) out.push_back(fold.of(columns));
  return out;
}

/// The selection repeated on draws of the training folds.
static std::vector<std::vector<int>> select_again(const Work& work, const Decision& decision, Random* random) {
  constexpr int kSelections = 10;
  SearchOptions quick = decision.search;
  quick.beam = 1;
  quick.threads = 1;  // draws are side by side
  const Shortlist list = shortlist(work, decision.state.choice.groups);
  const std::vector<Gram> folds = of_columns(work.grams.train_folds, list.columns);
  std::vector<Gram> draws;
  for (int r = 0; r < std::min(kSelections, work.given.options.resamples); ++r) draws.push_back(drawn(folds, random));
  std::vector<std::vector<int>> chosen(draws.size());
  const auto select = [&](std::size_t r) {
    for (const int g : Evidence(draws[r], list.groups, list.nuisance, list.prior).search(quick).choice.groups)
      chosen[r].push_back(list.which[static_cast<std::size_t>(g)]);
  };
  for_each_on_threads(draws.size(), work.given.options.threads, {}, select, 1);
  return chosen;
}

/// The chosen groups alone, on a Gram of the nuisance columns and theirs.
struct ChosenOnly {
  std::vector<ColumnGroup> groups;
  std::vector<int> nuisance;
  Choice choice;
  Eigen::VectorXd prior;
};

static ChosenOnly chosen_only(const Work& work, const Evidence::State& state) {
  ChosenOnly out;
  out.nuisance.resize(work.design.nuisance.size());
  std::iota(out.nuisance.begin(), out.nuisance.end(), 0);
  int next = static_cast<int>(out.nuisance.size());
  for (std::size_t k = 0; k < state.choice.groups.size(); ++k) {
    ColumnGroup group = work.design.candidates.groups[static_cast<std::size_t>(state.choice.groups[k])];
    for (int& column : group.columns) column = next++;
    out.groups.push_back(group);
    out.choice.groups.push_back(static_cast<int>(k));
    out.choice.scales.push_back(state.choice.scales[k]);
  }
  out.prior.resize(static_cast<Eigen::Index>(state.columns.size()));
  for (Eigen::Index k = 0; k < out.prior.size(); ++k)
    out.prior[k] = work.design.prior[state.columns[static_cast<std::size_t>(k)]];
  return out;
}

Resampled resample(const Work& work, const Decision& decision) {
  Random random(work.given.options.seed + 7);
  Resampled out;
  out.chosen = select_again(work, decision, &random);
  // How far the error shrinks takes the chosen columns only.
  const ChosenOnly few = chosen_only(work, decision.state);
  const std::vector<Gram> train_folds = of_columns(work.grams.train_folds, decision.state.columns),
                          test_folds = of_columns(work.grams.test_folds, decision.state.columns);
  for (int r = 0; r < work.given.options.resamples; ++r) {
    const Gram train = drawn(train_folds, &random), test = drawn(test_folds, &random);
    if (!(test.n > 0.0)) break;
    const Evidence evidence(train, few.groups, few.nuisance, few.prior);
    const Evidence::State refitted = evidence.evaluate(few.choice), nothing = evidence.evaluate({});
    const double before = std::max(held_out_squares(test, nothing.columns, nothing.solution), 1e-300);
    const double after = std::max(0.0, held_out_squares(test, refitted.columns, refitted.solution));
    out.shrink.push_back(1.0 - std::sqrt(after / before));
  }
  return out;
}

/// Share of the resampled selections that hold the group or one of its class; one more success and one more trial stand
/// for the data's own.
static double selection_frequency(const Work& work, const Resampled& resampled, const Sureness& sure, int group) {
  const auto& named = work.design.candidates.named;
  double back = 1.0, draws = 1.0;
  for (const std::vector<int>& chosen : resampled.chosen) {
    const bool found = std::any_of(chosen.begin(), chosen.end(), [&](int g) {
      const Explanation &other = named[static_cast<std::size_t>(g)], &mine = named[static_cast<std::size_t>(group)];
      if (same_name(other, mine) || contains(other, mine)) return true;
      return std::any_of(sure.rivals.begin(), sure.rivals.end(),
                         [&](const Rival& r) { return r.in_class && r.group == g; });
    });
    back += found ? 1.0 : 0.0;
    draws += 1.0;
  }
  return back / draws;
}

bool is_left_by(const Work& work, const Explanation& name, const UnknownEffect& unknown) {
  const EffectTraits& traits = effect_traits(work, name);
  const bool there = name.joints.empty() || name.joints == std::vector<std::string>{unknown.joint};
  const std::vector<Joint>& joints = work.given.frames.robot.joints;
  const auto at = std::find_if(joints.begin(), joints.end(), [&](const Joint& j) { return j.name == unknown.joint; });
  if (name.kind != Kind::catalogue || !there || at == joints.end() || unknown.inputs.empty()) return false;
  const auto joint = static_cast<std::size_t>(at - joints.begin());
  std::vector<std::string> own;
  if (traits.driver == Driver::temperature) own = {"time", "order"};
  if (traits.law_test == LawTest::times_direction)
    own = {input_name(Driver::direction, joint), input_name(Driver::gravity_torque, joint),
           input_name(Driver::angle, joint)};
  return std::all_of(unknown.inputs.begin(), unknown.inputs.end(),
                     [&](const std::string& input) { return std::find(own.begin(), own.end(), input) != own.end(); });
}

// Weights: docs/method/exam.md, "Confidence".
std::vector<Ground> grounds_of(const Work& work, const Decision& decision, const Resampled& resampled, int group,
                               const Sureness& sure, const UnseenErrors& without, const UnseenErrors& with,
                               bool unknown) {
  constexpr double kSureFall = 20.0;  ///< standard errors: more say no more
  const Explanation& name = work.design.candidates.named[static_cast<std::size_t>(group)];
  const bool in_question =
      sure.law_in_question || decision.in_question.count(group) > 0 || is_function_beside(work, decision, name);
  return {{"constant", 1.0, -2.6},
          {"found_again", selection_frequency(work, resampled, sure, group), 3.5},
          {"log_sure_fall", std::log(std::clamp(sure_fall(without, with), 1.0, kSureFall)), 1.8},
          {"unknown_found", unknown ? 1.0 : 0.0, -3.4},
          {"law_in_question", in_question ? 1.0 : 0.0, -1.4},
          {"law_is_part", sure.law_is_part ? 1.0 : 0.0, -3.0}};
}

}  // namespace truing::diagnosis
