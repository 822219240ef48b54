# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Values of a chain that are fitted: each on its scale, with its prior and its bounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.chain import PARAMETERS, ServoChain
from truing.dynamics.servo.simulator import Point

Floats = NDArray[np.float64]

USUAL = tuple(name for name, known in PARAMETERS.items() if known.usual)
WEIGHT, PAYLOAD, LINK = "weight_scale", "payload_mass", "link_scale"
_STEP = 0.03  # of the prior's standard deviation: a difference quotient's step
_MOST_LOG = 300.0  # what a logarithm may be
_LEAST_LOG = 1e-9  # below it a logarithm ends


@dataclass(frozen=True)
class Sizes:
    """What is usual at each joint, in units of which priors are given. shape=(joints,) each."""

    torque: Floats  # [Nm] rms of the drive's
    speed: Floats  # [rad/s] rms where it moves
    angle: Floats  # [rad] rms of the command error
    inertia: Floats  # [kg m^2]

    def of(self, dimension: str, joint: int) -> float:
        t, v = float(self.torque[joint]), float(self.speed[joint])
        a, i = float(self.angle[joint]), float(self.inertia[joint])
        return {
            "one": 1.0,
            "second": 1.0,
            "1/K": 1.0,
            "1/s": 1.0,
            "torque": t,
            "speed": v,
            "angle": a,
            "inertia": i,
            "torque/angle": t / a,
            "torque/(angle s)": t / a,
            "torque/speed": t / v,
            "torque/speed^2": t / v**2,
            "1/torque": 1.0 / t,
            "angle/torque": a / t,
        }[dimension]


@dataclass(frozen=True)
class Free:
    """A value that is fitted. `joint` -1: of the whole chain, or the same at all joints; `body`: whose mass
    it is."""

    field: str
    joint: int
    scale: str  # 'log' or 'linear'
    prior: float  # standard deviation on the scale
    low: float  # on the scale
    high: float
    unit: str
    body: str = ""

    @property
    def step(self) -> float:
        return _STEP * self.prior

    def value(self, point: Point) -> float:
        """In its unit."""
        if self.field == WEIGHT:
            return point.weight
        if self.field == PAYLOAD:
            return point.payload
        if self.field == LINK:
            return dict(point.links).get(self.body, 1.0)
        return point.value(max(self.joint, 0), self.field)

    def at(self, point: Point) -> float:
        """On its scale."""
        value = self.value(point)
        return math.log(max(value, _LEAST_LOG)) if self.scale == "log" else value

    def put(self, point: Point, at: float) -> Point:
        """The point with this value on its scale, within the bounds."""
        at = min(max(at, self.low), self.high)
        value = math.exp(min(at, _MOST_LOG)) if self.scale == "log" else at
        if self.field == WEIGHT:
            return replace(point, weight=value)
        if self.field == PAYLOAD:
            return replace(point, payload=value)
        if self.field == LINK:
            links = tuple(sorted({**dict(point.links), self.body: value}.items()))
            return replace(point, links=links)
        return point.with_value(slice(None) if self.joint < 0 else self.joint, self.field, value)

    def name(self, joints: Sequence[str]) -> str:
        if self.joint >= 0:
            return f"{self.field}.{joints[self.joint]}"
        return f"{self.field}.{self.body}" if self.body else self.field


def free_value(name: str, joint: int, sizes: Sizes) -> Free:
    """A value of a joint, as `PARAMETERS` knows it."""
    known = PARAMETERS[name]
    log = known.scale == "log"
    spread = known.spread if log else known.spread * sizes.of(known.dimension, joint)
    low = math.log(max(known.low, _LEAST_LOG)) if log else known.low
    high = math.log(known.high) if log and math.isfinite(known.high) else known.high
    return Free(name, joint, known.scale, spread, low, high, known.unit)


def usual_values(nominal: ServoChain, sizes: Sizes, torque_command: bool) -> list[Free]:
    """What standard practice fits at every joint: gain, damping, dry friction, rotor, zero."""
    names = [n for n in USUAL if not (torque_command and n == "zero")]
    return [free_value(name, j, sizes) for j in range(len(nominal.joints)) for name in names]


def moved(point: Point, free: Sequence[Free], by: Floats) -> Point:
    """The point with every value changed by so much on its scale."""
    for one, change in zip(free, by, strict=True):
        point = one.put(point, one.at(point) + float(change))
    return point
