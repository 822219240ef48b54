// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dynamics/columns.hpp"
#include "dynamics/effects/families.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/physical.hpp"
#include "dynamics/turn.hpp"
#include "math/batch.hpp"
#include "math/linear_algebra.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kBlocks = 10;                ///< of time, where recordings cannot be the folds
constexpr double kSlowRows = 0.5;          ///< [s] between rows: nobody records motion so rarely
constexpr std::size_t kFewRecordings = 4;  ///< fewer unmarked ones are parted into blocks of time

double length_of(const Recording& recording) {
  return (recording.read ? recording.end : recording.time[recording.time.size() - 1]) - recording.time[0];
}

/// Evenly spread: number k of a row is held out when k times the fraction passes a whole number.
bool is_held_out(double k, double test_share) {
  return std::floor((k + 1.0) * test_share + 0.5) > std::floor(k * test_share + 0.5);
}

/// Blocks of time as folds: some of them are held out.
void split_by_blocks(const std::vector<Recording>& recordings, double test_share, Problem* problem) {
  problem->single = true;
  double longest = 0.0;
  for (const Recording& recording : recordings) longest = std::max(longest, length_of(recording));
  Folds train, test;
  train.block_length = test.block_length = longest / kBlocks * (1.0 + 1e-9);
  train.of_recording.assign(recordings.size(), 0);
  test.of_recording.assign(recordings.size(), 0);
  for (int b = 0; b < kBlocks; ++b) {
    const bool held = is_held_out(b, test_share);
    train.of_block.push_back(held ? -1 : train.count++);
    test.of_block.push_back(held ? test.count++ : -1);
  }
  problem->train = train;
  problem->test = test;
  problem->held_out = {"blocks of time"};
}

void split(const std::vector<Recording>& recordings, double test_share, Problem* problem) {
  std::vector<bool> held(recordings.size());
  for (std::size_t r = 0; r < recordings.size(); ++r) held[r] = recordings[r].test;
  const auto tests = std::count(held.begin(), held.end(), true);
  if (tests == static_cast<std::ptrdiff_t>(held.size()))
    throw std::invalid_argument("all recordings are marked as test (column set): none is left to be fitted");
  if (tests == 0) {
    if (recordings.size() < kFewRecordings) return split_by_blocks(recordings, test_share, problem);
    for (std::size_t r = 0; r < held.size(); ++r) held[r] = is_held_out(static_cast<double>(r), test_share);
    problem->warnings.push_back("no recording is marked as test (column set): " + math::number(100.0 * test_share, 2) +
                                " % of them were held out");
  }
  Folds train, test;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    train.of_recording.push_back(held[r] ? -1 : train.count++);
    test.of_recording.push_back(held[r] ? test.count++ : -1);
    if (held[r]) problem->held_out.push_back(recordings[r].name);
  }
  if (train.count < 3) {  // few long ones: blocks of theirs are the folds, and the marked ones are held out
    double longest = 0.0;
    for (std::size_t r = 0; r < recordings.size(); ++r)
      if (!held[r]) longest = std::max(longest, length_of(recordings[r]));
    for (int& of : train.of_recording) of = of < 0 ? -1 : 0;
    train.block_length = longest / kBlocks * (1.0 + 1e-9);
    for (int b = 0; b < kBlocks; ++b) train.of_block.push_back(b);
    train.count = kBlocks;
    problem->single = true;
  }
  problem->train = train;
  problem->test = test;
}

}  // namespace

void require_usable(const Robot& robot, const std::vector<Recording>& recordings) {
  if (recordings.empty()) throw std::invalid_argument("there are no recordings");
  bool any_mass = false;
  for (const Joint& joint : robot.joints) any_mass = any_mass || joint.mass.value_or(0.0) > 0.0;
  if (!any_mass) {
    throw std::invalid_argument(
        "no link of the robot has a mass: torques need mass, centre of mass and inertia of the links (URDF: "
        "<inertial>; robot.yaml: mass, com, inertia)");
  }
  for (const Recording& recording : recordings) {
    validate(recording, robot);
    if (recording.torque.cols() == 0 && recording.current.cols() == 0) {
      throw std::invalid_argument("recording '" + recording.name +
                                  "': no torques (tau1_Nm …) and no currents (i1_A …)" +
                                  (recording.command.cols() > 0 ? ", which commands alone are not" : ""));
    }
  }
}

