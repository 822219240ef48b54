# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Maximum-likelihood hand-eye in NumPy, written apart from the library: what can be had from a scene whose
noises are known.

    python bench/handeye_oracle.py [--trials 100]

Unknown are the camera, the board and a correction of every reported hand pose; residuals are all of unit
variance:

    hand:    rotation vector and translation of the correction, over the robot's noise
    pose:    seen against predicted board, over the camera's noise
    pixels:  seen against projected points, over the pixel noise

Derivatives are central differences and the corrections are eliminated pose by pose, so there is no derivation
here that could be
wrong in the same way as that of the library. `by_scipy` solves the same problem once more with SciPy's
least_squares.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing.testing.scenes import Board, HandEyeScene, rotation, rotation_vector, simulate_handeye

Floats = NDArray[np.float64]
STEP = 1e-6  # of the differences [m], [rad]


@dataclass(frozen=True)
class Oracle:
    """Frames as in HandEyeScene; `covariance` of camera and board, each [m m m rad rad rad]: `error_of` says
    in which frames.
    """

    T_parent_camera: Floats
    T_parent_board: Floats
    covariance: Floats  # shape=(12, 12), from the stated noises
    cost: float  # sum of squares; about the number of residuals less 12 when all is well
    iterations: int


def inverse(T: Floats) -> Floats:
    out = np.zeros_like(T)
    R = np.swapaxes(T[..., :3, :3], -1, -2)
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = R, -(R @ T[..., :3, 3:])[..., 0], 1.0
    return out


def moved(T: Floats, step: Floats) -> Floats:
    """Frames with translations added, and turned about their own axes."""
    out = np.array(np.broadcast_to(T, (*np.broadcast_shapes(T.shape[:-2], step.shape[:-1]), 4, 4)))
    out[..., :3, 3] += step[..., :3]
    out[..., :3, :3] = out[..., :3, :3] @ rotation(step[..., 3:])
    return out


def error_of(T_true: Floats, T_found: Floats) -> Floats:
    """The step that leads from one to the other: what `covariance` is of."""
    return np.concatenate(
        [T_found[:3, 3] - T_true[:3, 3], rotation_vector(T_true[:3, :3].T @ T_found[:3, :3])]
    )


def degrees_millimetres(T_true: Floats, T_found: Floats) -> tuple[float, float]:
    step = error_of(T_true, T_found)
    return math.degrees(float(np.linalg.norm(step[3:]))), 1e3 * float(np.linalg.norm(step[:3]))


def predicted_boards(
    scene: HandEyeScene, T_parent_camera: Floats, T_parent_board: Floats, hand: Floats
) -> Floats:
    if scene.setup == "eye-to-hand":
        return np.asarray(inverse(T_parent_camera) @ hand @ T_parent_board)
    return np.asarray(inverse(T_parent_camera) @ inverse(hand) @ T_parent_board)


def start(scene: HandEyeScene, T_camera_board: Floats) -> tuple[Floats, Floats]:
    """Both rotations by an SVD of the sum of Kronecker products (Shah 2013), then both translations by linear
    least squares.
    """
    # H X = Y C for every pose: eye-to-hand H = hand, X = T_hand_board, Y = T_base_camera, C = T_camera_board;
    # eye-in-hand H = inverse hand, X = T_base_board, Y = T_hand_camera.
    H, C = scene.T_base_hand if scene.setup == "eye-to-hand" else inverse(scene.T_base_hand), T_camera_board
    K = np.einsum("nij,nkl->ikjl", H[:, :3, :3], C[:, :3, :3]).reshape(
        9, 9
    )  # sum of kron(R_H, R_C); vec(R_Y) = K vec(R_X), row by row
    u, _, vt = np.linalg.svd(K)
    Y, X = u[:, 0].reshape(3, 3), vt[0].reshape(3, 3)

    def nearest(M: Floats) -> Floats:
        a, _, b = np.linalg.svd(M * np.sign(np.linalg.det(M)))
        return np.asarray(a @ np.diag([1, 1, np.linalg.det(a @ b)]) @ b)

    X, Y = nearest(X), nearest(Y)
    rows = np.concatenate([H[:, :3, :3], np.broadcast_to(-np.eye(3), (len(H), 3, 3))], axis=2).reshape(-1, 6)
    right = (C[:, :3, 3] @ Y.T - H[:, :3, 3]).ravel()
    t = np.linalg.lstsq(rows, right, rcond=None)[0]
    board, camera = np.eye(4), np.eye(4)
    board[:3, :3], board[:3, 3], camera[:3, :3], camera[:3, 3] = X, t[:3], Y, t[3:]
    return camera, board


