# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye scenes are what they claim to be."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from truing.errors import InputError
from truing.testing.scenes import (
    DEGENERATE,
    LAYOUTS,
    MISTAKES,
    SETUPS,
    Board,
    Floats,
    HandEyeScene,
    PinholeCamera,
    Setup,
    flipped_boards,
    inverted_board,
    left_handed,
    millimetres,
    one_behind,
    quaternion_of_rotation,
    render_board,
    rotation,
    rotation_of_quaternion,
    rotation_vector,
    scalar_last,
    scaled,
    shuffled,
    simulate_handeye,
    simulate_streams,
    typing_error,
)

QUIET: dict[str, Any] = {"hand_m": 0.0, "hand_rad": 0.0, "camera_m": 0.0, "camera_rad": 0.0, "pixel": 0.0}


@pytest.fixture(params=SETUPS)
def setup(request: pytest.FixtureRequest) -> Setup:
    chosen: Setup = request.param
    return chosen


def gaps(scene: HandEyeScene, hand: Floats, seen: Floats) -> tuple[Floats, Floats]:
    """By how much the loop does not close, pose by pose: rotation vectors [rad] and translations [m], in the
    frame that does not move.
    """
    chain = (
        hand @ scene.T_parent_board if scene.setup == "eye-to-hand" else hand @ scene.T_parent_camera @ seen
    )
    wanted = (
        scene.T_parent_camera @ seen
        if scene.setup == "eye-to-hand"
        else np.broadcast_to(scene.T_parent_board, chain.shape)
    )
    return (
        rotation_vector(np.swapaxes(wanted[:, :3, :3], 1, 2) @ chain[:, :3, :3]),
        chain[:, :3, 3] - wanted[:, :3, 3],
    )


def worst(scene: HandEyeScene) -> float:
    turned, shifted = gaps(scene, scene.T_base_hand, scene.T_camera_board)
    return float(max(np.abs(turned).max(), np.abs(shifted).max()))


# ---- The scene -----------------------------------------------------------------------------------


def test_without_noise_the_loop_closes(setup: Setup) -> None:
    scene = simulate_handeye(setup, 50, **QUIET, seed=3)
    assert worst(scene) < 1e-13
    np.testing.assert_array_equal(scene.T_base_hand, scene.true_T_base_hand)
    np.testing.assert_array_equal(scene.T_camera_board, scene.true_T_camera_board)


def test_frames_are_proper(setup: Setup) -> None:
    scene = simulate_handeye(setup, 40, seed=5)
    for frames in (
        scene.T_base_hand,
        scene.T_camera_board,
        scene.T_parent_camera[None],
        scene.T_parent_board[None],
    ):
        R = frames[:, :3, :3]
        np.testing.assert_allclose(R @ np.swapaxes(R, 1, 2), np.broadcast_to(np.eye(3), R.shape), atol=1e-14)
        assert (np.linalg.det(R) > 0).all()
        np.testing.assert_array_equal(frames[:, 3], np.broadcast_to([0, 0, 0, 1], (len(frames), 4)))


def test_noise_has_the_stated_size_and_is_white(setup: Setup) -> None:
    sizes: dict[str, Any] = {"hand_m": 2e-4, "hand_rad": 1e-3, "camera_m": 7e-4, "camera_rad": 3e-3}
    scene = simulate_handeye(setup, 4000, **sizes, seed=1)
    R = np.swapaxes(scene.T_base_hand[:, :3, :3], 1, 2) @ scene.true_T_base_hand[:, :3, :3]
    hand = np.column_stack(
        [scene.true_T_base_hand[:, :3, 3] - scene.T_base_hand[:, :3, 3], rotation_vector(R)]
    )
    R = np.swapaxes(scene.true_T_camera_board[:, :3, :3], 1, 2) @ scene.T_camera_board[:, :3, :3]
    camera = np.column_stack(
        [scene.T_camera_board[:, :3, 3] - scene.true_T_camera_board[:, :3, 3], rotation_vector(R)]
    )
    drawn = np.column_stack([hand, camera]) / np.repeat(list(sizes.values()), 3)
    np.testing.assert_allclose(drawn.std(axis=0), 1, atol=4 / math.sqrt(2 * len(drawn)))
    np.testing.assert_allclose(drawn.mean(axis=0), 0, atol=4.5 / math.sqrt(len(drawn)))
    np.testing.assert_allclose(np.corrcoef(drawn.T), np.eye(12), atol=4.5 / math.sqrt(len(drawn)))


