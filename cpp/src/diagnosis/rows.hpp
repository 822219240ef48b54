// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Rows of the data: which are looked at, some as data of their own, and errors by row.

#include <cstdint>
#include <string>
#include <vector>

#include "rooms.hpp"
#include "truing/identify.hpp"

namespace truing::diagnosis {

/// What `identify` is asked to free for base and targets, which are always unknown.
std::vector<std::string> targets_of(const Robot& robot);

/// Length of every row's position (or distance) error [m]; NaN: nothing was measured.
std::vector<double> lengths_of(const Residuals& residuals, std::size_t rows);
/// Those of held-out rows.
std::vector<double> held_out(const std::vector<double>& lengths, const std::vector<std::int8_t>& set);

/// Rows that count, of at most so many pose groups, evenly taken.
std::vector<std::int32_t> thinned_rows(const Measurements& data, const std::vector<std::int32_t>& cluster,
                                       std::size_t most);
Measurements subset_of(const Measurements& data, const std::vector<std::int32_t>& rows);
/// Own effects for a subset: they may look values up by row, of the whole data. `whole` and `rows` must outlive them.
std::vector<Effect> mapped(const std::vector<Effect>& own, const Measurements& whole,
                           const std::vector<std::int32_t>& rows);

}  // namespace truing::diagnosis
