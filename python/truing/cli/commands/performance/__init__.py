# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Test a robot after ISO 9283: what to drive and measure, and what the measurements say."""

PANEL = "Apply"
