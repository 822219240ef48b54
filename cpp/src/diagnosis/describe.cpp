// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What the user reads of a decision: effects, curves, alternatives, the sentence.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "diagnosis/free_search.hpp"
#include "diagnosis/next_poses.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"
#include "model/effects/traits.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;

constexpr double kUnconfirmed = 0.6;  ///< at most so likely is what may gain nothing on poses that the fit did not see
constexpr double kMoreThanNoise = 2.0;  ///< times the noise: an error that noise does not make

/// What a curve is drawn of: motion of a site against an input, for a range of a second one if there is one.
struct Along {
  int input = -1;
  int site_column = -1;
  int second = -1;
  double low = 0.0, high = 0.0;
  double period = 0.0;         ///< the input is folded by it; 0: it is not
  std::vector<int> columns{};  ///< of the design, that make the motion; none: all of the group's
};

static bool is_among(const std::vector<int>& values, int value) {
  return std::find(values.begin(), values.end(), value) != values.end();
}

/// Places, among the state's columns, of a group's own and of what corrects its law; of some of them only, if told so.
static std::vector<std::size_t> columns_of_law(const Work& work, const Decision& decision, int group,
                                               const std::vector<int>& only) {
  const auto& groups = work.design.candidates.groups;
  std::vector<std::size_t> own;
  for (std::size_t c = 0; c < decision.state.columns.size(); ++c) {
    const int column = decision.state.columns[c];
    bool mine = is_among(groups[static_cast<std::size_t>(group)].columns, column);
    for (const auto& [other, corrected] : decision.corrects)
      mine |= corrected == group && is_among(groups[static_cast<std::size_t>(other)].columns, column);
    if (mine && (only.empty() || is_among(only, column))) own.push_back(c);
  }
  return own;
}

/// Of one row: the site's motion that its values show (de / dd) and that the law has (df / dd).
struct RowSum {
  double de = 0.0, dd = 0.0, df = 0.0;
};

static std::map<std::int32_t, RowSum> sums_by_row(const Work& work, const Evidence::State& state,
                                                  const std::vector<std::size_t>& own, const Along& along) {
  const Design& design = work.design;
  std::map<std::int32_t, RowSum> sums;
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const std::int32_t row = design.row[static_cast<std::size_t>(i)];
    if (along.second >= 0) {
      const double value = work.inputs[static_cast<std::size_t>(along.second)].values[static_cast<std::size_t>(row)];
      if (value < along.low || value > along.high) continue;
    }
    double e = design.y[i], f = 0.0;
    for (std::size_t c = 0; c < state.columns.size(); ++c)
      e -= design.x(i, state.columns[c]) * state.solution[static_cast<Eigen::Index>(c)];
    for (const std::size_t c : own) f += design.x(i, state.columns[c]) * state.solution[static_cast<Eigen::Index>(c)];
    const double w = design.weight[i], d = w * design.x(i, along.site_column);
    RowSum& sum = sums[row];
    sum.de += d * w * e;
    sum.df += d * w * f;
    sum.dd += d * d;
  }
  return sums;
}

/// What one pose says.
struct Sample {
  double x, value, fitted, lever;
};

/// Of the poses at which the site moves the tip well, by input.
static std::vector<Sample> samples_of(const std::map<std::int32_t, RowSum>& sums, const InputColumn& input,
                                      double period) {
  std::vector<double> levers;
  for (const auto& [row, sum] : sums) levers.push_back(sum.dd);
  const double least = sums.empty() ? 0.0 : 0.3 * median_of(levers);
  std::vector<Sample> samples;
  for (const auto& [row, sum] : sums) {
    if (!(sum.dd > least) || !(sum.dd > 0.0)) continue;
    const double value = input.values[static_cast<std::size_t>(row)];
    const double x = period > 0.0 ? value - period * std::floor(value / period) : value;
    samples.push_back({x, (sum.de + sum.df) / sum.dd, sum.df / sum.dd, sum.dd});
  }
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) { return a.x < b.x; });
  return samples;
}

/// The fitted function: its mean over the poses near each place (exact when it depends on this input alone).
static std::vector<std::array<double, 3>> points_of(const std::vector<Sample>& samples, double sigma) {
  constexpr std::size_t kBins = 24;
  std::vector<double> distinct;
  for (const Sample& s : samples) {
    if (distinct.empty() || s.x > distinct.back() + 1e-9) distinct.push_back(s.x);
  }
  const bool few = distinct.size() <= kBins;
  const std::size_t bins = std::min(distinct.size(), kBins);
  std::vector<std::array<double, 3>> points;
  for (std::size_t b = 0; b < bins; ++b) {
    const std::size_t from = few ? 0 : b * samples.size() / bins,
                      to = few ? samples.size() : (b + 1) * samples.size() / bins;
    double x = 0.0, f = 0.0, weight = 0.0, lever = 0.0;
    for (std::size_t k = from; k < to; ++k) {
      if (few && std::abs(samples[k].x - distinct[b]) > 1e-9) continue;
      x += samples[k].x;
      f += samples[k].fitted;
      lever += samples[k].lever;
      weight += 1.0;
    }
    if (weight > 0.0) points.push_back({x / weight, f / weight, sigma / std::sqrt(lever)});
  }
  return points;
}

