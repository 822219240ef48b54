// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "estimation/selection.hpp"
#include "model/effects/traits.hpp"
#include "model/gravity.hpp"
#include "model/model.hpp"

namespace truing::diagnosis {
namespace {

constexpr int kDriftKnots[3] = {6, 12, 24};
/// Every law has a number at every joint.
constexpr int kLaws = 8;

/// Of a law at a joint, the same for all effects that follow it there; -1: no law of one input.
int law_number(const EffectTraits& traits, std::size_t joint) {
  return traits.law == Law::none ? -1 : static_cast<int>(joint) * kLaws + static_cast<int>(traits.law);
}

/// Weight, temperature and other joints' motions bend and turn a joint that stands still as well.
bool acts_at_rest(const EffectTraits& traits) {
  switch (traits.driver) {
    case Driver::gravity_torque:
    case Driver::motor_torque:
    case Driver::temperature:
    case Driver::other_angles:
      return true;
    default:
      return traits.stands_for == StandsFor::joint_offset;
  }
}

/// Builds the list of candidates and, column by column, what they need.
class Builder {
 public:
  explicit Builder(const DesignTask& task) : task_(task) {
    for (std::size_t k = 0; k < task.at.joints.size(); ++k) {
      const InputColumn* motion = input(input_name(Driver::angle, k));
      moves_.push_back(!motion || !motion->constant);
      if (motion && motion->constant) {
        const Joint& joint = task.at.joints[k];
        if (!joint.passive())
          out_.not_testable.push_back({"every effect of its own motion",
                                       {joint.name},
                                       joint.name + " does not move",
                                       Untestable::joint_at_rest});
      }
    }
  }

  Candidates build() {
    geometry();
    for (const Effect& effect : catalogue()) {
      if (is_searched(effect) && effect.traits.stands_for != StandsFor::link_geometry && !left_out(effect.name))
        add_effect(effect, {});
    }
    for (const Effect& effect : task_.options.own_effects) {
      if (is_searched(effect) && !left_out(effect.name)) add_effect(effect, task_.options.own_effects);
    }
    drifts();
    warmth_over_time();
    law_tests();
    return std::move(out_);
  }

 private:
  bool left_out(const std::string& name) const { return is_left_out(task_.options, name); }

  bool is_searched(const Effect& effect) const {
    const std::vector<std::string>& also = task_.options.also;
    return effect.traits.search == Search::always ||
           (effect.traits.search == Search::if_asked && std::find(also.begin(), also.end(), effect.name) != also.end());
  }

  const InputColumn* input(const std::string& name) const {
    for (const InputColumn& column : task_.inputs) {
      if (column.name == name) return &column;
    }
    return nullptr;
  }
  int input_index(const std::string& name) const {
    const InputColumn* column = input(name);
    return column ? static_cast<int>(column - task_.inputs.data()) : -1;
  }
  /// Time, or the order of the rows in its place; -1: neither changes.
  int time_index() const {
    const int time = input_index("time") >= 0 ? input_index("time") : input_index("order");
    return time < 0 || task_.inputs[static_cast<std::size_t>(time)].constant ? -1 : time;
  }

  void add(Explanation named, ColumnGroup group) {
    out_.named.push_back(std::move(named));
    out_.groups.push_back(std::move(group));
  }

  /// Every link, and all of them together.
  void geometry() {
    const std::string& name = effect_that_stands_for(StandsFor::link_geometry).name;
    if (left_out(name)) return;
    const Model plain = make_model(task_.at, task_.data);
    const std::vector<bool> parallel = near_parallel(task_.at, IdentifyOptions().hayati_angle);
    Explanation all;
    all.kind = Explanation::Kind::all_geometry;
    all.effect = name;
    for (std::size_t k = 0; k < task_.at.joints.size(); ++k) {
      Explanation link;
      link.effect = name;
      link.joints = {task_.at.joints[k].name};
      for (const ParameterInfo& info : plain.parameters) {
        if (info.owner == static_cast<int>(k) && is_fitted_geometry(info, parallel, task_.at))
          link.parameters.push_back(info.name);
      }
      link.model_free = link.parameters;
      all.joints.push_back(link.joints[0]);
      all.parameters.insert(all.parameters.end(), link.parameters.begin(), link.parameters.end());
      add(link, {});
    }
    all.model_free = all.parameters;
    add(all, {});
  }

