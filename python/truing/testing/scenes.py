# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye scenes whose truth is known: what a controller reports and what a camera sees.

    scene = simulate_handeye("eye-to-hand", poses=30, seed=1)
    scene.T_base_hand, scene.T_camera_board  # what a calibration gets
    scene.T_parent_camera                    # what it should find

In every scene and pose, with the true frames,

    eye-to-hand:  T_base_hand @ T_hand_board = T_base_camera @ T_camera_board     parent of the camera: base;
    of the board: hand
    eye-in-hand:  T_base_hand @ T_hand_camera @ T_camera_board = T_base_board     parent of the camera: hand;
    of the board: base

Noise acts on a frame by a rotation vector about the frame's own axes, in its origin, and by a translation,
each component independent
and normal: `R_true = R_reported @ exp(w)`, `t_true = t_reported + n` for the hand; `R_seen = R_true @
exp(w)`, `t_seen = t_true + n` for the board in the camera. So a rotation error of the hand moves a board that
is mounted a lever away; a rotation error of the seen board does not move its origin.

Nothing here knows a solver. `MISTAKES` and `DEGENERATE` are what users hand in: data that are wrong, and data
that cannot tell.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from truing.errors import InputError

Floats = NDArray[np.float64]
Setup = Literal["eye-to-hand", "eye-in-hand"]
SETUPS: tuple[Setup, ...] = ("eye-to-hand", "eye-in-hand")
_BATCH = 64  # candidates drawn at a time: a longer scene of the same seed begins with the shorter one


@dataclass(frozen=True)
class Board:
    """A flat pattern. Its frame: origin in the first point, x along a row, y along a column, z away from who
    looks at it.
    """

    columns: int = 9
    rows: int = 6
    spacing: float = 0.025  # between neighbouring points [m]
    kind: Literal["chessboard", "circles"] = "chessboard"

    @property
    def points(self) -> Floats:
        """Inner corners or centres of circles, row by row, shape=(rows * columns, 3) [m]."""
        x, y = np.meshgrid(np.arange(self.columns), np.arange(self.rows))
        return np.column_stack([self.spacing * x.ravel(), self.spacing * y.ravel(), np.zeros(x.size)])

    @property
    def centre(self) -> Floats:
        return self.spacing * np.array([(self.columns - 1) / 2, (self.rows - 1) / 2, 0.0])


@dataclass(frozen=True)
class PinholeCamera:
    """Intrinsics in pixels, with the five coefficients k1 k2 p1 p2 k3 of plumb_bob; the centre of the first
    pixel is (0, 0).
    """

    width: int = 1280
    height: int = 960
    fx: float = 1100.0
    fy: float = 1098.0
    cx: float = 645.0
    cy: float = 476.0
    distortion: tuple[float, float, float, float, float] = (-0.12, 0.09, 4e-4, -3e-4, -0.02)

    @property
    def matrix(self) -> Floats:
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def project(self, points: Floats) -> Floats:
        """Points in the camera frame, shape=(..., 3) [m], to pixels, shape=(..., 2)."""
        distorted = self._distort(points[..., :2] / points[..., 2:])
        return np.asarray(distorted * np.array([self.fx, self.fy]) + np.array([self.cx, self.cy]))

    def rays(self, pixels: Floats) -> Floats:
        """Pixels, shape=(..., 2), to undistorted coordinates x/z, y/z."""
        wanted = (pixels - np.array([self.cx, self.cy])) / np.array([self.fx, self.fy])
        found = wanted.copy()
        for _ in range(20):  # a contraction for every lens that does not fold the image
            found += wanted - self._distort(found)
        return np.asarray(found)

    def _distort(self, ideal: Floats) -> Floats:
        k1, k2, p1, p2, k3 = self.distortion
        x, y = ideal[..., 0], ideal[..., 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            ],
            axis=-1,
        )


