# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""AprilTags are found where they are, in rendered images: grids as Kalibr prints them and plain ones, and
single tags; and lead to the camera.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from board_images import Floats, board_poses, frame, render, tags_texture, write_images
from handeye_scenes import CAMERA_IN_HAND, columns_of, write_csv
from truing import InputError
from truing.cli.app import main
from truing.files import Board, find_board, parse_board
from truing.files.tags import TagFinder
from truing.hand_eye import Camera

cv2 = pytest.importorskip("cv2")

# A camera of usual size: a tag of Kalibr's has ten cells in a row.
LARGE = Camera(
    width=800,
    height=600,
    fx=716.7,
    fy=720.0,
    cx=405.3,
    cy=295.3,
    distortion=[-0.12, 0.06, 0.001, -0.0007, 0.0],
)
KALIBR, PLAIN = tags_texture(), tags_texture(border=1, squares=False)


# ---- Names ---------------------------------------------------------------------------------------


def tags(columns: int, rows: int, size: float, family: str, spacing: float, first: int | None = 0) -> Board:
    return Board("apriltag", columns, rows, size, 0.0, family, None, spacing, first)


@pytest.mark.parametrize(
    ("text", "board"),
    [
        ("apriltag:36h11:6x6:88mm:0.3", tags(6, 6, 0.088, "36h11", 0.3)),
        ("apriltag:tag25h9:4x3:5cm:.25", tags(4, 3, 0.05, "25h9", 0.25)),
        ("apriltag:APRILTAG_16h5:2x1:40mm:1", tags(2, 1, 0.04, "16h5", 1.0)),
        ("apriltag:36h11:6x6:88mm:0.3:top-left", replace(tags(6, 6, 0.088, "36h11", 0.3), from_top=True)),
        ("apriltag:36h11:88mm:5", tags(1, 1, 0.088, "36h11", 0.0, 5)),
        ("apriltag:36h11:88mm", tags(1, 1, 0.088, "36h11", 0.0, None)),
    ],
)
def test_tags_are_read_by_their_name_and_say_it_again(text: str, board: Board) -> None:
    read = parse_board(text)
    assert read.size == pytest.approx(board.size) and parse_board(str(read)) == read
    assert (read.columns, read.rows, read.dictionary, read.spacing, read.first) == (
        board.columns,
        board.rows,
        board.dictionary,
        board.spacing,
        board.first,
    )


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("apriltag", "no family of AprilTags ''"),
        ("apriltag:36h12:6x6:88mm:0.3", "no family of AprilTags '36h12'; there are 36h11, 25h9, 16h5"),
        ("apriltag:36h11", "missing"),
        ("apriltag:36h11:6x6:88mm", "tags, side and spacing"),
        ("apriltag:36h11:6x6:88mm:0.3:top", "tags, side and spacing .* and top-left or nothing"),
        ("apriltag:36h11:6x6:88mm:26mm", "no spacing: the gap between two tags over the side"),
        ("apriltag:36h11:6x6:88:0.3", "no length with its unit"),
        ("apriltag:36h11:0x6:88mm:0.3", "no pair of numbers"),
        ("apriltag:36h11:88mm:five", "no number of a tag"),
    ],
)
def test_what_are_no_tags_is_refused(text: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        parse_board(text)


def test_points_are_kalibrs() -> None:
    """GridCalibrationTargetAprilgrid: tag 1 right of tag 0, tag 2 above; the origin bottom left."""
    points = parse_board("apriltag:36h11:2x2:100mm:0.5").points.reshape(4, 4, 3)
    assert np.allclose(points[0, :, :2], [[0, 0.1], [0.1, 0.1], [0.1, 0], [0, 0]])
    assert np.allclose(points[1] - points[0], [0.15, 0, 0])
    assert np.allclose(points[2] - points[0], [0, 0.15, 0])


def test_points_counted_from_the_top_left_have_the_same_frame() -> None:
    """As of cv::aruco::GridBoard tag 1 is right of tag 0 and tag 2 below; the origin is where Kalibr's is."""
    points = parse_board("apriltag:36h11:2x3:100mm:0.5:top-left").points.reshape(6, 4, 3)
    assert np.allclose(points[4, :, :2], [[0, 0.1], [0.1, 0.1], [0.1, 0], [0, 0]])
    assert np.allclose(points[1] - points[0], [0.15, 0, 0])
    assert np.allclose(points[2] - points[0], [0, -0.15, 0])


# ---- Finding -------------------------------------------------------------------------------------


def errors(found: Floats, true: list[Floats]) -> tuple[float, float]:
    """Largest position [m] and rotation [rad] between poses and the truth."""
    position = max(float(np.linalg.norm(a[:3, 3] - b[:3, 3])) for a, b in zip(found, true, strict=True))
    turns = [
        math.acos(min(1, (np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2))
        for a, b in zip(found, true, strict=True)
    ]
    return position, max(turns)


def large_poses(board: Board, count: int, seed: int = 0) -> list[Floats]:
    return board_poses(board, count, seed)  # CAMERA and LARGE have the same field of view


@pytest.mark.parametrize(
    ("text", "paint"),
    [
        ("apriltag:36h11:6x6:88mm:0.3", KALIBR),
        ("apriltag:36h11:4x3:40mm:0.3", KALIBR),
        ("apriltag:36h11:4x3:40mm:0.3", PLAIN),
        ("apriltag:25h9:3x4:40mm:0.25", PLAIN),
        ("apriltag:16h5:3x2:40mm:0.5", PLAIN),
        ("apriltag:36h11:3x3:40mm:0.3", tags_texture(turn=2)),
        ("apriltag:36h11:4x3:40mm:0.3:top-left", PLAIN),
    ],
)
def test_a_grid_is_found_to_a_fraction_of_a_pixel(text: str, paint: Any) -> None:
    board = parse_board(text)
    poses = large_poses(board, 4, seed=2)
    images = [render(board, T, LARGE, seed=k, paint=paint) for k, T in enumerate(poses)]
    views = find_board(images, board, camera=LARGE)
    assert views.found == (0, 1, 2, 3)
    assert all(len(points) >= 0.9 * len(board.points) for points in views.points)
    assert views.rms.max() < (0.4 if paint is PLAIN else 0.2)
    position, angle = errors(views.T_camera_board, poses)
    assert position < 0.003 * np.linalg.norm(poses[0][:3, 3]) and angle < 4e-3


def test_a_grid_that_is_half_out_of_the_image_is_found() -> None:
    board = parse_board("apriltag:36h11:6x6:40mm:0.3")
    poses = [T @ frame([0.12, -0.1, 0], [0, 0, 0]) for T in large_poses(board, 4, seed=4)]
    images = [render(board, T, LARGE, seed=k, paint=KALIBR) for k, T in enumerate(poses)]
    views = find_board(images, board, camera=LARGE)
    assert len(views.found) == 4 and min(map(len, views.points)) < len(board.points)
    assert errors(views.T_camera_board, poses)[0] < 4e-3


def test_the_camera_is_found_from_a_grid() -> None:
    board = parse_board("apriltag:36h11:5x4:40mm:0.3")
    images = [
        render(board, T, LARGE, seed=k, paint=KALIBR) for k, T in enumerate(large_poses(board, 12, seed=5))
    ]
    camera = find_board(images, board).camera
    assert [camera.fx, camera.fy] == pytest.approx([LARGE.fx, LARGE.fy], rel=5e-3)
    assert [camera.cx, camera.cy] == pytest.approx([LARGE.cx, LARGE.cy], abs=4)


@pytest.mark.parametrize("number", [":7", ""])
def test_a_single_tag_is_found(number: str) -> None:
    printed = parse_board("apriltag:36h11:80mm:7")
    rng = np.random.default_rng(1)
    poses = [
        frame([*rng.uniform(-0.05, 0.05, 2), 0.4], [math.pi, *rng.uniform(-0.5, 0.5, 2)]) for _ in range(5)
    ]
    images = [render(printed, T, LARGE, seed=k, paint=PLAIN) for k, T in enumerate(poses)]
    views = find_board(images, f"apriltag:36h11:80mm{number}", camera=LARGE)
    assert len(views.found) == 5 and errors(views.T_camera_board, poses)[0] < 2e-3
    with pytest.raises(InputError, match="one tag .* has four corners, too few .* give --camera"):
        find_board(images, f"apriltag:36h11:80mm{number}")


def test_of_several_tags_one_has_to_be_named() -> None:
    board = parse_board("apriltag:36h11:2x1:80mm:0.5")
    images = [render(board, T, LARGE, seed=k, paint=PLAIN) for k, T in enumerate(large_poses(board, 3))]
    with pytest.raises(
        InputError, match=r"the tags 0, 1 are in one image: say which, such as apriltag:36h11:80mm:0"
    ):
        find_board(images, "apriltag:36h11:80mm", camera=LARGE)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("apriltag:36h11:3x5:40mm:0.3", r"tags of 36h11 with numbers from 0 to 14 in 3 of the 3 .* counts"),
        (
            "apriltag:25h9:5x3:40mm:0.3",
            r"tags of 36h11 with numbers from 0 to 14 in 3 of the 3 .* those of 25h9",
        ),
    ],
)
def test_other_tags_than_were_said_are_named(said: str, message: str) -> None:
    board = parse_board("apriltag:36h11:5x3:40mm:0.3")
    images = [render(board, T, LARGE, seed=k, paint=KALIBR) for k, T in enumerate(large_poses(board, 3))]
    with pytest.raises(InputError, match=message):
        find_board(images, said, camera=LARGE)