  void add_effect(const Effect& effect, const std::vector<Effect>& own) {
    if (!effect.per_joint) {
      NotTestable obstacle;
      if (!try_terms(effect, own, {}, &obstacle) && !obstacle.why.empty()) out_.not_testable.push_back(obstacle);
      return;
    }
    NotTestable first;
    bool any = effect.terms_of_robot && try_terms(effect, own, {}, &first);
    for (std::size_t k = 0; k < task_.at.joints.size(); ++k) {
      if (!moves_[k] && !acts_at_rest(effect.traits)) continue;
      NotTestable obstacle;
      any |= try_terms(effect, own, {k}, &obstacle);
      if (first.why.empty()) first = obstacle;
    }
    if (!any && !first.why.empty()) out_.not_testable.push_back({effect.name, {}, first.why, first.reason});
  }

  /// One effect at a joint (none: of the whole robot). False: it is no candidate, and `obstacle` says why, unless the
  /// effect does not suit the joint.
  bool try_terms(const Effect& effect, const std::vector<Effect>& own, const std::vector<std::size_t>& joints,
                 NotTestable* obstacle) {
    Explanation e;
    e.effect = effect.name;
    for (const std::size_t k : joints) e.joints.push_back(task_.at.joints[k].name);
    try {
      find_terms(effect, own, obstacle, &e);
    } catch (const Unsuited&) {
      return false;
    } catch (const MissingColumn& why) {
      *obstacle = {effect.name, e.joints, why.what(), Untestable::column_missing};
      return false;
    } catch (const std::invalid_argument& why) {
      *obstacle = {effect.name, e.joints, why.what()};
      return false;
    }
    if (e.parameters.empty()) return false;
    const std::size_t joint = joints.empty() ? 0 : joints[0];
    // Of the whole robot only time and temperature are one input.
    const bool one_for_all = effect.traits.driver == Driver::time || effect.traits.driver == Driver::temperature;
    if (!joints.empty() || one_for_all) e.driver = input_name(effect.traits.driver, joint);
    ColumnGroup group;
    group.law_at = joints.empty() ? -1 : law_number(effect.traits, joint);
    if (effect.traits.driver == Driver::direction && task_.inferred_direction)
      e.note = "the approach direction was inferred from the order of the poses";
    const InputColumn* driver = input(e.driver);
    if (driver && driver->constant) {
      if (effect.traits.driver == Driver::time) return false;
      shadow_of_constant_input(effect, e, joint, &group);
    }
    if (joints.empty() || !effect.forms) {
      add(std::move(e), std::move(group));
      return true;
    }
    const std::vector<EffectForm> forms = effect.forms(task_.nominal, joint, task_.data);
    for (const EffectForm& form : forms) add_form(form, e, group);
    return !forms.empty();
  }

  /// One form of an effect at a joint. A mover that stands still moves nothing. A law about a phase of its own holds
  /// but for a constant: the joint was set to zero with the law's cause in place, and its zero is found with it.
  void add_form(const EffectForm& form, Explanation e, const ColumnGroup& group) {
    e.parameters = form.parameters;
    e.constants = form.constants;
    if (!form.constants.empty()) {
      e.model_free = {parameter_of(StandsFor::joint_offset, e.joints[0])};
      e.requests.push_back({effect_that_stands_for(StandsFor::joint_offset).name, e.joints});
    }
    add(std::move(e), group);
  }

