// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/where.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "diagnosis/free_search.hpp"
#include "estimation/evidence.hpp"
#include "math/batch.hpp"
#include "math/linear_algebra.hpp"
#include "math/random.hpp"
#include "math/statistics.hpp"

namespace truing::diagnosis {
namespace {

constexpr std::size_t kResamples = 24;
constexpr std::size_t kMostValues = 6000;

/// Gram of the nuisance columns and some free functions, of the rows `at` that are in a fold; -1: in any.
Gram gram_with(const Design& design, const Design::Rows& more, const std::vector<Eigen::Index>& at,
               double design_effect, int fold, GramSum* sum) {
  const auto nuisance = static_cast<Eigen::Index>(design.nuisance.size()), p = nuisance + more.cols();
  for (std::size_t n = 0; n < at.size(); ++n) {
    const Eigen::Index i = at[n];
    if (fold >= 0 && design.fold[static_cast<std::size_t>(i)] != fold) continue;
    double* out = sum->row();
    for (Eigen::Index k = 0; k < nuisance; ++k)
      out[k] = design.weight[i] * design.x(i, design.nuisance[static_cast<std::size_t>(k)]);
    for (Eigen::Index k = 0; k < more.cols(); ++k)
      out[nuisance + k] = design.weight[i] * more(static_cast<Eigen::Index>(n), k);
    out[p] = design.weight[i] * design.y[i];
    sum->push();
  }
  Gram out;
  out.add(sum->finish(), 1.0 / design_effect);
  return out;
}

/// Columns of free functions of each of some inputs at each of some sites, on the rows `at` of the design.
Design::Rows functions_of(const Design& design, const std::vector<InputColumn>& inputs,
                          const std::vector<Eigen::Index>& at, const std::vector<int>& sites,
                          const std::vector<int>& which, int most_knots) {
  std::vector<std::int32_t> rows;
  for (const Eigen::Index i : at) rows.push_back(design.row[static_cast<std::size_t>(i)]);
  std::vector<Design::Rows> parts;
  Eigen::Index columns = 0;
  for (const int input : which) {
    const std::vector<double>& values = inputs[static_cast<std::size_t>(input)].values;
    const std::vector<double> knots = knots_of(inputs[static_cast<std::size_t>(input)], rows, most_knots);
    if (knots.size() < 2) continue;
    Design::Rows part(static_cast<Eigen::Index>(at.size()), static_cast<Eigen::Index>(sites.size() * knots.size()));
    std::vector<double> hats(knots.size());
    for (std::size_t n = 0; n < at.size(); ++n) {
      hats_at(knots, values[static_cast<std::size_t>(rows[n])], hats.data());
      Eigen::Index c = 0;
      for (const int site : sites) {
        for (const double hat : hats) part(static_cast<Eigen::Index>(n), c++) = hat * design.x(at[n], site);
      }
    }
    columns += part.cols();
    parts.push_back(std::move(part));
  }
  Design::Rows all(static_cast<Eigen::Index>(at.size()), columns);
  Eigen::Index c = 0;
  for (const Design::Rows& part : parts) {
    all.middleCols(c, part.cols()) = part;
    c += part.cols();
  }
  return all;
}

/// Sum of squares that the nuisance alone leaves, less what is left with the free functions, and what those cost in
/// noise.
double explained(const Gram& gram, Eigen::Index nuisance, double* closable) {
  Eigen::MatrixXd d = gram.xx;
  const Eigen::Index p = d.rows();
  const Eigen::MatrixXd base =
      d.topLeftCorner(nuisance, nuisance) + (1e-10 * d.diagonal().head(nuisance)).asDiagonal().toDenseMatrix();
  const double before =
      gram.yy - gram.xy.head(nuisance).dot(solve_symmetric<Eigen::Dynamic, 1>(base, gram.xy.head(nuisance)));
  Eigen::VectorXd precision = 1e-10 * d.diagonal();
  precision.tail(p - nuisance).array() += 1.0 / (1e-3 * 1e-3);
  d.diagonal() += precision;
  const Eigen::LLT<Eigen::MatrixXd> factor = factorised(std::move(d));
  const double after = gram.yy - gram.xy.dot(factor.solve(gram.xy));
  // The trace of A^-1 (A - P) with a diagonal P.
  const double used = static_cast<double>(p - nuisance) - precision.dot(diagonal_of_inverse(factor));
  const double noise = after / std::max(1.0, gram.n - static_cast<double>(nuisance) - used);
  *closable = std::max(before - noise * std::max(1.0, gram.n - static_cast<double>(nuisance)), 1e-300);
  return std::max(0.0, before - after - used * noise);
}

Share share_of(const Design& design, const Design::Rows& more, const std::vector<Eigen::Index>& at,
               double design_effect, double closable, std::uint64_t seed, int threads) {
  const auto nuisance = static_cast<Eigen::Index>(design.nuisance.size());
  GramSum sum(nuisance + more.cols());
  std::vector<Gram> folds;
  for (int fold = 0; fold < design.folds; ++fold)
    folds.push_back(gram_with(design, more, at, design_effect, fold, &sum));
  Gram all;
  for (const Gram& fold : folds) all.add(fold);
  double own = 0.0;
  Share out;
  out.value = explained(all, nuisance, &own) / closable;
  Random random(seed);
  std::vector<std::vector<double>> times(kResamples, std::vector<double>(folds.size(), 0.0));
  for (std::vector<double>& of_draw : times)
    for (std::size_t k = 0; k < folds.size(); ++k) of_draw[random.below(folds.size())] += 1.0;
  std::vector<double> values(times.size());
  const auto work = [&](std::size_t r) {
    Gram drawn;
    for (std::size_t k = 0; k < folds.size(); ++k) {
      if (times[r][k] > 0.0) drawn.add(folds[k], times[r][k]);
    }
    double closable_of_draw = 0.0;
    values[r] = explained(drawn, nuisance, &closable_of_draw) / closable;
  };
  for_each_on_threads(times.size(), threads, {}, work, 1);
  out.value = std::min(1.0, out.value);
  out.low = std::clamp(std::min(out.value, quantile(&values, 0.05)), 0.0, 1.0);
  out.high = std::clamp(std::max(out.value, quantile(&values, 0.95)), 0.0, 1.0);
  return out;
}

}  // namespace

void share_out(const Design& design, const std::vector<InputColumn>& inputs, const Robot& robot, double design_effect,
               std::uint64_t seed, int threads, Diagnosis* out) {
  constexpr std::size_t kMostMoving = 20;
  const std::vector<Eigen::Index> at = some_training_rows(design, kMostValues).at;
  const auto nuisance = static_cast<Eigen::Index>(design.nuisance.size());
  std::vector<int> moving;
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    if (!inputs[k].constant && !is_torque(inputs[k]) && moving.size() < kMostMoving)
      moving.push_back(static_cast<int>(k));
  }
  std::vector<int> every_site;
  for (const std::vector<int>& columns : design.joint_column)
    every_site.insert(every_site.end(), columns.begin(), columns.end());
  const auto gram_at_every_site = [&](const std::vector<int>& which, int most_knots) {
    const Design::Rows functions = functions_of(design, inputs, at, every_site, which, most_knots);
    GramSum sum(nuisance + functions.cols());
    return gram_with(design, functions, at, design_effect, -1, &sum);
  };
  // What is closable at all: every joint by its own motion and direction, and by torque, together.
  double closable = 0.0, own = 0.0;
  explained(gram_at_every_site(moving, 3), nuisance, &closable);
  for (std::size_t joint = 0; joint < robot.joints.size(); ++joint) {
    const Design::Rows functions = functions_of(design, inputs, at, design.joint_column[joint], moving, 5);
    out->where_joints.push_back(
        {robot.joints[joint].name, share_of(design, functions, at, design_effect, closable, seed + joint, threads)});
  }
  for (const int input : moving) {
    const double share = explained(gram_at_every_site({input}, 5), nuisance, &own) / closable;
    out->where_inputs.push_back({inputs[static_cast<std::size_t>(input)].name, std::min(1.0, share)});
  }
  std::stable_sort(out->where_joints.begin(), out->where_joints.end(),
                   [](const WhereJoint& a, const WhereJoint& b) { return a.share.value > b.share.value; });
  std::stable_sort(out->where_inputs.begin(), out->where_inputs.end(),
                   [](const WhereInput& a, const WhereInput& b) { return a.share > b.share; });
}