@dataclass(frozen=True)
class Layout:
    """Where things are, and how far the poses spread. Positions are drawn evenly in a box before the camera,
    tilts evenly in a cone.
    """

    distance: float  # from the camera to the middle of the box [m]
    box: tuple[float, float, float]  # half sides along the camera's x, y, z [m]
    tilt: float  # largest angle between the board's normal and the optical axis [rad]
    roll: float  # largest turn about the board's normal [rad]
    lever: float  # from the hand to what it carries: the board's middle, or the camera [m]
    reach: float  # from the robot base to the middle of the box [m]

    def __post_init__(self) -> None:
        if not (
            self.distance > self.box[2] >= 0
            and min(self.box) >= 0
            and 0 <= self.tilt < math.pi / 2
            and 0 <= self.roll <= math.pi
        ):
            raise InputError(f"a layout with the board behind or beside the camera: {self}")


LAYOUTS: Mapping[Setup, Layout] = MappingProxyType(
    {
        "eye-to-hand": Layout(
            distance=0.9,
            box=(0.38, 0.285, 0.32),
            tilt=math.radians(50),
            roll=math.radians(75),
            lever=0.16,
            reach=0.9,
        ),
        "eye-in-hand": Layout(
            distance=0.5,
            box=(0.16, 0.12, 0.12),
            tilt=math.radians(40),
            roll=math.radians(75),
            lever=0.10,
            reach=0.7,
        ),
    }
)


@dataclass(frozen=True)
class HandEyeScene:
    """What a controller reports, what a camera sees, and the truth behind both."""

    setup: Setup
    T_base_hand: Floats  # shape=(n, 4, 4): as reported
    T_camera_board: Floats  # shape=(n, 4, 4): as seen
    T_parent_camera: Floats  # truth: in the base for eye-to-hand, in the hand for eye-in-hand
    T_parent_board: Floats  # truth: in the hand, or in the base
    true_T_base_hand: Floats
    true_T_camera_board: Floats  # the wrong ones of outliers included: what the camera believes to see
    outlier_rows: tuple[int, ...]
    hand_m: float  # noise, per axis: [m], [rad], [px]
    hand_rad: float
    camera_m: float
    camera_rad: float
    pixel: float
    camera: PinholeCamera
    board: Board
    # shape=(n, points of the board, 2): what the camera sees instead of T_camera_board, with noise of its own
    pixels: Floats | None
    seed: int

    @property
    def poses(self) -> int:
        return len(self.T_base_hand)

    def select(self, rows: NDArray[np.intp] | list[int]) -> HandEyeScene:
        """The scene with these poses, in this order."""
        chosen = np.asarray(rows, dtype=np.intp)
        return replace(
            self,
            T_base_hand=self.T_base_hand[chosen],
            T_camera_board=self.T_camera_board[chosen],
            true_T_base_hand=self.true_T_base_hand[chosen],
            true_T_camera_board=self.true_T_camera_board[chosen],
            pixels=None if self.pixels is None else self.pixels[chosen],
            outlier_rows=tuple(new for new, old in enumerate(chosen.tolist()) if old in self.outlier_rows),
        )


@dataclass(frozen=True)
class HandEyeStreams:
    """A hand and a camera that were recorded while the arm moved, each by its own clock."""

    setup: Setup
    t_hand: Floats  # [s], the robot's clock
    T_base_hand: Floats
    t_camera: Floats  # [s], the camera's clock: what it stamped t happened at t - clock_offset by the robot's
    T_camera_board: Floats
    clock_offset: float  # truth [s]
    T_parent_camera: Floats
    T_parent_board: Floats
    seed: int


