// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What the user reads of a decision: effects, curves, alternatives, the sentence.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "diagnosis/free_search.hpp"
#include "diagnosis/next_poses.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;

/// Motion of a site, pose by pose, as the measurements say it, and the fitted function through it.
static Curve curve_of(const Work& work, const Evidence::State& state, const std::map<int, int>& corrects, int group,
                      int input, int site_column, double second_low, double second_high, int second) {
  const Design& design = work.design;
  Curve out;
  const InputColumn& along = work.inputs[static_cast<std::size_t>(input)];
  out.input = along.name;
  out.input_unit = along.unit;
  out.unit = design.column_units[static_cast<std::size_t>(site_column)];
  out.site = design.column_names[static_cast<std::size_t>(site_column)];
  if (out.site.size() > 7 && out.site.compare(out.site.size() - 7, 7, ".offset") == 0)
    out.site.resize(out.site.size() - 7);
  if (second >= 0) {
    out.second_input = work.inputs[static_cast<std::size_t>(second)].name;
    out.second_low = second_low;
    out.second_high = second_high;
  }
  const ColumnGroup& g = design.candidates.groups[static_cast<std::size_t>(group)];
  std::vector<std::size_t> own;
  for (std::size_t c = 0; c < state.columns.size(); ++c) {
    const bool of_group = std::find(g.columns.begin(), g.columns.end(), state.columns[c]) != g.columns.end();
    bool of_law = false;
    for (const auto& [other, corrected] : corrects) {
      const ColumnGroup& o = design.candidates.groups[static_cast<std::size_t>(other)];
      of_law |=
          corrected == group && std::find(o.columns.begin(), o.columns.end(), state.columns[c]) != o.columns.end();
    }
    if (of_group || of_law) own.push_back(c);
  }
  struct Sum {
    double de = 0.0, dd = 0.0, df = 0.0;
  };
  std::map<std::int32_t, Sum> poses;  // by row
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const std::int32_t row = design.row[static_cast<std::size_t>(i)];
    if (second >= 0) {
      const double value = work.inputs[static_cast<std::size_t>(second)].values[static_cast<std::size_t>(row)];
      if (value < second_low || value > second_high) continue;
    }
    double e = design.y[i], f = 0.0;
    for (std::size_t c = 0; c < state.columns.size(); ++c)
      e -= design.x(i, state.columns[c]) * state.solution[static_cast<Eigen::Index>(c)];
    for (const std::size_t c : own) f += design.x(i, state.columns[c]) * state.solution[static_cast<Eigen::Index>(c)];
    const double w = design.weight[i], d = w * design.x(i, site_column);
    Sum& sum = poses[row];
    sum.de += d * w * e;
    sum.df += d * w * f;
    sum.dd += d * d;
  }
  if (poses.empty()) return out;
  std::vector<double> levers;
  for (const auto& [row, sum] : poses) levers.push_back(sum.dd);
  const double least = 0.3 * median_of(levers);
  struct Sample {
    double x, value, fitted, lever;
  };
  std::vector<Sample> samples;
  for (const auto& [row, sum] : poses) {
    if (!(sum.dd > least) || !(sum.dd > 0.0)) continue;
    samples.push_back(
        {along.values[static_cast<std::size_t>(row)], (sum.de + sum.df) / sum.dd, sum.df / sum.dd, sum.dd});
  }
  if (samples.empty()) return out;
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) { return a.x < b.x; });
  const std::size_t step = std::max<std::size_t>(1, samples.size() / 600);
  for (std::size_t k = 0; k < samples.size(); k += step) out.samples.push_back({samples[k].x, samples[k].value});
  // The fitted function: its mean over the poses near each place (exact when it depends on this input alone).
  std::vector<double> distinct;
  for (const Sample& s : samples) {
    if (distinct.empty() || s.x > distinct.back() + 1e-9) distinct.push_back(s.x);
  }
  const std::size_t bins = std::min<std::size_t>(distinct.size(), 24);
  const double sigma = std::sqrt(state.sigma2);
  for (std::size_t b = 0; b < bins; ++b) {
    const std::size_t from = distinct.size() <= 24 ? 0 : b * samples.size() / bins,
                      to = distinct.size() <= 24 ? samples.size() : (b + 1) * samples.size() / bins;
    double x = 0.0, f = 0.0, weight = 0.0, lever = 0.0;
    for (std::size_t k = from; k < to; ++k) {
      if (distinct.size() <= 24 && std::abs(samples[k].x - distinct[b]) > 1e-9) continue;
      x += samples[k].x;
      f += samples[k].fitted;
      lever += samples[k].lever;
      weight += 1.0;
    }
    if (weight > 0.0) out.points.push_back({x / weight, f / weight, sigma / std::sqrt(lever)});
  }
  return out;
}

