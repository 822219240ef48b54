// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "truing/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "estimation/evaluate.hpp"
#include "estimation/selection.hpp"
#include "math/observability.hpp"
#include "math/random.hpp"
#include "planning/poses.hpp"
#include "rooms.hpp"

namespace truing {
using namespace planning;

namespace planning {
namespace {

constexpr int kRankPoses = 1000;  // random poses that decide what any plan could see
constexpr int kDraws = 200;       // for one joint, before a proposal is given up

}  // namespace

std::vector<Range> joint_ranges(const Robot& robot, double min_step, double min_step_prismatic, const char* who) {
  std::vector<Range> ranges;
  for (const std::size_t k : robot.driven_joints()) {
    const Joint& joint = robot.joints[k];
    const bool revolute = joint.type == JointType::revolute;
    if (!revolute && !(std::isfinite(joint.lower) && std::isfinite(joint.upper))) {
      throw std::invalid_argument(std::string(who) + ": prismatic joint " + joint.name + " needs limits");
    }
    Range range{std::isfinite(joint.lower) ? joint.lower : -M_PI, std::isfinite(joint.upper) ? joint.upper : M_PI,
                revolute ? min_step : min_step_prismatic};
    if (range.upper - range.lower <= 2.0 * range.step) {
      throw std::invalid_argument(std::string(who) + ": the range of joint " + joint.name +
                                  " is too small for steps of more than " + std::to_string(range.step) +
                                  (revolute ? " rad" : " m") + " between any two neighbours: lower min_step");
    }
    ranges.push_back(range);
  }
  return ranges;
}

namespace {

/// Passive joints keep their limits too.
bool passive_joints_within(const Robot& robot, const Model& model, const Pose& pose) {
  for (std::size_t m = 0; m < robot.joints.size(); ++m) {
    if (!robot.joints[m].passive()) continue;
    const int own_site = model.coordinates[m].sites.front().first;
    double motion = 0.0;
    for (std::size_t k = 0; k < robot.joints.size(); ++k) {
      const Coordinate& driver = model.coordinates[k];
      if (driver.reading < 0) continue;
      for (const auto& [site, weight] : driver.sites) {
        if (site == own_site) motion += weight * pose[driver.reading];
      }
    }
    if (motion < robot.joints[m].lower || motion > robot.joints[m].upper) return false;
  }
  return true;
}

}  // namespace

bool draw_pose(const Robot& robot, const Model& model, const std::vector<Range>& ranges, const Pose* before,
               const Pose* after, Random* random, Pose* out) {
  for (int attempt = 0; attempt < kDraws; ++attempt) {
    bool found = true;
    for (std::size_t k = 0; k < ranges.size() && found; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      found = false;
      for (int draw = 0; draw < kDraws && !found; ++draw) {
        (*out)[i] = random->uniform(ranges[k].lower, ranges[k].upper);
        const auto far_from = [&](const Pose* other) {
          return !other || std::abs((*out)[i] - (*other)[i]) > ranges[k].step;
        };
        found = far_from(before) && far_from(after);
      }
    }
    if (found && passive_joints_within(robot, model, *out)) return true;
  }
  return false;
}

namespace {

/// Poses as measurements of the robot itself: only their Jacobian is wanted, at errors of zero.
class Poses {
 public:
  Poses(const Robot& robot, const std::vector<Pose>& poses, bool orientation)
      : columns_(static_cast<std::size_t>(poses.empty() ? 0 : poses[0].size())) {
    data.rows = poses.size();
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      for (const Pose& pose : poses) columns_[k].push_back(pose[static_cast<Eigen::Index>(k)]);
      data.joints.push_back({columns_[k].data(), 1});
    }
    Robot plain = robot;
    plain.effects.clear();
    predicted_ = predict(plain, data, {}, 1);
    for (std::size_t k = 0; k < 3; ++k) data.position[k] = {predicted_.position.data() + k, 3};
    for (std::size_t k = 0; k < 4 && orientation; ++k) data.orientation[k] = {predicted_.orientation.data() + k, 4};
  }
  Poses(const Poses&) = delete;
  Poses& operator=(const Poses&) = delete;

  std::vector<std::int32_t> rows() const {
    std::vector<std::int32_t> out(data.rows);
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = static_cast<std::int32_t>(k);
    return out;
  }

  Measurements data;

