// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/base_parameters.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "math/random.hpp"
#include "math/text.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Positions within the limits (or half a turn, a metre, either way), speeds and accelerations of the size of gravity's
/// torque, which otherwise would hide the columns that only motion shows.
MatrixXd random_gram(const Robot& robot, int states, std::uint64_t seed) {
  constexpr Index kTogether = 100;
  Random random(seed);
  const std::vector<std::size_t> driven = robot.driven_joints();
  const auto joints = static_cast<Index>(driven.size());
  const auto columns = static_cast<Index>(kLinkParameters * static_cast<Index>(robot.joints.size()));
  MatrixXd gram = MatrixXd::Zero(columns, columns);
  for (Index done = 0; done < states; done += kTogether) {
    const Index rows = std::min<Index>(kTogether, states - done);
    MatrixXd q(rows, joints), qd(rows, joints), qdd(rows, joints);
    for (Index k = 0; k < joints; ++k) {
      const Joint& joint = robot.joints[driven[static_cast<std::size_t>(k)]];
      const double reach = joint.type == JointType::revolute ? M_PI : 1.0;
      const double low = std::isfinite(joint.lower) ? joint.lower : -reach;
      const double high = std::isfinite(joint.upper) ? joint.upper : reach;
      for (Index i = 0; i < rows; ++i) {
        q(i, k) = random.uniform(low, high);
        qd(i, k) = random.uniform(-3.0, 3.0);
        qdd(i, k) = random.uniform(-10.0, 10.0);
      }
    }
    const MatrixXd Y = torque_regressor(robot, q, qd, qdd);
    gram += Y.transpose() * Y;
  }
  return gram;
}

}  // namespace

VectorXd BaseParameters::values(const VectorXd& parameters) const {
  VectorXd out(static_cast<Index>(kept.size())), others(static_cast<Index>(grouped.size()));
  for (Index i = 0; i < out.size(); ++i) out[i] = parameters[kept[static_cast<std::size_t>(i)]];
  for (Index i = 0; i < others.size(); ++i) others[i] = parameters[grouped[static_cast<std::size_t>(i)]];
  return out + combination * others;
}

VectorXd BaseParameters::with_values(const VectorXd& parameters, const VectorXd& base) const {
  VectorXd out = parameters;
  const VectorXd change = base - values(parameters);
  for (Index i = 0; i < change.size(); ++i) out[kept[static_cast<std::size_t>(i)]] += change[i];
  return out;
}

BaseParameters base_parameters(const Robot& robot, int states, std::uint64_t seed) {
  validate(robot);
  constexpr double kTolerance = 1e-5;  // random states leave no column in doubt, but a Gram has few digits
  return base_parameters(robot, random_gram(robot, states, seed), kTolerance);
}

BaseParameters base_parameters(const Robot& robot, const MatrixXd& gram, double tolerance) {
  const auto columns = static_cast<Index>(kLinkParameters * static_cast<Index>(robot.joints.size()));
  if (gram.rows() != columns || gram.cols() != columns)
    throw std::invalid_argument("base_parameters: the Gram has shape (" + std::to_string(gram.rows()) + ", " +
                                std::to_string(gram.cols()) + "), expected " + std::to_string(columns) +
                                ", ten for each link");
  // A column of rounding is none: a joint about the vertical feels 1e-16 of gravity.
  constexpr double kNothing = 1e-12;
  const double largest = gram.diagonal().cwiseAbs().maxCoeff();
  MatrixXd seen = gram;
  for (Index k = 0; k < columns; ++k) {
    if (gram(k, k) > kNothing * kNothing * largest) continue;
    seen.row(k).setZero();
    seen.col(k).setZero();
  }
  const Rank rank = find_rank(seen, std::vector<int>(static_cast<std::size_t>(columns), 0), tolerance);
  BaseParameters out;
  out.kept = rank.kept;
  std::vector<Index> from;
  for (std::size_t k = 0; k < rank.frozen.size(); ++k) {
    const int column = rank.frozen[k];
    const bool is_seen = seen(column, column) > 0.0;
    (is_seen ? out.grouped : out.unseen).push_back(column);
    if (is_seen) from.push_back(static_cast<Index>(k));
  }
  out.combination.resize(static_cast<Index>(out.kept.size()), static_cast<Index>(from.size()));
  for (std::size_t k = 0; k < from.size(); ++k)
    out.combination.col(static_cast<Index>(k)) = rank.combination.col(from[k]);
  return out;
}

std::string inertial_name(const Robot& robot, int column) {
  static const char* const kParts[] = {"m", "mx", "my", "mz", "xx", "yy", "zz", "xy", "xz", "yz"};
  return "link_inertia." + robot.joints[static_cast<std::size_t>(column / kLinkParameters)].name + "." +
         kParts[column % kLinkParameters];
}

std::vector<std::string> in_words(const BaseParameters& base, const Robot& robot) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < base.grouped.size(); ++k) {
    std::string line = inertial_name(robot, base.grouped[k]) + " grouped into ";
    const VectorXd weights = base.combination.col(static_cast<Index>(k));
    std::vector<std::string> parts;
    for (Index i = 0; i < weights.size(); ++i) {
      if (weights[i] != 0.0)
        parts.push_back(inertial_name(robot, base.kept[static_cast<std::size_t>(i)]) + " (" + number(weights[i], 4) +
                        ")");
    }
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (i > 0) line += i + 1 == parts.size() ? " and " : ", ";
      line += parts[i];
    }
    out.push_back(line);
  }
  for (const int column : base.unseen) out.push_back(inertial_name(robot, column) + " is not seen");
  return out;
}

}  // namespace truing::dynamics
