// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/outlook.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "dynamics/columns.hpp"
#include "dynamics/effects/families.hpp"
#include "dynamics/problem.hpp"
#include "math/linear_algebra.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kThreshold = 4.0;     ///< nats beyond the cost, as the search of a diagnosis has it
constexpr double kTakenUp = 1e-4;      ///< a column of which less is left is the groundwork's
constexpr double kLittlePrior = 1e-4;  ///< of the precision that inertial parameters have in a diagnosis
constexpr double kBeyondPrior = 5.0;   ///< times what machines usually have: it would show only if it were larger

/// Several forms of an effect at one place.
struct Place {
  std::vector<std::size_t> groups;
  std::size_t usual = 0;  ///< the one of middling visibility
};

bool same_effect_there(const TorqueGroup& a, const TorqueGroup& b) {
  return a.effect == b.effect && a.joints == b.joints;
}

MatrixXd block(const MatrixXd& all, const std::vector<int>& rows, const std::vector<int>& columns) {
  return all(rows, columns);
}

/// The part of its squares that the groundwork leaves of a column.
double left(const Information& information, int column) {
  const double whole = information.whole[column];
  return whole > 0.0 ? std::max(0.0, information.seen(column, column)) / whole : 0.0;
}

/// The group's column that shows best beside the groundwork.
int best_column(const Information& information, const TorqueGroup& group) {
  return *std::max_element(group.columns.begin(), group.columns.end(),
                           [&](int a, int b) { return left(information, a) < left(information, b); });
}

/// L^-1 S of a group's rows, S_gg = L L^T: products of two such blocks are correlations.
class Whitened {
 public:
  Whitened(const Information& information, const TorqueDesign& design) : design_(design) {
    for (const TorqueGroup& group : design.groups) {
      const MatrixXd own = block(information.seen, group.columns, group.columns);
      MatrixXd d = own;
      d.diagonal() += 1e-9 * own.diagonal();
      d.diagonal().array() += 1e-300;
      const Eigen::LLT<MatrixXd> factor = estimation::factorised(d);
      rows_.push_back(factor.matrixL().solve(information.seen(group.columns, Eigen::all).eval()));
      factors_.push_back(factor);
    }
  }
  /// Fraction of group a that b explains: mean squared canonical correlation over a's directions (Hotelling 1936).
  double r2(std::size_t a, std::size_t b) const {
    const MatrixXd across = rows_[a](Eigen::all, design_.groups[b].columns);
    const MatrixXd both = factors_[b].matrixL().solve(across.transpose());
    return std::clamp(both.squaredNorm() / static_cast<double>(across.rows()), 0.0, 1.0);
  }

 private:
  const TorqueDesign& design_;
  std::vector<MatrixXd> rows_;
  std::vector<Eigen::LLT<MatrixXd>> factors_;
};

std::string tells_apart(const TorqueEffect& a, const TorqueEffect& b) {
  const auto of = [&](TorqueFamily x, TorqueFamily y) {
    return (a.traits.family == x && b.traits.family == y) || (a.traits.family == y && b.traits.family == x);
  };
  if ((a.traits.scales_masses || b.traits.scales_masses) && !(a.traits.scales_masses && b.traits.scales_masses))
    return "payloads of two known masses, far apart (column payload_kg)";
  if (of(TorqueFamily::thermal, TorqueFamily::thermal))
    return "some recordings that begin warm and others that begin cold, so that time and temperature part";
  if (of(TorqueFamily::inertia, TorqueFamily::inertia))
    return "a payload of known mass in some recordings (column payload_kg), or what the data sheet says of one of them";
  if (of(TorqueFamily::measurement, TorqueFamily::measurement)) return "accelerations that change faster";
  if (a.traits.documentation.needs == b.traits.documentation.needs) return "more " + a.traits.documentation.needs;
  return a.name + " needs " + a.traits.documentation.needs + "; " + b.name + " needs " + b.traits.documentation.needs;
}

/// Groups by effect and place; forms in the order of how well they show.
std::vector<Place> places_of(const Information& information, const TorqueDesign& design) {
  std::vector<Place> out;
  for (std::size_t g = 0; g < design.groups.size(); ++g) {
    const TorqueGroup& group = design.groups[g];
    if (group.standard) continue;
    const auto at = std::find_if(out.begin(), out.end(), [&](const Place& place) {
      return same_effect_there(design.groups[place.groups.front()], group);
    });
    if (at == out.end()) {
      out.push_back({{g}, g});
    } else {
      at->groups.push_back(g);
    }
  }
  for (Place& place : out) {
    const auto shows = [&](std::size_t g) { return left(information, best_column(information, design.groups[g])); };
    std::stable_sort(place.groups.begin(), place.groups.end(),
                     [&](std::size_t a, std::size_t b) { return shows(a) > shows(b); });
    place.usual = place.groups[(place.groups.size() - 1) / 2];
  }
  return out;
}

