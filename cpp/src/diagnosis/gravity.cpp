// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Which way is down? A joint's spring gives way by c_k (tau_kx d_x + tau_ky d_y + tau_kz d_z), with the torques by
// gravity along each axis of the base, and one direction d for all joints: three columns a joint, of rank one. The
// direction is scanned as python/truing/dynamics/sanity/gravity.py does it for torques.

#include "diagnosis/gravity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <vector>

#include <Eigen/Geometry>

#include "math/batch.hpp"
#include "math/constants.hpp"
#include "model/gravity.hpp"
#include "model/motion.hpp"

namespace truing::diagnosis {
namespace {

using Eigen::Vector3d;

constexpr double kWide = 30.0 * kPi / 180.0, kNarrow = 0.5 * kPi / 180.0;  ///< steps from the best coarse direction
constexpr double kAsNear = 2.5 * kPi / 180.0;                              ///< two directions that are one
constexpr double kNatsWon = 10.0;       ///< that another direction wins, before a second look
constexpr double kBetter = 1.05;        ///< sums of squares of poses that a fit did not see
constexpr double kSureSpring = 4.0;     ///< standard errors of a spring that shows
constexpr std::ptrdiff_t kSeveral = 2;  ///< joints: a spring at one may stand for another law

/// Springs of all joints under any gravity, beside base, tool, links and waves of the joints' own angles.
class Springs {
 public:
  explicit Springs(const Work& work);

  bool any() const { return !joints_.empty(); }
  Vector3d as_written() const { return gravity_.normalized(); }
  double size() const { return gravity_.norm(); }

  /// Log evidence of springs under this direction.
  double evidence(const Vector3d& down) const { return fitted(sums_of(all_, down, false)).state.evidence; }

  /// Standard errors by which each spring differs from none.
  Eigen::VectorXd significance(const Vector3d& down) const;

  /// Sum of squares on every training fold, of the fit to the others; with waves of the joints' own angles or without.
  Eigen::VectorXd squares(const Vector3d& down, bool waves) const;

 private:
  struct Fit {
    Evidence::State state;
    int first_spring = 0;
  };

  void add_rows(const Work& work);
  std::array<std::vector<Eigen::VectorXd>, 3> torques(const Work& work) const;
  Gram sums_of(const Gram& whole, const Vector3d& down, bool waves) const;
  Fit fitted(const Gram& sums) const;

