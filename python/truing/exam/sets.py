# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The sets of the examination: `make("development/single/12")` gives robot, data and label of one of them,
the same every time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import truing
from truing.exam import families, field_families, recordings
from truing.exam.numbering import Numbering, parts_of
from truing.exam.scenes import SMALL, Case, Label, Request

COUNTS = {
    "none": 120,
    "single": 300,
    "double": 150,
    "confounded": 80,
    "wrong_law": 80,
    "unlisted": 120,
    "missing": 40,
    "twenty": 40,
    "grid": 80,
    "few": 120,
    "mistaken": 60,
    "machines": 120,
    "teeth": 90,
    "several": 60,
    "companion": 80,
}
"""Sets of each family. A new family stands last: a set's random numbers start from its family's place."""
QUICK = {
    "none": 12,
    "single": 18,
    "double": 8,
    "confounded": 6,
    "wrong_law": 4,
    "unlisted": 8,
    "missing": 2,
    "twenty": 2,
    "grid": 3,
    "few": 4,
    "mistaken": 3,
    "machines": 6,
    "teeth": 3,
    "several": 3,
    "companion": 2,
}
FAMILIES: dict[str, Callable[[Request], Case]] = {**families.FAMILIES, **field_families.FAMILIES}


NUMBERING = Numbering(COUNTS, QUICK, SMALL, 77)
ids = NUMBERING.ids


def make(id: str) -> tuple[truing.Robot, truing.Measurements, Label]:
    """Robot, data and label of a set."""
    case = build(id)
    return case.robot, case.data, case.label


def build(id: str) -> Case:
    """A set with everything about it."""
    request = NUMBERING.request(id)
    return FAMILIES[request.family](request)


_SOURCES = {"single": families.source_of_single, "missing": families.source_of_missing}
"""Families that take real recordings, and of which numbers."""


def skipped(which: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Sets that cannot be made here, and why."""
    why = recordings.missing(which)
    if not why:
        return
    for name in names:
        family, number = parts_of(name)
        source_of = _SOURCES.get(family)
        if source_of and source_of(number) == "spike":
            yield name, why
