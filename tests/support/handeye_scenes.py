# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Hand-eye scenes with known truth, as arrays and as files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from board_images import Floats, frame, rotation
from truing.rotations import quaternions_from_rotations

CAMERA_IN_HAND = frame([0.04, -0.02, 0.09], [0.1, -0.2, 1.5])
CAMERA_IN_BASE = frame([1.1, 0.2, 0.7], [-1.9, 0.1, 0.3])
BOARD = frame([0.62, 0.05, 0.02], [3.1, 0.1, 0.05])  # in the base; eye to hand: in the hand, scaled


@dataclass(frozen=True)
class HandEyeScene:
    """What was measured, and the truth."""

    setup: str
    A: Floats  # shape=(n, 4, 4) T_base_hand
    B: Floats  # shape=(n, 4, 4) T_camera_board
    X: Floats  # T_parent_camera
    Y: Floats  # T_parent_board


def noisy(T: Floats, position: float, angle: float, rng: np.random.Generator) -> Floats:
    out = T.copy()
    out[:3, 3] += rng.normal(0, 1, 3) * position
    out[:3, :3] = rotation(rng.normal(0, 1, 3) * angle) @ T[:3, :3]
    return out


def scene(
    count: int = 20,
    setup: str = "eye-in-hand",
    *,
    hand: tuple[float, float] = (1e-4, 3e-4),
    camera: tuple[float, float] = (3e-4, 8e-4),
    one_axis: bool = False,
    turns: float = 0.5,
    seed: int = 0,
) -> HandEyeScene:
    """Random poses that look at the board. hand, camera: noise of a component [m], [rad]. one_axis: the hand
    turns about base z alone.
    """
    rng = np.random.default_rng(seed)
    eye_in_hand = setup == "eye-in-hand"
    X, Y = (
        (CAMERA_IN_HAND, BOARD)
        if eye_in_hand
        else (CAMERA_IN_BASE, frame([0.02, -0.03, 0.06], [0.2, 0.1, -0.4]))
    )
    A, B = [], []
    for _ in range(count):
        turn = [0, 0, rng.uniform(-1, 1) * turns] if one_axis else rng.uniform(-1, 1, 3) * turns
        # The board half a metre or so before the camera, turned a little: the hand is where that puts it.
        if one_axis:
            hand_true = frame([0.5, 0, 0.5], [3.0, 0.1, 0.2])
            hand_true = frame(rng.uniform(-0.1, 0.1, 3), turn) @ hand_true
        else:
            seen = frame([*rng.uniform(-0.08, 0.08, 2), rng.uniform(0.4, 0.6)], turn)
            hand_true = Y @ np.linalg.inv(X @ seen) if eye_in_hand else X @ seen @ np.linalg.inv(Y)
        B_true = np.linalg.inv(X) @ (np.linalg.inv(hand_true) if eye_in_hand else hand_true) @ Y
        A.append(noisy(hand_true, *hand, rng))
        B.append(noisy(B_true, *camera, rng))
    return HandEyeScene(setup, np.array(A), np.array(B), X, Y)


def columns_of(side: str, T: Floats) -> dict[str, Any]:
    q = quaternions_from_rotations(T[:, :3, :3])
    return {
        **{f"{side}_{axis}_m": T[:, k, 3] for k, axis in enumerate("xyz")},
        **{f"{side}_q{part}": q[:, k] for k, part in enumerate("wxyz")},
    }


def write_csv(path: Path, columns: dict[str, Any]) -> Path:
    rows = list(zip(*columns.values(), strict=True))
    path.write_text(
        ",".join(columns)
        + "\n"
        + "".join(",".join(v if isinstance(v, str) else repr(float(v)) for v in row) + "\n" for row in rows)
    )
    return path


def write_scene(path: Path, s: HandEyeScene, **more: Any) -> Path:
    """poses.csv; `more`: further columns."""
    return write_csv(path, {**columns_of("hand", s.A), **columns_of("board", s.B), **more})
