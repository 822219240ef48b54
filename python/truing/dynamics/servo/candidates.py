# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Every effect that may be missing, at every joint, in the forms that its law may have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from truing.dynamics.servo.arm import ServoArm
from truing.dynamics.servo.chain import PARAMETERS
from truing.dynamics.servo.data import ServoData
from truing.dynamics.servo.fit import Column, Fitter, change_of
from truing.dynamics.servo.free import LINK, PAYLOAD, WEIGHT, Free, Sizes, free_value
from truing.dynamics.servo.simulator import Point

Floats = NDArray[np.float64]

_FROM_NEUTRAL = (
    "integral_gain",
    "damping_gain",
    "delay",
    "drive_law",
    "gain_law",
    "dead_band",
    "viscous_law",
    "back_emf",
    "load_friction",
    "asymmetric_friction",
    "thermal_friction",
    "warmup",
    "spring",
    "current_offset",
    "gravity_scale",
)
_STRIBECK = (0.05, 0.25)  # of the usual speed: the speed at which it has gone
_SATURATION = (0.5, 0.7, 0.85)  # of the largest torque
_RATE = (0.7, 0.9, 1.1)  # of the largest speed
_PRESLIDING = (0.1, 0.5)  # of the usual command error
_BACKLASH = (0.2, 0.8)  # the same
_ELASTICITY = (0.2, 0.8)  # the same, of twist under the usual torque
_HIGH = 0.995  # quantile: what is largest
_MOTION = 0.1  # of the prior's standard deviation: step of a difference quotient from the neutral value
_PAYLOAD_PRIOR, _MASS_PRIOR = 0.3, 0.3  # of the moved bodies' mass; of a body's


BUS = "delay of all"
"""Label of the delay that several joints have alike."""


@dataclass(frozen=True)
class Candidate:
    """One form of an effect at one joint, or of the whole arm."""

    effect: str
    joint: int  # -1: of the arm
    joints: tuple[str, ...]
    free: tuple[Free, ...]
    constants: Mapping[str, float] = field(default_factory=dict)  # of the joint: what the form sets beside
    begin: float | None = None  # in its unit, where the form was looked at; None: at the neutral value
    label: str = ""  # of the form: the same at all joints

    def on(self, point: Point) -> Point:
        """The point with the form's constants, and the value where it was looked at."""
        for name, value in self.constants.items():
            point = point.with_value(self.joint, name, value)
        if self.begin is not None:
            point = point.with_value(self.joint, self.free[0].field, self.begin)
        return point

    def off(self, point: Point) -> Point:
        """The point without the effect."""
        if self.joint < 0:
            for free in self.free:
                point = free.put(point, self.neutral)
            return point
        return point.with_value(self.joint, self.free[0].field, self.neutral)

    @property
    def neutral(self) -> float:
        """The value at which the effect is not there."""
        one = self.free[0].field
        if one in (WEIGHT, LINK, PAYLOAD):
            return 0.0 if one == PAYLOAD else 1.0
        return PARAMETERS[one].neutral

    @property
    def place(self) -> tuple[str, tuple[str, ...]]:
        return self.effect, self.joints


def candidates_of(
    arm: ServoArm,
    data: ServoData,
    point: Point,
    sizes: Sizes,
    torque: Floats,
    leave_out: Sequence[str],
) -> tuple[list[Candidate], list[tuple[str, tuple[str, ...], str]]]:
    """All forms, and what the recordings cannot test, with the reason. torque: shape=(n, joints) of the
    drives at the fit, whose largest a saturation is looked for below."""
    out: list[Candidate] = []
    not_testable: list[tuple[str, tuple[str, ...], str]] = []
    idle = _idle(data)
    for effect, why in idle.items():
        not_testable.append((PARAMETERS[effect].effect, (), why))
    for j, joint in enumerate(arm.nominal.joints):
        for name in _FROM_NEUTRAL:
            if name not in idle:
                constants = {"drive_reference": float(sizes.torque[j])} if name == "drive_law" else {}
                out.append(_candidate(name, j, joint, sizes, constants, None, name))
        out += _scanned(data, j, joint, sizes, np.abs(torque[:, j]))
    out += _of_supply(sizes, idle)
    out += _of_masses(arm, data)
    return [c for c in out if c.effect not in leave_out], not_testable


def _idle(data: ServoData) -> dict[str, str]:
    out = {}
    for needs, name, words in (
        ("gain", "gain_law", "the firmware's gain (kp1_raw …) was not recorded, or is the same everywhere"),
        ("supply", "supply_gain", "the supply (volt_V) was not recorded, or is the same everywhere"),
        (
            "warmth",
            "thermal_friction",
            "temperatures (temp1_C … or temp_C) were not recorded, or do not change",
        ),
        ("enabled", "back_emf", "no servo was switched off (enabled …) while it was recorded"),
    ):
        if needs not in data.varies:
            out[name] = words
    if data.torque_command:
        words = "commands are torques: there is no controller in the model"
        out |= {name: words for name in ("integral_gain", "damping_gain", "dead_band")}
    return out