def simulate_handeye(
    setup: Setup = "eye-to-hand",
    poses: int = 30,
    *,
    hand_m: float = 1e-4,
    hand_rad: float = math.radians(0.05),
    camera_m: float = 5e-4,
    camera_rad: float = math.radians(0.1),
    board: Board | None = None,
    camera: PinholeCamera | None = None,
    pixel: float = 0.1,
    outliers: float = 0.0,
    outlier_m: float = 0.03,
    outlier_rad: float = math.radians(10.0),
    layout: Layout | None = None,
    camera_looks_down: bool = False,
    seed: int = 0,
) -> HandEyeScene:
    """A camera, a board and an arm at random, and `poses` poses in which the camera sees the whole board.

    Args:
        hand_m: Noise of the reported hand, per axis [m]; hand_rad: about each axis [rad].
        camera_m: Noise of the seen board, per axis [m]; camera_rad: about each axis [rad].
        board: Make images too: the points of this board in pixels, with noise `pixel` per axis. It is
            independent of the noise of T_camera_board; a calibration uses one or the other.
        outliers: Fraction of the boards, rounded, that is seen off by `outlier_m` [m] in a random direction
            and turned by `outlier_rad` [rad] about a random axis; their pixels too.
        layout: Where things are; by default LAYOUTS[setup].
        camera_looks_down: Eye-to-hand: the optical axis is the base's -z. Eye-in-hand: it is parallel to the
            hand's z.
        seed: The same seed gives the same scene, and a longer one begins with the shorter one.
    """
    _check_scene(
        setup, poses, outliers, (hand_m, hand_rad, camera_m, camera_rad, pixel, outlier_m, outlier_rad)
    )
    layout = layout or LAYOUTS[setup]
    lens, pattern = camera or PinholeCamera(), board or Board()
    T_parent_camera, T_parent_board = _mounts(setup, layout, pattern, camera_looks_down, seed)
    seen = _visible_boards(poses, layout, lens, pattern, seed)
    hand = _hand_of(setup, T_parent_camera, T_parent_board, seen)

    rows, seen = _with_outliers(seen, outliers, outlier_m, outlier_rad, seed)
    reported, noisy = _with_noise(hand, seen, (hand_m, hand_rad), (camera_m, camera_rad), seed)
    pixels = None
    if board is not None:
        exact = lens.project(_apply(seen, board.points))
        pixels = exact + pixel * np.random.default_rng([seed, 5]).normal(size=exact.shape)
    return HandEyeScene(
        setup,
        reported,
        noisy,
        T_parent_camera,
        T_parent_board,
        hand,
        seen,
        tuple(int(row) for row in rows),
        hand_m,
        hand_rad,
        camera_m,
        camera_rad,
        pixel if board else 0.0,
        lens,
        pattern,
        pixels,
        seed,
    )


def _check_scene(setup: str, poses: int, outliers: float, sizes: Sequence[float]) -> None:
    if setup not in SETUPS:
        raise InputError(f"setup: found {setup!r}, expected one of {', '.join(SETUPS)}")
    if poses < 1:
        raise InputError(f"poses: found {poses}, expected at least 1")
    if not 0 <= outliers < 1:
        raise InputError(f"fraction of outliers: found {outliers:g}, expected 0 to 1")
    if min(sizes) < 0:
        raise InputError("noise and the size of outliers must not be negative")


def _with_outliers(
    boards: Floats, share: float, metres: float, radians: float, seed: int
) -> tuple[NDArray[np.intp], Floats]:
    """Rows that are seen wrongly, and the boards as they are seen."""
    rng = np.random.default_rng([seed, 3])
    rows = np.sort(rng.choice(len(boards), size=round(share * len(boards)), replace=False))
    directions, axes = (_directions(rng, rows.size) for _ in range(2))
    seen = boards.copy()
    seen[rows, :3, 3] += metres * directions
    seen[rows, :3, :3] = seen[rows, :3, :3] @ rotation(radians * axes)
    return rows, seen


def _with_noise(
    hand: Floats, seen: Floats, of_hand: tuple[float, float], of_camera: tuple[float, float], seed: int
) -> tuple[Floats, Floats]:
    """Hand and board as robot and camera report them. Noise per axis: [m], [rad]."""
    # Pose by pose, so that longer scenes begin with shorter ones.
    draws = np.random.default_rng([seed, 4]).normal(size=(len(hand), 4, 3))
    reported = hand.copy()
    reported[:, :3, :3] = hand[:, :3, :3] @ rotation(-of_hand[1] * draws[:, 0])
    reported[:, :3, 3] = hand[:, :3, 3] - of_hand[0] * draws[:, 1]
    noisy = seen.copy()
    noisy[:, :3, :3] = seen[:, :3, :3] @ rotation(of_camera[1] * draws[:, 2])
    noisy[:, :3, 3] = seen[:, :3, 3] + of_camera[0] * draws[:, 3]
    return reported, noisy


