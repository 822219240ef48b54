# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Actuator configurations of Isaac Lab, as a Python file. The robot itself goes there as a URDF (see
`urdf`)."""

from __future__ import annotations

import numpy as np

from truing import _core
from truing.dynamics.export.chain import Chain
from truing.dynamics.export.parts import NotWritten, Parts, Reference, rms, stand_in

_HEAD = '''"""Actuators of {name} for Isaac Lab, written by truing.

Use: ArticulationCfg(actuators=ACTUATORS, ...) with the URDF beside this file, converted. Friction is in Nm
(Isaac Sim 5.0 or later; before that, `friction` was a coefficient without a unit). stiffness and damping
are the controller's, which no recording of torques shows: set them. Explicit actuators saturate by speed:
DC_MOTORS.
"""

from isaaclab.actuators import DCMotorCfg, ImplicitActuatorCfg

'''


def write(
    robot: _core.Robot, chain: Chain, parts: Parts, reference: Reference
) -> tuple[str, list[NotWritten]]:
    """The text of the Python file, and what Isaac Lab has no place for."""
    left = list(parts.not_written)
    implicit, motors = [], []
    extra = [(0.0, 0.0)] * len(chain.driven)
    for effect in parts.beside:
        j, name = effect[1], chain.driven[effect[1]].name
        if effect[0] == "coupling":
            name += f".{chain.driven[effect[2]].name}"
        instead = stand_in(effect, reference)
        extra[j] = (extra[j][0] + instead.coulomb, extra[j][1] + instead.viscous)
        reason = "no place in Isaac Lab" + ("; friction stands for it" if instead.coulomb else "")
        left.append(NotWritten(f"{effect[0]}.{name}", instead.left, reason))
    for (a, b), c in parts.coupled_inertia.items():
        name = f"coupling.{chain.driven[a].name}.{chain.driven[b].name}.inertia"
        left.append(NotWritten(name, abs(c) * rms(reference.qdd[:, b]), "no place in Isaac Lab"))
    if parts.tool_force.any():
        left.append(NotWritten("tool_force", float("nan"), "no place in Isaac Lab"))
    for j, (link, own) in enumerate(zip(chain.driven, parts.joints, strict=True)):
        moving = own.coulomb + extra[j][0] + sum(size for size, _ in own.presliding)
        still = moving + sum(size for size, _ in own.stribeck)
        viscous = float(own.damping[0]) + extra[j][1]
        left += _without_place(link.name, j, parts, reference, still < moving, viscous)
        r = link.ratio
        common = {
            "joint_names_expr": [link.name],
            "armature": max(own.armature, 0.0) / r**2,
            "friction": max(still, moving, 0.0) / abs(r),
            "dynamic_friction": max(moving, 0.0) / abs(r),
            "viscous_friction": max(viscous, 0.0) / r**2,
        }
        effort = link.torque_limit / abs(r) if np.isfinite(link.torque_limit) else None
        speed = link.speed_limit * abs(r) if np.isfinite(link.speed_limit) else None
        limits = {"effort_limit_sim": effort, "velocity_limit_sim": speed}
        implicit.append(_entry(link.name, "ImplicitActuatorCfg", {**common, **limits}))
        if effort is not None and speed is not None:
            limits = {"saturation_effort": effort, "effort_limit": effort, "velocity_limit": speed}
            motors.append(_entry(link.name, "DCMotorCfg", {**common, **limits}))
    text = _HEAD.format(name=(robot.name or "the robot").replace("\\", "").replace('"', ""))
    text += "ACTUATORS = {\n" + "".join(implicit) + "}\n"
    return text + "\nDC_MOTORS = {\n" + "".join(motors) + "}\n", left


def _entry(name: str, kind: str, values: dict[str, object]) -> str:
    lines = "".join(f"        {key}={value!r},\n" for key, value in values.items())
    return f"    {name!r}: {kind}(\n{lines}        stiffness=None,\n        damping=None,\n    ),\n"


def _without_place(
    name: str, j: int, parts: Parts, reference: Reference, weak_start: bool, viscous: float
) -> list[NotWritten]:
    own = parts.joints[j]
    q, qd = reference.q[:, j], reference.qd[:, j]
    reason = "no place in Isaac Lab"
    sizes = {
        f"viscous_law.{name}.quadratic": own.damping[1] * rms(qd * qd),
        f"viscous_law.{name}.cubic": own.damping[2] * rms(qd**3),
        f"current_offset.{name}": own.offset,
        f"spring.{name}": own.spring * rms(q),
    }
    for order, (s, c) in own.ripple.items():
        sizes[f"ripple.{name}.{order}"] = rms(s * np.sin(order * q) + c * np.cos(order * q))
    out = [NotWritten(key, float(abs(size)), reason) for key, size in sizes.items() if size]
    for size, speed in own.stribeck:
        left = size * rms(np.exp(-((qd / speed) ** 2)))
        why = (
            "less friction at rest than in motion cannot be said" if weak_start else "written for rest alone"
        )
        out.append(NotWritten(f"stribeck.{name}", abs(left), why))
    for size, _ in own.presliding:
        out.append(NotWritten(f"presliding.{name}", abs(size), "written as friction, without its build-up"))
    if viscous < 0.0:
        out.append(NotWritten(f"viscous.{name}", -viscous * rms(qd), "negative: none written"))
    if own.armature < 0.0:
        size = -own.armature * rms(reference.qdd[:, j])
        out.append(NotWritten(f"armature.{name}", size, "negative: none written"))
    return out
