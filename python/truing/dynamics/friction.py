# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Friction of a robot's joints in steady motion, from the effects on torque that it carries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from truing import _core

Floats = NDArray[np.float64]

POINTS = 121  # of a curve, from fastest backwards to fastest forwards; odd, so that zero is one
_LAWS = ("coulomb", "viscous", "viscous_law", "stribeck", "asymmetric_friction", "presliding")


def parameters_at(robot: _core.Robot, joint: str) -> dict[str, float]:
    """Parameters and constants of the effects on a joint's torque, as "viscous_law.quadratic"; those that
    several effects share a name in are added.
    """
    found: dict[str, float] = {}
    for applied in robot.torque_effects:
        for name, value in applied.parameters.items():
            effect, _, rest = name.partition(".")
            if rest == joint or rest.startswith(joint + "."):
                key = effect + rest.removeprefix(joint)
                found[key] = found.get(key, 0.0) + value
    return found


def friction_torque(parameters: Mapping[str, float], speed: Floats, load: float = 0.0) -> Floats:
    """Friction of steady motion at `speed` [rad/s | m/s] under a joint torque of `load` [Nm | N], with
    parameters of `parameters_at`: the laws of docs/reference/torque_effects.md, presliding past its
    elastic part.
    """
    direction, size = np.sign(speed), np.abs(speed)
    value = parameters.get
    out = (value("coulomb", 0.0) + value("presliding", 0.0)) * direction
    out = out + value("viscous", 0.0) * speed + value("asymmetric_friction", 0.0) * size
    out = out + value("viscous_law.quadratic", 0.0) * speed * size
    out = out + value("viscous_law.cubic", 0.0) * speed**3
    out = out + value("viscous_law.root", 0.0) * direction * np.sqrt(size)
    if "viscous_law.v0" in parameters:
        out = out + value("viscous_law.saturating", 0.0) * np.tanh(speed / parameters["viscous_law.v0"])
    if "stribeck.vs" in parameters:
        out = out + value("stribeck", 0.0) * direction * np.exp(-((speed / parameters["stribeck.vs"]) ** 2))
    grows = value("load_friction", 0.0) + value("load_friction.links", 0.0)
    return np.asarray(out + grows * direction * abs(load))


def friction_dict(robot: _core.Robot, where: Sequence[_core.TorqueRegime]) -> list[dict[str, Any]]:
    """Friction over speed of every joint that has any, over the speeds that were seen; where friction grows
    with the load, at no load and at a large one that was seen.

    where: of a diagnosis; without it the speeds are those that the robot was fitted in.
    """
    out = []
    for index in robot.driven_joints():
        joint = robot.joints[index]
        parameters = parameters_at(robot, joint.name)
        if not any(key.split(".")[0] in (*_LAWS, "load_friction") for key in parameters):
            continue
        fastest = _reached(where, joint.name, "speed") or 1.0
        grows = any(key.split(".")[0] == "load_friction" for key in parameters)
        load = _reached(where, joint.name, "load") if grows else 0.0
        speed = np.linspace(-fastest, fastest, POINTS)
        speed[POINTS // 2] = np.nan  # friction jumps at rest: the line is broken there
        out.append(
            {
                "joint": joint.name,
                "unit": "Nm" if joint.type == "revolute" else "N",
                "speed_unit": "rad/s" if joint.type == "revolute" else "m/s",
                "speed": speed,
                "curves": [
                    {"load": at, "friction": friction_torque(parameters, speed, at)}
                    for at in sorted({0.0, load})
                ],
            }
        )
    return out


def _reached(where: Sequence[_core.TorqueRegime], joint: str, name: str) -> float:
    """The upper end of the highest part of an input that was seen with enough rows; 0: it was not."""
    bins = [w for w in where if w.joint == joint and w.input == name]
    enough = 0.01 * sum(w.n for w in bins)
    return max((w.high for w in bins if w.n >= enough), default=0.0)
