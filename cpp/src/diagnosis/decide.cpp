// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What explains the gap: named effects, free functions, and the questions between the two.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "diagnosis/free_search.hpp"
#include "math/text.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;
constexpr int kNullDraws = 200;
constexpr double kNoBetter = 1.004;  ///< a group must lower the cross-validated sum of squares by more than this
constexpr double kFreeShare = 0.04;  ///< of what is left, that a free function must explain
constexpr double kMeshNats =
    5.0;  ///< beyond the threshold, that a mesh order must win: waves this short fit anything a little

int input_named(const Work& work, const std::string& name) {
  for (std::size_t k = 0; k < work.inputs.size(); ++k) {
    if (work.inputs[k].name == name) return static_cast<int>(k);
  }
  return -1;
}

/// Adds columns of one more candidate to the design.
static void append(Work* work, Explanation what, const Design::Rows& columns, double cost) {
  Design& design = work->design;
  const Eigen::Index p = design.x.cols();
  design.x.conservativeResize(Eigen::NoChange, p + columns.cols());
  design.x.rightCols(columns.cols()) = columns;
  design.prior.conservativeResize(p + columns.cols());
  design.prior.tail(columns.cols()).setConstant(kLargest);
  ColumnGroup group;
  group.cost = cost;
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    group.columns.push_back(static_cast<int>(p + k));
    design.column_names.push_back(what.parameters[static_cast<std::size_t>(k)]);
    design.column_units.push_back("rad");
  }
  design.candidates.groups.push_back(std::move(group));
  design.candidates.named.push_back(std::move(what));
}

/// Mesh orders that win on what is left become candidates. True: there were some.
static bool add_meshes(Work* work, const Evidence& evidence, const Evidence::State& state, const Robot& robot,
                       double threshold) {
  const auto& left_out = work->options.leave_out;
  if (std::find(left_out.begin(), left_out.end(), "transmission_error") != left_out.end()) return false;
  bool any = false;
  for (const MeshGain& mesh : scan_mesh(work->design, evidence, state, work->inputs, robot, work->deff)) {
    if (mesh.score < threshold) continue;
    Explanation e;
    const std::string& joint = robot.joints[mesh.joint].name;
    e.effect = "transmission_error@" + exact_number(mesh.order);
    const bool known = std::any_of(work->design.candidates.named.begin(), work->design.candidates.named.end(),
                                   [&](const Explanation& other) {
                                     return other.effect == e.effect && other.joints == std::vector<std::string>{joint};
                                   });
    if (known) continue;
    e.joints = {joint};
    e.requests = {{e.effect, {joint}}};
    e.parameters = {e.effect + "." + joint + ".cos", e.effect + "." + joint + ".sin"};
    e.driver = "q" + std::to_string(mesh.joint + 1);
    e.note = "the order " + number(mesh.order) + " per turn was found by trying " + std::to_string(mesh.tried);
    const Eigen::Index n = work->design.x.rows();
    Design::Rows columns(n, 2);
    const auto input = std::find_if(work->inputs.begin(), work->inputs.end(),
                                    [&](const InputColumn& c) { return c.name == e.driver; });
    for (Eigen::Index i = 0; i < n; ++i) {
      const double q = input->values[static_cast<std::size_t>(work->design.row[static_cast<std::size_t>(i)])];
      const double d = work->design.x(i, work->design.joint_column[mesh.joint][0]);
      columns(i, 0) = d * std::cos(mesh.order * q);
      columns(i, 1) = d * std::sin(mesh.order * q);
    }
    append(work, e, columns, std::log(static_cast<double>(mesh.tried * static_cast<int>(robot.joints.size()))));
    any = true;
  }
  return any;
}

/// Of a free function and what it stands beside, the part that goes in as columns of the design.
static void append_free(Work* work, const FreeGain& found, std::size_t trials) {
  const Design::Rows columns =
      free_columns(work->design, found.site_columns, work->inputs, found.what.inputs, found.what.knots);
  append(work, found.what, columns, std::log(static_cast<double>(trials)));
}

