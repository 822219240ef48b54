// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Texts of common parts that several parts of the module show.
#pragma once

#include <string>
#include <vector>

#include "truing/common/error_statistics.hpp"

namespace truing::python {

std::string repr(const ErrorStatistics& errors);
/// "backlash at J2, J3"
std::string at_joints(const std::string& effect, const std::vector<std::string>& joints);

}  // namespace truing::python
