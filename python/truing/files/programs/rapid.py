# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""ABB RAPID modules: .mod and .sys.

Targets are robtarget [[x,y,z],[q1..q4],[cf1,cf4,cf6,cfx],[eax..]] and jointtarget [[j1..j6],[eax..]], in a
move or declared with CONST, PERS or VAR and never assigned. Tool and work object are arguments of the move
("Technical reference manual: RAPID Instructions, Functions and Data types").
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from truing.errors import InputError
from truing.files.brand_frames import frame_from_numbers
from truing.files.programs.model import (
    NOWHERE,
    Configuration,
    Floats,
    Found,
    Given,
    Place,
    Reading,
    Target,
    why_not_one,
)
from truing.files.programs.text import (
    Number,
    Source,
    blanked,
    closing,
    is_closed,
    numbers_of,
    pieces,
    require_end,
    trimmed,
    unclosed,
)

_FLAGS = re.ASCII | re.IGNORECASE
_NO_CODE = re.compile(r'"(?:[^"\r\n]|"")*"?|![^\r\n]*')
_TYPES = "robtarget|jointtarget|tooldata|wobjdata|pose"
_DECLARED = re.compile(
    rf"\b(?:CONST|PERS|VAR)\s+({_TYPES})\s+(\w+)\s*(\{{[^}}]*\}})?\s*(?::=\s*|(?=;))", _FLAGS
)
_NO_TARGET = 9e8  # 9E9: an external axis that is not there

# Instructions, their target arguments, and which argument is the tool, counted without switches.
_MOVES: dict[str, tuple[tuple[int, ...], int]] = {
    **dict.fromkeys(("moveabsj", "movej", "movel"), ((0,), 3)),
    **{f"move{way}{what}": ((0,), 3) for way in "jl" for what in ("do", "ao", "go", "sync")},
    **{f"trigg{way}": ((0,), 4) for way in "jl"},
    **{f"arcl{part}": ((0,), 5) for part in ("", "start", "end")},
    **{f"arcc{part}": ((0, 1), 6) for part in ("", "start", "end")},
    "movec": ((0, 1), 4),
    **{f"movec{what}": ((0, 1), 4) for what in ("do", "ao", "go", "sync")},
    "triggc": ((0, 1), 5),
}
_MOVE = re.compile(r"\b((?:Move|Trigg|Arc|Search|Spot|Disp|Paint|Cut|Nut|Calib)\w*)(?=[ \t\r\n\\])", _FLAGS)
_STARTS = re.compile(
    r"(?:^|[;\r\n]|\b(?:THEN|DO|ELSE|FROM)\b|:)[ \t]*$", _FLAGS
)  # what may stand before an instruction


@dataclass(frozen=True)
class _Use:
    source: int
    offset: int
    move: str
    tool: Place
    frame: Place
    via: bool = False
    previous: object = None
    ends_at: object = None

    def ends(self) -> tuple[int, int] | None:
        return (id(self.previous), id(self.ends_at)) if self.via else None


@dataclass
class _Value:
    """A literal, declared or in a move."""

    source: int
    type: str
    name: str  # "" in a move
    start: int
    end: int
    declared: int  # offset of the name
    array: bool = False
    uses: list[_Use] = field(default_factory=list)


