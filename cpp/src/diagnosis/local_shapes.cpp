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

}  // namespace

double best_local_shape(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t joint,
                        int input) {
  const Design& design = work.design;
  const InputColumn& along = work.inputs[static_cast<std::size_t>(input)];
  const Left left = what_is_left(design, state, kValuesSeen);
  std::vector<std::int32_t> rows;
  for (const Eigen::Index i : left.at) {
    const std::int32_t row = design.row[static_cast<std::size_t>(i)];
    if (rows.empty() || rows.back() != row) rows.push_back(row);
  }
  const std::vector<double> places = knots_of(along, rows, kPlaces);
  if (places.size() < 5) return -1e300;  // levels, not a curve
  const std::vector<Shape> shapes = shapes_of(places);
  const double times = 1.0 / (left.share * work.noise.design_effect),
               cost = std::log(static_cast<double>(shapes.size()));
  const Evidence::State seen = seen_on(left, evidence, state, times);
  Eigen::VectorXd motion(left.residual.size()), column(left.residual.size());
  for (Eigen::Index n = 0; n < motion.size(); ++n) {
    const Eigen::Index i = left.at[static_cast<std::size_t>(n)];
    motion[n] = design.weight[i] * design.x(i, design.joint_column[joint][0]);
  }
  double best = -1e300;
  for (const Shape& shape : shapes) {
    for (Eigen::Index n = 0; n < column.size(); ++n) {
      const std::int32_t row = design.row[static_cast<std::size_t>(left.at[static_cast<std::size_t>(n)])];
      column[n] = motion[n] * shape.at(along.values[static_cast<std::size_t>(row)]);
    }
    const Eigen::VectorXd half = left.factor.matrixL().solve(left.columns.transpose() * column);
    const double own = column.squaredNorm();
    const Eigen::MatrixXd a = Eigen::MatrixXd::Constant(1, 1, std::max(own - half.squaredNorm(), 1e-9 * own) * times);
    const Eigen::VectorXd b = Eigen::VectorXd::Constant(1, column.dot(left.residual) * times);
    best = std::max(best, evidence.gain_of(seen, a, b, Eigen::VectorXd::Constant(1, kLargest), cost).score);
  }
  return best;
}

}  // namespace truing::diagnosis
