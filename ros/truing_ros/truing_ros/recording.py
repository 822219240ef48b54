# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Joint states beside poses, as the CSV files that truing reads. Knows no ROS: times are whole nanoseconds.

A *row* is one pose of the arm at rest (``measurements.csv``, ``poses.csv``): joints and poses of the last
moments, averaged. A *stream* (``joints.csv``, ``tracker.csv``) is every sample as it came.
"""

from __future__ import annotations

import csv
import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from truing_ros.frames import Floats, Frame, mean_frame

NANO = 1e-9  # [s]
MOST_KEPT = 20000  # samples: a minute at 300 Hz; more are a window that was set too long


class NotTaken(ValueError):
    """No row was written; the sentence says what to wait for."""


class Table:
    """A CSV file that is written line by line: what was recorded before a crash is there.

    Raises FileExistsError where there is one already.
    """

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path, self.rows, self._width = path, 0, len(columns)
        self._file: IO[str] = path.open("x", encoding="utf-8", newline="", buffering=1)
        self._write(columns)

    def add(self, values: Iterable[float]) -> None:
        cells = [repr(float(value)) for value in values]
        if len(cells) != self._width:
            raise ValueError(f"{self.path}: {len(cells)} values for {self._width} columns")
        self._write(cells)
        self.rows += 1

    def close(self) -> None:
        self._file.close()

    def _write(self, cells: Sequence[str]) -> None:
        csv.writer(self._file, lineterminator="\n").writerow(cells)


class Joints:
    """Which of a message's joints are the robot's, in chain order."""

    def __init__(self, names: Sequence[str], prismatic: Iterable[str] = ()) -> None:
        if not names or len(set(names)) != len(names):
            raise ValueError(
                f"joints: found {list(names)}, expected every driven joint's name once, in chain order"
            )
        unknown = set(prismatic) - set(names)
        if unknown:
            raise ValueError(f"prismatic: {sorted(unknown)} are not among the joints {list(names)}")
        self.names = list(names)
        units = ["m" if name in set(prismatic) else "rad" for name in names]
        self.columns = [f"q{k}_{unit}" for k, unit in enumerate(units, start=1)]

    def positions(self, names: Sequence[str], positions: Sequence[float]) -> Floats | None:
        """shape=(n,) [rad | m]; None where the message is of other joints or has no number."""
        if len(positions) != len(names):
            return None
        found: Mapping[str, float] = dict(zip(names, positions, strict=True))
        values = np.array([found.get(name, math.nan) for name in self.names], dtype=float)
        return values if np.isfinite(values).all() else None


def _pose_columns(prefix: str = "", *, oriented: bool = True) -> list[str]:
    position = [f"{prefix}{axis}_m" for axis in "xyz"]
    return position + ([f"{prefix}{part}" for part in ("qw", "qx", "qy", "qz")] if oriented else [])


def _cells(frame: Frame, *, oriented: bool = True) -> list[float]:
    x, y, z, w = frame.quaternion
    return [*frame.position, *((w, x, y, z) if oriented else ())]


class Rows:
    """One row per pose of the arm, when it is asked for.

    kind "measurements": the measured target in the instrument's frame. "handeye": the board in the camera;
    the hand in the base comes with `take`. `window` [s]: how long the arm has to have been still, and what
    is averaged over; by arrival, so that clocks of robot and instrument need not agree. `still` [rad | m]:
    joints that move by more within the window are moving.
    """

    def __init__(
        self,
        path: Path,
        kind: str,
        joints: Joints,
        *,
        oriented: bool = True,
        window: float = 1.0,
        still: float = 2e-3,
    ) -> None:
        if kind == "handeye" and not oriented:
            raise ValueError("hand-eye needs orientations, and points have none")
        self._joints, self._kind, self._oriented, self._still = joints, kind, oriented, still
        self._window = round(window / NANO)
        self._readings: deque[tuple[int, Floats]] = deque(maxlen=MOST_KEPT)
        self._poses: deque[tuple[int, Frame]] = deque(maxlen=MOST_KEPT)
        self._last: Floats | None = None
        self._begin: int | None = None
        columns = _pose_columns(oriented=oriented) if kind == "measurements" else _pose_columns("board_")
        hand = _pose_columns("hand_") if kind == "handeye" else []
        self.table = Table(path, [*hand, *columns, *joints.columns, "t_s"])

    def on_joints(self, stamp: int, names: Sequence[str], positions: Sequence[float], now: int) -> None:
        values = self._joints.positions(names, positions)
        if values is not None:
            self._readings.append((now, values))

    def on_pose(self, stamp: int, frame: Frame, now: int) -> None:
        self._poses.append((now, frame))

    def take(self, now: int, hand: Frame | None = None) -> str:
        """Writes a row and says what it is the mean of. Raises NotTaken."""
        readings, poses = self._within(self._readings, now), self._within(self._poses, now)
        if not readings:
            raise NotTaken(f"no joint states of {self._joints.names} within {self._window * NANO:g} s")
        if not poses:
            raise NotTaken(f"no pose within {self._window * NANO:g} s")
        if self._kind == "handeye" and hand is None:
            raise NotTaken("it is not known where the hand is in the base")
        motion = float(np.ptp(readings, axis=0).max())
        if motion > self._still:
            raise NotTaken(f"the arm moves: by {motion:.2g} (rad or m) within {self._window * NANO:g} s")
        place, joints = mean_frame(poses), np.mean(readings, axis=0)
        spread = float(np.linalg.norm([pose.position - place.position for pose in poses], axis=1).max())
        self._begin = now if self._begin is None else self._begin
        measured = _cells(place, oriented=self._oriented)
        self.table.add([*(_cells(hand) if hand else ()), *measured, *joints, (now - self._begin) * NANO])
        self._last = joints
        return (
            f"row {self.table.rows}: mean of {len(readings)} joint states and {len(poses)} poses,"
            f" which lie within {1e3 * spread:.2g} mm"
        )

    def moved(self, now: int, least: float) -> bool:
        """Did a joint move by more than `least` [rad | m] since the last row?"""
        readings = self._within(self._readings, now)
        return bool(readings) and (
            self._last is None or float(np.abs(readings[-1] - self._last).max()) > least
        )

    def close(self) -> None:
        self.table.close()

    def _within(self, samples: deque[tuple[int, Any]], now: int) -> list[Any]:
        return [value for arrived, value in samples if now - self._window <= arrived <= now]


class Streams:
    """Every sample with its own stamp and its arrival, in seconds from the first one on."""

    def __init__(self, folder: Path, joints: Joints, *, oriented: bool = True) -> None:
        self._joints, self._oriented = joints, oriented
        self._begin: int | None = None
        self._last: dict[str, int] = {}
        self.left_out = 0  # samples whose stamp is not later than the one before
        self.joints = Table(folder / "joints.csv", ["t_s", *joints.columns, "arrival_s"])
        self.poses = Table(folder / "tracker.csv", ["t_s", *_pose_columns(oriented=oriented), "arrival_s"])

    def on_joints(self, stamp: int, names: Sequence[str], positions: Sequence[float], now: int) -> None:
        values = self._joints.positions(names, positions)
        if values is not None:
            self._add(self.joints, stamp, values, now)

    def on_pose(self, stamp: int, frame: Frame, now: int) -> None:
        self._add(self.poses, stamp, _cells(frame, oriented=self._oriented), now)

    def close(self) -> None:
        self.joints.close()
        self.poses.close()

    def _add(self, table: Table, stamp: int, values: Iterable[float], now: int) -> None:
        stamp = stamp or now  # a device that stamps nothing
        if stamp <= self._last.get(table.path.name, stamp - 1):
            self.left_out += 1
            return
        self._last[table.path.name] = stamp
        self._begin = stamp if self._begin is None else self._begin
        table.add([(stamp - self._begin) * NANO, *values, (now - self._begin) * NANO])