 private:
  std::vector<std::vector<double>> columns_;
  Prediction predicted_;
};

Weighing weighing_of(const PlanOptions& options) {
  Weighing weighing;
  weighing.position_scale = 1.0 / options.position_sigma;
  weighing.rotation_scale = 1.0 / options.rotation_sigma;
  return weighing;
}

/// Unit-weight Jacobian of every pose, shape (rows of a pose, parameters).
std::vector<Eigen::MatrixXd> jacobians(const Model& model, const std::vector<int>& free, const std::vector<Pose>& poses,
                                       const PlanOptions& options) {
  const Poses measured(model.robot, poses, options.orientation);
  const std::vector<std::vector<double>> bases = make_bases(model, measured.data);
  const Evaluator evaluator(model, measured.data, bases, make_segments(measured.data, measured.rows()), free, 1);
  const Eigen::VectorXd values = initial_values(model);
  std::vector<Eigen::MatrixXd> out;
  for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
    const int m = evaluator.tile_components(tile);
    Eigen::VectorXd r(evaluator.tile_rows(tile) * m);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> j(r.size(),
                                                                             static_cast<Eigen::Index>(free.size()));
    evaluator.tile(tile, values, weighing_of(options), r.data(), j.data());
    for (int k = 0; k < evaluator.tile_rows(tile); ++k) out.push_back(j.middleRows(k * m, m));
  }
  return out;
}

/// The index of an information matrix of unit-scaled parameters; larger is better.
double index_of(const Eigen::MatrixXd& information, Observability kind) {
  if (kind == Observability::d_optimal) {
    const Eigen::LLT<Eigen::MatrixXd> factor(information);
    if (factor.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
    return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
  }
  const Eigen::VectorXd eigen =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(information, Eigen::EigenvaluesOnly).eigenvalues();
  const double least = std::max(eigen.minCoeff(), 0.0), most = eigen.maxCoeff();
  switch (kind) {
    case Observability::a_optimal:
      return least > 0.0 ? -eigen.cwiseInverse().sum() : -std::numeric_limits<double>::infinity();
    case Observability::e_optimal:
      return std::sqrt(least);
    case Observability::inverse_condition:
      return std::sqrt(least / most);
    default:
      return least / std::sqrt(most);  // noise amplification
  }
}

/// A plan on its way: what it shall see, its poses, and their information matrix.
class Planner {
 public:
  Planner(const Robot& robot, const PlanOptions& options)
      : robot_(robot),
        options_(options),
        ranges_(joint_ranges(robot, options.min_step, options.min_step_prismatic, "plan")),
        random_(options.seed) {}

  /// Random poses tell what any plan can see.
  void find_what_can_be_seen() {
    ParameterSelection wanted;
    wanted.free = options_.free;
    wanted.effects = options_.effects;
    const Poses measured(robot_, draw_sample(), options_.orientation);
    model_ = make_model(robot_, measured.data, options_.effects);
    const std::vector<Segment> segments = make_segments(measured.data, measured.rows());
    const std::vector<int> free = select_free(model_, content_of(model_, segments), wanted);
    if (free.empty()) throw std::invalid_argument("plan: nothing is free");
    const std::vector<std::vector<double>> bases = make_bases(model_, measured.data);
    const Evaluator evaluator(model_, measured.data, bases, segments, free, 1);
    NormalEquations normal;
    evaluator.normal_equations(initial_values(model_), weighing_of(options_), &normal);
    clear_rounding(measured.rows().size(), &normal.gram);
    std::vector<int> priority;
    for (const int k : free) priority.push_back(priority_of(model_.parameters[k].role));
    selection_ = observable(model_, free, find_rank(normal.gram, priority, IdentifyOptions().rank_tolerance));
    const int values = options_.poses * (options_.orientation ? 6 : 3);
    if (values <= parameters()) {
      throw std::invalid_argument("plan: " + std::to_string(options_.poses) + " poses give " + std::to_string(values) +
                                  " values for " + std::to_string(parameters()) + " parameters: ask for more poses");
    }
  }

  /// What moves the tip by rounding alone is not seen, however well the rounding can be told from everything else.
  void clear_rounding(std::size_t rows, Eigen::MatrixXd* gram) const {
    const double least = std::pow(kRounding / options_.position_sigma, 2.0) * static_cast<double>(rows);
    for (Eigen::Index k = 0; k < gram->rows(); ++k) {
      if ((*gram)(k, k) >= least) continue;
      gram->row(k).setZero();
      gram->col(k).setZero();
    }
  }

  /// A random plan that keeps the rule between neighbours.
  void draw_plan() {
    for (int k = 0; k < options_.poses; ++k) {
      Pose pose(joints());
      if (!draw_pose(robot_, model_, ranges_, k ? &poses_.back() : nullptr, nullptr, &random_, &pose)) {
        throw std::invalid_argument(
            "plan: no pose is further than min_step from its neighbour in every joint: lower min_step");
      }
      poses_.push_back(pose);
    }
    rows_ = jacobians(model_, selection_.fitted, poses_, options_);
    information_ = Eigen::MatrixXd::Zero(parameters(), parameters());
    for (const Eigen::MatrixXd& j : rows_) information_.noalias() += j.transpose() * j;
    unit_ = information_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  }

  /// Exchange (Fedorov 1972): each pose in turn gives way to the proposal that raises the index most.
  void exchange(PlanResult* result) {
    result->index_start = index_of(scaled(information_), options_.index);
    double best = result->index_start;
    for (int sweep = 0; sweep < options_.sweeps; ++sweep) {
      const int exchanged_before = result->exchanges;
      for (int k = 0; k < options_.poses; ++k) result->exchanges += exchange_pose(k, &best) ? 1 : 0;
      if (result->exchanges == exchanged_before) break;
    }
    result->index_end = best;
  }

  void hand_out(PlanResult* result) const {
    result->joints.resize(options_.poses, joints());
    for (int k = 0; k < options_.poses; ++k) result->joints.row(k) = poses_[k];
    const Eigen::MatrixXd covariance = inverse_of(information_);
    const Eigen::VectorXd values = initial_values(model_);
    for (Eigen::Index k = 0; k < parameters(); ++k) {
      const int parameter = selection_.fitted[static_cast<std::size_t>(k)];
      const ParameterInfo& info = model_.parameters[parameter];
      result->parameters.push_back(
          {info.name, values[parameter], values[parameter], std::sqrt(covariance(k, k)), info.unit, false});
    }
    result->frozen = selection_.frozen;
  }

 private:
  Eigen::Index joints() const { return static_cast<Eigen::Index>(ranges_.size()); }
  Eigen::Index parameters() const { return static_cast<Eigen::Index>(selection_.fitted.size()); }

  /// In units of what the random plan sees of each parameter.
  Eigen::MatrixXd scaled(const Eigen::MatrixXd& m) const { return unit_.asDiagonal() * m * unit_.asDiagonal(); }

  std::vector<Pose> draw_sample() {
    std::vector<Pose> sample;
    const Model bare = make_model(robot_, Measurements{});
    while (static_cast<int>(sample.size()) < kRankPoses) {
      Pose pose(joints());
      if (!draw_pose(robot_, bare, ranges_, nullptr, nullptr, &random_, &pose))
        throw std::invalid_argument("plan: no pose is within the limits of the passive joints");
      sample.push_back(pose);
    }
    return sample;
  }

  /// True: the pose gave way to a better one.
  bool exchange_pose(int k, double* best) {
    std::vector<Pose> proposals;
    for (int c = 0; c < options_.proposals; ++c) {
      Pose pose(joints());
      if (draw_pose(robot_, model_, ranges_, k ? &poses_[k - 1] : nullptr,
                    k + 1 < options_.poses ? &poses_[k + 1] : nullptr, &random_, &pose))
        proposals.push_back(pose);
    }
    if (proposals.empty()) return false;
    const std::vector<Eigen::MatrixXd> candidates = jacobians(model_, selection_.fitted, proposals, options_);
    const Eigen::MatrixXd others = information_ - rows_[k].transpose() * rows_[k];
    int chosen = -1;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const double index = index_of(scaled(others + candidates[c].transpose() * candidates[c]), options_.index);
      if (index > *best) {
        *best = index;
        chosen = static_cast<int>(c);
      }
    }
    if (chosen < 0) return false;
    poses_[k] = proposals[chosen];
    rows_[k] = candidates[chosen];
    information_ = others + rows_[k].transpose() * rows_[k];
    return true;
  }

  const Robot& robot_;
  const PlanOptions& options_;
  const std::vector<Range> ranges_;
  Random random_;
  Model model_;
  Selection selection_;
  std::vector<Pose> poses_;
  std::vector<Eigen::MatrixXd> rows_;  ///< Jacobian of every pose
  Eigen::MatrixXd information_;
  Eigen::VectorXd unit_;
};

}  // namespace
}  // namespace planning

bool PlanOptions::is_valid(std::string* error) const {
  const auto fail = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (poses < 3) return fail("poses must be at least 3");
  if (!(min_step >= 0.0) || !(min_step_prismatic >= 0.0)) return fail("min_step must not be negative");
  if (!(position_sigma > 0.0) || !(rotation_sigma > 0.0))
    return fail("position_sigma and rotation_sigma must be positive");
  if (sweeps < 0 || proposals < 1) return fail("sweeps must not be negative, proposals at least 1");
  return true;
}

PlanResult plan(const Robot& robot, const PlanOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("plan: " + error);
  validate(robot);
  Planner planner(robot, options);
  planner.find_what_can_be_seen();
  planner.draw_plan();
  PlanResult result;
  planner.exchange(&result);
  planner.hand_out(&result);
  return result;
}

}  // namespace truing