def residuals(
    scene: HandEyeScene, camera: Floats, board: Floats, corrections: Floats, pixels: bool
) -> Floats:
    """Of what the camera saw, shape=(n, k)."""
    predicted = predicted_boards(scene, camera, board, moved(scene.T_base_hand, corrections))
    if pixels:
        assert scene.pixels is not None
        points = scene.board.points @ np.swapaxes(predicted[:, :3, :3], 1, 2) + predicted[:, None, :3, 3]
        return np.asarray(
            ((scene.camera.project(points) - scene.pixels) / scene.pixel).reshape(len(predicted), -1)
        )
    turned = rotation_vector(np.swapaxes(predicted[:, :3, :3], 1, 2) @ scene.T_camera_board[:, :3, :3])
    return np.concatenate(
        [(scene.T_camera_board[:, :3, 3] - predicted[:, :3, 3]) / scene.camera_m, turned / scene.camera_rad],
        axis=1,
    )


def solve(
    scene: HandEyeScene,
    *,
    pixels: bool = False,
    exact_hand: bool = False,
    iterations: int = 30,
    T_camera_board: Floats | None = None,
) -> Oracle:
    """Gauss-Newton with step halving. `exact_hand` takes reported poses as true; then pixels alone give
    "reprojection only".
    """
    n = scene.poses
    camera, board = start(scene, scene.T_camera_board if T_camera_board is None else T_camera_board)
    sigma = np.repeat([scene.hand_m, scene.hand_rad], 3)
    own = np.zeros((n, 6))

    def cost_at(camera: Floats, board: Floats, own: Floats) -> float:
        return float(
            (residuals(scene, camera, board, own, pixels) ** 2).sum()
            + (0 if exact_hand else ((own / sigma) ** 2).sum())
        )

    cost, shared, taken = cost_at(camera, board, own), np.eye(12), 0
    for _ in range(iterations):
        taken += 1
        r = residuals(scene, camera, board, own, pixels)
        J, Jo = np.zeros((n, r.shape[1], 12)), np.zeros((n, r.shape[1], 6))
        for k in range(6):
            d = np.zeros(6)
            d[k] = STEP
            for J_of, column, plus, minus in (
                (J, k, (moved(camera, d), board, own), (moved(camera, -d), board, own)),
                (J, 6 + k, (camera, moved(board, d), own), (camera, moved(board, -d), own)),
                (Jo, k, (camera, board, own + d), (camera, board, own - d)),
            ):
                if exact_hand and J_of is Jo:
                    continue
                J_of[..., column] = (residuals(scene, *plus, pixels) - residuals(scene, *minus, pixels)) / (
                    2 * STEP
                )
        JT, JoT = np.swapaxes(J, 1, 2), np.swapaxes(Jo, 1, 2)
        shared, g = (JT @ J).sum(axis=0), (JT @ r[..., None]).sum(axis=0)[:, 0]
        if not exact_hand:
            inner = JoT @ Jo + np.diag(sigma**-2)
            g_own = (JoT @ r[..., None])[..., 0] + own / sigma**2
            cross = JT @ Jo
            folded = cross @ np.linalg.inv(inner)
            shared = shared - (folded @ np.swapaxes(cross, 1, 2)).sum(axis=0)
            g = g - (folded @ g_own[..., None]).sum(axis=0)[:, 0]
        step = -np.linalg.solve(shared, g)
        step_own = (
            np.zeros((n, 6))
            if exact_hand
            else -np.linalg.solve(inner, (g_own + np.swapaxes(cross, 1, 2) @ step)[..., None])[..., 0]
        )
        share = 1.0
        while share > 1e-4:
            candidate = (
                moved(camera, share * step[:6]),
                moved(board, share * step[6:]),
                own + share * step_own,
            )
            new = cost_at(*candidate)
            if new <= cost * (1 + 1e-12):
                break
            share /= 2
        done = cost - new < 1e-9 * (1 + cost)
        (camera, board, own), cost = candidate, min(cost, new)
        if done:
            break
    return Oracle(camera, board, np.asarray(np.linalg.inv(shared), dtype=float), cost, taken)


