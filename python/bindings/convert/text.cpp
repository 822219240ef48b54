// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/text.hpp"

#include <cstdarg>
#include <cstdio>

namespace truing::python {

std::string formatted(const char* format, ...) {
  char buffer[256];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

std::string text(double value) { return formatted("%.9g", value); }

std::string text(const Eigen::Vector3d& v) { return text(v.x()) + " " + text(v.y()) + " " + text(v.z()); }

std::string millimetres(double metres, int digits) { return formatted("%.*g mm", digits, 1e3 * metres); }

std::string milliradians(double radians) { return formatted("%.3g mrad", 1e3 * radians); }

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

}  // namespace truing::python
