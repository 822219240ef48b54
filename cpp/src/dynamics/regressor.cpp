// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/regressor.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "math/rotation.hpp"
#include "math/text.hpp"
#include "model/motion.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

Isometry3d fixed_frame(const Robot& robot, Joint joint) {
  Robot one;
  one.convention = robot.convention;
  joint.driven_by.clear();
  joint.ratio = 1.0;
  joint.offset = 0.0;
  one.joints.push_back(std::move(joint));
  return forward_kinematics(one, Eigen::VectorXd::Zero(1)).front();
}

Joint only_before(const Joint& joint) {
  Joint before = joint;
  before.theta = before.d = 0.0;
  return before;
}

Joint only_after(const Joint& joint) {
  Joint after = joint;
  after.a = after.alpha = after.beta = 0.0;
  return after;
}

/// Motion of one link, seen from the base: what Newton and Euler need.
struct LinkMotion {
  Matrix3d R = Matrix3d::Identity();
  Vector3d origin = Vector3d::Zero();
  Vector3d w = Vector3d::Zero();      ///< angular velocity
  Vector3d alpha = Vector3d::Zero();  ///< angular acceleration
  Vector3d a = Vector3d::Zero();      ///< acceleration of the origin, less gravity

  Vector3d acceleration_at(const Vector3d& point) const {
    const Vector3d r = point - origin;
    return a + alpha.cross(r) + w.cross(w.cross(r));
  }
};

}  // namespace

void require_table(const char* name, const Eigen::MatrixXd& table, Eigen::Index rows, Eigen::Index joints) {
  const auto shape = [](Eigen::Index r, Eigen::Index c) {
    return "(" + std::to_string(r) + ", " + std::to_string(c) + ")";
  };
  if (table.rows() != rows || table.cols() != joints)
    throw std::invalid_argument(std::string(name) + " has shape " + shape(table.rows(), table.cols()) + ", expected " +
                                shape(rows, joints) +
                                ": a row for each sample, a column for each joint with a reading");
  for (Eigen::Index j = 0; j < joints; ++j) {
    for (Eigen::Index i = 0; i < rows; ++i) {
      if (!std::isfinite(table(i, j)))
        throw std::invalid_argument(std::string(name) + ", row " + std::to_string(i + 1) + ", joint " +
                                    std::to_string(j + 1) + ": " + number(table(i, j)) + ", expected a finite number");
    }
  }
}

LinkParameters link_parameters(const Joint& joint) {
  const double m = joint.mass.value_or(0.0);
  const Vector3d& c = joint.center_of_mass;
  // Steiner: from the centre of mass to the origin of the frame.
  const Matrix3d I =
      joint.inertia.value_or(Matrix3d::Zero()) + m * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
  LinkParameters out;
  out << m, m * c, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2);
  return out;
}

void set_link_parameters(const LinkParameters& p, Joint* joint) {
  if (p[0] == 0.0 && !p.segment<3>(1).isZero(0.0))
    throw std::invalid_argument("joint '" + joint->name + "': mass 0 kg with a first moment of " +
                                number(p.segment<3>(1).norm()) +
                                " kg m has no centre of mass; expected a mass that is not zero");
  joint->mass = p[0];
  joint->center_of_mass = p[0] != 0.0 ? Vector3d(p.segment<3>(1) / p[0]) : Vector3d(Vector3d::Zero());
  const Vector3d& c = joint->center_of_mass;
  Matrix3d I;
  I << p[4], p[7], p[8], p[7], p[5], p[9], p[8], p[9], p[6];
  joint->inertia = I - p[0] * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
}

Eigen::VectorXd link_parameters(const Robot& robot) {
  Eigen::VectorXd out(kLinkParameters * static_cast<Eigen::Index>(robot.joints.size()));
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    out.segment<kLinkParameters>(kLinkParameters * static_cast<Eigen::Index>(i)) = link_parameters(robot.joints[i]);
  return out;
}