def simulate_streams(
    setup: Setup = "eye-to-hand",
    *,
    seconds: float = 10.0,
    hand_rate: float = 125.0,
    camera_rate: float = 30.0,
    clock_offset: float = 0.037,
    hand_m: float = 1e-4,
    hand_rad: float = math.radians(0.05),
    camera_m: float = 5e-4,
    camera_rad: float = math.radians(0.1),
    layout: Layout | None = None,
    seed: int = 0,
) -> HandEyeStreams:
    """The arm in smooth motion, both records over the same span of true time. A camera stamp t is true time t
    - clock_offset [s].

    Rates in Hz. The board moves in the camera by a sum of three sines a coordinate, 0.1 to 0.6 Hz, within the
    layout's bounds.
    """
    if setup not in SETUPS:
        raise InputError(f"setup: found {setup!r}, expected one of {', '.join(SETUPS)}")
    if not (seconds > 0 and hand_rate > 0 and camera_rate > 0):
        raise InputError("duration and rates of streams must be positive")
    layout = layout or LAYOUTS[setup]
    pattern = Board()
    T_parent_camera, T_parent_board = _mounts(setup, layout, pattern, False, seed)
    rng = np.random.default_rng([seed, 6])
    frequency, phase = rng.uniform(0.1, 0.6, (3, 6)), rng.uniform(0, 2 * math.pi, (3, 6))
    size = np.array([*layout.box, layout.tilt / math.sqrt(2), layout.tilt / math.sqrt(2), layout.roll]) / 3

    def boards(times: Floats) -> Floats:
        swing = (np.sin(2 * math.pi * times[:, None, None] * frequency + phase) * size).sum(axis=1)
        tilt, roll = np.zeros((len(times), 3)), np.zeros((len(times), 3))
        tilt[:, :2], roll[:, 2] = swing[:, 3:5], swing[:, 5]
        return _centred(
            rotation(tilt) @ rotation(roll), swing[:, :3] + np.array([0.0, 0.0, layout.distance]), pattern
        )

    true_hand = np.arange(round(seconds * hand_rate)) / hand_rate
    # not in step with the robot's samples
    true_camera = rng.uniform(0, 1 / camera_rate) + np.arange(round(seconds * camera_rate) - 1) / camera_rate
    hand = _hand_of(setup, T_parent_camera, T_parent_board, boards(true_hand))
    hand[:, :3, :3] = hand[:, :3, :3] @ rotation(-hand_rad * rng.normal(size=(len(hand), 3)))
    hand[:, :3, 3] -= hand_m * rng.normal(size=(len(hand), 3))
    seen = boards(true_camera)
    seen[:, :3, :3] = seen[:, :3, :3] @ rotation(camera_rad * rng.normal(size=(len(seen), 3)))
    seen[:, :3, 3] += camera_m * rng.normal(size=(len(seen), 3))
    return HandEyeStreams(
        setup,
        true_hand,
        hand,
        true_camera + clock_offset,
        seen,
        clock_offset,
        T_parent_camera,
        T_parent_board,
        seed,
    )


# ---- Data that cannot tell -----------------------------------------------------------------------


def one_rotation_axis(setup: Setup = "eye-to-hand", poses: int = 30, **options: Any) -> HandEyeScene:
    """A SCARA: the hand turns about the vertical only. The camera's (the board's) place along that axis
    cannot be seen.
    """
    layout = replace(options.pop("layout", LAYOUTS[setup]), tilt=0.0)
    return simulate_handeye(setup, poses, layout=layout, camera_looks_down=True, **options)


def pure_translation(setup: Setup = "eye-to-hand", poses: int = 30, **options: Any) -> HandEyeScene:
    """The hand never turns: the camera's orientation can be found, its place cannot."""
    return simulate_handeye(
        setup, poses, layout=replace(options.pop("layout", LAYOUTS[setup]), tilt=0.0, roll=0.0), **options
    )


def tiny_rotations(
    setup: Setup = "eye-to-hand", poses: int = 30, *, angle: float = math.radians(0.5), **options: Any
) -> HandEyeScene:
    """The hand turns by no more than `angle` [rad] about any axis: what is found of the camera's place drowns
    in noise.
    """
    return simulate_handeye(
        setup, poses, layout=replace(options.pop("layout", LAYOUTS[setup]), tilt=angle, roll=angle), **options
    )