std::vector<double> drive_constants(const Robot& robot, const std::vector<Recording>& recordings,
                                    std::vector<std::string>* warnings) {
  std::vector<double> out;
  std::vector<std::string> unknown;
  const auto by_current = [&](Index column) {
    return std::any_of(recordings.begin(), recordings.end(), [column](const Recording& r) {
      return r.current.cols() > 0 && (r.torque.cols() == 0 || std::isnan(r.torque(0, column)));
    });
  };
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (std::size_t k = 0; k < driven.size(); ++k) {
    const Joint& joint = robot.joints[driven[k]];
    out.push_back(joint.torque_per_ampere.value_or(1.0));
    if (!joint.torque_per_ampere && by_current(static_cast<Index>(k))) unknown.push_back(joint.name);
  }
  if (!unknown.empty()) {
    warnings->push_back("torque_per_ampere is not known of " + listed(unknown) +
                        ": 1 Nm/A is assumed, so masses and drive constants cannot be told apart, and all torques of "
                        "these joints are in amperes");
  }
  return out;
}

namespace {

PrepareOptions prepare_options(const Robot& robot, const std::vector<Recording>& recordings, double cutoff,
                               std::vector<std::string>* warnings) {
  PrepareOptions out;
  out.torque_per_ampere = drive_constants(robot, recordings, warnings);
  out.cutoff = cutoff_of(recordings, cutoff);
  return out;
}

/// A payload that is stated in some recordings only is none in the others, which may be an oversight.
void warn_of_payloads(const std::vector<Recording>& recordings, std::vector<std::string>* warnings) {
  std::vector<std::string> without;
  for (const Recording& recording : recordings)
    if (recording.columns.count(kPayload) == 0) without.push_back(recording.name);
  if (without.empty() || without.size() == recordings.size()) return;
  warnings->push_back("no payload_kg in " + listed(without) + ": taken to be without a payload");
}

/// Of stamps in milliseconds speeds are a thousand times too small.
std::string of_slow_rows(const std::vector<Recording>& recordings) {
  const VectorXd& time = recordings.front().time;
  const double step = time.size() > 1 ? time[1] - time[0] : 0.0;
  return step < kSlowRows ? "" : "; rows are " + math::number(step) + " s apart: is t_s in seconds?";
}

}  // namespace

Problem::Problem(const Robot& given, const std::vector<Recording>& recordings, const ProblemOptions& options)
    : robot(given),
      tiles(recordings, robot, prepare_options(robot, recordings, options.cutoff, &warnings), options.threads),
      nominal(given, {}) {
  split(recordings, options.test_share, this);
  warn_of_payloads(recordings, &warnings);
  range = range_of(tiles);
  range.turns = turns_of(robot);
  range.frequency = tiles.options().cutoff;
  if ((range.speed.array() < speeds_at_rest(robot).array()).all()) {
    throw std::invalid_argument(
        "nothing moves: no joint of any recording is faster than 0.01 rad/s (or 0.001 m/s), and at rest friction tells "
        "nothing" +
        of_slow_rows(recordings));
  }
  own_effects = options.own_effects;
  nominal = model_of(robot, *this);
  fitted_before = !robot.torque_effects.empty() && robot.fitted_range.count("qd1") > 0;
}

bool is_inertial(const TorqueGroup& group) { return group.standard && group.family == TorqueFamily::inertia; }

std::vector<bool> inertial_columns(const TorqueDesign& design) {
  std::vector<bool> out(design.terms.size(), false);
  for (const TorqueGroup& group : design.groups) {
    for (const int c : group.columns) out[static_cast<std::size_t>(c)] = is_inertial(group);
  }
  return out;
}

