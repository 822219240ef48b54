# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Values that no motion has: angles that were folded into one turn, single rows far from their neighbours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from truing import _core
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import STILL

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

TURN = 2.0 * np.pi
NEAR_A_TURN = 0.5  # [rad] by which a step may miss a whole turn
WINDOW = 5  # rows whose median a row is held against: two wrong ones in a row are seen
FAR = 20.0  # times what nine in ten rows are off it
PART = 0.1  # of a column's range, without the outermost hundredth at each end
MOST = 0.02  # of the rows; of more nobody knows which are right
TABLES = {"position": ("q", "rad", "m"), "torque": ("tau", "Nm", "N"), "current": ("i", "A", "A")}


def unfolded(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Angles that step by a whole turn from row to row go on instead."""
    joints = driven_joints(robot)
    out, where, most = [], [], 0
    columns: dict[str, None] = {}
    for recording in recordings:
        q = np.array(recording.position)
        steps = np.diff(q, axis=0)
        folded = np.abs(np.abs(steps) - TURN) < NEAR_A_TURN
        folded &= np.array([joint.type == "revolute" for joint in joints])
        if folded.any():
            q[1:] -= np.cumsum(np.where(folded, np.sign(steps) * TURN, 0.0), axis=0)
            recording = recording.replace(position=q)
            where.append(recording.name)
            columns.update({joints[k].name: None for k in np.flatnonzero(folded.any(axis=0))})
            most += int(folded.sum())
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


def without_spikes(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Single values far from the rows around them are taken from these instead."""
    joints = driven_joints(robot)
    found: list[RecordingFinding] = []
    out = []
    for recording in recordings:
        fields = {}
        for name, (stem, turning, sliding) in TABLES.items():
            table = np.array(getattr(recording, name))
            for k in range(table.shape[1]):
                wrong = spikes(table[:, k])
                if not wrong.any() or not np.ptp(recording.position[:, k]) > STILL:
                    continue
                unit = turning if joints[k].type == "revolute" else sliding
                before = table[:, k].copy()
                table[wrong, k] = np.interp(np.flatnonzero(wrong), np.flatnonzero(~wrong), before[~wrong])
                largest = float(np.abs(before - table[:, k]).max())
                found.append(_spiked(recording.name, joints[k].name, f"{stem}{k + 1}", wrong, largest, unit))
                fields[name] = table
        out.append(recording.replace(**fields) if fields else recording)
    return _as_one(found), out


def spikes(x: Floats) -> Bools:
    """Rows that are far from the median of the rows around them: no more than two in a row. shape=(n,)"""
    nothing = np.zeros(len(x), dtype=np.bool_)
    if len(x) < 10 * WINDOW or np.isnan(x).any():
        return nothing
    off = np.abs(x - median_filter(x, WINDOW, mode="nearest"))
    low, high = np.quantile(x, (0.01, 0.99))
    wrong = np.asarray(off > max(FAR * float(np.quantile(off, 0.9)), PART * float(high - low)))
    return wrong if wrong.mean() < MOST else nothing


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
