# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""FANUC teach pendant programs as text: .ls.

Targets are the blocks P[n]{...} below /POS; each says its user frame (UF), tool (UT) and configuration, and
holds X Y Z W P R or J1 to J6 of group 1. Moves are the lines J, L, C and A below /MN; three A make an arc.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from truing.errors import InputError
from truing.files.programs.model import NOWHERE, Configuration, Found, Given, Place, Reading, Target
from truing.files.programs.text import NUMBER, Number, Source, require_end

_FLAGS = re.ASCII | re.IGNORECASE
_POSE = ("X", "Y", "Z", "W", "P", "R")
_JOINTS = ("J1", "J2", "J3", "J4", "J5", "J6")
_COMMENT = r"(?::(?:\"[^\"\r\n]*\"|[^\]\r\n])*)?"  # of a point: [3:"over bin"]
_BLOCK = re.compile(rf"^[ \t]*P\[[ \t]*(\d+)[ \t]*{_COMMENT}\][ \t]*\{{(?:([^{{}}]*)\}})?", _FLAGS | re.M)
_GROUP = re.compile(r"\bGP(\d+)[ \t]*:", _FLAGS)
_PLACES = re.compile(r"\bUF[ \t]*:[ \t]*(\w+)[ \t]*,[ \t]*UT[ \t]*:[ \t]*(\w+)", _FLAGS)
_CONFIG = re.compile(r"\bCONFIG[ \t]*:[ \t]*'([^'\r\n]*)'", _FLAGS)
_VALUE = re.compile(rf"(?<![\w])([A-Z]\d?)[ \t]*=[ \t]*({NUMBER})[ \t]*(mm|deg)(?![\w.])", _FLAGS)
_UNSET = re.compile(r"(?<![\w])([A-Z]\d?)[ \t]*=[ \t]*\*+", _FLAGS)
_LETTERS = re.compile(r"[ \t]*([NF])(?:[ \t]+[LR])?[ \t]+([UD])[ \t]+([TB])", _FLAGS)
_INSTRUCTION = re.compile(r"^[ \t]*\d*[ \t]*:(.*?);", re.M | re.S)  # of one line, or of several
_INDEX = r"\[((?:[^\[\]]|\[[^\]]*\])*)\]"  # [3], [3:over bin], [R[1]]
_MOVE = re.compile(rf"[ \t]*([JLCAS])[ \t]+(PR|P){_INDEX}(.*)", _FLAGS | re.S)
_SECOND = re.compile(rf"(?<!\w)(PR|P){_INDEX}", _FLAGS)
_ASSIGNED = re.compile(r"(?<!\w)P\[[ \t]*(\d+)[ \t]*(?::[^\]]*)?\][ \t]*=", _FLAGS)


@dataclass
class _Point:
    number: int
    start: int
    begin: int  # of the text in braces
    end: int
    uses: list[_Use] = field(default_factory=list)
    assigned: int | None = None  # offset


@dataclass(frozen=True)
class _Use:
    offset: int
    move: str
    options: str
    via: bool = False
    previous: int | None = None  # number of the point before
    ends_at: int | None = None