std::vector<int> standard_columns(const TorqueDesign& design) {
  std::vector<int> out;
  for (const TorqueGroup& group : design.groups) {
    if (group.standard) out.insert(out.end(), group.columns.begin(), group.columns.end());
  }
  return out;
}

Sums flat_sums_of(const TorqueGrams& grams, const std::vector<Noise>& noise, const TorqueDesign& design, int threads) {
  Sums out;
  for (std::size_t f = 0; f < grams->front().folds.size(); ++f) out.folds.emplace_back(grams, f, noise);
  out.all = sum_of_folds(*grams, noise, design.terms.size(), threads);
  out.precision = VectorXd::Zero(static_cast<Index>(design.terms.size()));
  return out;
}

Sums with_priors(Sums flat, const TorqueDesign& design, const std::vector<bool>& with_prior) {
  for (std::size_t c = 0; c < design.terms.size(); ++c) {
    if (with_prior[c]) flat.precision[static_cast<Index>(c)] = std::pow(design.terms[c].prior, -2.0);
  }
  flat.all.xx.diagonal() += flat.precision;
  return flat;
}

Sums sums_of(const TorqueGrams& grams, const std::vector<Noise>& noise, const TorqueDesign& design,
             const std::vector<bool>& with_prior, int threads) {
  return with_priors(flat_sums_of(grams, noise, design, threads), design, with_prior);
}

Fit fit_of(const Sums& sums, const std::vector<int>& columns, const VectorXd& ridge) {
  const Gram gram = sums.all.of(columns);
  MatrixXd d = gram.xx;
  if (ridge.size() == d.rows()) d.diagonal() += ridge;
  d.diagonal() += 1e-9 * gram.xx.diagonal();
  d.diagonal().array() += 1e-30;
  Fit out;
  out.columns = columns;
  out.ridge = ridge.size() == d.rows() ? ridge : VectorXd(VectorXd::Zero(d.rows()));
  const VectorXd scale = unit_scale<Eigen::Dynamic>(d);
  const MatrixXd inverse = inverse_symmetric<Eigen::Dynamic>(scaled_both<Eigen::Dynamic>(scale, d));
  out.covariance = scaled_both<Eigen::Dynamic>(scale, inverse);
  out.values = out.covariance * gram.xy;
  return out;
}

namespace {

/// Normal equations of one joint less its own columns.
struct Eliminated {
  std::vector<int> own, shared;  ///< columns of the design
  Eigen::LLT<MatrixXd> factor;   ///< L L^T of its own
  MatrixXd half;                 ///< L^-1 of their products with the shared ones
  VectorXd right;                ///< L^-1 of their right-hand side
  MatrixXd left_xx;              ///< what is left of the shared ones' matrix …
  VectorXd left_xy;              ///< … and of their right-hand side
};

/// A little on the diagonal holds what the rows cannot see at all.
double firm(double diagonal) { return diagonal * (1.0 + 1e-9) + 1e-30; }

Eliminated eliminated(const JointGrams& grams, const Noise& noise, const TorqueDesign& design,
                      const std::vector<bool>& wanted) {
  Eliminated out;
  std::vector<Index> own, shared;
  for (std::size_t k = 0; k < grams.columns.size(); ++k) {
    const int column = grams.columns[k];
    if (!wanted[static_cast<std::size_t>(column)]) continue;
    const bool alone = design.terms[static_cast<std::size_t>(column)].joints.size() == 1;
    (alone ? out.own : out.shared).push_back(column);
    (alone ? own : shared).push_back(static_cast<Index>(k));
  }
  const Gram sum = sum_of_folds(grams, noise);
  if (sum.xx.size() == 0) {
    out.own.clear();
    out.shared.clear();
    return out;
  }
  MatrixXd d = sum.xx(own, own);
  for (std::size_t k = 0; k < own.size(); ++k) {
    const auto at = static_cast<Index>(k);
    d(at, at) = firm(d(at, at) + std::pow(design.terms[static_cast<std::size_t>(out.own[k])].prior, -2.0));
  }
  out.factor = estimation::factorised(std::move(d));
  out.half = sum.xx(own, shared);
  out.factor.matrixL().solveInPlace(out.half);
  out.right = sum.xy(own);
  out.factor.matrixL().solveInPlace(out.right);
  out.left_xx = sum.xx(shared, shared);
  out.left_xx.noalias() -= out.half.transpose() * out.half;
  out.left_xy = sum.xy(shared) - out.half.transpose() * out.right;
  return out;
}

}  // namespace

