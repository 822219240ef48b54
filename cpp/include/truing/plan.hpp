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

/// Which number of the information matrix's eigenvalues a plan makes large.
enum class Observability {
  d_optimal,            ///< determinant (O1 of Borm and Menq 1989)
  a_optimal,            ///< minus the sum of variances of unit-scaled parameters
  e_optimal,            ///< smallest singular value (O3 of Nahvi et al. 1994)
  inverse_condition,    ///< smallest over largest singular value (O2 of Driels and Pathre 1990)
  noise_amplification,  ///< smallest squared over largest singular value (O4 of Nahvi and Hollerbach 1996)
};

struct PlanOptions {
  int poses = 50;
  double min_step = 0.2617993877991494;  ///< [rad] every revolute joint moves by more between neighbours (15 deg)
  double min_step_prismatic = 0.0;       ///< [m] the same for prismatic joints
  Observability index = Observability::d_optimal;
  bool orientation = false;      ///< full poses are measured, not only positions
  double position_sigma = 3e-5;  ///< [m] of one component, for the standard errors promised
  double rotation_sigma = 1e-4;  ///< [rad]
  int sweeps = 4;                ///< passes of exchange over all poses
  int proposals = 64;            ///< candidates tried for a pose in a pass
  std::uint64_t seed = 0;
  std::vector<std::string> free;  ///< as in IdentifyOptions
  std::vector<EffectRequest> effects;

  bool is_valid(std::string* error) const;
};

struct PlanResult {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>
      joints;                         ///< shape (poses, driven joints) [rad | m]
  std::vector<Parameter> parameters;  ///< sigma: the standard error this plan promises
  std::vector<Frozen> frozen;         ///< what no plan of this kind could see
  double index_start = 0.0;           ///< of the random plan that the exchange began with
  double index_end = 0.0;
  int exchanges = 0;
};

/// Measurement poses by exchange on an observability index. Revolute joints without limits use -pi … pi.
/// Throws std::invalid_argument: fewer poses than the parameters need, a joint whose range is too small for `min_step`.
PlanResult plan(const Robot& robot, const PlanOptions& options = {});

/// What will be recorded beside joints and tip, how far it will be varied, and what shall be told apart.
struct DistinguishOptions {
  std::vector<std::string> columns;  ///< of "dir", "payload", "temp", "t"
  std::vector<EffectRequest>
      separate;          ///< to be told apart, poses are added if it takes any; empty: the whole catalogue is looked at
  double payload = 5.0;  ///< [kg] a pose is measured with this or with nothing
  double temperature_low = 20.0;         ///< [deg C] at the first and the last pose …
  double temperature_high = 35.0;        ///< … and halfway
  double seconds_per_pose = 30.0;        ///< [s]
  bool orientation = false;              ///< full poses are measured, not only positions
  double position_sigma = 3e-5;          ///< [m] of one component
  double rotation_sigma = 1e-4;          ///< [rad]
  double alike = 0.98;                   ///< an effect of which another explains a larger share is not told from it
  int add = 12;                          ///< at most so many poses are added
  int proposals = 300;                   ///< poses that each of them is chosen from
  double min_step = 0.2617993877991494;  ///< [rad] as in PlanOptions, for added poses
  double min_step_prismatic = 0.0;       ///< [m]
  std::uint64_t seed = 0;                ///< of directions, payloads and proposals
  std::vector<Effect> own_effects;       ///< take part beside the catalogue

  bool is_valid(std::string* error) const;
};

/// The smallest effect that a plan would see.
struct EffectSize {
  std::string effect, joint;        ///< joint: empty if it belongs to none
  std::string parameter, unit;      ///< the one of its parameters that shows best
  double size = 0.0;                ///< in the parameter's unit, when base and tool are fitted
  double size_at_tip = 0.0;         ///< rms motion of the tip that this makes [m]
  double size_with_geometry = 0.0;  ///< when all geometry is fitted as well; NaN: geometry takes it all up
  double size_with_geometry_at_tip = 0.0;
  double standard_errors = 0.0;  ///< that `size` is of the parameter, the others of its effect left out
};

/// Two effects, and how far the first is like what the other can do.
struct EffectPair {
  std::string effect, joint, other, other_joint;
  double r2 = 0.0;  ///< share of the first's motion of the tip, beyond base and tool, that the other explains
  double r2_after = std::numeric_limits<double>::quiet_NaN();  ///< with the added poses; NaN: none were asked for
  std::string parameter, unit;
  double size = 0.0;  ///< of the first, from which on it is told from the other; NaN: never
  double size_after = std::numeric_limits<double>::quiet_NaN();
  std::string separated_by;  ///< what to measure to tell
};

struct Distinction {
  std::vector<EffectSize> effects;  ///< as of all poses, added ones included; so are the next three
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>
      r2;                         ///< share of the row's effect that the column's explains
  std::vector<EffectPair> alike;  ///< not told apart, most alike first
  std::vector<NotTestable> not_testable;
  std::vector<EffectPair> separated;  ///< every pair of those to be told apart, before and after poses were added
  int added = 0;                      ///< the last so many poses
  // The whole plan: the poses given, then those added. Columns that were not asked for are empty.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joints;     ///< [rad | m]
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> direction;  ///< -1, 1, of every driven joint
  Eigen::VectorXd payload, temperature, time;                                        ///< [kg], [deg C], [s]
};

/// Before any data: which effects a plan can tell apart, how small it would still see them, and the poses to add.
///
/// `joints` has a row per pose, as of PlanResult. Linear, at the robot without its effects; base and tool are fitted in
/// any case. Without the column "dir" every pose is taken to be approached from the same side. Throws
/// std::invalid_argument: unknown effects, joints or columns.
Distinction distinguish(const Robot& robot, const Eigen::MatrixXd& joints, const DistinguishOptions& options = {});

}  // namespace truing
