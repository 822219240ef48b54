# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of motion in ROS bags: sensor_msgs/JointState in rosbag2 folders, .mcap and .db3 files, without
ROS.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from truing import _core
from truing.errors import InputError
from truing.files.common import listed
from truing.files.output import reason, require_whole_file
from truing.files.recording_parts import checked_times, joints_of_names, make_recordings
from truing.files.table import Floats

BAG_SUFFIXES = (".mcap", ".db3", ".bag")
_JOINT_STATE = "sensor_msgs/msg/JointState"
_FIELDS = {"position": "position", "velocity": "speed", "effort": "torque"}  # of a message, of a recording


def is_bag(path: Path) -> bool:
    return path.suffix.lower() in BAG_SUFFIXES or (path / "metadata.yaml").is_file()


def read_bag(
    path: Path, name: str, robot: _core.Robot, joints: Sequence[str] | None, topic: str | None
) -> list[_core.Recording]:
    """The one recording of a bag."""
    require_whole_file(path)
    if not path.exists():
        raise InputError(f"{path}: cannot be read: there is no such file")
    rows = _Rows(path, robot, joints)
    for where, received, message in _messages(path, topic):
        rows.take(where, received, message)
    where, stamps, tables = rows.result()

    def refuse(message: str, *, row: int | None = None, column: str | None = None) -> NoReturn:
        place = where if row is None else f"{where}, message {row + 1} of these joints"
        raise InputError(f"{place}: {message}")

    names = [robot.joints[index].name for index in robot.driven_joints()]
    out = {"time": checked_times(stamps, refuse, "stamp")}
    for field, values in tables.items():
        found = _recorded(values, names, field, refuse)
        if found is not None:
            out[_FIELDS[field]] = found
    return make_recordings(where, name, robot, out, {})


def _messages(path: Path, topic: str | None) -> Iterator[tuple[str, int, Any]]:
    """File and topic for error messages, the recorder's stamp [ns], and each message of joint states."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(
            f"{path}: bags are read by the package rosbags, which is not installed: pip install"
            " 'truing[bags]'"
        ) from None
    # Bags of releases before Iron do not hold the definitions of their messages.
    usual = get_typestore(Stores.ROS1_NOETIC if path.suffix.lower() == ".bag" else Stores.ROS2_HUMBLE)
    try:
        with AnyReader([path], default_typestore=usual) as reader:
            used = _topic(path, topic, {c.topic: c.msgtype for c in reader.connections})
            wanted = [c for c in reader.connections if c.topic == used]
            for connection, stamp, data in reader.messages(wanted):
                yield f"{path}, topic {used}", stamp, reader.deserialize(data, connection.msgtype)
    except InputError:
        raise
    except Exception as error:  # of storage, of compression, of messages: a damaged file may raise anything
        text = reason(error) if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
        raise InputError(f"{path}: cannot be read as a bag: {' '.join(text.split())[:200]}") from None


def _topic(path: Path, topic: str | None, types: dict[str, str]) -> str:
    """The topic of joint states that is meant."""
    there = [name for name, kind in types.items() if kind == _JOINT_STATE]
    if topic is not None:
        if topic in there:
            return topic
        found = f"holds {types[topic]}" if topic in types else "is not there"
        raise InputError(
            f"{path}: the topic {topic!r} {found}, expected one of sensor_msgs/JointState:"
            f" {listed(there) or 'there is none'}"
        )
    if not there:
        raise InputError(
            f"{path}: holds no topic of sensor_msgs/JointState; its topics are"
            f" {listed([f'{name} ({kind})' for name, kind in types.items()]) or 'none'}"
        )
    if len(there) > 1:
        raise InputError(
            f"{path}: holds several topics of joint states, {listed(there)}: choose one with"
            " --topic (in Python: topic=)"
        )
    return there[0]


class _Rows:
    """The messages that have all of the robot's joints, as rows of numbers; the others are passed over."""

    def __init__(self, path: Path, robot: _core.Robot, joints: Sequence[str] | None) -> None:
        self._path = path
        self._robot = robot
        self._joints = joints
        self._missing = np.full(len(robot.driven_joints()), np.nan).tobytes()
        # Where the robot's joints are among the names of a message, or why they are not there.
        self._places: dict[tuple[str, ...], list[int] | InputError] = {}
        self._where = ""
        self._stamps = array("d")
        self._received = array("q")
        self._values = {field: bytearray() for field in _FIELDS}

    def take(self, where: str, received: int, message: Any) -> None:
        names = tuple(message.name)
        if names not in self._places:
            try:
                self._places[names] = joints_of_names(self._robot, self._joints, names, where)
            except InputError as error:
                self._places[names] = error
        place = self._places[names]
        if isinstance(place, InputError):
            return
        self._where = where
        self._stamps.append(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)
        self._received.append(received)
        for field, values in self._values.items():
            given = np.asarray(getattr(message, field), dtype=np.float64)
            values += given[place].tobytes() if len(given) > max(place) else self._missing

    def result(self) -> tuple[str, Floats, dict[str, Floats]]:
        """File and topic, stamps [s], and the fields: shape=(n, joints), NaN where a message has none."""
        if not self._stamps:
            # Several publishers may share a topic: the one that comes closest says what is wrong.
            closest = self._places.get(max(self._places, key=len, default=()))
            if isinstance(closest, InputError):
                raise closest
            raise InputError(f"{self._path}: holds no messages of joint states")
        stamps = np.array(self._stamps)
        if not stamps.any():  # the publisher did not fill them in: what the recorder says
            received = np.array(self._received)
            stamps = 1e-9 * (received - received[0])
        rows = len(stamps)
        tables = {
            field: np.frombuffer(values).reshape(rows, -1).copy(order="F")
            for field, values in self._values.items()
        }
        return self._where, stamps, tables


def _recorded(values: Floats, names: Sequence[str], field: str, refuse: Any) -> Floats | None:
    """The table without joints whose values are all zero or NaN: nobody measured them. None: none is left."""
    if field != "position":
        values[:, ~(np.nan_to_num(values) != 0.0).any(axis=0)] = np.nan
        if np.isnan(values).all():
            return None
    for k, name in enumerate(names):
        good = np.isfinite(values[:, k])
        if not good.all() and (field == "position" or good.any()):
            row = int(np.argmin(good))
            refuse(
                f"the {field} of joint {name!r} is {values[row, k]:g} there (in"
                f" {len(good) - int(good.sum())} of {len(good)} messages), expected a finite number",
                row=row,
            )
    return values