/// Motion of a site, pose by pose, as the measurements say it, and the fitted function through it.
static Curve curve_of(const Work& work, const Decision& decision, int group, const Along& along) {
  const Design& design = work.design;
  const InputColumn& input = work.inputs[static_cast<std::size_t>(along.input)];
  Curve out;
  out.input = input.name;
  out.input_unit = input.unit;
  out.unit = design.column_units[static_cast<std::size_t>(along.site_column)];
  out.site = design.column_names[static_cast<std::size_t>(along.site_column)];
  if (out.site.size() > 7 && out.site.compare(out.site.size() - 7, 7, ".offset") == 0)
    out.site.resize(out.site.size() - 7);
  if (along.second >= 0) {
    out.second_input = work.inputs[static_cast<std::size_t>(along.second)].name;
    out.second_low = along.low;
    out.second_high = along.high;
  }
  out.period = along.period;
  const std::vector<std::size_t> own = columns_of_law(work, decision, group, along.columns);
  const std::vector<Sample> samples = samples_of(sums_by_row(work, decision.state, own, along), input, along.period);
  const std::size_t step = std::max<std::size_t>(1, samples.size() / 600);
  for (std::size_t k = 0; k < samples.size(); k += step) out.samples.push_back({samples[k].x, samples[k].value});
  out.points = points_of(samples, std::sqrt(decision.state.sigma2));
  return out;
}

static std::string at_joints(const std::string& effect, const std::vector<std::string>& joints) {
  if (joints.empty()) return "";
  const bool of_links = model::traits_of(effect, {}).stands_for == StandsFor::link_geometry;
  if (joints.size() > 3)
    return (of_links ? " of " : " at ") + std::to_string(joints.size()) + (of_links ? " links" : " joints");
  return " at " + listed(joints);
}

/// What the data vary, as far as it tells effects apart.
static Recorded recorded(const Work& work) {
  Recorded out;
  for (const InputColumn& input : work.inputs) {
    if (input.constant) continue;
    out.direction |= input.joint >= 0 && !work.given.inferred_direction &&
                     input.name == input_name(Driver::direction, static_cast<std::size_t>(input.joint));
    out.payload |= input.name == "payload";
    out.temperature |= input.name == input_name(Driver::temperature, 0);
    out.time |= input.name == input_name(Driver::time, 0);
  }
  out.orientation = std::any_of(work.design.component.begin(), work.design.component.end(),
                                [](std::int8_t component) { return kind_of(component) == 1; });
  return out;
}

static std::string separated_by(const Work& work, const Explanation& a, const Explanation& b) {
  const std::vector<Effect>& own = work.given.options.own_effects;
  const std::string where_they_differ = "measure poses where the two differ: see the next poses";
  const Effect *first = effect_or_null(a.effect, own), *second = effect_or_null(b.effect, own);
  if (!first || !second) return where_they_differ;
  return model::separated_by({first, a.joints}, {second, b.joints}, recorded(work), where_they_differ);
}

/// The effects that `identify` is to be asked for. None: a frame that wanders freely is no effect of its catalogue.
static std::string identify_as(const Explanation& e) {
  if (e.kind == Kind::drift) return "";
  if (e.kind == Kind::all_geometry) return e.effect;
  std::string out;
  for (const EffectRequest& request :
       e.requests.empty() ? std::vector<EffectRequest>{{e.effect, e.joints}} : e.requests) {
    out += (out.empty() ? "" : ",") + request.effect;
    for (std::size_t k = 0; k < request.joints.size(); ++k) out += (k == 0 ? ":" : "+") + request.joints[k];
  }
  return out;
}

/// Values of the parameters of what was found by the search and is not refitted.
static std::vector<Parameter> parameters_of_search(const Work& work, const Evidence::State& state,
                                                   const Explanation& e) {
  std::vector<Parameter> out;
  for (const std::string& name : e.parameters) {
    const int column = work.design.column(name);
    const auto k = std::find(state.columns.begin(), state.columns.end(), column) - state.columns.begin();
    if (column < 0 || k >= static_cast<std::ptrdiff_t>(state.columns.size())) continue;
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(state.solution.size(), static_cast<Eigen::Index>(k));
    const double variance = state.sigma2 * unit.dot(state.factor.solve(unit));
    out.push_back({name, 0.0, state.solution[static_cast<Eigen::Index>(k)], std::sqrt(std::max(variance, 0.0)),
                   work.design.column_units[static_cast<std::size_t>(column)], false});
  }
  return out;
}

