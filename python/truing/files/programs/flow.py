# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which tool and frame hold at a line, in languages that set them by an instruction (KRL, URScript).

A program is read in the order of its lines. Where it runs in another order a place may not be what the line
above says: it is then not known, and targets that need it stay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from truing.files.programs.model import Place


@dataclass(frozen=True)
class Places:
    """What holds at a line."""

    tool: Place
    frame: Place


@dataclass
class _Block:
    entry: Places
    ends: list[Places]  # of its branches that are over
    first_line: int


class Flow:
    """Follows routines and blocks. `unset`: what holds before anything is set. `always`: what holds where a
    routine begins that another one calls.
    """

    def __init__(self, unset: Places, always: Places) -> None:
        self.now = unset
        self._always = always
        self._blocks: list[_Block] = []
        self._routines: list[tuple[Places, list[_Block]]] = []
        self._first = True

    def begin_routine(self) -> None:
        self._routines.append((self.now, self._blocks))
        self._blocks = []
        if not self._first:
            self.now = self._always
        self._first = False

    def end_routine(self) -> None:
        """Whoever called it goes on with what held there."""
        if self._routines:
            self.now, self._blocks = self._routines.pop()

    def open(self, line: int) -> None:
        self._blocks.append(_Block(self.now, [], line))

    def otherwise(self) -> None:
        """Another branch of the block begins."""
        if self._blocks:
            block = self._blocks[-1]
            block.ends.append(self.now)
            self.now = block.entry

    def close(self) -> None:
        """After a block a place holds if every way through it leaves the same."""
        if not self._blocks:
            return
        block = self._blocks.pop()
        self.now = Places(
            _agreed([block.entry.tool, *(end.tool for end in block.ends), self.now.tool], "tool", block),
            _agreed([block.entry.frame, *(end.frame for end in block.ends), self.now.frame], "frame", block),
        )

    def set_tool(self, place: Place) -> None:
        self.now = replace(self.now, tool=place)

    def set_frame(self, place: Place) -> None:
        self.now = replace(self.now, frame=place)


def _agreed(places: Sequence[Place], kind: str, block: _Block) -> Place:
    first = places[0]
    if all(place is first or place.is_like(first) for place in places):
        return first
    return Place(None, "", f"which {kind} holds depends on the block at line {block.first_line}")


def the_only(places: Sequence[Place], otherwise: Place, kind: str) -> Place:
    """What a routine begins with: the only place that the file ever sets."""
    if not places:
        return otherwise
    if all(place is places[0] or place.is_like(places[0]) for place in places):
        return places[0]
    return Place(None, "", f"which {kind} holds depends on where this routine is called from")
