# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Where recorded torques end: a low-pass that they went through before they were written.

Dry friction turns at once, so torques of a robot have content at all frequencies, which falls as 1/f, and so
has what a model with dry friction expects. Of torques that were low-passed nothing is left above some
frequency, at all joints alike. Spectra are Welch's (1967): overlapping stretches under Hann's window.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.recorded import driven_joints, measured_torque
from truing.dynamics.sanity.findings import RecordingFinding
from truing.dynamics.sanity.grids import gaps_of, usual_step

Floats = NDArray[np.float64]

STRETCH = 4.0  # [s] whose spectrum is taken
HALF = 0.05  # [s] of the window that angles are smoothed by, for their derivatives
QUIET = 0.01  # [rad/s | m/s] below this the sign of the speed fades, as in the core
BANDS = 4  # in an octave
LOWEST = 0.5  # [Hz] of the first band
EDGE = 0.5  # measured to expected: here the low-pass is said to be
GONE = 0.05  # and from an octave above no more than this is left, at every joint
ALIKE = 1.5  # of the joints' edges, the largest to the smallest
STEP_DOWN = 0.1  # [Hz] to which the cut-off is rounded
LONGEST = 120.0  # [s] of a recording that is looked at


def edge(robot: _core.Robot, recordings: Sequence[_core.Recording]) -> float | None:
    """[Hz] of the low-pass that the torques of all recordings went through; None: none is seen."""
    highest = _core.TorqueOptions().cutoff
    spectra = [found for one in recordings if (found := _spectra(robot, one)) is not None]
    if not spectra:
        return None
    bands = LOWEST * 2.0 ** (np.arange(math.ceil(BANDS * math.log2(2.0 * highest / LOWEST)) + 1) / BANDS)
    edges = []
    for j in range(len(driven_joints(robot))):
        parts = [(frequency, rows) for frequency, joints in spectra if (rows := joints[j]) is not None]
        ratio = _ratio(parts, bands) if parts else None
        if ratio is None:
            continue
        below = np.flatnonzero(ratio >= EDGE)
        if not below.size or below[-1] + 1 + BANDS >= len(bands):
            return None
        k = int(below[-1])
        if (ratio[k + 1 + BANDS :] > GONE).any():
            return None
        part = math.log(ratio[k] / EDGE) / math.log(ratio[k] / ratio[k + 1])
        edges.append(float(bands[k] * (bands[k + 1] / bands[k]) ** part))
    if not edges or max(edges) > ALIKE * min(edges) or max(edges) >= highest:
        return None
    return float(np.median(edges))


def cutoff_below(frequency: float) -> float:
    """[Hz] of the low-pass that both sides of the equation of motion then go through."""
    return max(STEP_DOWN, math.floor(frequency / STEP_DOWN) * STEP_DOWN)


def finding(frequency: float) -> RecordingFinding:
    words = (
        f"the torques were low-passed at about {frequency:.1f} Hz before they were recorded: nothing is left"
        f" of dry friction above it; what they are compared with is low-passed at"
        f" {cutoff_below(frequency):.1f} Hz"
    )
    return RecordingFinding("torques_low_passed", (), (), words, frequency, "Hz", True)


def _spectra(
    robot: _core.Robot, recording: _core.Recording
) -> tuple[Floats, list[tuple[Floats, Floats] | None]] | None:
    """Frequencies [Hz]; of every joint the power of what was measured and of what friction of the fitted size
    and the rigid model expect. None: no stretch without a gap is long enough."""
    time = np.asarray(recording.time, dtype=np.float64)
    step = usual_step(time)
    ends = np.concatenate([[-1], gaps_of(time), [len(time) - 1]])
    longest = int(np.argmax(np.diff(ends)))
    rows = slice(ends[longest] + 1, ends[longest + 1] + 1)
    even = np.arange(time[rows][0], min(time[rows][-1], time[rows][0] + LONGEST), step)
    window = int(STRETCH / step)
    if len(even) < window or window < 2:
        return None
    q, torque = (
        np.column_stack([np.interp(even, time[rows], column) for column in table[rows].T])
        for table in (np.asarray(recording.position), measured_torque(robot, recording))
    )
    q = _smoothed(q, max(1, round(HALF / step)))
    qd = np.gradient(q, step, axis=0)
    rigid = np.asarray(_core.rigid_torques(robot, q, qd, np.gradient(qd, step, axis=0)))
    joints: list[tuple[Floats, Floats] | None] = []
    for j in range(q.shape[1]):
        moves = np.abs(qd[:, j]) > QUIET
        turns = int(np.count_nonzero(np.diff(np.sign(qd[moves, j]))))
        if np.isnan(torque[:, j]).any() or turns < 2:  # a joint that does not turn round tells nothing
            joints.append(None)
            continue
        columns = np.column_stack([np.tanh(qd[:, j] / QUIET), qd[:, j], np.ones(len(q)), rigid[:, j]])
        values = np.linalg.lstsq(columns, torque[:, j], rcond=None)[0]
        joints.append((_power(torque[:, j], window), _power(columns @ values, window)))
    return np.asarray(np.fft.rfftfreq(window, step), dtype=np.float64), joints


def _smoothed(table: Floats, half: int) -> Floats:
    weights = np.hanning(2 * half + 3)[1:-1]
    weights /= weights.sum()
    return np.column_stack(
        [np.convolve(np.pad(column, half, mode="edge"), weights, mode="valid") for column in table.T]
    )


def _power(column: Floats, window: int) -> Floats:
    """Summed over stretches, each less its straight line."""
    begins = range(0, len(column) - window + 1, window // 2)
    parts = np.stack([column[begin : begin + window] for begin in begins])
    time = np.arange(window) - (window - 1) / 2
    parts = parts - parts.mean(axis=1, keepdims=True)
    parts = parts - np.outer(parts @ time / (time @ time), time)
    spectrum = np.fft.rfft(parts * np.hanning(window), axis=1)
    return np.asarray((np.abs(spectrum) ** 2).sum(axis=0))


def _ratio(parts: Sequence[tuple[Floats, tuple[Floats, Floats]]], bands: Floats) -> Floats | None:
    """Measured to expected amplitude in bands; None where a recording is too coarse in time for them."""
    sums = np.zeros((2, len(bands)))
    width = 2.0 ** (0.5 / BANDS)
    for frequency, powers in parts:
        for k, band in enumerate(bands):
            if band > frequency[-1]:
                return None
            inside = (frequency >= band / width) & (frequency < band * width)
            inside[np.argmin(np.abs(frequency - band))] = (
                True  # low bands are narrower than the spectrum's lines
            )
            sums[:, k] += [power[inside].mean() for power in powers]
    if not (sums[1] > 0.0).all():
        return None
    return np.asarray(np.sqrt(sums[0] / sums[1]))