Choice without(const Choice& choice, const std::vector<ColumnGroup>& groups, std::size_t at) {
  Choice out;
  const ColumnGroup& gone = groups[static_cast<std::size_t>(choice.groups[at])];
  for (std::size_t k = 0; k < choice.groups.size(); ++k) {
    const ColumnGroup& other = groups[static_cast<std::size_t>(choice.groups[k])];
    const bool orphan = gone.corrects_law_at < 0 && gone.law_at >= 0 && other.corrects_law_at == gone.law_at;
    if (k == at || orphan) continue;
    out.groups.push_back(choice.groups[k]);
    out.scales.push_back(choice.scales[k]);
  }
  return out;
}

/// Sum of squares on every fold of the fit to the others.
double cross_validated(const Work& work, const Choice& choice) {
  const auto& groups = work.design.candidates.groups;
  std::vector<int> columns = work.design.nuisance;
  for (const int g : choice.groups)
    columns.insert(columns.end(), groups[static_cast<std::size_t>(g)].columns.begin(),
                   groups[static_cast<std::size_t>(g)].columns.end());
  const Evidence whole(work.train, groups, work.design.nuisance, work.design.prior);
  const Evidence::State state = whole.evaluate(choice);
  const Gram all = work.train.of(columns);
  double sum = 0.0;
  for (const Gram& fold : work.fold) {
    const Gram held = fold.of(columns);
    Eigen::MatrixXd d = all.xx - held.xx;
    d.diagonal() += state.precision;
    const Eigen::VectorXd solution = factorised(std::move(d)).solve(all.xy - held.xy);
    sum += held.yy - 2.0 * solution.dot(held.xy) + solution.dot(held.xx * solution);
  }
  return sum;
}

/// Groups that do not help on poses they were not fitted to go, however well they fit.
static Evidence::State keep_what_predicts(const Work& work, Evidence::State state) {
  const auto& groups = work.design.candidates.groups;
  const Evidence evidence(work.train, groups, work.design.nuisance, work.design.prior);
  for (;;) {
    const double with = cross_validated(work, state.choice);
    double best = 1e300;
    Choice better;
    bool any = false;
    for (std::size_t at = 0; at < state.choice.groups.size(); ++at) {
      const Choice less = without(state.choice, groups, at);
      const double squares = cross_validated(work, less);
      if (squares < kNoBetter * with && squares < best) {
        best = squares;
        better = less;
        any = true;
      }
    }
    if (!any) return state;
    state = evidence.evaluate(better);
  }
}

Shortlist shortlist(const Work& work, const std::vector<int>& also) {
  Shortlist out;
  const auto& groups = work.design.candidates.groups;
  std::vector<int> place(static_cast<std::size_t>(work.design.x.cols()), -1);
  const auto take = [&](int column) {
    int& at = place[static_cast<std::size_t>(column)];
    if (at < 0) {
      at = static_cast<int>(out.columns.size());
      out.columns.push_back(column);
    }
    return at;
  };
  for (const int column : work.design.nuisance) out.nuisance.push_back(take(column));
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Explanation& e = work.design.candidates.named[g];
    const bool wanted = std::find(also.begin(), also.end(), static_cast<int>(g)) != also.end();
    const bool plain =
        e.kind == Kind::catalogue || e.kind == Kind::all_geometry || (e.kind == Kind::drift && e.knots[0].size() <= 6);
    if (groups[g].shadow || groups[g].columns.empty() || (!wanted && !plain)) continue;
    ColumnGroup group = groups[g];
    group.corrects_law_at = -1;
    for (int& column : group.columns) column = take(column);
    out.groups.push_back(std::move(group));
    out.which.push_back(static_cast<int>(g));
  }
  out.prior.resize(static_cast<Eigen::Index>(out.columns.size()));
  for (Eigen::Index k = 0; k < out.prior.size(); ++k)
    out.prior[k] = work.design.prior[out.columns[static_cast<std::size_t>(k)]];
  return out;
}

/// Of the motion that a law and its correction make together, the part that the plain law must make to keep its name.
/// What a joint does with its own angle can be anything: there the bar is higher.
static double least_share_of_law(const std::string& effect) {
  const bool own_motion = effect == "harmonic" || effect == "gear_ratio" || effect == "joint_offset" ||
                          effect == "axis_wobble" || effect == "link_geometry";
  return own_motion ? 0.92 : 0.65;
}

