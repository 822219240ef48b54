# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of programs finds, the same for every maker."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from truing.files.brand_frames import Brand
from truing.files.programs.text import Number, Source

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """A tool in the flange or a frame in the robot base, as far as it is known."""

    T: Floats | None = None  # shape=(4, 4) [m]
    name: str = ""  # as the program calls it
    why: str = ""  # why it is not known
    undefined: bool = False  # it has a name, but nobody says what it is: an option must

    def is_like(self, other: Place) -> bool:
        """Whether both are known and the same."""
        return self.T is not None and other.T is not None and np.array_equal(self.T, other.T)

    def or_flange(self) -> Place:
        """For joints, which need no tool: where errors are told, if the tool is known."""
        return NOWHERE if self.T is None else self


def why_not_one(places: Sequence[Place], word: str) -> str:
    """Why a target that moves use with these tools, or frames, is not meant by one of them; "" if it is, or
    an option has yet to say what it is.
    """
    unknown = next((place for place in places if place.T is None), None)
    if unknown is not None:
        return "" if unknown.undefined else unknown.why
    return (
        "" if all(place.is_like(places[0]) for place in places) else f"moves use it with more than one {word}"
    )


NOWHERE = Place(np.eye(4))  # the flange as a tool, the robot base as a frame


@dataclass(frozen=True)
class Configuration:
    """Which of the robot's ways to reach a pose is meant, as the maker counts.

    values: kuka S, T (None: not said); abb cf1, cf4, cf6, cfx; fanuc flip, up, front (1 or 0), turns of J4,
    J5, J6; yaskawa the first six of RCONF. numbers: tokens of those values that count turns and may be
    written anew (kuka T, abb cf1 cf4 cf6), by their place in `values`.
    """

    brand: Brand
    values: tuple[int | None, ...]
    text: str  # as the program writes it
    numbers: Mapping[int, Number] = field(default_factory=dict)


@dataclass(frozen=True)
class Via:
    """A point that an arc passes: which targets it starts and ends at; None: not a literal target."""

    start: int | None
    end: int | None


@dataclass(frozen=True)
class Target:
    """A literal target. Its numbers stand in the order of `NOTATIONS[brand].names`, or are the joints."""

    source: int  # which of the files
    line: int
    name: str  # "P[1]", "XP1"; of one that stands in its move the words of that
    move: str  # instruction that first uses it: "LIN"; "" where none does
    kind: Literal["pose", "joints"]
    numbers: tuple[Number, ...]
    order: tuple[int, int]  # file and offset of the move that first uses it
    moves: tuple[tuple[int, int], ...]  # likewise of every move to it
    tool: Place = NOWHERE
    frame: Place = NOWHERE
    configuration: Configuration | None = None
    seed: tuple[float, ...] | None = None  # [rad] joints near which the solution is meant
    via: Via | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Found:
    """A target as a reader comes to it. key: what it is known by. ends: of a point that an arc passes, keys
    of what the arc starts and ends at.
    """

    key: Hashable
    target: Target
    ends: tuple[Hashable, Hashable] | None = None


@dataclass(frozen=True)
class Stay:
    """Something that is left as it is, and why."""

    source: int
    line: int
    what: str
    why: str


@dataclass(frozen=True)
class Given:
    """What options say: tools and frames by the name the program has for them ("": any other), pulses per
    degree of a Yaskawa's joints.
    """

    tools: Mapping[str, Floats] = field(default_factory=dict)
    frames: Mapping[str, Floats] = field(default_factory=dict)
    pulses: tuple[float, ...] | None = None

    def tool(self, name: str) -> Place:
        return self._place(self.tools, "tool", name)

    def frame(self, name: str) -> Place:
        return self._place(self.frames, "frame", name)

    def _place(self, places: Mapping[str, Floats], kind: str, name: str) -> Place:
        """A place that the program does not define itself."""
        for known in (name.lower(), ""):
            if known in places:
                return Place(places[known], name)
        why = (
            f"{kind} {name} is not defined in the program"
            if name
            else f"no {kind} is set before it: --{kind} says which holds"
        )
        return Place(None, name, why, undefined=bool(name))


@dataclass
class Reading:
    """What was found in files that belong together."""

    brand: Brand
    sources: list[Source]
    targets: list[Target] = field(default_factory=list)
    stays: list[Stay] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    others: frozenset[int] = frozenset()  # files that are only looked into, and not written

    def own(self) -> list[Source]:
        """The files that make up the program."""
        return [source for k, source in enumerate(self.sources) if k not in self.others]

    def take(self, found: Sequence[Found]) -> None:
        """Adds targets in the order in which moves first use them, points of arcs with their ends."""
        ordered = sorted(found, key=lambda one: one.target.order)
        index = {one.key: k for k, one in enumerate(ordered)}
        for one in ordered:
            ends = None if one.ends is None else Via(*(index.get(key) for key in one.ends))
            self.targets.append(one.target if ends is None else replace(one.target, via=ends))

    def stay(self, source: int, offset: int, what: str, why: str) -> None:
        self.stays.append(Stay(source, self.sources[source].line(offset), what, why))
