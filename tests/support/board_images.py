# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Images of calibration boards by ray casting: the truth of every corner is known, and no board finder had a
hand in them.
"""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing.files import Board
from truing.hand_eye import Camera

Floats = NDArray[np.float64]
SUPERSAMPLING = 2
CAMERA = Camera(
    width=480,
    height=360,
    fx=430.0,
    fy=432.0,
    cx=243.0,
    cy=177.0,
    distortion=[-0.12, 0.06, 0.001, -0.0007, 0.0],
)


@functools.lru_cache(maxsize=4)
def rays(
    width: int, height: int, fx: float, fy: float, cx: float, cy: float, distortion: tuple[float, ...]
) -> Floats:
    """Directions (x, y, 1) of all subpixels, shape=(height * s, width * s, 2), by undoing the distortion step
    by step.
    """
    s = SUPERSAMPLING
    u = (np.arange(width * s) + 0.5) / s - 0.5
    v = (np.arange(height * s) + 0.5) / s - 0.5
    x0, y0 = np.meshgrid((u - cx) / fx, (v - cy) / fy)
    k1, k2, p1, p2, k3 = distortion
    x, y = x0.copy(), y0.copy()
    for _ in range(8):
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        x, y = (
            (x0 - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)) / radial,
            (y0 - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y) / radial,
        )
    return np.stack([x, y], axis=-1)


def texture(board: Board, x: Floats, y: Floats) -> Floats:
    """Grey value of the board's front at (x, y) [m] in its frame: 230 paper, 25 ink, 128 beside the board."""
    a = board.size
    if board.kind == "chessboard":
        left, top, right, bottom = -2 * a, -2 * a, (board.columns + 1) * a, (board.rows + 1) * a
        squares = (x > -a) & (x < board.columns * a) & (y > -a) & (y < board.rows * a)
        dark = squares & ((np.floor(x / a) + np.floor(y / a)).astype(np.int64) % 2 == 0)
    elif board.kind in ("circles", "acircles"):
        points = board.points
        low, high = points.min(axis=0), points.max(axis=0)
        left, top, right, bottom = low[0] - 1.5 * a, low[1] - 1.5 * a, high[0] + 1.5 * a, high[1] + 1.5 * a
        if board.kind == "circles":
            nearest = np.hypot(
                x - a * np.clip(np.rint(x / a), 0, board.columns - 1),
                y - a * np.clip(np.rint(y / a), 0, board.rows - 1),
            )
            dark = nearest < 0.27 * a
        else:
            dark = np.zeros(x.shape, dtype=bool)
            for point in points:
                dark |= np.hypot(x - point[0], y - point[1]) < 0.42 * a
    else:
        import cv2

        from truing.files.boards import _charuco_detector

        pattern: Any = _charuco_detector(cv2, board).getBoard()
        scale = 24  # subpixels of a square
        printed = pattern.generateImage((board.columns * scale, board.rows * scale))
        left, top, right, bottom = -0.5 * a, -0.5 * a, (board.columns + 0.5) * a, (board.rows + 0.5) * a
        column, row = np.floor(x / a * scale).astype(np.int64), np.floor(y / a * scale).astype(np.int64)
        inside = (column >= 0) & (column < printed.shape[1]) & (row >= 0) & (row < printed.shape[0])
        dark = np.zeros(x.shape, dtype=bool)
        dark[inside] = printed[row[inside], column[inside]] < 128
    paper = (x > left) & (x < right) & (y > top) & (y < bottom)
    return np.where(dark, 25.0, np.where(paper, 230.0, 128.0))


