# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Commanded positions against what joints did: units, signs, order of columns.

A servo goes, late and not quite, where it is sent. No model is needed to see that it went elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints
from truing.dynamics.sanity.findings import RecordingFinding, listed
from truing.dynamics.sanity.grids import STILL

Floats = NDArray[np.float64]

LATEST = 0.3  # [s] that a joint may be late
STEPS = 16  # of lateness that are tried
ROWS = 4000  # of a recording, evenly picked
ALIKE = 0.95  # correlation of commands and angles from which on their ratio is certain
OTHER = 0.8  # correlation below which a command is not that of its joint
LEAST, MOST = 0.4, 10.0  # ratio of commands and angles: a soft servo under load goes a fifth of the way
HALF = 0.5  # ratio from which on commands are as large as the angles
UNIT = 0.15  # relative: a ratio that is a unit's
BEYOND = 4.0  # times the limit of a joint: no angle is there
WITHIN = 1.1  # times the limit: an angle may be there
DEGREES = 180.0 / math.pi
UNITS = {
    DEGREES: "in degrees",
    1e3: "in thousandths",
    4096 / (2 * math.pi): "in ticks, 4096 a turn",
    1024 / math.radians(300.0): "in ticks, 1024 in 300°",
    1 / (2 * math.pi): "in turns",
}


@dataclass(frozen=True)
class _Alike:
    """Of each joint's angle (rows) with each command (columns), over all recordings."""

    correlation: Floats  # NaN: one of them never moves
    ratio: Floats  # of command and angle


