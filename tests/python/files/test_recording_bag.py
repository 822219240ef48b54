# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of motion in bags that the test writes with the library that reads them, in both storages."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from truing import _core
from truing.dynamics import load_recordings
from truing.errors import InputError

ROBOT = _core.Robot("arm", joints=[_core.Joint(name, a=0.3) for name in ("lift", "elbow", "turn")])
ORDER = ("elbow", "finger", "lift", "turn")  # of the message: not the robot's
ROWS = 50
T = 0.002 * np.arange(ROWS)
SENSORS = "sensor_msgs/msg/JointState"
TYPES = get_typestore(Stores.ROS2_HUMBLE)
STORAGES = (StoragePlugin.SQLITE3, StoragePlugin.MCAP)

Values = Callable[[int], Sequence[float]]


def positions(row: int) -> list[float]:
    return [0.1 * row, 7.0, 0.2 * row, -0.3 * row]


def efforts(row: int) -> list[float]:
    return [5.0 + row, 1.0, -5.0, 0.0]


def message(stamp: float, names: Sequence[str], position: Sequence[float], effort: Sequence[float]) -> object:
    seconds = int(stamp)
    time = TYPES.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=round((stamp - seconds) * 1e9))
    return TYPES.types[SENSORS](
        header=TYPES.types["std_msgs/msg/Header"](stamp=time, frame_id="base"),
        name=list(names),
        position=np.array(position, dtype=np.float64),
        velocity=np.zeros(0),
        effort=np.array(effort, dtype=np.float64),
    )


def bag(
    folder: Path,
    storage: StoragePlugin = StoragePlugin.MCAP,
    *,
    topics: Sequence[str] = ("/joint_states",),
    stamps: Sequence[float] = tuple(1_760_000_000.0 + T),
    position: Values = positions,
    effort: Values = efforts,
    names: Sequence[str] = ORDER,
) -> Path:
    """A bag with a message a row on each topic, and on the first one those of a gripper in between."""
    path = folder / f"bag_{storage.name.lower()}"
    with Writer(path, version=9, storage_plugin=storage) as writer:
        for topic in topics:
            connection = writer.add_connection(topic, SENSORS, typestore=TYPES)
            for row, stamp in enumerate(stamps):
                received = round(1e9 * (1_760_000_000.0 + T[row])) + 1000
                sent = message(stamp, names, position(row), effort(row))
                writer.write(connection, received, TYPES.serialize_cdr(sent, SENSORS))
                other = message(stamp, ["thumb"], [1.0], [])
                writer.write(connection, received + 1, TYPES.serialize_cdr(other, SENSORS))
        text = writer.add_connection("/note", "std_msgs/msg/String", typestore=TYPES)
        note = TYPES.types["std_msgs/msg/String"](data="begun")
        writer.write(text, 1, TYPES.serialize_cdr(note, "std_msgs/msg/String"))
    return path


