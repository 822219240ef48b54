// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Where the gap lies, which effect causes it, how far it shrinks. The procedure is that of docs/diagnose.md, section by section.

#include "truing/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <thread>

#include "candidates.hpp"
#include "evaluate.hpp"
#include "evidence.hpp"
#include "free_search.hpp"
#include "linearise.hpp"
#include "next_poses.hpp"
#include "random.hpp"
#include "sanity.hpp"
#include "selection.hpp"
#include "statistics.hpp"
#include "text.hpp"
#include "where.hpp"

namespace truing {
namespace detail {
namespace {

using Kind = Explanation::Kind;
constexpr int kNullDraws = 200;
constexpr double kClassR2 = 0.98;
constexpr double kNoBetter = 1.004;   ///< a group must lower the cross-validated sum of squares by more than this
constexpr double kCorrectionShare = 0.05;
constexpr double kFreeShare = 0.04;   ///< of what is left, that a free function must explain
constexpr double kMeshNats = 5.0;     ///< beyond the threshold, that a mesh order must win: waves this short fit anything a little
constexpr double kClassNats = 3.0;
constexpr double kChiMedian[4] = {0.0, 0.674490, 1.177410, 1.538172};

// --- the working state of one diagnosis ---------------------------------------------------------------------------------

struct Work {
  const DiagnoseOptions& options;
  Measurements data;                       ///< with the better joint record, and approach directions where they could be inferred
  std::vector<std::int32_t> cluster;       ///< pose group of every row
  std::vector<InputColumn> inputs;
  Identification frames;                   ///< base and targets found, everything else nominal
  Linearisation linear;
  Design design;
  double deff = 1.0;                       ///< values that count as one
  std::vector<std::int32_t> outliers;      ///< rows that count for little
  double position_sigma = 0.0;             ///< [m] of a component (or a distance), from the flexible fit
  std::vector<Gram> fold;                  ///< training folds
  Gram train, test;
  std::vector<Gram> test_fold;
  bool inferred_direction = false;
};

// --- weights: what noise is ----------------------------------------------------------------------------------------------

int kind_of(std::int8_t component) { return component < 3 ? 0 : component < 6 ? 1 : 2; }

/// Sums over the training rows, of some columns.
Gram sum_flexible(const Design& design, const std::vector<int>& columns) {
  GramSum sum(static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    if (design.fold[static_cast<std::size_t>(i)] >= design.folds) continue;
    double* out = sum.row();
    for (const int column : columns) {
      *out = design.weight[i] * design.x(i, column);
      out += GramSum::stride();
    }
    *out = design.weight[i] * design.y[i];
    sum.push();
  }
  return sum.finish();
}

/// Unit-weight rows: each kind of value by its own noise, what stands far out by less (Huber 1964; the power makes gross
/// outliers count for nothing). The noise is what the flexible model leaves: everything at once under a ridge prior, so
/// that an effect is not taken for noise.
void weigh(Work* work) {
  Design& design = work->design;
  const Eigen::Index n = design.x.rows();
  const Measurements& data = work->data;
  Eigen::VectorXd own = Eigen::VectorXd::Ones(n);  // what the rows say of themselves
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(design.row[static_cast<std::size_t>(i)]);
    const int kind = kind_of(design.component[static_cast<std::size_t>(i)]);
    if (data.weight) own[i] = std::sqrt(data.weight[row]);
    if (kind != 1 && data.position_sigma) own[i] /= data.position_sigma[row];
    if (kind == 1 && data.rotation_sigma) own[i] /= data.rotation_sigma[row];
  }
  std::vector<int> flexible = design.nuisance;
  std::vector<bool> in(static_cast<std::size_t>(design.x.cols()), false);
  for (const int k : flexible) in[static_cast<std::size_t>(k)] = true;
  for (std::size_t g = 0; g < design.candidates.groups.size(); ++g) {
    const Explanation& e = design.candidates.named[g];
    const bool coarse_drift = e.kind == Kind::drift && e.effect == "drift" && e.site != "base.xyz" && e.knots[0].size() <= 12;
    if (e.kind == Kind::drift && !coarse_drift) continue;
    for (const int k : design.candidates.groups[g].columns) {
      if (!in[static_cast<std::size_t>(k)]) flexible.push_back(k);
      in[static_cast<std::size_t>(k)] = true;
    }
  }
  double sigma[3] = {0.0, 0.0, 0.0};
  Eigen::VectorXd robust = Eigen::VectorXd::Ones(n);
  Eigen::VectorXd residual = design.y;
  double used = 0.0;
  const auto p = static_cast<Eigen::Index>(flexible.size());
  Eigen::MatrixXd xx(p, p);
  Eigen::VectorXd xy(p);
  double summed_at = 0.0;  // noise that xx and xy were weighted with; 0: weights differ from row to row
  for (int round = 0; round < 4; ++round) {
    // Noise of each kind from the median length, and the rows that stand out.
    std::vector<double> lengths[3];
    std::vector<std::pair<Eigen::Index, Eigen::Index>> blocks;  // values of one row and kind
    double training = 0.0;
    for (Eigen::Index i = 0; i < n;) {
      Eigen::Index j = i;
      const int kind = kind_of(design.component[static_cast<std::size_t>(i)]);
      while (j < n && design.row[static_cast<std::size_t>(j)] == design.row[static_cast<std::size_t>(i)] && kind_of(design.component[static_cast<std::size_t>(j)]) == kind) ++j;
      blocks.emplace_back(i, j - i);
      if (design.fold[static_cast<std::size_t>(i)] < design.folds) {
        lengths[kind].push_back((own.segment(i, j - i).cwiseProduct(residual.segment(i, j - i))).norm());
        training += static_cast<double>(j - i);
      }
      i = j;
    }
    const double inflate = std::sqrt(training / std::max(1.0, training - used));
    for (int kind = 0; kind < 3; ++kind) {
      if (!lengths[kind].empty()) sigma[kind] = std::max(median_of(lengths[kind]) / kChiMedian[kind == 2 ? 1 : 3] * inflate, 1e-12);
    }
    std::size_t far = 0, very_far = 0;
    std::vector<double> distance2(blocks.size());
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto [first, count] = blocks[b];
      const int kind = kind_of(design.component[static_cast<std::size_t>(first)]);
      distance2[b] = own.segment(first, count).cwiseProduct(residual.segment(first, count)).squaredNorm() / (sigma[kind] * sigma[kind]);
      const double bound = count == 1 ? 9.0 : 14.2;  // one in 370 of normal noise
      far += distance2[b] > bound ? 1 : 0;
      very_far += distance2[b] > 3.0 * bound ? 1 : 0;
    }
    const bool tails = round > 0 && (very_far > 0 || static_cast<double>(far) > 4.0 + 0.01 * static_cast<double>(blocks.size()));
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const auto [first, count] = blocks[b];
      const int kind = kind_of(design.component[static_cast<std::size_t>(first)]);
      const double bound = count == 1 ? 5.0 : 9.0;
      const double root = tails && distance2[b] > bound ? std::pow(bound / distance2[b], 0.75) : 1.0;
      if (round == 3 && root < 0.2) work->outliers.push_back(design.row[static_cast<std::size_t>(first)]);
      robust.segment(first, count).setConstant(root);
      design.weight.segment(first, count) = own.segment(first, count) * root / sigma[kind];
    }
    if (round == 3) break;
    // The flexible fit, at noise variance one. As long as all weights are equal, the sums only change their scale.
    const int kinds = (lengths[0].empty() ? 0 : 1) + (lengths[1].empty() ? 0 : 1) + (lengths[2].empty() ? 0 : 1);
    const double uniform = kinds == 1 && !tails ? std::max({sigma[0], sigma[1], sigma[2]}) : 0.0;
    if (uniform > 0.0 && summed_at > 0.0) {
      const double times = std::pow(summed_at / uniform, 2.0);
      xx *= times;
      xy *= times;
    } else {
      const Gram sums = sum_flexible(design, flexible);
      xx = sums.xx;
      xy = sums.xy;
    }
    summed_at = uniform;
    Eigen::MatrixXd d = xx;
    for (Eigen::Index c = 0; c < p; ++c) {
      const bool flat = c < static_cast<Eigen::Index>(design.nuisance.size());
      d(c, c) += flat ? 1e-9 * xx(c, c) + 1e-30 : std::pow(0.05 * design.prior[flexible[static_cast<std::size_t>(c)]], -2.0);
    }
    const Eigen::LLT<Eigen::MatrixXd> factor = factorised(std::move(d));
    const Eigen::VectorXd solution = factor.solve(xy);
    used = factor.solve(xx).trace();  // effective number of parameters
    for (Eigen::Index i = 0; i < n; ++i) {
      double fitted = 0.0;
      for (Eigen::Index c = 0; c < p; ++c) fitted += design.x(i, flexible[static_cast<std::size_t>(c)]) * solution[c];
      residual[i] = design.y[i] - fitted;
    }
  }
  work->position_sigma = sigma[0] > 0.0 ? sigma[0] : sigma[2];

