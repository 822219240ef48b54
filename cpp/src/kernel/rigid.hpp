// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The torques of a rigid chain and their regressor, samples side by side in SIMD lanes. See README.md in this folder.

#include <cstddef>

namespace truing::kernel {

/// Samples that the caller hands over are filled up to a multiple of this, which every copy's lanes divide.
constexpr int kSampleMultiple = 8;
constexpr int kLinkColumns = 10;

/// One link: before * motion about or along z * after. Frames: R column by column, then p.
struct RigidLink {
  double before[12];
  double after[12];
  bool moves_before;  ///< false: `before` is the identity
  bool moves_after;
  bool revolute;
};

struct RigidProgram {
  const RigidLink* links;
  int link_count;
  int driven_count;
  const double* coupling;  ///< [link][driven]: motion of a link's joint for a reading's change of one
  double gravity[3];       ///< in the base's axes
};

struct RigidTile {
  int samples;                   ///< a multiple of kSampleMultiple
  const double* motion;          ///< [link][stride]: of the joints, below 1e5 rad
  const double* rate;            ///< [link][stride]; a mass matrix does not look at it, nor at the next
  const double* acceleration;    ///< [link][stride]
  std::ptrdiff_t stride;         ///< of these three
  double* const* blocks;         ///< out [driven][link]: first of ten columns; null: this joint does not feel this link
  std::ptrdiff_t column_stride;  ///< of these; of torques: of `blocks[0]`, one column for each driven joint
  double* scratch;               ///< rigid_scratch(program.link_count, program.driven_count) numbers
};

constexpr std::size_t rigid_scratch(int links, int driven) {
  return kSampleMultiple * (12 * static_cast<std::size_t>(driven) + 58 * static_cast<std::size_t>(links) + 1);
}

struct RigidFunctions {
  const char* name;
  void (*regressor)(const RigidProgram&, const RigidTile&);
  /// The regressor times `parameters`, ten for each link, without its columns.
  void (*torque)(const RigidProgram&, const RigidTile&, const double* parameters);
  /// The same at rest, of a few numbers a link: `rate` and `acceleration` are not looked at.
  void (*weight)(const RigidProgram&, const RigidTile&, const double* parameters);
  /// The mass matrix of links with these parameters: row k of the matrix at blocks[k], one column for each driven
  /// joint.
  void (*mass_matrix)(const RigidProgram&, const RigidTile&, const double* parameters);
  /// What these torques change by, to first order, where a reading's motion is another. `change`: [3][driven][stride],
  /// of each reading's angle, rate and acceleration; at blocks[k] for a change of reading k's motion alone the torques
  /// of all, one column for each. At blocks[driven + k] the mass matrix, as above; null: it is not wanted.
  void (*torque_change)(const RigidProgram&, const RigidTile&, const double* parameters, const double* change);
  /// Of `count` angles below 1e5 rad, a multiple of kSampleMultiple; one of the outputs may be the input.
  void (*sine_cosine)(const double* angle, int count, double* sine, double* cosine);
};

/// The copy of the same name as functions().
const RigidFunctions& rigid_functions();
/// The named copy, or null when this machine or build lacks it.
const RigidFunctions* rigid_functions(const char* name);

}  // namespace truing::kernel
