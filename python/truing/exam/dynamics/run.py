# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The dynamic half of the examination: robots and recordings of motion, handed over as files, for
`truing.dynamics.check_recordings` and `diagnose`.
"""

from __future__ import annotations

import hashlib
import importlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import truing
from truing.exam.answers import Answer, failed
from truing.exam.dynamics import sets
from truing.exam.dynamics.answers import answer_of, realised
from truing.exam.dynamics.scenes import Case
from truing.exam.dynamics.score import score
from truing.exam.score import Scores, Sheet
from truing.exam.sitting import Clock, Half, Plan, PlanKeywords, Which, held

if TYPE_CHECKING:
    from typing_extensions import Unpack

Candidate = Callable[[Path, Sequence[Path]], Any]
"""Who sits the examination: gets the files of robot and recordings, returns a diagnosis or what has its
attributes.
"""


def diagnose(robot: Path, recordings: Sequence[Path]) -> Any:
    """The candidate that the examination is for: what `truing dynamics diagnose` says. Recordings are checked
    before they are diagnosed, and what the check names in the headline is a name as any other.
    """
    dynamics = importlib.import_module("truing.dynamics")
    arm = truing.load_robot(robot)
    read = dynamics.load_recordings(list(recordings), arm)
    if robot.suffix != ".urdf":  # an MJCF says drives as well
        return dynamics.diagnose(robot, read)
    checked = dynamics.check_recordings(arm, read)
    found = dynamics.diagnose(checked.robot, checked.recordings, cutoff=checked.cutoff)
    return importlib.import_module("truing.dynamics.told").told(found, checked.findings)


def run_exam(
    which: Which = "development",
    *,
    candidate: Candidate = diagnose,
    keep: Path | str | None = None,
    **plan: Unpack[PlanKeywords],
) -> Scores:
    """Makes the sets, has them answered from their files, opens the labels, and scores. Arguments as those of
    `truing.exam.run.run_exam`; keep: folder in which the files of every set stay.
    """
    return held(Dynamics(candidate, Path(keep) if keep else None), which, Plan(**plan))


@dataclass(frozen=True)
class Files:
    """A set as it is handed over."""

    robot: Path
    recordings: list[Path]


@dataclass(frozen=True)
class Dynamics(Half[Case, Files]):
    candidate: Candidate = diagnose
    keep: Path | None = None  # where the files of sets stay; None: nowhere
    about: ClassVar[Mapping[str, str]] = {"half": "dynamics"}

    def ids(self, which: str, plan: Plan) -> list[str]:
        return sets.ids(which, quick=plan.quick, families=plan.families, only=plan.only, seed=plan.seed)

    def skipped(self, which: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
        return sets.skipped(which, names)

    def build(self, id: str) -> Case:
        return sets.build(id)

    def hand_over(self, id: str, case: Case, place: Path) -> tuple[Files, str]:
        files = Files(*case.write(self.keep / id.replace("/", "_") if self.keep else place))
        return files, fingerprint([files.robot, *files.recordings])

    def ask(self, case: Case, handed: Files) -> tuple[Answer, dict[str, Answer]]:
        clock = Clock()
        try:
            diagnosis = self.candidate(handed.robot, handed.recordings)
            seconds, processor = clock.spent()
            said = answer_of(diagnosis, usual=bool(case.label.get("usual")))
            better = realised(diagnosis, case.write_kept_back(handed.robot.parent / "kept_back"))
        except Exception as error:  # the others still sit
            return failed(f"{type(error).__name__}: {error}", *clock.spent()), {}
        return replace(said, seconds=seconds, processor_seconds=processor, realised=better), {}

    def score(self, sheets: Sequence[Sheet], which: str, left_out: Mapping[str, str]) -> Scores:
        return score(sheets, which, left_out)


def fingerprint(files: Sequence[Path]) -> str:
    """Of what was handed over: names and bytes."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()
