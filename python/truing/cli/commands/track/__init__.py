# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say where the tool of a swaying arm will be, and what to add to the plan."""

PANEL = "Track"
