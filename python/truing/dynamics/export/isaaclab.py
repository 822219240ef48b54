# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Actuator configurations of Isaac Lab, as a Python file. The robot itself goes there as a URDF (see
`urdf`)."""

from __future__ import annotations

import numpy as np

from truing import _core
from truing.dynamics.export.chain import Chain, Floats
from truing.dynamics.export.parts import JointParts, NotWritten, Parts, Reference, negative, rms, stand_ins

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
    implicit, motors = [], []
    extra, no_place = stand_ins(chain, parts, reference, "no place in Isaac Lab")
    left = [*parts.not_written, *no_place]
    for j, (link, own) in enumerate(zip(chain.driven, parts.joints, strict=True)):
        moving = own.coulomb + float(extra[j, 0]) + sum(size for size, _ in own.presliding)
        still = moving + sum(size for size, _ in own.stribeck)
        viscous = float(own.damping[0] + extra[j, 1])
        left += _at_rest_alone(link.name, own, reference.qd[:, j], still < moving)
        left += negative("viscous", link.name, viscous * rms(reference.qd[:, j]))
        left += negative("armature", link.name, own.armature * rms(reference.qdd[:, j]))
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


def _at_rest_alone(name: str, own: JointParts, qd: Floats, weak_start: bool) -> list[NotWritten]:
    """Stribeck friction is static friction in Isaac Lab, and falls at once."""
    why = "less friction at rest than in motion cannot be said" if weak_start else "written for rest alone"
    sizes = [abs(size) * rms(np.exp(-((qd / speed) ** 2))) for size, speed in own.stribeck]
    return [NotWritten(f"stribeck.{name}", size, why) for size in sizes]
