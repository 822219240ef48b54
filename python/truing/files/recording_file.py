# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of motion, from whatever file they are in."""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from truing import _core
from truing.errors import InputError
from truing.files.common import PathLike, listed, shown
from truing.files.recording_bag import is_bag, read_bag
from truing.files.recording_lerobot import LeRobotUnits, is_lerobot, read_lerobot
from truing.files.recording_parts import split_joints
from truing.files.recording_rtde import is_rtde, read_rtde
from truing.files.recording_table import read_table

_WILD = "*?["


def load_recordings(
    paths: PathLike | Sequence[PathLike],
    robot: _core.Robot,
    *,
    joints: Sequence[str] | str | None = None,
    topic: str | None = None,
    units: LeRobotUnits | None = None,
) -> tuple[_core.Recording, ...]:
    """Read recordings of motion of `robot`: CSV and Parquet files, ROS bags, LeRobot data sets, or patterns
    such as "runs/*.csv".

    One file is one recording, called as the file without its ending. Columns, with their unit in the name:
    t_s; q1_rad ... for the joints that have a reading, in chain order; where there, qd1_rad_s ...,
    tau1_Nm ... or i1_A ..., u1_rad ... or u1_Nm ..., ud1_rad_s ..., payload_kg, temp1_C or temp_C, volt_V,
    enabled, set. Any other column of numbers is kept in `Recording.columns` under its name. Lines that begin
    with # are comments. Stamps since 1970 are counted from the first row on. Where `set` changes within a
    file, each run of rows is a recording of its own: name#1, name#2.

    Of a bag (rosbag2, .mcap, .db3, .bag; needs truing[bags]) the joint states are read: position, velocity,
    effort of the joints by name. Every episode of a LeRobot data set (its folder) is a recording: the state
    of the joints by name, and the actions as commands. A CSV file of Universal Robots' RTDE (timestamp,
    actual_q_0, actual_current_0 ..., as its recorder and ur_rtde write it) is read by its outputs' names.

    A Parquet file of more than 25 million cells stays on disk: every pass over the recording reads it again,
    a piece at a time (`Recording.pieces`). It is one recording, of one set.

    joints: which of the robot's joints each joint of the file is, in the file's order, "-" for none; absent:
    a table has the robot's joints in chain order, and names are the robot's.
    topic: of the joint states, where a bag has several.
    units: of the positions of a LeRobot data set, which does not say: "deg", "rad", or "percent" for -100 to
    100 of the range between the joint's limits.
    Raises InputError that names the file, the line, the column, what was found and what was expected. Warns
    (InputWarning) of columns without a meaning of their own that are left out, as they have gaps.
    """
    names = split_joints(joints)
    found = _expanded([paths] if isinstance(paths, (str, os.PathLike)) else list(paths))
    _refuse_idle("--topic (in Python: topic=) is of bags", topic, found, is_bag)
    _refuse_idle("--units (in Python: units=) is of LeRobot data sets", units, found, is_lerobot)
    out: list[_core.Recording] = []
    for path, name in zip(found, _names(found), strict=True):
        if is_bag(path):
            out += read_bag(path, name, robot, names, topic)
        elif is_lerobot(path):
            out += read_lerobot(path, name, robot, names, units)
        elif path.is_dir():
            raise InputError(
                f"{path}: is a folder, and neither a bag (metadata.yaml) nor a LeRobot data set"
                f" (meta/info.json): its files are meant by {str(path / '*.csv')!r}"
            )
        elif is_rtde(path):
            out += read_rtde(path, name, robot, names)
        else:
            out += read_table(path, name, robot, names)
    return tuple(out)


def _refuse_idle(what: str, value: object, paths: Sequence[Path], suits: Callable[[Path], bool]) -> None:
    """An option that none of the files takes was meant for others."""
    if value is not None and not any(suits(path) for path in paths):
        raise InputError(
            f"{what}: there is none among the recordings, {listed([str(path) for path in paths])}"
        )


def _expanded(paths: Sequence[PathLike]) -> list[Path]:
    """The files that are meant, patterns filled in, each once."""
    found: list[Path] = []
    for given in paths:
        path = Path(given)
        if any(sign in str(given) for sign in _WILD) and not path.exists():
            matches = sorted(glob.glob(str(given), recursive=True))
            if not matches:
                raise InputError(f"{shown(str(given))}: no file matches this pattern")
            found += [Path(match) for match in matches]
        else:
            found.append(path)
    if not found:
        raise InputError("no recordings are given: expected at least one file")
    for path, count in Counter(path.resolve() for path in found).items():
        if count > 1:
            raise InputError(f"{path}: is given {count} times: a recording counts once")
    return found


def _names(paths: Sequence[Path]) -> list[str]:
    """What recordings are called: the file without its ending, with its folders where that is not unique."""
    stems = Counter(path.stem for path in paths)
    return [path.stem if stems[path.stem] == 1 else path.as_posix() for path in paths]
