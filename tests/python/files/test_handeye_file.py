# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye files are read in SI, whatever they hold; what is wrong is named with line, column, what was found
and what was expected.
"""

from __future__ import annotations

import math
import re
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, strategies as st

import truing
from board_images import CAMERA, Floats, board_poses, rotation, write_images
from fuzzing import mutated, quick
from handeye_scenes import columns_of, scene, write_csv, write_scene
from truing import InputError, InputWarning, load_camera, load_handeye, save_camera
from truing.files import load_stream
from truing.files.handeye_file import EULER_ORDERS
from truing.hand_eye import HandEyePoses
from truing.rotations import (
    quaternions_from_rotations,
    rotations_from_angles,
    rotations_from_quaternions,
)

SCENE = scene(6)


def table(**changes: Any) -> dict[str, Any]:
    """Columns of a good file, some changed, None: left out."""
    columns = {**columns_of("hand", SCENE.A), **columns_of("board", SCENE.B), **changes}
    return {name: values for name, values in columns.items() if values is not None}


def refused(path: Path, message: str, **options: Any) -> None:
    with pytest.raises(InputError) as error, warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        load_handeye(path, **options)
    assert re.search(message, str(error.value)), str(error.value)
    assert str(path) in str(error.value)


# ---- Reading -------------------------------------------------------------------------------------


def test_poses_are_read_as_they_are_written(tmp_path: Path) -> None:
    data = load_handeye(
        write_scene(
            tmp_path / "poses.csv",
            SCENE,
            set=["train"] * 4 + ["test"] * 2,
            t_s=np.arange(6.0),
            q1_deg=[0, 90, 180, 0, 0, 0],
            q2_mm=[1000.0] * 6,
            lamp=[1.0] * 6,
        )
    )
    assert np.allclose(data.poses.T_base_hand, SCENE.A, atol=1e-14) and np.allclose(
        data.poses.T_camera_board, SCENE.B, atol=1e-14
    )
    assert data.poses.set is not None and data.poses.set.tolist() == [0, 0, 0, 0, 1, 1]
    assert data.time is not None and data.time.tolist() == list(range(6))
    assert data.joints is not None and data.joints[:3].tolist() == [
        [0.0, 1.0],
        [math.pi / 2, 1.0],
        [math.pi, 1.0],
    ]
    assert data.count == 6 and data.convention == "quaternion" and data.rows.tolist() == list(range(6))


def test_millimetres_are_read_as_metres(tmp_path: Path) -> None:
    columns = table(**{f"{side}_{axis}_m": None for side in ("hand", "board") for axis in "xyz"})
    columns |= {
        f"{side}_{axis}_mm": 1000 * T[:, k, 3]
        for side, T in (("hand", SCENE.A), ("board", SCENE.B))
        for k, axis in enumerate("xyz")
    }
    data = load_handeye(write_csv(tmp_path / "poses.csv", columns))
    assert np.allclose(data.poses.T_base_hand, SCENE.A, atol=1e-14) and np.allclose(
        data.poses.T_camera_board, SCENE.B, atol=1e-14
    )


def angles_of(T: Floats, order: str) -> Floats:
    """Angles of turned axes, by scipy: its capitals are turned axes."""
    spatial = pytest.importorskip("scipy.spatial.transform")
    in_order = spatial.Rotation.from_matrix(T[:, :3, :3]).as_euler(order.upper())
    if len(set(order)) < 3:
        return np.asarray(in_order)
    return np.asarray(in_order)[:, [order.index(axis) for axis in "xyz"]]


@pytest.mark.parametrize("order", EULER_ORDERS)
@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_angles_are_read_by_their_convention(tmp_path: Path, order: str, unit: str) -> None:
    angles = angles_of(SCENE.A, order) * (180 / math.pi if unit == "deg" else 1.0)
    columns = table(**{f"hand_q{part}": None for part in "wxyz"}) | {
        f"hand_r{axis}_{unit}": angles[:, k] for k, axis in enumerate("xyz")
    }
    data = load_handeye(write_csv(tmp_path / "poses.csv", columns), angles=order)
    assert np.allclose(data.poses.T_base_hand, SCENE.A, atol=1e-12)
    assert data.convention == order


def test_rotation_vectors_are_axis_times_angle() -> None:
    vectors = np.array([[0, 0, 0], [0, 0, math.pi / 2], [1e-9, 0, 0], [3.0, 0.3, -0.2], [0, math.pi, 0]])
    assert np.allclose(
        rotations_from_angles(vectors, "rotation-vector"), [rotation(v) for v in vectors], atol=1e-15
    )


def test_kuka_angles_are_turned_axes_zyx() -> None:
    """A about z, then B about the new y, then C about the new x."""
    a, b, c = 0.3, -0.4, 1.2
    expected = rotation([0, 0, a]) @ rotation([0, b, 0]) @ rotation([c, 0, 0])
    assert np.allclose(rotations_from_angles(np.array([[c, b, a]]), "zyx")[0], expected, atol=1e-15)


def test_quaternions_survive_a_round_trip_whatever_their_largest_part() -> None:
    rng = np.random.default_rng(0)
    q = rng.normal(size=(200, 4))
    q = np.concatenate([q, np.eye(4), -np.eye(4)])
    R = rotations_from_quaternions(q)
    assert np.allclose(rotations_from_quaternions(quaternions_from_rotations(R)), R, atol=1e-14)
    assert (quaternions_from_rotations(R)[:, 0] >= 0).all()


def test_rows_without_a_board_are_left_out_and_told(tmp_path: Path) -> None:
    lines = write_scene(tmp_path / "poses.csv", SCENE).read_text().splitlines()
    lines[3] = ",".join(lines[3].split(",")[:7] + [""] * 7)
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n")
    with pytest.warns(InputWarning, match=r"1 of 6 rows have no board pose and are left out: 2 \(from 0\)"):
        data = load_handeye(tmp_path / "poses.csv")
    assert data.rows.tolist() == [0, 1, 3, 4, 5] and data.count == 5 and len(data.unused) == 1


def test_images_are_read_with_their_board(tmp_path: Path) -> None:
    pytest.importorskip("cv2")
    board = truing.files.parse_board("circles:8x5:25mm")
    seen = board_poses(board, 4)
    names = write_images(tmp_path, board, seen)
    columns = {**columns_of("hand", SCENE.A[:4]), "image": names}
    save_camera(tmp_path / "camera.yaml", CAMERA)
    data = load_handeye(
        write_csv(tmp_path / "poses.csv", columns), board="circles:8x5:25mm", camera=tmp_path / "camera.yaml"
    )
    assert data.images == tuple(names) and data.camera_given and data.board == board
    assert data.poses.images is not None and len(data.poses.images) == 4
    assert data.poses.camera is not None and (data.poses.camera.fx, data.poses.camera.distortion) == (
        CAMERA.fx,
        CAMERA.distortion,
    )
    assert len(data.poses.board_symmetries) == 1
    refused(
        tmp_path / "poses.csv",
        r"column 'image': the column image needs to know what is in the images: say it with --board",
    )


def test_poses_of_a_robot_that_stood_still_count_once(tmp_path: Path) -> None:
    order = [0, 1, 2, 3, 4, 5, 1, 1, 4]
    hand, board = SCENE.A[order], SCENE.B[order].copy()
    hand[6, :3, 3] += 1e-5
    board[6, :3, 3] += 3e-4
    columns = {**columns_of("hand", hand), **columns_of("board", board)}
    with pytest.warns(InputWarning, match=r"3 of 9 poses .* 6 \(as 1\), 7 \(as 1\), 8 \(as 4\)"):
        data = load_handeye(write_csv(tmp_path / "poses.csv", columns))
    assert data.rows.tolist() == [0, 1, 2, 3, 4, 5] and len(data.unused) == 3
    assert np.allclose(data.poses.T_camera_board[1, :3, 3], SCENE.B[1, :3, 3] + 1e-4)
    columns["set"] = ["train"] * 6 + ["test"] * 3  # held-out poses are predicted, not fitted
    with pytest.warns(InputWarning, match=r"1 of 9 poses"):
        assert load_handeye(write_csv(tmp_path / "poses.csv", columns)).count == 8
    columns = {**columns_of("hand", hand), **columns_of("board", SCENE.B[[0, 1, 2, 3, 4, 5, 2, 3, 5]])}
    assert load_handeye(write_csv(tmp_path / "poses.csv", columns)).count == 9  # boards differ: a mistake


def test_images_of_a_robot_that_stood_still_count_once(tmp_path: Path) -> None:
    pytest.importorskip("cv2")
    board = truing.files.parse_board("circles:8x5:25mm")
    names = write_images(tmp_path, board, board_poses(board, 4))
    copy = tmp_path / "copy.png"
    copy.write_bytes((tmp_path / names[2]).read_bytes())
    columns = {**columns_of("hand", SCENE.A[[0, 1, 2, 3, 2]]), "image": [*names, copy.name]}
    with pytest.warns(InputWarning, match=r"1 of 5 poses .* 4 \(as 2\)"):
        data = load_handeye(write_csv(tmp_path / "poses.csv", columns), board=board, camera=CAMERA)
    assert data.images == tuple(names) and data.views is not None and data.poses.images is not None
    assert [len(points) for points in data.views.points] == [40] * 4  # a copy tells nothing new


# ---- What is wrong is named ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"hand_x_m": None},
            r"there is no column hand_x_m \(flange in the robot base: a position has three coordinates\)",
        ),
        ({"hand_qz": None}, r"there is no column hand_qz"),
        ({f"board_q{part}": None for part in "wxyz"}, r"there is no column board_qw"),
        (
            {f"board_{name}": None for name in ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")},
            r"nothing that the camera saw: expected the columns board_x_m",
        ),
        ({"hand_x_m": None, "hand_x_mm": [1.0] * 6}, r"mixed units in hand_x_mm, hand_y_m, hand_z_m"),
        (
            {"hand_x_m": None, "hand_x": [1.0] * 6},
            r"column 'hand_x': no known unit in the name, expected hand_x_m or hand_x_mm",
        ),
        ({"hand_x_mm": [1.0] * 6}, r"there are two columns for it, 'hand_x_m' and 'hand_x_mm'"),
        ({"hand_rx_deg": [1.0] * 6}, r"the hand has an orientation twice"),
        ({"hand_w": [1.0] * 6}, r"column 'hand_w': unknown column; did you mean 'hand_qw'\?"),
        ({"hand_qw_rad": [1.0] * 6}, r"a quaternion has no unit, expected the name hand_qw"),
        (
            {"hand_y_m": [0.1, 0.2, "nan", 0.1, 0.2, 0.3]},
            r"line 4, column 'hand_y_m': found 'nan', expected a finite number",
        ),
        ({"hand_y_m": [0.1, 0.2, "", 0.1, 0.2, 0.3]}, r"line 4, column 'hand_y_m': found an empty cell"),
        (
            {"board_y_m": [0.1, 0.2, "", 0.1, 0.2, 0.3]},
            r"line 4, column 'board_y_m': found an empty cell, expected a number, or empty cells in all of",
        ),
        (
            {"hand_y_m": [0.1, 0.2, "here", 0.1, 0.2, 0.3]},
            r"line 4, column 'hand_y_m': found 'here', expected a number",
        ),
        (
            {"hand_qw": [1.0, 1.0, 3.0, 1.0, 1.0, 1.0]},
            (
                r"line 2: found the hand quaternion 1 .* of length .*, expected a unit quaternion \(to"
                r" 1e-3\), scalar first"
            ),
        ),
        (
            {f"hand_q{part}": [0.0] * 6 for part in "wxyz"},
            r"line 2: found the hand quaternion 0 0 0 0 of length 0.*an empty orientation",
        ),
        (
            {f"board_q{part}": [v] * 6 for part, v in zip("wxyz", (0.0, 120.0, 35.0, -60.0), strict=True)},
            r"it looks like angles: call them board_rx_deg",
        ),
        (
            {f"hand_q{part}": [1000.0 * v] * 6 for part, v in zip("wxyz", (0.5, 0.5, 0.5, 0.5), strict=True)},
            r"converted to mm with the position",
        ),
        ({"set": ["train"] * 5 + ["trial"]}, r"line 7, column 'set': found 'trial', expected train or test"),
        ({"note": ["a"] * 6}, r"column 'note': found 'a', expected a number"),
        ({"t_ms": [1.0] * 6}, r"column 't_ms': no known unit in the name, expected t_s"),
        ({"q1": [1.0] * 6}, r"column 'q1': no known unit in the name, expected q1_rad"),
        ({"q2_rad": [1.0] * 6}, r"there is no column q1_rad \(or another unit\), but q2_rad"),
        ({"q1_rad": [1.0] * 6, "q1_deg": [1.0] * 6}, r"joint 1 has two columns"),
        (
            {"q1_rad": [90.0, 120, -170, 60, 45, 100]},
            r"column 'q1_rad': values from -170 to 120 look like degrees",
        ),
        ({"board_t_s": np.arange(6.0)}, r"there is no column t_s: board_t_s is the camera's time"),
        (
            {"t_s": [0, 1, 2, 2, 3, 4.0], "board_t_s": np.arange(6.0)},
            r"line 5, column 't_s': found 2 after 2, expected times that increase",
        ),
        (
            dict.fromkeys(columns_of("hand", SCENE.A)) | columns_of("hand", np.array([SCENE.A[0]] * 6)),
            r"all 6 robot poses are equal",
        ),
        (
            dict.fromkeys(columns_of("board", SCENE.A)) | columns_of("board", np.array([SCENE.A[0]] * 6)),
            r"all 6 board poses are equal",
        ),
        (
            {
                f"{side}_{axis}_m": 1000 * T[:, k, 3]
                for side, T in (("hand", SCENE.A), ("board", SCENE.B))
                for k, axis in enumerate("xyz")
            },
            r"these look like millimetres; call the columns hand_x_mm …, board_x_mm …",
        ),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    refused(write_csv(tmp_path / "poses.csv", table(**changes)), message)


@pytest.mark.parametrize("count", [1, 2])
def test_fewer_than_three_poses_are_too_few(tmp_path: Path, count: int) -> None:
    columns = {name: values[:count] for name, values in table().items()}
    refused(write_csv(tmp_path / "poses.csv", columns), rf"has {count} poses?, expected at least 3")


def test_a_missing_image_is_named(tmp_path: Path) -> None:
    columns = {**columns_of("hand", SCENE.A), "image": [f"images/{k}.png" for k in range(6)]}
    path = write_csv(tmp_path / "poses.csv", columns)
    refused(
        path,
        r"line 2, column 'image': there is no image 'images/0\.png' in .* 5 more are missing: images/1\.png,"
        r" images/2\.png",
        board="chessboard:9x6:25mm",
    )
    (tmp_path / "images").mkdir()
    for k in range(6):
        (tmp_path / f"images/{k}.png").write_bytes(b"")
    columns["image"][3] = "images/1.png"
    refused(
        write_csv(path, columns),
        r"line 5, column 'image': the image 'images/1\.png' is already that of an earlier row",
        board="chessboard:9x6:25mm",
    )
    columns["image"][3] = ""
    refused(
        write_csv(path, columns),
        r"line 5, column 'image': found an empty cell, expected the path of an image",
        board="chessboard:9x6:25mm",
    )


def test_angles_need_their_convention(tmp_path: Path) -> None:
    angles = np.degrees(angles_of(SCENE.A, "zyx"))
    columns = table(**{f"hand_q{part}": None for part in "wxyz"}) | {
        f"hand_r{axis}_deg": angles[:, k] for k, axis in enumerate("xyz")
    }
    path = write_csv(tmp_path / "poses.csv", columns)
    refused(
        path,
        r"columns hand_rx_deg, hand_ry_deg, hand_rz_deg: angles mean nothing without their convention: say it"
        r" with --angles .* zyx \(KUKA",
    )
    for wrong, hint in (
        ("XYZ", "fixed axes in the order xyz are 'zyx' here"),
        ("rpy", "expected rotation-vector"),
        ("xxz", "expected rotation-vector"),
    ):
        with pytest.raises(InputError, match=f"--angles: found '{wrong}'.*{hint}"):
            load_handeye(path, angles=wrong)


def test_degrees_in_a_column_of_radians_are_refused_and_the_reverse_is_doubted(tmp_path: Path) -> None:
    angles = angles_of(SCENE.A, "zyx")
    columns = table(**{f"hand_q{part}": None for part in "wxyz"}) | {
        f"hand_r{axis}_rad": np.degrees(angles[:, k]) for k, axis in enumerate("xyz")
    }
    refused(
        write_csv(tmp_path / "poses.csv", columns),
        r"line \d, column 'hand_r[xyz]_rad': found .*, more than a turn: these look like degrees; call the"
        r" columns hand_rx_deg",
        angles="zyx",
    )
    columns = table(**{f"hand_q{part}": None for part in "wxyz"}) | {
        f"hand_r{axis}_deg": angles[:, k] for k, axis in enumerate("xyz")
    }
    with pytest.warns(InputWarning, match="are these radians"):
        load_handeye(write_csv(tmp_path / "poses.csv", columns), angles="zyx")


def test_a_stream_has_times_that_increase(tmp_path: Path) -> None:
    stream = load_stream(
        write_csv(tmp_path / "hand.csv", {"t_s": np.arange(6.0), **columns_of("hand", SCENE.A)}), "hand"
    )
    assert stream.time.tolist() == list(range(6)) and np.allclose(stream.T, SCENE.A, atol=1e-14)
    for columns, message in (
        (columns_of("hand", SCENE.A), "there is no column t_s"),
        (
            {"t_s": [0, 1, 2, 3, 5, 4.0], **columns_of("hand", SCENE.A)},
            "line 7, column 't_s': found 4 after 5",
        ),
        ({"t_s": np.arange(6.0), **columns_of("board", SCENE.A)}, "expected the columns hand_x_m"),
    ):
        with pytest.raises(InputError, match=message):
            load_stream(write_csv(tmp_path / "hand.csv", columns), "hand")


def test_poses_given_as_arrays_are_checked_pose_by_pose() -> None:
    left = SCENE.A.copy()
    left[2, :3, 0] *= -1
    for A, message in (
        (left, "T_base_hand, pose 2: .*left-handed"),
        (np.where(np.arange(6)[:, None, None] == 4, np.nan, SCENE.A), "T_base_hand, pose 4: .*finite"),
        (2 * SCENE.A, "T_base_hand, pose 0: .*rigid"),
        (SCENE.A[:, :3], r"must have shape \(n, 4, 4\)"),
    ):
        with pytest.raises(InputError, match=message):
            HandEyePoses(A, SCENE.B)
    with pytest.raises(InputError, match="T_camera_board has 5 poses, T_base_hand has 6"):
        HandEyePoses(SCENE.A, SCENE.B[:5])
    with pytest.raises(InputError, match="images need a camera"):
        HandEyePoses(SCENE.A, SCENE.B, images=[(np.zeros((4, 3)), np.zeros((4, 2)))] * 6)
    with pytest.raises(InputError, match="images, pose 0: 4 points, but 3 pixels"):
        HandEyePoses(SCENE.A, SCENE.B, images=[(np.zeros((4, 3)), np.zeros((3, 2)))] * 6, camera=CAMERA)
    with pytest.raises(InputError, match="set: pose 1 holds 'trial'"):
        HandEyePoses(SCENE.A, SCENE.B, set=["train", "trial"] * 3)


# ---- Cameras -------------------------------------------------------------------------------------

CAMERA_YAML = b"""\
format: truing-camera/1
width: 640
height: 480
fx: 550.0
fy: 551.5
cx: 320
cy: 2.4e2
distortion: {model: plumb_bob, coefficients: [-0.1, 0.02, 0, 1e-3, 0]}
sigma: {fx: 0.3}
calibration: {source: poses.csv, "board": "circles:10x10:25.4mm"}
"""


def test_a_camera_file_is_read_and_written_bit_for_bit(tmp_path: Path) -> None:
    (tmp_path / "camera.yaml").write_bytes(CAMERA_YAML)
    camera = load_camera(tmp_path / "camera.yaml")
    assert (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy) == (
        640,
        480,
        550.0,
        551.5,
        320.0,
        240.0,
    )
    assert camera.distortion == (-0.1, 0.02, 0.0, 1e-3, 0.0)
    odd = CAMERA.replace(fx=1 / 3 * 1000, distortion=[1e-17, -1 / 7, 1e5 / 3e5, 0.0, -0.0])
    save_camera(
        tmp_path / "out.yaml",
        odd,
        sigma={"fx": 0.1, "k1": float("nan")},
        calibration={"source": 'a "b": {c}.csv', "images": 12, "refined": True},
    )
    again = load_camera(tmp_path / "out.yaml")
    assert (again.fx, again.distortion) == (odd.fx, odd.distortion)


@pytest.mark.parametrize("suffix", [".yml", ".xml", ".json"])
def test_a_camera_that_opencv_wrote_is_read(tmp_path: Path, suffix: str) -> None:
    cv2 = pytest.importorskip("cv2")

    def written(name: str, **changes: object) -> Path:
        path = tmp_path / (name + suffix)
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
        nodes = {
            "image_width": 640,
            "image_height": 480,
            "camera_matrix": np.array([[550.0, 0, 320], [0, 551.5, 240], [0, 0, 1]]),
            "distortion_coefficients": np.array([[-0.1, 0.02, 0, 1e-3, 0]]),
        } | changes
        for node, value in nodes.items():
            if value is not None:
                storage.write(node, value)
        storage.release()
        return path

    camera = load_camera(written("camera"))
    assert (camera.width, camera.height, camera.fx, camera.fy) == (640, 480, 550.0, 551.5)
    assert (camera.cx, camera.cy, camera.distortion) == (320.0, 240.0, (-0.1, 0.02, 0.0, 1e-3, 0.0))
    with pytest.raises(InputError, match="there is no node image_width"):
        load_camera(written("without", image_width=None))
    with pytest.raises(InputError, match="found 8 coefficients, expected 5"):
        load_camera(written("rational", distortion_coefficients=np.ones((1, 8))))
    with pytest.raises(InputError, match="outside the image's width of 300 pixels"):
        load_camera(written("other", image_width=300))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            b"truing-camera/1",
            b"truing-robot/1",
            r"line 1: format: found 'truing-robot/1', expected truing-camera/1",
        ),
        (b"format: truing-camera/1\n", b"", r"key 'format' is missing"),
        (b"width: 640\n", b"", r"key 'width' is missing"),
        (b"width: 640", b"width: 640.5", r"line 2: width: found 640\.5, expected a number of pixels"),
        (b"fx: 550.0", b"fx: .nan", r"line 4: fx: found NaN, expected a finite number"),
        (b"fx: 550.0", b"fx: 0.0036", r"line 4: fx: found 0\.0036, expected a focal length in pixels"),
        (b"fx: 550.0", b"focal: 550.0", r"line 4: focal: unknown key"),
        (b"cx: 320", b"cx: 700", r"line 6: cx: found 700, outside the image's width of 640 pixels"),
        (b"cy: 2.4e2", b"cy: -3", r"line 7: cy: found -3, outside the image's height"),
        (b"plumb_bob", b"fisheye", r"line 8: distortion model: found 'fisheye', expected plumb_bob"),
        (
            b"1e-3, 0]",
            b"1e-3, 0, 1, 2, 3]",
            r"line 8: distortion coefficients: found a list of 8, expected 5 coefficients .* another model",
        ),
        (b"-0.1,", b"many,", r"found 'many', expected a finite number"),
    ],
)
def test_what_is_wrong_in_a_camera_file_is_named(
    tmp_path: Path, old: bytes, new: bytes, message: str
) -> None:
    assert old in CAMERA_YAML
    (tmp_path / "camera.yaml").write_bytes(CAMERA_YAML.replace(old, new))
    with pytest.raises(InputError, match=message):
        load_camera(tmp_path / "camera.yaml")


# ---- Whatever is in a file -----------------------------------------------------------------------

POSES = b"""\
hand_x_m,hand_y_m,hand_z_m,hand_qw,hand_qx,hand_qy,hand_qz,board_x_mm,board_y_mm,board_z_mm,board_rx_deg,board_ry_deg,board_rz_deg,t_s,board_t_s,set,q1_rad
0.1,0.2,0.3,1,0,0,0,100,200,500,10,20,30,0,0.5,train,0.1
0.2,0.1,0.3,0.6,0.8,0,0,110,190,510,15,-20,30,1,1.5,train,0.2
0.3,0.2,0.1,0,0.6,0,0.8,120,180,520,20,25,-30,2,2.5,test,0.3
0.2,0.2,0.2,0,0,1,0,130,170,530,-25,20,30,3,3.5,train,-0.1
"""


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


def check(folder: Path, data: bytes) -> None:
    path = folder / "poses.csv"
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputWarning)
        try:
            found = load_handeye(path, angles="zyx")
        except InputError as error:
            assert "poses.csv" in str(error)
            return
    assert found.count >= 3 == len(found.poses.T_base_hand[0, :3, 3])
    assert np.isfinite(found.poses.T_base_hand).all() and np.isfinite(found.poses.T_camera_board).all()


@quick
@given(data=mutated(POSES))
@example(data=POSES)
def test_poses_with_faults(folder: Path, data: bytes) -> None:
    check(folder, data)


@quick
@given(text=st.text(alphabet='0123456789.,-+e"\n\r na', max_size=120))
def test_poses_of_any_cells(folder: Path, text: str) -> None:
    check(folder, POSES.split(b"\n")[0] + b"\n" + text.encode())


@quick
@given(data=mutated(CAMERA_YAML))
@example(data=CAMERA_YAML)
def test_cameras_with_faults(folder: Path, data: bytes) -> None:
    path = folder / "camera.yaml"
    path.write_bytes(data)
    try:
        camera = load_camera(path)
    except InputError as error:
        assert "camera.yaml" in str(error)
    else:
        assert camera.width > 0 and math.isfinite(camera.fx) and all(map(math.isfinite, camera.distortion))


@quick
@given(text=st.text(alphabet="chesboardicrlu0123456789xX:.m ×", max_size=40))
@example(text="chessboard:9x6:25mm")
@example(text="circles:9x6:²5mm")
def test_boards_of_any_name(text: str) -> None:
    try:
        board = truing.files.parse_board(text)
    except InputError:
        return
    assert len(board.points) >= 4 and np.isfinite(board.points).all()
