// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What explains the gap: named effects, free functions, and the questions between the two.

#include "diagnosis/diagnosis.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "diagnosis/free_search.hpp"
#include "math/text.hpp"
#include "model/effects/traits.hpp"

namespace truing::diagnosis {

using Kind = Explanation::Kind;
constexpr int kNullDraws = 200;
constexpr double kNoBetter = 1.004;     ///< a group must lower the cross-validated sum of squares by more than this
constexpr double kMuchBetter = 1.05;    ///< sums of squares that are worth another choice
constexpr double kNoChance = 1.5;       ///< sums of squares that noise alone does not make so unequal
constexpr double kChance = 0.05;        ///< of random signs, that a free function may have at most
constexpr double kFreeShare = 0.04;     ///< of what is left, that a free function must explain
constexpr double kFunctionFirst = 1.5;  ///< times the nats of an order, that a function wins to go before it
constexpr int kMostTurns = 4;           ///< of search and questions
constexpr double kWholly = 0.95;        ///< of a function, that a law or a plain shape makes: then it is that

const EffectTraits& effect_traits(const Work& work, const Explanation& e) {
  return model::traits_of(e.effect, work.given.options.own_effects);
}

int input_named(const Work& work, const std::string& name) {
  for (std::size_t k = 0; k < work.inputs.size(); ++k) {
    if (work.inputs[k].name == name) return static_cast<int>(k);
  }
  return -1;
}

void append(Work* work, Explanation what, const Design::Rows& columns, double cost) {
  Design& design = work->design;
  // The same function may be found again, with other knots: its parameters need names of their own.
  while (design.column(what.parameters.front()) >= 0) {
    for (std::string& name : what.parameters) name.insert(name.rfind('.'), "'");
  }
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

void append_free(Work* work, const FreeGain& found, std::size_t trials) {
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

Evidence::State keep_what_predicts(const Work& work, Evidence::State state) {
  const auto& groups = work.design.candidates.groups;
  const Evidence evidence = evidence_now(work);
  for (;;) {
    const Eigen::VectorXd with = squares_of_folds(work, state.choice);
    double best = 1e300;
    Choice better;
    bool any = false;
    for (std::size_t at = 0; at < state.choice.groups.size(); ++at) {
      const Choice less = without(state.choice, groups, at);
      const Eigen::VectorXd squares = squares_of_folds(work, less);
      if (!predicts_better(with, squares, kNoBetter) && squares.sum() < best) {
        best = squares.sum();
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
        e.kind == Kind::catalogue || e.kind == Kind::all_geometry || (is_over_time(e) && e.knots[0].size() <= 6);
    if (groups[g].shadow || groups[g].columns.empty() || (!wanted && !plain)) continue;
    ColumnGroup group = groups[g];
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
/// What a joint does with its own angle can be anything, unless it is smooth: there the bar is higher, and no plainer
/// shape may do better, unless the law makes the function wholly.
static double least_share_of_law(const EffectTraits& traits, bool smooth) {
  return follows_own_angle(traits) && !smooth ? 0.75 : 0.65;
}

std::vector<int> columns_of_groups(const Work& work, const std::vector<int>& groups) {
  std::vector<int> out;
  for (const int g : groups) {
    const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(g)].columns;
    out.insert(out.end(), columns.begin(), columns.end());
  }
  return out;
}

Choice without_these(const Choice& choice, const std::vector<int>& gone) {
  Choice out;
  for (std::size_t k = 0; k < choice.groups.size(); ++k) {
    if (std::find(gone.begin(), gone.end(), choice.groups[k]) != gone.end()) continue;
    out.groups.push_back(choice.groups[k]);
    out.scales.push_back(choice.scales[k]);
  }
  return out;
}

Choice only_these(const Choice& choice, const std::vector<int>& groups) {
  Choice out;
  for (std::size_t k = 0; k < choice.groups.size(); ++k) {
    if (std::find(groups.begin(), groups.end(), choice.groups[k]) == groups.end()) continue;
    out.groups.push_back(choice.groups[k]);
    out.scales.push_back(choice.scales[k]);
  }
  return out;
}

int add_fine_function(Work* work, const Robot& robot, std::size_t joint, const std::vector<int>& which) {
  std::vector<std::int32_t> rows;
  for (std::size_t i = 0; i < work->design.row.size(); ++i) {
    if (work->design.fold[i] < work->design.folds && (i == 0 || work->design.row[i] != work->design.row[i - 1]))
      rows.push_back(work->design.row[i]);
  }
  Explanation e;
  e.kind = Kind::free;
  e.effect = kNoEffect;
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

Evidence evidence_now(const Work& work) {
  return Evidence(work.grams.train, work.design.candidates.groups, work.design.nuisance, work.design.prior);
}

int all_links(const Work& work) {
  const auto& named = work.design.candidates.named;
  const auto at =
      std::find_if(named.begin(), named.end(), [](const Explanation& e) { return e.kind == Kind::all_geometry; });
  return at == named.end() ? -1 : static_cast<int>(at - named.begin());
}

double values_for_each(const Work& work, int group) {
  const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(group)].columns;
  return work.grams.train.n / static_cast<double>(columns.size());
}

bool has_few_poses(const Work& work, int links) {
  constexpr double kManyValues = 10.0;
  return values_for_each(work, links) <= kManyValues;
}

/// Angles of links are as large in milliradians as lengths are in millimetres where a robot reaches a metre; a
/// table-top arm's are larger, since what is machined to a hundredth is short. The ratio is the data's own: that of the
/// highest evidence of all links together (MacKay 1992, alternative priors), where it is clear. Many poses need no
/// prior.
void size_angles_of_links(Work* work) {
  constexpr double kRatios[] = {1.0 / 3.0, 3.0, 10.0};
  constexpr double kClear = 2.0;  // nats
  const int which = all_links(*work);
  if (which < 0 || !has_few_poses(*work, which)) return;
  const ColumnGroup& links = work->design.candidates.groups[static_cast<std::size_t>(which)];
  const auto with_ratio = [&](double ratio) {
    Eigen::VectorXd prior = work->design.prior;
    for (const int column : links.columns) {
      if (work->design.column_units[static_cast<std::size_t>(column)] == "rad") prior[column] *= ratio;
    }
    return prior;
  };
  const auto evidence_of = [&](const Eigen::VectorXd& prior) {
    const Evidence evidence(work->grams.train, work->design.candidates.groups, work->design.nuisance, prior);
    return evidence.gain(evidence.evaluate({}), links.columns, 0.0).evidence;
  };
  double best = evidence_of(work->design.prior) + kClear;
  Eigen::VectorXd prior = work->design.prior;
  for (const double ratio : kRatios) {
    const Eigen::VectorXd other = with_ratio(ratio);
    const double evidence = evidence_of(other);
    if (evidence <= best) continue;
    best = evidence;
    prior = other;
  }
  work->design.prior = prior;
}

/// All links contain each link, and what is a part of one.
static void drop_parts_of_all_links(const Work& work, Decision* decision) {
  const std::string& links = effect_that_stands_for(StandsFor::link_geometry).name;
  std::vector<int> single;
  bool all_links = false;
  for (const int g : decision->state.choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    all_links |= e.kind == Kind::all_geometry;
    const bool is_part = e.effect == links || is_contained(effect_traits(work, e), links, Containment::part);
    if (e.kind == Kind::catalogue && is_part) single.push_back(g);
  }
  if (all_links && !single.empty())
    decision->state = evidence_now(work).evaluate(without_these(decision->state.choice, single));
}

/// Three zones contain the plain spring: what corrects the plain law then corrects the larger one.
static void drop_special_cases(const Work& work, Decision* decision) {
  for (const int larger : Choice(decision->state.choice).groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(larger)];
    std::vector<int> smaller;
    for (const int g : decision->state.choice.groups) {
      const Explanation& other = work.design.candidates.named[static_cast<std::size_t>(g)];
      if (other.joints == e.joints && is_contained(effect_traits(work, other), e.effect, Containment::special_case))
        smaller.push_back(g);
    }
    if (smaller.empty()) continue;
    decision->state = evidence_now(work).evaluate(without_these(decision->state.choice, smaller));
    for (auto& [correction, corrected] : decision->corrects) {
      if (std::find(smaller.begin(), smaller.end(), corrected) != smaller.end()) corrected = larger;
    }
  }
}

static void drop_contained(const Work& work, Decision* decision) {
  drop_parts_of_all_links(work, decision);
  drop_special_cases(work, decision);
}

/// A function at a joint, and the laws there that it questions.
struct Question {
  int function = -1;  ///< its group
  Explanation what;
  std::size_t joint = 0;
  std::vector<int> here;  ///< the function, the chosen laws at its joint, and functions of the same inputs there
};

bool has_law_at(const Work& work, const Explanation& e, const std::string& joint) {
  const EffectTraits& traits = effect_traits(work, e);
  return e.joints == std::vector<std::string>{joint} && traits.stands_for != StandsFor::link_geometry &&
         traits.search != Search::by_order;
}

static Question question_of(const Work& work, const Robot& robot, const Choice& choice, int function) {
  const auto& named = work.design.candidates.named;
  Question q;
  q.function = function;
  q.what = named[static_cast<std::size_t>(function)];
  q.joint = robot.joint_index(q.what.site);
  q.here = {function};
  for (const int g : choice.groups) {
    const Explanation& e = named[static_cast<std::size_t>(g)];
    const bool is_law = (e.kind == Kind::catalogue || e.kind == Kind::law) && has_law_at(work, e, q.what.site);
    const bool is_the_same = e.kind == Kind::free && e.site == q.what.site && e.inputs == q.what.inputs;
    if (g != function && (is_law || is_the_same)) q.here.push_back(g);
  }
  return q;
}

/// How plain the function is where it stands alone at its joint: what of it a step, a corner or a bump would make.
static double share_of_shape(const Work& work, const Evidence& evidence, const Evidence::State& rest,
                             const Question& q) {
  if (q.what.inputs.size() != 1 || q.what.law_test != LawTest::of_driver) return 0.0;
  const Evidence::Gain gain = evidence.gain(rest, columns_of_groups(work, {q.function}), 0.0);
  Decision alone;
  alone.state = evidence.evaluate(with_one_more(rest.choice, q.function, gain.scale));
  return share_of_local_shape(work, alone, q.function, q.joint);
}

/// The function is one of the joint's own angle, and turns it in waves.
static bool is_smooth_turn(const Work& work, const Evidence& evidence, const Evidence::State& rest, const Question& q) {
  const int angle = input_named(work, input_name(Driver::angle, q.joint));
  return q.what.inputs == std::vector<int>{angle} && q.what.law_test == LawTest::of_driver &&
         is_smooth(work, evidence, rest, q.joint, angle);
}

/// What a function looks like.
struct Looks {
  double of_shape;  ///< of it, what a step, a corner or a bump makes
  bool smooth;      ///< it turns its joint in waves
};

/// The law that makes most of what the function and the laws at its joint make together; no group: none makes enough.
static Evidence::Gain law_that_stands(const Work& work, const Evidence& evidence, const Choice& choice,
                                      const Question& q) {
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  const Evidence::State rest = evidence.evaluate(without_these(choice, q.here));
  std::optional<Looks> looks;  // found where a law makes enough for it to matter
  const bool of_angle = q.what.inputs[0] == input_named(work, input_name(Driver::angle, q.joint));
  const double together = rest.rss - evidence.evaluate(choice).rss;
  Evidence::Gain best;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Explanation& e = named[g];
    if (e.kind != Kind::catalogue || groups[g].shadow || !has_law_at(work, e, q.what.site)) continue;
    if (q.what.kind == Kind::law && e.effect != q.what.effect &&
        groups[g].law_at != groups[static_cast<std::size_t>(q.function)].corrects_law_at)
      continue;
    const Evidence::Gain gain = evidence.gain(rest, groups[g].columns, groups[g].cost);
    const double share = gain.squares / std::max(together, 1e-300);
    const EffectTraits& traits = effect_traits(work, e);
    if (!(gain.score > best.score && share > least_share_of_law(traits, true))) continue;
    if (!looks) looks = {share_of_shape(work, evidence, rest, q), is_smooth_turn(work, evidence, rest, q)};
    const bool is_of_it = of_angle ? follows_configuration(traits) : follows_own_angle(traits);
    const bool plainer = is_of_it && !looks->smooth && share < kWholly && looks->of_shape > kWholly;
    if (plainer || !(share > least_share_of_law(traits, looks->smooth))) continue;
    best = gain;
    best.group = static_cast<int>(g);
  }
  return best;
}

/// The function, and what else at its joint is a function of the same inputs.
static std::vector<int> replaced_by_function(const Work& work, const Question& q, const std::vector<int>& inputs) {
  const auto input = [&](int i) -> const InputColumn& { return work.inputs[static_cast<std::size_t>(i)]; };
  const bool by_configuration =
      std::all_of(inputs.begin(), inputs.end(), [&](int i) { return input(i).name[0] == 'q' || is_torque(input(i)); });
  std::vector<int> gone = {q.function};
  for (const int g : q.here) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    const bool of_these = std::any_of(inputs.begin(), inputs.end(), [&](int i) { return input(i).name == e.driver; });
    if (g != q.function &&
        (e.kind == Kind::free || of_these || (by_configuration && follows_configuration(effect_traits(work, e)))))
      gone.push_back(g);
  }
  return gone;
}

/// Not this law: the function alone, with more knots, for it and all laws of its inputs at its joint. True: it was
/// taken.
static bool replace_laws(Work* work, const Robot& robot, const Question& q, Decision* decision) {
  std::vector<int> inputs = q.what.inputs;
  if (q.what.law_test == LawTest::times_direction) {
    const int direction = input_named(*work, input_name(Driver::direction, q.joint));
    if (direction >= 0) inputs.insert(inputs.begin(), direction);
  }
  const Choice& choice = decision->state.choice;
  const std::vector<int> gone = replaced_by_function(*work, q, inputs);
  if (gone.size() == 1 && q.what.kind == Kind::free) return false;
  const Choice remaining = without_these(choice, gone);
  const double before = cross_validated(*work, choice);
  const int fine = add_fine_function(work, robot, q.joint, inputs);
  extend_grams(work->design, work->noise.design_effect, &work->grams);
  const Evidence again = evidence_now(*work);
  const Evidence::Gain gain = again.gain(again.evaluate(remaining), columns_of_groups(*work, {fine}), 0.0);
  const Choice alone = with_one_more(remaining, fine, gain.scale);
  if (cross_validated(*work, alone) < 1.06 * before) {
    decision->state = again.evaluate(alone);
    return true;
  }
  decision->corrects[q.function] = -1;  // both stay
  return false;
}

/// The law stands, and the function is what it leaves: as large as that, and gone with the law. One such function of
/// the same inputs will do.
static void keep_as_correction(Work* work, const Evidence& evidence, int function, const Evidence::Gain& law,
                               Decision* decision) {
  std::vector<int> gone = {function};
  for (const auto& [other, corrected] : decision->corrects) {
    const Explanation& e = work->design.candidates.named[static_cast<std::size_t>(other)];
    if (corrected == law.group && e.inputs == work->design.candidates.named[static_cast<std::size_t>(function)].inputs)
      gone.push_back(other);
  }
  Choice choice = without_these(decision->state.choice, gone);
  if (std::find(choice.groups.begin(), choice.groups.end(), law.group) == choice.groups.end())
    choice = with_one_more(choice, law.group, law.scale);
  auto& groups = work->design.candidates.groups;
  const Evidence::Gain left = evidence.gain(evidence.evaluate(choice), columns_of_groups(*work, {function}), 0.0);
  decision->state = evidence.evaluate(with_one_more(choice, function, left.scale));
  decision->corrects[function] = law.group;
  const int number = groups[static_cast<std::size_t>(law.group)].law_at;
  if (number < 0) return;
  ColumnGroup& correction = groups[static_cast<std::size_t>(function)];
  correction.corrects_law_at = correction.law_at = number;
}

/// One function against the laws at its joint. True: the choice has changed.
static bool question_law(Work* work, const Robot& robot, const Evidence& evidence, int function, Decision* decision) {
  const Choice& choice = decision->state.choice;
  const Question q = question_of(*work, robot, choice, function);
  const Evidence::Gain best = law_that_stands(*work, evidence, choice, q);
  if (best.group >= 0) {  // the law stands; the function corrects it
    const std::size_t before = choice.groups.size();
    keep_as_correction(work, evidence, function, best, decision);
    return decision->state.choice.groups.size() != before;
  }
  const bool nothing_else_is_named = q.here.size() == 1 && q.what.kind == Kind::free;
  if (nothing_else_is_named || q.what.law_test == LawTest::times_the_lengths) return false;
  return replace_laws(work, robot, q, decision);
}

/// A law and a free function at one joint: either the law is right but for a correction, or it is not this law and its
/// name would be wrong. Decided by how much of the motion the plain law makes.
static void question_laws(Work* work, const Robot& robot, Decision* decision) {
  drop_contained(*work, decision);
  for (int round = 0; round < 6; ++round) {
    const Evidence evidence = evidence_now(*work);
    bool changed = false;
    for (const int f : Choice(decision->state.choice).groups) {
      const Explanation& e = work->design.candidates.named[static_cast<std::size_t>(f)];
      const bool is_function = e.kind == Kind::free || e.kind == Kind::law;
      if (!is_function || e.site == "base" || decision->corrects.count(f)) continue;
      changed = question_law(work, robot, evidence, f, decision);
      if (changed) break;
    }
    if (!changed) break;
  }
  drop_contained(*work, decision);
}

/// Is there a gap at all? Sets what noise alone reaches, and the threshold that it passes as often as is allowed.
static void find_gap(const Work& work, Gears* gears, Decision* out) {
  const DiagnoseOptions& options = work.given.options;
  const Evidence evidence = evidence_now(work);
  out->first = evidence.gains(evidence.evaluate({}));
  const Shortlist list = shortlist(work, {});
  double best = -1e300;  // of the groups that the null is drawn over, and no others
  for (const int g : list.which) best = std::max(best, out->first[static_cast<std::size_t>(g)].score);
  const Gram gram = work.grams.train.of(list.columns);
  const Evidence few(gram, list.groups, list.nuisance, list.prior);
  std::vector<double> null = few.null_scores(few.evaluate({}), kNullDraws, options.seed + 11, options.threads);
  int above = 1;
  for (const double score : null) above += score >= best ? 1 : 0;
  out->p_gap = static_cast<double>(above) / (static_cast<double>(null.size()) + 1.0);
  // Orders have no columns yet. Noise reaches their best score with a chance that is known.
  if (out->p_gap > options.false_alarm) {
    const OrderAt order = gears->best(evidence, evidence.evaluate({}));
    if (order.score > best) {
      const auto reach = std::count_if(null.begin(), null.end(), [&](double s) { return s >= order.score; });
      const double chance = static_cast<double>(reach + 1) / (static_cast<double>(null.size()) + 1.0);
      out->p_gap = std::min(1.0, chance + OrderScan::chance_of(order));
    }
  }
  std::sort(null.begin(), null.end());
  if (null.empty()) return;
  const double at = null[static_cast<std::size_t>(std::min<double>(
      static_cast<double>(null.size()) - 1.0, (1.0 - options.false_alarm) * static_cast<double>(null.size())))];
  out->search.threshold = std::max(out->search.threshold, at);
}

/// A candidate from the start; else a function that was found on what those leave.
static bool is_candidate(const Explanation& e) { return is_named(e) || is_over_time(e); }

/// What was found on what the candidates leave, of a choice.
static Choice without_names(const Work& work, const Choice& choice) {
  std::vector<int> names;
  for (const int g : choice.groups) {
    if (is_candidate(work.design.candidates.named[static_cast<std::size_t>(g)])) names.push_back(g);
  }
  return without_these(choice, names);
}

/// Chance of random signs that a function may have. Where nothing says that there is a gap, it says so by itself.
static double chance_allowed(const Work& work, const Decision& so_far) {
  const double false_alarm = work.given.options.false_alarm;
  const std::vector<int>& chosen = so_far.state.choice.groups;
  const bool gap = so_far.p_gap <= false_alarm || work.given.beyond_repeats > kLackOfFit ||
                   !std::all_of(chosen.begin(), chosen.end(), [&](int g) {
                     return is_candidate(work.design.candidates.named[static_cast<std::size_t>(g)]);
                   });
  return gap ? kChance : std::min(kChance, false_alarm);
}

static bool has_room(const Decision& decision) {
  return static_cast<int>(decision.state.choice.groups.size()) < decision.search.most_groups;
}

/// A free function on what is left, if it wins, and what it makes needless goes. True: it was taken.
static bool add_free_function(Work* work, const FreeScan& scan, Decision* out) {
  const SearchOptions& search = out->search;
  if (!has_room(*out) || scan.best.empty() || scan.p > chance_allowed(*work, *out)) return false;
  const FreeGain& best = scan.best.front();
  if (!(best.gain.score > search.threshold + 4.0 && best.gain.share > kFreeShare)) return false;
  append_free(work, best, scan.tried);
  extend_grams(work->design, work->noise.design_effect, &work->grams);
  const Evidence with = evidence_now(*work);
  const int function = static_cast<int>(work->design.candidates.groups.size()) - 1;
  const Choice grown = with_one_more(out->state.choice, function, best.gain.scale);
  Evidence::State next = with.improve(with.evaluate(grown), search);
  next = keep_what_predicts(*work, with.search(search, next.choice));
  // Names that were given before the function was known may stand for parts of it: once more without them.
  Evidence::State anew = keep_what_predicts(*work, with.search(search, without_names(*work, next.choice)));
  if (anew.score > next.score) next = std::move(anew);
  if (!(next.score > out->state.score + search.threshold)) return false;
  out->state = std::move(next);
  return true;
}

/// The same effect at every joint where it would win by itself, if what causes it is likely at several. Fewer than two:
/// none.
static Choice at_several_joints(const Work& work, const Decision& so_far, const Effect& effect) {
  Choice out;
  for (std::size_t g = 0; g < so_far.first.size(); ++g) {
    const Explanation& e = work.design.candidates.named[g];
    const ColumnGroup& group = work.design.candidates.groups[g];
    if (e.effect != effect.name || e.kind != Kind::catalogue || group.shadow || so_far.first[g].score < 0.0) continue;
    out.groups.push_back(static_cast<int>(g));
    out.scales.push_back(so_far.first[g].scale);
  }
  return out.groups.size() < 2 ? Choice{} : out;
}

/// A score in which an effect that is likely at several joints pays for the choice among all candidates once, and then
/// for that among the joints.
static double score_of_causes(const Work& work, const Evidence::State& state) {
  const double joints = std::log(static_cast<double>(work.design.joint_column.size()));
  double score = state.score;
  std::set<std::string> seen;
  for (const int g : state.choice.groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    if (e.kind != Kind::catalogue || !effect_traits(work, e).on_several_joints || seen.insert(e.effect).second)
      continue;
    score += std::max(0.0, work.design.candidates.groups[static_cast<std::size_t>(g)].cost - joints);
  }
  return score;
}

/// One cause on several joints: step by step something else at one of them can stand in its way.
static Evidence::State search_causes(const Work& work, const Evidence& evidence, const Decision& so_far,
                                     Evidence::State best) {
  for (const std::vector<Effect>* effects : {&catalogue(), &work.given.options.own_effects}) {
    for (const Effect& effect : *effects) {
      if (!effect.traits.on_several_joints) continue;
      const Choice start = at_several_joints(work, so_far, effect);
      if (start.groups.empty()) continue;
      Evidence::State other = keep_what_predicts(work, evidence.search(so_far.search, start));
      if (score_of_causes(work, other) > score_of_causes(work, best)) best = std::move(other);
    }
  }
  return best;
}

/// Named effects, from nothing on; and, where all links together are not among them, from those on: step by step a few
/// single effects can stand in the way of many small errors of the links.
static Evidence::State search_named(const Work& work, const Decision& so_far) {
  const Evidence evidence = evidence_now(work);
  Evidence::State best = keep_what_predicts(work, evidence.search(so_far.search));
  for (std::size_t g = 0; g < so_far.first.size(); ++g) {
    if (work.design.candidates.named[g].kind != Kind::all_geometry) continue;
    const std::vector<int>& in = best.choice.groups;
    if (std::find(in.begin(), in.end(), static_cast<int>(g)) != in.end()) continue;
    const Choice links = {{static_cast<int>(g)}, {so_far.first[g].scale}};
    const Evidence::State other = keep_what_predicts(work, evidence.search(so_far.search, links));
    if (other.score > best.score) best = other;
  }
  return search_causes(work, evidence, so_far, std::move(best));
}

/// All links together beside other groups, with the size of their errors that predicts other poses best.
static Choice with_links(const Work& work, int links, const Choice& others) {
  double least = 1e300;
  Choice best;
  for (const double scale : {1.0, 0.3, 0.1, 0.03, 0.01}) {
    Choice choice = others;
    choice.groups.push_back(links);
    choice.scales.push_back(scale);
    const double squares = cross_validated(work, choice);
    if (squares >= least) continue;
    least = squares;
    best = std::move(choice);
  }
  return best;
}

/// What the search would choose from these sums alone, `beside` other groups.
static Choice search_again(const Work& work, const Decision& decision, const Gram& train, Choice beside) {
  const Shortlist list = shortlist(work, decision.state.choice.groups);
  const Gram some = train.of(list.columns);
  const Evidence evidence(some, list.groups, list.nuisance, list.prior);
  for (int& group : beside.groups)
    group = static_cast<int>(std::find(list.which.begin(), list.which.end(), group) - list.which.begin());
  Choice found = evidence.search(decision.search, beside).choice;
  for (int& group : found.groups) group = list.which[static_cast<std::size_t>(group)];
  return found;
}

/// Do names that were chosen among many predict other poses better, for sure, than all links together do? Each fold is
/// predicted by names that were chosen without it. Functions were tested by themselves, and stand beside both.
static bool names_predict_better(const Work& work, const Decision& decision, const Choice& functions,
                                 const Choice& links) {
  const Eigen::VectorXd by_names =
      squares_of_parts(work, [&](const Gram& train) { return search_again(work, decision, train, functions); });
  return predicts_better(by_names, squares_of_parts(work, [&](const Gram&) { return links; }), 1.0);
}

/// Few poses cannot say which link it is, nor which of many causes that would do as well. What is known of every robot
/// beforehand, that its links are not as drawn, is believed before names that do not predict other poses better.
static void prefer_links_that_predict(const Work& work, Decision* out) {
  const int links = all_links(work);
  if (links < 0 || !has_few_poses(work, links)) return;  // of many, the evidence decides
  const auto has_links = [&](const Choice& choice) {
    return std::find(choice.groups.begin(), choice.groups.end(), links) != choice.groups.end();
  };
  const Evidence evidence = evidence_now(work);
  const Choice now = out->state.choice, functions = without_names(work, now),
               in_place = with_links(work, links, functions),
               beside = with_links(work, links, without_these(now, {links}));
  const bool has_names = now.groups.size() > functions.groups.size();
  if (has_links(now)) {
    out->state = evidence.evaluate(beside);
  } else if (has_names && names_predict_better(work, *out, functions, in_place)) {
    if (predicts_better(squares_of_folds(work, beside), squares_of_folds(work, now), kMuchBetter))
      out->state = evidence.evaluate(beside);
  } else if (predicts_better(squares_of_folds(work, in_place), squares_of_folds(work, functions), kMuchBetter)) {
    const Evidence::State found = keep_what_predicts(work, evidence.search(out->search, in_place));
    out->state = has_links(found.choice) ? found : evidence.evaluate(in_place);
  }
}

bool links_predict(const Work& work, const Choice& choice, std::size_t at) {
  const int group = choice.groups[at];
  if (work.design.candidates.named[static_cast<std::size_t>(group)].kind != Kind::all_geometry) return false;
  return predicts_better(squares_of_folds(work, choice), squares_of_folds(work, without_these(choice, {group})),
                         kMuchBetter);
}

/// Noise alone reaches as high a score as any candidate does: names go, unless a function that passed a test of its own
/// is there. But of few poses that score is no powerful test: where unseen folds lose a third of their squares by the
/// links, these stay.
static void keep_what_is_no_chance(const Work& work, Decision* out) {
  const auto& named = work.design.candidates.named;
  Choice links;
  for (std::size_t k = 0; k < out->state.choice.groups.size(); ++k) {
    const int g = out->state.choice.groups[k];
    const Explanation& e = named[static_cast<std::size_t>(g)];
    if (!is_candidate(e)) return;
    if (e.kind == Kind::all_geometry) links = {{g}, {out->state.choice.scales[k]}};
  }
  if (!predicts_better(squares_of_folds(work, links), squares_of_folds(work, {}), kNoChance)) links = {};
  out->state = evidence_now(work).evaluate(links);
}

static std::vector<FunctionBeside> functions_beside(const FreeScan& scan) {
  std::vector<FunctionBeside> out;
  for (const FreeGain& found : scan.best) {
    const bool of_one = found.what.inputs.size() == 1;
    out.push_back({found.what.site, found.what.inputs, of_one ? found.gain.evidence : found.gain.score});
  }
  return out;
}

/// Free functions and orders of gears on what the names leave, the better one first; where they win about as much, the
/// order: machines have it. Returns the next round's seed.
static std::uint64_t add_what_is_unnamed(Work* work, const Robot& robot, std::uint64_t seed, Gears* gears,
                                         Decision* out) {
  constexpr int kMostRounds = 6;
  for (int round = 0; round < kMostRounds; ++round) {
    const Evidence evidence = evidence_now(*work);
    FreeScanOptions scan_options;
    scan_options.threads = work->given.options.threads;
    scan_options.seed = seed++;
    const FreeScan scan =
        scan_free(work->design, evidence, out->state, work->inputs, robot, work->noise.design_effect, scan_options);
    out->p_left = scan.p;
    out->beside = functions_beside(scan);
    const OrderAt order = gears->best(evidence, out->state);
    const bool order_first = scan.best.empty() || kFunctionFirst * order.in_noise > scan.best.front().gain.score;
    if (order_first && gears->take(order, out)) continue;
    if (add_free_function(work, scan, out)) continue;
    if (order_first || !gears->take(order, out)) break;
  }
  return seed;
}

/// Sizes of groups were chosen when others were not in yet, or had not gone.
static void size_again(const Work& work, Decision* out) {
  const Evidence evidence = evidence_now(work);
  const auto& groups = work.design.candidates.groups;
  for (std::size_t at = 0; at < out->state.choice.groups.size(); ++at) {
    const int group = out->state.choice.groups[at];
    const Evidence::State rest = evidence.evaluate(without_these(out->state.choice, {group}));
    Choice other = out->state.choice;
    other.scales[at] = evidence.gain(rest, groups[static_cast<std::size_t>(group)].columns, 0.0).scale;
    if (other.scales[at] == out->state.choice.scales[at]) continue;
    Evidence::State next = evidence.evaluate(other);
    if (next.score > out->state.score) out->state = std::move(next);
  }
}

/// What did not predict other poses, or questions took away, may have stood in a name's way: of those that were not
/// `asked` about, the one that wins most, if it predicts. True: it was taken.
static bool add_name(const Work& work, const std::set<int>& asked, Decision* out) {
  if (!has_room(*out)) return false;
  const Evidence evidence = evidence_now(work);
  const SearchOptions& search = out->search;
  Evidence::Gain best;
  for (const Evidence::Gain& gain : evidence.gains(out->state, search.threads)) {
    const bool wins = gain.score > search.threshold && gain.share > search.least_share;
    if (wins && asked.count(gain.group) == 0 && gain.score > best.score &&
        is_candidate(work.design.candidates.named[static_cast<std::size_t>(gain.group)]) &&
        evidence.may_enter(out->state, gain.group))
      best = gain;
  }
  if (best.group < 0) return false;
  const Choice more = with_one_more(out->state.choice, best.group, best.scale);
  if (!predicts_better(squares_of_folds(work, more), squares_of_folds(work, out->state.choice), kNoBetter))
    return false;
  out->state = evidence.evaluate(more);
  return true;
}

/// All questions, of what is chosen, which joins those that were `asked` about.
static void question_all(Work* work, const Robot& robot, std::set<int>* asked, Decision* out) {
  asked->insert(out->state.choice.groups.begin(), out->state.choice.groups.end());
  question_bundles(work, robot, out);
  question_laws(work, robot, out);
}

/// Of the candidates that there are.
static Decision explain(Work* work, const Robot& robot) {
  const DiagnoseOptions& options = work->given.options;
  Decision out;
  out.search.most_groups = options.max_effects;
  out.search.threads = options.threads;
  Gears gears(work, robot);
  find_gap(*work, &gears, &out);
  if (work->given.mistaken) {
    out.state = evidence_now(*work).evaluate({});
    return out;
  }
  out.state = search_named(*work, out);
  // What questions take away leaves room for what there was none for.
  std::uint64_t seed = options.seed + 101;
  std::set<int> asked;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    seed = add_what_is_unnamed(work, robot, seed, &gears, &out);
    const bool was_full = !has_room(out);
    question_all(work, robot, &asked, &out);
    if (!was_full || !has_room(out)) break;
  }
  size_again(*work, &out);
  for (int turn = 0; turn < kMostTurns && add_name(*work, asked, &out); ++turn) question_all(work, robot, &asked, &out);
  prefer_links_that_predict(*work, &out);
  if (out.p_gap > options.false_alarm && work->given.beyond_repeats <= kLackOfFit) keep_what_is_no_chance(*work, &out);
  return out;
}

/// Without the functions that correct laws: beside them a law's own parts say little.
static Evidence::State with_plain_laws(const Work& work, const Decision& decision) {
  std::vector<int> corrections;
  for (const auto& [function, law] : decision.corrects) {
    if (law >= 0) corrections.push_back(function);
  }
  return corrections.empty() ? decision.state
                             : evidence_now(work).evaluate(without_these(decision.state.choice, corrections));
}

Decision decide(Work* work, const Robot& robot) {
  const std::size_t groups = work->design.candidates.groups.size();
  const Grams grams = work->grams;
  std::vector<TooLarge> aside;
  for (;;) {
    Decision out = explain(work, robot);
    const std::vector<TooLarge> more = too_large_in(*work, out.state);
    std::vector<int> gone = out_of_proportion_in(*work, with_plain_laws(*work, out));
    for (const TooLarge& one : more) gone.push_back(one.group);
    if (gone.empty()) {
      out.too_large = std::move(aside);
      return out;
    }
    set_aside(gone, groups, grams, work);
    aside.insert(aside.end(), more.begin(), more.end());
  }
}

}  // namespace truing::diagnosis