def _candidate(
    name: str,
    j: int,
    joint: str,
    sizes: Sizes,
    constants: Mapping[str, float],
    begin: float | None,
    label: str,
) -> Candidate:
    return Candidate(
        PARAMETERS[name].effect, j, (joint,), (free_value(name, j, sizes),), constants, begin, label
    )


def _scanned(data: ServoData, j: int, joint: str, sizes: Sizes, torque: Floats) -> list[Candidate]:
    """Forms that no derivative at the neutral value shows."""
    out = []
    largest = float(np.quantile(torque, _HIGH))
    fastest = max(float(np.quantile(np.abs(s.speed[:, j]), _HIGH)) for s in data.streams)
    angle, turn = float(sizes.angle[j]), float(sizes.angle[j] / sizes.torque[j])
    for k, part in enumerate(_STRIBECK):
        constants = {"stribeck_speed": part * float(sizes.speed[j])}
        out.append(_candidate("stribeck", j, joint, sizes, constants, None, f"stribeck {k}"))
    wide: list[tuple[str, Sequence[float], float]] = [
        ("saturation", _SATURATION, largest),
        ("presliding", _PRESLIDING, angle),
    ]
    if not data.torque_command:
        wide.append(("rate_limit", _RATE, fastest))
    for name, parts, unit in wide:
        out += [
            _candidate(name, j, joint, sizes, {}, part * unit, f"{name} {k}") for k, part in enumerate(parts)
        ]
    for name, parts, unit in (("backlash", _BACKLASH, angle), ("elasticity", _ELASTICITY, turn)):
        for encoder in (0.0, 1.0):
            out += [
                _candidate(
                    name, j, joint, sizes, {"motor_encoder": encoder}, part * unit, f"{name} {k} {encoder:g}"
                )
                for k, part in enumerate(parts)
            ]
    return out


def _of_supply(sizes: Sizes, idle: Mapping[str, str]) -> list[Candidate]:
    """One supply feeds all drives: as its volts were recorded, and as all drives' torques pull it down."""
    out = []
    for name, usual in (("supply_gain", 1.0), ("supply_sag", 1.0 / float(np.sum(sizes.torque)))):
        if name not in idle:
            known = PARAMETERS[name]
            free = Free(name, -1, known.scale, known.spread * usual, known.low, known.high, known.unit)
            out.append(Candidate(known.effect, -1, (), (free,), label=name))
    return out


def _of_masses(arm: ServoArm, data: ServoData) -> list[Candidate]:
    """Weight of all, a payload at the last body, and each body's mass."""
    out = [
        Candidate(
            "gravity_scale",
            -1,
            (),
            (Free(WEIGHT, -1, "linear", 0.3, 0.0, 4.0, "1"),),
            label="gravity_scale of all",
        )
    ]
    heavy = 1.0  # [kg] priors are of the bodies' own masses, where these are known
    out.append(
        Candidate(
            "payload",
            -1,
            (),
            (Free(PAYLOAD, -1, "linear", _PAYLOAD_PRIOR * heavy, 0.0, 100.0, "kg"),),
            label="payload",
        )
    )
    for k, body in enumerate(arm.bodies):
        free = Free(LINK, -1, "linear", _MASS_PRIOR, 0.02, 10.0, "1", body)
        out.append(Candidate("link_inertia", -1, (body,), (free,), label=f"link_inertia {k}"))
    del data
    return out


def candidate_columns(
    fitter: Fitter, point: Point, base: Floats, candidates: Sequence[Candidate]
) -> list[Column]:
    """What each candidate does to the position, with the values of its free value counted from the neutral
    one; of a form that was looked at away from it: of all that it does there.

    One form at all joints is one simulation, as in `Fitter.columns`.
    """
    labels: dict[str, list[int]] = {}
    for k, one in enumerate(candidates):
        labels.setdefault(one.label, []).append(k)
    points, steps = [], {}
    for members in labels.values():
        changed = point
        for k in members:
            changed, steps[k] = _shown(candidates[k], changed)
        points.append(changed)
    motions = fitter.motions(points)
    out: list[Column] = [(-1, np.zeros(0))] * len(candidates)
    for members, motion in zip(labels.values(), motions, strict=True):
        for k in members:
            out[k] = candidates[k].joint, change_of(motion, base, steps[k], candidates[k].joint)
    return out


def _shown(one: Candidate, point: Point) -> tuple[Point, float]:
    """The point with the candidate a little on, and how much that is."""
    free = one.free[0]
    if one.begin is not None:
        return one.on(point), 1.0
    point = one.on(point)
    at = free.at(point)
    step = _MOTION * free.prior
    if at + step > free.high:
        step = -step
    return free.put(point, at + step), step
