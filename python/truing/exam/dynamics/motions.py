# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the arms are told to do: Fourier trajectories, point to point, slow reversals. Made at the
controller's 1 ms, beginning and ending at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from truing.exam.dynamics.robots import Arm, Floats

STEP = 1e-3
"""[s] of controller and simulation."""
_SETTLE = 0.5  # [s] at rest before a recording begins
_FADE = 1.0  # [s] in and out


@dataclass(frozen=True)
class Course:
    """A commanded motion, shape=(rows, n) at STEP, and what kind it is."""

    kind: str
    q: Floats
    qd: Floats

    @property
    def settle(self) -> int:
        return round(_SETTLE / STEP)


def _course(kind: str, q: Floats) -> Course:
    rest = np.repeat(q[:1], round(_SETTLE / STEP), axis=0)
    whole = np.concatenate([rest, q])
    return Course(kind, whole, np.gradient(whole, STEP, axis=0))


def _ease(x: ArrayLike) -> Floats:
    """From 0 to 1 with speed and acceleration zero at both ends."""
    y = np.clip(np.asarray(x, dtype=np.float64), 0.0, 1.0)
    return np.asarray(y**3 * (10.0 - 15.0 * y + 6.0 * y**2))


def fourier(arm: Arm, rng: Generator, seconds: float, held: frozenset[int] = frozenset()) -> Course:
    """Sums of five harmonics, as for identification, up to 50 to 90 % of the largest speeds."""
    t = np.arange(round(seconds / STEP)) * STEP
    envelope = _ease(t / _FADE) * _ease((t[-1] - t) / _FADE)
    q = np.zeros((len(t), arm.n))
    base = 2.0 * np.pi / max(seconds, 8.0) * rng.uniform(0.9, 1.3)
    for j in range(arm.n):
        if j in held:
            continue
        wave = np.zeros_like(t)
        for k in range(1, 6):
            a, b = rng.normal(size=2) / k
            wave += a * np.sin(k * base * t) + b * np.cos(k * base * t)
        wave -= wave.mean()
        limit = arm.speed[j] * rng.uniform(0.5, 0.9)
        factor = min(limit / np.abs(np.gradient(wave, STEP)).max(), 0.9 * arm.reach[j] / np.abs(wave).max())
        q[:, j] = factor * wave
    return _course("fourier", q * envelope[:, None] + _start(arm, rng, held))


def _start(arm: Arm, rng: Generator, held: frozenset[int]) -> Floats:
    """Where a motion stands in the middle: a little off zero."""
    offset = rng.uniform(-0.1, 0.1, arm.n) * arm.reach
    offset[list(held)] = 0.0
    return np.asarray(offset)


def point_to_point(arm: Arm, rng: Generator, seconds: float, held: frozenset[int] = frozenset()) -> Course:
    """From one random posture to the next, with rests of 0.2 to 0.5 s."""
    here = _posture(arm, rng, held)
    parts = [np.repeat(here[None], round(0.2 / STEP), axis=0)]
    rows = 0
    while rows < seconds / STEP:
        there = _posture(arm, rng, held)
        time = float(np.max(1.875 * np.abs(there - here) / (arm.speed * rng.uniform(0.5, 0.9))))
        x = np.arange(1, max(round(time / STEP), 100) + 1) / max(round(time / STEP), 100)
        rest = np.repeat(there[None], round(rng.uniform(0.2, 0.5) / STEP), axis=0)
        parts += [here + _ease(x)[:, None] * (there - here), rest]
        rows += len(x) + len(rest)
        here = there
    return _course("ptp", np.concatenate(parts)[: round(seconds / STEP)])


def _posture(arm: Arm, rng: Generator, held: frozenset[int]) -> Floats:
    q = rng.uniform(-0.6, 0.6, arm.n) * arm.reach
    q[list(held)] = 0.0
    return np.asarray(q)


def reversals(arm: Arm, rng: Generator, seconds: float, held: frozenset[int] = frozenset()) -> Course:
    """Slow waves of small and large strokes, every joint with its own period: friction's own motion."""
    t = np.arange(round(seconds / STEP)) * STEP
    envelope = _ease(t / _FADE) * _ease((t[-1] - t) / _FADE)
    q = np.zeros((len(t), arm.n))
    for j in range(arm.n):
        if j in held:
            continue
        for period, stroke in ((rng.uniform(2.5, 5.0), 0.25), (rng.uniform(0.9, 1.6), 0.04)):
            q[:, j] += stroke * rng.uniform(0.5, 1.0) * np.sin(2 * np.pi * t / period + rng.uniform(0, 6.28))
    return _course("slow", q * envelope[:, None] + _posture(arm, rng, held))


def short(arm: Arm, rng: Generator, seconds: float, joint: int, stroke: float) -> Course:
    """A Fourier trajectory in which one joint hardly travels, by `stroke` [rad] to both sides."""
    course = fourier(arm, rng, seconds)
    q = course.q[course.settle :].copy()
    wave = q[:, joint] - q[0, joint]
    q[:, joint] = wave * stroke / max(float(np.abs(wave).max()), 1e-9)
    return _course("fourier", q)
