// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Steps, corners and bumps of an input, at places scanned on the rows: what a smooth law at a joint may stand for.

#include <algorithm>
#include <cmath>

#include "diagnosis/diagnosis.hpp"
#include "diagnosis/free_search.hpp"

namespace truing::diagnosis {
namespace {

constexpr int kPlaces = 20;
constexpr int kKnots = 8, kFineKnots = 16;
constexpr std::size_t kValuesSeen = 6000;  ///< looked at: of more, whole folds are left out

/// One shape at a place, as a function of the input.
struct Shape {
  enum class Kind { step, corner, bump };
  Kind kind;
  double place, width;

  double at(double x) const {
    switch (kind) {
      case Kind::step:
        return x > place ? 1.0 : 0.0;
      case Kind::corner:
        return std::max(0.0, x - place) / width;
      case Kind::bump:
        return std::exp(-0.5 * std::pow((x - place) / width, 2.0));
    }
    return 0.0;
  }
};

/// The same widths as plain_shape has; a corner rises by one over the whole range.
std::vector<Shape> shapes_of(const std::vector<double>& places) {
  std::vector<Shape> out;
  const double span = places.back() - places.front();
  for (std::size_t k = 1; k + 1 < places.size(); ++k) {
    out.push_back({Shape::Kind::step, 0.5 * (places[k] + places[k + 1]), 0.0});
    out.push_back({Shape::Kind::corner, places[k], span});
    for (const double width : {0.08, 0.15, 0.25}) out.push_back({Shape::Kind::bump, places[k], width * span});
  }
  return out;
}

/// A joint that moves as a function of an input beside a state, on the rows that are looked at.
class Beside {
 public:
  Beside(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t joint,
         const InputColumn& along)
      : along_(along),
        evidence_(evidence),
        left_(what_is_left(work.design, state, kValuesSeen)),
        times_(1.0 / (left_.share * work.noise.design_effect)),
        seen_(seen_on(left_, evidence, state, times_)),
        motion_(left_.residual.size()) {
    for (const Eigen::Index i : left_.at) {
      const std::int32_t row = work.design.row[static_cast<std::size_t>(i)];
      const auto n = static_cast<Eigen::Index>(x_.size());
      motion_[n] = work.design.weight[i] * work.design.x(i, work.design.joint_column[joint][0]);
      x_.push_back(along_.values[static_cast<std::size_t>(row)]);
      if (rows_.empty() || rows_.back() != row) rows_.push_back(row);
    }
  }

  std::vector<double> knots(int most) const { return knots_of(along_, rows_, most); }

  /// What the function wins [nats]: `count` parameters times as many values, which `values` finds at an input.
  template <typename Values>
  double evidence_of(std::size_t count, const Values& values) const {
    const auto p = static_cast<Eigen::Index>(count);
    Eigen::MatrixXd columns(motion_.size(), p);
    Eigen::VectorXd at(p);
    for (Eigen::Index n = 0; n < motion_.size(); ++n) {
      values(x_[static_cast<std::size_t>(n)], at.data());
      columns.row(n) = motion_[n] * at;
    }
    const Eigen::MatrixXd spanned = left_.span.transpose() * columns;
    Eigen::MatrixXd a = columns.transpose() * columns;
    const Eigen::VectorXd own = 1e-9 * a.diagonal();
    a -= spanned.transpose() * spanned;
    a.diagonal() += own;
    const Eigen::VectorXd b = columns.transpose() * left_.residual;
    return evidence_.gain_of(seen_, times_ * a, times_ * b, Eigen::VectorXd::Constant(p, kLargest), 0.0).evidence;
  }

  double evidence_of_knots(int most) const {
    const std::vector<double> knots = this->knots(most);
    return evidence_of(knots.size(), [&](double x, double* out) { hats_at(knots, x, out); });
  }

  /// A constant and waves of the first orders of an angle.
  double evidence_of_waves() const {
    constexpr int kOrder = 3;
    return evidence_of(1 + 2 * kOrder, [](double q, double* out) {
      *out++ = 1.0;
      for (int k = 1; k <= kOrder; ++k) {
        *out++ = std::cos(k * q);
        *out++ = std::sin(k * q);
      }
    });
  }

 private:
  const InputColumn& along_;
  const Evidence& evidence_;
  const Left left_;
  const double times_;
  const Evidence::State seen_;
  Eigen::VectorXd motion_;  // of the tip by the joint, weighted
  std::vector<double> x_;
  std::vector<std::int32_t> rows_;
};

double best_shape(const Beside& beside) {
  const std::vector<double> places = beside.knots(kPlaces);
  if (places.size() < 5) return -1e300;  // levels, not a curve
  const std::vector<Shape> shapes = shapes_of(places);
  double best = -1e300;
  for (const Shape& shape : shapes)
    best = std::max(best, beside.evidence_of(1, [&](double x, double* out) { *out = shape.at(x); }));
  return best - std::log(static_cast<double>(shapes.size()));
}

}  // namespace

double best_local_shape(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t joint,
                        int input) {
  return best_shape(Beside(work, evidence, state, joint, work.inputs[static_cast<std::size_t>(input)]));
}

bool is_smooth(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t joint, int angle) {
  const Beside beside(work, evidence, state, joint, work.inputs[static_cast<std::size_t>(angle)]);
  const double by_waves = beside.evidence_of_waves();
  return by_waves > beside.evidence_of_knots(kKnots) && by_waves > beside.evidence_of_knots(kFineKnots) &&
         by_waves > best_shape(beside);
}

double best_function(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t joint,
                     int angle) {
  const Beside beside(work, evidence, state, joint, work.inputs[static_cast<std::size_t>(angle)]);
  return std::max({beside.evidence_of_waves(), beside.evidence_of_knots(kKnots), beside.evidence_of_knots(kFineKnots)});
}

double best_function_of(const InputColumn& along, const Work& work, const Evidence& evidence,
                        const Evidence::State& state, std::size_t joint) {
  const Beside beside(work, evidence, state, joint, along);
  return std::max(beside.evidence_of_knots(kKnots), beside.evidence_of_knots(kFineKnots));
}

}  // namespace truing::diagnosis
