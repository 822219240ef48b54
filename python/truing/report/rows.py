# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Errors of every row of the data, before and after: plain numbers, which pages draw and tables hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Rows:
    """What is known of every row of the data, in the order of the data.

    Errors are predicted minus measured and NaN where a row does not measure them; a row has either a position
    error or a distance error. `position` is where the target was measured, or else predicted.
    """

    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]  # "rad" | "m"
    joints: Floats  # shape=(n, driven joints) [rad | m]
    position: Floats  # shape=(n, 3) [m]
    error_before: Floats  # shape=(n, 3) [m]
    error_after: Floats  # shape=(n, 3) [m]
    distance_before: Floats  # shape=(n,) [m]
    distance_after: Floats  # shape=(n,) [m]
    rotation_before: Floats  # shape=(n, 3) [rad]
    rotation_after: Floats  # shape=(n, 3) [rad]
    test: Bools
    rejected: Bools
    pose: NDArray[np.int32]  # group of rows of one robot pose
    time: Floats | None = None  # [s]

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.joints)

    @property
    def magnitude_before(self) -> Floats:
        """Length of the position (or distance) error before, shape=(n,) [m]."""
        return _magnitude(self.error_before, self.distance_before)

    @property
    def magnitude_after(self) -> Floats:
        """Length of the position (or distance) error after, shape=(n,) [m]."""
        return _magnitude(self.error_after, self.distance_after)

    @property
    def what(self) -> str:
        """What is compared: "position", "distance" or both."""
        positions, distances = np.isfinite(self.error_after).any(), np.isfinite(self.distance_after).any()
        return "position and distance" if positions and distances else "distance" if distances else "position"

    @property
    def numbers_per_row(self) -> float:
        """Measured numbers that a row carries, on average."""
        measured = sum(
            int(np.isfinite(e).sum()) for e in (self.error_after, self.distance_after, self.rotation_after)
        )
        return measured / self.count if self.count else 0.0


def _magnitude(error: Floats, distance: Floats) -> Floats:
    return np.where(np.isfinite(distance), np.abs(distance), np.sqrt(np.sum(error**2, axis=1)))


def statistics(magnitude: Floats, rotation: Floats | None = None) -> dict[str, Any]:
    """Statistics of error lengths [m] as ``result.json`` has them; rows without a measurement (NaN) do not
    count.
    """
    size = magnitude[np.isfinite(magnitude)]
    if size.size == 0:
        return {"rms_m": None, "mean_m": None, "median_m": None, "p95_m": None, "max_m": None, "n": 0}
    result: dict[str, Any] = {
        "rms_m": float(np.sqrt(np.mean(size**2))),
        "mean_m": float(size.mean()),
        "median_m": float(np.median(size)),
        "p95_m": float(np.quantile(size, 0.95)),
        "max_m": float(size.max()),
        "n": int(size.size),
    }
    if rotation is not None and np.isfinite(rotation).any():
        result["rotation_rms_rad"] = float(np.sqrt(np.nanmean(np.sum(rotation**2, axis=1))))
    return result
