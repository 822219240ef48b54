# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What single columns show without any model: their clock, rest, clipping, coarse steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints, of_all_rows
from truing.dynamics.sanity.findings import RecordingFinding, listed, together
from truing.dynamics.sanity.grids import (
    FAR_APART,
    MOVES,
    REST_WINDOW,
    SMOOTHING,
    STILL,
    Grid,
    gaps_of,
    speeds_at_rest,
    usual_step,
)
from truing.dynamics.smoothing import acceleration_kernel, rows_within

Floats = NDArray[np.float64]

JITTER = 0.1  # of the usual step: standard deviation from which on steps are said to differ
SMOOTHER = 3.0  # times smoother with even steps: then these are what the robot did
REST = 0.05  # of the rows: from here on rest is said
IDLE = 0.98  # of the rows at rest, of every joint: nothing is excited
CLIPPED = 0.005  # of the rows in plateaus at an end of the range
PLATEAU = 5  # rows in a row that a limit cuts off; a peak has fewer
LEVELS = 16  # of values that come in steps; of fewer nobody can say what a limit is
CROWDED = 3.0  # times as many rows at the end of the range as a step from it
LOOKED_AT = 5000  # rows of a column, evenly picked, that its steps are taken from
COARSE_TORQUE = 0.05  # of the torque's standard deviation: rms error by rounding
COARSE_POSITION = 0.2  # of the acceleration: rms error by rounding of the angle
_SAME = 1e-6  # of a column's range: values nearer to each other are one
_SMALL = 0.05  # of the differences of neighbouring values are smaller than its step
_WHOLE = 0.1  # steps by which a difference may miss a whole number of them
_MOST = 0.9  # of the differences do
_REPEATED = 0.25  # different values a row: with more of them the column comes in no steps
_ROUNDING = 12.0**-0.5  # rms error of rounding to steps of 1


def alone(recordings: Sequence[_core.Recording]) -> list[RecordingFinding]:
    """One recording: it can be compared with itself only."""
    if len(recordings) != 1:
        return []
    words = "one recording: blocks of its own time are held out, other motions may do worse, and no name is"
    return [RecordingFinding("one_recording", (), (), f"{words} surer than 90 %", 1.0, "recordings", True)]


def magnitudes() -> RecordingFinding:
    """Torques or currents without the way they push."""
    words = "torques never change their sign though their joints turn both ways and hold up no weight:"
    words += " they are magnitudes. Record them with their sign, or commands (u1_rad …), which are enough"
    return RecordingFinding("torque_magnitude", (), (), words, 0.0, "Nm", mistake=True)


# ---- The clock -------------------------------------------------------------------------------------
def clock(recordings: Sequence[_core.Recording]) -> tuple[list[RecordingFinding], list[_core.Recording]]:
    """Gaps, and steps that differ; and the recordings, with even steps where the motion says so."""
    gaps, jitter, out = [], [], []
    for recording in recordings:
        time = np.asarray(recording.time)
        steps, usual = np.diff(time), usual_step(time)
        after = gaps_of(time)
        if len(after):
            words = f"{counted(len(after), 'gap')} of up to {steps[after].max():.3g} s between rows"
            words += f" {1000 * usual:.3g} ms apart"
            gaps.append(_of_recording("gaps", recording, words, float(steps[after].max()), "s", applied=True))
        spread = float(np.std(np.delete(steps, after))) / usual
        if spread > JITTER:
            smoother = 1.0 if len(after) else _smoother_if_even(time, np.asarray(recording.position))
            jitter.append(_jitter(recording, spread, usual, smoother))
            if smoother > SMOOTHER:
                recording = of_all_rows(recording, _evenly_in_time)
        out.append(recording)
    found = together(gaps, lambda all_, worst: f"{_in(all_, worst)}{worst.evidence}; they are cut there")
    for applied in (True, False):
        same = [one for one in jitter if one.applied is applied]
        found += together(same, lambda all_, worst: f"{_in(all_, worst)}{worst.evidence}")
    return found, out


def slow(recordings: Sequence[_core.Recording]) -> list[RecordingFinding]:
    """Rows so far apart that what moves between them has to be thought of."""
    steps = {one.name: usual_step(np.asarray(one.time)) for one in recordings}
    where = [name for name, step in steps.items() if step > FAR_APART]
    if not where:
        return []
    step = 1000.0 * max(steps.values())
    words = f"{listed(where)}: rows are up to {step:.3g} ms apart: a smooth curve is laid through the angles,"
    words += " and torques are compared where they were recorded, without what is faster than rows can show"
    return [RecordingFinding("slow_rows", tuple(where), (), words, step, "ms", applied=True)]


def _evenly_in_time(recording: _core.Recording) -> _core.Recording:
    time = np.asarray(recording.time)
    return recording.replace(time=np.linspace(time[0], time[-1], len(time)))


