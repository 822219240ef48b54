# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Answers of other hand-eye programs are read as these write them, and held beside ours on the same poses."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from board_images import Floats, frame
from fuzzing import mutated, quick
from handeye_scenes import scene, write_scene
from truing import InputError
from truing.cli import main
from truing.files import read_handeye_answer
from truing.files.common import frame_dict
from truing.rotations import quaternions_from_rotations, rotation_vectors

T = frame([0.0312345678, -0.0587, 0.0941], [0.3, -0.4, 1.2])


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def values(frame: Floats = T) -> dict[str, float]:
    w, x, y, z = map(float, quaternions_from_rotations(frame[None, :3, :3])[0])
    return {**dict(zip("xyz", map(float, frame[:3, 3]), strict=True)), "qx": x, "qy": y, "qz": z, "qw": w}


def easy_handeye(on_hand: bool) -> str:
    held = "".join(f"  {key}: {value!r}\n" for key, value in sorted(values().items()))
    where = str(on_hand).lower()
    return f"parameters:\n  eye_on_hand: {where}\n  robot_base_frame: base\ntransformation:\n{held}"


def easy_handeye2(kind: str) -> str:
    v = values()
    return (
        f"parameters:\n  name: x\n  calibration_type: {kind}\ntransform:\n  translation:\n"
        + "".join(f"    {key}: {v[key]!r}\n" for key in "xyz")
        + "  rotation:\n"
        + "".join(f"    {key}: {v['q' + key]!r}\n" for key in "xyzw")
    )


def moveit2(mount: str) -> str:
    given = "".join(
        f'                "--{key}",\n                "{value}",\n' for key, value in values().items()
    )
    return f'''""" Static transform publisher acquired via MoveIt 2 hand-eye calibration """
""" {mount}: tool0 -> camera_color_optical_frame """
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    nodes = [
        Node(
            package="tf2_ros",
            executable="static_transform_publisher",
            output="log",
            arguments=[
                "--frame-id",
                "tool0",
                "--child-frame-id",
                "camera_color_optical_frame",
{given}                # "--roll",
                # "3",
            ],
        ),
    ]
    return LaunchDescription(nodes)
'''


def moveit1() -> str:
    numbers = " ".join(map(repr, values().values()))
    return f"""<launch>
  <!-- EYE-TO-HAND: base -> camera, static_transform_publisher args="1 2 3" -->
  <node pkg="tf2_ros" type="static_transform_publisher" name="camera_link_broadcaster"
    args="{numbers} base camera" />
</launch>
"""


def opencv(**nodes: Floats) -> str:
    cv2 = pytest.importorskip("cv2")
    storage = cv2.FileStorage("made.yml", cv2.FILE_STORAGE_WRITE)
    for name, matrix in nodes.items():
        storage.write(name, matrix)
    storage.release()
    return Path("made.yml").read_text()


def ours(setup: str) -> str:
    return json.dumps(
        {"format": "truing-handeye/1", "setup": setup, "camera": {"in": "hand", **frame_dict(T)}}
    )


CASES: dict[str, tuple[str, Callable[[], str], str | None]] = {
    "easy_handeye": ("a.yaml", lambda: easy_handeye(True), "eye-in-hand"),
    "easy_handeye, on the base": ("a.yaml", lambda: easy_handeye(False), "eye-to-hand"),
    "easy_handeye2": ("a.calib", lambda: easy_handeye2("eye_in_hand"), "eye-in-hand"),
    "easy_handeye2, on the base": ("a.calib", lambda: easy_handeye2("eye_on_base"), "eye-to-hand"),
    "MoveIt 2": ("camera.launch.py", lambda: moveit2("EYE-IN-HAND"), "eye-in-hand"),
    "MoveIt 1": ("camera.launch", moveit1, "eye-to-hand"),
    "OpenCV": ("a.yml", lambda: opencv(R_cam2gripper=T[:3, :3], t_cam2gripper=T[:3, 3:]), "eye-in-hand"),
    "OpenCV, rotation vector": (
        "a.yml",
        lambda: opencv(R_cam2base=rotation_vectors(T[None, :3, :3]).T, t_cam2base=T[:3, 3:]),
        "eye-to-hand",
    ),
    "OpenCV, inverse": ("a.yml", lambda: opencv(T_gripper2cam=np.linalg.inv(T)), "eye-in-hand"),
    "OpenCV, unnamed": ("a.yml", lambda: opencv(result=T), None),
    "truing": ("result.json", lambda: ours("eye-to-hand"), "eye-to-hand"),
    "numbers": ("a.txt", lambda: "\n".join(" ".join(map(repr, map(float, row))) for row in T), None),
}


@pytest.mark.parametrize("name", CASES)
def test_the_camera_is_where_the_program_says_it_is(name: str) -> None:
    file, text, setup = CASES[name]
    Path(file).write_text(text())
    answer = read_handeye_answer(Path(file))
    assert answer.setup == setup
    assert np.allclose(answer.T_parent_camera, T, atol=1e-9)


