# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the nodes of ros/truing_ros write, truing reads; what truing found, they publish. With stand-ins for
ROS: the nodes were not run under ROS here.
"""

from __future__ import annotations

import ast
import json
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ros_stand_ins as ros
import truing
from board_images import Floats, frame
from handeye_scenes import CAMERA_IN_HAND, scene
from truing.cli import main
from truing.examples import example
from truing.rotations import quaternions_from_rotations, rotations_from_quaternions

SECOND = 1_000_000_000  # [ns]
NAMES = [f"joint_{k}" for k in range(1, 7)]


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[ros.World]:
    monkeypatch.chdir(tmp_path)
    yield ros.install(monkeypatch)


def record(world: ros.World, **parameters: Any) -> Any:
    from truing_ros.record_node import Record

    world.parameters = {"joints": NAMES, **parameters}
    return Record()


def parts(T: Floats) -> tuple[Any, Any]:
    w, x, y, z = quaternions_from_rotations(T[None, :3, :3])[0]
    return ros.Point(x=T[0, 3], y=T[1, 3], z=T[2, 3]), ros.Quaternion(x=x, y=y, z=z, w=w)


def pose_message(world: ros.World, T: Floats) -> Any:
    position, orientation = parts(T)
    header = ros.Header(stamp=world.stamp())
    return ros.PoseStamped(header=header, pose=ros.Pose(position=position, orientation=orientation))


def transform_message(world: ros.World, T: Floats) -> Any:
    translation, rotation = parts(T)
    header = ros.Header(stamp=world.stamp())
    return ros.TransformStamped(
        header=header, transform=ros.Transform(translation=translation, rotation=rotation)
    )


def joint_message(world: ros.World, q: Floats) -> Any:
    """As a driver sends it: in its own order, with a gripper between."""
    names, values = [*NAMES[::-1], "gripper"], [*q[::-1], 0.04]
    return ros.JointState(header=ros.Header(stamp=world.stamp()), name=names, position=values)


def stand(world: ros.World, node: Any, q: Floats, T: Floats, noise: float = 0.0, seed: int = 0) -> None:
    """Two seconds at rest, joints at 50 Hz and poses at 10 Hz."""
    rng = np.random.default_rng(seed)
    for step in range(100):
        world.now += SECOND // 50
        node.on_joints(joint_message(world, q + rng.normal(0, 1e-5, 6)))
        if step % 5 == 0:
            seen = T.copy()
            seen[:3, 3] += rng.normal(0, noise, 3)
            node.on_pose(pose_message(world, seen))


def take(node: Any) -> Any:
    return node.services["~/take"](None, type("Response", (), {})())


def frame_in(message: Any) -> Floats:
    p, q = message.transform.translation, message.transform.rotation
    T = np.eye(4)
    T[:3, :3] = rotations_from_quaternions(np.array([[q.w, q.x, q.y, q.z]]))[0]
    T[:3, 3] = [p.x, p.y, p.z]
    return T


def test_rows_that_were_taken_are_measurements_that_identify_reads(world: ros.World) -> None:
    robot = truing.load_robot(example("ur10"))
    solver = truing.inverse_kinematics.InverseSolver(robot)
    node = record(world)
    rng = np.random.default_rng(1)
    joints = rng.uniform([-1, -2, -1, -1, -1, -1], [1, -1, 1, 1, 1, 1], (12, 6))  # within limits
    for row, q in enumerate(joints):
        stand(world, node, q, solver.forward(q), noise=1e-4, seed=row)
        assert take(node).success
    data = truing.load_measurements("measurements.csv", robot)
    assert np.allclose(data.joints, joints, atol=1e-5)
    expected = np.array([solver.forward(q)[:3, 3] for q in joints])
    assert np.abs(data.positions - expected).max() < 1.5e-4  # the mean of ten: 4 sigma of a row
    assert data.orientations is not None


def test_points_of_a_tracker_have_no_orientation(world: ros.World) -> None:
    node = record(world, pose_type="point", file="here/points.csv")
    world.now += SECOND
    node.on_joints(joint_message(world, np.zeros(6)))
    node.on_pose(
        ros.PointStamped(header=ros.Header(stamp=world.stamp()), point=ros.Point(x=1.0, y=2.0, z=3.0))
    )
    assert take(node).message == "row 1: mean of 1 joint states and 1 poses, which lie within 0 mm"
    header, row = Path("here/points.csv").read_text().splitlines()
    assert header == "x_m,y_m,z_m,q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,t_s"
    assert row.split(",")[:3] == ["1.0", "2.0", "3.0"]


def test_a_hand_eye_recording_gives_the_camera_and_the_camera_is_published(world: ros.World) -> None:
    s = scene(15)
    node = record(world, kind="handeye", pose_type="tf")
    for row, (A, B) in enumerate(zip(s.A, s.B, strict=True)):
        world.now += 2 * SECOND
        world.frames["base_link", "tool0"] = transform_message(world, A)
        world.frames["camera_color_optical_frame", "board"] = transform_message(world, B)
        node.on_joints(joint_message(world, np.full(6, 0.1 * row)))
        node.tick()
        node.tick()  # the same transform again is not another sample
        assert "1 poses" in take(node).message
    assert main(["handeye", "poses.csv", "--setup", "eye-in-hand", "--out", "found"]) == 0

    from truing_ros.hand_eye_node import HandEyeFrames

    world.parameters = {"result": "found", "board_frame": "board_found", "camera_frame": "optical"}
    HandEyeFrames()
    assert set(world.static) == {"optical", "board_found"}
    assert world.static["optical"].header.frame_id == "tool0"
    assert world.static["board_found"].header.frame_id == "base_link"
    found = json.loads(Path("found/result.json").read_text())["camera"]
    T = frame_in(world.static["optical"])
    assert np.allclose(T[:3, 3], [found[f"{axis}_m"] for axis in "xyz"], atol=1e-15)
    assert np.abs(T[:3, 3] - CAMERA_IN_HAND[:3, 3]).max() < 2e-3


def test_a_driver_with_frames_of_its_own_is_attached_by_their_root(world: ros.World) -> None:
    s = scene(12)
    camera = {f"{axis}_m": float(s.X[k, 3]) for k, axis in enumerate("xyz")}
    camera |= dict(
        zip(
            ("qw", "qx", "qy", "qz"),
            map(float, quaternions_from_rotations(s.X[None, :3, :3])[0]),
            strict=True,
        )
    )
    result = {
        "format": "truing-handeye/1",
        "camera": {"in": "hand", **camera},
        "board": {"in": "base", **camera},
    }
    Path("result.json").write_text(json.dumps(result))
    T_link_optical = frame([0.01, 0.015, -0.002], [-1.2, 1.2, -1.2])

    from truing_ros.hand_eye_node import HandEyeFrames

    world.parameters = {"result": "result.json", "attach": "camera_link", "camera_frame": "optical"}
    node = HandEyeFrames()
    node.tick()
    assert world.static == {}
    assert "waiting for optical in camera_link" in world.log[-1]
    world.frames["camera_link", "optical"] = transform_message(world, T_link_optical)
    node.tick()
    T_hand_link = frame_in(world.static["camera_link"])
    assert np.allclose(T_hand_link @ T_link_optical, s.X, atol=1e-12)
    assert not node.timers[0].running


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "No such file"),
        ("{", "is no JSON"),
        ('{"format": "truing-identification/1"}', "expected result.json of truing handeye"),
        ('{"format": "truing-handeye/1", "message": "turn more"}', "no camera was found: turn more"),
    ],
)
def test_a_file_without_a_camera_is_refused_by_name(world: ros.World, text: str | None, said: str) -> None:
    if text is not None:
        Path("result.json").write_text(text)
    from truing_ros import hand_eye

    with pytest.raises(ValueError, match=f"result.json: .*{said}"):
        hand_eye.read("result.json")


def test_streams_are_read_with_their_stamps_and_arrivals(world: ros.World) -> None:
    robot = truing.load_robot(example("ur10"))
    node = record(world, kind="streams", file="run")
    for step in range(400):
        world.now += SECOND // 100
        stamped = ros.World()
        stamped.now = world.now - 3_000_000  # 3 ms on the way
        q = 0.5 * np.sin(0.01 * step) * np.ones(6)
        node.on_joints(joint_message(stamped, q))
        if step % 4 == 0:
            T = frame([1.0, 0.2 * np.sin(0.01 * step), 0.5], [0.0, 0.0, 0.01 * step])
            node.on_pose(pose_message(stamped, T))
            node.on_pose(pose_message(stamped, T))  # sent twice
    assert node.recorder.left_out == 100
    joints, poses = truing.load_joints("run/joints.csv", robot), truing.load_tracker("run/tracker.csv")
    assert joints.t[0] == 0.0
    assert np.allclose(np.diff(joints.t), 0.01, atol=1e-9)
    assert joints.arrival is not None
    assert np.allclose(joints.arrival - joints.t, 0.003, atol=1e-9)
    assert len(poses.t) == 100
    assert np.allclose(poses.position[:, 1], 0.2 * np.sin(0.04 * np.arange(100)), atol=1e-12)


def test_a_row_is_taken_by_itself_once_the_arm_stands_still_somewhere_else(world: ros.World) -> None:
    node = record(world, auto=0.05)
    q, T = np.zeros(6), np.eye(4)
    stand(world, node, q, T)
    node.tick()
    node.tick()
    assert node.recorder.table.rows == 1
    for step in range(60):  # on the way
        world.now += SECOND // 50
        node.on_joints(joint_message(world, q + 0.01 * step))
        node.on_pose(pose_message(world, T))
        node.tick()
    assert node.recorder.table.rows == 1
    stand(world, node, q + 0.6, T)
    node.tick()
    assert node.recorder.table.rows == 2


def test_what_cannot_be_taken_is_answered_by_what_is_missing(world: ros.World) -> None:
    node = record(world)
    assert (take(node).success, take(node).message) == (False, f"no joint states of {NAMES} within 1 s")
    node.on_joints(ros.JointState(name=["gripper"], position=[0.0]))
    node.on_joints(ros.JointState(name=NAMES, position=[np.nan] * 6))
    node.on_joints(ros.JointState(name=NAMES, position=[]))
    assert take(node).message == f"no joint states of {NAMES} within 1 s"
    node.on_joints(joint_message(world, np.zeros(6)))
    node.on_pose(ros.PoseStamped(pose=ros.Pose(orientation=ros.Quaternion(w=0.0))))
    assert "holds no pose" in world.log[-1]
    assert take(node).message == "no pose within 1 s"
    node.on_pose(pose_message(world, np.eye(4)))
    node.on_joints(joint_message(world, np.full(6, 0.01)))
    assert take(node).message == "the arm moves: by 0.01 (rad or m) within 1 s"
    assert Path("measurements.csv").read_text().count("\n") == 1


def test_wrong_parameters_and_a_file_that_is_there_are_refused(world: ros.World) -> None:
    with pytest.raises(
        ValueError, match="kind: found 'rows', expected one of measurements, handeye, streams"
    ):
        record(world, kind="rows")
    with pytest.raises(ValueError, match="joints: found .* expected every driven joint's name once"):
        record(world, joints=["a", "a"])
    with pytest.raises(ValueError, match="hand-eye needs orientations"):
        record(world, kind="handeye", pose_type="point")
    Path("measurements.csv").write_text("mine")
    with pytest.raises(FileExistsError):
        record(world)
    assert Path("measurements.csv").read_text() == "mine"


def test_the_package_names_its_version_its_plugins_and_its_programs_as_they_are() -> None:
    root = ros.PACKAGE.parents[1]
    package = ET.parse(ros.PACKAGE / "package.xml").getroot()
    version = package.findtext("version")
    assert f"project(truing VERSION {version}" in (root / "CMakeLists.txt").read_text()
    cmake = (ros.PACKAGE / "CMakeLists.txt").read_text()
    for description in ros.PACKAGE.glob("*_plugins.xml"):
        assert description.name in cmake
        library = ET.parse(description).getroot()
        assert f"add_library({library.get('path')} SHARED" in cmake
        for plugin in library:
            exported = f"PLUGINLIB_EXPORT_CLASS({plugin.get('type')}, {plugin.get('base_class_type')})"
            assert any(exported in source.read_text() for source in (ros.PACKAGE / "src").glob("*.cpp"))
            assert plugin.get("name") in (root / "docs/guide/ros.md").read_text()
    for script in (ros.PACKAGE / "scripts").iterdir():
        assert f"scripts/{script.name}" in cmake
        assert script.stat().st_mode & 0o111
    for launch in (ros.PACKAGE / "launch").iterdir():
        ast.parse(launch.read_text())
