// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/rigid.hpp"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "dynamics/regressor.hpp"
#include "model/motion.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::string shape_of(const MatrixXd& table) {
  return "(" + std::to_string(table.rows()) + ", " + std::to_string(table.cols()) + ")";
}

void require_table(const char* name, const MatrixXd& table, Index rows, Index joints) {
  if (table.rows() != rows || table.cols() != joints) {
    throw std::invalid_argument(std::string(name) + " has shape " + shape_of(table) + ", expected (" +
                                std::to_string(rows) + ", " + std::to_string(joints) +
                                "): a row per sample, a column per joint that has a reading");
  }
  for (Index row = 0; row < rows; ++row) {
    for (Index column = 0; column < joints; ++column) {
      if (std::isfinite(table(row, column))) continue;
      throw std::invalid_argument(std::string(name) + ", row " + std::to_string(row + 1) + ", joint " +
                                  std::to_string(column + 1) + ": is not a finite number");
    }
  }
}

}  // namespace

Eigen::MatrixXd rigid_torques(const Robot& robot, const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd,
                              const Eigen::MatrixXd& qdd) {
  validate(robot);
  const RigidChain chain(robot);
  require_table("q", q, q.rows(), chain.driven());
  require_table("qd", qd, q.rows(), chain.driven());
  require_table("qdd", qdd, q.rows(), chain.driven());

  const VectorXd parameters = link_parameters(robot);
  MatrixXd Y(chain.driven(), parameters.size());
  MatrixXd torques = qdd * rotor_matrix(robot);  // it is symmetric
  for (Index row = 0; row < q.rows(); ++row) {
    const VectorXd position = q.row(row), speed = qd.row(row), acceleration = qdd.row(row);
    chain.regressor(position.data(), speed.data(), acceleration.data(), Y);
    torques.row(row) += (Y * parameters).transpose();
  }
  return torques;
}

}  // namespace truing::dynamics
