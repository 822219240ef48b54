# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""What servo arms are told to do: steps, chirps, multisines, slow reversals, waypoints. Made at the rate of
the bus, and held between its samples.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from truing.exam.dynamics.robots import Arm, Floats

SECONDS = 8.0
"""Of a recording."""
_REST = 0.3  # [s] at the first posture
_FASTEST = 0.7  # share of a joint's speed that commands ask for at most


@dataclass(frozen=True)
class Course:
    """Commands of a recording, shape=(rows, n) [rad], from its first row on."""

    kind: str
    rate: float  # [Hz]
    u: Floats


Wave = Callable[[Arm, Generator, Floats], Floats]


def course(kind: str, arm: Arm, rng: Generator, rate: float) -> Course:
    """A motion of a kind of KINDS. Joints start at a random posture, and keep to their speeds."""
    t = np.arange(round(SECONDS * rate)) / rate
    wave = KINDS[kind](arm, rng, np.maximum(t - _REST, 0.0))
    wave = wave - wave[:1]
    middle = rng.uniform(-0.3, 0.3, arm.n) * arm.reach
    room = 0.9 * arm.reach - np.abs(middle)
    return Course(kind, rate, middle + wave * np.minimum(1.0, room / np.maximum(np.ptp(wave, axis=0), 1e-9)))


def _slowed(wave: Floats, t: Floats, arm: Arm) -> Floats:
    fastest = np.abs(np.gradient(wave, t[-1] / (len(t) - 1), axis=0)).max(axis=0)
    return np.asarray(wave * np.minimum(1.0, _FASTEST * arm.speed / np.maximum(fastest, 1e-9)))


def _multisine(arm: Arm, rng: Generator, t: Floats) -> Floats:
    wave = np.zeros((len(t), arm.n))
    for j in range(arm.n):
        for hertz in rng.uniform((0.1, 0.25, 0.5, 0.9, 1.4), (0.2, 0.45, 0.8, 1.3, 2.0)):
            wave[:, j] += 0.2 / (0.4 + hertz) * np.sin(2 * np.pi * hertz * t + rng.uniform(0, 6.28))
    return _slowed(wave, t, arm)


def _chirp(arm: Arm, rng: Generator, t: Floats) -> Floats:
    """From a tenth of a hertz to three, smaller as it gets faster."""
    low, high = 0.1, rng.uniform(2.2, 3.2)
    phase = 2 * np.pi * (low * t + 0.5 * (high - low) / t[-1] * t**2)
    hertz = low + (high - low) * t / t[-1]
    size = 0.45 / (1.0 + hertz)
    shift = rng.uniform(0, 6.28, arm.n)
    return _slowed(size[:, None] * np.sin(phase[:, None] + shift), t, arm)


def _steps(arm: Arm, rng: Generator, t: Floats) -> Floats:
    wave = np.zeros((len(t), arm.n))
    for j in range(arm.n):
        here, level = rng.uniform(0.2, 0.6), 0.0
        while here < t[-1]:
            level = rng.uniform(0.12, 0.4) * (-1.0 if level > 0.0 else 1.0)
            wave[t >= here, j] = level
            here += rng.uniform(0.8, 1.6)
    return wave


def _slow(arm: Arm, rng: Generator, t: Floats) -> Floats:
    """Large waves of some seconds, and small ones upon them: friction's own motion."""
    wave = np.zeros((len(t), arm.n))
    for j in range(arm.n):
        for period, size in ((rng.uniform(3.0, 5.0), 0.35), (rng.uniform(1.1, 1.8), 0.05)):
            wave[:, j] += size * rng.uniform(0.6, 1.0) * np.sin(2 * np.pi * t / period + rng.uniform(0, 6.28))
    return wave


def _waypoints(arm: Arm, rng: Generator, t: Floats) -> Floats:
    """From one random posture to the next, all joints at a time, with rests."""
    wave = np.zeros((len(t), arm.n))
    here, level = 0.0, np.zeros(arm.n)
    while here < t[-1]:
        to = rng.uniform(-0.45, 0.45, arm.n) * np.minimum(arm.reach, 1.5)
        lasts = max(0.4, float(np.max(1.875 * np.abs(to - level) / (_FASTEST * arm.speed))))
        wave += (to - level) * _ease((t - here) / lasts)[:, None]
        here, level = here + lasts + rng.uniform(0.1, 0.5), to
    return wave


def _crawl(arm: Arm, rng: Generator, t: Floats) -> Floats:
    """Waves so slow that a delay and damping are the same."""
    wave = np.zeros((len(t), arm.n))
    for j in range(arm.n):
        period = rng.uniform(3.5, 5.5)
        wave[:, j] = rng.uniform(0.4, 0.6) * np.sin(2 * np.pi * t / period + rng.uniform(0, 6.28))
    return wave


def _ease(x: ArrayLike) -> Floats:
    y = np.clip(np.asarray(x, dtype=np.float64), 0.0, 1.0)
    return np.asarray(y**3 * (10.0 - 15.0 * y + 6.0 * y**2))


KINDS: dict[str, Wave] = {
    "multisine": _multisine,
    "chirp": _chirp,
    "steps": _steps,
    "slow": _slow,
    "waypoints": _waypoints,
    "crawl": _crawl,
}