/// Standard errors that a diagnosis asks for: twice the nats that the group has to win.
double standard_errors(const Information& information, const TorqueDesign& design, const TorqueGroup& group) {
  const auto kinds = std::count_if(design.groups.begin(), design.groups.end(),
                                   [&](const TorqueGroup& other) { return other.effect == group.effect; });
  return std::sqrt(2.0 * estimation::detection_nats(kThreshold, std::log(static_cast<double>(kinds)),
                                                    group.columns.size(), information.values));
}

TorqueEffectSize size_of(const Information& information, const TorqueDesign& design, const Robot& robot,
                         const TorqueGroup& group, const std::vector<double>& noise_free_scale) {
  const int column = best_column(information, group);
  const TorqueTerm& term = design.terms[static_cast<std::size_t>(column)];
  TorqueEffectSize out;
  out.effect = group.effect;
  out.joints = group.joints;
  out.parameter = term.parameter;
  out.unit = term.unit;
  out.size = standard_errors(information, design, group) / std::sqrt(information.seen(column, column));
  Index most = 0;
  VectorXd torques = information.rms.col(column);
  for (Index j = 0; j < torques.size(); ++j) torques[j] /= noise_free_scale[static_cast<std::size_t>(j)];
  torques.maxCoeff(&most);
  out.joint = driven_name(robot, static_cast<std::size_t>(most));
  out.torque = out.size * information.rms(most, column);
  return out;
}

NotTestable taken_up(const TorqueGroup& group) {
  const bool inertia = group.family == TorqueFamily::inertia;
  return {group.effect, group.joints,
          inertia
              ? "the same as link inertias, which are fitted in any case: a data sheet tells, or a diagnosis of a "
                "robot that was fitted before"
              : "link inertias, Coulomb and viscous friction and an offset, which are fitted in any case, take it up",
          inertia ? Untestable::same_as_masses : Untestable::other};
}

NotTestable too_small(const TorqueEffectSize& size) {
  return {
      size.effect, size.joints,
      "would show only from " + math::number(size.size, 2) + " " + size.unit + " on, which is more than machines have",
      Untestable::other};
}

TorqueEffectPair make_pair(const TorqueDesign& design, const std::vector<TorqueEffect>& own, std::size_t a,
                           std::size_t b, double r2) {
  const TorqueGroup &first = design.groups[a], &other = design.groups[b];
  return {first.effect, first.joints,
          other.effect, other.joints,
          r2,           tells_apart(find_torque_effect(first.effect, own), find_torque_effect(other.effect, own))};
}

/// How much the forms of `by` explain of the usual form of `of`, at most.
double r2_of_places(const Whitened& whitened, const Place& of, const Place& by) {
  double out = 0.0;
  for (const std::size_t g : by.groups) out = std::max(out, whitened.r2(of.usual, g));
  return out;
}

void sort_by_r2(std::vector<TorqueEffectPair>* pairs) {
  std::stable_sort(pairs->begin(), pairs->end(), [](const auto& a, const auto& b) { return a.r2 > b.r2 + 1e-9; });
}

}  // namespace

Information information_of(const Tiles& tiles, const TorqueDesign& design, const std::vector<double>& noise,
                           double noise_time) {
  Folds all;
  all.of_recording.assign(tiles.recordings().size(), 0);
  all.count = 1;
  const TorqueModel nominal(tiles.robot(), {});
  const TorqueGrams shared = sum_grams(DesignColumns(tiles, design), nominal, nominal, all);
  const std::vector<JointGrams>& grams = *shared;
  double length = 0.0;
  for (const Recording& recording : tiles.recordings())
    length += recording.time[recording.time.size() - 1] - recording.time[0];
  Information out;
  const auto columns = static_cast<Index>(design.terms.size());
  out.rms = MatrixXd::Zero(static_cast<Index>(grams.size()), columns);
  std::vector<Noise> noises;
  for (std::size_t j = 0; j < grams.size(); ++j) {
    const Gram& gram = grams[j].folds.front();
    Noise one;
    one.sigma = noise[j];
    // Of first-order noise 1 + 2 sum of exp(-k step / time) is about 2 time / step.
    one.design_effect = gram.n > 0.0 ? std::max(1.0, 2.0 * noise_time * gram.n / length) : 1.0;
    out.values += gram.n / one.design_effect;
    for (std::size_t c = 0; c < grams[j].columns.size(); ++c) {
      const auto k = static_cast<Index>(c);
      if (gram.n > 0.0)
        out.rms(static_cast<Index>(j), grams[j].columns[c]) = std::sqrt(std::max(0.0, gram.xx(k, k)) / gram.n);
    }
    noises.push_back(one);
  }
  const Sums sums = sums_of(shared, noises, design, inertial_columns(design));
  const std::vector<int> groundwork = standard_columns(design);
  out.whole = sums.all.xx.diagonal() - sums.precision;
  // Of the groundwork's prior only so much that no column is left without: what shows by it alone does not show.
  MatrixXd d = sums.all.xx(groundwork, groundwork);
  d.diagonal() -= (1.0 - kLittlePrior) * sums.precision(groundwork);
  d.diagonal() *= 1.0 + 1e-9;
  d.diagonal().array() += 1e-30;
  const VectorXd scale = d.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd across = scale.asDiagonal() * sums.all.xx(groundwork, Eigen::all);
  const Eigen::LLT<MatrixXd> factor = estimation::factorised(scale.asDiagonal() * d * scale.asDiagonal());
  const MatrixXd half = factor.matrixL().solve(across);
  out.seen = sums.all.xx - half.transpose() * half;
  for (const int c : groundwork) {
    out.seen.row(c).setZero();
    out.seen.col(c).setZero();
  }
  return out;
}

