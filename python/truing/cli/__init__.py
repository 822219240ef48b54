# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The command line. Every file in ``commands/`` is a command, every folder there a group of commands.

Exit status: 0 done (a diagnosis that finds nothing, or something unknown, is an answer too), 1 did not
converge or could not decide, 2 bad input (one line on stderr, nothing written), 130 interrupted.
"""

from truing.cli.app import main

__all__ = ["main"]
