# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The sets of the dynamic half: `build("development/single/12")` makes one of them, the same every time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

import truing
from truing.exam.dynamics import families, recordings
from truing.exam.dynamics.scenes import Case, Request
from truing.exam.sets import WHICH

COUNTS = {
    "none": 120,
    "single": 240,
    "double": 100,
    "confounded": 60,
    "wrong_law": 60,
    "unlisted": 80,
    "missing": 40,
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
}
_QUICK_FROM = 100_000
"""Number of the first quick set of a family, beyond all others."""


def ids(
    which: str,
    *,
    quick: bool = False,
    families: Sequence[str] | None = None,
    only: Sequence[str] | None = None,
    seed: int = 0,
) -> list[str]:
    """Names of all sets. Quick: a few of each family, that the whole examination does not have. only:
    "single/12", these sets.
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
        first, count = (_QUICK_FROM, QUICK[family]) if quick else (0, COUNTS[family])
        found += [f"{which}/{family}/{k}{after}" for k in range(first, first + count)]
    return found


def _known(family: str) -> None:
    if family not in COUNTS:
        raise truing.InputError(
            f"no family of sets {family!r} in the dynamic half: expected some of {', '.join(COUNTS)}"
        )


def build(id: str) -> Case:
    """A set. id: "development/single/12", with "@7" after it for another seed than 0."""
    words, _, seed = id.partition("@")
    which, family, number = words.split("/")
    if which not in WHICH or family not in COUNTS:
        raise ValueError(f"no set {id!r}: expected {'|'.join(WHICH)}/{'|'.join(COUNTS)}/number")
    rng = np.random.default_rng(
        [int(seed or 0), WHICH.index(which), list(COUNTS).index(family), int(number), 78]
    )
    return families.FAMILIES[family](Request(id, which, family, int(number), rng))


def skipped(which: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Sets that cannot be made here, and why."""
    why = recordings.missing(which)
    for name in names:
        _, family, text = name.partition("@")[0].split("/")
        number = int(text)
        loaded = family == "missing" and families.source_of_missing(number) == "spike"
        real = family == "single" and families.source_of_single(number) == "spike"
        real = real or (family == "none" and families.kind_of_none(number) == "recorded")
        if loaded and (which == "examination" or why):
            yield name, why or "the recording with a payload belongs to the development half"
        elif real and why:
            yield name, why
