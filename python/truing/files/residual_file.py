# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""``residuals.parquet`` and ``motion.parquet`` of ``truing dynamics``, read as the recordings that they were
made of."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError

Floats = NDArray[np.float64]
_OTHER = re.compile(r"temp\d*_C|payload_(kg|[xyz]_m|found)", re.ASCII)  # what models know of besides


def load_residual_motion(path: Path, robot: _core.Robot) -> list[tuple[_core.Recording, NDArray[np.bool_]]]:
    """Recordings of a diagnosis or fit, and which of their rows were held out.

    Raises InputError: no Parquet file, or one that lacks the motion of the robot's joints.
    """
    table = _table(path)
    joints = [robot.joints[index] for index in robot.driven_joints()]
    turns = [joint.type == "revolute" for joint in joints]
    positions = [f"q{k}_{'rad' if turn else 'm'}" for k, turn in enumerate(turns, 1)]
    torques = [f"tau{k}_{'Nm' if turn else 'N'}" for k, turn in enumerate(turns, 1)]
    speeds = [f"qd{k}_{'rad_s' if turn else 'm_s'}" for k, turn in enumerate(turns, 1)]
    missing = [n for n in ("recording", "set", "t_s", *positions, *torques) if n not in table.column_names]
    if missing:
        raise InputError(
            f"{path}: has no column {missing[0]}, expected the residuals.parquet that `truing dynamics"
            " diagnose` or `identify` of this version wrote for this robot: run it again"
        )
    # A column for each name; rows of one recording follow each other.
    columns: dict[str, Any] = {name: table[name].to_numpy() for name in table.column_names}
    names = columns["recording"].astype(str)
    others = [name for name in columns if _OTHER.fullmatch(name)]
    out = []
    for rows in _by_recording(names):
        held = columns["set"][rows].astype(str) == "test"
        speed = _stacked(columns, speeds, rows) if speeds[0] in columns else None
        recording = _core.Recording(
            str(names[rows[0]]),
            time=columns["t_s"][rows],
            position=_stacked(columns, positions, rows),
            speed=None if speed is None or np.isnan(speed).any() else speed,
            torque=_stacked(columns, torques, rows),
            columns={name: columns[name][rows] for name in others if not np.isnan(columns[name][rows]).any()},
            test=bool(held.all()),
        )
        out.append((recording, held))
    return out


def _stacked(columns: dict[str, Any], names: list[str], rows: NDArray[np.intp]) -> Floats:
    return np.column_stack([columns[name][rows] for name in names])


def _table(path: Path) -> Any:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        return pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: cannot be read as Parquet: {error}") from None


def _by_recording(names: NDArray[np.str_]) -> list[NDArray[np.intp]]:
    """Rows of each recording, which follow each other."""
    return np.split(np.arange(names.size), np.flatnonzero(names[1:] != names[:-1]) + 1)


# ---- Motion from commands ----------------------------------------------------------------------------
def commanded_columns(
    recordings: Sequence[_core.Recording], prismatic: Sequence[bool], held: Sequence[NDArray[np.bool_]]
) -> dict[str, Any]:
    """Columns of ``motion.parquet``: commands and positions of every row, and what else was recorded.

    prismatic: of each joint. held: which rows of each recording were held out.
    """
    units = ["m" if slides else "rad" for slides in prismatic]
    torque = any(recording.torque_command.shape[1] for recording in recordings)
    forces = ["N" if slides else "Nm" for slides in prismatic]
    counts = [len(recording) for recording in recordings]
    columns: dict[str, Any] = {
        "recording": np.repeat([recording.name for recording in recordings], counts),
        "set": np.where(np.concatenate(held), "test", "train"),
        "t_s": np.concatenate([recording.time for recording in recordings]),
    }
    for j, unit in enumerate(units):
        columns[f"q{j + 1}_{unit}"] = np.concatenate([r.position[:, j] for r in recordings])
        command = [r.torque_command[:, j] if torque else r.command[:, j] for r in recordings]
        columns[f"u{j + 1}_{forces[j] if torque else unit}"] = np.concatenate(command)
    for name in sorted({name for recording in recordings for name in recording.columns} - set(columns)):
        each = [np.asarray(r.columns.get(name, np.full(len(r), np.nan))) for r in recordings]
        columns[name] = np.concatenate(each)
    return columns


def load_commanded_motion(
    path: Path, prismatic: Sequence[bool]
) -> list[tuple[_core.Recording, NDArray[np.bool_]]]:
    """Recordings of a diagnosis from commands, and which of their rows were held out. Raises InputError."""
    table = _table(path)
    columns: dict[str, Any] = {name: table[name].to_numpy() for name in table.column_names}
    places = [f"q{j + 1}_{'m' if slides else 'rad'}" for j, slides in enumerate(prismatic)]
    torques = [f"u{j + 1}_{'N' if slides else 'Nm'}" for j, slides in enumerate(prismatic)]
    positions = [f"u{j + 1}_{'m' if slides else 'rad'}" for j, slides in enumerate(prismatic)]
    by_torque = torques[0] in columns
    commands = torques if by_torque else positions
    named = ("recording", "set", "t_s", *places, *commands)
    missing = [name for name in named if name not in columns]
    if missing:
        raise InputError(
            f"{path}: has no column {missing[0]}, expected the motion.parquet of `truing dynamics diagnose`"
            " for this arm: run it again"
        )
    out = []
    for rows in _by_recording(columns["recording"].astype(str)):
        held = columns["set"][rows].astype(str) == "test"
        others = {n: v[rows] for n, v in columns.items() if n not in named and not np.isnan(v[rows]).any()}
        drive = _stacked(columns, list(commands), rows)
        recording = _core.Recording(
            str(columns["recording"][rows[0]]),
            time=columns["t_s"][rows],
            position=_stacked(columns, places, rows),
            columns=others,
            test=bool(held.all()),
            command=None if by_torque else drive,
            torque_command=drive if by_torque else None,
        )
        out.append((recording, held))
    return out
