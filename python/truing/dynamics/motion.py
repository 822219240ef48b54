# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recorded motion as simulations take it: on an even grid, positions and speeds smoothed without phase."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.api import PAYLOAD_COLUMNS
from truing.dynamics.recorded import Recorded, driven_joints, measured_torque
from truing.dynamics.smoothing import cubics, even_times, rows_within
from truing.errors import InputError

Floats = NDArray[np.float64]

SMOOTHING = 0.05  # [s] half of the stretch whose cubic gives a smoothed value
GAP = 5.0  # of the usual time between rows: a gap
PAYLOAD_STEP = 0.01  # of the heaviest payload: a change, of which a simulation at one payload knows nothing
_SAME_TIME = 1e-9  # [s] by which times that were added up may miss a row


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
    payload: Floats  # shape=(n, 4) [kg, m], as the torques: a point mass and its place in the tool's frame
    step: float = field(kw_only=True)  # [s] between rows of the motion, gaps aside
    began: float = field(kw_only=True)  # [s] where the recording begins

    @property
    def stretches(self) -> list[tuple[float, float]]:
        """[s] begin and end of what is between gaps."""
        cuts = np.flatnonzero(np.diff(self.time) > GAP * self.step)
        begins, ends = self.time[[0, *(cuts + 1)]], self.time[[*cuts, -1]]
        return list(zip(begins.tolist(), ends.tolist(), strict=True))

    def near_gap(self, distance: float) -> NDArray[np.bool_]:
        """Rows nearer to a gap than `distance` [s]: smoothing mixed both sides of it. shape=(n,)"""
        out = np.zeros(self.time.size, dtype=bool)
        for (_, end), (begin, _) in itertools.pairwise(self.stretches):
            out |= (self.time > end - distance) & (self.time < begin + distance)
        return out

    def near(self, begin: float, end: float) -> Track:
        """The rows between two times, and one more on both sides."""
        rows, more = (
            slice(max(np.searchsorted(time, begin) - 1, 0), np.searchsorted(time, end, "right") + 1)
            for time in (self.time, self.torque_time)
        )
        motion = (table[rows] for table in (self.time, self.q, self.qd, self.qdd))
        others = (table[more] for table in (self.torque_time, self.torque, self.temperature, self.payload))
        return Track(*motion, *others, step=self.step, began=self.began)

    def payload_at(self, time: float) -> Floats:
        """That of the last row until `time` [s], as rows of `payload`. shape=(4,)"""
        row = int(np.searchsorted(self.torque_time, time + _SAME_TIME, "right")) - 1
        return np.asarray(self.payload[max(row, 0)])

    def one_payload(self, begin: float, end: float) -> bool:
        """Whether it does not change between two times [s]."""
        first, last = np.searchsorted(self.torque_time, (begin - _SAME_TIME, end + _SAME_TIME))
        mass = self.payload[first:last, 0]
        return mass.size == 0 or bool(np.ptp(mass) <= PAYLOAD_STEP * self.heaviest)

    @cached_property
    def heaviest(self) -> float:
        """[kg] the largest payload."""
        return float(self.payload[:, 0].max())


@dataclass(frozen=True)
class Stretch:
    """Rows of a recording, between gaps and changes of its payload."""

    name: str
    time: Floats
    position: Floats
    speed: Floats
    torque: Floats
    current: Floats
    columns: Mapping[str, Floats] = field(kw_only=True)


def stretches_of(recording: Recorded) -> list[Stretch]:
    """A recording cut at its gaps, and where its payload changes."""
    time = np.asarray(recording.time, dtype=float)
    mass = payloads(recording)[:, 0]
    gaps = np.diff(time) > GAP * np.median(np.diff(time))
    cuts = np.flatnonzero(gaps | (np.abs(np.diff(mass)) > PAYLOAD_STEP * mass.max())) + 1
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
    return even_track(recording, driving_torque(recording, robot), smoothing)


def even_track(recording: Recorded, torque: Floats, smoothing: float) -> tuple[Track, NDArray[np.bool_]]:
    """The same with torques of its rows, shape=(n, joints) [Nm | N]; (n, 0): without any."""
    time, q = np.asarray(recording.time, dtype=float), np.asarray(recording.position, dtype=float)
    step = float(np.median(np.diff(time))) if time.size > 1 else np.inf
    half, gaps = rows_within(smoothing, step), np.flatnonzero(np.diff(time) > GAP * step)
    grid = even_times(time, step, gaps) if time.size > 1 else time
    if grid.size < 4 * half:
        raise InputError(f"{recording.name}: {time[-1] - time[0]:.3g} s are too short to be simulated")
    smooth, slope = cubics(table_at(time, q, grid), half, step)
    speed = np.asarray(recording.speed, dtype=float)
    if speed.shape == q.shape and np.all(np.isfinite(speed)):
        rate = cubics(table_at(time, speed, grid), half, step)[0]
    else:
        rate = slope
    free = np.ones(grid.size, dtype=bool)
    for k in gaps:
        free &= (grid < time[k] - smoothing) | (grid > time[k + 1] + smoothing)
    warm = temperatures(recording, (time.size, torque.shape[1]))
    motion = (grid, smooth, rate, cubics(rate, half, step)[1])
    drives = (time, torque, warm, payloads(recording))
    return Track(*motion, *drives, step=step, began=float(time[0])), free


def driving_torque(recording: Recorded, robot: _core.Robot) -> Floats:
    """shape=(n, joints) [Nm | N]: torques as recorded, or currents times the robot's torque_per_ampere.
    Raises InputError where neither, or a position, is a number in every row."""
    torque = measured_torque(robot, recording, unknown=np.nan)
    position = np.asarray(recording.position, dtype=float)
    if position.shape != torque.shape or not np.all(np.isfinite(position)):
        raise InputError(
            f"{recording.name}: positions of shape {position.shape}, or not all numbers, expected"
            f" {torque.shape} numbers"
        )
    missing = [
        joint.name
        for joint, column in zip(driven_joints(robot), torque.T, strict=True)
        if not np.all(np.isfinite(column))
    ]
    if missing:
        raise InputError(
            f"{recording.name}: no torques, and no currents with the robot's torque_per_ampere, in every row"
            f" of {', '.join(missing)}: a simulation of torques cannot be driven"
        )
    return torque


def temperatures(recording: Recorded, shape: tuple[int, int]) -> Floats:
    """shape=(n, joints) [deg C]: columns 'temp1_C' … of the joints, or 'temp_C' of all; NaN without."""
    columns = {name: np.asarray(values, dtype=float) for name, values in recording.columns.items()}
    common = columns.get("temp_C", np.full(shape[0], np.nan))
    return np.array([columns.get(f"temp{j + 1}_C", common) for j in range(shape[1])]).reshape(shape[::-1]).T


def payloads(recording: Recorded) -> Floats:
    """shape=(n, 4) [kg, m]: columns 'payload_kg' and 'payload_x_m' … where it hangs; zero without."""
    n = np.size(recording.time)
    return np.column_stack(
        [np.asarray(recording.columns.get(name, np.zeros(n)), dtype=float) for name in PAYLOAD_COLUMNS]
    )


def smoothed(table: Floats, step: float, smoothing: float) -> Floats:
    """Even rows, each by the cubic through those within `smoothing` [s] on both sides."""
    half = rows_within(smoothing, step)
    return cubics(table, half, step)[0] if len(table) > 2 * half else table


def table_at(time: Floats, table: Floats, at: Floats) -> Floats:
    return np.column_stack([np.interp(at, time, column) for column in table.T])
