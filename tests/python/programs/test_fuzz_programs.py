# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Programs with bytes cut, doubled, swapped and replaced: no crash, and only numbers of targets change."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from fuzzing import TOKENS
from program_corpus import BESIDE, applied, programs
from truing import InputError

PIECES = [
    *TOKENS,
    *(b"{", b"}", b"[[", b"]]", b"(", b")", b";", b":=", b"=", b"!", b"#", b"*", b"+1", b"\\"),
    *(b"P[1]", b"GP2:", b"X ", b"E1 5", b"'B01'", b"DEF x()", b"END", b"ENDIF", b"IF a THEN"),
    *(b"///PULSE", b"///RCONF 1,1,1,1,1,1", b"C00002=", b"movel(", b"p[", b"set_tcp(", b"MoveL "),
    *(b"CIRC ", b"CONST robtarget p10:=", b"$TOOL=", b"CONFIG : '"),
]
_NUMBER = re.compile(rb"[-+]?[ \t]*(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_WORD = re.compile(rb"[\w.]")


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """One to three accidents."""
    for _ in range(int(rng.integers(1, 4))):
        a, b = sorted(int(x) for x in rng.integers(0, len(data) + 1, 2))
        b = min(b, a + int(rng.integers(1, 60)))
        kind = rng.integers(0, 6)
        piece = PIECES[int(rng.integers(0, len(PIECES)))]
        if kind == 0:
            data = data[:a] + data[b:]
        elif kind == 1:
            data = data[:b] + data[a:b] + data[b:]
        elif kind == 2:
            data = data[:a] + piece + data[a:]
        elif kind == 3:
            data = data[:a] + piece + data[a + len(piece) :]
        elif kind == 4:
            data = data[:a] + bytes([int(rng.integers(0, 256))]) + data[a + 1 :]
        else:
            digits = [m.start() for m in re.finditer(rb"\d", data)]
            if digits:
                at = digits[int(rng.integers(0, len(digits)))]
                data = data[:at] + b"%d" % rng.integers(0, 10) + data[at + 1 :]
    return data


def run_case(folder: Path, number: int) -> bool:
    """True where the program could still be read."""
    rng = np.random.default_rng([17, number])
    choices = programs()
    path = choices[int(rng.integers(0, len(choices)))]
    names = [path.name, *BESIDE.get(path.name, [])]
    if path.with_suffix(".dat").exists():
        names.append(path.with_suffix(".dat").name)
    hurt = int(rng.integers(0, len(names)))
    for old in folder.iterdir():
        old.unlink()
    for k, name in enumerate(names):
        data = path.with_name(name).read_bytes()
        (folder / name).write_bytes(mutated(data, rng) if k == hurt else data)
    try:
        outcome = applied(folder / path.name)
    except InputError as error:
        assert "\n" not in str(error).replace(repr(str(folder)), ""), f"case {number}: more than one line"
        return False
    for file, new in outcome.files.items():
        old = file.read_bytes()
        tokens = sorted(
            (n.start, n.end, text.encode())
            for one in outcome.targets
            if one.source == file and one.status == "changed"
            for n, text in one.texts.items()
        )
        rebuilt, done = b"", 0
        for start, end, text in tokens:
            assert start >= done, f"case {number}: two targets share a number"
            assert _NUMBER.fullmatch(old[start:end]), f"case {number}: {old[start:end]!r} is no number"
            assert _NUMBER.fullmatch(text), f"case {number}: {text!r} is no number"
            after = old[end : end + 1] if old[end : end + 2] not in (b"mm", b"de") else b""  # FANUC's units
            around = old[max(0, start - 1) : start] + after
            assert not _WORD.search(around), (
                f"case {number}: {old[start - 5 : end + 5]!r} is a part of a word"
            )
            rebuilt += old[done:start] + text
            done = end
        assert rebuilt + old[done:] == new, f"case {number}: something else changed"
    for one in outcome.targets:
        if one.status == "changed":
            assert one.moved[0] < 0.05, f"case {number}: moved by {one.moved[0]} m"
    return True


def test_mutated_programs_are_refused_or_changed_in_numbers_alone(tmp_path: Path) -> None:
    readable = sum(run_case(tmp_path, number) for number in range(200))
    assert 60 < readable < 200


@pytest.mark.slow
def test_ten_thousand_mutated_programs(tmp_path: Path) -> None:
    readable = sum(run_case(tmp_path, number) for number in range(10_000))
    assert readable > 3_000
