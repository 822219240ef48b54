// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Sanitizers look at memory, not at statistics, and take fifty times as long: tests that average over seeds take a few
/// under them, and leave the averages unchecked.
#if defined(TRUING_SANITIZED)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif
