# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""List the effects that truing knows."""

from __future__ import annotations

from dataclasses import dataclass

from truing.cli.tables import table

PANEL = "Diagnose"


@dataclass(frozen=True)
class Command:
    """Reads and writes nothing."""

    def run(self) -> int:
        from truing.model import catalogue

        table("effects", ("name", "what it is"), catalogue())
        return 0
