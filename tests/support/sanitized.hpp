// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>

/// Sanitizers look at memory, not at statistics, and take fifty times as long: tests that average over seeds take a few
/// under them, and leave the averages unchecked. Asked at run time: the same test objects are linked to both libraries.
static const bool kSanitized = std::getenv("TRUING_SANITIZED") != nullptr;