def commands(
    robot: _core.Robot, recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """What commands of positions show beside the angles; and recordings with what is certain corrected."""
    joints = driven_joints(robot)
    names = [joint.name for joint in joints]
    turns = np.array([joint.type == "revolute" for joint in joints])
    found, recordings = _angles_in_degrees(joints, recordings)
    alike = _alike(recordings)
    own, ratio = np.diag(alike.correlation), np.diag(alike.ratio)
    moved = other_order(alike.correlation)
    if moved is not None:
        return [*found, _order(names, moved)], list(recordings)
    sure = np.flatnonzero(np.abs(np.nan_to_num(own)) > ALIKE)
    in_degrees = [j for j in sure if turns[j] and abs(ratio[j] / DEGREES - 1.0) < UNIT]
    if in_degrees and all(j in in_degrees for j in sure if turns[j]):
        factors = np.where(turns, 1.0 / DEGREES, 1.0)
        recordings = [one.replace(command=np.asarray(one.command) * factors) for one in recordings]
        words = "commands are in deg, not in rad: joints go by a 57th of them; corrected"
        found.append(RecordingFinding("command_unit", (), (), words, DEGREES, "-", applied=True))
        return found, list(recordings)
    for j in sure:
        if own[j] < 0.0:
            words = (
                f"{names[j]} goes the other way than it is sent: the sign of u{j + 1} or of q{j + 1} is wrong"
            )
            words += " (correct the one that the robot's axis contradicts, and run again)"
            found.append(_mistake("command_sign", names[j], words, float(ratio[j])))
        elif not LEAST < ratio[j] < MOST:
            near = next((word for size, word in UNITS.items() if abs(ratio[j] / size - 1.0) < UNIT), "")
            words = f"u{j + 1} changes by {ratio[j]:.3g} where {names[j]} moves by 1: commands"
            words += f" {near or 'in another unit'}? Bring both to rad (or m), and run again"
            found.append(_mistake("command_unit", names[j], words, float(ratio[j])))
    return found, list(recordings)


def other_order(correlation: Floats) -> tuple[int, ...] | None:
    """The command of each joint, where some are those of others: like one of them, and not like its own."""
    size = np.abs(np.nan_to_num(correlation))
    best = size.argmax(axis=1)
    certain = (size.max(axis=1) > ALIKE) & (np.diag(size) < OTHER) & ~np.isnan(np.diag(correlation))
    order = np.where(certain, best, np.arange(len(size)))
    if not certain.any() or len(set(order.tolist())) < len(order):
        return None
    return tuple(int(k) for k in order)


def _order(names: Sequence[str], order: Sequence[int]) -> RecordingFinding:
    wrong = [j for j, k in enumerate(order) if j != k]
    said = listed([f"u{order[j] + 1} is that of {names[j]}" for j in wrong])
    words = f"commands are in another order than angles: {said}. Correct the columns, and run again"
    return RecordingFinding(
        "command_order", (), tuple(names[j] for j in wrong), words, float(len(wrong)), "joints", mistake=True
    )


def _mistake(finding: str, joint: str, words: str, value: float) -> RecordingFinding:
    return RecordingFinding(finding, (), (joint,), words, value, "-", mistake=True)


def _alike(recordings: Sequence[_core.Recording]) -> _Alike:
    """At the lateness at which angles are most like the commands before them; recordings by their rows."""
    tables = [_table(one) for one in recordings]
    best = max(
        (_at(tables, late) for late in np.linspace(0.0, LATEST, STEPS)),
        key=lambda one: float(np.nansum(np.abs(np.diag(one.correlation)))),
    )
    return best


def _table(recording: _core.Recording) -> tuple[Floats, Floats, Floats]:
    """Time, angles and commands of rows that are evenly picked."""
    every = max(1, len(recording) // ROWS)
    return (
        np.asarray(recording.time)[::every],
        np.asarray(recording.position)[::every],
        np.asarray(recording.command)[::every],
    )


def _at(tables: Sequence[tuple[Floats, Floats, Floats]], late: float) -> _Alike:
    """shape=(joints, joints): covariances within recordings, summed over them."""
    cross = of_q = of_u = 0.0
    ranges: Floats = np.zeros(tables[0][1].shape[1])
    for time, q, u in tables:
        before = np.column_stack([np.interp(time - late, time, column) for column in u.T])
        q0, u0 = q - q.mean(axis=0), before - before.mean(axis=0)
        cross = cross + q0.T @ u0
        of_q, of_u = of_q + np.sum(q0**2, axis=0), of_u + np.sum(u0**2, axis=0)
        ranges = np.maximum(ranges, np.ptp(q, axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = cross / np.sqrt(np.outer(of_q, of_u))
        ratio = np.sign(cross) * np.sqrt(np.outer(1.0 / of_q, of_u))
    still = ~(ranges > STILL)
    correlation[still, :] = np.nan
    correlation[~np.isfinite(correlation)] = np.nan
    return _Alike(correlation, ratio)


def _angles_in_degrees(
    joints: Sequence[_core.Joint], recordings: Sequence[_core.Recording]
) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Angles and commands, where angles in rad would be far beyond limits and in degrees are within all."""
    most = np.max([np.abs(np.asarray(one.position)).max(axis=0) for one in recordings], axis=0)
    limits = [
        (size, max(abs(joint.lower), abs(joint.upper)))
        for joint, size in zip(joints, most, strict=True)
        if joint.type == "revolute" and math.isfinite(joint.upper - joint.lower)
    ]
    beyond = sum(size > BEYOND * limit for size, limit in limits)
    if beyond < 2 or not all(size / DEGREES < WITHIN * limit for size, limit in limits):
        return [], list(recordings)
    factors = np.array([1.0 / DEGREES if joint.type == "revolute" else 1.0 for joint in joints])
    words = f"the angles are in deg, not in rad: those of {beyond} joints would be far beyond their limits;"
    words += " corrected"
    found = RecordingFinding("position_unit", (), (), words, float(beyond), "joints", applied=True)
    tables: tuple[str, ...] = ("position", "speed")
    if _both_in_degrees(joints, recordings):
        tables = ("position", "speed", "command", "speed_command")
    out = []
    for one in recordings:
        fields = {
            name: np.asarray(getattr(one, name)) * factors for name in tables if getattr(one, name).shape[1]
        }
        out.append(one.replace(**fields))
    return [found], out


def _both_in_degrees(joints: Sequence[_core.Joint], recordings: Sequence[_core.Recording]) -> bool:
    """Whether commands are as large as the angles."""
    alike = _alike(recordings)
    own, ratio = np.diag(alike.correlation), np.diag(alike.ratio)
    return bool(np.nanmedian(ratio[~np.isnan(own)]) > HALF) if (~np.isnan(own)).any() else True