def _jitter(recording: _core.Recording, spread: float, usual: float, smoother: float) -> RecordingFinding:
    words = f"steps between rows differ by {100 * spread:.0f} % of the usual {1000 * usual:.3g} ms (standard"
    words += " deviation)"
    if smoother > SMOOTHER:
        words += f"; with even steps the motion is {smoother:.1f} times smoother, so the stamps are the"
        words += " recorder's, and rows are taken as evenly spaced"
    applied = smoother > SMOOTHER
    return _of_recording("jitter", recording, words, 100 * spread, "%", applied=applied)


def _smoother_if_even(time: Floats, q: Floats) -> float:
    """How much less speeds change from row to row if rows were evenly spaced in time."""

    def roughness(steps: Floats) -> float:
        speed = np.diff(q, axis=0) / steps[:, None]
        size = speed.std(axis=0)
        moves = size > 0.0
        return (
            float(np.median(np.diff(speed, axis=0).std(axis=0)[moves] / size[moves])) if moves.any() else 0.0
        )

    even = roughness(np.full(len(time) - 1, (time[-1] - time[0]) / (len(time) - 1)))
    return roughness(np.diff(time)) / even if even > 0.0 else 1.0


# ---- Rest ------------------------------------------------------------------------------------------
def at_rest(grid: Grid, speeds: Floats) -> Floats:
    """Part of the rows in which each joint rests. speeds: `speeds_at_rest`. shape=(joints,)"""
    window = max(1, int(round(REST_WINDOW / grid.step)))
    fast = np.cumsum(np.abs(grid.qd) > speeds, axis=0)
    n = len(fast)
    high = fast[np.minimum(np.arange(n) + window, n - 1)]
    low = np.vstack([np.zeros((1, fast.shape[1]), dtype=fast.dtype), fast])[
        np.maximum(np.arange(n) - window, 0)
    ]
    return np.asarray(np.mean((high == low)[grid.rows], axis=0)) if len(grid.rows) else np.zeros(0)


def rest(robot: _core.Robot, grids: Sequence[Grid]) -> list[RecordingFinding]:
    """Recordings in which nothing moves, joints that never do, and rows at rest."""
    names = [joint.name for joint in driven_joints(robot)]
    speeds = speeds_at_rest(robot)
    shares = {grid.name: at_rest(grid, speeds) for grid in grids if len(grid.rows)}
    if not shares:
        return []
    idle = [
        RecordingFinding(
            "idle", (name,), (), "no joint moves", 100 * float(share.min()), "% of the rows at rest", True
        )
        for name, share in shares.items()
        if share.min() > IDLE
    ]
    table = np.array(list(shares.values()))
    still = [names[int(j)] for j in np.flatnonzero(table.min(axis=0) > IDLE)]
    out = together(idle, lambda all_, _: f"{_in(all_)}no joint moves: nothing can be fitted to it")
    if still and len(still) < len(names):
        words = f"{listed(still)} never {'move' if len(still) > 1 else 'moves'}: friction and inertia"
        words += " there cannot be found"
        out.append(RecordingFinding("still", (), tuple(still), words, 100.0, "% of the rows at rest"))
    busy = {name: share for name, share in shares.items() if share.min() <= IDLE and share.max() > REST}
    return [*out, *_rows_at_rest(names, busy)]


def _rows_at_rest(names: Sequence[str], shares: dict[str, Floats]) -> list[RecordingFinding]:
    if not shares:
        return []
    table = np.array(list(shares.values()))
    recording, joint = divmod(int(np.argmax(table)), len(names))
    most = 100 * float(table[recording, joint])
    words = (
        f"{listed(list(shares))}: joints are at rest in up to {most:.0f} % of the rows"
        f" ({names[joint]} in {list(shares)[recording]}); these rows are judged, not fitted"
    )
    joints = tuple(names[int(j)] for j in np.flatnonzero(table.max(axis=0) > REST))
    return [RecordingFinding("at_rest", tuple(shares), joints, words, most, "% of the rows", True)]


