# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Examine the diagnosis on withheld effects, simulated by other means than its own.

Writes result.json (the score table) and report.html. Needs MuJoCo: pip install "truing[exam]".
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, Literal

from truing.cli import run
from truing.cli.options import Choice, Count, Flag, Seed, Words
from truing.cli.tables import table
from truing.errors import InputError

if TYPE_CHECKING:
    from truing.exam.score import Scores

PANEL = "Diagnose"
_RUN = "truing.exam.run:run_exam"


@dataclass(frozen=True)
class Sat:
    scores: Scores
    folder: TemporaryDirectory[str]  # what was sealed, answered and opened


@dataclass(frozen=True, kw_only=True)
class Command(run.Command[None, Sat]):
    doing = "examining"
    own_processes = True

    which: Annotated[
        Literal["development", "examination"],
        Choice("Robots, sizes and effects to develop with, or those kept for the examination.", flag="--set"),
    ] = "development"
    quick: Annotated[bool, Flag("A few data sets of every family.")] = False
    families: Annotated[list[str], Words("Only these families of data sets: 'none,one'. Default: all.")] = ()  # type: ignore[assignment]
    workers: Annotated[int, Count("Processes at a time. 0: as many as the machine has.")] = 0
    limit: Annotated[int, Count("No more sets of each family than this. 0: all.")] = 0
    seed: Seed = 0

    def load(self, progress: run.Progress) -> None:
        try:
            import truing.exam.run  # noqa: F401
        except ModuleNotFoundError as error:
            if (error.name or "").split(".")[0] == "truing":
                raise
            raise InputError(
                f"the examination needs the package {error.name}, which is not installed: pip install"
                ' "truing[exam]"'
            ) from None

    def solve(self, loaded: None, progress: run.Progress) -> Sat:
        from truing.exam.run import run_exam

        folder = TemporaryDirectory(prefix="truing-exam-")
        scores = run_exam(
            self.which,
            quick=self.quick,
            seed=self.seed,
            families=self.families or None,
            limit=self.limit or None,
            workers=self.workers or os.cpu_count() or 1,
            out=folder.name,
            progress=progress.of,
        )
        return Sat(scores, folder)

    def write(self, folder: Path, loaded: None, found: Sat, warnings: list[str]) -> Mapping[str, Any]:
        from truing.exam.result import write_exam
        from truing.exam.score import table as score_table

        shutil.copytree(found.folder.name, folder, dirs_exist_ok=True)
        return write_exam(
            folder,
            {
                "set": self.which,
                "seed": self.seed,
                "sets": found.scores.sets,
                "scores": score_table(found.scores),
                "failures": found.scores.failures,
            },
        )

    def table(self, result: Mapping[str, Any], found: Sat) -> None:
        from truing.exam.page import plain

        names = list(dict.fromkeys(name for score in result["scores"] for name in score))
        head = [name.replace("_", " ") for name in names]
        table("examination", head, [[plain(score.get(name)) for name in names] for score in result["scores"]])