def equal_poses(setup: Setup = "eye-to-hand", poses: int = 5, **options: Any) -> HandEyeScene:
    """The same pose again and again, noise included: a program that never moved the arm."""
    return simulate_handeye(setup, poses, **options).select([0] * poses)


def two_poses(setup: Setup = "eye-to-hand", poses: int = 2, **options: Any) -> HandEyeScene:
    """One motion only: six equations for six unknowns, of which one turn and one shift stay free."""
    return simulate_handeye(setup, poses, **options)


# ---- Data that are wrong -------------------------------------------------------------------------


def inverted_hand(scene: HandEyeScene) -> HandEyeScene:
    """T_hand_base where T_base_hand is wanted; the same as naming the other setup."""
    return replace(scene, T_base_hand=_inverse(scene.T_base_hand))


def inverted_board(scene: HandEyeScene) -> HandEyeScene:
    """T_board_camera where T_camera_board is wanted."""
    return replace(scene, T_camera_board=_inverse(scene.T_camera_board))


def scalar_last(scene: HandEyeScene) -> HandEyeScene:
    """The hand's quaternions were written x y z w and read as w x y z."""
    return _rotated(
        scene,
        rotation_of_quaternion(np.roll(quaternion_of_rotation(scene.T_base_hand[:, :3, :3]), -1, axis=1)),
    )


def millimetres(scene: HandEyeScene) -> HandEyeScene:
    """The hand's positions are in mm and were read as m."""
    hand = scene.T_base_hand.copy()
    hand[:, :3, 3] *= 1000.0
    return replace(scene, T_base_hand=hand)


def left_handed(scene: HandEyeScene) -> HandEyeScene:
    """The hand's poses come from a world with y the other way: every matrix is a proper frame still, but of a
    mirrored robot.
    """
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    return replace(scene, T_base_hand=mirror @ scene.T_base_hand @ mirror)


def euler_order(scene: HandEyeScene) -> HandEyeScene:
    """The hand's angles are of Rz(c) Ry(b) Rx(a) and were read as Rx(a) Ry(b) Rz(c)."""
    R = scene.T_base_hand[:, :3, :3]
    a, b, c = (
        np.arctan2(R[:, 2, 1], R[:, 2, 2]),
        np.arcsin(np.clip(-R[:, 2, 0], -1, 1)),
        np.arctan2(R[:, 1, 0], R[:, 0, 0]),
    )
    x, y, z = (rotation(angle[:, None] * axis) for angle, axis in zip((a, b, c), np.eye(3), strict=True))
    return _rotated(scene, x @ y @ z)


def degrees_as_radians(scene: HandEyeScene) -> HandEyeScene:
    """The hand's rotation vectors are in degrees and were read as radians."""
    return _rotated(scene, rotation(np.degrees(rotation_vector(scene.T_base_hand[:, :3, :3]))))


def flipped_boards(scene: HandEyeScene, share: float = 0.3) -> HandEyeScene:
    """In so many images (rounded) the board was found turned by 180 degrees: its last point taken for the
    first. These rows are the outliers.
    """
    rows = np.sort(
        np.random.default_rng([scene.seed, 7]).choice(
            scene.poses, size=round(share * scene.poses), replace=False
        )
    )
    turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    turn[:3, 3] = 2 * scene.board.centre
    seen = scene.T_camera_board.copy()
    seen[rows] = seen[rows] @ turn
    pixels = scene.pixels
    if pixels is not None:
        pixels = pixels.copy()
        pixels[rows] = pixels[rows, ::-1]
    return replace(scene, T_camera_board=seen, pixels=pixels, outlier_rows=tuple(int(row) for row in rows))


def typing_error(scene: HandEyeScene, metres: float = 0.405) -> HandEyeScene:
    """The y of one hand pose is off by so much: a digit too many. This row is the outlier."""
    row = scene.poses // 3
    hand = scene.T_base_hand.copy()
    hand[row, 1, 3] += metres
    return replace(scene, T_base_hand=hand, outlier_rows=(row,))


