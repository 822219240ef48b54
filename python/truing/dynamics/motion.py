# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recorded motion as simulations take it: on an even grid, positions and speeds smoothed without phase."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError

Floats = NDArray[np.float64]

SMOOTHING = 0.05  # [s] half of the stretch whose cubic gives a smoothed value
GAP = 5.0  # of the usual time between rows: a gap


class Recorded(Protocol):
    """What of a recording is used; tables without columns were not recorded."""

    @property
    def name(self) -> str: ...
    @property
    def time(self) -> Any: ...
    @property
    def position(self) -> Any: ...
    @property
    def speed(self) -> Any: ...
    @property
    def torque(self) -> Any: ...
    @property
    def current(self) -> Any: ...
    @property
    def columns(self) -> Mapping[str, Any]: ...


@dataclass(frozen=True)
class Track:
    """One recording on an even grid, smoothed; torques as measured."""

    time: Floats
    q: Floats
    qd: Floats
    qdd: Floats
    torque_time: Floats
    torque: Floats
    temperature: Floats  # shape=(n, joints) [deg C], as the torques; NaN: not known

    def near(self, begin: float, end: float) -> Track:
        """The rows between two times, and one more on both sides."""
        rows, more = (
            slice(max(np.searchsorted(time, begin) - 1, 0), np.searchsorted(time, end, "right") + 1)
            for time in (self.time, self.torque_time)
        )
        motion = (table[rows] for table in (self.time, self.q, self.qd, self.qdd))
        return Track(*motion, *(table[more] for table in (self.torque_time, self.torque, self.temperature)))


def track_of(recording: Recorded, robot: _core.Robot, smoothing: float) -> tuple[Track, NDArray[np.bool_]]:
    """The recording on an even grid, and where that is not across a gap."""
    time, q = np.asarray(recording.time, dtype=float), np.asarray(recording.position, dtype=float)
    torque = measured_torque(recording, robot)
    step = float(np.median(np.diff(time)))
    half = max(int(round(smoothing / step)), 2)
    grid = np.arange(time[0], time[-1] + 1e-9, step)
    if grid.size < 4 * half:
        raise InputError(f"{recording.name}: {time[-1] - time[0]:.3g} s are too short to be simulated")
    value, slope = _kernels(half, step)
    smooth = _filtered(table_at(time, q, grid), value)
    speed = np.asarray(recording.speed, dtype=float)
    if speed.shape == q.shape and np.all(np.isfinite(speed)):
        rate = _filtered(table_at(time, speed, grid), value)
    else:
        rate = _filtered(table_at(time, q, grid), slope)
    free = np.ones(grid.size, dtype=bool)
    for k in np.flatnonzero(np.diff(time) > GAP * step):
        free &= (grid < time[k] - smoothing) | (grid > time[k + 1] + smoothing)
    return Track(
        grid, smooth, rate, _filtered(rate, slope), time, torque, temperatures(recording, torque.shape)
    ), free


def measured_torque(recording: Recorded, robot: _core.Robot) -> Floats:
    """shape=(n, joints) [Nm | N]: torques as recorded, or currents times the robot's torque_per_ampere."""
    driven = [joint for joint in robot.joints if not joint.passive]
    shape = (len(np.asarray(recording.time)), len(driven))
    torque = np.asarray(recording.torque, dtype=float)
    if torque.shape != shape:
        current = np.asarray(recording.current, dtype=float)
        gains = [joint.torque_per_ampere for joint in driven]
        if current.shape != shape or any(gain is None for gain in gains):
            raise InputError(
                f"{recording.name}: no torques, and no currents with the robot's torque_per_ampere, of all"
                f" {len(driven)} joints: a simulation of torques cannot be driven"
            )
        torque = current * np.array(gains, dtype=float)
    for what, table in (("positions", np.asarray(recording.position, dtype=float)), ("torques", torque)):
        if table.shape != shape or not np.all(np.isfinite(table)):
            raise InputError(
                f"{recording.name}: {what} of shape {table.shape}, or not all numbers, expected {shape}"
                " numbers"
            )
    return torque


def temperatures(recording: Recorded, shape: tuple[int, int]) -> Floats:
    """shape=(n, joints) [deg C]: columns 'temp1_C' … of the joints, or 'temp_C' of all; NaN without."""
    columns = {name: np.asarray(values, dtype=float) for name, values in recording.columns.items()}
    common = columns.get("temp_C", np.full(shape[0], np.nan))
    return np.column_stack([columns.get(f"temp{j + 1}_C", common) for j in range(shape[1])])


def smoothed(table: Floats, step: float, smoothing: float) -> Floats:
    """Even rows, each by the cubic through those within `smoothing` [s] on both sides."""
    half = max(int(round(smoothing / step)), 2)
    return _filtered(table, _kernels(half, step)[0]) if len(table) > 2 * half else table


def _kernels(half: int, step: float) -> tuple[Floats, Floats]:
    """Of a cubic through 2 half + 1 rows: value and slope in the middle. shape=(2 half + 1,)"""
    t = step * np.arange(-half, half + 1)
    fit = np.linalg.pinv(np.vander(t, 4, increasing=True))
    return fit[0], fit[1]


def _filtered(table: Floats, kernel: Floats) -> Floats:
    """Ends are continued by their point reflection."""
    half = kernel.size // 2
    before = 2.0 * table[:1] - table[half:0:-1]
    after = 2.0 * table[-1:] - table[-2 : -half - 2 : -1]
    long = np.concatenate([before, table, after])
    return np.column_stack([np.convolve(column, kernel[::-1], mode="valid") for column in long.T])


def table_at(time: Floats, table: Floats, at: Floats) -> Floats:
    return np.column_stack([np.interp(at, time, column) for column in table.T])