  /// What `identify` is to be asked for, and the names of the parameters. Throws what effect_terms throws.
  void find_terms(const Effect& effect, const std::vector<Effect>& own, NotTestable* obstacle, Explanation* e) {
    const EffectTraits& traits = effect.traits;
    if (traits.driver == Driver::temperature && task_.data.temperature && !input("temp")) {
      throw MissingColumn("the column temp_C has rows without a number: fill or remove it to test " + effect.name);
    }
    if (traits.needs_masses && !knows_mass(task_.at)) {
      *obstacle = {effect.name, e->joints,
                   effect.name +
                       " needs the links' mass and com: the payload's torque alone does not say in which zone, or on "
                       "which side, a joint is",
                   Untestable::masses_missing};
      return;
    }
    // Weights that nobody knows: the compliance finds the first moments itself.
    const bool weights_missing = !traits.weights_found_by.empty() && !knows_mass(task_.at);
    if (weights_missing) e->requests.push_back({traits.weights_found_by, e->joints});
    if (!weights_missing || task_.data.payload) e->requests.push_back({effect.name, e->joints});
    effect_terms(e->requests, task_.nominal, task_.data, own);
    const std::vector<Term> terms = effect_terms(e->requests, task_.at, task_.data, own);
    if (weights_missing)
      e->note =
          "the links' masses are not known: their first moments are found as well (" + traits.weights_found_by + ")";
    if (traits.stands_for != StandsFor::terms) {
      e->parameters = e->model_free = {parameter_of(traits.stands_for, e->joints[0])};
      return;
    }
    for (const Term& term : terms) {
      if (std::find(e->parameters.begin(), e->parameters.end(), term.parameter) == e->parameters.end())
        e->parameters.push_back(term.parameter);
    }
  }

  /// An input that never changes: the effect cannot be told from geometry, and is only named beside it.
  void shadow_of_constant_input(const Effect& effect, const Explanation& e, std::size_t joint, ColumnGroup* group) {
    if (effect.traits.driver == Driver::direction) {
      group->shadow = true;
      out_.not_testable.push_back({effect.name, e.joints,
                                   "every pose was approached from the same side: the same as a joint zero",
                                   Untestable::input_constant});
    }
    if (effect.traits.driver == Driver::temperature) {
      group->shadow = true;
      if (joint == 0 && (e.joints.empty() || !effect.terms_of_robot))
        out_.not_testable.push_back(
            {effect.name, {}, "the temperature is constant: the same as geometry", Untestable::input_constant});
    }
  }

  /// A frame that wanders freely: six coordinates, or the three of the place, by hats of time.
  void drifts() {
    const auto wanders = [](Moves what) -> const std::string& {
      return effect_that([what](const EffectTraits& t) { return t.wanders && t.moves == what; }).name;
    };
    const std::string &of_base = wanders(Moves::base), &of_targets = wanders(Moves::target);
    const int time = time_index();
    if (left_out(of_base) || time < 0) return;
    const InputColumn& along = task_.inputs[static_cast<std::size_t>(time)];
    const int affordable = most_parameters();
    if (3 * static_cast<int>(knots_of(along, task_.rows, kDriftKnots[0]).size()) > affordable) {
      out_.not_testable.push_back({of_base, {}, "too few poses for a frame that is a free function of time"});
      return;
    }
    const bool by_order = along.name == "order";
    if (by_order)
      out_.not_testable.push_back(
          {of_base, {}, "no column t_s: the order of the rows stands for time", Untestable::column_missing});
    for (const int most : kDriftKnots) {
      const std::vector<double> knots = knots_of(along, task_.rows, most);
      const int found = static_cast<int>(knots.size());
      if (found < std::min(most, 4) || (most > kDriftKnots[0] && found < most)) continue;
      for (const int coordinates : {3, 6}) {
        if (coordinates * found <= affordable) add_wandering_base(of_base, time, knots, coordinates);
      }
      if (most != kDriftKnots[0]) continue;
      // Or it is the target that has slipped on the last link.
      for (const Target& target : task_.at.targets) add_wandering_target(of_targets, target.name, time, knots);
    }
  }