def tags_texture(border: int = 2, squares: bool = True, turn: int = 0) -> Any:
    """A texture of AprilTags, y up: black cells around each, black squares that touch their corners (Kalibr's
    boards have two and these), and quarter turns in which they are printed.
    """

    def paint(board: Board, x: Floats, y: Floats) -> Floats:
        import cv2

        grid = board.tags
        step, gap = (1 + grid.spacing) * grid.size, grid.spacing * grid.size
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{grid.family}"))
        cells = {"36h11": 6, "25h9": 5, "16h5": 4}[grid.family] + 2 * border
        printed = np.array(
            [
                np.rot90(
                    cv2.aruco.generateImageMarker(
                        dictionary, (grid.first or 0) + k, cells, borderBits=border
                    ),
                    turn,
                )
                for k in range(grid.count)
            ]
        )
        column, row = np.floor(x / step).astype(np.intp), np.floor(y / step).astype(np.intp)
        u, v = (x - step * column) / grid.size, 1 - (y - step * row) / grid.size
        inside = (column >= 0) & (column < grid.columns) & (row >= 0) & (row < grid.rows) & (u < 1) & (v >= 0)
        counted = grid.rows - 1 - row if grid.from_top else row
        number = counted[inside] * grid.columns + column[inside]
        dark = np.zeros(x.shape, dtype=bool)
        place = number, (v[inside] * cells).astype(np.intp), (u[inside] * cells).astype(np.intp)
        dark[inside] = printed[place] < 128
        if squares:
            across, up = x + gap, y + gap
            at_corner = (across % step < gap) & (up % step < gap)
            dark |= (
                at_corner
                & (across < step * grid.columns + gap)
                & (up < step * grid.rows + gap)
                & ((across > 0) & (up > 0))
            )
        edge = 0.5 * grid.size
        width, height = step * grid.columns - gap, step * grid.rows - gap
        paper = (x > -edge) & (x < width + edge) & (y > -edge) & (y < height + edge)
        return np.where(dark, 25.0, np.where(paper, 230.0, 128.0))

    return paint


def render(
    board: Board,
    T_camera_board: Floats,
    camera: Camera = CAMERA,
    noise: float = 2.0,
    seed: int = 0,
    paint: Any = texture,
) -> NDArray[np.uint8]:
    """What the camera sees of the board."""
    direction = rays(
        camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, tuple(camera.distortion)
    )
    R, t = T_camera_board[:3, :3], T_camera_board[:3, 3]
    depth = (R[:, 2] @ t) / (direction @ R[:2, 2] + R[2, 2])
    place = np.concatenate([direction * depth[..., None], depth[..., None]], axis=-1) - t
    grey = np.where(depth > 0, paint(board, place @ R[:, 0], place @ R[:, 1]), 128.0)
    s = SUPERSAMPLING
    grey = grey.reshape(camera.height, s, camera.width, s).mean(axis=(1, 3))
    return np.clip(np.rint(grey + np.random.default_rng(seed).normal(0, noise, grey.shape)), 0, 255).astype(
        np.uint8
    )


def rotation(vector: Any) -> Floats:
    """Rotation matrix of a rotation vector [rad]."""
    v = np.asarray(vector, dtype=np.float64)
    angle = float(np.linalg.norm(v))
    if angle == 0:
        return np.eye(3)
    x, y, z = v / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def frame(position: Any, vector: Any) -> Floats:
    """shape=(4, 4) of a position [m] and a rotation vector [rad]."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(vector), position
    return T


def board_poses(board: Board, count: int, seed: int = 0, distance: float = 0.0) -> list[Floats]:
    """Poses in which the whole board is in view: tilted, turned, moved."""
    rng = np.random.default_rng(seed)
    points = board.points
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    away = distance or 1.6 * size
    poses = []
    while len(poses) < count:
        T = frame(
            [*rng.uniform(-0.15, 0.15, 2) * size, away * rng.uniform(0.9, 1.2)],
            [*rng.uniform(-0.55, 0.55, 2), rng.uniform(-0.6, 0.6)],
        )
        if board.kind == "apriltag":  # seen from the front, its z looks at the camera
            T = T @ np.diag([1.0, -1.0, -1.0, 1.0])
        T[:3, 3] -= T[:3, :3] @ middle
        corners = middle + np.array([[sx, sy, 0] for sx in (-1, 1) for sy in (-1, 1)]) * (
            np.ptp(points, axis=0) / 2 + (0.6 if board.kind == "apriltag" else 1.8) * board.size
        )
        seen = corners @ T[:3, :3].T + T[:3, 3]
        u, v = (
            CAMERA.fx * seen[:, 0] / seen[:, 2] + CAMERA.cx,
            CAMERA.fy * seen[:, 1] / seen[:, 2] + CAMERA.cy,
        )
        if u.min() > 2 and v.min() > 2 and u.max() < CAMERA.width - 3 and v.max() < CAMERA.height - 3:
            poses.append(T)
    return poses


def write_images(
    folder: Path, board: Board, poses: list[Floats], camera: Camera = CAMERA, paint: Any = texture
) -> list[str]:
    """Renders the poses to PNG files `images/0.png` … in `folder`; their names."""
    import cv2

    (folder / "images").mkdir(parents=True, exist_ok=True)
    names = []
    for k, T in enumerate(poses):
        names.append(f"images/{k}.png")
        cv2.imwrite(str(folder / names[-1]), render(board, T, camera, seed=k, paint=paint))
    return names
