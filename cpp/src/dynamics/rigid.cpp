// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/rigid.hpp"

#include "dynamics/regressor.hpp"
#include "model/motion.hpp"

namespace truing::dynamics {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Eigen::MatrixXd rigid_torques(const Robot& robot, const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd,
                              const Eigen::MatrixXd& qdd) {
  validate(robot);
  const RigidChain chain(robot);
  require_table("q", q, q.rows(), chain.driven());
  require_table("qd", qd, q.rows(), chain.driven());
  require_table("qdd", qdd, q.rows(), chain.driven());

  const VectorXd parameters = link_parameters(robot);
  MatrixXd torques = qdd * rotor_matrix(robot);  // it is symmetric
  if (chain.is_near(q)) return torques += chain.torques(q, qd, qdd, parameters);
  MatrixXd Y(chain.driven(), parameters.size());
  for (Index row = 0; row < q.rows(); ++row) {
    const VectorXd position = q.row(row), speed = qd.row(row), acceleration = qdd.row(row);
    chain.regressor(position.data(), speed.data(), acceleration.data(), Y);
    torques.row(row) += (Y * parameters).transpose();
  }
  return torques;
}

}  // namespace truing::dynamics
