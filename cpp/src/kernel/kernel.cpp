// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Compiled once per instruction set, with TRUING_KERNEL_NAMESPACE and TRUING_LANES given by the build.
// Everything but the table of functions at the end is in that namespace, so that no copy's code can be linked into
// another's.

#include "kernel.hpp"

#include <cstdint>
#include <cstring>

#include "lanes.hpp"

namespace truing::kernel::TRUING_KERNEL_NAMESPACE {
namespace {

inline Pack square_root(Pack v) {
  Pack out;
  for (int i = 0; i < kLanes; ++i) out[i] = __builtin_sqrt(v[i]);
  return out;
}

// Poses that go through the chain together: enough independent work to hide what one multiplication waits for the last.
constexpr int kGroupPoses = kLanes == 8 ? 16 : 8;
static_assert(kGroupPoses <= kMostGroupPoses && kTilePoses % kGroupPoses == 0, "a tile is made of whole groups");

// A vector for each pose of a group: [3][kGroupPoses].
inline Vec load_vec(const double* p) { return {load(p), load(p + kGroupPoses), load(p + 2 * kGroupPoses)}; }
inline void store_vec(double* p, Vec v) {
  store(p, v.x);
  store(p + kGroupPoses, v.y);
  store(p + 2 * kGroupPoses, v.z);
}

constexpr int kVec = 3 * kGroupPoses;

inline double* at_slot(const Tile& tile, int slot) { return tile.slots + slot * kVec; }

// The same vectors for every pose of a group.
inline void fill_slots(const Tile& tile, const int* slots, const double* vectors, int count) {
  for (int k = 0; k < count; ++k) {
    const Vec v{splat(vectors[3 * k]), splat(vectors[3 * k + 1]), splat(vectors[3 * k + 2])};
    for (int lane = 0; lane < kGroupPoses; lane += kLanes) store_vec(at_slot(tile, slots[k]) + lane, v);
  }
}

// R <- R Rot(angle).
inline void rotate(const Program& program, const Tile& tile, const double* angles, const Step& step) {
  Pack c{}, s{};
  if (step.dynamic < 0) {
    c = splat(program.constants[step.constant]);
    s = splat(program.constants[step.constant + 1]);
  }
  for (int lane = 0; lane < kGroupPoses; lane += kLanes) {
    if (step.dynamic >= 0) sine_cosine(load(angles + lane), &s, &c);
    const Vec u = load_vec(at_slot(tile, step.in[0]) + lane), v = load_vec(at_slot(tile, step.in[1]) + lane);
    store_vec(at_slot(tile, step.out[0]) + lane, c * u + s * v);
    store_vec(at_slot(tile, step.out[1]) + lane, c * v - s * u);
  }
}

// p <- p + length * column of R.
inline void translate(const Program& program, const Tile& tile, const double* lengths, const Step& step) {
  for (int lane = 0; lane < kGroupPoses; lane += kLanes) {
    const Pack length = step.dynamic < 0 ? splat(program.constants[step.constant]) : load(lengths + lane);
    store_vec(at_slot(tile, step.out[0]) + lane,
              load_vec(at_slot(tile, step.in[0]) + lane) + length * load_vec(at_slot(tile, step.in[1]) + lane));
  }
}

// R <- R F.
inline void rotate_fixed(const Tile& tile, const double* f, const Step& step) {
  for (int lane = 0; lane < kGroupPoses; lane += kLanes) {
    const Vec x = load_vec(at_slot(tile, step.in[0]) + lane), y = load_vec(at_slot(tile, step.in[1]) + lane),
              z = load_vec(at_slot(tile, step.in[2]) + lane);
    for (int k = 0; k < 3; ++k)
      store_vec(at_slot(tile, step.out[k]) + lane,
                splat(f[3 * k]) * x + splat(f[3 * k + 1]) * y + splat(f[3 * k + 2]) * z);
  }
}

// One sweep from the measurement frame to the target; axes and origins of the wanted sites stay in their slots.
inline void sweep(const Program& program, const Tile& tile, int first) {
  fill_slots(tile, program.start_slots, program.start_vectors, program.start_count);
  for (const Step* step = program.steps; step != program.steps + program.step_count; ++step) {
    const double* values = tile.values + (step->dynamic < 0 ? 0 : step->dynamic) * kTilePoses + first;
    switch (step->code) {
      case Code::rotate:
        rotate(program, tile, values, *step);
        break;
      case Code::translate:
        translate(program, tile, values, *step);
        break;
      case Code::fixed:
        rotate_fixed(tile, program.constants + step->constant, *step);
        break;
    }
  }
}

// Square root of the weight that a robust loss gives a residual of squared norm s2 (IRLS: weight = rho'(s) / s).
inline Pack root_weight(RowLoss loss, double scale, Pack s2) {
  const Pack one = splat(1.0);
  const Pack u2 = s2 / (scale * scale);
  switch (loss) {
    case RowLoss::none:
      break;
    case RowLoss::huber:
      return u2 <= one ? one : square_root(one / square_root(u2 > one ? u2 : one));
    case RowLoss::cauchy:
      return square_root(one / (one + u2));
    case RowLoss::tukey:
      return u2 < one ? one - u2 : splat(0.0);
  }
  return one;
}

constexpr int components_of(Kind kind) { return kind == Kind::distance ? 1 : kind == Kind::position ? 3 : 6; }

/// What the columns of one pack of poses need of its residual.
template <Kind kind>
struct PackResidual {
  Vec tip;
  Vec toward;  ///< distance: unit vector from the anchor to the tip
  Pack qw;     ///< pose: the error quaternion of R_predicted R_measured^T
  Vec qv;
  Pack scale[components_of(kind)];  ///< of every row: 1 / sigma, weight and loss
};

// Residual, predicted minus measured; its scale, weight and loss.
template <Kind kind, bool weighted>
inline void evaluate_residual(const Program& program, const Tile& tile, int first, int lane, PackResidual<kind>* out) {
  constexpr int components = components_of(kind);
  const int at = first + lane;
  const double* m = tile.measured + at;
  const int* tip = program.tip_slots;
  const Vec x = load_vec(at_slot(tile, tip[0]) + lane), y = load_vec(at_slot(tile, tip[1]) + lane),
            z = load_vec(at_slot(tile, tip[2]) + lane);
  const Vec p = load_vec(at_slot(tile, tip[3]) + lane);
  out->tip = p;
  Pack r[components];
  if (kind == Kind::distance) {
    const Vec from_anchor = p - Vec{splat(program.anchor[0]), splat(program.anchor[1]), splat(program.anchor[2])};
    const Pack length = square_root(dot(from_anchor, from_anchor));
    out->toward = (1.0 / length) * from_anchor;
    r[0] = length + program.anchor[3] - load(m);
  } else {
    r[0] = p.x - load(m);
    r[1] = p.y - load(m + kTilePoses);
    r[2] = p.z - load(m + 2 * kTilePoses);
  }
  if (kind == Kind::pose) {
    const auto column = [&](int k) {
      const double* c = m + (3 + 3 * k) * kTilePoses;
      return Vec{load(c), load(c + kTilePoses), load(c + 2 * kTilePoses)};
    };
    const Vec mx = column(0), my = column(1), mz = column(2);
    // E = sum over k of p_k m_k^T: its trace is 4 w^2 - 1, its antisymmetric part sum of m_k x p_k is 4 w v.
    const Pack w2 = 0.25 * (1.0 + dot(mx, x) + dot(my, y) + dot(mz, z));
    out->qw = square_root(w2 > 1e-12 ? w2 : splat(1e-12));
    out->qv = (0.25 / out->qw) * (cross(mx, x) + cross(my, y) + cross(mz, z));
    r[components - 3] = 2.0 * out->qv.x;
    r[components - 2] = 2.0 * out->qv.y;
    r[components - 1] = 2.0 * out->qv.z;
  }

  Pack s2 = splat(0.0);
  for (int k = 0; k < components; ++k) {
    out->scale[k] = splat(k < 3 ? program.position_scale : program.rotation_scale);
    if (weighted && tile.position_weight)
      out->scale[k] *= load((k < 3 ? tile.position_weight : tile.rotation_weight) + at);
    s2 += out->scale[k] * r[k] * out->scale[k] * r[k];
  }
  if (tile.squared_norm) store(tile.squared_norm + at, s2);
  if (weighted) {
    const Pack root = root_weight(program.loss, program.loss_scale, s2);
    for (int k = 0; k < components; ++k) out->scale[k] *= root;
  }
  for (int k = 0; k < components; ++k)
    store(tile.residual + k * kTilePoses + at, weighted ? out->scale[k] * r[k] : r[k]);
  if (tile.tip) {
    const Vec frame[4] = {p, x, y, z};
    for (int k = 0; k < 4; ++k) {
      store(tile.tip + (3 * k) * kTilePoses + at, frame[k].x);
      store(tile.tip + (3 * k + 1) * kTilePoses + at, frame[k].y);
      store(tile.tip + (3 * k + 2) * kTilePoses + at, frame[k].z);
    }
  }
}

struct Motion {
  Vec linear, angular;
};

// The tip's motion for a unit of one part: translation [axis; 0], rotation [axis x (tip - origin); axis].
inline Motion part_motion(const Tile& tile, const Part& part, int lane, Vec tip) {
  const Vec axis = load_vec(at_slot(tile, part.axis) + lane);
  if (part.origin < 0) return {axis, {splat(0.0), splat(0.0), splat(0.0)}};
  return {cross(axis, tip - load_vec(at_slot(tile, part.origin) + lane)), axis};
}

inline Motion column_motion(const Program& program, const Tile& tile, const ColumnPlan& plan, int at, int lane,
                            Vec tip) {
  const Part* part = program.parts + plan.first_part;
  Motion sum = part_motion(tile, *part, lane, tip);
  if (plan.part_count > 1 || part->weight != 1.0) {
    sum = {splat(part->weight) * sum.linear, splat(part->weight) * sum.angular};
    for (int k = 1; k < plan.part_count; ++k) {
      const Motion more = part_motion(tile, part[k], lane, tip);
      sum = {sum.linear + splat(part[k].weight) * more.linear, sum.angular + splat(part[k].weight) * more.angular};
    }
  }
  if (plan.basis >= 0) {
    const Pack phi = load(tile.bases + plan.basis * kTilePoses + at);
    sum = {phi * sum.linear, phi * sum.angular};
  }
  return sum;
}

template <Kind kind, bool weighted>
inline void evaluate_column(const Program& program, const Tile& tile, const ColumnPlan& plan, int first,
                            const PackResidual<kind>* residuals, double* column) {
  constexpr int components = components_of(kind);
  for (int lane = 0; lane < kGroupPoses; lane += kLanes) {
    const PackResidual<kind>& residual = residuals[lane / kLanes];
    Pack out[components];
    if (plan.fixed_axis >= 0) {
      for (int k = 0; k < components; ++k) out[k] = splat(k == plan.fixed_axis ? -1.0 : 0.0);
      if (kind == Kind::distance) {
        const Vec t = residual.toward;
        out[0] = plan.fixed_axis == 0 ? -t.x : plan.fixed_axis == 1 ? -t.y : plan.fixed_axis == 2 ? -t.z : splat(1.0);
      }
    } else {
      const Motion motion = column_motion(program, tile, plan, first + lane, lane, residual.tip);
      if (kind == Kind::distance) {
        out[0] = dot(residual.toward, motion.linear);
      } else {
        out[0] = motion.linear.x;
        out[1] = motion.linear.y;
        out[2] = motion.linear.z;
      }
      if (kind == Kind::pose) {
        // d(2 v) = w omega + omega x v for R_predicted <- Exp(omega) R_predicted.
        const Vec turn = residual.qw * motion.angular + cross(motion.angular, residual.qv);
        out[components - 3] = turn.x;
        out[components - 2] = turn.y;
        out[components - 1] = turn.z;
      }
    }
    for (int k = 0; k < components; ++k)
      store(column + k * kTilePoses + first + lane, weighted ? residual.scale[k] * out[k] : out[k]);
  }
}

template <Kind kind, bool weighted>
void evaluate_tile(const Program& program, const Tile& tile) {
  constexpr int column_size = components_of(kind) * kTilePoses;
  PackResidual<kind> residuals[kGroupPoses / kLanes];
  fill_slots(tile, program.fixed_slots, program.fixed_vectors, program.fixed_count);
  for (int first = 0; first < kTilePoses; first += kGroupPoses) {
    sweep(program, tile, first);
    for (int lane = 0; lane < kGroupPoses; lane += kLanes) {
      evaluate_residual<kind, weighted>(program, tile, first, lane, &residuals[lane / kLanes]);
    }
    for (int c = 0; c < program.column_count; ++c) {
      evaluate_column<kind, weighted>(program, tile, program.columns[c], first, residuals,
                                      tile.jacobian + static_cast<std::ptrdiff_t>(c) * column_size);
    }
  }
}

void evaluate(const Program& program, const Tile& tile) {
  const bool weighted = tile.position_weight || program.loss != RowLoss::none || program.position_scale != 1.0 ||
                        program.rotation_scale != 1.0;
  switch (program.kind) {
    case Kind::position:
      weighted ? evaluate_tile<Kind::position, true>(program, tile)
               : evaluate_tile<Kind::position, false>(program, tile);
      break;
    case Kind::pose:
      weighted ? evaluate_tile<Kind::pose, true>(program, tile) : evaluate_tile<Kind::pose, false>(program, tile);
      break;
    case Kind::distance:
      weighted ? evaluate_tile<Kind::distance, true>(program, tile)
               : evaluate_tile<Kind::distance, false>(program, tile);
      break;
  }
}

// Gram: blocks of kRows x kCols columns whose products stay in registers while the tile's rows stream by.
#if TRUING_LANES == 8
constexpr int kRows = 4,
              kCols = 4;  // 16 of 32 registers; larger blocks gain less than their sums cost in the first-level cache
#elif TRUING_LANES == 1
constexpr int kRows = 2, kCols = 2;
#else
constexpr int kRows = 4, kCols = 3;  // 12 of 16 registers
#endif
constexpr int kBlock = kRows * kCols * kLanes;

// Parts of a column's rows, a bit each.
using Parts = std::uint64_t;
constexpr int kMostParts = 64, kLeastPart = 16;

// Rows of one part, the last one's but for what is left.
inline int part_of(int length) { return kLeastPart * (1 + (length - 1) / (kLeastPart * kMostParts)); }

inline Parts all_parts(int length) { return ~Parts{0} >> (kMostParts - 1 - (length - 1) / part_of(length)); }

// acc += the products of kRows by kCols columns over some parts of their rows, one at least. Not inlined: the sums then
// stay in registers through the loop.
__attribute__((noinline)) void block_product(const double* const* a, const double* const* b, int length, Parts parts,
                                             double* acc) {
  Pack sum[kRows][kCols];
  for (int m = 0; m < kRows; ++m)
    for (int n = 0; n < kCols; ++n) sum[m][n] = Pack{};
  const double* a0[kRows];
  const double* b0[kCols];
  for (int m = 0; m < kRows; ++m) a0[m] = a[m];
  for (int n = 0; n < kCols; ++n) b0[n] = b[n];
  const int part = part_of(length);
  do {
    int k = __builtin_ctzll(parts) * part;
    const int end = k + part < length ? k + part : length;
    do {
      Pack left[kRows];
      for (int m = 0; m < kRows; ++m) left[m] = load(a0[m] + k);
      for (int n = 0; n < kCols; ++n) {
        const Pack right = load(b0[n] + k);
        for (int m = 0; m < kRows; ++m) sum[m][n] += left[m] * right;
      }
      k += kLanes;
    } while (k < end);
    parts &= parts - 1;
  } while (parts != 0);
  for (int m = 0; m < kRows; ++m)
    for (int n = 0; n < kCols; ++n)
      store(acc + (m * kCols + n) * kLanes, load(acc + (m * kCols + n) * kLanes) + sum[m][n]);
}

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

inline Mask bits_of(const double* x) {
  Mask out;
  std::memcpy(&out, x, sizeof out);
  return out;
}

// But for the sign.
inline bool any(Mask bits) {
  std::int64_t all = 0;
  for (int l = 0; l < kLanes; ++l) all |= bits[l];
  return static_cast<std::uint64_t>(all) << 1 != 0;
}

// So many packs are looked at before anything is decided.
bool is_zero(const double* x, std::ptrdiff_t length) {
  constexpr int kPacks = 4;
  std::ptrdiff_t k = 0;
  for (; k + kPacks * kLanes <= length; k += kPacks * kLanes) {
    Mask bits{};
    for (int m = 0; m < kPacks; ++m) bits |= bits_of(x + k + m * kLanes);
    if (any(bits)) return false;
  }
  for (; k < length; ++k)
    if (x[k] != 0.0) return false;
  return true;
}

// Where a column is not nought. The first number of most parts tells.
Parts parts_of(const double* x, int length) {
  const int part = part_of(length);
  Parts out = 0;
  for (int begin = 0, k = 0; begin < length; begin += part, ++k) {
    const int end = begin + part < length ? begin + part : length;
    Mask bits{};
    for (int i = begin; x[begin] == 0.0 && i < end; i += kLanes) bits |= bits_of(x + i);
    out |= Parts{x[begin] != 0.0 || any(bits)} << k;
  }
  return out;
}

// column(k): where column k is.
template <typename Column>
inline void add_products(Column column, int columns, int known, int length, double* acc) {
  // Many columns act now and then only, and what is nought adds nothing.
  constexpr int kMostLooked = 4096;
  constexpr int kFew = 2 * kCols;  // with so few others it takes longer to look at a column than to take its products
  const bool meets_many = columns - known > kFew;
  Parts parts[kMostLooked];
  for (int k = 0; k < columns && k < kMostLooked; ++k)
    parts[k] = k >= known || meets_many ? parts_of(column(k), length) : all_parts(length);
  const auto parts_of_any = [&](int first, int count) {
    Parts out = 0;
    for (int k = first; k < first + count && k < columns; ++k) out |= k < kMostLooked ? parts[k] : all_parts(length);
    return out;
  };
  for_blocks(columns, [&](int i, int j, std::size_t at) {
    if (j + kCols <= known) return;  // above the diagonal all of it is known
    const Parts both = parts_of_any(i, kRows) & parts_of_any(j, kCols);
    if (both == 0) return;
    const double* a[kRows];
    const double* b[kCols];
    // Beyond the last column the last one is read again; gram_reduce leaves those products out.
    for (int m = 0; m < kRows; ++m) a[m] = column(i + m < columns ? i + m : columns - 1);
    for (int n = 0; n < kCols; ++n) b[n] = column(j + n < columns ? j + n : columns - 1);
    block_product(a, b, length, both, acc + at);
  });
}

void gram_add(const double* c, std::ptrdiff_t stride, int columns, int known, int length, double* acc) {
  add_products([&](int k) { return c + stride * k; }, columns, known, length, acc);
}

void gram_add_columns(const double* const* c, int columns, int known, int length, double* acc) {
  add_products([&](int k) { return c[k]; }, columns, known, length, acc);
}

void gram_reduce(double* acc, int columns, int known, double* out) {
  for_blocks(columns, [&](int i, int j, std::size_t at) {
    if (j + kCols <= known) return;
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

// Gram of rows, whose numbers are neighbours: lanes are columns here, and no sum of lanes is left to be added up. A
// block has kRowsLeft columns by as many as kRowsRight packs have.
#if TRUING_LANES == 8
constexpr int kRowsLeft = 8, kRowsRight = 2;  // 16 of 32 registers
#else
constexpr int kRowsLeft = 4, kRowsRight = 2;  // 8 of 16 registers
#endif
static_assert(kRowColumns % kRowsLeft == 0 && kRowColumns % (kRowsRight * kLanes) == 0, "whole blocks in every copy");

// out (+)= the products of a block, row by row. Not inlined: the sums then stay in registers through the loop.
template <bool first>
__attribute__((noinline)) void rows_product(const double* left, const double* right, std::ptrdiff_t stride, int count,
                                            double* out) {
  Pack sum[kRowsLeft][kRowsRight];
  for (int m = 0; m < kRowsLeft; ++m)
    for (int n = 0; n < kRowsRight; ++n) sum[m][n] = first ? Pack{} : load(out + m * stride + n * kLanes);
  for (int k = 0; k < count; ++k, left += stride, right += stride) {
    Pack there[kRowsRight];
    for (int n = 0; n < kRowsRight; ++n) there[n] = load(right + n * kLanes);
    for (int m = 0; m < kRowsLeft; ++m)
      for (int n = 0; n < kRowsRight; ++n) sum[m][n] += left[m] * there[n];
  }
  for (int m = 0; m < kRowsLeft; ++m)
    for (int n = 0; n < kRowsRight; ++n) store(out + m * stride + n * kLanes, sum[m][n]);
}

bool are_zero(const double* rows, std::ptrdiff_t stride, int count) {
  for (int k = 0; k < count; ++k)
    for (int c = 0; c < kRowColumns; c += kLanes)
      if (!is_zero(rows + k * stride + c, kLanes)) return false;
  return true;
}

void gram_add_rows(const double* rows, int columns, int count, bool first, double* out) {
  for (int i = 0; i < columns; i += kRowColumns) {
    // Many columns act now and then only, and what is nought adds nothing.
    const bool zero = are_zero(rows + i, columns, count);
    if (zero && !first) continue;
    for (int m = i; m < i + kRowColumns; m += kRowsLeft) {
      for (int j = i; j < columns; j += kRowsRight * kLanes) {
        double* const to = out + static_cast<std::ptrdiff_t>(m) * columns + j;
        first ? rows_product<true>(rows + m, rows + j, columns, zero ? 0 : count, to)
              : rows_product<false>(rows + m, rows + j, columns, count, to);
      }
    }
  }
}

// So many columns at a time, each read from its begin to its end.
template <int count>
inline void add_some(const double* const* c, const double* by, int length, double* out) {
  int i = 0;
  for (; i + kLanes <= length; i += kLanes) {
    Pack sum = load(out + i);
    for (int k = 0; k < count; ++k) sum += by[k] * load(c[k] + i);
    store(out + i, sum);
  }
  for (; i < length; ++i)
    for (int k = 0; k < count; ++k) out[i] += by[k] * c[k][i];
}

void add_columns(const double* const* c, const double* by, int columns, int length, double* out) {
  constexpr int kTogether = 8;
  int k = 0;
  for (; k + kTogether <= columns; k += kTogether) add_some<kTogether>(c + k, by + k, length, out);
  for (; k < columns; ++k) add_some<1>(c + k, by + k, length, out);
}

// Squares of C row: so many lanes at a time stay in registers through the columns.
void add_squared(const double* c, std::ptrdiff_t stride, const double* row, int columns, int length, double* out) {
  constexpr int kPacks = 6;
  static_assert(kTilePoses % (kPacks * kLanes) == 0, "no pack reads beyond a tile's rows");
  for (int first = 0; first < length; first += kPacks * kLanes) {
    Pack sum[kPacks];
    for (int m = 0; m < kPacks; ++m) sum[m] = Pack{};
    for (int k = 0; k < columns; ++k) {
      const Pack weight = splat(row[k]);
      const double* const column = c + stride * k + first;
      for (int m = 0; m < kPacks; ++m) sum[m] += weight * load(column + m * kLanes);
    }
    for (int m = 0; m < kPacks; ++m) {
      double* const at = out + first + m * kLanes;
      store(at, load(at) + sum[m] * sum[m]);
    }
  }
}

#if TRUING_LANES == 8 && (defined(__clang__) || __GNUC__ >= 12)
#define TRUING_TRANSPOSES
// Eight packs: lane l of number k becomes lane k of number l. Blocks of one, of two and of four numbers change places.
inline void transpose(Pack* v) {
  Pack one[8], two[8];
  for (int k = 0; k < 8; k += 2) {
    one[k] = __builtin_shufflevector(v[k], v[k + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    one[k + 1] = __builtin_shufflevector(v[k], v[k + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  for (int k = 0; k < 8; k += 4) {
    for (int i = k; i < k + 2; ++i) {
      two[i] = __builtin_shufflevector(one[i], one[i + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      two[i + 2] = __builtin_shufflevector(one[i], one[i + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (int k = 0; k < 4; ++k) {
    v[k] = __builtin_shufflevector(two[k], two[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    v[k + 4] = __builtin_shufflevector(two[k], two[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}
#endif

// Filter: every lane goes through a part of the rows, so that a weight meets numbers that stand as packs do, and a
// row's sum goes through the weights in their order whatever its lane. out[n]: the n-th number that each lane needs.
inline void lay_side_by_side(const double* x, std::ptrdiff_t part, std::ptrdiff_t length, double* out) {
#ifdef TRUING_TRANSPOSES
  for (std::ptrdiff_t n = 0; n < length && length >= kLanes; n += kLanes) {
    const std::ptrdiff_t at = n + kLanes <= length ? n : length - kLanes;
    Pack here[kLanes];
    for (int l = 0; l < kLanes; ++l) here[l] = load(x + l * part + at);
    transpose(here);
    for (int k = 0; k < kLanes; ++k) store(out + (at + k) * kLanes, here[k]);
  }
  if (length >= kLanes) return;
#endif
  for (std::ptrdiff_t n = 0; n < length; ++n)
    for (int l = 0; l < kLanes; ++l) out[n * kLanes + l] = x[l * part + n];
}

// Some rows of every lane; several at a time hide that each waits for itself. Lanes' parts have so many rows.
template <int rows>
inline void filter_rows(const double* side_by_side, int step, const double* weights, int weight_count,
                        std::ptrdiff_t part, double* out) {
  Pack sum[rows];
  const double* x[rows];
  for (int m = 0; m < rows; ++m) {
    x[m] = side_by_side + std::ptrdiff_t{m} * step * kLanes;
    sum[m] = weights[0] * load(x[m]);
  }
  for (int k = 1; k < weight_count; ++k)
    for (int m = 0; m < rows; ++m) sum[m] += weights[k] * load(x[m] + std::ptrdiff_t{k} * kLanes);
#ifdef TRUING_TRANSPOSES
  if constexpr (rows == kLanes) {
    transpose(sum);
    for (int l = 0; l < kLanes; ++l) store(out + l * part, sum[l]);
    return;
  }
#endif
  for (int m = 0; m < rows; ++m)
    for (int l = 0; l < kLanes; ++l) out[l * part + m] = sum[m][l];
}

void filter_all(const double* x, int step, const double* weights, int weight_count, int count, double* scratch,
                double* out) {
  constexpr int kTogether = 8;
  const std::ptrdiff_t part = count / kLanes, length = (part - 1) * step + weight_count;
  const auto begin = reinterpret_cast<std::uintptr_t>(scratch), whole = std::uintptr_t{alignof(Pack)};
  double* const side_by_side = reinterpret_cast<double*>((begin + whole - 1) / whole * whole);
  lay_side_by_side(x, part * step, length, side_by_side);
  std::ptrdiff_t row = 0;
  for (; row + kTogether <= part; row += kTogether)
    filter_rows<kTogether>(side_by_side + row * step * kLanes, step, weights, weight_count, part, out + row);
  for (; row < part; ++row)
    filter_rows<1>(side_by_side + row * step * kLanes, step, weights, weight_count, part, out + row);
}

// Many columns act now and then only: beside a knot, while a play is crossed. What is nought beyond is not summed.
void filter(const double* x, int step, const double* weights, int weight_count, int count, double* scratch,
            double* out) {
  constexpr int kLooked = 64;
  const auto rows_from = [&](int row) { return count - row < kLooked ? count - row : kLooked; };
  const auto is_still = [&](int row) {
    return is_zero(x + std::ptrdiff_t{row} * step, std::ptrdiff_t{rows_from(row) - 1} * step + weight_count);
  };
  for (int row = 0; row < count;) {
    int end = row;
    while (end < count && !is_still(end)) end += rows_from(end);
    if (end > row)
      filter_all(x + std::ptrdiff_t{row} * step, step, weights, weight_count, end - row, scratch, out + row);
    row = end;
    for (; row < count && row < end + kLooked; ++row) out[row] = 0.0;
  }
}

}  // namespace

#define TRUING_TEXT_OF(x) #x
#define TRUING_TEXT(x) TRUING_TEXT_OF(x)
extern const Functions table;
const Functions table{TRUING_TEXT(TRUING_KERNEL_NAMESPACE),
                      kLanes,
                      evaluate,
                      gram_size,
                      gram_add,
                      gram_add_columns,
                      gram_reduce,
                      gram_add_rows,
                      add_columns,
                      add_squared,
                      filter};

}  // namespace truing::kernel::TRUING_KERNEL_NAMESPACE