/// Effects that are functions of where the joints stand, and of nothing else that is recorded.
static bool follows_configuration(const std::string& effect) {
  static const std::set<std::string> names = {"harmonic",         "gear_ratio",      "joint_offset",    "axis_wobble",
                                              "joint_compliance", "stiffness_zones", "gravity_backlash"};
  return names.count(effect) > 0;
}

static std::vector<int> columns_of(const Work& work, const std::vector<int>& groups) {
  std::vector<int> out;
  for (const int g : groups) {
    const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(g)].columns;
    out.insert(out.end(), columns.begin(), columns.end());
  }
  return out;
}

static Choice without_these(const Choice& choice, const std::vector<int>& gone) {
  Choice out;
  for (std::size_t k = 0; k < choice.groups.size(); ++k) {
    if (std::find(gone.begin(), gone.end(), choice.groups[k]) != gone.end()) continue;
    out.groups.push_back(choice.groups[k]);
    out.scales.push_back(choice.scales[k]);
  }
  return out;
}

/// A free function of these inputs at a joint, with many knots, as one more candidate.
static int add_fine_function(Work* work, const Robot& robot, std::size_t joint, const std::vector<int>& which) {
  std::vector<std::int32_t> rows;
  for (std::size_t i = 0; i < work->design.row.size(); ++i) {
    if (work->design.fold[i] < work->design.folds && (i == 0 || work->design.row[i] != work->design.row[i - 1]))
      rows.push_back(work->design.row[i]);
  }
  Explanation e;
  e.kind = Kind::free;
  e.effect = "free";
  e.site = robot.joints[joint].name;
  e.joints = {e.site};
  e.inputs = which;
  std::string name = "fine." + e.site;
  std::size_t count = 1;
  for (const int input : which) {
    const int most = which.size() > 1 ? 6 : rows.size() >= 150 ? 16 : rows.size() >= 80 ? 10 : 6;
    e.knots.push_back(knots_of(work->inputs[static_cast<std::size_t>(input)], rows, most));
    count *= e.knots.back().size();
    name += "." + work->inputs[static_cast<std::size_t>(input)].name;
  }
  for (std::size_t k = 0; k < count; ++k) e.parameters.push_back(name + "." + std::to_string(k + 1));
  append(work, e, free_columns(work->design, work->design.joint_column[joint], work->inputs, e.inputs, e.knots),
         std::log(300.0));
  return static_cast<int>(work->design.candidates.groups.size()) - 1;
}

static void drop_contained(Work* work, Decision* decision) {
  // All links contain each link.
  std::vector<int> single;
  bool all_links = false;
  for (const int g : decision->state.choice.groups) {
    const Explanation& e = work->design.candidates.named[static_cast<std::size_t>(g)];
    all_links |= e.kind == Kind::all_geometry;
    if (e.kind == Kind::catalogue && (e.effect == "link_geometry" || e.effect == "joint_offset")) single.push_back(g);
  }
  if (all_links && !single.empty()) {
    const Evidence evidence(work->train, work->design.candidates.groups, work->design.nuisance, work->design.prior);
    decision->state = evidence.evaluate(without_these(decision->state.choice, single));
  }
  // Three zones contain the plain spring.
  for (const int zones : Choice(decision->state.choice).groups) {
    const Explanation& e = work->design.candidates.named[static_cast<std::size_t>(zones)];
    if (e.effect != "stiffness_zones") continue;
    std::vector<int> springs;
    for (const int g : decision->state.choice.groups) {
      const Explanation& other = work->design.candidates.named[static_cast<std::size_t>(g)];
      if (other.effect == "joint_compliance" && other.joints == e.joints) springs.push_back(g);
    }
    if (springs.empty()) continue;
    const Evidence evidence(work->train, work->design.candidates.groups, work->design.nuisance, work->design.prior);
    decision->state = evidence.evaluate(without_these(decision->state.choice, springs));
    for (auto& [correction, corrected] : decision->corrects) {
      if (std::find(springs.begin(), springs.end(), corrected) != springs.end()) corrected = zones;
    }
  }
}

