# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""How large a number may be. What is larger was never meant: a comma lost, a unit mixed up, a fault."""

LARGEST_NUMBER = 1e12
"""Of any number in a file or on the command line; some have narrower bounds of their own."""