RigidChain::RigidChain(const Robot& robot) : gravity_(robot.gravity) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(driven.size()));
  zero_ = joint_motions(robot, rest);
  const Eigen::MatrixXd following = coupling_matrix(robot);
  coupling_.resize(following.rows(), rest.size());
  for (Eigen::Index k = 0; k < rest.size(); ++k) {
    const std::size_t joint = driven[static_cast<std::size_t>(k)];
    coupling_.col(k) = robot.joints[joint].ratio * following.col(static_cast<Eigen::Index>(joint));
  }
  for (const Joint& joint : robot.joints) {
    Link link;
    link.revolute = joint.type == JointType::revolute;
    link.axis = robot.convention == Convention::urdf ? joint.axis : Vector3d(Vector3d::UnitZ());
    // The motion about (along) z commutes with theta and d: all of a DH link comes after it, of a modified-DH link
    // theta and d.
    link.before = link.after = Isometry3d::Identity();
    switch (robot.convention) {
      case Convention::dh:
        link.after = fixed_frame(robot, joint);
        break;
      case Convention::mdh:
        link.before = fixed_frame(robot, only_before(joint));
        link.after = fixed_frame(robot, only_after(joint));
        break;
      case Convention::urdf:
        link.before = joint.T_parent_joint;
        break;
    }
    links_.push_back(link);
  }
  compile();
}

void RigidChain::compile() {
  for (const Link& link : links_) {
    // Turned so that the motion is about (along) z, and back.
    Isometry3d to_z = Isometry3d::Identity();
    to_z.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), link.axis).toRotationMatrix();
    const bool is_z = link.axis == Vector3d::UnitZ();
    const Isometry3d before = is_z ? link.before : link.before * to_z,
                     after = is_z ? link.after : to_z.inverse() * link.after;
    kernel::RigidLink out;
    Eigen::Map<Eigen::Matrix<double, 3, 4>>(out.before) = before.affine();
    Eigen::Map<Eigen::Matrix<double, 3, 4>>(out.after) = after.affine();
    out.moves_before = !before.matrix().isIdentity(0.0);
    out.moves_after = !after.matrix().isIdentity(0.0);
    out.revolute = link.revolute;
    compiled_.push_back(out);
  }
  felt_.resize(static_cast<std::size_t>(driven()));
  for (Eigen::Index i = 0; i < links(); ++i) {
    for (Eigen::Index k = 0; k < driven(); ++k) {
      coupling_rows_.push_back(coupling_(i, k));
      if (!coupling_.col(k).head(i + 1).isZero(0.0)) felt_[static_cast<std::size_t>(k)].push_back(i);
    }
  }
}

template <typename Run>
void RigidChain::passes(const Eigen::MatrixXd& q, const Eigen::MatrixXd* qd, const Eigen::MatrixXd* qdd,
                        Eigen::Index begin, Eigen::Index end, Run run) const {
  constexpr Eigen::Index kPassRows = 64;  // of a pass: what goes in and the columns of a joint stay in the cache
  thread_local std::vector<double> motions, scratch;
  const auto plane = static_cast<std::size_t>(links() * kPassRows);
  motions.resize(3 * plane);
  scratch.resize(kernel::rigid_scratch(static_cast<int>(links()), static_cast<int>(driven())));
  const kernel::RigidProgram program{compiled_.data(),
                                     static_cast<int>(links()),
                                     static_cast<int>(driven()),
                                     coupling_rows_.data(),
                                     {gravity_.x(), gravity_.y(), gravity_.z()}};
  for (Eigen::Index first = begin; first < end; first += kPassRows) {
    const Eigen::Index rows = std::min(kPassRows, end - first), all = padded(rows);
    for (Eigen::Index i = 0; i < links(); ++i) {
      const Eigen::MatrixXd* const tables[3] = {&q, qd, qdd};
      for (std::size_t t = 0; t < 3; ++t) {
        if (!tables[t]) continue;
        Eigen::Map<Eigen::VectorXd> to(motions.data() + t * plane + static_cast<std::size_t>(i * kPassRows), all);
        to.setConstant(t == 0 ? zero_[i] : 0.0);
        for (Eigen::Index k = 0; k < driven(); ++k) {
          const double by = coupling_(i, k);
          if (by != 0.0) to.head(rows) += by * tables[t]->col(k).segment(first, rows);
        }
        to.tail(all - rows).setConstant(to[rows - 1]);
      }
    }
    run(program,
        kernel::RigidTile{static_cast<int>(all), motions.data(), motions.data() + plane, motions.data() + 2 * plane,
                          kPassRows, nullptr, 0, scratch.data()},
        first, rows);
  }
}