static std::vector<Parameter> parameters_of(const Work& work, const Evidence::State& state, const Explanation& e,
                                            const Identification& refitted) {
  std::vector<Parameter> out;
  for (const Parameter& parameter : refitted.parameters) {
    if (std::find(e.parameters.begin(), e.parameters.end(), parameter.name) == e.parameters.end()) continue;
    if (e.kind == Kind::drift) continue;  // a curve, not numbers
    out.push_back(parameter);
  }
  const bool grows = e.kind == Kind::drift && e.law_test == LawTest::times_the_lengths;
  if (grows || (out.empty() && e.kind == Kind::catalogue)) return parameters_of_search(work, state, e);
  return out;
}

/// How far the error of unseen poses shrinks by one group, the last one in.
struct Shrinkage {
  UnseenErrors without, with;
  ErrorStatistics before, after;
  Share shrink;
  double gap = 0.0;             ///< held-out sum of squares with no group
  double closed_by_last = 0.0;  ///< and what the group closes of it
};

static Shrinkage shrinkage_by(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at) {
  const Evidence::State& state = decision.state;
  const auto squares = [&](const Evidence::State& s) {
    return held_out_squares(work.grams.test, s.columns, s.solution);
  };
  const Choice less = without(state.choice, work.design.candidates.groups, at);
  const DiagnoseOptions& options = work.given.options;
  Shrinkage out;
  out.without = unseen_errors(work, less);
  out.with = unseen_errors(work, state.choice);
  out.before = error_statistics(out.without.length);
  out.after = error_statistics(out.with.length);
  out.shrink = shrinkage(out.without, out.with, options.resamples, options.seed + 7);
  out.gap = squares(evidence.evaluate({}));
  out.closed_by_last = squares(evidence.evaluate(less)) - squares(state);
  return out;
}

/// Share of the gap that a group closes when it is the only one.
static double share_alone(const Work& work, const Evidence& evidence, const Choice& choice, std::size_t at,
                          double gap) {
  Choice only;
  only.groups = {choice.groups[at]};
  only.scales = {choice.scales[at]};
  const Evidence::State alone = evidence.evaluate(only);
  return std::max(0.0, 1.0 - held_out_squares(work.grams.test, alone.columns, alone.solution) / gap);
}

/// Why an effect was not tested for want of a column; nullptr: no column was missing.
static const NotTestable* lacking(const Work& work, const std::string& effect) {
  for (const NotTestable& n : work.design.candidates.not_testable) {
    if (n.effect == effect && n.reason == Untestable::column_missing) return &n;
  }
  return nullptr;
}

/// Its law needs a column that is missing, and time stood in for that.
static bool is_tried_over_time(const Work& work, const std::string& effect) {
  const auto& named = work.design.candidates.named;
  return std::any_of(named.begin(), named.end(),
                     [&](const Explanation& e) { return is_over_time(e) && e.effect == effect; });
}

static std::string recorded_it_would_tell(const NotTestable& lacking) { return "record what it needs: " + lacking.why; }

/// What could stand in its place by these data.
static std::vector<Alternative> class_of(const Work& work, const Explanation& e, const Sureness& sure,
                                         double probability) {
  constexpr std::size_t kMost = 8;
  std::vector<Alternative> out;
  std::set<std::pair<std::string, std::vector<std::string>>> listed_already;
  double rest = 0.0;
  for (const Rival& rival : sure.rivals) rest += rival.in_class ? std::exp(-0.5 * std::max(0.0, rival.loss)) : 0.0;
  for (const Rival& rival : sure.rivals) {
    const Explanation& other = work.design.candidates.named[static_cast<std::size_t>(rival.group)];
    if (!rival.in_class || !listed_already.insert({other.effect, other.joints}).second) continue;
    const NotTestable *needs = is_over_time(other) ? lacking(work, other.effect) : nullptr,
                      *need_of_this = is_over_time(e) ? lacking(work, e.effect) : nullptr;
    const std::string by = needs          ? recorded_it_would_tell(*needs)
                           : need_of_this ? recorded_it_would_tell(*need_of_this)
                                          : separated_by(work, e, other);
    out.push_back(
        {other.effect, other.joints, probability * std::exp(-0.5 * std::max(0.0, rival.loss)) / (1.0 + rest), by});
    if (out.size() >= kMost) break;
  }
  return out;
}

/// What was not recorded may do the same.
static std::vector<Alternative> untested_mimics(const Work& work, const Explanation& e) {
  std::vector<Alternative> out;
  for (const std::string& name : effect_traits(work, e).mimicked_by) {
    const NotTestable* why = lacking(work, name);
    if (!why || is_tried_over_time(work, name)) continue;
    const bool whole_robot = !find_effect(name, work.given.options.own_effects).per_joint;
    out.push_back({name, whole_robot ? std::vector<std::string>{} : e.joints, 0.0, recorded_it_would_tell(*why)});
  }
  return out;
}