VectorXd values_of(const TorqueGrams& grams, const std::vector<Noise>& noise, const TorqueDesign& design,
                   const std::vector<bool>& wanted, int threads) {
  std::vector<Eliminated> joints(grams->size());
  math::for_each_on_threads(
      joints.size(), threads, {}, [&](std::size_t j) { joints[j] = eliminated((*grams)[j], noise[j], design, wanted); },
      1);
  std::vector<int> shared;
  for (const Eliminated& joint : joints) shared.insert(shared.end(), joint.shared.begin(), joint.shared.end());
  std::sort(shared.begin(), shared.end());
  shared.erase(std::unique(shared.begin(), shared.end()), shared.end());
  const auto place = [&](int column) {
    return std::lower_bound(shared.begin(), shared.end(), column) - shared.begin();
  };
  const auto p = static_cast<Index>(shared.size());
  MatrixXd d = MatrixXd::Zero(p, p);
  VectorXd right = VectorXd::Zero(p), solution;
  for (const Eliminated& joint : joints) {
    std::vector<Index> at;
    for (const int column : joint.shared) at.push_back(place(column));
    d(at, at) += joint.left_xx;
    right(at) += joint.left_xy;
  }
  for (Index k = 0; k < p; ++k)
    d(k, k) = firm(d(k, k) +
                   std::pow(design.terms[static_cast<std::size_t>(shared[static_cast<std::size_t>(k)])].prior, -2.0));
  if (p > 0) {
    const VectorXd scale = unit_scale<Eigen::Dynamic>(d);
    solution = scale.cwiseProduct(
        solve_symmetric<Eigen::Dynamic, 1>(scaled_both<Eigen::Dynamic>(scale, d), scale.cwiseProduct(right)));
  }
  VectorXd out = VectorXd::Zero(static_cast<Index>(design.terms.size()));
  for (Index k = 0; k < p; ++k) out[shared[static_cast<std::size_t>(k)]] = solution[k];
  for (const Eliminated& joint : joints) {
    if (joint.own.empty()) continue;
    VectorXd own = joint.right;
    for (std::size_t k = 0; k < joint.shared.size(); ++k)
      own -= out[joint.shared[k]] * joint.half.col(static_cast<Index>(k));
    joint.factor.matrixU().solveInPlace(own);
    for (std::size_t k = 0; k < joint.own.size(); ++k) out[joint.own[k]] = own[static_cast<Index>(k)];
  }
  return out;
}

namespace {

/// Of a fit: which of its columns are inertial, at which of 10 * links parameters, and the others.
struct InertialPart {
  std::vector<Index> inertial, parameter, other;
};

InertialPart inertial_part(const Robot& robot, const TorqueDesign& design, const Fit& fit) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  std::vector<Index> parameter_of(design.terms.size(), -1);
  for (const TorqueGroup& group : design.groups) {
    if (!is_inertial(group)) continue;
    const auto link = static_cast<Index>(driven[driven_number(robot, group.joints.front())]);
    for (std::size_t k = 0; k < group.columns.size(); ++k)
      parameter_of[static_cast<std::size_t>(group.columns[k])] = kLinkParameters * link + static_cast<Index>(k);
  }
  InertialPart out;
  for (std::size_t k = 0; k < fit.columns.size(); ++k) {
    const Index parameter = parameter_of[static_cast<std::size_t>(fit.columns[k])];
    (parameter < 0 ? out.other : out.inertial).push_back(static_cast<Index>(k));
    if (parameter >= 0) out.parameter.push_back(parameter);
  }
  return out;
}

}  // namespace