def test_the_same_seed_gives_the_same_scene_and_another_another(setup: Setup) -> None:
    one, two, other = (
        simulate_handeye(setup, 20, board=Board(), outliers=0.1, seed=seed) for seed in (7, 7, 8)
    )
    for name in ("T_base_hand", "T_camera_board", "T_parent_camera", "T_parent_board", "pixels"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
        assert not np.array_equal(getattr(one, name), getattr(other, name))
    assert one.outlier_rows == two.outlier_rows


def test_a_longer_scene_begins_with_the_shorter_one(setup: Setup) -> None:
    short, long = simulate_handeye(setup, 10, seed=4), simulate_handeye(setup, 300, seed=4)
    np.testing.assert_array_equal(short.T_base_hand, long.T_base_hand[:10])
    np.testing.assert_array_equal(short.T_camera_board, long.T_camera_board[:10])
    np.testing.assert_array_equal(short.T_parent_camera, long.T_parent_camera)


def test_a_board_adds_pixels_and_changes_nothing_else(setup: Setup) -> None:
    poses, images = simulate_handeye(setup, 10, seed=4), simulate_handeye(setup, 10, board=Board(), seed=4)
    np.testing.assert_array_equal(poses.T_base_hand, images.T_base_hand)
    np.testing.assert_array_equal(poses.T_camera_board, images.T_camera_board)
    assert poses.pixels is None and images.pixels is not None


def test_the_scene_is_of_the_size_of_an_arm(setup: Setup) -> None:
    layout = LAYOUTS[setup]
    scene = simulate_handeye(setup, 500, **QUIET, seed=2)
    middle = scene.T_camera_board[:, :3, :3] @ scene.board.centre + scene.T_camera_board[:, :3, 3]
    assert (np.abs(middle - [0, 0, layout.distance]) <= layout.box).all()
    tilts = np.arccos(scene.T_camera_board[:, 2, 2])
    assert 0.9 * layout.tilt < tilts.max() <= layout.tilt
    assert np.linalg.norm(scene.T_base_hand[:, :3, 3], axis=1).max() < 2.0
    carried = (
        scene.T_parent_board @ np.append(scene.board.centre, 1)
        if setup == "eye-to-hand"
        else scene.T_parent_camera[:, 3]
    )
    assert np.linalg.norm(carried[:3]) == pytest.approx(layout.lever)


def test_gross_outliers_are_where_and_as_large_as_stated(setup: Setup) -> None:
    scene = simulate_handeye(setup, 40, **QUIET, outliers=0.1, seed=6)
    assert len(scene.outlier_rows) == 4
    clean = simulate_handeye(setup, 40, **QUIET, seed=6)
    shifted = np.linalg.norm(scene.T_camera_board[:, :3, 3] - clean.T_camera_board[:, :3, 3], axis=1)
    turned = np.linalg.norm(
        rotation_vector(np.swapaxes(clean.T_camera_board[:, :3, :3], 1, 2) @ scene.T_camera_board[:, :3, :3]),
        axis=1,
    )
    wrong = np.isin(np.arange(40), scene.outlier_rows)
    np.testing.assert_allclose(shifted, np.where(wrong, 0.03, 0), atol=1e-14)
    np.testing.assert_allclose(turned, np.where(wrong, math.radians(10), 0), atol=1e-12)


def test_select_keeps_the_outliers_where_they_go() -> None:
    scene = simulate_handeye(poses=20, outliers=0.1, board=Board(), seed=6)
    first, second = scene.outlier_rows
    chosen = scene.select([second, 3, first])
    assert chosen.poses == 3 and set(chosen.outlier_rows) - {1} == {0, 2}
    assert scene.pixels is not None and chosen.pixels is not None
    np.testing.assert_array_equal(chosen.pixels[2], scene.pixels[first])


@pytest.mark.parametrize(
    "wrong", [{"setup": "eye"}, {"poses": 0}, {"outliers": 1.0}, {"hand_m": -1.0}, {"pixel": -0.1}]
)
def test_what_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError):
        simulate_handeye(**wrong)  # type: ignore[arg-type]