/// A law that repeats many times per turn, at each of its joints: folded by its period, or it would be a hedge.
static void draw_periods(const Work& work, const Decision& decision, int g, FoundEffect* out) {
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
  const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(g)].columns;
  const std::size_t each = columns.size() / e.joints.size();
  for (std::size_t k = 0; k < e.joints.size(); ++k) {
    const std::size_t joint = work.given.frames.robot.joint_index(e.joints[k]);
    Along along{input_named(work, input_name(Driver::angle, joint)), work.design.joint_column[joint][0]};
    along.period = e.period;
    along.columns.assign(columns.begin() + static_cast<std::ptrdiff_t>(k * each),
                         columns.begin() + static_cast<std::ptrdiff_t>((k + 1) * each));
    out->curves.push_back(curve_of(work, decision, g, along));
  }
}

/// The law, drawn: over what corrects it, over its own input, or, of a wandering base, over time.
static void draw_law(const Work& work, const Decision& decision, int g, FoundEffect* out) {
  const auto& named = work.design.candidates.named;
  const Explanation& e = named[static_cast<std::size_t>(g)];
  const EffectTraits& traits = effect_traits(work, e);
  if (e.period > 0.0) return draw_periods(work, decision, g, out);
  const auto at_joint = [&](int input) {
    const std::size_t joint = work.given.frames.robot.joint_index(e.joints[0]);
    return Along{input, work.design.joint_column[joint][0]};
  };
  std::set<int> over;
  for (const int other : decision.state.choice.groups) {
    const auto corrected = decision.corrects.find(other);
    if (corrected == decision.corrects.end() || corrected->second != g) continue;
    const Explanation& correction = named[static_cast<std::size_t>(other)];
    if (is_named(correction)) continue;  // in words, by add_departures
    const std::string driver = work.inputs[static_cast<std::size_t>(correction.inputs[0])].name;
    const int input = input_named(work, driver);
    if (!over.insert(input).second) continue;  // two of its functions, one curve of all that it makes
    out->note +=
        (out->note.empty() ? "" : "; ") + std::string("its law is not the simple one: see the curve over ") + driver;
    if (input >= 0 && !e.joints.empty()) out->curves.push_back(curve_of(work, decision, g, at_joint(input)));
  }
  const int driver = input_named(work, e.driver);
  if (driver < 0) return;
  if (e.kind == Kind::catalogue && e.joints.size() == 1 && traits.moves == Moves::joint) {
    const bool drawn =
        std::any_of(out->curves.begin(), out->curves.end(), [&](const Curve& c) { return c.input == e.driver; });
    if (!drawn) out->curves.push_back(curve_of(work, decision, g, at_joint(driver)));
  }
  if (traits.moves == Moves::base) {
    for (std::size_t c = 0; c < 3 && c < work.design.base_columns.size(); ++c)
      out->curves.push_back(curve_of(work, decision, g, {driver, work.design.base_columns[c]}));
  }
}

/// What is named by itself elsewhere, and is a departure from this law here: fitted with it, and said in its note.
static void add_departures(const Work& work, const Decision& decision, int g, const Identification& refitted,
                           FoundEffect* out) {
  for (const auto& [other, corrected] : decision.corrects) {
    const Explanation& departure = work.design.candidates.named[static_cast<std::size_t>(other)];
    if (corrected != g || !is_named(departure) || !is_among(decision.state.choice.groups, other)) continue;
    if (!out->note.empty()) out->note += "; ";
    out->note += "its law is not the simple one: what it leaves looks like " + plain(departure.effect);
    if (const std::string also = identify_as(departure); !also.empty()) out->identify_as += "," + also;
    for (Parameter& parameter : parameters_of(work, decision.state, departure, refitted))
      out->parameters.push_back(std::move(parameter));
  }
}

/// What the user reads of one group.
FoundEffect describe(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at,
                     const Sureness& sure, const Resampled& resampled, bool unknown, const Identification& refitted) {
  const int g = decision.state.choice.groups[at];
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
  FoundEffect out;
  out.effect = e.effect;
  out.joints = e.joints;
  out.note = e.note;
  out.identify_as = identify_as(e);
  out.parameters = parameters_of(work, decision.state, e, refitted);
  const Shrinkage shrinkage = shrinkage_by(work, evidence, decision, at);
  const std::vector<Ground> grounds =
      grounds_of(work, decision, resampled, g, sure, shrinkage.without, shrinkage.with, unknown);
  const double probability = confidence(sure.posterior, grounds);
  out.probability = probability;
  out.grounds = grounds_told(sure.posterior, grounds);
  out.held_out_before = shrinkage.before;
  out.held_out_after = shrinkage.after;
  out.shrink = shrinkage.shrink;
  if (!(out.shrink.low > 0.0)) out.probability = std::min(out.probability, kUnconfirmed);
  if (shrinkage.gap > 0.0) {
    out.share_alone = share_alone(work, evidence, decision.state.choice, at, shrinkage.gap);
    out.share_last = std::max(0.0, shrinkage.closed_by_last / shrinkage.gap);
  }
  out.confounded_with = class_of(work, e, sure, probability);
  for (Alternative& mimic : untested_mimics(work, e)) out.confounded_with.push_back(std::move(mimic));
  std::vector<int> columns;
  for (const std::size_t c : columns_of_law(work, decision, g, {})) columns.push_back(decision.state.columns[c]);
  out.size_at_tip = size_at_tip(work, decision.state, columns);
  draw_law(work, decision, g, &out);
  add_departures(work, decision, g, refitted, &out);
  return out;
}

