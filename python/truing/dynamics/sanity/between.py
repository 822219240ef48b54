# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Does friction differ from recording to recording, as it does where arms are warm in some of them?

No effect names it unless a column says what it goes with, and "no gap beyond noise" would hide it. The torque
of every joint is taken by links, rotor, friction and an offset that all recordings have in common; what is
left of half a recording by friction and an offset that the other half of it asks for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import Grid

Floats = NDArray[np.float64]

ROWS = 600  # of each recording
FEWEST = 80  # of them with a measured torque
PART = 0.25  # of what common friction leaves: what friction of its own must remove
SPREAD = 0.05  # of dry friction: less is no warmth
RIDGE = 1e-7  # of the mean square of a column: what no motion shows
DEPENDENT = 1e-6  # of the largest eigenvalue: smaller ones are of columns that say the same


@dataclass(frozen=True)
class _Rows:
    """Of one joint in one recording."""

    common: Floats  # shape=(n, ...) torques by the parameters of links and rotor
    friction: Floats  # shape=(n, 3) direction, speed, one
    torque: Floats  # shape=(n,) [Nm | N]


@dataclass(frozen=True)
class _Differing:
    joint: str
    removed: float  # of the squared error
    spread: float  # of dry friction, standard deviation over its mean


def friction_differs(
    robot: _core.Robot, recordings: Sequence[_core.Recording], grids: Sequence[Grid]
) -> list[RecordingFinding]:
    """One finding, where friction of its own predicts the other half of a recording; else none. Nor where
    temperatures were recorded, which may tell it, or a load, which is no friction.
    """
    if any(
        name.startswith(("temp", "payload")) and np.ptp(of) > 0.0 for name, of in _columns(recordings).items()
    ):
        return []
    picked = [grid.rows[:: max(1, len(grid.rows) // ROWS)] for grid in grids]
    regressors = [
        np.asarray(_core.torque_regressor(robot, grid.q[rows], grid.qd[rows], grid.qdd[rows]))
        for grid, rows in zip(grids, picked, strict=True)
    ]
    found = []
    for j, joint in enumerate(driven_joints(robot)):
        seen = [_rows_of(*one, j) for one in zip(grids, picked, regressors, strict=True)]
        seen = [rows for rows in seen if len(rows.torque) >= FEWEST]
        if len(seen) < 2:
            continue
        own = _differing(joint.name, seen)
        if own.removed > PART and own.spread > SPREAD:
            found.append(own)
    return [_finding(sorted(found, key=lambda one: -one.removed))] if found else []


def _columns(recordings: Sequence[_core.Recording]) -> dict[str, Floats]:
    """Other columns of all recordings; zero where one does not have it."""
    names = dict.fromkeys(name for one in recordings for name in one.columns)
    return {
        name: np.concatenate([one.columns.get(name, np.zeros(len(one))) for one in recordings])
        for name in names
    }


def _rows_of(grid: Grid, rows: NDArray[np.intp], regressor: Floats, j: int) -> _Rows:
    there = ~np.isnan(grid.torque[rows, j])
    friction = np.column_stack([grid.direction[rows, j], grid.qd[rows, j], np.ones(len(rows))])
    common = np.column_stack([regressor[:, j], grid.qdd[rows, j]])
    return _Rows(common[there], friction[there], grid.torque[rows, j][there])


def _differing(joint: str, seen: Sequence[_Rows]) -> _Differing:
    columns = np.concatenate([np.column_stack([one.common, one.friction]) for one in seen])
    torque = np.concatenate([one.torque for one in seen])
    size = np.sqrt(np.mean(columns**2, axis=0)) + np.finfo(float).tiny
    scaled = columns / size
    gram = scaled.T @ scaled + RIDGE * len(scaled) * np.eye(len(size))
    values = np.linalg.solve(gram, scaled.T @ torque) / size
    left = np.split(torque - columns @ values, np.cumsum([len(one.torque) for one in seen])[:-1])
    own, before, after = [], 0.0, 0.0
    for one, rest in zip(seen, left, strict=True):
        half = len(rest) // 2
        for fitted, judged in ((slice(half), slice(half, None)), (slice(half, None), slice(half))):
            friction = _least_squares(one.friction[fitted], rest[fitted])
            before += float(np.sum(rest[judged] ** 2))
            after += float(np.sum((rest[judged] - one.friction[judged] @ friction) ** 2))
        own.append(_least_squares(one.friction, rest)[0])
    dry = abs(float(values[-3]))
    return _Differing(
        joint, 1.0 - after / before if before > 0.0 else 0.0, float(np.std(own)) / max(dry, 1e-12)
    )


def _least_squares(x: Floats, y: Floats) -> Floats:
    return np.asarray(np.linalg.pinv(x.T @ x, rcond=DEPENDENT, hermitian=True) @ (x.T @ y))


def _finding(joints: Sequence[_Differing]) -> RecordingFinding:
    worst = joints[0]
    spread = listed([f"{one.joint} {100.0 * one.spread:.0f} %" for one in joints])
    words = (
        f"friction differs from recording to recording (standard deviation of the dry one: {spread}), and no"
        f" column tells why: of what a common one leaves at {worst.joint}, each recording's own takes"
        f" {100.0 * worst.removed:.0f} %; record temp1_C ..., or warm up first"
    )
    names = tuple(one.joint for one in joints)
    return RecordingFinding("friction_differs", (), names, words, 100.0 * worst.spread, "%")
