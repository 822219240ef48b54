// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <locale>
#include <sstream>
#include <string>
#include <vector>

#include "math/constants.hpp"
#include "rooms.hpp"

namespace truing::math {

/// A number as text that never depends on the user's locale.
inline std::string number(double value, int digits = 6) {
  if (value != value) return "nan";  // streams write some of them as -nan
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(digits);
  out << value + 0.0;  // -0 becomes 0
  return out.str();
}

/// The same, short, but with the digits that it takes to read the very same double back.
inline std::string exact_number(double value) {
  for (const int digits : {15, 16}) {
    const std::string text = number(value, digits);
    std::istringstream in(text);
    in.imbue(std::locale::classic());
    double back = 0.0;
    if (in >> back && back == value) return text;
  }
  return number(value, 17);
}

/// "J1, J2, J3"
inline std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

/// Three digits, from 1000 on whole numbers in full: "0.124", "1142", not 1.14e+03.
inline std::string short_number(double value) {
  const bool in_full = std::abs(value) >= 999.5 && std::abs(value) < 1e9;
  return in_full ? number(std::round(value), 9) : number(value, 3);
}

/// A length or an angle as people read it: "0.124 mm", "0.3 deg".
inline std::string millimetres(double metres) { return short_number(1e3 * metres) + " mm"; }
inline std::string degrees(double radians) { return short_number(180.0 / kPi * radians) + " deg"; }

}  // namespace truing::math