  // Rows of one pose that err together count for less than their number.
  double together = 0.0, pairs = 0.0, alone = 0.0, values = 0.0;
  std::map<std::pair<std::int32_t, int>, std::array<double, 3>> sums;  // by pose and component: sum, sum of squares, count
  for (Eigen::Index i = 0; i < n; ++i) {
    if (design.fold[static_cast<std::size_t>(i)] >= design.folds) continue;
    const double e = design.weight[i] * residual[i];
    auto& s = sums[{design.cluster[static_cast<std::size_t>(i)], design.component[static_cast<std::size_t>(i)]}];
    s[0] += e;
    s[1] += e * e;
    s[2] += 1.0;
  }
  double squares_of_counts = 0.0;
  for (const auto& [key, s] : sums) {
    together += s[0] * s[0] - s[1];
    pairs += s[2] * (s[2] - 1.0);
    alone += s[1];
    values += s[2];
    squares_of_counts += s[2] * s[2];
  }
  if (pairs > 0.0 && alone > 0.0) {
    const double correlation = std::clamp((together / pairs) / (alone / values), 0.0, 1.0);
    work->deff = 1.0 + (squares_of_counts / values - 1.0) * correlation;
  }
}

void make_grams(Work* work) {
  const Design& design = work->design;
  const int folds = design.folds + design.test_folds;
  std::vector<Gram> grams(static_cast<std::size_t>(folds));
  const auto some = [&](int first) {
    for (int f = first; f < folds; f += 2) grams[static_cast<std::size_t>(f)].add(design.gram_of_fold(f), 1.0 / work->deff);
  };
  if (work->options.threads == 1) {
    some(0);
    some(1);
  } else {
    std::thread other(some, 1);
    some(0);
    other.join();
  }
  work->fold.assign(std::make_move_iterator(grams.begin()), std::make_move_iterator(grams.begin() + design.folds));
  work->test_fold.assign(std::make_move_iterator(grams.begin() + design.folds), std::make_move_iterator(grams.end()));
  work->train = work->test = Gram();
  for (const Gram& gram : work->fold) work->train.add(gram);
  for (const Gram& gram : work->test_fold) work->test.add(gram);
}

/// After columns were appended: their part of every Gram, nothing else.
void extend_grams(Work* work) {
  const Design& design = work->design;
  const Eigen::Index p = design.x.cols(), before = work->train.xx.cols(), more = p - before;
  if (more <= 0) return;
  const auto folds = static_cast<std::size_t>(design.folds + design.test_folds);
  std::vector<Eigen::MatrixXd> cross(folds, Eigen::MatrixXd::Zero(p, more));
  std::vector<Eigen::VectorXd> right(folds, Eigen::VectorXd::Zero(more));
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const double w2 = design.weight[i] * design.weight[i] / work->deff;
    if (w2 == 0.0) continue;
    const auto f = static_cast<std::size_t>(design.fold[static_cast<std::size_t>(i)]);
    for (Eigen::Index k = 0; k < more; ++k) {
      const double value = w2 * design.x(i, before + k);
      if (value == 0.0) continue;
      cross[f].col(k) += value * design.x.row(i).transpose();
      right[f][k] += value * design.y[i];
    }
  }
  const auto extend = [&](Gram* gram, const Eigen::MatrixXd& block, const Eigen::VectorXd& rhs) {
    gram->xx.conservativeResize(p, p);
    gram->xx.rightCols(more) = block;
    gram->xx.bottomRows(more) = block.transpose();
    gram->xy.conservativeResize(p);
    gram->xy.tail(more) = rhs;
  };
  Eigen::MatrixXd all[2] = {Eigen::MatrixXd::Zero(p, more), Eigen::MatrixXd::Zero(p, more)};
  Eigen::VectorXd all_right[2] = {Eigen::VectorXd::Zero(more), Eigen::VectorXd::Zero(more)};
  for (std::size_t f = 0; f < folds; ++f) {
    const bool test = f >= static_cast<std::size_t>(design.folds);
    extend(test ? &work->test_fold[f - static_cast<std::size_t>(design.folds)] : &work->fold[f], cross[f], right[f]);
    all[test ? 1 : 0] += cross[f];
    all_right[test ? 1 : 0] += right[f];
  }
  extend(&work->train, all[0], all_right[0]);
  extend(&work->test, all[1], all_right[1]);
}

// --- the search ----------------------------------------------------------------------------------------------------------

bool is_named(const Explanation& e) { return e.kind == Kind::catalogue || e.kind == Kind::all_geometry || e.kind == Kind::drift; }

int input_named(const Work& work, const std::string& name) {
  for (std::size_t k = 0; k < work.inputs.size(); ++k) {
    if (work.inputs[k].name == name) return static_cast<int>(k);
  }
  return -1;
}

/// Adds columns of one more candidate to the design.
void append(Work* work, Explanation what, const Design::Rows& columns, double prior, double cost, int kind_at = -1) {
  Design& design = work->design;
  const Eigen::Index p = design.x.cols();
  design.x.conservativeResize(Eigen::NoChange, p + columns.cols());
  design.x.rightCols(columns.cols()) = columns;
  design.prior.conservativeResize(p + columns.cols());
  design.prior.tail(columns.cols()).setConstant(prior);
  ColumnGroup group;
  group.cost = cost;
  group.kind_at = kind_at;
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    group.columns.push_back(static_cast<int>(p + k));
    design.column_names.push_back(what.parameters[static_cast<std::size_t>(k)]);
    design.column_units.push_back("rad");
  }
  design.candidates.groups.push_back(std::move(group));
  design.candidates.named.push_back(std::move(what));
}