  /// Parameters of a free function that the training poses are enough for.
  int most_parameters() const {
    constexpr double kValuesEach = 4.0;  ///< measured values that each of them needs
    std::set<std::int32_t> poses;
    for (const std::int32_t row : task_.rows) {
      if (!task_.set[static_cast<std::size_t>(row)]) poses.insert(task_.cluster[static_cast<std::size_t>(row)]);
    }
    return static_cast<int>((task_.data.distance ? 1.0 : 3.0) * static_cast<double>(poses.size()) / kValuesEach);
  }

  Explanation wandering(const std::string& effect, const std::string& site, int time,
                        const std::vector<double>& knots) const {
    Explanation e;
    e.kind = Explanation::Kind::drift;
    e.effect = effect;
    e.site = site;
    e.inputs = {time};
    e.knots = {knots};
    e.driver = task_.inputs[static_cast<std::size_t>(time)].name;
    return e;
  }
  static std::string time_in_words(const Explanation& e) {
    return e.driver == "order" ? "the order of the rows" : "time";
  }

  void add_wandering_base(const std::string& effect, int time, const std::vector<double>& knots, int coordinates) {
    Explanation e = wandering(effect, coordinates == 3 ? "base.xyz" : "base.xyzrxryrz", time, knots);
    const std::string count = std::to_string(knots.size());
    e.note = "the frame wanders: a free function of " + time_in_words(e) + ", " + count + " knots";
    for (int c = 0; c < coordinates; ++c) {
      for (std::size_t k = 0; k < knots.size(); ++k) {
        e.parameters.push_back(effect + "_" + count + "_" + std::to_string(coordinates) + ".base." + kFrame[c] + "." +
                               std::to_string(k + 1));
      }
    }
    add(std::move(e), {});
  }

  void add_wandering_target(const std::string& effect, const std::string& target, int time,
                            const std::vector<double>& knots) {
    Explanation e = wandering(effect, target + ".xyz", time, knots);
    e.note = "target " + target + " moves on the last link: a free function of " + time_in_words(e);
    for (std::size_t k = 0; k < 3 * knots.size(); ++k)
      e.parameters.push_back("wander." + target + "." + std::to_string(k + 1));
    add(std::move(e), {});
  }

  /// Where no temperature was recorded, what follows it is a function of time: all lengths that grow together, which
  /// nothing else does, by name; a joint's zero, which other things move as well, as a function that is unknown. Where
  /// one was, nothing is as warm as its sensor says, and the first joint's zero may stand where a drift is named.
  void warmth_over_time() {
    const int time = time_index();
    if (time < 0) return;
    for (const Effect& effect : catalogue()) {
      if (effect.traits.driver != Driver::temperature || !is_searched(effect) || left_out(effect.name)) continue;
      const bool of_zeros = effect.traits.law_test == LawTest::of_driver;
      if (task_.data.temperature) {
        if (of_zeros) add_moving_zero(effect.name, task_.at.joints.front(), time, true);
        continue;
      }
      if (effect.traits.law_test == LawTest::times_the_lengths) add_growths(effect.name, time);
      if (of_zeros) {
        for (const Joint& joint : task_.at.joints) add_moving_zero(effect.name, joint, time, false);
      }
    }
  }

  void add_growths(const std::string& effect, int time) {
    std::vector<std::string> every;
    for (const Joint& joint : task_.at.joints) every.push_back(joint.name);
    add_growth(effect, {}, every, time);
    for (const std::string& joint : every) add_growth(effect, {joint}, {joint}, time);
  }

