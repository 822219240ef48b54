// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/beside.hpp"

#include <algorithm>

#include "dynamics/columns.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Number of the joint that a group is a free function of; -1: it is an effect.
int joint_of_function(const TorqueDesign& design, int g) {
  const TorqueGroup& group = design.groups[static_cast<std::size_t>(g)];
  return group.effect.empty() ? group.joint : -1;
}

/// By column of the design, values of a fit to all folds but one.
VectorXd without_fold(const Account& account, const Evidence::State& state, std::size_t fold) {
  const Gram held = account.sums->folds[fold].of(state.columns);
  Gram others = account.sums->all.of(state.columns);
  others.xx -= held.xx;
  others.xx.diagonal() += state.precision;
  const VectorXd values = estimation::factorised(std::move(others.xx)).solve(others.xy - held.xy);
  VectorXd out = VectorXd::Zero(static_cast<Index>(account.design->terms.size()));
  out(state.columns) = values;
  return out;
}

/// Squares that a joint's columns leave on a fold. `values`: by column of the design.
double squares_left_of(const JointGrams& joint, std::size_t fold, const VectorXd& values) {
  const Gram& gram = joint.folds[fold];
  if (gram.xx.size() == 0) return 0.0;
  const VectorXd own = values(joint.columns);
  return gram.yy - 2.0 * own.dot(gram.xy) + own.dot(gram.xx * own);
}

}  // namespace

Choice with_functions_that_help(const Problem& problem, const Account& functions, const TorqueModel& seen,
                                double least_gain) {
  const TorqueDesign& design = *functions.design;
  Choice all = functions.choice, named;
  all.groups.insert(all.groups.end(), functions.small.groups.begin(), functions.small.groups.end());
  all.scales.insert(all.scales.end(), functions.small.scales.begin(), functions.small.scales.end());
  for (std::size_t k = 0; k < all.groups.size(); ++k) {
    if (joint_of_function(design, all.groups[k]) >= 0) continue;
    named.groups.push_back(all.groups[k]);
    named.scales.push_back(all.scales[k]);
  }
  if (named.groups.size() == all.groups.size()) return all;

  const Evidence::State with = functions.search->state(all), without = functions.search->state(named);
  std::vector<int> columns = with.columns;
  std::sort(columns.begin(), columns.end());
  const DesignColumns table(problem.tiles, design, std::move(columns));
  const TorqueGrams grams = sum_grams(table, problem.nominal, seen, problem.train, {}, Rows::judged);
  std::vector<VectorXd> before(grams->size(), VectorXd(problem.train.count)), after = before;  // by joint and fold
  for (std::size_t f = 0; f < functions.sums->folds.size(); ++f) {
    const VectorXd simple = without_fold(functions, without, f), whole = without_fold(functions, with, f);
    for (std::size_t j = 0; j < grams->size(); ++j) {
      before[j][static_cast<Index>(f)] = squares_left_of((*grams)[j], f, simple);
      after[j][static_cast<Index>(f)] = squares_left_of((*grams)[j], f, whole);
    }
  }
  Choice out = named;
  for (std::size_t k = 0; k < all.groups.size(); ++k) {
    const int joint = joint_of_function(design, all.groups[k]);
    if (joint < 0) continue;
    const auto j = static_cast<std::size_t>(joint);
    if (!Search::gains_on_folds(before[j], after[j], least_gain)) continue;
    out.groups.push_back(all.groups[k]);
    out.scales.push_back(all.scales[k]);
  }
  return out;
}

}  // namespace truing::dynamics
