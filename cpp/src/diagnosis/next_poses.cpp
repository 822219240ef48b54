// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/next_poses.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/evaluate.hpp"
#include "math/linear_algebra.hpp"
#include "math/random.hpp"
#include "math/text.hpp"
#include "model/model.hpp"

namespace truing::diagnosis {
namespace {

constexpr int kTried = 300;  ///< poses to choose from

/// Poses drawn within the joints' ranges (their limits, else what the data cover), both directions, light and full
/// payload.
class Drawn {
 public:
  Drawn(const Robot& robot, const Measurements& measured, std::uint64_t seed) : random_(seed) {
    data.rows = kTried;
    draw_joints(robot, measured);
    draw_inputs(measured);
    Robot plain = robot;
    plain.effects.clear();
    predicted_ = predict(plain, data, {}, 1);
    for (std::size_t k = 0; k < 3; ++k) data.position[k] = {predicted_.position.data() + k, 3};
  }
  Drawn(const Drawn&) = delete;
  Drawn& operator=(const Drawn&) = delete;

  Measurements data;

 private:
  template <typename Value>
  Column add(const Value& value) {
    std::vector<double> column(kTried);
    for (double& v : column) v = value();
    columns_.push_back(std::move(column));
    return Column{columns_.back().data(), 1};  // a vector keeps its memory when it is moved
  }
  Column uniform(double low, double high) {
    return add([&] { return random_.uniform(low, high); });
  }
  Column either(double one, double other) {
    return add([&] { return random_.next() & 1u ? one : other; });
  }

  static std::pair<double, double> range(const Column& column, std::size_t rows) {
    double low = column[0], high = column[0];
    for (std::size_t row = 1; row < rows; ++row) {
      if (column[row] < low) low = column[row];
      if (column[row] > high) high = column[row];
    }
    return {low, high};
  }

  void draw_joints(const Robot& robot, const Measurements& measured) {
    const std::vector<std::size_t> driven = robot.driven_joints();
    for (std::size_t k = 0; k < driven.size(); ++k) {
      auto [low, high] = range(measured.joints[k], measured.rows);
      const Joint& joint = robot.joints[driven[k]];
      if (std::isfinite(joint.lower) && std::isfinite(joint.upper)) {
        low = joint.lower;
        high = joint.upper;
      } else if (joint.type == JointType::revolute) {  // a little beyond what was driven to
        const double more = 0.25 * (high - low);
        low -= more;
        high += more;
      }
      data.joints.push_back(uniform(low, high));
    }
  }

  void draw_inputs(const Measurements& measured) {
    for (std::size_t k = 0; k < measured.direction.size(); ++k) data.direction.push_back(either(1.0, -1.0));
    if (measured.payload) {
      const auto [low, high] = range(measured.payload, measured.rows);
      data.payload = either(std::max(high, low + 1.0), low);
    }
    if (measured.temperature) {
      const auto [low, high] = range(measured.temperature, measured.rows);
      const double middle = 0.5 * (low + high), half = std::max(0.5 * (high - low), 5.0);
      data.temperature = uniform(middle - half, middle + half);
    }
    if (measured.time) {
      const auto [low, high] = range(measured.time, measured.rows);
      data.time = uniform(low, high);
    }
    for (const Column& column : measured.joint_speed) {
      const auto [low, high] = range(column, measured.rows);
      data.joint_speed.push_back(uniform(low, high));
    }
  }

  Random random_;
  std::vector<std::vector<double>> columns_;
  Prediction predicted_;
};

/// Effects of both, each once.
std::vector<EffectRequest> requests_of(const Rivals& rivals) {
  std::vector<EffectRequest> requests = rivals.first.requests;
  for (const EffectRequest& request : rivals.other.requests) {
    const bool there = std::any_of(requests.begin(), requests.end(), [&](const EffectRequest& r) {
      return r.effect == request.effect && r.joints == request.joints;
    });
    if (!there) requests.push_back(request);
  }
  return requests;
}

/// The first one's motion of the tip at every drawn pose, and the columns of all that could take it up: base, tool and
/// the rival.
struct Motion {
  Eigen::VectorXd signal;
  Eigen::MatrixXd others;  ///< of unit rms
};

std::vector<int> parameters_of(const Model& model, const Rivals& rivals) {
  std::vector<int> free;
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const auto is_of = [&](const Rivals::Side& side) {
      return std::find(side.parameters.begin(), side.parameters.end(), info.name) != side.parameters.end();
    };
    const bool frame = info.role == Role::base || (info.role == Role::target && info.owner == 0 && !info.rotation);
    if (frame || is_of(rivals.first) || is_of(rivals.other)) free.push_back(static_cast<int>(k));
  }
  return free;
}

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Rows positions_jacobian(const Model& model, const Measurements& data, const std::vector<int>& free) {
  const std::vector<std::vector<double>> bases = make_bases(model, data);
  std::vector<std::int32_t> rows(data.rows);
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = static_cast<std::int32_t>(k);
  const Evaluator evaluator(model, data, bases, make_segments(data, rows), free, 1);
  const Eigen::VectorXd values = initial_values(model);
  Rows j(3 * kTried, static_cast<Eigen::Index>(free.size()));
  Eigen::VectorXd r(3 * kTried);
  int row = 0;
  Weighing plain_weighing;
  plain_weighing.row_weights = false;
  for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
    evaluator.tile(tile, values, plain_weighing, r.data() + 3 * row,
                   j.data() + static_cast<std::ptrdiff_t>(3 * row) * j.cols());
    row += evaluator.tile_rows(tile);
  }
  return j;
}

