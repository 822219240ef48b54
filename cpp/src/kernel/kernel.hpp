// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The inner loop: poses side by side in SIMD lanes. See README.md in this folder.
// Only plain structs and raw pointers cross into it, since each copy is compiled for another instruction set.

#include <cstddef>

namespace truing::kernel {

/// Poses of one tile: its Jacobian (40 columns x 3 rows) just fits the first-level cache.
constexpr int kTilePoses = 48;
/// Poses that go through the chain together, at most.
constexpr int kMostGroupPoses = 16;
/// A tile's measured rows per pose, at most: position and rotation.
constexpr int kMaxComponents = 6;

/// One step of the chain sweep. A frame is four vectors: the columns x y z of R and the origin p, each in a slot. A
/// step writes over what it reads unless some site wants the old vector as its axis or origin: then the new one goes to
/// a slot of its own, and nothing is ever copied.
enum class Code : int {
  rotate,     ///< the two columns that a rotation mixes: u' = c u + s v, v' = c v - s u
  translate,  ///< p' = p + value * column
  fixed,      ///< R' = R F, F constant
};

struct Step {
  Code code;
  int dynamic;   ///< row of Tile::values that holds the value per pose; -1: the same for all poses
  int constant;  ///< else index into Program::constants: value, or cos and sin, or F column by column
  int in[3];     ///< slots: u v | p column | x y z
  int out[3];    ///< slots: u' v' | p' | x' y' z'
};

/// A site's geometric Jacobian column, times a weight: translation [axis; 0], rotation [axis x (tip - origin); axis].
struct Part {
  int axis;    ///< slot
  int origin;  ///< slot; -1: a translation
  double weight;
};

/// One Jacobian column: the sum of its parts times a basis value; or minus a unit vector (a fixed point's coordinate);
/// or, for distances, the anchor's coordinates and the wire's zero.
struct ColumnPlan {
  int first_part;
  int part_count;
  int basis;       ///< row of Tile::bases; -1: one
  int fixed_axis;  ///< 0..2: minus this unit vector; 3: the constant 1 (wire zero); -1: parts
};

enum class Kind : int { position, pose, distance };

enum class RowLoss : int { none, huber, cauchy, tukey };

struct Program {
  Kind kind;
  const Step* steps;
  int step_count;
  const double* constants;
  const int*
      start_slots;  ///< vectors before the first step, the same for all poses: those that a step will write over …
  const double* start_vectors;
  int start_count;
  const int* fixed_slots;  ///< … and those that none does
  const double* fixed_vectors;
  int fixed_count;
  int tip_slots[4];  ///< x y z p at the end
  const Part* parts;
  const ColumnPlan* columns;
  int column_count;
  double anchor[4];       ///< distance: the fixed point [m] and the wire's zero [m]
  double position_scale;  ///< multiplies position rows (1 / sigma)
  double rotation_scale;
  RowLoss loss;
  double loss_scale;  ///< on the scaled norm of a row's residual
};

struct Tile {
  const double* values;    ///< [dynamic][kTilePoses]
  const double* bases;     ///< [basis][kTilePoses]
  const double* measured;  ///< [component][kTilePoses]: x y z | x y z and R column by column | distance
  const double*
      position_weight;  ///< [kTilePoses] multiplies position or distance rows (0: a padded pose); null: all one
  const double* rotation_weight;  ///< [kTilePoses] the same for rotation rows; null exactly when position_weight is
  double* slots;                  ///< scratch, 3 * kMostGroupPoses numbers a slot
  double* jacobian;               ///< out [column][component][kTilePoses]
  double* residual;      ///< out [component][kTilePoses], the column after the Jacobian's last; weighted like it
  double* squared_norm;  ///< out [kTilePoses]: of the scaled residual, before loss and weight; null: not wanted
  double* tip;           ///< out [12][kTilePoses]: p, then R column by column; null: not wanted
};

/// Numbers that a filter needs beside its rows, which stand there again, lane by lane.
constexpr std::size_t filter_scratch(int step, int weight_count, int count) {
  constexpr std::size_t kMostLanes = 8;  // and as many numbers until a pack may begin
  return static_cast<std::size_t>(count) * static_cast<std::size_t>(step) +
         kMostLanes * (static_cast<std::size_t>(weight_count) + 1);
}

/// Rows for gram_add_rows have a multiple of so many numbers.
constexpr int kRowColumns = 16;

/// Accumulator of a Gram matrix; `size` doubles, opaque between gram_clear and gram_reduce.
struct Functions {
  const char* name;
  int lanes;
  void (*evaluate)(const Program&, const Tile&);
  std::size_t (*gram_size)(int columns);
  /// acc += C^T C of `columns` columns of `length` doubles (a multiple of 8), `stride` apart. Of the first
  /// `known` columns nobody wants the products with each other: some are left out.
  void (*gram_add)(const double* c, std::ptrdiff_t stride, int columns, int known, int length, double* acc);
  /// The same of columns that stand anywhere.
  void (*gram_add_columns)(const double* const* c, int columns, int known, int length, double* acc);
  /// Sums the lanes: upper triangle of `out` (columns x columns, column-major) += acc; acc is cleared. `known`: as it
  /// was when acc was added to.
  void (*gram_reduce)(double* acc, int columns, int known, double* out);
  /// C^T C of `count` rows that stand one after the other, `columns` doubles each (a multiple of kRowColumns), for few
  /// rows at a time: out[i * columns + j] += sum over rows of row[i] row[j], for j >= i at least. `first`: `out` is not
  /// read, and what stands there is gone.
  void (*gram_add_rows)(const double* rows, int columns, int count, bool first, double* out);
  /// out[i] += sum over k of by[k] c[k][i], of `columns` columns of `length` numbers.
  void (*add_columns)(const double* const* c, const double* by, int columns, int length, double* out);
  /// out[i] += (sum over k of row[k] c[k * stride + i])^2 for i below `length` (a multiple of kTilePoses).
  void (*add_squared)(const double* c, std::ptrdiff_t stride, const double* row, int columns, int length, double* out);
  /// out[i] = sum over k of weights[k] x[i * step + k], of `count` rows (a multiple of 8). `x` holds (count - 1) * step
  /// + weight_count numbers; `scratch`: filter_scratch(...) numbers. An output's bits do not depend on the others.
  void (*filter)(const double* x, int step, const double* weights, int weight_count, int count, double* scratch,
                 double* out);
};

/// The widest copy that this machine can run; TRUING_KERNEL=scalar|sse2|avx2|avx512 in the environment asks for a
/// narrower one.
const Functions& functions();
/// The named copy, or null when this machine or build lacks it.
const Functions* functions(const char* name);

}  // namespace truing::kernel