def park(A: Floats, B: Floats) -> Floats:
    """Park and Martin (1994), as cv::CALIB_HAND_EYE_PARK: from motions to the next pose, rotation first."""
    hand, seen = np.linalg.inv(A[:-1]) @ A[1:], B[:-1] @ np.linalg.inv(B[1:])
    alpha, beta = rotation_vectors(hand[:, :3, :3]), rotation_vectors(seen[:, :3, :3])
    u, _, vt = np.linalg.svd(alpha.T @ beta)  # (M^T M)^(-1/2) M^T, M = sum of beta alpha^T
    X = np.eye(4)
    X[:3, :3] = u @ vt
    left = np.concatenate(hand[:, :3, :3] - np.eye(3))
    right = np.concatenate(seen[:, :3, 3] @ X[:3, :3].T - hand[:, :3, 3])
    X[:3, 3] = np.linalg.lstsq(left, right, rcond=None)[0]
    return X


def test_a_closed_form_is_held_beside_ours_on_poses_that_neither_saw() -> None:
    s = scene(40, hand=(3e-4, 2e-3))
    held_out = slice(20, 40)
    theirs = park(s.A[:20], s.B[:20])
    Path("park.yml").write_text(opencv(R_cam2gripper=theirs[:3, :3], t_cam2gripper=theirs[:3, 3:]))
    poses = write_scene(Path("poses.csv"), s, set=["train"] * 20 + ["test"] * 20)
    assert main(["handeye", str(poses), "--compare", "park.yml", "--out", "found"]) == 0
    result = json.loads(Path("found/result.json").read_text())
    (other,) = result["compared"]
    away = np.linalg.norm(theirs[:3, 3] - [result["camera"][f"{axis}_m"] for axis in "xyz"])
    assert other["position_m"] == pytest.approx(away, rel=1e-6)
    board = (s.A @ theirs @ s.B)[held_out, :3, 3]
    assert other["closure"]["rms_m"] == pytest.approx(
        np.sqrt(((board - board.mean(0)) ** 2).sum(1).mean()), rel=1e-6
    )
    assert other["poses"] == 20
    assert other["closure_of_ours"]["rms_m"] < 1.05 * other["closure"]["rms_m"]
    assert other["remark"] == ""
    assert "Beside other programs" in Path("found/report.html").read_text()


def test_a_body_frame_and_an_inverse_are_recognised(capsys: pytest.CaptureFixture[str]) -> None:
    s = scene(15)
    body = s.X.copy()
    body[:3, :3] = body[:3, :3] @ [[0, -1, 0], [0, 0, -1], [1, 0, 0]]
    for name, camera in (("body.txt", body), ("inverse.txt", np.linalg.inv(s.X))):
        Path(name).write_text("\n".join(" ".join(map(repr, map(float, row))) for row in camera))
    poses = write_scene(Path("poses.csv"), s)
    files = ["--compare", "body.txt", "--compare", "inverse.txt"]
    assert main(["handeye", str(poses), *files, "--out", "found"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Theirs is the camera's body frame (x forward), ours the optical frame" in said
    assert "Theirs is the inverse: the hand or base in the camera" in said


def test_a_camera_elsewhere_is_refused_before_anything_is_solved(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.calib").write_text(easy_handeye2("eye_on_base"))
    poses = write_scene(Path("poses.csv"), scene(8))
    assert main(["handeye", str(poses), "--compare", "a.calib", "--out", "found"]) == 2
    assert "of a camera eye-to-hand, this is solved as eye-in-hand" in " ".join(
        capsys.readouterr().err.split()
    )
    assert not Path("found").exists()


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("a.calib", "transform:\n  translation: {x: 1}\n", "rotation: found nothing"),
        ("a.yaml", "transformation: {x: 1, y: 2, z: 3, qx: 0, qy: 0, qz: 0, qw: far}\n", "qw: found 'far'"),
        ("a.yaml", "transformation: {x: 1, y: 2, z: 3, qx: 0, qy: 0, qz: 0, qw: 3}\n", "of length 3"),
        (
            "a.launch",
            '<launch><node type="static_transform_publisher" args="1 2"/></launch>',
            "expected x y z and",
        ),
        ("a.launch.py", "static_transform_publisher = (", "is neither XML nor Python"),
        ("a.launch.py", "# static_transform_publisher", "found 0 calls of static_transform_publisher"),
        ("a.json", '{"format": "truing-identification/1"}', "found JSON of another kind"),
        (
            "a.json",
            '{"format": "truing-handeye/1", "status": "not observable"}',
            r"no camera .* \(not observable\)",
        ),
        ("a.txt", "1 2 3\n", "found 3 numbers"),
        ("a.txt", "hello", "found no pose of a camera"),
    ],
)
def test_what_is_no_answer_is_refused_by_what_is_missing(file: str, text: str, said: str) -> None:
    Path(file).write_text(text)
    with pytest.raises(InputError, match=f"{file}.*{said}"):
        read_handeye_answer(Path(file))


@pytest.mark.parametrize("name", ["easy_handeye2", "MoveIt 1", "MoveIt 2", "truing"])
def test_damaged_answers_are_read_or_refused_by_their_name(tmp_path: Path, name: str) -> None:
    file, text, _ = CASES[name]
    path = tmp_path / file

    @quick
    @given(mutated(text().encode()))
    def check(data: bytes) -> None:
        path.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                assert np.isfinite(read_handeye_answer(path).T_parent_camera).all()
            except InputError as error:
                assert str(path) in str(error)

    check()
