# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Fit and diagnose fleets of robots, and recordings larger than memory, on Dask."""

PANEL = "Fleets"