static std::string at_joints(const std::vector<std::string>& joints) {
  if (joints.empty()) return "";
  if (joints.size() > 3) return " of " + std::to_string(joints.size()) + " links";
  return " at " + listed(joints);
}

static std::string separated_by(const std::string& a, const std::string& b) {
  const auto pair_is = [&](const char* x, const char* y) { return (a == x && b == y) || (a == y && b == x); };
  const auto one_is = [&](const char* x) { return a == x || b == x; };
  if (one_is("backlash")) return "approach the same poses from both sides";
  if (pair_is("thermal", "drift") || pair_is("thermal_zero", "drift"))
    return "measure during warm-up and cool-down, or touch a fixed nest again and again";
  if (one_is("thermal") || one_is("thermal_zero")) return "measure at two temperatures";
  if (one_is("scale")) return "measure a scale bar of known length";
  if (one_is("drift")) return "measure fixed points again and again";
  if (pair_is("joint_compliance", "link_compliance")) return "put a target on the elbow, or measure orientations";
  if (one_is("joint_compliance") || one_is("link_compliance") || one_is("stiffness_zones") ||
      one_is("gravity_backlash"))
    return "repeat the same poses with another payload";
  if (one_is("gear_ratio") || one_is("harmonic")) return "use the joint's full range, both turns";
  if (one_is("axis_wobble")) return "measure orientations as well";
  return "measure poses where the two differ: see the next poses";
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

/// What the user reads of one group.
FoundEffect describe(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at,
                     const Sureness& sure, double probability, const Identification& refitted,
                     const Resampled& resampled) {
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  const int g = decision.state.choice.groups[at];
  const Explanation& e = named[static_cast<std::size_t>(g)];
  FoundEffect out;
  out.effect = e.effect;
  out.joints = e.joints;
  out.note = e.note;
  out.identify_as = identify_as(e);
  out.probability = probability;
  for (const Parameter& parameter : refitted.parameters) {
    if (std::find(e.parameters.begin(), e.parameters.end(), parameter.name) == e.parameters.end()) continue;
    if (e.kind == Kind::drift) continue;  // a curve, not numbers
    out.parameters.push_back(parameter);
  }
  if (out.parameters.empty() && e.kind == Kind::catalogue) {  // found by the search
    for (const std::string& name : e.parameters) {
      const int column = work.design.column(name);
      const auto k = std::find(decision.state.columns.begin(), decision.state.columns.end(), column) -
                     decision.state.columns.begin();
      if (column < 0 || k >= static_cast<std::ptrdiff_t>(decision.state.columns.size())) continue;
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(decision.state.solution.size(), static_cast<Eigen::Index>(k));
      const double variance = decision.state.sigma2 * unit.dot(decision.state.factor.solve(unit));
      out.parameters.push_back({name, 0.0, decision.state.solution[static_cast<Eigen::Index>(k)],
                                std::sqrt(std::max(variance, 0.0)),
                                work.design.column_units[static_cast<std::size_t>(column)], false});
    }
  }
  const Evidence::State less = evidence.evaluate(without(decision.state.choice, groups, at));
  out.held_out_before = error_statistics(held_out_lengths(work.design, less));
  out.held_out_after = error_statistics(held_out_lengths(work.design, decision.state));
  const double shrink = out.held_out_before.rms > 0.0 ? 1.0 - out.held_out_after.rms / out.held_out_before.rms : 0.0;
  const auto spread = resampled.shrink_of.find(g);
  out.shrink =
      percentile_interval(spread == resampled.shrink_of.end() ? std::vector<double>{} : spread->second, shrink);
  const Evidence::State nothing = evidence.evaluate({});
  Choice only;
  only.groups = {g};
  only.scales = {decision.state.choice.scales[at]};
  const double gap = held_out_squares(work.test, nothing.columns, nothing.solution);
  if (gap > 0.0) {
    const Evidence::State alone = evidence.evaluate(only);
    out.share_alone = std::max(0.0, 1.0 - held_out_squares(work.test, alone.columns, alone.solution) / gap);
    out.share_last = std::max(0.0, (held_out_squares(work.test, less.columns, less.solution) -
                                    held_out_squares(work.test, decision.state.columns, decision.state.solution)) /
                                       gap);
  }
  std::set<std::pair<std::string, std::vector<std::string>>> listed_already;
  double rest = 0.0;
  for (const Rival& rival : sure.rivals) rest += rival.in_class ? std::exp(-0.5 * std::max(0.0, rival.loss)) : 0.0;
  for (const Rival& rival : sure.rivals) {
    const Explanation& other = named[static_cast<std::size_t>(rival.group)];
    if (!rival.in_class || !listed_already.insert({other.effect, other.joints}).second) continue;
    out.confounded_with.push_back({other.effect, other.joints,
                                   probability * std::exp(-0.5 * std::max(0.0, rival.loss)) / (1.0 + rest),
                                   separated_by(e.effect, other.effect)});
    if (out.confounded_with.size() >= 8) break;
  }
  // What was not recorded may do the same.
  static const std::map<std::string, std::vector<std::string>> mimics = {{"backlash", {"windup", "time_offset"}},
                                                                         {"drift", {"thermal", "thermal_zero"}},
                                                                         {"thermal", {"drift"}},
                                                                         {"thermal_zero", {"drift"}},
                                                                         {"joint_compliance", {"windup"}},
                                                                         {"stiffness_zones", {"windup"}},
                                                                         {"gravity_backlash", {"windup"}}};
  const auto mimic = mimics.find(e.effect);
  for (std::size_t k = 0; mimic != mimics.end() && k < mimic->second.size(); ++k) {
    const auto untested =
        std::find_if(work.design.candidates.not_testable.begin(), work.design.candidates.not_testable.end(),
                     [&](const NotTestable& n) {
                       return n.effect == mimic->second[k] && n.why.find("column") != std::string::npos;
                     });
    if (untested == work.design.candidates.not_testable.end()) continue;
    const bool whole_robot = mimic->second[k] == "time_offset" || mimic->second[k] == "drift";
    out.confounded_with.push_back({mimic->second[k], whole_robot ? std::vector<std::string>{} : e.joints, 0.0,
                                   "record what it needs: " + untested->why});
  }
  // The law, drawn.
  for (const int other : decision.state.choice.groups) {
    const auto corrected = decision.corrects.find(other);
    if (corrected == decision.corrects.end() || corrected->second != g) continue;
    const Explanation& correction = named[static_cast<std::size_t>(other)];
    const std::string driver = work.inputs[static_cast<std::size_t>(correction.inputs[0])].name;
    out.note +=
        (out.note.empty() ? "" : "; ") + std::string("its law is not the simple one: see the curve over ") + driver;
    const int input = input_named(work, driver);
    if (input >= 0 && !e.joints.empty()) {
      const std::size_t joint = work.frames.robot.joint_index(e.joints[0]);
      out.curves.push_back(
          curve_of(work, decision.state, decision.corrects, g, input, work.design.joint_column[joint][0], 0, 0, -1));
    }
  }
  const int driver = input_named(work, e.driver);
  if (driver >= 0 && e.kind == Kind::catalogue && e.joints.size() == 1 && e.effect != "axis_wobble" &&
      e.effect != "thermal" && e.effect != "link_compliance") {
    const std::size_t joint = work.frames.robot.joint_index(e.joints[0]);
    const bool drawn =
        std::any_of(out.curves.begin(), out.curves.end(), [&](const Curve& c) { return c.input == e.driver; });
    if (!drawn)
      out.curves.push_back(
          curve_of(work, decision.state, decision.corrects, g, driver, work.design.joint_column[joint][0], 0, 0, -1));
  }
  if (e.effect == "drift" && driver >= 0) {
    for (std::size_t c = 0; c < 3 && c < work.design.base_columns.size(); ++c) {
      Curve curve = curve_of(work, decision.state, decision.corrects, g, driver, work.design.base_columns[c], 0, 0, -1);
      out.curves.push_back(std::move(curve));
    }
  }
  return out;
}

UnknownEffect describe_unknown(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at,
                               const Resampled& resampled) {
  const auto& groups = work.design.candidates.groups;
  const int g = decision.state.choice.groups[at];
  const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
  UnknownEffect out;
  out.joint = e.site;
  for (const int input : e.inputs) out.inputs.push_back(work.inputs[static_cast<std::size_t>(input)].name);
  const Evidence::State less = evidence.evaluate(without(decision.state.choice, groups, at));
  out.held_out_before = error_statistics(held_out_lengths(work.design, less));
  out.held_out_after = error_statistics(held_out_lengths(work.design, decision.state));
  const double shrink = out.held_out_before.rms > 0.0 ? 1.0 - out.held_out_after.rms / out.held_out_before.rms : 0.0;
  const auto spread = resampled.shrink_of.find(g);
  out.shrink =
      percentile_interval(spread == resampled.shrink_of.end() ? std::vector<double>{} : spread->second, shrink);
  const double gap = held_out_squares(work.test, evidence.evaluate({}).columns, evidence.evaluate({}).solution);
  if (gap > 0.0) {
    out.share = std::max(0.0, held_out_squares(work.test, less.columns, less.solution) -
                                  held_out_squares(work.test, decision.state.columns, decision.state.solution)) /
                gap;
  }
  const double loss = decision.state.score - less.score;
  out.probability = std::clamp(0.5 + 0.49 * std::min(1.0, loss / 30.0), 0.0, 0.99);
  std::vector<int> sites = work.design.base_columns;
  if (e.site != "base") {
    const std::size_t joint = work.frames.robot.joint_index(e.site);
    sites = work.design.joint_column[joint];
  } else if (sites.size() > 3) {
    sites.resize(3);
  }
  for (const int site : sites) {
    if (e.inputs.size() == 1) {
      out.curves.push_back(curve_of(work, decision.state, decision.corrects, g, e.inputs[0], site, 0, 0, -1));
      continue;
    }
    // Three slices along the second input.
    std::vector<double> values = work.inputs[static_cast<std::size_t>(e.inputs[1])].values;
    double edges[4];
    edges[0] = *std::min_element(values.begin(), values.end());
    edges[3] = *std::max_element(values.begin(), values.end());
    edges[1] = quantile(&values, 1.0 / 3.0);
    edges[2] = quantile(&values, 2.0 / 3.0);
    for (int k = 0; k < 3; ++k) {
      Curve curve =
          curve_of(work, decision.state, decision.corrects, g, e.inputs[0], site, edges[k], edges[k + 1], e.inputs[1]);
      if (!curve.points.empty()) out.curves.push_back(std::move(curve));
    }
  }
  if (!out.curves.empty() && e.inputs.size() == 1 && e.site != "base") out.looks_like = shape_of(out.curves[0]);
  if (e.inputs.size() == 2) out.looks_like = "depends on both " + out.inputs[0] + " and " + out.inputs[1];
  if (e.site == "base") out.looks_like = "the base moves as a function of " + out.inputs[0];
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

std::vector<Candidate> list_candidates(const Work& work, const Evidence& evidence,
                                       const std::vector<Evidence::Gain>& first) {
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  // Everything at once, under a wide prior: what "fit all and read the table" would show.
  Choice everything;
  for (std::size_t g = 0; g < first.size(); ++g) {
    if (named[g].kind != Kind::catalogue || groups[g].shadow) continue;
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
    Candidate c;
    c.effect = named[g].effect;
    c.joints = named[g].joints;
    c.columns = first[g].rank;
    c.gain = first[g].squares / std::max(all.sigma2, 1e-300);
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
    out.push_back(std::move(c));
  }
  return out;
}

/// The smallest size of every effect's first parameter that would have passed the threshold, beside what was named.
std::vector<Detectable> smallest_sizes(const Work& work, const Evidence& evidence, const Decision& decision) {
  const Evidence::State& state = decision.state;
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  std::vector<Detectable> out;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Explanation& e = named[g];
    if (e.kind != Kind::catalogue || groups[g].columns.empty() || groups[g].shadow ||
        e.effect.rfind("transmission_error", 0) == 0)
      continue;
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
        out.back().size * std::sqrt(3.0 * a / std::max(1.0, evidence.gram().n)) * work.position_sigma;
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
      rivals.name = effect.effect + at_joints(effect.joints);
      rivals.other_name = other.effect + at_joints(other.joints);
      rivals.first = {first->parameters, first->requests};
      rivals.other = {second->parameters, second->requests};
      for (const Parameter& parameter : effect.parameters)
        rivals.parameters[parameter.name] = parameter.value - parameter.nominal;
      out->next_poses =
          next_poses(work.linear.at, data, rivals, options, 6, work.position_sigma * std::sqrt(decision.state.sigma2));
      if (!out->next_poses.empty()) return;
    }
  }
}

