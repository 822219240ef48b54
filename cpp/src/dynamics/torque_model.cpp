// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/torque_model.hpp"

#include <algorithm>
#include <atomic>
#include <utility>

#include "dynamics/effects/families.hpp"
#include "dynamics/filter.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/turn.hpp"

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

namespace {

enum class TermKind { undirected, directed, needs_torque };

TermKind kind_of(const TorqueTerm& term) {
  if (term.needs_torque) return TermKind::needs_torque;
  return term.needs_direction ? TermKind::directed : TermKind::undirected;
}

/// Adds value * basis of every term of this kind to `torque`, shape=(rows, joints).
void add_terms(const std::vector<ValuedTerm>& terms, TermKind kind, const Motion& motion, MatrixXd* torque) {
  for (const ValuedTerm& valued : terms) {
    if (kind_of(valued.term) != kind || valued.value == 0.0) continue;
    const MatrixXd columns = valued.term.basis(motion);
    if (columns.rows() == 0) continue;
    for (std::size_t k = 0; k < valued.term.joints.size(); ++k)
      torque->col(static_cast<Index>(valued.term.joints[k])) += valued.value * columns.col(static_cast<Index>(k));
  }
}

}  // namespace

void fill_inertia(Motion* motion) { motion->inertia = mass_matrix_columns(*motion->robot, motion->q, motion->bodies); }

void fill_yielding(Motion* motion, bool with_inertia) {
  const MatrixXd dq = -motion->torque, dqd = rate_of(dq, motion->step), dqdd = rate_of(dqd, motion->step);
  RigidChain::Changes changes =
      RigidChain(*motion->robot)
          .torque_changes(motion->q, motion->qd, motion->qdd, motion->bodies, dq, dqd, dqdd, with_inertia);
  motion->yielding = std::move(changes.torques);
  motion->inertia = std::move(changes.masses);
}

void clear_tables(Motion* motion) {
  motion->rigid.clear();
  motion->inertia.clear();
  motion->yielding.clear();
}

namespace {

std::uint64_t next_number() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

TorqueModel::TorqueModel(const Robot& robot, std::vector<ValuedTerm> own)
    : robot_(robot),
      chain_(robot),
      links_(link_parameters(robot)),
      rotors_(rotor_matrix(robot)),
      turns_(turns_of(robot)),
      number_(next_number()) {
  add(std::move(own));
}

void TorqueModel::add(std::vector<ValuedTerm> more) {
  for (ValuedTerm& valued : more) {
    if (valued.term.link_parameter >= 0)
      links_[valued.term.link_parameter] += valued.value;
    else
      terms_.push_back(std::move(valued));
  }
}

TorqueModel TorqueModel::with(const std::vector<ValuedTerm>& more) const {
  TorqueModel out = *this;
  out.add(more);
  out.number_ = out.undirected_number_ = next_number();
  return out;
}

TorqueModel TorqueModel::turning(const std::vector<FrictionTurn>& turns) const {
  TorqueModel out = *this;
  out.turns_ = turns;
  if (!terms_.empty()) out.number_ = next_number();  // links and rotors know no friction
  return out;
}

bool TorqueModel::any(bool TorqueTerm::* needs) const {
  return std::any_of(terms_.begin(), terms_.end(), [needs](const ValuedTerm& v) { return v.term.*needs; });
}

bool TorqueModel::needs_rigid() const { return any(&TorqueTerm::needs_rigid) || (seen_ && seen_->needs_rigid()); }

TorqueModel TorqueModel::seeing(const TorqueModel& other) const {
  TorqueModel out = *this;
  out.seen_ = std::make_shared<const TorqueModel>(other);
  out.number_ = next_number();
  return out;
}

void TorqueModel::carry(Motion* motion) const {
  if (motion->bodies.size() == links_.size() && motion->bodies == links_) return;
  motion->carried = chain_.torques(motion->q, motion->qd, motion->qdd, links_);
  add_payload(*motion, &motion->carried);
  motion->bodies = links_;
}

MatrixXd TorqueModel::torque_of_others(Motion* motion, KnownTorque* known) const {
  carry(motion);
  MatrixXd out;
  if (known && known->of == undirected_number_) {
    out = known->undirected;
  } else {
    out = undirected_torque(*motion);
    if (known) {
      known->of = undirected_number_;
      known->undirected = out;
    }
  }
  add_terms(terms_, TermKind::directed, *motion, &out);
  return out;
}

MatrixXd TorqueModel::undirected_torque(const Motion& motion) const {
  MatrixXd out = motion.carried + motion.qdd * rotors_;  // it is symmetric
  add_terms(terms_, TermKind::undirected, motion, &out);
  return out;
}

MatrixXd TorqueModel::torque(Motion* motion) const {
  motion->direction = directions_of(*motion, turns_);
  return torque_by_direction(motion);
}

MatrixXd TorqueModel::torque_by_direction(Motion* motion, KnownTorque* known) const {
  MatrixXd out = torque_of_others(motion, known);
  const TorqueModel& seen = seen_ ? *seen_ : *this;
  if (!seen_) {
    motion->torque = out;
  } else if (known && known->seen == seen.number_) {
    seen.carry(motion);
  } else if (same(seen.turns_, turns_)) {
    motion->torque = seen.torque_of_others(motion);
  } else {
    const MatrixXd mine = std::exchange(motion->direction, directions_of(*motion, seen.turns_));
    motion->torque = seen.torque_of_others(motion);
    motion->direction = mine;
  }
  if (known) known->seen = seen.number_;
  if (any(&TorqueTerm::needs_yielding))
    fill_yielding(motion, any(&TorqueTerm::needs_inertia));
  else if (any(&TorqueTerm::needs_inertia))
    fill_inertia(motion);
  add_terms(terms_, TermKind::needs_torque, *motion, &out);
  return out;
}

}  // namespace truing::dynamics
