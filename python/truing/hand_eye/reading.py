# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Reading hand-eye data whose hand and camera may have files, and clocks, of their own."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from truing._core import ClockOffset, HandEyePoses
from truing.errors import InputError
from truing.files import HandEyeData, load_handeye, load_stream, pair_rows
from truing.files.table import Beside
from truing.hand_eye.api import handeye_clock

Floats = NDArray[np.float64]
Setup = Literal["eye-in-hand", "eye-to-hand"]
_FEWEST = 3
_PAUSE = 0.5  # [s] between poses: nobody moves so far between two samples of a motion
_TOGETHER = 0.1  # of the pause


def load_on_one_clock(
    poses: Path,
    *,
    board: str = "",
    camera: Path | None = None,
    angles: str = "",
    board_poses: Path | None = None,
    beside: Beside | None = None,
    setup: Setup = "eye-in-hand",
    progress: Any = None,
) -> tuple[HandEyeData | None, ClockOffset | None]:
    """What the files hold, hand poses at the camera's times (None: the offset of the clocks is not found),
    and the offset where there is one.

    board: what is in the images. board_poses: file of board poses with times of their own. beside: the hand
    poses of a table `poses` that has none. progress: called with how many images of how many are searched.
    Raises InputError.
    """
    if board_poses is None:
        data = load_handeye(
            poses,
            board=board or None,
            camera=camera,
            angles=angles or None,
            setup=setup,
            progress=progress,
            beside=beside,
        )
        if data.board_time is None or data.time is None:
            return data, None
        clock = handeye_clock(
            data.time, data.poses.T_base_hand, data.board_time, data.poses.T_camera_board, setup=setup
        )
        return (_at_camera_times(data, clock) if clock.found else None), clock
    hand = load_stream(poses, "hand", angles=angles or None)
    seen = load_stream(board_poses, "board", angles=angles or None)
    if hand.time is None or seen.time is None or _taken_together(hand.time, seen.time):
        return pair_rows(hand, seen), None
    clock = handeye_clock(hand.time, hand.T, seen.time, seen.T, setup=setup)
    if not clock.found:
        return None, clock
    rows = _rows(clock, board_poses)
    return HandEyeData(poses, HandEyePoses(clock.T_base_hand, seen.T[rows]), np.asarray(rows)), clock


def _taken_together(hand: Floats, camera: Floats) -> bool:
    """Poses at rest, one after the other: as many on both sides, with pauses much longer than their times
    differ.
    """
    if len(hand) != len(camera):
        return False
    pause = min(np.median(np.diff(hand)), np.median(np.diff(camera)))
    return bool(pause > _PAUSE and np.abs(hand - camera).max() < _TOGETHER * pause)


def _rows(clock: ClockOffset, file: Path) -> list[int]:
    rows = list(clock.rows)
    if len(rows) < _FEWEST:
        raise InputError(
            f"{file}: {len(rows)} board poses lie within the time of the robot's record, expected at least"
            f" {_FEWEST}"
        )
    return rows


def _at_camera_times(data: HandEyeData, clock: ClockOffset) -> HandEyeData:
    """The rows that the robot's record covers, with the hand where it was when the camera saw the board."""
    rows, poses = _rows(clock, data.path), data.poses
    return dataclasses.replace(
        data,
        poses=poses.replace(
            T_base_hand=clock.T_base_hand,
            T_camera_board=poses.T_camera_board[rows],
            images=None if poses.images is None else [poses.images[row] for row in rows],
            set=None if poses.set is None else poses.set[rows],
        ),
        rows=data.rows[rows],
        joints=None if data.joints is None else data.joints[rows],
        images=tuple(data.images[row] for row in rows) if data.images else (),
    )
