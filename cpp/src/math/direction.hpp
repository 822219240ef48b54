// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <Eigen/Core>

#include "math/text.hpp"
#include "rooms.hpp"

namespace truing::math {

/// "base z", or the vector where it is not near an axis.
inline std::string direction_name(const Eigen::Vector3d& d, const std::string& frame) {
  Eigen::Index k = 0;
  if (d.cwiseAbs().maxCoeff(&k) > 0.996) return frame + " " + std::string(1, "xyz"[k]);
  return frame + " (" + number(d.x(), 3) + ", " + number(d.y(), 3) + ", " + number(d.z(), 3) + ")";
}

}  // namespace truing::math
