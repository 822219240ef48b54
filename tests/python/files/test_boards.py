# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Boards are found where they are, in the order that their symmetries leave open and no other, and a board
that is not there is named.
"""

from __future__ import annotations

import builtins
import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truing
from board_images import CAMERA, Floats, board_poses, frame, render, write_images
from truing import InputError, InputWarning
from truing.files import Board, boards, find_board, parse_board
from truing.files.boards import _calibrate, plausible_camera
from truing.hand_eye import Camera

cv2 = pytest.importorskip("cv2")

PRINTED = [
    "chessboard:8x5:25mm",
    "chessboard:7x5:25mm",
    "chessboard:6x6:25mm",
    "chessboard:5x5:30mm",
    "charuco:5x7:40mm:30mm:5X5_50",
    "charuco:6x8:30mm:22mm:4X4_50",
    "circles:6x6:25mm",
    "circles:8x5:25mm",
    "acircles:4x11:20mm",
]


# ---- Names ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "board"),
    [
        ("chessboard:9x6:25mm", Board("chessboard", 9, 6, 0.025)),
        ("charuco:5x7:40mm:30mm", Board("charuco", 5, 7, 0.04, 0.03)),
        ("charuco:5X7:4cm:3cm:dict_5x5_100", Board("charuco", 5, 7, 0.04, 0.03, "5X5_100")),
        ("circles:10x10:25.4mm", Board("circles", 10, 10, 0.0254)),
        ("acircles:4x11:0.02m", Board("acircles", 4, 11, 0.02)),
        (" chessboard : 9 x 6 : 25 mm ", Board("chessboard", 9, 6, 0.025)),
    ],
)
def test_a_board_is_read_by_its_name_and_says_it_again(text: str, board: Board) -> None:
    read = parse_board(text)
    assert dataclasses.replace(read, size=0, marker=0) == dataclasses.replace(board, size=0, marker=0)
    assert [read.size, read.marker] == pytest.approx([board.size, board.marker], rel=1e-12)
    assert parse_board(str(read)) == read


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no kind of board"),
        ("chess:9x6:25mm", "no kind of board"),
        ("chessboard", "missing"),
        ("chessboard:9x6", "missing"),
        ("chessboard:9:25mm", "no pair of numbers"),
        ("chessboard:9x6:25", "no length with its unit"),
        ("chessboard:9x6:-25mm", "no length"),
        ("chessboard:9x6:25mm:3mm", "too much"),
        ("chessboard:2x6:25mm", "too small"),
        ("chessboard:9x6:25m", "not that of a board"),
        ("chessboard:9999x9999:1mm", "too large"),
        ("charuco:5x7:40mm", "missing"),
        ("charuco:5x7:30mm:40mm", "not smaller"),
        ("charuco:5x7:40mm:30mm:9X9_50", "no dictionary"),
        ("charuco:5x7:40mm:30mm:4X4_50:more", "too much"),
        ("acircles:4x10:20mm", "even number"),
        ("circles:10x10:nanmm", "no length"),
    ],
)
def test_what_is_no_board_is_refused_with_examples(text: str, why: str) -> None:
    with pytest.raises(InputError, match=why) as error:
        parse_board(text)
    assert repr(text) in str(error.value) and "chessboard:9x6:25mm (inner corners" in str(error.value)


# ---- Symmetries ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "turns"),
    [
        ("chessboard:9x6:25mm", 0),
        ("chessboard:7x5:25mm", 1),
        ("chessboard:8x6:25mm", 1),
        ("chessboard:6x6:25mm", 3),
        ("chessboard:7x7:25mm", 1),
        ("charuco:5x7:40mm:30mm", 0),
        ("circles:10x10:25mm", 3),
        ("circles:8x5:25mm", 1),
        ("acircles:4x11:20mm", 0),
    ],
)
def test_symmetries_map_the_points_onto_themselves(text: str, turns: int) -> None:
    board = parse_board(text)
    points = board.points
    assert len(board.symmetries()) == turns
    for T in board.symmetries():
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
        moved = points @ T[:3, :3].T + T[:3, 3]
        assert np.linalg.norm(moved[:, None] - points[None], axis=2).min(axis=1).max() < 1e-12
        assert not np.allclose(T, np.eye(4))


# ---- Finding -------------------------------------------------------------------------------------


def off(board: Board, found: Floats, true: Floats) -> tuple[float, float]:
    """Position [m] and rotation [rad] between a pose and the truth, in the board's symmetry that comes
    nearest.
    """
    best = (math.inf, math.inf)
    for S in (np.eye(4), *board.symmetries()):
        D = np.linalg.inv(true) @ found @ np.linalg.inv(S)
        best = min(
            best, (math.acos(np.clip((np.trace(D[:3, :3]) - 1) / 2, -1, 1)), float(np.linalg.norm(D[:3, 3])))
        )
    return best[1], best[0]


@pytest.mark.parametrize("text", PRINTED)
def test_a_board_is_found_where_it_is(text: str) -> None:
    board = parse_board(text)
    poses = board_poses(board, 4, seed=3)
    views = find_board([render(board, T, seed=k) for k, T in enumerate(poses)], board, camera=CAMERA)
    assert views.found == (0, 1, 2, 3) and views.missing == () and not views.calibrated
    for k, T in enumerate(poses):
        position, rotation = off(board, views.T_camera_board[k], T)
        distance = float(np.linalg.norm(T[:3, 3]))
        assert rotation < math.radians(0.6) and position < 4e-3 * distance
        assert views.rms[k] < (0.4 if board.kind == "charuco" else 0.25)
        assert views.points[k].shape[1] == 3 and views.pixels[k].shape == (len(views.points[k]), 2)


def test_pixels_are_those_of_the_points_to_a_tenth_and_count_from_the_pixel_centre() -> None:
    for text in ("chessboard:8x5:25mm", "acircles:4x11:20mm", "charuco:5x7:40mm:30mm:5X5_50"):
        board = parse_board(text)
        poses = board_poses(board, 3, seed=1)
        views = find_board([render(board, T, seed=k) for k, T in enumerate(poses)], board, camera=CAMERA)
        errors = [
            views.pixels[k] - truing.hand_eye.project(CAMERA, views.points[k] @ T[:3, :3].T + T[:3, 3])
            for k, T in enumerate(poses)
        ]
        every = np.concatenate(errors)
        assert np.abs(every.mean(axis=0)).max() < 0.04
        assert np.sqrt(np.mean(np.sum(every**2, axis=1))) < 0.2


@pytest.mark.parametrize("text", ["circles:6x6:25mm", "acircles:4x11:20mm"])
def test_of_dots_seen_aslant_the_centre_is_found_not_the_middle_of_the_picture(text: str) -> None:
    board = parse_board(text)
    poses = board_poses(board, 6, seed=1)
    views = find_board([render(board, T, seed=k) for k, T in enumerate(poses)], board)
    turned = [[T @ S for S in (np.eye(4), *board.symmetries())] for T in poses]
    off_centre = []
    for points, pixels, frames in zip(views.points, views.pixels, turned, strict=True):
        seen = [truing.hand_eye.project(CAMERA, points @ T[:3, :3].T + T[:3, 3]) - pixels for T in frames]
        off_centre.append(min(np.linalg.norm(one.mean(axis=0)) for one in seen))
    assert np.sqrt(np.mean(np.square(off_centre))) < 0.01  # the middles are 0.04 px beside the centres


def test_deep_pixels_are_read_by_the_bits_that_are_used(tmp_path: Path) -> None:
    board = parse_board("charuco:5x7:40mm:30mm:5X5_50")
    images = [render(board, T, seed=k) for k, T in enumerate(board_poses(board, 3, seed=2))]
    shallow = find_board(images, board, camera=CAMERA)
    for bits in (10, 12, 16):
        paths = [tmp_path / f"{bits}_{k}.png" for k in range(3)]
        for path, image in zip(paths, images, strict=True):
            cv2.imwrite(str(path), image.astype(np.uint16) << (bits - 8))
        deep = find_board(paths, board, camera=CAMERA)
        assert all(np.array_equal(a, b) for a, b in zip(deep.pixels, shallow.pixels, strict=True))
    cv2.imwrite(str(tmp_path / "float.tiff"), images[0].astype(np.float32))
    with pytest.raises(InputError, match="8 or 16 bits|no image that OpenCV can read"):
        find_board([tmp_path / "float.tiff"] * 3, board, camera=CAMERA)


def test_a_board_without_symmetry_is_never_read_turned() -> None:
    """The first square is dark: what OpenCV returns from the other end is put right."""
    board = parse_board("chessboard:8x5:25mm")
    middle = board.points.mean(axis=0)
    for degrees in (0, 90, 135, 180, 270):
        T = frame([0, 0, 0.55], [0, 0, math.radians(degrees)])
        T[:3, :3] = T[:3, :3] @ frame([0, 0, 0], [0.4, 0.2, 0])[:3, :3]
        T[:3, 3] -= T[:3, :3] @ middle
        views = find_board([render(board, T, seed=k) for k in range(3)], board, camera=CAMERA)
        assert off(board, views.T_camera_board[0], T)[1] < math.radians(0.6)


def test_the_dictionary_and_the_old_pattern_of_a_charuco_board_are_recognised() -> None:
    for printed in (
        dataclasses.replace(parse_board("charuco:6x8:30mm:22mm:6X6_50"), legacy=True),
        parse_board("charuco:6x8:30mm:22mm:7X7_100"),
    ):
        poses = board_poses(printed, 3)
        views = find_board(
            [render(printed, T, seed=k) for k, T in enumerate(poses)], "charuco:6x8:30mm:22mm", camera=CAMERA
        )
        assert views.board.dictionary.split("_")[0] == printed.dictionary.split("_")[0]
        assert views.board.legacy == bool(printed.legacy)
        assert off(printed, views.T_camera_board[0], poses[0])[1] < math.radians(0.8)


def test_part_of_a_charuco_board_is_enough() -> None:
    board = parse_board("charuco:5x7:40mm:30mm:5X5_50")
    poses = [T @ frame([-0.05, -0.07, 0], [0, 0, 0]) for T in board_poses(board, 3, distance=0.45)]
    views = find_board([render(board, T, seed=k) for k, T in enumerate(poses)], board, camera=CAMERA)
    assert any(len(points) < len(board.points) for points in views.points)
    assert max(
        off(board, views.T_camera_board[k], poses[n])[1] for k, n in enumerate(views.found)
    ) < math.radians(1.0)


def test_the_camera_is_found_from_the_images() -> None:
    board = parse_board("circles:8x5:25mm")
    poses = board_poses(board, 12, seed=5)
    views = find_board([render(board, T, seed=k) for k, T in enumerate(poses)], board)
    assert views.calibrated and views.calibration_rms < 0.1
    assert [views.camera.fx, views.camera.fy] == pytest.approx([CAMERA.fx, CAMERA.fy], rel=0.01)
    assert [views.camera.cx, views.camera.cy] == pytest.approx([CAMERA.cx, CAMERA.cy], abs=4)


def test_a_lens_that_bends_much_is_found_to_the_end() -> None:
    """Boards nearly from the front by a wide lens, seed 258: from OpenCV's own start,
    in its own 30 steps, the focal length was three times too long and 1.6 px rms were left, without a word.
    """
    rng = np.random.default_rng(258)
    points = parse_board("chessboard:6x4:42mm").points
    matrix = np.array([[990.0, 0, 860], [0, 990, 625], [0, 0, 1]])
    lens = np.array([0.26, -0.004, 0, 0, 0.001, 0.58, 0.03, 0.003])
    pixels = []
    for _ in range(14):
        turn, _ = cv2.Rodrigues(rng.normal(0, 0.15, 3))
        place = rng.uniform([-0.45, -0.25, 0.5], [0.35, 0.25, 0.65]) - turn @ points.mean(axis=0)
        seen, _ = cv2.projectPoints(points, turn, place, matrix, lens)
        pixels.append(np.asarray(seen).reshape(-1, 2) + rng.normal(0, 0.03, (len(points), 2)))
    camera, rms, _ = _calibrate(cv2, [points] * len(pixels), pixels, (1600, 1200))
    assert rms < 0.2
    assert [camera.fx, camera.fy] == pytest.approx([990, 990], rel=0.03)


def test_a_corner_that_is_far_from_where_the_others_have_it_is_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    board = parse_board("charuco:5x7:40mm:30mm:5X5_50")
    images = [render(board, T, seed=k) for k, T in enumerate(board_poses(board, 6, seed=2))]
    clean = find_board(images, board)
    find = boards._Finder._charuco

    def misplace(finder: Any, grey: Any) -> Any:
        points, pixels = find(finder, grey)
        if (grey == images[2]).all():
            pixels[5] += 3.0
        return points, pixels

    monkeypatch.setattr(boards._Finder, "_charuco", misplace)
    views = find_board(images, board)
    counts = [len(points) for points in views.points]
    assert counts == [len(points) - (k == 2) for k, points in enumerate(clean.points)]
    assert views.calibration_rms < 1.05 * clean.calibration_rms
    assert views.camera.fx == pytest.approx(clean.camera.fx, rel=2e-3)


def test_images_without_the_board_are_listed(tmp_path: Path) -> None:
    board = parse_board("circles:8x5:25mm")
    names = write_images(tmp_path, board, board_poses(board, 4))
    cv2.imwrite(str(tmp_path / "images/2.png"), np.full((CAMERA.height, CAMERA.width), 128, np.uint8))
    done: list[tuple[int, int]] = []
    views = find_board(
        [tmp_path / name for name in names],
        board,
        camera=CAMERA,
        names=names,
        progress=lambda k, n: done.append((k, n)),
    )
    assert views.found == (0, 1, 3) and views.missing == (2,)
    assert done == [(k, 4) for k in range(5)]


# ---- What is wrong is said -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("printed", "said", "message"),
    [
        (
            "chessboard:8x5:25mm",
            "chessboard:9x6:25mm",
            r"chessboard:8x5 is in 3 of the 3 .* count inner corners.* Say --board chessboard:8x5:25mm",
        ),
        ("chessboard:8x5:25mm", "chessboard:5x8:25mm", None),
        ("chessboard:8x5:25mm", "chessboard:7x4:25mm", "chessboard:8x5 is in 3 of the 3"),
        ("circles:6x6:25mm", "circles:7x6:25mm", "circles:6x6"),
        (
            "circles:6x6:25mm",
            "circles:6x5:25mm",
            "larger than circles:6x5:25mm: circles:6x6:25mm is found as well",
        ),
        ("circles:8x5:25mm", "chessboard:8x5:25mm", "circles:8x5 is in 3"),
        (
            "charuco:5x7:40mm:30mm:5X5_50",
            "charuco:5x7:40mm:30mm:4X4_50",
            "charuco:5x7 is in [23].*: its markers are of 5X5, not of 4X4_50. Say",
        ),
        ("charuco:7x5:40mm:30mm:5X5_50", "charuco:8x5:40mm:30mm", "charuco:7x5 is in [23]"),
        (
            "charuco:5x7:40mm:30mm:5X5_50",
            "charuco:5x7:40mm:20mm",
            "0.7[0-9]* times the side of their squares",
        ),
        ("charuco:5x7:40mm:30mm:5X5_50", "apriltag:36h11:3x3:30mm:0.3", "is it a ChArUco board"),
    ],
)
def test_another_board_than_was_said_is_recognised(printed: str, said: str, message: str | None) -> None:
    board = parse_board(printed)
    images = [render(board, T, seed=k) for k, T in enumerate(board_poses(board, 3, seed=8))]
    if message is None:  # rows and columns exchanged is the same board, counted along the other side
        assert find_board(images, said, camera=CAMERA).found == (0, 1, 2)
        return
    with pytest.raises(InputError, match=message):
        find_board(images, said, camera=CAMERA)


def test_no_board_at_all_says_so_and_names_the_images() -> None:
    empty = [np.full((240, 320), 90, np.uint8)] * 3
    with pytest.raises(
        InputError, match=r"found in 0 of 3 images, expected at least 3; not found in a\.png, b\.png, c\.png"
    ):
        find_board(empty, "chessboard:9x6:25mm", names=["a.png", "b.png", "c.png"])


def test_a_camera_of_another_size_or_another_camera_is_refused() -> None:
    board = parse_board("circles:8x5:25mm")
    images = [render(board, T, seed=k) for k, T in enumerate(board_poses(board, 6))]
    double = Camera(width=960, height=720, fx=860, fy=864, cx=486, cy=354)
    with pytest.raises(
        InputError,
        match=(
            r"480 x 360 pixels, but the values of cam\.yaml are for 960 x 720\. If the images were only"
            r" scaled: .* times 0\.5"
        ),
    ):
        find_board(images, board, camera=double, where="cam.yaml")
    with pytest.raises(
        InputError,
        match="480 x 360 pixels, but the values of the camera are for 100 x 100. Leave the camera out",
    ):
        find_board(images, board, camera=Camera(width=100, height=100, fx=100, fy=100, cx=50, cy=50))
    with pytest.raises(
        InputError, match=r"cam\.yaml does not fit the images.*px with values found from these images"
    ):
        find_board(
            images,
            board,
            camera=CAMERA.replace(fx=4000.0, fy=4000.0, distortion=[2.5, 0, 0.3, 0, 0]),
            where="cam.yaml",
        )
    with pytest.warns(InputWarning, match="the camera does not fit the images"):
        find_board(images, board, camera=CAMERA.replace(distortion=[0.5, 0, 0, 0, 0]))


def test_images_of_two_sizes_are_refused() -> None:
    with pytest.raises(
        InputError, match="one of 320 x 240|b has 300 x 240|has 300 x 240 pixels, but a has 320 x 240"
    ):
        find_board(
            [np.zeros((240, 320), np.uint8), np.zeros((240, 300), np.uint8)],
            "chessboard:9x6:25mm",
            names=["a", "b"],
        )


def test_boards_that_are_not_tilted_do_not_show_the_focal_length() -> None:
    board = parse_board("circles:8x5:25mm")
    flat = [frame([-0.09 + 0.01 * k, -0.05, 0.5], [0, 0, 0]) for k in range(4)]
    with pytest.raises(
        InputError,
        match="cannot be found from these images.*[Tt]ilt|cannot be found from these images.*tilted",
    ):
        find_board([render(board, T, seed=k) for k, T in enumerate(flat)], board)


def test_files_that_are_no_images_are_named(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_text("no image")
    (tmp_path / "b.png").write_bytes(b"")
    for name in ("a.png", "b.png"):
        with pytest.raises(InputError, match=f"{name}: is no image"):
            find_board([tmp_path / name], "chessboard:9x6:25mm")
    with pytest.raises(InputError, match=r"c\.png: cannot be read: No such file"):
        find_board([tmp_path / "c.png"], "chessboard:9x6:25mm")
    with pytest.raises(InputError, match="expected grey values of 8 or 16 bits"):
        find_board([np.zeros((200, 200))], "chessboard:9x6:25mm")  # type: ignore[list-item]


def test_without_opencv_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "cv2":
            raise ModuleNotFoundError("No module named 'cv2'", name="cv2")
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(
        InputError, match=r'needs OpenCV, which is not installed: pip install "truing\[images\]"'
    ):
        find_board([], "chessboard:9x6:25mm")


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"fx": 0.0}, "fx"),
        ({"fx": -400.0}, "fx"),
        ({"fy": 4.3}, "fy"),
        ({"fy": 2000.0}, "fy"),
        ({"cx": 700.0}, "cx"),
        ({"cy": -3.0}, "cy"),
        ({"fx": 1e9, "fy": 1e9}, "fx"),
    ],
)
def test_values_that_no_camera_has_are_told(changes: dict[str, float], name: str) -> None:
    wrong = plausible_camera(CAMERA.replace(**changes))
    assert wrong is not None and wrong[0] == name
    assert plausible_camera(CAMERA) is None


def test_a_camera_found_from_images_has_the_same_bits_every_time() -> None:
    board = parse_board("chessboard:8x5:25mm")
    images = [render(board, T, CAMERA) for T in board_poses(board, 12, seed=3)]
    threads = cv2.getNumThreads()
    cv2.setNumThreads(4)  # as many as a usual machine has, whatever this one has
    try:
        found = [find_board(images, board) for _ in range(6)]
        assert cv2.getNumThreads() == 4
    finally:
        cv2.setNumThreads(threads)
    for again in found[1:]:
        assert again.camera.fx == found[0].camera.fx and again.camera.distortion == found[0].camera.distortion
        assert np.array_equal(again.T_camera_board, found[0].T_camera_board)
