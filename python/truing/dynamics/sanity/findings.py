# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What looks wrong with recordings: the values that all checks give."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from truing import _core

_FEW = 4  # names in a sentence


@dataclass(frozen=True)
class FoundParameter:
    """A value that recordings tell before anything is fitted to all of them."""

    name: str  # as effects name theirs: "payload.m"
    value: float
    sigma: float  # standard error; 0: not known
    unit: str
    nominal: float = 0.0
    frozen: bool = False


@dataclass(frozen=True)
class RecordingFinding:
    """What looks odd about recordings of motion, or about how they fit the robot's model."""

    finding: str  # 'torque_sign', 'gaps' ...: docs/guide/dynamics.md has all
    recordings: tuple[str, ...]  # names; none: all
    joints: tuple[str, ...]  # names; none: it is no matter of single joints
    evidence: str  # in words, with the number
    value: float  # the number of the evidence: the largest, where several recordings or joints show it
    unit: str
    applied: bool = False  # it was corrected, or is allowed for, in what follows
    mistake: bool = False  # conclusions are doubtful until it is corrected
    spans: tuple[tuple[str, float, float], ...] = ()  # recording, begin and end [s] of when; none: always
    parameters: tuple[FoundParameter, ...] = ()  # of what it is, where it is an effect


@dataclass(frozen=True)
class CheckedRecordings:
    """Recordings with what could be corrected with certainty, and what was found."""

    robot: _core.Robot
    recordings: tuple[_core.Recording, ...]
    findings: tuple[RecordingFinding, ...]
    cutoff: float = 8.0  # [Hz] of the low-pass for what is fitted to them


def listed(names: Sequence[str], most: int = _FEW) -> str:
    """ "a, b and 3 more" """
    shown = list(names[:most]) if len(names) > most + 1 else list(names)
    rest = len(names) - len(shown)
    if rest:
        return f"{', '.join(shown)} and {rest} more"
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}" if shown else ""


def together(
    found: Sequence[RecordingFinding],
    words: Callable[[RecordingFinding, RecordingFinding], str],
) -> list[RecordingFinding]:
    """Findings of one kind as one: `words` says it from all of them taken together (the names of all
    recordings and joints) and from the one with the largest value.
    """
    if not found:
        return []
    worst = max(found, key=lambda one: abs(one.value))
    whole = replace(
        worst,
        recordings=_each_once(name for one in found for name in one.recordings),
        joints=_each_once(name for one in found for name in one.joints),
        applied=all(one.applied for one in found),
        mistake=any(one.mistake for one in found),
    )
    return [replace(whole, evidence=words(whole, worst))]


def _each_once(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(names))
