# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The sets of the examination: `make("development/single/12")` gives robot, data and label of one of them,
the same every time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

import truing
from truing.exam import families, field_families, recordings
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
WHICH = ("development", "examination")
FAMILIES: dict[str, Callable[[Request], Case]] = {**families.FAMILIES, **field_families.FAMILIES}


def ids(
    which: str,
    *,
    quick: bool = False,
    families: Sequence[str] | None = None,
    only: Sequence[str] | None = None,
    seed: int = 0,
) -> list[str]:
    """Names of all sets of an examination. Quick: a few small ones of each family, that the whole examination
    does not have. only: "single/12", these sets.
    """
    after = f"@{seed}" if seed else ""
    if only:
        for name in only:
            family, _, number = name.partition("/")
            _known(family)
            if not number.isdecimal():
                raise truing.InputError(f"no set {name!r}: expected a family and a number, 'single/12'")
        return [f"{which}/{name}{after}" for name in only]
    found = []
    for family in families or COUNTS:
        _known(family)
        first, count = (SMALL, QUICK[family]) if quick else (0, COUNTS[family])
        found += [f"{which}/{family}/{k}{after}" for k in range(first, first + count)]
    return found


def _known(family: str) -> None:
    if family not in COUNTS:
        raise truing.InputError(f"no family of sets {family!r}: expected some of {', '.join(COUNTS)}")


def make(id: str) -> tuple[truing.Robot, truing.Measurements, Label]:
    """Robot, data and label of a set."""
    case = build(id)
    return case.robot, case.data, case.label


def build(id: str) -> Case:
    """A set with everything about it. id: "development/single/12", with "@7" after it for another seed than
    0.
    """
    words, _, seed = id.partition("@")
    which, family, number = words.split("/")
    if which not in WHICH or family not in COUNTS:
        raise ValueError(f"no set {id!r}: expected {'|'.join(WHICH)}/{'|'.join(COUNTS)}/number")
    rng = np.random.default_rng(
        [int(seed or 0), WHICH.index(which), list(COUNTS).index(family), int(number), 77]
    )
    return FAMILIES[family](Request(id, which, family, int(number), rng))


_SOURCES = {"single": families.source_of_single, "missing": families.source_of_missing}
"""Families that take real recordings, and of which numbers."""


def skipped(which: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Sets that cannot be made here, and why."""
    why = recordings.missing(which)
    if not why:
        return
    for name in names:
        _, family, number = name.partition("@")[0].split("/")
        source_of = _SOURCES.get(family)
        if source_of and source_of(int(number)) == "spike":
            yield name, why
