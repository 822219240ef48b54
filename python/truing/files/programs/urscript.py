# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Universal Robots' URScript: .script.

Targets are poses p[x, y, z, rx, ry, rz] and joints [6 angles] in movej, movel, movep and movec, in them or
in a variable that is assigned once. The tool is set_tcp(p[...]); poses are in the robot base ("The URScript
Programming Language").
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from truing.errors import InputError
from truing.files.brand_frames import frame_from_numbers
from truing.files.programs.flow import Effects, Flow, Places, in_passes, the_only
from truing.files.programs.model import NOWHERE, Found, Given, Place, Reading, Target, why_not_one
from truing.files.programs.text import Number, Source, blanked, closing, numbers_of, pieces, trimmed, unclosed

_FLAGS = re.ASCII
_NO_CODE = re.compile(r'"[^"\r\n]*"?|#[^\r\n]*|^[ \t]*\$[^\r\n]*', re.MULTILINE)
_ASSIGNED = re.compile(
    r"^[ \t]*(?:(?:global|local)[ \t]+)?([A-Za-z_]\w*)[ \t]*(\[[^\]\r\n]*\])?[ \t]*=(?!=)[ \t]*",
    _FLAGS | re.M,
)
_EVENT = re.compile(
    r"(?<![\w.])(?:(?P<move>movej|movel|movep|movec|servoj|servoc|servol|speedj|speedl|set_tcp)[ \t]*(?=\()"
    r"|(?:def|thread|sec)[ \t]+(?P<opens>\w+)(?=[ \t]*\()|(?P<block>(?:if|switch|case)\b)"
    r"|(?P<loop>while\b)|(?P<other>elif\b)|(?P<last>else\b)|(?P<end>end)\b"
    r"|(?P<call>[A-Za-z_]\w*)[ \t]*(?=\())",
    _FLAGS,
)
_MOVES = {"movej": 1, "movel": 1, "movep": 1, "movec": 2}


@dataclass
class _Value:
    """A literal, in a move or assigned to a name."""

    name: str  # "" in a move
    pose: bool
    start: int
    end: int
    numbers: tuple[Number, ...]
    uses: list[_Use] = field(default_factory=list)


@dataclass(frozen=True)
class _Use:
    offset: int
    move: str
    tool: Place
    seed: tuple[float, ...] | None = None
    via: bool = False
    previous: object = None
    ends_at: object = None

    def ends(self) -> tuple[int, int] | None:
        return (id(self.previous), id(self.ends_at)) if self.via else None


def _literal(code: str, start: int, end: int) -> tuple[bool, tuple[Number, ...]] | None:
    """p[6 numbers] or [6 numbers]: whether it is a pose, and its tokens."""
    start, end = trimmed(code, start, end)
    pose = code.startswith("p[", start)
    bracket = start + pose
    if not code.startswith("[", bracket) or closing(code, bracket) != end - 1:
        return None
    numbers = numbers_of(code, bracket + 1, end - 1, 6)
    return None if numbers is None else (pose, numbers)


class _Script:
    def __init__(self, reading: Reading, given: Given) -> None:
        self.reading, self.given = reading, given
        self.code = blanked(reading.sources[0].text, _NO_CODE)
        self.names: dict[str, _Value] = {}
        self.assigned: dict[str, list[int]] = {}
        self.inline: list[_Value] = []
        self.mentions: set[int] = set()
        self.places: set[str] = set()  # names that are a tool
        self.previous: object = None

    def assignments(self) -> None:
        code = self.code
        for match in _ASSIGNED.finditer(code):
            self.assigned.setdefault(match[1], []).append(match.start(1))
            bracket = match.end() + code.startswith("p[", match.end())
            end = closing(code, bracket) if code.startswith("[", bracket) else None
            if end is None or match[2] or code[end + 1 : _end_of_line(code, end)].strip():
                continue
            literal = _literal(code, match.end(), end + 1)
            if literal is not None:
                self.names[match[1]] = _Value(match[1], literal[0], match.end(), end + 1, literal[1])

    def _constant(self, name: str) -> _Value | str:
        value, places = self.names.get(name), self.assigned.get(name, [])
        if value is None or len(places) != 1:
            lines = [str(self.reading.sources[0].line(place)) for place in places]
            where = f" (assigned in line {', '.join(lines[:3])})" if lines else ""
            return f"{name} is a variable{where}"
        return value

    # ---- Tools ----

    def _tcp(self, start: int, end: int) -> Place:
        """The argument of set_tcp."""
        parts = pieces(self.code, start, end)
        start, end = trimmed(self.code, *parts[0])
        text = self.code[start:end]
        named = self._constant(text) if re.fullmatch(r"[A-Za-z_]\w*", text, _FLAGS) else None
        literal = _literal(self.code, start, end)
        if isinstance(named, _Value):
            self.mentions.add(start)
            self.places.add(named.name)
            literal = (named.pose, named.numbers)
        if literal is not None and literal[0]:
            return Place(frame_from_numbers("ur", [number.value for number in literal[1]]), text[:40])
        line = self.reading.sources[0].line(start)
        known = self.given.tools.get("")
        return (
            Place(known, text)
            if known is not None
            else Place(None, text, f"set_tcp in line {line} is no literal")
        )

    def _tools_set(self) -> list[Place]:
        found = []
        for match in re.finditer(r"(?<![\w.])set_tcp[ \t]*(?=\()", self.code, _FLAGS):
            end = closing(self.code, match.end())
            if end is not None:
                found.append(self._tcp(match.end() + 1, end))
        return found

    # ---- Instructions ----

    def instructions(self) -> None:
        unset = Places(self.given.tool(""), NOWHERE)
        always = Places(the_only(self._tools_set(), unset.tool, "tool"), NOWHERE)

        def read(before: Effects, *, moves: bool = False) -> Effects:
            flow, kinds = Flow(unset, always, before), list[str]()
            for match in _EVENT.finditer(self.code):
                self._event(match, flow, kinds, moves=moves)
            if kinds:
                path = self.reading.sources[0].path
                raise InputError(
                    f"{path}: a {kinds[-1]} has no end: write the program anew if it was cut off"
                )
            return flow.found

        read(in_passes(read), moves=True)

    def _event(self, match: re.Match[str], flow: Flow, kinds: list[str], *, moves: bool) -> None:
        """kinds: of the routines and blocks around. moves: take the targets; else only follow the tool."""
        if match["move"]:
            end = closing(self.code, match.end())
            if end is None:
                stop = _end_of_line(self.code, match.start())
                raise unclosed(self.reading.sources[0], match.start(), stop)
            if moves or match["move"] == "set_tcp":
                self._call(match, end, flow)
        elif match["opens"]:
            kinds.append("routine")
            flow.begin_routine(match["opens"])
            self.previous = None
        elif match["block"] or match["loop"]:
            kinds.append("block")
            line = self.reading.sources[0].line(match.start())
            flow.open(line, loops=match["loop"] is not None)
        elif match["other"] or match["last"]:
            flow.otherwise(last=match["last"] is not None)
        elif match["call"]:
            flow.call(match["call"])
        elif kinds:
            (flow.end_routine if kinds.pop() == "routine" else flow.close)()

    def _call(self, match: re.Match[str], end: int, flow: Flow) -> None:
        word, start = match["move"], match.end() + 1
        shown = self.reading.sources[0].shown(match.start(), end + 1)
        if word == "set_tcp":
            flow.set_tool(self._tcp(start, end))
        elif word not in _MOVES:
            self.reading.stay(
                0, match.start(), shown, f"{word}: a stream of set-points or a speed, no target"
            )
            self.previous = None
        else:
            parts = pieces(self.code, start, end)[: _MOVES[word]]
            found = [self._argument(*part, many=word) for part in parts]
            values = [value for value, _ in found]
            for k, (value, seed) in enumerate(found):
                via = word == "movec" and k == 0
                use = _Use(
                    match.start(), word, flow.now.tool, seed, via, self.previous, values[-1] if via else None
                )
                if isinstance(value, str):
                    self.reading.stay(0, match.start(), shown, value)
                else:
                    value.uses.append(use)
            self.previous = values[-1] if values else None

    def _argument(self, start: int, end: int, *, many: str) -> tuple[_Value | str, tuple[float, ...] | None]:
        """What a move goes to, or why it is not known; joints near which the solution is meant."""
        start, end = trimmed(self.code, start, end)
        keyed = re.compile(r"(?:pose|q|pose_to|pose_via)[ \t]*=(?!=)", _FLAGS).match(self.code, start, end)
        if keyed:
            start, end = trimmed(self.code, keyed.end(), end)
        text = self.code[start:end]
        literal = _literal(self.code, start, end)
        if literal is not None:
            value = _Value("", literal[0], start, end, literal[1])
            self.inline.append(value)
            return value, None
        if re.fullmatch(r"[A-Za-z_]\w*", text, _FLAGS):
            self.mentions.add(start)
            return self._constant(text), None
        solved = re.match(r"get_inverse_kin[ \t]*(?=\()", text, _FLAGS)
        if solved and closing(self.code, start + solved.end()) == end - 1:
            return self._solved(start + solved.end() + 1, end - 1, many)
        called = re.match(r"([A-Za-z_]\w*)[ \t]*\(", text, _FLAGS)
        return (f"the target is computed by {called[1]}" if called else "the target is computed"), None

    def _solved(self, start: int, end: int, many: str) -> tuple[_Value | str, tuple[float, ...] | None]:
        """get_inverse_kin(pose, qnear=[...]): how PolyScope writes a joint move to a waypoint."""
        parts = pieces(self.code, start, end)
        value, _ = self._argument(*parts[0], many=many)
        if isinstance(value, _Value) and not value.pose:
            return "get_inverse_kin of joints", None
        if len(parts) == 1:
            return value, None
        near = re.compile(r"\s*(?:qnear[ \t]*=)?", _FLAGS).match(self.code, *parts[1])
        begin, stop = trimmed(self.code, near.end() if near else parts[1][0], parts[1][1])
        literal = _literal(self.code, begin, stop)
        if literal is None:
            named = self._constant(self.code[begin:stop])
            self.mentions.add(begin)
            literal = (named.pose, named.numbers) if isinstance(named, _Value) else None
        if literal is None or literal[0] or len(parts) > 2:
            return "get_inverse_kin has arguments that are no literals", None
        return value, tuple(number.value for number in literal[1])

    # ---- Targets ----

    def targets(self) -> None:
        found: list[Found] = []
        for value in [*self.inline, *self.names.values()]:
            target = self._target(value)
            if target is not None:
                found.append(Found(id(value), target, value.uses[0].ends()))
        self.reading.take(found)

    def _target(self, value: _Value) -> Target | None:
        if not value.uses:
            return None  # a variable that no move goes to
        source = self.reading.sources[0]
        first = value.uses[0]
        shown = value.name or source.shown(value.start, value.end)
        why = self._why_not(value)
        if why:
            self.reading.stay(0, value.start, shown, why)
            return None
        if value.name:
            self._other_mentions(value)
        return Target(
            source=0,
            line=source.line(value.start),
            name=shown,
            move=first.move,
            kind="pose" if value.pose else "joints",
            numbers=value.numbers,
            order=(0, first.offset),
            moves=tuple((0, use.offset) for use in value.uses),
            tool=first.tool if value.pose else first.tool.or_flange(),
            seed=first.seed,
        )

    def _why_not(self, value: _Value) -> str:
        if any(use.via != value.uses[0].via for use in value.uses):
            return "is a point on an arc and the end of another move"
        if value.name in self.places:
            return "is a tool as well as a target"
        if not value.pose:
            return ""
        return why_not_one([use.tool for use in value.uses], "tool")

    def _other_mentions(self, value: _Value) -> None:
        """Where the program computes with a target that is changed."""
        declared = self.assigned[value.name][0]
        for match in re.finditer(rf"(?<![\w.]){re.escape(value.name)}(?!\w)", self.code, _FLAGS):
            if match.start() in self.mentions or match.start() == declared:
                continue
            start = max(self.code.rfind("\n", 0, match.start()), self.code.rfind("\r", 0, match.start())) + 1
            shown = self.reading.sources[0].shown(start, _end_of_line(self.code, match.start()))
            self.reading.stay(0, match.start(), shown, f"computes with {value.name}, which is changed")


def _end_of_line(text: str, offset: int) -> int:
    found = re.compile(r"[\r\n]").search(text, offset)
    return found.start() if found else len(text)


def read(sources: Sequence[Source], given: Given) -> Reading:
    """Targets of one script."""
    source = sources[0]
    code = blanked(source.text, _NO_CODE)
    if not re.search(
        r"(?<![\w.])(?:def[ \t]+\w+|sec[ \t]+\w+|(?:move[jlpc]|servo\w+|speed[jl])[ \t]*)\(", code, _FLAGS
    ):
        raise InputError(f"{source.path}: has neither a def nor a move, expected a URScript program")
    reading = Reading("ur", list(sources))
    script = _Script(reading, given)
    script.assignments()
    script.instructions()
    script.targets()
    return reading
