# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What a controller's integral held when a recording began. No column has it: the servo held the arm before,
by an integral that the weight had charged. It is what moves the simulated arm nearest to the first seconds of
the recording; from there on the measured command error says it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo.data import ServoData, Window

Floats = NDArray[np.float64]


class Summing(Protocol):
    """A chain as numbers."""

    @property
    def chain(self) -> Floats: ...

    def key(self) -> bytes: ...


Run = Callable[[Sequence[Any], Sequence[Window], Sequence[Floats]], list[Floats]]
"""Motions of points over windows, each with its charges."""

_SEEN = 2.0  # [s] of a recording, that say how it began
_ALIKE = 0.2  # [s] of rows that count as one
_KEPT = 4000  # charges
_GAIN, _SUMS = (_core.servo_fields().index(name) for name in ("command_gain", "integral_gain"))


class Charges:
    """Integrals [rad s | m s] at the first rows of recordings, of chains that have any: shape=(recordings,
    joints); what was found is kept."""

    def __init__(self, data: ServoData, run: Run) -> None:
        self._data, self._run = data, run
        errors = np.concatenate([s.command - s.position for s in data.streams])
        self._error = np.sqrt(np.mean(errors**2, axis=0))
        self._known: dict[tuple[bytes, int], Floats] = {}

    def of(self, points: Sequence[Summing], windows: Sequence[Window]) -> list[Floats]:
        """Of each point for these windows; empty: it sums nothing."""
        summing = [k for k, p in enumerate(points) if np.any(p.chain[:, _SUMS] > 0.0)]
        keys = {k: points[k].key() for k in summing}
        streams = sorted({w.stream for w in windows})
        new = {
            keys[k]: points[k]
            for k in summing
            if any((keys[k], stream) not in self._known for stream in streams)
        }
        if new:
            self._find(new, streams)
        out = [np.zeros((0, 0))] * len(points)
        for k in summing:
            out[k] = np.zeros((len(self._data.streams), self._data.joints))
            out[k][streams] = [self._known[keys[k], stream] for stream in streams]
        while len(self._known) > _KEPT:
            self._known.pop(next(iter(self._known)))
        return out

    def _find(self, points: Mapping[bytes, Summing], streams: Sequence[int]) -> None:
        """By what a charge like a usual command error changes: e = c x, with a prior of one, and rows that
        count as one for a while (Kish 1965)."""
        windows = [self._first(stream) for stream in streams]
        unit = [self._unit(point) for point in points.values()]
        none = [np.zeros((len(self._data.streams), self._data.joints)) for _ in unit]
        ones = [empty + one for empty, one in zip(none, unit, strict=True)]
        every = list(points.values())
        motions = self._run([*every, *every], windows, [*none, *ones])
        ends = np.cumsum([0, *(w.rows for w in windows)])
        for k, key in enumerate(points):
            for i, w in enumerate(windows):
                rows, stream = slice(ends[i], ends[i + 1]), self._data.streams[w.stream]
                errors = stream.position[1 : w.rows + 1] - motions[k][rows]
                change = motions[len(every) + k][rows] - motions[k][rows]
                xx, xy = np.sum(change**2, axis=0), np.sum(change * errors, axis=0)
                left = np.sum(errors**2, axis=0) - xy**2 / np.maximum(xx, 1e-300)
                noise = left / w.rows * min(w.rows, _ALIKE / stream.step)
                self._known[key, w.stream] = unit[k] * xy / np.maximum(xx + noise, 1e-300)

    def _first(self, stream: int) -> Window:
        of = self._data.streams[stream]
        return Window(stream, 0, max(1, min(round(_SEEN / of.step), of.time.size - 1)))

    def _unit(self, point: Summing) -> Floats:
        """The charge whose torque is that of a joint's usual command error."""
        gain, sums = point.chain[:, _GAIN], point.chain[:, _SUMS]
        return np.where(sums > 0.0, gain * self._error / np.maximum(sums, 1e-300), 0.0)
