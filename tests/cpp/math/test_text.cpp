// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "math/text.hpp"

#include <doctest/doctest.h>

using truing::math::degrees;
using truing::math::millimetres;
using truing::math::short_number;

TEST_CASE("lengths and angles in sentences have no powers of ten where people write none") {
  CHECK(millimetres(1.2345e-4) == "0.123 mm");
  CHECK(millimetres(0.9994) == "999 mm");
  CHECK(millimetres(0.9996) == "1000 mm");
  CHECK(millimetres(-1.1424) == "-1142 mm");
  CHECK(millimetres(20.0) == "20000 mm");
  CHECK(degrees(truing::math::kPi) == "180 deg");
  CHECK(degrees(8.0 * truing::math::kPi) == "1440 deg");
  CHECK(short_number(1e12) == "1e+12");
  CHECK(short_number(0.0) == "0");
}
