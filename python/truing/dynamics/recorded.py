# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What was recorded of a robot's drives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from truing import _core

Floats = NDArray[np.float64]

OFF = 0.5  # of the column `enabled`: below it the drives gave no torque


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


TABLES = ("position", "speed", "torque", "current", "command", "speed_command", "torque_command")


def with_rows(
    recording: _core.Recording, kept: NDArray[np.bool_], changed: Mapping[str, Floats] | None = None
) -> _core.Recording:
    """These rows alone. kept: shape=(n,); changed: tables by name, with all rows, in place of its own."""
    tables = {name: np.asarray(getattr(recording, name)) for name in TABLES} | dict(changed or {})
    fields: dict[str, Any] = {name: table[kept] for name, table in tables.items() if table.shape[1]}
    columns = {name: np.asarray(values)[kept] for name, values in recording.columns.items()}
    time = np.asarray(recording.time)[kept]
    fields |= {"columns": columns, "torque_is_mean": recording.torque_is_mean, "test": recording.test}
    return _core.Recording(recording.name, time=time, **fields)


@dataclass(frozen=True)
class _Changed:
    """Pieces of a recording, each changed as it is read."""

    read: Callable[[], Iterator[_core.Recording]]
    change: Callable[[_core.Recording], _core.Recording]

    def __call__(self) -> Iterator[_core.Recording]:
        return map(self.change, self.read())


def of_all_rows(
    recording: _core.Recording, change: Callable[[_core.Recording], _core.Recording]
) -> _core.Recording:
    """What `change` makes of a recording; of one that is read in pieces, of each of them. It must not depend
    on the rows before."""
    changed = change(recording)
    if recording.pieces is None:
        return changed
    return changed.replace(pieces=_Changed(recording.pieces, change), end=recording.end)


def by_commands(recordings: Sequence[_core.Recording]) -> bool:
    """Whether all recordings have commands, and none has torques or currents."""
    torques = any(r.torque.shape[1] or r.current.shape[1] for r in recordings)
    commands = all(r.command.shape[1] or r.torque_command.shape[1] for r in recordings)
    return bool(recordings) and commands and not torques


def driven_joints(robot: _core.Robot) -> list[_core.Joint]:
    """The joints that have a reading, in chain order."""
    return [robot.joints[index] for index in robot.driven_joints()]


def torque_unit(joint: _core.Joint) -> str:
    return "Nm" if joint.type == "revolute" else "N"


def measured_torque(robot: _core.Robot, recording: Recorded, unknown: float = 1.0) -> Floats:
    """Torques as measured, else currents times the drives' constants; NaN where there is neither.
    shape=(n, joints) [Nm | N]

    unknown: [Nm/A | N/A] constant of a drive whose own is not known.
    """
    gains = [
        unknown if joint.torque_per_ampere is None else joint.torque_per_ampere
        for joint in driven_joints(robot)
    ]
    out = np.full((np.size(recording.time), len(gains)), np.nan)
    torque, current = (np.asarray(table, dtype=float) for table in (recording.torque, recording.current))
    if current.shape == out.shape:
        out = current * gains
    if torque.shape == out.shape:
        out = np.where(np.isnan(torque), out, torque)
    return out
