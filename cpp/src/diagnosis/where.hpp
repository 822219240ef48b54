// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "diagnosis/design.hpp"
#include "rooms.hpp"
#include "truing/diagnose.hpp"

namespace truing::diagnosis {

/// Shares of the closable gap by joint and by input: what additive free functions of all inputs at one joint (of one
/// input at all joints) explain of it beyond base and targets. They overlap, and need not add up to one.
void share_out(const Design& design, const std::vector<InputColumn>& inputs, const Robot& robot, double design_effect,
               std::uint64_t seed, int threads, Diagnosis* out);

/// Map of the gap over the workspace, and its principal directions in the base frame.
void map_workspace(const Robot& robot, const Measurements& data, const Residuals& residuals, Diagnosis* out);

/// Share of the held-out mean square that the nearest training poses' residuals predict: the structure that is left.
double neighbour_share(const Measurements& data, const std::vector<std::int8_t>& set, const Residuals& residuals,
                       double* p95);

}  // namespace truing::diagnosis
