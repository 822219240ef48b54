# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings as the simulation takes them: even rows, states smoothed, inputs beside the commands; and the
windows that they are cut into."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.motion import GAP, SMOOTHING, table_at
from truing.dynamics.smoothing import cubics
from truing.errors import InputError

Floats = NDArray[np.float64]

LONGEST_STEP = 0.002  # [s] of the simulator: half of the time in which MuJoCo's dry friction holds
_ROW = 0.0045  # [s] rows of faster recordings are thinned to no less
BLOCKS = 10  # of time, where no recording is held out
_FOLDS = 8  # at least: of fewer recordings each is parted into blocks of time
_FIRMWARE = ("kp{}_raw", "kp_raw")
_SUPPLY = ("volt{}_V", "volt_V")
_ENABLED = ("enabled{}", "enabled")
_WARMTH = ("temp{}_C", "temp_C")


@dataclass(frozen=True)
class Stream:
    """One recording, or a stretch of it between gaps, on even rows."""

    name: str  # of the recording
    fold: int  # number of the recording
    test: bool
    time: Floats  # shape=(n,) [s]
    step: float  # [s]
    command: Floats  # shape=(n, joints)
    position: Floats  # shape=(n, joints) as measured
    smooth: Floats  # shape=(n, joints)
    speed: Floats  # shape=(n, joints)
    gain: Floats  # shape=(n, joints or 1), over the reference
    supply: Floats
    enabled: Floats
    warmth: Floats  # [K] less the reference


@dataclass(frozen=True)
class ServoData:
    """All recordings, and what they hold beside commands and motion."""

    streams: tuple[Stream, ...]
    joints: int
    step: float  # [s] of the simulator
    torque_command: bool
    gain_reference: float
    supply_reference: float
    temperature_reference: float
    varies: frozenset[str]  # of 'gain', 'supply', 'warmth', 'enabled', what changes
    recordings: tuple[str, ...]
    blocks: bool  # blocks of time are held out, and not recordings


@dataclass(frozen=True)
class Window:
    """Rows of a stream, simulated from the state of the first."""

    stream: int
    first: int
    rows: int
    fold: int = 0
    test: bool = False


@dataclass
class _Columns:
    """Inputs of one kind in all recordings, and what they are counted from."""

    names: tuple[str, ...]
    usual: float
    values: list[Floats] = field(default_factory=list)

    def read(self, recording: _core.Recording, joints: int) -> Floats | None:
        n, found = len(recording), []
        for j in range(joints):
            name = next(
                (k for k in (form.format(j + 1) for form in self.names) if k in recording.columns), ""
            )
            found.append(np.asarray(recording.columns[name]) if name else None)
        if all(one is None for one in found):
            return None
        return np.column_stack([np.full(n, np.nan) if one is None else one for one in found])


def servo_data(
    recordings: Sequence[_core.Recording],
    joints: int,
    *,
    test_share: float = 0.3,
    smoothing: float = SMOOTHING,
) -> ServoData:
    """Recordings on even rows. Raises InputError that names the recording: no commands, other numbers of
    joints, angles or commands that are not numbers, too short."""
    if not recordings:
        raise InputError("no recordings are given: expected at least one")
    torque = all(r.torque_command.shape[1] and not r.command.shape[1] for r in recordings)
    for recording in recordings:
        _check(recording, joints, torque)
    step, every = _steps(recordings)
    inputs = {
        "gain": _Columns(_FIRMWARE, 1.0),
        "supply": _Columns(_SUPPLY, 1.0),
        "warmth": _Columns(_WARMTH, 0.0),
        "enabled": _Columns(_ENABLED, 1.0),
    }
    read = {
        name: [columns.read(recording, joints) for recording in recordings]
        for name, columns in inputs.items()
    }
    references = {name: _reference(name, values) for name, values in read.items()}
    streams = []
    for k, recording in enumerate(recordings):
        tables = {name: _relative(name, values[k], references[name]) for name, values in read.items()}
        streams += _streams(recording, k, torque, every[k], tables, smoothing)
    if not streams:
        raise InputError("no recording has 0.2 s without a gap")
    blocks = all(r.test == recordings[0].test for r in recordings)
    if blocks:
        streams = _unmarked(streams)
    return ServoData(
        tuple(streams),
        joints,
        step,
        torque,
        references["gain"],
        references["supply"],
        references["warmth"],
        frozenset(name for name in inputs if _changes(read[name])),
        tuple(r.name for r in recordings),
        blocks,
    )


def _check(recording: _core.Recording, joints: int, torque: bool) -> None:
    if recording.pieces is not None:
        raise InputError(
            f"{recording.name}: is longer than memory, in which what is simulated by commands must be: part"
            " it into files of some hours"
        )
    command = recording.torque_command if torque else recording.command
    if command.shape[1] == 0:
        raise InputError(
            f"{recording.name}: there are no commands (u1_rad … or u1_Nm …), which a diagnosis without"
            " torques needs"
        )
    if command.shape[1] != joints or recording.position.shape[1] != joints:
        raise InputError(
            f"{recording.name}: positions of {recording.position.shape[1]} joints and commands of"
            f" {command.shape[1]}, expected {joints} of each"
        )
    for what, table in (("position", recording.position), ("command", command)):
        bad = ~np.isfinite(np.asarray(table))
        if bad.any():
            row, joint = (int(i[0]) for i in np.nonzero(bad))
            raise InputError(
                f"{recording.name}: {what} of joint {joint + 1}, row {row + 1}: found no number, expected one"
                " in every row"
            )


