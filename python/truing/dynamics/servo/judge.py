# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Chains judged by the motion that they simulate on recordings that were not fitted: open loop from measured
states, at several horizons, joint by joint, and by what the joint was doing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.data import ServoData, Stream, Window
from truing.dynamics.servo.result import REGIMES, WHOLE, ServoRollout, ServoTrace
from truing.dynamics.servo.simulator import Point, Simulator

Floats = NDArray[np.float64]

HORIZONS = (0.1, 0.5, 2.0, 5.0)
_MOST = 60  # windows at a horizon
_STILL = 0.02  # of the fastest: slower rows are at rest
_NEAR = 0.15  # [s] from a turn: a reversal
_DRAWN = 20.0  # [s]


def spans_of(data: ServoData, windows: Sequence[Window], test: bool) -> list[Window]:
    """Stretches that were held out (or were not), as long as they go on without a break."""
    out: list[Window] = []
    for w in sorted((w for w in windows if w.test == test), key=lambda w: (w.stream, w.first)):
        last = out[-1] if out else None
        if last is not None and last.stream == w.stream and last.first + last.rows == w.first:
            out[-1] = Window(w.stream, last.first, last.rows + w.rows, last.fold, test)
        else:
            out.append(w)
    del data
    return out


def cut(data: ServoData, spans: Sequence[Window], horizon: float) -> list[Window]:
    """Windows of a horizon, one after the other; of the whole, the spans themselves."""
    if horizon == WHOLE:
        return list(spans)
    out = []
    for span in spans:
        rows = round(horizon / data.streams[span.stream].step)
        out += [
            Window(span.stream, span.first + k * rows, rows, span.fold, span.test)
            for k in range(span.rows // rows if rows else 0)
        ]
    if len(out) > _MOST:
        out = [out[k] for k in np.unique(np.round(np.linspace(0, len(out) - 1, _MOST)).astype(int))]
    return out


def measured(data: ServoData, windows: Sequence[Window]) -> Floats:
    return np.concatenate(
        [data.streams[w.stream].position[w.first + 1 : w.first + w.rows + 1] for w in windows]
    )


def judged(
    simulator: Simulator,
    windows: Sequence[Window],
    models: Mapping[str, Point],
    main: float,
) -> ServoRollout:
    """Errors of every model. main: the horizon [s] of regimes and recordings."""
    data = simulator.data
    spans = spans_of(data, windows, True) or spans_of(data, windows, False)
    points = list(models.values())
    horizons = [h for h in (*HORIZONS, WHOLE) if cut(data, spans, h)]
    errors = {name: np.zeros((data.joints, len(horizons))) for name in models}
    counts = []
    for k, horizon in enumerate(horizons):
        some = cut(data, spans, horizon)
        counts.append(len(some))
        truth = measured(data, some)
        for name, motion in zip(models, simulator.run(points, some)[0], strict=True):
            errors[name][:, k] = np.sqrt(np.mean((motion - truth) ** 2, axis=0))
    some = [w for w in windows if w.test] or list(windows)
    truth, motions = measured(data, some), simulator.run(points, some)[0]
    regime = np.concatenate([regimes_of(data.streams[w.stream], w) for w in some])
    owner = np.repeat([data.streams[w.stream].name for w in some], [w.rows for w in some])
    by_regime: dict[str, dict[str, Floats]] = {name: {} for name in models}
    by_recording: dict[str, dict[str, Floats]] = {name: {} for name in models}
    for name, motion in zip(models, motions, strict=True):
        squares = (motion - truth) ** 2
        for r, word in enumerate(REGIMES):
            by_regime[name][word] = np.array(
                [_rms(squares[regime[:, j] == r, j]) for j in range(data.joints)]
            )
        for recording in dict.fromkeys(owner):
            by_recording[name][str(recording)] = np.sqrt(np.mean(squares[owner == recording], axis=0))
    fitted = [w for w in windows if not w.test]
    truth = measured(data, fitted)
    train = {
        name: np.sqrt(np.mean((motion - truth) ** 2, axis=0))
        for name, motion in zip(models, simulator.run(points, fitted)[0], strict=True)
    }
    chain = simulator.arm.nominal
    return ServoRollout(
        tuple(horizons),
        chain.joints,
        tuple("m" if slides else "rad" for slides in chain.prismatic),
        tuple(counts),
        errors,
        by_regime,
        by_recording,
        main,
        train,
    )


def _rms(squares: Floats) -> float:
    return math.sqrt(float(np.mean(squares))) if squares.size else math.nan


def regimes_of(stream: Stream, window: Window) -> NDArray[np.intp]:
    """Number in REGIMES of every row of a window, joint by joint. shape=(rows, joints)"""
    rows = slice(window.first + 1, window.first + window.rows + 1)
    out = np.empty((window.rows, stream.speed.shape[1]), dtype=np.intp)
    near = max(1, round(_NEAR / stream.step))
    for j, speed in enumerate(stream.speed.T):
        fastest = np.abs(speed).max()
        still = np.abs(speed) <= _STILL * fastest
        moving = np.abs(speed[~still])
        middle = float(np.median(moving)) if moving.size else 0.0
        sign = np.sign(np.where(still, 0.0, speed))
        turns = _turns(sign)
        close = np.convolve(turns, np.ones(2 * near + 1), mode="same") > 0.5
        kind = np.where(close, 0, np.where(still, 3, np.where(np.abs(speed) < middle, 1, 2)))
        out[:, j] = kind[rows]
    return out


def _turns(sign: Floats) -> Floats:
    """1 where a joint begins to move the other way than it did last."""
    out = np.zeros(sign.size)
    at = np.flatnonzero(sign)
    out[at[1:][sign[at[1:]] != sign[at[:-1]]]] = 1.0
    return out


def traces_of(
    simulator: Simulator, windows: Sequence[Window], models: Mapping[str, Point]
) -> list[ServoTrace]:
    """Of every held-out recording its first seconds, windows one after the other."""
    data, chain = simulator.data, simulator.arm.nominal
    held = [w for w in windows if w.test] or list(windows)
    some: list[Window] = []
    for stream in dict.fromkeys(w.stream for w in held):
        mine = [w for w in held if w.stream == stream]
        step = data.streams[stream].step
        some += [
            w for k, w in enumerate(mine) if k == 0 or (w.first + w.rows - mine[0].first) * step <= _DRAWN
        ]
    motions = simulator.run(list(models.values()), some)[0]
    out = []
    at = np.cumsum([0, *(w.rows for w in some)])
    for stream in dict.fromkeys(w.stream for w in some):
        of = data.streams[stream]
        members = [k for k, w in enumerate(some) if w.stream == stream]
        rows = np.concatenate(
            [np.arange(some[k].first + 1, some[k].first + some[k].rows + 1) for k in members]
        )
        for j, joint in enumerate(chain.joints):
            simulated = {}
            for name, motion in zip(models, motions, strict=True):
                parts = []
                for k in members:
                    part = motion[at[k] : at[k + 1], j].copy()
                    part[0] = np.nan
                    parts.append(part)
                simulated[name] = np.concatenate(parts)
            out.append(
                ServoTrace(
                    of.name,
                    joint,
                    "m" if chain.prismatic[j] else "rad",
                    of.time[rows],
                    of.command[rows, j],
                    of.position[rows, j],
                    simulated,
                )
            )
    return out
