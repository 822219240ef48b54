# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Tables at even steps, smoothed without phase: each row by the cubic through those around it (Savitzky and
Golay 1964).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_ROUNDED = 1e-9  # [s] by which steps that are added up may miss the last row
_LEAST_HALF = 2  # rows on both sides: five rows leave a cubic a row to smooth with


def rows_within(smoothing: float, step: float) -> int:
    """Rows on both sides that lie within `smoothing` [s], `step` [s] apart."""
    return max(int(round(smoothing / step)), _LEAST_HALF)


def even_times(time: Floats, step: float, gaps: NDArray[np.intp]) -> Floats:
    """Instants `step` [s] apart from the first to the last row of every stretch between gaps. gaps: rows
    before them. Tables there may be smoothed as if rows were even; what is near a gap then mixes both sides.
    """
    begins, ends = np.concatenate([[0], gaps + 1]), np.concatenate([gaps, [len(time) - 1]])
    stretches = zip(time[begins], time[ends], strict=True)
    return np.concatenate([np.arange(begin, end + _ROUNDED, step) for begin, end in stretches])


def cubics(table: Floats, half: int, step: float) -> tuple[Floats, Floats]:
    """Values and slopes, by the cubic through 2 half + 1 rows around each; of rows at the ends by the cubic
    through the first or last of them. shape=(n, columns), n > 2 half; step: [s]
    """
    values, slopes = _weights(half, step)
    return _weighed(table, values), _weighed(table, slopes)


def acceleration_kernel(half: int, step: float) -> Floats:
    """What two slopes one after the other do to a table, shape=(4 half + 1,) [1/s^2]; step: [s]"""
    slope = _weights(half, step)[1][half]
    return np.convolve(slope, slope)


def _weights(half: int, step: float) -> tuple[Floats, Floats]:
    """Of the cubic through 2 half + 1 rows: its values and slopes at each. shape=(rows, rows)"""
    t = step * np.arange(-half, half + 1)
    powers = np.vander(t, 4, increasing=True)
    derivatives = np.column_stack([np.zeros_like(t), np.ones_like(t), 2.0 * t, 3.0 * t * t])
    fit = np.linalg.pinv(powers)
    return np.asarray(powers @ fit), np.asarray(derivatives @ fit)


def _weighed(table: Floats, weights: Floats) -> Floats:
    """A row of weights for each place among as many rows: the middle one for all but the ends."""
    half = len(weights) // 2
    if not table.shape[1]:
        return table
    middle = [np.convolve(column, weights[half, ::-1], mode="valid") for column in table.T]
    first, last = weights[:half] @ table[: 2 * half + 1], weights[-half:] @ table[-2 * half - 1 :]
    return np.concatenate([first, np.column_stack(middle), last])
