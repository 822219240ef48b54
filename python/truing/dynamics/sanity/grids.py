# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings as the checks see them: at even steps, smoothed without phase, derivatives with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints, measured_torque
from truing.dynamics.smoothing import cubics, even_times, rows_within

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

SPEED_AT_REST = 0.01  # [rad/s] as in the core: slower is noise
SLIDE_AT_REST = 0.001  # [m/s] the same of a joint that slides
STEP = 0.008  # [s] of the grid, at least: checks need no more
SMOOTHING = 0.1  # [s] half of the stretch whose cubic gives a smoothed value
REST_WINDOW = 0.25  # [s] on both sides, as in the core
FAR_APART = 0.012  # [s] between rows, as in the core: motion between them is that of a smooth curve
GAP = 5.0  # usual steps without a row, as in the core
MOVES = 0.05  # of a joint's usual largest speed: from here on it moves
STILL = 0.01  # [rad | m] of range: a joint that stays within does not move


@dataclass(frozen=True)
class Grid:
    """A recording at even steps. Rows are the instants; tables that were not recorded have no columns."""

    name: str
    step: float  # [s]
    raw_step: float  # [s] usual step of the recording itself
    time: Floats  # shape=(n,) [s] the instants, on the recording's clock
    rows: NDArray[np.intp]  # instants of the grid that are not across a gap
    q: Floats  # shape=(n, joints) [rad | m] smoothed
    qd: Floats  # shape=(n, joints) [rad/s | m/s]
    qdd: Floats  # shape=(n, joints) [rad/s^2 | m/s^2]
    direction: Floats  # shape=(n, joints) sign of the speed, smoothed as the torques are
    speed: Floats  # shape=(n, joints) [rad/s | m/s] as recorded, smoothed
    torque: Floats  # shape=(n, joints) [Nm | N] smoothed; NaN: not measured

    @property
    def moving(self) -> Bools:
        """Where each joint moves, whatever the unit of its angle is. shape=(n, joints)"""
        size = np.abs(self.qd)
        usual = np.quantile(size, 0.95, axis=0)
        ranges = np.ptp(self.q, axis=0)
        return np.asarray((size > MOVES * usual) & (ranges > STILL))


def usual_step(time: Floats) -> float:
    """[s] between rows."""
    return float(np.median(np.diff(time)))


def gaps_of(time: Floats) -> NDArray[np.intp]:
    """Rows before a gap."""
    return np.flatnonzero(np.diff(time) > GAP * usual_step(time))


def speeds_at_rest(robot: _core.Robot) -> Floats:
    """shape=(joints,) [rad/s | m/s] slower than which a joint that has a reading is at rest."""
    return np.array(
        [SPEED_AT_REST if joint.type == "revolute" else SLIDE_AT_REST for joint in driven_joints(robot)]
    )


def grids_of(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> list[Grid]:
    """Of the recordings that are long enough to be smoothed."""
    found = [grid_of(robot, recording) for recording in recordings]
    return [grid for grid in found if grid is not None]


def grid_of(robot: _core.Robot, recording: _core.Recording) -> Grid | None:
    time = np.asarray(recording.time, dtype=np.float64)
    step = max(usual_step(time), STEP)
    half = rows_within(SMOOTHING, step)
    grid = even_times(time, step, gaps_of(time))
    if len(grid) < 6 * half:
        return None
    tables = (np.asarray(recording.position), np.asarray(recording.speed), measured_torque(robot, recording))
    even = [_on_grid(time, table, grid) for table in tables]
    q, qd = cubics(even[0], half, step)
    speed, torque = (cubics(table, half, step)[0] for table in even[1:])
    free = np.ones(len(grid), dtype=np.bool_)
    free[: 2 * half] = free[-2 * half :] = False  # ends that smoothing made up
    for row in gaps_of(time):
        free &= (grid < time[row] - 2 * SMOOTHING) | (grid > time[row + 1] + 2 * SMOOTHING)
    return Grid(
        recording.name,
        step,
        usual_step(time),
        grid,
        np.flatnonzero(free),
        q,
        qd,
        cubics(qd, half, step)[1],
        cubics(np.tanh(qd / speeds_at_rest(robot)), half, step)[0],
        speed,
        torque,
    )


def _on_grid(time: Floats, table: Floats, grid: Floats) -> Floats:
    """Means over the steps of the grid where it is coarser than the rows, else straight lines."""
    out = np.empty((len(grid), table.shape[1]))
    coarse = len(time) > 1.5 * len(grid)
    for k, column in enumerate(np.asarray(table, dtype=np.float64).T):
        if coarse:
            out[:, k] = _means(time, column, grid)
        else:
            out[:, k] = np.interp(grid, time, column)
    return out


def _means(time: Floats, column: Floats, grid: Floats) -> Floats:
    """Of the straight lines between the rows, over a step around each instant of the grid."""
    area = np.concatenate([[0.0], np.cumsum(0.5 * (column[1:] + column[:-1]) * np.diff(time))])
    half = 0.5 * (grid[1] - grid[0])
    low, high = np.maximum(grid - half, time[0]), np.minimum(grid + half, time[-1])
    return np.asarray((np.interp(high, time, area) - np.interp(low, time, area)) / (high - low))