def _steps(recordings: Sequence[_core.Recording]) -> tuple[float, list[float]]:
    """The simulator's step, and between rows of each recording: a whole number of these."""
    usual = [float(np.median(np.diff(np.asarray(r.time)))) for r in recordings]
    rows = [dt * max(1, math.ceil(_ROW / dt - 1e-6)) for dt in usual]
    finest = min(rows)
    step = finest / math.ceil(finest / LONGEST_STEP - 1e-6)
    return step, [step * max(1, round(row / step)) for row in rows]


def _reference(name: str, values: Sequence[Floats | None]) -> float:
    there = [v[np.isfinite(v)] for v in values if v is not None]
    if name == "enabled" or not there:
        return {"warmth": 25.0}.get(name, 1.0)
    if name == "gain":
        logs = np.log(np.maximum(np.unique(np.concatenate(there)), 1e-9))
        return float(np.exp(np.mean(logs)))
    return float(np.mean(np.concatenate(there)))


def _relative(name: str, values: Floats | None, reference: float) -> Floats | None:
    if values is None:
        return None
    if name == "warmth":
        return np.asarray(np.nan_to_num(values - reference))
    if name == "enabled":
        return np.asarray(np.nan_to_num(values, nan=1.0))
    return np.asarray(np.nan_to_num(values / reference, nan=1.0))


def _changes(values: Sequence[Floats | None]) -> bool:
    there = [v[np.isfinite(v)] for v in values if v is not None]
    return bool(there) and float(np.ptp(np.concatenate(there))) > 1e-9


def _streams(
    recording: _core.Recording,
    number: int,
    torque: bool,
    step: float,
    tables: dict[str, Floats | None],
    smoothing: float,
) -> list[Stream]:
    time = np.asarray(recording.time, dtype=float)
    command = np.asarray(recording.torque_command if torque else recording.command, dtype=float)
    position = np.asarray(recording.position, dtype=float)
    usual = float(np.median(np.diff(time)))
    out = []
    for rows in np.split(np.arange(time.size), np.flatnonzero(np.diff(time) > GAP * usual) + 1):
        if rows.size < 20 or time[rows[-1]] - time[rows[0]] < 0.2:
            continue
        t = time[rows]
        grid = t[0] + step * np.arange(int((t[-1] - t[0]) / step + 1e-6) + 1)
        fine = t[0] + usual * np.arange(int((t[-1] - t[0]) / usual + 1e-6) + 1)
        smooth, speed = cubics(
            table_at(t, position[rows], fine), max(int(round(smoothing / usual)), 2), usual
        )
        # Of the nearest row: times that shake by a rounding would else take commands a whole row late.
        held = rows[np.clip(np.searchsorted(t, grid + 0.5 * usual, "right") - 1, 0, rows.size - 1)]
        inputs = {
            name: np.full((1, 1), 0.0 if name == "warmth" else 1.0) if table is None else table[held]
            for name, table in tables.items()
        }
        out.append(
            Stream(
                recording.name,
                number,
                bool(recording.test),
                grid,
                step,
                np.ascontiguousarray(command[held]),
                table_at(t, position[rows], grid),
                table_at(fine, smooth, grid),
                table_at(fine, speed, grid),
                **inputs,
            )
        )
    return out


def _unmarked(streams: Sequence[Stream]) -> list[Stream]:
    """Where all recordings are marked alike none is held out as a whole."""
    return [Stream(**{**vars(stream), "test": False}) for stream in streams]


def windows_of(data: ServoData, length: float, *, test_share: float = 0.3) -> list[Window]:
    """Every stream cut into windows of about `length` [s], one after the other; those of streams that are
    less than 1.6 times as long are whole. Where no recording is held out, blocks of time are."""
    out = []
    fitted = len({stream.fold for stream in data.streams if not stream.test})
    parts = min(BLOCKS, max(1, math.ceil(_FOLDS / max(fitted, 1))))
    for s, stream in enumerate(data.streams):
        n = stream.time.size - 1
        seconds = n * stream.step
        if not math.isfinite(length) or seconds < 1.6 * length:
            edges = np.array([0, n])
        else:
            edges = np.round(np.linspace(0, n, max(1, round(seconds / length)) + 1)).astype(int)
        for first, end in zip(edges[:-1], edges[1:], strict=True):
            block = min(int(BLOCKS * (first + end) / (2.0 * n)), BLOCKS - 1)
            held = math.floor((block + 1) * test_share + 0.5) > math.floor(block * test_share + 0.5)
            test = (data.blocks and held and edges.size > 2) or stream.test
            out.append(
                Window(s, int(first), int(end - first), stream.fold * parts + block * parts // BLOCKS, test)
            )
    if data.blocks and not any(w.test for w in out):
        out = [
            Window(w.stream, w.first, w.rows, w.fold, k % 3 == 2) if len(out) > 3 else w
            for k, w in enumerate(out)
        ]
    return out