void RigidChain::regressors(const kernel::RigidFunctions& kernel, const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd,
                            const Eigen::MatrixXd& qdd, Eigen::Index begin, Eigen::Index end, double* const* blocks,
                            Eigen::Index stride) const {
  thread_local std::vector<double*> out;
  out.resize(static_cast<std::size_t>(driven() * links()));
  passes(q, &qd, &qdd, begin, end,
         [&](const kernel::RigidProgram& program, kernel::RigidTile tile, Eigen::Index first, Eigen::Index) {
           for (std::size_t at = 0; at < out.size(); ++at)
             out[at] = blocks[at] ? blocks[at] + (first - begin) : nullptr;
           tile.blocks = out.data();
           tile.column_stride = stride;
           kernel.regressor(program, tile);
         });
}

bool RigidChain::is_near(const Eigen::MatrixXd& q) const {
  constexpr double kFar = 1e5;  // [rad]
  if (q.size() == 0) return true;
  return zero_.cwiseAbs().maxCoeff() + coupling_.cwiseAbs().rowwise().sum().maxCoeff() * q.cwiseAbs().maxCoeff() < kFar;
}

namespace {

/// Calls run(tile) with blocks that stand in tables of shape (rows, readings), from row `first` on; null: there is
/// none. Rows that the kernel would fill up, beyond the last one, get room of their own.
template <typename Run>
void fill_tables(const std::vector<Eigen::MatrixXd*>& tables, Eigen::Index first, Eigen::Index rows,
                 kernel::RigidTile tile, Run run) {
  thread_local std::vector<double> room;
  thread_local std::vector<double*> blocks;
  const Eigen::Index readings = tables.front()->cols(), size = readings * tile.samples;
  const bool fits = rows == tile.samples;
  tile.column_stride = fits ? tables.front()->rows() : tile.samples;
  room.resize(std::max(room.size(), tables.size() * static_cast<std::size_t>(size)));
  blocks.assign(tables.size(), nullptr);
  for (std::size_t k = 0; k < tables.size(); ++k) {
    if (tables[k]) blocks[k] = fits ? tables[k]->data() + first : room.data() + static_cast<Eigen::Index>(k) * size;
  }
  tile.blocks = blocks.data();
  run(tile);
  for (std::size_t k = 0; k < tables.size() && !fits; ++k) {
    if (tables[k])
      tables[k]->middleRows(first, rows) =
          Eigen::Map<const Eigen::MatrixXd>(blocks[k], tile.samples, readings).topRows(rows);
  }
}

/// Of every reading, shape=(rows, readings), to be filled. Copies of one would copy what is not there yet.
std::vector<Eigen::MatrixXd> empty_tables(Eigen::Index rows, Eigen::Index readings) {
  std::vector<Eigen::MatrixXd> out;
  for (Eigen::Index k = 0; k < readings; ++k) out.emplace_back(rows, readings);
  return out;
}

void add_places(std::vector<Eigen::MatrixXd>* tables, std::vector<Eigen::MatrixXd*>* places) {
  for (Eigen::MatrixXd& table : *tables) places->push_back(&table);
}

}  // namespace

