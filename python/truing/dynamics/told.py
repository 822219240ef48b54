# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a user is told: a diagnosis, and what the check of its recordings found before it. Headlines,
result.json and the examination say the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from truing import _core
from truing.dynamics.sanity.findings import FoundParameter, RecordingFinding, listed

LOADS = ("load_differs", "load_comes_and_goes")
"""Findings that are an effect of their own."""
LOAD_SURE = 0.9
"""What is stated of a load that only the check shows: 17 of 19 were there (docs/method/exam.md)."""
FRICTION_SURE = 0.9  # the same of friction that differs


@dataclass(frozen=True)
class FoundLoad:
    """A load of some recordings that no column tells, as an effect. They carry it, and not the robot."""

    recordings: tuple[str, ...]
    parameters: tuple[FoundParameter, ...]  # payload.m, payload.x ...
    sentence: str
    effect: str = "payload"
    joints: tuple[str, ...] = ()
    standard: bool = False
    probability: float = LOAD_SURE
    confounded_with: tuple[_core.TorqueAlternative, ...] = ()


@dataclass(frozen=True)
class DifferingFriction:
    """Friction of a joint that differs from recording to recording, and no column tells why."""

    joint: str
    inputs: tuple[str, ...] = ("recording",)
    probability: float = FRICTION_SURE


@dataclass(frozen=True)
class Told:
    """A diagnosis with what the check of its recordings says of the robot or its load."""

    found: _core.TorqueDiagnosis
    loads: tuple[FoundLoad, ...]
    differing: tuple[DifferingFriction, ...]
    verdict: str
    sentence: str

    @property
    def effects(self) -> tuple[FoundLoad | _core.FoundTorqueEffect, ...]:
        """Loads first: they were taken into account before anything else was looked for."""
        return (*self.loads, *self.found.effects)

    @property
    def unknown(self) -> tuple[DifferingFriction | _core.UnknownTorque, ...]:
        return (*self.found.unknown, *self.differing)

    @property
    def classes(self) -> Sequence[_core.TorqueClass]:
        return self.found.classes

    @property
    def not_testable(self) -> Sequence[_core.NotTestable]:
        return self.found.not_testable


def told(found: _core.TorqueDiagnosis, sanity: Iterable[RecordingFinding] = ()) -> Told:
    """found: of the recordings that the check gave back; sanity: its findings."""
    findings = list(sanity)
    loads = tuple(_load(one) for one in findings if one.finding in LOADS and one.applied)
    words = [sentence_of(loads)] if loads else []
    differs = next((one for one in findings if one.finding == "friction_differs"), None)
    if found.verdict == "none" and differs is not None:
        friction = (
            f"Friction differs from recording to recording, by {differs.value:.0f} % at {differs.joints[0]},"
            " and no column tells why; no other gap is left"
        )
        return Told(
            found, loads, (DifferingFriction(differs.joints[0]),), "unknown", ". ".join([*words, friction])
        )
    verdict = _WITH_LOAD.get(found.verdict, found.verdict) if loads else found.verdict
    rest = found.sentence.rstrip(".")
    if loads and found.verdict == "none":
        rest = "No other gap beyond noise is left"
    return Told(found, loads, (), verdict, ". ".join([*words, rest]))


def sentence_of(loads: Sequence[FoundLoad]) -> str:
    """Loads that nobody told in one sentence. "": none."""
    if len(loads) < 2:
        return "".join(load.sentence for load in loads)
    names = list(dict.fromkeys(name for load in loads for name in load.recordings))
    masses = [f"{load.parameters[0].value:.2f}" for load in loads]
    carry = "carries" if len(names) == 1 else "carry"
    return f"{listed(names)} {carry} loads of {', '.join(masses[:-1])} and {masses[-1]} kg that nobody told"


_WITH_LOAD = {"none": "effects", "unknown": "effects+unknown"}


def _load(finding: RecordingFinding) -> FoundLoad:
    carry = "carries" if len(finding.recordings) == 1 else "carry"
    times = " at times" if finding.finding == "load_comes_and_goes" else ""
    sentence = (
        f"{listed(finding.recordings)} {carry} a load of {finding.value:.2f} kg{times} that nobody told"
    )
    return FoundLoad(finding.recordings, finding.parameters, sentence)