// With the other columns eliminated (Schur complement), the inertial parameters' normal equations are H delta = g.
Fit with_bodies(const Robot& nominal, const TorqueDesign& design, const Sums& sums, const Fit& fit,
                std::vector<std::string>* warnings, const Fit* near) {
  const InertialPart part = inertial_part(nominal, design, fit);
  if (part.inertial.empty()) return fit;
  const Gram gram = sums.all.of(fit.columns);
  MatrixXd d = gram.xx;
  d.diagonal() += fit.ridge + 1e-9 * gram.xx.diagonal();
  for (const Index k : part.inertial) d(k, k) -= sums.precision[fit.columns[static_cast<std::size_t>(k)]];
  const MatrixXd to_other = d(part.other, part.inertial);
  const MatrixXd follow = solve_symmetric<Eigen::Dynamic, Eigen::Dynamic>(d(part.other, part.other), to_other);
  MatrixXd H = d(part.inertial, part.inertial) - to_other.transpose() * follow;
  H = (0.5 * (H + H.transpose())).eval();
  const VectorXd g = gram.xy(part.inertial) - follow.transpose() * gram.xy(part.other);

  const VectorXd before = link_parameters(nominal);
  MatrixXd information = MatrixXd::Zero(before.size(), before.size());
  information(part.parameter, part.parameter) = H;
  VectorXd gradient = information * before;
  gradient(part.parameter) += g;
  VectorXd start;
  if (near) {
    if (near->columns != fit.columns) throw std::logic_error("the fit that is near has other columns");
    start = before;
    start(part.parameter) += near->values(part.inertial);
  }
  const PhysicalInertias bodies = physical_inertias(nominal, information, gradient, {}, start);
  for (const LiftedLink& link : bodies.lifted)
    warnings->push_back("no body can have the mass and inertia that the file gives the link of '" + link.joint +
                        "': the nearest that one can have was taken for a start");

  const VectorXd change = (bodies.parameters - before)(part.parameter);
  const VectorXd moved = change - fit.values(part.inertial);
  Fit out = fit;
  out.values(part.inertial) = change;
  out.values(part.other) -= follow * moved;
  return out;
}

TorqueModel model_of(const Robot& robot, const Problem& problem) {
  return {robot, valued_terms(robot, problem.range, problem.own_effects)};
}

VectorXd by_column(const TorqueDesign& design, const Fit& fit) {
  VectorXd out = VectorXd::Zero(static_cast<Index>(design.terms.size()));
  out(fit.columns) = fit.values;
  return out;
}

std::vector<ValuedTerm> valued(const TorqueDesign& design, const Fit& fit) {
  std::vector<ValuedTerm> out;
  for (std::size_t k = 0; k < fit.columns.size(); ++k)
    out.push_back({design.terms[static_cast<std::size_t>(fit.columns[k])], fit.values[static_cast<Index>(k)]});
  return out;
}

namespace {

TorqueDesign standard_design(const Problem& problem) {
  TorqueDesign design;
  for (const TorqueEffect& effect : torque_catalogue()) {
    if (effect.traits.standard) add_effect(effect, -1, problem.robot, problem.range, &design);
  }
  return design;
}

struct StandardFit {
  Sums sums;
  Fit fit;
};

/// `table`: of `design`.
StandardFit standard_fit(const Problem& problem, const TorqueDesign& design, const DesignColumns& table,
                         const TorqueGrams& grams) {
  // Each joint by the noise that the fit leaves, which depends on it.
  std::vector<Noise> noise(problem.robot.driven_count());
  for (std::size_t j = 0; j < noise.size(); ++j)
    noise[j].sigma = std::max(0.1 * problem.range.torque[static_cast<Index>(j)], 1e-6);
  StandardFit out;
  for (int round = 0; round < 2; ++round) {
    if (round > 0) noise = noise_of(table, problem.nominal, by_column(design, out.fit), problem.train);
    out.sums = sums_of(grams, noise, design, inertial_columns(design));
    out.fit = fit_of(out.sums, standard_columns(design));
  }
  return out;
}

}  // namespace

