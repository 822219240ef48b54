// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/torque_model.hpp"

#include "dynamics/payload.hpp"

namespace truing::dynamics {

using Eigen::Index;
using Eigen::MatrixXd;

std::vector<ValuedTerm> valued_terms(const Robot& robot, const MotionRange& range,
                                     const std::vector<TorqueEffect>& own) {
  std::vector<ValuedTerm> out;
  for (const AppliedEffect& applied : robot.torque_effects) {
    for (TorqueTerm& term : terms_of(applied, robot, range, own)) {
      const double value = applied.parameters.at(term.parameter);
      out.push_back({std::move(term), value});
    }
  }
  return out;
}

void add_terms(const std::vector<ValuedTerm>& terms, bool that_need_torque, const Motion& motion, MatrixXd* torque) {
  for (const ValuedTerm& valued : terms) {
    if (valued.term.needs_torque != that_need_torque || valued.value == 0.0) continue;
    const MatrixXd columns = valued.term.basis(motion);
    for (std::size_t k = 0; k < valued.term.joints.size(); ++k)
      torque->col(static_cast<Index>(valued.term.joints[k])) += valued.value * columns.col(static_cast<Index>(k));
  }
}

TorqueModel::TorqueModel(const Robot& robot, std::vector<ValuedTerm> own)
    : robot_(robot), links_(link_parameters(robot)), rotors_(rotor_matrix(robot)), terms_(std::move(own)) {}

TorqueModel TorqueModel::with(const std::vector<ValuedTerm>& more) const {
  TorqueModel out = *this;
  out.terms_.insert(out.terms_.end(), more.begin(), more.end());
  return out;
}

MatrixXd TorqueModel::torque(Motion* motion) const {
  MatrixXd out = motion->qdd * rotors_;  // it is symmetric
  for (Index j = 0; j < out.cols(); ++j) out.col(j) += motion->rigid[static_cast<std::size_t>(j)] * links_;
  add_payload(*motion, &out);
  add_terms(terms_, false, *motion, &out);
  motion->torque = out;
  add_terms(terms_, true, *motion, &out);
  return out;
}

}  // namespace truing::dynamics
