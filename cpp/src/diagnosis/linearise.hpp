// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/robot.hpp"

namespace truing::diagnosis {

struct Linearisation {
  Robot at;                             ///< geometry found under a prior: where columns are taken
  std::map<std::string, double> shift;  ///< geometric parameters there minus the nominal ones
};

/// The robot nearest to the data that is still plausible: all geometry under a prior of 10 mm and 10 mrad, robust, so
/// that what the data cannot see stays where it is. `frames`: base and targets found already. Columns are taken there,
/// since second order counts: a tool or a zero that is far off spoils every column beyond it.
Linearisation linearise(const Robot& frames, const Measurements& data, const std::vector<std::int32_t>& rows,
                        double rotation_length, int threads);

/// A linearisation with its links as drawn: where weights and other inputs of laws are looked at. What the data cannot
/// tell from the tool is partly in the last links, and would load a balanced joint to a side that nobody knows.
Robot links_as_drawn(Robot at, const Robot& nominal);

}  // namespace truing::diagnosis
