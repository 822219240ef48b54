# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recorded motion as simulations take it: on an even grid, positions and speeds smoothed without phase."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
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
    began: float = field(kw_only=True)  # [s] where the recording begins

    def near(self, begin: float, end: float) -> Track:
        """The rows between two times, and one more on both sides."""
        rows, more = (
            slice(max(np.searchsorted(time, begin) - 1, 0), np.searchsorted(time, end, "right") + 1)
            for time in (self.time, self.torque_time)
        )
        motion = (table[rows] for table in (self.time, self.q, self.qd, self.qdd))
        others = (table[more] for table in (self.torque_time, self.torque, self.temperature))
        return Track(*motion, *others, began=self.began)


@dataclass(frozen=True)
class Stretch:
    """Rows of a recording, between gaps."""

    name: str
    time: Floats
    position: Floats
    speed: Floats
    torque: Floats
    current: Floats
    columns: Mapping[str, Floats] = field(kw_only=True)


def stretches_of(recording: Recorded) -> list[Stretch]:
    """A recording cut at its gaps."""
    time = np.asarray(recording.time, dtype=float)
    cuts = np.flatnonzero(np.diff(time) > GAP * np.median(np.diff(time))) + 1
    tables = [
        np.asarray(table, dtype=float)
        for table in (recording.position, recording.speed, recording.torque, recording.current)
    ]
    return [
        Stretch(
            f"{recording.name} from {time[rows[0]]:.6g} s on" if cuts.size else recording.name,
            time[rows],
            *(table[rows] if len(table) == time.size else table for table in tables),
            columns={
                name: np.asarray(values, dtype=float)[rows] for name, values in recording.columns.items()
            },
        )
        for rows in np.split(np.arange(time.size), cuts)
    ]


def track_of(recording: Recorded, robot: _core.Robot, smoothing: float) -> tuple[Track, NDArray[np.bool_]]:
    """The recording on an even grid, and where that is not across a gap."""
    time, q = np.asarray(recording.time, dtype=float), np.asarray(recording.position, dtype=float)
    torque = measured_torque(recording, robot)
    step = float(np.median(np.diff(time)))
    half = max(int(round(smoothing / step)), 2)
    grid = np.arange(time[0], time[-1] + 1e-9, step)
    if grid.size < 4 * half:
        raise InputError(f"{recording.name}: {time[-1] - time[0]:.3g} s are too short to be simulated")
    smooth, slope = _cubics(table_at(time, q, grid), half, step)
    speed = np.asarray(recording.speed, dtype=float)
    if speed.shape == q.shape and np.all(np.isfinite(speed)):
        rate = _cubics(table_at(time, speed, grid), half, step)[0]
    else:
        rate = slope
    free = np.ones(grid.size, dtype=bool)
    for k in np.flatnonzero(np.diff(time) > GAP * step):
        free &= (grid < time[k] - smoothing) | (grid > time[k + 1] + smoothing)
    warm = temperatures(recording, torque.shape)
    return Track(
        grid, smooth, rate, _cubics(rate, half, step)[1], time, torque, warm, began=float(time[0])
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
    return _cubics(table, half, step)[0] if len(table) > 2 * half else table


def _cubics(table: Floats, half: int, step: float) -> tuple[Floats, Floats]:
    """Values and slopes of even rows, by the cubic through 2 half + 1 rows around each (Savitzky and Golay
    1964); of rows at the ends by the cubic through the first or last of them. shape=(n, columns)"""
    t = step * np.arange(-half, half + 1)
    powers = np.vander(t, 4, increasing=True)
    slopes = np.column_stack([np.zeros_like(t), np.ones_like(t), 2.0 * t, 3.0 * t * t])
    fit = np.linalg.pinv(powers)
    out = []
    for rows in (powers @ fit, slopes @ fit):
        middle = [np.convolve(column, rows[half, ::-1], mode="valid") for column in table.T]
        first, last = rows[:half] @ table[: 2 * half + 1], rows[-half:] @ table[-2 * half - 1 :]
        out.append(np.concatenate([first, np.column_stack(middle), last]))
    return out[0], out[1]


def table_at(time: Floats, table: Floats, at: Floats) -> Floats:
    return np.column_stack([np.interp(at, time, column) for column in table.T])
