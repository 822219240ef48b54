# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""The chain itself over the windows that a written model is judged on: what all of its laws would do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from truing import _core
from truing.dynamics.servo.arm import ServoArm
from truing.dynamics.servo.chain import ServoChain
from truing.dynamics.servo.data import ServoData, Window, servo_data
from truing.dynamics.servo.simulator import Simulator, point_of
from truing.dynamics.simulate import Windows

Floats = NDArray[np.float64]


def chain_paths(
    chain: ServoChain, mjcf: str, recordings: Sequence[_core.Recording], windows: Windows
) -> Floats:
    """Where the chain is at the windows' times. shape=(n, times, joints) [rad | m]

    mjcf: the arm without drives. recordings: those of the windows, in their order. A window begins at the row
    that is nearest to its start.
    """
    data = at_references(servo_data(recordings, len(chain.joints)), chain)
    simulator = Simulator(ServoArm("", mjcf, chain, ()), data)
    some = [
        _window(data, int(t), float(s), windows) for s, t in zip(windows.starts, windows.track, strict=True)
    ]
    motion = simulator.run([point_of(chain)], some)[0][0]
    out = np.empty((len(some), windows.times.size, len(chain.joints)))
    at = np.cumsum([0, *(window.rows for window in some)])
    for k, window in enumerate(some):
        stream = data.streams[window.stream]
        rows = slice(window.first, window.first + window.rows + 1)
        path = np.vstack([stream.smooth[window.first], motion[at[k] : at[k + 1]]])
        since = stream.time[rows] - windows.starts[k]
        out[k] = np.column_stack([np.interp(windows.times, since, column) for column in path.T])
    return out


def at_references(data: ServoData, chain: ServoChain) -> ServoData:
    """Firmware gain, supply and temperature, counted from the chain's references."""
    gain, supply = data.gain_reference / chain.gain_reference, data.supply_reference / chain.supply_reference
    warmer = data.temperature_reference - chain.temperature_reference
    streams = [
        replace(
            stream,
            gain=stream.gain * (gain if "gain" in data.varies or data.gain_reference != 1.0 else 1.0),
            supply=stream.supply * (supply if data.supply_reference != 1.0 else 1.0),
            warmth=stream.warmth + (warmer if stream.warmth.size > 1 else 0.0),
        )
        for stream in data.streams
    ]
    return replace(data, streams=tuple(streams))


def _window(data: ServoData, recording: int, start: float, windows: Windows) -> Window:
    """The rows of a window in the stream that has its start."""
    number = next(
        k
        for k, stream in enumerate(data.streams)
        if stream.fold == recording and stream.time[0] - stream.step <= start <= stream.time[-1]
    )
    stream = data.streams[number]
    last = stream.time.size - 1
    first = min(max(round((start - stream.time[0]) / stream.step), 0), last - 1)
    rows = math.ceil(max(windows.times) / stream.step) + 1
    return Window(number, first, min(rows, last - first))