/// Mesh orders that win on what is left become candidates. True: there were some.
bool add_meshes(Work* work, const Evidence& evidence, const Evidence::State& state, const Robot& robot, double threshold) {
  const auto& left_out = work->options.leave_out;
  if (std::find(left_out.begin(), left_out.end(), "transmission_error") != left_out.end()) return false;
  bool any = false;
  for (const MeshGain& mesh : scan_mesh(work->design, evidence, state, work->inputs, robot, work->deff)) {
    if (mesh.score < threshold) continue;
    Explanation e;
    const std::string& joint = robot.joints[mesh.joint].name;
    e.effect = "transmission_error@" + exact_number(mesh.order);
    const bool known = std::any_of(work->design.candidates.named.begin(), work->design.candidates.named.end(), [&](const Explanation& other) {
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
    const auto input = std::find_if(work->inputs.begin(), work->inputs.end(), [&](const InputColumn& c) { return c.name == e.driver; });
    for (Eigen::Index i = 0; i < n; ++i) {
      const double q = input->values[static_cast<std::size_t>(work->design.row[static_cast<std::size_t>(i)])];
      const double d = work->design.x(i, work->design.joint_column[mesh.joint][0]);
      columns(i, 0) = d * std::cos(mesh.order * q);
      columns(i, 1) = d * std::sin(mesh.order * q);
    }
    append(work, e, columns, 1e-2, std::log(static_cast<double>(mesh.tried * static_cast<int>(robot.joints.size()))));
    any = true;
  }
  return any;
}

/// Everything that was decided.
struct Decision {
  Evidence::State state;           ///< named, laws and free functions
  Choice frames_only;
  double p_gap = 1.0;
  double p_left = 1.0;
  std::vector<Evidence::Gain> first;  ///< every group alone
  std::map<int, int> corrects;        ///< a law's correction, or a free function that is one: the group whose law it corrects
};

SearchOptions search_options(const DiagnoseOptions& options) {
  SearchOptions out;
  out.most_groups = options.max_effects;
  return out;
}

/// Of a free function and what it stands beside, the part that goes in as columns of the design.
void append_free(Work* work, const FreeGain& found, std::size_t trials) {
  const Design::Rows columns = free_columns(work->design, found.site_columns, work->inputs, found.what.inputs, found.what.knots);
  append(work, found.what, columns, 1e-2, std::log(static_cast<double>(trials)));
}

Choice without(const Choice& choice, const std::vector<ColumnGroup>& groups, std::size_t at) {
  Choice out;
  const ColumnGroup& gone = groups[static_cast<std::size_t>(choice.groups[at])];
  for (std::size_t k = 0; k < choice.groups.size(); ++k) {
    const ColumnGroup& other = groups[static_cast<std::size_t>(choice.groups[k])];
    const bool orphan = gone.parent_kind < 0 && gone.kind_at >= 0 && other.parent_kind == gone.kind_at;
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
  for (const int g : choice.groups) columns.insert(columns.end(), groups[static_cast<std::size_t>(g)].columns.begin(), groups[static_cast<std::size_t>(g)].columns.end());
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
Evidence::State keep_what_predicts(const Work& work, Evidence::State state) {
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

/// The groups that may enter first, on a Gram of their columns only: corrections of laws and fine drifts are many columns.
struct Shortlist {
  std::vector<ColumnGroup> groups;
  std::vector<int> which;      ///< of all groups
  std::vector<int> columns;    ///< of the design; the nuisance comes first
  std::vector<int> nuisance;
  Eigen::VectorXd prior;
};

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
    const bool plain = e.kind == Kind::catalogue || e.kind == Kind::all_geometry || (e.kind == Kind::drift && e.knots[0].size() <= 6);
    if (groups[g].shadow || groups[g].columns.empty() || (!wanted && !plain)) continue;
    ColumnGroup group = groups[g];
    group.parent_kind = -1;
    for (int& column : group.columns) column = take(column);
    out.groups.push_back(std::move(group));
    out.which.push_back(static_cast<int>(g));
  }
  out.prior.resize(static_cast<Eigen::Index>(out.columns.size()));
  for (Eigen::Index k = 0; k < out.prior.size(); ++k) out.prior[k] = work.design.prior[out.columns[static_cast<std::size_t>(k)]];
  return out;
}

/// Of the motion that a law and its correction make together, the part that the plain law must make to keep its name. What a
/// joint does with its own angle can be anything: there the bar is higher.
double least_share_of_law(const std::string& effect) {
  const bool own_motion = effect == "harmonic" || effect == "gear_ratio" || effect == "joint_offset" || effect == "axis_wobble" || effect == "link_geometry";
  return own_motion ? 0.92 : 0.65;
}

/// Effects that are functions of where the joints stand, and of nothing else that is recorded.
bool follows_configuration(const std::string& effect) {
  static const std::set<std::string> names = {"harmonic", "gear_ratio", "joint_offset", "axis_wobble", "joint_compliance", "stiffness_zones", "gravity_backlash"};
  return names.count(effect) > 0;
}

std::vector<int> columns_of(const Work& work, const std::vector<int>& groups) {
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

/// A free function of these inputs at a joint, with many knots, as one more candidate.
int add_fine_function(Work* work, const Robot& robot, std::size_t joint, const std::vector<int>& which) {
  std::vector<std::int32_t> rows;
  for (std::size_t i = 0; i < work->design.row.size(); ++i) {
    if (work->design.fold[i] < work->design.folds && (i == 0 || work->design.row[i] != work->design.row[i - 1])) rows.push_back(work->design.row[i]);
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
  append(work, e, free_columns(work->design, work->design.joint_column[joint], work->inputs, e.inputs, e.knots), 1e-2, std::log(300.0));
  return static_cast<int>(work->design.candidates.groups.size()) - 1;
}

void drop_contained(Work* work, Decision* decision) {
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

/// A law and a free function at one joint: either the law is right but for a correction, or it is not this law and its name
/// would be wrong. Decided by how much of the motion the plain law makes.
void question_laws(Work* work, const Robot& robot, Decision* decision) {
  drop_contained(work, decision);
  for (int round = 0; round < 6; ++round) {
    const auto& groups = work->design.candidates.groups;
    const auto& named = work->design.candidates.named;
    const Evidence evidence(work->train, groups, work->design.nuisance, work->design.prior);
    const Choice& choice = decision->state.choice;
    bool changed = false;
    for (const int f : choice.groups) {
      const Explanation& free = named[static_cast<std::size_t>(f)];
      if ((free.kind != Kind::free && free.kind != Kind::law) || free.site == "base" || decision->corrects.count(f)) continue;
      const std::size_t joint = robot.joint_index(free.site);
      // Laws at this joint, in or out, against the function and them together.
      std::vector<int> here = {f};
      for (const int g : choice.groups) {
        const Explanation& e = named[static_cast<std::size_t>(g)];
        if (g != f && (e.kind == Kind::catalogue || e.kind == Kind::law) && e.joints == std::vector<std::string>{free.site} && e.effect != "link_geometry" &&
            e.effect.rfind("transmission", 0) != 0)
          here.push_back(g);
      }
      const Evidence::State rest = evidence.evaluate(without_these(choice, here));
      const double together = rest.rss - evidence.evaluate(choice).rss;
      Evidence::Gain best;
      for (std::size_t g = 0; g < groups.size(); ++g) {
        const Explanation& e = named[g];
        if (e.kind != Kind::catalogue || groups[g].shadow || e.joints != std::vector<std::string>{free.site} || e.effect == "link_geometry" || e.effect.rfind("transmission", 0) == 0) continue;
        if (free.kind == Kind::law && e.effect != free.effect && groups[g].kind_at != groups[static_cast<std::size_t>(f)].parent_kind) continue;
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
        const bool of_these = std::any_of(inputs.begin(), inputs.end(), [&](int i) { return work->inputs[static_cast<std::size_t>(i)].name == driver; });
        if (g != f && (of_these || (by_configuration && follows_configuration(named[static_cast<std::size_t>(g)].effect)))) gone.push_back(g);
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
  SearchOptions search = search_options(options);
  Decision out;
  const auto evidence_now = [&] { return Evidence(work->train, work->design.candidates.groups, work->design.nuisance, work->design.prior); };

  // Is there a gap at all?
  {
    const Evidence evidence = evidence_now();
    const Evidence::State nothing = evidence.evaluate({});
    out.first = evidence.gains(nothing);
    double best = -1e300;
    for (const Evidence::Gain& gain : out.first) {
      const ColumnGroup& group = work->design.candidates.groups[static_cast<std::size_t>(gain.group)];
      if (group.parent_kind < 0 && !group.shadow) best = std::max(best, gain.score);
    }
    const Shortlist list = shortlist(*work, {});
    const Gram gram = work->train.of(list.columns);
    const Evidence few(gram, list.groups, list.nuisance, list.prior);
    std::vector<double> null = few.null_scores(few.evaluate({}), kNullDraws, options.seed + 11);
    int above = 1;
    for (const double score : null) above += score >= best ? 1 : 0;
    out.p_gap = static_cast<double>(above) / (static_cast<double>(null.size()) + 1.0);
    std::sort(null.begin(), null.end());
    // The threshold that noise alone passes as often as is allowed.
    if (!null.empty()) {
      const double at = null[static_cast<std::size_t>(std::min<double>(static_cast<double>(null.size()) - 1.0, (1.0 - options.false_alarm) * static_cast<double>(null.size())))];
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
    if (room && !scan.best.empty() && scan.p <= 0.02 && scan.best.front().gain.score > search.threshold + 4.0 && scan.best.front().gain.share > kFreeShare) {
      const FreeGain& best = scan.best.front();
      append_free(work, best, scan.best.size());
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
    const bool only_named = std::all_of(out.state.choice.groups.begin(), out.state.choice.groups.end(), [&](int g) { return is_named(work->design.candidates.named[static_cast<std::size_t>(g)]); });
    if (only_named && !out.state.choice.groups.empty()) out.state = evidence_now().evaluate({});
  }
  return out;
}

// --- errors of rows under a linear model ---------------------------------------------------------------------------------

/// Lengths of the position (or distance) errors that a linear model leaves on the design's held-out rows, in order.
std::vector<double> held_out_lengths(const Design& design, const Evidence::State& state) {
  std::vector<double> out;
  std::int32_t last = -1;
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    if (design.fold[static_cast<std::size_t>(i)] < design.folds || kind_of(design.component[static_cast<std::size_t>(i)]) == 1) continue;
    double e = design.y[i];
    for (std::size_t c = 0; c < state.columns.size(); ++c) e -= design.x(i, state.columns[c]) * state.solution[static_cast<Eigen::Index>(c)];
    const std::int32_t row = design.row[static_cast<std::size_t>(i)];
    if (row != last) out.push_back(0.0);
    last = row;
    out.back() += e * e;
  }
  for (double& length : out) length = std::sqrt(length);
  return out;
}

Share percentile_interval(std::vector<double> values, double center) {
  Share out{center, center, center};
  if (values.size() < 5) return out;
  // Folds are few and whole: their spread is a little less than that of poses (measured by the examination, docs/exam.md).
  constexpr double kWider = 1.25;
  const double median = quantile(&values, 0.5);
  out.low = center + kWider * (quantile(&values, 0.05) - median);
  out.high = center + kWider * (quantile(&values, 0.95) - median);
  return out;
}

// --- the exact refit -----------------------------------------------------------------------------------------------------

struct Refit {
  Identification found;
  std::vector<Effect> own;
};

/// A column's parameter in the linear model.
double solution_of(const Work& work, const Evidence::State& state, const std::string& name) {
  const int column = work.design.column(name);
  const auto at = std::find(state.columns.begin(), state.columns.end(), column) - state.columns.begin();
  return column >= 0 && at < static_cast<std::ptrdiff_t>(state.columns.size()) ? state.solution[static_cast<Eigen::Index>(at)] : 0.0;
}

/// The chosen groups fitted without linearisation on the training rows.
Refit refit(const Work& work, const Robot& robot, const Evidence::State& state, const std::vector<int>& groups) {
  Refit out;
  Robot start = robot;
  IdentifyOptions options;
  options.threads = work.options.threads;
  options.seed = work.options.seed;
  options.own_effects = work.options.own_effects;
  std::vector<std::string> targets;
  for (const Target& target : robot.targets) targets.push_back(target.name + ".*");
  if (targets.empty()) targets.push_back("tool.*");
  options.free = targets;
  std::set<std::pair<std::string, std::string>> asked;
  for (const int g : groups) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    options.free.insert(options.free.end(), e.model_free.begin(), e.model_free.end());
    const bool many = std::any_of(e.requests.begin(), e.requests.end(), [](const EffectRequest& request) { return request.effect == "gravity_moment"; });
    if (many) {
      // First moments of unknown weights are many and hardly told apart: they stay as the search found them, under its prior.
      for (const EffectRequest& request : e.requests) {
        AppliedEffect applied{request.effect, request.joints, {}};
        for (const std::string& name : e.parameters) {
          if (name.compare(0, request.effect.size() + 1, request.effect + ".") == 0) applied.parameters[name] = solution_of(work, state, name);
        }
        start.effects.push_back(std::move(applied));
      }
      continue;
    }
    for (const EffectRequest& request : e.requests) {
      if (request.effect == "gear_ratio" || request.effect == "joint_offset" || request.effect == "link_geometry") continue;
      if (asked.insert({request.effect, request.joints.empty() ? "" : request.joints[0]}).second) options.effects.push_back(request);
    }
    if (e.kind == Kind::law || e.kind == Kind::free || e.kind == Kind::drift) {
      const std::vector<int>& columns = work.design.candidates.groups[static_cast<std::size_t>(g)].columns;
      Eigen::VectorXd coefficients(static_cast<Eigen::Index>(columns.size()));
      for (Eigen::Index k = 0; k < coefficients.size(); ++k) {
        const auto at = std::find(state.columns.begin(), state.columns.end(), columns[static_cast<std::size_t>(k)]) - state.columns.begin();
        coefficients[k] = state.solution[static_cast<Eigen::Index>(at)];
      }
      options.own_effects.push_back(free_effect(e, coefficients, work.inputs));
      options.effects.push_back({options.own_effects.back().name, {}});
    }
  }
  // One request an effect, with all of its joints.
  std::vector<EffectRequest> merged;
  for (const EffectRequest& request : options.effects) {
    auto same = std::find_if(merged.begin(), merged.end(), [&](const EffectRequest& other) { return other.effect == request.effect && !other.joints.empty(); });
    if (same != merged.end() && !request.joints.empty()) same->joints.insert(same->joints.end(), request.joints.begin(), request.joints.end());
    else merged.push_back(request);
  }
  options.effects = merged;
  out.own = options.own_effects;
  Measurements data = work.data;
  data.set = work.frames.set;
  out.found = identify(start, data, options);
  return out;
}

std::vector<double> lengths_of(const Residuals& residuals, std::size_t rows) {
  std::vector<double> out(rows, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t row = 0; row < rows; ++row) {
    const auto i = static_cast<Eigen::Index>(row);
    const double d = residuals.distance[i];
    out[row] = d == d ? std::abs(d) : residuals.position.row(i).norm();
  }
  return out;
}

std::vector<double> held_out(const std::vector<double>& lengths, const std::vector<std::int8_t>& set) {
  std::vector<double> out;
  for (std::size_t row = 0; row < lengths.size(); ++row) {
    if (set[row] && std::isfinite(lengths[row])) out.push_back(lengths[row]);
  }
  return out;
}

// --- curves --------------------------------------------------------------------------------------------------------------

/// Motion of a site, pose by pose, as the measurements say it, and the fitted function through it.
Curve curve_of(const Work& work, const Evidence::State& state, const std::map<int, int>& corrects, int group, int input, int site_column,
               double second_low, double second_high, int second) {
  const Design& design = work.design;
  Curve out;
  const InputColumn& along = work.inputs[static_cast<std::size_t>(input)];
  out.input = along.name;
  out.input_unit = along.unit;
  out.unit = design.column_units[static_cast<std::size_t>(site_column)];
  out.site = design.column_names[static_cast<std::size_t>(site_column)];
  if (out.site.size() > 7 && out.site.compare(out.site.size() - 7, 7, ".offset") == 0) out.site.resize(out.site.size() - 7);
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
      of_law |= corrected == group && std::find(o.columns.begin(), o.columns.end(), state.columns[c]) != o.columns.end();
    }
    if (of_group || of_law) own.push_back(c);
  }
  struct Sum {
    double de = 0.0, dd = 0.0, df = 0.0, variance = 0.0;
  };
  std::map<std::int32_t, Sum> poses;  // by row
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const std::int32_t row = design.row[static_cast<std::size_t>(i)];
    if (second >= 0) {
      const double value = work.inputs[static_cast<std::size_t>(second)].values[static_cast<std::size_t>(row)];
      if (value < second_low || value > second_high) continue;
    }
    double e = design.y[i], f = 0.0;
    for (std::size_t c = 0; c < state.columns.size(); ++c) e -= design.x(i, state.columns[c]) * state.solution[static_cast<Eigen::Index>(c)];
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
    samples.push_back({along.values[static_cast<std::size_t>(row)], (sum.de + sum.df) / sum.dd, sum.df / sum.dd, sum.dd});
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
    const std::size_t from = distinct.size() <= 24 ? 0 : b * samples.size() / bins, to = distinct.size() <= 24 ? samples.size() : (b + 1) * samples.size() / bins;
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

// --- words ---------------------------------------------------------------------------------------------------------------

std::string millimetres(double metres) { return number(1e3 * metres, 3) + " mm"; }

std::string at_joints(const std::vector<std::string>& joints) {
  if (joints.empty()) return "";
  if (joints.size() > 3) return " of " + std::to_string(joints.size()) + " links";
  return " at " + listed(joints);
}

std::string separated_by(const std::string& a, const std::string& b) {
  const auto pair_is = [&](const char* x, const char* y) { return (a == x && b == y) || (a == y && b == x); };
  const auto one_is = [&](const char* x) { return a == x || b == x; };
  if (one_is("backlash")) return "approach the same poses from both sides";
  if (pair_is("thermal", "drift") || pair_is("thermal_zero", "drift")) return "measure during warm-up and cool-down, or touch a fixed nest again and again";
  if (one_is("thermal") || one_is("thermal_zero")) return "measure at two temperatures";
  if (one_is("scale")) return "measure a scale bar of known length";
  if (one_is("drift")) return "measure fixed points again and again";
  if (pair_is("joint_compliance", "link_compliance")) return "put a target on the elbow, or measure orientations";
  if (one_is("joint_compliance") || one_is("link_compliance") || one_is("stiffness_zones") || one_is("gravity_backlash")) return "repeat the same poses with another payload";
  if (one_is("gear_ratio") || one_is("harmonic")) return "use the joint's full range, both turns";
  if (one_is("axis_wobble")) return "measure orientations as well";
  return "measure poses where the two differ: see the next poses";
}


// --- how sure ------------------------------------------------------------------------------------------------------------

/// What may stand in a named group's place.
struct Rival {
  int group = -1;
  double loss = 0.0;   ///< of score [nats]
  double r2 = 0.0;     ///< share of the named effect's motion of the tip that it can make
  bool in_class = false;
};

struct Sureness {
  std::vector<Rival> rivals;     ///< those in the class first, by loss
  double raw = 0.0;              ///< posterior of the class
  double removal_loss = 0.0;     ///< nats lost without it
};

bool same_name(const Explanation& a, const Explanation& b) { return a.effect == b.effect && a.joints == b.joints; }

/// link_geometry contains the same link's zero: a name for more of the same.
bool contains(const Explanation& large, const Explanation& small) {
  if (large.effect != "link_geometry") return false;
  if (small.effect != "joint_offset" && small.effect != "link_geometry") return false;
  return large.joints.size() > small.joints.size() || (small.effect == "joint_offset" && large.joints == small.joints);
}

Sureness how_sure(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t at) {
  constexpr double kTempered = 0.5;  // no model is exact: half a nat counts for one
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  const int g = state.choice.groups[at];
  const Evidence::State less = evidence.evaluate(without(state.choice, groups, at));
  Eigen::VectorXd theta(static_cast<Eigen::Index>(groups[static_cast<std::size_t>(g)].columns.size()));
  for (Eigen::Index k = 0; k < theta.size(); ++k) {
    const int column = groups[static_cast<std::size_t>(g)].columns[static_cast<std::size_t>(k)];
    const auto found = std::find(state.columns.begin(), state.columns.end(), column) - state.columns.begin();
    theta[k] = state.solution[static_cast<Eigen::Index>(found)];
  }
  Sureness out;
  out.removal_loss = state.score - less.score;
  double all = 1.0 + std::exp(-kTempered * std::max(0.0, out.removal_loss)), of_class = 1.0;
  const double gained = less.rss - state.rss;
  for (const Evidence::Gain& gain : evidence.gains(less)) {
    const Explanation& e = named[static_cast<std::size_t>(gain.group)];
    const ColumnGroup& group = groups[static_cast<std::size_t>(gain.group)];
    if (gain.group == g || group.parent_kind >= 0 || group.columns.empty() || e.kind == Kind::free) continue;
    if (same_name(e, named[static_cast<std::size_t>(g)]) || contains(e, named[static_cast<std::size_t>(g)]) || e.kind == Kind::drift) continue;
    if (std::find(less.choice.groups.begin(), less.choice.groups.end(), gain.group) != less.choice.groups.end()) continue;
    Rival rival;
    rival.group = gain.group;
    rival.loss = state.score - less.score - gain.score;
    const std::string& mine = named[static_cast<std::size_t>(g)].effect;
    const bool any_geometry = e.kind == Kind::all_geometry;
    if (gain.squares > 0.5 * gained || (any_geometry && (mine == "scale" || mine == "thermal"))) {
      rival.r2 = evidence.explained(less, groups[static_cast<std::size_t>(g)].columns, theta, group.columns);
      // Or the other way round: a plainer one that this one contains, and that closes nearly as much.
      if (group.columns.size() == 1 && gain.squares > 0.8 * gained) {
        rival.r2 = std::max(rival.r2, evidence.explained(less, group.columns, Eigen::VectorXd::Ones(1), groups[static_cast<std::size_t>(g)].columns));
      }
    }
    // What can make the same motion is named with it, even where the last per cents speak for one of them: no law is that exact.
    const bool comparable = any_geometry ? mine == "scale" || mine == "thermal" : gain.rank <= 8;
    rival.in_class = rival.loss < kClassNats || (rival.r2 > kClassR2 && comparable);
    const double weight = group.shadow ? 0.0 : std::exp(-kTempered * std::max(0.0, rival.loss));
    all += weight;
    if (rival.in_class) of_class += weight;
    if (rival.in_class || weight > 1e-3) out.rivals.push_back(rival);
  }
  out.raw = of_class / all;
  std::sort(out.rivals.begin(), out.rivals.end(), [](const Rival& a, const Rival& b) { return a.in_class != b.in_class ? a.in_class : a.loss < b.loss; });
  return out;
}

/// The selection repeated on resampled poses: which groups come back, and how far the held-out error shrinks each time.
struct Resampled {
  std::vector<std::vector<int>> chosen;
  std::vector<double> shrink;                         ///< of the held-out rms, all groups
  std::map<int, std::vector<double>> shrink_of;       ///< by group of the decision: against all others
};

Resampled resample(const Work& work, const Decision& decision, const SearchOptions& search) {
  constexpr int kSelections = 10;
  Resampled out;
  Random random(work.options.seed + 7);
  const auto& groups = work.design.candidates.groups;
  const auto drawn = [&](const std::vector<Gram>& folds) {
    std::vector<double> times(folds.size(), 0.0);
    for (std::size_t k = 0; k < folds.size(); ++k) times[random.below(folds.size())] += 1.0;
    Gram sum;
    for (std::size_t k = 0; k < folds.size(); ++k) {
      if (times[k] > 0.0) sum.add(folds[k], times[k]);
    }
    return sum;
  };
  SearchOptions quick = search;
  quick.beam = 1;
  const Shortlist list = shortlist(work, decision.state.choice.groups);
  std::vector<Gram> short_folds;
  for (const Gram& fold : work.fold) short_folds.push_back(fold.of(list.columns));
  for (int r = 0; r < std::min(kSelections, work.options.resamples); ++r) {
    const Gram train = drawn(short_folds);
    out.chosen.emplace_back();
    for (const int g : Evidence(train, list.groups, list.nuisance, list.prior).search(quick).choice.groups) {
      out.chosen.back().push_back(list.which[static_cast<std::size_t>(g)]);
    }
  }
  // How far the error shrinks takes the chosen columns only.
  const std::vector<int>& columns = decision.state.columns;
  std::vector<ColumnGroup> few;
  std::vector<int> nuisance(work.design.nuisance.size());
  std::iota(nuisance.begin(), nuisance.end(), 0);
  Choice choice;
  int next = static_cast<int>(nuisance.size());
  for (std::size_t k = 0; k < decision.state.choice.groups.size(); ++k) {
    ColumnGroup group = groups[static_cast<std::size_t>(decision.state.choice.groups[k])];
    for (int& column : group.columns) column = next++;
    few.push_back(group);
    choice.groups.push_back(static_cast<int>(k));
    choice.scales.push_back(decision.state.choice.scales[k]);
  }
  std::vector<Gram> train_folds, test_folds;
  for (const Gram& fold : work.fold) train_folds.push_back(fold.of(columns));
  for (const Gram& fold : work.test_fold) test_folds.push_back(fold.of(columns));
  Eigen::VectorXd prior(static_cast<Eigen::Index>(columns.size()));
  for (Eigen::Index k = 0; k < prior.size(); ++k) prior[k] = work.design.prior[columns[static_cast<std::size_t>(k)]];
  for (int r = 0; r < work.options.resamples; ++r) {
    const Gram train = drawn(train_folds), test = drawn(test_folds);
    if (!(test.n > 0.0)) break;
    const Evidence evidence(train, few, nuisance, prior);
    const Evidence::State refitted = evidence.evaluate(choice), nothing = evidence.evaluate({});
    const double before = std::max(held_out_squares(test, nothing.columns, nothing.solution), 1e-300);
    const double after = std::max(0.0, held_out_squares(test, refitted.columns, refitted.solution));
    out.shrink.push_back(1.0 - std::sqrt(after / before));
    for (std::size_t at = 0; at < choice.groups.size(); ++at) {
      const Evidence::State less = evidence.evaluate(without(choice, few, at));
      const double lesser = std::max(held_out_squares(test, less.columns, less.solution), 1e-300);
      out.shrink_of[decision.state.choice.groups[at]].push_back(1.0 - std::sqrt(after / lesser));
    }
  }
  return out;
}

/// How often the resampled selections hold the group or one of its class; one more success and one more trial stand for the data's own.
double came_back(const Work& work, const Resampled& resampled, const Sureness& sure, int group) {
  const auto& named = work.design.candidates.named;
  double back = 1.0, draws = 1.0;
  for (const std::vector<int>& chosen : resampled.chosen) {
    const bool found = std::any_of(chosen.begin(), chosen.end(), [&](int g) {
      const Explanation &other = named[static_cast<std::size_t>(g)], &mine = named[static_cast<std::size_t>(group)];
      if (same_name(other, mine) || contains(other, mine)) return true;
      return std::any_of(sure.rivals.begin(), sure.rivals.end(), [&](const Rival& r) { return r.in_class && r.group == g; });
    });
    back += found ? 1.0 : 0.0;
    draws += 1.0;
  }
  return back / draws;
}

/// Stated confidence from what it rests on: the posterior of the class, how often resampled poses bring it back, and what is lost
/// without it. Mapped so that it says how often such names were right on development sets of the examination (docs/exam.md).
double calibrated(double posterior, double came_back, double removal_loss) {
  const double score = 0.45 * posterior + 0.35 * came_back + 0.2 * std::min(removal_loss, 40.0) / 40.0;
  constexpr double kMap[6][2] = {{0.0, 0.05}, {0.5, 0.3}, {0.7, 0.64}, {0.9, 0.74}, {0.975, 0.8}, {0.998, 0.95}};
  for (int k = 1; k < 6; ++k) {
    if (score <= kMap[k][0]) return kMap[k - 1][1] + (score - kMap[k - 1][0]) / (kMap[k][0] - kMap[k - 1][0]) * (kMap[k][1] - kMap[k - 1][1]);
  }
  return kMap[5][1];
}

/// Noise from repeats: rows of one target at equal joints, directions and payload. Degrees of freedom in `freedom`.
double repeat_sigma(const Measurements& data, double* freedom) {
  std::map<std::vector<double>, std::vector<std::size_t>> same;
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (!data.has_position(row) && !data.has_distance(row)) continue;
    std::vector<double> key;
    for (const Column& column : data.joints) key.push_back(column[row]);
    for (const Column& column : data.direction) key.push_back(column ? column[row] : 0.0);
    key.push_back(data.payload ? data.payload[row] : 0.0);
    key.push_back(data.target.empty() ? 0.0 : data.target[row]);
    same[std::move(key)].push_back(row);
  }
  std::vector<double> squares;  // of pairs' differences, per component
  *freedom = 0.0;
  double sum = 0.0;
  for (const auto& [key, rows] : same) {
    if (rows.size() < 2) continue;
    const bool distance = data.has_distance(rows[0]);
    const int components = distance ? 1 : 3;
    for (int c = 0; c < components; ++c) {
      double mean = 0.0, s = 0.0;
      const auto value = [&](std::size_t row) { return distance ? data.distance[row] : data.position[static_cast<std::size_t>(c)][row]; };
      for (const std::size_t row : rows) mean += value(row) / static_cast<double>(rows.size());
      for (const std::size_t row : rows) s += (value(row) - mean) * (value(row) - mean);
      sum += s;
      *freedom += static_cast<double>(rows.size()) - 1.0;
    }
  }
  return *freedom > 0.0 ? std::sqrt(sum / *freedom) : 0.0;
}

std::vector<std::int32_t> thinned_rows(const Measurements& data, const std::vector<std::int32_t>& cluster, std::size_t most) {
  const std::size_t clusters = cluster.empty() ? 0 : static_cast<std::size_t>(*std::max_element(cluster.begin(), cluster.end())) + 1;
  std::vector<std::int32_t> rows;
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (data.weight && data.weight[row] == 0.0) continue;
    // Evenly in order of appearance: of n clusters, `most`.
    const auto c = static_cast<std::size_t>(cluster[row]);
    if (clusters > most && c * most / clusters == (c + 1) * most / clusters) continue;
    rows.push_back(static_cast<std::int32_t>(row));
  }
  return rows;
}

/// The rows as data of their own, so that nothing is computed for the others.
struct Subset {
  std::vector<std::vector<double>> columns;
};

Measurements subset_of(const Measurements& data, const std::vector<std::int32_t>& rows) {
  auto owned = std::make_shared<Subset>();
  Measurements out;
  out.rows = rows.size();
  std::vector<std::pair<Column*, std::size_t>> to_set;
  const auto take = [&](const Column& from, Column* to) {
    if (!from) return;
    std::vector<double> values(rows.size());
    for (std::size_t k = 0; k < rows.size(); ++k) values[k] = from[static_cast<std::size_t>(rows[k])];
    owned->columns.push_back(std::move(values));
    *to = {owned->columns.back().data(), 1};  // a vector keeps its memory when it is moved
  };
  const auto take_all = [&](const std::vector<Column>& from, std::vector<Column>* to) {
    to->resize(from.size());
    for (std::size_t k = 0; k < from.size(); ++k) take(from[k], &(*to)[k]);
  };
  take_all(data.joints, &out.joints);
  take_all(data.direction, &out.direction);
  take_all(data.joint_speed, &out.joint_speed);
  for (std::size_t k = 0; k < 3; ++k) take(data.position[k], &out.position[k]);
  for (std::size_t k = 0; k < 4; ++k) take(data.orientation[k], &out.orientation[k]);
  take(data.distance, &out.distance);
  take(data.payload, &out.payload);
  take(data.temperature, &out.temperature);
  take(data.time, &out.time);
  take(data.position_sigma, &out.position_sigma);
  take(data.rotation_sigma, &out.rotation_sigma);
  take(data.weight, &out.weight);
  for (const auto& [name, column] : data.covariates) take(column, &out.covariates[name]);
  out.fixed_point_names = data.fixed_point_names;
  for (const std::int32_t row : rows) {
    const auto r = static_cast<std::size_t>(row);
    if (!data.fixed_point.empty()) out.fixed_point.push_back(data.fixed_point[r]);
    if (!data.target.empty()) out.target.push_back(data.target[r]);
    if (!data.set.empty()) out.set.push_back(data.set[r]);
  }
  out.owner = owned;
  return out;
}

/// Own effects may look values up by row: of the whole data, not of the subset.
std::vector<Effect> mapped(const std::vector<Effect>& own, const Measurements& whole, const std::vector<std::int32_t>& rows) {
  std::vector<Effect> out = own;
  for (Effect& effect : out) {
    effect.terms = [terms = effect.terms, &whole, &rows](const Robot& robot, std::size_t joint, const Measurements&) {
      std::vector<Term> made = terms(robot, joint, whole);
      for (Term& term : made) {
        term.basis = [basis = term.basis, &whole, &rows](const Inputs& in) {
          Inputs of_whole = in;
          of_whole.data = &whole;
          of_whole.row = static_cast<std::size_t>(rows[in.row]);
          return basis(of_whole);
        };
      }
      return made;
    };
  }
  return out;
}

}  // namespace
}  // namespace detail

bool DiagnoseOptions::is_valid(std::string* error) const {
  const auto fail = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(false_alarm > 0.0 && false_alarm < 0.5)) return fail("false_alarm must be in (0, 0.5)");
  if (max_effects < 1) return fail("max_effects must be at least 1");
  if (!(test_share > 0.0 && test_share < 0.9)) return fail("test_share must be in (0, 0.9)");
  if (search_poses < 50) return fail("search_poses must be at least 50");
  if (resamples < 0) return fail("resamples must not be negative");
  if (!(rotation_length > 0.0)) return fail("rotation_length must be positive [m]");
  return true;
}

namespace detail {
namespace {

/// What the user reads of one group.
FoundEffect describe(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at, const Sureness& sure, double probability,
                     const Identification& refitted, const Resampled& resampled) {
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  const int g = decision.state.choice.groups[at];
  const Explanation& e = named[static_cast<std::size_t>(g)];
  FoundEffect out;
  out.effect = e.effect.substr(0, e.effect.find('@')) == "transmission_error" ? e.effect : e.effect;
  out.joints = e.joints;
  out.note = e.note;
  out.probability = probability;
  for (const Parameter& parameter : refitted.parameters) {
    if (std::find(e.parameters.begin(), e.parameters.end(), parameter.name) == e.parameters.end()) continue;
    if (e.kind == Kind::drift) continue;  // a curve, not numbers
    out.parameters.push_back(parameter);
  }
  if (out.parameters.empty() && e.kind == Kind::catalogue) {  // found by the search
    for (const std::string& name : e.parameters) {
      const int column = work.design.column(name);
      const auto k = std::find(decision.state.columns.begin(), decision.state.columns.end(), column) - decision.state.columns.begin();
      if (column < 0 || k >= static_cast<std::ptrdiff_t>(decision.state.columns.size())) continue;
      const Eigen::VectorXd unit = Eigen::VectorXd::Unit(decision.state.solution.size(), static_cast<Eigen::Index>(k));
      const double variance = decision.state.sigma2 * unit.dot(decision.state.factor.solve(unit));
      out.parameters.push_back({name, 0.0, decision.state.solution[static_cast<Eigen::Index>(k)], std::sqrt(std::max(variance, 0.0)), work.design.column_units[static_cast<std::size_t>(column)], false});
    }
  }
  const Evidence::State less = evidence.evaluate(without(decision.state.choice, groups, at));
  out.held_out_before = error_statistics(held_out_lengths(work.design, less));
  out.held_out_after = error_statistics(held_out_lengths(work.design, decision.state));
  const double shrink = out.held_out_before.rms > 0.0 ? 1.0 - out.held_out_after.rms / out.held_out_before.rms : 0.0;
  const auto spread = resampled.shrink_of.find(g);
  out.shrink = percentile_interval(spread == resampled.shrink_of.end() ? std::vector<double>{} : spread->second, shrink);
  const Evidence::State nothing = evidence.evaluate({});
  Choice only;
  only.groups = {g};
  only.scales = {decision.state.choice.scales[at]};
  const double gap = held_out_squares(work.test, nothing.columns, nothing.solution);
  if (gap > 0.0) {
    const Evidence::State alone = evidence.evaluate(only);
    out.share_alone = std::max(0.0, 1.0 - held_out_squares(work.test, alone.columns, alone.solution) / gap);
    out.share_last = std::max(0.0, (held_out_squares(work.test, less.columns, less.solution) - held_out_squares(work.test, decision.state.columns, decision.state.solution)) / gap);
  }
  std::set<std::pair<std::string, std::vector<std::string>>> listed_already;
  double rest = 0.0;
  for (const Rival& rival : sure.rivals) rest += rival.in_class ? std::exp(-0.5 * std::max(0.0, rival.loss)) : 0.0;
  for (const Rival& rival : sure.rivals) {
    const Explanation& other = named[static_cast<std::size_t>(rival.group)];
    if (!rival.in_class || !listed_already.insert({other.effect, other.joints}).second) continue;
    out.confounded_with.push_back({other.effect, other.joints, probability * std::exp(-0.5 * std::max(0.0, rival.loss)) / (1.0 + rest), separated_by(e.effect, other.effect)});
    if (out.confounded_with.size() >= 8) break;
  }
  // What was not recorded may do the same.
  static const std::map<std::string, std::vector<std::string>> mimics = {
      {"backlash", {"windup", "time_offset"}}, {"drift", {"thermal", "thermal_zero"}}, {"thermal", {"drift"}}, {"thermal_zero", {"drift"}}, {"joint_compliance", {"windup"}},
      {"stiffness_zones", {"windup"}}, {"gravity_backlash", {"windup"}}};
  const auto mimic = mimics.find(e.effect);
  for (std::size_t k = 0; mimic != mimics.end() && k < mimic->second.size(); ++k) {
    const auto untested = std::find_if(work.design.candidates.not_testable.begin(), work.design.candidates.not_testable.end(),
                                       [&](const NotTestable& n) { return n.effect == mimic->second[k] && n.why.find("column") != std::string::npos; });
    if (untested == work.design.candidates.not_testable.end()) continue;
    const bool whole_robot = mimic->second[k] == "time_offset" || mimic->second[k] == "drift";
    out.confounded_with.push_back({mimic->second[k], whole_robot ? std::vector<std::string>{} : e.joints, 0.0, "record what it needs: " + untested->why});
  }
  // The law, drawn.
  for (const int other : decision.state.choice.groups) {
    const auto corrected = decision.corrects.find(other);
    if (corrected == decision.corrects.end() || corrected->second != g) continue;
    const Explanation& correction = named[static_cast<std::size_t>(other)];
    const std::string driver = work.inputs[static_cast<std::size_t>(correction.inputs[0])].name;
    out.note += (out.note.empty() ? "" : "; ") + std::string("its law is not the simple one: see the curve over ") + driver;
    const int input = input_named(work, driver);
    if (input >= 0 && !e.joints.empty()) {
      const auto joint = static_cast<std::size_t>(std::find_if(work.frames.robot.joints.begin(), work.frames.robot.joints.end(), [&](const Joint& j) { return j.name == e.joints[0]; }) - work.frames.robot.joints.begin());
      out.curves.push_back(curve_of(work, decision.state, decision.corrects, g, input, work.design.joint_column[joint][0], 0, 0, -1));
    }
  }
  const int driver = input_named(work, e.driver);
  if (driver >= 0 && e.kind == Kind::catalogue && e.joints.size() == 1 && e.effect != "axis_wobble" && e.effect != "thermal" && e.effect != "link_compliance") {
    const auto joint = static_cast<std::size_t>(std::find_if(work.frames.robot.joints.begin(), work.frames.robot.joints.end(), [&](const Joint& j) { return j.name == e.joints[0]; }) - work.frames.robot.joints.begin());
    const bool drawn = std::any_of(out.curves.begin(), out.curves.end(), [&](const Curve& c) { return c.input == e.driver; });
    if (!drawn) out.curves.push_back(curve_of(work, decision.state, decision.corrects, g, driver, work.design.joint_column[joint][0], 0, 0, -1));
  }
  if (e.effect == "drift" && driver >= 0) {
    for (std::size_t c = 0; c < 3 && c < work.design.base_columns.size(); ++c) {
      Curve curve = curve_of(work, decision.state, decision.corrects, g, driver, work.design.base_columns[c], 0, 0, -1);
      out.curves.push_back(std::move(curve));
    }
  }
  return out;
}

UnknownEffect describe_unknown(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at, const Resampled& resampled) {
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
  out.shrink = percentile_interval(spread == resampled.shrink_of.end() ? std::vector<double>{} : spread->second, shrink);
  const double gap = held_out_squares(work.test, evidence.evaluate({}).columns, evidence.evaluate({}).solution);
  if (gap > 0.0) {
    out.share = std::max(0.0, held_out_squares(work.test, less.columns, less.solution) - held_out_squares(work.test, decision.state.columns, decision.state.solution)) / gap;
  }
  const double loss = decision.state.score - less.score;
  out.probability = std::clamp(0.5 + 0.49 * std::min(1.0, loss / 30.0), 0.0, 0.99);
  std::vector<int> sites = work.design.base_columns;
  if (e.site != "base") {
    const auto joint = static_cast<std::size_t>(std::find_if(work.frames.robot.joints.begin(), work.frames.robot.joints.end(), [&](const Joint& j) { return j.name == e.site; }) - work.frames.robot.joints.begin());
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
      Curve curve = curve_of(work, decision.state, decision.corrects, g, e.inputs[0], site, edges[k], edges[k + 1], e.inputs[1]);
      if (!curve.points.empty()) out.curves.push_back(std::move(curve));
    }
  }
  if (!out.curves.empty() && e.inputs.size() == 1 && e.site != "base") out.looks_like = shape_of(out.curves[0]);
  if (e.inputs.size() == 2) out.looks_like = "depends on both " + out.inputs[0] + " and " + out.inputs[1];
  if (e.site == "base") out.looks_like = "the base moves as a function of " + out.inputs[0];
  return out;
}

std::vector<Candidate> list_candidates(const Work& work, const Evidence& evidence, const std::vector<Evidence::Gain>& first) {
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
    if (groups[g].parent_kind >= 0 || named[g].kind == Kind::law) continue;
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
      const bool mine = std::find(groups[g].columns.begin(), groups[g].columns.end(), all.columns[k]) != groups[g].columns.end();
      if (mine) c.largest_z = std::max(c.largest_z, std::abs(all.solution[static_cast<Eigen::Index>(k)]) / sigma[static_cast<Eigen::Index>(k)]);
    }
    out.push_back(std::move(c));
  }
  return out;
}

/// The smallest size of every effect's first parameter that would have passed the threshold, beside what was named.
std::vector<Detectable> smallest_sizes(const Work& work, const Evidence& evidence, const Evidence::State& state, double threshold) {
  const auto& groups = work.design.candidates.groups;
  const auto& named = work.design.candidates.named;
  std::vector<Detectable> out;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const Explanation& e = named[g];
    if (e.kind != Kind::catalogue || groups[g].columns.empty() || groups[g].shadow || e.effect.rfind("transmission_error", 0) == 0) continue;
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
    out.push_back({e.effect, e.joints.empty() ? "" : e.joints[0], work.design.column_names[static_cast<std::size_t>(column)], work.design.column_units[static_cast<std::size_t>(column)], 0.0, 0.0});
    const double a = evidence.visible(state, column);
    if (!(a > 1e-6 * evidence.gram().xx(column, column))) {
      out.pop_back();
      continue;
    }
    const double nats = threshold + groups[g].cost + 0.5 * static_cast<double>(groups[g].columns.size()) * std::log(1.0 + evidence.gram().n);
    out.back().size = std::sqrt(2.0 * nats * state.sigma2 / a);
    out.back().size_at_tip = out.back().size * std::sqrt(3.0 * a / std::max(1.0, evidence.gram().n)) * work.position_sigma;
  }
  std::stable_sort(out.begin(), out.end(), [](const Detectable& a, const Detectable& b) { return a.effect != b.effect ? a.effect < b.effect : a.size_at_tip < b.size_at_tip; });
  return out;
}

/// For the first named effect that something else could stand for: the poses that would tell.
void add_next_poses(const Work& work, const Measurements& data, const DiagnoseOptions& options, const Decision& decision, Diagnosis* out) {
  for (const FoundEffect& effect : out->effects) {
    for (const Alternative& other : effect.confounded_with) {
      const auto request_of = [&](const std::string& name, const std::vector<std::string>& joints) -> const Explanation* {
        for (const Explanation& e : work.design.candidates.named) {
          if (e.kind == Kind::catalogue && e.effect == name && e.joints == joints) return &e;
        }
        return nullptr;
      };
      const Explanation *first = request_of(effect.effect, effect.joints), *second = request_of(other.effect, other.joints);
      if (!first || !second) continue;
      Rivals rivals;
      rivals.name = effect.effect + at_joints(effect.joints);
      rivals.other_name = other.effect + at_joints(other.joints);
      rivals.first = {first->parameters, first->requests};
      rivals.other = {second->parameters, second->requests};
      for (const Parameter& parameter : effect.parameters) rivals.parameters[parameter.name] = parameter.value - parameter.nominal;
      out->next_poses = next_poses(work.linear.at, data, rivals, options, 6, work.position_sigma * std::sqrt(decision.state.sigma2));
      if (!out->next_poses.empty()) return;
    }
  }
}

std::string sentence_of(const Diagnosis& d) {
  const std::string gap = millimetres(d.gap.rms);
  std::string text;
  if (d.verdict == Verdict::none) {
    text = "No gap beyond noise: " + gap + " rms on held-out poses, of which noise is " + millimetres(d.noise_floor) + ".";
    if (!d.detectable.empty()) {
      const auto easiest = std::min_element(d.detectable.begin(), d.detectable.end(), [](const Detectable& a, const Detectable& b) { return (a.effect == "backlash" ? 0.0 : 1.0) + a.size_at_tip < (b.effect == "backlash" ? 0.0 : 1.0) + b.size_at_tip; });
      const bool angle = easiest->unit == "rad";
      text += " A " + easiest->effect + (easiest->joint.empty() ? "" : " at " + easiest->joint) + " above " + number(angle ? 1e3 * easiest->size : easiest->size, 2) + (angle ? " mrad" : " " + easiest->unit) + " would have shown.";
    }
    return text;
  }
  if (!d.effects.empty()) {
    text = "The gap of " + gap + " shrinks to " + millimetres(d.after.rms) + ": ";
    for (std::size_t k = 0; k < d.effects.size() && k < 4; ++k) {
      text += (k == 0 ? "" : k + 1 == std::min<std::size_t>(d.effects.size(), 4) ? " and " : ", ") + d.effects[k].effect + at_joints(d.effects[k].joints);
      if (!d.effects[k].confounded_with.empty() && d.effects[k].confounded_with[0].probability > 0.0) {
        text += " (or " + d.effects[k].confounded_with[0].effect + at_joints(d.effects[k].confounded_with[0].joints) + ": these data cannot tell)";
      }
    }
    if (d.effects.size() > 4) text += " and " + std::to_string(d.effects.size() - 4) + " more";
    text += ".";
  } else {
    text = "There is a gap of " + gap + " that no effect of the catalogue explains.";
  }
  if (!d.unknown.empty()) {
    const UnknownEffect& u = d.unknown[0];
    text += " Unknown: " + (u.joint.empty() ? std::string("something") : u.joint) + " moves as a function of " + (u.inputs.size() == 2 ? u.inputs[0] + " and " + u.inputs[1] : u.inputs[0] == "order" ? std::string("the order of the rows") : listed(u.inputs)) +
            (u.looks_like.empty() || u.inputs.size() == 2 || u.joint == "base" ? "" : " (" + u.looks_like + ")") + ".";
  }
  return text;
}

}  // namespace
}  // namespace detail

