# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Poses as ViSP writes them: a file for each, `pose_fPe_1.yaml`, with `rows: 6`, `cols: 1` and as `data` the
position [m] and the rotation vector [rad].
"""

from __future__ import annotations

import math
import re
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError
from truing.files.rigid import frames_from_parts
from truing.files.yaml_tree import Document, found
from truing.rotations import rotations_from_angles

Floats = NDArray[np.float64]

_KIND = "pose of ViSP"
_NUMBER = re.compile(r"%0?[0-9]*d")  # of a file, as ViSP's own programs are told it
_KEYS = {"rows", "cols", "data"}


def is_series(path: Path) -> bool:
    """Whether a name stands for a file of each pose: `pose_fPe_%d.yaml`."""
    return bool(_NUMBER.search(path.name)) and not path.exists()


def is_visp_matrix(value: Any) -> bool:
    """Whether a YAML document is a matrix of ViSP, as its poses are."""
    return isinstance(value, dict) and value.keys() >= _KEYS


def read_visp_series(pattern: Path) -> Floats:
    """Frames, shape=(n, 4, 4) [m], of the files that the pattern stands for, in the order of their numbers.

    Raises InputError: there are none, a number between them is missing, or one is no pose.
    """
    paths = _files(pattern)
    frames = np.concatenate([visp_frame(Document.read(path, _KIND))[None] for path in paths.values()])
    return np.asarray(frames, dtype=np.float64)


def _files(pattern: Path) -> dict[int, Path]:
    before, after = _NUMBER.split(pattern.name, maxsplit=1)
    name = re.compile(re.escape(before) + "([0-9]+)" + re.escape(after))
    folder = pattern.parent
    numbered = [(name.fullmatch(path.name), path) for path in folder.iterdir()] if folder.is_dir() else []
    paths = dict(sorted((int(match[1]), path) for match, path in numbered if match))
    if not paths:
        raise InputError(f"{pattern}: found no file of that name with a number for %d in {folder}")
    gap = next((number for number in range(min(paths), max(paths)) if number not in paths), None)
    if gap is not None:
        missing = _NUMBER.sub(str(gap), pattern.name)
        raise InputError(
            f"{pattern}: found numbers from {min(paths)} to {max(paths)} without {missing}, expected all: the"
            " poses of hand and board belong together one by one"
        )
    return paths


def visp_frame(document: Document) -> Floats:
    """The frame, shape=(4, 4) [m], of a pose in ViSP's words. Raises InputError."""
    value = document.value
    if not is_visp_matrix(value):
        document.refuse((), f"found {found(value)}, expected a {_KIND}: rows: 6, cols: 1 and data")
    data = value["data"]
    if not isinstance(data, list) or len(data) != 6:
        document.refuse(
            ("data",), f"found {found(data)}, expected 6 rows: the position [m], the rotation vector [rad]"
        )
    numbers = np.array([_number(document, row, entry) for row, entry in enumerate(data)])
    rotation = rotations_from_angles(numbers[None, 3:], "rotation-vector")
    frames = frames_from_parts(rotation, numbers[None, :3], lambda _: str(document.path))
    return frames.reshape(4, 4)


def _number(document: Document, row: int, entry: Any) -> float:
    value = entry[0] if isinstance(entry, list) and len(entry) == 1 else entry
    if not isinstance(value, Decimal) or not math.isfinite(value):
        document.refuse(("data", row), f"found {found(value)}, expected a finite number")
    return float(value)
