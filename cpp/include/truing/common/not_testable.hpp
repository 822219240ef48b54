// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace truing {

/// An effect that the data could not show, whether it is there or not.
struct NotTestable {
  std::string effect;
  std::vector<std::string> joints;  ///< empty: at any
  std::string why;                  ///< "no column temp_C", "J1 does not move", "the same as the base frame" …
};

}  // namespace truing