template <typename Run>
void RigidChain::fill(const std::vector<Eigen::MatrixXd*>& tables, const Eigen::MatrixXd& q, const Eigen::MatrixXd* qd,
                      const Eigen::MatrixXd* qdd, Run run) const {
  const auto pass = [&](const kernel::RigidProgram& program, const kernel::RigidTile& tile, Eigen::Index first,
                        Eigen::Index rows) {
    fill_tables(tables, first, rows, tile, [&](const kernel::RigidTile& there) { run(program, there, first, rows); });
  };
  passes(q, qd, qdd, 0, q.rows(), pass);
}

Eigen::MatrixXd RigidChain::torques(const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd, const Eigen::MatrixXd& qdd,
                                    const Eigen::VectorXd& parameters) const {
  Eigen::MatrixXd out(q.rows(), driven());
  fill({&out}, q, &qd, &qdd,
       [&](const kernel::RigidProgram& program, const kernel::RigidTile& tile, Eigen::Index, Eigen::Index) {
         kernel::rigid_functions().torque(program, tile, parameters.data());
       });
  return out;
}

Eigen::MatrixXd RigidChain::weights(const Eigen::MatrixXd& q, const Eigen::VectorXd& parameters) const {
  Eigen::MatrixXd out(q.rows(), driven());
  fill({&out}, q, nullptr, nullptr,
       [&](const kernel::RigidProgram& program, const kernel::RigidTile& tile, Eigen::Index, Eigen::Index) {
         kernel::rigid_functions().weight(program, tile, parameters.data());
       });
  return out;
}

std::vector<Eigen::MatrixXd> RigidChain::mass_matrices(const Eigen::MatrixXd& q,
                                                       const Eigen::VectorXd& parameters) const {
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(q.rows(), q.cols());
  std::vector<Eigen::MatrixXd> out = empty_tables(q.rows(), driven());
  std::vector<Eigen::MatrixXd*> places;
  add_places(&out, &places);
  fill(places, q, &rest, &rest,
       [&](const kernel::RigidProgram& program, const kernel::RigidTile& tile, Eigen::Index, Eigen::Index) {
         kernel::rigid_functions().mass_matrix(program, tile, parameters.data());
       });
  return out;
}

RigidChain::Changes RigidChain::torque_changes(const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd,
                                               const Eigen::MatrixXd& qdd, const Eigen::VectorXd& parameters,
                                               const Eigen::MatrixXd& dq, const Eigen::MatrixXd& dqd,
                                               const Eigen::MatrixXd& dqdd, bool with_masses) const {
  Changes out;
  std::vector<Eigen::MatrixXd*> places;
  out.torques = empty_tables(q.rows(), driven());
  add_places(&out.torques, &places);
  if (with_masses) {
    out.masses = empty_tables(q.rows(), driven());
    add_places(&out.masses, &places);
  }
  places.resize(2 * static_cast<std::size_t>(driven()), nullptr);
  thread_local std::vector<double> change;
  fill(places, q, &qd, &qdd,
       [&](const kernel::RigidProgram& program, const kernel::RigidTile& tile, Eigen::Index first, Eigen::Index rows) {
         change.resize(static_cast<std::size_t>(3 * driven() * tile.stride));
         double* to = change.data();
         for (const Eigen::MatrixXd* const table : {&dq, &dqd, &dqdd}) {
           for (Eigen::Index k = 0; k < driven(); ++k, to += tile.stride) {
             std::copy_n(table->col(k).data() + first, rows, to);
             std::fill(to + rows, to + tile.samples, 0.0);
           }
         }
         kernel::rigid_functions().torque_change(program, tile, parameters.data(), change.data());
       });
  return out;
}