class _Rapid:
    def __init__(self, reading: Reading, given: Given) -> None:
        self.reading = reading
        self.given = given
        self.code = [blanked(source.text, _NO_CODE) for source in reading.sources]
        self.names: list[dict[str, _Value]] = [{} for _ in reading.sources]
        self.assigned: dict[tuple[int, str], int] = {}
        self.inline: list[_Value] = []
        self.mentions: set[tuple[int, int]] = set()
        self.previous: object = None

    # ---- Declarations ----

    def declarations(self) -> None:
        for source, code in enumerate(self.code):
            for match in _DECLARED.finditer(code):
                start = match.end()
                end = closing(code, start) if code.startswith("[", start) else None
                literal = end is not None and re.compile(r"\s*;").match(code, end + 1)
                stop = end + 1 if literal and end is not None else start
                name = match[2].lower()
                value = _Value(
                    source, match[1].lower(), match[2], start, stop, match.start(2), bool(match[3])
                )
                if name in self.names[source]:  # in two routines: which one a move means is not told apart
                    self.assigned[source, name] = match.start(2)
                else:
                    self.names[source][name] = value
        for source, code in enumerate(self.code):
            for match in re.finditer(
                r"(?<![\\\w.])([a-z]\w*)(?:\s*\.\s*\w+|\s*\{[^}]*\})*\s*:=", code, _FLAGS
            ):
                known = self._known(match[1], source)
                if isinstance(known, _Value) and (known.source, known.declared) != (source, match.start(1)):
                    self.assigned.setdefault((known.source, known.name.lower()), match.start(1))

    def _known(self, name: str, source: int) -> _Value | str:
        """A declared value: in the same module, or the only one in the others."""
        own = self.names[source].get(name.lower())
        if own is not None:
            return own
        others = [names[name.lower()] for names in self.names if name.lower() in names]
        if len(others) == 1:
            return others[0]
        return f"{name} is declared in more than one of the files given" if others else ""

    # ---- Tools and work objects ----

    def tool(self, text: str, source: int) -> Place:
        return self._place(text, source, "tool0", "tooldata")

    def frame(self, text: str, source: int) -> Place:
        return self._place(text or "wobj0", source, "wobj0", "wobjdata")

    def _place(self, text: str, source: int, usual: str, type_: str) -> Place:
        word = "".join(text.split())
        if word.lower() == usual:
            return NOWHERE
        given = self.given.tools if type_ == "tooldata" else self.given.frames
        if not re.fullmatch(r"\w+", word, re.ASCII):
            return Place(None, text, f"{type_} {text[:40]!r} is no name of a constant")
        if word.lower() in given:
            return Place(given[word.lower()], word)
        value = self._known(word, source)
        if isinstance(value, _Value) and value.type == type_:
            line = self.assigned.get((value.source, value.name.lower()))
            if line is not None:
                where = self.reading.sources[value.source].line(line)
                return Place(None, word, f"{type_} {word} is assigned in line {where}")
            return self._literal_place(value)
        if value and isinstance(value, str):
            return Place(None, word, value)
        return self.given.tool(word) if type_ == "tooldata" else self.given.frame(word)

    def _literal_place(self, value: _Value) -> Place:
        code, text = self.code[value.source], self.reading.sources[value.source].text
        parts = self._parts(value)
        unread = Place(None, value.name, f"{value.type} {value.name} is no literal")
        if not parts or value.array:
            return unread
        held = code[slice(*trimmed(code, *parts[0]))].lower()
        if value.type == "tooldata":
            T = self._pose(code, parts[1]) if len(parts) == 3 else None
            if held != "true" and T is not None:
                return Place(
                    None, value.name, f"the tool {value.name} stands still, the robot holds the workpiece"
                )
            return unread if T is None else Place(T, value.name)
        if len(parts) != 5:
            return unread
        user, work = self._pose(code, parts[3]), self._pose(code, parts[4])
        if user is None or work is None:
            return unread
        if held != "false":
            return Place(None, value.name, f"the robot holds the work object {value.name}")
        unit = text[slice(*trimmed(text, *parts[2]))]
        if code[slice(*trimmed(code, *parts[1]))].lower() != "true" or unit not in ('""', ""):
            return Place(
                None, value.name, f"the work object {value.name} is moved by a mechanical unit {unit}"
            )
        return Place(user @ work, value.name)

    def _parts(self, value: _Value) -> list[tuple[int, int]]:
        return (
            pieces(self.code[value.source], value.start + 1, value.end - 1) if value.end > value.start else []
        )

    def _pose(self, code: str, piece: tuple[int, int]) -> Floats | None:
        numbers = _pose_numbers(code, piece)
        if numbers is None:
            return None
        try:
            return frame_from_numbers("abb", [number.value for number in numbers])
        except InputError:
            return None

    # ---- Moves ----

    def moves(self, source: int) -> None:
        code = self.code[source]
        displaced = re.search(r"\b(PDispOn|PDispSet|EOffsOn|EOffsSet)\b", code, _FLAGS)
        starts = [match for match in _MOVE.finditer(code) if self._begins(code, match.start())]
        for match, after in itertools.zip_longest(starts, starts[1:]):
            end = code.find(";", match.end())
            beyond = after is not None and after[1].lower() in _MOVES and after.start() < end
            if (end < 0 or beyond) and match[1].lower() in _MOVES:
                said = self.reading.sources[source]
                stop = after.start() if after is not None else len(code)
                raise InputError(
                    f"{said.path}, line {said.line(match.start())}: {said.shown(match.start(), stop)}:"
                    " no ; follows, expected one after the move: write the program anew if it was cut off"
                )
            if end < 0 or ":=" in code[match.end() : match.end() + 3]:
                continue
            if re.match(r"\s*[:(]", code[match.end() : end]):
                continue
            self._move(source, match, end, displaced)

    @staticmethod
    def _begins(code: str, start: int) -> bool:
        """Whether an instruction may stand here."""
        line_start = max(code.rfind("\n", 0, start), code.rfind("\r", 0, start), 0)
        before = code[max(line_start, code.rfind(";", 0, start)) : start]
        return _STARTS.search(before or "\n") is not None

    def _move(self, source: int, match: re.Match[str], end: int, displaced: re.Match[str] | None) -> None:
        code, word = self.code[source], match[1]
        known = _MOVES.get(word.lower())
        shown = self.reading.sources[source].shown(match.start(), end)
        if known is None:
            if not word.lower().startswith("moveext"):
                self.reading.stay(source, match.start(), shown, f"the instruction {word} is not understood")
                self.previous = None
            return
        if not is_closed(code, match.start(), end):
            raise unclosed(self.reading.sources[source], match.start(), end)
        places, tool_at = known
        arguments, work = self._arguments(source, match.end(), end)
        if displaced and word.lower() != "moveabsj":
            where = self.reading.sources[source].line(displaced.start())
            self.reading.stay(
                source, match.start(), shown, f"{displaced[1]} in line {where} displaces targets"
            )
            return
        tool_text = code[slice(*arguments[tool_at])] if len(arguments) > tool_at else ""
        tool = self.tool(tool_text, source) if tool_text else Place(None, "", "the move names no tool")
        frame = self.frame(work, source)
        found = [
            self._argument(source, *arguments[k], joints=word.lower() == "moveabsj")
            for k in places
            if k < len(arguments)
        ]
        for k, what in enumerate(found):
            via = len(places) == 2 and k == 0
            use = _Use(
                source, match.start(), word, tool, frame, via, self.previous, found[-1] if via else None
            )
            if isinstance(what, str):
                self.reading.stay(source, match.start(), shown, what)
            else:
                what.uses.append(use)
        self.previous = found[-1] if found else None

    def _arguments(self, source: int, start: int, end: int) -> tuple[list[tuple[int, int]], str]:
        """Arguments without their switches, and the work object."""
        code, found, work = self.code[source], [], ""
        for a, b in pieces(code, start, end):
            parts = pieces(code, a, b, "\\")
            a, b = trimmed(code, *parts[0])
            if a < b:
                found.append((a, b))
            for switch in parts[1:]:
                named = re.compile(r"\s*WObj\s*:=(.*)", _FLAGS | re.DOTALL).fullmatch(code, *switch)
                work = named[1].strip() if named else work
        return found, work

    def _argument(self, source: int, start: int, end: int, *, joints: bool) -> _Value | str:
        code = self.code[source]
        text = code[start:end]
        type_ = "jointtarget" if joints else "robtarget"
        if text.startswith("["):
            if closing(code, start) != end - 1:
                return "the target is computed"
            value = _Value(source, type_, "", start, end, start)
            self.inline.append(value)
            return value
        if not re.fullmatch(r"\w+", text, re.ASCII):
            called = re.match(r"(\w+)\s*\(", text, re.ASCII)
            return f"the target is computed by {called[1]}" if called else "the target is no constant"
        self.mentions.add((source, start))
        found = self._known(text, source)
        if isinstance(found, str):
            return found or f"{text} is not declared in the files given"
        return found if found.type == type_ else f"{text} is a {found.type}, not a {type_}"

    # ---- Targets ----

    def targets(self) -> None:
        values = [*self.inline, *(value for names in self.names for value in names.values())]
        found: list[Found] = []
        for value in values:
            if value.type in ("robtarget", "jointtarget"):
                target = self._target(value)
                if target is not None:
                    found.append(Found(id(value), target, value.uses[0].ends()))
        self.reading.take(found)

    def _target(self, value: _Value) -> Target | None:
        source = self.reading.sources[value.source]
        shown = value.name or source.shown(value.start, value.end)
        why = self._why_not(value)
        numbers = None if why else self._numbers(value)
        if numbers is None:
            self.reading.stay(value.source, value.declared, shown, why or "is no literal")
            return None
        why = self._why_not_here(value, numbers)
        if why:
            self.reading.stay(value.source, value.declared, shown, why)
            return None
        if value.name:
            self._other_mentions(value)
        pose = value.type == "robtarget"
        first = value.uses[0]
        return Target(
            source=value.source,
            line=source.line(value.declared),
            name=shown,
            move=first.move,
            kind="pose" if pose else "joints",
            numbers=numbers.target,
            order=(first.source, first.offset),
            moves=tuple((use.source, use.offset) for use in value.uses),
            tool=first.tool if pose else first.tool.or_flange(),
            frame=first.frame if pose else NOWHERE,
            configuration=_configuration(numbers.configuration) if pose else None,
            notes=("external axes untouched",) if numbers.active else (),
        )

    def _why_not(self, value: _Value) -> str:
        key = (value.source, value.name.lower())
        if value.name and key in self.assigned:
            line = self.reading.sources[value.source].line(self.assigned[key])
            return f"is declared or assigned again in line {line}, no constant"
        if value.array:
            return "is an array"
        if not value.uses:
            return "no move in the files given uses it, so that its tool and work object are not known"
        if any(use.via != value.uses[0].via for use in value.uses):
            return "is a point on an arc and the end of another move"
        return "is no literal" if value.end == value.start else ""

    def _why_not_here(self, value: _Value, numbers: _Numbers) -> str:
        if value.type == "jointtarget":
            return ""
        if any(number.value != 0 for number in numbers.active):
            return "an external axis is not at 0 and may move robot or workpiece"
        why = why_not_one([use.tool for use in value.uses], "tool")
        return why or why_not_one([use.frame for use in value.uses], "work object")

    def _numbers(self, value: _Value) -> _Numbers | None:
        code, parts = self.code[value.source], self._parts(value)
        if value.type == "jointtarget":
            if len(parts) != 2:
                return None
            joints, outside = _bracketed(code, parts[0], 6), _bracketed(code, parts[1], 6)
            return None if joints is None or outside is None else _Numbers(joints, (), _active(outside))
        if len(parts) != 4:
            return None
        place, turn = _bracketed(code, parts[0], 3), _bracketed(code, parts[1], 4)
        configuration, outside = _bracketed(code, parts[2], 4), _bracketed(code, parts[3], 6)
        if place is None or turn is None or configuration is None or outside is None:
            return None
        return _Numbers((*place, *turn), configuration, _active(outside))

    def _other_mentions(self, value: _Value) -> None:
        """Where the program computes with a target that is changed."""
        pattern = re.compile(rf"(?<![\w.\\]){re.escape(value.name)}(?!\w)", _FLAGS)
        for source, code in enumerate(self.code):
            for match in pattern.finditer(code):
                own = source == value.source and match.start() == value.declared
                if (
                    own
                    or (source, match.start()) in self.mentions
                    or self._known(value.name, source) is not value
                ):
                    continue
                start = code.rfind(";", 0, match.start()) + 1
                end = code.find(";", match.start())
                start, end = trimmed(code, start, len(code) if end < 0 else end)
                shown = self.reading.sources[source].shown(start, end)
                if not _MOVE.match(code, start):  # else the move is told itself
                    self.reading.stay(
                        source, match.start(), shown, f"computes with {value.name}, which is changed"
                    )


