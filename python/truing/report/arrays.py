# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Arrays as pages hold them, and fewer points of them where a picture has no room for all."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def packed(values: Floats | NDArray[np.integer[Any]]) -> dict[str, str]:
    """plotly.js's own form of a typed array: four bytes a number."""
    return {
        "dtype": "f4",
        "bdata": base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode(),
    }


def unpacked(values: Any) -> Floats:
    """The numbers of `packed`, or of a sequence with None for NaN."""
    if isinstance(values, dict):
        return np.frombuffer(base64.b64decode(values["bdata"]), dtype="<f4").astype(np.float64)
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def subsample(indices: NDArray[np.integer[Any]], limit: int) -> NDArray[np.integer[Any]]:
    """At most `limit` of the indices, evenly picked."""
    return (
        indices if indices.size <= limit else indices[np.linspace(0, indices.size - 1, limit).astype(np.intp)]
    )


def outline(values: Floats, limit: int) -> NDArray[np.intp]:
    """About `limit` places of a line at most, the smallest and largest value of every stretch among them: no
    peak is lost, and gaps (NaN) stay.
    """
    if values.size <= limit:
        return np.arange(values.size)
    known = np.isfinite(values)
    ends = np.flatnonzero(np.diff(known.astype(np.int8))) + 1
    keep: list[int] = []
    for run in np.split(np.arange(values.size), ends):
        if not known[run[0]]:
            keep.append(int(run[0]))  # a gap stays one
            continue
        keep += [int(run[0]), int(run[-1])]
        for part in np.array_split(run, max(1, limit * run.size // values.size // 2)):
            keep += [int(part[np.argmin(values[part])]), int(part[np.argmax(values[part])])]
    return np.unique(keep)


def mixed(scale: Sequence[str], fraction: float) -> str:
    """The colour at a fraction of a scale of colours "#rrggbb"."""
    at = min(max(fraction, 0.0), 1.0) * (len(scale) - 1)
    k = min(int(at), len(scale) - 2)
    first, second = ([int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in scale[k : k + 2])
    return "#" + "".join(f"{round(a + (at - k) * (b - a)):02x}" for a, b in zip(first, second, strict=True))