Diagnosis diagnose(const Robot& robot, const Measurements& given, const DiagnoseOptions& options) {
  using namespace detail;
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("diagnose: " + error);
  validate(robot);
  validate(given, robot);
  bool measured = false;
  for (std::size_t row = 0; row < given.rows && !measured; ++row) measured = !given.has_fixed_point(row) && (given.has_position(row) || given.has_distance(row));
  if (!measured) throw std::invalid_argument("diagnose needs measured positions, poses or distances: touched fixed points alone show no scale, and are for identify");
  for (const std::string& name : options.leave_out) find_effect(name, options.own_effects);

  // 0. Sanity, before statistics.
  Checked checked = check(robot, given, options);
  Diagnosis result;
  result.seed = options.seed;
  result.sanity = checked.findings;
  result.joint_record = checked.joint_record;
  const Measurements& data = checked.data;

  // 1. Register: base and targets are always unknown.
  IdentifyOptions frames_only;
  frames_only.test_share = options.test_share;
  frames_only.seed = options.seed;
  frames_only.threads = options.threads;
  frames_only.rotation_length = options.rotation_length;
  frames_only.own_effects = options.own_effects;
  for (const Target& target : robot.targets) frames_only.free.push_back(target.name + ".*");
  if (frames_only.free.empty()) frames_only.free = {"tool.*"};
  Identification frames = identify(robot, data, frames_only);
  if (!frames.test) throw std::invalid_argument("diagnose needs held-out poses: no row is in the set 'test'");
  result.set = frames.set;
  result.robot_before = frames.robot;

  // The rows that are searched: all, or evenly some of very many.
  const std::vector<std::int32_t> all_clusters = pose_groups(data);
  const std::vector<std::int32_t> rows = thinned_rows(data, all_clusters, options.search_poses);
  const bool thinned = rows.size() < data.rows;
  if (thinned) result.warnings.push_back("searched on " + std::to_string(rows.size()) + " of " + std::to_string(data.rows) + " rows; fitted and judged on all");
  DiagnoseOptions search_options_ = options;
  Work work{search_options_, data, all_clusters, {}, frames, {}, {}, 1.0, {}, 0.0, {}, {}, {}, {}, checked.inferred_direction};
  std::vector<std::int8_t> set = frames.set;
  if (thinned) {
    work.data = subset_of(data, rows);
    search_options_.own_effects = mapped(options.own_effects, data, rows);
    work.cluster.clear();
    set.clear();
    for (const std::int32_t row : rows) {
      work.cluster.push_back(all_clusters[static_cast<std::size_t>(row)]);
      set.push_back(frames.set[static_cast<std::size_t>(row)]);
    }
  }
  std::vector<std::int32_t> train_rows, searched(work.data.rows);
  std::iota(searched.begin(), searched.end(), 0);
  for (const std::int32_t row : searched) {
    if (!set[static_cast<std::size_t>(row)]) train_rows.push_back(row);
  }

  // 2. Linearise once, where the geometry is about right; weigh; Gram matrices by fold.
  work.linear = linearise(frames.robot, work.data, train_rows, options.rotation_length, options.threads);
  work.inputs = make_inputs(work.linear.at, work.data);
  work.design = make_design({frames.robot, work.linear.at, work.linear.shift, work.data, work.inputs, searched, set, work.cluster, search_options_, checked.inferred_direction});
  for (const NotTestable& n : work.design.candidates.not_testable) {
    const bool twice = std::any_of(result.not_testable.begin(), result.not_testable.end(), [&](const NotTestable& other) { return other.effect == n.effect && other.joints == n.joints; });
    if (!twice) result.not_testable.push_back(n);
  }
  weigh(&work);
  make_grams(&work);

  for (const std::int32_t row : work.outliers) result.outliers.push_back(static_cast<std::size_t>(thinned ? rows[static_cast<std::size_t>(row)] : row));
  std::sort(result.outliers.begin(), result.outliers.end());
  result.outliers.erase(std::unique(result.outliers.begin(), result.outliers.end()), result.outliers.end());
  if (!result.outliers.empty()) {
    result.sanity.push_back({"outliers", std::to_string(result.outliers.size()) + " rows stand so far out that they count for little: look at them first if they are many.",
                             result.outliers.size() <= 50 ? result.outliers : std::vector<std::size_t>{}});
  }

  // 3. to 6. What explains it.
  Decision decision = decide(&work, robot);
  const Evidence evidence(work.train, work.design.candidates.groups, work.design.nuisance, work.design.prior);
  const SearchOptions search = search_options(options);
  const Resampled resampled = resample(work, decision, search);
  result.p_gap = decision.p_gap;
  result.remaining_structure_p = decision.p_left;

  // A name is given to what is more likely right than wrong.
  std::map<int, std::pair<Sureness, double>> sureness;
  for (bool dropped = true; dropped;) {
    dropped = false;
    sureness.clear();
    for (std::size_t at = 0; at < decision.state.choice.groups.size(); ++at) {
      const int g = decision.state.choice.groups[at];
      if (!is_named(work.design.candidates.named[static_cast<std::size_t>(g)])) continue;
      const Sureness sure = how_sure(work, evidence, decision.state, at);
      sureness[g] = {sure, calibrated(sure.raw, came_back(work, resampled, sure, g), sure.removal_loss)};
    }
    const auto least = std::min_element(sureness.begin(), sureness.end(), [](const auto& a, const auto& b) { return a.second.second < b.second.second; });
    if (least == sureness.end() || least->second.second >= 0.5) break;
    const auto at = std::find(decision.state.choice.groups.begin(), decision.state.choice.groups.end(), least->first) - decision.state.choice.groups.begin();
    decision.state = evidence.evaluate(without(decision.state.choice, work.design.candidates.groups, static_cast<std::size_t>(at)));
    for (auto& [correction, corrected] : decision.corrects) corrected = corrected == least->first ? -1 : corrected;
    dropped = true;
  }

  // 7. How far: the exact refit, on all rows.
  std::vector<int> named_groups, catalogue_groups, every_group = decision.state.choice.groups;
  for (const int g : every_group) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(g)];
    const auto corrects = decision.corrects.find(g);
    if (e.kind != Kind::free || (corrects != decision.corrects.end() && corrects->second >= 0)) named_groups.push_back(g);
    if (e.kind == Kind::catalogue || e.kind == Kind::all_geometry) catalogue_groups.push_back(g);
  }
  Work whole{options, data, all_clusters, {}, frames, {}, {}, 1.0, {}, 0.0, {}, {}, {}, {}, checked.inferred_direction};
  whole.design.candidates = work.design.candidates;
  whole.design.column_names = work.design.column_names;
  whole.design.prior = work.design.prior;
  const bool needs_inputs = catalogue_groups.size() < every_group.size();
  if (needs_inputs) whole.inputs = thinned ? make_inputs(work.linear.at, data) : work.inputs;
  const Refit by_catalogue = refit(whole, robot, decision.state, catalogue_groups);
  const Refit by_named = named_groups.size() > catalogue_groups.size() ? refit(whole, robot, decision.state, named_groups) : by_catalogue;
  const Refit by_all = every_group.size() > named_groups.size() ? refit(whole, robot, decision.state, every_group) : by_named;
  result.robot = by_catalogue.found.robot;
  result.residuals_before = residuals(frames.robot, data, options.own_effects, options.threads);
  result.residuals_after = residuals(by_named.found.robot, data, by_named.own, options.threads);
  const Residuals after_all = residuals(by_all.found.robot, data, by_all.own, options.threads);
  result.error_before = lengths_of(result.residuals_before, data.rows);
  result.error_after = lengths_of(result.residuals_after, data.rows);
  result.gap = error_statistics(held_out(result.error_before, result.set));
  result.after = error_statistics(held_out(result.error_after, result.set));
  result.after_unknown = error_statistics(held_out(lengths_of(after_all, data.rows), result.set));
  const double by_robot = error_statistics(held_out(lengths_of(residuals(result.robot, data, options.own_effects, options.threads), data.rows), result.set)).rms;
  if (!catalogue_groups.empty()) result.shrink = percentile_interval(resampled.shrink, result.gap.rms > 0.0 ? 1.0 - by_robot / result.gap.rms : 0.0);

  // Noise: from repeats, else what the chosen model leaves.
  double freedom = 0.0;
  const double repeats = repeat_sigma(data, &freedom);
  const double components = data.distance ? 1.0 : 3.0;
  result.noise_from_repeats = freedom >= 20.0;
  result.noise_floor = std::sqrt(components) * (result.noise_from_repeats ? repeats : work.position_sigma * std::sqrt(decision.state.sigma2));
  const double gap2 = std::pow(result.gap.rms, 2.0), floor2 = std::pow(result.noise_floor, 2.0), after2 = std::pow(result.after.rms, 2.0);
  result.closable = gap2 > floor2 ? std::clamp((gap2 - after2) / (gap2 - floor2), 0.0, 1.0) : 0.0;

  for (std::size_t at = 0; at < every_group.size(); ++at) {
    const Explanation& e = work.design.candidates.named[static_cast<std::size_t>(every_group[at])];
    const auto corrects = decision.corrects.find(every_group[at]);
    const bool correction = corrects != decision.corrects.end() && corrects->second >= 0;
    if (e.kind == Kind::free || e.kind == Kind::law) {
      UnknownEffect unknown = describe_unknown(work, evidence, decision, at, resampled);
      // A small correction of a law is a remark; a large one is something that nobody has named.
      if (!correction || unknown.share > kCorrectionShare) result.unknown.push_back(std::move(unknown));
    } else {
      const auto& [sure, probability] = sureness[every_group[at]];
      result.effects.push_back(describe(work, evidence, decision, at, sure, probability, by_all.found, resampled));
    }
  }
  // A drift made of several terms is one effect.
  for (std::size_t k = 0; k < result.effects.size(); ++k) {
    for (std::size_t m = result.effects.size(); m-- > k + 1;) {
      FoundEffect &first = result.effects[k], &second = result.effects[m];
      if (first.effect != second.effect || first.joints != second.joints) continue;
      first.probability = std::max(first.probability, second.probability);
      first.share_alone = std::max(first.share_alone, second.share_alone);
      first.share_last += second.share_last;
      first.parameters.insert(first.parameters.end(), second.parameters.begin(), second.parameters.end());
      if (first.curves.empty()) first.curves = second.curves;
      result.effects.erase(result.effects.begin() + static_cast<std::ptrdiff_t>(m));
    }
  }
  for (std::size_t k = 0; k < result.unknown.size(); ++k) {
    for (std::size_t m = result.unknown.size(); m-- > k + 1;) {
      if (result.unknown[k].joint != result.unknown[m].joint || result.unknown[k].inputs != result.unknown[m].inputs) continue;
      result.unknown[k].share += result.unknown[m].share;
      result.unknown.erase(result.unknown.begin() + static_cast<std::ptrdiff_t>(m));
    }
  }
  // Shares that add up: between alone and last, scaled to what all together close.
  const double closed = std::max(0.0, 1.0 - std::pow(result.gap.rms > 0.0 ? result.after_unknown.rms / result.gap.rms : 1.0, 2.0));
  double total = 0.0;
  for (const FoundEffect& effect : result.effects) total += 0.5 * (effect.share_alone + effect.share_last);
  for (const UnknownEffect& unknown : result.unknown) total += unknown.share;
  for (FoundEffect& effect : result.effects) effect.share = total > 0.0 ? closed * 0.5 * (effect.share_alone + effect.share_last) / total : 0.0;
  for (UnknownEffect& unknown : result.unknown) unknown.share = total > 0.0 ? closed * unknown.share / total : 0.0;
  std::stable_sort(result.effects.begin(), result.effects.end(), [](const FoundEffect& a, const FoundEffect& b) { return a.share > b.share; });
  std::stable_sort(result.unknown.begin(), result.unknown.end(), [](const UnknownEffect& a, const UnknownEffect& b) { return a.probability > b.probability; });

  result.verdict = result.effects.empty() ? (result.unknown.empty() ? Verdict::none : Verdict::unknown)
                                          : (result.unknown.empty() ? Verdict::effects : Verdict::effects_and_unknown);
  result.candidates = list_candidates(work, evidence, decision.first);
  result.detectable = smallest_sizes(work, evidence, decision.state, search.threshold);
  share_out(work.design, work.inputs, robot, work.deff, options.seed + 17, &result);
  map_workspace(frames.robot, data, result.residuals_before, &result);
  result.neighbour_share = neighbour_share(data, result.set, after_all, &result.neighbour_p95);
  if (checked.inferred_direction) {
    result.not_testable.push_back({"backlash", {}, "no columns dir1 …: only a direction inferred from the order of the rows could be tried"});
    for (const Column& column : data.direction) {
      result.directions.emplace_back();
      for (std::size_t row = 0; row < data.rows; ++row) result.directions.back().push_back(column[row]);
    }
  }
  add_next_poses(work, data, options, decision, &result);
  result.sentence = sentence_of(result);
  return result;
}

}  // namespace truing
