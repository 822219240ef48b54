# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Names of the sets of either half: "development/single/12", with "@7" after it for another seed than 0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import truing
from truing.exam.scenes import Request

WHICH = ("development", "examination")


@dataclass(frozen=True)
class Numbering:
    """Which sets there are. Random numbers of a set start from its family's place: a new family
    stands last.
    """

    counts: Mapping[str, int]  # of sets, by family
    quick: Mapping[str, int]  # the same of the quick examination
    quick_from: int  # number of the first quick set of a family, beyond all others
    stream: int  # of random numbers, another one in each half
    where: str = ""  # of which half, for messages

    def ids(
        self,
        which: str,
        *,
        quick: bool = False,
        families: Sequence[str] | None = None,
        only: Sequence[str] | None = None,
        seed: int = 0,
    ) -> list[str]:
        """Names of all sets of an examination. Quick: a few of each family, that the whole examination does
        not have. only: "single/12", these sets. Raises InputError.
        """
        after = f"@{seed}" if seed else ""
        if only:
            for name in only:
                family, _, number = name.partition("/")
                self._known(family)
                if not number.isdecimal():
                    raise truing.InputError(f"no set {name!r}: expected a family and a number, 'single/12'")
            return [f"{which}/{name}{after}" for name in only]
        found = []
        for family in families or self.counts:
            self._known(family)
            first, count = (self.quick_from, self.quick[family]) if quick else (0, self.counts[family])
            found += [f"{which}/{family}/{k}{after}" for k in range(first, first + count)]
        return found

    def _known(self, family: str) -> None:
        if family not in self.counts:
            raise truing.InputError(
                f"no family of sets {family!r}{self.where}: expected some of {', '.join(self.counts)}"
            )

    def request(self, id: str) -> Request:
        """Which set is wanted, and the dice for it. Raises ValueError."""
        words, _, seed = id.partition("@")
        which, family, number = words.split("/")
        if which not in WHICH or family not in self.counts:
            raise ValueError(f"no set {id!r}: expected {'|'.join(WHICH)}/{'|'.join(self.counts)}/number")
        dice = [int(seed or 0), WHICH.index(which), list(self.counts).index(family), int(number), self.stream]
        return Request(id, which, family, int(number), np.random.default_rng(dice))


def parts_of(id: str) -> tuple[str, int]:
    """Family and number."""
    _, family, number = id.partition("@")[0].split("/")
    return family, int(number)