# ---- Images --------------------------------------------------------------------------------------


def test_every_point_of_the_board_is_in_the_image(setup: Setup) -> None:
    scene = simulate_handeye(setup, 200, board=Board(), seed=2)
    assert scene.pixels is not None
    assert scene.pixels.shape == (200, 54, 2)
    assert scene.pixels.min() > 0 and (scene.pixels < [scene.camera.width - 1, scene.camera.height - 1]).all()


def test_pixel_noise_has_the_stated_size() -> None:
    noisy, exact = (
        simulate_handeye(poses=200, board=Board(), pixel=pixel, seed=2).pixels for pixel in (0.1, 0.0)
    )
    assert noisy is not None and exact is not None
    assert (noisy - exact).std() == pytest.approx(0.1, rel=0.03)


def test_rays_undo_the_projection() -> None:
    camera = PinholeCamera()
    pixels = np.stack(np.meshgrid(np.linspace(0, 1279, 30), np.linspace(0, 959, 20)), axis=-1)
    rays = camera.rays(pixels)
    np.testing.assert_allclose(
        camera.project(np.concatenate([rays, np.ones((20, 30, 1))], axis=-1)), pixels, atol=1e-8
    )


def test_projection_is_that_of_opencv() -> None:
    cv2 = pytest.importorskip("cv2")
    scene = simulate_handeye(poses=3, board=Board(), pixel=0.0, seed=2)
    assert scene.pixels is not None
    for T, pixels in zip(scene.true_T_camera_board, scene.pixels, strict=True):
        theirs, _ = cv2.projectPoints(
            scene.board.points,
            rotation_vector(T[:3, :3]),
            T[:3, 3],
            scene.camera.matrix,
            np.array(scene.camera.distortion),
        )
        np.testing.assert_allclose(pixels, theirs.reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize("kind", ["chessboard", "circles"])
def test_a_rendered_board_is_dark_where_it_should_be(kind: str) -> None:
    board = Board(kind=kind)  # type: ignore[arg-type]
    scene = simulate_handeye(poses=1, board=board, pixel=0.0, seed=2)
    T = scene.true_T_camera_board[0]
    image = render_board(scene.camera, board, T, noise=0.0)
    assert image.shape == (960, 1280) and image.dtype == np.uint8
    at = np.array([[0.5, 0.5, 0], [1.5, 0.5, 0], [-1.5, -1.5, 0], [3.0, 2.0, 0]]) * board.spacing
    u, v = np.rint(scene.camera.project(at @ T[:3, :3].T + T[:3, 3])).astype(int).T
    grey = image[v, u].astype(int)
    assert grey[2] > 200
    if kind == "chessboard":
        assert grey[0] < 60 and grey[1] > 200
    else:
        assert grey[0] > 200 and grey[3] < 60
    np.testing.assert_array_equal(image, render_board(scene.camera, board, T, noise=0.0))


def test_opencv_finds_the_corners_where_the_projection_says() -> None:
    cv2 = pytest.importorskip("cv2")
    scene = simulate_handeye(poses=2, board=Board(), pixel=0.0, seed=2)
    assert scene.pixels is not None
    for T, pixels in zip(scene.true_T_camera_board, scene.pixels, strict=True):
        image = render_board(scene.camera, scene.board, T)
        there, corners = cv2.findChessboardCorners(image, (9, 6))
        assert there
        corners = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), (3, 50, 1e-4)).reshape(-1, 2)
        if np.linalg.norm(corners[0] - pixels[0]) > np.linalg.norm(corners[-1] - pixels[0]):
            corners = corners[::-1]  # the other end of a 9 x 6 board looks the same but for its colours
        assert np.sqrt(((corners - pixels) ** 2).mean()) < 0.06


def test_a_board_behind_the_camera_is_refused() -> None:
    T = np.eye(4)
    T[2, 3] = -1.0
    with pytest.raises(InputError):
        render_board(PinholeCamera(), Board(), T)


# ---- Data that cannot tell -----------------------------------------------------------------------