  std::vector<std::size_t> joints_;
  Vector3d gravity_ = Vector3d::Zero();
  std::vector<int> plain_;  ///< columns of the design: base and tool, then the links
  int nuisance_ = 0;
  Eigen::VectorXd prior_;  ///< of the plain columns, the springs, the waves
  std::vector<Gram> folds_;
  Gram all_;
};

Springs::Springs(const Work& work) {
  const Robot& robot = work.linear.at;
  gravity_ = robot.gravity;
  if (!(gravity_.norm() > 0.0) || !(knows_mass(robot) || work.given.data.payload)) return;
  plain_ = work.design.nuisance;
  nuisance_ = static_cast<int>(plain_.size());
  for (std::size_t g = 0; g < work.design.candidates.named.size(); ++g) {
    if (work.design.candidates.named[g].kind != Explanation::Kind::all_geometry) continue;
    const std::vector<int>& links = work.design.candidates.groups[g].columns;
    plain_.insert(plain_.end(), links.begin(), links.end());
  }
  joints_ = robot.driven_joints();
  add_rows(work);
}

/// Of every joint and row, with gravity along each axis of the base.
std::array<std::vector<Eigen::VectorXd>, 3> Springs::torques(const Work& work) const {
  const Measurements& data = work.given.data;
  std::array<Robot, 3> turned = {work.linear.at, work.linear.at, work.linear.at};
  for (int axis = 0; axis < 3; ++axis) turned[static_cast<std::size_t>(axis)].gravity = size() * Vector3d::Unit(axis);
  const Eigen::MatrixXd coupling = coupling_matrix(work.linear.at);
  Eigen::VectorXd reading(static_cast<Eigen::Index>(data.joints.size()));
  std::array<std::vector<Eigen::VectorXd>, 3> out;
  for (std::size_t row = 0; row < data.rows; ++row) {
    for (Eigen::Index k = 0; k < reading.size(); ++k) reading[k] = data.joints[static_cast<std::size_t>(k)][row];
    const auto frames = forward_kinematics(work.linear.at, reading, 0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out[axis].emplace_back(static_cast<Eigen::Index>(work.linear.at.joints.size()));
      gravity_torques_at(turned[axis], coupling, frames, data.payload ? data.payload[row] : 0.0, out[axis].back());
    }
  }
  return out;
}

/// Sums over rows of: plain columns; of every joint its springs along x, y, z; of every joint cos and sin of its angle.
void Springs::add_rows(const Work& work) {
  const Design& design = work.design;
  const auto torque = torques(work);
  const auto plain = static_cast<Eigen::Index>(plain_.size()), joints = static_cast<Eigen::Index>(joints_.size());
  const double root_effect = std::sqrt(work.noise.design_effect);
  std::vector<GramSum> sums;
  for (int fold = 0; fold < design.folds; ++fold) sums.emplace_back(plain + 5 * joints);
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (design.fold[at] >= design.folds) continue;
    const double weight = design.weight[i] / root_effect;
    GramSum& sum = sums[static_cast<std::size_t>(design.fold[at])];
    double* out = sum.row();
    const auto put = [&](double value) {
      *out = weight * value;
      ++out;
    };
    const auto row = static_cast<std::size_t>(design.row[at]);
    const auto motion = [&](std::size_t joint) { return design.x(i, design.joint_column[joint][0]); };
    for (const int column : plain_) put(design.x(i, column));
    for (const std::size_t joint : joints_) {
      for (const auto& along : torque) put(along[row][static_cast<Eigen::Index>(joint)] * motion(joint));
    }
    for (std::size_t k = 0; k < joints_.size(); ++k) {
      const double angle = work.given.data.joints[k][row];
      put(std::cos(angle) * motion(joints_[k]));
      put(std::sin(angle) * motion(joints_[k]));
    }
    put(design.y[i]);
    sum.push();
  }
  for (GramSum& sum : sums) {
    folds_.push_back(sum.finish());
    all_.add(folds_.back());
  }
  prior_ = Eigen::VectorXd::Constant(plain + 3 * joints, kLargest);
  for (Eigen::Index k = 0; k < plain; ++k) prior_[k] = design.prior[plain_[static_cast<std::size_t>(k)]];
  for (Eigen::Index k = 0; k < joints; ++k) {
    double largest = 0.0;  // rms torque, along the axis where it is largest
    for (const auto& along : torque) {
      double squares = 0.0;
      for (const Eigen::VectorXd& of_row : along)
        squares += std::pow(of_row[static_cast<Eigen::Index>(joints_[static_cast<std::size_t>(k)])], 2.0);
      largest = std::max(largest, std::sqrt(squares / static_cast<double>(along.size())));
    }
    if (largest > 0.0) prior_[plain + k] /= largest;
  }
}

/// A joint's three springs become one.
Gram Springs::sums_of(const Gram& whole, const Vector3d& down, bool waves) const {
  const auto plain = static_cast<Eigen::Index>(plain_.size()), joints = static_cast<Eigen::Index>(joints_.size());
  const Eigen::Index kept = plain + (waves ? 3 : 1) * joints;
  Eigen::MatrixXd take = Eigen::MatrixXd::Zero(whole.xx.rows(), kept);
  take.topLeftCorner(plain, plain).setIdentity();
  for (Eigen::Index k = 0; k < joints; ++k) take.block<3, 1>(plain + 3 * k, plain + k) = down;
  if (waves) take.block(plain + 3 * joints, plain + joints, 2 * joints, 2 * joints).setIdentity();
  Gram out;
  out.xx = take.transpose() * whole.xx * take;
  out.xy = take.transpose() * whole.xy;
  out.yy = whole.yy;
  out.n = whole.n;
  return out;
}

/// Links, springs and waves, each with the size that the data bear out.
Springs::Fit Springs::fitted(const Gram& sums) const {
  const int plain = static_cast<int>(plain_.size()), joints = static_cast<int>(joints_.size());
  const auto range = [](int first, int last) {
    std::vector<int> out(static_cast<std::size_t>(last - first));
    std::iota(out.begin(), out.end(), first);
    return out;
  };
  const int columns = static_cast<int>(sums.xx.rows());
  std::vector<ColumnGroup> groups(3);
  groups[0].columns = range(nuisance_, plain);
  groups[1].columns = range(plain, plain + joints);
  groups[2].columns = range(plain + joints, columns);
  const Eigen::VectorXd prior = prior_.head(columns);
  const Evidence evidence(sums, groups, range(0, nuisance_), prior);
  Fit out;
  out.state = evidence.evaluate({});
  for (int g = 0; g < 3; ++g) {
    if (groups[static_cast<std::size_t>(g)].columns.empty()) continue;
    if (g == 1) out.first_spring = static_cast<int>(out.state.columns.size());
    Choice choice = out.state.choice;
    choice.groups.push_back(g);
    choice.scales.push_back(evidence.gain(out.state, groups[static_cast<std::size_t>(g)].columns, 0.0).scale);
    out.state = evidence.evaluate(choice);
  }
  return out;
}

Eigen::VectorXd Springs::significance(const Vector3d& down) const {
  const Fit fit = fitted(sums_of(all_, down, false));
  Eigen::VectorXd out(static_cast<Eigen::Index>(joints_.size()));
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    const Eigen::Index at = fit.first_spring + k;
    const double variance = fit.state.factor.solve(Eigen::VectorXd::Unit(fit.state.solution.size(), at))[at];
    out[k] = fit.state.solution[at] / std::sqrt(std::max(fit.state.sigma2 * variance, 1e-300));
  }
  return out;
}