void map_workspace(const Robot& robot, const Measurements& data, const Residuals& residuals, Diagnosis* out) {
  const Eigen::Isometry3d base_from_measurement = robot.T_measurement_base.inverse();
  std::vector<Eigen::Vector3d> places, errors;
  for (std::size_t row = 0; row < data.rows; ++row) {
    const Eigen::Vector3d e = residuals.position.row(static_cast<Eigen::Index>(row)).transpose();
    if (!e.allFinite() || !data.has_position(row)) continue;
    places.push_back(base_from_measurement *
                     Eigen::Vector3d(data.position[0][row], data.position[1][row], data.position[2][row]));
    errors.push_back(base_from_measurement.linear() * e);
  }
  if (places.size() < 3) return;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& e : errors) covariance += e * e.transpose() / static_cast<double>(errors.size());
  const SymmetricEigen<3> axes = symmetric_eigen<3>(covariance);
  out->direction = axes.vectors.rowwise().reverse();
  out->direction_rms = axes.values.reverse().cwiseMax(0.0).cwiseSqrt();
  Eigen::Vector3d low = places[0], high = places[0];
  for (const Eigen::Vector3d& p : places) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // Cubes, six along the longest side.
  const double side = std::max((high - low).maxCoeff() / 6.0, 1e-6);
  struct Cell {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    double squares = 0.0;
    std::size_t n = 0;
  };
  std::map<std::array<int, 3>, Cell> cells;
  for (std::size_t k = 0; k < places.size(); ++k) {
    std::array<int, 3> key{};
    for (int axis = 0; axis < 3; ++axis)
      key[static_cast<std::size_t>(axis)] = static_cast<int>((places[k][axis] - low[axis]) / side);
    Cell& cell = cells[key];
    cell.place += places[k];
    cell.squares += errors[k].squaredNorm();
    ++cell.n;
  }
  for (const auto& [key, cell] : cells) {
    const Eigen::Vector3d center = cell.place / static_cast<double>(cell.n);
    out->workspace.push_back(
        {{center.x(), center.y(), center.z()}, std::sqrt(cell.squares / static_cast<double>(cell.n)), cell.n});
  }
}