def refusal(path: Path, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        load_recordings(path, ROBOT, **options)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("storage", STORAGES)
def test_joint_states_come_by_name(tmp_path: Path, storage: StoragePlugin) -> None:
    path = bag(tmp_path, storage)
    (file,) = [file for file in path.iterdir() if file.suffix in (".mcap", ".db3")]
    for source in (path, file):
        (found,) = load_recordings(source, ROBOT)
        rows = np.arange(ROWS)
        assert found.name == source.stem
        assert found.time == pytest.approx(T, abs=1e-6) and found.time[0] == 0.0
        assert found.position == pytest.approx(np.column_stack([0.2 * rows, 0.1 * rows, -0.3 * rows]))
        assert np.array_equal(found.torque[:, 0], np.full(ROWS, -5.0))
        assert np.array_equal(found.torque[:, 1], 5.0 + rows)
        assert np.isnan(found.torque[:, 2]).all()  # zero throughout: not measured
        assert found.speed.shape == (ROWS, 0)


def test_bags_of_ros_1_are_read_as_well(tmp_path: Path) -> None:
    types = get_typestore(Stores.ROS1_NOETIC)
    with Writer1(tmp_path / "run.bag") as writer:
        connection = writer.add_connection("/joint_states", SENSORS, typestore=types)
        for row in range(ROWS):
            stamp = types.types["builtin_interfaces/msg/Time"](sec=100, nanosec=round(1e9 * T[row]))
            sent = types.types[SENSORS](
                header=types.types["std_msgs/msg/Header"](seq=row, stamp=stamp, frame_id="base"),
                name=list(ORDER),
                position=np.array(positions(row)),
                velocity=np.full(4, 0.5),
                effort=np.zeros(0),
            )
            writer.write(connection, round(1e9 * (100.0 + T[row])), types.serialize_ros1(sent, SENSORS))
    (found,) = load_recordings(tmp_path / "run.bag", ROBOT)
    assert found.position[:, 2] == pytest.approx(-0.3 * np.arange(ROWS))
    assert (found.speed == 0.5).all()
    assert found.torque.shape == (ROWS, 0)
    assert found.time == pytest.approx(100.0 + T)


def test_efforts_that_are_zero_throughout_were_not_measured(tmp_path: Path) -> None:
    (found,) = load_recordings(bag(tmp_path, effort=lambda row: [0.0, np.nan, 0.0, 0.0]), ROBOT)
    assert found.torque.shape == (ROWS, 0)


def test_stamps_that_nobody_filled_in_are_the_recorder_s(tmp_path: Path) -> None:
    (found,) = load_recordings(bag(tmp_path, stamps=[0.0] * ROWS), ROBOT)
    assert found.time == pytest.approx(T, abs=1e-6)


def test_joints_says_what_the_message_s_joints_are(tmp_path: Path) -> None:
    path = bag(tmp_path, names=("a", "b", "c", "d"))
    message = refusal(path)
    assert "there is no joint lift, elbow, turn; the joints there are a, b, c, d" in message
    (found,) = load_recordings(path, ROBOT, joints=["elbow", "-", "lift", "turn"])
    assert np.array_equal(found.torque[:, 1], 5.0 + np.arange(ROWS))
    assert "has 4 joints, a, b, c, d; --joints names 5" in refusal(path, joints="-,-,lift,elbow,turn")


def test_of_several_topics_one_has_to_be_chosen(tmp_path: Path) -> None:
    path = bag(tmp_path, topics=("/joint_states", "/left"))
    assert "several topics of joint states, /joint_states, /left: choose one with --topic" in refusal(path)
    (found,) = load_recordings(path, ROBOT, topic="/left")
    assert len(found) == ROWS
    assert "'/note' holds std_msgs/msg/String, expected one of" in refusal(path, topic="/note")
    assert "'/nothing' is not there" in refusal(path, topic="/nothing")
    assert "holds no topic of sensor_msgs/JointState" in refusal(
        bag(tmp_path, StoragePlugin.SQLITE3, topics=())
    )
    (tmp_path / "none").mkdir()
    assert "holds no messages of joint states" in refusal(bag(tmp_path / "none", stamps=()))


def test_what_cannot_be_is_refused_at_its_message(tmp_path: Path) -> None:
    def broken(row: int) -> list[float]:
        return [*positions(row)[:3], np.nan if row in (11, 12) else 0.1]

    def halting(row: int) -> list[float]:
        return [np.nan if row == 5 else 1.0, 0.0, 0.0, 0.0]

    stamps = [*(10.0 + T)]
    stamps[20] = 9.0
    said = refusal(bag(tmp_path, position=broken))
    assert "topic /joint_states, message 12 of these joints: the position of joint 'turn' is nan" in said
    assert "(in 2 of 50 messages)" in said
    assert "message 6 of these joints: the effort of joint 'elbow' is nan" in refusal(
        bag(tmp_path, StoragePlugin.SQLITE3, effort=halting)
    )
    (tmp_path / "other").mkdir()
    assert "message 21 of these joints: time goes backwards: found 9 s" in refusal(
        bag(tmp_path / "other", stamps=stamps)
    )


@pytest.mark.parametrize("storage", STORAGES)
def test_damaged_bags_are_refused(tmp_path: Path, storage: StoragePlugin) -> None:
    path = bag(tmp_path, storage)
    (file,) = [file for file in path.iterdir() if file.suffix in (".mcap", ".db3")]
    whole = file.read_bytes()
    rng = np.random.default_rng(1)
    for cut in rng.integers(0, len(whole), 10):
        file.write_bytes(whole[:cut])
        assert str(file) in refusal(file)
    for _ in range(30):
        data = np.frombuffer(whole, np.uint8).copy()
        data[rng.integers(0, len(data), 5)] = rng.integers(0, 256, 5)
        file.write_bytes(data.tobytes())
        try:
            for recording in load_recordings(file, ROBOT):
                _core.validate_recording(recording, ROBOT)
        except InputError as error:
            assert str(file) in str(error)
    assert "there is no such file" in refusal(tmp_path / "none.mcap")


def test_without_the_library_one_message_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = bag(tmp_path)
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    assert "pip install 'truing[bags]'" in refusal(path)