std::string sentence_of(const Diagnosis& d) {
  const std::string gap = millimetres(d.gap.rms);
  std::string text;
  if (d.verdict == Verdict::none) {
    text =
        "No gap beyond noise: " + gap + " rms on held-out poses, of which noise is " + millimetres(d.noise_floor) + ".";
    if (!d.detectable.empty()) {
      const auto easiest =
          std::min_element(d.detectable.begin(), d.detectable.end(), [](const Detectable& a, const Detectable& b) {
            return (a.effect == "backlash" ? 0.0 : 1.0) + a.size_at_tip <
                   (b.effect == "backlash" ? 0.0 : 1.0) + b.size_at_tip;
          });
      const bool angle = easiest->unit == "rad";
      text += " A " + easiest->effect + (easiest->joint.empty() ? "" : " at " + easiest->joint) + " above " +
              number(angle ? 1e3 * easiest->size : easiest->size, 2) + (angle ? " mrad" : " " + easiest->unit) +
              " would have shown.";
    }
    return text;
  }
  if (!d.effects.empty()) {
    text = "The gap of " + gap + " shrinks to " + millimetres(d.after.rms) + ": ";
    for (std::size_t k = 0; k < d.effects.size() && k < 4; ++k) {
      text += (k == 0                                                ? ""
               : k + 1 == std::min<std::size_t>(d.effects.size(), 4) ? " and "
                                                                     : ", ") +
              d.effects[k].effect + at_joints(d.effects[k].joints);
      if (!d.effects[k].confounded_with.empty() && d.effects[k].confounded_with[0].probability > 0.0) {
        text += " (or " + d.effects[k].confounded_with[0].effect + at_joints(d.effects[k].confounded_with[0].joints) +
                ": these data cannot tell)";
      }
    }
    if (d.effects.size() > 4) text += " and " + std::to_string(d.effects.size() - 4) + " more";
    text += ".";
  } else {
    text = "There is a gap of " + gap + " that no effect of the catalogue explains.";
  }
  if (!d.unknown.empty() && d.unknown[0].inputs.empty()) {
    text += " Repeats show a noise of " + millimetres(d.noise_floor) +
            ": something is there that no function of what was recorded describes.";
  } else if (!d.unknown.empty()) {
    const UnknownEffect& u = d.unknown[0];
    text += " Unknown: " + (u.joint.empty() ? std::string("something") : u.joint) + " moves as a function of " +
            (u.inputs.size() == 2     ? u.inputs[0] + " and " + u.inputs[1]
             : u.inputs[0] == "order" ? std::string("the order of the rows")
                                      : listed(u.inputs)) +
            (u.looks_like.empty() || u.inputs.size() == 2 || u.joint == "base" ? "" : " (" + u.looks_like + ")") + ".";
  }
  return text;
}

}  // namespace truing::diagnosis
