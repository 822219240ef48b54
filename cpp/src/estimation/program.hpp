// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A model compiled for the kernel: the chain of one segment as steps over vectors, and where each free parameter's
// column comes from.

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "estimation/evaluate.hpp"
#include "kernel/kernel.hpp"
#include "model/model.hpp"
#include "rooms.hpp"

namespace truing::estimation {

struct DynamicSite {
  int parameter;                     ///< holds the part that is the same for all poses; -1: none
  std::vector<SiteWeight> moved_by;  ///< coordinate, weight
};

struct ConstantSource {
  int parameter;
  bool rotation;
  int at;
};

/// A segment's program, but for the numbers that change with the parameters. Vectors (the axes x y z of the current
/// frame, its origin p, and what columns want of frames that were passed) stand in slots.
struct Program {
  std::vector<kernel::Step> prefix;  ///< the same for all poses: base, and what stands before the first joint
  std::vector<kernel::Step> steps;
  std::vector<int> fixed_slots;  ///< what the prefix leaves behind for good …
  std::vector<int> start_slots;  ///< … and for the steps to write over
  int tip_slots[4];
  std::vector<double> constants;  ///< fixed rotations are in place already
  std::vector<ConstantSource> sources;
  std::vector<DynamicSite> dynamic;
  std::vector<kernel::Part> parts;
  std::vector<kernel::ColumnPlan> columns;
  std::vector<int> column_free;            ///< which free parameter each column belongs to
  std::vector<std::pair<int, int>> bases;  ///< (reading, term) of each basis row, one of them -1
  std::vector<int> left_out;  ///< parameters whose sites move nothing because they are zero, and must stay so
  int slot_count = 0;
};

Program compile(const Model& model, const Segment& segment, const std::vector<int>& free,
                const Eigen::VectorXd& values);

/// The prefix, once for all poses: what it leaves in its slots.
void sweep_prefix(const Program& program, const std::vector<double>& constants, std::vector<double>* start_vectors,
                  std::vector<double>* fixed_vectors);

}  // namespace truing::estimation