@dataclass(frozen=True)
class _Numbers:
    """Tokens of a literal."""

    target: tuple[Number, ...]
    configuration: tuple[Number, ...]
    active: tuple[Number, ...]  # external axes that are there


def _bracketed(code: str, piece: tuple[int, int], count: int) -> tuple[Number, ...] | None:
    start, end = trimmed(code, *piece)
    if not code.startswith("[", start) or closing(code, start) != end - 1:
        return None
    return numbers_of(code, start + 1, end - 1, count)


def _pose_numbers(code: str, piece: tuple[int, int]) -> tuple[Number, ...] | None:
    start, end = trimmed(code, *piece)
    if not code.startswith("[", start) or closing(code, start) != end - 1:
        return None
    parts = pieces(code, start + 1, end - 1)
    if len(parts) != 2:
        return None
    place, turn = _bracketed(code, parts[0], 3), _bracketed(code, parts[1], 4)
    return None if place is None or turn is None else (*place, *turn)


def _active(outside: Sequence[Number]) -> tuple[Number, ...]:
    return tuple(number for number in outside if abs(number.value) < _NO_TARGET)


def _configuration(numbers: Sequence[Number]) -> Configuration:
    values = tuple(int(number.value) if number.value == int(number.value) else None for number in numbers)
    text = f"[{', '.join(number.text for number in numbers)}]"
    return Configuration("abb", values, text, dict(enumerate(numbers[:3])))


def read(sources: Sequence[Source], given: Given) -> Reading:
    """Targets of modules, which may use each other's data."""
    for source in sources:
        code = blanked(source.text, _NO_CODE)
        if not re.search(r"\bMODULE\b", code, _FLAGS):
            raise InputError(f"{source.path}: has no MODULE, expected a RAPID module")
        together = re.search(r"\b(SyncMoveOn)\b", code, _FLAGS)
        if together:
            raise InputError(
                f"{source.path}, line {source.line(together.start())}: SyncMoveOn: robots that move"
                " together; one"
                " robot's program is expected"
            )
    reading = Reading("abb", list(sources))
    rapid = _Rapid(reading, given)
    rapid.declarations()
    for k, source in enumerate(sources):
        rapid.moves(k)
        require_end(source, rapid.code[k], "ENDMODULE", r"\bENDMODULE\b")
    rapid.targets()
    return reading
