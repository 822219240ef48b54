// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Functions that laws of friction are made of, number by number in SIMD lanes. See README.md in this folder.

namespace truing::kernel {

/// Of `count` numbers, a multiple of kSampleMultiple; `out` may be `x`. Good to three units in the last place.
struct LawFunctions {
  const char* name;
  void (*exponential)(const double* x, int count, double* out);  ///< of x up to 709; below -708 it is nought
  void (*hyperbolic_tangent)(const double* x, int count, double* out);
  void (*log_two_cosh)(const double* x, int count, double* out);  ///< log(2 cosh x), the tangent's integral
};

/// The copy of the same name as functions().
const LawFunctions& law_functions();
/// The named copy, or null when this machine or build lacks it.
const LawFunctions* law_functions(const char* name);

}  // namespace truing::kernel