Eigen::VectorXd Springs::squares(const Vector3d& down, bool waves) const {
  const Gram all = sums_of(all_, down, waves);
  const Fit fit = fitted(all);
  const Gram ordered = all.of(fit.state.columns);
  Eigen::VectorXd out(static_cast<Eigen::Index>(folds_.size()));
  for (std::size_t k = 0; k < folds_.size(); ++k) {
    const Gram held = sums_of(folds_[k], down, waves), own = held.of(fit.state.columns);
    Eigen::MatrixXd d = ordered.xx - own.xx;
    d.diagonal() += fit.state.precision;
    out[static_cast<Eigen::Index>(k)] =
        held_out_squares(held, fit.state.columns, factorised(std::move(d)).solve(ordered.xy - own.xy));
  }
  return out;
}

/// Axes, diagonals and corners of a cube.
std::vector<Vector3d> coarse_directions() {
  std::vector<Vector3d> out;
  for (int way = 0; way < 27; ++way) {
    const Vector3d d(way / 9 - 1, way / 3 % 3 - 1, way % 3 - 1);
    if (d.norm() > 0.0) out.push_back(d.normalized());
  }
  return out;
}

/// Eight directions at an angle [rad] from one.
std::vector<Vector3d> directions_around(const Vector3d& direction, double angle) {
  const Vector3d side = direction.unitOrthogonal(), up = direction.cross(side);
  std::vector<Vector3d> out;
  for (int k = 0; k < 8; ++k) {
    const double turn = k * kPi / 4.0;
    out.push_back(std::cos(angle) * direction + std::sin(angle) * (std::cos(turn) * side + std::sin(turn) * up));
  }
  return out;
}

const Vector3d& nearest(const std::vector<Vector3d>& to, const Vector3d& direction) {
  return *std::max_element(to.begin(), to.end(),
                           [&](const Vector3d& a, const Vector3d& b) { return a.dot(direction) < b.dot(direction); });
}

/// The direction under which springs explain most; a coarse one that is as near as the scan can tell. A direction and
/// its opposite explain the same, by springs of the other sign.
Vector3d best_direction(const Springs& springs, int threads) {
  const auto best_of = [&](const std::vector<Vector3d>& directions) {
    std::vector<double> evidence(directions.size());
    const auto work = [&](std::size_t k) { evidence[k] = springs.evidence(directions[k]); };
    for_each_on_threads(directions.size(), threads, {}, work, 1);
    const auto best = std::max_element(evidence.begin(), evidence.end());
    return std::make_pair(*best, directions[static_cast<std::size_t>(best - evidence.begin())]);
  };
  const std::vector<Vector3d> coarse = coarse_directions();
  auto best = best_of({coarse.begin(), coarse.begin() + 13});  // the others are their opposites
  for (double step = kWide; step > kNarrow;) {
    const auto other = best_of(directions_around(best.second, step));
    if (other.first > best.first)
      best = other;
    else
      step *= 0.5;
  }
  const Vector3d& plain = nearest(coarse, best.second);
  return plain.dot(best.second) > std::cos(kAsNear) ? plain : best.second;
}

/// Several joints give way with their weight, and none, for sure, against it.
bool are_springs(const Eigen::VectorXd& significance) {
  const auto shown = (significance.array() > kSureSpring).count();
  return shown >= kSeveral && significance.minCoeff() > -kSureSpring;
}

}  // namespace

std::optional<Vector3d> other_gravity(const Work& work) {
  const Springs springs(work);
  if (!springs.any()) return std::nullopt;
  const Vector3d written = springs.as_written();
  const Eigen::VectorXd as_it_is = springs.significance(written);
  if (are_springs(-as_it_is)) return -work.given.frames.robot.gravity;  // it hangs upside down
  Vector3d down = best_direction(springs, work.given.options.threads);
  if (are_springs(springs.significance(-down))) down = -down;
  const bool other = down.dot(written) < std::cos(kAsNear) && are_springs(springs.significance(down)) &&
                     springs.evidence(down) > springs.evidence(written) + kNatsWon;
  // What a joint does with its own angle looks like weight along another axis, joint by joint.
  if (!other || !predicts_better(springs.squares(down, false), springs.squares(written, true), kBetter))
    return std::nullopt;
  return springs.size() * down;
}

SanityFinding gravity_finding(const Vector3d& gravity) {
  const Vector3d down = gravity.normalized();
  std::string direction;
  for (int axis = 0; axis < 3; ++axis) {
    char text[16];
    std::snprintf(text, sizeof(text), "%s%.2f", axis > 0 ? " " : "", std::round(100.0 * down[axis]) / 100.0 + 0.0);
    direction += text;
  }
  return {"gravity_direction",
          "gravity points along " + direction +
              " of the base, not as the robot's file has it: under that weight the "
              "joints give way. The diagnosis goes on with it.",
          {}};
}

}  // namespace truing::diagnosis