def one_behind(scene: HandEyeScene) -> HandEyeScene:
    """The first image was lost and nobody noticed: every hand pose stands beside the next one's image."""
    shifted = np.roll(np.arange(scene.poses), -1)[:-1]
    kept = np.arange(scene.poses - 1)
    later, earlier = scene.select(shifted), scene.select(kept)
    return replace(
        earlier,
        T_camera_board=later.T_camera_board,
        true_T_camera_board=later.true_T_camera_board,
        pixels=later.pixels,
    )


def shuffled(scene: HandEyeScene, seed: int = 1) -> HandEyeScene:
    """Nothing wrong: the same poses in another order. A result must not move."""
    return scene.select(np.random.default_rng([seed, 8]).permutation(scene.poses))


def scaled(scene: HandEyeScene, factor: float = 1000.0) -> HandEyeScene:
    """Nothing wrong: all lengths in another unit. A result must be the same, in that unit."""

    def scale(frames: Floats) -> Floats:
        out = frames.copy()
        out[..., :3, 3] *= factor
        return out

    return replace(
        scene,
        T_base_hand=scale(scene.T_base_hand),
        T_camera_board=scale(scene.T_camera_board),
        T_parent_camera=scale(scene.T_parent_camera),
        T_parent_board=scale(scene.T_parent_board),
        true_T_base_hand=scale(scene.true_T_base_hand),
        true_T_camera_board=scale(scene.true_T_camera_board),
        hand_m=factor * scene.hand_m,
        camera_m=factor * scene.camera_m,
        board=replace(scene.board, spacing=factor * scene.board.spacing),
    )


DEGENERATE: Mapping[str, Callable[..., HandEyeScene]] = MappingProxyType(
    {
        "one rotation axis": one_rotation_axis,
        "pure translation": pure_translation,
        "tiny rotations": tiny_rotations,
        "equal poses": equal_poses,
        "two poses": two_poses,
    }
)
MISTAKES: Mapping[str, Callable[[HandEyeScene], HandEyeScene]] = MappingProxyType(
    {
        "inverted hand": inverted_hand,
        "inverted board": inverted_board,
        "quaternion x y z w": scalar_last,
        "mm for m": millimetres,
        "left-handed": left_handed,
        "Euler order": euler_order,
        "degrees for radians": degrees_as_radians,
        "flipped boards": flipped_boards,
        "typing error": typing_error,
        "one behind": one_behind,
    }
)


# ---- Images --------------------------------------------------------------------------------------


def render_board(
    camera: PinholeCamera,
    board: Board,
    T_camera_board: Floats,
    *,
    blur: float = 0.6,
    noise: float = 2.0,
    samples: int = 4,
    seed: int = 0,
) -> NDArray[np.uint8]:
    """A grey image of the board through the lens, shape=(height, width).

    Every pixel is the mean of samples x samples rays, each followed through the distortion to the board's
    plane, so corners and circles are where `camera.project` says. `blur` is the lens's standard deviation
    [px], `noise` the sensor's [grey levels of 255].
    """
    outline = _outline(board)
    across = np.linspace(0, 1, 50)[:, None]
    edges = np.concatenate(
        [(1 - across) * a + across * b for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True)]
    )
    in_camera = _apply(T_camera_board[None], edges)[0]
    if in_camera[:, 2].min() <= 0:
        raise InputError("a board behind the camera cannot be drawn")
    image = np.full((camera.height, camera.width), 110.0)
    pixels = camera.project(in_camera)
    margin = 3 + 4 * blur
    left, top = np.maximum(np.floor(pixels.min(axis=0) - margin), 0).astype(int)
    right, bottom = np.minimum(
        np.ceil(pixels.max(axis=0) + margin) + 1, [camera.width, camera.height]
    ).astype(int)
    if right > left and bottom > top:
        part = _rays_to_grey(
            camera, board, T_camera_board, np.arange(left, right), np.arange(top, bottom), samples
        )
        image[top:bottom, left:right] = _blurred(part, blur) if blur > 0 else part
    image += noise * np.random.default_rng([seed, 9]).normal(size=image.shape)
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)


