# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The camera that was found beside those of other programs, on the same poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.errors import InputError
from truing.files import HandEyeAnswer
from truing.files.common import frame_dict
from truing.rotations import rotation_vectors

Floats = NDArray[np.float64]

_NEAR = 0.1  # [rad] so near to ours comes a frame that was turned or inverted by mistake, once that is undone
# The body frame of a camera (x forward, z up) in its optical frame (z forward, x right), as ROS has them.
_OPTICAL_BODY = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])


def require_setup(answers: Sequence[HandEyeAnswer], setup: str) -> None:
    """Raises InputError where an answer is of a camera elsewhere."""
    for answer in answers:
        if answer.setup is not None and answer.setup != setup:
            raise InputError(
                f"{answer.path}: {answer.tool} of a camera {answer.setup}, this is solved as {setup}: say"
                f" --setup {answer.setup}, or leave it out"
            )


def comparison(
    camera: _core.UncertainFrame,
    A: Floats,
    B: Floats | None,
    rows: NDArray[np.bool_],
    setup: str,
    answers: Sequence[HandEyeAnswer],
) -> list[dict[str, Any]]:
    """What result.json says of each answer. A, B: shape=(n, 4, 4), T_base_hand and T_camera_board (None: not
    known as numbers); rows: shape=(n,), those that the loop is closed over.
    """
    ours = np.asarray(camera.T)
    own = None if B is None else closure(ours, A[rows], B[rows], setup)
    out = []
    for answer in answers:
        T = answer.T_parent_camera
        change = np.concatenate(
            [T[:3, 3] - ours[:3, 3], rotation_vectors((T[:3, :3] @ ours[:3, :3].T)[None])[0]]
        )
        sigma = np.asarray(camera.sigma)
        out.append(
            {
                "file": str(answer.path),
                "tool": answer.tool,
                "camera": frame_dict(T),
                "position_m": float(np.linalg.norm(change[:3])),
                "rotation_rad": float(np.linalg.norm(change[3:])),
                "largest_sigmas": float(np.max(np.abs(change) / sigma)) if (sigma > 0).all() else None,
                "closure": None if B is None else closure(T, A[rows], B[rows], setup),
                "closure_of_ours": own,
                "poses": int(rows.sum()),
                "remark": _remark(T, ours),
            }
        )
    return out


def closure(T_parent_camera: Floats, A: Floats, B: Floats, setup: str) -> dict[str, float]:
    """How far the board seems to move from pose to pose, rms, where the camera is there: the board's own
    place is the mean of all, so that no program's is preferred.
    """
    seen = A @ T_parent_camera @ B if setup == "eye-in-hand" else np.linalg.inv(A) @ T_parent_camera @ B
    place = seen[:, :3, 3].mean(axis=0)
    u, _, vt = np.linalg.svd(seen[:, :3, :3].mean(axis=0))  # the nearest rotation to the mean
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    off = seen[:, :3, 3] - place
    turned = rotation_vectors(np.swapaxes(seen[:, :3, :3], 1, 2) @ turn)
    return {
        "rms_m": float(np.sqrt((off**2).sum(axis=1).mean())),
        "rotation_rms_rad": float(np.sqrt((turned**2).sum(axis=1).mean())),
    }


def _remark(theirs: Floats, ours: Floats) -> str:
    """The likely reason of a difference that no noise makes."""

    def angle(R: Floats) -> float:
        return float(np.linalg.norm(rotation_vectors(R[None])[0]))

    R, other = ours[:3, :3], theirs[:3, :3]
    if angle(R.T @ other) < _NEAR:
        return ""
    if angle((R @ _OPTICAL_BODY).T @ other) < _NEAR:
        return "theirs is the camera's body frame (x forward), ours the optical frame (z forward)"
    if angle(R @ other) < _NEAR:
        return "theirs is the inverse: the hand or base in the camera"
    return ""
