# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Yaskawa INFORM jobs: .jbi.

Targets are the lines Cnnnnn=... below //POS. What is above them says how they are meant: ///TOOL, ///USER,
///POSTYPE (PULSE, BASE, ROBOT, USER), ///PULSE or ///RECTAN, and ///RCONF, the configuration ("Job data
format" of the controllers' data transmission manuals).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from truing.errors import InputError
from truing.files.programs.model import NOWHERE, Configuration, Found, Given, Place, Reading, Target
from truing.files.programs.text import Number, Source, numbers_of, require_end, trimmed

_FLAGS = re.ASCII | re.IGNORECASE
_LINE = re.compile(r"[^\r\n]+")
_POSITION = re.compile(r"[ \t]*(BC|EC|C|BP|EX|P)(\d+)[ \t]*=", _FLAGS)
_MOVE = re.compile(r"[ \t]*(\+?S?MOV[JLCS]|IMOV|REFP|MFRAME)\b(.*)", _FLAGS | re.DOTALL)
_NAMED = re.compile(r"(?<!\w)(BC|EC|C|P)(\d+)(?!\w)", _FLAGS)
_ROBOTS = re.compile(r"\bRB(\d+)\b", _FLAGS)


@dataclass(frozen=True)
class _Heading:
    """What the lines above a position say."""

    tool: str = ""
    user: str = ""
    type: str = ""
    form: str = ""  # PULSE or RECTAN
    configuration: Configuration | None = None


@dataclass
class _Position:
    number: int
    start: int
    end: int
    heading: _Heading
    numbers: tuple[Number, ...] | None
    uses: list[_Use] = field(default_factory=list)


@dataclass(frozen=True)
class _Use:
    offset: int
    move: str
    arc: int | None  # which point of its arc, from 0
    shifted: bool
    with_base: bool