/// A free function of one input, or three slices along the second one.
static std::vector<Curve> curves_of_function(const Work& work, const Decision& decision, int g, int site) {
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
  if (e.inputs.size() == 1) return {curve_of(work, decision, g, {e.inputs[0], site})};
  std::vector<double> values = work.inputs[static_cast<std::size_t>(e.inputs[1])].values;
  double edges[4];
  edges[0] = *std::min_element(values.begin(), values.end());
  edges[3] = *std::max_element(values.begin(), values.end());
  edges[1] = quantile(&values, 1.0 / 3.0);
  edges[2] = quantile(&values, 2.0 / 3.0);
  std::vector<Curve> out;
  for (int k = 0; k < 3; ++k) {
    Curve curve = curve_of(work, decision, g, {e.inputs[0], site, e.inputs[1], edges[k], edges[k + 1]});
    if (!curve.points.empty()) out.push_back(std::move(curve));
  }
  return out;
}

double share_of_local_shape(const Work& work, const Decision& decision, int function, std::size_t joint) {
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(function)];
  return share_of_local_shape(curve_of(work, decision, function, {e.inputs[0], work.design.joint_column[joint][0]}));
}

/// "; or its zero moves with temperature, which was not recorded": of a joint that moves as time goes on.
static std::string unrecorded_cause(const Work& work, const Explanation& e) {
  if (e.inputs.size() != 1 || e.site == "base") return "";
  const std::string& input = work.inputs[static_cast<std::size_t>(e.inputs[0])].name;
  if (input != "order" && input != input_name(Driver::time, 0)) return "";
  for (const Effect& effect : catalogue()) {
    const bool of_joint = effect.traits.driver == Driver::temperature && effect.traits.moves == Moves::joint;
    if (of_joint && lacking(work, effect.name)) return "; or " + plain(effect.name) + ": no temperature was recorded";
  }
  return "";
}

/// "q1 and payload".
static std::string in_a_row(const std::vector<std::string>& inputs) {
  return inputs.size() == 2 ? inputs[0] + " and " + inputs[1] : listed(inputs);
}

/// What a place and its inputs say already.
static std::string plainly(const std::string& site, const std::vector<std::string>& inputs) {
  if (site == "base") return "the base moves as a function of " + in_a_row(inputs);
  return inputs.size() == 2 ? "depends on both " + in_a_row(inputs) : "";
}

/// Inputs of a free function, as the user reads them.
static std::vector<std::string> names_of_inputs(const Work& work, const Explanation& e) {
  std::vector<std::string> out;
  if (e.turning.angle >= 0) out.push_back(work.inputs[static_cast<std::size_t>(e.turning.angle)].name);
  for (const int input : e.inputs) out.push_back(work.inputs[static_cast<std::size_t>(input)].name);
  return out;
}

/// "; or J2 as a function of payload": the best function at every other joint, or the base, that these data do not tell
/// from the one that was taken, or that plainly makes the same motion.
static std::string other_places(const Work& work, const Evidence& evidence, const Evidence::State& less, double sigma2,
                                int group) {
  constexpr double kNats = 3.0;
  constexpr int kPlain = 8;  ///< parameters: more explain much of any motion
  const Explanation& mine = work.design.candidates.named[static_cast<std::size_t>(group)];
  FreeScanOptions options;
  options.threads = work.given.options.threads;
  options.flips = 0;
  const FreeScan scan =
      scan_free(work.design, evidence, less, work.inputs, work.given.frames.robot, work.noise.design_effect, options);
  Evidence::Gain own = evidence.gain(less, columns_of_groups(work, {group}), 0.0);
  for (const FreeGain& found : scan.best)
    if (found.what.site == mine.site && found.gain.evidence > own.evidence) own = found.gain;
  const auto is_as_good = [&](const Evidence::Gain& other) {
    const bool is_same_motion = other.rank <= kPlain && own.squares - other.squares < 2.0 * kNats * sigma2;
    return other.evidence > own.evidence - kNats || is_same_motion;
  };
  std::string out;
  std::set<std::string> said = {mine.site};
  for (const FreeGain& found : scan.best) {
    if (!is_as_good(found.gain) || !said.insert(found.what.site).second) continue;
    out += "; or " + found.what.site + " as a function of " + in_a_row(names_of_inputs(work, found.what));
  }
  return out.empty() ? "" : out + ": these poses do not tell which";
}

