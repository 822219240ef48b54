# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""A base that does not stand as the file has it: weight that pulls another way."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.apart import Apart
from truing.dynamics.servo.fit import Column, Fitted, change_of
from truing.dynamics.servo.free import Sizes
from truing.dynamics.servo.naming import THRESHOLD, Namer

Floats = NDArray[np.float64]

_STEP = 1.0  # [m/s^2] of a difference quotient
_PRIOR = 9.81  # [m/s^2] of each component
_LEAST_TILT = math.radians(3.0)  # below it a base stands as the file has it
_LEAST_GAIN = 0.3  # of the joints' squared errors, geometric mean
_LEAST_SHARE = 0.1  # of the squared errors, by the columns: less is not worth another fit
_TURNS = 6  # fits in gravity of another direction
_SETTLED = math.radians(1.0)
Grounded = tuple[Namer, Fitted, Sizes]


@dataclass(frozen=True)
class Mounting:
    """How the arm stands instead."""

    gravity: Floats  # [m/s^2] in the file's frame
    of_file: Floats
    tilt: float  # [rad]

    def sentence(self) -> str:
        now, then = ("(" + ", ".join(f"{v:.2f}" for v in g) + ")" for g in (self.gravity, self.of_file))
        return (
            f"the base is turned by {math.degrees(self.tilt):.0f}° against the file: weight pulls along {now}"
            f" m/s², the file's gravity is {then}. All that is said holds for an arm that stands so"
        )


def mounting(
    apart: Apart, ground: Callable[[Apart], Grounded], begun: Grounded
) -> tuple[Mounting | None, Grounded]:
    """How the arm stands, if motion says that it is otherwise than the file has it, and what a search begins
    from then. ground: the usual parameters fitted. begun: to the arm as the file has it.

    The change of the motion with each component of gravity is a column as that of any effect. The arm is
    turned by what they say and its usual parameters are fitted again, as long as it moves better; in all by
    enough. Of a single joint its zero and its weight do the same.
    """
    of_file = np.array(apart.model.opt.gravity)
    if begun[0].joints < 2 or not of_file.any():
        return None, begun
    gravity, best = of_file, begun
    for _ in range(_TURNS):
        new = _direction(apart, gravity, best, _LEAST_SHARE if best is begun else 0.0)
        if new is None or _angle(new, gravity) < _SETTLED:
            break
        other = ground(apart.in_gravity(new))
        if not _squares(other[1]) < _squares(best[1]):
            break
        gravity, best = new, other
    tilt = _angle(gravity, of_file)
    if tilt < _LEAST_TILT or _squares(best[1]) > _squares(begun[1]) + math.log(1.0 - _LEAST_GAIN):
        return None, begun
    return Mounting(gravity, of_file, tilt), best


def _direction(apart: Apart, gravity: Floats, grounded: Grounded, least: float) -> Floats | None:
    """Gravity as the columns of its components have it, as large as the file's. None: they explain less
    than a part `least` of the squared errors."""
    namer, fitted, _ = grounded
    base = namer.fitter.motions([fitted.point])[0]
    columns: list[Column] = []
    for k in range(3):
        other = apart.in_gravity(gravity + _STEP * np.eye(3)[k])
        motion = other.run([fitted.point], namer.fitter.rows.windows)[0][0]
        columns.append((-1, change_of(motion, base, _STEP, -1)))
    sums = namer.sums(fitted, columns)
    group = [sums.always + k for k in range(3)]
    prior = np.array([*(f.prior for f in fitted.free), *([_PRIOR] * 3)])
    (tilt,) = namer.ranked(sums, [group], [0.0], prior)[1]
    if tilt.score < THRESHOLD or tilt.share < least:
        return None
    new = gravity + tilt.values
    return np.asarray(new * np.linalg.norm(gravity) / max(float(np.linalg.norm(new)), 1e-9))


def _squares(fitted: Fitted) -> float:
    """Logarithm of the joints' mean squared errors, their mean."""
    return float(np.mean(np.log(np.maximum(np.mean(fitted.errors**2, axis=0), 1e-14))))


def _angle(one: Floats, other: Floats) -> float:
    cosine = float(one @ other) / float(np.linalg.norm(one) * np.linalg.norm(other))
    return math.acos(min(max(cosine, -1.0), 1.0))