class _Job:
    def __init__(self, reading: Reading, given: Given) -> None:
        self.reading, self.given = reading, given
        self.source = reading.sources[0]
        self.text = self.source.text
        self.positions: dict[int, _Position] = {}
        self._robots: set[str] = set()
        self.sequence: list[int | None] = []  # numbers of C positions as moves use them

    def read_lines(self) -> None:
        heading, in_program, arc, shifted = _Heading(), False, 0, False
        for match in _LINE.finditer(self.text):
            line = match[0].strip()
            if line.upper().startswith("//INST"):
                in_program = True
            elif not in_program:
                heading = self._heading(line, heading, match)
            elif line.upper().startswith("///GROUP"):
                self._require_one_robot(line, match.start())
            elif not line.startswith(("'", "/")):
                shifted = (shifted or line.upper().startswith("SFTON")) and not line.upper().startswith(
                    "SFTOF"
                )
                move = _MOVE.match(line)
                if move:
                    arc = arc + 1 if "MOVC" in move[1].upper() else 0
                    self._move(match.start(), move, arc - 1 if arc else None, shifted)

    def _require_one_robot(self, line: str, offset: int) -> None:
        self._robots |= {match[1] for match in _ROBOTS.finditer(line)}
        if len(self._robots) > 1:
            names = ", ".join(f"RB{number}" for number in sorted(self._robots))
            raise InputError(
                f"{self.source.path}, line {self.source.line(offset)}: the job moves the robots {names};"
                " one robot's"
                " program is expected"
            )

    def _heading(self, line: str, heading: _Heading, match: re.Match[str]) -> _Heading:
        words = line.lstrip("/").split(None, 1)
        word, rest = (words[0].upper() if words else ""), (words[1].strip() if len(words) > 1 else "")
        if not line.startswith("///"):
            self._position(match, heading)
            return heading
        if word == "TOOL":
            return replace(heading, tool=rest.partition(",")[0].strip())
        if word == "USER":
            return replace(heading, user=rest)
        if word == "POSTYPE":
            return replace(heading, type=rest.upper())
        if word in ("PULSE", "RECTAN"):
            return replace(heading, form=word)
        if word == "RCONF":
            return replace(heading, configuration=_configuration(rest))
        return heading

    def _position(self, match: re.Match[str], heading: _Heading) -> None:
        found = _POSITION.match(self.text, match.start(), match.end())
        if not found or found[1].upper() != "C":
            return
        start, end = trimmed(self.text, found.end(), match.end())
        number = int(found[2])
        if number in self.positions:
            line = self.source.line(match.start())
            raise InputError(f"{self.source.path}, line {line}: C{found[2]} is there twice")
        numbers = numbers_of(self.text, start, end, 6)
        self.positions[number] = _Position(number, found.start(1), end, heading, numbers)

    def _move(self, offset: int, move: re.Match[str], arc: int | None, shifted: bool) -> None:
        word = move[1].upper().lstrip("+")
        shown = self.source.shown(offset, offset + len(move[0]))
        named = [(match[1].upper(), int(match[2])) for match in _NAMED.finditer(move[2])]
        robot = [number for kind, number in named if kind == "C"]
        if word in ("IMOV", "REFP", "MFRAME"):
            self.reading.stay(
                0, offset, shown, "a relative move" if word == "IMOV" else f"{word}: no move to a target"
            )
            self.sequence.append(None)
        elif not robot and any(kind == "P" for kind, _ in named):
            self.reading.stay(0, offset, shown, "a position variable, known when the job runs")
            self.sequence.append(None)
        elif robot and robot[0] not in self.positions:
            self.reading.stay(0, offset, shown, f"C{robot[0]:05d} is not in the file")
            self.sequence.append(None)
        elif robot:
            with_base = any(kind == "BC" for kind, _ in named)
            if shifted:
                self.reading.stay(0, offset, shown, "moved by SFTON")
            self.positions[robot[0]].uses.append(_Use(offset, word, arc, shifted, with_base))
            self.sequence.append(robot[0])

    # ---- Targets ----

    def targets(self) -> None:
        found: list[Found] = []
        for position in self.positions.values():
            target = self._target(position)
            if target is not None:
                found.append(Found(position.number, target, self._ends(position)))
        self.reading.take(found)

    def _ends(self, position: _Position) -> tuple[int | None, int | None] | None:
        """Of the middle one of an arc's three points its neighbours."""
        if not any(use.arc is not None and use.arc % 2 == 1 for use in position.uses):
            return None
        at = self.sequence.index(position.number)
        after = self.sequence[at + 1] if at + 1 < len(self.sequence) else None
        return self.sequence[at - 1] if at else None, after

    def _target(self, position: _Position) -> Target | None:
        name = f"C{position.number:05d}"
        why = self._why_not(position)
        if why:
            self.reading.stay(0, position.start, name, why)
            return None
        assert position.numbers is not None
        heading, first = position.heading, position.uses[0] if position.uses else None
        pose = heading.form == "RECTAN"
        return Target(
            source=0,
            line=self.source.line(position.start),
            name=name,
            move=first.move if first else "",
            kind="pose" if pose else "joints",
            numbers=position.numbers,
            order=(0, first.offset if first else len(self.text) + position.start),
            moves=tuple((0, use.offset) for use in position.uses),
            tool=self._tool(heading) if pose else self._tool(heading).or_flange(),
            frame=self._frame(heading) if pose else NOWHERE,
            configuration=heading.configuration if pose else None,
        )

    def _tool(self, heading: _Heading) -> Place:
        return self.given.tool(heading.tool)

    def _frame(self, heading: _Heading) -> Place:
        return self.given.frame(heading.user) if heading.type == "USER" else NOWHERE

    def _why_not(self, position: _Position) -> str:
        heading = position.heading
        if position.numbers is None:
            return "is not six numbers"
        if position.uses and all(use.shifted for use in position.uses):
            return "only moves that SFTON shifts use it"
        if heading.form == "PULSE":
            if heading.type not in ("", "PULSE"):
                return f"its ///POSTYPE is {heading.type}, expected PULSE with ///PULSE"
            return "" if self.given.pulses else "is in pulses: --pulses says how many make a degree"
        if heading.form != "RECTAN":
            return "no ///PULSE or ///RECTAN says how it is meant"
        if heading.type not in ("BASE", "ROBOT", "USER"):
            return f"its ///POSTYPE is {heading.type or 'missing'}, expected BASE, ROBOT or USER"
        if heading.type != "ROBOT" and any(use.with_base for use in position.uses):
            return "a base axis (BC) moves the robot in the frame that it is given in"
        if heading.configuration is None:
            return "its ///RCONF is missing or not understood"
        for place in (self._tool(heading), self._frame(heading)):
            if place.T is None and not place.undefined:
                return place.why
        return ""


def _configuration(text: str) -> Configuration | None:
    words = [word.strip() for word in text.split(",")]
    if len(words) < 6 or not all(word in ("0", "1") for word in words[:6]):
        return None
    return Configuration("yaskawa", tuple(int(word) for word in words[:6]), ",".join(words[:6]))


def read(sources: Sequence[Source], given: Given) -> Reading:
    """Targets of one job."""
    source = sources[0]
    if not re.search(r"^(?:\xef\xbb\xbf)?[ \t]*/JOB\b", source.text, _FLAGS | re.MULTILINE):
        raise InputError(f"{source.path}: no line starts with /JOB, expected a Yaskawa job")
    require_end(source, source.text, "//INST", r"(?:^|\r)[ \t]*//INST\b")
    require_end(source, source.text, "END", r"(?:^|\r)[ \t]*END[ \t]*(?:\r|$)")
    reading = Reading("yaskawa", list(sources))
    job = _Job(reading, given)
    job.read_lines()
    job.targets()
    return reading
