# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a writer gives back: files as text, and what they do not hold."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.controllers.distances import Distance, Dropped

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Written:
    """files: text by name. values: what is to be entered, for result.json. lines: the same in words."""

    files: Mapping[str, str]
    values: Mapping[str, Any]
    lines: Sequence[tuple[str, str]]
    dropped: Sequence[Dropped] = ()
    notes: Sequence[str] = ()
    remaining: Distance | None = None
    """Between the calibrated robot and the one that the files describe, read as they are written."""
    before: Distance | None = None
    """The same of the nominal robot, tool and base fitted."""
    extra: Mapping[str, Any] = field(default_factory=dict)


def name_in_file(name: str) -> str:
    """A name as a file's or an identifier: letters, digits, underscores."""
    return re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "robot"


def numbers(values: Sequence[float], digits: int) -> list[str]:
    """With so many digits behind the point, and no negative zero."""
    return [f"{round(float(value), digits) + 0.0:.{digits}f}" for value in values]
