# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The command line. Every file in ``commands/`` is a command, every folder there a group of commands.

Exit status: 0 done (a diagnosis that finds nothing, or something unknown, is an answer too), 1 did not
converge, could not decide or could not write (a full disk), 2 bad input (one line on stderr, nothing
written), 130 interrupted.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from truing.cli.interrupts import none_lost, was_interrupted

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line; the exit status."""
    with none_lost():
        try:
            from truing.cli.app import main as run  # late: Ctrl-C ends imports, too, with a line
        except (KeyboardInterrupt, ImportError) as error:
            if not was_interrupted(error):
                raise
            sys.stderr.write("truing: interrupted\n")
            return 130
        return run(arguments)