# ---- Values ----------------------------------------------------------------------------------------
def values(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> list[RecordingFinding]:
    """Columns that are clipped, coarse, or the same throughout."""
    found: dict[str, list[RecordingFinding]] = {}
    for recording in recordings:
        for one in _values_of(robot, recording):
            found.setdefault(one.finding, []).append(one)
    return [
        one
        for kind in found.values()
        for one in together(kind, lambda all_, worst: f"{_in(all_, worst)}{worst.evidence}")
    ]


def _values_of(robot: _core.Robot, recording: _core.Recording) -> Iterator[RecordingFinding]:
    step = usual_step(np.asarray(recording.time))
    kernel = acceleration_kernel(rows_within(SMOOTHING, step), step)
    for k, joint in enumerate(driven_joints(robot)):
        position = np.asarray(recording.position[:, k])
        moves = bool(np.ptp(position) > STILL)
        unit = "rad" if joint.type == "revolute" else "m"
        if moves:
            yield from _coarse_position(recording, joint.name, position, kernel, unit)
        for table, stem, amount in (
            (recording.torque, "tau", "Nm" if joint.type == "revolute" else "N"),
            (recording.current, "i", "A"),
        ):
            if table.shape[1] and not np.isnan(table[0, k]) and moves:
                yield from _drive_column(
                    recording, joint.name, np.asarray(table[:, k]), f"{stem}{k + 1}", amount
                )


def _drive_column(
    recording: _core.Recording, joint: str, values_: Floats, column: str, unit: str
) -> Iterator[RecordingFinding]:
    if np.ptp(values_) == 0.0:
        words = f"{column} is {values_[0]:.4g} {unit} in every row, though {joint} moves"
        yield _of_recording("constant", recording, words, float(values_[0]), unit, joint, mistake=True)
        return
    step = resolution(values_)
    for end, word in ((float(values_.max()), "largest"), (float(values_.min()), "smallest")):
        share = _plateau_share(values_, end, step)
        if share > CLIPPED:
            words = (
                f"{column} stays at its {word} value, {end:.4g} {unit}, in {100 * share:.1f} % of the rows:"
                " clipped by the drive or the recorder"
            )
            yield _of_recording("clipped", recording, words, 100 * share, "% of the rows", joint)
    if step * _ROUNDING > COARSE_TORQUE * values_.std():
        part = 100 * step * _ROUNDING / values_.std()
        words = (
            f"{column} comes in steps of {step:.3g} {unit}, whose rounding is {part:.0f} % of its variation"
        )
        yield _of_recording("coarse_torque", recording, words, step, unit, joint)


def _plateau_share(x: Floats, end: float, step: float) -> float:
    """Part of the rows that are in runs at one end of the range: beyond it nothing was recorded. Of values
    that come in steps there are far fewer one step from it.
    """
    there = np.abs(x - end) <= 1e-9 * abs(end)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8)))
    runs = edges[1::2] - edges[::2]
    next_to_it = (np.abs(x - end) < 1.5 * step) & ~there
    if there.sum() < CROWDED * next_to_it.sum() or np.ptp(x) < LEVELS * step:
        return 0.0
    return float(runs[runs >= PLATEAU].sum()) / len(x)


def resolution(x: Floats) -> float:
    """The step between values, if they come in steps; else 0."""
    some = x[:: max(1, len(x) // LOOKED_AT)]
    different = np.unique(some)
    if len(different) < 2 or len(different) > _REPEATED * len(some):
        return 0.0
    steps = np.diff(different)
    steps = steps[steps > _SAME * np.ptp(different)]
    step = float(np.quantile(steps, _SMALL))
    whole = steps / step
    return step if float(np.mean(np.abs(whole - np.round(whole)) < _WHOLE)) > _MOST else 0.0


def _coarse_position(
    recording: _core.Recording, joint: str, q: Floats, kernel: Floats, unit: str
) -> Iterator[RecordingFinding]:
    step = resolution(q)
    if step == 0.0:
        return
    acceleration = np.convolve(q, kernel, mode="valid")
    moving = np.abs(acceleration) > MOVES * np.abs(acceleration).max() if len(acceleration) else np.zeros(0)
    size = float(np.sqrt(np.mean(acceleration[moving] ** 2))) if np.any(moving) else 0.0
    if not size > 0.0:
        return
    part = step * _ROUNDING * float(np.linalg.norm(kernel)) / size
    if part > COARSE_POSITION:
        words = (
            f"the angle comes in steps of {step:.3g} {unit}, whose rounding is {100 * part:.0f} % of the"
            " acceleration: inertia cannot be told from it"
        )
        yield _of_recording("coarse_position", recording, words, step, unit, joint)


def _of_recording(
    finding: str,
    recording: _core.Recording,
    evidence: str,
    value: float,
    unit: str,
    joint: str = "",
    *,
    applied: bool = False,
    mistake: bool = False,
) -> RecordingFinding:
    joints = (joint,) if joint else ()
    return RecordingFinding(finding, (recording.name,), joints, evidence, value, unit, applied, mistake)


def counted(n: int, noun: str) -> str:
    return f"{n} {noun}{'' if n == 1 else 's'}"


def _in(all_: RecordingFinding, worst: RecordingFinding | None = None) -> str:
    """ "run1 and run2 (J2, J3), worst in run1: " """
    where = listed(all_.recordings)
    if all_.joints:
        where += f" ({listed(all_.joints)})"
    if worst is None or (len(all_.recordings) == 1 and len(all_.joints) <= 1):
        return f"{where}: "
    most = worst.recordings[0] if len(all_.recordings) > 1 else worst.joints[0]
    return f"{where}, most in {most}: " if len(all_.recordings) > 1 else f"{where}, most at {most}: "
