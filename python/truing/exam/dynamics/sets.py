# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The sets of the dynamic half: `build("development/single/12")` makes one of them, the same every time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from truing.exam.dynamics import families, recordings
from truing.exam.dynamics.scenes import Case
from truing.exam.dynamics.servo.families import FAMILIES as SERVO_FAMILIES
from truing.exam.numbering import Numbering, parts_of

COUNTS = {
    "none": 120,
    "single": 240,
    "double": 100,
    "confounded": 60,
    "wrong_law": 60,
    "unlisted": 80,
    "missing": 40,
    "servo_none": 80,
    "servo_single": 240,
    "servo_confounded": 42,
    "servo_unlisted": 60,
    "servo_missing": 40,
}
"""Sets of each family. A new family stands last: a set's random numbers start from its family's place."""
QUICK = {
    "none": 4,
    "single": 8,
    "double": 2,
    "confounded": 4,
    "wrong_law": 2,
    "unlisted": 2,
    "missing": 2,
    "servo_none": 2,
    "servo_single": 4,
    "servo_confounded": 3,
    "servo_unlisted": 2,
    "servo_missing": 2,
}
NUMBERING = Numbering(COUNTS, QUICK, 100_000, 78, " in the dynamic half")
ids = NUMBERING.ids
_FAMILIES = families.FAMILIES | SERVO_FAMILIES


def build(id: str) -> Case:
    """A set."""
    request = NUMBERING.request(id)
    return _FAMILIES[request.family](request)


def skipped(which: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Sets that cannot be made here, and why."""
    why = recordings.missing(which)
    for name in names:
        family, number = parts_of(name)
        loaded = family == "missing" and families.source_of_missing(number) == "spike"
        real = family == "single" and families.source_of_single(number) == "spike"
        real = real or (family == "none" and families.kind_of_none(number) == "recorded")
        if loaded and (which == "examination" or why):
            yield name, why or "the recording with a payload belongs to the development half"
        elif real and why:
            yield name, why
