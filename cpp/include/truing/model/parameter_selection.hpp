// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "truing/model/effect.hpp"

namespace truing {

/// Which parameters of a model are to be found.
struct ParameterSelection {
  /// Names and globs ('J2.*', '*.ratio'); empty: every geometric value and the targets. What belongs to the instrument
  /// (base frame, anchor, fixed points) is always found unless it is in `hold`.
  std::vector<std::string> free;
  std::vector<std::string> hold;              ///< names and globs that stay at nominal whatever else is asked for
  std::vector<EffectRequest> effects;         ///< effects to fit as well
  double hayati_angle = 0.08726646259971647;  ///< [rad] neighbouring axes nearer to parallel get beta (5 deg)
};

}  // namespace truing
