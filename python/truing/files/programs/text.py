# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The text of a program, in which number tokens can be replaced and nothing else.

A file is taken as Latin-1, whatever its encoding is: one character is one byte, and all that the languages
mean is ASCII. So every other byte, the encoding and the line endings stay as they are.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from truing.errors import InputError
from truing.files.common import read_bytes
from truing.limits import LARGEST_NUMBER

LARGEST_PROGRAM = 50_000_000  # [bytes] a million lines
NUMBER = r"[-+]?[ \t]*(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_NUMBER = re.compile(NUMBER, re.ASCII)


@dataclass(frozen=True)
class Number:
    """A number token: where it stands, and how it is written."""

    start: int
    end: int
    text: str

    @property
    def value(self) -> float:
        return float(self.text.replace(" ", "").replace("\t", ""))

    @property
    def decimals(self) -> int:
        """Digits after the point."""
        return len(self.text.lower().partition("e")[0].partition(".")[2])


@dataclass(frozen=True)
class Source:
    """A file of a program."""

    path: Path
    text: str  # a character is a byte
    _lines: list[int] = field(default_factory=list, compare=False, repr=False)

    def __post_init__(self) -> None:
        self._lines.extend(match.end() for match in re.finditer(r"\r\n|\n|\r", self.text))

    def line(self, offset: int) -> int:
        """Number of the line that holds this character, from 1."""
        return bisect.bisect_right(self._lines, offset) + 1

    def shown(self, start: int, end: int, limit: int = 60) -> str:
        """A piece as a reader sees it: one line, not too long."""
        data = self.text[start:end].encode("latin-1")
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
        text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
        return text if len(text) <= limit else text[: limit - 1] + "…"


def read_source(path: Path) -> Source:
    """Raises InputError for what is no text of single bytes."""
    data = read_bytes(path, LARGEST_PROGRAM)
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise InputError(f"{path}: is UTF-16 text, expected a program in Latin-1 or UTF-8: save it again so")
    position = data.find(b"\0")
    if position >= 0:
        raise InputError(
            f"{path}: is a binary file (byte {position} is zero), expected the text of a program"
            " (FANUC: save the .tp as .ls)"
        )
    if not data.strip():
        raise InputError(f"{path}: is empty, expected a program")
    return Source(path, data.decode("latin-1"))


def number_at(text: str, start: int, end: int) -> Number | None:
    """The piece as one number, spaces around it aside; None if it is anything else, or too large."""
    while start < end and text[start] in " \t\r\n":
        start += 1
    while end > start and text[end - 1] in " \t\r\n":
        end -= 1
    if not _NUMBER.fullmatch(text, start, end):
        return None
    number = Number(start, end, text[start:end])
    return number if abs(number.value) <= LARGEST_NUMBER else None


def blanked(text: str, pattern: re.Pattern[str]) -> str:
    """The text with spaces where the pattern matches (comments, strings); line ends and offsets stay, and the
    mark that opens a string: -"a"1.4 is no number.
    """

    def spaces(match: re.Match[str]) -> str:
        mark = 1 if match[0].startswith('"') else 0
        return match[0][:mark] + re.sub(r"[^\r\n]", " ", match[0][mark:])

    return pattern.sub(spaces, text)


_PAIRS = {"(": ")", "[": "]", "{": "}"}


def closing(text: str, start: int) -> int | None:
    """Where the bracket that opens at `start` closes; None: nowhere."""
    awaited: list[str] = []
    for position in range(start, min(len(text), start + 20_000)):
        letter = text[position]
        if letter in _PAIRS:
            awaited.append(_PAIRS[letter])
        elif letter in ")]}":
            if not awaited or letter != awaited.pop():
                return None
            if not awaited:
                return position
    return None


def is_closed(text: str, start: int, end: int) -> bool:
    """Whether the brackets of a piece close in pairs."""
    awaited: list[str] = []
    for letter in text[start:end]:
        if letter in _PAIRS:
            awaited.append(_PAIRS[letter])
        elif letter in ")]}" and (not awaited or letter != awaited.pop()):
            return False
    return not awaited


def unclosed(source: Source, start: int, end: int) -> InputError:
    """The error for a move whose brackets do not close in pairs."""
    return InputError(
        f"{source.path}, line {source.line(start)}: {source.shown(start, end)}: brackets do not close in"
        " pairs, expected ( [ ] ): mend the line, or write the program anew if it was cut off"
    )


def require_end(source: Source, code: str, word: str, pattern: str) -> None:
    """Programs are written whole: one without its end was cut off, and so may be what is left of its targets.
    code: the text, comments blanked. Raises InputError.
    """
    if not re.search(pattern, code, re.ASCII | re.IGNORECASE | re.MULTILINE):
        raise InputError(f"{source.path}: has no {word}, and was cut off: write the program anew")


def pieces(text: str, start: int, end: int, separator: str = ",") -> list[tuple[int, int]]:
    """The parts between separators that stand in no bracket."""
    found: list[tuple[int, int]] = []
    depth, begin = 0, start
    for position in range(start, end):
        letter = text[position]
        depth += (letter in "([{") - (letter in ")]}")
        if letter == separator and depth == 0:
            found.append((begin, position))
            begin = position + 1
    return [*found, (begin, end)]


def trimmed(text: str, start: int, end: int) -> tuple[int, int]:
    """The piece without the space around it."""
    piece = text[start:end]
    return start + len(piece) - len(piece.lstrip(" \t\r\n")), end - len(piece) + len(piece.rstrip(" \t\r\n"))


def numbers_of(text: str, start: int, end: int, count: int) -> tuple[Number, ...] | None:
    """So many numbers between commas; None if it is anything else."""
    found = [number_at(text, *piece) for piece in pieces(text, start, end)]
    whole = tuple(number for number in found if number is not None)
    return whole if len(whole) == len(found) == count else None


def printed(number: Number, value: float, least_decimals: int) -> str:
    """The value in the manner of a token: as many decimals, at least `least_decimals`; the token's own text
    where the printed digits would say the same.
    """
    decimals = max(number.decimals, least_decimals)
    # Half a digit, less what arithmetic in doubles leaves.
    if abs(value - number.value) <= 0.5 * 10.0**-decimals + 1e-12 * abs(value):
        return number.text
    text = f"{value:.{decimals}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")
    if re.match(r"[-+]?[ \t]*\.", number.text):  # PolyScope writes .433
        text = re.sub(r"^(-?)0\.", r"\1.", text)
    return "+" + text if number.text.startswith("+") and not text.startswith("-") else text


def edited(source: Source, texts: Mapping[Number, str]) -> bytes:
    """The file with these tokens replaced."""
    parts: list[str] = []
    done = 0
    for number in sorted(texts, key=lambda number: number.start):
        if number.start < done or source.text[number.start : number.end] != number.text:
            raise ValueError(f"{source.path}: token at {number.start} is not where it was read")
        parts += [source.text[done : number.start], texts[number]]
        done = number.end
    return "".join([*parts, source.text[done:]]).encode("latin-1")
