// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/remainder.hpp"

#include <algorithm>

#include "math/batch.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRidgeParts[] = {1.0, 0.3, 0.1, 0.03};  ///< of what is left, that one column may make

/// By column of the design, the choice as it is handed over, moved as the fit of any numbers moves where it is made
/// without a fold. Fits of bodies to all but each fold would take their time.
VectorXd handed_over_without(const Account& account, const Evidence::State& state, const FoldGram& fold,
                             const VectorXd& handed_over) {
  const Gram held = fold.of(state.columns);
  Gram others = account.sums->all.of(state.columns);
  others.xx -= held.xx;
  others.xx.diagonal() += state.precision;
  const VectorXd values = estimation::factorised(std::move(others.xx)).solve(others.xy - held.xy);
  VectorXd out = handed_over;
  out(state.columns) += values - state.solution;
  return out;
}

/// Columns of a joint that were not chosen: their places in its Gram, and the number of the group of each.
struct Others {
  std::vector<Index> places;
  std::vector<int> groups;
};

Others others_of(const TorqueDesign& design, std::size_t joint, const JointGrams& grams,
                 const std::vector<int>& chosen) {
  Others out;
  for (std::size_t g = 0; g < design.groups.size(); ++g) {
    if (design.groups[g].joint != static_cast<int>(joint)) continue;
    for (const int column : design.groups[g].columns) {
      const Index place = grams.places[static_cast<std::size_t>(column)];
      if (place < 0 || std::find(chosen.begin(), chosen.end(), column) != chosen.end()) continue;
      out.places.push_back(place);
      out.groups.push_back(static_cast<int>(g));
    }
  }
  return out;
}

/// Mean squares of columns, as their groups have them: what hardly moves a row of one of them tells nothing of it.
VectorXd mean_squares(const Gram& gram, const Others& others) {
  const VectorXd own = gram.xx.diagonal()(others.places) / std::max(gram.n, 1.0);
  VectorXd out(own.size());
  for (Index k = 0; k < own.size(); ++k) {
    const int group = others.groups[static_cast<std::size_t>(k)];
    double sum = 0.0;
    for (Index i = 0; i < own.size(); ++i) sum += others.groups[static_cast<std::size_t>(i)] == group ? own[i] : 0.0;
    out[k] = sum / static_cast<double>(std::count(others.groups.begin(), others.groups.end(), group));
  }
  return out.cwiseMax(1e-12 * out.maxCoeff());
}

/// Sums of some folds: of the columns, and of what values of the choice leave.
struct Left {
  MatrixXd xx;
  VectorXd xy;
  double yy = 0.0;
};

Left left_of(const Gram& gram, const std::vector<Index>& places, const VectorXd& chosen) {
  const VectorXd product = gram.xx * chosen;
  return {gram.xx(places, places), gram.xy(places) - product(places),
          gram.yy + chosen.dot(product) - 2.0 * chosen.dot(gram.xy)};
}

Gram less(const Gram& all, const Gram& fold) {
  return {all.xx - fold.xx, all.xy - fold.xy, all.yy - fold.yy, all.n - fold.n};
}

/// Values under a prior by which every column makes such a part of what is left. `square`: mean squares of the columns.
VectorXd ridge(const Left& left, const VectorXd& square, double design_effect, double part) {
  MatrixXd a = left.xx;
  a.diagonal() += design_effect / (part * part) * square;
  return estimation::factorised(std::move(a)).solve(left.xy);
}

/// Squares of folds before, and what predictions p of them gain, 2 s b - s^2 c when they are shrunken by s.
struct RidgeGains {
  VectorXd before, b, c;

  double shrink() const { return std::clamp(b.sum() / std::max(c.sum(), 1e-300), 0.0, 1.0); }
  VectorXd after() const { return before - 2.0 * shrink() * b + shrink() * shrink() * c; }
};

/// The columns of one joint beside its choice.
class Rest {
 public:
  Rest(const JointGrams& joint, const Others& others, double design_effect)
      : joint_(joint), places_(others.places), design_effect_(design_effect) {
    for (const Gram& fold : joint.folds) {
      if (fold.xx.size() > 0) all_.add(fold);
    }
    square_ = mean_squares(all_, others);
  }