def motions(scene: HandEyeScene) -> Floats:
    """Rotation vectors from the first hand pose to the others."""
    R = scene.true_T_base_hand[:, :3, :3]
    return rotation_vector(np.swapaxes(R[:1], 1, 2) @ R[1:])


def test_one_rotation_axis_is_one(setup: Setup) -> None:
    scene = DEGENERATE["one rotation axis"](setup, 30, seed=3, **QUIET)
    values = np.linalg.svd(motions(scene), compute_uv=False)
    assert values[0] > 1 and values[1] < 1e-12
    axis = scene.T_base_hand[:, :3, :3] @ np.linalg.svd(motions(scene))[2][0]
    if setup == "eye-to-hand":
        np.testing.assert_allclose(np.abs(axis[:, 2]), 1, atol=1e-12)
    assert worst(scene) < 1e-13


def test_pure_translation_does_not_turn(setup: Setup) -> None:
    scene = DEGENERATE["pure translation"](setup, 30, seed=3, **QUIET)
    assert np.abs(motions(scene)).max() < 1e-12
    assert np.ptp(scene.T_base_hand[:, :3, 3], axis=0).min() > 0.1


def test_tiny_rotations_are_tiny(setup: Setup) -> None:
    scene = DEGENERATE["tiny rotations"](setup, 30, seed=3, angle=0.01, **QUIET)
    turned = np.linalg.norm(motions(scene), axis=1)
    assert 0.005 < turned.max() < 0.03
    assert np.linalg.svd(motions(scene), compute_uv=False)[2] > 1e-4


def test_equal_poses_are_equal(setup: Setup) -> None:
    scene = DEGENERATE["equal poses"](setup, seed=3)
    assert scene.poses == 5
    np.testing.assert_array_equal(scene.T_base_hand, scene.T_base_hand[[0] * 5])
    np.testing.assert_array_equal(scene.T_camera_board, scene.T_camera_board[[0] * 5])


# ---- Data that are wrong -------------------------------------------------------------------------


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_breaks_the_loop_and_leaves_the_truth(setup: Setup, name: str) -> None:
    scene = simulate_handeye(setup, 30, **QUIET, seed=3)
    spoilt = MISTAKES[name](scene)
    assert worst(scene) < 1e-13 and worst(spoilt) > 0.02
    np.testing.assert_array_equal(spoilt.T_parent_camera, scene.T_parent_camera)
    np.testing.assert_array_equal(spoilt.T_parent_board, scene.T_parent_board)
    again = MISTAKES[name](scene)
    np.testing.assert_array_equal(spoilt.T_base_hand, again.T_base_hand)
    np.testing.assert_array_equal(spoilt.T_camera_board, again.T_camera_board)
    R = spoilt.T_base_hand[:, :3, :3]
    np.testing.assert_allclose(
        np.linalg.det(R), 1, atol=1e-12
    )  # nothing that a check of single poses would find


def test_a_mistake_undone_closes_the_loop(setup: Setup) -> None:
    scene = simulate_handeye(setup, 30, **QUIET, seed=3)
    for twice in (inverted_board, left_handed):
        np.testing.assert_allclose(twice(twice(scene)).T_base_hand, scene.T_base_hand, atol=1e-14)
        np.testing.assert_allclose(twice(twice(scene)).T_camera_board, scene.T_camera_board, atol=1e-14)
    q = quaternion_of_rotation(scalar_last(scene).T_base_hand[:, :3, :3])
    back = rotation_of_quaternion(np.roll(q, 1, axis=1))
    np.testing.assert_allclose(back, scene.T_base_hand[:, :3, :3], atol=1e-13)
    np.testing.assert_allclose(millimetres(scene).T_base_hand[:, :3, 3], 1000 * scene.T_base_hand[:, :3, 3])


def test_a_flipped_board_is_the_same_board_from_its_other_end() -> None:
    scene = simulate_handeye(poses=30, **QUIET, board=Board(), seed=3)
    spoilt = flipped_boards(scene)
    assert len(spoilt.outlier_rows) == 9 and spoilt.pixels is not None
    points = (
        scene.board.points @ np.swapaxes(spoilt.T_camera_board[:, :3, :3], 1, 2)
        + spoilt.T_camera_board[:, None, :3, 3]
    )
    np.testing.assert_allclose(scene.camera.project(points), spoilt.pixels, atol=1e-9)


