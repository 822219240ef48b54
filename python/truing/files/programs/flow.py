# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which tool and frame hold at a line, in languages that set them by an instruction (KRL, URScript).

A program is read in the order of its lines. Where it runs in another order (loops, calls, jumps) a place may
not be what the line above says: it is then not known, and targets that need it stay. What a loop leaves at
its end, and a routine to its caller, is known when they have been read: hence several passes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from truing.files.programs.model import Place

_MOST_PASSES = 20  # calls within calls; what has not settled then keeps what the last pass says


@dataclass(frozen=True)
class Places:
    """What holds at a line."""

    tool: Place
    frame: Place

    def is_like(self, other: Places) -> bool:
        """Whether both say the same, or both that it is not known."""
        pairs = ((self.tool, other.tool), (self.frame, other.frame))
        return all(a.is_like(b) or (a.T is None and b.T is None) for a, b in pairs)


@dataclass
class _Block:
    entry: Places
    ends: list[Places]  # of its branches that are over
    first_line: int
    loops: bool
    whole: bool = False  # one of its branches is always taken


@dataclass
class Effects:
    """What one pass has found of loops and routines."""

    loops: dict[int, Places] = field(default_factory=dict)  # by first line: what holds at the end
    routines: dict[str, tuple[Place | None, Place | None]] = field(default_factory=dict)
    """By name: tool and frame that it leaves to its caller; None: the caller's own."""

    def is_like(self, other: Effects) -> bool:
        return (
            self.loops.keys() == other.loops.keys()
            and all(places.is_like(other.loops[line]) for line, places in self.loops.items())
            and {name: _known(left) for name, left in self.routines.items()}
            == {name: _known(left) for name, left in other.routines.items()}
        )


def _known(left: tuple[Place | None, Place | None]) -> tuple[object, object]:
    """Comparable: left alone, not known, or the numbers."""
    tool, frame = (None if p is None else "?" if p.T is None else p.T.tobytes() for p in left)
    return tool, frame


def in_passes(read: Callable[[Effects], Effects]) -> Effects:
    """Reads until nothing changes: `read` takes what the pass before has found."""
    found = Effects()
    for _ in range(_MOST_PASSES):
        before, found = found, read(found)
        if found.is_like(before):
            break
    return found


class Flow:
    """Follows routines and blocks. `unset`: what holds before anything is set. `always`: what holds where a
    routine begins that another one calls, and behind a label. `before`: what an earlier pass has found.
    """

    def __init__(self, unset: Places, always: Places, before: Effects | None = None) -> None:
        self.now = unset
        self.found = Effects()
        self._always = always
        self._before = before or Effects()
        self._blocks: list[_Block] = []
        self._routines: list[tuple[str, Places, Places, list[_Block]]] = []
        self._first = True

    def begin_routine(self, name: str = "") -> None:
        outer = self.now
        if not self._first:
            self.now = self._always
        self._routines.append((name, self.now, outer, self._blocks))
        self._blocks = []
        self._first = False

    def end_routine(self) -> None:
        """What it leaves to its callers. The text after it goes on with what held before it."""
        if not self._routines:
            return
        name, entry, outer, blocks = self._routines.pop()
        tool = None if self.now.tool is entry.tool else self.now.tool
        frame = None if self.now.frame is entry.frame else self.now.frame
        self.found.routines[name] = tool, frame
        self.now, self._blocks = outer, blocks

    def call(self, name: str) -> bool:
        """A routine of this file is called; False: it is not one."""
        tool, frame = self._before.routines.get(name, (None, None))
        self.now = Places(tool or self.now.tool, frame or self.now.frame)
        return name in self._before.routines

    def label(self) -> None:
        """Jumps come here from anywhere."""
        self.now = self._always

    def open(self, line: int, *, loops: bool = False) -> None:
        block = _Block(self.now, [], line, loops)
        if loops and line in self._before.loops:
            end = self._before.loops[line]
            self.now = Places(
                _agreed([self.now.tool, end.tool], "tool", block),
                _agreed([self.now.frame, end.frame], "frame", block),
            )
            block.entry = self.now
        self._blocks.append(block)

    def otherwise(self, *, last: bool = False) -> None:
        """Another branch of the block begins; last: it is taken where no other is."""
        if self._blocks:
            block = self._blocks[-1]
            block.ends.append(self.now)
            block.whole = block.whole or last
            self.now = block.entry

    def close(self) -> None:
        """After a block a place holds if every way through it leaves the same."""
        if not self._blocks:
            return
        block = self._blocks.pop()
        if block.loops:
            self.found.loops[block.first_line] = self.now
        ways = [*([] if block.whole else [block.entry]), *block.ends, self.now]
        self.now = Places(
            _agreed([way.tool for way in ways], "tool", block),
            _agreed([way.frame for way in ways], "frame", block),
        )

    def set_tool(self, place: Place) -> None:
        self.now = replace(self.now, tool=replace(place))  # another object: it was set

    def set_frame(self, place: Place) -> None:
        self.now = replace(self.now, frame=replace(place))


def _agreed(places: Sequence[Place], kind: str, block: _Block) -> Place:
    if _all_one(places):
        return places[0]
    return Place(None, "", f"which {kind} holds depends on the block at line {block.first_line}")


def _all_one(places: Sequence[Place]) -> bool:
    """Whether they are one place, or not known for one reason."""
    first = places[0]
    return all(
        place.is_like(first) or (place.T is None and first.T is None and place.why == first.why)
        for place in places
    )


def the_only(places: Sequence[Place], otherwise: Place, kind: str) -> Place:
    """What a routine begins with: the only place that the file ever sets."""
    if not places:
        return otherwise
    if _all_one(places):
        return places[0]
    return Place(None, "", f"which {kind} holds depends on where this routine is called from")