void RigidChain::regressor(const double* q, const double* qd, const double* qdd, Eigen::Ref<Eigen::MatrixXd> Y) const {
  Y.setZero();
  const Eigen::Map<const Eigen::VectorXd> reading(q, driven()), speed(qd, driven()), acceleration(qdd, driven());
  constexpr int kMostJoints = 200;
  thread_local std::vector<Vector3d> axes(kMostJoints), points(kMostJoints);
  LinkMotion link;
  link.a = -gravity_;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Link& fixed = links_[i];
    const auto row = static_cast<Eigen::Index>(i);
    const double motion = zero_[row] + coupling_.row(row).dot(reading);
    const double rate = coupling_.row(row).dot(speed), rate_of_rate = coupling_.row(row).dot(acceleration);

    // To the joint's frame, still part of the link before.
    const Vector3d joint_origin = link.origin + link.R * fixed.before.translation();
    link.a = link.acceleration_at(joint_origin);
    link.R = link.R * fixed.before.linear();
    const Vector3d z = link.R * fixed.axis;
    // The joint (Luh, Walker and Paul 1980, eq. 1 to 3, seen from the base).
    Vector3d origin = joint_origin;
    if (fixed.revolute) {
      link.alpha += z * rate_of_rate + link.w.cross(z) * rate;
      link.w += z * rate;
      link.R = link.R * Eigen::AngleAxisd(motion, fixed.axis).toRotationMatrix();
    } else {
      const Vector3d moved = joint_origin + z * motion;
      const Vector3d r = moved - joint_origin;
      link.a += link.alpha.cross(r) + link.w.cross(link.w.cross(r)) + z * rate_of_rate + 2.0 * link.w.cross(z) * rate;
      origin = moved;
    }
    // To the frame after the link.
    link.origin = origin;
    const Vector3d end = origin + link.R * fixed.after.translation();
    link.a = link.acceleration_at(end);
    link.origin = end;
    link.R = link.R * fixed.after.linear();
    axes[i] = z;
    points[i] = joint_origin;

    // Force and moment about the frame's origin of every parameter of one (Atkeson, An and Hollerbach 1986, eq. 7).
    Eigen::Matrix<double, 3, kLinkParameters> force = Eigen::Matrix<double, 3, kLinkParameters>::Zero(), moment = force;
    force.col(0) = link.a;
    const Matrix3d field = skew(link.alpha) + skew(link.w) * skew(link.w);
    force.middleCols<3>(1) = field * link.R;
    moment.middleCols<3>(1) = -skew(link.a) * link.R;
    const Vector3d u = link.R.transpose() * link.alpha, w = link.R.transpose() * link.w;
    Eigen::Matrix<double, 3, 6> inertial;
    inertial << u.x(), -w.y() * w.z(), w.y() * w.z(), u.y() - w.x() * w.z(), u.z() + w.x() * w.y(),
        w.y() * w.y() - w.z() * w.z(),  //
        w.x() * w.z(), u.y(), -w.x() * w.z(), u.x() + w.y() * w.z(), w.z() * w.z() - w.x() * w.x(),
        u.z() - w.x() * w.y(),  //
        -w.x() * w.y(), w.x() * w.y(), u.z(), w.x() * w.x() - w.y() * w.y(), u.x() - w.y() * w.z(),
        u.y() + w.x() * w.z();
    moment.rightCols<6>() = link.R * inertial;

    // What each joint below feels of it, and by which readings that joint moves.
    for (std::size_t j = 0; j <= i; ++j) {
      Eigen::Matrix<double, 1, kLinkParameters> felt;
      if (links_[j].revolute) {
        const Vector3d lever = (link.origin - points[j]);
        felt = axes[j].transpose() * moment + axes[j].cross(lever).transpose() * force;
      } else {
        felt = axes[j].transpose() * force;
      }
      for (Eigen::Index k = 0; k < driven(); ++k) {
        const double by = coupling_(static_cast<Eigen::Index>(j), k);
        if (by != 0.0) Y.block<1, kLinkParameters>(k, kLinkParameters * row) += by * felt;
      }
    }
  }
}

Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> torque_regressor(const Robot& robot,
                                                                                        const Eigen::MatrixXd& q,
                                                                                        const Eigen::MatrixXd& qd,
                                                                                        const Eigen::MatrixXd& qdd) {
  validate(robot);
  const RigidChain chain(robot);
  const Eigen::Index joints = chain.driven();
  require_table("q", q, q.rows(), joints);
  require_table("qd", qd, q.rows(), joints);
  require_table("qdd", qdd, q.rows(), joints);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> out(q.rows() * joints,
                                                                             kLinkParameters * chain.links());
  if (chain.is_near(q)) {
    constexpr Eigen::Index kTogether = 256;  // what is made of these is laid row by row while it is in the cache
    for (Eigen::Index first = 0; first < q.rows(); first += kTogether) {
      const Eigen::Index rows = std::min(kTogether, q.rows() - first);
      const auto part = [&](const Eigen::MatrixXd& table) -> Eigen::MatrixXd { return table.middleRows(first, rows); };
      const std::vector<Eigen::MatrixXd> columns = regressor_columns(chain, part(q), part(qd), part(qdd));
      for (Eigen::Index i = 0; i < rows; ++i)
        for (Eigen::Index j = 0; j < joints; ++j)
          out.row((first + i) * joints + j) = columns[static_cast<std::size_t>(j)].row(i);
    }
    return out;
  }
  Eigen::MatrixXd Y(joints, out.cols());
  for (Eigen::Index i = 0; i < q.rows(); ++i) {
    const Eigen::VectorXd a = q.row(i), b = qd.row(i), c = qdd.row(i);
    chain.regressor(a.data(), b.data(), c.data(), Y);
    out.middleRows(i * joints, joints) = Y;
  }
  return out;
}