std::vector<Parameter> parameters_of(const TorqueDesign& design, const std::vector<int>& columns, const Fit& fit) {
  std::vector<Parameter> out;
  for (const int c : columns) {
    const auto at = std::find(fit.columns.begin(), fit.columns.end(), c);
    if (at == fit.columns.end()) continue;
    const auto k = static_cast<Index>(at - fit.columns.begin());
    const TorqueTerm& term = design.terms[static_cast<std::size_t>(c)];
    Parameter parameter;
    parameter.name = term.parameter;
    parameter.unit = term.unit;
    parameter.value = fit.values[k];
    parameter.sigma = std::sqrt(std::max(0.0, fit.covariance(k, k)));
    out.push_back(std::move(parameter));
    for (const auto& [name, value] : term.constants) out.push_back({name, value, value, 0.0, "", true});
  }
  return out;
}

MatrixXd covariance_of(const TorqueDesign& design, const Fit& fit, const std::vector<Parameter>& parameters) {
  std::vector<Index> at;
  for (const Parameter& parameter : parameters) {
    if (parameter.frozen) continue;
    const auto is_it = [&](int c) { return design.terms[static_cast<std::size_t>(c)].parameter == parameter.name; };
    const auto found = std::find_if(fit.columns.begin(), fit.columns.end(), is_it);
    if (found == fit.columns.end()) throw std::logic_error("no column of the fit is " + parameter.name);
    at.push_back(static_cast<Index>(found - fit.columns.begin()));
  }
  const MatrixXd out = fit.covariance(at, at);
  return 0.5 * (out + out.transpose());
}

Robot applied(const Robot& robot, const TorqueDesign& design, const std::vector<int>& groups, const Fit& fit,
              const MotionRange& range) {
  Robot out = robot;
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (const int g : groups) {
    const TorqueGroup& group = design.groups[static_cast<std::size_t>(g)];
    const std::vector<Parameter> parameters = parameters_of(design, group.columns, fit);
    if (is_inertial(group)) {
      Joint& joint = out.joints[driven[driven_number(robot, group.joints.front())]];
      LinkParameters links = link_parameters(joint);
      for (Index k = 0; k < kLinkParameters; ++k) links[k] += parameters[static_cast<std::size_t>(k)].value;
      set_link_parameters(links, &joint);
      continue;
    }
    AppliedEffect effect{group.effect, group.joints, {}};
    for (const Parameter& parameter : parameters) effect.parameters[parameter.name] = parameter.value;
    // What the robot carries already grows.
    const auto same = std::find_if(out.torque_effects.begin(), out.torque_effects.end(), [&](const AppliedEffect& e) {
      return e.effect == effect.effect && e.joints == effect.joints;
    });
    const auto grows = [&] {
      return std::all_of(parameters.begin(), parameters.end(), [&](const Parameter& p) {
        const auto old = same->parameters.find(p.name);
        return old == same->parameters.end() ? p.frozen : (!p.frozen || old->second == p.value);
      });
    };
    if (same != out.torque_effects.end() && grows()) {
      for (const Parameter& p : parameters)
        same->parameters[p.name] = (p.frozen ? 0.0 : same->parameters[p.name]) + p.value;
    } else {
      out.torque_effects.push_back(std::move(effect));
    }
  }
  for (Index j = 0; j < range.speed.size(); ++j) {
    const std::string number = std::to_string(j + 1);
    out.fitted_range["q" + number] = {range.lower[j], range.upper[j]};
    out.fitted_range["qd" + number] = {-range.speed[j], range.speed[j]};
  }
  if (range.frequency > 0.0) out.fitted_range["frequency"] = {0.0, range.frequency};
  return out;
}