class _Fanuc:
    def __init__(self, reading: Reading, given: Given) -> None:
        self.reading, self.given = reading, given
        self.text = reading.sources[0].text
        sections = {
            match[1].upper(): match.end()
            for match in re.finditer(r"^/(MN|POS|END)\b", self.text, _FLAGS | re.M)
        }
        self.moves_at = (sections.get("MN", 0), sections.get("POS", len(self.text)))
        self.points_at = (sections.get("POS", len(self.text)), len(self.text))
        self.points: dict[int, _Point] = {}
        self.on_arc: list[int | None] = []  # points of the moves A before, one after the other

    def read_points(self) -> None:
        for match in _BLOCK.finditer(self.text, *self.points_at):
            number = int(match[1])
            if match[2] is None or number in self.points:
                line = self.reading.sources[0].line(match.start())
                what = "is there twice" if number in self.points else "has no } at its end"
                raise InputError(f"{self.reading.sources[0].path}, line {line}: P[{number}] {what}")
            self.points[number] = _Point(number, match.start(), match.start(2), match.end(2))
        for point in self.points.values():
            self._require_one_robot(point)

    def _groups(self, point: _Point) -> dict[int, tuple[int, int]]:
        found = list(_GROUP.finditer(self.text, point.begin, point.end))
        if not found:
            return {1: (point.begin, point.end)}
        ends = [match.start() for match in found[1:]] + [point.end]
        return {int(match[1]): (match.end(), end) for match, end in zip(found, ends, strict=True)}

    def _values(self, piece: tuple[int, int]) -> dict[str, Number]:
        return {
            match[1].upper(): Number(match.start(2), match.end(2), match[2])
            for match in _VALUE.finditer(self.text, *piece)
        }

    def _require_one_robot(self, point: _Point) -> None:
        groups = self._groups(point)
        for number, piece in groups.items():
            values = self._values(piece)
            if number != 1 and ("X" in values or "J4" in values):
                line = self.reading.sources[0].line(piece[0])
                raise InputError(
                    f"{self.reading.sources[0].path}, line {line}: P[{point.number}] moves a second"
                    " robot, group"
                    f" {number}; one robot's program is expected"
                )

    # ---- Moves ----

    def read_moves(self) -> None:
        previous: int | None = None
        for match in _INSTRUCTION.finditer(self.text, *self.moves_at):
            body = match[1]
            if body.lstrip().startswith(("!", "//", "--")):
                continue
            for assigned in _ASSIGNED.finditer(body):
                point = self.points.get(int(assigned[1]))
                if point is not None and point.assigned is None:
                    point.assigned = match.start(1) + assigned.start()
            move = _MOVE.match(body)
            self._other_mentions(match.start(1), body, bool(move))
            if move:
                previous = self._move(match.start(1), body, move, previous)

    def _other_mentions(self, offset: int, body: str, is_move: bool) -> None:
        """PR[1]=P[3]: the program computes with a point, which may be changed."""
        if is_move:
            return
        for found in _SECOND.finditer(re.sub(r'"[^"]*"', "", body)):
            number = self._point_number(found[1], found[2])
            if number in self.points and not _ASSIGNED.match(body, found.start()):
                shown = self.reading.sources[0].shown(offset, offset + len(body)).strip()
                self.reading.stay(0, offset, shown, f"computes with P[{number}], which is changed")

    def _move(self, offset: int, body: str, move: re.Match[str], previous: int | None) -> int | None:
        """Returns the point that the robot is at afterwards, if it is known."""
        word = move[1].upper()
        named = [(move[2], move[3])]
        second = _SECOND.match(move[4].lstrip(" \t\r\n:0123456789")) if word == "C" else None
        if second:
            named.append((second[1], second[2]))
        options = re.sub(r'"[^"]*"', "", move[4])
        shown = self.reading.sources[0].shown(offset, offset + len(body)).strip()
        numbers = [self._point_number(kind, text) for kind, text in named]
        relative = _relative(options)
        for k, (number, (kind, text)) in enumerate(zip(numbers, named, strict=True)):
            if number is None:
                why = f"{kind.upper()}[{text.strip()}] is known when the program runs"
                self.reading.stay(0, offset, shown, why)
            elif number not in self.points:
                self.reading.stay(0, offset, shown, f"P[{number}] is not in the file")
            else:
                if relative:
                    self.reading.stay(0, offset, shown, relative)
                via = word == "C" and k == 0 and len(numbers) == 2
                use = _Use(offset, word, options, via, previous, numbers[-1] if via else None)
                self.points[number].uses.append(use)
        self.on_arc = [*self.on_arc, numbers[-1]] if word == "A" else []
        if len(self.on_arc) > 2:  # the first A goes straight to where the arc begins
            self._passed(*self.on_arc[-2:])
        return None if relative else numbers[-1]

    def _passed(self, number: int | None, ends_at: int | None) -> None:
        """The last use of a point is in the middle of an arc of moves A."""
        point = self.points.get(number) if number is not None else None
        if point is not None:
            point.uses[-1] = replace(point.uses[-1], via=True, ends_at=ends_at)

    def _point_number(self, kind: str, text: str) -> int | None:
        text = text.partition(":")[0].strip()
        return int(text) if kind.upper() == "P" and text.isdigit() else None

    # ---- Targets ----

    def targets(self) -> None:
        found: list[Found] = []
        for point in self.points.values():
            target = self._target(point)
            if target is not None:
                first = point.uses[0] if point.uses else None
                ends = (first.previous, first.ends_at) if first is not None and first.via else None
                found.append(Found(point.number, target, ends))
        self.reading.take(found)

    def _target(self, point: _Point) -> Target | None:
        groups = self._groups(point)
        piece = groups.get(1)
        name = f"P[{point.number}]"
        values = self._values(piece) if piece else {}
        kind = "joints" if any(joint in values for joint in _JOINTS) else "pose"
        names = _JOINTS if kind == "joints" else _POSE
        place = _PLACES.search(self.text, *piece) if piece else None
        why = self._why_not(point, piece, values, names)
        if why:
            self.reading.stay(0, point.start, name, why)
            return None
        assert piece is not None
        for number in groups:
            if number != 1:
                self.reading.stay(
                    0, groups[number][0], f"{name}, GP{number}", "another group than the robot's"
                )
        tool, frame = self._places(place)
        if kind == "pose":
            unknown = next((p for p in (tool, frame) if p.T is None and not p.undefined), None)
            if unknown is not None:
                self.reading.stay(0, point.start, name, unknown.why)
                return None
        outside = sorted(value for value in values if re.fullmatch(r"E\d", value))
        first = point.uses[0] if point.uses else None
        return Target(
            source=0,
            line=self.reading.sources[0].line(point.start),
            name=name,
            move=first.move if first else "",
            kind=kind,  # type: ignore[arg-type]
            numbers=tuple(values[n] for n in names),
            order=(0, first.offset if first else len(self.text) + point.start),
            moves=tuple((0, use.offset) for use in point.uses),
            tool=tool if kind == "pose" else tool.or_flange(),
            frame=frame if kind == "pose" else NOWHERE,
            configuration=self._configuration(piece) if kind == "pose" else None,
            notes=(f"external axes {', '.join(outside)} untouched",) if outside else (),
        )

    def _why_not(
        self, point: _Point, piece: tuple[int, int] | None, values: dict[str, Number], names: Sequence[str]
    ) -> str:
        if piece is None:
            return "has no group 1"
        missing = [n for n in names if n not in values]
        if missing:
            unset = _UNSET.search(self.text, *piece)
            return "is not taught yet (***)" if unset else f"has no {', '.join(missing)} with its unit"
        if point.assigned is not None:
            return f"is assigned in line {self.reading.sources[0].line(point.assigned)}, no constant"
        if point.uses and all(_relative(use.options) for use in point.uses):
            return "only moves with an offset or an increment use it"
        if any(re.search(r"\bINC\b", use.options, _FLAGS) for use in point.uses):
            return "an incremental move uses it"
        if any(use.via != point.uses[0].via for use in point.uses):
            return "is a point on an arc and the end of another move"
        if (
            any(re.search(r"\bCOORD\b", use.options, _FLAGS) for use in point.uses)
            and len(self._groups(point)) > 1
        ):
            return "moves together with another group (COORD)"
        pose = names is _POSE or tuple(names) == _POSE
        active = [n for n in values if re.fullmatch(r"E\d", n) and values[n].value != 0]
        if pose and active:
            return f"external axis {', '.join(active)} is not at 0 and may move robot or workpiece"
        if pose and self._configuration(piece) is None:
            return "its CONFIG is missing or not understood"
        return ""

    def _places(self, place: re.Match[str] | None) -> tuple[Place, Place]:
        if place is None:
            missing = Place(None, "", "says no UF and UT")
            return missing, missing
        return self._place(place[2], "UT", "tool"), self._place(place[1], "UF", "frame")

    def _place(self, text: str, word: str, kind: str) -> Place:
        if text == "0":
            return NOWHERE
        if not text.isdigit():
            return Place(None, text, f"{word} : {text} is what holds when the program runs")
        return self.given.tool(text) if kind == "tool" else self.given.frame(text)

    def _configuration(self, piece: tuple[int, int]) -> Configuration | None:
        match = _CONFIG.search(self.text, *piece)
        letters = _LETTERS.match(match[1]) if match else None
        if match is None or letters is None:
            return None
        rest = [part.strip() for part in match[1][letters.end() :].split(",")[1:]]
        if len(rest) != 3 or not all(re.fullmatch(r"-?\d", part, re.ASCII) for part in rest):
            return None
        flip, up, front = (
            int(letter.upper() == word) for letter, word in zip(letters.groups(), "FUT", strict=True)
        )
        return Configuration("fanuc", (flip, up, front, *map(int, rest)), match[1].strip())


def _relative(options: str) -> str:
    """Why the point of a move is not where the robot goes."""
    match = re.search(r"\b(Tool_Offset|VOFFSET|Offset|INC|Skip)\b", options, _FLAGS)
    if not match or match[1].lower() == "skip":
        return ""
    return "an incremental move" if match[1].lower() == "inc" else f"moves with {match[1]}"


def read(sources: Sequence[Source], given: Given) -> Reading:
    """Targets of one .ls file."""
    source = sources[0]
    if not re.search(r"^(?:\xef\xbb\xbf)?[ \t]*/PROG\b", source.text, _FLAGS | re.MULTILINE):
        raise InputError(f"{source.path}: no line starts with /PROG, expected a FANUC program as text")
    require_end(source, source.text, "/END", r"^[ \t]*/END\b")
    reading = Reading("fanuc", list(sources))
    fanuc = _Fanuc(reading, given)
    fanuc.read_points()
    fanuc.read_moves()
    fanuc.targets()
    return reading
