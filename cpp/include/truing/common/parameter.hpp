// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

namespace truing {

/// One parameter of the result. Names: `J2.a`, `J3.ratio`, `tool.x`, `base.rz`, `backlash.J3`, `anchor.zero` …
/// Orientation corrections rx ry rz are rotation vectors from the nominal to the found orientation, about the parent's
/// axes.
struct Parameter {
  std::string name;
  double nominal = 0.0;
  double value = 0.0;
  double sigma = 0.0;  ///< standard error; NaN when frozen
  std::string unit;    ///< m, rad, -, rad/Nm …
  bool frozen = false;
};

/// A combination of parameters that the data cannot see: moving them together so changes no measurement.
struct Frozen {
  std::string parameter;                      ///< the one held at nominal
  std::map<std::string, double> combination;  ///< weights, 1 for `parameter`
  std::string why;
};

}  // namespace truing
