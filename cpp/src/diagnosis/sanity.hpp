// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/diagnose.hpp"

namespace truing::diagnosis {

/// The data as they are gone on with, and what was noticed.
struct Checked {
  Measurements data;
  std::vector<SanityFinding> findings;
  std::string joint_record = "q";
  bool inferred_direction = false;
};

/// Before any statistics: duplicate rows, joints that stand still, which record of the joints fits, order and signs of
/// the joints, approach directions from the order of the poses where none are given. Throws std::invalid_argument on
/// what cannot be used.
Checked check(const Robot& robot, const Measurements& data, const DiagnoseOptions& options);

}  // namespace truing::diagnosis