/// A law and a free function at one joint: either the law is right but for a correction, or it is not this law and its
/// name would be wrong. Decided by how much of the motion the plain law makes.
static void question_laws(Work* work, const Robot& robot, Decision* decision) {
  drop_contained(work, decision);
  for (int round = 0; round < 6; ++round) {
    const auto& groups = work->design.candidates.groups;
    const auto& named = work->design.candidates.named;
    const Evidence evidence(work->train, groups, work->design.nuisance, work->design.prior);
    const Choice& choice = decision->state.choice;
    bool changed = false;
    for (const int f : choice.groups) {
      const Explanation& free = named[static_cast<std::size_t>(f)];
      if ((free.kind != Kind::free && free.kind != Kind::law) || free.site == "base" || decision->corrects.count(f))
        continue;
      const std::size_t joint = robot.joint_index(free.site);
      // Laws at this joint, in or out, against the function and them together.
      std::vector<int> here = {f};
      for (const int g : choice.groups) {
        const Explanation& e = named[static_cast<std::size_t>(g)];
        if (g != f && (e.kind == Kind::catalogue || e.kind == Kind::law) &&
            e.joints == std::vector<std::string>{free.site} && e.effect != "link_geometry" &&
            e.effect.rfind("transmission", 0) != 0)
          here.push_back(g);
      }
      const Evidence::State rest = evidence.evaluate(without_these(choice, here));
      const double together = rest.rss - evidence.evaluate(choice).rss;
      Evidence::Gain best;
      for (std::size_t g = 0; g < groups.size(); ++g) {
        const Explanation& e = named[g];
        if (e.kind != Kind::catalogue || groups[g].shadow || e.joints != std::vector<std::string>{free.site} ||
            e.effect == "link_geometry" || e.effect.rfind("transmission", 0) == 0)
          continue;
        if (free.kind == Kind::law && e.effect != free.effect &&
            groups[g].law_at != groups[static_cast<std::size_t>(f)].corrects_law_at)
          continue;
        Evidence::Gain gain = evidence.gain(rest, groups[g].columns, groups[g].cost);
        const double share = gain.squares / std::max(together, 1e-300);
        if (share > least_share_of_law(e.effect) && gain.score > best.score) {
          best = gain;
          best.group = static_cast<int>(g);
        }
      }
      if (best.group >= 0) {
        // The law stands; the function corrects it.
        if (std::find(choice.groups.begin(), choice.groups.end(), best.group) == choice.groups.end()) {
          Choice with = choice;
          with.groups.push_back(best.group);
          with.scales.push_back(best.scale);
          decision->state = evidence.evaluate(with);
          changed = true;
        }
        decision->corrects[f] = best.group;
        if (changed) break;
        continue;
      }
      if (here.size() == 1 && free.kind == Kind::free) continue;  // nothing else is named here
      if (free.law_form == 2) continue;
      // Not this law: the function alone, with more knots, for it and all laws of its inputs here.
      std::vector<int> inputs = free.inputs;
      if (free.law_form == 1) {
        const int direction = input_named(*work, "dir" + std::to_string(joint + 1));
        if (direction >= 0) inputs.insert(inputs.begin(), direction);
      }
      const bool by_configuration = std::all_of(inputs.begin(), inputs.end(), [&](int i) {
        const std::string& name = work->inputs[static_cast<std::size_t>(i)].name;
        return name[0] == 'q' || name.rfind("torque", 0) == 0;
      });
      std::vector<int> gone = {f};
      for (const int g : here) {
        const std::string& driver = named[static_cast<std::size_t>(g)].driver;
        const bool of_these = std::any_of(inputs.begin(), inputs.end(), [&](int i) {
          return work->inputs[static_cast<std::size_t>(i)].name == driver;
        });
        if (g != f &&
            (of_these || (by_configuration && follows_configuration(named[static_cast<std::size_t>(g)].effect))))
          gone.push_back(g);
      }
      if (gone.size() == 1 && free.kind == Kind::free) continue;
      const Choice remaining = without_these(choice, gone);
      const double before = cross_validated(*work, choice);
      const int fine = add_fine_function(work, robot, joint, inputs);
      extend_grams(work);
      const Evidence again(work->train, work->design.candidates.groups, work->design.nuisance, work->design.prior);
      const Evidence::Gain gain = again.gain(again.evaluate(remaining), columns_of(*work, {fine}), 0.0);
      Choice alone = remaining;
      alone.groups.push_back(fine);
      alone.scales.push_back(gain.scale);
      if (cross_validated(*work, alone) < 1.06 * before) {
        decision->state = again.evaluate(alone);
        changed = true;
        break;
      }
      decision->corrects[f] = -1;  // both stay
    }
    if (!changed) break;
  }
  drop_contained(work, decision);
}

