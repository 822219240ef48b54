// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Numbers and lists as people write them.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace truing::python {

/// std::snprintf into a string, cut at 255 characters.
std::string formatted(const char* format, ...) __attribute__((format(printf, 1, 2)));
/// Nine significant digits.
std::string text(double value);
/// "1 2.5 0"
std::string text(const Eigen::Vector3d& v);
/// "1.23 mm", of a length in metres.
std::string millimetres(double metres, int digits = 3);
/// "1.23 mrad", of an angle in radians.
std::string milliradians(double radians);
/// "a, b, c"
std::string joined(const std::vector<std::string>& words);

}  // namespace truing::python
