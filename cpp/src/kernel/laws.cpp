// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Compiled once per instruction set, like kernel.cpp.

#include "laws.hpp"

#include "lanes.hpp"

namespace truing::kernel::TRUING_KERNEL_NAMESPACE {
namespace {

inline Pack size_of(Pack x) { return x < 0.0 ? -x : x; }

// x = k log 2 + r, and exp(r) by a rational function (S. Moshier, Cephes).
inline Pack exponential(Pack x) {
  const double magic = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer, which its low bits are
  const Pack shifted = x * 1.44269504088896340736 + magic;
  const Pack k = shifted - magic;
  const Pack r = (x - k * 6.93145751953125e-1) - k * 1.42860682030941723212e-6;
  const Pack r2 = r * r;
  const Pack p = r * (9.99999999999999999910e-1 + r2 * (3.02994407707441961300e-2 + r2 * 1.26177193074810590878e-4));
  const Pack q =
      2.0 + r2 * (2.27265548208155028766e-1 + r2 * (2.52448340349684104192e-3 + r2 * 3.00198505138664455042e-6));
  Mask bits;
  std::memcpy(&bits, &shifted, sizeof bits);
  bits = (bits + 1023) << 52;  // of 2^k
  Pack power;
  std::memcpy(&power, &bits, sizeof power);
  return x < -708.0 ? Pack{} : (1.0 + 2.0 * (p / (q - p))) * power;
}

// By a rational function near nought (S. Moshier, Cephes), else by the exponential.
inline Pack hyperbolic_tangent(Pack x) {
  const Pack size = size_of(x), far = splat(20.0), x2 = x * x;  // from there on it is one to the last bit
  const Pack p = -1.61468768441708447952e3 + x2 * (-9.92877231001918586564e1 + x2 * -9.64399179425052238628e-1);
  const Pack q = 4.84406305325125486048e3 + x2 * (2.23548839060100448583e3 + x2 * (1.12811678491632931402e2 + x2));
  const Pack near = x + x * x2 * (p / q);
  const Pack beyond = 1.0 - 2.0 / (exponential(2.0 * (size < far ? size : far)) + 1.0);
  const Pack signed_beyond = x < 0.0 ? -beyond : beyond;
  return size > 0.625 ? signed_beyond : near;
}

// |x| + log(1 + e), e = exp(-2 |x|), the log as 2 artanh(e / (2 + e)) by its series.
inline Pack log_two_cosh(Pack x) {
  constexpr double kOver[] = {1.0,        1.0 / 3.0,  1.0 / 5.0,  1.0 / 7.0,  1.0 / 9.0,  1.0 / 11.0,
                              1.0 / 13.0, 1.0 / 15.0, 1.0 / 17.0, 1.0 / 19.0, 1.0 / 21.0, 1.0 / 23.0,
                              1.0 / 25.0, 1.0 / 27.0, 1.0 / 29.0, 1.0 / 31.0, 1.0 / 33.0};
  constexpr int kTerms = sizeof kOver / sizeof kOver[0];  // the next is below half a unit in the last place at e = 1
  const Pack e = exponential(-2.0 * size_of(x));
  const Pack s = e / (2.0 + e), s2 = s * s;
  Pack sum = splat(kOver[kTerms - 1]);
  for (int k = kTerms - 2; k >= 0; --k) sum = kOver[k] + s2 * sum;
  return size_of(x) + 2.0 * s * sum;
}

void exponential_of(const double* x, int count, double* out) {
  for (int i = 0; i < count; i += kLanes) store(out + i, exponential(load(x + i)));
}
void hyperbolic_tangent_of(const double* x, int count, double* out) {
  for (int i = 0; i < count; i += kLanes) store(out + i, hyperbolic_tangent(load(x + i)));
}
void log_two_cosh_of(const double* x, int count, double* out) {
  for (int i = 0; i < count; i += kLanes) store(out + i, log_two_cosh(load(x + i)));
}

}  // namespace

#define TRUING_TEXT_OF(x) #x
#define TRUING_TEXT(x) TRUING_TEXT_OF(x)
extern const LawFunctions law_table;
const LawFunctions law_table{TRUING_TEXT(TRUING_KERNEL_NAMESPACE), exponential_of, hyperbolic_tangent_of,
                             log_two_cosh_of};

}  // namespace truing::kernel::TRUING_KERNEL_NAMESPACE
