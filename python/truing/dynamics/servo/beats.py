# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Commands that change more seldom than rows are recorded.

A policy of 20 Hz beside joints that are read at 50: its commands were held until the next one, or what the
column shows are samples of commands that went on between (logged more seldom than sent, or filled in by the
servo). Both look late, or like other controllers, if they are taken for the other; the motion tells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing import _core

Floats = NDArray[np.float64]

_LONGEST = 0.3  # [s] between commands: what changes more seldom are steps
_LEAST_CHANGES = 20
_ROWS = 1.5  # between changes, at least
_TOGETHER = 1.6  # times the usual time between changes: longer ones are rests, of several beats
_REGULAR = 0.95  # of the changes, that are seen within a row of their beat
_WITHIN = 20  # instants of a row, over which commands are averaged


@dataclass(frozen=True)
class Beat:
    """Commands change, if they do, at `first` and every `period` seconds after it."""

    period: float
    first: float


def beat_of(recording: _core.Recording) -> Beat | None:
    """When a recording's commands change. None: at every row, or at no even beat, or hardly."""
    seen, row = _changes(recording)
    if seen.size < _LEAST_CHANGES:
        return None
    between = np.diff(seen)
    period = float(np.mean(between[between < _TOGETHER * np.median(between)]))
    if not _ROWS * row < period < _LONGEST:
        return None
    counts = np.concatenate([[0.0], np.cumsum(np.maximum(np.round(between / period), 1.0))])
    period = float(np.polyfit(counts, seen, 1)[0])
    late = seen - period * counts  # by up to a row: a change is seen at the next one
    low = float(np.median(late)) - 0.75 * row
    regular = (late > low) & (late < low + 1.5 * row)
    if np.mean(regular) < _REGULAR:
        return None
    return Beat(period, float(np.min(late[regular])))


def _changes(recording: _core.Recording) -> tuple[Floats, float]:
    """Times of rows at which a command is another one, and between rows [s]."""
    time, command = np.asarray(recording.time), np.asarray(recording.command)
    if command.shape[1] == 0 or recording.pieces is not None:
        return np.zeros(0), 1.0
    changed = np.any(np.diff(command, axis=0) != 0.0, axis=1)
    return time[np.flatnonzero(changed) + 1], float(np.median(np.diff(time)))


def rare_beat(recording: _core.Recording, period: float) -> Beat | None:
    """The beat of the other recordings, of one whose commands change on it, and more seldom."""
    seen, row = _changes(recording)
    if seen.size == 0:
        return None
    late = seen - period * np.round((seen - seen[0]) / period)
    return Beat(period, float(late.min())) if float(np.ptp(late)) < 1.05 * row else None


def as_held(recording: _core.Recording, beat: Beat) -> _core.Recording:
    """Commands as each row has them on the average, held from beat to beat: a change within a row is half
    a row late in the column."""
    time, values = _beats(recording, beat)
    return _averaged(recording, lambda t: values[np.clip(np.searchsorted(time, t, "right") - 1, 0, None)])


def straight(recording: _core.Recording, beat: Beat) -> _core.Recording:
    """The same with straight lines from beat to beat."""
    time, values = _beats(recording, beat)
    return _averaged(
        recording, lambda t: np.column_stack([np.interp(t, time, column) for column in values.T])
    )


def smooth(recording: _core.Recording, beat: Beat) -> _core.Recording:
    """The same with cubics whose slopes are those of the beats on both sides (Catmull and Rom 1974)."""
    time, values = _beats(recording, beat)
    slopes = np.gradient(values, axis=0)

    def at(t: Floats) -> Floats:
        k = np.clip(np.searchsorted(time, t, "right") - 1, 0, time.size - 2)
        x = np.clip((t - time[k]) / beat.period, 0.0, 1.0)[:, None]
        a, b, c, d = values[k], values[k + 1], slopes[k], slopes[k + 1]
        line, own = a + x * (b - a), (1.0 - x) * (c - (b - a)) - x * (d - (b - a))
        return np.asarray(line + x * (1.0 - x) * own)

    return _averaged(recording, at)


def _beats(recording: _core.Recording, beat: Beat) -> tuple[Floats, Floats]:
    """Times of all beats, and what holds from each on."""
    time, command = np.asarray(recording.time), np.asarray(recording.command)
    row = float(np.median(np.diff(time)))
    first = beat.first - beat.period * np.ceil((beat.first - time[0]) / beat.period)
    beats = np.arange(first, time[-1] + beat.period, beat.period)
    seen = np.searchsorted(time, beats - 1e-6 * row, "left")  # at the next row
    return beats, command[np.clip(seen, 0, time.size - 1)]


def _averaged(recording: _core.Recording, at: Callable[[Floats], Floats]) -> _core.Recording:
    time = np.asarray(recording.time)
    row = float(np.median(np.diff(time)))
    instants = time[:, None] + row * (np.arange(_WITHIN) + 0.5) / _WITHIN
    command = at(instants.ravel()).reshape(time.size, _WITHIN, -1).mean(axis=1)
    return recording.replace(command=command)


def _held(recording: _core.Recording, beat: Beat | None, period: float) -> _core.Recording:
    return recording if beat is None else as_held(recording, beat)


def _filled_in(recording: _core.Recording, beat: Beat | None, period: float) -> _core.Recording:
    """Steps, too, are gone to in a straight line."""
    beat = beat or rare_beat(recording, period)
    return recording if beat is None else straight(recording, beat)


def _logged_seldom(recording: _core.Recording, beat: Beat | None, period: float) -> _core.Recording:
    return recording if beat is None else smooth(recording, beat)


_BETWEEN = (
    ", but joints move as if they went on between: servos fill them in (and are late by about as much), or"
    " they were logged more seldom than sent"
)
READINGS = {
    _held: ": joints move as if each was held until the next",
    _filled_in: _BETWEEN,
    _logged_seldom: _BETWEEN,
}
"""What commands may have been between two beats, and what is said of it. Takes a recording, its beat, and the
period of the others."""
