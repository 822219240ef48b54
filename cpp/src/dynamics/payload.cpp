// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/payload.hpp"

#include <array>

namespace truing::dynamics {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const char* const kPayload = "payload_kg";
const char* const kPayloadFound = "payload_found";

namespace {

constexpr std::array<const char*, 3> kPlace{"payload_x_m", "payload_y_m", "payload_z_m"};

VectorXd column_of(const Motion& motion, const char* name) {
  const auto found = motion.columns.find(name);
  return found == motion.columns.end() ? VectorXd(VectorXd::Zero(motion.rows())) : found->second;
}

Eigen::Isometry3d tool_of(const Robot& robot) {
  return robot.targets.empty() ? Eigen::Isometry3d::Identity() : robot.targets.front().T_last_target;
}

/// In the frame after the last link: shape=(rows, 3) [m].
MatrixXd place_of(const Motion& motion) {
  const Eigen::Isometry3d T_last_tool = tool_of(*motion.robot);
  MatrixXd place(motion.rows(), 3);
  for (std::size_t k = 0; k < kPlace.size(); ++k) place.col(static_cast<Index>(k)) = column_of(motion, kPlace[k]);
  return (place * T_last_tool.linear().transpose()).rowwise() + T_last_tool.translation().transpose();
}

/// Parameters of a point of 1 kg at every row of `place`: shape=(rows, 10).
MatrixXd point_mass(const MatrixXd& place) {
  const Eigen::ArrayXd x = place.col(0), y = place.col(1), z = place.col(2);
  MatrixXd out(place.rows(), kLinkParameters);
  out << VectorXd::Ones(place.rows()), place, y.square() + z.square(), x.square() + z.square(), x.square() + y.square(),
      -x * y, -x * z, -y * z;
  return out;
}

/// The same, moved by `along` per metre: what changes.
MatrixXd point_mass_moved(const MatrixXd& place, const Eigen::Vector3d& along) {
  const Eigen::ArrayXd x = place.col(0), y = place.col(1), z = place.col(2);
  MatrixXd out(place.rows(), kLinkParameters);
  out << VectorXd::Zero(place.rows()), VectorXd::Ones(place.rows()) * along.transpose(),
      2.0 * (y * along.y() + z * along.z()), 2.0 * (x * along.x() + z * along.z()),
      2.0 * (x * along.x() + y * along.y()), -(x * along.y() + y * along.x()), -(x * along.z() + z * along.x()),
      -(y * along.z() + z * along.y());
  return out;
}

/// Torques of a last link with these parameters, shape=(rows, 10), in every row.
MatrixXd torques_of(const Motion& motion, const MatrixXd& parameters) {
  const Index last = kLinkParameters * (static_cast<Index>(motion.robot->joints.size()) - 1);
  const std::vector<MatrixXd> made = motion.rigid.empty()
                                         ? regressor_columns(RigidChain(*motion.robot), motion.q, motion.qd, motion.qdd)
                                         : std::vector<MatrixXd>{};
  const std::vector<MatrixXd>& columns = motion.rigid.empty() ? made : motion.rigid;
  MatrixXd out(motion.rows(), motion.q.cols());
  for (Index j = 0; j < out.cols(); ++j) {
    const MatrixXd& rigid = columns[static_cast<std::size_t>(j)];
    out.col(j) = rigid.middleCols(last, kLinkParameters).cwiseProduct(parameters).rowwise().sum();
  }
  return out;
}

}  // namespace

bool is_of_payload(const std::string& column) {
  return column == kPayload || column == kPayloadFound || column == kPlace[0] || column == kPlace[1] ||
         column == kPlace[2];
}

VectorXd payload_of(const Motion& motion) { return column_of(motion, kPayload); }

void add_payload(const Motion& motion, MatrixXd* torque) {
  const VectorXd mass = payload_of(motion);
  if (mass.isZero(0.0)) return;
  *torque += mass.asDiagonal() * torques_of(motion, point_mass(place_of(motion)));
}

MatrixXd payload_shifted(const Motion& motion, int axis) {
  const Eigen::Vector3d along = tool_of(*motion.robot).linear().col(axis);
  return payload_of(motion).asDiagonal() * torques_of(motion, point_mass_moved(place_of(motion), along));
}

bool payload_was_found(const MotionRange& range) {
  const auto found = range.columns.find(kPayloadFound);
  return found != range.columns.end() && found->second.second > 0.0;
}

bool payload_varies(const MotionRange& range) {
  const auto stated = range.columns.find(kPayload);
  const bool varies = stated != range.columns.end() && stated->second.second > stated->second.first;
  return varies && !payload_was_found(range);
}

}  // namespace truing::dynamics
