// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// What tracker and replay both hand out.
#pragma once

#include "convert/columns.hpp"
#include "truing/tracking/tracker.hpp"

namespace truing::python {

using NumberColumns = py::typing::Dict<std::string, py::array_t<double>>;
using Columns = py::typing::Dict<std::string, py::object>;
using Counts = std::map<std::string, std::map<std::string, std::uint64_t>>;

/// Samples by stream and outcome; outcomes that never came are left out.
Counts counts_of(const Counters& counters);
/// The same, its arrays read-only.
py::dict sealed(py::dict columns);
NumberColumns innovation_columns(const std::vector<Innovation>& items);

}  // namespace truing::python
