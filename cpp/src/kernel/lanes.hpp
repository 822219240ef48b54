// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Packs of numbers, one of each lane, and vectors of packs: what the files of a copy share. The build gives the copy's
// namespace and its lanes; without them this is the plain copy.

#include <cstdint>
#include <cstring>

#if !defined(TRUING_LANES)
#define TRUING_LANES 1
#define TRUING_KERNEL_NAMESPACE scalar
#endif

namespace truing::kernel {
namespace TRUING_KERNEL_NAMESPACE {
namespace {

constexpr int kLanes = TRUING_LANES;
typedef double Pack __attribute__((vector_size(8 * TRUING_LANES)));
typedef std::int64_t Mask __attribute__((vector_size(8 * TRUING_LANES)));

inline Pack load(const double* p) {
  Pack v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store(double* p, Pack v) { std::memcpy(p, &v, sizeof v); }
inline Pack splat(double x) { return Pack{} + x; }

struct Vec {
  Pack x, y, z;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(Pack s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline Pack dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

// sin and cos to about one unit in the last place for |angle| < 1e5: Cody-Waite reduction by pi/2 in three parts,
// then minimax polynomials on [-pi/4, pi/4] (coefficients: S. Moshier, Cephes).
inline void sine_cosine(Pack angle, Pack* sine, Pack* cosine) {
  const double magic =
      6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer, whose low bits are the quadrant
  const Pack shifted = angle * 0.63661977236758134308 + magic;
  const Pack k = shifted - magic;
  const Pack r =
      ((angle - k * 1.57079632673412561417) - k * 6.07710050630396597660e-11) - k * 2.02226624879595063154e-21;
  const Pack r2 = r * r;
  const Pack s = r + r * r2 *
                         (-1.66666666666666307295e-1 +
                          r2 * (8.33333333332211858878e-3 +
                                r2 * (-1.98412698295895385996e-4 +
                                      r2 * (2.75573136213857245213e-6 +
                                            r2 * (-2.50507477628578072866e-8 + r2 * 1.58962301576546568060e-10)))));
  const Pack c = 1.0 - 0.5 * r2 +
                 r2 * r2 *
                     (4.16666666666665929218e-2 +
                      r2 * (-1.38888888888730564116e-3 +
                            r2 * (2.48015872888517045348e-5 +
                                  r2 * (-2.75573141792967388112e-7 +
                                        r2 * (2.08757008419747316778e-9 + r2 * -1.13585365213876817300e-11)))));
  Mask quadrant;
  std::memcpy(&quadrant, &shifted, sizeof quadrant);
  const Mask odd = (quadrant & 1) != 0;
  const Pack sin_size = odd ? c : s;
  const Pack cos_size = odd ? s : c;
  *sine = (quadrant & 2) != 0 ? -sin_size : sin_size;
  *cosine = ((quadrant + 1) & 2) != 0 ? -cos_size : cos_size;
}

}  // namespace
}  // namespace TRUING_KERNEL_NAMESPACE
}  // namespace truing::kernel