std::vector<Eigen::MatrixXd> regressor_columns(const RigidChain& chain, const Eigen::MatrixXd& q,
                                               const Eigen::MatrixXd& qd, const Eigen::MatrixXd& qdd) {
  const Eigen::Index rows = q.rows(), padded = RigidChain::padded(rows);
  std::vector<Eigen::MatrixXd> out(static_cast<std::size_t>(chain.driven()),
                                   Eigen::MatrixXd::Zero(padded, kLinkParameters * chain.links()));
  std::vector<double*> blocks(static_cast<std::size_t>(chain.driven() * chain.links()), nullptr);
  for (Eigen::Index k = 0; k < chain.driven(); ++k) {
    for (const Eigen::Index link : chain.felt_links(k))
      blocks[static_cast<std::size_t>(k * chain.links() + link)] =
          out[static_cast<std::size_t>(k)].data() + padded * kLinkParameters * link;
  }
  if (rows > 0) chain.regressors(q, qd, qdd, 0, rows, blocks.data(), padded);
  for (Eigen::MatrixXd& columns : out) columns.conservativeResize(rows, Eigen::NoChange);
  return out;
}

std::vector<Eigen::MatrixXd> mass_matrix_columns(const Robot& robot, const Eigen::MatrixXd& q,
                                                 const Eigen::VectorXd& links) {
  return RigidChain(robot).mass_matrices(q, links);
}

// Kinetic energy of the rotors 1/2 sum I_i (C qd)_i^2: their mass matrix is C^T diag(I) C.
Eigen::MatrixXd rotor_matrix(const Robot& robot) {
  const Eigen::MatrixXd coupling = coupling_matrix(robot);
  const std::vector<std::size_t> driven = robot.driven_joints();
  Eigen::MatrixXd C(coupling.rows(), static_cast<Eigen::Index>(driven.size()));
  for (std::size_t k = 0; k < driven.size(); ++k)
    C.col(static_cast<Eigen::Index>(k)) =
        robot.joints[driven[k]].ratio * coupling.col(static_cast<Eigen::Index>(driven[k]));
  Eigen::VectorXd inertia(C.rows());
  for (Eigen::Index i = 0; i < C.rows(); ++i) inertia[i] = robot.joints[static_cast<std::size_t>(i)].rotor_inertia;
  return C.transpose() * inertia.asDiagonal() * C;
}

}  // namespace truing::dynamics
