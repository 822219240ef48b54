# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Which of some values, each with a standard error of its own, stand out from the others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LEAST = 5  # values, of which one can stand out: fewer others say nothing of how they scatter
_MOST = 0.25  # of the values, that may stand out: what more of them do is how they scatter
_LEAST_ERROR = 1e-12  # none is smaller: nothing is divided by zero


@dataclass(frozen=True)
class Outlier:
    """A value that stands out. centre, scatter: mean of the others, and their standard deviation beyond their
    errors. probability: that any of as many values were as far from it by chance.
    """

    index: int
    centre: float
    scatter: float
    probability: float


def standing_out(values: Floats, errors: Floats, least_probability: float) -> list[Outlier]:
    """values, errors: shape=(n,); NaN: not known.

    The most extreme value is taken away again and again; of those taken away, as many stand out as the last
    that is too far from what was left then (Rosner 1983): so two that stand out do not hide each other. In
    how many ways so many can be taken away is part of the probability.
    """
    errors = np.maximum(errors, _LEAST_ERROR)
    left = [int(k) for k in np.flatnonzero(np.isfinite(values) & np.isfinite(errors))]
    known, removed = len(left), list[Outlier]()
    for count in range(1, int(_MOST * known) + 1 if known >= LEAST else 0):
        ways = math.comb(known, count)
        farthest = min(
            (_against_the_others(k, left, values, errors, ways) for k in left), key=lambda o: o.probability
        )
        removed.append(farthest)
        left.remove(farthest.index)
    while removed and removed[-1].probability > least_probability:
        left.append(removed.pop().index)
    ways = math.comb(known, len(removed))
    return [_against_the_others(o.index, sorted(left), values, errors, ways) for o in removed]


def left_of(values: Floats, errors: Floats, removed: Sequence[Outlier]) -> list[int]:
    """Numbers of the known values that were not taken away."""
    known = np.flatnonzero(np.isfinite(values) & np.isfinite(errors))
    gone = {outlier.index for outlier in removed}
    return [int(k) for k in known if int(k) not in gone]


def centre_of(values: Floats, errors: Floats) -> tuple[float, float, float]:
    """Mean of values that scatter beyond their errors, its standard error, and that scatter (DerSimonian and
    Laird 1986).
    """
    errors = np.maximum(errors, _LEAST_ERROR)
    weights = 1.0 / errors**2
    mean = float(weights @ values / weights.sum())
    excess = float(weights @ (values - mean) ** 2) - (len(values) - 1)
    scale = float(weights.sum() - weights @ weights / weights.sum())
    scatter = math.sqrt(max(0.0, excess / scale)) if scale > 0.0 else 0.0
    weights = 1.0 / (errors**2 + scatter**2)
    return float(weights @ values / weights.sum()), float(1.0 / math.sqrt(weights.sum())), scatter


def _against_the_others(k: int, among: Sequence[int], values: Floats, errors: Floats, ways: int) -> Outlier:
    """Value k against the mean of the others, in units of what another arm would be off by. ways: in which it
    could have been chosen.
    """
    others = np.array([other for other in among if other != k])
    mean, error, scatter = centre_of(values[others], errors[others])
    off = abs(float(values[k]) - mean) / math.sqrt(errors[k] ** 2 + scatter**2 + error**2)
    return Outlier(k, mean, scatter, min(1.0, ways * beyond(off, len(others) - 1)))


def beyond(t: float, freedom: int) -> float:
    """Probability of a Student's t of so many degrees of freedom beyond +-t (Abramowitz and Stegun 1964,
    26.7.3 and 26.7.4).
    """
    angle = math.atan(t / math.sqrt(freedom))
    sine, square = math.sin(angle), math.cos(angle) ** 2
    odd = freedom % 2
    term, total = (math.cos(angle), 0.0) if odd else (1.0, 0.0)
    for k in range(1 + odd, freedom, 2):
        total += term
        term *= square * k / (k + 1)
    inside = 2.0 / math.pi * (angle + sine * total) if odd else sine * total
    return max(0.0, 1.0 - inside)