UnknownEffect describe_unknown(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at) {
  const int g = decision.state.choice.groups[at];
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
  UnknownEffect out;
  out.joint = e.site;
  out.inputs = names_of_inputs(work, e);
  const Shrinkage shrinkage = shrinkage_by(work, evidence, decision, at);
  out.held_out_before = shrinkage.before;
  out.held_out_after = shrinkage.after;
  out.shrink = shrinkage.shrink;
  if (shrinkage.gap > 0.0) out.share = std::max(0.0, shrinkage.closed_by_last) / shrinkage.gap;
  out.size_at_tip =
      size_at_tip(work, decision.state, work.design.candidates.groups[static_cast<std::size_t>(g)].columns);
  const Evidence::State less = evidence.evaluate(without(decision.state.choice, work.design.candidates.groups, at));
  const double loss = decision.state.score - less.score;
  out.probability = std::clamp(0.5 + 0.49 * std::min(1.0, loss / 30.0), 0.0, 0.99);
  std::vector<int> sites = work.design.base_columns;
  if (e.site != "base")
    sites = work.design.joint_column[work.given.frames.robot.joint_index(e.site)];
  else if (e.turning.angle >= 0)
    sites = {work.design.turning_base_columns[3], work.design.turning_base_columns[4]};
  else if (sites.size() > 3)
    sites.resize(3);
  for (const int site : sites) {
    for (Curve& curve : curves_of_function(work, decision, g, site)) out.curves.push_back(std::move(curve));
  }
  if (!out.curves.empty() && e.inputs.size() == 1 && e.site != "base")
    out.looks_like = shape_of(out.curves[0]) + unrecorded_cause(work, e);
  if (out.looks_like.empty()) out.looks_like = plainly(e.site, out.inputs);
  if (e.turning.angle >= 0)
    out.looks_like =
        "the base, or the bearing of the joint that turns the arm, gives way towards the arm, as a function of " +
        out.inputs[1];
  if (e.kind == Kind::free && decision.corrects.count(g) == 0)
    out.looks_like += other_places(work, evidence, less, decision.state.sigma2, g);
  return out;
}

UnknownEffect describe_lack_of_fit(const Diagnosis& d, double excess) {
  UnknownEffect out;
  out.held_out_before = out.held_out_after = d.gap;
  const double nats = 0.5 * excess * excess;
  out.probability = 0.5 + 0.49 * std::min(1.0, nats / 30.0);
  out.looks_like = "no function of what was recorded, at one joint or the base";
  return out;
}

UnknownEffect describe_mistake(const Diagnosis& d, const SanityFinding& mistake) {
  UnknownEffect out;
  out.held_out_before = out.held_out_after = d.gap;
  out.probability = 0.99;
  out.looks_like = "the robot file or the columns: " + mistake.kind;
  return out;
}

std::vector<Candidate> list_candidates(const Work& work, const Evidence& evidence,
                                       const std::vector<Evidence::Gain>& first) {
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  // Everything at once, under a wide prior: what "fit all and read the table" would show.
  Choice everything;
  for (std::size_t g = 0; g < first.size(); ++g) {
    // Of forms with constants of their own none: the parameters are the same ones.
    if (named[g].kind != Kind::catalogue || groups[g].shadow || !named[g].constants.empty()) continue;
    everything.groups.push_back(static_cast<int>(g));
    everything.scales.push_back(1.0);
  }
  const Evidence::State all = evidence.evaluate(everything);
  Eigen::VectorXd sigma = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(all.columns.size()));
  const Eigen::MatrixXd inverse = all.factor.solve(Eigen::MatrixXd::Identity(sigma.size(), sigma.size()));
  for (Eigen::Index k = 0; k < sigma.size(); ++k) sigma[k] = std::sqrt(std::max(all.sigma2 * inverse(k, k), 1e-300));
  const double without_any = std::max(cross_validated(work, {}), 1e-300);
  std::vector<Candidate> out;
  for (std::size_t g = 0; g < first.size(); ++g) {
    if (groups[g].corrects_law_at >= 0 || named[g].kind == Kind::law) continue;
    if (is_over_time(named[g]) && effect_traits(work, named[g]).driver != Driver::time) continue;  // its own is missing
    Candidate c;
    c.effect = named[g].effect;
    c.joints = named[g].joints;
    c.columns = first[g].rank;
    c.gain = first[g].squares;  // weights have made noise the unit
    c.evidence = first[g].score;
    if (!groups[g].columns.empty()) {
      Choice alone;
      alone.groups = {static_cast<int>(g)};
      alone.scales = {first[g].scale};
      c.held_out_gain = 1.0 - cross_validated(work, alone) / without_any;
    }
    for (std::size_t k = 0; k < all.columns.size(); ++k) {
      const bool mine =
          std::find(groups[g].columns.begin(), groups[g].columns.end(), all.columns[k]) != groups[g].columns.end();
      if (mine)
        c.largest_z = std::max(
            c.largest_z, std::abs(all.solution[static_cast<Eigen::Index>(k)]) / sigma[static_cast<Eigen::Index>(k)]);
    }
    // Of an effect's forms the one that explains most.
    const auto same = std::find_if(out.begin(), out.end(), [&](const Candidate& other) {
      return named[g].kind == Kind::catalogue && other.effect == c.effect && other.joints == c.joints;
    });
    if (same == out.end())
      out.push_back(std::move(c));
    else if (c.evidence > same->evidence)
      *same = std::move(c);
  }
  return out;
}