@pytest.mark.parametrize(("printed", "said"), [("", ":top-left"), (":top-left", "")])
def test_a_grid_that_is_counted_the_other_way_is_refused_by_its_name(printed: str, said: str) -> None:
    name = "apriltag:36h11:4x3:40mm:0.3"
    board = parse_board(name + printed)
    images = [render(board, T, LARGE, seed=k, paint=PLAIN) for k, T in enumerate(large_poses(board, 3))]
    with pytest.raises(InputError, match=f"counted the other way: say --board {name}{printed}$"):
        find_board(images, name + said, camera=LARGE)


# ---- The gap between tags ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("printed", "said", "paint"),
    [
        ("36h11:4x3:40mm:0.3", 0.25, KALIBR),
        ("36h11:4x3:40mm:0.3", 0.36, KALIBR),
        ("36h11:4x3:40mm:0.3", 1.3, KALIBR),
        ("36h11:3x4:40mm:0.2", 0.3, PLAIN),
        ("25h9:4x3:40mm:0.5", 0.25, PLAIN),
        ("16h5:1x3:40mm:0.4", 0.3, PLAIN),
        ("36h11:1x3:40mm:0.4:top-left", 0.3, PLAIN),
        ("36h11:3x3:40mm:0.3", 0.2, tags_texture(turn=2)),
    ],
)
def test_a_spacing_that_is_not_that_of_the_tags_is_refused(printed: str, said: float, paint: Any) -> None:
    board = parse_board(f"apriltag:{printed}")
    images = [
        render(board, T, LARGE, seed=k, paint=paint) for k, T in enumerate(large_poses(board, 3, seed=3))
    ]
    with pytest.raises(
        InputError, match=rf"gaps of 0\.\d+ times their side .* that was said is {said:g}:"
    ) as why:
        find_board(images, replace(board, spacing=said), camera=LARGE)
    seen = float(str(why.value).split("gaps of ")[1].split()[0])
    assert seen == pytest.approx(board.spacing, abs=0.015)
    find_board(images, board, camera=LARGE)