// --- errors --------------------------------------------------------------------------------------

namespace {

struct Moments {
  double n = 0.0, sum = 0.0, squares = 0.0, errors = 0.0;

  void add(double measured, double predicted) {
    n += 1.0;
    sum += measured;
    squares += measured * measured;
    errors += std::pow(measured - predicted, 2.0);
  }
  void add(const Moments& other) {
    n += other.n;
    sum += other.sum;
    squares += other.squares;
    errors += other.errors;
  }
  TorqueError error(const std::string& joint) const {
    TorqueError out;
    out.joint = joint;
    out.n = n;
    if (n < 2.0) return out;
    out.rms = std::sqrt(errors / n);
    const double variance = squares / n - std::pow(sum / n, 2.0);
    out.percent = 100.0 * out.rms / std::sqrt(std::max(variance, 1e-300));
    return out;
  }
};

/// Of one joint.
struct JointMoments {
  Moments all, moving;

  void add(const JointMoments& other) {
    all.add(other.all);
    moving.add(other.moving);
  }
};
using ModelMoments = std::vector<std::vector<JointMoments>>;  // by model and joint

/// Of held-out rows, and of training rows.
struct SplitMoments {
  ModelMoments held_out, train;

  SplitMoments() = default;
  SplitMoments(std::size_t models, std::size_t joints)
      : held_out(models, std::vector<JointMoments>(joints)), train(held_out) {}

  void add(const SplitMoments& other) {
    for (std::size_t m = 0; m < train.size(); ++m) {
      for (std::size_t j = 0; j < train[m].size(); ++j) {
        held_out[m][j].add(other.held_out[m][j]);
        train[m][j].add(other.train[m][j]);
      }
    }
  }
};

using Models = std::vector<std::pair<std::string, TorqueModel>>;

SplitMoments moments_of(const Problem& problem, const Models& models, Tile* tile) {
  SplitMoments out(models.size(), problem.robot.driven_count());
  const VectorXd time = tile->own_time();
  for (std::size_t m = 0; m < models.size(); ++m) {
    const MatrixXd& predicted = kept_torque(models[m].second, tile);
    for (Index i = 0; i < tile->count; ++i) {
      const bool held_out = problem.test.fold(tile->recording, time[i]) >= 0;
      if (!held_out && problem.train.fold(tile->recording, time[i]) < 0) continue;
      std::vector<JointMoments>& by_joint = held_out ? out.held_out[m] : out.train[m];
      for (Index j = 0; j < predicted.cols(); ++j) {
        const double y = tile->measured(i, j);
        if (std::isnan(y)) continue;
        JointMoments& joint = by_joint[static_cast<std::size_t>(j)];
        joint.all.add(y, predicted(i, j));
        if (tile->moving(i, j) > 0.0) joint.moving.add(y, predicted(i, j));
      }
    }
  }
  return out;
}

}  // namespace

std::vector<TorqueErrors> errors_of(const Problem& problem, const Models& models) {
  std::vector<SplitMoments> lot(Tiles::kTogether);
  SplitMoments all(models.size(), problem.robot.driven_count());
  problem.tiles.for_each([](std::size_t) { return true; },
                         [&](Tile& tile, std::size_t k) { lot[k] = moments_of(problem, models, &tile); },
                         [&](std::size_t k) { all.add(lot[k]); });
  const std::vector<std::size_t> driven = problem.robot.driven_joints();
  std::vector<TorqueErrors> out(models.size());
  for (std::size_t m = 0; m < models.size(); ++m) {
    out[m].model = models[m].first;
    for (std::size_t j = 0; j < driven.size(); ++j) {
      const std::string& joint = problem.robot.joints[driven[j]].name;
      out[m].held_out.push_back(all.held_out[m][j].all.error(joint));
      out[m].in_motion.push_back(all.held_out[m][j].moving.error(joint));
      out[m].train.push_back(all.train[m][j].all.error(joint));
    }
  }
  return out;
}