/// The smallest size of every effect's first parameter that would have passed the threshold, beside what was named.
std::vector<Detectable> smallest_sizes(const Work& work, const Evidence& evidence, const Decision& decision) {
  const Evidence::State& state = decision.state;
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  std::vector<Detectable> out;
  std::set<std::pair<std::string, std::vector<std::string>>> said;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Explanation& e = named[g];
    if (e.kind != Kind::catalogue || groups[g].columns.empty() || groups[g].shadow ||
        effect_traits(work, e).search == Search::by_order)
      continue;
    if (!said.insert({e.effect, e.joints}).second) continue;  // of an effect's forms the first: the usual one
    const std::vector<int>& chosen = state.choice.groups;
    if (std::find(chosen.begin(), chosen.end(), static_cast<int>(g)) != chosen.end()) continue;
    // The single column that shows best.
    double best = 0.0;
    int column = -1;
    for (const int k : groups[g].columns) {
      const double size = evidence.visible(state, k) * work.design.prior[k] * work.design.prior[k];
      if (size > best) {
        best = size;
        column = k;
      }
    }
    if (column < 0) continue;
    out.push_back({e.effect, e.joints.empty() ? "" : e.joints[0],
                   work.design.column_names[static_cast<std::size_t>(column)],
                   work.design.column_units[static_cast<std::size_t>(column)], 0.0, 0.0});
    const double a = evidence.visible(state, column);
    if (!(a > 1e-6 * evidence.gram().xx(column, column))) {
      out.pop_back();
      continue;
    }
    const double nats =
        detection_nats(decision.search.threshold, groups[g].cost, groups[g].columns.size(), evidence.gram().n);
    out.back().size = std::sqrt(2.0 * nats * state.sigma2 / a);
    out.back().size_at_tip =
        out.back().size * std::sqrt(3.0 * a / std::max(1.0, evidence.gram().n)) * work.noise.position_sigma;
  }
  std::stable_sort(out.begin(), out.end(), [](const Detectable& a, const Detectable& b) {
    return a.effect != b.effect ? a.effect < b.effect : a.size_at_tip < b.size_at_tip;
  });
  return out;
}

/// For the first named effect that something else could stand for: the poses that would tell.
void add_next_poses(const Work& work, const Measurements& data, const DiagnoseOptions& options,
                    const Decision& decision, Diagnosis* out) {
  for (const FoundEffect& effect : out->effects) {
    for (const Alternative& other : effect.confounded_with) {
      const auto request_of = [&](const std::string& name,
                                  const std::vector<std::string>& joints) -> const Explanation* {
        for (const Explanation& e : work.design.candidates.named) {
          if (e.kind == Kind::catalogue && e.effect == name && e.joints == joints) return &e;
        }
        return nullptr;
      };
      const Explanation *first = request_of(effect.effect, effect.joints),
                        *second = request_of(other.effect, other.joints);
      if (!first || !second) continue;
      Rivals rivals;
      rivals.name = effect.effect + at_joints(effect.effect, effect.joints);
      rivals.other_name = other.effect + at_joints(other.effect, other.joints);
      rivals.first = {first->parameters, first->requests};
      rivals.other = {second->parameters, second->requests};
      for (const Parameter& parameter : effect.parameters)
        rivals.parameters[parameter.name] = parameter.value - parameter.nominal;
      out->next_poses = next_poses(work.linear.at, data, rivals, options, 6,
                                   work.noise.position_sigma * std::sqrt(decision.state.sigma2));
      if (!out->next_poses.empty()) return;
    }
  }
}

