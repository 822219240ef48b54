// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "truing/identify.hpp"

namespace truing {

/// Which number of the information matrix's eigenvalues a plan makes large.
enum class Observability {
  d_optimal,           ///< determinant (O1 of Borm and Menq 1989)
  a_optimal,           ///< minus the sum of variances of unit-scaled parameters
  e_optimal,           ///< smallest singular value (O3 of Nahvi et al. 1994)
  inverse_condition,   ///< smallest over largest singular value (O2 of Driels and Pathre 1990)
  noise_amplification, ///< smallest squared over largest singular value (O4 of Nahvi and Hollerbach 1996)
};

struct PlanOptions {
  int poses = 50;
  double min_step = 0.2617993877991494;  ///< [rad] every revolute joint moves by more between neighbours (15 deg)
  double min_step_prismatic = 0.0;       ///< [m] the same for prismatic joints
  Observability index = Observability::d_optimal;
  bool orientation = false;              ///< full poses are measured, not only positions
  double position_sigma = 3e-5;          ///< [m] of one component, for the standard errors promised
  double rotation_sigma = 1e-4;          ///< [rad]
  int sweeps = 4;                        ///< passes of exchange over all poses
  int proposals = 64;                    ///< candidates tried for a pose in a pass
  std::uint64_t seed = 0;
  std::vector<std::string> free;         ///< as in IdentifyOptions
  std::vector<EffectRequest> effects;

  bool is_valid(std::string* error) const;
};

struct PlanResult {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joints;  ///< shape (poses, driven joints) [rad | m]
  std::vector<Parameter> parameters;  ///< sigma: the standard error this plan promises
  std::vector<Frozen> frozen;         ///< what no plan of this kind could see
  double index_start = 0.0;           ///< of the random plan that the exchange began with
  double index_end = 0.0;
  int exchanges = 0;
};

/// Measurement poses by exchange on an observability index. Revolute joints without limits use -pi … pi.
/// Throws std::invalid_argument: fewer poses than the parameters need, a joint whose range is too small for `min_step`.
PlanResult plan(const Robot& robot, const PlanOptions& options = {});

}  // namespace truing
