// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Compiled once per instruction set, with TRUING_KERNEL_NAMESPACE and TRUING_LANES given by the build.
// Everything but the table of functions at the end is in that namespace, so that no copy's code can be linked into another's.

#include "kernel.hpp"

#include <cstdint>
#include <cstring>

namespace truing::kernel::TRUING_KERNEL_NAMESPACE {
namespace {

constexpr int kLanes = TRUING_LANES;
typedef double Pack __attribute__((vector_size(8 * TRUING_LANES)));
typedef std::int64_t Mask __attribute__((vector_size(8 * TRUING_LANES)));

inline Pack load(const double* p) { Pack v; std::memcpy(&v, p, sizeof v); return v; }
inline void store(double* p, Pack v) { std::memcpy(p, &v, sizeof v); }
inline Pack splat(double x) { return Pack{} + x; }
inline Pack square_root(Pack v) {
  Pack out;
  for (int i = 0; i < kLanes; ++i) out[i] = __builtin_sqrt(v[i]);
  return out;
}

struct Vec { Pack x, y, z; };
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(Pack s, Vec a) { return {s * a.x, s * a.y, s * a.z}; }
inline Pack dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline Vec load_slot(const double* slots, int slot) {
  const double* p = slots + 3 * kLanes * slot;
  return {load(p), load(p + kLanes), load(p + 2 * kLanes)};
}
inline void store_slot(double* slots, int slot, Vec v) {
  double* p = slots + 3 * kLanes * slot;
  store(p, v.x);
  store(p + kLanes, v.y);
  store(p + 2 * kLanes, v.z);
}

// sin and cos to about one unit in the last place for |angle| < 1e5: Cody-Waite reduction by pi/2 in three parts,
// then minimax polynomials on [-pi/4, pi/4] (coefficients: S. Moshier, Cephes).
inline void sine_cosine(Pack angle, Pack* sine, Pack* cosine) {
  const double magic = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer, whose low bits are the quadrant
  const Pack shifted = angle * 0.63661977236758134308 + magic;
  const Pack k = shifted - magic;
  const Pack r = ((angle - k * 1.57079632673412561417) - k * 6.07710050630396597660e-11) - k * 2.02226624879595063154e-21;
  const Pack r2 = r * r;
  const Pack s = r + r * r2 * (-1.66666666666666307295e-1 + r2 * (8.33333333332211858878e-3 + r2 * (-1.98412698295895385996e-4 +
                 r2 * (2.75573136213857245213e-6 + r2 * (-2.50507477628578072866e-8 + r2 * 1.58962301576546568060e-10)))));
  const Pack c = 1.0 - 0.5 * r2 + r2 * r2 * (4.16666666666665929218e-2 + r2 * (-1.38888888888730564116e-3 + r2 * (2.48015872888517045348e-5 +
                 r2 * (-2.75573141792967388112e-7 + r2 * (2.08757008419747316778e-9 + r2 * -1.13585365213876817300e-11)))));
  Mask quadrant;
  std::memcpy(&quadrant, &shifted, sizeof quadrant);
  const Mask odd = (quadrant & 1) != 0;
  const Pack sin_size = odd ? c : s;
  const Pack cos_size = odd ? s : c;
  *sine = (quadrant & 2) != 0 ? -sin_size : sin_size;
  *cosine = ((quadrant + 1) & 2) != 0 ? -cos_size : cos_size;
}

struct Frame { Vec x, y, z, p; };

// The two columns of R that a rotation mixes: (u, v) <- (c u + s v, c v - s u).
inline void mix(Vec* u, Vec* v, Pack c, Pack s) {
  const Vec u0 = *u;
  *u = c * u0 + s * *v;
  *v = c * *v - s * u0;
}

inline void angle_of(const Program& program, const Tile& tile, const Step& step, int lane, Pack* c, Pack* s) {
  if (step.dynamic >= 0) {
    sine_cosine(load(tile.values + step.dynamic * kTilePoses + lane), s, c);
  } else {
    *c = splat(program.constants[step.constant]);
    *s = splat(program.constants[step.constant + 1]);
  }
}

inline Pack length_of(const Program& program, const Tile& tile, const Step& step, int lane) {
  return step.dynamic >= 0 ? load(tile.values + step.dynamic * kTilePoses + lane) : splat(program.constants[step.constant]);
}

// One sweep from the measurement frame to the target; axes and origins of the wanted sites fall out on the way.
inline Frame sweep(const Program& program, const Tile& tile, int lane) {
  const Pack zero = splat(0.0), one = splat(1.0);
  Frame f{{one, zero, zero}, {zero, one, zero}, {zero, zero, one}, {zero, zero, zero}};
  Pack c, s;
  for (const Step* step = program.steps; step != program.steps + program.step_count; ++step) {
    switch (step->code) {
      case Code::rotate_x: angle_of(program, tile, *step, lane, &c, &s); mix(&f.y, &f.z, c, s); break;
      case Code::rotate_y: angle_of(program, tile, *step, lane, &c, &s); mix(&f.z, &f.x, c, s); break;
      case Code::rotate_z: angle_of(program, tile, *step, lane, &c, &s); mix(&f.x, &f.y, c, s); break;
      case Code::translate_x: f.p = f.p + length_of(program, tile, *step, lane) * f.x; break;
      case Code::translate_y: f.p = f.p + length_of(program, tile, *step, lane) * f.y; break;
      case Code::translate_z: f.p = f.p + length_of(program, tile, *step, lane) * f.z; break;
      case Code::rotate_fixed: {
        const double* m = program.constants + step->constant;
        const Frame g = f;
        f.x = splat(m[0]) * g.x + splat(m[1]) * g.y + splat(m[2]) * g.z;
        f.y = splat(m[3]) * g.x + splat(m[4]) * g.y + splat(m[5]) * g.z;
        f.z = splat(m[6]) * g.x + splat(m[7]) * g.y + splat(m[8]) * g.z;
        break;
      }
      case Code::save_x: store_slot(tile.slots, step->slot, f.x); break;
      case Code::save_y: store_slot(tile.slots, step->slot, f.y); break;
      case Code::save_z: store_slot(tile.slots, step->slot, f.z); break;
      case Code::save_origin: store_slot(tile.slots, step->slot, f.p); break;
    }
  }
  return f;
}

// Square root of the weight that a robust loss gives a residual of squared norm s2 (IRLS: weight = rho'(s) / s).
inline Pack root_weight(RowLoss loss, double scale, Pack s2) {
  const Pack one = splat(1.0);
  const Pack u2 = s2 / (scale * scale);
  switch (loss) {
    case RowLoss::none: break;
    case RowLoss::huber: return u2 <= one ? one : square_root(one / square_root(u2 > one ? u2 : one));
    case RowLoss::cauchy: return square_root(one / (one + u2));
    case RowLoss::tukey: return u2 < one ? one - u2 : splat(0.0);
  }
  return one;
}

struct Motion { Vec linear, angular; };

template <Kind kind>
inline Motion column_motion(const Program& program, const Tile& tile, const ColumnPlan& plan, Vec tip) {
  const Pack zero = splat(0.0);
  Motion sum{{zero, zero, zero}, {zero, zero, zero}};
  for (const Part* part = program.parts + plan.first_part; part != program.parts + plan.first_part + plan.part_count; ++part) {
    const Vec axis = load_slot(tile.slots, part->axis);
    const Vec linear = part->origin < 0 ? axis : cross(axis, tip - load_slot(tile.slots, part->origin));
    const Pack weight = splat(part->weight);
    const bool alone = plan.part_count == 1 && part->weight == 1.0;
    sum.linear = alone ? linear : sum.linear + weight * linear;
    if (kind == Kind::pose && part->origin >= 0) sum.angular = alone ? axis : sum.angular + weight * axis;
  }
  return sum;
}

template <Kind kind, bool weighted>
inline void evaluate_pack(const Program& program, const Tile& tile, int lane) {
  constexpr int components = kind == Kind::distance ? 1 : kind == Kind::position ? 3 : 6;
  constexpr int column_size = components * kTilePoses;
  const Frame f = sweep(program, tile, lane);
  const double* m = tile.measured + lane;

  // Residual, predicted minus measured.
  Pack r[components];
  Vec toward{};          // distance: unit vector from the anchor to the tip
  Pack qw{};             // pose: the error quaternion of R_predicted R_measured^T
  Vec qv{};
  if (kind == Kind::distance) {
    const Vec from_anchor = f.p - Vec{splat(program.anchor[0]), splat(program.anchor[1]), splat(program.anchor[2])};
    const Pack length = square_root(dot(from_anchor, from_anchor));
    toward = (1.0 / length) * from_anchor;
    r[0] = length + program.anchor[3] - load(m);
  } else {
    r[0] = f.p.x - load(m);
    r[1] = f.p.y - load(m + kTilePoses);
    r[2] = f.p.z - load(m + 2 * kTilePoses);
  }
  if (kind == Kind::pose) {
    const auto column = [&](int k) {
      const double* c = m + (3 + 3 * k) * kTilePoses;
      return Vec{load(c), load(c + kTilePoses), load(c + 2 * kTilePoses)};
    };
    const Vec mx = column(0), my = column(1), mz = column(2);
    // E = sum over k of p_k m_k^T: its trace is 4 w^2 - 1, its antisymmetric part sum of m_k x p_k is 4 w v.
    const Pack trace = dot(mx, f.x) + dot(my, f.y) + dot(mz, f.z);
    const Pack w2 = 0.25 * (1.0 + trace);
    qw = square_root(w2 > 1e-12 ? w2 : splat(1e-12));
    qv = (0.25 / qw) * (cross(mx, f.x) + cross(my, f.y) + cross(mz, f.z));
    r[components - 3] = 2.0 * qv.x;
    r[components - 2] = 2.0 * qv.y;
    r[components - 1] = 2.0 * qv.z;
  }

  // Scales, weights and loss.
  Pack scale[components];
  Pack s2 = splat(0.0);
  for (int k = 0; k < components; ++k) {
    scale[k] = splat(k < 3 ? program.position_scale : program.rotation_scale);
    if (weighted && tile.position_weight) scale[k] *= load((k < 3 ? tile.position_weight : tile.rotation_weight) + lane);
    s2 += scale[k] * r[k] * scale[k] * r[k];
  }
  if (tile.squared_norm) store(tile.squared_norm + lane, s2);
  if (tile.tip) {
    const Vec out[4] = {f.p, f.x, f.y, f.z};
    for (int k = 0; k < 4; ++k) {
      store(tile.tip + (3 * k) * kTilePoses + lane, out[k].x);
      store(tile.tip + (3 * k + 1) * kTilePoses + lane, out[k].y);
      store(tile.tip + (3 * k + 2) * kTilePoses + lane, out[k].z);
    }
  }
  if (weighted) {
    const Pack root = root_weight(program.loss, program.loss_scale, s2);
    for (int k = 0; k < components; ++k) scale[k] *= root;
  }
  for (int k = 0; k < components; ++k) store(tile.residual + k * kTilePoses + lane, weighted ? scale[k] * r[k] : r[k]);

  // Columns.
  for (int c = 0; c < program.column_count; ++c) {
    const ColumnPlan& plan = program.columns[c];
    Pack out[components];
    if (plan.fixed_axis >= 0) {
      for (int k = 0; k < components; ++k) out[k] = splat(k == plan.fixed_axis ? -1.0 : 0.0);
      if (kind == Kind::distance) {
        out[0] = plan.fixed_axis == 0 ? -toward.x : plan.fixed_axis == 1 ? -toward.y : plan.fixed_axis == 2 ? -toward.z : splat(1.0);
      }
    } else {
      Motion motion = column_motion<kind>(program, tile, plan, f.p);
      if (plan.basis >= 0) {
        const Pack phi = load(tile.bases + plan.basis * kTilePoses + lane);
        motion.linear = phi * motion.linear;
        if (kind == Kind::pose) motion.angular = phi * motion.angular;
      }
      if (kind == Kind::distance) {
        out[0] = dot(toward, motion.linear);
      } else {
        out[0] = motion.linear.x;
        out[1] = motion.linear.y;
        out[2] = motion.linear.z;
      }
      if (kind == Kind::pose) {
        // d(2 v) = w omega + omega x v for R_predicted <- Exp(omega) R_predicted.
        const Vec turn = qw * motion.angular + cross(motion.angular, qv);
        out[components - 3] = turn.x;
        out[components - 2] = turn.y;
        out[components - 1] = turn.z;
      }
    }
    double* column = tile.jacobian + static_cast<std::ptrdiff_t>(c) * column_size + lane;
    for (int k = 0; k < components; ++k) store(column + k * kTilePoses, weighted ? scale[k] * out[k] : out[k]);
  }
}

template <Kind kind, bool weighted>
void evaluate_tile(const Program& program, const Tile& tile) {
  for (int lane = 0; lane < tile.poses; lane += kLanes) evaluate_pack<kind, weighted>(program, tile, lane);
}

void evaluate(const Program& program, const Tile& tile) {
  const bool weighted = tile.position_weight || program.loss != RowLoss::none || program.position_scale != 1.0 || program.rotation_scale != 1.0;
  switch (program.kind) {
    case Kind::position: weighted ? evaluate_tile<Kind::position, true>(program, tile) : evaluate_tile<Kind::position, false>(program, tile); break;
    case Kind::pose: weighted ? evaluate_tile<Kind::pose, true>(program, tile) : evaluate_tile<Kind::pose, false>(program, tile); break;
    case Kind::distance: weighted ? evaluate_tile<Kind::distance, true>(program, tile) : evaluate_tile<Kind::distance, false>(program, tile); break;
  }
}

// Gram: blocks of kRows x kCols columns whose products stay in registers while the tile's rows stream by.
#if TRUING_LANES == 8
constexpr int kRows = 4, kCols = 6;  // 24 of 32 registers
#elif TRUING_LANES == 1
constexpr int kRows = 2, kCols = 2;
#else
constexpr int kRows = 4, kCols = 3;  // 12 of 16 registers
#endif
constexpr int kBlock = kRows * kCols * kLanes;

// Calls f(first row column, first col column, accumulator) for each block that touches the upper triangle.
template <typename F>
inline void for_blocks(int columns, F f) {
  std::size_t at = 0;
  for (int i = 0; i < columns; i += kRows) {
    for (int j = i - i % kCols; j < columns; j += kCols) {
      if (j + kCols <= i) continue;
      f(i, j, at);
      at += kBlock;
    }
  }
}

std::size_t gram_size(int columns) {
  std::size_t size = 0;
  for_blocks(columns, [&](int, int, std::size_t at) { size = at + kBlock; });
  return size;
}

void gram_add(const double* c, std::ptrdiff_t stride, int columns, int length, double* acc) {
  for_blocks(columns, [&](int i, int j, std::size_t at) {
    const double* a[kRows];
    const double* b[kCols];
    // Beyond the last column the last one is read again; gram_reduce leaves those products out.
    for (int m = 0; m < kRows; ++m) a[m] = c + stride * (i + m < columns ? i + m : columns - 1);
    for (int n = 0; n < kCols; ++n) b[n] = c + stride * (j + n < columns ? j + n : columns - 1);
    Pack sum[kRows][kCols];
    for (int m = 0; m < kRows; ++m)
      for (int n = 0; n < kCols; ++n) sum[m][n] = load(acc + at + (m * kCols + n) * kLanes);
    for (int k = 0; k < length; k += kLanes) {
      Pack left[kRows];
      for (int m = 0; m < kRows; ++m) left[m] = load(a[m] + k);
      for (int n = 0; n < kCols; ++n) {
        const Pack right = load(b[n] + k);
        for (int m = 0; m < kRows; ++m) sum[m][n] += left[m] * right;
      }
    }
    for (int m = 0; m < kRows; ++m)
      for (int n = 0; n < kCols; ++n) store(acc + at + (m * kCols + n) * kLanes, sum[m][n]);
  });
}

void gram_reduce(double* acc, int columns, double* out) {
  for_blocks(columns, [&](int i, int j, std::size_t at) {
    for (int m = 0; m < kRows; ++m) {
      for (int n = 0; n < kCols; ++n) {
        double total = 0.0;
        for (int l = 0; l < kLanes; ++l) total += acc[at + (m * kCols + n) * kLanes + l];
        if (i + m <= j + n && j + n < columns) out[static_cast<std::ptrdiff_t>(j + n) * columns + i + m] += total;
      }
    }
    std::memset(acc + at, 0, kBlock * sizeof(double));
  });
}

}  // namespace

#define TRUING_TEXT_OF(x) #x
#define TRUING_TEXT(x) TRUING_TEXT_OF(x)
extern const Functions table;
const Functions table{TRUING_TEXT(TRUING_KERNEL_NAMESPACE), kLanes, evaluate, gram_size, gram_add, gram_reduce};

}  // namespace truing::kernel::TRUING_KERNEL_NAMESPACE
