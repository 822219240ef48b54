# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of motion in ROS bags: sensor_msgs/JointState in rosbag2 folders, .mcap and .db3 files, without
ROS.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from truing import _core
from truing.errors import InputError
from truing.files.common import listed
from truing.files.output import reason, require_whole_file
from truing.files.recording_parts import checked_times, joints_of_names, make_recordings, table_of
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
    used, messages = _messages(path, topic)
    where = f"{path}, topic {used}"
    stamps, tables = _tables(where, messages, robot, joints)

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


def _messages(path: Path, topic: str | None) -> tuple[str, list[tuple[int, Any]]]:
    """The topic, and stamps of the recorder [ns] with the messages of joint states."""
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
            return used, [
                (stamp, reader.deserialize(data, connection.msgtype))
                for connection, stamp, data in reader.messages(wanted)
            ]
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
            f"{path}: holds several topics of joint states, {listed(there)}: choose one with topic="
        )
    return there[0]


def _tables(
    where: str, messages: Sequence[tuple[int, Any]], robot: _core.Robot, joints: Sequence[str] | None
) -> tuple[Floats, dict[str, Floats]]:
    """Stamps [s], and the fields of the messages that have all of the robot's joints: shape=(n, joints), NaN
    where a message leaves a field empty.
    """
    places: dict[tuple[str, ...], list[int] | InputError] = {}
    chosen: list[tuple[int, Any, list[int]]] = []
    for received, message in messages:
        names = tuple(message.name)
        if names not in places:
            try:
                places[names] = joints_of_names(robot, joints, names, where)
            except InputError as error:
                places[names] = error
        place = places[names]
        if not isinstance(place, InputError):
            chosen.append((received, message, place))
    if not chosen:
        # Several publishers may share a topic: the one that comes closest says what is wrong.
        errors = [(len(names), error) for names, error in places.items() if isinstance(error, InputError)]
        raise (
            max(errors, key=lambda item: item[0])[1] if errors else InputError(f"{where}: holds no messages")
        )
    stamps = np.array([m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec for _, m, _ in chosen])
    if not stamps.any():  # the publisher did not fill them in: what the recorder says
        first = chosen[0][0]
        stamps = np.array([1e-9 * (received - first) for received, _, _ in chosen])
    tables = {}
    for field in _FIELDS:
        table = table_of(len(chosen), len(robot.driven_joints()))
        for row, (_, message, place) in enumerate(chosen):
            values = getattr(message, field)
            if len(values) > max(place):
                table[row] = np.asarray(values)[place]
        tables[field] = table
    return stamps, tables


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
