// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

namespace truing {

/// One parameter of a result. Names: `J2.a`, `J3.ratio`, `tool.x`, `base.rz`, `backlash.J3`, `anchor.zero` …
/// Orientation corrections rx ry rz are rotation vectors from the nominal to the found orientation, about the parent's
/// axes.
struct Parameter {
  std::string name;      ///< full name
  double nominal = 0.0;  ///< value before, in `unit`
  double value = 0.0;    ///< value found, in `unit`
  double sigma = 0.0;    ///< standard error, in `unit`; NaN when frozen
  std::string unit;      ///< m, rad, -, rad/Nm …
  bool frozen = false;   ///< held at nominal, because the data cannot see it
};

/// A combination of parameters that the data cannot see: moving them together so changes no measurement.
struct Frozen {
  std::string parameter;                      ///< the one held at nominal
  std::map<std::string, double> combination;  ///< weight by parameter, 1 for `parameter`
  std::string why;                            ///< why it is frozen
};

}  // namespace truing
