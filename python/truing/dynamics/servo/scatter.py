# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Servos drawn all over what servos may be, and looked at side by side: where a file's values are far off, no
step from them leads to the right ones.

What a joint carries is known by its masses: a servo is drawn as the frequency and the damping at which it
moves that, its rotor over it, and the command error that its dry friction holds. Numbers are evenly spread
(additive recurrence: Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences").
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.arm import LEAST_ARMATURE, LEAST_FRICTION
from truing.dynamics.servo.fit import Fitter
from truing.dynamics.servo.simulator import FIELDS, Point

Floats = NDArray[np.float64]

_DRAWN = 512
_AT_ONCE = 64
_FREQUENCY = (3.0, 300.0)  # [rad/s] undamped
_DAMPING = (0.1, 30.0)  # of the critical
_ROTOR = (0.01, 30.0)  # over the lesser, and the larger, of what the joint carries and the file's rotor
_VALUES = ("command_gain", "viscous", "coulomb", "armature")
_KEPT, _AROUND = 8, 256
_WIDTHS = (1.0, 0.5, 0.25, 0.12)  # of logarithms
_HELD = (3e-4, 0.1)  # [rad | m] of command error, by dry friction


def spread(count: int, dimensions: int) -> Floats:
    """Even numbers from 0 to 1. shape=(count, dimensions)"""
    root = 2.0
    for _ in range(60):  # of x^(d + 1) = x + 1
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    steps = root ** -np.arange(1.0, dimensions + 1)
    return np.asarray((0.5 + np.outer(np.arange(1.0, count + 1), steps)) % 1.0)


def scattered(nominal: Point, carried: Floats, count: int = _DRAWN) -> list[Point]:
    """Servos at all joints. carried: shape=(joints,) [kg m^2 | kg] without rotors"""
    draws = spread(count, 4)

    def between(column: int, low: Floats | float, high: Floats | float) -> Floats:
        """Shape=(count, joints), even in the logarithm."""
        low, high = np.log(low) + 0.0 * carried, np.log(high) + 0.0 * carried
        return np.asarray(np.exp(low + draws[:, column : column + 1] * (high - low)))

    file = nominal.chain[:, FIELDS.index("armature")]
    least, most = np.minimum(carried, file), np.maximum(carried, file)
    rotor = between(0, np.maximum(_ROTOR[0] * least, LEAST_ARMATURE), _ROTOR[1] * most)
    inertia, frequency = carried + rotor, between(1, *_FREQUENCY)
    gain = inertia * frequency**2
    values = {
        "armature": rotor,
        "command_gain": gain,
        "viscous": np.maximum(2.0 * between(2, *_DAMPING) * inertia * frequency, LEAST_FRICTION),
        "coulomb": np.maximum(gain * between(3, *_HELD), LEAST_FRICTION),
    }
    chains = np.repeat(nominal.chain[None], count, axis=0)
    for name, value in values.items():
        chains[:, :, FIELDS.index(name)] = value
    return [replace(nominal, chain=chain) for chain in chains]


def narrowed(fitter: Fitter, points: list[Point]) -> Point:
    """The best servo of each joint after draws around the best ones, nearer from round to round."""
    best = best_of(fitter, points, _KEPT)
    draws = 2.0 * spread(_AROUND, len(_VALUES)) - 1.0
    columns = [FIELDS.index(name) for name in _VALUES]
    for width in _WIDTHS:
        around = []
        for number, draw in enumerate(draws):
            chain = best[number % _KEPT].chain.copy()
            chain[:, columns] *= np.exp(width * draw)
            around.append(replace(best[0], chain=chain))
        best = best_of(fitter, [*best, *around], _KEPT)
    return best[0]


def best_of(fitter: Fitter, points: list[Point], kept: int) -> list[Point]:
    """Joint by joint the best, the second and so on: joints hardly see each other."""
    squares = np.concatenate(
        [
            [
                np.mean(fitter.errors(motion) ** 2, axis=0)
                for motion in fitter.motions(points[k : k + _AT_ONCE])
            ]
            for k in range(0, len(points), _AT_ONCE)
        ]
    )
    order = np.argsort(squares, axis=0)[:kept]
    chains = np.array([point.chain for point in points])
    joints = np.arange(squares.shape[1])
    return [replace(points[0], chain=chains[places, joints]) for places in order]