/// The smallest effect that would have shown and that machines may have: play if there is one, of which everybody has
/// an idea.
static std::string would_have_shown(std::vector<Detectable> detectable) {
  detectable.erase(std::remove_if(detectable.begin(), detectable.end(),
                                  [](const Detectable& one) { return !may_be_of_machines(one); }),
                   detectable.end());
  if (detectable.empty()) return "";
  const auto rank = [](const Detectable& d) {
    return (model::traits_of(d.effect, {}).driver == Driver::direction ? 0.0 : 1.0) + d.size_at_tip;
  };
  const Detectable& easiest =
      *std::min_element(detectable.begin(), detectable.end(),
                        [&](const Detectable& a, const Detectable& b) { return rank(a) < rank(b); });
  const ReportUnit& shown = model::traits_of(easiest.effect, {}).reported;
  const bool converted = easiest.unit == shown.of;
  return " A " + plain(easiest.effect) + (easiest.joint.empty() ? "" : " at " + easiest.joint) + " above " +
         number(converted ? shown.factor * easiest.size : easiest.size, 2) + " " +
         (converted ? shown.unit : easiest.unit) + " would have shown.";
}

/// "the error of the 5 poses held out falls by 0.12 mm in the mean, with a standard error of 0.2 mm".
static std::string fall_in_words(const HeldOutFall& fall) {
  return "the error of the " + std::to_string(fall.poses) + " poses held out " + (fall.mean < 0.0 ? "rises" : "falls") +
         " by " + millimetres(std::abs(fall.mean)) + " in the mean, with a standard error of " +
         millimetres(fall.sigma);
}

static std::string causes_in_words(const Diagnosis& d) {
  if (d.effects.empty())
    return "There is a gap of " + millimetres(d.gap.rms) + " that no effect of the catalogue explains.";
  if (d.after.rms > d.gap.rms)
    return "Held-out poses neither confirm nor contradict what explains the others: " + largest_causes(d) + ".";
  return "The gap of " + millimetres(d.gap.rms) + " shrinks to " + millimetres(d.after.rms) + ": " + largest_causes(d) +
         ".";
}

/// How sure it is where held-out poses leave a doubt.
static std::string doubt_in_words(const Diagnosis& d) {
  const HeldOutFall& fall = d.held_out_fall;
  if (d.effects.empty() || fall.poses < 2 || fall.probability > kConfirmed) return "";
  return " That other poses gain by it is sure to " + number(100.0 * fall.probability, 2) +
         " %: " + fall_in_words(fall) + "." + (d.after.rms > d.gap.rms ? answerable_questions(d) : "") +
         " Measure more poses.";
}

static std::string failure_in_words(const Diagnosis& d) {
  const double after = d.effects.empty() ? d.after_unknown.rms : d.after.rms;
  return "The model found does not hold on poses that it never saw: their error of " + millimetres(d.gap.rms) +
         " would be " + millimetres(after) + " with " +
         (d.effects.empty() ? std::string("the functions found") : largest_causes(d)) + " (" +
         fall_in_words(d.held_out_fall) + "). Nothing of it is in the robot's file." + answerable_questions(d) +
         " Measure more poses, spread over the whole range.";
}

static std::string unknown_in_words(const Diagnosis& d) {
  if (d.unknown.empty()) return "";
  const UnknownEffect& u = d.unknown[0];
  if (u.inputs.empty()) {
    return " Repeats show a noise of " + millimetres(d.noise_floor) +
           ": something is there that no function of what was recorded describes.";
  }
  return " Unknown: " + (u.joint.empty() ? std::string("something") : u.joint) + " moves as a function of " +
         (u.inputs[0] == "order" && u.inputs.size() == 1 ? std::string("the order of the rows") : in_a_row(u.inputs)) +
         (u.looks_like == plainly(u.joint, u.inputs) ? "" : " (" + u.looks_like + ")") + ".";
}

bool too_few_poses(const Diagnosis& d) {
  return d.verdict == Verdict::none && d.gap.rms > kMoreThanNoise * d.noise_floor;
}

static const SanityFinding* mistake_in(const Diagnosis& d) {
  const auto found =
      std::find_if(d.sanity.begin(), d.sanity.end(), [](const SanityFinding& finding) { return finding.mistake; });
  return found == d.sanity.end() ? nullptr : &*found;
}

std::string sentence_of(const Diagnosis& d) {
  if (const SanityFinding* mistake = mistake_in(d))
    return "Robot file and measurements do not go together: " + mistake->text;
  if (too_few_poses(d)) {
    return "These poses are too few to tell a gap from noise: with base and tool fitted, held-out poses are off by " +
           millimetres(d.gap.rms) + " rms, and a fit of everything at once leaves " + millimetres(d.noise_floor) + "." +
           answerable_questions(d) + " Measure more of them.";
  }
  if (d.verdict == Verdict::none) {
    return "No gap beyond noise: " + millimetres(d.gap.rms) + " rms on held-out poses, of which noise is " +
           millimetres(d.noise_floor) + "." + would_have_shown(d.detectable);
  }
  if (d.verdict == Verdict::does_not_hold) return failure_in_words(d);
  return causes_in_words(d) + doubt_in_words(d) + unknown_in_words(d);
}

}  // namespace truing::diagnosis
