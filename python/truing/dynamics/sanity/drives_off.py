# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Rows in which drives are off: brakes hold the joints, or nobody reads the torque."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import OFF, measured_torque, of_all_rows, with_rows
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import speeds_at_rest, usual_step

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

USUAL = 0.95  # quantile of a joint's torques: nearly the largest
NOTHING = 0.1  # of these: no torque, but noise and an offset
HELD = 0.3  # of these: some joint was asked for, right before or after, in the same posture
WINDOW = 0.1  # [s] on both sides, over which a joint at rest does not move
LEAST = 0.1  # [s] without torque
BESIDE = 0.15  # [s] of the same rest before and after it: a friction that lets go takes longer
FEWEST = 3  # rows that there have to be
MARGIN = 0.1  # [s] left out beside it: brakes close, drives let go


def without_drives_off(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Rows in which drives are off are left out: by the column `enabled`; and at rest, where no joint has a
    torque although one of them had, or has again, in the same posture."""
    sizes = np.abs(np.nan_to_num(np.vstack([measured_torque(robot, one) for one in recordings])))
    usual = np.quantile(sizes, USUAL, axis=0)
    out, where, seconds, told = [], [], 0.0, False
    for recording in recordings:
        step = usual_step(np.asarray(recording.time))
        off = drives_off(robot, usual, step, recording)
        if off.all():
            return [_always(recording)], list(recordings)
        if off.any():
            where.append(recording.name)
            seconds += float(off.sum()) * step
            told = told or bool(_told(recording).any())
        if off.any() or (recording.pieces is not None and "enabled" in recording.columns):
            recording = of_all_rows(recording, partial(_with_drives_on, robot, usual, step))
        out.append(recording)
    return ([_said(where, seconds, told)] if where else []), out


def drives_off(robot: _core.Robot, usual: Floats, step: float, recording: _core.Recording) -> Bools:
    """Rows of a recording, or of a piece of one, in which its drives are off. shape=(n,)

    usual: shape=(joints,) [Nm | N] size of each joint's torque; step: [s] between rows.
    """
    torque = np.nan_to_num(measured_torque(robot, recording))  # where there is none, none is asked for
    size = np.abs(torque) / np.where(usual > 0.0, usual, np.inf)
    resting = at_rest(np.asarray(recording.position), step, speeds_at_rest(robot))
    nothing = np.all(size < NOTHING, axis=1)
    out = _told(recording)
    for first, last in _runs(resting):
        for begin, end in _runs(nothing[first:last]) + first:
            before = size[max(first, begin - round(BESIDE / step)) : begin]
            after = size[end : min(last, end + round(BESIDE / step))]
            if (end - begin) * step >= LEAST and (_asked(before) or _asked(after)):
                margin = round(MARGIN / step)
                out[max(0, begin - margin) : end + margin] = True
    return out


def _told(recording: _core.Recording) -> Bools:
    """Rows in which the drives are off by the column `enabled`. shape=(n,)"""
    enabled = recording.columns.get("enabled")
    return np.zeros(len(recording), dtype=np.bool_) if enabled is None else np.asarray(enabled) < OFF


def _runs(wanted: Bools) -> NDArray[np.intp]:
    """First and one past the last row of every run. shape=(runs, 2)"""
    edges = np.diff(np.concatenate([[False], wanted, [False]]).astype(np.int8))
    return np.flatnonzero(edges).reshape(-1, 2)


def _asked(size: Floats) -> bool:
    """Whether some joint has a torque in these rows, of its usual one."""
    return len(size) >= FEWEST and bool(np.median(size, axis=0).max() > HELD)


def at_rest(q: Floats, step: float, speeds: Floats) -> Bools:
    """Rows around which no joint moves faster than noise lets one see. speeds: shape=(joints,) shape=(n,)"""
    half = max(1, round(WINDOW / step))
    if len(q) <= 2 * half:
        return np.zeros(len(q), dtype=np.bool_)
    moved = np.abs(q[2 * half :] - q[: -2 * half]) / (2 * half * step)
    return np.pad(np.all(moved < speeds, axis=1), half, mode="edge")


def _with_drives_on(
    robot: _core.Robot, usual: Floats, step: float, recording: _core.Recording
) -> _core.Recording:
    return with_rows(recording, ~drives_off(robot, usual, step, recording))


def _said(where: Sequence[str], seconds: float, told: bool) -> RecordingFinding:
    why = (
        "by the column enabled"
        if told
        else "no joint has a torque at rest, where one of them had or has one in the same posture, as with"
        " brakes on"
    )
    words = f"{listed(where)}: drives are off for {seconds:.3g} s in all ({why}): these rows are left out"
    return RecordingFinding("drives_off", tuple(where), (), words, seconds, "s", applied=True)


def _always(recording: _core.Recording) -> RecordingFinding:
    words = f"{recording.name}: drives are off throughout: expected rows with the drives on, leave it out"
    return RecordingFinding("drives_off", (recording.name,), (), words, 100.0, "% of the rows", mistake=True)
