# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Values that no motion has: angles that were folded into one turn, single rows far from their neighbours,
angles of all joints that stay the same for some rows in the middle of a motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints, of_all_rows, with_rows
from truing.dynamics.sanity.columns import resolution
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import STILL, usual_step

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

TURN = 2.0 * np.pi
NEAR_A_TURN = 0.5  # [rad] by which a step may miss a whole turn
CLOSE = 0.024  # [s] between rows: between such no motion goes there and back
WINDOW = 5  # rows whose median a row is held against: two wrong ones in a row are seen
FAR = 20.0  # times what nine in ten rows are off it
PART = 0.1  # of a torque's range, without the outermost hundredth at each end
PART_OF_ANGLE, LEAST_ANGLE = 0.02, 0.05  # of an angle's, and [rad | m]: motion goes less far and back
TIMES = 3.0  # the steps around it: steps to a wrong row and back are larger
MOST = 0.02  # of the rows; of more nobody knows which are right
REPEATED, SEVERAL = 3, 2  # rows that are the same, joints that then jump: at least
NEAR = 5  # rows before and after that tell how fast joints move
HALF_WAY = 0.5  # of the way that joints would have gone
COARSE = 4.0  # steps of the encoder: less is no jump
TABLES = {"position": ("q", "rad", "m"), "torque": ("tau", "Nm", "N"), "current": ("i", "A", "A")}


