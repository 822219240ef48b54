# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""``residuals.parquet`` of ``truing dynamics``, read as the recordings that it was made of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError

Floats = NDArray[np.float64]


def load_residual_motion(path: Path, robot: _core.Robot) -> list[tuple[_core.Recording, NDArray[np.bool_]]]:
    """Recordings of a diagnosis or fit, and which of their rows were held out.

    Raises InputError: no Parquet file, or one that lacks the motion of the robot's joints.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: cannot be read as Parquet: {error}") from None
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
    warm = [name for name in columns if name.startswith("temp") and name.endswith("_C")]
    out = []
    for rows in np.split(np.arange(names.size), np.flatnonzero(names[1:] != names[:-1]) + 1):
        held = columns["set"][rows].astype(str) == "test"
        speed = _stacked(columns, speeds, rows) if speeds[0] in columns else None
        recording = _core.Recording(
            str(names[rows[0]]),
            time=columns["t_s"][rows],
            position=_stacked(columns, positions, rows),
            speed=None if speed is None or np.isnan(speed).any() else speed,
            torque=_stacked(columns, torques, rows),
            columns={name: columns[name][rows] for name in warm if not np.isnan(columns[name][rows]).any()},
            test=bool(held.all()),
        )
        out.append((recording, held))
    return out


def _stacked(columns: dict[str, Any], names: list[str], rows: NDArray[np.intp]) -> Floats:
    return np.column_stack([columns[name][rows] for name in names])
