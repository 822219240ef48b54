# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Examine the diagnosis on withheld effects, simulated by other means than its own.

Writes result.json (the score table) and report.html. Needs MuJoCo: pip install "truing[exam]".
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import Choice, Count, Flag, Seed, Time, Words
from truing.cli.tables import table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.exam.score import Scores

PANEL = "Diagnose"
SITTING = "sitting"
"""Folder within the output's that grows meanwhile: what was sealed, answered and opened."""


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[None, "Scores"]):
    doing = "examining"
    own_processes = True

    which: Annotated[
        Literal["development", "examination"],
        Choice("Robots, sizes and effects to develop with, or those kept for the examination.", flag="--set"),
    ] = "development"
    dynamics: Annotated[
        bool, Flag("The dynamic half: effects on the torques of recorded motion, for 'dynamics diagnose'.")
    ] = False
    quick: Annotated[bool, Flag("A few data sets of every family.")] = False
    families: Annotated[list[str], Words("Only these families of data sets: 'none,one'. Default: all.")] = ()  # type: ignore[assignment]
    sets: Annotated[list[str], Words("Only these data sets: 'single/12,grid/3'. Default: all.")] = ()  # type: ignore[assignment]
    resume: Annotated[bool, Flag("Keep the answers of a sitting that was ended.")] = False
    workers: Annotated[int, Count("Processes at a time. 0: as many as the machine has.")] = 0
    timeout: Annotated[
        float,
        Time("A diagnosis that takes longer, the making of its set included, has failed. 0: none.", least=0),
    ] = 600.0
    limit: Annotated[int, Count("No more sets of each family than this. 0: all.")] = 0
    seed: Seed = 0

    def load(self, progress: run.Progress) -> None:
        try:
            import truing.exam.dynamics.run
            import truing.exam.run  # noqa: F401
        except ModuleNotFoundError as error:
            if (error.name or "").split(".")[0] == "truing":
                raise
            raise InputError(
                f"the examination needs the package {error.name}, which is not installed: pip install"
                ' "truing[exam]"'
            ) from None

    def solve(self, loaded: None, progress: run.Progress) -> Scores:
        from truing.exam import run as statics
        from truing.exam.dynamics import run as dynamics

        run_exam = dynamics.run_exam if self.dynamics else statics.run_exam
        return run_exam(
            self.which,
            quick=self.quick,
            seed=self.seed,
            families=self.families or None,
            only=self.sets or None,
            limit=self.limit or None,
            resume=self.resume,
            workers=self.workers or os.cpu_count() or 1,
            timeout=self.timeout or None,
            out=self.out / SITTING,
            progress=progress.of,
        )

    def write(self, folder: Path, loaded: None, found: Scores, warnings: list[str]) -> Mapping[str, Any]:
        from truing.exam.result import write_exam
        from truing.exam.score import cost_table, table as score_table

        return write_exam(
            folder,
            {
                "half": "dynamics" if self.dynamics else "statics",
                "set": self.which,
                "seed": self.seed,
                "sets": found.sets,
                "left_out": found.left_out,
                "drawn_anew": found.drawn_anew,
                "warnings": warnings,
                "scores": score_table(found),
                "costs": cost_table(found),
                "failures": found.failures,
            },
        )

    def table(self, result: Mapping[str, Any], found: Scores) -> None:
        from truing.exam.page import plain

        names = list(dict.fromkeys(name for score in result["scores"] for name in score))
        head = [name.replace("_", " ") for name in names]
        table("examination", head, [[plain(score.get(name)) for name in names] for score in result["scores"]])
        costs = result["costs"]
        if costs:
            table(
                "cost of a diagnosis", list(costs[0]), [[str(cell) for cell in row.values()] for row in costs]
            )
