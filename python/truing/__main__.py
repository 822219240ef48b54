# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""``python -m truing``: the command line."""

import sys

from truing.cli import main

if __name__ == "__main__":
    sys.exit(main())