def by_scipy(scene: HandEyeScene, *, pixels: bool = False) -> tuple[Floats, Floats]:
    """The same by scipy.optimize.least_squares, one vector of unknowns; slow, for checks."""
    from scipy.optimize import least_squares
    from scipy.sparse import lil_matrix

    camera, board = start(scene, scene.T_camera_board)
    sigma, n = np.repeat([scene.hand_m, scene.hand_rad], 3), scene.poses

    def f(x: Floats) -> Floats:
        own = x[12:].reshape(n, 6) * sigma
        seen = residuals(scene, moved(camera, x[:6]), moved(board, x[6:12]), own, pixels)
        return np.concatenate([seen.ravel(), x[12:]])

    k = len(f(np.zeros(12 + 6 * n))) // n - 6
    pattern = lil_matrix(((k + 6) * n, 12 + 6 * n), dtype=int)
    pattern[: k * n, :12] = 1
    for pose in range(n):
        pattern[k * pose : k * (pose + 1), 12 + 6 * pose : 18 + 6 * pose] = 1
        for axis in range(6):
            pattern[k * n + 6 * pose + axis, 12 + 6 * pose + axis] = 1
    scale = np.concatenate([np.full(12, 1e-3), np.ones(6 * n)])
    found = least_squares(
        f, np.zeros(12 + 6 * n), jac_sparsity=pattern, x_scale=scale, xtol=1e-12, ftol=1e-12, gtol=1e-12
    )
    return moved(camera, found.x[:6]), moved(board, found.x[6:12])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--trials", type=int, default=100)
    arguments = parser.parse_args()
    print(
        "| scene | trials | deg | mm | cost / residuals - 12 | iterations | ms |\n| --- | --- | --- | --- |"
        " --- | --- | --- |"
    )
    for setup in ("eye-to-hand", "eye-in-hand"):
        for poses, pixels, exact in (
            (10, False, False),
            (30, False, False),
            (100, False, False),
            (1000, False, False),
            (30, True, False),
            (30, True, True),
        ):
            trials = max(5, arguments.trials // 5) if poses == 1000 else arguments.trials
            errors, fit, steps, times = [], [], [], []
            for seed in range(trials):
                scene = simulate_handeye(setup, poses, board=Board() if pixels else None, seed=seed)
                begun = time.perf_counter()
                found = solve(scene, pixels=pixels, exact_hand=exact)
                times.append(time.perf_counter() - begun)
                errors.append(degrees_millimetres(scene.T_parent_camera, found.T_parent_camera))
                fit.append(found.cost / (poses * (108 if pixels else 6) - 12))
                steps.append(found.iterations)
            deg, mm = np.median(errors, axis=0)
            what = ("reprojection only" if exact else "pixels and robot") if pixels else "poses"
            print(
                f"| {setup}, {what}, {poses} | {trials} | {deg:.4f} | {mm:.3f} | {np.mean(fit):.3f} |"
                f" {np.median(steps):.0f} | {1e3 * np.median(times):.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
