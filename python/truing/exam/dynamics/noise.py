# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Noise of torques: white, coloured as that of real arms, and what real recordings leave with its phases
drawn anew.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from truing.exam.dynamics.robots import Floats

_SLOW = (0.25, 0.5)  # [s] time constants of the slow part: 10 to 25 samples of correlation at 25 Hz
_FAST = 0.02  # [s]
_SLOW_SHARE = 0.85  # of the variance


def white(rows: int, n: int, rng: Generator) -> Floats:
    return rng.normal(size=(rows, n))


def coloured(rows: int, n: int, step: float, rng: Generator) -> Floats:
    """Two first-order processes, slow and fast, of variance one together."""
    found = np.empty((rows, n))
    for j in range(n):
        slow = _first_order(rows, step / rng.uniform(*_SLOW), rng)
        fast = _first_order(rows, step / _FAST, rng)
        found[:, j] = np.sqrt(_SLOW_SHARE) * slow + np.sqrt(1.0 - _SLOW_SHARE) * fast
    return found


def _first_order(rows: int, rate: float, rng: Generator) -> Floats:
    a = float(np.exp(-rate))
    x, found = float(rng.normal()), []
    for kick in (np.sqrt(1.0 - a * a) * rng.normal(size=rows)).tolist():
        x = a * x + kick
        found.append(x)
    return np.array(found)


def reshuffled(residual: Floats, rng: Generator) -> Floats:
    """The same spectrum, phases drawn anew, column by column (Theiler et al. 1992)."""
    spectrum = np.fft.rfft(residual, axis=0)
    phase = np.exp(2j * np.pi * rng.random(spectrum.shape))
    phase[0] = 1.0
    return np.asarray(np.fft.irfft(np.abs(spectrum) * phase, n=len(residual), axis=0))