// --- the turn of friction ------------------------------------------------------------------------

namespace {

/// `errors_with`: rms errors by joint of what is fitted with the turns that are set [Nm | N].
void choose_turns(Problem* problem, bool may_fade, const std::function<std::vector<double>()>& errors_with) {
  constexpr FrictionTurn kTurns[] = {{0.01, 0.0},  {1e-3, 0.0},  {3e-4, 0.0},       {0.01, 1e-6},
                                     {0.01, 1e-5}, {0.01, 1e-4}, {0.01, 1e-4, 1.0}, {0.01, 1e-4, 10.0}};
  const double least_of_fading = std::sqrt(0.99);  // a law more removes 1 % of a joint's squares, as effects must
  const auto set = [&](const std::vector<FrictionTurn>& turns) {
    problem->range.turns = turns;
    problem->nominal = problem->nominal.turning(turns);
  };
  const std::size_t joints = problem->robot.driven_count();
  std::vector<double> least(joints, std::numeric_limits<double>::infinity());
  std::vector<FrictionTurn> chosen(joints);
  for (const FrictionTurn& turn : kTurns) {
    // Blocks of one recording share its rests: a joint that rests once does not say what friction forgets.
    if (turn.fade > 0.0 && (problem->single || !may_fade)) continue;
    set(std::vector<FrictionTurn>(joints, turn));
    const std::vector<double> errors = errors_with();
    for (std::size_t j = 0; j < joints; ++j) {
      const bool one_more = turn.fade > 0.0 && chosen[j].fade == 0.0;
      if (errors[j] >= least[j] * (one_more ? least_of_fading : 1.0)) continue;
      least[j] = errors[j];
      chosen[j] = turn;
    }
  }
  set(chosen);
}

}  // namespace

bool choose_turns_again(Problem* problem, const TorqueDesign& design, const TorqueModel& seen,
                        const std::vector<Noise>& noise, bool may_fade) {
  const std::vector<FrictionTurn> before = problem->range.turns;
  DesignColumns table(problem->tiles, design);
  std::vector<int> columns(design.terms.size());
  std::iota(columns.begin(), columns.end(), 0);
  std::vector<TorqueGrams> grams;  // with the turns before
  choose_turns(problem, may_fade, [&] {
    table.turned();
    grams = sum_grams(table, problem->nominal, seen.turning(problem->range.turns), problem->train, {grams, true},
                      {Rows::fitted, Rows::resting});
    const Fit fit = fit_of(sums_of(grams.front(), noise, design, inertial_columns(design)), columns);
    return rms_of(grams, by_column(design, fit));
  });
  return !same(problem->range.turns, before);
}

Groundwork groundwork_of(Problem* problem, bool may_fade) {
  if (problem->fitted_before) {
    const std::vector<Noise> noise = noise_of(problem->tiles, problem->nominal, problem->train);
    return {standard_design(*problem), {}, {}, problem->nominal, noise};
  }
  TorqueDesign design = standard_design(*problem);
  DesignColumns table(problem->tiles, design);
  std::vector<TorqueGrams> grams;
  const auto fitted = [&] {
    design = standard_design(*problem);  // of the same columns
    table.turned();
    grams = sum_grams(table, problem->nominal, problem->nominal, problem->train, {grams, true},
                      {Rows::fitted, Rows::resting});
    return standard_fit(*problem, design, table, grams.front());
  };
  choose_turns(problem, may_fade, [&] {
    const VectorXd values = by_column(design, fitted().fit);
    return rms_of(grams, values);
  });
  StandardFit chosen = fitted();
  std::vector<Noise> noise = noise_of(table, problem->nominal, by_column(design, chosen.fit), problem->train);
  TorqueModel model = problem->nominal.with(valued(design, chosen.fit));
  return {design, std::move(chosen.sums), std::move(chosen.fit), std::move(model), std::move(noise)};
}

}  // namespace truing::dynamics