def unfolded(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Angles that step by a whole turn from row to row go on instead."""
    joints = driven_joints(robot)
    turning = np.array([joint.type == "revolute" for joint in joints])
    out, where, most = [], [], 0
    columns: dict[str, None] = {}
    for recording in recordings:
        q = np.asarray(recording.position)
        turns = _turns(q, turning, q[0])
        if turns.any():
            pieces = recording.pieces and _Unfolded(recording.pieces, turning)
            recording = recording.replace(position=q - turns, pieces=pieces, end=recording.end)
            where.append(recording.name)
            columns.update({joints[k].name: None for k in np.flatnonzero(turns.any(axis=0))})
            most += int(np.count_nonzero(np.diff(turns, axis=0)))
        out.append(recording)
    if not where:
        return [], out
    words = (
        f"{listed(where)} ({listed(list(columns))}): angles were folded into one turn, {most} steps of 360°"
    )
    words += " from one row to the next: they go on there"
    found = RecordingFinding(
        "angle_folded", tuple(where), tuple(columns), words, float(most), "steps", applied=True
    )
    return [found], out


def _turns(q: Floats, turning: Bools, before: Floats) -> Floats:
    """[rad] shape=(n, joints) whole turns that steps up to each row had. before: the row before the first."""
    steps = np.diff(q, axis=0, prepend=before[None])
    folded = (np.abs(np.abs(steps) - TURN) < NEAR_A_TURN) & turning
    return np.asarray(np.cumsum(np.where(folded, np.sign(steps) * TURN, 0.0), axis=0))


@dataclass(frozen=True)
class _Unfolded:
    """Pieces of a recording, each of whose angles go on from the piece before."""

    read: Callable[[], Iterator[_core.Recording]]
    turning: Bools

    def __call__(self) -> Iterator[_core.Recording]:
        last, turned = None, 0.0
        for piece in self.read():
            q = np.asarray(piece.position)
            turns = turned + _turns(q, self.turning, q[0] if last is None else last)
            last, turned = q[-1], turns[-1]
            yield piece.replace(position=q - turns)


def without_spikes(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Single values far from the rows around them are taken from these instead."""
    found: list[RecordingFinding] = []
    out = []
    for recording in recordings:
        near = usual_step(np.asarray(recording.time)) <= CLOSE
        spiked = _spikes_of(robot, recording) if near else []
        if spiked:
            recording = of_all_rows(recording, partial(_without_spikes, robot))
            found += [one.said for one in spiked]
        out.append(recording)
    return _as_one(found), out


@dataclass(frozen=True)
class _Spiked:
    """A column with spikes."""

    table: str
    column: int
    mended: Floats  # shape=(n,)
    said: RecordingFinding


def _without_spikes(robot: _core.Robot, recording: _core.Recording) -> _core.Recording:
    tables: dict[str, Floats] = {}
    for one in _spikes_of(robot, recording):
        tables.setdefault(one.table, np.array(getattr(recording, one.table)))[:, one.column] = one.mended
    return recording.replace(**tables) if tables else recording


def _spikes_of(robot: _core.Robot, recording: _core.Recording) -> list[_Spiked]:
    joints, found = driven_joints(robot), []
    for name, (stem, turning, sliding) in TABLES.items():
        table = np.asarray(getattr(recording, name))
        for k in range(table.shape[1]):
            of_angle = (PART_OF_ANGLE, LEAST_ANGLE) if name == "position" else (PART, 0.0)
            x = table[:, k]
            wrong = spikes(x, *of_angle)
            if not wrong.any() or not np.ptp(recording.position[:, k]) > STILL:
                continue
            unit = turning if joints[k].type == "revolute" else sliding
            mended = x.copy()
            mended[wrong] = np.interp(np.flatnonzero(wrong), np.flatnonzero(~wrong), x[~wrong])
            largest = float(np.abs(x - mended).max())
            said = _spiked(recording.name, joints[k].name, f"{stem}{k + 1}", wrong, largest, unit)
            found.append(_Spiked(name, k, mended, said))
    return found


def spikes(x: Floats, part: float = PART, floor: float = 0.0) -> Bools:
    """Rows that are far from the median of the rows around them: no more than two in a row. shape=(n,)
    part: of the range, that they are off at least; floor: the same, in the column's unit."""
    nothing = np.zeros(len(x), dtype=np.bool_)
    if len(x) < 10 * WINDOW or np.isnan(x).any():
        return nothing
    around = np.lib.stride_tricks.sliding_window_view(np.pad(x, WINDOW // 2, mode="edge"), WINDOW)
    off = np.abs(x - np.median(around, axis=1))
    low, high = np.quantile(x, (0.01, 0.99))
    least = max(floor, FAR * float(np.quantile(off, 0.9)), part * float(high - low), COARSE * resolution(x))
    far = np.concatenate([[False], off > least, [False]])
    wrong = nothing.copy()
    for a, b in np.flatnonzero(np.diff(far.astype(np.int8))).reshape(-1, 2):
        wrong[a:b] = 2 <= a and b <= len(x) - 2 and _there_and_back(x, a, b)
    return wrong if wrong.mean() < MOST else nothing


def _there_and_back(x: Floats, a: int, b: int) -> bool:
    """Whether values step to rows [a, b) and back again, by far more than before and after: a motion that
    turns in few rows slows down before it does."""
    there, back = x[a] - x[a - 1], x[b - 1] - x[b]
    around = max(abs(x[a - 1] - x[a - 2]), abs(x[b + 1] - x[b]) if b + 1 < len(x) else 0.0)
    return bool(there * back > 0.0 and min(abs(there), abs(back)) > TIMES * around)


def without_frozen(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Rows in which the last angles were written once more, as where a bus drops out, are left out."""
    out, where, rows, longest = [], [], 0, 0.0
    for recording in recordings:
        stuck = frozen(np.asarray(recording.position))
        if stuck.any():
            time = np.asarray(recording.time)
            where.append(recording.name)
            rows += int(stuck.sum())
            edges = np.flatnonzero(np.diff(np.concatenate([[0], stuck.astype(np.int8), [0]])))
            longest = max(longest, *(time[b - 1] - time[a - 1] for a, b in edges.reshape(-1, 2)))
            recording = of_all_rows(recording, _without_frozen)
        out.append(recording)
    if not where:
        return [], out
    words = (
        f"{listed(where)}: the angles of all joints stay the same for up to {longest:.2g} s while they move,"
    )
    words += f" {rows} rows in all, as where a bus drops out: these rows are left out"
    return [RecordingFinding("frozen", tuple(where), (), words, float(rows), "rows", applied=True)], out


def _without_frozen(recording: _core.Recording) -> _core.Recording:
    return with_rows(recording, ~frozen(np.asarray(recording.position)))


def frozen(q: Floats) -> Bools:
    """Rows that repeat the one before, of all joints, and after which several are where they would have gone:
    by half of the usual way in so many rows, or more. shape=(n,)"""
    steps = np.abs(np.diff(q, axis=0))
    same = np.concatenate([[False], (steps == 0.0).all(axis=1), [False]])
    out = np.zeros(len(q), dtype=np.bool_)
    least = steps[steps > 0.0].min(initial=np.inf)  # of the encoders
    for a, b in 1 + np.flatnonzero(np.diff(same.astype(np.int8))).reshape(-1, 2):
        length = b - a
        if length < REPEATED or a < 1 + NEAR or b + NEAR > len(steps):
            continue
        before, after = steps[a - 1 - NEAR : a - 1].mean(axis=0), steps[b : b + NEAR].mean(axis=0)
        usual = 0.5 * (before + after)
        jumped = (steps[b - 1] > HALF_WAY * length * usual) & (steps[b - 1] > COARSE * least) & (before > 0.0)
        if np.count_nonzero(jumped) >= SEVERAL:
            out[a:b] = True
    return out


def _spiked(
    recording: str, joint: str, column: str, wrong: Bools, largest: float, unit: str
) -> RecordingFinding:
    n = int(wrong.sum())
    words = f"{column} of {n} {'row' if n == 1 else 'rows'} up to {largest:.3g} {unit}"
    return RecordingFinding("spikes", (recording,), (joint,), words, float(n), "rows", applied=True)


def _as_one(found: Sequence[RecordingFinding]) -> list[RecordingFinding]:
    if not found:
        return []
    recordings = tuple(dict.fromkeys(one.recordings[0] for one in found))
    joints = tuple(dict.fromkeys(one.joints[0] for one in found))
    worst = max(found, key=lambda one: one.value)
    words = (
        f"{listed(recordings)} ({listed(joints)}): single values are far from the rows around them, most in"
        f" {worst.recordings[0]}: {worst.evidence}; lines between these rows are taken instead"
    )
    total = sum(one.value for one in found)
    return [replace(worst, recordings=recordings, joints=joints, evidence=words, value=total, unit="values")]