Motion motion_of(const Model& model, const Measurements& data, const Rivals& rivals) {
  const std::vector<int> free = parameters_of(model, rivals);
  const Rows j = positions_jacobian(model, data, free);
  Motion out;
  out.signal = Eigen::VectorXd::Zero(j.rows());
  std::vector<int> others;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const std::string& name = model.parameters[static_cast<std::size_t>(free[k])].name;
    const auto mine = rivals.parameters.find(name);
    if (mine != rivals.parameters.end() && std::isfinite(mine->second))
      out.signal += mine->second * j.col(static_cast<Eigen::Index>(k));
    else
      others.push_back(static_cast<int>(k));
  }
  Eigen::MatrixXd& x = out.others;
  x.resize(j.rows(), static_cast<Eigen::Index>(others.size()));
  for (Eigen::Index k = 0; k < x.cols(); ++k) x.col(k) = j.col(others[static_cast<std::size_t>(k)]);
  const Eigen::VectorXd size =
      (x.colwise().squaredNorm() / static_cast<double>(x.rows())).cwiseSqrt().cwiseMax(1e-30).transpose();
  for (Eigen::Index k = 0; k < x.cols(); ++k) x.col(k) /= size[k];
  return out;
}

/// A pose of those drawn, and how far the two differ there [m].
struct Telling {
  int pose;
  double difference;
};

/// Greedy: the pose where the rival, fitted to the first on what is chosen already, still differs most from it.
std::vector<Telling> most_telling(const Motion& motion, int count, double least) {
  const Eigen::MatrixXd& x = motion.others;
  Eigen::MatrixXd information = 1e-3 * Eigen::MatrixXd::Identity(x.cols(), x.cols());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(x.cols());
  // On poses like these in any number the rival follows as far as it can: start from there.
  const Eigen::MatrixXd everywhere = x.transpose() * x / 50.0;
  information += everywhere;
  right += x.transpose() * motion.signal / 50.0;
  std::vector<Telling> chosen;
  for (int n = 0; n < count; ++n) {
    const Eigen::VectorXd left = motion.signal - x * solve_symmetric<Eigen::Dynamic, 1>(information, right);
    Telling best{-1, 0.0};
    for (int k = 0; k < kTried; ++k) {
      const double difference = left.segment<3>(3 * k).norm();
      const bool taken = std::any_of(chosen.begin(), chosen.end(), [k](const Telling& t) { return t.pose == k; });
      if (difference > best.difference && !taken) best = {k, difference};
    }
    if (best.pose < 0 || best.difference < least) break;
    chosen.push_back(best);
    const auto rows = x.middleRows(3 * best.pose, 3);
    information += rows.transpose() * rows;
    right += rows.transpose() * motion.signal.segment<3>(3 * best.pose);
  }
  return chosen;
}

}  // namespace

std::vector<NextPose> next_poses(const Robot& robot, const Measurements& measured, const Rivals& rivals,
                                 const DiagnoseOptions& options, int count, double noise_sigma) {
  const Drawn drawn(robot, measured, options.seed + 23);
  const Measurements& data = drawn.data;
  Robot plain = robot;
  plain.effects.clear();
  Motion motion;
  try {
    motion = motion_of(make_model(plain, data, requests_of(rivals), options.own_effects), data, rivals);
  } catch (const std::invalid_argument&) {
    return {};  // needs a column that cannot be drawn
  }
  std::vector<NextPose> out;
  for (const Telling& telling : most_telling(motion, count, 0.5 * noise_sigma)) {
    const auto row = static_cast<std::size_t>(telling.pose);
    NextPose pose;
    for (const Column& column : data.joints) pose.joints.push_back(column[row]);
    for (const Column& column : data.direction) pose.direction.push_back(column[row] > 0.0 ? 1 : -1);
    if (data.payload) pose.payload = data.payload[row];
    pose.why = rivals.name + " and " + rivals.other_name + " differ here by " + number(1e3 * telling.difference, 2) +
               " mm, " + number(telling.difference / std::max(noise_sigma, 1e-12), 2) + " times the noise";
    out.push_back(std::move(pose));
  }
  return out;
}

}  // namespace truing::diagnosis
