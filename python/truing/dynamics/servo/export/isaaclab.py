# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Actuators of a servo arm for Isaac Lab, as a Python file: delayed PD, DC motors where torque saturates."""

from __future__ import annotations

import math
from collections.abc import Mapping

from truing.dynamics.export.parts import NotWritten
from truing.dynamics.servo.chain import ServoChain
from truing.dynamics.servo.export.held import Held, HeldJoint, Use

STEP = 0.005  # [s] of physics, Isaac Lab's usual one
_NO_PLACE = "no place in Isaac Lab's actuators"

_HEAD = '''"""Actuators of {name} for Isaac Lab, written by truing from commands and motion.

Use: ArticulationCfg(actuators=ACTUATORS, ...). Delays are in steps of PHYSICS_DT: if yours is another, take
delayed_pd(dt). DC_MOTORS are the joints whose torque saturates, without the delay: they lose torque with
speed, up to the speed at which the damping takes all of it. Friction is in Nm (Isaac Sim 5.0 or later). What
Isaac Lab has no place for is in not_written.yaml.
"""

from isaaclab.actuators import DCMotorCfg, DelayedPDActuatorCfg

PHYSICS_DT = {step!r}  # [s]
DELAYS = {delays!r}  # [s]
ZEROS = {zeros!r}  # [rad | m] readings of the recorded robot less those of the model
VALUES = {values!r}


def delayed_pd(dt=PHYSICS_DT):
    """Delayed PD actuators for physics steps of dt [s]."""
    steps = {{joint: round(delay / dt) for joint, delay in DELAYS.items()}}
    return {{
        joint: DelayedPDActuatorCfg(
            joint_names_expr=[joint], min_delay=steps[joint], max_delay=steps[joint], **values
        )
        for joint, values in VALUES.items()
    }}


ACTUATORS = delayed_pd()

DC_MOTORS = {{
{motors}}}
'''


def write(chain: ServoChain, held: Held, uses: Mapping[str, Use]) -> tuple[str, list[NotWritten]]:
    """The text of the Python file, and what Isaac Lab has no place for."""
    left = list(held.not_written)
    values: dict[str, dict[str, float | None]] = {}
    motors = []
    for joint, one in held.joints.items():
        left += _without_place(joint, one, uses[joint])
        values[joint] = {
            "stiffness": one.gain,
            "damping": one.damping_gain,
            "effort_limit": one.force_limit,
            "armature": one.armature,
            "friction": one.friction + max(one.more_at_rest, 0.0),
            "dynamic_friction": one.friction,
            "viscous_friction": one.damping[0],
        }
        if one.force_limit is not None and one.damping[0] > 0.0:
            motors.append(_motor(joint, one))
    left += _weights(chain)
    return _HEAD.format(
        name=_plain(", ".join(chain.joints)),
        step=STEP,
        delays={joint: one.delay for joint, one in held.joints.items()},
        zeros={joint: one.zero for joint, one in held.joints.items()},
        values=values,
        motors="".join(motors),
    ), left


def _motor(joint: str, one: HeldJoint) -> str:
    """Torque falls with speed as the damping has it, to none at limit / damping: what brakes is in that."""
    limit = one.force_limit or 0.0
    fields = {
        "joint_names_expr": [joint],
        "stiffness": one.gain,
        "damping": one.damping_gain + one.damping[0],
        "saturation_effort": limit,
        "effort_limit": limit,
        "velocity_limit": limit / one.damping[0],
        "armature": one.armature,
        "friction": one.friction + max(one.more_at_rest, 0.0),
        "dynamic_friction": one.friction,
        "viscous_friction": 0.0,
    }
    lines = "".join(f"        {key}={value!r},\n" for key, value in fields.items())
    return f"    {joint!r}: DCMotorCfg(\n{lines}    ),\n"


def _without_place(joint: str, one: HeldJoint, use: Use) -> list[NotWritten]:
    slow = use.speed[abs(use.speed) > 0.0] if use.known else use.speed
    sizes = {
        "integral_gain": (one.integral_gain, math.nan),
        "rate_limit": (one.rate_limit or 0.0, math.nan),
        "viscous_law": (
            one.damping[1],
            float((abs(one.damping[1]) * slow**2).mean()) if slow.size else math.nan,
        ),
        "presliding": (one.presliding, one.friction),
        "spring": (one.spring, math.nan),
        "current_offset": (one.offset, abs(one.offset)),
        "backlash": (one.play, math.nan),
        "joint_elasticity": (one.twist, math.nan),
    }
    out = [NotWritten(f"{name}.{joint}", size, _NO_PLACE) for name, (value, size) in sizes.items() if value]
    if one.delay:
        rest = abs(one.delay - STEP * round(one.delay / STEP))
        size = one.gain * rest * float((use.command_speed**2).mean() ** 0.5) if use.known else math.nan
        if rest > 0.0:
            out.append(NotWritten(f"delay.{joint}", size, f"to whole steps of {STEP:g} s"))
    if one.more_at_rest < 0.0:
        out.append(NotWritten(f"stribeck.{joint}", -one.more_at_rest, "less friction at rest: none written"))
    return out


def _weights(chain: ServoChain) -> list[NotWritten]:
    """What belongs to the bodies: into the asset, not into the actuators."""
    reason = "belongs to the bodies: convert the MJCF of `--to mjcf`, or set the masses of the asset"
    out = [
        NotWritten(f"gravity_scale.{joint}", math.nan, reason)
        for joint, drive in zip(chain.joints, chain.drives, strict=True)
        if drive.gravity_scale != 1.0
    ]
    if chain.weight_scale != 1.0:
        out.append(NotWritten("gravity_scale", math.nan, reason))
    if chain.payload_mass:
        out.append(NotWritten("payload", math.nan, reason))
    if chain.gravity is not None:
        out.append(NotWritten("gravity", math.nan, "belongs to the scene: turn the base, or set its gravity"))
    return out + [NotWritten(f"link_scale.{body}", math.nan, reason) for body in chain.link_scale]


def _plain(text: str) -> str:
    return text.replace("\\", "").replace('"', "")