  /// A candidate that is one function of time, with a few knots and with more of them.
  void add_over_time(const Explanation& what, const std::string& prefix, bool only_alternative = false) {
    for (const int most : {kDriftKnots[0], kDriftKnots[1]}) {
      Explanation e = what;
      e.knots = {knots_of(task_.inputs[static_cast<std::size_t>(e.inputs[0])], task_.rows, most)};
      const std::size_t count = e.knots[0].size();
      const bool no_finer = most > kDriftKnots[0] && static_cast<int>(count) < most;
      if (count < 4 || no_finer || static_cast<int>(count) > most_parameters()) return;
      for (std::size_t k = 0; k < count; ++k)
        e.parameters.push_back(prefix + "_" + std::to_string(count) + "." + std::to_string(k + 1));
      ColumnGroup group;
      group.shadow = only_alternative;
      add(std::move(e), std::move(group));
    }
  }

  /// The lengths of some links times one function of time, which is zero at first: what was wrong then is geometry.
  void add_growth(const std::string& effect, const std::vector<std::string>& joints,
                  const std::vector<std::string>& links, int time) {
    const bool any_length = std::any_of(
        links.begin(), links.end(), [&](const std::string& link) { return !lengths_of_link(task_.at, link).empty(); });
    if (!any_length) return;
    Explanation e = wandering(effect, "", time, {});
    e.joints = joints;
    e.law_test = LawTest::times_the_lengths;
    e.note = "no temperature was recorded: lengths grow together, a free function of " + time_in_words(e);
    add_over_time(e, effect + (joints.empty() ? "" : "." + joints[0]) + ".of_" + e.driver);
  }

  void add_moving_zero(const std::string& effect, const Joint& joint, int time, bool only_alternative) {
    if (joint.passive()) return;
    Explanation e = wandering(effect, joint.name, time, {});
    e.kind = Explanation::Kind::free;
    e.joints = {joint.name};
    add_over_time(e, "free." + joint.name + "." + e.driver, only_alternative);
  }

  /// Corrections of the laws of effects at joints, to be asked for once the effect itself is in.
  void law_tests() {
    for (std::size_t joint = 0; joint < task_.at.joints.size(); ++joint) {
      for (const LawTest test : {LawTest::of_driver, LawTest::times_direction, LawTest::times_the_lengths}) {
        for (const std::vector<Effect>* effects : {&catalogue(), &task_.options.own_effects}) {
          for (const Effect& effect : *effects) {
            const bool acts = moves_[joint] || acts_at_rest(effect.traits);
            if (acts && effect.traits.law_test == test && is_searched(effect)) add_law_test(effect, joint);
          }
        }
      }
    }
    for (const std::vector<Effect>* effects : {&catalogue(), &task_.options.own_effects}) {
      for (const Effect& effect : *effects) {
        const bool of_lengths = effect.traits.law_test == LawTest::times_the_lengths;
        if (of_lengths && effect.terms_of_robot && input("temp") && is_searched(effect)) add_law_test_of_robot(effect);
      }
    }
  }

  /// The input that the correction of a law is a function of.
  std::string input_of_law_test(const EffectTraits& traits, std::size_t joint) const {
    switch (traits.law_test) {
      case LawTest::times_direction:
        return input_name(knows_mass(task_.at) ? Driver::gravity_torque : Driver::angle, joint);
      case LawTest::times_the_lengths:  // warmth lags behind the sensor: a function of time, not of the temperature
        if (input_index("temp") < 0 || time_index() < 0) return "time";
        return task_.inputs[static_cast<std::size_t>(time_index())].name;
      default:
        return input_name(traits.driver, joint);
    }
  }

  void add_law_test(const Effect& effect, std::size_t joint) {
    Explanation e;
    e.joints = {task_.at.joints[joint].name};
    e.site = e.joints[0];
    add_correction(effect, joint, std::move(e));
  }

  /// All links by one function. The law of the robot as a whole has no number (ColumnGroup::law_at): this is no
  /// candidate, and is only compared with what that law leaves (departures_from_laws).
  void add_law_test_of_robot(const Effect& effect) { add_correction(effect, task_.at.joints.size(), {}); }