def _rays_to_grey(
    camera: PinholeCamera,
    board: Board,
    T_camera_board: Floats,
    columns: NDArray[np.intp],
    rows: NDArray[np.intp],
    samples: int,
) -> Floats:
    u, v = np.meshgrid(columns, rows)
    rays = camera.rays(np.stack([u, v], axis=-1).astype(float))
    along_v, along_u = np.gradient(rays, axis=(0, 1))  # within a pixel the lens is linear
    homography = np.linalg.inv(T_camera_board[:3, [0, 1, 3]]).T
    total = np.zeros(u.shape)
    steps = (np.arange(samples) + 0.5) / samples - 0.5
    for dv in steps:
        for du in steps:
            met = (rays + du * along_u + dv * along_v) @ homography[:2] + homography[2]
            total += _grey(board, met[..., :2] / met[..., 2:])
    return np.asarray(total / samples**2)


def _blurred(image: Floats, deviation: float) -> Floats:
    reach = math.ceil(4 * deviation)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / deviation) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        padded = np.pad(image, [(reach, reach) if a == axis else (0, 0) for a in (0, 1)], mode="edge")
        size = image.shape[axis]
        image = np.sum(
            [weight * np.take(padded, range(k, k + size), axis=axis) for k, weight in enumerate(kernel)],
            axis=0,
        )
    return image


def _outline(board: Board, around: float = 2.0) -> Floats:
    """Corners of the sheet with so many squares around the points: 1 to the end of a chessboard, 2 to that of
    its paper.
    """
    edge = around * board.spacing
    right, bottom = 2 * board.centre[:2]
    return np.array(
        [
            [-edge, -edge, 0],
            [right + edge, -edge, 0],
            [right + edge, bottom + edge, 0],
            [-edge, bottom + edge, 0],
        ]
    )


def _grey(board: Board, at: Floats) -> Floats:
    x, y = at[..., 0] / board.spacing, at[..., 1] / board.spacing
    grey = np.where((x > -2) & (x < board.columns + 1) & (y > -2) & (y < board.rows + 1), 225.0, 110.0)
    if board.kind == "chessboard":
        inside = (x > -1) & (x < board.columns) & (y > -1) & (y < board.rows)
        black = inside & ((np.floor(x) + np.floor(y)) % 2 == 0)
    else:
        column, row = np.rint(x), np.rint(y)
        black = (
            (column >= 0)
            & (column < board.columns)
            & (row >= 0)
            & (row < board.rows)
            & ((x - column) ** 2 + (y - row) ** 2 < 0.28**2)
        )
    return np.where(black, 30.0, grey)


# ---- Rotations and frames ------------------------------------------------------------------------


def rotation(vectors: Floats) -> Floats:
    """Rotation matrices of rotation vectors, shape=(..., 3) [rad]."""
    vectors = np.asarray(vectors, dtype=float)
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    K = np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)
    return np.asarray(
        np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (K @ K)
    )


def rotation_vector(R: Floats) -> Floats:
    """Rotation vectors of rotation matrices, shape=(..., 3, 3), of angles up to pi [rad]."""
    q = quaternion_of_rotation(R)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    return np.asarray(np.where(sine > 1e-12, angle / np.maximum(sine, 1e-300), 2.0) * q[..., 1:])


def quaternion_of_rotation(R: Floats) -> Floats:
    """Quaternions w x y z with w >= 0, shape=(..., 4): the column of largest diagonal of 4 q qT."""
    R = np.asarray(R, dtype=float)
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    wx, wy, wz = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    xy, xz, yz = R[..., 1, 0] + R[..., 0, 1], R[..., 0, 2] + R[..., 2, 0], R[..., 2, 1] + R[..., 1, 2]
    rows = [
        [1 + xx + yy + zz, wx, wy, wz],
        [wx, 1 + xx - yy - zz, xy, xz],
        [wy, xy, 1 - xx + yy - zz, yz],
        [wz, xz, yz, 1 - xx - yy + zz],
    ]
    outer = np.stack([np.stack(row, -1) for row in rows], -2)
    best = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[..., :1] < 0, -q, q))


