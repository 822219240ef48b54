# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Are angles counted from another zero, or the other way, than the robot's file counts them?

Controllers and files that others wrote differ by a quarter or half a turn at some joints, often at several at
once, and each alone helps little. So joints are changed singly as long as that helps, then two at a time.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence

QUARTERS = (0, 1, 2, 3)  # turns of 90 degrees from the file's zero
Way = tuple[int, int]  # of a joint: 1 or -1, the other way; and quarter turns from zero
AS_IT_IS: Way = (1, 0)
WAYS = [(sign, quarter) for sign in (1, -1) for quarter in QUARTERS]


def best_ways(
    left: Callable[[tuple[Way, ...]], float], joints: Sequence[bool], least: float
) -> tuple[Way, ...]:
    """The ways to count at which `left` is least. Every sign or zero that is changed must gain `least`: of an
    arm and its mirror image, which weigh as much, the one that changes fewer is taken. joints: whether each
    is a revolute one, as others have no turns.
    """

    def cost(ways: tuple[Way, ...]) -> float:
        return left(ways) + least * sum((sign < 0) + (quarter != 0) for sign, quarter in ways)

    best = (AS_IT_IS,) * len(joints)
    while True:
        other = min(_neighbours(best, joints, 1), key=cost)
        if cost(other) >= cost(best):
            other = min(_neighbours(best, joints, 2), key=cost, default=best)
        if cost(other) >= cost(best):
            return best
        best = other


def _neighbours(ways: tuple[Way, ...], joints: Sequence[bool], together: int) -> Iterator[tuple[Way, ...]]:
    """All that differ at so many joints; `ways` itself among them."""
    choices = [WAYS if turns else [(1, 0), (-1, 0)] for turns in joints]
    for some in itertools.combinations(range(len(ways)), together):
        for new in itertools.product(*(choices[j] for j in some)):
            changed = dict(zip(some, new, strict=True))
            yield tuple(changed.get(j, way) for j, way in enumerate(ways))


def angle(quarter: int) -> float:
    """[rad] between -90 and 180 degrees"""
    return math.radians(90.0 * (quarter if quarter < 3 else -1))


def in_words(names: Sequence[str], signs: Sequence[float], zeros: Sequence[float]) -> str:
    """ "J2 plus 90°, J3 with the opposite sign (angle and torque) and minus 90°" """
    said = []
    for name, sign, zero in zip(names, signs, zeros, strict=True):
        degrees = round(math.degrees(zero)) % 360
        turned = " with the opposite sign (angle and torque)" if sign < 0 else ""
        added = {90: " plus 90°", 180: " plus 180°", 270: " minus 90°"}.get(degrees, "")
        if turned or added:
            said.append(f"{name}{turned}{' and' if turned and added else ''}{added}")
    return ", ".join(said)
