// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The chain that the torque regressor runs over, compiled once.

#include <vector>

#include <Eigen/Core>

#include "kernel/rigid.hpp"
#include "rooms.hpp"
#include "truing/dynamics/regressor.hpp"
#include "truing/model/robot.hpp"

namespace truing::dynamics {

/// What of a robot the regressor needs, made once.
class RigidChain {
 public:
  explicit RigidChain(const Robot& robot);

  Eigen::Index links() const { return static_cast<Eigen::Index>(links_.size()); }
  Eigen::Index driven() const { return coupling_.cols(); }

  /// Y of one sample, shape=(driven, 10 * links): readings, their speeds and accelerations [rad | m, s].
  void regressor(const double* q, const double* qd, const double* qdd, Eigen::Ref<Eigen::MatrixXd> Y) const;

  /// Links that load the joint of reading k, ascending; to it the others' columns are zero.
  const std::vector<Eigen::Index>& felt_links(Eigen::Index k) const { return felt_[static_cast<std::size_t>(k)]; }

  /// The same of rows begin to end of tables of shape (rows, driven), samples side by side on the kernel that the
  /// processor is best at. blocks[k * links + i]: where reading k's joint has its ten columns of link i, `stride`
  /// numbers apart, with room for `padded(end - begin)` rows (what is beyond the last is a copy of it); null: not
  /// wanted. A row's numbers depend neither on the rows around it nor on the thread. Angles below 1e5 rad.
  void regressors(const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd, const Eigen::MatrixXd& qdd, Eigen::Index begin,
                  Eigen::Index end, double* const* blocks, Eigen::Index stride) const {
    regressors(kernel::rigid_functions(), q, qd, qdd, begin, end, blocks, stride);
  }
  /// No joint stands beyond the angles that the kernel takes.
  bool is_near(const Eigen::MatrixXd& q) const;
  /// On a copy of the kernel of one's choice.
  void regressors(const kernel::RigidFunctions& kernel, const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd,
                  const Eigen::MatrixXd& qdd, Eigen::Index begin, Eigen::Index end, double* const* blocks,
                  Eigen::Index stride) const;
  /// The regressor of every row times `parameters` (10 * links), without forming it: shape=(rows, driven).
  Eigen::MatrixXd torques(const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd, const Eigen::MatrixXd& qdd,
                          const Eigen::VectorXd& parameters) const;
  /// The same at rest.
  Eigen::MatrixXd weights(const Eigen::MatrixXd& q, const Eigen::VectorXd& parameters) const;
  /// The mass matrix of links with these parameters in every row: column k of it, shape=(rows, driven), at place k.
  std::vector<Eigen::MatrixXd> mass_matrices(const Eigen::MatrixXd& q, const Eigen::VectorXd& parameters) const;
  /// What these torques change by, to first order, where a reading's motion is another by `dq` and its derivatives,
  /// shape=(rows, driven) each: for a change of reading k's motion alone those of all readings, shape=(rows, driven),
  /// at place k. Found on the way, where they are wanted: mass_matrices().
  struct Changes {
    std::vector<Eigen::MatrixXd> torques, masses;
  };
  Changes torque_changes(const Eigen::MatrixXd& q, const Eigen::MatrixXd& qd, const Eigen::MatrixXd& qdd,
                         const Eigen::VectorXd& parameters, const Eigen::MatrixXd& dq, const Eigen::MatrixXd& dqd,
                         const Eigen::MatrixXd& dqdd, bool with_masses = true) const;
  static constexpr Eigen::Index padded(Eigen::Index rows) {
    return (rows + kernel::kSampleMultiple - 1) / kernel::kSampleMultiple * kernel::kSampleMultiple;
  }

 private:
  void compile();
  /// Calls run(program, tile, first, rows) with what moves in rows first to first + rows, a cacheful at a time. Null:
  /// nobody looks at it.
  template <typename Run>
  void passes(const Eigen::MatrixXd& q, const Eigen::MatrixXd* qd, const Eigen::MatrixXd* qdd, Eigen::Index begin,
              Eigen::Index end, Run run) const;
  /// The same of all rows, where the tile's blocks are `tables` of shape (rows, driven); null: there is none.
  template <typename Run>
  void fill(const std::vector<Eigen::MatrixXd*>& tables, const Eigen::MatrixXd& q, const Eigen::MatrixXd* qd,
            const Eigen::MatrixXd* qdd, Run run) const;

  struct Link {
    Eigen::Isometry3d before, after;  ///< the fixed parts: T = before * motion * after
    Eigen::Vector3d axis;
    bool revolute;
  };
  std::vector<Link> links_;
  Eigen::MatrixXd coupling_;  ///< shape=(links, driven): motion of every joint for a reading's change of one
  Eigen::VectorXd zero_;      ///< motion of every joint at readings of zero [rad | m]
  Eigen::Vector3d gravity_;   ///< in the base's axes
  std::vector<std::vector<Eigen::Index>> felt_;
  std::vector<kernel::RigidLink> compiled_;  ///< the links again, motions about z
  std::vector<double> coupling_rows_;        ///< coupling_, row by row
};

/// Throws std::invalid_argument that names the table, row and joint: another shape, values that are not finite.
void require_table(const char* name, const Eigen::MatrixXd& table, Eigen::Index rows, Eigen::Index joints);

/// Columns of every row, joint by joint: shape=(rows, 10 * links) each.
std::vector<Eigen::MatrixXd> regressor_columns(const RigidChain& chain, const Eigen::MatrixXd& q,
                                               const Eigen::MatrixXd& qd, const Eigen::MatrixXd& qdd);

/// Columns of the mass matrix of the robot's links at every row, joint by joint: shape=(rows, joints) each.
std::vector<Eigen::MatrixXd> mass_matrix_columns(const Robot& robot, const Eigen::MatrixXd& q,
                                                 const Eigen::VectorXd& links);

/// Mass matrix of the rotors [kg m^2 | kg], of the joints that have a reading.
Eigen::MatrixXd rotor_matrix(const Robot& robot);

}  // namespace truing::dynamics