def rotation_of_quaternion(q: Floats) -> Floats:
    """Rotation matrices of unit quaternions w x y z, shape=(..., 4)."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    return np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1),
        ],
        -2,
    )


def _frames(R: Floats, t: Floats) -> Floats:
    frames = np.zeros((*np.broadcast_shapes(R.shape[:-2], t.shape[:-1]), 4, 4))
    frames[..., :3, :3], frames[..., :3, 3], frames[..., 3, 3] = R, t, 1.0
    return frames


def _inverse(T: Floats) -> Floats:
    R = np.swapaxes(T[..., :3, :3], -1, -2)
    return _frames(R, -(R @ T[..., :3, 3:])[..., 0])


def _apply(T: Floats, points: Floats) -> Floats:
    """Every point in every frame, shape=(n, m, 3)."""
    return np.asarray(points @ np.swapaxes(T[:, :3, :3], 1, 2) + T[:, None, :3, 3])


def _directions(rng: np.random.Generator, count: int) -> Floats:
    drawn = rng.normal(size=(count, 3))
    return np.asarray(drawn / np.linalg.norm(drawn, axis=1, keepdims=True))


def _centred(R: Floats, centres: Floats, board: Board) -> Floats:
    """Board frames whose boards have their middle there."""
    return _frames(R, centres - R @ board.centre)


def _mounts(
    setup: Setup, layout: Layout, board: Board, camera_looks_down: bool, seed: int
) -> tuple[Floats, Floats]:
    """True T_parent_camera and T_parent_board."""
    rng = np.random.default_rng([seed, 1])
    middle = layout.reach * _directions(rng, 1)[0]
    middle[2] = abs(middle[2])  # above the floor that the robot stands on
    quaternions = rng.normal(size=(2, 4))
    one, two = rotation_of_quaternion(quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True))
    lever = layout.lever * _directions(rng, 1)[0]
    yaw = rotation(np.array([0.0, 0.0, rng.uniform(-math.pi, math.pi)]))
    if setup == "eye-to-hand":
        if camera_looks_down:
            one, two = yaw @ np.diag([1.0, -1.0, -1.0]), np.diag([1.0, -1.0, -1.0])
        return _frames(one, middle - layout.distance * one[:, 2]), _centred(two, lever, board)
    if camera_looks_down:
        one, two = yaw, np.diag([1.0, -1.0, -1.0])
    return _frames(one, lever), _centred(two, middle, board)


def _visible_boards(count: int, layout: Layout, camera: PinholeCamera, board: Board, seed: int) -> Floats:
    """True T_camera_board with the whole pattern, its outer squares included, within the image."""
    rng = np.random.default_rng([seed, 2])
    low, high = np.full(2, 4.0), np.array([camera.width, camera.height]) - 5.0
    corners = _outline(board, 1.0)
    kept: list[Floats] = []
    found = 0
    for _ in range(100 + 20 * count // _BATCH):
        centres = rng.uniform(-1, 1, (_BATCH, 3)) * np.array(layout.box) + np.array(
            [0.0, 0.0, layout.distance]
        )
        around = rng.uniform(-math.pi, math.pi, _BATCH)
        away = layout.tilt * np.sqrt(rng.uniform(0, 1, _BATCH))
        roll = rng.uniform(-layout.roll, layout.roll, _BATCH)
        zero = np.zeros(_BATCH)
        R = rotation(np.column_stack([away * np.cos(around), away * np.sin(around), zero])) @ rotation(
            np.column_stack([zero, zero, roll])
        )
        frames = _centred(R, centres, board)
        points = _apply(frames, corners)
        pixels = camera.project(points)
        frames = frames[
            ((pixels > low) & (pixels < high)).all(axis=(1, 2)) & (points[..., 2] > 0).all(axis=1)
        ]
        kept.append(frames)
        found += len(frames)
        if found >= count:
            return np.concatenate(kept)[:count]
    raise InputError(
        "this camera hardly ever sees the whole board in this layout: a smaller board, or one farther away"
    )


def _hand_of(setup: Setup, T_parent_camera: Floats, T_parent_board: Floats, T_camera_board: Floats) -> Floats:
    """T_base_hand that closes the loop."""
    if setup == "eye-to-hand":
        return np.asarray(T_parent_camera @ T_camera_board @ _inverse(T_parent_board))
    return np.asarray(T_parent_board @ _inverse(T_camera_board) @ _inverse(T_parent_camera))


def _rotated(scene: HandEyeScene, R: Floats) -> HandEyeScene:
    hand = scene.T_base_hand.copy()
    hand[:, :3, :3] = R
    return replace(scene, T_base_hand=hand)
