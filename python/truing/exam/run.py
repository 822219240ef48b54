# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The static half of the examination: robots and measured poses, for `truing.diagnose`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco  # noqa: F401  (what is not installed is said here, not by a worker)

import truing
from truing.exam import sets
from truing.exam.answers import Answer, answer_of, baselines, failed, fresh_errors, realised_shrink
from truing.exam.scenes import Case
from truing.exam.score import Scores, Sheet, score
from truing.exam.sealing import fingerprint
from truing.exam.sitting import Clock, Half, Plan, PlanKeywords, Which, held

if TYPE_CHECKING:
    from typing_extensions import Unpack

Candidate = Callable[[truing.Robot, truing.Measurements], Any]
"""Who sits the examination: gets robot and data, returns a Diagnosis or what has its attributes."""

_AGAINST_GEOMETRY = frozenset({"few", "mistaken"})
"""Families in which the result is compared with what identifying link values alone would have given."""


def diagnose(robot: truing.Robot, data: truing.Measurements) -> Any:
    """The candidate that the examination is for."""
    return truing.diagnose(robot, data, seed=0, threads=1)  # workers share the processors already


def run_exam(
    which: Which = "development", *, candidate: Candidate = diagnose, **plan: Unpack[PlanKeywords]
) -> Scores:
    """Makes the sets, has them answered, opens the labels, and scores.

    which: "development" is there to be looked at and learned from, "examination" is not: other robots, seeds,
    unlisted effects. candidate: a function at the top of a module. plan: fields of
    `truing.exam.sitting.Plan`.
    """
    return held(Statics(candidate), which, Plan(**plan))


@dataclass(frozen=True)
class Statics(Half[Case, Case]):
    candidate: Candidate = diagnose

    def ids(self, which: str, plan: Plan) -> list[str]:
        return sets.ids(which, quick=plan.quick, families=plan.families, only=plan.only, seed=plan.seed)

    def skipped(self, which: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
        return sets.skipped(which, names)

    def build(self, id: str) -> Case:
        return sets.build(id)

    def hand_over(self, id: str, case: Case, place: Path) -> tuple[Case, str]:
        return case, fingerprint(case.data)

    def ask(self, case: Case, handed: Case) -> tuple[Answer, dict[str, Answer]]:
        clock = Clock()
        try:
            diagnosis = self.candidate(case.robot, case.data)
            seconds, processor = clock.spent()
            said = answer_of(diagnosis)
            others = baselines(diagnosis.candidates, case.data.rows, bool(case.label["geometry_underneath"]))
        except Exception as error:  # the others still sit
            return failed(f"{type(error).__name__}: {error}", *clock.spent()), {}
        alone, poses = case.label["family"] in _AGAINST_GEOMETRY, case.fresh()
        try:
            fresh = fresh_errors(diagnosis, case.robot, case.data, poses, alone)
        except Exception as error:  # a robot that cannot be evaluated is part of the answer
            return failed(f"robot: {type(error).__name__}: {error}", seconds, processor), {}
        realised = realised_shrink(diagnosis, fresh)
        answer = replace(said, seconds=seconds, processor_seconds=processor, fresh=fresh, realised=realised)
        return answer, others

    def score(self, sheets: Sequence[Sheet], which: str, left_out: Mapping[str, str]) -> Scores:
        return score(sheets, which, left_out)