double neighbour_share(const Measurements& data, const std::vector<std::int8_t>& set, const Residuals& residuals,
                       double* p95) {
  constexpr std::size_t kMost = 1500;  // poses of each part that are compared
  constexpr std::size_t kNeighbours = 4;
  const std::size_t joints = data.joints.size();
  std::vector<std::size_t> train, test;
  const auto has = [&](std::size_t row) { return residuals.position.row(static_cast<Eigen::Index>(row)).allFinite(); };
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (has(row)) (set[row] ? test : train).push_back(row);
  }
  const auto thin = [](std::vector<std::size_t>* rows) {
    const std::size_t step = rows->size() / kMost + 1;
    std::vector<std::size_t> kept;
    for (std::size_t k = 0; k < rows->size(); k += step) kept.push_back((*rows)[k]);
    *rows = std::move(kept);
  };
  thin(&train);
  thin(&test);
  if (train.size() < 30 || test.size() < 10) return 0.0;
  std::vector<double> scale(joints, 0.0);
  for (std::size_t k = 0; k < joints; ++k) {
    std::vector<double> values;
    for (const std::size_t row : train) values.push_back(data.joints[k][row]);
    std::vector<double> copy = values;
    const double spread = quantile(&values, 0.9) - quantile(&copy, 0.1);
    scale[k] = spread > 1e-3 ? 1.0 / spread : 0.0;
  }
  double before = 0.0, after = 0.0;
  std::vector<double> lengths;
  std::vector<std::pair<double, std::size_t>> near;
  for (const std::size_t row : test) {
    near.clear();
    for (const std::size_t other : train) {
      if (!data.target.empty() && data.target[other] != data.target[row]) continue;
      double distance = 0.0;
      for (std::size_t k = 0; k < joints; ++k) {
        const double d = scale[k] * (data.joints[k][row] - data.joints[k][other]);
        distance += d * d;
      }
      near.emplace_back(distance, other);
    }
    if (near.size() < kNeighbours) continue;
    std::nth_element(near.begin(), near.begin() + kNeighbours - 1, near.end());
    Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
    for (std::size_t k = 0; k < kNeighbours; ++k)
      mean += residuals.position.row(static_cast<Eigen::Index>(near[k].second)) / kNeighbours;
    const Eigen::RowVector3d e = residuals.position.row(static_cast<Eigen::Index>(row));
    before += e.squaredNorm();
    // A mean of neighbours is itself noisy: half of it is the better guess when they agree only in part.
    after += (e - 0.5 * mean).squaredNorm();
    lengths.push_back((e - 0.5 * mean).norm());
  }
  if (lengths.empty() || !(before > 0.0)) return 0.0;
  *p95 = quantile(&lengths, 0.95);
  return std::max(0.0, 1.0 - after / before);
}

}  // namespace truing::diagnosis