  /// `joint`: one past the last for the robot as a whole.
  void add_correction(const Effect& effect, std::size_t joint, Explanation e) {
    e.driver = input_of_law_test(effect.traits, joint);
    const int at = input_index(e.driver);
    if (at < 0 || task_.inputs[static_cast<std::size_t>(at)].constant) return;
    e.kind = Explanation::Kind::law;
    e.effect = effect.name;
    e.inputs = {at};
    e.law_test = effect.traits.law_test;
    e.knots = {knots_of(task_.inputs[static_cast<std::size_t>(at)], task_.rows,
                        e.law_test == LawTest::times_direction ? 5 : 8)};
    if (e.knots[0].size() < 3) return;
    for (std::size_t k = 0; k < e.knots[0].size(); ++k)
      e.parameters.push_back("law." + effect.name + "." + e.site + "." + std::to_string(k + 1));
    ColumnGroup group;
    group.corrects_law_at = group.law_at = law_number(effect.traits, joint);
    add(std::move(e), std::move(group));
  }

  const DesignTask& task_;
  std::vector<bool> moves_;
  Candidates out_;
};

/// Groups of one kind share the prior: the cost of having looked at all of them.
void charge_search(Candidates* candidates) {
  double count = 0.0;
  for (const ColumnGroup& group : candidates->groups) count += group.corrects_law_at < 0 && !group.shadow ? 1.0 : 0.0;
  for (ColumnGroup& group : candidates->groups)
    group.cost += group.corrects_law_at < 0 ? std::log(std::max(1.0, count)) : std::log(3.0);
}

}  // namespace

Candidates make_candidates(const DesignTask& task) {
  Candidates out = Builder(task).build();
  charge_search(&out);
  return out;
}

bool is_left_out(const DiagnoseOptions& options, const std::string& effect) {
  return std::find(options.leave_out.begin(), options.leave_out.end(), effect) != options.leave_out.end();
}

std::vector<std::pair<std::string, double>> lengths_of_link(const Robot& robot, const std::string& joint) {
  // As of the effect `thermal`: an offset found where the drawing has none is no beam, and what grows stays the same.
  constexpr double kShortest = 1e-3;  ///< [m]
  const Joint& link = robot.joints[robot.joint_index(joint)];
  const Eigen::Vector3d origin = link.T_parent_joint.translation();
  const std::pair<const char*, double> lengths[5] = {
      {"a", link.a}, {"d", link.d}, {"x", origin.x()}, {"y", origin.y()}, {"z", origin.z()}};
  std::vector<std::pair<std::string, double>> out;
  for (const auto& [value, length] : lengths) {
    if ((value[0] >= 'x') == (robot.convention == Convention::urdf) && std::abs(length) >= kShortest)
      out.push_back({joint + "." + value, length});
  }
  return out;
}

std::vector<std::pair<std::string, double>> lengths_that_grow(const Robot& robot, const Explanation& e) {
  std::vector<std::pair<std::string, double>> out;
  for (const Joint& joint : robot.joints) {
    if (!e.joints.empty() && std::find(e.joints.begin(), e.joints.end(), joint.name) == e.joints.end()) continue;
    for (auto& length : lengths_of_link(robot, joint.name)) out.push_back(std::move(length));
  }
  return out;
}

std::vector<std::string> frame_coordinates(const std::string& site) {
  const std::size_t dot = site.rfind(".xyz");
  if (site != "base" && dot == std::string::npos) return {};
  const std::string frame = site.substr(0, dot);
  const bool place_only = dot != std::string::npos && site.size() == dot + 4;
  std::vector<std::string> out;
  for (int k = 0; k < (place_only ? 3 : 6); ++k) out.push_back(frame + "." + kFrame[k]);
  return out;
}

}  // namespace truing::diagnosis
