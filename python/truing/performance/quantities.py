# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The characteristics of ISO 9283:1998, one function a formula, in arrays of attained positions.

Clauses are those of the standard's table of contents; the formulas are as its users print them (sources:
docs/guide/performance.md). Standard deviations have n - 1 in the denominator. The last axis is x, y, z.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def pose_accuracy(attained: Floats, commanded: Floats) -> Floats:
    """AP (7.2): distance of the barycentre of the attained positions from the commanded one.

    attained: shape=(..., n, 3) [m]. commanded: shape=(..., 3) [m]. Result: shape=(...) [m].
    """
    return np.asarray(np.linalg.norm(attained.mean(axis=-2) - commanded, axis=-1))


def lengths_from_barycentre(attained: Floats) -> Floats:
    """l_j of 7.2: distance of every attained position from the barycentre, shape=(..., n) [m]."""
    return np.asarray(np.linalg.norm(attained - attained.mean(axis=-2, keepdims=True), axis=-1))


def pose_repeatability(attained: Floats) -> Floats:
    """RP (7.2): mean length plus three of its standard deviations, shape=(...) [m] of (..., n, 3)."""
    lengths = lengths_from_barycentre(attained)
    return np.asarray(lengths.mean(axis=-1) + 3.0 * lengths.std(axis=-1, ddof=1))


def three_deviations(values: Floats) -> Floats:
    """RP of an angle (7.2) and RD of a distance (7.3): three standard deviations along the last axis.
    The standard writes them with a sign of plus or minus.
    """
    return np.asarray(3.0 * values.std(axis=-1, ddof=1))


def largest_distance(points: Sequence[Floats]) -> Floats:
    """vAP (7.2) of the barycentres of all directions: the largest distance between any two, shape=(...)."""
    return np.asarray(np.max([np.linalg.norm(a - b, axis=-1) for a, b in combinations(points, 2)], axis=0))


def distances(first: Floats, second: Floats) -> Floats:
    """D_j of 7.3: distance of two positions attained in one cycle, shape=(..., n) [m] of (..., n, 3)."""
    return np.asarray(np.linalg.norm(first - second, axis=-1))


def path_accuracy(attained: Floats, commanded: Floats) -> Floats:
    """AT (8.2): the largest distance of the mean path from the commanded one.

    attained: shape=(..., n, m, 3) [m], where cycle j crosses the plane that is normal to the commanded path
    at its point i. commanded: shape=(m, 3) [m].
    """
    return np.asarray(np.linalg.norm(attained.mean(axis=-3) - commanded, axis=-1).max(axis=-1))


def path_repeatability(attained: Floats) -> Floats:
    """RT (8.3): the largest of the repeatabilities of the path's points; shapes as in `path_accuracy`."""
    return np.asarray(pose_repeatability(np.moveaxis(attained, -3, -2)).max(axis=-1))


def drift(values: Floats) -> Floats:
    """dAP and dRP (7.6): the largest change since the first block, along the last axis."""
    return np.asarray(np.abs(values - values[..., :1]).max(axis=-1))


def crossings(positions: Floats, commanded: Floats) -> Floats:
    """Where a recorded path crosses the planes normal to the commanded path at its points (8.2).

    positions: shape=(k, 3) [m], one cycle in the order of time. commanded: shape=(m, 3) [m].
    Result: shape=(m, 3) [m], NaN where the recording ends before the plane. Between two samples the path is a
    line; of several crossings the one nearest to the commanded point counts.
    """
    tangents = np.gradient(commanded, axis=0)
    found = np.full(commanded.shape, np.nan)
    for i, (point, tangent) in enumerate(zip(commanded, tangents, strict=True)):
        ahead = (positions - point) @ tangent
        at = np.flatnonzero((ahead[:-1] <= 0) & (ahead[1:] >= 0) & (ahead[1:] > ahead[:-1]))
        if at.size:
            share = ahead[at] / (ahead[at] - ahead[at + 1])
            crossed = positions[at] + share[:, None] * (positions[at + 1] - positions[at])
            found[i] = crossed[np.argmin(np.linalg.norm(crossed - point, axis=1))]
    return found
