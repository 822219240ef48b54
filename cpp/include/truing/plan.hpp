// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/diagnose.hpp"
#include "truing/identify.hpp"

namespace truing {

/// The index of the information matrix that a plan maximises.
enum class Observability {
  d_optimal,            ///< determinant (O1 of Borm and Menq 1989)
  a_optimal,            ///< minus the sum of variances of unit-scaled parameters
  e_optimal,            ///< smallest singular value (O3 of Nahvi et al. 1994)
  inverse_condition,    ///< smallest over largest singular value (O2 of Driels and Pathre 1990)
  noise_amplification,  ///< smallest squared over largest singular value (O4 of Nahvi and Hollerbach 1996)
};

/// How `plan` works.
struct PlanOptions {
  int poses = 50;                        ///< number of poses
  double min_step = 0.2617993877991494;  ///< [rad] least motion of a revolute joint between neighbours (15 deg)
  double min_step_prismatic = 0.0;       ///< [m] the same for prismatic joints
  Observability index = Observability::d_optimal;  ///< what the plan maximises
  bool orientation = false;                        ///< full poses are measured, not only positions
  double position_sigma = 3e-5;                    ///< [m] noise of one component, for the standard errors promised
  double rotation_sigma = 1e-4;                    ///< [rad] likewise
  int sweeps = 4;                                  ///< passes of exchange over all poses
  int proposals = 64;                              ///< candidates tried for a pose in a pass
  std::uint64_t seed = 0;                          ///< of the random start and the candidates
  std::vector<std::string> free;                   ///< as in `IdentifyOptions`
  std::vector<EffectRequest> effects;              ///< effects that shall be seen as well

  bool is_valid(std::string* error) const;
};

/// What `plan` found.
struct PlanResult {
  /// shape=(poses, driven joints) [rad | m].
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joints;
  std::vector<Parameter> parameters;  ///< sigma: the standard error that this plan promises
  std::vector<Frozen> frozen;         ///< what no plan of this kind could see
  double index_start = 0.0;           ///< index of the random plan that the exchange began with
  double index_end = 0.0;             ///< index of this plan
  int exchanges = 0;                  ///< number of poses exchanged
};

/// Measurement poses by exchange on an observability index. Revolute joints without limits use -pi … pi.
/// Throws std::invalid_argument: fewer poses than the parameters need, a joint whose range is too small for `min_step`.
PlanResult plan(const Robot& robot, const PlanOptions& options = {});

/// How `distinguish` works: what will be recorded beside joints and tip, how far it will be varied, and what shall be
/// told apart.
struct DistinguishOptions {
  std::vector<std::string> columns;  ///< what is recorded beside joints and tip, of 'dir', 'payload', 'temp', 't'
  /// Effects to be told apart; poses are added if it takes any. Empty: the whole catalogue is looked at, and none are.
  std::vector<EffectRequest> separate;
  double payload = 5.0;                  ///< [kg] a pose is measured with this or with nothing
  double temperature_low = 20.0;         ///< [deg C] at the first and the last pose
  double temperature_high = 35.0;        ///< [deg C] halfway
  double seconds_per_pose = 30.0;        ///< [s]
  bool orientation = false;              ///< full poses are measured, not only positions
  double position_sigma = 3e-5;          ///< [m] noise of one component
  double rotation_sigma = 1e-4;          ///< [rad] likewise
  double alike = 0.98;                   ///< an effect of which another explains a larger fraction is not told from it
  int add = 12;                          ///< maximum number of poses added
  int proposals = 300;                   ///< candidates that each of them is chosen from
  double min_step = 0.2617993877991494;  ///< [rad] least motion of a revolute joint to an added pose
  double min_step_prismatic = 0.0;       ///< [m] the same for prismatic joints
  std::uint64_t seed = 0;                ///< of directions, payloads and proposals
  std::vector<Effect> own_effects;       ///< take part beside the catalogue

  bool is_valid(std::string* error) const;
};

/// The smallest effect that a plan would see.
struct EffectSize {
  std::string effect;               ///< its name
  std::string joint;                ///< where; empty: it belongs to no joint
  std::string parameter;            ///< the one of its parameters that shows best
  std::string unit;                 ///< of `size`
  double size = 0.0;                ///< in `unit`, when base and tool are fitted
  double size_at_tip = 0.0;         ///< [m] rms motion of the tip that this makes
  double size_with_geometry = 0.0;  ///< in `unit`, when all geometry is fitted as well; NaN: geometry takes it all up
  double size_with_geometry_at_tip = 0.0;  ///< [m] rms motion of the tip that this makes
  double standard_errors = 0.0;  ///< `size` in standard errors of the parameter, the others of its effect left out
};

/// Two effects, and how far the other can explain the first.
struct EffectPair {
  std::string effect;       ///< the first
  std::string joint;        ///< where; empty: it belongs to no joint
  std::string other;        ///< the other
  std::string other_joint;  ///< where the other is; empty: it belongs to no joint
  double r2 = 0.0;  ///< fraction of the first's motion of the tip, beyond base and tool, that the other explains
  double r2_after = std::numeric_limits<double>::quiet_NaN();    ///< with the added poses; NaN: none were asked for
  std::string parameter;                                         ///< of the first: what `size` is of
  std::string unit;                                              ///< of `size`
  double size = 0.0;                                             ///< from which on the two are told apart; NaN: never
  double size_after = std::numeric_limits<double>::quiet_NaN();  ///< the same with the added poses
  std::string separated_by;                                      ///< what to measure to tell
};

/// What `distinguish` found, of all poses, added ones included.
struct Distinction {
  std::vector<EffectSize> effects;  ///< the smallest sizes that the plan would see
  /// shape=(effects, effects): fraction of the row's effect that the column's explains.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> r2;
  std::vector<EffectPair> alike;          ///< pairs that are not told apart, largest r2 first
  std::vector<NotTestable> not_testable;  ///< effects that such data could not show
  std::vector<EffectPair> separated;      ///< every pair of those to be told apart, before and after poses were added
  int added = 0;                          ///< number of poses added; they are the last ones
  /// shape=(poses, driven joints) [rad | m]: the poses given, then those added.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joints;
  // Columns of the plan that were not asked for are empty.
  /// shape=(poses, driven joints): approach direction, -1 or 1; absent unless asked for.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> direction;
  Eigen::VectorXd payload;      ///< shape=(poses,) [kg]; absent unless asked for
  Eigen::VectorXd temperature;  ///< shape=(poses,) [deg C]; absent unless asked for
  Eigen::VectorXd time;         ///< shape=(poses,) [s]; absent unless asked for
};

/// Before any data: which effects a plan can tell apart, how small it would still see them, and the poses to add.
///
/// `joints` has a row per pose, as of PlanResult. Linear, at the robot without its effects; base and tool are fitted in
/// any case. Without the column "dir" every pose is taken to be approached from the same side. Throws
/// std::invalid_argument: unknown effects, joints or columns.
Distinction distinguish(const Robot& robot, const Eigen::MatrixXd& joints, const DistinguishOptions& options = {});

}  // namespace truing