@pytest.mark.parametrize(
    ("text", "paint"),
    [
        ("36h11:6x6:30mm:0.3", KALIBR),
        ("36h11:4x3:40mm:0.2", PLAIN),
        ("25h9:3x4:40mm:0.5", PLAIN),
        ("16h5:2x3:40mm:0.25", PLAIN),
        ("36h11:3x3:40mm:0.3", tags_texture(turn=1)),
    ],
)
@pytest.mark.parametrize("views", [2, pytest.param(10, marks=pytest.mark.slow)])
def test_no_single_view_of_the_right_spacing_is_refused(text: str, paint: Any, views: int) -> None:
    board = parse_board(f"apriltag:{text}")
    for seed, T in enumerate(large_poses(board, views, seed=11)):
        finder = TagFinder(cv2, board.tags)
        assert finder(render(board, T, LARGE, seed=seed, paint=paint)) is not None
        assert finder.spacing_seen() is None


# ---- To the camera -------------------------------------------------------------------------------


@pytest.mark.parametrize("given", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_images_of_a_grid_lead_to_the_camera(tmp_path: Path, given: bool) -> None:
    board = parse_board("apriltag:36h11:4x3:40mm:0.3")
    seen = large_poses(board, 10, seed=9)
    Y = frame([0.6, 0.1, 0.05], [0.1, 0.2, 0.1])
    rng = np.random.default_rng(0)
    hands = np.array([Y @ np.linalg.inv(CAMERA_IN_HAND @ B) for B in seen])
    hands[:, :3, 3] += rng.normal(0, 5e-5, (10, 3))
    names = write_images(tmp_path, board, seen, LARGE, KALIBR)
    truing.save_camera(tmp_path / "camera.yaml", LARGE)
    write_csv(tmp_path / "poses.csv", {**columns_of("hand", hands), "image": names})
    arguments = [
        "handeye",
        str(tmp_path / "poses.csv"),
        "--board",
        str(board),
        "--out",
        str(tmp_path / "out"),
    ]
    assert main([*arguments, *(["--camera", str(tmp_path / "camera.yaml")] if given else [])]) == 0
    result = json.loads((tmp_path / "out/result.json").read_text())
    found = np.array([result["camera"][f"{axis}_m"] for axis in "xyz"])
    assert np.linalg.norm(found - CAMERA_IN_HAND[:3, 3]) < (1e-3 if given else 3e-3)
    at = np.array([result["board"][f"{axis}_m"] for axis in "xyz"])
    assert np.linalg.norm(at - Y[:3, 3]) < (1e-3 if given else 3e-3)  # the bottom left corner of tag 0
