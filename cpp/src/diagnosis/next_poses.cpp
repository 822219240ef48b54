// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/next_poses.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include <Eigen/Cholesky>

#include "estimation/evaluate.hpp"
#include "math/random.hpp"
#include "math/text.hpp"

namespace truing::diagnosis {
namespace {

constexpr int kTried = 300;  ///< poses to choose from

/// Poses drawn within the joints' ranges (their limits, else what the data cover), both directions, light and full
/// payload.
struct Drawn {
  Measurements data;
  std::shared_ptr<std::vector<std::vector<double>>> columns;
};

Drawn draw(const Robot& robot, const Measurements& measured, std::uint64_t seed) {
  Drawn out;
  out.columns = std::make_shared<std::vector<std::vector<double>>>();
  Random random(seed);
  const auto add = [&](const auto& value) {
    std::vector<double> column(kTried);
    for (double& v : column) v = value();
    out.columns->push_back(std::move(column));
    return Column{out.columns->back().data(), 1};
  };
  const auto range = [&](const Column& column) {
    double low = column[0], high = column[0];
    for (std::size_t row = 1; row < measured.rows; ++row) {
      if (column[row] < low) low = column[row];
      if (column[row] > high) high = column[row];
    }
    return std::make_pair(low, high);
  };
  out.data.rows = kTried;
  const std::vector<std::size_t> driven = robot.driven_joints();
  for (std::size_t k = 0; k < driven.size(); ++k) {
    auto [low, high] = range(measured.joints[k]);
    const Joint& joint = robot.joints[driven[k]];
    if (std::isfinite(joint.lower) && std::isfinite(joint.upper)) {
      low = joint.lower;
      high = joint.upper;
    } else if (joint.type == JointType::revolute) {  // a little beyond what was driven to
      const double more = 0.25 * (high - low);
      low -= more;
      high += more;
    }
    out.data.joints.push_back(add([&, from = low, to = high] { return random.uniform(from, to); }));
  }
  for (std::size_t k = 0; k < measured.direction.size(); ++k)
    out.data.direction.push_back(add([&] { return random.next() & 1u ? 1.0 : -1.0; }));
  if (measured.payload) {
    const auto [low, high] = range(measured.payload);
    out.data.payload = add([&, from = low, to = std::max(high, low + 1.0)] { return random.next() & 1u ? to : from; });
  }
  if (measured.temperature) {
    const auto [low, high] = range(measured.temperature);
    const double middle = 0.5 * (low + high), half = std::max(0.5 * (high - low), 5.0);
    out.data.temperature = add([&, from = middle - half, to = middle + half] { return random.uniform(from, to); });
  }
  if (measured.time) {
    const auto [low, high] = range(measured.time);
    out.data.time = add([&, from = low, to = high] { return random.uniform(from, to); });
  }
  for (const Column& column : measured.joint_speed) {
    const auto [low, high] = range(column);
    out.data.joint_speed.push_back(add([&, from = low, to = high] { return random.uniform(from, to); }));
  }
  return out;
}

}  // namespace

std::vector<NextPose> next_poses(const Robot& robot, const Measurements& measured, const Rivals& rivals,
                                 const DiagnoseOptions& options, int count, double noise_sigma) {
  Drawn drawn = draw(robot, measured, options.seed + 23);
  Measurements& data = drawn.data;
  Robot plain = robot;
  plain.effects.clear();
  const Prediction predicted = predict(plain, data, {}, 1);
  for (std::size_t k = 0; k < 3; ++k) data.position[k] = {predicted.position.data() + k, 3};

  std::vector<EffectRequest> requests = rivals.first.requests;
  for (const EffectRequest& request : rivals.other.requests) {
    const bool there = std::any_of(requests.begin(), requests.end(), [&](const EffectRequest& r) {
      return r.effect == request.effect && r.joints == request.joints;
    });
    if (!there) requests.push_back(request);
  }
  std::vector<int> free;
  std::vector<std::vector<double>> bases;
  Model model;
  try {
    model = make_model(plain, data, requests, options.own_effects);
    bases = make_bases(model, data);
  } catch (const std::invalid_argument&) {
    return {};  // needs a column that cannot be drawn
  }
  // The first one's motion of the tip, and all that could take it up: base, tool and the rival.
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const auto is_of = [&](const Rivals::Side& side) {
      return std::find(side.parameters.begin(), side.parameters.end(), info.name) != side.parameters.end();
    };
    const bool frame = info.role == Role::base || (info.role == Role::target && info.owner == 0 && !info.rotation);
    if (frame || is_of(rivals.first) || is_of(rivals.other)) free.push_back(static_cast<int>(k));
  }
  std::vector<std::int32_t> rows(data.rows);
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = static_cast<std::int32_t>(k);
  const Evaluator evaluator(model, data, bases, make_segments(data, rows), free, 1);
  const Eigen::VectorXd values = initial_values(model);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> j(3 * kTried,
                                                                           static_cast<Eigen::Index>(free.size()));
  Eigen::VectorXd r(3 * kTried);
  int row = 0;
  Weighing plain_weighing;
  plain_weighing.row_weights = false;
  for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
    evaluator.tile(tile, values, plain_weighing, r.data() + 3 * row,
                   j.data() + static_cast<std::ptrdiff_t>(3 * row) * j.cols());
    row += evaluator.tile_rows(tile);
  }
  Eigen::VectorXd signal = Eigen::VectorXd::Zero(j.rows());
  std::vector<int> others;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const std::string& name = model.parameters[static_cast<std::size_t>(free[k])].name;
    const auto mine = rivals.parameters.find(name);
    if (mine != rivals.parameters.end() && std::isfinite(mine->second))
      signal += mine->second * j.col(static_cast<Eigen::Index>(k));
    else
      others.push_back(static_cast<int>(k));
  }
  Eigen::MatrixXd x(j.rows(), static_cast<Eigen::Index>(others.size()));
  for (Eigen::Index k = 0; k < x.cols(); ++k) x.col(k) = j.col(others[static_cast<std::size_t>(k)]);
  const Eigen::VectorXd size =
      (x.colwise().squaredNorm() / static_cast<double>(x.rows())).cwiseSqrt().cwiseMax(1e-30).transpose();
  for (Eigen::Index k = 0; k < x.cols(); ++k) x.col(k) /= size[k];

  // Greedy: the pose where the rival, fitted to the first on what is chosen already, still differs most from it.
  Eigen::MatrixXd information = 1e-3 * Eigen::MatrixXd::Identity(x.cols(), x.cols());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(x.cols());
  std::vector<int> chosen;
  std::vector<NextPose> out;
  // On poses like these in any number the rival follows as far as it can: start from there.
  const Eigen::MatrixXd everywhere = x.transpose() * x / 50.0;
  information += everywhere;
  right += x.transpose() * signal / 50.0;
  for (int n = 0; n < count; ++n) {
    const Eigen::VectorXd left = signal - x * information.ldlt().solve(right);
    int best = -1;
    double most = 0.0;
    for (int k = 0; k < kTried; ++k) {
      const double difference = left.segment<3>(3 * k).norm();
      if (difference > most && std::find(chosen.begin(), chosen.end(), k) == chosen.end()) {
        most = difference;
        best = k;
      }
    }
    if (best < 0 || most < 0.5 * noise_sigma) break;
    chosen.push_back(best);
    information += x.middleRows(3 * best, 3).transpose() * x.middleRows(3 * best, 3);
    right += x.middleRows(3 * best, 3).transpose() * signal.segment<3>(3 * best);
    NextPose pose;
    for (const Column& column : data.joints) pose.joints.push_back(column[static_cast<std::size_t>(best)]);
    for (const Column& column : data.direction)
      pose.direction.push_back(column[static_cast<std::size_t>(best)] > 0.0 ? 1 : -1);
    if (data.payload) pose.payload = data.payload[static_cast<std::size_t>(best)];
    pose.why = rivals.name + " and " + rivals.other_name + " differ here by " + number(1e3 * most, 2) + " mm, " +
               number(most / std::max(noise_sigma, 1e-12), 2) + " times the noise";
    out.push_back(std::move(pose));
  }
  return out;
}

}  // namespace truing::diagnosis
