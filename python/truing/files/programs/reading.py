# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""From files to what is in them: which maker's language, which files belong together."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.brand_frames import NOTATIONS, Brand, frame_from_numbers
from truing.files.programs import fanuc, inform, krl, rapid, urscript
from truing.files.programs.model import Given, Reading
from truing.files.programs.text import Source, read_source

SUFFIXES: Mapping[str, Brand] = {
    ".src": "kuka",
    ".dat": "kuka",
    ".mod": "abb",
    ".modx": "abb",
    ".sys": "abb",
    ".sysx": "abb",
    ".ls": "fanuc",
    ".script": "ur",
    ".urscript": "ur",
    ".jbi": "yaskawa",
}
_READERS: Mapping[Brand, Callable[[Sequence[Source], Given], Reading]] = {
    "kuka": krl.read,
    "abb": rapid.read,
    "fanuc": fanuc.read,
    "ur": urscript.read,
    "yaskawa": inform.read,
}


def has_program_name(path: Path) -> bool:
    """Whether the name is that of a robot program."""
    return path.suffix.lower() in SUFFIXES


def brand_of(path: Path) -> Brand:
    """Raises InputError for a file that is no robot program."""
    suffix = path.suffix.lower()
    if suffix in SUFFIXES:
        return SUFFIXES[suffix]
    if suffix == ".tp":
        raise InputError(
            f"{path}: is a binary FANUC program, expected its text: save it as .ls and give that"
        )
    raise InputError(
        f"{path}: found {suffix or 'no suffix'!r}, expected a program of KUKA (.src, .dat), ABB (.mod,"
        " .sys), FANUC"
        " (.ls), Universal Robots (.script) or Yaskawa (.jbi)"
    )


@dataclass(frozen=True)
class Refused:
    """Files that cannot be used, and why."""

    paths: tuple[Path, ...]
    message: str


def read_programs(paths: Sequence[Path], given: Given) -> tuple[list[Reading], list[Refused]]:
    """Every program of these files: a .src with its .dat, which is found beside it; RAPID modules together.

    A file that cannot be used is told with its reason, and the others are read.
    """
    brands = {brand_of(path) for path in paths}
    if len(brands) > 1:
        raise InputError(f"programs of {' and '.join(sorted(brands))}: give those of one robot at a time")
    readings: list[Reading] = []
    refused: list[Refused] = []
    for group in _groups(list(dict.fromkeys(paths)), next(iter(brands))):
        try:
            readings.append(_READERS[next(iter(brands))]([read_source(path) for path in group], given))
        except InputError as error:
            refused.append(Refused(tuple(group), str(error)))
    return readings, refused


def _groups(paths: list[Path], brand: Brand) -> list[list[Path]]:
    if brand == "abb":
        return [paths]
    if brand != "kuka":
        return [[path] for path in paths]
    programs = [path for path in paths if path.suffix.lower() == ".src"]
    data = [path for path in paths if path.suffix.lower() == ".dat"]
    if not programs:
        return [[path] for path in data]
    groups, taken = [], set()
    for program in programs:
        own = [path for path in data if path.stem.lower() == program.stem.lower()] or _beside(program)
        taken.update(own)
        groups.append([program, *own])
    others = [path for path in data if path not in taken]  # $config.dat: what all programs use
    return [[*group, *others] for group in groups]


def _beside(program: Path) -> list[Path]:
    """The .dat of the same name in the same folder."""
    try:
        return [
            path
            for path in program.parent.iterdir()
            if path.suffix.lower() == ".dat" and path.stem.lower() == program.stem.lower()
        ][:1]
    except OSError:
        return []


def parse_place(text: str, brand: Brand, option: str) -> tuple[str, NDArray[np.float64]]:
    """ "NAME=X,Y,Z,A,B,C" or the numbers alone, in the brand's own notation. Raises InputError."""
    name, equals, numbers = text.rpartition("=")
    words = [word for word in re.split(r"[,\s]+", numbers.strip("[]p{} ")) if word]
    names = ",".join(NOTATIONS[brand].names)
    try:
        values = [float(word) for word in words]
        place = frame_from_numbers(brand, values)
    except (ValueError, InputError) as error:
        why = f": {error}" if isinstance(error, InputError) else ""
        raise InputError(
            f"{option}: found {text!r}, expected NAME={names} in {brand}'s own units{why}"
        ) from None
    return name.strip().lower() if equals else "", place
