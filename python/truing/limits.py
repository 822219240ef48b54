# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How large a number may be, and how far off. What is beyond was never meant: a comma lost, a fault."""

LARGEST_NUMBER = 1e12
"""Of any number in a file or on the command line; some have narrower bounds of their own."""

UNIT_LENGTH_OFF = 1e-3
"""Of a unit quaternion's length from 1: what few printed digits leave. More was never one."""