double nats(const Information& information, const TorqueDesign& design, const std::vector<int>& columns) {
  MatrixXd d = block(information.seen, columns, columns);
  for (Index k = 0; k < d.rows(); ++k) {
    const double prior = design.terms[static_cast<std::size_t>(columns[static_cast<std::size_t>(k)])].prior;
    d.row(k) *= prior;
    d.col(k) *= prior;
  }
  d.diagonal().array() += 1.0;
  const MatrixXd factor = estimation::factorised(std::move(d)).matrixL();
  return factor.diagonal().array().log().sum();
}

double nats_beside(const Information& information, const TorqueDesign& design, const std::vector<int>& columns,
                   const std::vector<int>& others) {
  std::vector<int> both = columns;
  both.insert(both.end(), others.begin(), others.end());
  return nats(information, design, both) - nats(information, design, others);
}

TorqueOutlook outlook_of(const Information& information, const TorqueDesign& design, const Robot& robot,
                         const std::vector<TorqueEffect>& own, const std::vector<bool>& wanted, double alike) {
  TorqueOutlook out;
  out.not_testable = design.not_testable;
  const Whitened whitened(information, design);
  std::vector<double> scale;  // a column shows most where it is large beside what all columns of its kind make there
  for (Index j = 0; j < information.rms.rows(); ++j) scale.push_back(std::max(1e-12, information.rms.row(j).mean()));
  std::vector<Place> seen;
  std::vector<bool> asked;
  for (const Place& place : places_of(information, design)) {
    const TorqueGroup& group = design.groups[place.usual];
    const int column = best_column(information, group);
    if (left(information, column) < kTakenUp) {
      if (wanted[place.usual]) out.not_testable.push_back(taken_up(group));
      continue;
    }
    const TorqueEffectSize size = size_of(information, design, robot, group, scale);
    if (size.size > kBeyondPrior * design.terms[static_cast<std::size_t>(column)].prior) {
      if (wanted[place.usual]) out.not_testable.push_back(too_small(size));
      continue;
    }
    seen.push_back(place);
    asked.push_back(wanted[place.usual]);
    out.effects.push_back(size);
  }
  for (std::size_t a = 0; a < seen.size(); ++a) {
    TorqueEffectSize& size = out.effects[a];
    size.closest = "none";
    for (std::size_t b = 0; b < seen.size(); ++b) {
      if (a == b) continue;
      const double r2 = r2_of_places(whitened, seen[a], seen[b]);
      if (r2 > alike && (asked[a] || asked[b]))
        out.alike.push_back(make_pair(design, own, seen[a].usual, seen[b].usual, r2));
      if (r2 <= size.r2) continue;
      size.r2 = r2;
      size.closest = design.groups[seen[b].usual].effect;
      size.closest_joints = design.groups[seen[b].usual].joints;
    }
    if (size.r2 <= alike) size.size_apart = size.size / std::sqrt(1.0 - size.r2);
  }
  std::vector<TorqueEffectSize> shown;
  for (std::size_t a = 0; a < seen.size(); ++a)
    if (asked[a]) shown.push_back(out.effects[a]);
  out.effects = std::move(shown);
  sort_by_r2(&out.alike);
  return out;
}

std::vector<TorqueEffectPair> pairs_of(const Information& information, const TorqueDesign& design,
                                       const std::vector<TorqueEffect>& own, const std::vector<bool>& wanted) {
  const Whitened whitened(information, design);
  const std::vector<Place> places = places_of(information, design);
  std::vector<TorqueEffectPair> out;
  for (std::size_t a = 0; a < places.size(); ++a) {
    for (std::size_t b = 0; b < places.size(); ++b) {
      if (a == b || !wanted[places[a].usual] || !wanted[places[b].usual]) continue;
      out.push_back(
          make_pair(design, own, places[a].usual, places[b].usual, r2_of_places(whitened, places[a], places[b])));
    }
  }
  sort_by_r2(&out);
  return out;
}

}  // namespace truing::dynamics
