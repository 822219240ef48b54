# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What all readers of recordings share: which joint a column belongs to, times, and the recording that comes
of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np

from truing import _core
from truing.errors import InputError
from truing.files.common import listed
from truing.files.table import Floats

# A joint of the file that is none of the robot's, in `joints`.
NO_JOINT = "-"

_EPOCH = 1e8  # [s] no machine runs for three years: larger stamps count from 1970
_SLOWEST = 10.0  # [s] a median step above this is no stream of seconds
_FASTEST = 1e-5  # [s] nor is one below this

# Raises InputError about a row (counted from 0), a column, or the whole.
Refuse = Callable[..., NoReturn]


def split_joints(joints: Sequence[str] | str | None) -> list[str] | None:
    """Names of joints, also as one text with commas."""
    if joints is None:
        return None
    names = joints.split(",") if isinstance(joints, str) else list(joints)
    return [name.strip() for name in names]


def joints_of_numbers(robot: _core.Robot, joints: Sequence[str] | None) -> dict[int, int]:
    """Which joint of the robot (counted from 0, among those with a reading) each number of the file is."""
    names = [robot.joints[index].name for index in robot.driven_joints()]
    if joints is None:
        return {number: number - 1 for number in range(1, len(names) + 1)}
    place = {name: k for k, name in enumerate(names)}
    found: dict[int, int] = {}
    for number, name in enumerate(joints, 1):
        if name == NO_JOINT:
            continue
        if name not in place:
            raise InputError(
                f"joints: the robot has no joint {name!r} with a reading; it has {listed(names)} (write"
                f" {NO_JOINT!r} for a joint of the file that is none of the robot's)"
            )
        if place[name] in found.values():
            raise InputError(f"joints: {name!r} is there twice")
        found[number] = place[name]
    missing = [name for name in names if name not in joints]
    if missing:
        raise InputError(
            f"joints: there is no {listed(missing)}: name the robot's joint of every column of the file, in"
            " the file's order"
        )
    return found


def joints_of_names(
    robot: _core.Robot, joints: Sequence[str] | None, there: Sequence[str], where: str
) -> list[int]:
    """For each of the robot's joints with a reading its place among the file's names: by equal names, or by
    `joints`, which says what the file's joints are called in the robot, in the file's order.
    """
    names = [robot.joints[index].name for index in robot.driven_joints()]
    if joints is None:
        missing = [name for name in names if name not in there]
        if missing:
            raise InputError(
                f"{where}: there is no joint {listed(missing)}; the joints there are {listed(list(there))}:"
                " say with joints= what each of these is called in the robot, in this order"
                f" ({NO_JOINT!r} for none)"
            )
        return [list(there).index(name) for name in names]
    numbers = joints_of_numbers(robot, joints)
    if max(numbers) > len(there):
        raise InputError(
            f"{where}: has {len(there)} joints, {listed(list(there))}; joints names {len(joints)}"
        )
    of_joint = {joint: number - 1 for number, joint in numbers.items()}
    return [of_joint[k] for k in range(len(names))]


def checked_times(t: Floats, refuse: Refuse, column: str, first: float | None = None) -> Floats:
    """The stamps [s], from 0 on if they count from 1970. Refuses those that do not increase. first: stamp of
    the recording's first row, where these are later ones.
    """
    first = float(t[0]) if first is None else first
    wrong = np.flatnonzero(np.diff(t) <= 0)
    if wrong.size:
        row = int(wrong[0]) + 1
        if t[row] == t[row - 1]:
            refuse(
                f"found {t[row]:.15g} s a second time, expected one row for each instant ({wrong.size} such"
                " rows): remove the repeated rows, or write the stamps with more digits",
                row=row,
                column=column,
            )
        refuse(
            f"time goes backwards: found {t[row]:.15g} s after {t[row - 1]:.15g} s, expected growing times:"
            " sort the rows, or split the file where another recording begins",
            row=row,
            column=column,
        )
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    if not _FASTEST < step < _SLOWEST:
        refuse(
            f"rows are {step:.4g} s apart: the unit in the name of the column, s, ms, us or ns, seems to be"
            " another one than that of its numbers",
            column=column,
        )
    return t - first if abs(first) > _EPOCH else t


def table_of(rows: int, joints: int) -> Floats:
    """A table of joints that nobody recorded so far; columns lie in one piece, as the core has them."""
    return np.full((rows, joints), np.nan, order="F")


def make_recordings(
    where: str,
    name: str,
    robot: _core.Robot,
    tables: Mapping[str, Floats],
    columns: Mapping[str, Floats],
    test: Any = None,
) -> list[_core.Recording]:
    """One recording, or as many as there are runs of rows of one set (`test`: per row).

    `tables` has "time", "position" and what else was recorded, by the names that `Recording` has.
    """
    rows = len(tables["time"])
    if test is None:
        test = np.zeros(rows, dtype=np.bool_)
    starts = [0, *(np.flatnonzero(test[1:] != test[:-1]) + 1), rows]
    out = []
    for run, (start, end) in enumerate(zip(starts[:-1], starts[1:], strict=True), 1):
        part = slice(start, end) if len(starts) > 2 else slice(None)
        keywords: dict[str, Any] = {field: values[part] for field, values in tables.items()}
        try:
            recording = _core.Recording(
                name if len(starts) == 2 else f"{name}#{run}",
                columns={key: values[part] for key, values in columns.items()},
                test=bool(test[start]),
                **keywords,
            )
            _core.validate_recording(recording, robot)
        except ValueError as error:
            raise InputError(f"{where}: {error}") from None
        out.append(recording)
    return out
