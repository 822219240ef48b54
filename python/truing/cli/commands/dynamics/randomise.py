# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Say what a diagnosis left uncertain, as ranges and correlations for domain randomisation.

What the data settled is not drawn. Writes randomisation.yaml, events.py (Isaac Lab), samples.csv (drawn
robots), result.json, report.html.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from truing.cli import run
from truing.cli.options import Count, File, Fraction, Seed, keyword
from truing.cli.tables import say, table

if TYPE_CHECKING:
    from truing.dynamics.uncertainty import Randomisation

PANEL = "Dynamics"
LISTED = 20  # parameters on the terminal; the report has all


@dataclass(frozen=True, kw_only=True)
class Command(run.Command["Mapping[str, Any]", "Randomisation"]):
    doing = "drawing"

    result: Annotated[
        Path,
        File("Folder of `truing dynamics diagnose` or `identify`.", argument=True, metavar="RESULT"),
    ]
    known: Annotated[
        float,
        Fraction("A standard error below this part of the value is taken for none: the value is not drawn."),
    ] = keyword("truing.dynamics.uncertainty:randomisation", "known")
    mass_uncertainty: Annotated[
        float,
        Fraction(
            "Standard error of the model's masses, of results from commands alone, which cannot show it."
        ),
    ] = keyword("truing.dynamics.uncertainty:randomisation", "mass_uncertainty")
    samples: Annotated[int, Count("Robots to draw into samples.csv.", least=1, most=1_000_000)] = 256
    seed: Seed = 0

    def load(self, progress: run.Progress) -> Mapping[str, Any]:
        from truing.dynamics.uncertainty import result_dict

        return result_dict(self.result)

    def solve(self, loaded: Mapping[str, Any], progress: run.Progress) -> Randomisation:
        from truing.dynamics.uncertainty import randomisation

        return randomisation(loaded, known=self.known, mass_uncertainty=self.mass_uncertainty)

    def write(
        self, folder: Path, loaded: Mapping[str, Any], found: Randomisation, warnings: list[str]
    ) -> Mapping[str, Any]:
        from truing.dynamics.uncertainty.written import write_randomisation

        return write_randomisation(folder, found, self.samples, self.seed, warnings=warnings)

    def table(self, result: Mapping[str, Any], found: Randomisation) -> None:
        from truing.dynamics.uncertainty.page import sentence, strong_pairs
        from truing.dynamics.uncertainty.written import table_rows

        say(sentence(result))
        rows = table_rows(found)
        if rows:
            table("what is drawn", ("", "found", "90 % range", "unit"), rows[:LISTED], words=True)
        if len(rows) > LISTED:
            say(f"and {len(rows) - LISTED} more: see the report")
        pairs = [(a, b, f"{value:+.2f}") for a, b, value in strong_pairs(result)[:6]]
        if pairs:
            table("what goes together most", ("", "", "correlation"), pairs, words=True)
        for note in result["notes"]:
            say(f"note: {note}")