  /// Every fold by the fit to the others, for every part. `chosen`: values of the choice without each fold.
  std::vector<RidgeGains> gains(const std::vector<VectorXd>& chosen) const {
    const auto folds = static_cast<Index>(joint_.folds.size());
    const VectorXd none = VectorXd::Zero(folds);
    std::vector<RidgeGains> out(std::size(kRidgeParts), {none, none, none});
    for (Index f = 0; f < folds; ++f) {
      const auto at = static_cast<std::size_t>(f);
      const Gram& fold = joint_.folds[at];
      if (fold.xx.size() == 0) continue;
      const VectorXd values = chosen[at](joint_.columns);
      const Left held = left_of(fold, places_, values), others = left_of(less(all_, fold), places_, values);
      for (std::size_t k = 0; k < out.size(); ++k) {
        const VectorXd fit = ridge(others, square_, design_effect_, kRidgeParts[k]);
        out[k].before[f] = held.yy;
        out[k].b[f] = fit.dot(held.xy);
        out[k].c[f] = fit.dot(held.xx * fit);
      }
    }
    return out;
  }

  VectorXd fitted(const VectorXd& chosen, double part) const {
    const VectorXd values = chosen(joint_.columns);
    return ridge(left_of(all_, places_, values), square_, design_effect_, part);
  }

 private:
  const JointGrams& joint_;
  std::vector<Index> places_;
  double design_effect_;
  Gram all_;
  VectorXd square_;
};

/// Terms of a joint beside the choice that gain on folds, with their values. `without`: `chosen` without each fold.
std::vector<ValuedTerm> terms_beside(const TorqueDesign& design, std::size_t joint, const JointGrams& grams,
                                     double design_effect, const std::vector<int>& in_choice, const VectorXd& chosen,
                                     const std::vector<VectorXd>& without, double least_gain) {
  const auto has_rows = [](const Gram& fold) { return fold.xx.size() > 0; };
  if (std::none_of(grams.folds.begin(), grams.folds.end(), has_rows)) return {};  // at rest in all recordings
  const Others others = others_of(design, joint, grams, in_choice);
  if (others.places.empty()) return {};
  const Rest rest(grams, others, design_effect);
  const std::vector<RidgeGains> gains = rest.gains(without);
  const auto best = std::min_element(gains.begin(), gains.end(), [](const RidgeGains& a, const RidgeGains& b) {
    return a.after().sum() < b.after().sum();
  });
  if (!Search::gains_on_folds(best->before, best->after(), least_gain)) return {};
  const VectorXd values = best->shrink() * rest.fitted(chosen, kRidgeParts[best - gains.begin()]);
  std::vector<ValuedTerm> out;
  for (std::size_t k = 0; k < others.places.size(); ++k) {
    const int column = grams.columns[static_cast<std::size_t>(others.places[k])];
    out.push_back({design.terms[static_cast<std::size_t>(column)], values[static_cast<Index>(k)]});
  }
  return out;
}

}  // namespace

std::vector<Remainder> remainders_beside(const Account& account, const Fit& handed_over, double least_gain) {
  const TorqueDesign& design = *account.design;
  const std::vector<FoldGram>& folds = account.sums->folds;
  const Evidence::State& state = account.search->state(account.choice);
  const VectorXd chosen = by_column(design, handed_over);
  const int threads = account.search->threads();
  std::vector<VectorXd> chosen_without(folds.size());
  const auto refit = [&](std::size_t f) { chosen_without[f] = handed_over_without(account, state, folds[f], chosen); };
  math::for_each_on_threads(folds.size(), threads, {}, refit, 1);
  const std::vector<JointGrams>& joints = *folds.front().joints();
  std::vector<Remainder> out(joints.size());
  const auto fit = [&](std::size_t j) {
    out[j] = {j, terms_beside(design, j, joints[j], folds.front().design_effect(j), state.columns, chosen,
                              chosen_without, least_gain)};
  };
  math::for_each_on_threads(joints.size(), threads, {}, fit, 1);
  out.erase(std::remove_if(out.begin(), out.end(), [](const Remainder& one) { return one.terms.empty(); }), out.end());
  return out;
}

}  // namespace truing::dynamics
