# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Frames of the set-up that are off reach the tool, and its standard deviations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from truing.files.stream_file import SetupData
from truing.rotations import rotation_vectors
from truing.tracking import TrackSetup
from truing.tracking.uncertainty import tool_covariance

FRAMES = ("T_tracker_base", "T_flange_receiver", "T_flange_tool")


def _frame(random: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(random.normal(0.0, 2.0, 3)).as_matrix()
    T[:3, 3] = random.normal(0.0, 3.0, 3)
    return T


def _off(T: np.ndarray, by: np.ndarray) -> np.ndarray:
    """x, y, z and a rotation vector, about the parent's axes."""
    out = T.copy()
    out[:3, 3] += by[:3]
    out[:3, :3] = Rotation.from_rotvec(by[3:]).as_matrix() @ T[:3, :3]
    return out


def _tool(frames: dict[str, np.ndarray], T_tracker_receiver: np.ndarray) -> np.ndarray:
    base, receiver, tool = (frames[name] for name in FRAMES)
    return np.linalg.inv(base) @ T_tracker_receiver @ np.linalg.inv(receiver) @ tool


@pytest.mark.parametrize("name", FRAMES)
def test_an_error_of_a_frame_moves_the_tool_as_differences_do(name: str) -> None:
    random = np.random.default_rng(17)
    for _ in range(20):
        frames = {frame: _frame(random) for frame in FRAMES}
        T_tracker_receiver, filtered = _frame(random), np.diag(random.uniform(1e-8, 1e-6, 6))
        by = random.normal(0.0, 1e-8, 6)
        right, off = (
            _tool(some, T_tracker_receiver) for some in (frames, {**frames, name: _off(frames[name], by)})
        )
        moved = np.concatenate(
            [off[:3, 3] - right[:3, 3], rotation_vectors((off[:3, :3] @ right[:3, :3].T)[None])[0]]
        )
        where = SetupData(TrackSetup(**frames), {name: np.outer(by, by)})
        found = tool_covariance(where, right[None], filtered[None])[0] - filtered
        assert found == pytest.approx(np.outer(moved, moved), rel=1e-4, abs=1e-20)


def test_frames_without_covariance_add_nothing() -> None:
    random = np.random.default_rng(18)
    where = SetupData(TrackSetup(**{frame: _frame(random) for frame in FRAMES}))
    filtered = np.diag(random.uniform(1e-8, 1e-6, 6))[None]
    assert (tool_covariance(where, _frame(random)[None], filtered) == filtered).all()