Decision decide(Work* work, const Robot& robot) {
  const DiagnoseOptions& options = work->options;
  Decision out;
  SearchOptions& search = out.search;
  search.most_groups = options.max_effects;
  const auto evidence_now = [&] {
    return Evidence(work->train, work->design.candidates.groups, work->design.nuisance, work->design.prior);
  };

  // Is there a gap at all?
  {
    const Evidence evidence = evidence_now();
    const Evidence::State nothing = evidence.evaluate({});
    out.first = evidence.gains(nothing);
    const Shortlist list = shortlist(*work, {});
    double best = -1e300;  // of the groups that the null is drawn over, and no others
    for (const int g : list.which) best = std::max(best, out.first[static_cast<std::size_t>(g)].score);
    const Gram gram = work->train.of(list.columns);
    const Evidence few(gram, list.groups, list.nuisance, list.prior);
    std::vector<double> null = few.null_scores(few.evaluate({}), kNullDraws, options.seed + 11);
    int above = 1;
    for (const double score : null) above += score >= best ? 1 : 0;
    out.p_gap = static_cast<double>(above) / (static_cast<double>(null.size()) + 1.0);
    std::sort(null.begin(), null.end());
    // The threshold that noise alone passes as often as is allowed.
    if (!null.empty()) {
      const double at = null[static_cast<std::size_t>(std::min<double>(
          static_cast<double>(null.size()) - 1.0, (1.0 - options.false_alarm) * static_cast<double>(null.size())))];
      search.threshold = std::max(search.threshold, at);
    }
  }

  // Named effects; then free functions on what they leave, and what these make needless goes; then mesh orders.
  out.state = keep_what_predicts(*work, evidence_now().search(search));
  for (int round = 0; round < 6; ++round) {
    const Evidence evidence = evidence_now();
    FreeScanOptions scan_options;
    scan_options.seed = options.seed + 101 + static_cast<std::uint64_t>(round);
    const FreeScan scan = scan_free(work->design, evidence, out.state, work->inputs, robot, work->deff, scan_options);
    out.p_left = scan.p;
    const bool room = static_cast<int>(out.state.choice.groups.size()) < search.most_groups;
    if (room && !scan.best.empty() && scan.p <= 0.02 && scan.best.front().gain.score > search.threshold + 4.0 &&
        scan.best.front().gain.share > kFreeShare) {
      const FreeGain& best = scan.best.front();
      append_free(work, best, scan.tried);
      extend_grams(work);
      const Evidence with = evidence_now();
      Choice grown = out.state.choice;
      grown.groups.push_back(static_cast<int>(work->design.candidates.groups.size()) - 1);
      grown.scales.push_back(best.gain.scale);
      Evidence::State next = with.improve(with.evaluate(grown), search);
      next = keep_what_predicts(*work, with.search(search, next.choice));
      if (next.score > out.state.score + search.threshold) {
        out.state = std::move(next);
        continue;
      }
    }
    if (!add_meshes(work, evidence, out.state, robot, search.threshold + kMeshNats)) break;
    extend_grams(work);
    Evidence::State next = keep_what_predicts(*work, evidence_now().search(search, out.state.choice));
    if (next.score < out.state.score + search.threshold) break;
    out.state = std::move(next);
  }
  question_laws(work, robot, &out);
  if (out.p_gap > options.false_alarm) {
    const bool only_named = std::all_of(out.state.choice.groups.begin(), out.state.choice.groups.end(), [&](int g) {
      return is_named(work->design.candidates.named[static_cast<std::size_t>(g)]);
    });
    if (only_named && !out.state.choice.groups.empty()) out.state = evidence_now().evaluate({});
  }
  return out;
}

}  // namespace truing::diagnosis