def test_a_typing_error_is_in_one_number() -> None:
    scene = simulate_handeye(poses=30, seed=3)
    changed = typing_error(scene).T_base_hand - scene.T_base_hand
    assert np.count_nonzero(changed) == 1
    assert changed[typing_error(scene).outlier_rows[0], 1, 3] == pytest.approx(0.405)


def test_one_behind_puts_every_hand_beside_the_next_image() -> None:
    scene = simulate_handeye(poses=10, board=Board(), seed=3)
    behind = one_behind(scene)
    assert behind.poses == 9 and behind.pixels is not None and scene.pixels is not None
    np.testing.assert_array_equal(behind.T_base_hand, scene.T_base_hand[:-1])
    np.testing.assert_array_equal(behind.T_camera_board, scene.T_camera_board[1:])
    np.testing.assert_array_equal(behind.pixels, scene.pixels[1:])


def test_order_and_unit_are_no_mistakes(setup: Setup) -> None:
    scene = simulate_handeye(setup, 30, **QUIET, seed=3)
    assert worst(shuffled(scene)) < 1e-13
    assert worst(scaled(scene)) < 1e-10
    assert not np.array_equal(shuffled(scene).T_base_hand, scene.T_base_hand)


# ---- Streams -------------------------------------------------------------------------------------


def test_streams_agree_once_the_clocks_do(setup: Setup) -> None:
    streams = simulate_streams(setup, seconds=6, hand_m=0, hand_rad=0, camera_m=0, camera_rad=0, seed=2)
    assert np.diff(streams.t_hand) == pytest.approx(1 / 125) and np.diff(streams.t_camera) == pytest.approx(
        1 / 30
    )

    def gap(offset: float) -> float:
        """Median distance in which the loop does not close, with the board interpolated to the hand's
        instants.
        """
        t = streams.t_hand + offset
        within = (t > streams.t_camera[0]) & (t < streams.t_camera[-1])
        board = np.column_stack(
            [np.interp(t[within], streams.t_camera, column) for column in streams.T_camera_board[:, :3, 3].T]
        )
        hand = streams.T_base_hand[within]
        if setup == "eye-to-hand":
            one, two = (
                hand @ streams.T_parent_board[:, 3],
                board @ streams.T_parent_camera[:3, :3].T + streams.T_parent_camera[:3, 3],
            )
        else:
            one = (hand @ streams.T_parent_camera @ np.column_stack([board, np.ones(len(board))])[..., None])[
                ..., 0
            ]
            two = np.broadcast_to(streams.T_parent_board[:3, 3], (len(one), 3))
        return float(np.median(np.linalg.norm(one[:, :3] - two, axis=1)))

    assert gap(streams.clock_offset) < 5e-4  # what linear interpolation leaves
    assert gap(0.0) > 5 * gap(streams.clock_offset)
    assert gap(2 * streams.clock_offset) > 5 * gap(streams.clock_offset)


def test_streams_move_smoothly(setup: Setup) -> None:
    streams = simulate_streams(setup, hand_m=0, hand_rad=0, camera_m=0, camera_rad=0, seed=5)
    speed = np.linalg.norm(np.diff(streams.T_base_hand[:, :3, 3], axis=0), axis=1) * 125
    assert 0.02 < np.median(speed) < 1.0 and speed.max() < 3.0
    assert (np.diff(streams.t_camera) > 0).all()


# ---- Rotations -----------------------------------------------------------------------------------


def test_rotations_there_and_back() -> None:
    rng = np.random.default_rng(1)
    vectors = rng.normal(size=(500, 3))
    vectors *= (rng.uniform(0, np.pi, 500) / np.linalg.norm(vectors, axis=1))[:, None]
    vectors[0], vectors[1], vectors[2] = 0, [1e-9, 0, 0], [np.pi - 1e-9, 0, 0]
    R = rotation(vectors)
    np.testing.assert_allclose(rotation_vector(R), vectors, atol=1e-8)
    np.testing.assert_allclose(rotation_of_quaternion(quaternion_of_rotation(R)), R, atol=1e-14)
    np.testing.assert_allclose(
        rotation(np.array([0, 0, np.pi / 2])), [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15
    )
