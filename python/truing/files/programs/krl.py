# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""KUKA KRL: a .src with the .dat beside it.

Targets are aggregates {X .., Y .., Z .., A .., B .., C ..} and {A1 .., ... A6 ..}, in a move or declared in
the .dat. Tool and base are $TOOL and $BASE, BAS(#TOOL, n), FDAT, or STOOL2(FP1) of a spline move. The
language is described in KUKA's "Expert Programming" manuals.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from truing.errors import InputError
from truing.files.brand_frames import frame_from_numbers
from truing.files.programs.flow import Effects, Flow, Places, in_passes, the_only
from truing.files.programs.model import (
    NOWHERE,
    Configuration,
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
    number_at,
    pieces,
    require_end,
    trimmed,
    unclosed,
)

_FRAME = ("X", "Y", "Z", "A", "B", "C")
_AXES = ("A1", "A2", "A3", "A4", "A5", "A6")
_EXTERNAL = ("E1", "E2", "E3", "E4", "E5", "E6")
_FLAGS = re.ASCII | re.IGNORECASE
_NO_CODE = re.compile(r'"[^"\r\n]*"?|;[^\r\n]*|^[ \t]*&[^\r\n]*', re.MULTILINE)
_DECLARED = re.compile(
    r"^[ \t]*(?:GLOBAL[ \t]+)?(?:DECL[ \t]+)?(?:GLOBAL[ \t]+)?(?:CONST[ \t]+)?"
    r"(E6POS|POS|FRAME|E6AXIS|AXIS|FDAT)[ \t]+(\$?\w+(?:\[\d*\])?)[ \t]*=[ \t]*(?=\{)",
    _FLAGS | re.MULTILINE,
)
_ELEMENT = re.compile(
    r"^[ \t]*((?:TOOL|BASE)_DATA\[[ \t]*\d+[ \t]*\])[ \t]*((?:\.[ \t]*\w+[ \t]*)?)=(?!=)[ \t]*",
    _FLAGS | re.MULTILINE,
)
_STATEMENT = re.compile(r"[^\r\n]+")
_MOVE = re.compile(r"(S?PTP|S?LIN|S?CIRC|SPL|ASYPTP|SPLINE)(_REL)?(?![\w$=])[ \t]*", _FLAGS)
_PART_SET = re.compile(r"\$(TOOL|BASE)[ \t]*\.[ \t]*\w+[ \t]*=(?!=)", _FLAGS)
_SET = re.compile(r"\$(TOOL|BASE)[ \t]*=(?!=)[ \t]*(.*?)[ \t]*$", _FLAGS)
_BAS = re.compile(r"BAS[ \t]*\([ \t]*#(TOOL|BASE)[ \t]*,[ \t]*(.*?)[ \t]*\)[ \t]*$", _FLAGS)
_FDAT = re.compile(r"FDAT_ACT[ \t]*=(?!=)[ \t]*", _FLAGS)
_WITH = re.compile(r"\$(TOOL|BASE)[ \t]*=[ \t]*(STOOL2?|SBASE)?[ \t]*", _FLAGS)
_ASSIGNED = re.compile(r"^[ \t]*([A-Za-z_]\w*)(?:\.\w+|\[[^\]\r\n]*\])*[ \t]*=(?!=)", _FLAGS | re.MULTILINE)
_OPENS = re.compile(r"(?:IF|SWITCH|(WHILE|FOR|LOOP|REPEAT))(?!\w)", _FLAGS)
_BRANCHES = re.compile(r"(?:(ELSE|DEFAULT)|CASE)(?!\w)", _FLAGS)
_CLOSES = re.compile(r"(ENDIF|ENDSWITCH|ENDWHILE|ENDFOR|ENDLOOP|UNTIL)(?!\w)", _FLAGS)
_ROUTINE = re.compile(r"(?:GLOBAL[ \t]+)?DEF(FCT)?(?!\w)", _FLAGS)
_ROUTINE_ENDS = re.compile(r"END(FCT)?[ \t]*$", _FLAGS)
_CALL = re.compile(r"([A-Za-z_]\w*)[ \t]*(?=\()", _FLAGS)
_LABEL = re.compile(r"[A-Za-z_]\w*[ \t]*:", _FLAGS)


@dataclass(frozen=True)
class _Aggregate:
    """{...}: its components by name; None where one is no number."""

    start: int
    end: int
    values: dict[str, Number | None]
    words: dict[str, str]  # as they are written

    def has(self, names: Sequence[str]) -> bool:
        return all(self.values.get(name) is not None for name in names)

    def all_of(self, names: Sequence[str]) -> tuple[Number, ...]:
        return tuple(number for name in names if (number := self.values.get(name)) is not None)

    def integer(self, name: str) -> int | None:
        """35, or 'B100011', 'H23' as KRL has binary and hexadecimal numbers."""
        number = self.values.get(name)
        if number is not None:
            return int(number.value) if number.value == int(number.value) else None
        coded = re.fullmatch(
            r"'(?:B([01]+)|H([0-9A-F]+))'", "".join(self.words.get(name, "").upper().split())
        )
        return None if coded is None else int(coded[1], 2) if coded[1] else int(coded[2], 16)


@dataclass
class _Name:
    """A declared name, and the moves that use it."""

    source: int
    name: str
    type: str
    what: _Aggregate
    uses: list[_Use] = field(default_factory=list)


@dataclass(frozen=True)
class _Use:
    """A target in a move."""

    source: int
    offset: int
    move: str
    places: Places
    via: bool = False
    previous: object = None  # what the move starts at: a _Name, an _Aggregate, or None
    ends_at: object = None  # of a point on an arc: what the arc ends at

    def ends(self) -> tuple[int, int] | None:
        return (id(self.previous), id(self.ends_at)) if self.via else None


def aggregate_at(text: str, start: int) -> _Aggregate | None:
    """The aggregate that begins with the brace at `start`."""
    end = closing(text, start)
    if end is None or re.search(r"[\r\n]", text[start:end]):
        return None
    begin = start + 1
    typed = re.compile(r"[ \t]*\w+[ \t]*:", re.ASCII).match(text, begin)  # {FRAME: X ..}
    if typed:
        begin = typed.end()
    values: dict[str, Number | None] = {}
    words: dict[str, str] = {}
    for piece in pieces(text, begin, end):
        named = re.compile(r"[ \t]*([A-Za-z_]\w*)(?:\[\])?(?=[ \t])", re.ASCII).match(
            text, piece[0], piece[1]
        )
        if not named or named[1].upper() in values:
            return None
        values[named[1].upper()] = number_at(text, named.end(), piece[1])
        words[named[1].upper()] = text[named.end() : piece[1]].strip()
    return _Aggregate(start, end + 1, values, words)


class _Krl:
    """One .src and .dat, with other .dat files for what they declare."""

    def __init__(self, reading: Reading, given: Given) -> None:
        self.reading = reading
        self.given = given
        self.code = [blanked(source.text, _NO_CODE) for source in reading.sources]
        self.names: dict[str, _Name] = {}
        self.elements: dict[str, Place] = {}  # TOOL_DATA[1]
        self.elsewhere: dict[str, None] = {}  # routines that are called and not in the files given
        self.assigned: dict[str, str] = {}  # name: where it is assigned first
        self.inline: list[tuple[_Aggregate, _Use]] = []
        self.mentions: set[tuple[int, int]] = set()  # offsets of names that moves use
        self.places: set[str] = set()  # names that are a tool or a base
        self.previous: object = None

    # ---- Declarations ----

    def declarations(self) -> None:
        for source, code in enumerate(self.code):
            for match in _DECLARED.finditer(code):
                found = aggregate_at(code, match.end())
                name = match[2].upper()
                if found is None:
                    continue
                if source in self.reading.others and match[1].upper() not in ("FRAME", "FDAT"):
                    continue  # its targets belong to whoever has that file
                if name in self.names:
                    self.assigned.setdefault(name, self._at(source, match.start()))
                    continue
                self.names[name] = _Name(source, match[2], match[1].upper(), found)
            for match in _ELEMENT.finditer(code):
                whole = code.startswith("{", match.end()) and not match[2]
                found = aggregate_at(code, match.end()) if whole else None
                self._element("".join(match[1].upper().split()), found, self._at(source, match.start()))
            for match in _ASSIGNED.finditer(code):
                self.assigned.setdefault(match[1].upper(), self._at(source, match.start(1)))

    def _element(self, name: str, found: _Aggregate | None, where: str) -> None:
        """TOOL_DATA[1] = {...}; found: None where it is no literal."""
        place = None if found is None or not found.has(_FRAME) else self._literal(found, name)
        place = place or Place(None, name, f"{name} is set to what is no literal in {where}")
        before = self.elements.setdefault(name, place)
        if before is not place and not before.is_like(place):
            self.elements[name] = Place(None, name, f"{name} is set to something else in {where}")

    def _at(self, source: int, offset: int) -> str:
        found = self.reading.sources[source]
        return f"line {found.line(offset)} of {found.path.name}"

    # ---- Tools and frames ----

    def _numbered(self, kind: str, number: int) -> Place:
        """TOOL_DATA[1]: from a .dat that is given, or an option; 0 is none."""
        if number == 0:
            return NOWHERE
        found = self.elements.get(f"{kind}_DATA[{number}]")
        given = self.given.tool(str(number)) if kind == "TOOL" else self.given.frame(str(number))
        return given if found is None or (found.T is None and given.T is not None) else found

    def _literal(self, found: _Aggregate, name: str) -> Place:
        return Place(frame_from_numbers("kuka", [number.value for number in found.all_of(_FRAME)]), name)

    def place(self, kind: str, text: str, source: int, offset: int) -> Place:
        """What `$TOOL = …` sets."""
        line = self.reading.sources[source].line(offset)
        word = "".join(text.split()).upper()
        if word in ("$NULLFRAME", "$WORLD", "$ROBROOT"):
            return NOWHERE
        numbered = re.fullmatch(rf"{kind}_DATA\[(\d+)\]", word)
        if numbered:
            return self._numbered(kind, int(numbered[1]))
        if text.startswith("{"):
            found = aggregate_at(self.code[source], offset)
            if found is not None and found.has(_FRAME) and found.end - offset == len(text.rstrip()):
                return self._literal(found, f"line {line}")
        declared = self.names.get(word)
        if declared is not None and declared.type == "FRAME" and word not in self.assigned:
            self.places.add(word)
            if declared.what.has(_FRAME):
                return self._literal(declared.what, declared.name)
        given = self.given.tools if kind == "TOOL" else self.given.frames
        known = given.get(word.lower(), given.get(""))
        if known is not None:
            return Place(known, text)
        return Place(None, text, f"${kind} is set to {text[:40]} in line {line}, which is no literal frame")

    def _fdat(self, text: str, source: int, offset: int) -> Places | None:
        """FP1 or {TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE}."""
        found = aggregate_at(self.code[source], offset) if text.startswith("{") else None
        if found is None:
            declared = self.names.get(text.upper())
            if declared is None or declared.type != "FDAT":
                return None
            found = declared.what
            code = self.code[declared.source]
        else:
            code = self.code[source]
        tool, base = found.integer("TOOL_NO"), found.integer("BASE_NO")
        if re.search(r"#TCP", code[found.start : found.end], re.IGNORECASE):
            held = Place(None, text, "the robot holds the workpiece (IPO_FRAME #TCP)")
            return Places(held, held)
        if tool is None or base is None or tool < 0 or base < 0:
            return None
        return Places(self._numbered("TOOL", tool), self._numbered("BASE", base))

    # ---- Statements ----

    def statements(self, source: int) -> None:
        code = self.code[source]
        unset = Places(self.given.tool(""), self.given.frame(""))
        always = self._always(source, unset)

        def read(before: Effects, *, moves: bool = False) -> Effects:
            flow = Flow(unset, always, before)
            for match in _STATEMENT.finditer(code):
                start, end = trimmed(code, match.start(), match.end())
                if start < end and not _DECLARED.match(code, match.start()):
                    self._statement(source, start, end, flow, moves=moves)
            return flow.found

        read(in_passes(read), moves=True)

    def _always(self, source: int, unset: Places) -> Places:
        """What is set all over the file: routines that others call begin with it."""
        tools, frames = [], []
        for match in _STATEMENT.finditer(self.code[source]):
            start, end = trimmed(self.code[source], match.start(), match.end())
            flow = Flow(Places(NOWHERE, NOWHERE), Places(NOWHERE, NOWHERE))
            before = flow.now
            self._set_places(source, start, end, flow)
            if flow.now.tool is not before.tool:
                tools.append(flow.now.tool)
            if flow.now.frame is not before.frame:
                frames.append(flow.now.frame)
        return Places(the_only(tools, unset.tool, "tool"), the_only(frames, unset.frame, "frame"))

    def _statement(self, source: int, start: int, end: int, flow: Flow, *, moves: bool) -> None:
        """moves: take the targets; else only follow tool and base."""
        code = self.code[source]
        if _ROUTINE.match(code, start, end):
            named = re.search(r"(\w+)[ \t]*\(", code[start:end], re.ASCII)
            flow.begin_routine(named[1].upper() if named else "")
            self.previous = None
        elif _ROUTINE_ENDS.fullmatch(code, start, end):
            flow.end_routine()
        elif opens := _OPENS.match(code, start, end):
            flow.open(self.reading.sources[source].line(start), loops=opens[1] is not None)
        elif branches := _BRANCHES.match(code, start, end):
            flow.otherwise(last=branches[1] is not None)
        elif _CLOSES.match(code, start, end):
            flow.close()
        elif _LABEL.fullmatch(code, start, end):
            flow.label()
        elif not self._set_places(source, start, end, flow):
            move = _MOVE.match(code, start, end)
            if move is None:
                self._call(code, start, end, flow, moves=moves)
            elif moves and move[1].upper() != "SPLINE":
                self._move(source, move, start, end, flow.now)

    def _call(self, code: str, start: int, end: int, flow: Flow, *, moves: bool) -> None:
        call = _CALL.match(code, start, end)
        if call is None or closing(code, call.end()) != end - 1 or call[1].upper() == "BAS":
            return
        if not flow.call(call[1].upper()) and moves:
            self.elsewhere.setdefault(call[1].upper())

    def _set_places(self, source: int, start: int, end: int, flow: Flow) -> bool:
        code = self.code[source]
        if found := _SET.fullmatch(code, start, end):
            place = self.place(found[1].upper(), found[2], source, found.start(2))
            (flow.set_tool if found[1].upper() == "TOOL" else flow.set_frame)(place)
        elif found := _BAS.fullmatch(code, start, end):
            kind = found[1].upper()
            place = (
                self._numbered(kind, int(found[2]))
                if found[2].isdigit()
                else Place(None, found[2], f"BAS(#{kind}) has no literal number")
            )
            (flow.set_tool if kind == "TOOL" else flow.set_frame)(place)
        elif found := _FDAT.match(code, start, end):
            places = self._fdat(code[found.end() : end].strip(), source, found.end())
            unknown = Place(
                None, "", f"FDAT_ACT is set to what is not in the files given: {code[found.end() : end][:40]}"
            )
            flow.set_tool(places.tool if places else unknown)
            flow.set_frame(places.frame if places else unknown)
        elif found := _PART_SET.match(code, start, end):
            line = self.reading.sources[source].line(start)
            place = Place(None, "", f"a part of ${found[1].upper()} is set in line {line}")
            (flow.set_tool if found[1].upper() == "TOOL" else flow.set_frame)(place)
        else:
            return False
        return True

    def _with(self, source: int, start: int, end: int, places: Places) -> Places:
        """SPTP XP1 WITH $TOOL = STOOL2(FP1), $BASE = SBASE(FP1.BASE_NO): for this move alone."""
        code = self.code[source]
        for match in _WITH.finditer(code, start, end):
            kind, named = match[1].upper(), match[2]
            stop = next((b for a, b in pieces(code, match.end(), end)), end)
            text = code[match.end() : stop].strip()
            if named:
                fdat = re.match(r"\(\s*(\w+)", text, re.ASCII)
                found = self._fdat(fdat[1], source, match.end()) if fdat else None
                place = (found.tool if kind == "TOOL" else found.frame) if found else None
                place = place or Place(None, text, f"{named}{text[:40]} is not in the files given")
            else:
                place = self.place(kind, text, source, match.end())
            places = Places(place, places.frame) if kind == "TOOL" else Places(places.tool, place)
        return places

    def _move(self, source: int, move: re.Match[str], start: int, end: int, places: Places) -> None:
        code, word = self.code[source], move[1].upper()
        if move[2]:
            self.reading.stay(source, start, self._shown(source, start, end), "a relative move")
            self.previous = None
            return
        if not is_closed(code, start, end):
            raise unclosed(self.reading.sources[source], start, end)
        tail = re.compile(r"(?<![\w$])WITH(?!\w)", _FLAGS).search(code, move.end(), end)
        stop = tail.start() if tail else end
        if tail:
            places = self._with(source, tail.end(), end, places)
        arguments = [trimmed(code, *piece) for piece in pieces(code, move.end(), stop)]
        # What approximates (C_DIS, C_PTP) follows a target after a space.
        found = [self._argument(source, a, b) for a, b in arguments[: 2 if word.endswith("CIRC") else 1]]
        last = found[-1] if found else None
        for k, what in enumerate(found):
            via = word.endswith("CIRC") and k == 0
            use = _Use(source, start, word, places, via, self.previous, last if via else None)
            self._take(what, use, source, start, end)
        self.previous = last

    def _argument(self, source: int, start: int, end: int) -> _Aggregate | _Name | str:
        """What a move goes to: an aggregate, a declared name, or why it is neither."""
        code = self.code[source]
        if code.startswith("{", start):
            found = aggregate_at(code, start)
            stop = found.end if found else start
            what: _Aggregate | _Name | str = found or "the aggregate cannot be read"
        else:
            word = re.compile(r"\$?\w+(?:\[\d+\])?", re.ASCII).match(code, start, end)
            if not word:
                return "is no literal target"
            stop, name = word.end(), word[0].upper()
            if word[0].startswith("$"):
                return f"{word[0]} is known when the program runs"
            self.mentions.add((source, start))
            if name not in self.names:
                where = f" (assigned in {self.assigned[name]})" if name in self.assigned else ""
                return f"{word[0]} is not declared with a literal in the files given{where}"
            what = self.names[name]
        rest = code[stop:end].strip().upper()
        if rest and not re.fullmatch(r"(C_\w+|\s)+", rest, re.ASCII):
            return "the target is computed (an operator follows it)"
        return what

    def _shown(self, source: int, start: int, end: int) -> str:
        return self.reading.sources[source].shown(start, end)

    def _take(self, what: _Aggregate | _Name | str, use: _Use, source: int, start: int, end: int) -> None:
        if isinstance(what, str):
            self.reading.stay(source, start, self._shown(source, start, end), what)
        elif isinstance(what, _Name):
            what.uses.append(use)
        else:
            self.inline.append((what, use))

    # ---- Targets ----

    def targets(self) -> None:
        found: list[Found] = []
        for what, use in self.inline:
            shown = self._shown(use.source, what.start, what.end)
            target = self._target(what, use.source, shown, [use])
            if target is not None:
                found.append(Found(id(what), target, use.ends()))
        for name in self.names.values():
            if name.type not in ("FDAT", "FRAME") or name.uses:
                target = self._named(name)
                if target is not None:
                    found.append(Found(id(name), target, name.uses[0].ends()))
        self.reading.take(found)

    def _named(self, name: _Name) -> Target | None:
        reading = self.reading
        key = name.name.upper()
        if key in self.assigned:
            why = f"is assigned in {self.assigned[key]}, no constant"
        elif not name.uses:
            if name.type == "FRAME":
                return None
            why = "no move in the files given uses it, so that its tool and base are not known"
        elif key in self.places:
            why = "is a tool or a base as well as a target"
        elif any(use.via != name.uses[0].via for use in name.uses):
            why = "is a point on an arc and the end of another move"
        else:
            self._other_mentions(name)
            return self._target(name.what, name.source, name.name, name.uses)
        reading.stay(name.source, name.what.start, name.name, why)
        return None

    def _other_mentions(self, name: _Name) -> None:
        """Where the program computes with a target that is changed."""
        pattern = re.compile(rf"(?<![\w$.]){re.escape(name.name)}(?!\w)", _FLAGS)
        for source, code in enumerate(self.code):
            for match in pattern.finditer(code):
                declared = source == name.source and match.start() < name.what.start
                if (source, match.start()) in self.mentions or declared:
                    continue
                line = _line_around(code, match.start())
                self.reading.stay(
                    source,
                    match.start(),
                    self._shown(source, *line),
                    f"computes with {name.name}, which is changed",
                )

    def _target(self, what: _Aggregate, source: int, name: str, uses: Sequence[_Use]) -> Target | None:
        kind = "joints" if any(axis in what.values for axis in _AXES) else "pose"
        names = _AXES if kind == "joints" else _FRAME
        why = self._why_not(what, kind, names, uses)
        if why:
            self.reading.stay(source, what.start, name, why)
            return None
        first = uses[0]
        return Target(
            source=source,
            line=self.reading.sources[source].line(what.start),
            name=name,
            move=first.move,
            kind=kind,  # type: ignore[arg-type]
            numbers=what.all_of(names),
            order=(first.source, first.offset),
            moves=tuple((use.source, use.offset) for use in uses),
            tool=first.places.tool if kind == "pose" else first.places.tool.or_flange(),
            frame=first.places.frame if kind == "pose" else NOWHERE,
            configuration=self._configuration(what) if kind == "pose" else None,
            notes=_external_notes(what),
        )

    def _why_not(self, what: _Aggregate, kind: str, names: Sequence[str], uses: Sequence[_Use]) -> str:
        missing = [name for name in names if name not in what.values]
        unread = [name for name in names if name in what.values and what.values[name] is None]
        if missing:
            return f"{', '.join(missing)} not given: taken from where the robot is when it runs"
        if unread:
            return f"{', '.join(unread)}: no literal number"
        if kind == "joints":
            return ""
        active = [name for name in _EXTERNAL if (n := what.values.get(name)) is not None and n.value != 0]
        if active:
            return f"external axis {', '.join(active)} is not at 0 and may move robot or workpiece"
        why = why_not_one([use.places.tool for use in uses], "tool")
        return why or why_not_one([use.places.frame for use in uses], "base")

    def _configuration(self, what: _Aggregate) -> Configuration | None:
        status, turn = what.integer("S"), what.integer("T")
        if status is None and turn is None:
            return None
        token = what.values.get("T")
        said = (("S", status), ("T", turn))
        text = ", ".join(f"{name} {value}" for name, value in said if value is not None)
        return Configuration("kuka", (status, turn), text, {1: token} if token is not None else {})


def _line_around(text: str, offset: int) -> tuple[int, int]:
    start = max(text.rfind("\n", 0, offset), text.rfind("\r", 0, offset)) + 1
    ends = [end for end in (text.find("\n", offset), text.find("\r", offset)) if end >= 0]
    return start, min(ends, default=len(text))


def _external_notes(what: _Aggregate) -> tuple[str, ...]:
    there = [name for name in _EXTERNAL if name in what.values]
    return (
        (f"external axes {there[0]} to {there[-1]} untouched",)
        if len(there) > 1
        else ((f"external axis {there[0]} untouched",) if there else ())
    )


def read(sources: Sequence[Source], given: Given) -> Reading:
    """Targets of a .src with its .dat, and of other .dat files what they declare."""
    stems = {source.path.stem.lower() for source in sources if source.path.suffix.lower() == ".src"}
    others = [k for k, source in enumerate(sources) if stems and source.path.stem.lower() not in stems]
    reading = Reading("kuka", list(sources), others=frozenset(others))
    programs = [k for k, source in enumerate(sources) if source.path.suffix.lower() == ".src"]
    for k in programs:
        if not re.search(
            r"^(?:\xef\xbb\xbf)?[ \t]*(?:GLOBAL[ \t]+)?DEF",
            blanked(sources[k].text, _NO_CODE),
            _FLAGS | re.MULTILINE,
        ):
            raise InputError(f"{sources[k].path}: no line starts with DEF, expected a KRL program")
    krl = _Krl(reading, given)
    krl.declarations()
    for k in programs:
        krl.statements(k)
        require_end(sources[k], krl.code[k], "END", r"(?:^|\r)[ \t]*END(FCT)?[ \t]*(?:\r|$)")
    krl.targets()
    if krl.elsewhere:
        reading.notes.append(
            f"{sources[0].path.name}: {', '.join(krl.elsewhere)}, called and not in the files given, are"
            " taken to leave tool and base as they are"
        )
    return reading
